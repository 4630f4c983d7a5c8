//! Step II: the depth maps of a carver, in as many layers as its mesh needs.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupLayoutEntries, Buffer, CommandEncoder, PipelineCache, ShaderStages,
            ShaderType, StorageTextureAccess, TextureSampleType, UniformBuffer,
            binding_types::{storage_buffer_sized, texture_2d, texture_storage_2d_array, uniform_buffer},
        },
        renderer::{RenderDevice, RenderQueue},
    },
};
use core::iter;

use super::{
    clip_draw::{ClipDrawPipeline, ClipMeshDraw, Draw, MeshSource},
    clip_textures::{ClipTextures, LAYER_FORMAT, LayerRange},
};
use crate::render::gpu::compute_pass::{ComputePass, Groups, PassDescriptor, are_ready};

/// The layers to fill, as `LayerRange` in WGSL.
#[derive(Clone, Copy, ShaderType)]
pub(in crate::render) struct LayerRangeUniform {
    first: u32,
    count: u32,
    is_cut_off: u32,
}

#[derive(Resource)]
pub(crate) struct PeelPasses {
    pair: ComputePass,
    append: ComputePass,
    finish: ComputePass,
}

impl FromWorld for PeelPasses {
    fn from_world(world: &mut World) -> Self {
        let exact = TextureSampleType::Float { filterable: false };
        let depth = texture_2d(TextureSampleType::Depth);
        let shader: Handle<Shader> = load_embedded_asset!(world, "peel.wgsl");
        let pair = PassDescriptor {
            name: "contextual_ao_peel",
            shader: shader.clone(),
            entry_point: Some("pair"),
            own: &BindGroupLayoutEntries::sequential(
                ShaderStages::COMPUTE,
                (
                    uniform_buffer::<LayerRangeUniform>(false),
                    texture_storage_2d_array(LAYER_FORMAT, StorageTextureAccess::WriteOnly),
                    depth,
                    depth,
                ),
            ),
            ..default()
        };
        let pair = ComputePass::new(world, pair);
        let own = BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (texture_2d(exact), texture_2d(exact), storage_buffer_sized(false, None)),
        );
        let several = |entry_point| {
            let descriptor = PassDescriptor {
                name: "contextual_ao_peel_several",
                shader: shader.clone(),
                entry_point: Some(entry_point),
                shader_defs: vec!["SEVERAL_LAYERS".into()],
                before: vec![pair.layout().clone()],
                own: &own,
                ..default()
            };
            ComputePass::new(world, descriptor)
        };
        Self { append: several("append"), finish: several("finish"), pair }
    }
}

impl PeelPasses {
    pub fn is_ready(&self, cache: &PipelineCache) -> bool {
        are_ready([&self.pair, &self.append, &self.finish], cache)
    }

    /// Plans to fill `layers` with a mesh of up to `surfaces` surfaces along a line of sight.
    pub fn bind_mesh(
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
            let resources = (
                uniform.binding()?,
                &textures.depth.view,
                &textures.surfaces[surface].view,
                &textures.surfaces[other].view,
            );
            Some(self.pair.bind(resources, cache, device))
        };
        let groups = [group([0, 1])?, group([1, 0])?];
        let several = (layers.count > 1).then(|| {
            let compared = [0, 1].map(|k| clip_draw.bind_surface(&textures.surfaces[k].view, cache, device));
            let peeling = textures.prepare_peeling(device);
            let progress = peeling.progress.clone();
            let passed = peeling.passed.view.clone();
            let resources = (&textures.counts.view, &passed, progress.as_entire_binding());
            let group = self.append.bind(resources, cache, device);
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
    /// Bind groups with one of the two surfaces first, and with the other first.
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
        passes: &PeelPasses,
        textures: &ClipTextures,
        source: &MeshSource,
    ) {
        let surfaces = textures.surfaces.each_ref().map(|surface| &surface.view);
        let run = |encoder: &mut CommandEncoder, pass: &ComputePass, surface: usize| {
            let groups = iter::once(&self.groups[surface]);
            let groups = groups.chain(self.several.as_ref().map(|several| &several.group));
            let texels = Groups::Pixels(UVec2::splat(textures.depth_map_size));
            pass.encode(encoder, groups, texels, source.cache);
        };
        let (Some(several), Some(peeling)) = (&self.several, &textures.peeling) else {
            self.draw.encode(Draw::Nearest, encoder, surfaces[0], None, source);
            self.draw.encode(Draw::Farthest, encoder, surfaces[1], None, source);
            run(encoder, &passes.pair, 0);
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
            run(encoder, &passes.append, current);
        }
        let last = several.peels as usize % 2;
        self.draw.encode(Draw::Farthest, encoder, surfaces[last], None, source);
        run(encoder, &passes.finish, last);
    }
}
