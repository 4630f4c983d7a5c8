//! The orthographic frame fixed to a clip mesh, from which its depth maps are rendered.

use bevy::{
    camera::primitives::MeshAabb,
    math::{Affine3A, DMat3, DVec3, Mat3, Vec2, Vec3},
    mesh::{PrimitiveTopology, VertexAttributeValues},
    platform::collections::HashSet,
    prelude::*,
};

use super::{ClipMesh, ClipMeshFailed, pose::PosedMesh};

/// The clip camera of a [`ClipMesh`], inserted and kept up to date by the plugin.
///
/// The camera is fixed to the mesh (paper, section 3.2). It changes with the mesh's vertices, never with the
/// pose, so moving a carver re-renders no maps.
#[derive(Component, Clone, Debug, PartialEq)]
pub struct ClipCamera {
    /// View from which the depth maps are rendered; `None` if the mesh cannot be rendered.
    pub frame: Option<ClipFrame>,
    /// Mesh in view: the entity's own mesh, or a deformed copy of it.
    pub mesh: AssetId<Mesh>,
    /// Number of changes of the mesh. Each change renders the depth maps again.
    pub revision: u32,
}

/// An axis-aligned orthographic view of a mesh: maps the mesh's local space to *clip map space*.
///
/// In clip map space, x and y in [0, 1] address the depth map (y down). The depth is z in [0, 1].
///
/// The view looks along the shortest side of the mesh's bounding box. Along this side, a flat, hollow
/// shape (a ring, a torus) hides the least of itself. So its nearest and farthest surfaces describe it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClipFrame {
    linear: Mat3,
    translation: Vec3,
}

/// Share of the extent that is left free on each side: one texel of a 512 map. It keeps surfaces off the border texels
/// and the depth limits.
const MARGIN: f32 = 1.0 / 512.0;

impl ClipFrame {
    /// The view of a bounding box given by its centre and half extents (local mesh units).
    ///
    /// `None` if the box is empty or not finite. A flat box is given a little thickness.
    pub fn around(center: Vec3, half_extents: Vec3) -> Option<Self> {
        let largest = half_extents.max_element();
        if !center.is_finite() || !half_extents.is_finite() || largest <= 0.0 {
            return None;
        }
        let half = half_extents.max(Vec3::splat(largest * 1e-4)) * (1.0 + 2.0 * MARGIN);
        let axes = if half.z <= half.x && half.z <= half.y {
            [Vec3::X, Vec3::NEG_Y, Vec3::NEG_Z]
        } else if half.y <= half.x {
            [Vec3::X, Vec3::Z, Vec3::NEG_Y]
        } else {
            [Vec3::Z, Vec3::NEG_Y, Vec3::X]
        };
        // Rows: each clip map axis as a function of the local position.
        let rows = axes.map(|axis| axis / (2.0 * half.dot(axis.abs())));
        let linear = Mat3::from_cols(rows[0], rows[1], rows[2]).transpose();
        Some(Self { linear, translation: Vec3::splat(0.5) - linear * center })
    }

    /// Local mesh space → clip map space.
    pub fn clip_from_local(&self) -> Affine3A {
        Affine3A::from_mat3_translation(self.linear, self.translation)
    }

    /// Half axes, in clip map space, of an axis-aligned ellipsoid that contains a ball of `reach` world units.
    ///
    /// `world_from_local` maps the carver's local space to the world. The ellipsoid is exact unless the carver is
    /// sheared; then it is larger.
    ///
    /// `None` if the carver is collapsed (a zero or non-finite scale).
    pub fn reach_radii(&self, world_from_local: Mat3, reach: f32) -> Option<Vec3> {
        let world_from_clip = world_from_local.as_dmat3() * self.linear.as_dmat3().inverse();
        // A ball of the world is the set |world_from_clip v| <= reach, i.e. v^T gram v <= reach².
        let gram = world_from_clip.transpose() * world_from_clip;
        let diagonal = DVec3::new(gram.x_axis.x, gram.y_axis.y, gram.z_axis.z);
        if !diagonal.is_finite() || diagonal.min_element() <= 1e-18 {
            return None;
        }
        // With unit diagonal, smallest eigenvalue * identity <= gram. So the ellipsoid of the scaled identity
        // contains the ellipsoid of the gram matrix.
        let scale = diagonal.map(f64::sqrt);
        let unit = DMat3::from_diagonal(scale.recip()) * gram * DMat3::from_diagonal(scale.recip());
        let smallest = smallest_eigenvalue(unit);
        if smallest <= 1e-6 {
            return None;
        }
        Some((DVec3::splat(reach as f64 / smallest.sqrt()) / scale).as_vec3())
    }
}

/// Smallest eigenvalue of a symmetric 3x3 matrix (trigonometric solution of the cubic).
fn smallest_eigenvalue(m: DMat3) -> f64 {
    let off = m.y_axis.x.powi(2) + m.z_axis.x.powi(2) + m.z_axis.y.powi(2);
    let diagonal = DVec3::new(m.x_axis.x, m.y_axis.y, m.z_axis.z);
    if off < 1e-20 {
        return diagonal.min_element();
    }
    let mean = diagonal.element_sum() / 3.0;
    let p = (((diagonal - mean).length_squared() + 2.0 * off) / 6.0).sqrt();
    let r = ((m - DMat3::from_diagonal(DVec3::splat(mean))) * (1.0 / p)).determinant() / 2.0;
    let angle = r.clamp(-1.0, 1.0).acos() / 3.0;
    mean + 2.0 * p * (angle + std::f64::consts::TAU / 3.0).cos()
}

/// The part of clip map space that the dilation maps cover: the depth maps' unit square, widened
/// by the reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DilationFrame {
    /// Lower corner, clip map space.
    pub min: Vec2,
    /// Width and height, clip map space.
    pub size: Vec2,
}

impl DilationFrame {
    /// The frame for a dilation by an ellipsoid of the given half axes (clip map space).
    pub fn for_radii(radii: Vec3) -> Self {
        // A little more than the reach: rounding must not push an affected point outside.
        let margin = radii.truncate() * 1.001;
        Self { min: -margin, size: Vec2::ONE + 2.0 * margin }
    }
}

/// Gives every carver a clip camera, and a new clip camera when its mesh or vertices change.
pub(super) fn update_clip_cameras(
    mut commands: Commands,
    mut events: MessageReader<AssetEvent<Mesh>>,
    meshes: Res<Assets<Mesh>>,
    carvers: Query<(Entity, &Mesh3d, Option<&PosedMesh>, Option<&ClipCamera>), With<ClipMesh>>,
    mut modified: Local<HashSet<AssetId<Mesh>>>,
) {
    modified.clear();
    modified.extend(events.read().filter_map(|event| match event {
        AssetEvent::Added { id } | AssetEvent::Modified { id } => Some(*id),
        _ => None,
    }));
    for (entity, mesh, posed, camera) in &carvers {
        let id = posed.map_or(mesh.id(), |posed| posed.mesh.id());
        let is_modified = modified.contains(&id);
        if camera.is_some_and(|camera| camera.mesh == id) && !is_modified {
            continue;
        }
        let Some(mesh) = meshes.get(id) else {
            continue;
        };
        let frame = frame_of(mesh);
        let revision = camera.map_or(0, |camera| camera.revision + 1);
        commands.entity(entity).try_insert(ClipCamera { frame: frame.ok(), mesh: id, revision });
        if let Err(reason) = frame {
            warn!("the clip mesh on {entity} has no effect: {reason}");
            commands.trigger(ClipMeshFailed { entity, reason: reason.to_string() });
        }
    }
}

/// The view of a mesh, or the reason why it cannot carve.
fn frame_of(mesh: &Mesh) -> Result<ClipFrame, &'static str> {
    if !matches!(
        mesh.primitive_topology(),
        PrimitiveTopology::TriangleList | PrimitiveTopology::TriangleStrip
    ) {
        return Err("it is not made of triangles");
    }
    if let Ok(VertexAttributeValues::Float32x3(positions)) = mesh.try_attribute(Mesh::ATTRIBUTE_POSITION)
        && !positions.iter().flatten().all(|coordinate| coordinate.is_finite())
    {
        return Err("a position is not finite");
    }
    let aabb = mesh.compute_aabb().ok_or("it has no positions")?;
    ClipFrame::around(aabb.center.into(), aabb.half_extents.into()).ok_or("it has no extent")
}

/// Removes the clip camera from entities that are no longer carvers.
pub(super) fn remove_clip_cameras(
    mut commands: Commands,
    orphans: Query<Entity, (With<ClipCamera>, Or<(Without<ClipMesh>, Without<Mesh3d>)>)>,
) {
    for entity in &orphans {
        commands.entity(entity).try_remove::<ClipCamera>();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_box_fills_the_map_and_its_shortest_side_is_the_depth() {
        let (center, half) = (Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 0.5, 2.0));
        let clip = ClipFrame::around(center, half).unwrap().clip_from_local();
        for corner in 0..8 {
            let sign = Vec3::from_array([0, 1, 2].map(|axis| ((corner >> axis) & 1) as f32 * 2.0 - 1.0));
            let p = clip.transform_point3(center + half * sign);
            assert!(p.cmpgt(Vec3::ZERO).all() && p.cmplt(Vec3::ONE).all(), "{p}");
            assert!((p - 0.5).abs().cmpgt(Vec3::splat(0.497)).all(), "{p}");
        }
        let along_y = clip.transform_vector3(Vec3::Y);
        assert_eq!((along_y.x, along_y.y), (0.0, 0.0));
        assert!(ClipFrame::around(center, Vec3::ZERO).is_none());
        assert!(ClipFrame::around(Vec3::NAN, half).is_none());
    }

    #[test]
    fn the_reach_ellipsoid_contains_the_ball() {
        let frame = ClipFrame::around(Vec3::ZERO, Vec3::new(3.0, 2.0, 1.0)).unwrap();
        let shear =
            Mat3::from_cols(Vec3::new(1.0, 0.2, 0.0), Vec3::new(0.4, -2.0, 0.3), Vec3::new(0.0, 0.1, 0.7));
        for world_from_local in [Mat3::IDENTITY, Mat3::from_rotation_y(0.7) * 2.0, shear] {
            let radii = frame.reach_radii(world_from_local, 0.5).unwrap();
            let clip_from_world = frame.linear * world_from_local.inverse();
            for k in 0..200 {
                let direction = crate::occlusion::fibonacci_direction(k, 200).as_vec3();
                let v = clip_from_world * (direction * 0.5) / radii;
                assert!(v.length() <= 1.0 + 1e-5, "{v} for {world_from_local}");
            }
        }
        assert!(frame.reach_radii(Mat3::ZERO, 0.5).is_none());
        assert!(frame.reach_radii(Mat3::NAN, 0.5).is_none());
    }
}
