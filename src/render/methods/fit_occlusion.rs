//! Which occlusion is computed for a volume: in the main world, so that what draws agrees with what computes.

use bevy::{prelude::*, render::renderer::RenderDevice};

use super::{filtering, method_bytes::MethodBytes, sweeping};
use crate::{
    occlusion::{
        AmbientOcclusion, FittedOcclusion, GeometryTerm, OcclusionFailed, OcclusionFallback, OcclusionLimit,
        OcclusionMethod, OcclusionShortfall, OcclusionSweeping,
    },
    render::volumes::occlusion_texels::OcclusionTexels,
    volume::{BytesTaken, LookupTable, StoredBytes, VolumeBudget},
};

/// What the method of some settings keeps for so many voxels.
fn method_bytes(occlusion: &AmbientOcclusion, dimensions: UVec3, stored: StoredBytes) -> MethodBytes {
    let texels = OcclusionTexels::of(occlusion);
    let voxels = dimensions.as_u64vec3().element_product();
    let buffers = match &occlusion.method {
        OcclusionMethod::Progressive(_) => MethodBytes::of_buffers(&[4 * voxels]),
        OcclusionMethod::Sweeping(settings) => sweeping::method_bytes(settings, dimensions),
        OcclusionMethod::Filtering(settings) => filtering::method_bytes(settings, dimensions),
        _ => MethodBytes::default(),
    };
    let texture = texels.bytes(dimensions, stored.scalar).saturating_sub(voxels * stored.scalar);
    MethodBytes { total: buffers.total + texture, ..buffers }
}

/// What there is for one method.
struct Room {
    most_buffer: u64,
    most_texels_z: u32,
    most_bytes: u64,
}

/// Keeps a volume's occlusion within the device and the budget.
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
            most_buffer: limits.max_storage_buffer_binding_size.min(limits.max_buffer_size),
            most_texels_z: limits.max_texture_dimension_3d,
            most_bytes: budget.most_bytes.saturating_sub(others),
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
        let Some((amount, limit, most)) = self.missing(&occlusion, needed, dimensions) else {
            return FittedOcclusion { occlusion, shortfall: None, bytes: needed.total };
        };
        let (method, fallback) = match occlusion.method {
            OcclusionMethod::Progressive(_) => (OcclusionMethod::Rays, OcclusionFallback::AllRaysAtOnce),
            OcclusionMethod::Sweeping(settings) if settings.geometry_term != GeometryTerm::None => {
                let settings = OcclusionSweeping { geometry_term: GeometryTerm::None, ..settings };
                (OcclusionMethod::Sweeping(settings), OcclusionFallback::NoGeometryTerm)
            }
            _ => (OcclusionMethod::Rays, OcclusionFallback::Unoccluded),
        };
        let shortfall = OcclusionShortfall { needed: amount, limit, most, fallback };
        let less = AmbientOcclusion { method, ..occlusion };
        let fitted = match fallback {
            OcclusionFallback::Unoccluded => FittedOcclusion { occlusion: less, shortfall: None, bytes: 0 },
            _ => self.fit(less, dimensions, stored),
        };
        // What is left when less does not fit either is what counts.
        FittedOcclusion { shortfall: fitted.shortfall.or(Some(shortfall)), ..fitted }
    }

    /// What is missing, if anything is: how much is needed, what limits it, and to how much.
    fn missing(
        &self,
        occlusion: &AmbientOcclusion,
        needed: MethodBytes,
        dimensions: UVec3,
    ) -> Option<(u64, OcclusionLimit, u64)> {
        let texels = OcclusionTexels::of(occlusion).size(dimensions);
        if needed.largest_buffer > self.most_buffer {
            Some((needed.largest_buffer, OcclusionLimit::Buffer, self.most_buffer))
        } else if texels.z > self.most_texels_z {
            let (needed, most) = (u64::from(texels.z), u64::from(self.most_texels_z));
            Some((needed, OcclusionLimit::Texture, most))
        } else if needed.total > self.most_bytes {
            Some((needed.total, OcclusionLimit::Budget, self.most_bytes))
        } else {
            None
        }
    }
}
