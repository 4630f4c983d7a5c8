//! The intensities of a volume as a texture.

use bevy::{
    ecs::system::{SystemParamItem, lifetimeless::SRes},
    prelude::*,
    render::{
        render_asset::{PrepareAssetError, RenderAsset},
        render_resource::{Texture, TextureDataOrder, TextureUsages, TextureView},
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::formats::{Formats, volume_texture};
use crate::volume::{Intensities, Rescale, Volume, VolumeBudget, VolumeSize};

/// A [`Volume`] on the device.
pub(crate) struct GpuVolume {
    pub texture: Texture,
    pub view: TextureView,
    /// The stored intensity that the texture gives as 1.
    pub largest_stored: f64,
    /// Lowest and highest intensity, in the file's units, as the texture gives them.
    pub range: [f64; 2],
    /// How stored intensities become the file's units.
    pub rescale: Rescale,
}

impl RenderAsset for GpuVolume {
    type SourceAsset = Volume;
    type Param = (SRes<RenderDevice>, SRes<RenderQueue>, SRes<Formats>, SRes<VolumeBudget>);

    fn byte_len(volume: &Volume) -> Option<usize> {
        let bytes_per_voxel = match volume.intensities() {
            Intensities::U8(_) => 1,
            Intensities::U16(_) => 2,
        };
        Some(bytes_per_voxel * volume.intensities().len())
    }

    fn prepare_asset(
        volume: Volume,
        _: AssetId<Volume>,
        (device, queue, formats, budget): &mut SystemParamItem<Self::Param>,
        _: Option<&Self>,
    ) -> Result<Self, PrepareAssetError<Volume>> {
        let (format, bytes, largest_stored) = formats.encode_intensities(volume.intensities());
        // One beyond the budget was reported; its place is taken by a single voxel, which matches no
        // volume of that size and so is never shown.
        let fits = budget.check(VolumeSize::of(&volume), &device.limits()).is_ok();
        let dimensions = if fits { volume.dimensions() } else { UVec3::ONE };
        let texture = device.create_texture_with_data(
            queue,
            &volume_texture("contextual_ao_intensities", dimensions, format, TextureUsages::COPY_DST),
            TextureDataOrder::default(),
            &bytes,
        );
        let range = volume.range().map(|value| volume.to_stored(value) / largest_stored);
        let view = texture.create_view(&default());
        Ok(Self { view, texture, largest_stored, range, rescale: volume.rescale() })
    }
}

impl GpuVolume {
    /// Number of voxels.
    pub fn dimensions(&self) -> UVec3 {
        let size = self.texture.size();
        UVec3::new(size.width, size.height, size.depth_or_array_layers)
    }
}
