//! Transfer functions become tables, one for every volume that is shown.

use bevy::{platform::collections::HashSet, prelude::*};

use super::{
    LookupTable, OcclusionReady, TransferFunction, Volume, VolumeLoaded, VolumeTransferFunction,
    fit::ShownVolume,
};

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
                commands.entity(entity).try_remove::<LookupTable>().try_insert(OcclusionReady(false));
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
        commands.entity(entity).try_insert((baked, OcclusionReady(false)));
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
