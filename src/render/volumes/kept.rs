//! What a volume's occlusion method keeps for it, as all that is not the method sees it.

use bevy::{prelude::*, render::render_resource::TextureView};
use core::any::Any;

use crate::diagnostics::GpuUsage;

/// What an occlusion method keeps on the GPU for one volume. It goes with the volume, and with the method.
pub trait MethodResources: Any + Send + Sync {
    /// What it takes.
    fn usage(&self) -> GpuUsage;

    /// By what surfaces are oriented when views draw them, in place of the clipped opacities: a distance field's
    /// gradient and the distance (`orientation.wgsl`). The material binds the view as long as
    /// [`MethodSettings::drawing`](crate::occlusion::MethodSettings::drawing) is the same: so long it must stay.
    fn orientations(&self) -> Option<&TextureView> {
        None
    }

    /// Between which intensities, as the texture gives them, a surface lies that is drawn alone, if one is.
    fn drawn_intensities(&self) -> Option<Vec2> {
        None
    }
}

impl dyn MethodResources {
    /// What is kept, if it is of this type.
    pub fn get<T: MethodResources>(&self) -> Option<&T> {
        (self as &dyn Any).downcast_ref()
    }

    /// The same, to be changed.
    pub fn get_mut<T: MethodResources>(&mut self) -> Option<&mut T> {
        (self as &mut dyn Any).downcast_mut()
    }

    /// The same, taken over.
    pub fn take<T: MethodResources>(self: Box<Self>) -> Option<Box<T>> {
        (self as Box<dyn Any>).downcast().ok()
    }
}
