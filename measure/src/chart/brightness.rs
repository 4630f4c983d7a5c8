//! Errors of images, as they are and with their brightness fitted: methods define the same openness as more light or
//! less, and a factor on all light is no error of shading.

use bevy::prelude::*;
use contextual_ao_kit::fit::Fit;

/// Largest factor on light, and number of steps of the search for the best.
const MOST: f64 = 16.0;
const STEPS: u32 = 40;

/// Errors of bytes of colours against true ones. The factor is on linear light; errors are of encoded colours.
pub fn image_fit(pairs: impl IntoIterator<Item = [u8; 2]>) -> Option<Fit> {
    let mut counts = vec![0u32; 1 << 16];
    for [found, truth] in pairs {
        counts[usize::from(found) << 8 | usize::from(truth)] += 1;
    }
    let share = |byte: usize| byte as f64 / 255.0;
    let cells: Vec<(f64, f64, u32)> = counts
        .iter()
        .enumerate()
        .filter(|(_, count)| **count > 0)
        .map(|(cell, count)| (share(cell >> 8), share(cell & 255), *count))
        .collect();
    let raw = Fit::of(
        cells.iter().flat_map(|(found, truth, count)| std::iter::repeat_n([*found, *truth], *count as usize)),
    );
    let rms = |factor: f64| {
        let squares = cells.iter().map(|(found, truth, count)| {
            let error = encoded(factor * linear(*found)) - truth;
            error * error * f64::from(*count)
        });
        (squares.sum::<f64>() / raw.count as f64).sqrt()
    };
    // Golden section over the factor's logarithm.
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    let (mut low, mut high) = (-MOST.ln(), MOST.ln());
    for _ in 0..STEPS {
        let (left, right) = (high - golden * (high - low), low + golden * (high - low));
        if rms(left.exp()) < rms(right.exp()) { high = right } else { low = left }
    }
    let factor = (0.5 * (low + high)).exp();
    (raw.count > 0).then(|| Fit { factor, fitted_rms: rms(factor).min(raw.rms), ..raw })
}

fn linear(encoded: f64) -> f64 {
    Color::srgb(encoded as f32, 0.0, 0.0).to_linear().red.into()
}

pub fn encoded(linear: f64) -> f64 {
    f64::from(Color::linear_rgb(linear as f32, 0.0, 0.0).to_srgba().red).min(1.0)
}
