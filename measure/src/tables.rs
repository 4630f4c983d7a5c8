//! The CAO paper's tables 2 to 6 with our figures beside. Real volumes at hand stand for its own, and ratios for
//! frames per second.

use bevy::math::{DVec3, UVec3};
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::mode::ShadingMode;

use crate::{
    Options,
    counting::{CARVER, CountingScene, ball},
    counts::published_voxels,
    directions::Shot,
    figures::{FrameTimes, ratio},
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
    let scenes = [CountingScene::EngineOpaque, CountingScene::Bonsai, CountingScene::CtTorso];
    for (scene, published) in scenes.into_iter().zip(&PUBLISHED) {
        if let Some(mut stage) = scene.open(options)? {
            print(&measure(&mut stage, Some(published), true, None, options)?);
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
    print_second_carver(measured);
    print_errors(
        "Table 5: RMS error of voxels against 512 rays, 0 to 1",
        measured,
        |paper| paper.voxel_rms,
        |m| m.voxel_rms,
    );
    print_errors(
        "Table 6: RMS error of pixels against 512 rays, 0 to 255",
        measured,
        |paper| paper.pixel_rms,
        |m| m.pixel_rms,
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
    let second = [ball(&stage.scene.geometry, DVec3::ONE - CARVER, 0.14)];
    let is_in_time = |_: &_| deadline.is_none_or(|deadline| Instant::now() < deadline);
    let by_rays = PATTERNS.into_iter().take_while(is_in_time).map(|[theirs, fibonacci]| {
        let shots = [Shot::take(stage, theirs)?, Shot::take(stage, fibonacci)?];
        stage.prepare(ShadingMode::Solid, theirs)?;
        let solid = stage.medians(options.warmup, options.frames, Stage::carve);
        stage.carve(0);
        let published = dense.then(|| times::published(stage, options.slow_frames)).transpose()?;
        let ours = times::ours(stage, options)?;
        let two_carvers = times::with(stage, &second, options)?;
        stage.carve(0);
        Ok(ByRays {
            rays: theirs.rays(),
            solid,
            published,
            ours,
            two_carvers,
            voxel_rms: [0, 1].map(|k| shots[k].voxel_errors(&truth).rms / 255.0),
            pixel_rms: [0, 1].map(|k| shots[k].pixel_errors(&truth).rms),
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

fn print_errors(
    title: &str,
    measured: &Measured,
    paper: fn(&Published) -> [f64; 4],
    ours: fn(&ByRays) -> [f64; 2],
) {
    let rows = rows(measured, |published, k| [paper(published)[k]], |m| ours(m).map(Some));
    print_table(title, ["scene", "rays", "paper", "its pattern here", "Fibonacci"], rows);
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
fn print_table<const N: usize>(title: &str, head: [&str; N], rows: impl IntoIterator<Item = Vec<String>>) {
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
