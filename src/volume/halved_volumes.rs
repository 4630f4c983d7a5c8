//! Volumes at a lower resolution, made in the background, once for all entities that show them.

use bevy::{
    platform::collections::{HashMap, HashSet},
    prelude::*,
    tasks::{AsyncComputeTaskPool, Task, block_on, poll_once},
};

use super::{Volume, budget::TooLarge};

/// Halved volumes, by their source volume and number of halvings.
#[derive(Resource, Default)]
pub(super) struct HalvedVolumes(HashMap<(AssetId<Volume>, u32), Halved>);

enum Halved {
    Making(Task<Volume>),
    /// Made, with the number of frames since an entity last showed the volume.
    Made(Handle<Volume>, u32),
}

impl HalvedVolumes {
    /// The volume after `halvings` halvings, because of `reason`; `None` while it is being made.
    pub fn get(
        &mut self,
        id: AssetId<Volume>,
        halvings: u32,
        volume: &Volume,
        reason: TooLarge,
        volumes: &mut Assets<Volume>,
    ) -> Option<Handle<Volume>> {
        let halved = self.0.entry((id, halvings)).or_insert_with(|| {
            let TooLarge { dimensions, limit, would_fit } = reason;
            warn!("{dimensions} voxels {limit}: {} are shown", would_fit.unwrap_or_default());
            // The clone shares the voxels.
            let volume = volume.clone();
            let halve = async move { (0..halvings).fold(volume, |volume, _| volume.halved()) };
            Halved::Making(AsyncComputeTaskPool::get().spawn(halve))
        });
        if let Halved::Making(task) = halved {
            *halved = Halved::Made(volumes.add(block_on(poll_once(task))?), 0);
        }
        match halved {
            Halved::Made(handle, _) => Some(handle.clone()),
            Halved::Making(_) => None,
        }
    }

    /// Drops halved volumes whose source volume changed.
    pub fn forget(&mut self, modified: &HashSet<AssetId<Volume>>) {
        self.0.retain(|(id, _), _| !modified.contains(id));
    }

    /// Keeps halved volumes that are shown, and frees the others.
    pub fn keep(&mut self, shown: &HashSet<AssetId<Volume>>) {
        self.0.retain(|_, halved| match halved {
            Halved::Making(_) => true,
            Halved::Made(handle, unused) => {
                *unused = if shown.contains(&handle.id()) { 0 } else { *unused + 1 };
                // The component that shows a volume is inserted a frame later.
                *unused < 3
            }
        });
    }
}
