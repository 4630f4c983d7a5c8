//! Step II: the nearest and farthest depth of a clip mesh, seen from its clip camera.

use bevy::mesh::PrimitiveTopology;
use bevy::{
    asset::load_embedded_asset,
    mesh::MeshVertexBufferLayoutRef,
    prelude::*,
    render::{
        mesh::{RenderMesh, RenderMeshBufferInfo, allocator::MeshAllocator},
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries,
            CachedRenderPipelineId, CommandEncoder, CompareFunction, DepthStencilState, IndexFormat, LoadOp,
            MultisampleState, Operations, PipelineCache, PrimitiveState, RenderPassDepthStencilAttachment,
            RenderPassDescriptor, RenderPipelineDescriptor, ShaderStages, SpecializedRenderPipeline,
            SpecializedRenderPipelines, StoreOp, TextureFormat, UniformBuffer, VertexState,
            binding_types::uniform_buffer,
        },
        renderer::{RenderDevice, RenderQueue},
    },
    shader::Shader,
};

use super::clip_maps::ClipTextures;

/// Which of a mesh's surfaces a depth map keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Surface {
    Nearest,
    Farthest,
}

impl Surface {
    pub const BOTH: [Self; 2] = [Self::Nearest, Self::Farthest];

    /// The value of a texel without a surface: near 1 and far 0, so that nothing is between.
    fn cleared(self) -> f32 {
        match self {
            Self::Nearest => 1.0,
            Self::Farthest => 0.0,
        }
    }

    fn keeps(self) -> CompareFunction {
        match self {
            Self::Nearest => CompareFunction::Less,
            Self::Farthest => CompareFunction::Greater,
        }
    }
}

#[derive(Clone, PartialEq, Eq, Hash)]
pub(crate) struct ClipDepthKey {
    surface: Surface,
    layout: MeshVertexBufferLayoutRef,
    topology: PrimitiveTopology,
    strip_index_format: Option<IndexFormat>,
}

#[derive(Resource)]
pub(crate) struct ClipDepthPipeline {
    layout: BindGroupLayoutDescriptor,
    shader: Handle<Shader>,
}

impl FromWorld for ClipDepthPipeline {
    fn from_world(world: &mut World) -> Self {
        Self {
            layout: BindGroupLayoutDescriptor::new(
                "contextual_ao_clip_depth",
                &BindGroupLayoutEntries::single(ShaderStages::VERTEX, uniform_buffer::<Mat4>(false)),
            ),
            shader: load_embedded_asset!(world, "clip_depth.wgsl"),
        }
    }
}

impl SpecializedRenderPipeline for ClipDepthPipeline {
    type Key = ClipDepthKey;

    fn specialize(&self, key: ClipDepthKey) -> RenderPipelineDescriptor {
        let position = [Mesh::ATTRIBUTE_POSITION.at_shader_location(0)];
        RenderPipelineDescriptor {
            label: Some("contextual_ao_clip_depth".into()),
            layout: vec![self.layout.clone()],
            vertex: VertexState {
                shader: self.shader.clone(),
                buffers: key.layout.0.get_layout(&position).into_iter().collect(),
                ..default()
            },
            primitive: PrimitiveState {
                topology: key.topology,
                strip_index_format: key.strip_index_format,
                ..default()
            },
            depth_stencil: Some(DepthStencilState {
                format: TextureFormat::Depth32Float,
                depth_write_enabled: Some(true),
                depth_compare: Some(key.surface.keeps()),
                stencil: default(),
                bias: default(),
            }),
            multisample: MultisampleState::default(),
            ..default()
        }
    }
}

impl ClipDepthPipeline {
    /// The pipelines that draw a mesh, nearest surface first. `None` for a mesh that has no
    /// surface to draw (points, lines, no positions).
    pub fn queue(
        &self,
        mesh: &RenderMesh,
        pipelines: &mut SpecializedRenderPipelines<Self>,
        cache: &PipelineCache,
    ) -> Option<[CachedRenderPipelineId; 2]> {
        let topology = mesh.primitive_topology();
        let is_strip = match topology {
            PrimitiveTopology::TriangleList => false,
            PrimitiveTopology::TriangleStrip => true,
            _ => return None,
        };
        if !mesh.layout.0.contains(Mesh::ATTRIBUTE_POSITION.id) {
            return None;
        }
        Some(Surface::BOTH.map(|surface| {
            let key = ClipDepthKey {
                surface,
                layout: mesh.layout.clone(),
                topology,
                strip_index_format: mesh.index_format().filter(|_| is_strip),
            };
            pipelines.specialize(cache, self, key)
        }))
    }

    /// Puts the camera of one carver where the shader reads it.
    pub fn bind(
        &self,
        clip_from_local: Mat4,
        cache: &PipelineCache,
        device: &RenderDevice,
        queue: &RenderQueue,
    ) -> Option<BindGroup> {
        let mut camera = UniformBuffer::from(clip_from_local);
        camera.write_buffer(device, queue);
        Some(device.create_bind_group(
            "contextual_ao_clip_depth",
            &cache.get_bind_group_layout(&self.layout),
            &BindGroupEntries::single(camera.binding()?),
        ))
    }
}

/// One carver's depth maps to render.
pub(crate) struct ClipDepthJob {
    pub mesh: AssetId<Mesh>,
    pub slot: u32,
    pub pipelines: [CachedRenderPipelineId; 2],
    pub camera: BindGroup,
}

impl ClipDepthJob {
    /// Draws the mesh twice, into the carver's two layers.
    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        textures: &ClipTextures,
        cache: &PipelineCache,
        meshes: &bevy::render::render_asset::RenderAssets<RenderMesh>,
        allocator: &MeshAllocator,
    ) {
        let (Some(mesh), Some(vertices)) = (meshes.get(self.mesh), allocator.mesh_vertex_slice(&self.mesh))
        else {
            return;
        };
        for (surface, pipeline) in Surface::BOTH.into_iter().zip(self.pipelines) {
            let Some(pipeline) = cache.get_render_pipeline(pipeline) else {
                return;
            };
            let layer = 2 * self.slot + surface as u32;
            let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
                label: Some("contextual_ao_clip_depth"),
                color_attachments: &[],
                depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
                    view: &textures.depth_layer(layer),
                    depth_ops: Some(Operations {
                        load: LoadOp::Clear(surface.cleared()),
                        store: StoreOp::Store,
                    }),
                    stencil_ops: None,
                }),
                timestamp_writes: None,
                occlusion_query_set: None,
                multiview_mask: None,
            });
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &self.camera, &[]);
            pass.set_vertex_buffer(0, *vertices.buffer.slice(..));
            match &mesh.buffer_info {
                RenderMeshBufferInfo::Indexed { index_format, count } => {
                    let Some(indices) = allocator.mesh_index_slice(&self.mesh) else {
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
}
