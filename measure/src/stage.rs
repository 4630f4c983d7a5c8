//! A scene that is changed from frame to frame, timed and counted.

use bevy::{
    anti_alias::taa::TemporalAntiAliasing,
    core_pipeline::prepass::MotionVectorPrepass,
    prelude::*,
    render::{camera::TemporalJitter, renderer::RenderAdapterInfo},
};
use bevy_contextual_ao::occlusion::Optimizations;
use bevy_contextual_ao::{
    diagnostics::{
        ClipWork, GpuUsage, PassLog, RenderStatus, SPAN_DRAW, TimePassesByClock, Work, latest_gpu_ms,
    },
    prelude::*,
    render::{VolumeTexture, VoxelMask},
    volume::WORLD_UNITS_PER_MM,
};
use contextual_ao_kit::mode::ShadingMode;
use serde_json::{Value, json};
use std::{sync::Once, time::Instant};

use crate::figures::{FrameTimes, SPANS, merged};
use contextual_ao_kit::{
    carver::Carver,
    headless::Headless,
    scene::{Scene, SceneParts},
};

/// A scene in an app of its own.
pub struct Stage {
    pub headless: Headless,
    /// Entities of the scene.
    pub scene: Scene,
    /// Carvers that move, each with the transform with which it was spawned: the first, and those that joined it.
    starts: Vec<(Entity, Transform)>,
    /// Rays that were last cast; before the first cast, the scene's rays.
    rays: OcclusionRays,
    /// The scene's own view samples.
    shading: VolumeShading,
    /// Camera of the second eye and its transform, while it is open.
    second_eye: Option<(Entity, Transform)>,
}

/// How a pixel is sampled.
#[derive(Clone, Copy)]
pub struct Samples {
    pub msaa: Msaa,
    /// Rays of a pixel at an outline.
    pub outline_rays: u32,
    /// Whether frames are averaged (TAA).
    pub over_frames: bool,
}

impl Samples {
    /// One sample a pixel.
    pub const ONE: Self = Self { msaa: Msaa::Off, outline_rays: 1, over_frames: false };
}

/// Steps that a carver moves away before it turns back.
const WAY: u32 = 8;

/// Steps from its start to a carver that moves to and fro, a step per frame.
pub fn to_and_fro(frame: u32) -> u32 {
    let phase = frame % (2 * WAY);
    phase.min(2 * WAY - phase)
}

impl Stage {
    /// Sets up a scene with an image of `size` pixels.
    pub fn new(parts: SceneParts, size: UVec2) -> Self {
        static DEVICE_TOLD: Once = Once::new();
        let mut headless = Headless::new(size, |_| {});
        let rays = parts.occlusion.method.rays().copied().unwrap_or_default();
        let shading = parts.shading.clone();
        let scene = parts.spawn(&mut headless);
        let world = headless.app.world();
        let first = scene.carvers.first();
        let starts = first.map(|carver| (*carver, world.get(*carver).copied().unwrap_or_default()));
        let starts = starts.into_iter().collect();
        let stage = Self { headless, scene, starts, rays, shading, second_eye: None };
        let adapter = stage.adapter();
        DEVICE_TOLD.call_once(|| eprintln!("{}, {} {}", adapter.name, adapter.driver, adapter.driver_info));
        stage
    }

    fn world(&mut self) -> &mut World {
        self.headless.app.world_mut()
    }

    /// Adapter of the device.
    pub fn adapter(&self) -> &RenderAdapterInfo {
        self.headless.app.world().resource()
    }

    /// Occlusion settings of the volume.
    pub fn occlusion(&self) -> AmbientOcclusion {
        self.headless.app.world().get::<AmbientOcclusion>(self.scene.volume).cloned().unwrap_or_default()
    }

    /// Rays that were last cast; before the first cast, the scene's rays.
    pub fn rays(&self) -> OcclusionRays {
        self.rays
    }

    /// Number of samples of a dense LAO: all rays of all voxels, at full length.
    pub fn dense_samples(&self) -> u64 {
        self.scene.voxels * u64::from(self.rays.pattern.rays()) * u64::from(self.rays.steps)
    }

    /// Prints figures as a line of JSON, with the scene, the rays and the device.
    pub fn print(&self, figures: Value) {
        let OcclusionRays { pattern, steps, .. } = self.rays;
        let of = json!({
            "scene": self.scene.name,
            "voxels": self.scene.voxels,
            "pattern": pattern.to_string(),
            "rays": pattern.rays(),
            "steps": steps,
            "device": self.adapter().name,
        });
        println!("{}", merged(of, figures));
    }

    /// Changes the shading mode of the volume.
    pub fn set_mode(&mut self, mode: ShadingMode) {
        self.headless.set_mode(self.scene.volume, mode);
    }

    /// Changes the view samples of the volume to those of a preset, or to the scene's own.
    pub fn set_view_samples(&mut self, quality: Option<Quality>) {
        let VolumeShading { step_voxels, reconstruction, jitter, .. } =
            quality.map_or_else(|| self.shading.clone(), Quality::shading);
        self.set_shading(|shading| {
            *shading = VolumeShading { step_voxels, reconstruction, jitter, ..shading.clone() };
        });
    }

    /// Changes how the volume is drawn.
    pub fn set_shading(&mut self, change: impl FnOnce(&mut VolumeShading)) {
        let volume = self.scene.volume;
        if let Some(mut shading) = self.world().get_mut::<VolumeShading>(volume) {
            change(&mut shading);
        }
    }

    /// Sets how pixels are sampled.
    pub fn set_samples(&mut self, Samples { msaa, outline_rays, over_frames }: Samples) {
        let camera = self.scene.camera;
        let mut entity = self.world().entity_mut(camera);
        entity.insert(msaa).remove::<(TemporalAntiAliasing, TemporalJitter, MotionVectorPrepass)>();
        if over_frames {
            entity.insert(TemporalAntiAliasing::default());
        }
        self.set_shading(|shading| shading.outline_rays = outline_rays);
    }

    /// Changes the optimizations.
    pub fn set_optimizations(&mut self, optimizations: Optimizations) {
        self.world().insert_resource(optimizations);
    }

    /// Changes how the volume is shaded. Runs frames until everything is there that does not change from frame to
    /// frame.
    pub fn prepare(&mut self, mode: ShadingMode, pattern: RayPattern) -> Result<(), String> {
        let mut occlusion = self.occlusion();
        if let Some(rays) = occlusion.method.rays_mut() {
            rays.pattern = pattern;
        }
        self.prepare_with(mode, occlusion)
    }

    /// [`Self::prepare`] with all settings of occlusion.
    pub fn prepare_with(&mut self, mode: ShadingMode, occlusion: AmbientOcclusion) -> Result<(), String> {
        // Modes that recompute everything in every frame have nothing to prepare.
        self.set_mode(if mode.recomputes_all() { ShadingMode::Solid } else { mode });
        let volume = self.scene.volume;
        self.rays = occlusion.method.rays().copied().unwrap_or(self.rays);
        self.world().entity_mut(volume).insert(occlusion);
        self.headless.until_ready(self.scene.volume)?;
        self.set_mode(mode);
        Ok(())
    }

    /// Moves the first carver by an offset from its start, and further carvers with it.
    pub fn move_carver(&mut self, offset_mm: Vec3) {
        for (carver, start) in self.starts.clone() {
            let translation = start.translation + offset_mm * WORLD_UNITS_PER_MM;
            self.world().entity_mut(carver).insert(Transform { translation, ..start });
        }
    }

    /// Spawns a carver that moves with the first.
    pub fn join(&mut self, carver: &Carver) -> Entity {
        let entity = carver.spawn(self.world());
        let start = self.world().get(entity).copied().unwrap_or_default();
        self.starts.push((entity, start));
        entity
    }

    /// Despawns a carver that moves with the first.
    pub fn leave(&mut self, carver: Entity) {
        self.starts.retain(|(entity, _)| *entity != carver);
        self.world().despawn(carver);
    }

    /// Puts the first carver where it is in a frame. It moves to and fro along the view's horizontal, a voxel per
    /// frame.
    pub fn carve(&mut self, frame: u32) {
        let way = to_and_fro(frame) as f32 * self.scene.voxel_mm;
        self.move_carver(way * self.scene.view.right());
    }

    /// Turns the camera from its start about the vertical axis through the volume's centre. The second eye turns with
    /// it.
    pub fn turn_camera(&mut self, degrees: f32) {
        let turn = Transform::from_rotation(Quat::from_rotation_y(degrees.to_radians()));
        let first = (self.scene.camera, self.scene.view);
        for (camera, view) in [Some(first), self.second_eye].into_iter().flatten() {
            self.world().entity_mut(camera).insert(turn * view);
        }
    }

    /// Opens a second eye beside the first, which draws a whole image as well.
    pub fn open_second_eye(&mut self) {
        const APART_MM: f32 = 63.0;
        let first = self.scene.view;
        let right = first.right() * APART_MM * WORLD_UNITS_PER_MM;
        let view = first.with_translation(first.translation + right);
        let projection: Projection =
            self.headless.app.world().get(self.scene.camera).cloned().unwrap_or_default();
        let camera = (self.headless.camera(), projection);
        let order = Camera { order: 1, ..default() };
        self.second_eye = Some((self.world().spawn(camera).insert((order, view)).id(), view));
    }

    /// Closes the second eye.
    pub fn close_second_eye(&mut self) {
        if let Some((camera, _)) = self.second_eye.take() {
            self.world().despawn(camera);
        }
    }

    /// Shifts the transfer function's first point. All occlusion is invalid in the next frame.
    pub fn edit_transfer_function(&mut self, by: f32) {
        self.set_transfer_function(|function| function.points[0].value += by);
    }

    /// Changes the transfer function.
    pub fn set_transfer_function(&mut self, change: impl FnOnce(&mut TransferFunction)) {
        let volume = self.scene.volume;
        let world = self.world();
        let handle = world.get::<VolumeTransferFunction>(volume).map(|function| function.0.clone());
        let mut functions = world.resource_mut::<Assets<TransferFunction>>();
        if let Some(mut function) = handle.and_then(|handle| functions.get_mut(&handle)) {
            change(&mut function);
        }
        // The renderer learns of a changed asset a frame later.
        self.headless.frame();
    }

    /// Milliseconds of one frame.
    pub fn frame_ms(&mut self) -> f64 {
        let begin = Instant::now();
        self.headless.frame();
        begin.elapsed().as_secs_f64() * 1e3
    }

    /// Times frames, and makes `change` before each frame.
    pub fn time(&mut self, frames: u32, mut change: impl FnMut(&mut Self, u32)) -> Vec<FrameTimes> {
        let mut times: Vec<FrameTimes> = Vec::new();
        let mut before = PassLog::default();
        for frame in 0..frames {
            change(self, frame);
            let total = self.frame_ms();
            // The times of passes are known one frame later.
            self.read_passes(times.last_mut(), &mut before);
            times.push(FrameTimes { total, ..default() });
        }
        let mode = self.mode();
        if mode.recomputes_all() {
            self.set_mode(ShadingMode::Solid);
        }
        self.headless.frame();
        self.read_passes(times.last_mut(), &mut before);
        self.set_mode(mode);
        times
    }

    /// Medians of `frames` frames, after `warmup` frames that are not counted.
    pub fn medians(&mut self, warmup: u32, frames: u32, change: impl FnMut(&mut Self, u32)) -> FrameTimes {
        let times = self.time(warmup + frames, change);
        FrameTimes::medians(&times[warmup as usize..])
    }

    /// [`Self::medians`], but with the total of as many frames before, which waited for no single pass.
    pub fn medians_undisturbed(
        &mut self,
        warmup: u32,
        frames: u32,
        mut change: impl FnMut(&mut Self, u32),
    ) -> FrameTimes {
        let by_clock = self.headless.app.world().resource::<TimePassesByClock>().0;
        self.world().insert_resource(TimePassesByClock(false));
        let undisturbed = self.medians(warmup, frames, &mut change);
        self.world().insert_resource(TimePassesByClock(by_clock));
        FrameTimes { total: undisturbed.total, ..self.medians(warmup, frames, change) }
    }

    fn mode(&self) -> ShadingMode {
        self.headless.mode(self.scene.volume)
    }

    fn passes(&self) -> PassLog {
        self.headless.app.world().resource::<RenderStatus>().passes.clone()
    }

    /// Fills in the times of the passes that ran since `before`.
    fn read_passes(&self, times: Option<&mut FrameTimes>, before: &mut PassLog) {
        let passes = self.passes();
        if let Some(times) = times {
            times.passes = SPANS.map(|span| {
                let ran = passes.jobs(span) > before.jobs(span);
                if ran { self.headless.pass_ms(span) } else { 0.0 }
            });
            times.draw = latest_gpu_ms(self.headless.diagnostics(), SPAN_DRAW).unwrap_or(0.0);
        }
        *before = passes;
    }

    /// Work of the ray cast in a frame; `change` is made before the frame.
    pub fn count(&mut self, change: impl FnOnce(&mut Self)) -> Work {
        self.count_all(change).0
    }

    /// The same, and the work of clipping.
    pub fn count_all(&mut self, change: impl FnOnce(&mut Self)) -> (Work, ClipWork) {
        change(self);
        self.headless.count_all_work(self.scene.volume)
    }

    /// Resources on the GPU.
    pub fn usage(&self) -> GpuUsage {
        self.headless.app.world().resource::<RenderStatus>().usage
    }

    /// Makes the carver larger or smaller, for good.
    pub fn scale_carver(&mut self, factor: f32) {
        self.starts.iter_mut().for_each(|(_, start)| start.scale *= factor);
        self.move_carver(Vec3::ZERO);
    }

    /// Number of jobs that passes did in two frames in which nothing changed.
    pub fn jobs_at_rest(&mut self) -> u64 {
        // The jobs of a frame are known one frame later.
        self.headless.frames(2);
        let before = self.passes().total_jobs();
        self.headless.frames(2);
        self.passes().total_jobs() - before
    }

    /// Occlusion, as bytes, of the voxels that views read; `None` for others.
    pub fn seen_occlusion(&self) -> Vec<Option<u8>> {
        let (headless, volume) = (&self.headless, self.scene.volume);
        let texels = headless.voxels(volume, VolumeTexture::Occlusion);
        let valid = headless.mask(volume, VoxelMask::Valid);
        texels.into_iter().zip(valid).map(|(texel, valid)| valid.then_some(texel)).collect()
    }

    /// Image of a frame in which nothing else is changed.
    pub fn image(&mut self) -> Vec<u8> {
        self.headless.frame();
        self.headless.image()
    }

    /// Image with everything recomputed by the same rays.
    pub fn lao_image(&mut self) -> Vec<u8> {
        let mode = self.mode();
        self.set_mode(ShadingMode::Lao);
        let image = self.image();
        self.set_mode(mode);
        image
    }
}
