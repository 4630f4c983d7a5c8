//! Bounds of the rays that the GPU casts at a time.

use bevy::prelude::*;

/// Bounds of the rays that the GPU casts at a time, for each volume. Rays are cast for words: blocks of 4x4x2 voxels,
/// of which some or all are stale and seen.
#[derive(Resource, Reflect, Clone, Copy, Debug, PartialEq, Eq)]
#[reflect(Resource, Default, Debug, Clone, PartialEq)]
pub struct CastBudget {
    /// Most words of one dispatch. Where everything is stale, each dispatch is a submission of its own, so that no
    /// driver takes the device for hung. Fewer words are safer on slow devices, and take a little more time.
    pub words_per_dispatch: u32,
    /// Most words of one frame; `None` casts all words in the frame that needs them. The others wait for later frames,
    /// the oldest first. Until then, voxels keep the factor that they had, and new ones are drawn as if unoccluded.
    /// [`OcclusionReady`](crate::volume::OcclusionReady) says when none waits. Fewer words keep frames short, and take
    /// more frames. Progressive rays, and occlusion that is recomputed in every frame, have no such bound.
    /// [`CastPacing`](super::CastPacing) finds the number by the frame time.
    pub words_per_frame: Option<u32>,
}

impl Default for CastBudget {
    fn default() -> Self {
        Self { words_per_dispatch: 65_536, words_per_frame: None }
    }
}
