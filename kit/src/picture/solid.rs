//! Solids with exact signed distances.

use bevy::math::{DQuat, DVec2, DVec3};

/// A solid; lengths in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Solid {
    /// A ball.
    Ball { center: DVec3, radius: f64 },
    /// All between two planes at equal distances from the origin. `normal` is a unit vector.
    Slab { normal: DVec3, thickness: f64 },
    /// A box about the origin, turned by `turn`; `size` is from face to face.
    Box { size: DVec3, turn: DQuat },
    /// A tube of radius `tube` along a circle of radius `ring`; the axis is y, turned by `turn`.
    Torus { center: DVec3, ring: f64, tube: f64, turn: DQuat },
}

impl Solid {
    /// Distance from the surface, mm; negative inside.
    pub fn distance(&self, p: DVec3) -> f64 {
        match *self {
            Self::Ball { center, radius } => p.distance(center) - radius,
            Self::Slab { normal, thickness } => p.dot(normal).abs() - 0.5 * thickness,
            Self::Box { size, turn } => {
                let beyond = (turn.inverse() * p).abs() - 0.5 * size;
                beyond.max(DVec3::ZERO).length() + beyond.max_element().min(0.0)
            }
            Self::Torus { center, ring, tube, turn } => {
                let q = turn.inverse() * (p - center);
                DVec2::new(DVec2::new(q.x, q.z).length() - ring, q.y).length() - tube
            }
        }
    }

    /// A profile of an edge at a point: that of the nearest face, less that of the face behind it. Only slabs are so thin
    /// that the face behind matters. The profile takes distances outside a face, in units of `unit_mm`.
    pub fn profile_at(&self, p: DVec3, unit_mm: f64, profile: fn(f64) -> f64) -> f64 {
        let distance = self.distance(p);
        let behind = match *self {
            Self::Slab { thickness, .. } => profile((distance + thickness) / unit_mm),
            _ => 0.0,
        };
        profile(distance / unit_mm) - behind
    }

    /// Direction in which the distance grows, a unit vector. On edges it is that of one side.
    pub fn normal(&self, p: DVec3) -> DVec3 {
        match *self {
            Self::Ball { center, .. } => (p - center).normalize_or_zero(),
            Self::Slab { normal, .. } => normal * p.dot(normal).signum(),
            Self::Box { size, turn } => {
                let q = turn.inverse() * p;
                let beyond = q.abs() - 0.5 * size;
                let out = if beyond.max_element() > 0.0 {
                    beyond.max(DVec3::ZERO)
                } else {
                    DVec3::AXES[beyond.max_position()]
                };
                turn * (out.normalize() * q.signum())
            }
            Self::Torus { center, ring, turn, .. } => {
                let q = turn.inverse() * (p - center);
                let on_ring = DVec3::new(q.x, 0.0, q.z).normalize_or_zero() * ring;
                turn * (q - on_ring).normalize_or_zero()
            }
        }
    }
}
