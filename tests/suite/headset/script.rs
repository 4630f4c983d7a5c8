//! What head and hands do, frame by frame.

use bevy::prelude::*;
use std::f32::consts::TAU;

use super::{remote::RemoteHand, scene::VOLUME_AT};

/// Length of the script.
pub const FRAMES: u32 = 1000;
/// Frames of a part. At the end of each everything rests.
const PART: u32 = 100;
pub const AT_REST_FROM: u32 = 85;

/// Where everything is in a frame.
#[derive(Clone, Copy, Debug)]
pub struct Moment {
    pub head: Transform,
    /// Left and right.
    pub hands: [RemoteHand; 2],
    pub part: Part,
    /// Frame of the part. From [`AT_REST_FROM`] on nothing moves.
    pub in_part: u32,
}

/// Parts follow each other, and begin again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The right hand carves, the head rests.
    Carve,
    /// Nothing carves, the head walks around.
    Look,
    /// Both hands carve while the head walks.
    Both,
    /// The left hand takes the volume along, the right one carves.
    Take,
}

impl Moment {
    pub fn of(frame: u32) -> Self {
        let (part, in_part) = (Part::nth(frame / PART), frame % PART);
        let time = in_part.min(AT_REST_FROM) as f32 / AT_REST_FROM as f32;
        // Each part begins where the last one ended: head and hands walk on only while they move.
        let walked = |parts: &[Part]| {
            let done = (0..frame / PART).filter(|k| parts.contains(&Part::nth(*k))).count() as f32;
            done + if parts.contains(&part) { time } else { 0.0 }
        };
        let head = head_at(walked(&[Part::Look, Part::Both]));
        let right = walked(&[Part::Carve, Part::Both, Part::Take]);
        let left = walked(&[Part::Both, Part::Take]);
        let pulls = |does: bool| f32::from(does && in_part > 2);
        let hands = [
            RemoteHand {
                pose: hand_at(-1.0, left),
                trigger: pulls(part == Part::Both),
                grip: pulls(part == Part::Take),
                ..default()
            },
            RemoteHand { pose: hand_at(1.0, right), trigger: pulls(part != Part::Look), ..default() },
        ];
        Self { head, hands, part, in_part }
    }
}

impl Part {
    pub const COUNT: usize = 4;
    pub const ALL: [Self; Self::COUNT] = [Self::Carve, Self::Look, Self::Both, Self::Take];

    fn nth(k: u32) -> Self {
        Self::ALL[k as usize % Self::COUNT]
    }
}

/// The head on its way around the volume.
fn head_at(walked: f32) -> Transform {
    let angle = 0.25 * TAU * walked;
    let place = VOLUME_AT + Vec3::new(0.4 * angle.sin(), 0.1 * (2.0 * angle).sin(), 0.4 * angle.cos());
    Transform::from_translation(place).looking_at(VOLUME_AT - 0.12 * Vec3::Y, Vec3::Y)
}

/// A hand on its way through the volume.
fn hand_at(side: f32, walked: f32) -> Transform {
    let angle = TAU * (0.4 * walked + 0.1 * side);
    let side_m = side * (0.05 + 0.04 * angle.cos());
    let place = Vec3::new(side_m, 0.07 * angle.sin(), 0.05 + 0.06 * (1.3 * angle).cos());
    Transform::from_translation(VOLUME_AT + place).with_rotation(Quat::from_euler(
        EulerRot::YXZ,
        0.4 * angle,
        0.3 * side,
        0.2,
    ))
}
