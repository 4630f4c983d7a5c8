//! The component that lets a volume be drawn with fewer samples while something moves.

use bevy::{
    ecs::{lifecycle::HookContext, world::DeferredWorld},
    prelude::*,
};

use super::{Quality, motion_sampling::MotionSampling};

/// Draws a volume with fewer samples along view rays while something moves, as the frame time demands. Insert it on
/// the entity of a [`Volume3d`](crate::volume::Volume3d). Without it, every frame is drawn in full.
///
/// Motion is a change of place between the volume and a camera of its render layers, or a carver that acts on it. A
/// camera's projection and a carver's vertices count as well. Values that are written again unchanged do not, nor does
/// a rig that moves as a whole. The present samples are those of [`VolumeShading`](super::VolumeShading), which is
/// never written: while something moves, the samples lie farther apart, at most as far as those of `lowest`. So a still
/// picture is always the full one, bit for bit. Removing the component restores it at once.
///
/// Rays are the same in motion. Other rays would make all occlusion stale, and casting it anew costs more than any
/// frame saves. So this helps where drawing takes the time: at high resolutions, with two eyes, in translucent data.
/// Whenever the distance of samples changes, all view rays of the volume are followed again. It therefore changes in
/// few and large steps.
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(MotionSampling)]
#[component(on_remove = remove_sampling)]
pub struct MotionQuality {
    /// The floor: view samples never lie farther apart than those of this preset. A lower one makes faster frames
    /// possible, and shows slices in motion. One that is no lower than the volume's own setting has no effect.
    pub lowest: Quality,
    /// Longest frame time, milliseconds, by [`Time<Real>`]. A higher one keeps more samples in motion, a lower one drops
    /// them sooner. Where frames wait for a display, it needs to be a third longer than the display's interval: waiting
    /// hides how much faster a frame could be.
    pub target_frame_ms: f32,
    /// Seconds without motion after which the picture is full again. A longer time bridges pauses of a hand, a shorter
    /// one shows the full picture sooner. At 0 the first frame without motion is full.
    pub settle_s: f32,
}

impl Default for MotionQuality {
    fn default() -> Self {
        // 60 frames a second, and a third more.
        Self { lowest: Quality::Low, target_frame_ms: 22.0, settle_s: 0.2 }
    }
}

/// Removes what the plugin keeps for the component.
fn remove_sampling(mut world: DeferredWorld, removed: HookContext) {
    world.commands().entity(removed.entity).try_remove::<MotionSampling>();
}
