//! Test for points inside a closed mesh, by winding number: the reference for carving with that mesh.

use super::shapes::Triangles;
use bevy::prelude::*;
use parry3d::{
    math::Vector,
    query::{PointQuery, Ray, RayCast},
    shape::TriMesh,
};

/// Directions of rays. A shape made from round numbers is unlikely to have a face or an edge parallel to them.
const DIRECTIONS: [[f32; 3]; 3] =
    [[0.531_7, 0.270_3, 0.802_6], [-0.653_9, 0.728_1, 0.205_7], [0.303_7, -0.871_9, -0.384_1]];

/// Tells whether points are inside a mesh and how far they are from its surface.
pub struct InsideTest {
    mesh: TriMesh,
}

impl InsideTest {
    /// The test for a closed mesh of at least one triangle.
    pub fn new(triangles: &Triangles) -> Self {
        let positions = triangles.positions.iter().map(|&p| Vector::from(p)).collect();
        let mesh = TriMesh::new(positions, triangles.indices.clone());
        Self { mesh: mesh.expect("the mesh has triangles") }
    }

    /// Whether a point is inside: the surface winds around it, either way. Overlapping parts are united. A part that
    /// faces inwards inside another part is a cavity.
    pub fn contains(&self, p: Vec3) -> bool {
        // A ray can slip between two triangles, or meet both where they join. That is too rare to happen to two of
        // three rays.
        let winding = |ray: usize| self.winding(p, DIRECTIONS[ray]);
        let (a, b) = (winding(0), winding(1));
        let agreed = if a == b { a } else { winding(2) };
        agreed != 0
    }

    /// Distance to the surface.
    pub fn distance(&self, p: Vec3) -> f32 {
        let p = Vector::from(p.to_array());
        self.mesh.project_local_point(p, false).point.distance(p)
    }

    /// Number of times a ray from the point leaves the mesh, minus the times it enters.
    fn winding(&self, p: Vec3, direction: [f32; 3]) -> i32 {
        let ray = Ray::new(Vector::from(p.to_array()), Vector::from(direction));
        let near = self.mesh.bvh().leaves(|node| node.aabb().intersects_local_ray(&ray, f32::MAX));
        near.map(|id| self.mesh.triangle(id))
            .filter(|triangle| triangle.intersects_local_ray(&ray, f32::MAX))
            .map(|triangle| if triangle.scaled_normal().dot(ray.dir) > 0.0 { 1 } else { -1 })
            .sum()
    }
}
