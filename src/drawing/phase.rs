//! Bind groups of volumes, and the commands that draw them in a view.

use bevy::{
    core_pipeline::{
        deferred::{AlphaMask3dDeferred, Opaque3dDeferred},
        prepass::{AlphaMask3dPrepass, Opaque3dPrepass},
    },
    ecs::{
        query::ROQueryItem,
        system::{SystemParamItem, lifetimeless::SRes},
    },
    pbr::{SetMeshViewBindGroup, SetMeshViewBindingArrayBindGroup},
    platform::collections::HashMap,
    prelude::*,
    render::{
        render_phase::{
            PhaseItem, RenderCommand, RenderCommandResult, SetItemPipeline, TrackedRenderPass,
            ViewBinnedRenderPhases,
        },
        render_resource::{
            BindGroup, BindGroupEntry, BindingResource, BufferId, PipelineCache, TextureViewId,
        },
        renderer::RenderDevice,
        sync_world::MainEntity,
        view::ExtractedView,
    },
};

use super::merging::{MERGED_BIND_GROUP, MergedDraws, merged_bindings, offset_of_record};
use super::pipeline::{
    DrawPipeline, OCCLUSION, ORIENTATIONS, OUTLINES, VIEW_BINDING, VOLUME_BIND_GROUP, drawn_bindings,
};
use crate::render::{
    BOX_VERTICES, BuffersOf, ClipMaps, ExtractedScene, Formats, KeptGroup, MarchedViewUniform, RUNS_BINDING,
    ViewArray, VolumeRuns, VolumeStore,
};

/// Bind groups of volumes.
#[derive(Resource, Default)]
pub(super) struct DrawnVolumes {
    /// Groups of this frame, by the entity of the box; each with the volume in it.
    by_box: HashMap<MainEntity, (MainEntity, DrawnGroups)>,
    kept: BuffersOf<MainEntity, KeptGroup<Bound, Option<DrawnGroups>>>,
    /// What merged draws read besides.
    merged: Option<BindGroup>,
    kept_merged: KeptGroup<BufferId>,
}

/// Bind groups of a volume.
#[derive(Clone)]
pub(super) struct DrawnGroups {
    /// For drawing.
    pub drawn: BindGroup,
    /// The same for shading outlines, without their lists.
    pub shaded: BindGroup,
    /// The lists of outlines, to be written.
    pub outlines: BindGroup,
}

/// Everything that a volume's bind group binds and that may be made anew: the volume and its views, then clip maps, the lookup
/// table, and what the method makes.
type Bound = ([BufferId; 4], [TextureViewId; 4]);

impl DrawnVolumes {
    /// Bind groups of the volume in a box.
    pub fn groups_of(&self, drawn_box: MainEntity) -> Option<&DrawnGroups> {
        self.by_box.get(&drawn_box).map(|(_, groups)| groups)
    }
}

/// Draws a volume in a view.
pub(super) type DrawVolume =
    (SetItemPipeline, SetMeshViewBindGroup<0>, SetMeshViewBindingArrayBindGroup<1>, DrawBox<ALL_RAYS>);

/// Draws the view rays that `DrawVolume` leaves out, if there are any.
pub(super) type DrawCutOffRays =
    (SetItemPipeline, SetMeshViewBindGroup<0>, SetMeshViewBindingArrayBindGroup<1>, DrawBox<CUT_OFF_RAYS>);

/// Draws the samples of pixels that `DrawVolume` leaves out at the outlines of opaque meshes.
pub(super) type DrawFarSamples = (
    SetItemPipeline,
    SetMeshViewBindGroup<0>,
    SetMeshViewBindingArrayBindGroup<1>,
    SkipWithoutMeshes,
    DrawBox<ALL_RAYS>,
);

/// Binds the resources that the passes keep for volumes.
pub(super) fn bind_volumes(
    scene: Res<ExtractedScene>,
    store: Res<VolumeStore>,
    runs: Res<VolumeRuns>,
    clip_maps: Res<ClipMaps>,
    formats: Res<Formats>,
    base: Res<DrawPipeline>,
    (merged, cache, device): (Res<MergedDraws>, Res<PipelineCache>, Res<RenderDevice>),
    mut drawn: ResMut<DrawnVolumes>,
) {
    let DrawnVolumes { by_box, kept, merged: of_merged, kept_merged } = &mut *drawn;
    let bind = |label, layout, entries: &[BindGroupEntry]| {
        device.create_bind_group(label, &cache.get_bind_group_layout(layout), entries)
    };
    by_box.clear();
    kept.begin_frame();
    *of_merged = merged.buffer.as_ref().map(|records| {
        let entries = merged_bindings(records);
        kept_merged.of(records.id(), || bind("contextual_ao_merged", &base.merged_layout, &entries))
    });
    let Some(clip) = &clip_maps.textures else {
        return;
    };
    for volume in &scene.volumes {
        let bound = (|| {
            let resources = store.0.get(&volume.entity)?;
            let [views, runs, outlines] = runs.of(volume.entity)?.buffers()?;
            let (orientations, occlusion) = (resources.orientations(), &resources.occlusion.view);
            let buffers = [views, runs, outlines, resources.uniform.buffer()?].map(|buffer| buffer.id());
            let table = &resources.lookup_table.texture.view;
            let textures = [&clip.depth.view, table, orientations, occlusion].map(|view| view.id());
            let group = kept.of(volume.entity).of((buffers, textures), || {
                let bindings = drawn_bindings(resources, clip, &formats)?;
                let shared = bindings.iter().map(|(binding, resource)| (*binding, resource.get_binding()));
                let own = [
                    (ORIENTATIONS, BindingResource::TextureView(orientations)),
                    (OCCLUSION, BindingResource::TextureView(occlusion)),
                    (RUNS_BINDING, runs.as_entire_binding()),
                    (VIEW_BINDING, ViewArray::<MarchedViewUniform>::binding(views, 1)),
                ];
                let mut entries: Vec<_> = shared
                    .chain(own)
                    .map(|(binding, resource)| BindGroupEntry { binding, resource })
                    .collect();
                let lists = |binding| BindGroupEntry { binding, resource: outlines.as_entire_binding() };
                let [shaded_layout, outline_layout] = &base.of_outlines;
                let shaded = bind("contextual_ao_shaded_volume", shaded_layout, &entries);
                entries.push(lists(OUTLINES));
                Some(DrawnGroups {
                    drawn: bind("contextual_ao_drawn_volume", &base.layout, &entries),
                    shaded,
                    outlines: bind("contextual_ao_outline_lists", outline_layout, &[lists(0)]),
                })
            })?;
            Some((volume.drawn_on?, (volume.entity, group)))
        })();
        by_box.extend(bound);
    }
}

/// Goes on drawing an item if the view has opaque meshes.
pub(super) struct SkipWithoutMeshes;

impl<P: PhaseItem> RenderCommand<P> for SkipWithoutMeshes {
    type Param = (
        SRes<ViewBinnedRenderPhases<Opaque3dPrepass>>,
        SRes<ViewBinnedRenderPhases<AlphaMask3dPrepass>>,
        SRes<ViewBinnedRenderPhases<Opaque3dDeferred>>,
        SRes<ViewBinnedRenderPhases<AlphaMask3dDeferred>>,
    );
    type ViewQuery = &'static ExtractedView;
    type ItemQuery = ();

    fn render<'w>(
        _: &P,
        view: ROQueryItem<'w, '_, Self::ViewQuery>,
        _: Option<()>,
        (opaque, masked, deferred, masked_deferred): SystemParamItem<'w, '_, Self::Param>,
        _: &mut TrackedRenderPass<'w>,
    ) -> RenderCommandResult {
        let view = &view.retained_view_entity;
        let has_meshes = opaque.get(view).is_some_and(|phase| !phase.is_empty())
            || masked.get(view).is_some_and(|phase| !phase.is_empty())
            || deferred.get(view).is_some_and(|phase| !phase.is_empty())
            || masked_deferred.get(view).is_some_and(|phase| !phase.is_empty());
        if has_meshes { RenderCommandResult::Success } else { RenderCommandResult::Skip }
    }
}

/// Rays that a box is drawn for: those of pixels; those of pixels without room for runs, if there are any, as `march` says
/// in the draw's arguments.
const ALL_RAYS: u8 = 0;
const CUT_OFF_RAYS: u8 = 1;

/// Draws the box of a volume, bound in a view.
pub(super) struct DrawBox<const RAYS: u8>;

impl<P: PhaseItem, const RAYS: u8> RenderCommand<P> for DrawBox<RAYS> {
    type Param = (SRes<DrawnVolumes>, SRes<VolumeRuns>);
    type ViewQuery = Entity;
    type ItemQuery = ();

    fn render<'w>(
        item: &P,
        view: ROQueryItem<'w, '_, Entity>,
        _: Option<()>,
        (drawn, runs): SystemParamItem<'w, '_, Self::Param>,
        pass: &mut TrackedRenderPass<'w>,
    ) -> RenderCommandResult {
        let drawn = drawn.into_inner();
        let found = drawn.by_box.get(&item.main_entity());
        let runs = found.and_then(|(volume, groups)| Some((groups, runs.into_inner().of(*volume)?)));
        let Some((groups, runs)) = runs else {
            return RenderCommandResult::Skip;
        };
        let Some(offset) = runs.offset_of(view) else {
            return RenderCommandResult::Skip;
        };
        pass.set_bind_group(VOLUME_BIND_GROUP, &groups.drawn, &[offset]);
        if let Some(merged) = &drawn.merged {
            pass.set_bind_group(MERGED_BIND_GROUP, merged, &[offset_of_record(item.batch_range().start)]);
        }
        if RAYS != CUT_OFF_RAYS {
            pass.draw(0..BOX_VERTICES, 0..1);
        } else if let Some((arguments, offset)) = runs.cut_off_draw(view) {
            pass.draw_indirect(arguments, offset);
        }
        RenderCommandResult::Success
    }
}
