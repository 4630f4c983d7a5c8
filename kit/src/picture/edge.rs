//! The profile of an edge in a scanner's image.

use std::{
    f64::consts::{FRAC_2_SQRT_PI, SQRT_2, TAU},
    sync::LazyLock,
};

/// Distance from an edge, in standard deviations, from which on the profile is flat: all but 1e-9 of it.
const FLAT: f64 = 6.0;
/// Entries of the profile's table per standard deviation: the cubics between them are off by 2e-11.
const DENSITY: f64 = 128.0;

/// The profile from `-FLAT` on, with one entry beyond `FLAT`.
static PROFILE: LazyLock<Vec<f64>> = LazyLock::new(|| {
    let of = |k: u32| 0.5 - 0.5 * error_function((f64::from(k) / DENSITY - FLAT) / SQRT_2);
    (0..=(2.0 * FLAT * DENSITY) as u32 + 1).map(of).collect()
});

/// Share of matter that a scanner finds at a distance outside a flat surface: 0.5 on the surface. `away` is in standard
/// deviations of the scanner's blur, negative inside.
pub fn share(away: f64) -> f64 {
    if away.abs() >= FLAT {
        return if away < 0.0 { 1.0 } else { 0.0 };
    }
    let place = (away + FLAT) * DENSITY;
    let (below, t) = (place as usize, place.fract());
    let (a, b) = (PROFILE[below], PROFILE[below + 1]);
    let slope = |at: f64| -steepness(at) / DENSITY;
    let (from, to) = (slope(away - t / DENSITY), slope(away + (1.0 - t) / DENSITY));
    // The cubic with these ends and slopes.
    let rise = b - a;
    a + t * (from + t * (3.0 * rise - 2.0 * from - to + t * (from + to - 2.0 * rise)))
}

/// Distance at which [`share`] has fallen to a value, standard deviations.
pub fn distance_of(share_there: f64) -> f64 {
    let (mut low, mut high) = (-FLAT, FLAT);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        (low, high) = if share(middle) > share_there { (middle, high) } else { (low, middle) };
    }
    high
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
