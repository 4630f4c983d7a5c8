//! The occlusion that is computed for a volume: as set, or reduced to fit the device and the budget.

use bevy::{prelude::*, render::renderer::RenderDevice};

use super::{
    AmbientOcclusion, MethodBytes, OcclusionFailed, OcclusionFallback, OcclusionLimit, OcclusionShortfall,
    Reconstruction, VolumeLighting,
};
use crate::volume::{BytesTaken, LookupTable, StoredBytes, VolumeBudget};

/// The occlusion that is computed for a volume: as set, or reduced to fit.
#[derive(Component, Clone, Debug, PartialEq)]
pub(crate) struct FittedOcclusion {
    /// Settings within their valid ranges.
    pub occlusion: AmbientOcclusion,
    pub shortfall: Option<OcclusionShortfall>,
    /// Bytes that the method takes beside the volume's own.
    pub bytes: u64,
}

impl FittedOcclusion {
    /// Whether any occlusion is computed.
    pub fn has_occlusion(&self) -> bool {
        self.shortfall.is_none_or(|shortfall| shortfall.fallback != OcclusionFallback::Unoccluded)
    }
}

/// The occlusion that is computed and drawn, the filter, the light, the kind of transfer function, and outlines. While pipelines are being compiled these are the
/// previous ones.
#[derive(Component, PartialEq)]
pub(crate) struct ShownOcclusion {
    pub fitted: FittedOcclusion,
    pub reconstruction: Reconstruction,
    pub lighting: VolumeLighting,
    /// Whether the transfer function follows the gradient.
    pub by_gradient: bool,
    pub outline_rays: u32,
}

/// Memory that a method takes for a volume of these dimensions, with the occlusion texture beyond a scalar a voxel.
fn method_bytes(occlusion: &AmbientOcclusion, dimensions: UVec3, stored: StoredBytes) -> MethodBytes {
    let bytes = occlusion.method.settings().bytes(dimensions);
    let voxels = dimensions.as_u64vec3().element_product();
    let texture = occlusion.texels().bytes(dimensions, stored.scalar);
    MethodBytes { total: bytes.total + texture.saturating_sub(voxels * stored.scalar), ..bytes }
}

/// Limits for one method.
struct Room {
    max_buffer: u64,
    max_texels_z: u32,
    max_bytes: u64,
}

/// Keeps the occlusion of every volume within the limits of the device and the budget.
pub(crate) fn fit_occlusion(
    mut commands: Commands,
    mut volumes: Query<(Entity, &LookupTable, &AmbientOcclusion, Option<&mut FittedOcclusion>)>,
    orphans: Query<Entity, (With<FittedOcclusion>, Without<LookupTable>)>,
    budget: Res<VolumeBudget>,
    stored: Res<StoredBytes>,
    device: Res<RenderDevice>,
    mut taken: ResMut<BytesTaken>,
) {
    let limits = device.limits();
    let mut by_methods: u64 = volumes.iter().filter_map(|(_, _, _, fitted)| Some(fitted?.bytes)).sum();
    for (entity, table, wanted, fitted) in &mut volumes {
        let own = fitted.as_ref().map_or(0, |fitted| fitted.bytes);
        let others = by_methods - own + taken.by_volumes + taken.by_carvers;
        let room = Room {
            max_buffer: limits.max_storage_buffer_binding_size.min(limits.max_buffer_size),
            max_texels_z: limits.max_texture_dimension_3d,
            max_bytes: budget.max_bytes.saturating_sub(others),
        };
        let new = room.fit(wanted.clamped(), table.geometry.dimensions, *stored);
        by_methods = by_methods - own + new.bytes;
        let before = fitted.as_ref().and_then(|fitted| fitted.shortfall);
        if let Some(shortfall) = new.shortfall.filter(|_| new.shortfall != before) {
            commands.trigger(OcclusionFailed { entity, shortfall });
        }
        match fitted {
            Some(mut fitted) => {
                fitted.set_if_neq(new);
            }
            None => {
                commands.entity(entity).try_insert(new);
            }
        }
    }
    for entity in &orphans {
        commands.entity(entity).try_remove::<FittedOcclusion>();
    }
    taken.set_if_neq(BytesTaken { by_methods, ..*taken });
}

impl Room {
    fn fit(&self, occlusion: AmbientOcclusion, dimensions: UVec3, stored: StoredBytes) -> FittedOcclusion {
        let needed = method_bytes(&occlusion, dimensions, stored);
        let Some((amount, limit, max)) = self.missing(&occlusion, needed, dimensions) else {
            return FittedOcclusion { occlusion, shortfall: None, bytes: needed.total };
        };
        let unoccluded = || (default(), OcclusionFallback::Unoccluded);
        let (method, fallback) = occlusion.method.instead().unwrap_or_else(unoccluded);
        let shortfall = OcclusionShortfall { needed: amount, limit, max, fallback };
        let less = AmbientOcclusion { method, ..occlusion };
        let fitted = match fallback {
            OcclusionFallback::Unoccluded => FittedOcclusion { occlusion: less, shortfall: None, bytes: 0 },
            _ => self.fit(less, dimensions, stored),
        };
        // If the reduced settings do not fit either, their shortfall replaces this one.
        FittedOcclusion { shortfall: fitted.shortfall.or(Some(shortfall)), ..fitted }
    }

    /// The limit that is exceeded, if any: the amount needed, the kind of limit, and its value.
    fn missing(
        &self,
        occlusion: &AmbientOcclusion,
        needed: MethodBytes,
        dimensions: UVec3,
    ) -> Option<(u64, OcclusionLimit, u64)> {
        let texels = occlusion.texels().size(dimensions);
        if needed.largest_buffer > self.max_buffer {
            Some((needed.largest_buffer, OcclusionLimit::Buffer, self.max_buffer))
        } else if texels.z > self.max_texels_z {
            let (needed, max) = (u64::from(texels.z), u64::from(self.max_texels_z));
            Some((needed, OcclusionLimit::Texture, max))
        } else if needed.total > self.max_bytes {
            Some((needed.total, OcclusionLimit::Budget, self.max_bytes))
        } else {
            None
        }
    }
}
