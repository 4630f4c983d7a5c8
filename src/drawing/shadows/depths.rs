//! The pass that follows the rays of lights through volumes. It runs before any camera draws.

use bevy::{
    asset::load_embedded_asset,
    core_pipeline::FullscreenShader,
    platform::collections::HashMap,
    prelude::*,
    render::{
        diagnostic::RecordDiagnostics,
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupEntry, BindGroupLayoutDescriptor, BindGroupLayoutEntries,
            BindingResource, BufferId, CachedRenderPipelineId, CompareFunction, DepthStencilState, Extent3d,
            FragmentState, LoadOp, Operations, PipelineCache, RenderPassDepthStencilAttachment,
            RenderPassDescriptor, RenderPipelineDescriptor, ShaderStages, SpecializedRenderPipeline,
            SpecializedRenderPipelines, StoreOp, TextureDescriptor, TextureDimension, TextureUsages,
            TextureViewDimension, TextureViewId,
            binding_types::{texture_depth_2d, uniform_buffer},
        },
        renderer::{RenderContext, RenderDevice},
        sync_world::MainEntity,
    },
};

use crate::{
    diagnostics::SPAN_SHADOWS,
    drawing::pipeline::{
        FollowedRays, ORIENTATIONS, VIEW_BINDING, bind_group_defs, depth_of_shader, drawn_bindings,
        marched_layout_entries,
    },
    render::{
        BuffersOf, ClipMaps, ClipTextures, ExtractedScene, Gpu, KeptGroup, MarchedViewUniform,
        TextureAndView, ViewArray, VolumeInView, VolumeResources, VolumeStore, VolumeWindow, VolumeWindows,
    },
};

/// Kept depths are as wide and high as a multiple of this, texels: a light that moves seldom needs new ones.
const SIZE_STEP: u32 = 64;

/// Makes the pipelines.
#[derive(Resource)]
pub(in crate::drawing) struct ShadowPipeline {
    covers_window: FullscreenShader,
    shader: Handle<Shader>,
    layout: BindGroupLayoutDescriptor,
    /// Of the depths and the view, for drawing into a shadow map.
    pub of_maps: BindGroupLayoutDescriptor,
}

/// Shadows of this frame, by the view of a light.
#[derive(Resource, Default)]
pub(in crate::drawing) struct Shadows {
    pub jobs: HashMap<Entity, Vec<ShadowJob>>,
    volumes: BuffersOf<MainEntity, VolumeInLights>,
    depths: BuffersOf<VolumeInView, KeptDepths>,
}

/// A volume in the views of lights.
#[derive(Default)]
struct VolumeInLights {
    views: ViewArray<MarchedViewUniform>,
    group: KeptGroup<([BufferId; 2], [TextureViewId; 3]), Option<BindGroup>>,
}

/// Depths at which a volume stops the light of a view.
#[derive(Default)]
struct KeptDepths {
    texture: Option<TextureAndView>,
    /// What the texture was found for.
    found_for: Option<(MarchedViewUniform, u32, FollowedRays)>,
    /// For drawing into a shadow map.
    group: KeptGroup<(TextureViewId, BufferId)>,
}

/// One volume in one view of a light.
pub(in crate::drawing) struct ShadowJob {
    /// The pass that finds the depths, if they are stale.
    find: Option<(CachedRenderPipelineId, BindGroup)>,
    depths: TextureAndView,
    /// Binds the depths, and the view.
    pub group: BindGroup,
    /// Dynamic offset of the view.
    pub offset: u32,
    /// First pixel of the window, and its size.
    pub first: UVec2,
    pub size: UVec2,
}

impl FromWorld for ShadowPipeline {
    fn from_world(world: &mut World) -> Self {
        let stages = ShaderStages::FRAGMENT;
        let entries = marched_layout_entries(stages);
        let depths_and_view = (texture_depth_2d(), uniform_buffer::<MarchedViewUniform>(true));
        let of_maps = BindGroupLayoutEntries::sequential(stages, depths_and_view);
        Self {
            covers_window: world.resource::<FullscreenShader>().clone(),
            shader: load_embedded_asset!(world, "depths.wgsl"),
            layout: BindGroupLayoutDescriptor::new("contextual_ao_shadow", &entries),
            of_maps: BindGroupLayoutDescriptor::new("contextual_ao_shadow_map", &of_maps),
        }
    }
}

impl SpecializedRenderPipeline for ShadowPipeline {
    type Key = FollowedRays;

    fn specialize(&self, rays: FollowedRays) -> RenderPipelineDescriptor {
        let shader_defs = bind_group_defs(0).into_iter().chain(rays.shader_defs()).collect();
        RenderPipelineDescriptor {
            label: Some("contextual_ao_shadow".into()),
            layout: vec![self.layout.clone()],
            vertex: self.covers_window.to_vertex_state(),
            fragment: Some(FragmentState { shader: self.shader.clone(), shader_defs, ..default() }),
            depth_stencil: Some(DepthStencilState {
                depth_compare: Some(CompareFunction::Always),
                ..depth_of_shader()
            }),
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
    let Shadows { jobs, volumes, depths } = &mut *shadows;
    jobs.clear();
    volumes.begin_frame();
    depths.begin_frame();
    let Some(clip) = &clip_maps.textures else {
        return;
    };
    for volume in &scene.volumes {
        let lights = windows.of_lights(volume.entity);
        let Some(resources) = store.0.get(&volume.entity).filter(|_| !lights.is_empty()) else {
            continue;
        };
        let in_lights = volumes.of(volume.entity);
        let uniforms: Vec<_> = lights.iter().map(MarchedViewUniform::without_runs).collect();
        in_lights.views.write(uniforms.clone(), &gpu);
        let (Some(group), Some(views)) =
            (in_lights.bind(resources, clip, &base, &gpu), in_lights.views.buffer())
        else {
            continue;
        };
        let key = FollowedRays::of(volume);
        let pipeline = pipelines.specialize(&gpu.cache, &base, key);
        // Depths are not found until the pipeline is compiled.
        let is_ready = gpu.cache.get_render_pipeline(pipeline).is_some();
        for ((index, light), uniform) in (0..).zip(lights).zip(uniforms) {
            let kept = depths.of((light.view, volume.entity));
            let texture = kept.keep_room(light, &gpu.device);
            let found_for = Some((uniform, resources.state.revision, key));
            let is_stale = kept.found_for != found_for && is_ready;
            if is_stale {
                kept.found_for = found_for;
            }
            let of_map = kept.group.of((texture.view.id(), views.id()), || {
                let view = ViewArray::<MarchedViewUniform>::binding(views, 1);
                let entries = BindGroupEntries::sequential((&texture.view, view));
                let layout = gpu.cache.get_bind_group_layout(&base.of_maps);
                gpu.device.create_bind_group("contextual_ao_shadow_map", &layout, &entries)
            });
            jobs.entry(light.view).or_default().push(ShadowJob {
                find: is_stale.then(|| (pipeline, group.clone())),
                depths: texture,
                group: of_map,
                offset: index * ViewArray::<MarchedViewUniform>::BYTES,
                first: light.uniform.first,
                size: light.uniform.end - light.uniform.first,
            });
        }
    }
}

impl VolumeInLights {
    /// Binds the volume and its views.
    fn bind(
        &mut self,
        resources: &VolumeResources,
        clip: &ClipTextures,
        base: &ShadowPipeline,
        gpu: &Gpu,
    ) -> Option<BindGroup> {
        let views = self.views.buffer()?;
        let orientations = resources.orientations();
        let buffers = [views, resources.uniform.buffer()?].map(|buffer| buffer.id());
        let textures = [&clip.depth.view, &resources.lookup_table.texture.view, orientations];
        self.group.of((buffers, textures.map(|view| view.id())), || {
            let bindings = drawn_bindings(resources, clip, &gpu.formats)?;
            let shared = bindings.iter().map(|(binding, resource)| (*binding, resource.get_binding()));
            let own = [
                (ORIENTATIONS, BindingResource::TextureView(orientations)),
                (VIEW_BINDING, ViewArray::<MarchedViewUniform>::binding(views, 1)),
            ];
            let entries = shared.chain(own).map(|(binding, resource)| BindGroupEntry { binding, resource });
            let layout = gpu.cache.get_bind_group_layout(&base.layout);
            let entries: Vec<_> = entries.collect();
            Some(gpu.device.create_bind_group("contextual_ao_shadow", &layout, &entries))
        })
    }
}

impl KeptDepths {
    /// A texture with room for a window. What an earlier one held is lost.
    fn keep_room(&mut self, window: &VolumeWindow, device: &RenderDevice) -> TextureAndView {
        let wanted = (window.uniform.end - window.uniform.first + SIZE_STEP - 1) / SIZE_STEP * SIZE_STEP;
        let has_room = |texture: &&TextureAndView| {
            let has = UVec2::new(texture.texture.width(), texture.texture.height());
            wanted.cmple(has).all() && has.element_product() <= 4 * wanted.element_product()
        };
        if let Some(texture) = self.texture.as_ref().filter(has_room) {
            return texture.clone();
        }
        self.found_for = None;
        let descriptor = TextureDescriptor {
            label: Some("contextual_ao_shadow_depths"),
            size: Extent3d { width: wanted.x, height: wanted.y, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format: depth_of_shader().format,
            usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        };
        self.texture.insert(TextureAndView::new(device, &descriptor, TextureViewDimension::D2)).clone()
    }
}

/// Finds the depths that are stale.
pub(super) fn find_depths(shadows: Res<Shadows>, cache: Res<PipelineCache>, mut ctx: RenderContext) {
    let stale = || {
        let jobs = shadows.jobs.values().flatten();
        jobs.filter_map(|job| job.find.as_ref().map(|(pipeline, group)| (job, *pipeline, group)))
    };
    if stale().next().is_none() {
        return;
    }
    let recorder = ctx.diagnostic_recorder();
    let recorder = recorder.as_deref();
    let span = recorder.time_span(ctx.command_encoder(), SPAN_SHADOWS);
    for (job, pipeline, group) in stale() {
        let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
            label: Some("contextual_ao_shadow"),
            depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
                view: &job.depths.view,
                depth_ops: Some(Operations { load: LoadOp::Clear(0.0), store: StoreOp::Store }),
                stencil_ops: None,
            }),
            ..default()
        });
        if let Some(pipeline) = cache.get_render_pipeline(pipeline) {
            pass.set_render_pipeline(pipeline);
            pass.set_bind_group(0, group, &[job.offset]);
            pass.set_viewport(0.0, 0.0, job.size.x as f32, job.size.y as f32, 0.0, 1.0);
            pass.draw(0..3, 0..1);
        }
    }
    span.end(ctx.command_encoder());
}
