//! Table 1 of Ruiz et al. (Volumetric Ambient Occlusion for Volumetric Models, 2010): time to filter a volume. Each
//! of three estimates, and the variance by which opacities are modulated (section 4.2), is timed for several radii.
//! Volumes at hand stand for the paper's own. Then the paper's figures 8 and 10: the head by each estimate, and with
//! opacities modulated.

use bevy_contextual_ao::{
    occlusion::{DensityEstimate, DensitySource, OcclusionFiltering, OpacityModulation},
    prelude::*,
};
use contextual_ao_kit::mode::ShadingMode;
use serde_json::json;

use crate::{Options, counting::CountingScene, figures::median, gallery::compose, stage::Stage};

/// Radii in voxels, the paper's first.
const RADII: [u32; 5] = [5, 10, 1, 20, 40];

/// What is filtered.
#[derive(Clone, Copy)]
struct Filtered {
    name: &'static str,
    estimate: DensityEstimate,
    modulation: OpacityModulation,
}

const CASES: [Filtered; 4] = [
    Filtered { name: "Chebyshev", estimate: DensityEstimate::Chebyshev, modulation: OpacityModulation::None },
    Filtered { name: "power", estimate: DensityEstimate::Power, modulation: OpacityModulation::None },
    Filtered { name: "Gaussian", estimate: DensityEstimate::Gaussian, modulation: OpacityModulation::None },
    // The means are those of Chebyshev's bound.
    Filtered { name: "variance", estimate: DensityEstimate::Chebyshev, modulation: VARIANCE },
];

/// The paper's variance of 5 for figures 9 and 10, of intensities from 0 to 255.
const VARIANCE: OpacityModulation = OpacityModulation::Variance(5.0 / (255.0 * 255.0));
/// Change of the occlusion over a voxel from which on matter is as opaque as ever.
const GRADIENT: OpacityModulation = OpacityModulation::Gradient(0.05);

/// The paper's milliseconds of each case for radii of 5 and 10 voxels, where it has them.
type Published = [[Option<f64>; 2]; CASES.len()];

/// The paper's head, of 256 x 256 x 113 voxels, and its body, of 256 x 256 x 415.
const HEAD: Published =
    [[Some(200.0), Some(268.0)], [Some(161.0), Some(205.0)], [Some(203.0), Some(270.0)], [None, Some(243.0)]];
const BODY: Published =
    [[Some(713.0), Some(958.0)], [Some(565.0), Some(734.0)], [Some(717.0), Some(965.0)], [None, Some(863.0)]];

/// Prints a line per volume, estimate and radius.
pub fn run(options: &Options) -> Result<(), String> {
    for (scene, published) in [(CountingScene::CtHead, HEAD), (CountingScene::CtTorso, BODY)] {
        let Some(mut parts) = scene.load(options)? else {
            continue;
        };
        parts.carvers.clear();
        let mut stage = Stage::new(parts, options.image_size());
        for (case, paper_ms) in CASES.into_iter().zip(published) {
            measure(&mut stage, case, paper_ms, options)?;
        }
    }
    pictures(options)
}

/// Opacities that show muscle and skin through each other, and bone behind: file units (HU), opacity of a mm, colour.
const TISSUES: [(f32, f32, [f32; 3]); 5] = [
    (-300.0, 0.0, [0.8, 0.45, 0.35]),
    (0.0, 0.05, [0.8, 0.45, 0.35]),
    (120.0, 0.05, [0.75, 0.3, 0.25]),
    (250.0, 0.4, [0.95, 0.9, 0.8]),
    (1200.0, 0.9, [0.95, 0.9, 0.8]),
];

/// Figures 8 and 10 for the head, in a sheet.
fn pictures(options: &Options) -> Result<(), String> {
    let Some(mut parts) = CountingScene::CtHead.load(options)? else {
        return Ok(());
    };
    parts.carvers.clear();
    let point = |(value, opacity, color)| ControlPoint { value, color, opacity };
    let function =
        TransferFunction::new(TISSUES.map(point).into(), 1.0).map_err(|error| error.to_string())?;
    parts.transfer_function = Some(function);
    let size = options.image_size();
    let mut stage = Stage::new(parts, size);
    let mut pictures = Vec::new();
    let mut take = |name: String, mode, case: Filtered| -> Result<(), String> {
        set_radius(&mut stage, case, 10);
        let occlusion = stage.occlusion();
        stage.prepare_with(mode, occlusion)?;
        pictures.push((name, stage.image()));
        Ok(())
    };
    take("no occlusion".into(), ShadingMode::Solid, CASES[0])?;
    for case in &CASES[..3] {
        take(case.name.into(), ShadingMode::Cao, *case)?;
    }
    take("lit".into(), ShadingMode::Phong, CASES[0])?;
    for case in &CASES[..3] {
        let modulated = Filtered { modulation: GRADIENT, ..*case };
        take(format!("lit, gradient, {}", case.name), ShadingMode::PhongCao, modulated)?;
    }
    take("lit, variance".into(), ShadingMode::PhongCao, CASES[3])?;
    let path = options.out.join("filtering_ct-head.png");
    std::fs::create_dir_all(&options.out).map_err(|error| format!("{}: {error}", options.out.display()))?;
    let pictures: Vec<_> = pictures.iter().map(|(name, image)| (name.as_str(), image.clone())).collect();
    compose(&pictures, size)?.save(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    println!("{}", path.display());
    Ok(())
}

fn measure(
    stage: &mut Stage,
    case: Filtered,
    paper_ms: [Option<f64>; 2],
    options: &Options,
) -> Result<(), String> {
    set_radius(stage, case, RADII[0]);
    // Everything is computed anew in every frame.
    stage.prepare(ShadingMode::Lao, stage.rays().pattern)?;
    // Radii take turns, so that other work of the device slows all of them down.
    let turns = RADII.len() as u32;
    let times = stage.time(turns * (options.warmup + options.frames), |stage, frame| {
        set_radius(stage, case, RADII[(frame % turns) as usize]);
    });
    let times = &times[(turns * options.warmup) as usize..];
    let medians = [0, 1, 2, 3, 4].map(|turn| {
        let of_radius = times.iter().skip(turn).step_by(RADII.len());
        median(of_radius.map(|times| times.of(OcclusionFiltering::SPAN)).collect())
    });
    for (k, (radius, ms)) in RADII.into_iter().zip(medians).enumerate() {
        stage.print(json!({
            "estimate": case.name,
            "radius_voxels": radius,
            "frames": options.frames,
            "ms_filter": ms,
            "of_radius_5": ms / medians[0],
            "paper_ms": paper_ms.get(k),
            "paper_of_radius_5": paper_ms.get(k).and_then(|ms| Some((*ms)? / paper_ms[0]?)),
        }));
    }
    Ok(())
}

fn set_radius(stage: &mut Stage, case: Filtered, radius: u32) {
    let settings = OcclusionFiltering {
        estimate: case.estimate,
        modulation: case.modulation,
        density: DensitySource::Intensity,
        radius_mm: Some(radius as f32 * stage.scene.voxel_mm),
        ..Default::default()
    };
    let volume = stage.scene.volume;
    if let Some(mut occlusion) = stage.headless.app.world_mut().get_mut::<AmbientOcclusion>(volume) {
        occlusion.method = OcclusionMethod::Filtering(settings);
    }
}
