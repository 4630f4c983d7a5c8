//! Motion vectors and depths of volumes, in front of those that the prepass has of meshes: for passes behind the main pass,
//! such as Bevy's temporal anti-aliasing and motion blur.

use bevy::{
    asset::load_embedded_asset,
    core_pipeline::prepass::{MOTION_VECTOR_PREPASS_FORMAT, MotionVectorPrepass, ViewPrepassTextures},
    platform::collections::HashMap,
    prelude::*,
    render::{
        camera::ExtractedCamera,
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries,
            CachedRenderPipelineId, ColorTargetState, ColorWrites, FragmentState, LoadOp, MultisampleState,
            Operations, PipelineCache, RenderPassDepthStencilAttachment, RenderPassDescriptor,
            RenderPipelineDescriptor, ShaderStages, SpecializedRenderPipeline, SpecializedRenderPipelines,
            StorageBuffer, StoreOp, VertexState, binding_types::storage_buffer_read_only,
        },
        renderer::{RenderContext, ViewQuery},
    },
    shader::ShaderDefVal,
};

use super::{
    phase::DrawnVolumes,
    pipeline::{DrawPipeline, bind_group_defs, box_primitive, depth_of_shader},
};
use crate::render::{
    BOX_VERTICES, BuffersOf, ExtractedScene, Gpu, MarchVariant, VolumeInView, VolumeRuns, VolumeWindows,
};

/// Group of a volume's bindings.
const VOLUME_BIND_GROUP: usize = 1;

/// Makes the pipelines.
#[derive(Resource)]
pub(super) struct MotionPipeline {
    shader: Handle<Shader>,
    own: BindGroupLayoutDescriptor,
    volume: BindGroupLayoutDescriptor,
}

/// Samples of a pixel, and how rays are followed.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct MotionKey {
    samples: u32,
    variant: MarchVariant,
}

/// Motions of this frame, by the view.
#[derive(Resource, Default)]
pub(super) struct Motions {
    jobs: HashMap<Entity, Vec<MotionJob>>,
    kept: BuffersOf<VolumeInView, Motion>,
}

/// Transforms from volume space (mm) to clip space without jitter: of this frame, and of the previous one.
#[derive(Default)]
struct Motion {
    clip_from_local: StorageBuffer<[Mat4; 2]>,
    group: Option<BindGroup>,
}

/// One volume in one view.
struct MotionJob {
    pipeline: CachedRenderPipelineId,
    motion: BindGroup,
    volume: BindGroup,
    /// Dynamic offset of the view.
    offset: u32,
}

impl FromWorld for MotionPipeline {
    fn from_world(world: &mut World) -> Self {
        let motion = storage_buffer_read_only::<[Mat4; 2]>(false);
        let entries = BindGroupLayoutEntries::single(ShaderStages::FRAGMENT, motion);
        Self {
            shader: load_embedded_asset!(world, "motion_vectors.wgsl"),
            own: BindGroupLayoutDescriptor::new("contextual_ao_motion", &entries),
            volume: world.resource::<DrawPipeline>().layout.clone(),
        }
    }
}

impl SpecializedRenderPipeline for MotionPipeline {
    type Key = MotionKey;

    fn specialize(&self, MotionKey { samples, variant }: MotionKey) -> RenderPipelineDescriptor {
        let own = variant.shader_defs().map(ShaderDefVal::from);
        let shader_defs: Vec<_> = bind_group_defs(VOLUME_BIND_GROUP).into_iter().chain(own).collect();
        let target = ColorTargetState {
            format: MOTION_VECTOR_PREPASS_FORMAT,
            blend: None,
            write_mask: ColorWrites::ALL,
        };
        RenderPipelineDescriptor {
            label: Some("contextual_ao_motion_vectors".into()),
            layout: vec![self.own.clone(), self.volume.clone()],
            vertex: VertexState {
                shader: self.shader.clone(),
                shader_defs: shader_defs.clone(),
                ..default()
            },
            fragment: Some(FragmentState {
                shader: self.shader.clone(),
                shader_defs,
                targets: vec![Some(target)],
                ..default()
            }),
            primitive: box_primitive(),
            depth_stencil: Some(depth_of_shader()),
            multisample: MultisampleState { count: samples, ..default() },
            ..default()
        }
    }
}

/// Prepares the pass in views that ask for motion vectors.
pub(super) fn prepare_motions(
    scene: Res<ExtractedScene>,
    windows: Res<VolumeWindows>,
    runs: Res<VolumeRuns>,
    drawn: Res<DrawnVolumes>,
    views: Query<&Msaa, With<MotionVectorPrepass>>,
    base: Res<MotionPipeline>,
    mut pipelines: ResMut<SpecializedRenderPipelines<MotionPipeline>>,
    gpu: Gpu,
    mut motions: ResMut<Motions>,
) {
    let Motions { jobs, kept } = &mut *motions;
    jobs.clear();
    kept.begin_frame();
    for volume in &scene.volumes {
        for window in windows.onto(volume.entity) {
            let Ok(msaa) = views.get(window.view) else {
                continue;
            };
            let job = (|| {
                let motion = kept.of((window.view, volume.entity)).bind(window.unjittered, &base, &gpu)?;
                let key = MotionKey { samples: msaa.samples(), variant: MarchVariant::of(volume) };
                Some(MotionJob {
                    pipeline: pipelines.specialize(&gpu.cache, &base, key),
                    motion,
                    volume: drawn.groups_of(volume.drawn_on?)?.drawn.clone(),
                    offset: runs.of(volume.entity)?.offset_of(window.view)?,
                })
            })();
            jobs.entry(window.view).or_default().extend(job);
        }
    }
}

impl Motion {
    /// Goes on to the transform of the next frame. A volume that was not in view before stands still.
    fn bind(&mut self, clip_from_local: Mat4, base: &MotionPipeline, gpu: &Gpu) -> Option<BindGroup> {
        let before = if self.group.is_some() { self.clip_from_local.get()[0] } else { clip_from_local };
        self.clip_from_local.set([clip_from_local, before]);
        self.clip_from_local.write_buffer(&gpu.device, &gpu.queue);
        if self.group.is_none() {
            let layout = gpu.cache.get_bind_group_layout(&base.own);
            let entries = BindGroupEntries::single(self.clip_from_local.binding()?);
            self.group = Some(gpu.device.create_bind_group("contextual_ao_motion", &layout, &entries));
        }
        self.group.clone()
    }
}

/// Writes the motion vectors and depths of a view's volumes, once volumes are drawn: drawing reads the depths of meshes alone.
pub(super) fn write_motion_vectors(
    view: ViewQuery<(&ExtractedCamera, &ViewPrepassTextures)>,
    motions: Res<Motions>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let jobs = motions.jobs.get(&view.entity());
    let (camera, textures) = view.into_inner();
    let (Some(jobs), Some(motion), Some(depth)) = (jobs, &textures.motion_vectors, &textures.depth) else {
        return;
    };
    let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
        label: Some("contextual_ao_motion_vectors"),
        color_attachments: &[Some(motion.get_attachment())],
        depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
            view: &depth.texture.default_view,
            depth_ops: Some(Operations { load: LoadOp::Load, store: StoreOp::Store }),
            stencil_ops: None,
        }),
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    if let Some(viewport) = &camera.viewport {
        pass.set_camera_viewport(viewport);
    }
    for job in jobs {
        let Some(pipeline) = cache.get_render_pipeline(job.pipeline) else {
            continue;
        };
        pass.set_render_pipeline(pipeline);
        pass.set_bind_group(0, &job.motion, &[]);
        pass.set_bind_group(VOLUME_BIND_GROUP, &job.volume, &[job.offset]);
        pass.draw(0..BOX_VERTICES, 0..1);
    }
}
