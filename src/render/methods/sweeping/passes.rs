//! The passes of occlusion sweeping over one volume.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::render_resource::{
        BindGroup, BindGroupEntry, BindGroupLayoutEntry, BindingResource, Buffer, CommandEncoder,
        PipelineCache, ShaderStages, StorageTextureAccess, TextureFormat, TextureSampleType,
        binding_types::{
            storage_buffer_read_only_sized, storage_buffer_sized, texture_3d, texture_storage_3d,
            uniform_buffer,
        },
    },
    shader::ShaderDefVal,
};

use super::{
    planes::SweepPlane,
    resources::{SURFACE_FORMAT, SweepResources, SweepingUniform},
};
use crate::render::{
    gpu::{
        compute_pass::{ComputePass, Groups, PassDescriptor, are_ready},
        device::Gpu,
        formats::Formats,
    },
    volumes::{clip_pass::ClipPassUniform, layouts::bricks_layout, store::VolumeResources},
};

/// Binding numbers of a volume's resources, in group 1 of the passes.
const OPACITIES: u32 = 0;
const CLIP_PASS: u32 = 2;
const FACES: u32 = 4;
const FOUND: u32 = 5;
const DISTANCES: u32 = 6;
const OCCLUSION: u32 = 7;
// Uniforms are behind that of the clip pass (5 in docs/drivers.md).
const SETTINGS: u32 = 8;
const PLANE: u32 = 9;
const SURFACE: u32 = 10;

pub(crate) struct SweepPasses {
    /// Finds differences of intensities from the isovalue. The next pass finds distances of voxels next to the surface.
    measure_differences: ComputePass,
    initialize_distances: ComputePass,
    sweep_opacities: ComputePass,
    sweep_isosurface: ComputePass,
    sweep_distances_alone: ComputePass,
    collect_factors: ComputePass,
    collect_octants: ComputePass,
    collect_surface: ComputePass,
}

impl FromWorld for SweepPasses {
    fn from_world(world: &mut World) -> Self {
        let stages = ShaderStages::COMPUTE;
        let opacities = texture_3d(TextureSampleType::Float { filterable: true }).build(OPACITIES, stages);
        let settings = uniform_buffer::<SweepingUniform>(false).build(SETTINGS, stages);
        let coverage = uniform_buffer::<ClipPassUniform>(false).build(CLIP_PASS, stages);
        let plane = uniform_buffer::<SweepPlane>(true).build(PLANE, stages);
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
        let sweep: Handle<Shader> = load_embedded_asset!(world, "sweep.wgsl");
        let sweep = |defs: &[&'static str], own: &[BindGroupLayoutEntry]| {
            pass("contextual_ao_sweep", sweep.clone(), "sweep", defs, own)
        };
        let collect: Handle<Shader> = load_embedded_asset!(world, "collect.wgsl");
        let collect = |defs: &[&'static str], format: TextureFormat| {
            let read = storage_buffer_read_only_sized(false, None).build(FOUND, stages);
            let occlusion =
                texture_storage_3d(format, StorageTextureAccess::WriteOnly).build(OCCLUSION, stages);
            pass(
                "contextual_ao_sweep_collect",
                collect.clone(),
                "collect",
                defs,
                &[settings, read, occlusion],
            )
        };
        let surface = [
            settings,
            storage_buffer_read_only_sized(false, None).build(DISTANCES, stages),
            texture_storage_3d(SURFACE_FORMAT, StorageTextureAccess::WriteOnly).build(SURFACE, stages),
        ];
        let [faces, found, distances] = [FACES, FOUND, DISTANCES].map(written);
        Self {
            measure_differences: initialize("measure_differences", &[settings, coverage, found]),
            initialize_distances: initialize("initialize_distances", &[settings, found, distances]),
            sweep_opacities: sweep(&["LIGHT"], &[opacities, settings, plane, faces, found]),
            sweep_isosurface: sweep(&["LIGHT", "DISTANCES"], &[settings, plane, faces, found, distances]),
            sweep_distances_alone: sweep(&["DISTANCES"], &[settings, plane, distances]),
            collect_factors: collect(&[], world.resource::<Formats>().scalar),
            collect_octants: collect(&["OCTANTS"], TextureFormat::Rgba8Unorm),
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
    what: Swept,
    sweep: BindGroup,
    /// Offsets of the planes' uniforms, and workgroups of the planes.
    dispatches: Vec<(u32, UVec2)>,
    /// Whether each octant's visibility is kept, not their mean.
    keeps_octants: bool,
    collect: BindGroup,
    surface: Option<BindGroup>,
}

#[derive(Clone, Copy, PartialEq)]
enum Swept {
    Opacities,
    Isosurface,
    DistancesAlone,
}

impl SweepPasses {
    pub fn are_ready(&self, cache: &PipelineCache) -> bool {
        let passes = [
            &self.measure_differences,
            &self.initialize_distances,
            &self.sweep_opacities,
            &self.sweep_isosurface,
            &self.sweep_distances_alone,
            &self.collect_factors,
            &self.collect_octants,
            &self.collect_surface,
        ];
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
        sweeping.planes.write_buffer(device, queue);
        let settings = (SETTINGS, sweeping.uniform.binding()?);
        let opacities = (OPACITIES, BindingResource::TextureView(&volume.opacities.view));
        let coverage = (CLIP_PASS, volume.pass.binding()?);
        let plane = (PLANE, sweeping.planes.binding()?);
        let faces = (FACES, sweeping.faces.as_entire_binding());
        let found = (FOUND, sweeping.found.as_entire_binding());
        let occlusion = (OCCLUSION, BindingResource::TextureView(&volume.occlusion.view));
        let bind = |pass: &ComputePass, resources: &[(u32, BindingResource)]| {
            let entries = resources.iter().cloned();
            let entries = entries.map(|(binding, resource)| BindGroupEntry { binding, resource });
            pass.bind_entries(&entries.collect::<Vec<_>>(), cache, device)
        };
        let collect = self.collect(sweeping.keeps_octants);
        let (what, isosurface, swept) = match &sweeping.distances {
            None => {
                let swept = [opacities, settings.clone(), plane, faces, found.clone()];
                (Swept::Opacities, None, bind(&self.sweep_opacities, &swept))
            }
            Some(distances) => {
                let distances = (DISTANCES, distances.as_entire_binding());
                let measured = [settings.clone(), coverage, found.clone()];
                let initialized = [settings.clone(), found.clone(), distances.clone()];
                let isosurface = [
                    bind(&self.measure_differences, &measured),
                    bind(&self.initialize_distances, &initialized),
                ];
                let (what, swept) = if distances_alone {
                    let swept = [settings.clone(), plane, distances];
                    (Swept::DistancesAlone, bind(&self.sweep_distances_alone, &swept))
                } else {
                    let swept = [settings.clone(), plane, faces, found.clone(), distances];
                    (Swept::Isosurface, bind(&self.sweep_isosurface, &swept))
                };
                (what, Some(isosurface), swept)
            }
        };
        Some(SweepJob {
            volume: group.clone(),
            dimensions: sweeping.dimensions,
            found: sweeping.found.clone(),
            isosurface,
            what,
            sweep: swept,
            dispatches: sweeping.sweeps(what != Swept::Opacities).collect(),
            keeps_octants: sweeping.keeps_octants,
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

    fn collect(&self, keeps_octants: bool) -> &ComputePass {
        if keeps_octants { &self.collect_octants } else { &self.collect_factors }
    }

    pub fn encode(&self, encoder: &mut CommandEncoder, job: &SweepJob, cache: &PipelineCache) {
        let volume = &job.volume;
        let voxels = Groups::Voxels(job.dimensions);
        if let Some([measured, initialized]) = &job.isosurface {
            self.measure_differences.encode(encoder, [volume, measured], voxels, cache);
            self.initialize_distances.encode(encoder, [volume, initialized], voxels, cache);
        }
        if job.what != Swept::DistancesAlone {
            encoder.clear_buffer(&job.found, 0, None);
        }
        let sweep = match job.what {
            Swept::Opacities => &self.sweep_opacities,
            Swept::Isosurface => &self.sweep_isosurface,
            Swept::DistancesAlone => &self.sweep_distances_alone,
        };
        let steps = job.dispatches.iter().copied();
        sweep.encode_steps(encoder, [volume, &job.sweep], steps, cache);
        if job.what != Swept::DistancesAlone {
            let collect = self.collect(job.keeps_octants);
            collect.encode(encoder, [volume, &job.collect], voxels, cache);
        }
        if let Some(surface) = &job.surface {
            self.collect_surface.encode(encoder, [volume, surface], voxels, cache);
        }
    }
}
