//! Step II: draws of a clip mesh from its clip camera, which find its layers.

use bevy::{
    asset::load_embedded_asset,
    mesh::{MeshVertexBufferLayoutRef, PrimitiveTopology},
    prelude::*,
    render::{
        mesh::{RenderMesh, RenderMeshBufferInfo, allocator::MeshAllocator},
        render_asset::RenderAssets,
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, BlendComponent,
            BlendFactor, BlendOperation, BlendState, CachedRenderPipelineId, ColorTargetState, ColorWrites,
            CommandEncoder, CompareFunction, DepthStencilState, FragmentState, IndexFormat, LoadOp,
            Operations, PipelineCache, PrimitiveState, RenderPassColorAttachment,
            RenderPassDepthStencilAttachment, RenderPassDescriptor, RenderPipelineDescriptor, ShaderStages,
            SpecializedRenderPipeline, SpecializedRenderPipelines, StoreOp, TextureSampleType, TextureView,
            UniformBuffer, VertexState,
            binding_types::{texture_2d, uniform_buffer},
        },
        renderer::{RenderDevice, RenderQueue},
    },
    shader::Shader,
};

use super::clip_textures::{COUNT_FORMAT, SURFACE_FORMAT};

/// Result of one draw of a clip mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Draw {
    /// Number of all surfaces.
    Count,
    /// Number of surfaces up to a surface drawn before.
    Passed,
    /// The surface nearest to the clip camera.
    Nearest,
    /// The next surface behind a surface drawn before.
    Next,
    /// The farthest surface.
    Farthest,
}

impl Draw {
    const ALL: [Self; 5] = [Self::Count, Self::Passed, Self::Nearest, Self::Next, Self::Farthest];

    fn counts(self) -> bool {
        matches!(self, Self::Count | Self::Passed)
    }

    /// Whether the draw compares with a surface drawn before.
    fn compares(self) -> bool {
        matches!(self, Self::Passed | Self::Next)
    }

    /// Depth of a texel without a surface: near is 1 and far is 0, so that no point is between.
    fn cleared_depth(self) -> f32 {
        if self == Self::Farthest { 0.0 } else { 1.0 }
    }
}

#[derive(Clone, PartialEq, Eq, Hash)]
pub(crate) struct ClipDrawKey {
    draw: Draw,
    layout: MeshVertexBufferLayoutRef,
    topology: PrimitiveTopology,
    strip_index_format: Option<IndexFormat>,
}

#[derive(Resource)]
pub(crate) struct ClipDrawPipeline {
    camera_layout: BindGroupLayoutDescriptor,
    surface_layout: BindGroupLayoutDescriptor,
    shader: Handle<Shader>,
}

impl FromWorld for ClipDrawPipeline {
    fn from_world(world: &mut World) -> Self {
        Self {
            camera_layout: BindGroupLayoutDescriptor::new(
                "contextual_ao_clip_camera",
                &BindGroupLayoutEntries::single(ShaderStages::VERTEX, uniform_buffer::<Mat4>(false)),
            ),
            surface_layout: BindGroupLayoutDescriptor::new(
                "contextual_ao_clip_surface",
                &BindGroupLayoutEntries::single(ShaderStages::FRAGMENT, texture_2d(TextureSampleType::Depth)),
            ),
            shader: load_embedded_asset!(world, "clip_draw.wgsl"),
        }
    }
}

impl SpecializedRenderPipeline for ClipDrawPipeline {
    type Key = ClipDrawKey;

    fn specialize(&self, key: ClipDrawKey) -> RenderPipelineDescriptor {
        let position = [Mesh::ATTRIBUTE_POSITION.at_shader_location(0)];
        let draw = key.draw;
        let defs = [("COUNT", draw.counts()), ("COMPARE", draw.compares())];
        let shader_defs: Vec<_> =
            defs.into_iter().filter(|(_, on)| *on).map(|(name, _)| name.into()).collect();
        let mut layout = vec![self.camera_layout.clone()];
        layout.extend(draw.compares().then(|| self.surface_layout.clone()));
        let add = BlendComponent {
            src_factor: BlendFactor::One,
            dst_factor: BlendFactor::One,
            operation: BlendOperation::Add,
        };
        let count_target = ColorTargetState {
            format: COUNT_FORMAT,
            blend: Some(BlendState { color: add, alpha: add }),
            write_mask: ColorWrites::ALL,
        };
        let keeps = if draw == Draw::Farthest { CompareFunction::Greater } else { CompareFunction::Less };
        RenderPipelineDescriptor {
            label: Some("contextual_ao_clip_draw".into()),
            layout,
            vertex: VertexState {
                shader: self.shader.clone(),
                shader_defs: shader_defs.clone(),
                buffers: key.layout.0.get_layout(&position).into_iter().collect(),
                ..default()
            },
            fragment: Some(FragmentState {
                shader: self.shader.clone(),
                shader_defs,
                targets: draw.counts().then_some(Some(count_target)).into_iter().collect(),
                ..default()
            }),
            primitive: PrimitiveState {
                topology: key.topology,
                strip_index_format: key.strip_index_format,
                ..default()
            },
            depth_stencil: (!draw.counts()).then(|| DepthStencilState {
                format: SURFACE_FORMAT,
                depth_write_enabled: Some(true),
                depth_compare: Some(keeps),
                stencil: default(),
                bias: default(),
            }),
            ..default()
        }
    }
}

impl ClipDrawPipeline {
    /// Prepares to draw a mesh. `None` until the mesh and its pipelines are ready, and for a mesh without surfaces
    /// (points, lines, no positions).
    pub fn prepare(
        &self,
        mesh_id: AssetId<Mesh>,
        clip_from_local: Mat4,
        source: &MeshSource,
        specialized: &mut SpecializedRenderPipelines<Self>,
        device: &RenderDevice,
        queue: &RenderQueue,
    ) -> Option<ClipMeshDraw> {
        source.allocator.mesh_vertex_slice(&mesh_id)?;
        let mesh = source.meshes.get(mesh_id)?;
        let topology = mesh.primitive_topology();
        let is_strip = match topology {
            PrimitiveTopology::TriangleList => false,
            PrimitiveTopology::TriangleStrip => true,
            _ => return None,
        };
        if !mesh.layout.0.contains(Mesh::ATTRIBUTE_POSITION.id) {
            return None;
        }
        let pipelines = Draw::ALL.map(|draw| {
            let key = ClipDrawKey {
                draw,
                layout: mesh.layout.clone(),
                topology,
                strip_index_format: mesh.index_format().filter(|_| is_strip),
            };
            specialized.specialize(source.cache, self, key)
        });
        for pipeline in pipelines {
            source.cache.get_render_pipeline(pipeline)?;
        }
        let mut camera = UniformBuffer::from(clip_from_local);
        camera.write_buffer(device, queue);
        let camera = device.create_bind_group(
            "contextual_ao_clip_camera",
            &source.cache.get_bind_group_layout(&self.camera_layout),
            &BindGroupEntries::single(camera.binding()?),
        );
        Some(ClipMeshDraw { mesh: mesh_id, pipelines, camera })
    }

    /// Binds a surface for draws that compare with it.
    pub fn bind_surface(
        &self,
        surface: &TextureView,
        cache: &PipelineCache,
        device: &RenderDevice,
    ) -> BindGroup {
        device.create_bind_group(
            "contextual_ao_clip_surface",
            &cache.get_bind_group_layout(&self.surface_layout),
            &BindGroupEntries::single(surface),
        )
    }
}

/// Sources of meshes and pipelines.
pub(crate) struct MeshSource<'a> {
    pub cache: &'a PipelineCache,
    pub meshes: &'a RenderAssets<RenderMesh>,
    pub allocator: &'a MeshAllocator,
}

/// A clip mesh ready to be drawn.
pub(crate) struct ClipMeshDraw {
    mesh: AssetId<Mesh>,
    pipelines: [CachedRenderPipelineId; Draw::ALL.len()],
    camera: BindGroup,
}

impl ClipMeshDraw {
    /// Encodes a draw into `target`. `compared` is the surface to compare with, for draws that compare.
    pub fn encode(
        &self,
        draw: Draw,
        encoder: &mut CommandEncoder,
        target: &TextureView,
        compared: Option<&BindGroup>,
        source: &MeshSource,
    ) {
        let (Some(mesh), Some(vertices), Some(pipeline)) = (
            source.meshes.get(self.mesh),
            source.allocator.mesh_vertex_slice(&self.mesh),
            source.cache.get_render_pipeline(self.pipelines[draw as usize]),
        ) else {
            return;
        };
        let color = [Some(RenderPassColorAttachment {
            view: target,
            depth_slice: None,
            resolve_target: None,
            ops: Operations { load: LoadOp::Clear(default()), store: StoreOp::Store },
        })];
        let depth = RenderPassDepthStencilAttachment {
            view: target,
            depth_ops: Some(Operations { load: LoadOp::Clear(draw.cleared_depth()), store: StoreOp::Store }),
            stencil_ops: None,
        };
        let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
            label: Some("contextual_ao_clip_draw"),
            color_attachments: if draw.counts() { &color } else { &[] },
            depth_stencil_attachment: (!draw.counts()).then_some(depth),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &self.camera, &[]);
        if let Some(compared) = compared {
            pass.set_bind_group(1, compared, &[]);
        }
        pass.set_vertex_buffer(0, *vertices.buffer.slice(..));
        match &mesh.buffer_info {
            RenderMeshBufferInfo::Indexed { index_format, count } => {
                let Some(indices) = source.allocator.mesh_index_slice(&self.mesh) else {
                    return;
                };
                pass.set_index_buffer(*indices.buffer.slice(..), *index_format);
                let range = indices.range.start..indices.range.start + count;
                pass.draw_indexed(range, vertices.range.start as i32, 0..1);
            }
            RenderMeshBufferInfo::NonIndexed => pass.draw(vertices.range.clone(), 0..1),
        }
    }
}
