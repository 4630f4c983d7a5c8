//! Measures carve frames without a window, a JSON line per configuration. By default the first carver of the given
//! scene moves one voxel per frame along the view's horizontal.

mod ablation;
mod carve;
mod cases;
mod chart;
mod counting;
mod counts;
mod directions;
mod figures;
mod filtering;
mod fingerprints;
mod gallery;
mod isosurface;
mod lights;
mod live;
mod motion;
mod overlaps;
mod pacing;
mod parts;
mod periphery;
mod picture;
mod published;
mod report;
mod shell;
mod stage;
mod sweeping;
mod tables;
mod times;
mod truths;

use bevy::prelude::*;
use bevy_contextual_ao::prelude::*;
use clap::{Args, Parser};
use contextual_ao_kit::mode::ShadingMode;
use contextual_ao_kit::{
    scene::SceneOptions,
    stability::{self, Group},
};
use counting::CountingScene;
use std::path::PathBuf;

/// Measures carve frames.
#[derive(Clone, Parser)]
struct Options {
    #[command(flatten)]
    scene: SceneOptions,
    #[command(flatten)]
    instead: Instead,
    /// Shading modes: solid, phong, cao, phong_cao, lao; several may be given.
    #[arg(long = "mode", num_args = 1.., default_values = ["cao", "lao"])]
    modes: Vec<ShadingMode>,
    /// Ray patterns: neighborhood6, neighborhood14, neighborhood26, rubik54, sphere512, fibonacci:N; several may be
    /// given.
    #[arg(long = "pattern", num_args = 1.., default_values_t = [RayPattern::Rubik54])]
    patterns: Vec<RayPattern>,
    /// Number of frames that are measured.
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..))]
    frames: u32,
    /// Number of measured frames of the published pipeline, which is slow.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    slow_frames: u32,
    /// Number of frames before the measured frames.
    #[arg(long, default_value_t = 3)]
    warmup: u32,
    /// With --ablation: measures also without any optimization, which is slow.
    #[arg(long)]
    with_published: bool,
    /// The largest generated volume, voxels along each side.
    #[arg(long, default_value_t = 256)]
    most: u32,
    /// Leaves out the comparison with LAO, which is slow.
    #[arg(long)]
    no_check: bool,
    /// Folder that --chart, --plot, --gallery and --picture write to.
    #[arg(long, default_value = "charts")]
    out: PathBuf,
    /// With --chart: number of times that volumes and images are halved [default: 1, with --quick 2].
    #[arg(long)]
    halvings: Option<u32>,
    /// Measures scenes other than the given scene at half their resolution, in small images. With --report: volumes
    /// of at most 128 voxels along each side, images of 200x200 pixels, at most 3 frames (5 minutes on a software
    /// driver).
    #[arg(long)]
    quick: bool,
    /// With --report and --chart: Python interpreter that may have VTK, to measure it as well.
    #[arg(long, default_value = "python3")]
    python: PathBuf,
    /// With --chart: folder with Node packages that may have vtk.js, to compare it as well.
    #[arg(long)]
    node_packages: Option<PathBuf>,
}

/// Other measurements, in scenes of their own.
#[derive(Args, Clone)]
#[group(multiple = false)]
struct Instead {
    /// Steadiness and exactness of clipping where similar methods fail, a JSON line per figure (half an hour on a
    /// software driver).
    #[arg(long, value_name = "GROUP", num_args = 0..=1)]
    stability: Option<Option<Group>>,
    /// Number of samples of a carve frame beside that of the published pipeline, in real volumes.
    #[arg(long, value_name = "SCENE", num_args = 0..=1)]
    counts: Option<Option<CountingScene>>,
    /// Time of a carve frame beside that of a dense LAO as published, at rest, and with more carvers: CT of an
    /// engine.
    #[arg(long)]
    times: bool,
    /// Effect of each optimization: all of them on, then each switched off by itself. Uses the given scene if it has
    /// a volume, else CT of an engine.
    #[arg(long)]
    ablation: bool,
    /// Growth of the work with a generated volume: 64, 128, 256 and 512 voxels along each side.
    #[arg(long)]
    growth: bool,
    /// The scene of benches/peers in three shading modes.
    #[arg(long)]
    peer: bool,
    /// Cost of each part of the picture in the scene of benches/peers: the time of a lit and occluded frame with the
    /// part over that without it.
    #[arg(long)]
    parts: bool,
    /// Cost of volumes in the same space, and of translucent meshes in a volume, in the scene of benches/peers.
    #[arg(long)]
    overlaps: bool,
    /// Cost of the scene's lights and of shadows, over that of a headlight, in the scene of benches/peers.
    #[arg(long)]
    lights: bool,
    /// Error of the occlusion of ray patterns against very many rays, in real volumes.
    #[arg(long)]
    directions: bool,
    /// Tables 2 to 6 of the CAO paper with our figures beside. Slow unless --quick; --most 512 adds a generated
    /// volume of that size.
    #[arg(long)]
    tables: bool,
    /// Table 1 of the CAO paper: the frame after the radius, the transfer function or the carver changed, by every
    /// method.
    #[arg(long)]
    live: bool,
    /// Table 1 of the paper on occlusion by filtering: times for its two radii and for others, by its three
    /// estimates. The volumes are CT of a head and of a torso.
    #[arg(long)]
    filtering: bool,
    /// Error of progressive rays while a carver moves: CT of an engine.
    #[arg(long)]
    motion: bool,
    /// Frame times and errors with `CastPacing` and without it, in a generated volume: a ball carves, and now and then all
    /// in view has to be cast.
    #[arg(long)]
    pacing: bool,
    /// Time of two eyes with a periphery of half resolution over that of two whole images: the scene of benches/peers.
    #[arg(long)]
    periphery: bool,
    /// Errors of sweeping an isosurface and of directional occlusion shading against their own definitions, by Monte
    /// Carlo on the CPU: CT of an engine and of a head.
    #[arg(long)]
    truths: bool,
    /// Speed against accuracy of every occlusion method (16 minutes a scene on a software driver with --quick). Writes
    /// chart.csv, and charts of carve frames, frames at rest and frames after an edit of the transfer function. With
    /// the name of a scene, rows of other scenes stay in the file.
    #[arg(long, value_name = "SCENE", num_args = 0..=1)]
    chart: Option<Option<String>>,
    /// Draws the charts again from a chart.csv.
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// Times of occlusion sweeping in generated volumes, with the times of table 2 of its paper beside. The largest
    /// volume is 250 voxels along each side; --most leaves out larger volumes.
    #[arg(long)]
    sweeping: bool,
    /// Time to draw an isosurface by view rays that leap by its distance field, in two CT volumes. Beside it are view
    /// rays that go step by step, and the transfer function.
    #[arg(long)]
    isosurface: bool,
    /// Hashes of images and voxels of small scenes, by every method in every mode. The lines before and after a
    /// change are the same if the change changes nothing.
    #[arg(long)]
    fingerprints: bool,
    /// The given scene by every method side by side, as methods.png.
    #[arg(long)]
    gallery: bool,
    /// How far pictures of analytic scenes are from the truth, a JSON line per scene, setting and mode. Writes each
    /// picture, its truth and their difference into the folder of --out. --most leaves out larger volumes. --quick
    /// takes 48 voxels along each side and small images.
    #[arg(long, value_name = "SCENE", num_args = 0..=1)]
    picture: Option<Option<String>>,
    /// Every table that generated volumes allow, in at most 8 minutes on a GPU. Writes a Markdown file and a CSV
    /// file into the folder, both named after the graphics device.
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
}

impl Options {
    /// Size of images, pixels.
    fn image_size(&self) -> UVec2 {
        if self.quick { UVec2::splat(200) } else { self.scene.size }
    }
}

fn main() -> Result<(), String> {
    let options = Options::parse();
    let instead = &options.instead;
    if let Some(group) = instead.stability {
        stability(group)
    } else if let Some(scene) = instead.counts {
        counts::run(scene, &options)
    } else if instead.times {
        times::run(&options)
    } else if instead.ablation {
        ablation::run(&options)
    } else if instead.growth {
        shell::growth(&options)
    } else if instead.peer {
        shell::peer(&options)
    } else if instead.parts {
        parts::run(&options)
    } else if instead.lights {
        lights::run(&options)
    } else if instead.overlaps {
        overlaps::run(&options)
    } else if instead.directions {
        directions::run(&options)
    } else if instead.tables {
        tables::run(&options)
    } else if instead.live {
        live::run(&options)
    } else if instead.filtering {
        filtering::run(&options)
    } else if instead.motion {
        motion::run(&options)
    } else if instead.pacing {
        pacing::run(&options)
    } else if instead.periphery {
        periphery::run(&options)
    } else if instead.truths {
        truths::run(&options)
    } else if let Some(scene) = &instead.chart {
        chart::run(scene.as_deref(), &options)
    } else if let Some(file) = &instead.plot {
        chart::plot_again(file, &options.out)
    } else if instead.sweeping {
        sweeping::run(&options)
    } else if instead.isosurface {
        isosurface::run(&options)
    } else if instead.fingerprints {
        fingerprints::run()
    } else if instead.gallery {
        gallery::run(&options)
    } else if let Some(scene) = &instead.picture {
        picture::run(scene.as_deref(), &options)
    } else if let Some(folder) = &instead.report {
        report::run(folder, &options)
    } else {
        carve::run(&options)
    }
}

fn stability(group: Option<Group>) -> Result<(), String> {
    let mut broken = 0;
    stability::run(group, |figure| {
        broken += usize::from(!figure.holds());
        println!("{}", figure.to_json());
    });
    if broken == 0 { Ok(()) } else { Err(format!("{broken} figures exceed their bounds")) }
}
