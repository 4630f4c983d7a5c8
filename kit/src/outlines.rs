//! Outlines of the shapes that people carve with: thin tubes along circles and edges.

use bevy::{mesh::MeshMergeError, prelude::*};
use core::f32::consts::{FRAC_PI_2, TAU};

/// Tubes of one radius. The unit is that of the shapes.
#[derive(Clone, Copy, Debug)]
pub struct Outlines {
    /// Radius of the tubes.
    pub line_radius: f32,
}

impl Outlines {
    /// Three circles around a sphere.
    pub fn sphere(self, radius: f32) -> Result<Mesh, MeshMergeError> {
        let [around_x, around_z] = [Quat::from_rotation_x(FRAC_PI_2), Quat::from_rotation_z(FRAC_PI_2)];
        let turns = [Quat::IDENTITY, around_x, around_z];
        self.merged(turns.map(|rotation| self.circle(radius).rotated_by(rotation)))
    }

    /// The twelve edges of a box, given half its size.
    pub fn cuboid(self, half: Vec3) -> Result<Mesh, MeshMergeError> {
        let along = [Vec3::X, Vec3::Y, Vec3::Z];
        let signs = [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]];
        self.merged((0..3).flat_map(|axis| {
            signs.map(|[a, b]| {
                let (first, second) = (along[(axis + 1) % 3], along[(axis + 2) % 3]);
                let thickness = Vec3::splat(2.0 * self.line_radius);
                let edge = Cuboid::from_size(thickness + 2.0 * half * along[axis]);
                Mesh::from(edge).translated_by(half * (a * first + b * second))
            })
        }))
    }

    /// Four circles along a ring around the y axis, and eight across it.
    pub fn torus(self, major_radius: f32, minor_radius: f32) -> Result<Mesh, MeshMergeError> {
        let along = [
            self.circle(major_radius - minor_radius),
            self.circle(major_radius + minor_radius),
            self.circle(major_radius).translated_by(minor_radius * Vec3::Y),
            self.circle(major_radius).translated_by(-minor_radius * Vec3::Y),
        ];
        let across = (0..8).map(|k| {
            self.circle(minor_radius)
                .rotated_by(Quat::from_rotation_x(FRAC_PI_2))
                .translated_by(major_radius * Vec3::X)
                .rotated_by(Quat::from_rotation_y(k as f32 * TAU / 8.0))
        });
        self.merged(along.into_iter().chain(across))
    }

    /// A circle around the y axis.
    pub fn circle(self, radius: f32) -> Mesh {
        let tube = Torus { minor_radius: self.line_radius, major_radius: radius };
        tube.mesh().minor_resolution(6).major_resolution(96).build()
    }

    /// One mesh of several.
    pub fn merged(self, parts: impl IntoIterator<Item = Mesh>) -> Result<Mesh, MeshMergeError> {
        let mut parts = parts.into_iter();
        let Some(mut all) = parts.next() else {
            return Ok(Sphere::new(self.line_radius).into());
        };
        for part in parts {
            all.merge(&part)?;
        }
        Ok(all)
    }
}
