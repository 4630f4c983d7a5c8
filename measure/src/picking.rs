//! Time of rays that the CPU casts at a volume, as pointers do.

use bevy::{ecs::system::SystemState, prelude::*};
use bevy_contextual_ao::{occlusion::Optimizations, prelude::*};
use contextual_ao_kit::mode::ShadingMode;
use serde_json::json;
use std::time::Instant;

use crate::{Options, figures::median, shell, stage::Stage};

/// Rays along each side of the image.
const SIDE: u32 = 64;
/// Times that both ways are measured, in turns.
const ROUNDS: usize = 5;

/// Prints the mean time of a ray through the image's pixels.
pub fn run(options: &Options) -> Result<(), String> {
    let mut stage = match options.scene.volume {
        Some(_) => Stage::new(options.scene.parts()?, options.image_size()),
        None => shell::beside_peers(options.image_size(), options)?,
    };
    stage.prepare(ShadingMode::Solid, stage.rays().pattern)?;
    let rays = rays(&mut stage);
    let first = |stage: &mut Stage| cast(stage, &rays[..1]).0;
    // The first ray finds the air.
    set(&mut stage, true);
    let first_ms = first(&mut stage);
    let (mut with, mut without) = (Vec::new(), Vec::new());
    let mut hits = [0; 2];
    for _ in 0..ROUNDS {
        for (leaps, times) in [(true, &mut with), (false, &mut without)] {
            set(&mut stage, leaps);
            let (ms, count) = cast(&mut stage, &rays);
            times.push(ms / rays.len() as f64);
            hits[usize::from(leaps)] = count;
        }
    }
    let ratios: Vec<_> = with.iter().zip(&without).map(|(with, without)| with / without).collect();
    stage.print(json!({
        "rays": rays.len(),
        "hits": hits,
        "ms_without_leaps": median(without),
        "ms_with_leaps": median(with),
        "ratios": ratios,
        "first_ray_ms": first_ms,
    }));
    Ok(())
}

fn set(stage: &mut Stage, draw_leaps: bool) {
    stage.headless.app.world_mut().resource_mut::<Optimizations>().draw_leaps = draw_leaps;
}

/// Rays from the camera through a lattice of places in the image.
fn rays(stage: &mut Stage) -> Vec<Ray3d> {
    let (camera, world) = (stage.scene.camera, stage.headless.app.world());
    let view = *world.get::<GlobalTransform>(camera).expect("a camera");
    let camera = world.get::<Camera>(camera).expect("a camera");
    let size = camera.logical_viewport_size().expect("an image");
    let places = (0..SIDE * SIDE).map(|k| (UVec2::new(k % SIDE, k / SIDE).as_vec2() + 0.5) / SIDE as f32);
    places.filter_map(|place| camera.viewport_to_world(&view, place * size).ok()).collect()
}

/// Milliseconds of casting all rays, and the number of hits.
fn cast(stage: &mut Stage, rays: &[Ray3d]) -> (f64, usize) {
    let world = stage.headless.app.world_mut();
    let mut state = SystemState::<VolumeRayCast>::new(world);
    let ray_cast = state.get(world).expect("all that it needs");
    let settings = VolumeRayCastSettings::default();
    let begin = Instant::now();
    let hits = rays.iter().filter(|ray| ray_cast.cast(**ray, &settings).is_some()).count();
    (begin.elapsed().as_secs_f64() * 1e3, hits)
}
