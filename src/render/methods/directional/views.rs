//! Jobs of the views that draw volumes by directional occlusion shading.

use bevy::{
    core_pipeline::{prepass::ViewPrepassTextures, tonemapping::Tonemapping},
    ecs::{entity::EntityHashMap, system::SystemParam},
    prelude::*,
    render::{
        render_resource::{PipelineCache, SpecializedRenderPipelines, StorageBuffer, UniformBuffer},
        renderer::{FlushCommands, RenderContext, RenderQueue, ViewQuery},
        view::{ViewTarget, ViewUniformOffset},
    },
};

use super::{
    buffers::{Buffers, DirectionalBuffers},
    composite::{CompositeJob, CompositeKey, CompositePipeline, ViewKind, ViewResources},
    slices::{DirectionalPasses, SlicesJob, SlicesVariant},
    slicing::{Slicing, SlicingData},
};
use crate::{
    diagnostics::ReportChannel,
    occlusion::{DirectionalOcclusion, VolumeLighting},
    render::{
        extract::{ExtractedScene, ExtractedVolume},
        gpu::{
            device::Gpu,
            frame::{Frame, TimesByClock},
            uniforms::BuffersOf,
        },
        methods::pipelines::MethodPipelines,
        volumes::store::{VolumeResources, VolumeStore},
        windows::{VolumeInView, VolumeWindows, WindowUniform},
    },
};

/// Jobs of every view with such volumes, farthest volume first.
#[derive(Resource, Default)]
pub(super) struct DirectionalViews(EntityHashMap<Vec<DirectionalJob>>);

/// Buffers that describe volumes in views.
#[derive(Resource, Default)]
pub(super) struct DirectionalUniforms {
    windows: BuffersOf<VolumeInView, UniformBuffer<WindowUniform>>,
    slicings: BuffersOf<VolumeInView, StorageBuffer<SlicingData>>,
}

/// One volume in one view.
struct DirectionalJob {
    slices: SlicesJob,
    composite: CompositeJob,
    center_depth: f64,
}

/// A volume in a window of a view.
struct Shown<'a> {
    volume: &'a VolumeResources,
    is_lit: bool,
    by_gradient: bool,
    key: VolumeInView,
    window: WindowUniform,
    slicing: Slicing,
}

/// Components of the views.
type ViewData = (&'static ViewPrepassTextures, ViewKind);

/// The passes, and the inputs of their bind groups.
#[derive(SystemParam)]
pub(super) struct Passes<'w> {
    slices: Res<'w, DirectionalPasses>,
    composite: Res<'w, CompositePipeline>,
    pipelines: ResMut<'w, SpecializedRenderPipelines<CompositePipeline>>,
    views: ViewResources<'w>,
    uniforms: ResMut<'w, DirectionalUniforms>,
    gpu: Gpu<'w>,
}

/// Writes the inputs of the passes and makes their bind groups.
pub(super) fn prepare_views(
    scene: Res<ExtractedScene>,
    store: Res<VolumeStore>,
    windows: Res<VolumeWindows>,
    pipelines: Res<MethodPipelines>,
    views: Query<ViewData>,
    report: Res<ReportChannel>,
    mut passes: Passes,
    mut buffers: ResMut<DirectionalBuffers>,
    mut jobs: ResMut<DirectionalViews>,
) {
    jobs.0.clear();
    passes.uniforms.windows.begin_frame();
    passes.uniforms.slicings.begin_frame();
    let mut shown = Vec::new();
    // Only volumes with ready pipelines were bound in this frame.
    let is_ready = |volume: &&ExtractedVolume| pipelines.are_there_for(&volume.occlusion.method);
    for volume in scene.volumes.iter().filter(|volume| volume.is_placed).filter(is_ready) {
        let settings =
            volume.occlusion.method.get::<DirectionalOcclusion>().filter(|_| volume.is_drawn_by_method());
        let (Some(settings), Some(resources)) = (settings, store.0.get(&volume.entity)) else {
            continue;
        };
        shown.extend(windows.onto(volume.entity).iter().filter_map(|view| {
            let slicing = Slicing::of(volume, settings, &view.uniform)?;
            let key = (view.view, volume.entity);
            Some(Shown {
                volume: resources,
                is_lit: volume.shading.lighting != VolumeLighting::Unlit,
                by_gradient: volume.by_gradient,
                key,
                window: view.uniform,
                slicing,
            })
        }));
    }
    let largest = shown.iter().map(|shown| shown.window.end - shown.window.first);
    let largest = largest.reduce(UVec2::max).unwrap_or_default();
    let Some(buffers) = buffers.fit(largest, &passes.gpu.device) else {
        if !shown.is_empty() {
            warn_once!("directional occlusion: {largest} pixels are more than the device has buffers for");
        }
        return;
    };
    if let Ok(mut report) = report.0.lock() {
        report.usage = report.usage + buffers.usage();
    }
    for shown in shown {
        if let Some(job) = passes.prepare(&shown, views.get(shown.key.0).ok(), buffers) {
            jobs.0.entry(shown.key.0).or_default().push(job);
        }
    }
    for jobs in jobs.0.values_mut() {
        jobs.sort_by(|a, b| b.center_depth.total_cmp(&a.center_depth));
    }
}

impl Passes<'_> {
    /// Prepares one volume in one view. `None` while a resource is missing.
    fn prepare(
        &mut self,
        shown: &Shown,
        view: Option<bevy::ecs::query::ROQueryItem<ViewData>>,
        buffers: &Buffers,
    ) -> Option<DirectionalJob> {
        let Self { slices, composite, pipelines, views, uniforms, gpu } = self;
        let Gpu { device, cache, .. } = &*gpu;
        let (prepass, kind) = view?;
        let key = CompositeKey::of(kind);
        let variant = SlicesVariant {
            is_multisampled: key.samples > 1,
            is_lit: shown.is_lit,
            by_gradient: shown.by_gradient,
        };
        let uniforms = &mut **uniforms;
        let window = uniforms.windows.write(shown.key, shown.window, gpu)?;
        let slicing = uniforms.slicings.of(shown.key);
        if slicing.buffer().is_none() || *slicing.get() != shown.slicing.data {
            slicing.set(shown.slicing.data);
            slicing.write_buffer(device, &gpu.queue);
        }
        let tonemapping = kind.3.copied().unwrap_or(Tonemapping::None);
        let WindowUniform { first, end, .. } = shown.window;
        Some(DirectionalJob {
            slices: SlicesJob {
                volume: shown.volume.groups()?.lit.clone(),
                slices: slices.bind_slices(
                    [window.clone(), slicing.binding()?],
                    buffers,
                    prepass.depth_view()?,
                    variant,
                    cache,
                    device,
                ),
                number: slices.bind_numbers(buffers, cache, device),
                count: shown.slicing.count,
                pixels: end - first,
                variant,
            },
            composite: CompositeJob {
                pipeline: pipelines.specialize(cache, composite, key),
                group: composite.bind(window, buffers, tonemapping, views, cache, device)?,
                window: (first, end),
            },
            center_depth: shown.slicing.center_depth,
        })
    }
}

/// Shades and draws the volumes of a view.
pub(super) fn shade_views(
    view: ViewQuery<(&ViewTarget, &ViewUniformOffset)>,
    jobs: Res<DirectionalViews>,
    slices: Option<Res<DirectionalPasses>>,
    cache: Res<PipelineCache>,
    timing: Res<TimesByClock>,
    queue: Res<RenderQueue>,
    report: Res<ReportChannel>,
    mut before: FlushCommands,
    ctx: RenderContext,
) {
    let (Some(jobs), Some(slices)) = (jobs.0.get(&view.entity()), slices) else {
        return;
    };
    let (target, uniform) = view.into_inner();
    let mut frame = Frame::of_view(ctx, &queue, &timing, &mut before);
    frame.pass(DirectionalOcclusion::SPAN, jobs, |encoder, job| {
        slices.encode(encoder, &job.slices, &cache);
        job.composite.encode(encoder, target, uniform.offset, &cache);
    });
    frame.report(&report);
}
