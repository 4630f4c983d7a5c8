//! Which volume an entity shows: the one that it asks for, a smaller one, or still the one before.

use bevy::{
    platform::collections::{HashMap, HashSet},
    prelude::*,
    render::{render_resource::WgpuLimits, renderer::RenderDevice},
    tasks::{AsyncComputeTaskPool, Task, block_on, poll_once},
};

use super::{
    Volume, Volume3d, VolumeBudget, VolumeFailed,
    budget::{BytesTaken, StoredBytes, TooLarge, VolumeSize},
};

/// What is shown of a [`Volume3d`].
#[derive(Component, Clone)]
pub(crate) struct ShownVolume {
    /// The volume that this was decided for, and the budget that decided it.
    of: AssetId<Volume>,
    budget: VolumeBudget,
    /// That volume, a smaller one, or another that was shown before; `None` if there is nothing to show.
    pub volume: Option<Handle<Volume>>,
    /// Bytes that it takes.
    bytes: u64,
    /// Counts changes of what is shown.
    pub revision: u32,
}

/// Volumes at a lower resolution, by the volume and how often it was halved.
#[derive(Resource, Default)]
pub(super) struct HalvedVolumes(HashMap<(AssetId<Volume>, u32), Halved>);

/// A smaller volume, once a background task has made it.
enum Halved {
    Making(Task<Volume>),
    Made(Handle<Volume>),
}

impl HalvedVolumes {
    /// The volume halved so many times; `None` while it is being made.
    fn get(
        &mut self,
        id: AssetId<Volume>,
        halvings: u32,
        volumes: &mut Assets<Volume>,
    ) -> Option<Handle<Volume>> {
        let key = (id, halvings);
        if !self.0.contains_key(&key) {
            // Its voxels are shared, not copied.
            let volume = volumes.get(id)?.clone();
            let halve = async move { (0..halvings).fold(volume, |volume, _| volume.halved()) };
            self.0.insert(key, Halved::Making(AsyncComputeTaskPool::get().spawn(halve)));
        }
        let halved = self.0.get_mut(&key)?;
        if let Halved::Making(task) = halved {
            *halved = Halved::Made(volumes.add(block_on(poll_once(task))?));
        }
        match halved {
            Halved::Made(handle) => Some(handle.clone()),
            Halved::Making(_) => None,
        }
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
    let modified: HashSet<_> = events
        .read()
        .filter_map(|event| match event {
            AssetEvent::Modified { id } | AssetEvent::Removed { id } => Some(*id),
            _ => None,
        })
        .collect();
    halved.0.retain(|(id, _), _| !modified.contains(id));
    let mut used = HashSet::new();
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
        let is_current = shown.as_ref().is_some_and(|shown| shown.of == id) && !modified.contains(&id);
        if is_current && shown.as_ref().is_some_and(|shown| shown.budget == *budget) {
            used.extend(shown.as_ref().and_then(|shown| shown.volume.as_ref()).map(Handle::id));
            continue;
        }
        let before = shown.as_ref().and_then(|shown| shown.volume.clone());
        let was_shown = shown.as_ref().is_some_and(|shown| shown.of == id);
        let Some(volume) = volumes.get(id) else {
            if was_shown {
                commands.entity(entity).try_remove::<ShownVolume>();
            }
            used.extend(before.as_ref().map(Handle::id));
            continue;
        };
        let own = shown.as_ref().map_or(0, |shown| shown.bytes);
        let others = by_volumes - own + taken.by_methods + taken.by_carvers;
        let size = VolumeSize::of(volume, *stored);
        let (fitted, bytes) = match budget.check(size, &limits, others) {
            Ok(()) => (Some(handle.0.clone()), size.bytes()),
            Err(limit) => {
                let fits = budget.halvings(size, &limits, others);
                let (dimensions, would_fit) = (size.dimensions, fits.map(|(_, size)| size.dimensions));
                let reason = TooLarge { dimensions, limit, would_fit };
                match fits.filter(|_| budget.halves) {
                    Some((halvings, size)) => {
                        if !halved.0.contains_key(&(id, halvings)) {
                            warn!("{dimensions} voxels {limit}: {} are shown", size.dimensions);
                        }
                        let Some(smaller) = halved.get(id, halvings, &mut volumes) else {
                            used.extend(before.as_ref().map(Handle::id));
                            continue;
                        };
                        (Some(smaller), size.bytes())
                    }
                    None => {
                        commands.trigger(VolumeFailed { entity, reason: reason.into() });
                        // One that is not this volume goes on being shown.
                        let stays = before.clone().filter(|_| !was_shown);
                        let bytes = if stays.is_some() { own } else { 0 };
                        (stays, bytes)
                    }
                }
            }
        };
        by_volumes = by_volumes - own + bytes;
        used.extend(fitted.as_ref().map(Handle::id));
        let has_changed = fitted != before || modified.contains(&id);
        let revision = shown.as_ref().map_or(0, |shown| shown.revision + u32::from(has_changed));
        let new = ShownVolume { of: id, budget: budget.clone(), volume: fitted, bytes, revision };
        match shown {
            Some(mut shown) => *shown = new,
            None => {
                commands.entity(entity).try_insert(new);
            }
        }
    }
    halved.0.retain(|_, halved| match halved {
        Halved::Making(_) => true,
        Halved::Made(handle) => used.contains(&handle.id()),
    });
    for entity in &orphans {
        commands.entity(entity).try_remove::<ShownVolume>();
    }
    taken.set_if_neq(BytesTaken { by_volumes, ..*taken });
}
