//! The motion that hands give to what they hold. Pure maths, in double precision.

use bevy::{
    math::{DAffine3, DMat3, DQuat, DVec3},
    prelude::*,
};

/// A place without shear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Similarity {
    pub translation: DVec3,
    pub rotation: DQuat,
    /// Negative where space is mirrored: a mirror image is a rotation of the image through the origin.
    pub scale: f64,
}

impl Similarity {
    /// The place of an affine transform, or nearly that if it shears; `None` if it is collapsed or not finite.
    pub fn of(affine: &DAffine3) -> Option<Self> {
        let scale = affine.matrix3.determinant().cbrt();
        if !affine.is_finite() || !scale.is_normal() {
            return None;
        }
        let linear = affine.matrix3 * scale.recip();
        let x = linear.x_axis.try_normalize()?;
        let y = (linear.y_axis - x * x.dot(linear.y_axis)).try_normalize()?;
        let rotation = DQuat::from_mat3(&DMat3::from_cols(x, y, x.cross(y)));
        Some(Self { translation: affine.translation, rotation, scale })
    }
}

/// A motion that maps the point `from` to the point `to`, turns and grows about it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    pub from: DVec3,
    pub to: DVec3,
    pub rotation: DQuat,
    pub scale: f64,
}

impl Motion {
    /// The motion of one hand.
    pub fn of_one(grab: &Similarity, now: &Similarity) -> Self {
        Self {
            from: grab.translation,
            to: now.translation,
            rotation: now.rotation * grab.rotation.inverse(),
            scale: now.scale / grab.scale,
        }
    }

    /// The motion that takes both hands along; `None` where hands are in the same place.
    ///
    /// The mean of both rotations turns the line between the hands almost to where it is. The shortest rotation does the rest.
    /// So a turn of the whole has no singular angle, as the shortest rotation alone would have at 180 degrees.
    pub fn of_two(grab: [&Similarity; 2], now: [&Similarity; 2]) -> Option<Self> {
        let between = |hands: [&Similarity; 2]| hands[1].translation - hands[0].translation;
        let middle = |hands: [&Similarity; 2]| hands[0].translation.midpoint(hands[1].translation);
        let (line_then, line_now) = (between(grab), between(now));
        let (then, at_present) = (line_then.try_normalize()?, line_now.try_normalize()?);
        let [first, second] = [0, 1].map(|hand: usize| now[hand].rotation * grab[hand].rotation.inverse());
        let sum = first + second;
        let mean = if sum.length_squared() > 1e-12 { sum.normalize() } else { first };
        let rest = DQuat::from_rotation_arc((mean * then).normalize(), at_present);
        Some(Self {
            from: middle(grab),
            to: middle(now),
            rotation: (rest * mean).normalize(),
            scale: line_now.length() / line_then.length(),
        })
    }

    /// Moves a transform.
    pub fn apply(&self, start: &Transform) -> Transform {
        let arm = start.translation.as_dvec3() - self.from;
        Transform {
            translation: (self.to + self.rotation * (self.scale * arm)).as_vec3(),
            rotation: (self.rotation * start.rotation.as_dquat()).as_quat(),
            scale: (self.scale * start.scale.as_dvec3()).as_vec3(),
        }
    }
}

/// The part of a growth by `factor` that keeps a scale within limits. A scale outside of the limits may stay there.
pub(super) fn limited(factor: f64, scale: Vec3, min: f32, max: f32) -> f64 {
    let size = scale.abs().max_element();
    if !(size > 0.0 && size.is_finite()) {
        return 1.0;
    }
    // `min` and `max` of numbers pass over NaN.
    let [least, most] = [min.min(size), max.max(size)].map(|limit| f64::from(limit) / f64::from(size));
    // Through the origin, a factor may be negative: its amount counts.
    factor.signum() * factor.abs().max(least).min(most)
}
