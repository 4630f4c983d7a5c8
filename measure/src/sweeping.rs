//! Table 2 of the occlusion sweeping paper (Singh, Yuksel, House 2009) with our times beside. It gives the time that
//! occlusion adds to a distance field.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::{
    occlusion::{GeometryTerm, OcclusionSweeping, SweepDistancesAlone, SweepingSurface},
    prelude::*,
};
use contextual_ao_kit::mode::ShadingMode;
use serde_json::json;

use crate::{Options, stage::Stage};
use contextual_ao_kit::{
    scene::{BONE, SceneParts},
    small_scene::folded_volume,
};

/// Voxels along each axis, and the paper's seconds: distances alone, with the octants' mean, with all octants.
const PUBLISHED: [([u32; 3], [f64; 3]); 5] = [
    ([101, 101, 61], [0.72, 0.91, 1.01]),
    ([100, 100, 100], [1.06, 1.386, 1.52]),
    ([150, 150, 150], [3.86, 6.52, 7.78]),
    ([200, 200, 200], [9.56, 17.12, 23.43]),
    ([250, 250, 250], [23.26, 39.66, 46.64]),
];

/// Isovalue of the surface, for intensities from 0 to 255.
const ISOVALUE: f32 = 128.0;

/// Times all sweeps of one frame, and prints a line for each size.
pub fn run(options: &Options) -> Result<(), String> {
    for (voxels, paper) in PUBLISHED {
        if voxels.into_iter().all(|count| count <= options.most) {
            measure(UVec3::from_array(voxels), paper, options)?;
        }
    }
    Ok(())
}

fn measure(voxels: UVec3, paper: [f64; 3], options: &Options) -> Result<(), String> {
    let function = TransferFunction::ramp(100.0, 156.0, 1.0, BONE).map_err(|error| error.to_string())?;
    let parts = SceneParts {
        name: "folds".to_owned(),
        volume: folded_volume(voxels, DVec3::ONE),
        transfer_function: Some(function),
        budget: default(),
        occlusion: default(),
        shading: default(),
        carvers: Vec::new(),
        camera: 2.0 * voxels.as_vec3(),
        fov: 30.0,
    };
    let mut stage = Stage::new(parts, UVec2::splat(64));
    let mut seconds = |surface, geometry_term, distances_alone| {
        let world = stage.headless.app.world_mut();
        world.insert_resource(SweepDistancesAlone(distances_alone));
        if let Some(mut occlusion) = world.get_mut::<AmbientOcclusion>(stage.scene.volume) {
            let sweeping = OcclusionSweeping { surface, geometry_term, ..default() };
            occlusion.method = OcclusionMethod::Sweeping(sweeping);
        }
        // Everything is swept in every frame.
        let pattern = stage.rays().pattern;
        stage.prepare(ShadingMode::Lao, pattern)?;
        let times = stage.medians(options.warmup, options.frames, |_, _| {});
        Ok::<_, String>(times.of(OcclusionSweeping::SPAN) / 1e3)
    };
    let surface = SweepingSurface::Isovalue(ISOVALUE);
    let distances = seconds(surface, GeometryTerm::None, true)?;
    let mean = seconds(surface, GeometryTerm::None, false)?;
    let octants = seconds(surface, GeometryTerm::Cosine, false)?;
    let by_opacity = seconds(SweepingSurface::Opacity, GeometryTerm::None, false)?;
    println!(
        "{}",
        json!({
            "scene": "folds",
            "voxels": voxels.to_array(),
            "device": stage.adapter().name,
            "frames": options.frames,
            "s_distances": distances,
            "s_mean": mean,
            "s_octants": octants,
            "s_by_opacity": by_opacity,
            "mean_over_distances": mean / distances,
            "octants_over_distances": octants / distances,
            "paper_s_distances": paper[0],
            "paper_s_mean": paper[1],
            "paper_s_octants": paper[2],
            "paper_mean_over_distances": paper[1] / paper[0],
            "paper_octants_over_distances": paper[2] / paper[0],
        })
    );
    Ok(())
}
