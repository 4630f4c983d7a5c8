//! The CAO paper's tables 2 to 6 and its figures 10 and 12, with ours beside. Real volumes at hand stand for its own, and
//! ratios for frames per second.

use bevy::math::{DVec3, UVec3};
use bevy_contextual_ao::{occlusion::Optimizations, prelude::*, render::VolumeTexture};
use contextual_ao_kit::mode::ShadingMode;

use crate::{
    Options,
    counting::{CARVER, CountingScene, ball},
    counts::published_voxels,
    directions::Shot,
    figures::{Errors, FrameTimes, ratio},
    published::{PUBLISHED, Published},
    shell,
    stage::Stage,
    times,
};
use std::time::Instant;

/// The paper's patterns, and our patterns of as many rays.
pub const PATTERNS: [[RayPattern; 2]; 4] = [
    [RayPattern::Neighborhood6, RayPattern::Fibonacci(6)],
    [RayPattern::Neighborhood14, RayPattern::Fibonacci(14)],
    [RayPattern::Neighborhood26, RayPattern::Fibonacci(26)],
    [RayPattern::Rubik54, RayPattern::Fibonacci(54)],
];

/// Measurements in one scene.
pub struct Measured {
    pub name: String,
    /// The scene of the paper that this scene stands for.
    beside: Option<&'static Published>,
    dimensions: UVec3,
    steps: u32,
    /// Percent of voxels cast in a carve frame: as published, and by us.
    pub recast_percent: [f64; 2],
    /// Measurements by pattern, fewer where the time was up.
    pub by_rays: Vec<ByRays>,
}

/// Measurements with one of [`PATTERNS`].
pub struct ByRays {
    pub rays: u32,
    pub solid: FrameTimes,
    /// Dense LAO and CAO, both as published; not in volumes too large for them.
    pub published: Option<[FrameTimes; 2]>,
    pub ours: FrameTimes,
    pub two_carvers: FrameTimes,
    /// RMS errors of the paper's pattern and of ours against 512 rays.
    pub voxel_rms: [f64; 2],
    pub pixel_rms: [f64; 2],
    /// RMS error of the paper's pattern over all voxels, also those that no view reads; only beside a dense LAO.
    pub all_voxel_rms: Option<f64>,
    /// Errors of the pixels with the paper's pattern, as shares of the range.
    pub error_picture: Vec<f32>,
}

impl ByRays {
    /// Time of a dense LAO over that of CAO as published, and over that of ours.
    pub fn dense_over_ours(&self) -> Option<[f64; 2]> {
        let [dense, published] = self.published?;
        Some([published, self.ours].map(|times| dense.total / times.total))
    }

    /// Time of our CAO over that of no occlusion.
    pub fn ours_over_solid(&self) -> f64 {
        self.ours.total / self.solid.total
    }

    /// Percent of the frame rate that a second carver takes.
    pub fn percent_lost(&self) -> f64 {
        percent_lost(self.two_carvers.total, self.ours.total)
    }
}

/// Measures the figures of the tables, which takes long. Prints the tables of each scene once it is measured.
pub fn run(options: &Options) -> Result<(), String> {
    let scenes = [CountingScene::EngineOpaque, CountingScene::Beetle, CountingScene::CtTorso];
    for (scene, published) in scenes.into_iter().zip(&PUBLISHED) {
        if let Some(mut stage) = scene.open(options)? {
            let measured = measure(&mut stage, Some(published), true, None, options)?;
            print(&measured);
            save_error_pictures(&measured, options)?;
        }
    }
    if options.most >= 512 {
        print(&measure(&mut shell::growing(512)?, None, false, None, options)?);
    }
    Ok(())
}

fn print(measured: &Measured) {
    print_scene(measured);
    print_speed(measured);
    print_breakdown(measured);
    print_second_carver(measured);
    let rows_of_voxels = rows(
        measured,
        |paper, k| [paper.voxel_rms[k]],
        |m| [m.all_voxel_rms, Some(m.voxel_rms[0]), Some(m.voxel_rms[1])],
    );
    print_table(
        "Table 5: RMS error of voxels against 512 rays, 0 to 1",
        [
            "scene",
            "rays",
            "paper",
            "its pattern, all voxels",
            "its pattern, seen voxels",
            "Fibonacci, seen voxels",
        ],
        rows_of_voxels,
    );
    let rows_of_pixels = rows(measured, |paper, k| [paper.pixel_rms[k]], |m| m.pixel_rms.map(Some));
    print_table(
        "Table 6: RMS error of pixels against 512 rays, 0 to 255",
        ["scene", "rays", "paper", "its pattern here", "Fibonacci"],
        rows_of_pixels,
    );
}

/// Measures a scene, and dense LAO as published if `dense`. After `deadline` no further pattern is begun.
pub fn measure(
    stage: &mut Stage,
    beside: Option<&'static Published>,
    dense: bool,
    deadline: Option<Instant>,
    options: &Options,
) -> Result<Measured, String> {
    let voxels = stage.scene.voxels;
    let published = published_voxels(stage)?;
    stage.carve(1);
    stage.prepare(ShadingMode::Cao, RayPattern::Fibonacci(6))?;
    let ours = stage.count(|stage| stage.carve(0)).voxels;
    let truth = Shot::take(stage, RayPattern::Sphere512)?;
    // It overlaps the first, as in the paper's figure 11.
    let second = ball(&stage.scene.geometry, CARVER + DVec3::new(-0.3, 0.1, 0.0), 0.2);
    let all_true = dense.then(|| all_voxels(stage, RayPattern::Sphere512)).transpose()?;
    let is_in_time = |_: &_| deadline.is_none_or(|deadline| Instant::now() < deadline);
    let by_rays = PATTERNS.into_iter().take_while(is_in_time).map(|[theirs, fibonacci]| {
        let shots = [Shot::take(stage, theirs)?, Shot::take(stage, fibonacci)?];
        stage.prepare(ShadingMode::Solid, theirs)?;
        let solid = stage.medians(options.warmup, options.frames, Stage::carve);
        stage.carve(0);
        let published = dense.then(|| times::published(stage, options.slow_frames)).transpose()?;
        let ours = times::ours(stage, options)?;
        let two_carvers = times::with_overlapping(stage, &second, options)?;
        stage.carve(0);
        let all_voxel_rms = match &all_true {
            Some(truth) => {
                let found = all_voxels(stage, theirs)?;
                Some(Errors::of(found.into_iter().zip(truth.iter().copied())).rms / 255.0)
            }
            None => None,
        };
        Ok(ByRays {
            rays: theirs.rays(),
            solid,
            published,
            ours,
            two_carvers,
            voxel_rms: [0, 1].map(|k| shots[k].voxel_errors(&truth).rms / 255.0),
            pixel_rms: [0, 1].map(|k| shots[k].pixel_errors(&truth).rms),
            all_voxel_rms,
            error_picture: shots[0].error_picture(&truth),
        })
    });
    let by_rays = by_rays.collect::<Result<_, String>>()?;
    Ok(Measured {
        name: stage.scene.name.clone(),
        beside,
        dimensions: stage.scene.geometry.dimensions,
        steps: stage.rays().steps,
        recast_percent: [published, ours].map(|recast| 100.0 * ratio(recast, voxels)),
        by_rays,
    })
}

/// Occlusion of all voxels, whether or not a view reads them, as a dense LAO finds it.
fn all_voxels(stage: &mut Stage, pattern: RayPattern) -> Result<Vec<u8>, String> {
    stage.prepare(ShadingMode::Solid, pattern)?;
    stage.set_optimizations(Optimizations::NONE);
    stage.set_mode(ShadingMode::Lao);
    stage.headless.frame();
    let occlusion = stage.headless.voxels(stage.scene.volume, VolumeTexture::Occlusion);
    stage.set_mode(ShadingMode::Solid);
    stage.set_optimizations(Optimizations::default());
    Ok(occlusion)
}

fn print_scene(m: &Measured) {
    let [published, ours] = m.recast_percent.map(|percent| format!("{percent:.2}"));
    let paper = |of: fn(&Published) -> String| m.beside.map_or_else(none, of);
    let row = vec![
        paper(|p| p.name.to_owned()),
        paper(|p| p.resolution.map(|n| n.to_string()).join("x")),
        paper(|p| p.steps.to_string()),
        paper(|p| format!("{:.2}", p.recast_percent)),
        m.name.clone(),
        m.dimensions.to_array().map(|n| n.to_string()).join("x"),
        m.steps.to_string(),
        published,
        ours,
    ];
    let head =
        ["paper", "voxels", "steps", "% recast", "here", "voxels", "steps", "% as published", "% ours"];
    print_table("Table 2: the scene, and voxels recast in a carve frame", head, [row]);
}

fn print_speed(measured: &Measured) {
    let rows = rows(
        measured,
        |paper, k| [paper.cao_fps[k] / paper.lao_fps[k], paper.solid_fps / paper.cao_fps[k]],
        |m| {
            let [published, ours] = m.dense_over_ours().map_or([None; 2], |ratios| ratios.map(Some));
            [published, ours, Some(m.ours_over_solid())]
        },
    );
    let head = [
        "scene",
        "rays",
        "LAO/CAO paper",
        "CAO/solid paper",
        "LAO/CAO as published",
        "LAO/CAO ours",
        "CAO/solid ours",
    ];
    print_table("Table 3: time of a frame, CAO's beside that of dense LAO and of no occlusion", head, rows);
}

/// Figure 10: steps IV, V and VI of a frame, and the rest.
fn print_breakdown(measured: &Measured) {
    let mut lines = Vec::new();
    for m in measured.by_rays.iter().filter(|m| [6, 54].contains(&m.rays)) {
        let [dense, published] = m.published.map_or([None; 2], |times| times.map(Some));
        for (name, times) in [("LAO", dense), ("CAO as published", published), ("CAO ours", Some(m.ours))] {
            let Some(times) = times else {
                continue;
            };
            let parts = times.breakdown().map(|ms| format!("{ms:.1}"));
            let cells = [measured.name.clone(), m.rays.to_string(), name.to_owned()].into_iter().chain(parts);
            lines.push(cells.collect());
        }
    }
    let head = ["scene", "rays", "", "clipping", "ray cast", "rendering", "overhead"];
    print_table("Figure 10: milliseconds of a frame", head, lines);
}

/// Largest error of a pixel that figure 12 shows, as a share of the range.
const LARGEST_SHOWN: f32 = 0.2;

/// Figure 12: errors of the pixels with 6 and with 54 rays. Darker is worse.
fn save_error_pictures(measured: &Measured, options: &Options) -> Result<(), String> {
    std::fs::create_dir_all(&options.out).map_err(|error| format!("{}: {error}", options.out.display()))?;
    let size = options.image_size();
    for m in measured.by_rays.iter().filter(|m| [6, 54].contains(&m.rays)) {
        let shade = |error: &f32| (255.0 * (1.0 - (error / LARGEST_SHOWN).min(1.0))).round() as u8;
        let shades: Vec<u8> = m.error_picture.iter().map(shade).collect();
        let file = options.out.join(format!("{}_error_{}.png", measured.name, m.rays));
        image::save_buffer(&file, &shades, size.x, size.y, image::ColorType::L8)
            .map_err(|error| format!("{}: {error}", file.display()))?;
        let largest = m.error_picture.iter().fold(0.0, |largest: f32, error| largest.max(*error));
        println!("Figure 12: {}, largest error {:.1} %", file.display(), 100.0 * largest);
    }
    println!();
    Ok(())
}

fn print_second_carver(measured: &Measured) {
    let rows = rows(
        measured,
        |paper, k| [percent_lost(1.0 / paper.two_meshes_fps[k], 1.0 / paper.cao_fps[k])],
        |m| {
            [
                Some(m.percent_lost()),
                Some(percent_lost(m.two_carvers.clip_and_cast(), m.ours.clip_and_cast())),
            ]
        },
    );
    let head = ["scene", "rays", "% paper", "% ours", "% ours, clip and cast"];
    print_table("Table 4: share of the frame rate that a second carver takes", head, rows);
}

/// Percent by which the frame rate falls when a frame takes `time` instead of `before`.
fn percent_lost(time: f64, before: f64) -> f64 {
    100.0 * (1.0 - before / time)
}

/// A row per number of rays: the paper's figures, and the measured figures.
fn rows<const P: usize, const M: usize>(
    measured: &Measured,
    paper: impl Fn(&Published, usize) -> [f64; P],
    ours: impl Fn(&ByRays) -> [Option<f64>; M],
) -> Vec<Vec<String>> {
    let of = |(k, m): (usize, &ByRays)| {
        let paper = measured.beside.map_or([None; P], |published| paper(published, k).map(Some));
        let values = paper.into_iter().chain(ours(m));
        let values = values.map(|value| value.map_or_else(none, |value| format!("{value:.4}")));
        [measured.name.clone(), m.rays.to_string()].into_iter().chain(values).collect()
    };
    measured.by_rays.iter().enumerate().map(of).collect()
}

fn none() -> String {
    "-".to_owned()
}

/// Prints a table. Columns are as wide as their contents.
pub fn print_table<const N: usize>(
    title: &str,
    head: [&str; N],
    rows: impl IntoIterator<Item = Vec<String>>,
) {
    let mut lines = vec![head.map(str::to_owned).to_vec()];
    lines.extend(rows);
    let widths: [usize; N] =
        std::array::from_fn(|k| lines.iter().map(|line| line[k].len()).max().unwrap_or_default());
    println!("{title}");
    for line in lines {
        let cells: Vec<_> = line.iter().zip(widths).map(|(cell, width)| format!("{cell:>width$}")).collect();
        println!("{}", cells.join("  "));
    }
    println!();
}
