//! Resources that an occlusion method keeps for a volume, as code outside the method sees them.

use bevy::{
    prelude::*,
    render::render_resource::{Buffer, TextureView},
};
use core::any::Any;

use crate::diagnostics::GpuUsage;

/// A cast, as its method tells it.
#[derive(Clone, Copy, Debug)]
pub struct LatestCast<'a> {
    /// Number of casts so far.
    pub number: u64,
    /// Begins with four words: the second and the third are the places of the first and the end word in the list
    /// (`cast_state.wgsl`).
    pub state: &'a Buffer,
}

/// GPU resources that an occlusion method keeps for one volume. They are freed with the volume, and with the method.
pub trait MethodResources: Any + Send + Sync {
    /// GPU usage of the resources.
    fn usage(&self) -> GpuUsage;

    /// Whether no occlusion waits for later frames. Otherwise the volume is not ready yet.
    fn is_complete(&self) -> bool {
        true
    }

    /// The latest cast over words that clipping or marking listed, if the method casts rays.
    fn latest_cast(&self) -> Option<LatestCast<'_>> {
        None
    }

    /// Texture that orients surfaces when views draw them, in place of the clipped opacities. It holds a distance
    /// field's gradient and the distance (`orientation.wgsl`).
    fn orientations(&self) -> Option<&TextureView> {
        None
    }

    /// Lower and upper bound of drawn intensities, as the texture gives them, if only a surface is drawn.
    fn drawn_intensities(&self) -> Option<Vec2> {
        None
    }
}

impl dyn MethodResources {
    /// The resources, if they are of this type.
    pub fn get<T: MethodResources>(&self) -> Option<&T> {
        (self as &dyn Any).downcast_ref()
    }

    /// The same, mutably.
    pub fn get_mut<T: MethodResources>(&mut self) -> Option<&mut T> {
        (self as &mut dyn Any).downcast_mut()
    }

    /// The same, by value.
    pub fn take<T: MethodResources>(self: Box<Self>) -> Option<Box<T>> {
        (self as Box<dyn Any>).downcast().ok()
    }
}
