//! The pass that finds transmittances of volumes that share space, along the rays of pixels. It runs before any camera draws.

use bevy::{
    asset::load_embedded_asset,
    platform::collections::HashMap,
    prelude::*,
    render::{
        diagnostic::RecordDiagnostics,
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, BufferId,
            CachedComputePipelineId, ComputePassDescriptor, ComputePipelineDescriptor, PipelineCache,
            ShaderStages, SpecializedComputePipeline, SpecializedComputePipelines,
            binding_types::{storage_buffer_read_only_sized, storage_buffer_sized},
        },
        renderer::RenderContext,
        sync_world::MainEntity,
    },
};

use super::records::{CurvesOf, MergedDraws};
use crate::{
    diagnostics::SPAN_TRANSMITTANCE,
    drawing::{
        phase::DrawnVolumes,
        pipeline::{DrawPipeline, DrawVariant, bind_group_defs},
    },
    render::{BuffersOf, ExtractedScene, Gpu, KeptGroup, ViewArray, VolumeRuns},
};

/// Makes the pipelines.
#[derive(Resource)]
pub(in crate::drawing) struct TransmittancePipeline {
    shader: Handle<Shader>,
    volume: BindGroupLayoutDescriptor,
    own: BindGroupLayoutDescriptor,
}

/// Curves to find in this frame.
#[derive(Resource, Default)]
pub(in crate::drawing) struct Transmittances {
    jobs: Vec<TransmittanceJob>,
    words: ViewArray<CurvesWords>,
    groups: BuffersOf<MainEntity, KeptGroup<[BufferId; 3]>>,
    /// Curves that the buffer holds, each with the state of the runs that it was found from.
    found: HashMap<(Entity, MainEntity), (CurvesOf, u32)>,
    buffer: Option<BufferId>,
}

/// Words of the curves of one volume in one view, `curves` in WGSL. Dynamic offsets are multiples of 256 bytes.
type CurvesWords = [UVec4; 16];

/// Curves of one volume in one view, by the rays of pixels or by those at outlines.
struct TransmittanceJob {
    pipeline: CachedComputePipelineId,
    volume: BindGroup,
    /// Dynamic offset of the view.
    view: u32,
    own: BindGroup,
    /// Dynamic offset of the curves.
    curves: u32,
    workgroups: UVec2,
}

impl FromWorld for TransmittancePipeline {
    fn from_world(world: &mut World) -> Self {
        let written = storage_buffer_sized(false, None);
        let [curves, outlines] = [true, false].map(|offset| storage_buffer_read_only_sized(offset, None));
        let entries = BindGroupLayoutEntries::sequential(ShaderStages::COMPUTE, (written, curves, outlines));
        let [volume, _] = world.resource::<DrawPipeline>().of_outlines.clone();
        Self {
            shader: load_embedded_asset!(world, "transmittance.wgsl"),
            volume,
            own: BindGroupLayoutDescriptor::new("contextual_ao_transmittance", &entries),
        }
    }
}

/// Kind of a volume, and whether the rays are those of outlines.
pub(super) type TransmittanceKey = (DrawVariant, bool);

impl SpecializedComputePipeline for TransmittancePipeline {
    type Key = TransmittanceKey;

    fn specialize(&self, (variant, of_outlines): TransmittanceKey) -> ComputePipelineDescriptor {
        let outlines = of_outlines.then(|| "OUTLINE_RAYS".into());
        let own_defs = variant.shader_defs().chain(outlines);
        ComputePipelineDescriptor {
            label: Some("contextual_ao_transmittance".into()),
            layout: vec![self.volume.clone(), self.own.clone()],
            shader: self.shader.clone(),
            shader_defs: bind_group_defs(0).into_iter().chain(own_defs).collect(),
            zero_initialize_workgroup_memory: false,
            ..default()
        }
    }
}

/// Prepares the pass for curves that the buffer does not hold as they are.
pub(in crate::drawing) fn prepare_transmittances(
    scene: Res<ExtractedScene>,
    runs: Res<VolumeRuns>,
    drawn: Res<DrawnVolumes>,
    merged: Res<MergedDraws>,
    base: Res<TransmittancePipeline>,
    mut pipelines: ResMut<SpecializedComputePipelines<TransmittancePipeline>>,
    gpu: Gpu,
    mut transmittances: ResMut<Transmittances>,
) {
    let Transmittances { jobs, words, groups, found, buffer } = &mut *transmittances;
    jobs.clear();
    groups.begin_frame();
    let Some(records) = &merged.buffer else {
        return;
    };
    if buffer.replace(records.id()) != Some(records.id()) {
        found.clear();
    }
    let before = core::mem::take(found);
    let words_of = |curves: &CurvesOf| {
        let [first, end, word] = curves.words();
        let mut words = CurvesWords::default();
        words[0] = UVec4::new(first, end, word, 0);
        words
    };
    words.write(merged.curves.iter().map(words_of).collect(), &gpu);
    for (index, curves) in (0..).zip(&merged.curves) {
        let found_jobs = (|| {
            let volume = scene.volumes.iter().find(|volume| volume.entity == curves.volume)?;
            let of_volume = runs.of(volume.entity)?;
            let variant = DrawVariant::of(&volume.occlusion, &volume.shading, volume.by_gradient);
            let variant = variant.of_transmittance();
            let key = (curves.view, curves.volume);
            let state = (*curves, of_volume.revision());
            found.insert(key, state);
            let [_, _, outlines] = of_volume.buffers()?;
            let words = words.buffer()?;
            let own = groups.of(curves.volume).of([records.id(), words.id(), outlines.id()], || {
                let layout = gpu.cache.get_bind_group_layout(&base.own);
                let curves = ViewArray::<CurvesWords>::binding(words, 1);
                let resources = (records.as_entire_binding(), curves, outlines.as_entire_binding());
                let entries = BindGroupEntries::sequential(resources);
                gpu.device.create_bind_group("contextual_ao_transmittance", &layout, &entries)
            });
            if !variant.may_change_at_rest() && before.get(&key) == Some(&state) {
                return None;
            }
            let volume = &drawn.groups_of(volume.drawn_on?)?.shaded;
            let curves_offset = index * ViewArray::<CurvesWords>::BYTES;
            let mut job = |of_outlines, view, workgroups| TransmittanceJob {
                pipeline: pipelines.specialize(&gpu.cache, &base, (variant, of_outlines)),
                volume: volume.clone(),
                view,
                own: own.clone(),
                curves: curves_offset,
                workgroups,
            };
            let tiles = (curves.end - curves.first + 7) / 8;
            let of_pixels = job(false, of_volume.offset_of(curves.view)?, tiles);
            let outlines = of_volume.outlines_of(curves.view);
            // Those of outlines take the places of the pixels' own.
            let of_outlines = outlines.map(|outlines| job(true, outlines.offset, outlines.workgroups));
            Some([of_pixels].into_iter().chain(of_outlines))
        })();
        jobs.extend(found_jobs.into_iter().flatten());
    }
}

/// Finds the curves of all views.
pub(in crate::drawing) fn find_transmittances(
    transmittances: Res<Transmittances>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    if transmittances.jobs.is_empty() {
        return;
    }
    let recorder = ctx.diagnostic_recorder();
    let recorder = recorder.as_deref();
    let encoder = ctx.command_encoder();
    let span = recorder.time_span(encoder, SPAN_TRANSMITTANCE);
    let descriptor = ComputePassDescriptor { label: Some("contextual_ao_transmittance"), ..default() };
    let mut pass = encoder.begin_compute_pass(&descriptor);
    for job in &transmittances.jobs {
        let Some(pipeline) = cache.get_compute_pipeline(job.pipeline) else {
            continue;
        };
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &job.volume, &[job.view]);
        pass.set_bind_group(1, &job.own, &[job.curves]);
        pass.dispatch_workgroups(job.workgroups.x, job.workgroups.y, 1);
    }
    drop(pass);
    span.end(encoder);
}
