//! Shadows that volumes cast, drawn into the shadow maps that Bevy keeps of meshes. So all that receives the shadows of
//! meshes receives those of volumes: meshes, other volumes, and the volume itself.

use bevy::{
    asset::load_embedded_asset,
    pbr::{ShadowView, ViewLightEntities},
    platform::collections::HashMap,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntry, BindGroupLayoutDescriptor, BindingResource, BufferId,
            CachedRenderPipelineId, FragmentState, PipelineCache, RenderPassDescriptor,
            RenderPipelineDescriptor, ShaderStages, SpecializedRenderPipeline, SpecializedRenderPipelines,
            StoreOp, TextureViewId, VertexState,
        },
        renderer::{RenderContext, ViewQuery},
        sync_world::MainEntity,
    },
    shader::ShaderDefVal,
};

use super::pipeline::{
    ORIENTATIONS, VIEW_BINDING, bind_group_defs, box_primitive, depth_of_shader, drawn_bindings,
    marched_layout_entries,
};
use crate::render::{
    BOX_VERTICES, BuffersOf, ClipMaps, ExtractedScene, Gpu, KeptGroup, MarchVariant, MarchedViewUniform,
    ViewArray, VolumeStore, VolumeWindows,
};

/// Makes the pipelines.
#[derive(Resource)]
pub(super) struct ShadowPipeline {
    shader: Handle<Shader>,
    layout: BindGroupLayoutDescriptor,
}

/// How rays of light are followed, and whether only an isosurface stops them.
type ShadowKey = (MarchVariant, bool);

/// Shadows of this frame, by the view of a light.
#[derive(Resource, Default)]
pub(super) struct Shadows {
    jobs: HashMap<Entity, Vec<ShadowJob>>,
    kept: BuffersOf<MainEntity, VolumeInLights>,
}

/// A volume in the views of lights.
#[derive(Default)]
struct VolumeInLights {
    views: ViewArray<MarchedViewUniform>,
    group: KeptGroup<([BufferId; 2], [TextureViewId; 3]), Option<BindGroup>>,
}

/// One volume in one view of a light.
struct ShadowJob {
    pipeline: CachedRenderPipelineId,
    group: BindGroup,
    /// Dynamic offset of the view.
    offset: u32,
}

impl FromWorld for ShadowPipeline {
    fn from_world(world: &mut World) -> Self {
        let entries = marched_layout_entries(ShaderStages::VERTEX_FRAGMENT);
        Self {
            shader: load_embedded_asset!(world, "shadows.wgsl"),
            layout: BindGroupLayoutDescriptor::new("contextual_ao_shadow", &entries),
        }
    }
}

impl SpecializedRenderPipeline for ShadowPipeline {
    type Key = ShadowKey;

    fn specialize(&self, (variant, draws_surface): ShadowKey) -> RenderPipelineDescriptor {
        let own = variant.shader_defs().chain(draws_surface.then_some("ISOSURFACE")).map(ShaderDefVal::from);
        let shader_defs: Vec<_> = bind_group_defs(0).into_iter().chain(own).collect();
        RenderPipelineDescriptor {
            label: Some("contextual_ao_shadow".into()),
            layout: vec![self.layout.clone()],
            vertex: VertexState {
                shader: self.shader.clone(),
                shader_defs: shader_defs.clone(),
                ..default()
            },
            fragment: Some(FragmentState { shader: self.shader.clone(), shader_defs, ..default() }),
            primitive: box_primitive(),
            depth_stencil: Some(depth_of_shader()),
            ..default()
        }
    }
}

/// Prepares the shadows of all volumes that cast some.
pub(super) fn prepare_shadows(
    scene: Res<ExtractedScene>,
    windows: Res<VolumeWindows>,
    store: Res<VolumeStore>,
    clip_maps: Res<ClipMaps>,
    base: Res<ShadowPipeline>,
    mut pipelines: ResMut<SpecializedRenderPipelines<ShadowPipeline>>,
    gpu: Gpu,
    mut shadows: ResMut<Shadows>,
) {
    let Shadows { jobs, kept } = &mut *shadows;
    jobs.clear();
    kept.begin_frame();
    let Some(clip) = &clip_maps.textures else {
        return;
    };
    for volume in &scene.volumes {
        let lights = windows.of_lights(volume.entity);
        let Some(resources) = store.0.get(&volume.entity).filter(|_| !lights.is_empty()) else {
            continue;
        };
        let VolumeInLights { views, group } = kept.of(volume.entity);
        views.write(lights.iter().map(MarchedViewUniform::without_runs).collect(), &gpu);
        let bound = (|| {
            let views = views.buffer()?;
            let orientations = resources.orientations();
            let buffers = [views, resources.uniform.buffer()?].map(|buffer| buffer.id());
            let textures = [&clip.depth.view, &resources.lookup_table.texture.view, orientations];
            group.of((buffers, textures.map(|view| view.id())), || {
                let bindings = drawn_bindings(resources, clip, &gpu.formats)?;
                let shared = bindings.iter().map(|(binding, resource)| (*binding, resource.get_binding()));
                let own = [
                    (ORIENTATIONS, BindingResource::TextureView(orientations)),
                    (VIEW_BINDING, ViewArray::<MarchedViewUniform>::binding(views, 1)),
                ];
                let entries =
                    shared.chain(own).map(|(binding, resource)| BindGroupEntry { binding, resource });
                let layout = gpu.cache.get_bind_group_layout(&base.layout);
                let entries: Vec<_> = entries.collect();
                Some(gpu.device.create_bind_group("contextual_ao_shadow", &layout, &entries))
            })
        })();
        let Some(group) = bound else {
            continue;
        };
        let key = (MarchVariant::of(volume), volume.draws_surface());
        let pipeline = pipelines.specialize(&gpu.cache, &base, key);
        for (index, light) in (0..).zip(lights) {
            let offset = index * ViewArray::<MarchedViewUniform>::BYTES;
            jobs.entry(light.view).or_default().push(ShadowJob { pipeline, group: group.clone(), offset });
        }
    }
}

/// Draws the shadows of volumes behind those of meshes: into the maps of a camera's directional lights, or into that of a
/// point or spot light.
pub(super) fn draw_shadows(
    view: ViewQuery<(Entity, Option<&ViewLightEntities>)>,
    maps: Query<&ShadowView>,
    shadows: Res<Shadows>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let (view, lights) = view.into_inner();
    let own = [view];
    for light in lights.map_or(&own[..], |lights| &lights.lights) {
        let (Some(jobs), Ok(map)) = (shadows.jobs.get(light), maps.get(*light)) else {
            continue;
        };
        let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
            label: Some("contextual_ao_shadow"),
            color_attachments: &[],
            depth_stencil_attachment: Some(map.depth_attachment.get_attachment(StoreOp::Store)),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        for job in jobs {
            if let Some(pipeline) = cache.get_render_pipeline(job.pipeline) {
                pass.set_render_pipeline(pipeline);
                pass.set_bind_group(0, &job.group, &[job.offset]);
                pass.draw(0..BOX_VERTICES, 0..1);
            }
        }
    }
}
