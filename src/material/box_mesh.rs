//! The box of a volume, on whose back faces the volume is drawn.

use bevy::{
    asset::RenderAssetUsages,
    mesh::{Indices, PrimitiveTopology},
    prelude::*,
};

use crate::volume::VolumeGeometry;

/// The box that the voxels fill, in volume space (mm), with its faces outwards.
pub(super) fn box_mesh(geometry: &VolumeGeometry) -> Mesh {
    // Corners of each face, counter-clockwise seen from outside for a right-handed grid.
    const FACES: [[u32; 4]; 6] =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let corners = geometry.corners().map(|corner| corner.as_vec3().to_array());
    let is_mirrored = geometry.local_from_voxel.matrix3.determinant() < 0.0;
    let triangles = FACES.iter().flat_map(
        |&[a, b, c, d]| {
            if is_mirrored { [a, c, b, a, d, c] } else { [a, b, c, a, c, d] }
        },
    );
    // Only the renderer keeps the triangles: picking passes through the box to objects behind it.
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::RENDER_WORLD)
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, corners.to_vec())
        .with_inserted_indices(Indices::U32(triangles.collect()))
}
