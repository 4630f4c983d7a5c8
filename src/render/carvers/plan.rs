//! Plan of the carvers' new depth and dilation maps.

use bevy::{
    ecs::system::SystemParam,
    platform::{collections::HashMap, time::Instant},
    prelude::*,
    render::{
        mesh::{RenderMesh, allocator::MeshAllocator},
        render_asset::RenderAssets,
        render_resource::SpecializedRenderPipelines,
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::{
    clip_draw::{ClipDrawPipeline, ClipMeshDraw, MeshSource},
    clip_keys::{DepthKey, DilationKey},
    clip_maps::{ClipMaps, ReadyCarver, Slot},
    clip_textures::ClipTextures,
    count_surfaces::CountJob,
    dilate::DilateJob,
    passes::CarverPasses,
    peel::PeelJob,
    surface_count::layers_of,
};
use crate::{
    clip::{ClipMeshCutOff, MAX_LAYERS},
    render::{
        extract::{ExtractedCarver, ExtractedScene, ExtractedVolume, Influence},
        windows::VolumeWindows,
    },
};

/// The passes of this frame over carvers, in the order in which they are encoded.
#[derive(Resource, Default)]
pub(crate) struct CarverPlan {
    pub counts: Vec<CountJob>,
    pub depth_maps: Vec<PeelJob>,
    pub dilations: Vec<DilateJob>,
    /// Carvers whose maps are ready, or will be after this frame's passes.
    pub ready: HashMap<Entity, ReadyCarver>,
    /// Whether some carver waits for its mesh, its surface count, its layers or a pipeline.
    pub waits: bool,
    /// Number of layers that all carvers are to get together.
    pub layers_wanted: u32,
    /// Carvers that get fewer layers than their meshes have.
    pub cut_off: Vec<ClipMeshCutOff>,
    /// When planning began in this frame.
    pub began: Option<Instant>,
    /// Counts remade maps.
    maps_revision: u64,
}

/// Resources for planning.
#[derive(SystemParam)]
pub(crate) struct PlanParts<'w> {
    draw: Res<'w, ClipDrawPipeline>,
    specialized: ResMut<'w, SpecializedRenderPipelines<ClipDrawPipeline>>,
    passes: CarverPasses<'w>,
    meshes: Res<'w, RenderAssets<RenderMesh>>,
    allocator: Res<'w, MeshAllocator>,
    device: Res<'w, RenderDevice>,
    queue: Res<'w, RenderQueue>,
}

/// Plans steps II and III. A carver whose mesh or pipelines are not ready waits a frame. While a new mesh is not ready,
/// the old mesh carves on.
pub(crate) fn plan_carvers(
    scene: Res<ExtractedScene>,
    windows: Res<VolumeWindows>,
    mut parts: PlanParts,
    mut clip_maps: ResMut<ClipMaps>,
    mut plan: ResMut<CarverPlan>,
) {
    plan.began = Some(Instant::now());
    plan.counts.clear();
    plan.depth_maps.clear();
    plan.dilations.clear();
    plan.ready.clear();
    plan.waits = false;
    let are_ready = parts.passes.are_ready();
    if clip_maps.textures.is_none() || !are_ready {
        plan.waits = !scene.carvers.is_empty();
        return;
    }
    count_surfaces(&scene, &windows, &mut parts, &mut clip_maps, &mut plan);
    let wanted = layers_wanted(&scene, &clip_maps, &mut plan);
    clip_maps.place(&wanted, &parts.device, &parts.queue);
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
            // The carver carves nothing.
            continue;
        }
        if !is_seen(carver, &scene, &windows) {
            // No view shows a volume that this carver carves. Until then, only its number of layers must be known.
            plan.waits |= slot.count.of(carver.mesh).is_none();
            continue;
        }
        plan.waits |= draw_layers(carver, slot, textures, &mut parts, &mut plan).is_none();
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
                let PlanParts { passes: CarverPasses { dilate, cache, .. }, device, queue, .. } = &parts;
                plan.dilations.extend(dilate.bind_layer(dilation, layer, textures, cache, device, queue));
            }
            slot.dilated = Some(dilation);
            plan.maps_revision += 1;
            slot.revision = plan.maps_revision;
        }
        let ready = ReadyCarver { layers, frame: drawn.frame, dilation, revision: slot.revision };
        plan.ready.insert(carver.entity, ready);
    }
}

/// Plans to count the surfaces of meshes that are new or have changed.
fn count_surfaces(
    scene: &ExtractedScene,
    windows: &VolumeWindows,
    parts: &mut PlanParts,
    clip_maps: &mut ClipMaps,
    plan: &mut CarverPlan,
) {
    let ClipMaps { textures: Some(textures), slots } = clip_maps else {
        return;
    };
    for carver in &scene.carvers {
        let Some(slot) = slots.get_mut(&carver.entity) else {
            continue;
        };
        slot.count.receive(&parts.device);
        let key = DepthKey::of(carver, textures.depth_map_size);
        // A mesh that deforms unseen keeps its last count.
        let is_needed = slot.count.of(carver.mesh).is_none() || is_seen(carver, scene, windows);
        if is_needed
            && slot.count.is_wanted(&key)
            && let Some(draw) = parts.prepare(carver)
        {
            let PlanParts { passes: CarverPasses { count, cache, .. }, device, .. } = &*parts;
            plan.counts.extend(count.begin(draw, key, &mut slot.count, textures, cache, device));
        }
    }
}

/// Number of layers for each carver whose surfaces are counted. All together get at most as many as the arrays can
/// have. If that is not enough, the carvers that were spawned first get theirs.
fn layers_wanted(scene: &ExtractedScene, clip_maps: &ClipMaps, plan: &mut CarverPlan) -> Vec<(Entity, u32)> {
    let most = scene.clip_settings.max_layers.clamp(1, MAX_LAYERS);
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
        // While the surfaces of a new mesh are being counted, the maps of the old mesh stay.
        let current = Some(slot.layers.count).filter(|count| *count > 0);
        let has_layers = slot.count.of(mesh).map(layers_of).or(current)?;
        // One layer is left for each later carver, as long as there are enough.
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

/// Plans to draw a carver's layers if its maps have other inputs. `None` if the draw has to wait.
fn draw_layers(
    carver: &ExtractedCarver,
    slot: &mut Slot,
    textures: &mut ClipTextures,
    parts: &mut PlanParts,
    plan: &mut CarverPlan,
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
    let draw = parts.prepare(carver)?;
    let PlanParts { draw: clip_draw, passes: CarverPasses { peel, cache, .. }, device, queue, .. } = parts;
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

impl PlanParts<'_> {
    /// Prepares to draw a carver's mesh. `None` until the mesh is ready.
    fn prepare(&mut self, carver: &ExtractedCarver) -> Option<ClipMeshDraw> {
        let source =
            MeshSource { cache: &self.passes.cache, meshes: &self.meshes, allocator: &self.allocator };
        let camera = Mat4::from(carver.frame.clip_from_local());
        let Self { draw, specialized, device, queue, .. } = self;
        draw.prepare(carver.mesh, camera, &source, specialized, device, queue)
    }
}

/// Whether any view shows a volume that a carver carves.
fn is_seen(carver: &ExtractedCarver, scene: &ExtractedScene, windows: &VolumeWindows) -> bool {
    scene.volumes.iter().any(|volume| windows.show(volume) && carver.clip_mesh.carves(volume.entity.id()))
}

/// Largest influence of a carver on the volumes that it carves.
fn influence(carver: &ExtractedCarver, scene: &ExtractedScene) -> Influence {
    let carves = |volume: &&ExtractedVolume| volume.is_placed && carver.clip_mesh.carves(volume.entity.id());
    let carved = scene.volumes.iter().filter(carves);
    carved.map(ExtractedVolume::influence).fold(default(), Influence::max)
}
