//! Closed triangle meshes made from a few numbers, for carvers and for tests. The inside of each mesh is known or can
//! be computed exactly.

use bevy::{
    asset::RenderAssetUsages,
    math::Affine3A,
    mesh::{Indices, PrimitiveTopology},
    prelude::*,
};
use std::f32::consts::{FRAC_PI_2, TAU};

/// A mesh as plain triangles, outward facing (counter-clockwise from outside).
///
/// Every mesh made here is closed and welded: corners that coincide are one vertex.
#[derive(Clone, Debug)]
pub struct Triangles {
    /// The corners, mesh units.
    pub positions: Vec<[f32; 3]>,
    /// Three corners for each triangle.
    pub indices: Vec<[u32; 3]>,
}

impl Triangles {
    /// A sphere about the origin with its poles on y; the vertices lie on the sphere. It has `subdivisions` bands
    /// from pole to pole, each of twice as many sides.
    pub fn sphere(radius: f32, subdivisions: u32) -> Self {
        let profile: Vec<_> = arc(radius, -FRAC_PI_2, FRAC_PI_2, subdivisions).collect();
        revolution(&on_axis(profile), 2 * subdivisions)
    }

    /// A cuboid about the origin; `size` is its extent from face to face.
    pub fn cuboid(size: Vec3) -> Self {
        let (x, y) = (0.5 * size.x, 0.5 * size.y);
        prism(&[vec2(-x, -y), vec2(x, -y), vec2(x, y), vec2(-x, y)], size.z)
    }

    /// A torus about the y axis: a tube of radius `minor` along a circle of radius `major`.
    pub fn torus(major: f32, minor: f32, major_segments: u32, minor_segments: u32) -> Self {
        let circle = |t: f32| major * vec3(t.sin(), 0.0, t.cos());
        closed_tube(circle, minor, major_segments, minor_segments)
    }

    /// The lower half of a spherical shell about the origin, open towards +y and with a flat rim. `segments` is the
    /// number of sides around; the hemispheres have a quarter as many bands.
    pub fn bowl(outer_radius: f32, inner_radius: f32, segments: u32) -> Self {
        let bands = (segments / 4).max(2);
        let outer = arc(outer_radius, -FRAC_PI_2, 0.0, bands);
        let inner = arc(inner_radius, 0.0, -FRAC_PI_2, bands);
        revolution(&on_axis(outer.chain(inner).collect()), segments)
    }

    /// A tube along a trefoil knot about the z axis. The curve reaches `3 * scale` from that axis and `scale` to
    /// either side along it. Strands pass `1.21 * scale` apart, so a tube of radius up to `0.6 * scale` does not meet
    /// itself.
    pub fn trefoil_tube(scale: f32, tube_radius: f32, segments: u32, sides: u32) -> Self {
        let knot = |t: f32| {
            let (x, y) = (t.sin() + 2.0 * (2.0 * t).sin(), t.cos() - 2.0 * (2.0 * t).cos());
            scale * vec3(x, y, -(3.0 * t).sin())
        };
        closed_tube(knot, tube_radius, segments, sides)
    }

    /// Two legs at a right angle, one along x and one along y. They are `leg` long, measured outside, and `depth`
    /// wide along z. Their bounding box is centred on the origin.
    pub fn l_bracket(leg: f32, thickness: f32, depth: f32) -> Self {
        // The inner corner comes first: it sees all other corners, as the fan over the ends needs.
        let (t, l) = (thickness, leg);
        let outline = [(t, t), (t, l), (0.0, l), (0.0, 0.0), (l, 0.0), (l, t)];
        prism(&outline.map(|(x, y)| vec2(x, y) - 0.5 * leg), depth)
    }

    /// Two spheres in one mesh. Their centres are `distance` apart on x, with the origin between them.
    pub fn two_spheres(radius: f32, distance: f32, subdivisions: u32) -> Self {
        let sphere = |x| Self::sphere(radius, subdivisions).translated(vec3(x, 0.0, 0.0));
        sphere(-0.5 * distance).merged(sphere(0.5 * distance))
    }

    /// Both meshes as one.
    pub fn merged(mut self, other: Self) -> Self {
        let offset = self.positions.len() as u32;
        self.positions.extend(other.positions);
        self.indices.extend(other.indices.into_iter().map(|triangle| triangle.map(|i| i + offset)));
        self
    }

    /// The mesh with each corner moved. It faces as before even if `transform` mirrors.
    pub fn transformed(mut self, transform: Affine3A) -> Self {
        for position in &mut self.positions {
            *position = transform.transform_point3(Vec3::from_array(*position)).to_array();
        }
        if transform.matrix3.determinant() < 0.0 { self.flipped() } else { self }
    }

    /// The mesh moved by an offset.
    pub fn translated(self, offset: Vec3) -> Self {
        self.transformed(Affine3A::from_translation(offset))
    }

    /// The mesh turned about the origin.
    pub fn rotated(self, rotation: Quat) -> Self {
        self.transformed(Affine3A::from_quat(rotation))
    }

    /// The mesh scaled about the origin along each axis.
    pub fn scaled(self, scale: Vec3) -> Self {
        self.transformed(Affine3A::from_scale(scale))
    }

    /// The mesh with every other triangle reversed: its winding says nothing.
    pub fn half_flipped(mut self) -> Self {
        for triangle in self.indices.iter_mut().step_by(2) {
            triangle.swap(0, 1);
        }
        self
    }

    /// The mesh with its triangles facing the other way.
    pub fn flipped(mut self) -> Self {
        for [_, b, c] in &mut self.indices {
            std::mem::swap(b, c);
        }
        self
    }

    /// The corners of each triangle.
    pub fn corners(&self) -> impl Iterator<Item = [Vec3; 3]> {
        self.indices.iter().map(|triangle| triangle.map(|i| self.positions[i as usize].into()))
    }

    /// The mesh for Bevy; it has neither normals nor texture coordinates.
    pub fn mesh(&self) -> Mesh {
        Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
            .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, self.positions.clone())
            .with_inserted_indices(Indices::U32(self.indices.as_flattened().to_vec()))
    }
}

/// `steps + 1` points on a circle about the origin, from one angle to another.
fn arc(radius: f32, from: f32, to: f32, steps: u32) -> impl Iterator<Item = Vec2> {
    (0..=steps).map(move |i| radius * Vec2::from_angle(from + (to - from) * i as f32 / steps as f32))
}

/// The profile with both ends exactly on the axis; rounding may have left them beside it.
fn on_axis(mut profile: Vec<Vec2>) -> Vec<Vec2> {
    for end in [0, profile.len() - 1] {
        profile[end].x = 0.0;
    }
    profile
}

/// Solid of revolution of a profile of (radius, height) about the y axis. Both ends of the profile lie on the axis,
/// and the inside is on its left.
fn revolution(profile: &[Vec2], sides: u32) -> Triangles {
    let (last, top) = (profile.len() as u32 - 1, 1 + (profile.len() as u32 - 2) * sides);
    let point = |p: &Vec2, side| {
        let (sin, cos) = (TAU * side as f32 / sides as f32).sin_cos();
        [p.x * sin, p.y, p.x * cos]
    };
    // Each end is one vertex.
    let vertices = |(i, p)| (0..if i == 0 || i == last { 1 } else { sides }).map(move |side| point(p, side));
    Triangles {
        positions: (0..).zip(profile).flat_map(vertices).collect(),
        indices: grid(last, sides, |ring, side| match ring {
            0 => 0,
            ring if ring == last => top,
            ring => 1 + (ring - 1) * sides + side % sides,
        }),
    }
}

/// A tube along a closed curve, given as a function of 0..2 pi.
fn closed_tube(curve: impl Fn(f32) -> Vec3, radius: f32, rings: u32, sides: u32) -> Triangles {
    let turn = |i: u32, n: u32| TAU * i as f32 / n as f32;
    let centre = |ring: u32| curve(turn(ring % rings, rings));
    let tangent = |ring: u32| (centre(ring + 1) - centre(ring + rings - 1)).normalize();
    // One normal is carried along the curve without turning about it, so no bend upsets it. It comes back turned by
    // some angle. Removing that angle little by little closes the tube.
    let first = tangent(0).any_orthonormal_vector();
    let carried = |normal: &mut Vec3, ring| {
        let here = *normal;
        *normal = Quat::from_rotation_arc(tangent(ring), tangent(ring + 1)) * here;
        Some(here)
    };
    let normals: Vec<Vec3> = (0..=rings).scan(first, carried).collect();
    let last = normals[rings as usize];
    let twist = last.cross(first).dot(tangent(0)).atan2(last.dot(first));
    let point = |ring: u32, side: u32| {
        let normal = normals[ring as usize];
        let angle = turn(side, sides) + twist * ring as f32 / rings as f32;
        let arm = normal * angle.cos() + tangent(ring).cross(normal) * angle.sin();
        (centre(ring) + radius * arm).to_array()
    };
    Triangles {
        positions: (0..rings)
            .flat_map(|ring| (0..sides).map(move |side| (ring, side)))
            .map(|(r, s)| point(r, s))
            .collect(),
        indices: grid(rings, sides, |ring, side| ring % rings * sides + side % sides),
    }
}

/// A prism: a counter-clockwise polygon in x and y, extended along z to both sides of the origin. The polygon's first
/// corner sees all the others.
fn prism(outline: &[Vec2], depth: f32) -> Triangles {
    let n = outline.len() as u32;
    let at = |z: f32| outline.iter().map(move |p| [p.x, p.y, z]);
    let mut indices = grid(1, n, |ring, side| ring * n + side % n);
    indices.extend((1..n - 1).flat_map(|i| [[0, i + 1, i], [n, n + i, n + i + 1]]));
    Triangles { positions: at(-0.5 * depth).chain(at(0.5 * depth)).collect(), indices }
}

/// Triangles between rings of vertices. Seen from outside, sides count to the right and rings upwards. Triangles
/// without area are left out, where `vertex` makes a ring one point.
fn grid(bands: u32, sides: u32, vertex: impl Fn(u32, u32) -> u32) -> Vec<[u32; 3]> {
    let quad = |(ring, side): (u32, u32)| {
        let (a, b) = (vertex(ring, side), vertex(ring, side + 1));
        let (c, d) = (vertex(ring + 1, side + 1), vertex(ring + 1, side));
        [[a, b, c], [a, c, d]]
    };
    (0..bands)
        .flat_map(|ring| (0..sides).map(move |side| (ring, side)))
        .flat_map(quad)
        .filter(|[a, b, c]| a != b && b != c && c != a)
        .collect()
}
