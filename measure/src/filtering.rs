//! Table 1 of Ruiz et al. (Volumetric Ambient Occlusion for Volumetric Models, 2010): time to filter a volume. Each
//! of three estimates is timed for several radii. Volumes at hand stand for the paper's own.

use bevy_contextual_ao::{
    occlusion::{DensityEstimate, DensitySource, OcclusionFiltering},
    prelude::*,
};
use contextual_ao_kit::mode::ShadingMode;
use serde_json::json;

use crate::{Options, counting::CountingScene, figures::median, stage::Stage};

/// Radii in voxels, the paper's first.
const RADII: [u32; 5] = [5, 10, 1, 20, 40];

/// The paper's milliseconds of one estimate in one volume, for radii of 5 and 10 voxels.
type Published = (DensityEstimate, [f64; 2]);

/// The paper's head, of 256 x 256 x 113 voxels, and its body, of 256 x 256 x 415.
const HEAD: [Published; 3] = [
    (DensityEstimate::Chebyshev, [200.0, 268.0]),
    (DensityEstimate::Power, [161.0, 205.0]),
    (DensityEstimate::Gaussian, [203.0, 270.0]),
];
const BODY: [Published; 3] = [
    (DensityEstimate::Chebyshev, [713.0, 958.0]),
    (DensityEstimate::Power, [565.0, 734.0]),
    (DensityEstimate::Gaussian, [717.0, 965.0]),
];

/// Prints a line per volume, estimate and radius.
pub fn run(options: &Options) -> Result<(), String> {
    for (scene, published) in [(CountingScene::CtHead, HEAD), (CountingScene::CtTorso, BODY)] {
        let Some(mut parts) = scene.load(options)? else {
            continue;
        };
        parts.carvers.clear();
        let mut stage = Stage::new(parts, options.image_size());
        for (estimate, paper_ms) in published {
            measure(&mut stage, estimate, paper_ms, options)?;
        }
    }
    Ok(())
}

fn measure(
    stage: &mut Stage,
    estimate: DensityEstimate,
    paper_ms: [f64; 2],
    options: &Options,
) -> Result<(), String> {
    set_radius(stage, estimate, RADII[0]);
    // Everything is computed anew in every frame.
    stage.prepare(ShadingMode::Lao, stage.rays().pattern)?;
    // Radii take turns, so that other work of the device slows all of them down.
    let turns = RADII.len() as u32;
    let times = stage.time(turns * (options.warmup + options.frames), |stage, frame| {
        set_radius(stage, estimate, RADII[(frame % turns) as usize]);
    });
    let times = &times[(turns * options.warmup) as usize..];
    let medians = [0, 1, 2, 3, 4].map(|turn| {
        let of_radius = times.iter().skip(turn).step_by(RADII.len());
        median(of_radius.map(|times| times.of(OcclusionFiltering::SPAN)).collect())
    });
    for (k, (radius, ms)) in RADII.into_iter().zip(medians).enumerate() {
        stage.print(json!({
            "estimate": format!("{estimate:?}"),
            "radius_voxels": radius,
            "frames": options.frames,
            "ms_filter": ms,
            "of_radius_5": ms / medians[0],
            "paper_ms": paper_ms.get(k),
            "paper_of_radius_5": paper_ms.get(k).map(|ms| ms / paper_ms[0]),
        }));
    }
    Ok(())
}

fn set_radius(stage: &mut Stage, estimate: DensityEstimate, radius: u32) {
    let settings = OcclusionFiltering {
        estimate,
        density: DensitySource::Intensity,
        radius_mm: Some(radius as f32 * stage.scene.voxel_mm),
        ..Default::default()
    };
    let volume = stage.scene.volume;
    if let Some(mut occlusion) = stage.headless.app.world_mut().get_mut::<AmbientOcclusion>(volume) {
        occlusion.method = OcclusionMethod::Filtering(settings);
    }
}
