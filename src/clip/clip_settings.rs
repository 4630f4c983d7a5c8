//! Settings shared by all clip cameras, and how much room their maps take.

use bevy::prelude::*;

use super::{ClipMesh, MAX_CARVERS};
use crate::volume::{BytesTaken, VolumeBudget};

/// Layers in the texture arrays of all carvers together: as many as wgpu guarantees.
pub(crate) const MAX_LAYERS: u32 = 256;

/// Settings shared by all clip cameras.
#[derive(Resource, Reflect, Clone, Debug, PartialEq)]
#[reflect(Resource, Default, Debug, Clone, PartialEq)]
pub struct ClipSettings {
    /// Width and height of a depth map in texels, rounded up to a multiple of 16.
    ///
    /// More texels follow curved and slanted surfaces closer; memory grows with the square
    /// (8 bytes per texel and layer), the time of a carve frame hardly at all.
    pub depth_map_size: u32,
    /// The most layers that a clip mesh may take: pairs of a near and a far surface, one behind the
    /// other as its clip camera sees them. A mesh takes no more than it needs: a convex one has a
    /// single layer, a knot two or three.
    ///
    /// A lower bound saves memory and time where meshes have more; what does not fit is filled up
    /// to the farthest surface, with a warning ([`ClipMeshCutOff`](super::ClipMeshCutOff)). With 1
    /// every mesh is carved as published, from its nearest to its farthest surface.
    pub max_layers: u32,
    /// How much of a voxel is taken to be clipped.
    pub coverage: CoverageRule,
}

impl Default for ClipSettings {
    fn default() -> Self {
        Self { depth_map_size: 1024, max_layers: 8, coverage: CoverageRule::default() }
    }
}

/// How the share of a voxel that carvers leave (its coverage) is found; the opacity that occludes
/// others is multiplied by it.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
#[non_exhaustive]
pub enum CoverageRule {
    /// Integrated exactly along the clip camera's line of sight, over 9 lines and, where they
    /// disagree, a lattice of 29: changes steadily when a carver moves. A voxel that two carvers cut
    /// is counted by the published points.
    #[default]
    Lines,
    /// The published rule: 9 points are tested, and 32 more where they disagree. Jumps when a
    /// carver's face reaches the outermost points: by up to 0.29 measured for 1/32 voxel of motion.
    Points,
    /// One point, the voxel's centre: the cheapest, and the least steady.
    Center,
}

/// Layers that the arrays have room for; grows and shrinks with what clip meshes need.
///
/// Known in the main world: textures and what binds them follow the same number.
#[derive(Resource, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ClipCapacity {
    /// Layers in each array.
    pub layers: u32,
    /// The most that the budget allows.
    pub most: u32,
}

impl Default for ClipCapacity {
    fn default() -> Self {
        Self { layers: 1, most: MAX_LAYERS }
    }
}

/// Layers that clip meshes need, as far as their surfaces have been counted.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct LayersWanted(pub u32);

/// Bytes of the depth and dilation maps of one layer, and of what all share: depth maps have 8 bytes a texel,
/// dilation maps 16 for 8x8 texels; two surfaces and a count have 4 bytes a texel each, tiles 16 for 16x16 texels,
/// and peeling more than one layer takes 12 bytes a texel.
fn map_bytes(settings: &ClipSettings, peels: bool) -> [u64; 2] {
    let size = u64::from(settings.depth_map_size).max(16).next_multiple_of(16);
    let texels = size * size;
    let peeling = if peels { 12 * texels } else { 0 };
    [8 * texels + texels / 4, 12 * texels + texels / 16 + peeling]
}

/// Makes room for a layer per carver, and for more where they are known to need them, as far as the budget allows.
pub(super) fn update_capacity(
    carvers: Query<(), With<ClipMesh>>,
    wanted: Res<LayersWanted>,
    settings: Res<ClipSettings>,
    budget: Res<VolumeBudget>,
    mut taken: ResMut<BytesTaken>,
    mut capacity: ResMut<ClipCapacity>,
) {
    let carvers = carvers.iter().len().min(MAX_CARVERS) as u32;
    let [of_layer, shared] = map_bytes(&settings, wanted.0 > carvers);
    let spare = budget.max_bytes.saturating_sub(taken.by_volumes + taken.by_methods + shared);
    let most = (spare / of_layer.max(1)).clamp(1, MAX_LAYERS.into()) as u32;
    // The largest power of two that fits.
    let most = 1 << most.ilog2();
    let layers = carvers.max(wanted.0).clamp(1, MAX_LAYERS).next_power_of_two().min(most);
    capacity.set_if_neq(ClipCapacity { layers, most });
    taken.set_if_neq(BytesTaken { by_carvers: u64::from(layers) * of_layer + shared, ..*taken });
}
