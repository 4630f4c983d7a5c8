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

/// What the scene has in the place of its volume.
#[derive(Clone, Copy)]
struct Case {
    /// Number of volumes, all alike and in one place.
    volumes: usize,
    /// Number of translucent panes, and whether they are in the volume or before it.
    panes: usize,
    are_inside: bool,
    /// The case that it is compared with.
    beside: usize,
}

/// Distance of panes before the volume from its middle, world units.
const BEFORE: f32 = 0.14;

const CASES: [Case; 7] = [
    Case { volumes: 1, panes: 0, are_inside: false, beside: 0 },
    Case { volumes: 2, panes: 0, are_inside: false, beside: 0 },
    Case { volumes: 3, panes: 0, are_inside: false, beside: 0 },
    Case { volumes: 1, panes: 1, are_inside: false, beside: 0 },
    Case { volumes: 1, panes: 1, are_inside: true, beside: 3 },
    Case { volumes: 1, panes: 3, are_inside: false, beside: 0 },
    Case { volumes: 1, panes: 3, are_inside: true, beside: 5 },
];

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
            for (index, case) in CASES.iter().enumerate() {
                set_up(&mut stage, is_translucent, case)?;
                for (moves, times) in [false, true].into_iter().zip(&mut times) {
                    let change = |stage: &mut Stage, frame: u32| {
                        if moves {
                            stage.move_carver(to_and_fro(frame) as f32 * Vec3::Z);
                            stage.turn_camera(frame as f32);
                        }
                    };
                    let medians = stage.medians_undisturbed(options.warmup, options.frames, change);
                    times[index].push(medians.total);
                }
            }
        }
        for (moves, times) in [false, true].into_iter().zip(times) {
            let medians = times.map(median);
            for (case, ms) in CASES.iter().zip(medians) {
                stage.print(json!({
                    "volumes": case.volumes,
                    "panes": case.panes,
                    "inside": case.are_inside,
                    "translucent": is_translucent,
                    "moves": moves,
                    "frame_over_one_volume": ms / medians[0],
                    "frame_over_other_case": ms / medians[case.beside],
                    "ms": ms,
                }));
            }
        }
    }
    Ok(())
}

/// Spawns what a case has.
fn set_up(stage: &mut Stage, is_translucent: bool, case: &Case) -> Result<(), String> {
    begin_case::<CaseThing>(stage, is_translucent);
    let (volume, view) = (stage.scene.volume, stage.scene.view);
    let world = stage.headless.app.world_mut();
    let copies: Vec<_> = (1..case.volumes).map(|_| world.entity_mut(volume).clone_and_spawn()).collect();
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
    for pane in 0..case.panes {
        // Apart along the line of sight, around the volume's middle or before the volume.
        let before = if case.are_inside { 0.0 } else { BEFORE };
        let place = (before + 0.02 * (pane as f32 - 0.5 * (case.panes - 1) as f32)) * view.back();
        let pane = (Mesh3d(mesh.clone()), MeshMaterial3d(material.clone()), CaseThing);
        world.spawn((pane, Transform { translation: place, ..view.with_scale(Vec3::ONE) }));
    }
    for copy in copies {
        stage.headless.until_ready(copy)?;
    }
    // Pipelines are compiled.
    stage.headless.frames(6);
    Ok(())
}
