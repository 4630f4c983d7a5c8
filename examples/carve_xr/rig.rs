//! The floor that the user stands on, with eyes and hands. It moves only when the user asks for it: by a jump to a place, or
//! by a turn of 30 degrees. Nothing glides.

use bevy::prelude::*;
use bevy_mod_xr::session::XrTrackingRoot;
use core::f32::consts::FRAC_PI_6;

use super::controls::{ControlSystems, Controls, Side};

/// Half the width and depth of the room, metres. The user stays this far within.
pub const ROOM: Vec2 = Vec2::new(3.0, 3.0);
const FROM_WALLS: f32 = 0.3;
/// Where the user stands first: before the stand, facing it.
const START: Transform = Transform::from_xyz(0.0, 0.0, 0.75);
/// Speed at which the arc leaves the hand, m/s. A higher one reaches farther, and is harder to aim.
const ARC_SPEED: f32 = 5.0;
const GRAVITY: Vec3 = Vec3::new(0.0, -9.81, 0.0);
/// Time between points of the arc, seconds.
const ARC_STEP_S: f32 = 0.03;
const ARC_POINTS: usize = 70;
/// Deflection of a stick to the side that turns, and that lets it turn again.
const TURN_AT: f32 = 0.7;
const TURN_AGAIN_AT: f32 = 0.4;
const TURN: f32 = FRAC_PI_6;
const RING_RADIUS: f32 = 0.2;
const ALLOWED: Color = Color::srgb(0.3, 0.9, 0.6);
const REFUSED: Color = Color::srgb(0.9, 0.35, 0.25);

pub struct RigPlugin;

impl Plugin for RigPlugin {
    fn build(&self, app: &mut App) {
        app.register_required_components::<Controls, Steering>().add_systems(Startup, spawn).add_systems(
            Update,
            (aim, move_rig, draw_arc.run_if(resource_exists::<GizmoConfigStore>))
                .chain()
                .in_set(ControlSystems),
        );
    }
}

/// The floor. Hands and eyes are its children.
#[derive(Component)]
#[require(Transform, Visibility)]
pub struct Rig;

/// A camera that the user sees through.
#[derive(Component, Default)]
pub struct Eye;

/// How a hand's stick moves the rig.
#[derive(Component, Clone, Debug, Default)]
struct Steering {
    /// The arc, while the stick is pressed down.
    arc: Vec<Vec3>,
    /// Where the arc meets the floor in the room.
    landing: Option<Vec3>,
    /// Whether the stick was let go in this frame.
    jumps: bool,
    /// Whether the stick is still to the side after a turn.
    has_turned: bool,
}

/// Spawns the rig with both hands. In a headset the tracking root is the rig.
fn spawn(mut commands: Commands, roots: Query<Entity, With<XrTrackingRoot>>) {
    let rig = roots.iter().next().unwrap_or_else(|| commands.spawn_empty().id());
    commands.entity(rig).insert((Rig, START));
    for side in [Side::Left, Side::Right] {
        commands.spawn((Controls::new(side), Transform::default(), Visibility::default(), ChildOf(rig)));
    }
}

/// Points of the flight of a stone that is thrown along -z, down to the floor.
pub fn arc(aim: Isometry3d) -> Vec<Vec3> {
    let velocity = ARC_SPEED * (aim.rotation * Vec3::NEG_Z);
    let at =
        |seconds: f32| Vec3::from(aim.translation) + seconds * velocity + 0.5 * seconds.powi(2) * GRAVITY;
    let mut points: Vec<_> = (0..ARC_POINTS).map(|index| at(index as f32 * ARC_STEP_S)).collect();
    if let Some(under) = points.iter().position(|point| point.y < 0.0).filter(|&under| under > 0) {
        let (above, below) = (points[under - 1], points[under]);
        points.truncate(under);
        points.push(above.lerp(below, above.y / (above.y - below.y)).with_y(0.0));
    }
    points
}

/// Where an arc lands; `None` outside of the room.
pub fn landing(arc: &[Vec3]) -> Option<Vec3> {
    let last = arc.last().filter(|last| last.y == 0.0)?;
    (last.xz().abs().cmple(ROOM - FROM_WALLS).all()).then_some(*last)
}

/// The rig after a jump that puts the head above `place`. The height of the floor stays.
pub fn jumped(rig: Transform, head: Vec3, place: Vec3) -> Transform {
    let way = (place - head).with_y(0.0);
    rig.with_translation(rig.translation + way)
}

/// The rig after a turn to the left about the head.
pub fn turned(mut rig: Transform, head: Vec3, angle: f32) -> Transform {
    rig.rotate_around(head, Quat::from_rotation_y(angle));
    rig
}

/// Aims while a stick is pressed down.
fn aim(
    rigs: Query<&Transform, (With<Rig>, Without<Controls>)>,
    mut hands: Query<(&Controls, &Transform, &mut Steering)>,
) {
    let Ok(rig) = rigs.single() else {
        return;
    };
    for (controls, hand, mut steering) in &mut hands {
        let is_aiming = controls.is_tracked && controls.stick_pressed;
        steering.jumps = !is_aiming && !steering.arc.is_empty();
        if is_aiming {
            let hand = *rig * *hand;
            let aim = Isometry3d::new(hand.translation, hand.rotation) * controls.aim;
            steering.arc = arc(aim);
            steering.landing = landing(&steering.arc);
        } else if !steering.arc.is_empty() {
            steering.arc.clear();
        }
    }
}

/// Jumps when a stick is let go, and turns once for each push to the side.
fn move_rig(
    mut rigs: Query<&mut Transform, With<Rig>>,
    eyes: Query<&Transform, (With<Eye>, Without<Rig>)>,
    mut hands: Query<(&Controls, &mut Steering)>,
) {
    let Ok(mut rig) = rigs.single_mut() else {
        return;
    };
    let head = eyes.iter().map(|eye| eye.translation).sum::<Vec3>() / eyes.iter().count().max(1) as f32;
    for (controls, mut steering) in &mut hands {
        if steering.jumps
            && let Some(place) = steering.landing.take()
        {
            *rig = jumped(*rig, rig.transform_point(head), place);
        }
        let aside = if controls.is_tracked && !controls.stick_pressed { controls.stick.x } else { 0.0 };
        if aside.abs() > TURN_AT && !steering.has_turned {
            *rig = turned(*rig, rig.transform_point(head), -TURN * aside.signum());
            steering.has_turned = true;
        } else if aside.abs() < TURN_AGAIN_AT && steering.has_turned {
            steering.has_turned = false;
        }
    }
}

fn draw_arc(hands: Query<&Steering>, mut gizmos: Gizmos) {
    for steering in hands.iter().filter(|steering| !steering.arc.is_empty()) {
        let color = if steering.landing.is_some() { ALLOWED } else { REFUSED };
        gizmos.linestrip(steering.arc.iter().copied(), color);
        if let Some(place) = steering.landing {
            let flat = Quat::from_rotation_x(-core::f32::consts::FRAC_PI_2);
            for radius in [RING_RADIUS, 0.9 * RING_RADIUS] {
                gizmos.circle(Isometry3d::new(place + 0.005 * Vec3::Y, flat), radius, color);
            }
        }
    }
}
