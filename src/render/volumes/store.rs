//! GPU resources that each volume keeps from frame to frame.

use bevy::{
    platform::collections::{HashMap, HashSet},
    prelude::*,
    render::{
        render_resource::{
            BindGroup, Buffer, StorageBuffer, Texture, TextureFormat, TextureUsages, TextureView,
            TextureViewDimension, TextureViewId, UniformBuffer,
        },
        renderer::{RenderDevice, RenderQueue},
        sync_world::MainEntity,
    },
};
use core::iter;
use std::sync::Arc;

use super::{
    bricks::BrickResources,
    carver_uniform::{CarverTable, CarverUniform},
    clip_pass::ClipPassUniform,
    contents::VolumeState,
    gpu_table::GpuTable,
    intensities::GpuVolume,
    kept::MethodResources,
    preintegration::StepLengths,
    uniform::VolumeUniform,
};
use crate::{
    diagnostics::GpuUsage,
    occlusion::OcclusionTexels,
    render::{
        extract::{ExtractedScene, ExtractedVolume},
        gpu::{
            formats::{Formats, volume_texture},
            textures::{TextureAndView, usage_of},
        },
    },
    volume::Rescale,
};

/// The resources of every volume in the scene, by the main world's entity.
///
/// It lives in the render world. Its textures may be read there, after a frame.
#[derive(Resource, Default)]
pub struct VolumeStore(pub(crate) HashMap<MainEntity, VolumeResources>);

/// A texture of one value in [0, 1] per voxel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum VolumeTexture {
    /// Opacity after clipping, of one occlusion step.
    Opacities,
    /// Occlusion factor as drawn, 1 where unoccluded.
    ///
    /// By rays: only where [`VoxelMask::Valid`] holds, with one texel for 2x2x2 voxels at half resolution. By other
    /// methods: all voxels. Sweeping with a geometry term has four octants in four channels, and the others behind them
    /// along z. Filtering with modulation has the drawn share of the opacity in the second channel.
    Occlusion,
}

/// A yes or no per voxel. The values are those of the masks on the GPU, which have one more mask in between.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum VoxelMask {
    /// The occlusion is up to date: it was cast after the last change of its inputs. Says nothing of hidden voxels.
    Valid = 0,
    /// No drawn point reads the voxel: all points that read it are clipped or transparent.
    Hidden = 2,
}

/// Textures and buffers of one volume. The paper's names of the volumes are in brackets.
pub(crate) struct VolumeResources {
    /// Intensities [V].
    pub gpu_volume: Arc<GpuVolume>,
    pub rescale: Rescale,
    /// Lowest and highest intensity, as the texture gives them.
    pub range: [f64; 2],
    pub lookup_table: GpuTable,
    /// Opacity after clipping [V_o].
    pub opacities: TextureAndView,
    /// Occlusion as drawn [V_AO].
    pub occlusion: TextureAndView,
    texels: OcclusionTexels,
    pub uniform: UniformBuffer<VolumeUniform>,
    pub carvers: UniformBuffer<CarverTable>,
    pub pass: UniformBuffer<ClipPassUniform>,
    /// Carvers that changed: past states, then present states.
    pub changes: StorageBuffer<Vec<CarverUniform>>,
    pub bricks: BrickResources,
    /// Resources of the occlusion method.
    pub kept: Option<Box<dyn MethodResources>>,
    pub state: VolumeState,
    pub(super) groups: Option<VolumeGroups>,
}

/// Group 0 of the passes over one volume. Clones share the groups.
#[derive(Clone)]
pub(crate) struct VolumeGroups {
    /// The bound textures that may be made anew: clip maps and the lookup table.
    pub(super) bound: [TextureViewId; 3],
    /// For passes that compute the data of bricks.
    pub volume: BindGroup,
    /// For passes that read the data of bricks.
    pub bricks: BindGroup,
    /// For passes that also light samples.
    pub lit: BindGroup,
}

impl VolumeStore {
    /// A texture of the volume on an entity of the main world. `None` while there is no such volume.
    ///
    /// Only the first channel counts, unless [`VolumeTexture`] names more. The format is `R8Unorm`, or `Rgba8Unorm` if
    /// the texture has more channels or the device cannot write `R8Unorm`.
    pub fn texture(&self, volume: Entity, texture: VolumeTexture) -> Option<&Texture> {
        let resources = self.0.get(&MainEntity::from(volume))?;
        Some(match texture {
            VolumeTexture::Opacities => &resources.opacities.texture,
            VolumeTexture::Occlusion => &resources.occlusion.texture,
        })
    }

    /// A mask of the volume on an entity of the main world: the buffer, and the mask's first byte and size. Every brick
    /// of 4x4x4 voxels has two words, with a bit per voxel. Bricks and bits are in order, x fastest.
    pub fn mask(&self, volume: Entity, mask: VoxelMask) -> Option<(&Buffer, u64, u64)> {
        let bricks = &self.0.get(&MainEntity::from(volume))?.bricks;
        let (first, size) = bricks.mask(mask as u32);
        Some((&bricks.voxel_masks, first, size))
    }

    /// The words of a volume's bricks, for tests: carvers near each brick, and the distance that rays may leap.
    #[doc(hidden)]
    pub fn brick_words(&self, volume: Entity) -> Option<&Texture> {
        Some(&self.0.get(&MainEntity::from(volume))?.bricks.words.texture)
    }

    /// Resources that the method of a volume keeps, if they are of this type.
    pub fn kept<T: MethodResources>(&self, volume: Entity) -> Option<&T> {
        self.0.get(&MainEntity::from(volume))?.kept.as_ref()?.get()
    }

    /// Makes the resources of volumes that came or changed their data. Frees those of volumes that are gone.
    fn update(
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
            resources.keep_texels(volume, formats, device);
            resources.keep_table(volume, device);
            self.0.insert(volume.entity, resources);
        }
    }

    /// GPU usage of the volumes.
    pub(in crate::render) fn usage(&self) -> GpuUsage {
        // Intensities are stored once, however many entities show them.
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
        let texels = volume.occlusion.texels();
        let mut new = Self {
            rescale: data.rescale(),
            range: data.range().map(|value| data.to_stored(value) / gpu_volume.largest_stored),
            gpu_volume,
            lookup_table: GpuTable::new(&volume.table, device),
            opacities: written("contextual_ao_opacities", dimensions, formats.scalar, device),
            occlusion: occlusion_texture(texels, dimensions, formats, device),
            texels,
            uniform: default(),
            carvers: default(),
            pass: default(),
            changes: default(),
            bricks: BrickResources::new(dimensions, device),
            kept: None,
            state: default(),
            groups: None,
        };
        // Drawing binds these buffers in the volume's first frame, before their values are known.
        new.uniform.write_buffer(device, queue);
        new.carvers.write_buffer(device, queue);
        new
    }

    /// Makes another occlusion texture if the volume's occlusion has other texels.
    fn keep_texels(&mut self, volume: &ExtractedVolume, formats: &Formats, device: &RenderDevice) {
        let texels = volume.occlusion.texels();
        if self.texels != texels {
            self.texels = texels;
            self.occlusion = occlusion_texture(texels, volume.geometry.dimensions, formats, device);
            // The new texture is empty, whatever the settings were when the volume was last seen.
            self.state.contents = None;
        }
    }

    /// Makes another table if the volume's table has another number of gradients.
    fn keep_table(&mut self, volume: &ExtractedVolume, device: &RenderDevice) {
        if !self.lookup_table.fits(&volume.table) {
            self.lookup_table = GpuTable::new(&volume.table, device);
            // The method writes its rows when it makes its resources.
            self.kept = None;
            self.state.contents = None;
        }
    }

    /// Texture that orients surfaces when views draw them.
    pub fn orientations(&self) -> &TextureView {
        let kept = self.kept.as_ref().and_then(|kept| kept.orientations());
        kept.unwrap_or(&self.opacities.view)
    }

    /// Uploads the lookup table if it changed, or the lengths of steps did.
    pub fn upload(&mut self, volume: &ExtractedVolume, steps: StepLengths, queue: &RenderQueue) {
        if self.lookup_table.upload(&volume.table, steps, queue) {
            let mut opaque = 0u32;
            let before = volume.table.largest_opacities().map(|opacity| {
                opaque += u32::from(opacity > 0.0);
                opaque
            });
            let opaque_before: Vec<u32> = iter::once(0).chain(before).collect();
            queue.write_buffer(&self.bricks.opaque_before, 0, bytemuck::cast_slice(&opaque_before));
        }
    }

    fn usage(&self) -> GpuUsage {
        usage_of([&self.lookup_table.texture.texture, &self.opacities.texture, &self.occlusion.texture])
            + self.bricks.usage()
            + self.kept.as_ref().map_or_else(default, |kept| kept.usage())
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
    let format = if texels.is_scalar() { formats.scalar } else { TextureFormat::Rgba8Unorm };
    written("contextual_ao_occlusion", texels.size(voxels), format, device)
}

/// Allocates and frees resources, before drawing binds them.
pub(crate) fn keep_volumes(
    scene: Res<ExtractedScene>,
    formats: Res<Formats>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    mut volumes: ResMut<VolumeStore>,
) {
    volumes.update(&scene, &formats, &device, &queue);
}
