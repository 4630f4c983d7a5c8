//! What each volume keeps on the device from frame to frame.

use bevy::{
    log::warn_once,
    platform::collections::{HashMap, HashSet},
    prelude::*,
    render::{
        render_asset::RenderAssets,
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

use super::{
    brick_resources::BrickResources,
    carver_uniform::{CarverTable, CarverUniform},
    clip_maps::ClipMaps,
    extract::{ExtractedScene, ExtractedVolume},
    filtering::FilteringResources,
    formats::{Formats, volume_texture},
    gpu_volume::GpuVolume,
    occlusion_texels::OcclusionTexels,
    pass_uniforms::OcclusionPassUniform,
    sweeping::{SweepResources, TABLE_ROWS, geometry_term_table},
    textures::{TextureAndView, largest_storage_buffer, usage_of, usage_of_buffers},
    volume_state::VolumeState,
    volume_uniform::{VolumeUniform, ray_table},
};
use crate::{
    diagnostics::GpuUsage,
    occlusion::OcclusionMethod,
    volume::{LookupTable, Rescale, Volume},
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
    identity: VolumeIdentity,
    /// [V]
    pub intensities: TextureView,
    intensity_texture: Texture,
    pub largest_stored: f64,
    /// Lowest and highest intensity, as the texture gives them.
    range: [f64; 2],
    rescale: Rescale,
    /// The transfer function; behind it, where octants are drawn, their geometry term.
    pub lookup_table: TextureAndView,
    /// Opacity after clipping [V_o].
    pub opacities: TextureAndView,
    /// Occlusion as drawn [V_AO].
    pub occlusion: TextureAndView,
    pub uniform: UniformBuffer<VolumeUniform>,
    pub carvers: UniformBuffer<CarverTable>,
    pub pass: UniformBuffer<OcclusionPassUniform>,
    /// Carvers that changed, as they were and as they are.
    pub changes: StorageBuffer<Vec<CarverUniform>>,
    pub rays: StorageBuffer<Vec<Vec4>>,
    pub bricks: BrickResources,
    /// Of progressive rays: the sum of what they found so far, a number a voxel. There is none if the device cannot
    /// bind it; then all rays are cast at once.
    pub ray_sums: Option<Buffer>,
    pub sweeping: Option<SweepResources>,
    pub filtering: Option<FilteringResources>,
    pub state: VolumeState,
}

/// Tells one content of a volume's textures from another.
#[derive(Clone, Copy, PartialEq, Eq)]
struct VolumeIdentity {
    asset: AssetId<Volume>,
    revision: u32,
    texels: OcclusionTexels,
}

impl VolumeIdentity {
    fn of(volume: &ExtractedVolume, device: &RenderDevice) -> Self {
        Self {
            asset: volume.asset,
            revision: volume.table.volume_revision,
            texels: OcclusionTexels::of(&volume.occlusion, volume.geometry.dimensions, device),
        }
    }
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
    pub(super) fn update(
        &mut self,
        scene: &ExtractedScene,
        volumes: &RenderAssets<GpuVolume>,
        formats: &Formats,
        device: &RenderDevice,
    ) {
        let alive: HashSet<_> = scene.volumes.iter().map(|volume| volume.entity).collect();
        self.0.retain(|entity, _| alive.contains(entity));
        for volume in &scene.volumes {
            let identity = VolumeIdentity::of(volume, device);
            let resources = self.0.get_mut(&volume.entity);
            if let Some(resources) = resources.filter(|resources| resources.identity == identity) {
                resources.keep_for_method(volume, device);
                continue;
            }
            self.0.remove(&volume.entity);
            let gpu_volume = volumes.get(volume.asset);
            if let Some(gpu_volume) = gpu_volume.filter(|gpu| gpu.dimensions() == volume.geometry.dimensions)
            {
                let mut resources = VolumeResources::new(identity, volume, gpu_volume, formats, device);
                resources.keep_for_method(volume, device);
                self.0.insert(volume.entity, resources);
            }
        }
    }

    /// What the volumes take on the device.
    pub(super) fn usage(&self) -> GpuUsage {
        self.0.values().fold(default(), |sum: GpuUsage, volume| sum + volume.usage())
    }
}

impl VolumeResources {
    fn new(
        identity: VolumeIdentity,
        volume: &ExtractedVolume,
        gpu_volume: &GpuVolume,
        formats: &Formats,
        device: &RenderDevice,
    ) -> Self {
        let written = |label, (size, format)| {
            let descriptor = volume_texture(label, size, format, TextureUsages::STORAGE_BINDING);
            TextureAndView::new(device, &descriptor, TextureViewDimension::D3)
        };
        let dimensions = volume.geometry.dimensions;
        Self {
            identity,
            intensities: gpu_volume.view.clone(),
            intensity_texture: gpu_volume.texture.clone(),
            largest_stored: gpu_volume.largest_stored,
            rescale: gpu_volume.rescale,
            range: gpu_volume.range,
            lookup_table: TextureAndView::new(
                device,
                &TextureDescriptor {
                    label: Some("contextual_ao_lookup_table"),
                    size: Extent3d {
                        width: LookupTable::ENTRIES as u32,
                        height: 1 + if identity.texels == OcclusionTexels::Octants { TABLE_ROWS } else { 0 },
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
            opacities: written("contextual_ao_opacities", (dimensions, formats.scalar)),
            occlusion: written("contextual_ao_occlusion", identity.texels.texture(dimensions, formats)),
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
        }
    }

    /// Makes what the volume's occlusion method needs for itself, and frees what others had.
    fn keep_for_method(&mut self, volume: &ExtractedVolume, device: &RenderDevice) {
        self.keep_ray_sums(volume, device);
        self.filtering = FilteringResources::kept(self.filtering.take(), volume, self.range, device);
        match &volume.occlusion.method {
            OcclusionMethod::Sweeping(settings) => {
                let stored = (self.rescale, self.largest_stored);
                let texels = self.identity.texels;
                SweepResources::keep(&mut self.sweeping, settings, volume, texels, stored, device);
            }
            _ => self.sweeping = None,
        }
    }

    fn keep_ray_sums(&mut self, volume: &ExtractedVolume, device: &RenderDevice) {
        let is_progressive = matches!(volume.occlusion.method, OcclusionMethod::Progressive(_));
        let size = 4 * volume.geometry.dimensions.as_u64vec3().element_product();
        let most = largest_storage_buffer(device);
        if is_progressive && size > most {
            warn_once!(
                "progressive rays need {size} bytes in a buffer, the device allows {most}: all are cast at once"
            );
        }
        let keeps = is_progressive && size <= most;
        if keeps != self.ray_sums.is_some() {
            let descriptor = BufferDescriptor {
                label: Some("contextual_ao_ray_sums"),
                size,
                usage: BufferUsages::STORAGE,
                mapped_at_creation: false,
            };
            self.ray_sums = keeps.then(|| device.create_buffer(&descriptor));
        }
    }

    /// Whether there is what a method needs: the device may be too small.
    pub fn can_compute(&self, method: &OcclusionMethod) -> bool {
        match method {
            OcclusionMethod::Sweeping(_) => self.sweeping.is_some(),
            OcclusionMethod::Filtering(_) => self.filtering.is_some(),
            _ => true,
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
        if self.state.table_revision.is_none() && self.identity.texels == OcclusionTexels::Octants {
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
        usage_of([
            &self.intensity_texture,
            &self.lookup_table.texture,
            &self.opacities.texture,
            &self.occlusion.texture,
        ]) + self.bricks.usage()
            + usage_of_buffers(&self.ray_sums)
            + self.filtering.as_ref().map_or_else(default, FilteringResources::usage)
            + sweeping
    }
}

/// Allocates and frees, before materials bind what there is.
pub(crate) fn prepare_resources(
    scene: Res<ExtractedScene>,
    gpu_volumes: Res<RenderAssets<GpuVolume>>,
    formats: Res<Formats>,
    device: Res<RenderDevice>,
    mut volumes: ResMut<VolumeStore>,
    mut clip_maps: ResMut<ClipMaps>,
) {
    clip_maps.update(&scene, &device);
    volumes.update(&scene, &gpu_volumes, &formats, &device);
}
