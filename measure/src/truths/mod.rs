//! Sweeping and directional occlusion shading against their own definitions, which are evaluated apart, on the CPU.

mod directional;
mod field;
mod sweeping;

use bevy::prelude::*;
use bevy_contextual_ao::{
    occlusion::{DirectionalOcclusion, GeometryTerm, OcclusionSweeping, SweepingSurface},
    prelude::*,
};
use contextual_ao_kit::{fit::Fit, mode::ShadingMode};
use serde_json::{Value, json};
use std::{num::NonZero, thread};

use crate::{Options, counting::CountingScene, stage::Stage};
use directional::Matter;
use field::{Eye, Field};

/// One of so many pixels along each axis is compared.
const STRIDE: u32 = 2;

/// Prints the errors of both methods, a JSON line per setting.
pub fn run(options: &Options) -> Result<(), String> {
    for scene in [CountingScene::EngineOpaque, CountingScene::CtHead] {
        if let Some(mut white) = WhiteScene::open(scene, options)? {
            of_sweeping(&mut white)?;
            of_light(&mut white)?;
        }
    }
    for scene in [CountingScene::EngineOpaque, CountingScene::EngineTranslucent] {
        if let Some(mut white) = WhiteScene::open(scene, options)? {
            of_directional(&mut white)?;
        }
    }
    Ok(())
}

/// A scene of white matter on black, without carvers, so that pixels show how much light arrives.
struct WhiteScene {
    stage: Stage,
    content: Content,
}

/// What a truth is evaluated from.
struct Content {
    field: Field,
    function: TransferFunction,
    eye: Eye,
    size: UVec2,
}

impl WhiteScene {
    fn open(scene: CountingScene, options: &Options) -> Result<Option<Self>, String> {
        let Some(mut parts) = scene.load(options)? else {
            return Ok(None);
        };
        parts.carvers.clear();
        let Some(function) = &mut parts.transfer_function else {
            return Ok(None);
        };
        function.points.iter_mut().for_each(|point| point.color = [1.0; 3]);
        let (field, function, fov) = (Field::new(&parts.volume), function.clone(), parts.fov);
        let size = options.image_size();
        let mut stage = Stage::new(parts, size);
        stage.headless.app.insert_resource(ClearColor(Color::BLACK));
        let eye = Eye::new(stage.scene.view, fov, size);
        Ok(Some(Self { stage, content: Content { field, function, eye, size } }))
    }

    /// Light in the compared pixels of a frame by a method.
    fn rendered(&mut self, method: OcclusionMethod) -> Result<Vec<f64>, String> {
        self.stage.prepare_with(ShadingMode::Cao, AmbientOcclusion::by(method))?;
        let image = self.stage.image();
        let red = |pixel: UVec2| image[4 * (pixel.y * self.content.size.x + pixel.x) as usize];
        let linear = |pixel| Color::srgb_u8(red(pixel), 0, 0).to_linear().red.into();
        Ok(self.content.pixels().map(linear).collect())
    }

    fn print(&self, setting: Value, found: &[f64], truth: &[Option<f64>], gamma: f64) {
        let pairs = found.iter().zip(truth).filter(|(found, _)| **found > 0.0);
        let fit =
            Fit::of(pairs.filter_map(|(found, truth)| Some([*found, truth.as_ref()?.powf(1.0 / gamma)])));
        self.stage.print(crate::figures::merged(
            setting,
            json!({
                "pixels": fit.count,
                "rms": fit.rms,
                "factor": fit.factor,
                "fitted_rms": fit.fitted_rms,
                "correlation": fit.correlation,
            }),
        ));
    }
}

impl Content {
    fn pixels(&self) -> impl Iterator<Item = UVec2> + use<> {
        let counts = self.size / STRIDE;
        (0..counts.element_product()).map(move |k| STRIDE * UVec2::new(k % counts.x, k / counts.x))
    }

    /// The truth in the compared pixels.
    fn truth(&self, of: impl Fn(bevy::math::DVec3) -> Option<f64> + Sync) -> Vec<Option<f64>> {
        let pixels: Vec<UVec2> = self.pixels().collect();
        let threads = thread::available_parallelism().map_or(1, NonZero::get);
        let mut found = vec![None; pixels.len()];
        let share = pixels.len().div_ceil(threads).max(1);
        thread::scope(|scope| {
            for (pixels, found) in pixels.chunks(share).zip(found.chunks_mut(share)) {
                scope.spawn(|| {
                    for (pixel, found) in pixels.iter().zip(found) {
                        *found = of(self.eye.through(*pixel));
                    }
                });
            }
        });
        found
    }
}

fn of_sweeping(white: &mut WhiteScene) -> Result<(), String> {
    let Some(isovalue) = white.content.function.isovalue() else {
        return Ok(());
    };
    for geometry_term in [GeometryTerm::Cosine, GeometryTerm::None] {
        let has_term = geometry_term != GeometryTerm::None;
        let truth = white.content.truth(|direction| {
            sweeping::light_at(&white.content.field, isovalue.into(), &white.content.eye, direction, has_term)
        });
        for gamma in [1.0, 2.0] {
            let surface = SweepingSurface::Isosurface(isovalue);
            let settings = OcclusionSweeping { surface, geometry_term, gamma, ..default() };
            let found = white.rendered(OcclusionMethod::Sweeping(settings))?;
            let setting = json!({
                "method": "sweeping", "geometry_term": format!("{geometry_term:?}"), "gamma": gamma,
            });
            white.print(setting, &found, &truth, gamma.into());
        }
    }
    Ok(())
}

/// Directions towards lights, volume space: from above, and from beside the viewer.
const LIGHTS: [Vec3; 2] = [Vec3::Y, Vec3::new(1.0, 0.3, 0.6)];

fn of_light(white: &mut WhiteScene) -> Result<(), String> {
    let Some(isovalue) = white.content.function.isovalue() else {
        return Ok(());
    };
    for light in LIGHTS {
        let truth = white.content.truth(|direction| {
            let toward = light.as_dvec3().normalize();
            let content = &white.content;
            sweeping::light_from(&content.field, isovalue.into(), &content.eye, direction, toward)
        });
        let surface = SweepingSurface::Isosurface(isovalue);
        let settings = OcclusionSweeping {
            surface,
            geometry_term: GeometryTerm::Cosine,
            gamma: 1.0,
            light: Some(light),
            ..default()
        };
        let found = white.rendered(OcclusionMethod::Sweeping(settings))?;
        let setting = json!({ "method": "sweeping", "light": light.to_array() });
        white.print(setting, &found, &truth, 1.0);
    }
    Ok(())
}

fn of_directional(white: &mut WhiteScene) -> Result<(), String> {
    for aperture_degrees in [50.0, 70.0, 85.0] {
        let matter = Matter { field: &white.content.field, function: &white.content.function };
        let truth = white
            .content
            .truth(|direction| matter.light_at(&white.content.eye, direction, aperture_degrees.into()));
        let base = DirectionalOcclusion { aperture_degrees, samples: 5, ..default() };
        for settings in [
            base,
            DirectionalOcclusion { exact_distance: true, ..base },
            DirectionalOcclusion { slice_voxels: 1.0, ..base },
            DirectionalOcclusion { slice_voxels: 0.25, ..base },
        ] {
            let found = white.rendered(OcclusionMethod::Directional(settings))?;
            let setting = json!({
                "method": "directional",
                "aperture_degrees": aperture_degrees,
                "slice_voxels": settings.slice_voxels,
                "algorithm": if settings.exact_distance { 2 } else { 3 },
            });
            white.print(setting, &found, &truth, 1.0);
        }
    }
    Ok(())
}
