//! The profile of an edge in a scanner's image.

use std::f64::consts::{FRAC_2_SQRT_PI, SQRT_2, TAU};

/// Distance from an edge, in standard deviations, from which on the profile is flat: all but 1e-8 of it.
pub const FLAT: f64 = 6.0;

/// Share of matter that a scanner finds at a distance outside a flat surface: 0.5 on the surface. `away` is in standard
/// deviations of the scanner's blur, negative inside.
pub fn share(away: f64) -> f64 {
    if away.abs() >= FLAT {
        return if away < 0.0 { 1.0 } else { 0.0 };
    }
    0.5 * (1.0 - error_function(away / SQRT_2))
}

/// Decrease of [`share`] per standard deviation.
pub fn steepness(away: f64) -> f64 {
    (-0.5 * away * away).exp() / TAU.sqrt()
}

/// The error function, by a series whose terms are all of one sign: no digits cancel.
pub fn error_function(x: f64) -> f64 {
    let mut term = x;
    let mut sum = x;
    let mut odd = 1.0;
    while term.abs() > 1e-17 * sum.abs() {
        odd += 2.0;
        term *= 2.0 * x * x / odd;
        sum += term;
    }
    FRAC_2_SQRT_PI * (-x * x).exp() * sum
}
