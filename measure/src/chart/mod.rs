//! Speed against accuracy of every occlusion method, in three scenes. Times of frames are compared with a dense local
//! ambient occlusion, errors with very many rays. Measuring writes rows; plotting reads rows only.

mod accuracy;
mod brightness;
mod canvas;
mod definitions;
mod labels;
mod methods;
mod panel;
mod peers;
mod plot;
pub mod scenes;
mod shot;
mod timing;

use bevy_contextual_ao::prelude::{AmbientOcclusion, TransferFunction};
use contextual_ao_kit::mode::ShadingMode;
use std::{fs, path::Path, time::Instant};

use crate::{Options, stage::Stage};
use accuracy::Accuracy;
use contextual_ao_kit::{
    chart::{Row, from_csv, to_csv},
    scene::SceneParts,
};
use methods::SceneScale;
use peers::HandedOver;

/// Measures, writes `chart.csv` after each setting, and draws the charts. If a scene is named, it alone is measured, and
/// rows of others stay.
pub fn run(named: Option<&str>, options: &Options) -> Result<(), String> {
    fs::create_dir_all(&options.out).map_err(|error| format!("{}: {error}", options.out.display()))?;
    let file = options.out.join("chart.csv");
    let mut rows = Vec::new();
    if let Some(named) = named
        && let Ok(csv) = fs::read_to_string(&file)
    {
        rows = from_csv(&csv).map_err(|error| format!("{}: {error}", file.display()))?.0;
        rows.retain(|row| row.scene != named);
    }
    let scenes = scenes::load(options)?;
    let names: Vec<_> = scenes.iter().map(|scene| scene.name.clone()).collect();
    if let Some(unknown) = named.filter(|named| !names.iter().any(|name| name == named)) {
        return Err(format!("--chart {unknown}: expected {}", names.join(", ")));
    }
    for scene in scenes.into_iter().filter(|scene| named.is_none_or(|named| scene.name == named)) {
        measure(scene, options, &mut |row, device| {
            rows.push(row);
            fs::write(&file, to_csv(&rows, device)).map_err(|error| format!("{}: {error}", file.display()))
        })?;
    }
    println!("{}", file.display());
    plot_again(&file, &options.out)
}

/// Draws the charts of rows that were written before.
pub fn plot_again(file: &Path, out: &Path) -> Result<(), String> {
    let csv = fs::read_to_string(file).map_err(|error| format!("{}: {error}", file.display()))?;
    let (rows, device) = from_csv(&csv).map_err(|error| format!("{}: {error}", file.display()))?;
    fs::create_dir_all(out).map_err(|error| format!("{}: {error}", out.display()))?;
    plot::plot(&rows, &device, out)
}

/// Measures a scene. Each row is kept as soon as it is there, with the device that it was measured on: a run that is
/// ended early has rows.
fn measure(
    scene: SceneParts,
    options: &Options,
    keep: &mut dyn FnMut(Row, &str) -> Result<(), String>,
) -> Result<(), String> {
    let begin = Instant::now();
    let opacities = scene.transfer_function.iter().flat_map(|function| &function.points);
    let opacity = opacities.map(|point| point.opacity).fold(0.0, f32::max);
    let intensities = definitions::clipped_intensities(&scene.volume, scene.carvers.first());
    // Translucent matter has no surface.
    let isovalue =
        scene.transfer_function.as_ref().filter(|_| opacity >= 1.0).and_then(TransferFunction::isovalue);
    let size = scenes::image_size(options);
    let peers = HandedOver::write(&scene, size, options.out.join(format!("{}-peers", scene.name)))?;
    let mut stage = Stage::new(scene, size);
    let scale = SceneScale { rays: stage.rays(), geometry: stage.scene.geometry, opacity, isovalue };
    let settings = scale.settings();
    let name = stage.scene.name.clone();

    let timed = timing::time(&mut stage, &settings, options.frames)?;
    let solid = settings.iter().position(|setting| setting.is_solid());
    let dense = settings.iter().position(|setting| setting.is_dense_unit());
    let (Some(solid), Some(dense)) = (solid, dense) else {
        return Err("there is nothing to compare with".to_owned());
    };
    eprintln!("{name}: timed, {:.0} s", begin.elapsed().as_secs_f64());

    // The truth is cast with these rays.
    stage.prepare_with(ShadingMode::Solid, AmbientOcclusion::by(scale.rays))?;
    let mut accuracy = Accuracy::new(&mut stage, intensities)?;
    let file = options.out.join(format!("{name}.png"));
    image::save_buffer(&file, accuracy.true_image(), size.x, size.y, image::ColorType::Rgba8)
        .map_err(|error| format!("{}: {error}", file.display()))?;
    let adapter = stage.adapter();
    let device = format!("{}; {} {}", adapter.name, adapter.driver, adapter.driver_info);
    let mut first = None;
    for (setting, timed_setting) in settings.iter().zip(&timed) {
        let errors = accuracy.of(&mut stage, setting)?;
        let row = Row {
            scene: name.clone(),
            voxels: scale.geometry.dimensions.to_array(),
            pixels: size.to_array(),
            family: setting.family.to_owned(),
            label: setting.label.clone(),
            light: setting.light().to_owned(),
            frames: timed_setting.frames,
            ms: timed_setting.ms,
            quartiles_ms: timed_setting.quartiles_ms,
            solid_ms: timed[solid].ms,
            dense_ms: timed[dense].ms[0],
            voxels_fit: errors.voxels,
            image_fit: errors.image,
            own_definition: errors.own_definition,
            own_voxel_error: errors.own_voxels,
            own_image_error: errors.own_image,
        };
        first.get_or_insert_with(|| row.clone());
        keep(row, &device)?;
    }
    if let Some(first) = first {
        for row in peers.rows(&accuracy, &first, options)? {
            keep(row, &device)?;
        }
    }
    eprintln!("{name}: compared, {:.0} s", begin.elapsed().as_secs_f64());
    Ok(())
}
