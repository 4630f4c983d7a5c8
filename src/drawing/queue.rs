//! What each view draws of volumes, and in which order, among its other transparent objects. Bevy draws these from back to
//! front.

use bevy::{
    core_pipeline::core_3d::{Transparent3d, TransparentSortingInfo3d},
    ecs::system::SystemParam,
    pbr::{MeshPipelineKey, ViewKeyCache},
    prelude::*,
    render::{
        render_phase::{
            DrawFunctionId, DrawFunctions, PhaseItemExtraIndex, SortedRenderPhase, ViewSortedRenderPhases,
        },
        render_resource::{CachedRenderPipelineId, PipelineCache, SpecializedRenderPipelines},
        sync_world::MainEntity,
        view::{ExtractedView, RenderVisibleEntities},
    },
};
use core::ops::Range;

use super::{
    depth::DepthPipeline,
    merging::{
        DrawnPart, MergedDraws, MergedPipelines, MergingPipelines, Translucents, WorldBox, groups_of,
        parts_of, whole_behind,
    },
    phase::{DrawCutOffRays, DrawFarSamples, DrawVolume},
    pipeline::{DrawPipeline, DrawVariant, FollowedRays},
};
use crate::render::{ExtractedScene, ExtractedVolume, MethodPipelines, shows};

/// Draw functions of volumes.
struct Functions {
    volume: DrawFunctionId,
    cut_off_rays: DrawFunctionId,
    far_samples: DrawFunctionId,
}

/// A volume that a view shows.
struct Shown<'a> {
    volume: &'a ExtractedVolume,
    /// The entity of its box.
    by: MainEntity,
    world_box: WorldBox,
    variant: DrawVariant,
    /// How its depth is drawn, if it has one.
    depth: Option<CachedRenderPipelineId>,
}

/// The transparent objects of a view.
struct Queue<'a> {
    view: &'a ExtractedView,
    key: MeshPipelineKey,
    phase: &'a mut SortedRenderPhase<Transparent3d>,
    functions: &'a Functions,
    /// Number of the next item.
    number: u32,
}

/// Pipelines that draw volumes.
#[derive(SystemParam)]
pub(super) struct Pipelines<'w> {
    base: Res<'w, DrawPipeline>,
    drawn: ResMut<'w, SpecializedRenderPipelines<DrawPipeline>>,
    depth_base: Res<'w, DepthPipeline>,
    depths: ResMut<'w, SpecializedRenderPipelines<DepthPipeline>>,
    merging: MergingPipelines<'w>,
    cache: Res<'w, PipelineCache>,
}

/// Adds volumes to the transparent objects of the views that show them.
pub(super) fn queue_volumes(
    scene: Res<ExtractedScene>,
    methods: Res<MethodPipelines>,
    functions: Res<DrawFunctions<Transparent3d>>,
    mut pipelines: Pipelines,
    (keys, translucents): (Res<ViewKeyCache>, Res<Translucents>),
    views: Query<(Entity, &ExtractedView, &RenderVisibleEntities)>,
    mut phases: ResMut<ViewSortedRenderPhases<Transparent3d>>,
    mut merged: ResMut<MergedDraws>,
) {
    merged.begin_frame();
    let functions = functions.read();
    let functions = Functions {
        volume: functions.id::<DrawVolume>(),
        cut_off_rays: functions.id::<DrawCutOffRays>(),
        far_samples: functions.id::<DrawFarSamples>(),
    };
    for (view_entity, view, visible) in &views {
        let id = &view.retained_view_entity;
        let (Some(phase), Some(key)) = (phases.get_mut(id), keys.get(id)) else {
            continue;
        };
        if !pipelines.base.has_room_in(*key) {
            warn_once!(
                "a view shows no volumes: with what it has besides, they need more storage buffers than this graphics \
                 device allows"
            );
            continue;
        }
        let mut queue = Queue { view, key: *key, phase, functions: &functions, number: u32::MAX };
        let meshes = queue.meshes(&translucents);
        let shown = scene.volumes.iter().filter_map(|volume| pipelines.shown(volume, visible, *key));
        // Some methods draw volumes themselves.
        let (by_methods, shown): (Vec<_>, Vec<_>) = shown.partition(|shown| {
            shown.volume.is_drawn_by_method() && methods.are_there_for(&shown.volume.occlusion.method)
        });
        by_methods.iter().for_each(|shown| queue.add_depth(shown, queue.depth_of(shown.center())));
        let boxes: Vec<_> = shown.iter().map(|shown| shown.world_box).collect();
        for group in groups_of(&boxes) {
            let mut members: Vec<_> = group.into_iter().map(|index| &shown[index]).collect();
            members.sort_by(|a, b| queue.depth_of(b.center()).total_cmp(&queue.depth_of(a.center())));
            let parts = queue.parts_of(&members, &meshes);
            let are_apart = members.len() == 1 && parts.len() == 1;
            // Volumes that do not meet yet may do so.
            let may_meet = !are_apart || shown.len() > 1;
            let together = if may_meet { pipelines.together(&members, *key) } else { None };
            match together.filter(|_| !are_apart) {
                Some(together) => {
                    let volumes = members.iter().map(|shown| shown.volume.entity).collect();
                    let group = merged.add_group(view_entity, volumes);
                    let record = |member, part| merged.add_draw(group, member, part);
                    queue.add_merged(&members, &together, &parts, record);
                }
                None if are_apart => queue.add_alone(members[0], parts[0].sorted_depth, &mut pipelines),
                None => members.iter().for_each(|shown| {
                    queue.add_alone(shown, queue.depth_of(shown.center()), &mut pipelines);
                }),
            }
        }
    }
}

impl Pipelines<'_> {
    /// The volume as a view shows it.
    fn shown<'a>(
        &mut self,
        volume: &'a ExtractedVolume,
        visible: &RenderVisibleEntities,
        view: MeshPipelineKey,
    ) -> Option<Shown<'a>> {
        let by = volume.drawn_on.filter(|drawn_on| volume.is_placed && shows(visible, *drawn_on))?;
        let texture_from_voxel = volume.geometry.texture_from_voxel();
        let local_from_texture = volume.geometry.local_from_voxel * texture_from_voxel.inverse();
        let depth = volume
            .depth_opacity
            .map(|_| self.depths.specialize(&self.cache, &self.depth_base, (view, FollowedRays::of(volume))));
        Some(Shown {
            volume,
            by,
            world_box: WorldBox(volume.world_from_local * local_from_texture.as_affine3a()),
            variant: DrawVariant::of(&volume.occlusion, &volume.shading, volume.by_gradient),
            depth,
        })
    }

    fn of(&mut self, view: MeshPipelineKey, variant: DrawVariant) -> CachedRenderPipelineId {
        self.drawn.specialize(&self.cache, &self.base, (view, variant))
    }

    /// Pipelines of volumes that share space. `None` until all are compiled, and where Bevy sorts fragments: their lists hold
    /// no part of a volume that others hide.
    fn together(&mut self, members: &[&Shown], view: MeshPipelineKey) -> Option<Vec<MergedPipelines>> {
        if view.contains(MeshPipelineKey::OIT_ENABLED) {
            return None;
        }
        let Self { base, drawn, merging, cache, .. } = self;
        let of = |shown: &&Shown| merging.of(view, shown.variant, (base, drawn), cache);
        let all: Vec<Option<MergedPipelines>> = members.iter().map(of).collect();
        all.into_iter().collect()
    }
}

impl Shown<'_> {
    fn center(&self) -> Vec3 {
        self.volume.world_from_local.translation.into()
    }
}

impl Queue<'_> {
    /// Distance of a point from the plane through the camera, world units.
    fn depth_of(&self, point: Vec3) -> f32 {
        -self.view.rangefinder3d().distance(&point)
    }

    /// Translucent meshes of the view: their boxes, and the depths by which they are sorted.
    fn meshes(&self, translucents: &Translucents) -> Vec<(WorldBox, f32)> {
        let rangefinder = self.view.rangefinder3d();
        let items = self.phase.items.iter();
        items
            .filter_map(|((_, mesh), item)| {
                let depth = -item.sorting_info.sort_distance(&rangefinder);
                Some((*translucents.box_of(*mesh)?, depth))
            })
            .collect()
    }

    /// Parts of a group of volumes between the meshes in it.
    fn parts_of(&self, members: &[&Shown], meshes: &[(WorldBox, f32)]) -> Vec<DrawnPart> {
        let inside = meshes
            .iter()
            .filter(|(of_mesh, _)| members.iter().any(|shown| shown.world_box.may_meet(of_mesh)));
        let planes: Vec<_> = inside.map(|(_, depth)| *depth).collect();
        let corners = members.iter().flat_map(|shown| shown.world_box.corners());
        let depths = corners.map(|corner| self.depth_of(corner));
        let (near, far) =
            depths.fold((f32::MAX, f32::MIN), |(near, far), depth| (near.min(depth), far.max(depth)));
        let center = members.iter().map(|shown| shown.center()).sum::<Vec3>() / members.len() as f32;
        let whole_depth = self.depth_of(center);
        if members.iter().any(|shown| shown.depth.is_some()) {
            return vec![whole_behind(&planes, far, whole_depth)];
        }
        parts_of(planes, [near, far], whole_depth)
    }

    /// Adds an item, sorted by a depth.
    fn add(
        &mut self,
        shown: &Shown,
        depth: f32,
        pipeline: CachedRenderPipelineId,
        draw_function: DrawFunctionId,
        instances: Range<u32>,
    ) {
        // A phase has one item for each pair of entities. No entity of the render world has such a number.
        self.number -= 1;
        let key = Entity::from_raw_u32(self.number).unwrap_or(Entity::PLACEHOLDER);
        let view = self.view.world_from_view;
        let mesh_center = view.translation() + depth * view.forward();
        self.phase.add_transient(Transparent3d {
            sorting_info: TransparentSortingInfo3d::Sorted { mesh_center, depth_bias: 0.0 },
            distance: 0.0,
            pipeline,
            entity: (key, shown.by),
            draw_function,
            batch_range: instances,
            extra_index: PhaseItemExtraIndex::None,
            indexed: false,
        });
    }

    /// Draws all rays of a volume: those with room for their runs, the others, and those of far samples.
    fn add_rays(
        &mut self,
        shown: &Shown,
        depth: f32,
        pipelines: [Option<CachedRenderPipelineId>; 3],
        instances: Range<u32>,
    ) {
        let Functions { volume, cut_off_rays, far_samples } = *self.functions;
        for (pipeline, function) in pipelines.into_iter().zip([volume, cut_off_rays, far_samples]) {
            if let Some(pipeline) = pipeline {
                self.add(shown, depth, pipeline, function, instances.clone());
            }
        }
    }

    /// Draws a volume that shares no space, sorted by a depth.
    fn add_alone(&mut self, shown: &Shown, depth: f32, pipelines: &mut Pipelines) {
        let variant = shown.variant;
        let variants = [Some(variant), variant.of_the_others(), variant.of_far_samples(self.key)];
        let of_rays = variants.map(|variant| Some(pipelines.of(self.key, variant?)));
        self.add_rays(shown, depth, of_rays, 0..1);
        self.add_depth(shown, depth);
    }

    /// Draws the depth of a volume that has one, behind its colours.
    fn add_depth(&mut self, shown: &Shown, depth: f32) {
        if let Some(pipeline) = shown.depth {
            self.add(shown, depth, pipeline, self.functions.volume, 0..1);
        }
    }

    /// Draws volumes that share space, part by part: all of them dim what is behind, then each adds its light.
    fn add_merged(
        &mut self,
        members: &[&Shown],
        pipelines: &[MergedPipelines],
        parts: &[DrawnPart],
        mut record: impl FnMut(usize, DrawnPart) -> u32,
    ) {
        let dim = self.functions.volume;
        for part in parts {
            let depth = part.sorted_depth;
            let records: Vec<_> = (0..members.len()).map(|member| record(member, *part)).collect();
            let each = || members.iter().zip(pipelines).zip(&records);
            if members.len() > 1 {
                for ((shown, pipelines), record) in each() {
                    self.add(shown, depth, pipelines.dims, dim, *record..record + 1);
                }
            }
            for ((shown, pipelines), record) in each() {
                let of_rays = [Some(pipelines.draws), pipelines.draws_cut_off, pipelines.draws_far];
                self.add_rays(shown, depth, of_rays, *record..record + 1);
            }
        }
        if let Some(nearest) = parts.last() {
            members.iter().for_each(|shown| self.add_depth(shown, nearest.sorted_depth));
        }
    }
}
