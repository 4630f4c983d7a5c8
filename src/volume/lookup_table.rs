//! The transfer function of one volume as a table: what the GPU reads.

use bevy::{
    color::{ColorToComponents, Srgba},
    platform::collections::HashSet,
    prelude::*,
};
use std::sync::Arc;

use super::{
    OcclusionProgress, TransferFunction, Volume, VolumeGeometry, VolumeLoaded, VolumeTransferFunction,
    fit::ShownVolume,
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
    /// The volume.
    pub volume: Volume,
    /// The volume's grid.
    pub geometry: VolumeGeometry,
    /// The transfer function that this was made of.
    function: AssetId<TransferFunction>,
    /// Counts changes.
    pub revision: u32,
    /// Counts changes of the volume's data.
    pub volume_revision: u32,
}

impl LookupTable {
    /// Number of entries: a 12-bit CT keeps every intensity apart.
    pub const ENTRIES: usize = 4096;

    pub(crate) fn bake(function: &TransferFunction, volume: &Volume) -> Self {
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
            volume: volume.clone(),
            function: AssetId::default(),
            revision: 0,
            volume_revision: 0,
        }
    }
}

/// Bakes the table of every volume whose data or transfer function changed, and takes it from those that can no
/// longer be shown. A table stays until the volume and the transfer function of the next one are there.
pub(super) fn bake_lookup_tables(
    mut commands: Commands,
    mut function_events: MessageReader<AssetEvent<TransferFunction>>,
    volumes: Res<Assets<Volume>>,
    functions: Res<Assets<TransferFunction>>,
    entities: Query<(Entity, &ShownVolume, &VolumeTransferFunction, Option<&LookupTable>)>,
    orphans: Query<Entity, (With<LookupTable>, Without<ShownVolume>)>,
) {
    let changed_functions: HashSet<_> = function_events.read().filter_map(changed).collect();
    for (entity, shown, function, table) in &entities {
        let Some(handle) = &shown.volume else {
            if table.is_some() {
                commands.entity(entity).try_remove::<LookupTable>().try_insert(OcclusionProgress(0.0));
            }
            continue;
        };
        let id = function.id();
        let shows_volume = table.is_some_and(|table| table.volume_revision == shown.revision);
        let is_current = table.is_some_and(|table| table.function == id) && !changed_functions.contains(&id);
        if shows_volume && is_current {
            continue;
        }
        let Some(volume) = volumes.get(handle) else {
            continue;
        };
        let baked = if id == AssetId::default() {
            LookupTable::bake(&TransferFunction::for_volume(volume), volume)
        } else if let Some(function) = functions.get(id) {
            LookupTable::bake(function, volume)
        } else {
            continue;
        };
        let baked = LookupTable {
            function: id,
            revision: table.map_or(0, |table| table.revision + 1),
            volume_revision: shown.revision,
            ..baked
        };
        commands.entity(entity).try_insert((baked, OcclusionProgress(0.0)));
        if !shows_volume {
            commands.trigger(VolumeLoaded { entity });
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
