//! Bakes transfer functions into tables, one for every shown volume.

use bevy::{platform::collections::HashSet, prelude::*};

use super::{
    LookupTable, OcclusionReady, TransferFunction, Volume, VolumeLoaded, VolumeTransferFunction,
    fit::ShownVolume,
};

/// Bakes the table of every volume whose data or transfer function changed. A volume that can no longer be shown loses
/// its table. A table stays until the next volume and its transfer function have loaded.
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

/// The asset that an event modifies or removes. An added asset has no table yet, so its event is not needed.
fn changed<A: Asset>(event: &AssetEvent<A>) -> Option<AssetId<A>> {
    match event {
        AssetEvent::Modified { id } | AssetEvent::Removed { id } => Some(*id),
        _ => None,
    }
}
