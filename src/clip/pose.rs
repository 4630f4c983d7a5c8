//! Deforms the vertices of carvers by skinning and morph targets.
//!
//! Bevy deforms vertices on the GPU, for each view. The clip camera needs the deformed vertices and their
//! bounds once per change, in the carver's own space. So the vertices are deformed here.

use bevy::{
    math::DMat4,
    mesh::{
        MeshVertexAttribute, VertexAttributeValues,
        morph::{MeshMorphWeights, MorphWeights},
        skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    },
    prelude::*,
};

use super::{ClipMesh, ClipMeshFailed, RelativePoses};

/// A deformed copy of a clip mesh, for its clip camera.
#[derive(Component)]
pub(crate) struct PosedMesh {
    pub mesh: Handle<Mesh>,
    pose: Pose,
}

/// Joints and weights that deform a mesh. A rig that moves as a whole keeps its pose.
#[derive(Clone, PartialEq)]
struct Pose {
    of: AssetId<Mesh>,
    /// Local mesh space → carver space for every joint; empty without joints.
    joints: Vec<Mat4>,
    /// Weight of every morph target.
    weights: Vec<f32>,
}

impl Pose {
    /// Makes a copy of the mesh's triangles with deformed corners.
    fn apply(&self, mesh: &Mesh) -> Result<Mesh, &'static str> {
        let no_data = "its vertices are not kept in the main world, so it cannot be deformed";
        let attribute =
            |attribute: MeshVertexAttribute| mesh.try_attribute_option(attribute).map_err(|_| no_data);
        let Some(VertexAttributeValues::Float32x3(positions)) = attribute(Mesh::ATTRIBUTE_POSITION)? else {
            return Err("it has no positions");
        };
        let mut positions: Vec<_> = positions.iter().copied().map(Vec3::from).collect();
        if let Ok(targets) = mesh.try_morph_targets() {
            for (target, weight) in targets.chunks(positions.len().max(1)).zip(&self.weights) {
                for (position, difference) in positions.iter_mut().zip(target) {
                    *position += *weight * difference.position;
                }
            }
        }
        if !self.joints.is_empty()
            && let Some(VertexAttributeValues::Uint16x4(joints)) = attribute(Mesh::ATTRIBUTE_JOINT_INDEX)?
            && let Some(VertexAttributeValues::Float32x4(weights)) = attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT)?
        {
            for ((position, joints), weights) in positions.iter_mut().zip(joints).zip(weights) {
                let joint = |k: u16| self.joints.get(usize::from(k)).copied().unwrap_or_default();
                let blended = joints.iter().zip(weights).map(|(&k, &weight)| joint(k) * weight);
                *position = blended.fold(Mat4::ZERO, |sum, matrix| sum + matrix).transform_point3(*position);
            }
        }
        let mut posed = Mesh::new(mesh.primitive_topology(), default());
        if let Some(indices) = mesh.try_indices_option().map_err(|_| no_data)? {
            posed.insert_indices(indices.clone());
        }
        let positions: Vec<_> = positions.iter().map(Vec3::to_array).collect();
        Ok(posed.with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions))
    }
}

type Deforms = Or<(With<SkinnedMesh>, With<MeshMorphWeights>)>;

/// Deforms carvers whose pose or vertices changed.
pub(super) fn pose_meshes(
    mut commands: Commands,
    mut carvers: Query<
        (Entity, &Mesh3d, Option<&SkinnedMesh>, Option<&MeshMorphWeights>, Option<&mut PosedMesh>),
        (With<ClipMesh>, Deforms),
    >,
    poses: RelativePoses,
    morphs: Query<&MorphWeights>,
    bindposes: Res<Assets<SkinnedMeshInverseBindposes>>,
    mut events: MessageReader<AssetEvent<Mesh>>,
    mut meshes: ResMut<Assets<Mesh>>,
) {
    let modified: Vec<_> = events
        .read()
        .filter_map(|event| if let AssetEvent::Modified { id } = event { Some(*id) } else { None })
        .collect();
    for (entity, base, skin, morph, posed) in &mut carvers {
        let joints = match skin {
            Some(skin) => match joints_of(skin, entity, &poses, &bindposes) {
                Some(joints) => joints,
                // A joint is missing: the last pose stays.
                None => continue,
            },
            None => Vec::new(),
        };
        let weights = match morph {
            Some(MeshMorphWeights::Value { weights }) => weights.clone(),
            Some(MeshMorphWeights::Reference(entity)) => {
                morphs.get(*entity).map(|morph| morph.weights().to_vec()).unwrap_or_default()
            }
            None => Vec::new(),
        };
        if !weights.iter().all(|weight| weight.is_finite()) {
            continue;
        }
        let pose = Pose { of: base.id(), joints, weights };
        let is_modified = modified.contains(&pose.of);
        if posed.as_ref().is_some_and(|posed| posed.pose == pose) && !is_modified {
            continue;
        }
        let Some(mesh) = meshes.get(&base.0) else {
            continue;
        };
        match (pose.apply(mesh), posed) {
            (Ok(deformed), Some(mut posed)) if posed.mesh != base.0 => {
                let _ = meshes.insert(&posed.mesh, deformed);
                posed.pose = pose;
            }
            (Ok(deformed), _) => {
                commands.entity(entity).try_insert(PosedMesh { mesh: meshes.add(deformed), pose });
            }
            // The mesh carves undeformed, as reported before.
            (Err(_), Some(mut posed)) if posed.mesh == base.0 => posed.pose = pose,
            (Err(reason), _) => {
                warn!("the clip mesh on {entity} does not follow its pose: {reason}");
                commands.trigger(ClipMeshFailed { entity, reason: reason.to_string() });
                commands.entity(entity).try_insert(PosedMesh { mesh: base.0.clone(), pose });
            }
        }
    }
}

/// The joints' matrices in the carver's space; `None` if anything is missing, collapsed or not finite. They
/// are rounded to a part in 100,000, so that a rig that moves as a whole keeps its pose.
fn joints_of(
    skin: &SkinnedMesh,
    carver: Entity,
    poses: &RelativePoses,
    bindposes: &Assets<SkinnedMeshInverseBindposes>,
) -> Option<Vec<Mat4>> {
    let bindposes = bindposes.get(&skin.inverse_bindposes)?;
    let matrices = skin.joints.iter().zip(bindposes.iter()).map(|(&joint, &bindpose)| {
        let carver_from_joint = DMat4::from(poses.between(joint, carver)?).as_mat4();
        let matrix = carver_from_joint * bindpose;
        matrix.is_finite().then_some(matrix)
    });
    let mut matrices: Vec<_> = matrices.collect::<Option<_>>()?;
    let entries = matrices.iter().flat_map(Mat4::to_cols_array);
    let largest = entries.fold(f32::MIN_POSITIVE, |largest, entry| largest.max(entry.abs()));
    // A power of two, so that rounding to it is exact.
    let step = (largest.log2().ceil() - 17.0).exp2();
    for matrix in &mut matrices {
        *matrix = Mat4::from_cols_array(&matrix.to_cols_array().map(|entry| (entry / step).round() * step));
    }
    Some(matrices)
}

/// Removes the copy from entities that no longer deform.
pub(super) fn remove_poses(
    mut commands: Commands,
    orphans: Query<Entity, (With<PosedMesh>, Or<(Without<ClipMesh>, Without<Mesh3d>)>)>,
    rigid: Query<Entity, (With<PosedMesh>, Without<SkinnedMesh>, Without<MeshMorphWeights>)>,
) {
    for entity in orphans.iter().chain(&rigid) {
        commands.entity(entity).try_remove::<PosedMesh>();
    }
}
