//! Errors of the stored occlusion of ray patterns against very many rays.

use bevy::prelude::*;
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::mode::ShadingMode;
use serde_json::json;

use crate::{Options, counting::CountingScene, figures::Errors, stage::Stage};

const SCENES: [CountingScene; 5] = [
    CountingScene::EngineOpaque,
    CountingScene::EngineTranslucent,
    CountingScene::Bonsai,
    CountingScene::CtHead,
    CountingScene::MrBrain,
];

const PATTERNS: [RayPattern; 9] = [
    RayPattern::Neighborhood14,
    RayPattern::Neighborhood26,
    RayPattern::Rubik54,
    RayPattern::Fibonacci(14),
    RayPattern::Fibonacci(20),
    RayPattern::Fibonacci(26),
    RayPattern::Fibonacci(32),
    RayPattern::Fibonacci(36),
    RayPattern::Fibonacci(54),
];

/// Compares the voxels that a small image of each scene reads, without carvers. Occlusion is stored in bytes:
/// rounding two values alone makes an RMS difference of 0.0016.
pub fn run(options: &Options) -> Result<(), String> {
    for scene in SCENES {
        let Some(mut parts) = scene.load(options)? else {
            continue;
        };
        parts.carvers.clear();
        let mut stage = Stage::new(parts, UVec2::splat(96));
        let true_rays = max_rays(&stage);
        let truth = Shot::take(&mut stage, RayPattern::Fibonacci(true_rays))?;
        for pattern in PATTERNS {
            let errors = Shot::take(&mut stage, pattern)?.voxel_errors(&truth);
            stage.print(json!({
                "true_rays": true_rays,
                "rms": errors.rms / 255.0,
                "largest": errors.largest / 255.0,
                "voxels_compared": errors.count,
            }));
        }
    }
    Ok(())
}

/// Number of true rays: 4096, or as many as Mesa's software driver casts. The driver ends a shader's loops after
/// 65,535 rounds in all, without a message. An invocation casts half of all rays where 64 share 32 voxels. A ray takes a
/// round for each sample, and at most another one to look for a leap.
pub fn max_rays(stage: &Stage) -> u32 {
    if stage.headless.is_software() { (65_535 / (stage.rays().steps + 1)).min(4096) } else { 4096 }
}

/// Result of a pattern in a scene.
pub struct Shot {
    /// Occlusion of the voxels that the image reads.
    occlusion: Vec<Option<u8>>,
    image: Vec<u8>,
}

impl Shot {
    /// Renders an image with a pattern.
    pub fn take(stage: &mut Stage, pattern: RayPattern) -> Result<Self, String> {
        stage.prepare(ShadingMode::Cao, pattern)?;
        Ok(Self { occlusion: stage.seen_occlusion(), image: stage.headless.image() })
    }

    /// Errors of the occlusion against `truth`, where both are known.
    pub fn voxel_errors(&self, truth: &Self) -> Errors {
        Errors::of(self.occlusion.iter().zip(&truth.occlusion).filter_map(|(a, b)| Some(((*a)?, (*b)?))))
    }

    /// Mean error of each pixel's colours against `truth`, as a share of the range.
    pub fn error_picture(&self, truth: &Self) -> Vec<f32> {
        let pixels = self.image.chunks(4).zip(truth.image.chunks(4));
        let mean = |(a, b): (&[u8], &[u8])| {
            let sum: u32 = a.iter().zip(b).take(3).map(|(a, b)| u32::from(a.abs_diff(*b))).sum();
            sum as f32 / (3.0 * 255.0)
        };
        pixels.map(mean).collect()
    }

    /// Errors of the colours against `truth`, over all pixels.
    pub fn pixel_errors(&self, truth: &Self) -> Errors {
        let colors = |shot: &Self| shot.image.chunks(4).flat_map(|pixel| pixel[..3].to_vec()).collect();
        let (a, b): (Vec<u8>, Vec<u8>) = (colors(self), colors(truth));
        Errors::of(a.into_iter().zip(b))
    }
}
