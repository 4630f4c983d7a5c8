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

impl ShownVolume {
    /// Whether it is the volume that was asked for, as it is.
    fn is_whole(&self) -> bool {
        self.volume.as_ref().is_some_and(|volume| volume.id() == self.of)
    }
}

/// What becomes of a volume.
enum Fit {
    /// This is shown, the volume itself or a smaller one, and takes so many bytes.
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
    /// What becomes of a volume beside others that take so many bytes.
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

    /// Whether there is room for more of a volume than so many bytes.
    fn has_more(&self, volume: &Volume, others: u64, bytes: u64) -> bool {
        let fits = self.budget.halvings(VolumeSize::of(volume, self.stored), &self.limits, others);
        fits.is_some_and(|(_, size)| size.bytes() > bytes)
    }
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
                // It was taken away.
                commands.entity(entity).try_remove::<ShownVolume>();
            }
            continue;
        };
        let (before, own, revision) =
            shown.as_ref().map_or((None, 0, 0), |shown| (shown.volume.clone(), shown.bytes, shown.revision));
        let others = by_volumes - own + taken.by_methods + taken.by_carvers;
        // A smaller one stays until there is room for more of it.
        if decided.is_some_and(|shown| !shown.is_refused && !room.has_more(&volume, others, shown.bytes)) {
            continue;
        }
        let fit = room.fit(&handle.0, &volume, others, &mut volumes, &mut halved);
        let (volume, bytes, is_refused) = match fit {
            Fit::Shown(volume, bytes) => (Some(volume), bytes, false),
            Fit::BeingHalved => continue,
            Fit::Refused(reason) => {
                if decided.is_some() {
                    // It was told before.
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
