//! What lights of the scene and shadows cost, in the scene of `benches/peers`: a cut moves while the camera turns.

use bevy::{
    light::{CascadeShadowConfigBuilder, DirectionalLightShadowMap, NotShadowCaster},
    prelude::*,
};
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::mode::ShadingMode;
use serde_json::json;

use crate::{
    Options,
    cases::begin_case,
    figures::median,
    shell,
    stage::{Stage, to_and_fro},
};

/// Texels along each side of shadow maps.
const SHADOW_MAP: usize = 1024;
/// Times that all cases are measured, in turns.
const ROUNDS: usize = 3;

/// How the volume is lit.
#[derive(Clone, Copy, Default)]
struct Case {
    name: &'static str,
    /// Whether the lights of the scene count, of which one is directional; else a headlight.
    has_scene_lights: bool,
    point_lights: u32,
    /// Whether the directional light has a shadow map, and whether the volume casts a shadow into it.
    has_shadows: bool,
    casts: bool,
    is_translucent: bool,
}

fn cases() -> Vec<Case> {
    let scene = Case { name: "one directional light", has_scene_lights: true, ..default() };
    let opaque = [
        Case { name: "headlight", ..default() },
        scene,
        Case { name: "and 1 point light", point_lights: 1, ..scene },
        Case { name: "and 4 point lights", point_lights: 4, ..scene },
        Case { name: "and 16 point lights", point_lights: 16, ..scene },
        Case { name: "with a shadow map of meshes", has_shadows: true, ..scene },
        Case { name: "with the volume's shadow in it", has_shadows: true, casts: true, ..scene },
    ];
    let translucent = opaque[..2].iter().map(|case| Case { is_translucent: true, ..*case });
    opaque.into_iter().chain(translucent).collect()
}

/// A light that a case has spawned.
#[derive(Component)]
struct CaseLight;

/// Prints the time of a frame of each case over that with a headlight.
pub fn run(options: &Options) -> Result<(), String> {
    let mut stage = shell::beside_peers(options.image_size(), options)?;
    stage.prepare(ShadingMode::PhongCao, stage.rays().pattern)?;
    let world = stage.headless.app.world_mut();
    world.insert_resource(DirectionalLightShadowMap { size: SHADOW_MAP });
    let cases = cases();
    let mut times = vec![Vec::new(); cases.len()];
    for _ in 0..ROUNDS {
        for (case, times) in cases.iter().zip(&mut times) {
            light(&mut stage, case);
            let change = |stage: &mut Stage, frame: u32| {
                stage.move_carver(to_and_fro(frame) as f32 * Vec3::Z);
                stage.turn_camera(frame as f32);
            };
            times.push(stage.medians_undisturbed(options.warmup, options.frames, change).total);
        }
    }
    for (case, own) in cases.iter().zip(&times) {
        let headlight = cases
            .iter()
            .position(|other| !other.has_scene_lights && other.is_translucent == case.is_translucent);
        let headlight = &times[headlight.unwrap_or_default()];
        let ratios: Vec<_> = own.iter().zip(headlight).map(|(own, headlight)| own / headlight).collect();
        let figures = json!({
            "light": case.name,
            "translucent": case.is_translucent,
            "frame_over_headlight": median(own.clone()) / median(headlight.clone()),
            "rounds": ratios,
            "ms": median(own.clone()),
        });
        stage.print(figures);
    }
    Ok(())
}

/// Lights the scene for a case.
fn light(stage: &mut Stage, case: &Case) {
    let lighting =
        if case.has_scene_lights { VolumeLighting::SceneLights } else { VolumeLighting::Headlight };
    stage.set_shading(|shading| shading.lighting = lighting);
    begin_case::<CaseLight>(stage, case.is_translucent);
    let volume = stage.scene.volume;
    let world = stage.headless.app.world_mut();
    if case.casts {
        world.entity_mut(volume).remove::<NotShadowCaster>();
    } else {
        world.entity_mut(volume).insert(NotShadowCaster);
    }
    if !case.has_scene_lights {
        return;
    }
    let from = Transform::from_xyz(0.3, 0.5, 0.4).looking_at(Vec3::ZERO, Vec3::Y);
    let sun = DirectionalLight {
        illuminance: 3000.0,
        shadow_maps_enabled: case.has_shadows,
        shadow_depth_bias: 0.002,
        ..default()
    };
    let cascade = CascadeShadowConfigBuilder { num_cascades: 1, maximum_distance: 1.0, ..default() }.build();
    world.spawn((sun, cascade, from, CaseLight));
    for number in 0..case.point_lights {
        let around = Quat::from_rotation_y(number as f32 * 2.4);
        let lamp = PointLight { intensity: 1000.0 / case.point_lights as f32, ..default() };
        world.spawn((lamp, Transform::from_translation(around * Vec3::new(0.2, 0.2, 0.2)), CaseLight));
    }
}
