//! The bricks that casts of rays list. The lists are made on the GPU. They are read back, some frames late, while their
//! gizmos are shown.

use bevy::{
    platform::collections::{HashMap, HashSet},
    prelude::*,
    render::{
        Extract,
        render_resource::BufferId,
        renderer::{RenderContext, RenderDevice},
    },
};
use std::sync::{Arc, Mutex};

use super::{ShowVolumeGizmos, VolumeGizmoConfigGroup};
use crate::{
    render::{Readback, VolumeStore, listed_bricks},
    volume::LookupTable,
};

/// Voxels of a brick along each axis.
pub(super) const BRICK_SIDE: u32 = 4;

/// Bricks of 4x4x4 voxels of which the latest cast cast any: those whose occlusion was stale and that a view reads.
///
/// The plugin inserts it on the entities of volumes while their listed bricks are shown, and removes it. It is some frames
/// late, and skips casts that follow one another faster. Frames that cast nothing leave it as it is. Methods without rays
/// list nothing.
#[derive(Component, Debug, Default, PartialEq, Eq)]
pub struct ListedBricks {
    /// The bricks, by their place in the grid of bricks, in order.
    pub bricks: Vec<UVec3>,
}

/// Lists that have arrived: the numbers of bricks by volume.
#[derive(Resource, Clone, Default)]
pub(super) struct Arrived(Arc<Mutex<HashMap<Entity, Vec<u32>>>>);

/// Asks for the lists of volumes whose bricks are shown.
pub(super) fn ask(
    mut commands: Commands,
    volumes: Query<(Entity, Has<ListedBricks>, Has<LookupTable>, Option<&ShowVolumeGizmos>)>,
    store: Res<GizmoConfigStore>,
) {
    let (config, group) = store.config::<VolumeGizmoConfigGroup>();
    for (entity, has_list, is_volume, show) in &volumes {
        let is_shown = config.enabled && is_volume && group.color(group.listed_bricks, show).is_some();
        if is_shown && !has_list {
            commands.entity(entity).try_insert(ListedBricks::default());
        } else if !is_shown && has_list {
            commands.entity(entity).try_remove::<ListedBricks>();
        }
    }
}

/// Takes over lists that have arrived.
pub(super) fn receive(arrived: Res<Arrived>, mut volumes: Query<(&LookupTable, &mut ListedBricks)>) {
    let Ok(mut arrived) = arrived.0.lock() else {
        return;
    };
    for (entity, bricks) in arrived.drain() {
        if let Ok((table, mut listed)) = volumes.get_mut(entity) {
            let voxels = table.geometry.dimensions;
            let bricks = bricks.into_iter().map(|brick| brick_at(brick, voxels)).collect();
            listed.set_if_neq(ListedBricks { bricks });
        }
    }
}

/// The lists of the volumes whose bricks are shown.
#[derive(Resource, Default)]
pub(super) struct Readbacks(HashMap<Entity, ListReadback>);

/// The list of one volume.
#[derive(Default)]
struct ListReadback {
    /// The cast whose list was copied last.
    copied: Option<(u64, BufferId)>,
    readback: Readback<()>,
}

/// Takes over which lists are asked for. Forgets the others.
pub(super) fn extract(mut readbacks: ResMut<Readbacks>, asked: Extract<Query<Entity, With<ListedBricks>>>) {
    if asked.is_empty() && readbacks.0.is_empty() {
        return;
    }
    let asked: HashSet<_> = asked.iter().collect();
    readbacks.0.retain(|entity, _| asked.contains(entity));
    for entity in asked {
        readbacks.0.entry(entity).or_default();
    }
}

pub(super) fn any_asked_for(readbacks: Res<Readbacks>) -> bool {
    !readbacks.0.is_empty()
}

/// Copies the lists of this frame's casts, and sends those that have arrived.
pub(super) fn copy(
    mut readbacks: ResMut<Readbacks>,
    store: Res<VolumeStore>,
    arrived: Res<Arrived>,
    mut ctx: RenderContext,
) {
    let device = ctx.render_device().clone();
    for (&entity, list) in &mut readbacks.0 {
        if let Some(((), bytes)) = list.readback.receive(&device) {
            send(&arrived, entity, listed_bricks(&bytes));
        }
        let Some(cast) = store.listed_cast(entity) else {
            if list.copied.take().is_some() {
                send(&arrived, entity, Vec::new());
            }
            continue;
        };
        if list.copied != Some(cast.id())
            && let Some(staging) = list.readback.begin((), cast.bytes(), &device)
        {
            list.copied = Some(cast.id());
            cast.copy(&staging, ctx.command_encoder());
        }
    }
}

/// Requests the copies, once they are submitted.
pub(super) fn request(mut readbacks: ResMut<Readbacks>, device: Res<RenderDevice>) {
    for list in readbacks.0.values_mut() {
        list.readback.request(&device);
    }
}

fn send(arrived: &Arrived, entity: Entity, bricks: Vec<u32>) {
    if let Ok(mut arrived) = arrived.0.lock() {
        arrived.insert(entity, bricks);
    }
}

/// The brick with a number, of a volume of so many voxels. Bricks are in order, x fastest.
fn brick_at(index: u32, voxels: UVec3) -> UVec3 {
    let counts = voxels.map(|voxels| voxels.div_ceil(BRICK_SIDE));
    UVec3::new(index % counts.x, (index / counts.x) % counts.y, index / (counts.x * counts.y))
}
