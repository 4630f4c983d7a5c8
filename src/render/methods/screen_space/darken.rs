//! Multiplies the colours of a view by its factors, in place. Images of other views beside it stay.

use bevy::{
    asset::load_embedded_asset,
    core_pipeline::FullscreenShader,
    ecs::system::SystemParam,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupLayoutDescriptor, BindGroupLayoutEntries, BlendComponent, BlendFactor,
            BlendOperation, BlendState, ColorTargetState, ColorWrites, CommandEncoder, FragmentState,
            PipelineCache, RenderPassColorAttachment, RenderPassDescriptor, RenderPipeline,
            RenderPipelineDescriptor, ShaderStages, SpecializedRenderPipeline, SpecializedRenderPipelines,
            TextureFormat, TextureSampleType, VertexState,
            binding_types::{texture_2d, uniform_buffer},
        },
        view::ViewTarget,
    },
    shader::Shader,
};

use super::uniform::ScreenSpaceUniform;
use crate::{occlusion::ScreenSpaceBlur, render::gpu::render_pipelines::variants_are_ready};

/// The pipeline, and its bind group layout.
#[derive(Resource)]
pub(crate) struct DarkenPipeline {
    pub layout: BindGroupLayoutDescriptor,
    vertex: VertexState,
    shader: Handle<Shader>,
}

const BLURS: [ScreenSpaceBlur; 3] = [ScreenSpaceBlur::None, ScreenSpaceBlur::Gaussian, ScreenSpaceBlur::Even];

/// Shader definition of a blur.
fn definition(blur: ScreenSpaceBlur) -> Option<&'static str> {
    match blur {
        ScreenSpaceBlur::None => None,
        ScreenSpaceBlur::Gaussian => Some("GAUSSIAN"),
        ScreenSpaceBlur::Even => Some("EVEN"),
    }
}

/// Key of a variant of the pipeline.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct DarkenKey {
    /// Format of the view's colours.
    pub format: TextureFormat,
    pub blur: ScreenSpaceBlur,
}

impl FromWorld for DarkenPipeline {
    fn from_world(world: &mut World) -> Self {
        let entries = BindGroupLayoutEntries::sequential(
            ShaderStages::FRAGMENT,
            (
                uniform_buffer::<ScreenSpaceUniform>(false),
                texture_2d(TextureSampleType::Float { filterable: false }),
                texture_2d(TextureSampleType::Uint),
            ),
        );
        Self {
            layout: BindGroupLayoutDescriptor::new("contextual_ao_darken", &entries),
            vertex: world.resource::<FullscreenShader>().to_vertex_state(),
            shader: load_embedded_asset!(world, "darken.wgsl"),
        }
    }
}

impl SpecializedRenderPipeline for DarkenPipeline {
    type Key = DarkenKey;

    fn specialize(&self, key: DarkenKey) -> RenderPipelineDescriptor {
        let multiply = BlendComponent {
            src_factor: BlendFactor::Dst,
            dst_factor: BlendFactor::Zero,
            operation: BlendOperation::Add,
        };
        let target = ColorTargetState {
            format: key.format,
            blend: Some(BlendState { color: multiply, alpha: BlendComponent::REPLACE }),
            // Alpha stays.
            write_mask: ColorWrites::COLOR,
        };
        RenderPipelineDescriptor {
            label: Some("contextual_ao_darken".into()),
            layout: vec![self.layout.clone()],
            vertex: self.vertex.clone(),
            fragment: Some(FragmentState {
                shader: self.shader.clone(),
                shader_defs: definition(key.blur).map(Into::into).into_iter().collect(),
                targets: vec![Some(target)],
                ..default()
            }),
            ..default()
        }
    }
}

/// The pipelines of all views.
#[derive(SystemParam)]
pub(crate) struct DarkenPipelines<'w, 's> {
    base: Res<'w, DarkenPipeline>,
    variants: ResMut<'w, SpecializedRenderPipelines<DarkenPipeline>>,
    views: Query<'w, 's, &'static ViewTarget>,
}

impl DarkenPipelines<'_, '_> {
    /// Whether the pipelines are ready. The first call starts their compilation.
    pub fn are_ready(&mut self, cache: &PipelineCache) -> bool {
        let Self { base, variants, views } = self;
        let formats = views.iter().map(ViewTarget::main_texture_format);
        let keys = formats.flat_map(|format| BLURS.map(|blur| DarkenKey { format, blur }));
        variants_are_ready(&**base, variants, keys, cache)
    }
}

/// Draws over the pixels of a viewport, given by origin and size.
pub(super) fn encode(
    encoder: &mut CommandEncoder,
    pipeline: &RenderPipeline,
    group: &BindGroup,
    viewport: Vec4,
    colors: RenderPassColorAttachment,
) {
    let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
        label: Some("contextual_ao_darken"),
        color_attachments: &[Some(colors)],
        ..default()
    });
    pass.set_viewport(viewport.x, viewport.y, viewport.z, viewport.w, 0.0, 1.0);
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, group, &[]);
    pass.draw(0..3, 0..1);
}
