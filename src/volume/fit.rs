//! Decides the volume that an entity shows: the requested volume, a smaller copy, or the volume before.

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

/// The volume that a [`Volume3d`] entity shows.
#[derive(Component, Clone)]
pub(crate) struct ShownVolume {
    /// The requested volume, and the budget at the decision.
    of: AssetId<Volume>,
    budget: VolumeBudget,
    /// Whether there was no room for the requested volume.
    is_refused: bool,
    /// The requested volume, a smaller copy, or the volume shown before; `None` if there is nothing to show.
    pub volume: Option<Handle<Volume>>,
    /// Bytes that the shown volume takes.
    bytes: u64,
    /// Number of changes of the shown volume.
    pub revision: u32,
}

impl ShownVolume {
    /// Whether the requested volume itself is shown.
    fn is_whole(&self) -> bool {
        self.volume.as_ref().is_some_and(|volume| volume.id() == self.of)
    }
}

/// Decision on a volume.
enum Fit {
    /// The volume itself or a smaller copy is shown and takes this many bytes.
    Shown(Handle<Volume>, u64),
    BeingHalved,
    Refused(TooLarge),
}

/// The memory that volumes may take.
struct Room<'a> {
    budget: &'a VolumeBudget,
    stored: StoredBytes,
    limits: WgpuLimits,
}

impl Room<'_> {
    /// Decides on a volume, beside others that take `others` bytes.
    fn fit(
        &self,
        handle: &Handle<Volume>,
        volume: &Volume,
        others: u64,
        volumes: &mut Assets<Volume>,
        halved: &mut HalvedVolumes,
    ) -> Fit {
        let size = VolumeSize::of(volume, self.stored);
        let Err(limit) = self.budget.check(size, &self.limits, others) else {
            return Fit::Shown(handle.clone(), size.bytes());
        };
        let fits = self.budget.halvings(size, &self.limits, others);
        let would_fit = fits.map(|(_, size)| size.dimensions);
        let reason = TooLarge { dimensions: volume.dimensions(), limit, would_fit };
        match fits.filter(|_| self.budget.halves) {
            Some((halvings, size)) => halved
                .get(handle.id(), halvings, volume, reason, volumes)
                .map_or(Fit::BeingHalved, |half| Fit::Shown(half, size.bytes())),
            None => Fit::Refused(reason),
        }
    }

    /// Whether there is room for a copy of the volume that takes more than `bytes`.
    fn has_more(&self, volume: &Volume, others: u64, bytes: u64) -> bool {
        let fits = self.budget.halvings(VolumeSize::of(volume, self.stored), &self.limits, others);
        fits.is_some_and(|(_, size)| size.bytes() > bytes)
    }
}

/// Decides the shown volume of entities that are new or changed. While a volume is being read or halved, or if
/// it is refused, the volume before stays.
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
    let room = Room { budget: &budget, stored: *stored, limits };
    let mut by_volumes: u64 = entities.iter().filter_map(|(_, _, shown)| Some(shown?.bytes)).sum();
    for (entity, handle, shown) in &mut entities {
        let id = handle.id();
        let current = shown.as_deref().cloned().filter(|shown| shown.of == id);
        let same = |shown: &&ShownVolume| shown.budget == *budget && !modified.contains(&id);
        let decided = current.as_ref().filter(same);
        if decided.is_some_and(ShownVolume::is_whole) {
            continue;
        }
        let Some(volume) = volumes.get(id).cloned() else {
            if current.is_some() {
                // The volume's asset was removed.
                commands.entity(entity).try_remove::<ShownVolume>();
            }
            continue;
        };
        let (before, own, revision) =
            shown.as_ref().map_or((None, 0, 0), |shown| (shown.volume.clone(), shown.bytes, shown.revision));
        let others = by_volumes - own + taken.by_methods + taken.by_carvers;
        // A smaller copy stays until there is room for a larger one.
        if decided.is_some_and(|shown| !shown.is_refused && !room.has_more(&volume, others, shown.bytes)) {
            continue;
        }
        let fit = room.fit(&handle.0, &volume, others, &mut volumes, &mut halved);
        let (volume, bytes, is_refused) = match fit {
            Fit::Shown(volume, bytes) => (Some(volume), bytes, false),
            Fit::BeingHalved => continue,
            Fit::Refused(reason) => {
                if decided.is_some() {
                    // The refusal was reported before.
                    continue;
                }
                commands.trigger(VolumeFailed { entity, reason: reason.into() });
                // Another volume, shown before, stays.
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

/// The volume that an event modifies or removes. An added volume has no decision yet, so its event is not needed.
fn modified(event: &AssetEvent<Volume>) -> Option<AssetId<Volume>> {
    match event {
        AssetEvent::Modified { id } | AssetEvent::Removed { id } => Some(*id),
        _ => None,
    }
}
