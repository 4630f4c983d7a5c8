//! The settings of openness.

use bevy_contextual_ao::occlusion::MethodSettings;

/// Settings of openness, the mean transparency of a point's six neighbours at a distance.
#[derive(Clone, Debug, PartialEq)]
pub struct Openness {
    /// Distance of the neighbours, voxels. Larger ones see larger hollows.
    pub distance_voxels: u32,
}

impl Openness {
    /// Span of the passes over all volumes, in the diagnostics.
    pub const SPAN: &str = "toy/openness";
}

impl MethodSettings for Openness {
    fn name(&self) -> &'static str {
        "openness"
    }
}
