//! Step II: the depth maps of a carver, as many layers as its mesh needs.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, Buffer,
            CachedComputePipelineId, CommandEncoder, ComputePassDescriptor, ComputePipelineDescriptor,
            PipelineCache, ShaderStages, ShaderType, StorageTextureAccess, TextureSampleType, UniformBuffer,
            binding_types::{storage_buffer_sized, texture_2d, texture_storage_2d_array, uniform_buffer},
        },
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::{
    clip_draw::{ClipDrawPipeline, ClipMeshDraw, Draw, MeshSource},
    clip_maps::LayerRange,
    clip_textures::{ClipTextures, LAYER_FORMAT},
};

/// The layers to fill, as `LayerRange` in WGSL.
#[derive(Clone, Copy, ShaderType)]
struct LayerRangeUniform {
    first: u32,
    count: u32,
    is_cut_off: u32,
}

#[derive(Resource)]
pub(crate) struct PeelPipelines {
    layout: BindGroupLayoutDescriptor,
    several_layout: BindGroupLayoutDescriptor,
    pair: CachedComputePipelineId,
    append: CachedComputePipelineId,
    finish: CachedComputePipelineId,
}

impl FromWorld for PeelPipelines {
    fn from_world(world: &mut World) -> Self {
        let exact = TextureSampleType::Float { filterable: false };
        let layout = BindGroupLayoutDescriptor::new(
            "contextual_ao_peel",
            &BindGroupLayoutEntries::sequential(
                ShaderStages::COMPUTE,
                (
                    uniform_buffer::<LayerRangeUniform>(false),
                    texture_storage_2d_array(LAYER_FORMAT, StorageTextureAccess::WriteOnly),
                    texture_2d(TextureSampleType::Depth),
                    texture_2d(TextureSampleType::Depth),
                ),
            ),
        );
        let several_layout = BindGroupLayoutDescriptor::new(
            "contextual_ao_peel_several",
            &BindGroupLayoutEntries::sequential(
                ShaderStages::COMPUTE,
                (texture_2d(exact), texture_2d(exact), storage_buffer_sized(false, None)),
            ),
        );
        let shader: Handle<Shader> = load_embedded_asset!(world, "peel.wgsl");
        let cache = world.resource::<PipelineCache>();
        let queue = |name: &'static str, is_several: bool| {
            let mut layouts = vec![layout.clone()];
            layouts.extend(is_several.then(|| several_layout.clone()));
            cache.queue_compute_pipeline(ComputePipelineDescriptor {
                label: Some(format!("contextual_ao_{name}").into()),
                layout: layouts,
                shader: shader.clone(),
                shader_defs: is_several.then_some("SEVERAL_LAYERS".into()).into_iter().collect(),
                entry_point: Some(name.into()),
                ..default()
            })
        };
        Self {
            pair: queue("pair", false),
            append: queue("append", true),
            finish: queue("finish", true),
            layout,
            several_layout,
        }
    }
}

impl PeelPipelines {
    pub fn is_ready(&self, cache: &PipelineCache) -> bool {
        let all = [self.pair, self.append, self.finish];
        all.into_iter().all(|pipeline| cache.get_compute_pipeline(pipeline).is_some())
    }

    /// Plans to fill `layers` with a mesh that has up to `surfaces` along a line of sight.
    pub fn bind(
        &self,
        draw: ClipMeshDraw,
        layers: LayerRange,
        surfaces: u32,
        clip_draw: &ClipDrawPipeline,
        textures: &mut ClipTextures,
        cache: &PipelineCache,
        device: &RenderDevice,
        queue: &RenderQueue,
    ) -> Option<PeelJob> {
        let mut uniform = UniformBuffer::from(LayerRangeUniform {
            first: layers.first,
            count: layers.count,
            is_cut_off: layers.cuts_off(surfaces) as u32,
        });
        uniform.write_buffer(device, queue);
        let group = |[surface, other]: [usize; 2]| {
            Some(device.create_bind_group(
                "contextual_ao_peel",
                &cache.get_bind_group_layout(&self.layout),
                &BindGroupEntries::sequential((
                    uniform.binding()?,
                    &textures.depth.view,
                    &textures.surfaces[surface].view,
                    &textures.surfaces[other].view,
                )),
            ))
        };
        let groups = [group([0, 1])?, group([1, 0])?];
        let several = (layers.count > 1).then(|| {
            let compared = [0, 1].map(|k| clip_draw.bind_surface(&textures.surfaces[k].view, cache, device));
            let peeling = textures.prepare_peeling(device);
            let progress = peeling.progress.clone();
            let passed = peeling.passed.view.clone();
            let group = device.create_bind_group(
                "contextual_ao_peel_several",
                &cache.get_bind_group_layout(&self.several_layout),
                &BindGroupEntries::sequential((&textures.counts.view, &passed, progress.as_entire_binding())),
            );
            // All but the farthest surface, which needs no peeling.
            let peels = (surfaces - 1).min(2 * layers.count - 1);
            SeveralLayers { peels, compared, group, progress }
        });
        Some(PeelJob { draw, groups, several })
    }
}

/// One carver's depth maps to render.
pub(crate) struct PeelJob {
    draw: ClipMeshDraw,
    /// With one of the two surfaces first, and with the other.
    groups: [BindGroup; 2],
    several: Option<SeveralLayers>,
}

struct SeveralLayers {
    peels: u32,
    /// The two surfaces, for draws to compare with.
    compared: [BindGroup; 2],
    group: BindGroup,
    progress: Buffer,
}

impl PeelJob {
    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        pipelines: &PeelPipelines,
        textures: &ClipTextures,
        source: &MeshSource,
    ) {
        let surfaces = textures.surfaces.each_ref().map(|surface| &surface.view);
        let dispatch =
            |encoder: &mut CommandEncoder, pipeline, surface: usize, several: Option<&BindGroup>| {
                let Some(pipeline) = source.cache.get_compute_pipeline(pipeline) else {
                    return;
                };
                let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor {
                    label: Some("contextual_ao_peel"),
                    timestamp_writes: None,
                });
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, &self.groups[surface], &[]);
                if let Some(several) = several {
                    pass.set_bind_group(1, several, &[]);
                }
                let groups = textures.depth_map_size.div_ceil(8);
                pass.dispatch_workgroups(groups, groups, 1);
            };
        let (Some(several), Some(peeling)) = (&self.several, &textures.peeling) else {
            self.draw.encode(Draw::Nearest, encoder, surfaces[0], None, source);
            self.draw.encode(Draw::Farthest, encoder, surfaces[1], None, source);
            dispatch(encoder, pipelines.pair, 0, None);
            return;
        };
        let compared = &several.compared;
        encoder.clear_buffer(&several.progress, 0, None);
        self.draw.encode(Draw::Count, encoder, &textures.counts.view, None, source);
        for peel in 0..several.peels as usize {
            let (current, previous) = (peel % 2, (peel + 1) % 2);
            if peel == 0 {
                self.draw.encode(Draw::Nearest, encoder, surfaces[current], None, source);
            } else {
                self.draw.encode(Draw::Next, encoder, surfaces[current], Some(&compared[previous]), source);
            }
            let passed = &peeling.passed.view;
            self.draw.encode(Draw::Passed, encoder, passed, Some(&compared[current]), source);
            dispatch(encoder, pipelines.append, current, Some(&several.group));
        }
        let last = several.peels as usize % 2;
        self.draw.encode(Draw::Farthest, encoder, surfaces[last], None, source);
        dispatch(encoder, pipelines.finish, last, Some(&several.group));
    }
}
