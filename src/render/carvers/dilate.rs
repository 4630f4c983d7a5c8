//! Step III: the depth maps of a carver, inflated and shrunk.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupLayoutEntries, CommandEncoder, PipelineCache, ShaderStages, ShaderType,
            StorageTextureAccess, TextureSampleType, UniformBuffer,
            binding_types::{
                texture_2d, texture_2d_array, texture_storage_2d, texture_storage_2d_array, uniform_buffer,
            },
        },
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::{
    clip_keys::DilationKey,
    clip_textures::{ClipTextures, DILATION_FORMAT},
};
use crate::render::gpu::compute_pass::{ComputePass, Groups, PassDescriptor, are_ready};

/// The dilation of one layer, as `Dilation` in WGSL.
#[derive(Clone, Copy, ShaderType)]
pub(in crate::render) struct DilationUniform {
    inflation: Vec3,
    layer: u32,
    shrinkage: Vec3,
    frame_min: Vec2,
    frame_size: Vec2,
}

#[derive(Resource)]
pub(crate) struct DilatePasses {
    reduce: ComputePass,
    dilate: ComputePass,
}

impl FromWorld for DilatePasses {
    fn from_world(world: &mut World) -> Self {
        let format = DILATION_FORMAT;
        let exact = TextureSampleType::Float { filterable: false };
        let access = StorageTextureAccess::WriteOnly;
        let uniform = uniform_buffer::<DilationUniform>(false);
        let shader: Handle<Shader> = load_embedded_asset!(world, "dilate.wgsl");
        let reduce = PassDescriptor {
            name: "contextual_ao_reduce",
            shader: shader.clone(),
            entry_point: Some("reduce"),
            shader_defs: vec!["REDUCE".into()],
            own: &BindGroupLayoutEntries::sequential(
                ShaderStages::COMPUTE,
                (uniform, texture_2d_array(exact), texture_storage_2d(format, access)),
            ),
            ..default()
        };
        let dilate = PassDescriptor {
            name: "contextual_ao_dilate",
            shader,
            entry_point: Some("dilate"),
            own: &BindGroupLayoutEntries::sequential(
                ShaderStages::COMPUTE,
                (
                    uniform,
                    texture_2d_array(exact),
                    texture_2d(exact),
                    texture_storage_2d_array(format, access),
                ),
            ),
            ..default()
        };
        Self { reduce: ComputePass::new(world, reduce), dilate: ComputePass::new(world, dilate) }
    }
}

impl DilatePasses {
    pub fn is_ready(&self, cache: &PipelineCache) -> bool {
        are_ready([&self.reduce, &self.dilate], cache)
    }

    /// Writes the dilation of one layer for the shader, and binds it.
    pub fn bind_layer(
        &self,
        key: DilationKey,
        layer: u32,
        textures: &ClipTextures,
        cache: &PipelineCache,
        device: &RenderDevice,
        queue: &RenderQueue,
    ) -> Option<DilateJob> {
        let frame = key.frame();
        let mut uniform = UniformBuffer::from(DilationUniform {
            inflation: key.inflation,
            layer,
            shrinkage: key.shrinkage,
            frame_min: frame.min,
            frame_size: frame.size,
        });
        uniform.write_buffer(device, queue);
        let (uniform, depth, tiles) = (uniform.binding()?, &textures.depth.view, &textures.tiles.view);
        let dilation = &textures.dilation.view;
        Some(DilateJob {
            reduce: self.reduce.bind((uniform.clone(), depth, tiles), cache, device),
            dilate: self.dilate.bind((uniform, depth, tiles, dilation), cache, device),
        })
    }
}

/// One layer's dilation map to compute.
pub(crate) struct DilateJob {
    reduce: BindGroup,
    dilate: BindGroup,
}

impl DilateJob {
    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        passes: &DilatePasses,
        textures: &ClipTextures,
        cache: &PipelineCache,
    ) {
        // The reduction has a tile per invocation, the dilation a texel per workgroup.
        let tiles = Groups::Pixels(UVec2::splat(textures.tile_count()));
        passes.reduce.encode(encoder, [&self.reduce], tiles, cache);
        let texels = Groups::Square(textures.dilation_map_size());
        passes.dilate.encode(encoder, [&self.dilate], texels, cache);
    }
}
