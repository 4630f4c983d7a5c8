//! Which volume an entity shows: the one that it asks for, a smaller one, or still the one before.

use bevy::{
    platform::collections::HashSet,
    prelude::*,
    render::{render_resource::WgpuLimits, renderer::RenderDevice},
};

use super::{
    Volume, Volume3d, VolumeBudget, VolumeFailed,
    budget::{BytesTaken, StoredBytes, TooLarge, VolumeSize},
    halved_volumes::HalvedVolumes,
};

/// What is shown of a [`Volume3d`].
#[derive(Component, Clone)]
pub(crate) struct ShownVolume {
    /// The volume that this was decided for, and the budget that decided it.
    of: AssetId<Volume>,
    budget: VolumeBudget,
    /// Whether there was no room for it.
    is_refused: bool,
    /// That volume, a smaller one, or another that was shown before; `None` if there is nothing to show.
    pub volume: Option<Handle<Volume>>,
    /// Bytes that it takes.
    bytes: u64,
    /// Counts changes of what is shown.
    pub revision: u32,
}

/// What becomes of a volume.
enum Fit {
    /// This is shown, the volume itself or a smaller one, and takes so many bytes.
    Shown(Handle<Volume>, u64),
    BeingHalved,
    Refused(TooLarge),
}

/// Decides what is shown of volumes that came or changed. While a volume is being read or halved, or if it is
/// refused, the one before stays.
pub(super) fn fit_volumes(
    mut commands: Commands,
    mut events: MessageReader<AssetEvent<Volume>>,
    mut entities: Query<(Entity, &Volume3d, Option<&mut ShownVolume>)>,
    orphans: Query<Entity, (With<ShownVolume>, Without<Volume3d>)>,
    budget: Res<VolumeBudget>,
    stored: Res<StoredBytes>,
    device: Option<Res<RenderDevice>>,
    mut taken: ResMut<BytesTaken>,
    mut volumes: ResMut<Assets<Volume>>,
    mut halved: ResMut<HalvedVolumes>,
) {
    let modified: HashSet<_> = events.read().filter_map(modified).collect();
    halved.forget(&modified);
    // Without a device nothing is drawn, and nothing is too large.
    let unlimited = || WgpuLimits {
        max_texture_dimension_3d: u32::MAX,
        max_storage_buffer_binding_size: u64::MAX,
        ..default()
    };
    let limits = device.map_or_else(unlimited, |device| device.limits());
    let mut by_volumes: u64 = entities.iter().filter_map(|(_, _, shown)| Some(shown?.bytes)).sum();
    for (entity, handle, shown) in &mut entities {
        let id = handle.id();
        let current = shown.as_deref().cloned().filter(|shown| shown.of == id);
        let is_decided = current.as_ref().is_some_and(|current| {
            current.budget == *budget && !current.is_refused && !modified.contains(&id)
        });
        if is_decided {
            continue;
        }
        let Some(volume) = volumes.get(id).cloned() else {
            if current.is_some() {
                // It was taken away.
                commands.entity(entity).try_remove::<ShownVolume>();
            }
            continue;
        };
        let (before, own, revision) =
            shown.as_ref().map_or((None, 0, 0), |shown| (shown.volume.clone(), shown.bytes, shown.revision));
        let others = by_volumes - own + taken.by_methods + taken.by_carvers;
        let size = VolumeSize::of(&volume, *stored);
        let fit = match budget.check(size, &limits, others) {
            Ok(()) => Fit::Shown(handle.0.clone(), size.bytes()),
            Err(limit) => {
                let fits = budget.halvings(size, &limits, others);
                let too_large = |size: Option<VolumeSize>| TooLarge {
                    dimensions: volume.dimensions(),
                    limit,
                    would_fit: size.map(|size| size.dimensions),
                };
                match fits.filter(|_| budget.halves) {
                    Some((halvings, size)) => {
                        let reason = too_large(Some(size));
                        halved
                            .get(id, halvings, &volume, reason, &mut volumes)
                            .map_or(Fit::BeingHalved, |half| Fit::Shown(half, size.bytes()))
                    }
                    None => Fit::Refused(too_large(fits.map(|(_, size)| size))),
                }
            }
        };
        let (volume, bytes, is_refused) = match fit {
            Fit::Shown(volume, bytes) => (Some(volume), bytes, false),
            Fit::BeingHalved => continue,
            Fit::Refused(reason) => {
                let was_told = current.as_ref().is_some_and(|current| {
                    current.is_refused && current.budget == *budget && !modified.contains(&id)
                });
                if was_told {
                    continue;
                }
                commands.trigger(VolumeFailed { entity, reason: reason.into() });
                // Another volume goes on being shown.
                let stays = before.clone().filter(|_| current.is_none());
                let bytes = if stays.is_some() { own } else { 0 };
                (stays, bytes, true)
            }
        };
        by_volumes = by_volumes - own + bytes;
        let has_changed = volume != before || modified.contains(&id) && !is_refused;
        let revision = revision + u32::from(has_changed && shown.is_some());
        let new = ShownVolume { of: id, budget: budget.clone(), is_refused, volume, bytes, revision };
        match shown {
            Some(mut shown) => *shown = new,
            None => {
                commands.entity(entity).try_insert(new);
            }
        }
    }
    let used = entities.iter().filter_map(|(_, _, shown)| Some(shown?.volume.as_ref()?.id()));
    halved.keep(&used.collect());
    for entity in &orphans {
        commands.entity(entity).try_remove::<ShownVolume>();
    }
    taken.set_if_neq(BytesTaken { by_volumes, ..*taken });
}

/// The volume that an event changes, if it does. One that was added is missed by nobody.
fn modified(event: &AssetEvent<Volume>) -> Option<AssetId<Volume>> {
    match event {
        AssetEvent::Modified { id } | AssetEvent::Removed { id } => Some(*id),
        _ => None,
    }
}
