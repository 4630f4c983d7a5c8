//! Decides which passes this frame needs for every volume, before any is encoded. A frame without changes needs none.

use bevy::prelude::*;

use super::{
    carvers::{clip_maps::ClipMaps, clip_textures::ClipTextures, plan::CarverPlan},
    clipping::{
        job::{ClipJob, KeptClipGroups},
        passes::ClippingPasses,
    },
    extract::{ExtractedScene, ExtractedVolume},
    gpu::{device::Gpu, uniforms::write_if_changed},
    methods::{
        pipelines::MethodPipelines,
        registry::VoxelMethods,
        voxel_method::{KeptVolume, VolumeFrame},
    },
    views::{
        march::{MarchJob, MarchPass},
        runs::{Stale, VolumeRuns},
    },
    volumes::{
        bricks::MASK_WORDS,
        carver_uniform::{CarverTable, CarverUniform},
        contents::{Contents, MarchVariant},
        store::{VolumeGroups, VolumeResources, VolumeStore},
        uniform::VolumeUniform,
    },
    windows::VolumeWindows,
};
use crate::diagnostics::ReportChannel;

/// Passes over volumes in this frame, but for those of step V: the methods hold these.
#[derive(Resource, Default)]
pub(crate) struct VolumePlan {
    pub clips: Vec<ClipJob>,
    pub marches: Vec<MarchJob>,
    /// Whether passes over everything take long, and are submitted apart.
    pub takes_long: bool,
}

/// Writes the inputs of the shaders and plans the passes over volumes.
pub(crate) fn plan_volumes(
    scene: Res<ExtractedScene>,
    windows: Res<VolumeWindows>,
    carver_plan: Res<CarverPlan>,
    clip_maps: Res<ClipMaps>,
    (clipping, march): (ClippingPasses, Res<MarchPass>),
    pipelines: Res<MethodPipelines>,
    gpu: Gpu,
    report: Res<ReportChannel>,
    mut methods: ResMut<VoxelMethods>,
    (mut store, mut runs, mut clip_groups): (ResMut<VolumeStore>, ResMut<VolumeRuns>, ResMut<KeptClipGroups>),
    mut plan: ResMut<VolumePlan>,
) {
    plan.clips.clear();
    plan.marches.clear();
    plan.takes_long = false;
    runs.begin_frame();
    clip_groups.begin_frame();
    let Some(clip) = &clip_maps.textures else {
        return;
    };
    let mut planning = Planning {
        scene: &scene,
        windows: &windows,
        clipping: &clipping,
        march: &march,
        runs: &mut runs,
        clip_groups: &mut clip_groups,
        gpu: &gpu,
    };
    let mut ready = Vec::new();
    for volume in scene.volumes.iter().filter(|volume| volume.is_placed) {
        let Some(resources) = store.0.get_mut(&volume.entity) else {
            continue;
        };
        let are_ready = pipelines.are_there_for(&volume.occlusion.method);
        // Changes made while no view shows the volume are found by comparison when it is seen again.
        if windows.show(volume) {
            let carvers = carvers_of(volume, &scene, &carver_plan);
            planning.show(volume, resources, (carvers, clip), are_ready, &mut methods, &mut plan);
        }
        // No result is final until all carvers carve.
        let is_there = are_ready && volume.has_occlusion && !volume.awaits_pipelines && !carver_plan.waits;
        let is_final = is_there && resources.kept.as_ref().is_none_or(|kept| kept.is_complete());
        ready.push((volume.entity.id(), is_final));
    }
    if let Ok(mut report) = report.0.lock() {
        report.ready = ready;
        report.layers_wanted = carver_plan.layers_wanted;
        report.cut_off.clone_from(&carver_plan.cut_off);
        let carves = plan.clips.iter().filter_map(|job| job.carve.as_ref());
        let tested = carves.flat_map(|carve| carve.superbricks).map(|tested| u64::from(tested.count())).sum();
        if tested > 0 {
            report.superbricks_tested = tested;
        }
        report.plan_time = carver_plan.began.map_or_else(default, |began| began.elapsed());
        report.usage = store.usage() + clip_maps.usage() + runs.usage();
    }
}

/// Uniforms of the carvers that act on a volume, each with the revision of its maps.
fn carvers_of(
    volume: &ExtractedVolume,
    scene: &ExtractedScene,
    plan: &CarverPlan,
) -> Vec<(CarverUniform, u64)> {
    let carving = volume.carvers.iter().filter_map(|&(index, pose)| {
        let carver = &scene.carvers[index];
        let ready = plan.ready.get(&carver.entity)?;
        Some((CarverUniform::new(carver, ready, volume, pose), ready.revision))
    });
    carving.collect()
}

/// Writes the data of a volume that all shaders read. Returns whether the volume is drawn differently than before.
fn write_volume(
    volume: &ExtractedVolume,
    resources: &mut VolumeResources,
    carvers: &[(CarverUniform, u64)],
    has_occlusion: bool,
    clip: &ClipTextures,
    scene: &ExtractedScene,
    gpu: &Gpu,
) -> bool {
    let table: CarverTable = carvers.iter().map(|(carver, _)| *carver).collect();
    let sizes = [clip.depth_map_size, clip.dilation_map_size()];
    let largest = resources.gpu_volume.largest_stored;
    let drawn = resources.kept.as_ref().and_then(|kept| kept.drawn_intensities());
    let uniform =
        VolumeUniform::new(volume, largest, has_occlusion, drawn, sizes, carvers.len(), &scene.optimizations);
    resources.upload(volume, uniform.step_lengths(), &gpu.queue);
    let variant = Some(MarchVariant::of(volume));
    let is_filtered_anew = core::mem::replace(&mut resources.state.marched, variant) != variant;
    write_if_changed(&mut resources.carvers, table, &gpu.device, &gpu.queue);
    write_if_changed(&mut resources.uniform, uniform, &gpu.device, &gpu.queue) || is_filtered_anew
}

/// Inputs for planning the passes over one volume.
struct Planning<'a, 'w> {
    scene: &'a ExtractedScene,
    windows: &'a VolumeWindows,
    clipping: &'a ClippingPasses<'w>,
    march: &'a MarchPass,
    runs: &'a mut VolumeRuns,
    clip_groups: &'a mut KeptClipGroups,
    gpu: &'a Gpu<'w>,
}

impl Planning<'_, '_> {
    /// Plans the passes over a volume that a view shows.
    fn show(
        &mut self,
        volume: &ExtractedVolume,
        resources: &mut VolumeResources,
        (carvers, clip): (Vec<(CarverUniform, u64)>, &ClipTextures),
        are_ready: bool,
        methods: &mut VoxelMethods,
        plan: &mut VolumePlan,
    ) {
        let (scene, gpu) = (self.scene, self.gpu);
        let looks_different = write_volume(volume, resources, &carvers, are_ready, clip, scene, gpu);
        let Some(groups) = resources.keep_groups(clip, &gpu.formats, &gpu.cache, &gpu.device) else {
            return;
        };
        if are_ready {
            let contents = Contents::of(volume, carvers, scene.clip_settings.coverage);
            self.plan(volume, resources, &groups, (contents, looks_different), methods, plan);
        } else {
            // It is drawn meanwhile, without occlusion.
            resources.state.revision = resources.state.revision.wrapping_add(1);
            plan.marches.extend(self.march(volume, &groups, &Stale::Everything));
        }
    }

    fn plan(
        &mut self,
        volume: &ExtractedVolume,
        resources: &mut VolumeResources,
        groups: &VolumeGroups,
        (contents, looks_different): (Contents, bool),
        methods: &mut VoxelMethods,
        plan: &mut VolumePlan,
    ) {
        let Gpu { device, queue, .. } = self.gpu;
        let optimizations = &self.scene.optimizations;
        let mut method = methods.of_mut(&volume.occlusion.method);
        let kept_volume = KeptVolume { volume, resources };
        let demand =
            method.as_ref().map_or_else(default, |method| method.demand(&kept_volume, optimizations));
        let step = resources.clip_step(volume, contents, demand, optimizations);
        let (of, gpu) = ((volume.entity, &mut *resources), (&**device, &**queue));
        plan.clips.extend(self.clipping.bind(&step, of, groups, self.clip_groups, gpu));
        let words = u64::from(resources.bricks.bricks) * u64::from(MASK_WORDS);
        plan.takes_long |= step.is_all_stale && words > u64::from(self.scene.cast_budget.words_per_dispatch);
        let stale = if looks_different {
            Stale::Everything
        } else {
            Stale::by(&step, volume.footprint_mm(), &volume.geometry, optimizations)
        };
        if !matches!(stale, Stale::Nothing) {
            resources.state.revision = resources.state.revision.wrapping_add(1);
        }
        if volume.is_drawn_by_method() {
            // Depths and motion vectors follow its rays themselves.
            self.runs.of_mut(volume.entity).plan_without(self.windows.onto(volume.entity), self.gpu);
        } else {
            plan.marches.extend(self.march(volume, groups, &stale));
        }
        let mut kept = resources.kept.take();
        if let (Some(method), Some(kept)) = (&mut method, &mut kept) {
            let frame = VolumeFrame {
                of: KeptVolume { volume, resources },
                groups,
                step: &step,
                windows: self.windows.onto(volume.entity),
                runs: self.runs.of_mut(volume.entity),
                looks_different,
                optimizations,
                cast_budget: self.scene.cast_budget,
                cast_pacing: self.scene.cast_pacing,
                frame_ms: self.scene.frame_ms,
            };
            method.plan(&mut **kept, &frame, self.gpu);
        }
        resources.kept = kept;
    }

    /// Plans the march of a volume's views.
    fn march(&mut self, volume: &ExtractedVolume, groups: &VolumeGroups, stale: &Stale) -> Option<MarchJob> {
        let windows = self.windows.onto(volume.entity);
        let runs = self.runs.of_mut(volume.entity);
        if volume.draws_surface() {
            runs.plan_without(windows, self.gpu);
            return None;
        }
        self.march.plan(MarchVariant::of(volume), windows, runs, stale, groups, self.gpu)
    }
}
