//! Measurements of a generated volume of any size: a bumpy shell with a rod along each axis (`benches/peers` has the
//! same).

use bevy::{
    math::{DAffine3, DVec2, DVec3, Vec3Swizzles},
    prelude::*,
};
use bevy_contextual_ao::{
    diagnostics::{ClipWork, Work},
    prelude::*,
    volume::{Intensities, Rescale, VolumeError, VolumeGeometry},
};
use contextual_ao_kit::mode::ShadingMode;
use serde_json::json;

use crate::{
    Options,
    counting::ball,
    figures::{FrameTimes, merged, ratio},
    stage::{Samples, Stage, to_and_fro},
};
use contextual_ao_kit::{
    carver::{Carver, Shape},
    scene::{BONE, SceneParts},
};

/// Extent of the generated volumes along each side, mm.
const EXTENT_MM: f32 = 128.0;
/// Place of the ball that carves, as shares of the grid's extent.
pub const CARVER: DVec3 = DVec3::new(0.7, 0.65, 0.7);
/// Voxels along each side of the volumes that grow.
pub const SIZES: [u32; 4] = [64, 128, 256, 512];

/// Parts of the scene without carvers.
fn shell(volume: Volume) -> Result<SceneParts, String> {
    let spacing_mm = volume.spacing_mm().min_element();
    let function = TransferFunction::ramp(1500.0, 2500.0, 0.95, BONE);
    let mut function = function.map_err(|error| error.to_string())?;
    // The unit of opacity is one voxel.
    function.opacity_unit_distance_mm = spacing_mm;
    Ok(SceneParts {
        name: format!("shell {}", volume.dimensions().x),
        volume,
        transfer_function: Some(function),
        budget: default(),
        occlusion: AmbientOcclusion::by(OcclusionRays {
            pattern: RayPattern::Fibonacci(26),
            step_mm: Some(spacing_mm),
            ..default()
        }),
        shading: VolumeShading { step_voxels: 1.0, jitter: false, ..default() },
        carvers: Vec::new(),
        camera: Vec3::new(132.0, 88.0, 198.0),
        fov: 30.0,
    })
}

/// Generates the volume, `size` voxels along each side. Its values are 0 to 4000.
pub fn generate(size: u32) -> Result<Volume, String> {
    shell_volume(size, EXTENT_MM / size as f32).map_err(|error| error.to_string())
}

/// `x`, `y` and `z` are those of volume space.
fn shell_volume(size: u32, spacing_mm: f32) -> Result<Volume, VolumeError> {
    let at: Vec<f64> = (0..size).map(|k| 2.0 * f64::from(k) / f64::from(size - 1) - 1.0).collect();
    let waves: Vec<f64> = at.iter().map(|g| (9.0 * g).sin()).collect();
    let rod = |across: DVec2| (1.0 - (across.length() - 0.12) / 0.04).clamp(0.0, 1.0);
    let mut values = Vec::with_capacity(size.pow(3) as usize);
    for (z, wave_z) in at.iter().zip(&waves) {
        for (y, wave_y) in at.iter().zip(&waves) {
            for (x, wave_x) in at.iter().zip(&waves) {
                let p = DVec3::new(*x, *y, *z);
                let bumps = 0.04 * wave_x * wave_y * wave_z;
                let shell = 1.0 - (p.length() - 0.75 - bumps).abs() / 0.08;
                let rods = rod(p.yz()).max(rod(p.zx())).max(rod(p.xy()));
                values.push((4000.0 * shell.max(rods)).round() as u16);
            }
        }
    }
    let patient_from_grid = [DVec3::NEG_X, DVec3::Z, DVec3::Y].map(|axis| axis * f64::from(spacing_mm));
    let [x, y, z] = patient_from_grid;
    let grid_to_patient = DAffine3::from_cols(x, y, z, DVec3::ZERO);
    Volume::new(UVec3::splat(size), grid_to_patient, Intensities::U16(values), Rescale::default())
}

/// Times and work of frames of one kind.
pub struct Measured {
    pub times: FrameTimes,
    pub work: Work,
    pub clipped: ClipWork,
}

impl Measured {
    /// Bricks touched by clipping, and bytes of these, over those of another frame.
    pub fn touched_over(clipped: &ClipWork, other: &ClipWork) -> [f64; 2] {
        let bytes = |work: &ClipWork| work.bytes(INTENSITY_BYTES);
        [ratio(clipped.bricks(), other.bricks()), ratio(bytes(clipped), bytes(other))]
    }
}

/// Bytes of a voxel's intensity in the generated volumes.
const INTENSITY_BYTES: u64 = 2;
/// Radius of the ball that is as large in voxels in every size.
const SAME_VOXELS: f32 = 18.0;

/// Measures carve frames of a stage.
pub fn grown(stage: &mut Stage, options: &Options) -> Result<Measured, String> {
    stage.prepare(ShadingMode::Cao, stage.rays().pattern)?;
    let times = stage.medians(options.warmup, options.frames, Stage::carve);
    let (work, clipped) = stage.count_all(|stage| stage.carve(options.warmup + options.frames));
    Ok(Measured { times, work, clipped })
}

/// Measures the same scene in more and more voxels, carved by a ball of the same share of it. The number of rays and
/// of steps of a voxel stays the same. The image has as many pixels along each side as the volume has voxels: work
/// grows with its surface.
pub fn growth(options: &Options) -> Result<(), String> {
    let mut last: Option<(Measured, ClipWork)> = None;
    for size in SIZES.into_iter().filter(|size| *size <= options.most) {
        let mut stage = growing(size)?;
        let grown = grown(&mut stage, options)?;
        let Measured { times, work, clipped } = &grown;
        let same = same_carver(&mut stage, size)?;
        let last_clipped = last.as_ref().map(|(last, same)| (&last.clipped, same));
        let touched = last_clipped.map(|(last, _)| Measured::touched_over(clipped, last));
        let touched_by_same = last_clipped.map(|(_, last)| Measured::touched_over(&same, last));
        let last_grown = last.as_ref().map(|(last, _)| last);
        let figures = json!({
            "recast_voxels": work.voxels,
            "samples": work.samples,
            "samples_over_last_size": last_grown.map(|last| ratio(work.samples, last.work.samples)),
            "frame_over_last_size": last_grown.map(|last| times.total / last.times.total),
            "clip_and_cast_over_last_size":
                last_grown.map(|last| times.clip_and_cast() / last.times.clip_and_cast()),
            "bricks": clipped.bricks(),
            "bricks_clipped": clipped.bricks_clipped,
            "bricks_expired": clipped.bricks_expired,
            "superbricks_visited": clipped.superbricks_visited,
            "superbricks_measured": clipped.superbricks_measured,
            "clip_bytes": clipped.bytes(INTENSITY_BYTES),
            "bricks_and_bytes_over_last_size": touched,
            "same_carver_bricks": same.bricks(),
            "same_carver_bricks_and_bytes_over_last_size": touched_by_same,
            "gpu_bytes": stage.usage().bytes,
        });
        stage.print(merged(figures, times.to_json()));
        last = Some((grown, same));
    }
    Ok(())
}

/// Clipping by a ball of as many voxels in every size, in the same place.
fn same_carver(stage: &mut Stage, size: u32) -> Result<ClipWork, String> {
    stage.scale_carver(SAME_VOXELS / (0.28 * size as f32));
    stage.prepare(ShadingMode::Cao, stage.rays().pattern)?;
    stage.carve(0);
    stage.headless.frame();
    Ok(stage.count_all(|stage| stage.carve(1)).1)
}

/// Stage of the growing scene in one size.
pub fn growing(size: u32) -> Result<Stage, String> {
    Ok(Stage::new(carved(generate(size)?)?, UVec2::splat(size)))
}

/// Parts of the growing scene.
pub fn carved(volume: Volume) -> Result<SceneParts, String> {
    let mut parts = shell(volume)?;
    parts.carvers.push(ball(&VolumeGeometry::of(&parts.volume), CARVER, 0.28));
    Ok(parts)
}

/// Shading modes in which the scene of `benches/peers` is measured, by each filter.
const PEER_MODES: [ShadingMode; 3] = [ShadingMode::Solid, ShadingMode::Phong, ShadingMode::Cao];

/// Filters and modes in which it is measured.
pub fn peer_cases() -> impl Iterator<Item = (Reconstruction, ShadingMode)> {
    Reconstruction::ALL.into_iter().flat_map(|filter| PEER_MODES.map(|mode| (filter, mode)))
}

/// Image of the scene of `benches/peers`, pixels.
pub const PEER_IMAGE: UVec2 = UVec2::splat(512);

/// Stage of the scene of `benches/peers`, with an image of `size` pixels.
pub fn beside_peers(size: UVec2, options: &Options) -> Result<Stage, String> {
    let mut parts = shell(generate(128)?)?;
    parts.carvers.push(Carver::new(Shape::Box { size: Vec3::splat(200.0) }, 116.0 * Vec3::Z));
    let mut stage = Stage::new(parts, size);
    stage.set_optimizations(options.scene.optimizations()?);
    Ok(stage)
}

/// Measures frames of the scene of `benches/peers`: a cut moves while the camera turns.
pub fn peer_frames(stage: &mut Stage, mode: ShadingMode, options: &Options) -> Result<Measured, String> {
    stage.prepare(mode, stage.rays().pattern)?;
    let change = |stage: &mut Stage, frame: u32| {
        stage.move_carver(to_and_fro(frame) as f32 * Vec3::Z);
        stage.turn_camera(frame as f32);
    };
    let times = stage.medians_undisturbed(options.warmup, options.frames, change);
    let (work, clipped) = stage.count_all(|stage| change(stage, options.warmup + options.frames));
    change(stage, 0);
    Ok(Measured { times, work, clipped })
}

/// Samples with which the scene is measured by the default filter.
const PEER_SAMPLES: [Samples; 4] = [
    Samples { msaa: Msaa::Sample4, outline_rays: 1, over_frames: false },
    Samples { msaa: Msaa::Sample4, outline_rays: 4, over_frames: false },
    Samples { msaa: Msaa::Sample4, outline_rays: 8, over_frames: false },
    Samples { over_frames: true, ..Samples::ONE },
];

/// Measures the scene of `benches/peers` by each filter in each mode, with smooth outlines, and over frames.
pub fn peer(options: &Options) -> Result<(), String> {
    let mut stage = beside_peers(PEER_IMAGE, options)?;
    let filters = peer_cases().map(|(filter, mode)| (filter, mode, Samples::ONE));
    let sampled = PEER_SAMPLES
        .into_iter()
        .flat_map(|samples| PEER_MODES.map(|mode| (Reconstruction::default(), mode, samples)));
    for (filter, mode, samples) in filters.chain(sampled) {
        stage.set_shading(|shading| shading.reconstruction = filter);
        stage.set_samples(samples);
        let Measured { times, work, .. } = peer_frames(&mut stage, mode, options)?;
        let figures = json!({
            "mode": mode.name(),
            "reconstruction": filter.name(),
            "msaa": samples.msaa.samples(),
            "outline_rays": samples.outline_rays,
            "over_frames": samples.over_frames,
            "frames": options.frames,
            "recast_voxels": work.voxels,
            "samples": work.samples,
            "distances": work.distances,
        });
        stage.print(merged(figures, times.to_json()));
    }
    Ok(())
}
