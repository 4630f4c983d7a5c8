//! The difference between a picture and its truth.

use bevy::math::UVec2;
use contextual_ao_kit::picture::truth::Pixel;
use serde_json::{Value, json};

/// Least cosine between normal and line of sight of pixels that are compared.
const LEAST_FACING: f64 = 0.3;
/// Largest cosine at which normals are compared: beyond it a level is worth many degrees.
const MOST_FACING: f64 = 0.97;
/// Least opacity of pixels that are compared.
const LEAST_ALPHA: f64 = 0.5;
/// Pixels around a pixel that have to be compared as well: the outline is left out.
const MARGIN: u32 = 2;
/// Degree of the polynomial of the cosine that is taken off the difference.
const DEGREE: usize = 4;

/// Values of the pixels that are compared.
pub struct Difference {
    /// Levels of red, green and blue, 0 to 255, and the true levels.
    pairs: Vec<([f64; 3], [f64; 3])>,
    /// Cosine between normal and line of sight.
    facing: Vec<f64>,
}

impl Difference {
    /// The difference of a picture's levels from the true ones.
    pub fn of(picture: &[[f64; 3]], levels: &[[f64; 3]], truth: &[Pixel], size: UVec2) -> Self {
        let at = |x: u32, y: u32| (y * size.x + x) as usize;
        let counts = |k: usize| truth[k].alpha > LEAST_ALPHA && truth[k].facing > LEAST_FACING;
        let mut difference = Self { pairs: Vec::new(), facing: Vec::new() };
        for y in MARGIN..size.y - MARGIN {
            for x in MARGIN..size.x - MARGIN {
                let mut around =
                    (y - MARGIN..=y + MARGIN).flat_map(|v| (x - MARGIN..=x + MARGIN).map(move |u| (u, v)));
                if around.all(|(u, v)| counts(at(u, v))) {
                    let k = at(x, y);
                    difference.pairs.push((picture[k], levels[k]));
                    difference.facing.push(truth[k].facing);
                }
            }
        }
        difference
    }

    /// Mean and largest difference of the angle between normal and line of sight, degrees. `facing_of` gives the
    /// angle's cosine for a level.
    pub fn angles_by(&self, facing_of: impl Fn(f64) -> f64) -> [f64; 2] {
        let angle = |level| facing_of(level).acos().to_degrees();
        let pairs = self.pairs.iter().zip(&self.facing).filter(|(_, facing)| **facing < MOST_FACING);
        let errors: Vec<f64> =
            pairs.map(|((shown, level), _)| (angle(shown[1]) - angle(level[1])).abs()).collect();
        [errors.iter().sum::<f64>() / errors.len().max(1) as f64, largest(&errors)]
    }

    /// The figures, in levels.
    pub fn to_json(&self) -> Value {
        let by_channel = |channel: usize| {
            self.pairs.iter().map(move |(shown, level)| shown[channel] - level[channel]).collect::<Vec<_>>()
        };
        let all = [0, 1, 2].map(by_channel);
        let rests = all.each_ref().map(|errors| rest(errors, &self.facing));
        let [all, rests] = [all, rests].map(|channels| channels.concat());
        json!({
            "residual_std": root_mean_square(&rests),
            "residual_largest": largest(&rests),
            "rms": root_mean_square(&all),
            "largest": largest(&all),
            "pixels": self.pairs.len(),
        })
    }
}

fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest, value| value.abs().max(largest))
}

/// What is left of values without the polynomial of the cosine that fits them best.
fn rest(values: &[f64], facing: &[f64]) -> Vec<f64> {
    let low = facing.iter().copied().fold(f64::INFINITY, f64::min);
    let high = facing.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let middle = 0.5 * (low + high);
    let half = (0.5 * (high - low)).max(1e-9);
    // Polynomials that are made perpendicular to each other, one after the other.
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let mut rest = values.to_vec();
    for degree in 0..=DEGREE {
        let mut next: Vec<f64> =
            facing.iter().map(|facing| ((facing - middle) / half).powi(degree as i32)).collect();
        let before = root_mean_square(&next);
        for other in &basis {
            take_off(&mut next, other);
        }
        // In scenes of few angles higher degrees say nothing new.
        if root_mean_square(&next) < 1e-3 * before {
            break;
        }
        take_off(&mut rest, &next);
        basis.push(next);
    }
    rest
}

/// Takes the part of values along a direction off them.
fn take_off(values: &mut [f64], along: &[f64]) {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let share = dot(values, along) / dot(along, along);
    for (value, along) in values.iter_mut().zip(along) {
        *value -= share * along;
    }
}
