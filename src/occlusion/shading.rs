//! The component that says how a volume is drawn.

use bevy::prelude::*;
use core::str::FromStr;

/// How a volume is drawn (required by [`Volume3d`](crate::volume::Volume3d)).
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct VolumeShading {
    /// The light on samples.
    pub lighting: VolumeLighting,
    /// Roughness of surfaces under the scene's lights, 0 to 1, as that of Bevy's `StandardMaterial`. A lower one gives
    /// smaller, brighter highlights.
    pub perceptual_roughness: f32,
    /// Reflectance of surfaces under the scene's lights, 0 to 1, as that of Bevy's `StandardMaterial`: 0.5 is 4 % of the
    /// light from straight ahead. A higher one gives brighter highlights.
    pub reflectance: f32,
    /// Whether [`AmbientOcclusion`](super::AmbientOcclusion) darkens samples: the ambient and diffuse parts of lit
    /// samples, all of the colour of unlit ones. If `false`, no occlusion is computed.
    pub ambient_occlusion: bool,
    /// Occlusion factor that gets all of the ambient light.
    pub ambient_scale: AmbientScale,
    /// Exponent of the share of ambient light. A higher one deepens shadows, 0 shows none.
    pub occlusion_intensity: f32,
    /// Factor on the volume's light. A higher one is brighter; light above 1 is cut off unless the camera is HDR.
    pub exposure: f32,
    /// Distance between samples along a view ray, in units of the smallest voxel spacing. Smaller
    /// steps cost proportionally more drawing time and show fewer slices.
    pub step_voxels: f32,
    /// Interpolation of intensities between voxels.
    pub reconstruction: Reconstruction,
    /// Moves the start of every view ray by blue noise, a fixed tile of 64x64 pixels: slices turn into fine grain. The
    /// grain is fixed to pixels, so two eyes see it at other points of the volume. Apps for headsets switch it off.
    pub jitter: bool,
    /// View rays of a pixel at an outline of the volume or of a cut, in views with `Msaa`; at most 32. More rays cost as much
    /// as more such pixels. Fewer show steps, and flicker when a carver moves. With 1, all pixels have one ray. So has a
    /// pixel in which an opaque mesh ends what the rays see.
    pub outline_rays: u32,
}

impl Default for VolumeShading {
    fn default() -> Self {
        Self {
            lighting: default(),
            perceptual_roughness: 0.5,
            reflectance: 0.5,
            ambient_occlusion: true,
            ambient_scale: default(),
            occlusion_intensity: 1.0,
            exposure: 1.0,
            step_voxels: 0.5,
            reconstruction: default(),
            jitter: true,
            outline_rays: 4,
        }
    }
}

impl VolumeShading {
    /// Exponent and factor within their valid ranges; 1 in place of what is not finite.
    pub(crate) fn drawn_light(&self) -> [f32; 2] {
        let valid = |value: f32| if value.is_finite() { value.max(0.0) } else { 1.0 };
        [self.occlusion_intensity, self.exposure].map(valid)
    }

    /// Roughness and reflectance within their valid ranges; the defaults in place of what is not finite.
    pub(crate) fn drawn_surface(&self) -> [f32; 2] {
        let default = Self::default();
        let valid =
            |value: f32, default: f32| if value.is_finite() { value.clamp(0.0, 1.0) } else { default };
        // The roughness of the least that Bevy's lights take.
        let roughness = valid(self.perceptual_roughness, default.perceptual_roughness).max(0.089);
        [roughness, valid(self.reflectance, default.reflectance)]
    }

    /// Rays of a pixel at an outline; 0 if it has its own ray alone.
    pub(crate) fn drawn_outline_rays(&self) -> u32 {
        if self.outline_rays > 1 { self.outline_rays.min(32) } else { 0 }
    }

    /// Distance between samples, voxels, within its valid range.
    pub(crate) fn drawn_step_voxels(&self) -> f32 {
        self.step_voxels.max(0.01)
    }
}

/// The light on the samples of a volume.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
#[non_exhaustive]
pub enum VolumeLighting {
    /// No light: samples show the transfer function's colour.
    #[default]
    Unlit,
    /// A light at the camera, by Blinn-Phong. Normals come from the intensities, on cuts from the carver's surface, and
    /// from the distance field where only an isosurface is drawn.
    Headlight,
    /// The lights of the scene, as Bevy's `StandardMaterial` takes them: directional, point, spot and ambient lights,
    /// environment maps and irradiance volumes, in physical units, with the camera's exposure and the shadows of meshes.
    /// Occlusion darkens indirect light alone. Matter without a surface is lit as if it faced the viewer. Normals are those of
    /// [`Headlight`](Self::Headlight).
    ///
    /// Light is computed once for every tenth of a pixel's opacity: it costs more in translucent volumes. Screen-space and
    /// directional occlusion draw by a headlight instead.
    SceneLights,
}

/// Occlusion factor that gets all of the ambient light.
///
/// Rays from a flat surface are at best half open, and lose some more along the surface: its factor is below 0.5. It is
/// known from the method's settings and the sky alone, so that no picture is brightened by its content. It matters for
/// rays alone.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
#[non_exhaustive]
pub enum AmbientScale {
    /// That of an open flat surface. Surfaces that bulge get no more light than flat ones.
    #[default]
    FlatSurface,
    /// A factor of 1, as published: no surface gets it. For comparison.
    Published,
}

/// Interpolation of intensities between voxels, for the pictures of volumes. The occlusion of a voxel is the same by all
/// filters, and so are the normals of surfaces: they come from the cubic B-spline.
///
/// Screen-space and directional occlusion draw by trilinear intensities alone.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
#[non_exhaustive]
pub enum Reconstruction {
    /// By the nearest 8 voxels, one filtered sample a place: the fastest. Boundaries of tissues have kinks at voxels,
    /// which show as steps where a voxel takes several pixels.
    Trilinear,
    /// Opacities by the nearest 8 voxels; colours by a sharpened cubic B-spline, so that boundaries of tissues are smooth.
    /// Occlusion is taken where a surface without kinks is: less grain. Fifteen filtered samples more for every two slices
    /// that are seen.
    #[default]
    SmoothColors,
    /// The same, with occlusion by the nearest 27 voxels, with a quadratic B-spline: the least grain. Occlusion of two
    /// fifths more voxels is computed.
    SmoothOcclusion,
    /// Opacities by the nearest 64 voxels, with a cubic B-spline, and smooth colours and occlusion. Outlines and
    /// translucent layers are smooth as well. Eight filtered samples a place. Details finer than two voxels, and noise,
    /// lose contrast.
    Tricubic,
}

impl Reconstruction {
    /// All filters, from the fastest to the smoothest.
    pub const ALL: [Self; 4] = [Self::Trilinear, Self::SmoothColors, Self::SmoothOcclusion, Self::Tricubic];

    /// The name used on command lines and in reports: `trilinear`, `smooth_colors`, `smooth_occlusion`,
    /// `tricubic`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Trilinear => "trilinear",
            Self::SmoothColors => "smooth_colors",
            Self::SmoothOcclusion => "smooth_occlusion",
            Self::Tricubic => "tricubic",
        }
    }

    /// Whether intensities are tricubic, and opacities with them.
    pub(crate) fn is_tricubic(self) -> bool {
        self == Self::Tricubic
    }

    /// Whether occlusion is looked up by the nearest 27 texels, not by 8.
    pub(crate) fn smooths_occlusion(self) -> bool {
        matches!(self, Self::SmoothOcclusion | Self::Tricubic)
    }

    /// Whether occlusion is looked up beside trilinear surfaces, where a surface without bumps is.
    pub(crate) fn shifts_occlusion(self) -> bool {
        matches!(self, Self::SmoothColors | Self::SmoothOcclusion)
    }

    /// Shader definitions of the pass that draws volumes.
    pub(crate) fn shader_defs(self) -> &'static [&'static str] {
        match self {
            Self::Trilinear => &[],
            Self::SmoothColors => &["SMOOTH_COLORS"],
            Self::SmoothOcclusion => &["SMOOTH_COLORS", "SMOOTH_OCCLUSION"],
            Self::Tricubic => &["SMOOTH_COLORS", "SMOOTH_OCCLUSION", "TRICUBIC"],
        }
    }
}

impl FromStr for Reconstruction {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|filter| filter.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            format!("unknown reconstruction `{name}`: expected one of {names}")
        })
    }
}
