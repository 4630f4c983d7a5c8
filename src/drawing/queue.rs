//! What each view draws of volumes, and in which order, among its other transparent objects. Bevy draws these from back to
//! front.

use bevy::{
    core_pipeline::core_3d::{Transparent3d, TransparentSortingInfo3d},
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
    merging::{
        MergedDraws, MergedPipelines, MergingPipelines, Part, Translucents, WorldBox, groups_of, parts_of,
    },
    phase::{DrawCutOffRays, DrawFarSamples, DrawVolume},
    pipeline::{DrawPipeline, DrawVariant},
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
}

/// The transparent objects of a view.
struct Queue<'a> {
    view: &'a ExtractedView,
    phase: &'a mut SortedRenderPhase<Transparent3d>,
    functions: &'a Functions,
    /// Number of the next item.
    number: u32,
}

/// Adds volumes to the transparent objects of the views that show them.
pub(super) fn queue_volumes(
    scene: Res<ExtractedScene>,
    methods: Res<MethodPipelines>,
    functions: Res<DrawFunctions<Transparent3d>>,
    base: Res<DrawPipeline>,
    mut pipelines: ResMut<SpecializedRenderPipelines<DrawPipeline>>,
    mut merging: MergingPipelines,
    cache: Res<PipelineCache>,
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
        let shown: Vec<_> =
            scene.volumes.iter().filter_map(|volume| shown(volume, visible, &methods)).collect();
        let mut queue = Queue { view, phase, functions: &functions, number: u32::MAX };
        let meshes = queue.meshes(&translucents);
        let boxes: Vec<_> = shown.iter().map(|shown| shown.world_box).collect();
        for group in groups_of(&boxes) {
            let mut members: Vec<_> = group.into_iter().map(|index| &shown[index]).collect();
            members.sort_by(|a, b| queue.depth_of(b.center()).total_cmp(&queue.depth_of(a.center())));
            let parts = queue.parts_of(&members, &meshes);
            // Volumes that do not meet yet may do so.
            let mut together = None;
            if shown.len() > 1 || parts.len() > 1 {
                let of = |shown: &&Shown| merging.of(*key, shown.variant, (&base, &mut pipelines), &cache);
                let all: Vec<Option<MergedPipelines>> = members.iter().map(of).collect();
                together = all.into_iter().collect::<Option<Vec<_>>>();
            }
            match together {
                Some(together) if members.len() > 1 || parts.len() > 1 => {
                    let volumes = members.iter().map(|shown| shown.volume.entity).collect();
                    let index = merged.add_group(view_entity, volumes);
                    queue.add_merged(&members, &together, &parts, |member, part| {
                        merged.add_draw(index, member, part)
                    });
                }
                _ => members.iter().for_each(|shown| {
                    let specialize = |variant| pipelines.specialize(&cache, &base, (*key, variant));
                    queue.add_alone(shown, *key, specialize);
                }),
            }
        }
    }
}

/// The volume as a view shows it. Some methods draw volumes themselves.
fn shown<'a>(
    volume: &'a ExtractedVolume,
    visible: &RenderVisibleEntities,
    methods: &MethodPipelines,
) -> Option<Shown<'a>> {
    let by = volume.drawn_on.filter(|drawn_on| volume.is_placed && shows(visible, *drawn_on))?;
    if volume.is_drawn_by_method() && methods.are_there_for(&volume.occlusion.method) {
        return None;
    }
    let texture_from_voxel = volume.geometry.texture_from_voxel();
    let local_from_texture = volume.geometry.local_from_voxel * texture_from_voxel.inverse();
    let world_box = WorldBox(volume.world_from_local * local_from_texture.as_affine3a());
    let variant = DrawVariant::of(&volume.occlusion, &volume.shading, volume.by_gradient);
    Some(Shown { volume, by, world_box, variant })
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
    fn parts_of(&self, members: &[&Shown], meshes: &[(WorldBox, f32)]) -> Vec<Part> {
        let inside = meshes
            .iter()
            .filter(|(of_mesh, _)| members.iter().any(|shown| shown.world_box.may_meet(of_mesh)));
        let planes = inside.map(|(_, depth)| *depth).collect();
        let corners = members.iter().flat_map(|shown| shown.world_box.corners());
        let depths = corners.map(|corner| self.depth_of(corner));
        let (near, far) =
            depths.fold((f32::MAX, f32::MIN), |(near, far), depth| (near.min(depth), far.max(depth)));
        let center = members.iter().map(|shown| shown.center()).sum::<Vec3>() / members.len() as f32;
        parts_of(planes, [near, far], self.depth_of(center))
    }

    fn add(
        &mut self,
        shown: &Shown,
        mesh_center: Vec3,
        pipeline: CachedRenderPipelineId,
        draw_function: DrawFunctionId,
        instances: Range<u32>,
    ) {
        // A phase has one item for each pair of entities. No entity of the render world has such a number.
        self.number -= 1;
        let key = Entity::from_raw_u32(self.number).unwrap_or(Entity::PLACEHOLDER);
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

    /// Draws a volume that shares no space.
    fn add_alone(
        &mut self,
        shown: &Shown,
        view: MeshPipelineKey,
        mut specialize: impl FnMut(DrawVariant) -> CachedRenderPipelineId,
    ) {
        let Functions { volume, cut_off_rays, far_samples } = *self.functions;
        let variant = shown.variant;
        let others = [(variant.of_the_others(), cut_off_rays), (variant.of_far_samples(view), far_samples)];
        self.add(shown, shown.center(), specialize(variant), volume, 0..1);
        for (variant, function) in others {
            if let Some(variant) = variant {
                self.add(shown, shown.center(), specialize(variant), function, 0..1);
            }
        }
    }

    /// Draws volumes that share space, part by part: all of them dim what is behind, then each adds its light.
    fn add_merged(
        &mut self,
        members: &[&Shown],
        pipelines: &[MergedPipelines],
        parts: &[Part],
        mut record: impl FnMut(usize, Part) -> u32,
    ) {
        let Functions { volume, far_samples, .. } = *self.functions;
        for part in parts {
            // A point at the part's depth.
            let place = self.view.world_from_view.translation()
                + part.sorted_depth * self.view.world_from_view.forward();
            let records: Vec<_> = (0..members.len()).map(|member| record(member, *part)).collect();
            let each = || members.iter().zip(pipelines).zip(&records);
            if members.len() > 1 {
                for ((shown, pipelines), record) in each() {
                    self.add(shown, place, pipelines.dims, volume, *record..record + 1);
                }
            }
            for ((shown, pipelines), record) in each() {
                self.add(shown, place, pipelines.draws, volume, *record..record + 1);
                if let Some(far) = pipelines.draws_far {
                    self.add(shown, place, far, far_samples, *record..record + 1);
                }
            }
        }
    }
}
