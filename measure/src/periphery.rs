//! Whether drawing the periphery of two eyes at half resolution pays, by cameras alone: the scene of `benches/peers`.

use bevy::{
    camera::{RenderTarget, SubCameraView},
    core_pipeline::tonemapping::Tonemapping,
    prelude::*,
    render::render_resource::TextureFormat,
};
use bevy_contextual_ao::{diagnostics::TimePassesByClock, volume::WORLD_UNITS_PER_MM};
use contextual_ao_kit::mode::ShadingMode;
use serde_json::json;

use crate::{
    Options,
    figures::median,
    shell,
    stage::{Stage, to_and_fro},
};

/// Pixels along each side of an eye's image; with --quick half of them.
const EYE: u32 = 640;
/// Distance of the eyes, mm.
const APART_MM: f32 = 63.0;
/// Pixels by which an eye's frustum lies beside its axis, of a whole image.
const BESIDE: u32 = 64;
/// Times that all cases are measured, in turns.
const ROUNDS: usize = 5;

/// A camera of an eye, with the eye's place beside the head, mm.
#[derive(Component)]
struct EyeCamera {
    beside_mm: f32,
}

/// A part of an eye's image: its resolution, 1 in so many pixels along each axis, and its part of the field.
#[derive(Clone, Copy)]
struct Part {
    coarseness: u32,
    /// First pixel and width, of 4 along each axis.
    first: u32,
    width: u32,
}

const WHOLE: Part = Part { coarseness: 1, first: 0, width: 4 };
const MIDDLE: Part = Part { coarseness: 1, first: 1, width: 2 };
const COARSE: Part = Part { coarseness: 2, ..WHOLE };

/// Prints the time of a frame with a coarse periphery over that of two whole images.
pub fn run(options: &Options) -> Result<(), String> {
    let mut stage = shell::beside_peers(UVec2::splat(16), options)?;
    stage.headless.app.world_mut().insert_resource(TimePassesByClock(false));
    stage.prepare(ShadingMode::PhongCao, stage.rays().pattern)?;
    let camera = stage.scene.camera;
    if let Some(mut camera) = stage.headless.app.world_mut().get_mut::<Camera>(camera) {
        camera.is_active = false;
    }
    let eye = if options.quick { EYE / 2 } else { EYE };
    let states = ["carver moves", "head turns", "at rest"];
    let mut times = states.map(|_| [Vec::new(), Vec::new()]);
    for _ in 0..ROUNDS {
        for (layout, parts) in [&[WHOLE][..], &[COARSE, MIDDLE]].into_iter().enumerate() {
            open_eyes(&mut stage, parts, eye);
            for (state, times) in states.into_iter().zip(&mut times) {
                let frames = (0..options.warmup + options.frames).map(|frame| {
                    let moves = |of: &str| if state == of { to_and_fro(frame) as f32 } else { 0.0 };
                    stage.move_carver(moves("carver moves") * Vec3::Z);
                    turn_head(&mut stage, moves("head turns"));
                    stage.frame_ms()
                });
                let frames: Vec<_> = frames.collect();
                times[layout].push(median(frames[options.warmup as usize..].to_vec()));
            }
        }
    }
    for (state, [whole, parted]) in states.into_iter().zip(times) {
        let ratios: Vec<_> = parted.iter().zip(&whole).map(|(parted, whole)| parted / whole).collect();
        stage.print(json!({
            "state": state,
            "eye": eye,
            "frame_over_whole": median(ratios.clone()),
            "rounds": ratios,
            "ms_whole": median(whole),
            "ms_parted": median(parted),
        }));
    }
    Ok(())
}

/// Opens two eyes, with a camera for each part of their images.
fn open_eyes(stage: &mut Stage, parts: &[Part], eye: u32) {
    let projection =
        stage.headless.app.world().get::<Projection>(stage.scene.camera).cloned().unwrap_or_default();
    let world = stage.headless.app.world_mut();
    let mut before = world.query_filtered::<Entity, With<EyeCamera>>();
    for entity in before.iter(world).collect::<Vec<_>>() {
        world.despawn(entity);
    }
    let mut order = 1;
    for side in [-1.0, 1.0] {
        for part in parts {
            let pixels = eye / part.coarseness;
            let beside = BESIDE * eye / EYE / part.coarseness;
            let size = UVec2::splat(pixels * part.width / 4);
            let first = UVec2::splat(pixels * part.first / 4);
            // The left eye sees more to the right.
            let shift = if side < 0.0 { beside } else { 0 };
            let image = Image::new_target_texture(size.x, size.y, TextureFormat::Rgba8UnormSrgb, None);
            let target = world.resource_mut::<Assets<Image>>().add(image);
            let view = SubCameraView {
                full_size: UVec2::new(pixels + beside, pixels),
                offset: (first + UVec2::new(shift, 0)).as_vec2(),
                size,
            };
            world.spawn((
                (Camera3d::default(), Tonemapping::None, Msaa::Off, projection.clone()),
                Camera { order, sub_camera_view: Some(view), ..default() },
                RenderTarget::Image(target.into()),
                EyeCamera { beside_mm: 0.5 * side * APART_MM },
            ));
            order += 1;
        }
    }
    turn_head(stage, 0.0);
    stage.headless.frames(4);
}

/// Turns the head about the volume's vertical axis.
fn turn_head(stage: &mut Stage, degrees: f32) {
    let turn = Transform::from_rotation(Quat::from_rotation_y(degrees.to_radians()));
    let view = stage.scene.view;
    let world = stage.headless.app.world_mut();
    for (eye, mut transform) in world.query::<(&EyeCamera, &mut Transform)>().iter_mut(world) {
        let aside = view.right() * eye.beside_mm * WORLD_UNITS_PER_MM;
        transform.set_if_neq(turn * view.with_translation(view.translation + aside));
    }
}
