//! The component that gives a volume a depth.

use bevy::prelude::*;

/// Writes the depth of a volume into the depth of the main pass, as an opaque mesh does. Insert it on the entity of a
/// [`Volume3d`](crate::volume::Volume3d). Without it a volume has no depth.
///
/// What is drawn later, or reads that depth behind the main pass, then knows the volume: depth of field, volumetric fog, and
/// translucent meshes. Those in the volume's box are drawn after it, and hidden pixel by pixel where they are
/// behind it. Without a depth they divide the volume by the planes of their centres, which suits translucent matter. The depth costs another way along each view ray, up to the point that
/// it is taken from.
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct VolumeDepth {
    /// Opacity up to the point whose depth a pixel gets, 0 to 1. A pixel that is less opaque gets none. A higher one lies
    /// deeper in soft matter, costs a longer way, and leaves more pixels without a depth. A lower one hides more of what is
    /// seen through translucent matter.
    pub opacity: f32,
}

impl Default for VolumeDepth {
    fn default() -> Self {
        // That of hits of pointers, and of motion vectors.
        Self { opacity: 0.5 }
    }
}

/// Opacities of a depth: any matter at all, and what drawing takes for opaque.
const LEAST_OPACITY: f32 = 0.004;
const MOST_OPACITY: f32 = 0.99;

impl VolumeDepth {
    /// The opacity within its valid range.
    pub(crate) fn stopping_opacity(self) -> f32 {
        if self.opacity.is_nan() {
            Self::default().opacity
        } else {
            self.opacity.clamp(LEAST_OPACITY, MOST_OPACITY)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_number_is_an_opacity_that_matter_can_have() {
        let opacities = [f32::NAN, f32::NEG_INFINITY, 0.0, 0.5, 1.0, f32::INFINITY];
        let stopping = opacities.map(|opacity| VolumeDepth { opacity }.stopping_opacity());
        assert_eq!(stopping, [0.5, 0.004, 0.004, 0.5, 0.99, 0.99]);
    }
}
