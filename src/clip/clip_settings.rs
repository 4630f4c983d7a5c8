//! Settings shared by all clip cameras, and the memory of their maps.

use bevy::prelude::*;

use super::{ClipMesh, MAX_CARVERS};
use crate::volume::{BytesTaken, VolumeBudget};

/// Layers in the texture arrays of all carvers together: the number that wgpu guarantees.
pub(crate) const MAX_LAYERS: u32 = 256;

/// Settings shared by all clip cameras.
#[derive(Resource, Reflect, Clone, Debug, PartialEq)]
#[reflect(Resource, Default, Debug, Clone, PartialEq)]
pub struct ClipSettings {
    /// Width and height of a depth map in texels, rounded up to a multiple of 16.
    ///
    /// More texels follow curved and slanted surfaces more closely. Memory grows with the square of the size
    /// (8 bytes per texel and layer). The time of a carve frame hardly grows.
    pub depth_map_size: u32,
    /// Largest number of layers of a carver. A layer is a pair of a near and a far surface; the clip camera sees
    /// layers behind one another. A mesh takes only the layers it needs: a convex mesh one, a knot two or three.
    ///
    /// A lower bound saves memory and time for meshes with more layers. The layers beyond it are filled up to the
    /// farthest surface, with a warning ([`ClipMeshCutOff`](super::ClipMeshCutOff)). With 1, every mesh is carved as
    /// published, from its nearest to its farthest surface.
    pub max_layers: u32,
    /// Rule for the share of a voxel that carvers leave.
    pub coverage: CoverageRule,
}

impl Default for ClipSettings {
    fn default() -> Self {
        Self { depth_map_size: 1024, max_layers: 8, coverage: CoverageRule::default() }
    }
}

/// Rule for a voxel's coverage: the share of the voxel that carvers leave. The opacity that occludes other
/// voxels is multiplied by the coverage.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
#[non_exhaustive]
pub enum CoverageRule {
    /// Integrates exactly along the clip camera's line of sight, over 9 lines and, where they disagree, over a
    /// lattice of 29 lines. The coverage changes steadily when a carver moves. A voxel that two carvers cut uses
    /// the published points.
    #[default]
    Lines,
    /// The published rule: tests 9 points and, where they disagree, 32 more. The coverage jumps when a carver's face
    /// reaches the outermost points. The largest jump measured for 1/32 voxel of motion is 0.29.
    Points,
    /// Tests one point, the voxel's centre: the cheapest rule, and the least steady.
    Center,
}

/// Layers that the texture arrays have room for. The number follows the needs of the carvers.
///
/// It is known in the main world: textures and their bindings follow the same number.
#[derive(Resource, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ClipCapacity {
    /// Layers in each array.
    pub layers: u32,
    /// Largest number of layers that the budget allows.
    pub most: u32,
}

impl Default for ClipCapacity {
    fn default() -> Self {
        Self { layers: 1, most: MAX_LAYERS }
    }
}

/// Layers that all carvers get together, as far as their surfaces have been counted.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct LayersWanted(pub u32);

/// Bytes of the maps of one layer, and of the textures that all layers share.
///
/// Depth maps have 8 bytes a texel, dilation maps 16 for 8x8 texels. The shared textures are two surfaces and a count
/// (4 bytes a texel each), and tiles (16 bytes for 16x16 texels). Peeling more than one layer takes 12 bytes a texel.
fn map_bytes(settings: &ClipSettings, peels: bool) -> [u64; 2] {
    let size = u64::from(settings.depth_map_size).max(16).next_multiple_of(16);
    let texels = size * size;
    let peeling = if peels { 12 * texels } else { 0 };
    [8 * texels + texels / 4, 12 * texels + texels / 16 + peeling]
}

/// Makes room for one layer per carver, and for more layers where carvers need them, within the budget.
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
