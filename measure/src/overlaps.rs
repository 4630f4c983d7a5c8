//! What volumes in the same space cost, and translucent meshes in a volume, in the scene of `benches/peers`.

use bevy::prelude::*;
use contextual_ao_kit::mode::ShadingMode;
use serde_json::json;

use crate::{
    Options,
    cases::begin_case,
    figures::median,
    shell,
    stage::{Stage, to_and_fro},
};

/// Times that the cases of a kind are measured, in turns.
const ROUNDS: usize = 3;

/// What the scene has in the place of its volume: a number of volumes, all alike and in one place, and of translucent panes
/// in it. The first is one volume alone.
const CASES: [(usize, usize); 5] = [(1, 0), (2, 0), (3, 0), (1, 1), (1, 3)];

/// Things that a case has spawned.
#[derive(Component)]
struct CaseThing;

/// Prints the time of a frame of each case over that of one volume, and over that of as many.
pub fn run(options: &Options) -> Result<(), String> {
    let mut stage = shell::beside_peers(options.image_size(), options)?;
    stage.prepare(ShadingMode::PhongCao, stage.rays().pattern)?;
    for is_translucent in [false, true] {
        let mut times = [(); 2].map(|_| CASES.map(|_| Vec::new()));
        for _ in 0..ROUNDS {
            for (case, (volumes, panes)) in CASES.into_iter().enumerate() {
                set_up(&mut stage, is_translucent, volumes, panes)?;
                for (moves, times) in [false, true].into_iter().zip(&mut times) {
                    let change = |stage: &mut Stage, frame: u32| {
                        if moves {
                            stage.move_carver(to_and_fro(frame) as f32 * Vec3::Z);
                            stage.turn_camera(frame as f32);
                        }
                    };
                    let medians = stage.medians_undisturbed(options.warmup, options.frames, change);
                    times[case].push(medians.total);
                }
            }
        }
        for (moves, times) in [false, true].into_iter().zip(times) {
            let medians = times.map(median);
            for ((volumes, panes), ms) in CASES.into_iter().zip(medians) {
                stage.print(json!({
                    "volumes": volumes,
                    "panes": panes,
                    "translucent": is_translucent,
                    "moves": moves,
                    "frame_over_one_volume": ms / medians[0],
                    "frame_over_as_many_volumes": ms / medians[0] / volumes as f64,
                    "ms": ms,
                }));
            }
        }
    }
    Ok(())
}

/// Spawns what a case has.
fn set_up(stage: &mut Stage, is_translucent: bool, volumes: usize, panes: usize) -> Result<(), String> {
    begin_case::<CaseThing>(stage, is_translucent);
    let volume = stage.scene.volume;
    let world = stage.headless.app.world_mut();
    let copies: Vec<_> = (1..volumes).map(|_| world.entity_mut(volume).clone_and_spawn()).collect();
    for copy in &copies {
        world.entity_mut(*copy).insert(CaseThing);
    }
    let mesh = world.resource_mut::<Assets<Mesh>>().add(Rectangle::new(0.2, 0.2));
    let material = StandardMaterial {
        base_color: Color::srgba(0.5, 0.7, 0.9, 0.3),
        alpha_mode: AlphaMode::Blend,
        unlit: true,
        ..default()
    };
    let material = world.resource_mut::<Assets<StandardMaterial>>().add(material);
    for pane in 0..panes {
        // Apart along the line of sight.
        let place = 0.02 * (pane as f32 - 0.5 * (panes - 1) as f32) * Vec3::Z;
        let pane = (Mesh3d(mesh.clone()), MeshMaterial3d(material.clone()), CaseThing);
        world.spawn((pane, Transform::from_translation(place)));
    }
    for copy in copies {
        stage.headless.until_ready(copy)?;
    }
    // Pipelines are compiled.
    stage.headless.frames(6);
    Ok(())
}
