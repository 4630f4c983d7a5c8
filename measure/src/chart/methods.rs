//! The methods of the chart and their settings, in one list.

use bevy::prelude::*;
use bevy_contextual_ao::occlusion::Optimizations;
use bevy_contextual_ao::{
    occlusion::{
        DensityEstimate, DensitySource, DirectionalOcclusion, GeometryTerm, MethodSettings,
        OcclusionFiltering, OcclusionSweeping, ProgressiveRays, ScreenSpaceBlur, ScreenSpaceOcclusion,
        SummedAreaOcclusion, SweepingSurface,
    },
    prelude::*,
    volume::VolumeGeometry,
};
use contextual_ao_kit::mode::ShadingMode;

/// A setting of a method.
#[derive(Clone)]
pub struct Setting {
    /// Name of the method, as in the legend.
    pub family: &'static str,
    /// A short name.
    pub label: String,
    pub mode: ShadingMode,
    pub optimizations: Optimizations,
    pub occlusion: AmbientOcclusion,
    /// The preset of the view samples; `None` for the scene's own.
    pub view_samples: Option<Quality>,
    pub own: Own,
}

/// A method's own definition, if it is not local ambient occlusion by very many rays.
#[derive(Clone, PartialEq)]
pub enum Own {
    /// Local ambient occlusion by very many rays.
    Rays,
    /// Occlusion by all rays of the pattern, in the same frame.
    AllRays,
    /// Share of the voxels in the box around a voxel that are not denser.
    NotDenser,
    /// Light that comes from all directions through the whole volume.
    WholeVolume,
    /// Image of the same method with better settings.
    Better(OcclusionMethod),
}

/// Dense local ambient occlusion, whose carve frame is the unit of time.
pub const DENSE: (&str, &str) = ("dense LAO", "LAO 54");
/// Name of drawing without occlusion.
pub const SOLID: &str = "no occlusion";

/// Properties of a scene that the settings depend on.
pub struct SceneScale {
    /// The scene's own rays.
    pub rays: OcclusionRays,
    pub geometry: VolumeGeometry,
    /// The highest opacity of a voxel.
    pub opacity: f32,
    /// Intensity of the surface, if matter is opaque.
    pub isovalue: Option<f32>,
}

impl SceneScale {
    /// Distance that rays look, mm.
    fn reach_mm(&self) -> f32 {
        self.rays.steps as f32 * self.step_mm()
    }

    fn step_mm(&self) -> f32 {
        self.rays.step_length_mm(&self.geometry) as f32
    }

    fn of(&self, family: &'static str, label: impl Into<String>, occlusion: AmbientOcclusion) -> Setting {
        let (mode, optimizations) = (ShadingMode::Cao, Optimizations::default());
        let (label, view_samples) = (label.into(), None);
        Setting { family, label, mode, optimizations, occlusion, view_samples, own: Own::Rays }
    }

    fn by(&self, family: &'static str, label: impl Into<String>, method: OcclusionMethod) -> Setting {
        self.of(family, label, AmbientOcclusion::by(method))
    }

    fn rays(&self, pattern: RayPattern) -> AmbientOcclusion {
        AmbientOcclusion::by(OcclusionRays { pattern, ..self.rays })
    }

    /// All settings, including the dense local ambient occlusion of 54 rays and drawing alone.
    pub fn settings(&self) -> Vec<Setting> {
        let mut settings = vec![Setting {
            mode: ShadingMode::Solid,
            ..self.of(SOLID, SOLID, AmbientOcclusion::by(self.rays))
        }];
        settings.extend(self.dense());
        settings.extend(self.contextual());
        settings.extend(self.presets());
        settings.extend(self.progressive());
        settings.extend(self.sweeping());
        settings.extend(self.filtering());
        settings.extend(self.summed_area());
        settings.extend(self.screen_space());
        settings.extend(self.directional());
        settings
    }

    fn dense(&self) -> impl Iterator<Item = Setting> {
        let dense = |pattern| Setting {
            mode: ShadingMode::Lao,
            optimizations: Optimizations::NONE,
            ..self.of(DENSE.0, format!("LAO {}", short(pattern)), self.rays(pattern))
        };
        // Other patterns have the errors of their contextual rows.
        [RayPattern::Neighborhood6, RayPattern::Rubik54, RayPattern::default()].into_iter().map(dense)
    }

    fn contextual(&self) -> Vec<Setting> {
        let published = Setting {
            optimizations: Optimizations::NONE,
            ..self.of("CAO as published", "published 54", self.rays(RayPattern::Rubik54))
        };
        let ours = PATTERNS
            .into_iter()
            .map(|pattern| self.of("CAO", format!("CAO {}", short(pattern)), self.rays(pattern)));
        let few = [RayPattern::Fibonacci(14), RayPattern::Fibonacci(36)];
        let half = few.map(|pattern| {
            let rays = OcclusionRays { pattern, resolution: OcclusionResolution::Half, ..self.rays };
            self.by("CAO at half resolution", format!("half {}", short(pattern)), rays.into())
        });
        let strides = few.map(|pattern| {
            let (steps, step_mm) = (self.rays.steps / 2, Some(2.0 * self.step_mm()));
            let rays = OcclusionRays { pattern, steps, step_mm, ..self.rays };
            self.by("CAO with half the steps", format!("stride {}", short(pattern)), rays.into())
        });
        let sky = few.map(|pattern| {
            let occlusion = AmbientOcclusion { sky: Sky::above(Vec3::Y), ..self.rays(pattern) };
            self.of("CAO under a cloudy sky", format!("sky {}", short(pattern)), occlusion)
        });
        [published].into_iter().chain(ours).chain(half).chain(strides).chain(sky).collect()
    }

    /// The quality presets, with their own view samples and the scene's reach.
    fn presets(&self) -> [Setting; 4] {
        Quality::ALL.map(|quality| {
            let mut occlusion = AmbientOcclusion::by(self.rays);
            quality.apply(&mut default(), &mut occlusion);
            let setting = self.of("quality presets", quality.name(), occlusion);
            Setting { view_samples: Some(quality), ..setting }
        })
    }

    fn progressive(&self) -> [Setting; 3] {
        [(1, 1.0, ""), (4, 1.0, ""), (1, 0.0, " anew")].map(|(rays_per_frame, kept_on_change, note)| {
            let rays = OcclusionRays { pattern: default(), ..self.rays };
            let settings = ProgressiveRays { rays, rays_per_frame, kept_on_change };
            let label = format!("progr. {rays_per_frame}{note}");
            Setting { own: Own::AllRays, ..self.by("progressive rays", label, settings.into()) }
        })
    }

    fn sweeping(&self) -> Vec<Setting> {
        let by = |label: &str, surface, geometry_term, gamma| {
            let settings = OcclusionSweeping { surface, geometry_term, gamma, ..default() };
            let own = match geometry_term {
                GeometryTerm::None if surface == SweepingSurface::Opacity => Own::WholeVolume,
                _ => Own::Rays,
            };
            Setting { own, ..self.by("sweeping", label, OcclusionMethod::Sweeping(settings)) }
        };
        let (opacity, none, cosine) = (SweepingSurface::Opacity, GeometryTerm::None, GeometryTerm::Cosine);
        let mut settings = vec![
            by("sweep", opacity, none, 1.0),
            by("sweep γ2", opacity, none, 2.0),
            by("sweep cos", opacity, cosine, 1.0),
            by("sweep cos γ2", opacity, cosine, 2.0),
        ];
        // As published: an isosurface, with the geometry term and gamma 2, and without the term.
        if let Some(surface) = self.isovalue.map(SweepingSurface::Isosurface) {
            settings.extend([
                by("sweep publ.", surface, cosine, 2.0),
                by("sweep publ. no cos", surface, none, 2.0),
            ]);
        }
        settings
    }

    fn filtering(&self) -> Vec<Setting> {
        let estimates = [
            ("Cheb.", DensityEstimate::Chebyshev, DensitySource::Intensity),
            ("Cheb. open", DensityEstimate::ChebyshevOpen, DensitySource::Intensity),
            ("power", DensityEstimate::Power, DensitySource::Intensity),
            ("Gauss", DensityEstimate::Gaussian, DensitySource::Intensity),
            ("opac.", DensityEstimate::Power, DensitySource::Opacity),
        ];
        let radii = [4.0, 2.0].map(|part| self.reach_mm() / part);
        let both = estimates.into_iter().flat_map(|estimate| radii.map(|radius_mm| (estimate, radius_mm)));
        let by = |((name, estimate, density), radius_mm): (_, f32)| {
            let settings = OcclusionFiltering { estimate, density, radius_mm: Some(radius_mm), ..default() };
            let label = format!("{name} {}", (radius_mm / self.step_mm()).round());
            Setting {
                own: Own::NotDenser,
                ..self.by("filtering", label, OcclusionMethod::Filtering(settings))
            }
        };
        both.map(by).collect()
    }

    fn summed_area(&self) -> Vec<Setting> {
        let radii = [4.0, 2.0].map(|part| self.reach_mm() / part);
        let both = [("SAT", 1), ("shells", SummedAreaOcclusion::default().shells)];
        let both = both.into_iter().flat_map(|boxes| radii.map(|radius_mm| (boxes, radius_mm)));
        let by = |((name, shells), radius_mm): (_, f32)| {
            let settings = SummedAreaOcclusion { radius_mm: Some(radius_mm), shells };
            let label = format!("{name} {}", (radius_mm / self.step_mm()).round());
            self.by("summed-area table", label, OcclusionMethod::SummedArea(settings))
        };
        both.map(by).collect()
    }

    fn screen_space(&self) -> Vec<Setting> {
        let by = |(samples, blur)| {
            let settings = ScreenSpaceOcclusion {
                // Half the highest opacity of a voxel.
                opacity_threshold: 0.5 * self.opacity,
                radius_mm: Some(0.5 * self.reach_mm()),
                bias_mm: Some(0.5 * self.step_mm()),
                samples,
                blur,
            };
            let label = format!("SSAO {samples}{}", if blur == ScreenSpaceBlur::None { "" } else { " blur" });
            let better = ScreenSpaceOcclusion { samples: 256, blur: ScreenSpaceBlur::None, ..settings };
            let own = Own::Better(OcclusionMethod::ScreenSpace(better));
            Setting { own, ..self.by("screen space", label, OcclusionMethod::ScreenSpace(settings)) }
        };
        let (none, even) = (ScreenSpaceBlur::None, ScreenSpaceBlur::Even);
        let mut settings: Vec<_> = [(16, none), (16, even), (64, none), (64, even)].map(by).into();
        let recommended = ScreenSpaceOcclusion {
            opacity_threshold: 0.5 * self.opacity,
            ..ScreenSpaceOcclusion::recommended(&self.geometry)
        };
        settings.push(self.by("screen space", "SSAO as VTK", OcclusionMethod::ScreenSpace(recommended)));
        settings
    }

    fn directional(&self) -> Vec<Setting> {
        let by = |(samples, aperture_degrees, exact_distance)| {
            let settings = DirectionalOcclusion { samples, aperture_degrees, exact_distance, ..default() };
            let algorithm = if exact_distance { " alg. 2" } else { "" };
            let label = format!("DOS {samples}×{samples} {aperture_degrees}°{algorithm}");
            let better = DirectionalOcclusion { samples: 16, ..settings };
            let own = Own::Better(OcclusionMethod::Directional(better));
            Setting {
                own,
                ..self.by("directional occlusion shading", label, OcclusionMethod::Directional(settings))
            }
        };
        [(2, 60.0, false), (5, 60.0, false), (2, 80.0, false), (5, 80.0, false), (5, 80.0, true)]
            .map(by)
            .into()
    }
}

const PATTERNS: [RayPattern; 8] = [
    RayPattern::Neighborhood6,
    RayPattern::Neighborhood14,
    RayPattern::Neighborhood26,
    RayPattern::Rubik54,
    RayPattern::Fibonacci(14),
    RayPattern::Fibonacci(26),
    RayPattern::Fibonacci(36),
    RayPattern::Fibonacci(54),
];

/// Number of rays; F stands for a Fibonacci lattice.
fn short(pattern: RayPattern) -> String {
    match pattern {
        RayPattern::Fibonacci(rays) => format!("F{rays}"),
        _ => pattern.rays().to_string(),
    }
}

impl Setting {
    /// Whether a factor is kept for each voxel and can be read back. Factors of views do not count, nor factors of
    /// octants that drawing puts together.
    pub fn has_voxels(&self) -> bool {
        let method = &self.occlusion.method;
        let of_octants = |method: &OcclusionMethod| {
            matches!(method, OcclusionMethod::Sweeping(OcclusionSweeping { geometry_term, .. })
                if *geometry_term != GeometryTerm::None)
        };
        method.kind().is_of_voxels() && !of_octants(method) && self.mode.uses_occlusion()
    }

    /// Number of frames of motion until errors are as they stay, and after a change until nothing more is computed.
    pub fn frames_of_motion(&self) -> u32 {
        match self.occlusion.method {
            OcclusionMethod::Progressive(settings) => {
                settings.rays.pattern.rays().div_ceil(settings.rays_per_frame.max(1))
            }
            _ => 0,
        }
    }

    /// Light for which the occlusion is computed, and the view samples of the true image if they are not the scene's.
    pub fn light(&self) -> &'static str {
        match (self.view_samples, self.occlusion.sky == Sky::default()) {
            (Some(_), _) => "all around; view samples of reference",
            (None, true) => "all around",
            (None, false) => "from above",
        }
    }
}
