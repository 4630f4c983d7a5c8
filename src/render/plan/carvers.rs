//! Which carvers need new depth or dilation maps.

use bevy::{
    prelude::*,
    render::{
        mesh::{RenderMesh, allocator::MeshAllocator},
        render_asset::RenderAssets,
        render_resource::{PipelineCache, SpecializedRenderPipelines},
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::{FramePlan, ReadyCarver};
use crate::render::{
    clip_depth::{ClipDepthJob, ClipDepthPipeline},
    clip_maps::{ClipMaps, DepthKey, DilationKey},
    dilate::DilatePipelines,
    extract::{ExtractedCarver, ExtractedScene, ExtractedVolume, Influence},
};

/// Plans steps II and III. A carver whose mesh or pipelines are not there yet waits a frame.
pub(crate) fn plan_carvers(
    scene: Res<ExtractedScene>,
    depth_pipeline: Res<ClipDepthPipeline>,
    mut depth_pipelines: ResMut<SpecializedRenderPipelines<ClipDepthPipeline>>,
    dilate_pipelines: Res<DilatePipelines>,
    cache: Res<PipelineCache>,
    meshes: Res<RenderAssets<RenderMesh>>,
    allocator: Res<MeshAllocator>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    mut clip_maps: ResMut<ClipMaps>,
    mut plan: ResMut<FramePlan>,
) {
    plan.depth_maps.clear();
    plan.dilations.clear();
    plan.carvers.clear();
    plan.carvers_wait = false;
    let ClipMaps { textures: Some(textures), slots } = &mut *clip_maps else {
        return;
    };
    if !dilate_pipelines.is_ready(&cache) {
        plan.carvers_wait = !scene.carvers.is_empty();
        return;
    }
    for carver in &scene.carvers {
        let Some(slot) = slots.get_mut(&carver.entity) else {
            continue;
        };
        let influence = influence(carver, &scene);
        if influence.reach_world <= 0.0 {
            // There is nothing to carve.
            continue;
        }
        let wanted = DepthKey::of(carver);
        let redraw = if slot.drawn == Some(wanted) {
            None
        } else {
            let job = depth_job(
                carver,
                slot.index,
                &depth_pipeline,
                &mut depth_pipelines,
                &cache,
                &meshes,
                &allocator,
                &device,
                &queue,
            );
            plan.carvers_wait |= job.is_none();
            job
        };
        // While a new mesh is not ready, the old one carves on.
        let Some(drawn) = redraw.as_ref().map(|_| wanted).or(slot.drawn) else {
            continue;
        };
        let operation = carver.clip_mesh.operation;
        let linear = carver.world_from_local.matrix3.into();
        let Some(dilation) = DilationKey::new(&drawn.frame, linear, operation, influence, slot.dilated)
        else {
            continue;
        };
        if redraw.is_some() || slot.dilated != Some(dilation) {
            let job = dilate_pipelines.bind(dilation, slot.index, textures, &cache, &device, &queue);
            plan.dilations.extend(job);
            plan.maps_revision += 1;
            slot.revision = plan.maps_revision;
        }
        plan.depth_maps.extend(redraw);
        slot.drawn = Some(drawn);
        slot.dilated = Some(dilation);
        let ready = ReadyCarver { slot: slot.index, frame: drawn.frame, dilation, revision: slot.revision };
        plan.carvers.insert(carver.entity, ready);
    }
}

/// What it takes to render a carver's depth maps; `None` while its mesh or pipelines are not there.
fn depth_job(
    carver: &ExtractedCarver,
    slot: u32,
    pipeline: &ClipDepthPipeline,
    specialized: &mut SpecializedRenderPipelines<ClipDepthPipeline>,
    cache: &PipelineCache,
    meshes: &RenderAssets<RenderMesh>,
    allocator: &MeshAllocator,
    device: &RenderDevice,
    queue: &RenderQueue,
) -> Option<ClipDepthJob> {
    allocator.mesh_vertex_slice(&carver.mesh)?;
    let pipelines = pipeline.queue(meshes.get(carver.mesh)?, specialized, cache)?;
    for pipeline in pipelines {
        cache.get_render_pipeline(pipeline)?;
    }
    let camera = Mat4::from(carver.frame.clip_from_local());
    Some(ClipDepthJob {
        mesh: carver.mesh,
        slot,
        pipelines,
        camera: pipeline.bind(camera, cache, device, queue)?,
    })
}

/// How far a carver acts on any of the volumes that it carves.
fn influence(carver: &ExtractedCarver, scene: &ExtractedScene) -> Influence {
    let carves = |volume: &&ExtractedVolume| volume.is_placed && carver.clip_mesh.carves(volume.entity.id());
    let carved = scene.volumes.iter().filter(carves);
    carved.map(ExtractedVolume::influence).fold(default(), Influence::max)
}
