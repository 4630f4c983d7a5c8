//! The depth and dilation maps of all carvers: one texture array each, one slot per carver.

use bevy::{
    math::Vec3,
    platform::collections::HashMap,
    prelude::*,
    render::{
        render_resource::{
            Extent3d, Texture, TextureAspect, TextureDescriptor, TextureDimension, TextureFormat,
            TextureUsages, TextureView, TextureViewDescriptor, TextureViewDimension,
        },
        renderer::RenderDevice,
    },
};

use super::extract::{ExtractedCarver, ExtractedScene, Influence};
use crate::{
    clip::{ClipFrame, ClipOperation, DilationFrame},
    diagnostics::GpuUsage,
};

/// Depth map texels per dilation map texel, along each side: dilation bounds are smooth, and are
/// taken over whole texels.
const TEXELS_PER_DILATION_TEXEL: u32 = 8;

/// Depth map texels along each side of a tile, whose extrema are found first (`TILE` in WGSL).
const TEXELS_PER_TILE: u32 = 16;

/// The maps of every carver.
#[derive(Resource, Default)]
pub(crate) struct ClipMaps {
    pub textures: Option<ClipTextures>,
    pub slots: HashMap<Entity, Slot>,
}

/// The texture arrays.
pub(crate) struct ClipTextures {
    /// Number of slots.
    pub capacity: u32,
    /// Texels per side of a depth map.
    pub depth_map_size: u32,
    depth: Texture,
    /// Layer `2 * slot`: nearest depth, `2 * slot + 1`: farthest.
    pub depth_view: TextureView,
    dilation: Texture,
    /// Layer `slot`: near and far bound of the inflated mesh, then of the shrunk one.
    pub dilation_view: TextureView,
    tiles: Texture,
    /// Extrema of the tiles of the depth map being dilated.
    pub tile_view: TextureView,
}

/// A carver's place in the arrays, and what its maps show.
#[derive(Default)]
pub(crate) struct Slot {
    pub index: u32,
    pub drawn: Option<DepthKey>,
    pub dilated: Option<DilationKey>,
    pub revision: u64,
}

/// What a depth map depends on.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct DepthKey {
    mesh: AssetId<Mesh>,
    revision: u32,
    pub frame: ClipFrame,
}

/// What a dilation map depends on, besides the depth map: half axes of ellipsoids, clip map space.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct DilationKey {
    /// The mesh is inflated by this.
    pub inflation: Vec3,
    /// And shrunk by this.
    pub shrinkage: Vec3,
}

impl DilationKey {
    /// What a carver needs, keeping `current` while it serves: turning a carver changes the radii
    /// by rounding only, which the margins of reach and footprint cover. `None` if the carver is
    /// collapsed.
    pub fn new(
        frame: &ClipFrame,
        world_from_local: Mat3,
        operation: ClipOperation,
        influence: Influence,
        current: Option<Self>,
    ) -> Option<Self> {
        let radii = |length| frame.reach_radii(world_from_local, length);
        let (reach, footprint) = (radii(influence.reach_world)?, radii(influence.footprint_world)?);
        let new = match operation {
            ClipOperation::Subtract => Self { inflation: reach, shrinkage: footprint },
            ClipOperation::Intersect => Self { inflation: footprint, shrinkage: reach },
        };
        let serves = |old: &Self| {
            let change = |old: Vec3, new: Vec3| (new / old - 1.0).abs().max_element();
            change(old.inflation, new.inflation).max(change(old.shrinkage, new.shrinkage)) < 1e-4
        };
        Some(current.filter(serves).unwrap_or(new))
    }

    /// The part of clip map space that the dilation map covers.
    pub fn frame(&self) -> DilationFrame {
        DilationFrame::for_radii(self.inflation)
    }
}

impl DepthKey {
    pub fn of(carver: &ExtractedCarver) -> Self {
        Self { mesh: carver.mesh, revision: carver.revision, frame: carver.frame }
    }
}

/// A depth map size that divides into tiles.
pub(crate) fn depth_map_size(requested: u32, largest: u32) -> u32 {
    let step = TEXELS_PER_TILE;
    requested.clamp(step, largest).next_multiple_of(step).min(largest / step * step)
}

impl ClipMaps {
    /// Makes room for the carvers of the scene, and frees what the others had.
    pub fn update(&mut self, scene: &ExtractedScene, device: &RenderDevice) {
        let capacity = scene.clip_capacity.0;
        let size =
            depth_map_size(scene.clip_settings.depth_map_size, device.limits().max_texture_dimension_2d);
        let fits = |textures: &ClipTextures| textures.capacity == capacity && textures.depth_map_size == size;
        if !self.textures.as_ref().is_some_and(fits) {
            self.textures = Some(ClipTextures::new(capacity, size, device));
            self.slots.clear();
        }
        let alive = scene.carver_entities();
        self.slots.retain(|entity, _| alive.contains(entity));
        for carver in &scene.carvers {
            if !self.slots.contains_key(&carver.entity) {
                let taken: Vec<u32> = self.slots.values().map(|slot| slot.index).collect();
                if let Some(index) = (0..capacity).find(|index| !taken.contains(index)) {
                    self.slots.insert(carver.entity, Slot { index, ..default() });
                }
            }
        }
    }

    /// What the maps take on the device.
    pub fn usage(&self) -> GpuUsage {
        self.textures
            .as_ref()
            .map_or(default(), |textures| usage_of([&textures.depth, &textures.dilation, &textures.tiles]))
    }
}

impl ClipTextures {
    fn new(capacity: u32, depth_map_size: u32, device: &RenderDevice) -> Self {
        let array = |label, size, layers, format, usage| {
            device.create_texture(&TextureDescriptor {
                label: Some(label),
                size: Extent3d { width: size, height: size, depth_or_array_layers: layers },
                mip_level_count: 1,
                sample_count: 1,
                dimension: TextureDimension::D2,
                format,
                usage: usage | TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_SRC,
                view_formats: &[],
            })
        };
        let view = |texture: &Texture, dimension| {
            texture.create_view(&TextureViewDescriptor { dimension: Some(dimension), ..default() })
        };
        let depth = array(
            "contextual_ao_depth_maps",
            depth_map_size,
            2 * capacity,
            TextureFormat::Depth32Float,
            TextureUsages::RENDER_ATTACHMENT,
        );
        let dilation = array(
            "contextual_ao_dilation_maps",
            depth_map_size / TEXELS_PER_DILATION_TEXEL,
            capacity,
            TextureFormat::Rgba32Float,
            TextureUsages::STORAGE_BINDING,
        );
        let tiles = array(
            "contextual_ao_depth_tiles",
            depth_map_size / TEXELS_PER_TILE,
            1,
            TextureFormat::Rgba32Float,
            TextureUsages::STORAGE_BINDING,
        );
        Self {
            capacity,
            depth_map_size,
            depth_view: view(&depth, TextureViewDimension::D2Array),
            dilation_view: view(&dilation, TextureViewDimension::D2Array),
            tile_view: view(&tiles, TextureViewDimension::D2),
            depth,
            dilation,
            tiles,
        }
    }

    /// Tiles along each side of a depth map.
    pub fn tile_count(&self) -> u32 {
        self.depth_map_size / TEXELS_PER_TILE
    }

    /// Texels per side of a dilation map.
    pub fn dilation_map_size(&self) -> u32 {
        self.depth_map_size / TEXELS_PER_DILATION_TEXEL
    }

    /// One layer of the depth maps, to render into.
    pub fn depth_layer(&self, layer: u32) -> TextureView {
        self.depth.create_view(&TextureViewDescriptor {
            dimension: Some(TextureViewDimension::D2),
            aspect: TextureAspect::DepthOnly,
            base_array_layer: layer,
            array_layer_count: Some(1),
            ..default()
        })
    }
}

/// Number and bytes of some textures.
pub(crate) fn usage_of<'a>(textures: impl IntoIterator<Item = &'a Texture>) -> GpuUsage {
    let mut usage = GpuUsage::default();
    for texture in textures {
        let size = texture.size();
        let texels = size.width as u64 * size.height as u64 * size.depth_or_array_layers as u64;
        usage.textures += 1;
        usage.bytes +=
            texels * texture.format().block_copy_size(Some(texture_aspect(texture))).unwrap_or(0) as u64;
    }
    usage
}

fn texture_aspect(texture: &Texture) -> TextureAspect {
    if texture.format().is_depth_stencil_format() { TextureAspect::DepthOnly } else { TextureAspect::All }
}
