//! The textures of the clip maps: arrays shared by all carvers, and intermediate textures for finding a mesh's layers.

use bevy::{
    prelude::*,
    render::{
        render_resource::{
            Buffer, BufferDescriptor, BufferUsages, Extent3d, Origin3d, TexelCopyTextureInfo, TextureFormat,
            TextureUsages, WgpuLimits,
        },
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::surface_count::layers_of;
use crate::{
    diagnostics::GpuUsage,
    render::gpu::textures::{TextureAndView, usage_of},
};

/// Depth map texels per dilation map texel, along each side. Dilation bounds are smooth, and hold over whole texels.
const TEXELS_PER_DILATION_TEXEL: u32 = 8;

/// Depth map texels along each side of a tile, whose extrema are found before dilation (`TILE` in WGSL).
pub(in crate::render) const TEXELS_PER_TILE: u32 = 16;

/// Bytes of `Progress` in WGSL.
pub(in crate::render) const PEEL_BYTES_PER_TEXEL: u64 = 8;

/// Format of the depth maps: near and far.
pub(crate) const LAYER_FORMAT: TextureFormat = TextureFormat::Rg32Float;
/// Format of the dilation maps: near and far of the inflated layer, then of the shrunk layer.
pub(crate) const DILATION_FORMAT: TextureFormat = TextureFormat::Rgba32Float;
/// Format of one surface seen by a clip camera.
pub(crate) const SURFACE_FORMAT: TextureFormat = TextureFormat::Depth32Float;
/// Format of counts of surfaces: front faces minus back faces, and all faces.
pub(crate) const COUNT_FORMAT: TextureFormat = TextureFormat::Rg16Float;

/// Consecutive layers of the arrays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct LayerRange {
    pub first: u32,
    pub count: u32,
}

impl LayerRange {
    /// Whether a mesh with `surfaces` surfaces along a line of sight has more layers than this range.
    pub fn cuts_off(self, surfaces: u32) -> bool {
        layers_of(surfaces) > self.count
    }
}

/// The texture arrays, with one layer in each for every layer of every carver, and intermediate textures.
#[derive(Clone)]
pub(crate) struct ClipTextures {
    /// Number of layers in each array.
    pub capacity: u32,
    /// Texels per side of a depth map.
    pub depth_map_size: u32,
    /// Near and far depth of a layer; near 1 and far 0 where the layer is empty.
    pub depth: TextureAndView,
    /// Near and far bound of the inflated layer, then of the shrunk layer.
    pub dilation: TextureAndView,
    /// Extrema of the tiles of the layer being dilated.
    pub tiles: TextureAndView,
    /// Surfaces along each line of sight of the carver being drawn.
    pub counts: TextureAndView,
    /// Two surfaces of this carver: nearest and farthest, or one peel and the next.
    pub surfaces: [TextureAndView; 2],
    /// Additional resources for peeling more than one layer, made when the first mesh needs them.
    pub peeling: Option<PeelTextures>,
}

/// State kept from one peel to the next.
#[derive(Clone)]
pub(crate) struct PeelTextures {
    /// Counts of surfaces up to the last peeled surface.
    pub passed: TextureAndView,
    /// The layer being filled at every texel.
    pub progress: Buffer,
}

/// Depth map size that divides into tiles, and that the device can hold and peel.
pub(crate) fn depth_map_size(requested: u32, limits: &WgpuLimits) -> u32 {
    let peeled_bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    let peeled = (peeled_bytes / PEEL_BYTES_PER_TEXEL).isqrt() as u32;
    let largest = limits.max_texture_dimension_2d.min(peeled);
    let step = TEXELS_PER_TILE;
    requested.clamp(step, largest).next_multiple_of(step).min(largest / step * step)
}

fn depth_maps(capacity: u32, size: u32, device: &RenderDevice) -> TextureAndView {
    TextureAndView::array(device, "contextual_ao_depth_maps", (size, capacity), LAYER_FORMAT, KEPT)
}

fn dilation_maps(capacity: u32, depth_map_size: u32, device: &RenderDevice) -> TextureAndView {
    let size = depth_map_size / TEXELS_PER_DILATION_TEXEL;
    TextureAndView::array(device, "contextual_ao_dilation_maps", (size, capacity), DILATION_FORMAT, KEPT)
}

/// Usage of maps that passes write, and that are copied when layers are rearranged.
const KEPT: TextureUsages =
    TextureUsages::STORAGE_BINDING.union(TextureUsages::COPY_SRC).union(TextureUsages::COPY_DST);

impl ClipTextures {
    pub fn new(capacity: u32, depth_map_size: u32, device: &RenderDevice) -> Self {
        let stored = TextureUsages::STORAGE_BINDING;
        let drawn = TextureUsages::RENDER_ATTACHMENT;
        let square = |label, size, format, usage| TextureAndView::single(device, label, size, format, usage);
        let tiles = depth_map_size / TEXELS_PER_TILE;
        let surface = || square("contextual_ao_surface", depth_map_size, SURFACE_FORMAT, drawn);
        Self {
            capacity,
            depth_map_size,
            depth: depth_maps(capacity, depth_map_size, device),
            dilation: dilation_maps(capacity, depth_map_size, device),
            tiles: square("contextual_ao_depth_tiles", tiles, DILATION_FORMAT, stored),
            counts: square("contextual_ao_surface_counts", depth_map_size, COUNT_FORMAT, drawn),
            surfaces: [surface(), surface()],
            peeling: None,
        }
    }

    /// The same maps in arrays of `capacity` layers. Each move copies a range of layers to a new first layer.
    pub fn moved(
        &self,
        capacity: u32,
        moves: &[(LayerRange, u32)],
        device: &RenderDevice,
        queue: &RenderQueue,
    ) -> Self {
        let depth = depth_maps(capacity, self.depth_map_size, device);
        let dilation = dilation_maps(capacity, self.depth_map_size, device);
        let mut encoder = device.create_command_encoder(&default());
        for (from, to) in [(&self.depth, &depth), (&self.dilation, &dilation)] {
            for &(layers, first) in moves.iter().filter(|(layers, _)| layers.count > 0) {
                let at = |layer| Origin3d { z: layer, ..default() };
                let size = Extent3d { depth_or_array_layers: layers.count, ..from.texture.size() };
                encoder.copy_texture_to_texture(
                    TexelCopyTextureInfo { origin: at(layers.first), ..from.texture.as_image_copy() },
                    TexelCopyTextureInfo { origin: at(first), ..to.texture.as_image_copy() },
                    size,
                );
            }
        }
        queue.submit([encoder.finish()]);
        Self { capacity, depth, dilation, ..self.clone() }
    }

    /// Makes the resources for peeling, if they are missing.
    pub fn prepare_peeling(&mut self, device: &RenderDevice) -> &PeelTextures {
        let size = self.depth_map_size;
        self.peeling.get_or_insert_with(|| PeelTextures {
            passed: TextureAndView::single(
                device,
                "contextual_ao_surfaces_passed",
                size,
                COUNT_FORMAT,
                TextureUsages::RENDER_ATTACHMENT,
            ),
            progress: device.create_buffer(&BufferDescriptor {
                label: Some("contextual_ao_peel_progress"),
                size: PEEL_BYTES_PER_TEXEL * u64::from(size) * u64::from(size),
                usage: BufferUsages::STORAGE | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
        })
    }

    /// Number of tiles along each side of a depth map.
    pub fn tile_count(&self) -> u32 {
        self.depth_map_size / TEXELS_PER_TILE
    }

    /// Texels per side of a dilation map.
    pub fn dilation_map_size(&self) -> u32 {
        self.depth_map_size / TEXELS_PER_DILATION_TEXEL
    }

    /// GPU usage of the textures.
    pub fn usage(&self) -> GpuUsage {
        let [first, second] = &self.surfaces;
        let all = [&self.depth, &self.dilation, &self.tiles, &self.counts, first, second];
        let mut usage = usage_of(all.map(|texture| &texture.texture));
        if let Some(peeling) = &self.peeling {
            usage = usage + usage_of([&peeling.passed.texture]);
            usage.bytes += peeling.progress.size();
        }
        usage
    }
}
