//! The depth and dilation maps of all carvers: the array layers of each carver, and the inputs of its maps.

use bevy::{
    platform::collections::HashMap,
    prelude::*,
    render::renderer::{RenderDevice, RenderQueue},
};

use super::{
    clip_keys::{DepthKey, DilationKey},
    clip_textures::{ClipTextures, LayerRange, depth_map_size},
    surface_count::SurfaceCount,
};
use crate::{clip::ClipFrame, diagnostics::GpuUsage, render::extract::ExtractedScene};

/// The maps of every carver.
#[derive(Resource, Default)]
pub(crate) struct ClipMaps {
    pub textures: Option<ClipTextures>,
    pub slots: HashMap<Entity, Slot>,
}

/// A carver's place in the arrays, and the inputs of its maps.
#[derive(Default)]
pub(crate) struct Slot {
    pub layers: LayerRange,
    pub count: SurfaceCount,
    /// Inputs of the depth maps, and whether the mesh has more layers than the slot.
    pub drawn: Option<(DepthKey, bool)>,
    pub dilated: Option<DilationKey>,
    pub revision: u64,
}

/// A carver that takes part in this frame.
#[derive(Clone, Copy)]
pub(crate) struct ReadyCarver {
    pub layers: LayerRange,
    /// Clip camera frame of the carver's maps.
    pub frame: ClipFrame,
    pub dilation: DilationKey,
    /// Distinguishes these maps from all others.
    pub revision: u64,
}

impl Slot {
    /// Gives the slot other layers, whose maps are still to be made.
    fn place(&mut self, layers: LayerRange) {
        *self =
            Self { layers, count: core::mem::take(&mut self.count), revision: self.revision, ..default() };
    }
}

impl ClipMaps {
    /// Makes room for the carvers of the scene, and frees the room of all others.
    fn update(&mut self, scene: &ExtractedScene, device: &RenderDevice, queue: &RenderQueue) {
        let alive = scene.carver_entities();
        self.slots.retain(|entity, _| alive.contains(entity));
        for entity in alive {
            self.slots.entry(entity).or_default();
        }
        let capacity = scene.clip_capacity.layers;
        let size = depth_map_size(scene.clip_settings.depth_map_size, &device.limits());
        match &self.textures {
            Some(textures) if textures.depth_map_size == size => {
                if textures.capacity != capacity {
                    self.rearrange(capacity, &[], device, queue);
                }
            }
            _ => {
                self.textures = Some(ClipTextures::new(capacity, size, device));
                for slot in self.slots.values_mut() {
                    slot.place(default());
                }
            }
        }
    }

    /// Gives carvers the numbers of layers that they want, in the order of `wanted`. A carver without room keeps its
    /// layers until there is room. Maps that stay are not made again.
    pub fn place(&mut self, wanted: &[(Entity, u32)], device: &RenderDevice, queue: &RenderQueue) {
        let capacity = self.textures.as_ref().map_or(0, |textures| textures.capacity);
        for &(entity, count) in wanted {
            if self.slots.get(&entity).is_none_or(|slot| slot.layers.count == count) {
                continue;
            }
            let others =
                self.slots.iter().filter(|(other, _)| **other != entity).map(|(_, slot)| slot.layers);
            if let Some(layers) = first_gap(others.collect(), count, capacity) {
                self.slots.entry(entity).or_default().place(layers);
            } else if wanted.iter().map(|(_, count)| count).sum::<u32>() <= capacity {
                // The free layers are enough, but not consecutive.
                self.rearrange(capacity, wanted, device, queue);
                return;
            }
        }
    }

    /// Moves maps to arrays of `capacity` layers. Carvers that are to have another number of layers get room for new
    /// maps.
    fn rearrange(
        &mut self,
        capacity: u32,
        wanted: &[(Entity, u32)],
        device: &RenderDevice,
        queue: &RenderQueue,
    ) {
        let Some(textures) = &mut self.textures else {
            return;
        };
        let counts = self.slots.iter().map(|(entity, slot)| {
            let count = wanted.iter().find(|(other, _)| other == entity).map(|(_, count)| *count);
            (*entity, slot.layers, count.unwrap_or(slot.layers.count))
        });
        let mut counts: Vec<_> = counts.collect();
        counts.sort_unstable_by_key(|(_, layers, _)| layers.first);
        let places = arrange(counts.iter().map(|(_, layers, count)| (*layers, *count)), capacity);
        let mut moves = Vec::new();
        for ((entity, layers, count), place) in counts.into_iter().zip(places) {
            let Some(slot) = self.slots.get_mut(&entity) else {
                continue;
            };
            if place.count == layers.count && count == layers.count {
                moves.push((layers, place.first));
                slot.layers = place;
            } else {
                slot.place(place);
            }
        }
        *textures = textures.moved(capacity, &moves, device, queue);
    }

    /// GPU usage of the maps.
    pub fn usage(&self) -> GpuUsage {
        self.textures.as_ref().map_or(default(), ClipTextures::usage)
    }
}

/// New places for maps, given their present places and their new numbers of layers. Maps that can stay do. If the
/// others then have no room, all maps are placed one behind the other. Maps that do not fit get no layers.
fn arrange(maps: impl Iterator<Item = (LayerRange, u32)> + Clone, capacity: u32) -> Vec<LayerRange> {
    let stays = |(layers, count): (LayerRange, u32)| {
        (layers.count == count && layers.first + count <= capacity).then_some(layers)
    };
    let mut taken: Vec<_> = maps.clone().filter_map(stays).collect();
    let in_gaps = maps.clone().map(|map| {
        stays(map).or_else(|| {
            let layers = first_gap(taken.clone(), map.1, capacity)?;
            taken.push(layers);
            Some(layers)
        })
    });
    if let Some(places) = in_gaps.collect::<Option<_>>() {
        return places;
    }
    let mut first = 0;
    let one_behind_the_other = maps.map(|(_, count)| {
        if first + count > capacity {
            return LayerRange::default();
        }
        first += count;
        LayerRange { first: first - count, count }
    });
    one_behind_the_other.collect()
}

/// The first `count` consecutive layers that are free.
fn first_gap(mut taken: Vec<LayerRange>, count: u32, capacity: u32) -> Option<LayerRange> {
    taken.sort_unstable_by_key(|range| range.first);
    let mut first = 0;
    for range in taken.into_iter().filter(|range| range.count > 0) {
        if range.first >= first + count {
            break;
        }
        first = first.max(range.first + range.count);
    }
    (first + count <= capacity).then_some(LayerRange { first, count })
}

/// Allocates and frees maps, before drawing binds them.
pub(crate) fn keep_clip_maps(
    scene: Res<ExtractedScene>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    mut clip_maps: ResMut<ClipMaps>,
) {
    clip_maps.update(&scene, &device, &queue);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_found_where_they_are() {
        let range = |first, count| LayerRange { first, count };
        assert_eq!(first_gap(vec![], 3, 4), Some(range(0, 3)));
        assert_eq!(first_gap(vec![range(4, 2), range(0, 1)], 3, 8), Some(range(1, 3)));
        assert_eq!(first_gap(vec![range(0, 2), range(3, 2)], 2, 8), Some(range(5, 2)));
        assert_eq!(first_gap(vec![range(0, 2), range(3, 2)], 4, 8), None);
        assert_eq!(first_gap(vec![range(0, 0)], 1, 1), Some(range(0, 1)));
    }

    #[test]
    fn maps_stay_where_they_are_if_they_can() {
        let range = |first, count| LayerRange { first, count };
        let place = |maps: &[(LayerRange, u32)], capacity| arrange(maps.iter().copied(), capacity);
        // Growing moves nothing.
        let four = [(range(0, 1), 1), (range(1, 2), 2), (range(3, 1), 1), (range(0, 0), 1)];
        assert_eq!(place(&four, 8), [range(0, 1), range(1, 2), range(3, 1), range(4, 1)]);
        // Shrinking moves maps that lie beyond the end.
        let two = [(range(0, 1), 1), (range(5, 2), 2)];
        assert_eq!(place(&two, 4), [range(0, 1), range(1, 2)]);
        // Gaps that are too small are closed.
        let gaps = [(range(0, 1), 1), (range(2, 1), 1), (range(0, 0), 2)];
        assert_eq!(place(&gaps, 4), [range(0, 1), range(1, 1), range(2, 2)]);
        assert_eq!(place(&[(range(0, 0), 3), (range(0, 0), 2)], 4), [range(0, 3), range(0, 0)]);
    }
}
