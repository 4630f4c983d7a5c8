//! Depths of volumes that have a [`VolumeDepth`](crate::occlusion::VolumeDepth), in the depth of the main pass: for what is
//! drawn later, and for passes behind the main pass, such as Bevy's depth of field and volumetric fog.
//!
//! A volume's depth is drawn right behind its colours, among the transparent objects. Volumes read the depth of the prepass,
//! so that none ends its own rays.

use bevy::{
    asset::load_embedded_asset,
    core_pipeline::core_3d::{Transparent3d, TransparentSortingInfo3d},
    pbr::{MeshPipelineKey, ViewKeyCache},
    prelude::*,
    render::{
        render_phase::{DrawFunctions, PhaseItemExtraIndex, ViewSortedRenderPhases},
        render_resource::{
            ColorWrites, PipelineCache, RenderPipelineDescriptor, SpecializedRenderPipeline,
            SpecializedRenderPipelines,
        },
        view::{ExtractedView, RenderVisibleEntities},
    },
    shader::ShaderDefVal,
};

use super::{
    phase::DrawVolume,
    pipeline::{DrawPipeline, depth_of_shader},
};
use crate::render::{ExtractedScene, MarchVariant, shows};

/// Makes the pipelines.
#[derive(Resource)]
pub(super) struct DepthPipeline {
    drawing: DrawPipeline,
    shader: Handle<Shader>,
}

/// Kind of a view, how its rays are followed, and whether only an isosurface is drawn.
type DepthKey = (MeshPipelineKey, MarchVariant, bool);

impl FromWorld for DepthPipeline {
    fn from_world(world: &mut World) -> Self {
        let drawing = world.resource::<DrawPipeline>().clone();
        Self { drawing, shader: load_embedded_asset!(world, "depth.wgsl") }
    }
}

impl SpecializedRenderPipeline for DepthPipeline {
    type Key = DepthKey;

    fn specialize(&self, (view, variant, draws_surface): DepthKey) -> RenderPipelineDescriptor {
        let own = variant.shader_defs().chain(draws_surface.then_some("ISOSURFACE")).map(ShaderDefVal::from);
        let mut descriptor = self.drawing.describe(view, &self.shader, own);
        descriptor.label = Some("contextual_ao_depth".into());
        // The pass has colours, which stay.
        for target in
            descriptor.fragment.iter_mut().flat_map(|fragment| fragment.targets.iter_mut().flatten())
        {
            (target.blend, target.write_mask) = (None, ColorWrites::empty());
        }
        descriptor.depth_stencil = Some(depth_of_shader());
        descriptor
    }
}

/// Number of a depth among the items of a volume. No entity of the render world has it.
const DEPTH_ITEM: u32 = u32::MAX - 16;

/// Adds depths of volumes to the transparent objects of the views that show them, behind all colours of volumes.
pub(super) fn queue_depths(
    scene: Res<ExtractedScene>,
    functions: Res<DrawFunctions<Transparent3d>>,
    base: Res<DepthPipeline>,
    mut pipelines: ResMut<SpecializedRenderPipelines<DepthPipeline>>,
    cache: Res<PipelineCache>,
    keys: Res<ViewKeyCache>,
    views: Query<(&ExtractedView, &RenderVisibleEntities)>,
    mut phases: ResMut<ViewSortedRenderPhases<Transparent3d>>,
) {
    let draw_function = functions.read().id::<DrawVolume>();
    let item = Entity::from_raw_u32(DEPTH_ITEM).unwrap_or(Entity::PLACEHOLDER);
    for (view, visible) in &views {
        let id = &view.retained_view_entity;
        let (Some(phase), Some(key_of_view)) = (phases.get_mut(id), keys.get(id)) else {
            continue;
        };
        for volume in scene.volumes.iter().filter(|volume| volume.is_placed && volume.depth_opacity.is_some())
        {
            let Some(shown_by) = volume.drawn_on.filter(|drawn_on| shows(visible, *drawn_on)) else {
                continue;
            };
            let key = (*key_of_view, MarchVariant::of(volume), volume.draws_surface());
            phase.add_transient(Transparent3d {
                sorting_info: TransparentSortingInfo3d::Sorted {
                    mesh_center: volume.world_from_local.translation.into(),
                    depth_bias: 0.0,
                },
                distance: 0.0,
                pipeline: pipelines.specialize(&cache, &base, key),
                entity: (item, shown_by),
                draw_function,
                batch_range: 0..1,
                extra_index: PhaseItemExtraIndex::None,
                indexed: false,
            });
        }
    }
}
