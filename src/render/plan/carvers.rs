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
    extract::{ExtractedCarver, ExtractedScene, Influence},
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
    let ClipMaps {
        textures: Some(textures),
        slots,
    } = &mut *clip_maps
    else {
        return;
    };
    if !dilate_pipelines.is_ready(&cache) {
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
        let depth_key = DepthKey::of(carver);
        let Some(dilation_key) = DilationKey::new(carver, influence, slot.dilated) else {
            continue;
        };
        let redraws = slot.drawn != Some(depth_key);
        if redraws {
            let job = (|| {
                allocator.mesh_vertex_slice(&carver.mesh)?;
                let pipelines =
                    depth_pipeline.queue(meshes.get(carver.mesh)?, &mut depth_pipelines, &cache)?;
                for pipeline in pipelines {
                    cache.get_render_pipeline(pipeline)?;
                }
                let camera = Mat4::from(carver.frame.clip_from_local());
                Some(ClipDepthJob {
                    mesh: carver.mesh,
                    slot: slot.index,
                    pipelines,
                    camera: depth_pipeline.bind(camera, &cache, &device, &queue)?,
                })
            })();
            let Some(job) = job else {
                continue;
            };
            plan.depth_maps.push(job);
            slot.drawn = Some(depth_key);
        }
        if redraws || slot.dilated != Some(dilation_key) {
            let job = dilate_pipelines.bind(dilation_key, slot.index, textures, &cache, &device, &queue);
            plan.dilations.extend(job);
            slot.dilated = Some(dilation_key);
        }
        let ready = ReadyCarver {
            slot: slot.index,
            dilation: dilation_key,
        };
        plan.carvers.insert(carver.entity, ready);
    }
    if !plan.depth_maps.is_empty() || !plan.dilations.is_empty() {
        plan.maps_revision += 1;
    }
}

/// How far a carver acts on any of the volumes that it carves.
fn influence(carver: &ExtractedCarver, scene: &ExtractedScene) -> Influence {
    let carved = scene
        .volumes
        .iter()
        .filter(|volume| carver.clip_mesh.carves(volume.entity.id()));
    carved
        .map(|volume| volume.influence())
        .fold(default(), Influence::max)
}
