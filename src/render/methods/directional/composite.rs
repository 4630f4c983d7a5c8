//! Composites the accumulated slices over the image drawn so far.

use bevy::{
    asset::load_embedded_asset,
    core_pipeline::{
        FullscreenShader,
        tonemapping::{Tonemapping, TonemappingLuts, get_lut_bind_group_layout_entries, get_lut_bindings},
    },
    ecs::{query::ROQueryItem, system::SystemParam},
    prelude::*,
    render::{
        camera::ExtractedCamera,
        render_asset::RenderAssets,
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, BindingResource,
            BlendState, CachedRenderPipelineId, ColorTargetState, ColorWrites, CommandEncoder, FragmentState,
            MultisampleState, PipelineCache, RenderPassDescriptor, RenderPipelineDescriptor, ShaderStages,
            SpecializedRenderPipeline, SpecializedRenderPipelines, TextureFormat,
            binding_types::{storage_buffer_read_only_sized, uniform_buffer},
        },
        renderer::RenderDevice,
        texture::{FallbackImage, GpuImage},
        view::{ExtractedView, ViewTarget, ViewUniform, ViewUniforms},
    },
    shader::ShaderDefVal,
};

use super::buffers::Buffers;
use crate::render::{gpu::render_pipelines::variants_are_ready, windows::WindowUniform};

/// Makes a pipeline for every kind of view.
#[derive(Resource)]
pub(crate) struct CompositePipeline {
    layout: BindGroupLayoutDescriptor,
    vertex_shader: FullscreenShader,
    shader: Handle<Shader>,
}

/// Kind of a view.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct CompositeKey {
    pub format: TextureFormat,
    /// Number of samples a pixel.
    pub samples: u32,
    /// Tone mapping by this pass, if no later pass does it.
    pub tonemapping: Option<Tonemapping>,
}

/// Components that select the pipeline of a view.
pub(crate) type ViewKind =
    (&'static Msaa, &'static ExtractedView, &'static ExtractedCamera, Option<&'static Tonemapping>);

impl CompositeKey {
    pub fn of((msaa, view, camera, tonemapping): ROQueryItem<ViewKind>) -> Self {
        Self {
            format: view.target_format,
            samples: msaa.samples(),
            tonemapping: tonemapping.copied().filter(|_| !camera.hdr),
        }
    }
}

/// The pipelines of all views.
#[derive(SystemParam)]
pub(crate) struct CompositePipelines<'w, 's> {
    base: Res<'w, CompositePipeline>,
    variants: ResMut<'w, SpecializedRenderPipelines<CompositePipeline>>,
    views: Query<'w, 's, ViewKind>,
}

impl CompositePipelines<'_, '_> {
    /// Whether the pipelines are ready. The first call starts their compilation.
    pub fn are_ready(&mut self, cache: &PipelineCache) -> bool {
        let Self { base, variants, views } = self;
        variants_are_ready(&**base, variants, views.iter().map(CompositeKey::of), cache)
    }
}

/// One volume in one view.
pub(super) struct CompositeJob {
    pub pipeline: CachedRenderPipelineId,
    pub group: BindGroup,
    /// First and end pixel.
    pub window: (UVec2, UVec2),
}

/// Resources that describe views and their tone mapping.
#[derive(SystemParam)]
pub(super) struct ViewResources<'w> {
    uniforms: Res<'w, ViewUniforms>,
    images: Res<'w, RenderAssets<GpuImage>>,
    luts: Res<'w, TonemappingLuts>,
    fallback: Res<'w, FallbackImage>,
}

impl FromWorld for CompositePipeline {
    fn from_world(world: &mut World) -> Self {
        let [lut_texture, lut_sampler] = get_lut_bind_group_layout_entries();
        let entries = BindGroupLayoutEntries::sequential(
            ShaderStages::FRAGMENT,
            (
                uniform_buffer::<ViewUniform>(true),
                uniform_buffer::<WindowUniform>(false),
                storage_buffer_read_only_sized(false, None),
                lut_texture,
                lut_sampler,
            ),
        );
        Self {
            layout: BindGroupLayoutDescriptor::new("contextual_ao_composite", &entries),
            vertex_shader: world.resource::<FullscreenShader>().clone(),
            shader: load_embedded_asset!(world, "composite.wgsl"),
        }
    }
}

impl SpecializedRenderPipeline for CompositePipeline {
    type Key = CompositeKey;

    fn specialize(&self, key: CompositeKey) -> RenderPipelineDescriptor {
        let target = ColorTargetState {
            format: key.format,
            blend: Some(BlendState::PREMULTIPLIED_ALPHA_BLENDING),
            write_mask: ColorWrites::ALL,
        };
        RenderPipelineDescriptor {
            label: Some("contextual_ao_composite".into()),
            layout: vec![self.layout.clone()],
            vertex: self.vertex_shader.to_vertex_state(),
            fragment: Some(FragmentState {
                shader: self.shader.clone(),
                shader_defs: key.tonemapping.map(tonemapping_defs).unwrap_or_default(),
                targets: vec![Some(target)],
                ..default()
            }),
            multisample: MultisampleState { count: key.samples, ..default() },
            ..default()
        }
    }
}

/// Shader definitions of Bevy's materials for a view that maps tones in materials.
fn tonemapping_defs(tonemapping: Tonemapping) -> Vec<ShaderDefVal> {
    let method = match tonemapping {
        Tonemapping::None => "TONEMAP_METHOD_NONE",
        Tonemapping::Reinhard => "TONEMAP_METHOD_REINHARD",
        Tonemapping::ReinhardLuminance => "TONEMAP_METHOD_REINHARD_LUMINANCE",
        Tonemapping::AcesFitted => "TONEMAP_METHOD_ACES_FITTED",
        Tonemapping::AgX => "TONEMAP_METHOD_AGX",
        Tonemapping::SomewhatBoringDisplayTransform => "TONEMAP_METHOD_SOMEWHAT_BORING_DISPLAY_TRANSFORM",
        Tonemapping::TonyMcMapface => "TONEMAP_METHOD_TONY_MC_MAPFACE",
        Tonemapping::BlenderFilmic => "TONEMAP_METHOD_BLENDER_FILMIC",
        Tonemapping::KhronosPbrNeutral => "TONEMAP_METHOD_PBR_NEUTRAL",
    };
    vec![
        "TONEMAP_IN_SHADER".into(),
        method.into(),
        ShaderDefVal::UInt("TONEMAPPING_LUT_TEXTURE_BINDING_INDEX".into(), 3),
        ShaderDefVal::UInt("TONEMAPPING_LUT_SAMPLER_BINDING_INDEX".into(), 4),
    ]
}

impl CompositePipeline {
    pub(super) fn bind(
        &self,
        window: BindingResource,
        buffers: &Buffers,
        tonemapping: Tonemapping,
        views: &ViewResources,
        cache: &PipelineCache,
        device: &RenderDevice,
    ) -> Option<BindGroup> {
        let luts = get_lut_bindings(&views.images, &views.luts, &tonemapping, &views.fallback);
        let entries = BindGroupEntries::sequential((
            views.uniforms.uniforms.binding()?,
            window,
            buffers.eye.as_entire_binding(),
            luts.0,
            luts.1,
        ));
        let layout = cache.get_bind_group_layout(&self.layout);
        Some(device.create_bind_group("contextual_ao_composite", &layout, &entries))
    }
}

impl CompositeJob {
    /// Encodes the pass. `view` is the offset of the view's uniform.
    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        target: &ViewTarget,
        view: u32,
        cache: &PipelineCache,
    ) {
        let Some(pipeline) = cache.get_render_pipeline(self.pipeline) else {
            return;
        };
        let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
            label: Some("contextual_ao_composite"),
            color_attachments: &[Some(target.get_color_attachment())],
            depth_stencil_attachment: None,
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        let (first, end) = self.window;
        let size = end - first;
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &*self.group, &[view]);
        pass.set_scissor_rect(first.x, first.y, size.x, size.y);
        pass.draw(0..3, 0..1);
    }
}
