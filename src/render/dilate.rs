//! Step III: the depth maps of a carver, inflated and shrunk.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries,
            CachedComputePipelineId, CommandEncoder, ComputePassDescriptor, ComputePipelineDescriptor,
            PipelineCache, ShaderStages, ShaderType, StorageTextureAccess, TextureSampleType, UniformBuffer,
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

/// The dilation of one layer, as `Dilation` in WGSL.
#[derive(Clone, Copy, ShaderType)]
struct DilationUniform {
    inflation: Vec3,
    layer: u32,
    shrinkage: Vec3,
    frame_min: Vec2,
    frame_size: Vec2,
}

#[derive(Resource)]
pub(crate) struct DilatePipelines {
    reduce_layout: BindGroupLayoutDescriptor,
    dilate_layout: BindGroupLayoutDescriptor,
    reduce: CachedComputePipelineId,
    dilate: CachedComputePipelineId,
}

impl FromWorld for DilatePipelines {
    fn from_world(world: &mut World) -> Self {
        let format = DILATION_FORMAT;
        let exact = TextureSampleType::Float { filterable: false };
        let access = StorageTextureAccess::WriteOnly;
        let reduce_layout = BindGroupLayoutDescriptor::new(
            "contextual_ao_reduce",
            &BindGroupLayoutEntries::sequential(
                ShaderStages::COMPUTE,
                (
                    uniform_buffer::<DilationUniform>(false),
                    texture_2d_array(exact),
                    texture_storage_2d(format, access),
                ),
            ),
        );
        let dilate_layout = BindGroupLayoutDescriptor::new(
            "contextual_ao_dilate",
            &BindGroupLayoutEntries::sequential(
                ShaderStages::COMPUTE,
                (
                    uniform_buffer::<DilationUniform>(false),
                    texture_2d_array(exact),
                    texture_2d(exact),
                    texture_storage_2d_array(format, access),
                ),
            ),
        );
        let shader: Handle<Shader> = load_embedded_asset!(world, "dilate.wgsl");
        let cache = world.resource::<PipelineCache>();
        let queue = |name: &'static str, layout: &BindGroupLayoutDescriptor, defs: &[&str]| {
            cache.queue_compute_pipeline(ComputePipelineDescriptor {
                label: Some(format!("contextual_ao_{name}").into()),
                layout: vec![layout.clone()],
                shader: shader.clone(),
                shader_defs: defs.iter().map(|&def| def.into()).collect(),
                entry_point: Some(name.into()),
                ..default()
            })
        };
        Self {
            reduce: queue("reduce", &reduce_layout, &["REDUCE"]),
            dilate: queue("dilate", &dilate_layout, &[]),
            reduce_layout,
            dilate_layout,
        }
    }
}

impl DilatePipelines {
    pub fn is_ready(&self, cache: &PipelineCache) -> bool {
        [self.reduce, self.dilate].into_iter().all(|pipeline| cache.get_compute_pipeline(pipeline).is_some())
    }

    /// Puts the dilation of one layer where the shader reads it.
    pub fn bind(
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
        let uniform = uniform.binding()?;
        Some(DilateJob {
            reduce: device.create_bind_group(
                "contextual_ao_reduce",
                &cache.get_bind_group_layout(&self.reduce_layout),
                &BindGroupEntries::sequential((uniform.clone(), &textures.depth.view, &textures.tiles.view)),
            ),
            dilate: device.create_bind_group(
                "contextual_ao_dilate",
                &cache.get_bind_group_layout(&self.dilate_layout),
                &BindGroupEntries::sequential((
                    uniform,
                    &textures.depth.view,
                    &textures.tiles.view,
                    &textures.dilation.view,
                )),
            ),
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
        pipelines: &DilatePipelines,
        textures: &ClipTextures,
        cache: &PipelineCache,
    ) {
        // The reduction has a tile per invocation, the dilation a texel per workgroup.
        let passes = [
            (pipelines.reduce, &self.reduce, textures.tile_count().div_ceil(8)),
            (pipelines.dilate, &self.dilate, textures.dilation_map_size()),
        ];
        for (pipeline, bind_group, groups) in passes {
            let Some(pipeline) = cache.get_compute_pipeline(pipeline) else {
                return;
            };
            let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor {
                label: Some("contextual_ao_dilate"),
                timestamp_writes: None,
            });
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, bind_group, &[]);
            pass.dispatch_workgroups(groups, groups, 1);
        }
    }
}
