//! Which carvers need new depth or dilation maps.

use bevy::{
    ecs::system::SystemParam,
    prelude::*,
    render::{
        mesh::{RenderMesh, allocator::MeshAllocator},
        render_asset::RenderAssets,
        render_resource::SpecializedRenderPipelines,
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::FramePlan;
use crate::{
    clip::{ClipMeshCutOff, MAX_LAYERS},
    render::{
        carvers::{
            clip_draw::{ClipDrawPipeline, ClipMeshDraw, MeshSource},
            clip_keys::{DepthKey, DilationKey},
            clip_maps::{ClipMaps, ReadyCarver, Slot},
            clip_textures::ClipTextures,
            surface_count::layers_of,
        },
        extract::{ExtractedCarver, ExtractedScene, ExtractedVolume, Influence},
        passes::Passes,
    },
};

/// What planning the passes over carvers takes.
#[derive(SystemParam)]
pub(crate) struct CarverPasses<'w> {
    draw: Res<'w, ClipDrawPipeline>,
    specialized: ResMut<'w, SpecializedRenderPipelines<ClipDrawPipeline>>,
    passes: Passes<'w>,
    meshes: Res<'w, RenderAssets<RenderMesh>>,
    allocator: Res<'w, MeshAllocator>,
    device: Res<'w, RenderDevice>,
    queue: Res<'w, RenderQueue>,
}

/// Plans steps II and III. A carver whose mesh or pipelines are not there yet waits a frame; while
/// a new mesh is not ready, the old one carves on.
pub(crate) fn plan_carvers(
    scene: Res<ExtractedScene>,
    mut carver_passes: CarverPasses,
    mut clip_maps: ResMut<ClipMaps>,
    mut plan: ResMut<FramePlan>,
) {
    plan.counts.clear();
    plan.depth_maps.clear();
    plan.dilations.clear();
    plan.carvers.clear();
    plan.carvers_wait = false;
    let are_ready = carver_passes.passes.over_carvers_are_ready();
    if clip_maps.textures.is_none() || !are_ready {
        plan.carvers_wait = !scene.carvers.is_empty();
        return;
    }
    count_surfaces(&scene, &mut carver_passes, &mut clip_maps, &mut plan);
    let wanted = layers_wanted(&scene, &clip_maps, &mut plan);
    clip_maps.place(&wanted, &carver_passes.device, &carver_passes.queue);
    let ClipMaps { textures: Some(textures), slots } = &mut *clip_maps else {
        return;
    };
    for carver in &scene.carvers {
        let Some(slot) = slots.get_mut(&carver.entity) else {
            continue;
        };
        let influence = influence(carver, &scene);
        let has_room = plan.cut_off.iter().all(|cut| cut.entity != carver.entity || cut.gets_layers > 0);
        if influence.reach_world <= 0.0 || !carver.is_placed || !has_room {
            // It carves nothing.
            continue;
        }
        if !is_seen(carver, &scene, &plan) {
            // Nobody sees it; until then it is only known what its maps will take.
            plan.carvers_wait |= slot.count.of(carver.mesh).is_none();
            continue;
        }
        plan.carvers_wait |= draw_layers(carver, slot, textures, &mut carver_passes, &mut plan).is_none();
        let (Some((drawn, _)), layers) = (slot.drawn, slot.layers) else {
            continue;
        };
        let operation = carver.clip_mesh.operation;
        let linear = carver.world_from_local.matrix3.into();
        let Some(dilation) = DilationKey::new(&drawn.frame, linear, operation, influence, slot.dilated)
        else {
            continue;
        };
        if slot.dilated != Some(dilation) {
            for layer in layers.first..layers.first + layers.count {
                let CarverPasses { passes: Passes { dilate, cache, .. }, device, queue, .. } = &carver_passes;
                plan.dilations.extend(dilate.bind_layer(dilation, layer, textures, cache, device, queue));
            }
            slot.dilated = Some(dilation);
            plan.maps_revision += 1;
            slot.revision = plan.maps_revision;
        }
        let ready = ReadyCarver { layers, frame: drawn.frame, dilation, revision: slot.revision };
        plan.carvers.insert(carver.entity, ready);
    }
}

/// Plans to count the surfaces of meshes that are new or have changed.
fn count_surfaces(
    scene: &ExtractedScene,
    carver_passes: &mut CarverPasses,
    clip_maps: &mut ClipMaps,
    plan: &mut FramePlan,
) {
    let ClipMaps { textures: Some(textures), slots } = clip_maps else {
        return;
    };
    for carver in &scene.carvers {
        let Some(slot) = slots.get_mut(&carver.entity) else {
            continue;
        };
        slot.count.receive(&carver_passes.device);
        let key = DepthKey::of(carver, textures.depth_map_size);
        // The surfaces of a mesh that deforms unseen are those that it had.
        let is_needed = slot.count.of(carver.mesh).is_none() || is_seen(carver, scene, plan);
        if is_needed
            && slot.count.is_wanted(&key)
            && let Some(draw) = carver_passes.prepare(carver)
        {
            let CarverPasses { passes: Passes { count, cache, .. }, device, .. } = &*carver_passes;
            plan.counts.push(count.begin(draw, key, &mut slot.count, textures, cache, device));
        }
    }
}

/// How many layers each carver is to get whose surfaces are known. All together get no more than
/// the arrays can have; where it is not enough, those that were spawned first get theirs.
fn layers_wanted(scene: &ExtractedScene, clip_maps: &ClipMaps, plan: &mut FramePlan) -> Vec<(Entity, u32)> {
    let most = scene.clip_settings.most_layers.clamp(1, MAX_LAYERS);
    let mut spare = scene.clip_capacity.most;
    let mut others = scene.carvers.len() as u32;
    let beyond_most = scene.beyond_most.iter();
    plan.cut_off.clear();
    plan.cut_off.extend(beyond_most.map(|&(entity, mesh)| ClipMeshCutOff {
        entity,
        mesh,
        has_layers: 1,
        gets_layers: 0,
    }));
    let wanted = scene.carvers.iter().filter_map(|carver| {
        let (entity, mesh) = (carver.entity, carver.mesh);
        let slot = clip_maps.slots.get(&entity)?;
        // While the surfaces of a new mesh are being counted, the maps of the old one stay.
        let current = Some(slot.layers.count).filter(|count| *count > 0);
        let has_layers = slot.count.of(mesh).map(layers_of).or(current)?;
        // One is left for each of those behind it, as long as there are so many.
        others = others.saturating_sub(1);
        let gets_layers = has_layers.min(most).min(spare.saturating_sub(others).max(1)).min(spare);
        spare -= gets_layers;
        if gets_layers < has_layers {
            plan.cut_off.push(ClipMeshCutOff { entity, mesh, has_layers, gets_layers });
        }
        Some((entity, gets_layers))
    });
    let wanted: Vec<_> = wanted.collect();
    plan.layers_wanted = wanted.iter().map(|(_, layers)| layers).sum();
    wanted
}

/// Plans to draw a carver's layers if its maps show anything else. `None` if that has to wait.
fn draw_layers(
    carver: &ExtractedCarver,
    slot: &mut Slot,
    textures: &mut ClipTextures,
    carver_passes: &mut CarverPasses,
    plan: &mut FramePlan,
) -> Option<()> {
    let key = DepthKey::of(carver, textures.depth_map_size);
    let surfaces = slot.count.of(carver.mesh)?;
    let is_cut_off = slot.layers.cuts_off(surfaces);
    if slot.drawn == Some((key, is_cut_off)) {
        return Some(());
    }
    if slot.layers.count == 0 {
        return None;
    }
    let draw = carver_passes.prepare(carver)?;
    let CarverPasses { draw: clip_draw, passes: Passes { peel, cache, .. }, device, queue, .. } =
        carver_passes;
    plan.depth_maps.push(peel.bind_mesh(
        draw,
        slot.layers,
        surfaces,
        clip_draw,
        textures,
        cache,
        device,
        queue,
    )?);
    slot.drawn = Some((key, is_cut_off));
    slot.dilated = None;
    Some(())
}

impl CarverPasses<'_> {
    /// What it takes to draw a carver's mesh; `None` while it is not there.
    fn prepare(&mut self, carver: &ExtractedCarver) -> Option<ClipMeshDraw> {
        let source =
            MeshSource { cache: &self.passes.cache, meshes: &self.meshes, allocator: &self.allocator };
        let camera = Mat4::from(carver.frame.clip_from_local());
        let Self { draw, specialized, device, queue, .. } = self;
        draw.prepare(carver.mesh, camera, &source, specialized, device, queue)
    }
}

/// Whether anybody sees a volume that a carver carves.
fn is_seen(carver: &ExtractedCarver, scene: &ExtractedScene, plan: &FramePlan) -> bool {
    scene.volumes.iter().any(|volume| plan.sees(volume) && carver.clip_mesh.carves(volume.entity.id()))
}

/// How far a carver acts on any of the volumes that it carves.
fn influence(carver: &ExtractedCarver, scene: &ExtractedScene) -> Influence {
    let carves = |volume: &&ExtractedVolume| volume.is_placed && carver.clip_mesh.carves(volume.entity.id());
    let carved = scene.volumes.iter().filter(carves);
    carved.map(ExtractedVolume::influence).fold(default(), Influence::max)
}
