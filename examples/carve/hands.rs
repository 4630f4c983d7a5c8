//! Moving, turning and scaling the carvers with pointer and keys.

use bevy::{
    input::mouse::{AccumulatedMouseScroll, MouseScrollUnit},
    picking::hover::Hovered,
    prelude::*,
};
use bevy_contextual_ao::prelude::*;
use bevy_egui::input::egui_wants_any_keyboard_input;
use bevy_panorbit_camera::PanOrbitCamera;

use super::carvers::Carver;

/// Effects of keys and pointer, for the panel.
pub const HELP: [[&str; 2]; 15] = [
    ["drag a carver", "move it"],
    ["scroll over it", "nearer, farther"],
    ["double click", "put the selected carver there"],
    ["drag elsewhere", "orbit (right: pan, scroll: zoom)"],
    ["Tab", "select the next carver"],
    ["Q  E", "nearer, farther"],
    ["W A S D, arrows", "rotate"],
    ["Z  X", "smaller, larger"],
    ["Space", "remove or keep what is inside"],
    ["R", "all carvers back to their start"],
    ["1 to 5", "shading mode"],
    ["Delete", "remove the selected point"],
    ["P", "save a picture"],
    ["G", "show clip cameras, reaches, listed bricks"],
    ["drop files", "open them, or a folder"],
];
/// Share of the distance to the camera by which one notch of the wheel moves a carver.
const DEPTH_PER_NOTCH: f32 = 0.015;
/// The same share per second, while a key is held.
const DEPTH_PER_SECOND: f32 = 0.15;
/// Notches of a wheel in one pixel of a touch pad.
const NOTCHES_PER_PIXEL: f32 = 0.02;
/// Turn of a carver, radians per second.
const TURN_PER_SECOND: f32 = 1.2;
/// Natural logarithm of the scale, per second.
const GROWTH_PER_SECOND: f32 = 0.7;

pub struct HandsPlugin;

impl Plugin for HandsPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Hand>().add_observer(grab).add_observer(drag).add_observer(put).add_systems(
            Update,
            (
                (select_next, toggle_operation, reset, press_keys)
                    .chain()
                    .run_if(not(egui_wants_any_keyboard_input)),
                (let_go, scroll, lend_pointer_to_camera).chain(),
            ),
        );
    }
}

/// The carvers that pointer and keys act on.
#[derive(Resource, Default)]
pub struct Hand {
    /// The carver that keys move.
    pub selected: Option<Entity>,
    /// The carver that is dragged.
    pub grabbed: Option<Entity>,
}

/// The scene's camera; the panel's camera has no orbit.
type Eye = (With<PanOrbitCamera>, Without<Carver>);

fn grab(press: On<Pointer<Press>>, carvers: Query<(), With<Carver>>, mut hand: ResMut<Hand>) {
    if press.button == PointerButton::Primary && carvers.contains(press.entity) {
        hand.selected = Some(press.entity);
        hand.grabbed = Some(press.entity);
    }
}

fn let_go(buttons: Res<ButtonInput<MouseButton>>, mut hand: ResMut<Hand>) {
    if hand.grabbed.is_some() && !buttons.pressed(MouseButton::Left) {
        hand.grabbed = None;
    }
}

/// Moves a carver with the pointer, in the plane that faces the camera and holds the carver's centre.
fn drag(
    drag: On<Pointer<Drag>>,
    mut carvers: Query<&mut Transform, With<Carver>>,
    cameras: Query<(&Camera, &GlobalTransform), Eye>,
) -> Result {
    let (PointerButton::Primary, Ok(mut carver)) = (drag.button, carvers.get_mut(drag.entity)) else {
        return Ok(());
    };
    let (camera, eye) = cameras.single()?;
    let plane = InfinitePlane3d::new(eye.forward());
    let pointed_at = |position: Vec2| {
        let ray = camera.viewport_to_world(eye, position).ok()?;
        ray.plane_intersection_point(carver.translation, plane)
    };
    let now = drag.pointer_location.position;
    // The pointer meets no plane if the carver is behind the camera.
    if let (Some(from), Some(to)) = (pointed_at(now - drag.delta), pointed_at(now)) {
        carver.translation += to - from;
    }
    Ok(())
}

/// Puts the selected carver onto what a double click hits of a volume. Clicks on a carver are for the carver.
pub fn put(
    click: On<Pointer<Click>>,
    hand: Res<Hand>,
    mut carvers: Query<(&mut Transform, &Hovered), With<Carver>>,
) {
    // The event goes on to the volume's parents and to the window.
    let Some(hit) = click.hit.extra_as::<VolumeHit>().filter(|hit| hit.volume == click.entity) else {
        return;
    };
    let is_on_carver = carvers.iter().any(|(_, hovered)| hovered.get());
    if click.button != PointerButton::Primary || click.count != 2 || is_on_carver {
        return;
    }
    if let Some((mut carver, _)) = hand.selected.and_then(|entity| carvers.get_mut(entity).ok()) {
        carver.translation = hit.position;
    }
}

/// The carver that scrolling acts on: the carver in the hand, or else the carver under the idle pointer.
fn carver_under_pointer(
    hand: &Hand,
    buttons: &ButtonInput<MouseButton>,
    carvers: &Query<(Entity, &Hovered), With<Carver>>,
) -> Option<Entity> {
    let is_idle = buttons.get_pressed().len() == 0;
    let hovered = || carvers.iter().find(|(_, hovered)| hovered.get());
    hand.grabbed.or_else(|| hovered().filter(|_| is_idle).map(|(entity, _)| entity))
}

fn scroll(
    wheel: Res<AccumulatedMouseScroll>,
    hand: Res<Hand>,
    buttons: Res<ButtonInput<MouseButton>>,
    hovered: Query<(Entity, &Hovered), With<Carver>>,
    mut carvers: Query<&mut Transform, With<Carver>>,
    cameras: Query<&GlobalTransform, Eye>,
) -> Result {
    if wheel.delta.y == 0.0 {
        return Ok(());
    }
    let notches = match wheel.unit {
        MouseScrollUnit::Line => wheel.delta.y,
        MouseScrollUnit::Pixel => wheel.delta.y * NOTCHES_PER_PIXEL,
    };
    if let Some(entity) = carver_under_pointer(&hand, &buttons, &hovered) {
        push(&mut *carvers.get_mut(entity)?, cameras.single()?, notches * DEPTH_PER_NOTCH);
    }
    Ok(())
}

/// Moves a carver away from the camera by a share of its distance.
fn push(carver: &mut Transform, eye: &GlobalTransform, share: f32) {
    let distance = eye.translation().distance(carver.translation);
    carver.translation += eye.forward() * (share * distance);
}

/// Lets the camera have the pointer and the wheel while no carver needs them.
fn lend_pointer_to_camera(
    hand: Res<Hand>,
    buttons: Res<ButtonInput<MouseButton>>,
    hovered: Query<(Entity, &Hovered), With<Carver>>,
    mut cameras: Query<&mut PanOrbitCamera>,
) {
    let is_free = carver_under_pointer(&hand, &buttons, &hovered).is_none();
    for mut camera in &mut cameras {
        if camera.enabled != is_free {
            camera.enabled = is_free;
        }
    }
}

fn select_next(keys: Res<ButtonInput<KeyCode>>, carvers: Query<(Entity, &Carver)>, mut hand: ResMut<Hand>) {
    if !keys.just_pressed(KeyCode::Tab) {
        return;
    }
    let mut order: Vec<_> = carvers.iter().collect();
    order.sort_by_key(|(_, carver)| carver.index);
    let selected = order.iter().position(|&(entity, _)| hand.selected == Some(entity));
    let next = selected.map_or(0, |index| index + 1);
    hand.selected = order.get(next).or(order.first()).map(|&(entity, _)| entity);
}

fn toggle_operation(keys: Res<ButtonInput<KeyCode>>, hand: Res<Hand>, mut carvers: Query<&mut ClipMesh>) {
    if !keys.just_pressed(KeyCode::Space) {
        return;
    }
    if let Some(mut carver) = hand.selected.and_then(|entity| carvers.get_mut(entity).ok()) {
        carver.operation = match carver.operation {
            ClipOperation::Subtract => ClipOperation::Intersect,
            _ => ClipOperation::Subtract,
        };
    }
}

fn reset(keys: Res<ButtonInput<KeyCode>>, mut carvers: Query<(&Carver, &mut Transform, &mut ClipMesh)>) {
    if keys.just_pressed(KeyCode::KeyR) {
        for (carver, mut transform, mut clip) in &mut carvers {
            *transform = carver.home;
            clip.set_if_neq(ClipMesh::default());
        }
    }
}

/// Moves, turns and scales the selected carver while keys are held.
fn press_keys(
    keys: Res<ButtonInput<KeyCode>>,
    time: Res<Time>,
    hand: Res<Hand>,
    mut carvers: Query<&mut Transform, With<Carver>>,
    cameras: Query<&GlobalTransform, Eye>,
) -> Result {
    let Some(mut carver) = hand.selected.and_then(|entity| carvers.get_mut(entity).ok()) else {
        return Ok(());
    };
    let axis = |less: &[KeyCode], more: &[KeyCode]| {
        let held = |keys_of: &[KeyCode]| f32::from(keys_of.iter().any(|&key| is_held(&keys, key)));
        (held(more) - held(less)) * time.delta_secs()
    };
    let depth = axis(&[KeyCode::KeyQ], &[KeyCode::KeyE]);
    let growth = axis(&[KeyCode::KeyZ], &[KeyCode::KeyX]);
    let turn = Vec2::new(
        axis(&[KeyCode::KeyW, KeyCode::ArrowUp], &[KeyCode::KeyS, KeyCode::ArrowDown]),
        axis(&[KeyCode::KeyA, KeyCode::ArrowLeft], &[KeyCode::KeyD, KeyCode::ArrowRight]),
    );
    // An untouched carver must not count as changed.
    if (depth, growth, turn) == (0.0, 0.0, Vec2::ZERO) {
        return Ok(());
    }
    let eye = cameras.single()?;
    push(&mut carver, eye, depth * DEPTH_PER_SECOND);
    carver.scale *= (growth * GROWTH_PER_SECOND).exp();
    let [pitch, yaw] = (turn * TURN_PER_SECOND).to_array();
    carver.rotate(Quat::from_axis_angle(*eye.right(), pitch) * Quat::from_axis_angle(*eye.up(), yaw));
    Ok(())
}

/// Whether a key is down, or was for less than a frame.
fn is_held(keys: &ButtonInput<KeyCode>, key: KeyCode) -> bool {
    keys.pressed(key) || keys.just_pressed(key)
}
