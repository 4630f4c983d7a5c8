//! The settings of screen-space ambient occlusion for volumes (Kitware 2023, VTK's `vtkSSAOPass`).

use bevy::{math::DVec3, prelude::*};

use super::{
    MethodKind, MethodSettings,
    lengths::{length_mm, within},
};
use crate::volume::VolumeGeometry;

/// Occlusion among the surfaces that a view sees.
///
/// Each view finds the first point along each of its rays whose opacity reaches a threshold. Points around it count
/// as occluded where they lie behind a surface that the view sees. Opaque meshes of the scene and volumes occlude
/// each other. Every frame costs the same, whether anything changed or not. Objects that are hidden or outside of
/// the image do not occlude. Two eyes see different occlusion
/// ([`OcclusionDiffersBetweenEyes`](super::OcclusionDiffersBetweenEyes)).
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub struct ScreenSpaceOcclusion {
    /// Lowest opacity, of a drawing step, of a sample that counts as the surface. Lower thresholds find surfaces
    /// that are hardly visible. Where no sample reaches the threshold there is no occlusion.
    pub opacity_threshold: f32,
    /// Farthest distance of an occluding surface, mm of the volume; `None` is 20 voxels. A longer radius darkens
    /// larger hollows, and surfaces beside the outline of something in front of them.
    pub radius_mm: Option<f32>,
    /// Least distance in front of a point at which a surface occludes it, mm; `None` is half a voxel. A shorter
    /// bias shows the steps of voxels, a longer one loses creases.
    pub bias_mm: Option<f32>,
    /// Points tested around each pixel, at most [`Self::MAX_SAMPLES`]. More points cost proportionally more time
    /// and show less noise.
    pub samples: u32,
    /// How the noise is blurred.
    pub blur: ScreenSpaceBlur,
}

impl ScreenSpaceOcclusion {
    /// Largest number of points around a pixel.
    pub const MAX_SAMPLES: u32 = 256;
    /// The longest radius, mm.
    pub const MAX_RADIUS_MM: f32 = 10_000.0;
    /// Diagnostics span of the passes over all shaded views. They run after drawing.
    pub const SPAN: &str = "contextual_ao/screen_space";

    /// The settings that VTK's authors recommend (Kitware 2023): 128 samples, a radius of a tenth of the diagonal of the
    /// scene's bounding box, here that of a volume's, a bias of a thousandth, and VTK's blur.
    pub fn recommended(geometry: &VolumeGeometry) -> Self {
        let [first, .., last] = geometry.corners();
        let diagonal_mm = first.distance(last) as f32;
        Self {
            radius_mm: Some(0.1 * diagonal_mm),
            bias_mm: Some(0.001 * diagonal_mm),
            samples: 128,
            blur: ScreenSpaceBlur::Gaussian,
            ..Self::default()
        }
    }

    /// Limits these settings to their valid ranges.
    pub(crate) fn clamped(&self) -> Self {
        let length = |mm: Option<f32>| mm.map(|mm| within(mm, Self::MAX_RADIUS_MM));
        Self {
            opacity_threshold: within(self.opacity_threshold, 1.0),
            radius_mm: length(self.radius_mm),
            bias_mm: length(self.bias_mm),
            samples: self.samples.min(Self::MAX_SAMPLES),
            blur: self.blur,
        }
    }

    /// Radius and bias, mm.
    pub fn lengths_mm(&self, geometry: &VolumeGeometry) -> [f64; 2] {
        [length_mm(self.radius_mm, 20.0, geometry), length_mm(self.bias_mm, 0.5, geometry)]
    }

    /// The points tested around a point whose normal is the z axis, in radii.
    ///
    /// They are spread evenly over the half ball, then drawn towards its middle (VTK's scale,
    /// 0.1 + 0.9 (k / samples)^2). The first point is drawn to a tenth, the last hardly.
    pub fn kernel(&self) -> Vec<Vec3> {
        // Powers of the root of x^4 = x + 1. The multiples of these three numbers fill the unit cube evenly.
        const EVEN: [f64; 3] = [0.8191725133961645, 0.6710436067037893, 0.5497004779019703];
        let count = self.samples.min(Self::MAX_SAMPLES);
        let point = |k: u32| {
            let [turn, height, volume] = EVEN.map(|step| (0.5 + f64::from(k + 1) * step).fract());
            let (sin, cos) = (core::f64::consts::TAU * turn).sin_cos();
            let across = (1.0 - height * height).sqrt();
            let share = f64::from(k) / f64::from(count);
            let length = volume.cbrt() * (0.1 + 0.9 * share * share);
            (length * DVec3::new(across * cos, across * sin, height)).as_vec3()
        };
        (0..count).map(point).collect()
    }
}

impl MethodSettings for ScreenSpaceOcclusion {
    fn name(&self) -> &'static str {
        "screen_space"
    }

    fn kind(&self) -> MethodKind {
        MethodKind::DrawnViews
    }
}

impl Default for ScreenSpaceOcclusion {
    fn default() -> Self {
        Self { opacity_threshold: 0.5, radius_mm: None, bias_mm: None, samples: 32, blur: default() }
    }
}

/// Blur of screen-space occlusion.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
#[non_exhaustive]
pub enum ScreenSpaceBlur {
    /// No blur: the pattern of the points shows.
    None,
    /// VTK's: a Gaussian over 3 x 3 pixels, which darkens across outlines. The pattern of the points shows less.
    Gaussian,
    /// The mean over the 4 x 4 pixels that have all turns of the points. It leaves out pixels farther away than the
    /// radius, so that outlines stay sharp.
    #[default]
    Even,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kernel_fills_the_half_ball() {
        let kernel = ScreenSpaceOcclusion { samples: 64, ..default() }.kernel();
        assert!(kernel.iter().all(|point| point.z >= 0.0 && point.length() <= 1.0));
        // The mean of evenly spread directions is half along the axis and 0 across it.
        let mean = kernel.iter().map(|point| point.normalize()).sum::<Vec3>() / 64.0;
        assert!(mean.distance(Vec3::new(0.0, 0.0, 0.5)) < 0.05, "{mean}");
    }

    #[test]
    fn no_setting_is_beyond_what_can_be_computed() {
        for value in [f32::NAN, f32::INFINITY, -1.0, 0.0, 1e38] {
            let settings = ScreenSpaceOcclusion {
                opacity_threshold: value,
                radius_mm: Some(value),
                bias_mm: Some(value),
                samples: u32::MAX,
                blur: default(),
            };
            let clamped = settings.clamped();
            let lengths = [clamped.radius_mm, clamped.bias_mm];
            assert!(
                lengths.iter().flatten().all(|mm| (0.0..=ScreenSpaceOcclusion::MAX_RADIUS_MM).contains(mm))
            );
            assert!((0.0..=1.0).contains(&clamped.opacity_threshold));
            assert_eq!(settings.kernel().len(), 256);
        }
    }
}
