//! The passes of occlusion sweeping over one volume.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::render_resource::{
        BindGroup, BindGroupEntry, BindGroupLayoutEntry, BindingResource, Buffer, CommandEncoder,
        PipelineCache, ShaderStages, StorageTextureAccess, TextureFormat,
        binding_types::{
            storage_buffer_read_only_sized, storage_buffer_sized, texture_storage_3d, uniform_buffer,
        },
    },
    shader::ShaderDefVal,
};

use super::{
    resources::{
        CLIP_PASS, DISTANCES, FOUND, OCCLUSION, SETTINGS, SURFACE, SURFACE_FORMAT, SweepResources,
        SweepingUniform,
    },
    sweeps::{Sweep, SweepKinds},
};
use crate::render::{
    gpu::{
        compute_pass::{ComputePass, Groups, PassDescriptor, are_ready},
        device::Gpu,
        formats::Formats,
    },
    volumes::{clip_pass::ClipPassUniform, layouts::bricks_layout, store::VolumeResources},
};

pub(crate) struct SweepPasses {
    /// Finds differences of intensities from the isovalue. The next pass finds distances of voxels next to the surface.
    measure_differences: ComputePass,
    initialize_distances: ComputePass,
    sweeps: SweepKinds,
    /// Of factors and of octants, each from the volume's grid and from a turned grid.
    collect: [[ComputePass; 2]; 2],
    collect_surface: ComputePass,
}

impl FromWorld for SweepPasses {
    fn from_world(world: &mut World) -> Self {
        let sweeps = SweepKinds::from_world(world);
        let stages = ShaderStages::COMPUTE;
        let settings = uniform_buffer::<SweepingUniform>(false).build(SETTINGS, stages);
        let coverage = uniform_buffer::<ClipPassUniform>(false).build(CLIP_PASS, stages);
        let written = |binding: u32| storage_buffer_sized(false, None).build(binding, stages);
        let pass = |name, shader, entry_point, defs: &[&'static str], own: &[BindGroupLayoutEntry]| {
            let descriptor = PassDescriptor {
                name,
                shader,
                entry_point: Some(entry_point),
                shader_defs: defs.iter().map(|def| ShaderDefVal::from(*def)).collect(),
                before: vec![bricks_layout()],
                own,
                ..default()
            };
            ComputePass::new(world, descriptor)
        };
        let isosurface: Handle<Shader> = load_embedded_asset!(world, "isosurface.wgsl");
        let initialize = |entry_point, own: &[BindGroupLayoutEntry]| {
            pass("contextual_ao_isosurface", isosurface.clone(), entry_point, &[], own)
        };
        let collect: Handle<Shader> = load_embedded_asset!(world, "collect.wgsl");
        let collect = |octants: Option<&'static str>, turned: Option<&'static str>, format: TextureFormat| {
            let defs: Vec<_> = octants.into_iter().chain(turned).collect();
            let read = storage_buffer_read_only_sized(false, None).build(FOUND, stages);
            let occlusion =
                texture_storage_3d(format, StorageTextureAccess::WriteOnly).build(OCCLUSION, stages);
            pass(
                "contextual_ao_sweep_collect",
                collect.clone(),
                "collect",
                &defs,
                &[settings, read, occlusion],
            )
        };
        let factors = world.resource::<Formats>().scalar;
        let collect = [(None, factors), (Some("OCTANTS"), TextureFormat::Rgba8Unorm)]
            .map(|(octants, format)| [None, Some("TURNED")].map(|turned| collect(octants, turned, format)));
        let surface = [
            settings,
            storage_buffer_read_only_sized(false, None).build(DISTANCES, stages),
            texture_storage_3d(SURFACE_FORMAT, StorageTextureAccess::WriteOnly).build(SURFACE, stages),
        ];
        let [found, distances] = [FOUND, DISTANCES].map(written);
        Self {
            measure_differences: initialize("measure_differences", &[settings, coverage, found]),
            initialize_distances: initialize("initialize_distances", &[settings, found, distances]),
            sweeps,
            collect,
            collect_surface: pass(
                "contextual_ao_sweep_surface",
                load_embedded_asset!(world, "surface.wgsl"),
                "collect_surface",
                &[],
                &surface,
            ),
        }
    }
}

/// The passes over one volume.
pub(crate) struct SweepJob {
    volume: BindGroup,
    dimensions: UVec3,
    found: Buffer,
    isosurface: Option<[BindGroup; 2]>,
    sweeps: Vec<Sweep>,
    /// Whether light is found, not distances alone.
    finds_light: bool,
    /// Whether each octant's visibility is kept, not their mean.
    keeps_octants: bool,
    /// Whether the light goes through a turned grid.
    is_turned: bool,
    collect: BindGroup,
    surface: Option<BindGroup>,
}

impl SweepPasses {
    pub fn are_ready(&self, cache: &PipelineCache) -> bool {
        let passes = [&self.measure_differences, &self.initialize_distances, &self.collect_surface];
        let passes = passes.into_iter().chain(self.sweeps.all()).chain(self.collect.iter().flatten());
        are_ready(passes, cache)
    }

    /// Binds the resources of a volume. `distances_alone` leaves out the light, if there are distances.
    pub fn bind_volume(
        &self,
        volume: &VolumeResources,
        sweeping: &mut SweepResources,
        group: &BindGroup,
        distances_alone: bool,
        gpu: &Gpu,
    ) -> Option<SweepJob> {
        let Gpu { device, queue, cache, .. } = gpu;
        sweeping.uniform.write_buffer(device, queue);
        sweeping.plan.uniforms.write_buffer(device, queue);
        let settings = (SETTINGS, sweeping.uniform.binding()?);
        let coverage = (CLIP_PASS, volume.pass.binding()?);
        let found = (FOUND, sweeping.found.as_entire_binding());
        let occlusion = (OCCLUSION, BindingResource::TextureView(&volume.occlusion.view));
        let bind = |pass: &ComputePass, resources: &[(u32, BindingResource)]| {
            let entries = resources.iter().cloned();
            let entries = entries.map(|(binding, resource)| BindGroupEntry { binding, resource });
            pass.bind_entries(&entries.collect::<Vec<_>>(), cache, device)
        };
        let is_turned = sweeping.plan.cells().is_some();
        let collect = self.collect(sweeping.keeps_octants, is_turned);
        let isosurface = sweeping.distances.as_ref().map(|distances| {
            let distances = (DISTANCES, distances.as_entire_binding());
            let measured = [settings.clone(), coverage, found.clone()];
            let initialized = [settings.clone(), found.clone(), distances];
            [bind(&self.measure_differences, &measured), bind(&self.initialize_distances, &initialized)]
        });
        Some(SweepJob {
            volume: group.clone(),
            dimensions: sweeping.dimensions,
            found: sweeping.found.clone(),
            isosurface,
            sweeps: self.sweeps.plan(volume, sweeping, distances_alone, gpu)?,
            finds_light: !distances_alone || sweeping.distances.is_none(),
            keeps_octants: sweeping.keeps_octants,
            is_turned,
            collect: bind(collect, &[settings.clone(), found, occlusion]),
            surface: sweeping.distances.as_ref().zip(sweeping.surface.as_ref()).map(
                |(distances, surface)| {
                    let distances = (DISTANCES, distances.as_entire_binding());
                    let surface = (SURFACE, BindingResource::TextureView(&surface.view));
                    bind(&self.collect_surface, &[settings.clone(), distances, surface])
                },
            ),
        })
    }

    fn collect(&self, keeps_octants: bool, is_turned: bool) -> &ComputePass {
        &self.collect[usize::from(keeps_octants)][usize::from(is_turned)]
    }

    pub fn encode(&self, encoder: &mut CommandEncoder, job: &SweepJob, cache: &PipelineCache) {
        let volume = &job.volume;
        let voxels = Groups::Voxels(job.dimensions);
        if let Some([measured, initialized]) = &job.isosurface {
            self.measure_differences.encode(encoder, [volume, measured], voxels, cache);
            self.initialize_distances.encode(encoder, [volume, initialized], voxels, cache);
        }
        if job.finds_light {
            encoder.clear_buffer(&job.found, 0, None);
        }
        for sweep in &job.sweeps {
            self.sweeps.encode(encoder, volume, sweep, cache);
        }
        if job.finds_light {
            let collect = self.collect(job.keeps_octants, job.is_turned);
            collect.encode(encoder, [volume, &job.collect], voxels, cache);
        }
        if let Some(surface) = &job.surface {
            self.collect_surface.encode(encoder, [volume, surface], voxels, cache);
        }
    }
}
