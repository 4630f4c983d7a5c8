//! The transfer function of one volume as a table: what the GPU reads.

use bevy::{
    color::{ColorToComponents, Srgba},
    platform::collections::HashSet,
    prelude::*,
};
use std::sync::Arc;

use super::{
    OcclusionProgress, ShownVolume, TransferFunction, Volume, VolumeGeometry, VolumeLoaded,
    VolumeTransferFunction,
};

/// The transfer function of a [`Volume3d`](super::Volume3d) over the volume's range of intensities,
/// inserted and kept up to date by the plugin.
#[derive(Component, Clone, Debug, PartialEq)]
pub struct LookupTable {
    /// [`LookupTable::ENTRIES`] values, evenly spaced over [`LookupTable::stored_range`]: linear
    /// RGB and the opacity per unit distance, 0 to 1.
    pub entries: Arc<Vec<[f32; 4]>>,
    /// Stored intensities of the first and the last entry. Beyond them the function is constant.
    pub stored_range: [f64; 2],
    /// Length, mm, over which the entries' opacity accumulates.
    pub opacity_unit_distance_mm: f32,
    /// The volume's grid.
    pub geometry: VolumeGeometry,
    /// Counts changes.
    pub revision: u32,
    /// Counts changes of the volume's data.
    pub volume_revision: u32,
}

impl LookupTable {
    /// Number of entries: a 12-bit CT keeps every intensity apart.
    pub const ENTRIES: usize = 4096;

    pub(crate) fn bake(
        function: &TransferFunction,
        volume: &Volume,
        revision: u32,
        volume_revision: u32,
    ) -> Self {
        let [lo, hi] = volume.stored_range().map(f64::from);
        // Only where the function varies: a narrow window of a 16-bit volume gets all entries. One
        // intensity more at either end, so that a step there has both its sides.
        let ends = [function.points.first(), function.points.last()]
            .map(|point| point.map_or(0.0, |point| volume.to_stored(point.value as f64)));
        let start = (ends[0].min(ends[1]).floor() - 1.0).clamp(lo, hi);
        let end = (ends[0].max(ends[1]).ceil() + 1.0).clamp(lo, hi);
        // Where there are entries enough, every stored intensity has one of its own.
        let (span, last) = (end - start, (Self::ENTRIES - 1) as f64);
        let step = if span <= last { (last / span.max(1.0)).floor().recip() } else { span / last };
        let entries = (0..Self::ENTRIES)
            .map(|k| {
                let value = volume.to_file_units(start + k as f64 * step);
                let [r, g, b, opacity] = function.sample(value as f32);
                // Control points hold display colours; light adds up linearly.
                let [r, g, b] = LinearRgba::from(Srgba::rgb(r, g, b)).to_f32_array_no_alpha();
                [r, g, b, opacity]
            })
            .collect();
        Self {
            entries: Arc::new(entries),
            stored_range: [start, start + last * step],
            opacity_unit_distance_mm: function.opacity_unit_distance_mm,
            geometry: VolumeGeometry::of(volume),
            revision,
            volume_revision,
        }
    }
}

/// Bakes the table of every volume whose data or transfer function changed, and takes it from
/// those that cannot (or can no longer) be shown.
pub(super) fn bake_lookup_tables(
    mut commands: Commands,
    mut function_events: MessageReader<AssetEvent<TransferFunction>>,
    volumes: Res<Assets<Volume>>,
    functions: Res<Assets<TransferFunction>>,
    entities: Query<(Entity, Ref<ShownVolume>, Ref<VolumeTransferFunction>, Option<&LookupTable>)>,
    orphans: Query<Entity, (With<LookupTable>, Without<ShownVolume>)>,
) {
    let changed_functions: HashSet<_> = function_events.read().filter_map(changed).collect();
    for (entity, volume, function, table) in &entities {
        let volume_changed = volume.is_changed();
        let changed = volume_changed || function.is_changed() || changed_functions.contains(&function.id());
        if table.is_some() && !changed {
            continue;
        }
        let baked = volume.volume.as_ref().and_then(|volume| {
            let volume = volumes.get(volume)?;
            let function = if function.0 == Handle::default() {
                &TransferFunction::for_volume(volume)
            } else {
                functions.get(&function.0)?
            };
            let (revision, volume_revision) = table.map_or((0, 0), |table| {
                (table.revision + 1, table.volume_revision + u32::from(volume_changed))
            });
            Some(LookupTable::bake(function, volume, revision, volume_revision))
        });
        match baked {
            Some(baked) => {
                let is_new = table.is_none() || volume_changed;
                commands.entity(entity).try_insert((baked, OcclusionProgress(0.0)));
                if is_new {
                    commands.trigger(VolumeLoaded { entity });
                }
            }
            None if table.is_some() => {
                let mut entity = commands.entity(entity);
                entity.try_remove::<LookupTable>().try_insert(OcclusionProgress(0.0));
            }
            None => {}
        }
    }
    for entity in &orphans {
        commands.entity(entity).try_remove::<LookupTable>();
    }
}

/// The asset that an event changes, if it does. One that was added is missed by no table.
fn changed<A: Asset>(event: &AssetEvent<A>) -> Option<AssetId<A>> {
    match event {
        AssetEvent::Modified { id } | AssetEvent::Removed { id } => Some(*id),
        _ => None,
    }
}
