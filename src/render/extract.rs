//! Extraction of the scene, as this frame needs it, from the main world to the render world.

use bevy::{
    camera::visibility::RenderLayers,
    light::{NotShadowCaster, NotShadowReceiver},
    math::{Affine3A, DAffine3, DVec3},
    platform::collections::HashSet,
    prelude::*,
    render::{Extract, render_resource::WgpuFeatures, renderer::RenderDevice, sync_world::MainEntity},
};

use crate::{
    clip::{
        ClipCamera, ClipCapacity, ClipFrame, ClipMesh, ClipSettings, MAX_CARVERS, RelativePoses, SpawnOrder,
        placed,
    },
    diagnostics::{CountWork, TimePassesByClock},
    occlusion::{
        AmbientOcclusion, CastBudget, CastPacing, FittedOcclusion, MethodKind, MotionSampling,
        OcclusionTexels, Optimizations, Recompute, ShownOcclusion, VolumeDepth, VolumeShading,
    },
    render::gpu::frame::TimesByClock,
    volume::{LookupTable, VolumeBox, VolumeGeometry, WORLD_UNITS_PER_MM, longest_stretch},
};

/// All volumes and carvers, rebuilt every frame.
#[derive(Resource, Default)]
pub(crate) struct ExtractedScene {
    pub volumes: Vec<ExtractedVolume>,
    pub carvers: Vec<ExtractedCarver>,
    /// Carvers beyond [`MAX_CARVERS`], with their meshes.
    pub beyond_most: Vec<(Entity, AssetId<Mesh>)>,
    pub clip_settings: ClipSettings,
    pub clip_capacity: ClipCapacity,
    pub optimizations: Optimizations,
    pub cast_budget: CastBudget,
    pub cast_pacing: Option<CastPacing>,
    /// Time of the frame before, milliseconds; 0 without a clock.
    pub frame_ms: f32,
    pub count_work: bool,
}

pub(crate) struct ExtractedVolume {
    pub entity: MainEntity,
    /// The entity whose mesh is the volume's box. Views that show the box see the volume.
    pub drawn_on: Option<MainEntity>,
    pub geometry: VolumeGeometry,
    pub table: LookupTable,
    /// Whether the drawn transfer function follows the gradient. A table that does may have to wait for its pipelines.
    pub by_gradient: bool,
    pub occlusion: AmbientOcclusion,
    pub shading: VolumeShading,
    /// Whether all occlusion is recomputed in every frame. `occlusion` does not hold this setting.
    pub recomputes_all: bool,
    /// Whether any occlusion can be computed for the volume.
    pub has_occlusion: bool,
    /// Whether different occlusion is wanted, whose pipelines are being compiled.
    pub awaits_pipelines: bool,
    /// Volume space (mm) to the world.
    pub world_from_local: Affine3A,
    /// Carvers that act on the volume, as indices into the scene's carvers. Each has the transform from volume space
    /// (mm) to the carver's space.
    pub carvers: Vec<(usize, DAffine3)>,
    /// Whether the volume's transform is invertible. A collapsed volume keeps its resources, and waits.
    pub is_placed: bool,
    /// The volume casts shadows of lights that are on one of these layers.
    pub layers: RenderLayers,
    pub casts_shadows: bool,
    pub receives_shadows: bool,
    /// Opacity up to the point whose depth is written, if any is.
    pub depth_opacity: Option<f32>,
}

/// Distances at which a carver acts on voxels, as radii of balls in the world.
#[derive(Clone, Copy, Default)]
pub(crate) struct Influence {
    /// Contains the occlusion reach around a voxel.
    pub reach_world: f32,
    /// Contains all points that read a voxel.
    pub footprint_world: f32,
}

impl Influence {
    pub fn max(self, other: Self) -> Self {
        Self {
            reach_world: self.reach_world.max(other.reach_world),
            footprint_world: self.footprint_world.max(other.footprint_world),
        }
    }
}

/// Farthest way of a look-up, voxels. An edge half as wide as a scanner's asks for no more.
const FARTHEST_SHIFT_VOXELS: f32 = 0.125;

impl ExtractedVolume {
    /// Rays of a pixel at an outline; 0 if all pixels have one.
    pub fn outline_rays(&self) -> u32 {
        let are_apart = !self.draws_surface() && !self.is_drawn_by_method();
        if are_apart { self.shading.drawn_outline_rays() } else { 0 }
    }

    /// Whether the occlusion method draws the volume, in place of slices along view rays.
    pub fn is_drawn_by_method(&self) -> bool {
        self.occlusion.method.kind() == MethodKind::DrawingViews && self.shading.ambient_occlusion
    }

    /// Whether only an isosurface is drawn.
    pub fn draws_surface(&self) -> bool {
        self.occlusion.method.settings().drawing().draws_surface
    }

    /// Whether occlusion is looked up by the nearest 27 texels, not by 8.
    pub fn smooths_occlusion(&self) -> bool {
        self.shading.reconstruction.smooths_occlusion() && self.has_factors()
    }

    /// Farthest way of an occlusion look-up from the point that is seen, voxels.
    pub fn occlusion_shift_voxels(&self) -> f32 {
        let shifts = self.shading.reconstruction.shifts_occlusion() && self.has_factors();
        if shifts { FARTHEST_SHIFT_VOXELS } else { 0.0 }
    }

    /// Whether occlusion is a factor, whatever the orientation of a surface is.
    fn has_factors(&self) -> bool {
        self.occlusion.texels() != OcclusionTexels::Octants
    }

    /// Radius, mm, around a voxel of all points whose clipping decides its coverage, and all that read the voxel.
    pub fn footprint_mm(&self) -> f64 {
        let stride = f64::from(self.occlusion.texels().stride());
        // Texels away from which a texel is read, by points that may be shifted. Its middle is up to half a voxel from the
        // voxel that stands for it.
        let texels = if self.smooths_occlusion() { 1.5 } else { 1.0 };
        let voxels = texels * stride + 0.5 * (stride - 1.0) + f64::from(self.occlusion_shift_voxels());
        self.occlusion.footprint_mm(&self.geometry).max(voxels * self.geometry.cell_diagonal_mm())
    }

    /// Influence of carvers on this volume, at its scale in the world.
    pub fn influence(&self) -> Influence {
        // Rounding must not make a length too short.
        let stretch = longest_stretch(self.world_from_local.matrix3.as_dmat3()) as f32 * 1.001;
        Influence {
            reach_world: self.occlusion.reach_mm(&self.geometry) as f32 * stretch,
            footprint_world: self.footprint_mm() as f32 * stretch,
        }
    }
}

pub(crate) struct ExtractedCarver {
    order: SpawnOrder,
    pub entity: Entity,
    pub clip_mesh: ClipMesh,
    pub mesh: AssetId<Mesh>,
    pub frame: ClipFrame,
    pub revision: u32,
    pub world_from_local: Affine3A,
    /// Whether the carver's transform is invertible. A collapsed carver keeps its maps, and carves nothing.
    pub is_placed: bool,
}

/// Copies the inputs of the passes. A volume without its lookup table is not ready to be shown.
pub(crate) fn extract_scene(
    mut scene: ResMut<ExtractedScene>,
    mut timing: ResMut<TimesByClock>,
    volumes: Extract<
        Query<(
            Entity,
            &LookupTable,
            (&FittedOcclusion, &ShownOcclusion),
            (&VolumeShading, Option<&MotionSampling>, Option<&VolumeDepth>),
            &GlobalTransform,
            Option<&VolumeBox>,
            (&InheritedVisibility, Option<&RenderLayers>, Has<NotShadowCaster>, Has<NotShadowReceiver>),
        )>,
    >,
    carvers: Extract<Query<(&SpawnOrder, Entity, &ClipMesh, &ClipCamera, &GlobalTransform)>>,
    poses: Extract<RelativePoses>,
    clip_settings: Extract<Res<ClipSettings>>,
    clip_capacity: Extract<Res<ClipCapacity>>,
    optimizations: Extract<Res<Optimizations>>,
    (cast_budget, cast_pacing): (Extract<Res<CastBudget>>, Extract<Option<Res<CastPacing>>>),
    time: Extract<Option<Res<Time<Real>>>>,
    count_work: Extract<Res<CountWork>>,
    time_by_clock: Extract<Res<TimePassesByClock>>,
    device: Option<Res<RenderDevice>>,
) {
    scene.clip_settings = clip_settings.clone();
    scene.clip_capacity = **clip_capacity;
    scene.optimizations = **optimizations;
    scene.cast_budget = **cast_budget;
    scene.cast_pacing = cast_pacing.as_deref().copied();
    scene.frame_ms = time.as_deref().map_or(0.0, |time| 1e3 * time.delta_secs());
    scene.count_work = count_work.0 && device.is_some_and(|device| counts_arrive(&device));
    // The counters are cleared and read in the order of the frame.
    timing.0 = time_by_clock.0 && !scene.count_work;
    scene.carvers.clear();
    scene.carvers.extend(carvers.iter().filter_map(|(order, entity, clip_mesh, camera, transform)| {
        Some(ExtractedCarver {
            order: *order,
            entity,
            clip_mesh: clip_mesh.clone(),
            mesh: camera.mesh,
            frame: camera.frame?,
            revision: camera.revision,
            world_from_local: transform.affine(),
            is_placed: placed(transform).is_some(),
        })
    }));
    // The same carvers act in every frame, whatever the order of the query: active ones first, by order of spawning.
    scene.carvers.sort_unstable_by_key(|carver| (!carver.clip_mesh.is_active, carver.order));
    let first_beyond = scene.carvers.len().min(MAX_CARVERS);
    scene.beyond_most =
        scene.carvers.drain(first_beyond..).map(|carver| (carver.entity, carver.mesh)).collect();
    let ExtractedScene { volumes: extracted, carvers, .. } = &mut *scene;
    extracted.clear();
    extracted.extend(volumes.iter().map(
        |(entity, table, (wanted, shown), shading, transform, drawn_on, shadows)| {
            let occlusion = &shown.fitted;
            let (shading, in_motion, depth) = shading;
            let step_voxels = in_motion.and_then(MotionSampling::step_voxels).unwrap_or(shading.step_voxels);
            let (visibility, layers, casts_none, receives_none) = shadows;
            let uses_occlusion = shading.ambient_occlusion && occlusion.has_occlusion();
            ExtractedVolume {
                entity: entity.into(),
                drawn_on: drawn_on.map(|child| child.0.into()),
                geometry: table.geometry,
                table: table.clone(),
                by_gradient: shown.by_gradient && table.last_gradient.is_some(),
                occlusion: AmbientOcclusion { recompute: default(), ..occlusion.occlusion.clone() },
                has_occlusion: occlusion.has_occlusion(),
                awaits_pipelines: wanted != occlusion,
                shading: VolumeShading {
                    ambient_occlusion: uses_occlusion,
                    step_voxels,
                    reconstruction: shown.reconstruction,
                    lighting: shown.lighting,
                    outline_rays: shown.outline_rays,
                    ..shading.clone()
                },
                recomputes_all: uses_occlusion && occlusion.occlusion.recompute == Recompute::Everything,
                world_from_local: transform.affine() * Affine3A::from_scale(Vec3::splat(WORLD_UNITS_PER_MM)),
                carvers: carvers_of(entity, carvers, &poses),
                is_placed: placed(transform).is_some(),
                layers: layers.cloned().unwrap_or_default(),
                casts_shadows: visibility.get() && !casts_none,
                receives_shadows: !receives_none,
                depth_opacity: depth.map(|depth| depth.stopping_opacity()),
            }
        },
    ));
}

/// Whether counters can be read back. On a device without queries Bevy 0.19.1 reads the counters' buffers before they
/// are mapped, and panics (`FrameData::finish` in `bevy_render/src/diagnostic/internal.rs`).
fn counts_arrive(device: &RenderDevice) -> bool {
    let queries = WgpuFeatures::TIMESTAMP_QUERY | WgpuFeatures::PIPELINE_STATISTICS_QUERY;
    let arrive = device.features().intersects(queries);
    if !arrive {
        warn_once!("work cannot be counted on this graphics device: it has no queries");
    }
    arrive
}

/// The carvers that act on a volume.
fn carvers_of(volume: Entity, carvers: &[ExtractedCarver], poses: &RelativePoses) -> Vec<(usize, DAffine3)> {
    let millimetres = DAffine3::from_scale(DVec3::splat(WORLD_UNITS_PER_MM.into()));
    let acting = carvers.iter().enumerate().filter(|(_, carver)| carver.clip_mesh.carves(volume));
    acting
        .filter_map(|(index, carver)| Some((index, poses.between(volume, carver.entity)? * millimetres)))
        .collect()
}

impl ExtractedScene {
    /// The entities of all carvers.
    pub fn carver_entities(&self) -> HashSet<Entity> {
        self.carvers.iter().map(|carver| carver.entity).collect()
    }
}
