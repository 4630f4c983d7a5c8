//! How far pictures are from the truth, in analytic scenes. `docs/picture.md` has the definitions.

mod difference;
mod files;

use bevy::prelude::*;
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::{
    mode::ShadingMode,
    picture::{
        color::{level_of, light_of},
        scenes::{GREY, PictureScene, RESOLUTIONS},
        truth::{Pixel, Truth, facing_of},
    },
};
use serde_json::{Value, json};

use crate::{Options, figures::merged, stage::Stage};
use difference::Difference;

/// Pixels along each side of pictures; those of the ball have twice as many.
const PIXELS: u32 = 128;

/// Settings of the renderer under a name.
struct Setting {
    name: &'static str,
    shading: VolumeShading,
    rays: OcclusionRays,
    /// Whether it is taken in the scenes of the ball alone.
    in_ball_alone: bool,
}

/// The settings. Further ones go here.
fn settings() -> Vec<Setting> {
    let default_setting =
        Setting { name: "default", shading: default(), rays: default(), in_ball_alone: false };
    let reference = Setting {
        name: "reference",
        shading: Quality::Reference.shading(),
        rays: Quality::Reference.rays(),
        in_ball_alone: true,
    };
    let others = Reconstruction::ALL.into_iter().filter(|filter| *filter != Reconstruction::default());
    let others = others.map(|reconstruction| Setting {
        name: reconstruction.name(),
        shading: VolumeShading { reconstruction, ..default() },
        rays: default(),
        in_ball_alone: true,
    });
    [default_setting, reference].into_iter().chain(others).collect()
}

/// The ways to shade.
const MODES: [ShadingMode; 3] = [ShadingMode::Phong, ShadingMode::Cao, ShadingMode::PhongCao];

/// Prints a line for every scene, setting and mode; of the scene of this name alone if there is one.
pub fn run(name: Option<&str>, options: &Options) -> Result<(), String> {
    std::fs::create_dir_all(&options.out).map_err(|error| format!("{}: {error}", options.out.display()))?;
    let resolutions = if options.quick { &RESOLUTIONS[..1] } else { &RESOLUTIONS[..] };
    let pixels = if options.quick { PIXELS / 2 } else { PIXELS };
    let names = PictureScene::all(RESOLUTIONS[0], pixels)?.into_iter().map(|scene| scene.name);
    let mut names: Vec<_> = names.collect();
    names.dedup();
    if let Some(name) = name.filter(|name| !names.iter().any(|known| known == name)) {
        return Err(format!("unknown scene `{name}`: expected one of {}", names.join(", ")));
    }
    for &voxels in resolutions.iter().filter(|voxels| **voxels <= options.most) {
        let scenes = PictureScene::all(voxels, pixels)?.into_iter();
        for scene in scenes.filter(|scene| name.is_none_or(|name| scene.name == name)) {
            compare(&scene, voxels, options)?;
        }
    }
    Ok(())
}

/// Compares the pictures of a scene at a resolution.
fn compare(scene: &PictureScene, voxels: u32, options: &Options) -> Result<(), String> {
    let truth = Truth::new(&scene.field, OcclusionRays::default().steps).picture(&scene.eye);
    for setting in settings() {
        if setting.in_ball_alone && scene.name != "ball" {
            continue;
        }
        let occlusion = AmbientOcclusion::by(setting.rays);
        let mut stage = Stage::new(scene.parts(setting.shading.clone(), occlusion)?, scene.eye.size);
        stage.headless.render_floats(stage.scene.camera, scene.eye.size);
        // What is translucent is judged by itself, not by what is behind it.
        stage.headless.app.insert_resource(ClearColor(Color::BLACK));
        for mode in MODES {
            stage.prepare(mode, setting.rays.pattern)?;
            stage.headless.frame();
            let unrounded: Vec<_> = stage.headless.light().iter().map(|light| light.map(level_of)).collect();
            let picture: Vec<_> = unrounded.iter().map(|levels| levels.map(f64::round)).collect();
            let true_levels: Vec<[f64; 3]> = truth.iter().map(|pixel| levels(pixel, mode)).collect();
            let figures = |picture: &[[f64; 3]]| {
                let difference = Difference::of(picture, &true_levels, &truth, scene.eye.size);
                let normals = (mode == ShadingMode::Phong && scene.is_grey).then(|| {
                    difference.angles_by(|level| facing_of(light_of(level), light_of(255.0 * GREY)))
                });
                merged(difference.to_json(), angles_to_json(normals))
            };
            let which = json!({
                "voxels": voxels,
                "transfer": scene.transfer,
                "setting": setting.name,
                "mode": mode.name(),
                "pixels_per_voxel": pixels_per_voxel(scene),
                "unrounded": figures(&unrounded),
            });
            stage.print(merged(which, figures(&picture)));
            let name = [&scene.name, &scene.transfer, setting.name, mode.name()].join("_");
            files::write(
                &options.out.join(format!("{name}_{voxels}")),
                &picture,
                &true_levels,
                scene.eye.size,
            )?;
        }
    }
    Ok(())
}

/// Levels that a pixel should have, over black.
fn levels(pixel: &Pixel, mode: ShadingMode) -> [f64; 3] {
    let light = match mode {
        ShadingMode::Phong => pixel.lit,
        ShadingMode::Cao => pixel.occluded,
        _ => pixel.lit_occluded,
    };
    light.to_array().map(level_of)
}

/// Pixels per voxel at the distance of the origin.
fn pixels_per_voxel(scene: &PictureScene) -> f64 {
    let eye = &scene.eye;
    let height_mm = 2.0 * eye.position.length() * (0.5 * eye.fov).tan();
    f64::from(eye.size.y) * scene.field.voxel_mm / height_mm
}

fn angles_to_json(angles: Option<[f64; 2]>) -> Value {
    json!({
        "normals_deg": angles.map(|[mean, _]| mean),
        "normals_largest_deg": angles.map(|[_, largest]| largest),
    })
}
