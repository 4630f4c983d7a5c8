//! Renders a volume with carvers to a PNG, without a window, and prints the time of every pass.

use bevy::prelude::*;
use bevy_contextual_ao::{
    diagnostics::{RenderStatus, SPAN_DRAW},
    prelude::*,
};
use clap::Parser;
use contextual_ao_kit::mode::ShadingMode;
use contextual_ao_kit::{headless::Headless, scene::SceneOptions};
use std::path::PathBuf;

/// Renders a volume with carvers to a PNG.
#[derive(Parser)]
struct Options {
    #[command(flatten)]
    scene: SceneOptions,
    /// Shading mode: solid, phong, cao, phong_cao or lao.
    #[arg(long, default_value = "cao")]
    mode: ShadingMode,
    /// Ray pattern: neighborhood6, neighborhood14, neighborhood26, rubik54, sphere512 or fibonacci:N.
    #[arg(long, default_value_t = RayPattern::default())]
    pattern: RayPattern,
    /// File that the image is written to.
    #[arg(long, default_value = "snapshot.png")]
    out: PathBuf,
}

fn main() -> Result<(), String> {
    let options = Options::parse();
    let mut headless = Headless::new(options.scene.size, |app| {
        app.insert_resource(ClearColor(Color::srgb(0.06, 0.07, 0.08)));
    });
    let scene = options.scene.spawn(&mut headless)?;
    let world = headless.app.world_mut();
    let mut occlusion = world.get_mut::<AmbientOcclusion>(scene.volume);
    if let Some(rays) = occlusion.as_mut().and_then(|occlusion| occlusion.method.rays_mut()) {
        rays.pattern = options.pattern;
    }
    headless.set_mode(scene.volume, options.mode);
    headless.until_ready(scene.volume)?;
    let pixels = headless.image();
    let UVec2 { x: width, y: height } = options.scene.size;
    image::save_buffer(&options.out, &pixels, width, height, image::ColorType::Rgba8)
        .map_err(|error| format!("{}: {error}", options.out.display()))?;
    // Timings arrive a frame or two after their pass.
    headless.frames(3);
    println!("{} ({} voxels), {}", scene.name, scene.voxels, options.pattern);
    let passes = headless.app.world().resource::<RenderStatus>().passes.clone();
    for span in passes.spans().chain([SPAN_DRAW]) {
        println!("{span:32} {:9.2} ms", headless.pass_ms(span));
    }
    println!("{}", options.out.display());
    Ok(())
}
