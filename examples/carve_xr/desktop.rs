//! The desktop in place of a headset: one hand follows the mouse, the other one rests with the panel in view.

use bevy::{
    input::mouse::{AccumulatedMouseMotion, AccumulatedMouseScroll, MouseScrollUnit},
    math::Affine3A,
    prelude::*,
    window::PrimaryWindow,
};
use bevy_contextual_ao::prelude::Hand;
use bevy_egui::{
    EguiContexts, EguiGlobalSettings, EguiPrimaryContextPass, PrimaryEguiContext,
    egui::{Align2, Area, Frame, Grid, RichText},
};
use core::f32::consts::FRAC_PI_2;

use super::{
    controls::{Controls, Side},
    eyes::NEAR,
    rig::{Eye, Rig},
    wrist,
};

/// Effects of mouse and keys.
const HELP: [[&str; 2]; 9] = [
    ["left button", "carve, press the panel"],
    ["right drag", "look around"],
    ["wheel", "nearer, farther"],
    ["G", "grab; while carving: leave the carver"],
    ["C  X", "next shape, remove or keep"],
    ["Z  Shift+Z", "larger, smaller"],
    ["T (hold)", "jump where the arc lands"],
    ["Left  Right", "turn"],
    ["Tab", "the other hand"],
];
/// Height of the eyes of someone who looks at the stand, metres.
const EYES: f32 = 1.5;
const FIRST_PITCH: f32 = -0.42;
const RADIANS_PER_PIXEL: f32 = 0.004;
const REACH: core::ops::RangeInclusive<f32> = 0.25..=3.0;
const REACH_PER_NOTCH: f32 = 1.04;
const NOTCHES_PER_PIXEL: f32 = 0.02;
/// The right hand from its carver's middle, seen from the eye: to the right, below and nearer.
const HAND: Vec3 = Vec3::new(0.04, -0.06, 0.07);
/// Hands grab what their carvers touch.
const GRABS_WITHIN: f32 = 0.15;
/// Middle of the right hand's panel, seen from the eye, if it had one.
const PANEL: Vec3 = Vec3::new(0.225, 0.0, -0.45);
/// Start of the pointing ray before the eye.
const RAY_START: f32 = 0.15;

pub struct DesktopPlugin;

impl Plugin for DesktopPlugin {
    fn build(&self, app: &mut App) {
        app.world_mut().resource_mut::<EguiGlobalSettings>().auto_create_primary_context = false;
        app.init_resource::<Mouse>()
            .add_systems(PostStartup, (spawn_eye, reach_far))
            .add_systems(PreUpdate, (look, move_hands).chain().after(bevy::input::InputSystems))
            .add_systems(EguiPrimaryContextPass, help);
    }
}

/// What the mouse moves.
#[derive(Resource)]
struct Mouse {
    side: Side,
    /// Distance of the carver from the eye, metres.
    reach: f32,
    yaw: f32,
    pitch: f32,
}

impl Default for Mouse {
    fn default() -> Self {
        Self { side: Side::Right, reach: 0.75, yaw: 0.0, pitch: FIRST_PITCH }
    }
}

fn spawn_eye(mut commands: Commands, rigs: Query<Entity, With<Rig>>) -> Result {
    commands.spawn((
        Eye,
        PrimaryEguiContext,
        Camera3d::default(),
        Projection::Perspective(PerspectiveProjection { near: NEAR, ..default() }),
        Transform::from_xyz(0.0, EYES, 0.0),
        ChildOf(rigs.single()?),
    ));
    Ok(())
}

fn reach_far(mut hands: Query<&mut Hand>) {
    for mut hand in &mut hands {
        hand.reach = GRABS_WITHIN;
    }
}

/// Turns the head, and sets the reach of the hand.
fn look(
    mut mouse: ResMut<Mouse>,
    buttons: Res<ButtonInput<MouseButton>>,
    (motion, scroll): (Res<AccumulatedMouseMotion>, Res<AccumulatedMouseScroll>),
    mut eyes: Query<&mut Transform, With<Eye>>,
) {
    if buttons.pressed(MouseButton::Right) {
        mouse.yaw -= RADIANS_PER_PIXEL * motion.delta.x;
        mouse.pitch = (mouse.pitch - RADIANS_PER_PIXEL * motion.delta.y).clamp(-FRAC_PI_2, FRAC_PI_2);
    }
    let notches = match scroll.unit {
        MouseScrollUnit::Line => scroll.delta.y,
        MouseScrollUnit::Pixel => NOTCHES_PER_PIXEL * scroll.delta.y,
    };
    mouse.reach = (mouse.reach * REACH_PER_NOTCH.powf(notches)).clamp(*REACH.start(), *REACH.end());
    for mut eye in &mut eyes {
        let rotation = Quat::from_euler(EulerRot::YXZ, mouse.yaw, mouse.pitch, 0.0);
        if eye.rotation != rotation {
            eye.rotation = rotation;
        }
    }
}

/// Writes what a headset would: places of the hands, and their controls.
fn move_hands(
    mut mouse: ResMut<Mouse>,
    keys: Res<ButtonInput<KeyCode>>,
    buttons: Res<ButtonInput<MouseButton>>,
    windows: Query<&Window, With<PrimaryWindow>>,
    eyes: Query<(&Camera, &Transform), With<Eye>>,
    mut hands: Query<(&mut Controls, &mut Transform), Without<Eye>>,
) {
    let (Ok((camera, eye)), Ok(window)) = (eyes.single(), windows.single()) else {
        return;
    };
    if keys.just_pressed(KeyCode::Tab) {
        mouse.side = if mouse.side == Side::Left { Side::Right } else { Side::Left };
    }
    // In the space of the rig, as hands of a headset are.
    let in_rig = GlobalTransform::from(*eye);
    let cursor = window.cursor_position().and_then(|at| camera.viewport_to_world(&in_rig, at).ok());
    for (mut controls, mut hand) in &mut hands {
        if controls.side != mouse.side {
            *controls = Controls { is_tracked: true, ..Controls::new(controls.side) };
            hand.set_if_neq(at_rest(eye, controls.side));
        } else if let Some(ray) = cursor {
            let carver = ray.get_point(mouse.reach);
            let place = carver + eye.rotation * (mirror(controls.side) * HAND);
            hand.set_if_neq(Transform::from_translation(place).looking_at(carver, eye.up()));
            let ray_start =
                Transform::from_translation(ray.get_point(RAY_START)).looking_to(ray.direction, eye.up());
            let aim = hand.compute_affine().inverse() * ray_start.compute_affine();
            *controls = Controls { aim: isometry(aim), ..pressed(controls.side, &keys, &buttons) };
        }
    }
}

/// What is to the right of the right hand is to the left of the left hand.
fn mirror(side: Side) -> Vec3 {
    Vec3::new(if side == Side::Left { -1.0 } else { 1.0 }, 1.0, 1.0)
}

/// The pose of the hand that does not follow the mouse: its panel faces the eye.
fn at_rest(eye: &Transform, side: Side) -> Transform {
    let panel = Isometry3d::new(eye.transform_point(mirror(side) * PANEL), eye.rotation);
    Transform::from_isometry(panel * wrist::PLACE.inverse())
}

fn isometry(affine: Affine3A) -> Isometry3d {
    let (_, rotation, translation) = affine.to_scale_rotation_translation();
    Isometry3d::new(translation, rotation)
}

/// The controls that keys and buttons press.
fn pressed(side: Side, keys: &ButtonInput<KeyCode>, buttons: &ButtonInput<MouseButton>) -> Controls {
    let is_shift = keys.any_pressed([KeyCode::ShiftLeft, KeyCode::ShiftRight]);
    let axis = |less: bool, more: bool| f32::from(more) - f32::from(less);
    let is_larger = keys.any_pressed([KeyCode::Equal, KeyCode::NumpadAdd]);
    let is_smaller = keys.any_pressed([KeyCode::Minus, KeyCode::NumpadSubtract]);
    let z = keys.pressed(KeyCode::KeyZ);
    Controls {
        grip: f32::from(keys.pressed(KeyCode::KeyG)),
        trigger: f32::from(buttons.pressed(MouseButton::Left)),
        stick: Vec2::new(
            axis(keys.pressed(KeyCode::ArrowLeft), keys.pressed(KeyCode::ArrowRight)),
            axis(is_smaller || z && is_shift, is_larger || z && !is_shift),
        ),
        stick_pressed: keys.pressed(KeyCode::KeyT),
        shape: keys.pressed(KeyCode::KeyC),
        operation: keys.pressed(KeyCode::KeyX),
        is_tracked: true,
        ..Controls::new(side)
    }
}

fn help(mut contexts: EguiContexts) -> Result {
    let area = Area::new("help".into()).anchor(Align2::RIGHT_BOTTOM, [-12.0, -12.0]).interactable(false);
    area.show(contexts.ctx_mut()?, |ui| {
        Frame::popup(ui.style()).show(ui, |ui| {
            Grid::new("help").num_columns(2).show(ui, |ui| {
                for [keys, effect] in HELP {
                    ui.label(RichText::new(keys).strong());
                    ui.label(effect);
                    ui.end_row();
                }
            });
        });
    });
    Ok(())
}
