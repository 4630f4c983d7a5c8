//! Resources that summed-area tables keep on the GPU for a volume.

use bevy::{
    prelude::*,
    render::{
        render_resource::{Buffer, BufferDescriptor, BufferUsages, ShaderType, StorageBuffer},
        renderer::RenderDevice,
    },
};

use crate::{
    diagnostics::GpuUsage,
    occlusion::SummedAreaOcclusion,
    render::{
        gpu::{device::Gpu, textures::usage_of_buffers},
        volumes::kept::MethodResources,
    },
    volume::VolumeGeometry,
};

/// A shell of the box around a voxel, `Shell` in WGSL.
#[derive(Clone, Copy, Debug, Default, PartialEq, ShaderType)]
pub(crate) struct Shell {
    radii: UVec3,
    steps: f32,
}

impl Shell {
    /// All shells of the settings, from the inside out.
    fn all(settings: &SummedAreaOcclusion, geometry: &VolumeGeometry) -> Vec<Self> {
        let shells = settings.shell_radii(geometry).into_iter();
        shells.map(|(radii, steps)| Self { radii, steps: steps as f32 }).collect()
    }
}

/// The table of one volume, and the shells that it is read by.
pub(crate) struct SummedAreaResources {
    /// Sum of opacities up to every voxel, a word each, x fastest.
    pub table: Buffer,
    pub shells: StorageBuffer<Vec<Shell>>,
    /// Whether the table is up to date.
    pub has_table: bool,
    /// Whether the occlusion is up to date.
    pub has_factors: bool,
}

impl MethodResources for SummedAreaResources {
    fn usage(&self) -> GpuUsage {
        usage_of_buffers([&self.table])
    }
}

impl SummedAreaResources {
    pub fn new(dimensions: UVec3, device: &RenderDevice) -> Self {
        let table = device.create_buffer(&BufferDescriptor {
            label: Some("contextual_ao_summed_area_table"),
            size: 4 * dimensions.as_u64vec3().element_product(),
            usage: BufferUsages::STORAGE,
            mapped_at_creation: false,
        });
        Self { table, shells: default(), has_table: false, has_factors: false }
    }

    /// Writes the shells of the settings.
    pub fn write_shells(&mut self, settings: &SummedAreaOcclusion, geometry: &VolumeGeometry, gpu: &Gpu) {
        let shells = Shell::all(settings, geometry);
        // The shader counts shells by the buffer's length, which a buffer keeps when less is written.
        if *self.shells.get() != shells {
            self.shells = shells.into();
            self.shells.write_buffer(&gpu.device, &gpu.queue);
        }
    }
}
