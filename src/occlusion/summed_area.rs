//! The settings of occlusion by summed-area tables (Díaz et al.: Real-time ambient occlusion and halos with Summed Area
//! Tables, 2010; Schlegel, Makhinya, Pajarola: Extinction-based Shading and Illumination in GPU Volume Ray-Casting,
//! 2011).

use bevy::prelude::*;
use core::f64::consts::LN_2;

use super::{
    MethodBytes, MethodSettings, Sky,
    lengths::{length_mm, whole_voxels},
};
use crate::volume::VolumeGeometry;

/// Occlusion by mean opacities of boxes around a voxel.
///
/// A summed-area table gives the sum over any box by eight look-ups. Every change of opacities sums the whole volume
/// anew. Changes of these settings keep the table. It takes 4 bytes a voxel. A volume whose table is larger than the
/// device binds is drawn without occlusion.
///
/// The formulas are those by which Titov et al. describe both methods (section 2). One shell is the method of Díaz et
/// al.: the factor is 1 - m, where m is the unweighted mean opacity of the box. More shells are the method of Schlegel
/// et al.: shells of the box at different distances absorb light one after the other. A part s of a shell lets
/// (1 - m)^s through, in occlusion steps. The factor is the mean over the way to the outermost shell.
///
/// The description leaves the following open. Boxes contain the voxel itself. All shells are equally thick. Voxels
/// beyond the grid are empty. All of the way gives light evenly, as along a ray of local ambient occlusion. Means are of
/// opacities; Schlegel et al. themselves sum extinction coefficients.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub struct SummedAreaOcclusion {
    /// Half the width of the box, mm. `None` is 10 voxels. A larger radius finds larger hollows, at the same price. It is
    /// rounded to whole voxels along each axis, at least 1, at most [`Self::MAX_VOXELS`].
    pub radius_mm: Option<f32>,
    /// Number of shells of the box, 1 to [`Self::MAX_SHELLS`]. More tell distances better, and cost eight look-ups each.
    /// Shells thinner than a voxel count as one.
    pub shells: u32,
}

impl SummedAreaOcclusion {
    /// Largest radius, voxels. The sum over a box has 32 bits.
    pub const MAX_VOXELS: u32 = 127;
    /// Largest number of shells.
    pub const MAX_SHELLS: u32 = Self::MAX_VOXELS;
    /// Diagnostics span of the passes that sum opacities, over all volumes.
    pub const SPAN_TABLE: &str = "contextual_ao/summed_area_table";
    /// Diagnostics span of the pass that evaluates boxes, over all volumes.
    pub const SPAN_BOXES: &str = "contextual_ao/summed_area_boxes";

    /// Limits these settings to their valid ranges.
    pub(super) fn clamped(self) -> Self {
        Self {
            // 0 in place of NaN.
            radius_mm: self.radius_mm.map(|mm| mm.max(0.0)),
            shells: self.shells.clamp(1, Self::MAX_SHELLS),
        }
    }

    /// The radius, mm: the one set, or 10 voxels. It is at least the smallest voxel spacing.
    pub fn radius_length_mm(&self, geometry: &VolumeGeometry) -> f64 {
        let spacing_mm = geometry.spacing_mm;
        let most_mm = f64::from(Self::MAX_VOXELS) * spacing_mm.max_element();
        length_mm(self.radius_mm, 10.0, geometry).clamp(spacing_mm.min_element(), most_mm)
    }

    /// Outer radii of all shells along each axis, whole voxels, from the inside out. Each has the shell's thickness,
    /// occlusion steps; a single shell has 0.
    pub(crate) fn shell_radii(&self, geometry: &VolumeGeometry) -> Vec<(UVec3, f64)> {
        let radius_mm = self.radius_length_mm(geometry);
        let radii = |radius_mm| whole_voxels(radius_mm, Self::MAX_VOXELS, geometry);
        if self.shells == 1 {
            return vec![(radii(radius_mm), 0.0)];
        }
        let thickness_mm = radius_mm / f64::from(self.shells);
        let steps = thickness_mm / self.step_length_mm(geometry);
        let mut shells: Vec<(UVec3, f64)> = Vec::new();
        for number in 1..=self.shells {
            let radii = radii(f64::from(number) * thickness_mm);
            match shells.last_mut() {
                Some((outer, thickness)) if *outer == radii => *thickness += steps,
                _ => shells.push((radii, steps)),
            }
        }
        shells
    }
}

impl MethodSettings for SummedAreaOcclusion {
    fn name(&self) -> &'static str {
        "summed_area"
    }

    fn bytes(&self, dimensions: UVec3) -> MethodBytes {
        MethodBytes::of_buffers(&[4 * dimensions.as_u64vec3().element_product()])
    }

    /// Half of each shell around a point of an opaque half space's surface is opaque.
    fn flat_factor(&self, _: &Sky, geometry: &VolumeGeometry) -> f64 {
        let steps: f64 = self.shell_radii(geometry).into_iter().map(|(_, steps)| steps).sum();
        let depth = LN_2 * steps;
        if depth > 0.0 { (1.0 - (-depth).exp()) / depth } else { 0.5 }
    }
}

impl Default for SummedAreaOcclusion {
    fn default() -> Self {
        Self { radius_mm: None, shells: 5 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::math::{DAffine3, DVec3};

    fn shells(radius_mm: f32, shells: u32, spacing_mm: DVec3) -> Vec<(UVec3, f64)> {
        let dimensions = UVec3::splat(9);
        let geometry =
            VolumeGeometry { dimensions, spacing_mm, local_from_voxel: DAffine3::from_scale(spacing_mm) };
        SummedAreaOcclusion { radius_mm: Some(radius_mm), shells }.clamped().shell_radii(&geometry)
    }

    #[test]
    fn shells_are_as_thick_as_the_radius_together() {
        let spacing_mm = DVec3::new(0.5, 1.0, 2.0);
        assert_eq!(shells(4.0, 1, spacing_mm), [(UVec3::new(8, 4, 2), 0.0)]);
        let two = [(UVec3::new(4, 2, 1), 4.0), (UVec3::new(8, 4, 2), 4.0)];
        assert_eq!(shells(4.0, 2, spacing_mm), two);
        for number in [3, 100, u32::MAX] {
            let shells = shells(4.0, number, spacing_mm);
            // The smallest spacing is one step.
            let steps: f64 = shells.iter().map(|(_, steps)| steps).sum();
            assert!((steps - 8.0).abs() < 1e-9, "{number}: {steps}");
            assert_eq!(shells.last().map(|(radii, _)| *radii), Some(UVec3::new(8, 4, 2)));
            let grow = |pair: &[(UVec3, f64)]| pair[0].0.cmple(pair[1].0).all() && pair[0].0 != pair[1].0;
            assert!(shells.windows(2).all(grow), "{shells:?}");
        }
    }

    #[test]
    fn settings_without_sense_give_boxes_that_can_be_summed() {
        for radius_mm in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -1.0, 0.0] {
            for number in [0, 1, 7, u32::MAX] {
                let shells = shells(radius_mm, number, DVec3::new(0.5, 1.0, 2.0));
                assert!(!shells.is_empty() && shells.len() <= SummedAreaOcclusion::MAX_SHELLS as usize);
                for (radii, steps) in shells {
                    let is_single = number <= 1;
                    assert!(
                        (steps == 0.0) == is_single && steps.is_finite(),
                        "{radius_mm} {number}: {steps}"
                    );
                    let voxels = (2 * radii + 1).as_u64vec3().element_product();
                    assert!(255 * voxels <= u64::from(u32::MAX), "{radii} voxels of 255 exceed 32 bits");
                }
            }
        }
    }
}
