//! What each volume keeps on the device from frame to frame.

use bevy::{
    platform::collections::{HashMap, HashSet},
    prelude::*,
    render::{
        render_resource::{
            Buffer, BufferDescriptor, BufferUsages, Extent3d, Origin3d, StorageBuffer, TexelCopyBufferLayout,
            TexelCopyTextureInfo, Texture, TextureDescriptor, TextureDimension, TextureFormat, TextureUsages,
            TextureView, TextureViewDimension, UniformBuffer,
        },
        renderer::{RenderDevice, RenderQueue},
        sync_world::MainEntity,
    },
};
use core::iter;
use std::sync::Arc;

use super::{
    brick_resources::BrickResources,
    carver_uniform::{CarverTable, CarverUniform},
    gpu_volume::GpuVolume,
    occlusion_texels::OcclusionTexels,
    pass_uniforms::OcclusionPassUniform,
    volume_state::VolumeState,
    volume_uniform::{VolumeUniform, ray_table},
};
use crate::{
    diagnostics::GpuUsage,
    occlusion::OcclusionMethod,
    render::{
        carvers::clip_maps::ClipMaps,
        extract::{ExtractedScene, ExtractedVolume},
        gpu::{
            formats::{Formats, volume_texture},
            textures::{TextureAndView, usage_of, usage_of_buffers},
        },
        methods::{
            filtering::FilteringResources,
            sweeping::{SweepResources, TABLE_ROWS, geometry_term_table},
        },
    },
    volume::{LookupTable, Rescale},
};

/// The resources of every volume in the scene, by the main world's entity.
///
/// It lives in the render world. Its textures may be read there, after a frame.
#[derive(Resource, Default)]
pub struct VolumeStore(pub(crate) HashMap<MainEntity, VolumeResources>);

/// A texture of one value in [0, 1] per voxel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VolumeTexture {
    /// Opacity after clipping, of one occlusion step.
    Opacities,
    /// Occlusion as drawn, 1 where unoccluded. By rays: only where [`VoxelMask::Valid`] holds, and a texel for
    /// 2x2x2 voxels at half resolution. By other methods: of all voxels; with a geometry term in sweeping, four
    /// octants in four channels and the others behind them along z; with modulation in filtering, the share of
    /// the opacity that is drawn in the second channel.
    Occlusion,
}

/// A yes or no per voxel. In the order of the masks on the device, of which there is one more between.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VoxelMask {
    /// The occlusion is up to date: it has been cast since anything changed that it depends on. Says nothing
    /// of voxels that are hidden.
    Valid = 0,
    /// No point that is drawn reads the voxel: what reads it is clipped, or transparent.
    Hidden = 2,
}

/// Textures and buffers of one volume. The volumes' names in the paper are in brackets.
pub(crate) struct VolumeResources {
    /// [V]
    pub gpu_volume: Arc<GpuVolume>,
    rescale: Rescale,
    /// Lowest and highest intensity, as the texture gives them.
    range: [f64; 2],
    /// The transfer function; behind it, for octants, their geometry term.
    pub lookup_table: TextureAndView,
    /// Opacity after clipping [V_o].
    pub opacities: TextureAndView,
    /// Occlusion as drawn [V_AO].
    pub occlusion: TextureAndView,
    texels: OcclusionTexels,
    pub uniform: UniformBuffer<VolumeUniform>,
    pub carvers: UniformBuffer<CarverTable>,
    pub pass: UniformBuffer<OcclusionPassUniform>,
    /// Carvers that changed, as they were and as they are.
    pub changes: StorageBuffer<Vec<CarverUniform>>,
    pub rays: StorageBuffer<Vec<Vec4>>,
    pub bricks: BrickResources,
    /// Of progressive rays: the sum of what they found so far, a number a voxel.
    pub ray_sums: Option<Buffer>,
    pub sweeping: Option<SweepResources>,
    pub filtering: Option<FilteringResources>,
    pub state: VolumeState,
}

impl VolumeStore {
    /// A texture of the volume on an entity of the main world: one channel counts, of format
    /// `R8Unorm` or, where the device cannot write that, `Rgba8Unorm`. `None` while there is no such volume.
    pub fn texture(&self, volume: Entity, texture: VolumeTexture) -> Option<&Texture> {
        let resources = self.0.get(&MainEntity::from(volume))?;
        Some(match texture {
            VolumeTexture::Opacities => &resources.opacities.texture,
            VolumeTexture::Occlusion => &resources.occlusion.texture,
        })
    }

    /// A mask of the volume on an entity of the main world: the buffer, and first byte and size of the
    /// mask in it. Two words for every brick of 4x4x4 voxels, a bit each, x fastest in all.
    pub fn mask(&self, volume: Entity, mask: VoxelMask) -> Option<(&Buffer, u64, u64)> {
        let bricks = &self.0.get(&MainEntity::from(volume))?.bricks;
        let (first, size) = bricks.mask(mask as u32);
        Some((&bricks.voxel_masks, first, size))
    }

    /// Of a volume swept by an isovalue ([`SweepingSurface`](crate::occlusion::SweepingSurface)): the signed distance
    /// of every voxel from the surface, 32-bit floats, mm, x fastest; below 0 inside, 1e18 or -1e18 where
    /// there is no surface; as if the grid's axes were perpendicular.
    pub fn signed_distances(&self, volume: Entity) -> Option<&Buffer> {
        self.0.get(&MainEntity::from(volume))?.sweeping.as_ref()?.distances.as_ref()
    }

    /// Makes what volumes that came, or changed their data, need; frees what the others had.
    pub(in crate::render) fn update(
        &mut self,
        scene: &ExtractedScene,
        formats: &Formats,
        device: &RenderDevice,
        queue: &RenderQueue,
    ) {
        let alive: HashSet<_> = scene.volumes.iter().map(|volume| volume.entity).collect();
        self.0.retain(|entity, _| alive.contains(entity));
        for volume in &scene.volumes {
            let data = &volume.table.volume;
            let kept = self.0.remove(&volume.entity).filter(|kept| kept.gpu_volume.holds(data));
            let mut resources = kept.unwrap_or_else(|| {
                let shared = self.0.values().find(|other| other.gpu_volume.holds(data));
                let gpu_volume = shared.map_or_else(
                    || Arc::new(GpuVolume::new(data, formats, device, queue)),
                    |other| other.gpu_volume.clone(),
                );
                VolumeResources::new(gpu_volume, volume, formats, device, queue)
            });
            resources.keep_for_method(volume, formats, device);
            self.0.insert(volume.entity, resources);
        }
    }

    /// What the volumes take on the device.
    pub(in crate::render) fn usage(&self) -> GpuUsage {
        // Intensities are there once, however many entities show them.
        let mut counted = HashSet::new();
        let is_new = |volume: &&VolumeResources| counted.insert(Arc::as_ptr(&volume.gpu_volume));
        let intensities = usage_of(self.0.values().filter(is_new).map(|volume| &volume.gpu_volume.texture));
        self.0.values().fold(intensities, |sum, volume| sum + volume.usage())
    }
}

impl VolumeResources {
    fn new(
        gpu_volume: Arc<GpuVolume>,
        volume: &ExtractedVolume,
        formats: &Formats,
        device: &RenderDevice,
        queue: &RenderQueue,
    ) -> Self {
        let dimensions = volume.geometry.dimensions;
        let data = &volume.table.volume;
        let texels = OcclusionTexels::of(&volume.occlusion);
        let mut new = Self {
            rescale: data.rescale(),
            range: data.range().map(|value| data.to_stored(value) / gpu_volume.largest_stored),
            gpu_volume,
            lookup_table: TextureAndView::new(
                device,
                &TextureDescriptor {
                    label: Some("contextual_ao_lookup_table"),
                    size: Extent3d {
                        width: LookupTable::ENTRIES as u32,
                        height: 1 + TABLE_ROWS,
                        ..default()
                    },
                    mip_level_count: 1,
                    sample_count: 1,
                    dimension: TextureDimension::D2,
                    format: TextureFormat::Rgba32Float,
                    usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
                    view_formats: &[],
                },
                TextureViewDimension::D2,
            ),
            opacities: written("contextual_ao_opacities", dimensions, formats.scalar, device),
            occlusion: occlusion_texture(texels, dimensions, formats, device),
            texels,
            uniform: default(),
            carvers: default(),
            pass: default(),
            changes: default(),
            rays: default(),
            bricks: BrickResources::new(dimensions, device),
            ray_sums: None,
            sweeping: None,
            filtering: None,
            state: default(),
        };
        // The material binds them in the frame in which the volume comes, before they are known.
        new.uniform.write_buffer(device, queue);
        new.carvers.write_buffer(device, queue);
        new
    }

    /// Makes what the volume's occlusion method needs for itself, and frees what others had.
    fn keep_for_method(&mut self, volume: &ExtractedVolume, formats: &Formats, device: &RenderDevice) {
        let dimensions = volume.geometry.dimensions;
        let texels = OcclusionTexels::of(&volume.occlusion);
        if self.texels != texels {
            self.texels = texels;
            self.occlusion = occlusion_texture(texels, dimensions, formats, device);
        }
        let is_progressive = matches!(volume.occlusion.method, OcclusionMethod::Progressive(_));
        if is_progressive != self.ray_sums.is_some() {
            let descriptor = BufferDescriptor {
                label: Some("contextual_ao_ray_sums"),
                size: 4 * dimensions.as_u64vec3().element_product(),
                usage: BufferUsages::STORAGE,
                mapped_at_creation: false,
            };
            self.ray_sums = is_progressive.then(|| device.create_buffer(&descriptor));
        }
        self.filtering = FilteringResources::kept(self.filtering.take(), volume, self.range, device);
        match &volume.occlusion.method {
            OcclusionMethod::Sweeping(settings) => {
                let stored = (self.rescale, self.gpu_volume.largest_stored);
                SweepResources::keep(&mut self.sweeping, settings, volume, stored, device);
            }
            _ => self.sweeping = None,
        }
    }

    /// What surfaces are oriented by when views draw them: the distance field of a surface that is drawn
    /// alone, or the clipped opacities.
    pub fn orientations(&self) -> &TextureView {
        let surface = self.sweeping.as_ref().and_then(|sweeping| sweeping.surface.as_ref());
        &surface.unwrap_or(&self.opacities).view
    }

    /// Uploads the lookup table and the rays where they changed.
    pub fn upload(&mut self, volume: &ExtractedVolume, device: &RenderDevice, queue: &RenderQueue) {
        if !self.state.has_geometry_term && self.texels == OcclusionTexels::Octants {
            self.state.has_geometry_term = true;
            self.write_table_rows(1, &geometry_term_table(), queue);
        }
        if self.state.table_revision != Some(volume.table.revision) {
            self.state.table_revision = Some(volume.table.revision);
            self.write_table_rows(0, &volume.table.entries, queue);
            let mut opaque = 0u32;
            let before = volume.table.entries.iter().map(|entry| {
                opaque += u32::from(entry[3] > 0.0);
                opaque
            });
            let opaque_before: Vec<u32> = iter::once(0).chain(before).collect();
            queue.write_buffer(&self.bricks.opaque_before, 0, bytemuck::cast_slice(&opaque_before));
        }
        if self.state.rays_for.as_ref() != Some(&volume.occlusion) {
            self.state.rays_for = Some(volume.occlusion.clone());
            self.rays.set(ray_table(volume));
            self.rays.write_buffer(device, queue);
        }
    }

    /// Writes whole rows of the lookup table's texture.
    fn write_table_rows(&self, first: u32, texels: &[[f32; 4]], queue: &RenderQueue) {
        let texture = &self.lookup_table.texture;
        let width = texture.width();
        let origin = Origin3d { y: first, ..default() };
        let layout =
            TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(16 * width), rows_per_image: None };
        queue.write_texture(
            TexelCopyTextureInfo { origin, ..texture.as_image_copy() },
            bytemuck::cast_slice(texels),
            layout,
            Extent3d { width, height: texels.len() as u32 / width, ..default() },
        );
    }

    fn usage(&self) -> GpuUsage {
        let sweeping = self.sweeping.as_ref().map(SweepResources::usage).unwrap_or_default();
        usage_of([&self.lookup_table.texture, &self.opacities.texture, &self.occlusion.texture])
            + self.bricks.usage()
            + usage_of_buffers(&self.ray_sums)
            + self.filtering.as_ref().map_or_else(default, FilteringResources::usage)
            + sweeping
    }
}

/// A texture that passes write and views read.
fn written(label: &'static str, size: UVec3, format: TextureFormat, device: &RenderDevice) -> TextureAndView {
    let descriptor = volume_texture(label, size, format, TextureUsages::STORAGE_BINDING);
    TextureAndView::new(device, &descriptor, TextureViewDimension::D3)
}

fn occlusion_texture(
    texels: OcclusionTexels,
    voxels: UVec3,
    formats: &Formats,
    device: &RenderDevice,
) -> TextureAndView {
    written("contextual_ao_occlusion", texels.size(voxels), texels.format(formats), device)
}

/// Allocates and frees, before materials bind what there is.
pub(crate) fn prepare_resources(
    scene: Res<ExtractedScene>,
    formats: Res<Formats>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    mut volumes: ResMut<VolumeStore>,
    mut clip_maps: ResMut<ClipMaps>,
) {
    clip_maps.update(&scene, &device, &queue);
    volumes.update(&scene, &formats, &device, &queue);
}
