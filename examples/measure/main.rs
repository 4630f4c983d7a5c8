//! Measures carve frames without a window: moves the first carver one voxel per frame along the
//! view's horizontal and prints one JSON line per shading mode and ray pattern.

#[path = "../common/mod.rs"]
mod common;

use bevy::{prelude::*, render::renderer::RenderAdapterInfo};
use bevy_contextual_ao::{
    diagnostics::{
        SPAN_CLIP, SPAN_CULL, SPAN_DISTANCES, SPAN_DRAW, SPAN_MARK, SPAN_RAY_CAST, Work, latest_gpu_ms,
    },
    prelude::*,
    volume::WORLD_UNITS_PER_MM,
};
use clap::Parser;
use common::{
    headless::Headless,
    scene::{Scene, SceneOptions},
    stability::{self, Group},
};
use serde_json::json;
use std::time::Instant;

/// Measures carve frames.
#[derive(Parser)]
struct Options {
    #[command(flatten)]
    scene: SceneOptions,
    /// solid, phong, cao, phong_cao, lao; several may be given.
    #[arg(long = "mode", num_args = 1.., default_values = ["cao", "lao"])]
    modes: Vec<ShadingMode>,
    /// neighborhood6, neighborhood14, neighborhood26, rubik54, sphere512, fibonacci:N; several may
    /// be given.
    #[arg(long = "pattern", num_args = 1.., default_values_t = [RayPattern::Rubik54])]
    patterns: Vec<RayPattern>,
    /// Frames that are measured.
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..))]
    frames: u32,
    /// Instead: how steady and exact clipping is where such methods fail, a JSON line per figure
    /// (half an hour on a software driver). The scene's options play no part.
    #[arg(long, value_name = "GROUP", num_args = 0..=1)]
    stability: Option<Option<Group>>,
    /// Frames before those.
    #[arg(long, default_value_t = 3)]
    warmup: u32,
}

fn main() -> Result<(), String> {
    let options = Options::parse();
    if let Some(group) = options.stability {
        let mut broken = 0;
        stability::run(group, |figure| {
            broken += usize::from(!figure.holds());
            println!("{}", figure.to_json());
        });
        return if broken == 0 { Ok(()) } else { Err(format!("{broken} figures exceed their bounds")) };
    }
    let mut headless = Headless::new(options.scene.size, |_| {});
    let scene = options.scene.spawn(&mut headless)?;
    if scene.carvers.is_empty() {
        return Err("--carver is missing: there would be nothing to measure".into());
    }
    let adapter = headless.app.world().resource::<RenderAdapterInfo>();
    eprintln!("{}, {} {}", adapter.name, adapter.driver, adapter.driver_info);
    for &pattern in &options.patterns {
        for &mode in &options.modes {
            let line = Measurement::new(&mut headless, &scene, &options).run(mode, pattern)?;
            println!("{line}");
        }
    }
    Ok(())
}

/// One configuration at work.
struct Measurement<'a> {
    headless: &'a mut Headless,
    scene: &'a Scene,
    options: &'a Options,
    start: Transform,
}

/// Milliseconds of one frame.
#[derive(Clone, Copy, Default)]
struct FrameTimes {
    total: f64,
    cull: f64,
    clip: f64,
    distances: f64,
    mark: f64,
    cast: f64,
    draw: f64,
}

impl<'a> Measurement<'a> {
    fn new(headless: &'a mut Headless, scene: &'a Scene, options: &'a Options) -> Self {
        let start = *headless.app.world().get::<Transform>(scene.carvers[0]).unwrap_or(&Transform::IDENTITY);
        Self { headless, scene, options, start }
    }

    fn run(mut self, mode: ShadingMode, pattern: RayPattern) -> Result<serde_json::Value, String> {
        // What recomputes everything in every frame has nothing to get ready.
        self.set_mode(if mode.recomputes_all() { ShadingMode::Solid } else { mode });
        self.set_pattern(pattern);
        self.headless.until_ready(self.scene.volume)?;
        self.set_mode(mode);
        let mut times = Vec::new();
        let (first, last) = (self.options.warmup, self.options.warmup + self.options.frames);
        for frame in 0..last {
            let total = self.carve_frame(frame);
            times.push(FrameTimes { total, ..default() });
            // What passes took is known one frame later.
            if let Some(before) = frame.checked_sub(1) {
                self.read_pass_times(&mut times[before as usize], mode);
            }
        }
        if let Some(latest) = times.last_mut() {
            self.set_mode(ShadingMode::Solid);
            self.headless.frame();
            self.set_mode(mode);
            self.read_pass_times(latest, mode);
        }
        times.drain(..first as usize);
        let work = self.count_work();
        self.headless.frame();
        let image = self.headless.image();
        // The same pose, everything recomputed.
        let different = if mode.uses_occlusion() && !mode.uses_light() {
            self.set_mode(ShadingMode::Lao);
            self.headless.frame();
            let reference = self.headless.image();
            Some(count_different(&image, &reference))
        } else {
            None
        };
        self.move_carver(0);
        let median = |value: fn(&FrameTimes) -> f64| median(times.iter().map(value).collect());
        Ok(json!({
            "scene": self.scene.name,
            "mode": mode.name(),
            "pattern": pattern.to_string(),
            "rays": pattern.rays(),
            "steps": self.options.scene.steps,
            "voxels": self.scene.voxels,
            "recast_voxels": work.voxels,
            "samples": work.samples,
            "distances": work.distances,
            "frames": self.options.frames,
            "ms_total": median(|t| t.total),
            "ms_cull": median(|t| t.cull),
            "ms_clip": median(|t| t.clip),
            "ms_distances": median(|t| t.distances),
            "ms_mark": median(|t| t.mark),
            "ms_cast": median(|t| t.cast),
            "ms_draw": median(|t| t.draw),
            "pixels_different_from_lao": different,
        }))
    }

    fn set_mode(&mut self, mode: ShadingMode) {
        self.headless.set_mode(self.scene.volume, mode);
    }

    fn set_pattern(&mut self, pattern: RayPattern) {
        let world = self.headless.app.world_mut();
        if let Some(mut occlusion) = world.get_mut::<AmbientOcclusion>(self.scene.volume) {
            occlusion.pattern = pattern;
        }
    }

    /// Where the carver is after this many frames: to and fro by up to 8 voxels.
    fn pose(&self, frame: u32) -> Transform {
        const WAY: u32 = 8;
        let phase = frame % (2 * WAY);
        let voxels = if phase <= WAY { phase } else { 2 * WAY - phase } as f32;
        let offset = self.scene.view.right() * (voxels * self.scene.voxel_mm * WORLD_UNITS_PER_MM);
        Transform { translation: self.start.translation + offset, ..self.start }
    }

    fn move_carver(&mut self, frame: u32) {
        let pose = self.pose(frame);
        self.headless.app.world_mut().entity_mut(self.scene.carvers[0]).insert(pose);
    }

    /// Milliseconds of a frame in which the carver moved.
    fn carve_frame(&mut self, frame: u32) -> f64 {
        self.move_carver(frame);
        let begin = Instant::now();
        self.headless.frame();
        begin.elapsed().as_secs_f64() * 1e3
    }

    fn read_pass_times(&self, times: &mut FrameTimes, mode: ShadingMode) {
        times.cull = self.headless.pass_ms(SPAN_CULL);
        times.clip = self.headless.pass_ms(SPAN_CLIP);
        times.distances = self.headless.pass_ms(SPAN_DISTANCES);
        if mode.uses_occlusion() {
            times.mark = self.headless.pass_ms(SPAN_MARK);
            times.cast = self.headless.pass_ms(SPAN_RAY_CAST);
        }
        times.draw = latest_gpu_ms(self.headless.diagnostics(), SPAN_DRAW).unwrap_or(0.0);
    }

    /// Work of one more carve frame, counted in a frame of its own.
    fn count_work(&mut self) -> Work {
        let pose = self.pose(self.options.warmup + self.options.frames);
        let carver = self.scene.carvers[0];
        self.headless.count_work(self.scene.volume, |world| {
            world.entity_mut(carver).insert(pose);
        })
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 { values[middle] } else { (values[middle - 1] + values[middle]) / 2.0 }
}

/// Pixels that are not the same in two RGBA images of one size.
fn count_different(a: &[u8], b: &[u8]) -> usize {
    a.chunks(4).zip(b.chunks(4)).filter(|(a, b)| a != b).count()
}
