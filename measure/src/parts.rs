//! What each part of the picture costs, in the scene of `benches/peers`.

use bevy::prelude::*;
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::mode::ShadingMode;
use serde_json::json;

use crate::{
    Options,
    figures::median,
    shell,
    stage::{Samples, Stage},
};

/// How the scene is shown.
#[derive(Clone, Copy)]
struct Look {
    mode: ShadingMode,
    step_voxels: f32,
    jitter: bool,
    reconstruction: Reconstruction,
    opacities: VoxelOpacities,
    coverage: CoverageRule,
    /// Whether opacity depends on the gradient too.
    by_gradient: bool,
    samples: Samples,
}

impl Default for Look {
    fn default() -> Self {
        let VolumeShading { step_voxels, jitter, reconstruction, .. } = default();
        Self {
            mode: ShadingMode::PhongCao,
            step_voxels,
            jitter,
            reconstruction,
            opacities: default(),
            coverage: default(),
            by_gradient: false,
            samples: Samples::ONE,
        }
    }
}

/// A part's name, the look without it, and the look with it.
type Part = (&'static str, Look, Look);

fn parts() -> Vec<Part> {
    let all = Look::default();
    let filtered = |reconstruction| Look { reconstruction, ..all };
    let sampled = |outline_rays| {
        let samples = Samples { msaa: Msaa::Sample4, outline_rays, over_frames: false };
        Look { samples, ..all }
    };
    let over_frames = Look { samples: Samples { over_frames: true, ..Samples::ONE }, ..all };
    let trilinear = filtered(Reconstruction::Trilinear);
    vec![
        ("occlusion", Look { mode: ShadingMode::Phong, ..all }, all),
        ("normals and light", Look { mode: ShadingMode::Cao, ..all }, all),
        ("smooth colours", trilinear, all),
        ("smooth occlusion", trilinear, filtered(Reconstruction::SmoothOcclusion)),
        ("tricubic", trilinear, filtered(Reconstruction::Tricubic)),
        ("opacities of whole voxels", Look { opacities: VoxelOpacities::OfCenters, ..all }, all),
        ("coverage by lines", Look { coverage: CoverageRule::Points, ..all }, all),
        ("half steps", Look { step_voxels: 1.0, ..all }, all),
        ("noise", Look { jitter: false, ..all }, all),
        ("function of the gradient", all, Look { by_gradient: true, ..all }),
        ("four samples a pixel", all, sampled(1)),
        ("4 rays at outlines", sampled(1), sampled(4)),
        ("32 rays at outlines", sampled(1), sampled(32)),
        ("anti-aliasing over frames", all, over_frames),
    ]
}

/// Times that both looks of a part are measured, in turns: a machine's speed varies by more than some parts cost.
const ROUNDS: usize = 3;

/// Prints the time of a frame with each part over that without it.
pub fn run(options: &Options) -> Result<(), String> {
    let mut stage = shell::beside_peers(shell::PEER_IMAGE, options)?;
    for (part, without, with) in parts() {
        let mut times = [Vec::new(), Vec::new()];
        for _ in 0..ROUNDS {
            for (look, times) in [without, with].iter().zip(&mut times) {
                show(&mut stage, look);
                times.push(shell::peer_frames(&mut stage, look.mode, options)?.times.total);
            }
        }
        let ratios = times[0].iter().zip(&times[1]).map(|(without, with)| with / without).collect::<Vec<_>>();
        let [without, with] = times.map(median);
        let figures = json!({
            "part": part,
            "frame_over_without": with / without,
            "rounds": ratios,
            "ms_without": without,
            "ms_with": with,
        });
        stage.print(figures);
    }
    Ok(())
}

fn show(stage: &mut Stage, look: &Look) {
    let Look { step_voxels, jitter, reconstruction, opacities, coverage, by_gradient, samples, .. } = *look;
    let gradient_opacity = if by_gradient {
        // From a tenth of the gradient of the shell on, per mm, matter is as opaque as before.
        [0.0, 80.0].map(|gradient| GradientPoint { gradient, opacity: gradient / 80.0 }).to_vec()
    } else {
        Vec::new()
    };
    stage.set_transfer_function(|function| function.gradient_opacity = gradient_opacity);
    stage.set_shading(|shading| {
        *shading = VolumeShading { step_voxels, jitter, reconstruction, ..shading.clone() };
    });
    stage.set_samples(samples);
    let volume = stage.scene.volume;
    let world = stage.headless.app.world_mut();
    world.resource_mut::<ClipSettings>().coverage = coverage;
    if let Some(mut occlusion) = world.get_mut::<AmbientOcclusion>(volume) {
        occlusion.opacities = opacities;
    }
}
