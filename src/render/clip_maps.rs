//! The depth and dilation maps of all carvers: which layers of the arrays belong to which carver,
//! and what they show.

use bevy::{platform::collections::HashMap, prelude::*, render::renderer::RenderDevice};

use super::{
    clip_keys::{DepthKey, DilationKey},
    clip_textures::{ClipTextures, depth_map_size},
    extract::ExtractedScene,
    surface_count::{SurfaceCount, layers_of},
};
use crate::{clip::ClipFrame, diagnostics::GpuUsage};

/// The maps of every carver.
#[derive(Resource, Default)]
pub(crate) struct ClipMaps {
    pub textures: Option<ClipTextures>,
    pub slots: HashMap<Entity, Slot>,
}

/// A carver's place in the arrays, and what its maps show.
#[derive(Default)]
pub(crate) struct Slot {
    pub layers: LayerRange,
    pub count: SurfaceCount,
    /// What the depth maps show, and whether its last layer is cut off.
    pub drawn: Option<(DepthKey, bool)>,
    pub dilated: Option<DilationKey>,
    pub revision: u64,
}

/// Consecutive layers of the arrays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct LayerRange {
    pub first: u32,
    pub count: u32,
}

impl LayerRange {
    /// Whether a mesh with so many surfaces along a line of sight has more layers.
    pub fn cuts_off(self, surfaces: u32) -> bool {
        layers_of(surfaces) > self.count
    }
}

/// A carver that takes part in this frame.
#[derive(Clone, Copy)]
pub(crate) struct ReadyCarver {
    pub layers: LayerRange,
    /// The view that its maps show.
    pub frame: ClipFrame,
    pub dilation: DilationKey,
    /// Tells these maps from all others.
    pub revision: u64,
}

impl Slot {
    fn place(&mut self, layers: LayerRange) {
        *self =
            Self { layers, count: core::mem::take(&mut self.count), revision: self.revision, ..default() };
    }
}

impl ClipMaps {
    /// Makes room for the carvers of the scene, and frees what the others had.
    pub fn update(&mut self, scene: &ExtractedScene, device: &RenderDevice) {
        let capacity = scene.clip_capacity.0;
        let size = depth_map_size(scene.clip_settings.depth_map_size, &device.limits());
        let fits = |textures: &ClipTextures| textures.capacity == capacity && textures.depth_map_size == size;
        if !self.textures.as_ref().is_some_and(fits) {
            self.textures = Some(ClipTextures::new(capacity, size, device));
            for slot in self.slots.values_mut() {
                slot.place(default());
            }
        }
        let alive = scene.carver_entities();
        self.slots.retain(|entity, _| alive.contains(entity));
        for entity in alive {
            self.slots.entry(entity).or_default();
        }
    }

    /// Gives carvers the numbers of layers that they want. Where there is no room, a carver keeps
    /// what it has until there is.
    pub fn place(&mut self, wanted: &[(Entity, u32)]) {
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
                // There is room, but not in one piece.
                self.pack(wanted);
                return;
            }
        }
    }

    /// Places all carvers anew, one behind the other.
    fn pack(&mut self, wanted: &[(Entity, u32)]) {
        let mut first = 0;
        for slot in self.slots.values_mut() {
            slot.place(default());
        }
        for &(entity, count) in wanted {
            self.slots.entry(entity).or_default().place(LayerRange { first, count });
            first += count;
        }
    }

    /// What the maps take on the device.
    pub fn usage(&self) -> GpuUsage {
        self.textures.as_ref().map_or(default(), ClipTextures::usage)
    }
}

/// The first `count` layers that are free.
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
}
