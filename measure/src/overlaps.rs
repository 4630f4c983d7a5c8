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

/// Times that all cases are measured, in turns.
const ROUNDS: usize = 3;

/// What the scene has in the place of its volume.
#[derive(Clone, Copy)]
struct Case {
    /// Number of volumes, all alike and in one place.
    volumes: usize,
    /// Number of translucent panes in it.
    panes: usize,
    is_translucent: bool,
    /// Whether the cut and the camera move.
    moves: bool,
}

/// Things that a case has spawned.
#[derive(Component)]
struct CaseThing;

fn cases() -> Vec<Case> {
    let of = |volumes, panes| {
        [false, true].into_iter().flat_map(move |is_translucent| {
            [true, false].map(|moves| Case { volumes, panes, is_translucent, moves })
        })
    };
    [(1, 0), (2, 0), (3, 0), (1, 1), (1, 3)]
        .into_iter()
        .flat_map(|(volumes, panes)| of(volumes, panes))
        .collect()
}

/// Prints the time of a frame of each case over that of one volume, and over that of as many.
pub fn run(options: &Options) -> Result<(), String> {
    let mut stage = shell::beside_peers(options.image_size(), options)?;
    stage.prepare(ShadingMode::PhongCao, stage.rays().pattern)?;
    let cases = cases();
    let mut times = vec![Vec::new(); cases.len()];
    for _ in 0..ROUNDS {
        for (case, times) in cases.iter().zip(&mut times) {
            set_up(&mut stage, case)?;
            let change = |stage: &mut Stage, frame: u32| {
                if case.moves {
                    stage.move_carver(to_and_fro(frame) as f32 * Vec3::Z);
                    stage.turn_camera(frame as f32);
                }
            };
            times.push(stage.medians_undisturbed(options.warmup, options.frames, change).total);
        }
    }
    for (case, own) in cases.iter().zip(&times) {
        let is_alone = |other: &Case| {
            (other.volumes, other.panes) == (1, 0)
                && (other.is_translucent, other.moves) == (case.is_translucent, case.moves)
        };
        let alone = cases.iter().position(is_alone).map_or(own, |index| &times[index]);
        let ratio = median(own.clone()) / median(alone.clone());
        stage.print(json!({
            "volumes": case.volumes,
            "panes": case.panes,
            "translucent": case.is_translucent,
            "moves": case.moves,
            "frame_over_one_volume": ratio,
            "frame_over_as_many_volumes": ratio / case.volumes as f64,
            "ms": median(own.clone()),
        }));
    }
    Ok(())
}

/// Spawns what a case has.
fn set_up(stage: &mut Stage, case: &Case) -> Result<(), String> {
    begin_case::<CaseThing>(stage, case.is_translucent);
    let volume = stage.scene.volume;
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
        // Apart along the line of sight.
        let place = 0.02 * (pane as f32 - 0.5 * (case.panes - 1) as f32) * Vec3::Z;
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
