//! Error of progressive rays while a carver moves, against all rays in the same frame.

use bevy::prelude::*;
use bevy_contextual_ao::{occlusion::ProgressiveRays, prelude::*};
use contextual_ao_kit::{chart::rms, mode::ShadingMode};
use serde_json::json;

use crate::{
    Options,
    counting::CountingScene,
    stage::{Stage, to_and_fro},
};

/// Frames of motion: the running mean is steady after as many as there are rays. The last ones are compared.
const FRAMES: u32 = 56;
const COMPARED: u32 = 12;

/// Prints the errors of weights and of rays a frame, for a carver that swings and for one that goes one way.
pub fn run(options: &Options) -> Result<(), String> {
    let scene = CountingScene::EngineOpaque;
    let (Some(reference), Some(progressive)) = (scene.open(options)?, scene.open(options)?) else {
        return Ok(());
    };
    let mut stages = [reference, progressive];
    let rays = OcclusionRays { pattern: default(), ..stages[0].rays() };
    for rays_per_frame in [1, 4] {
        for kept_on_change in [0.0, 0.1, 0.3, 1.0] {
            let settings = ProgressiveRays { rays, rays_per_frame, kept_on_change };
            let methods: [OcclusionMethod; 2] = [rays.into(), settings.into()];
            for (name, is_one_way) in [("to and fro", false), ("one way", true)] {
                for (stage, method) in stages.iter_mut().zip(&methods) {
                    move_carver(stage, 0, is_one_way);
                    stage.prepare_with(ShadingMode::Cao, AmbientOcclusion::by(method.clone()))?;
                }
                let errors = errors(&mut stages, is_one_way);
                stages[1].print(json!({
                    "rays_per_frame": rays_per_frame,
                    "kept_on_change": kept_on_change,
                    "motion": name,
                    "voxel_rms": errors,
                }));
            }
        }
    }
    Ok(())
}

/// RMS error over the seen voxels of the compared frames.
fn errors(stages: &mut [Stage; 2], is_one_way: bool) -> Option<f64> {
    let mut differences = Vec::new();
    for frame in 1..=FRAMES {
        for stage in stages.iter_mut() {
            move_carver(stage, frame, is_one_way);
            stage.headless.frame();
        }
        if frame > FRAMES - COMPARED {
            let [truth, found] = [0, 1].map(|k| stages[k].seen_occlusion());
            let pairs = truth.into_iter().zip(found);
            differences.extend(
                pairs.filter_map(|(truth, found)| Some((f64::from(found?) - f64::from(truth?)) / 255.0)),
            );
        }
    }
    rms(differences).0
}

/// A voxel a frame, to and fro or away.
fn move_carver(stage: &mut Stage, frame: u32, is_one_way: bool) {
    let voxels = if is_one_way { frame as f32 } else { to_and_fro(frame) as f32 };
    let right = stage.scene.view.right();
    stage.move_carver(voxels * stage.scene.voxel_mm * right);
}
