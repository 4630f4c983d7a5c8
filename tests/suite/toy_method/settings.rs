//! The settings of openness.

use bevy_contextual_ao::occlusion::MethodSettings;

/// A point is as open as its six neighbours at a distance are transparent, on average.
#[derive(Clone, Debug, PartialEq)]
pub struct Openness {
    /// Distance of the neighbours, voxels. Larger ones see larger hollows.
    pub distance_voxels: u32,
}

impl Openness {
    /// The passes over all volumes, in the diagnostics.
    pub const SPAN: &str = "toy/openness";
}

impl MethodSettings for Openness {
    fn name(&self) -> &'static str {
        "openness"
    }
}
