//! Values of transfer functions.

use super::transfer_function::{ControlPoint, GradientPoint, TransferFunction};

impl TransferFunction {
    /// Red, green, blue (sRGB-encoded) and opacity of [`points`](Self::points) at a value in file units.
    ///
    /// At a step, the result is that of the upper side. Without points it is all zero.
    pub fn sample(&self, value: f32) -> [f32; 4] {
        sample_points(&self.points, value.into())
    }

    /// Red, green, blue (sRGB-encoded) and opacity at a value in file units, where the value's gradient has a length in
    /// [`gradient_unit`](Self::gradient_unit).
    pub fn sample_at(&self, value: f32, gradient: f32) -> [f32; 4] {
        // Not a number counts as 0.
        let gradient = gradient.max(0.0);
        let acting = self.at_gradients.iter().filter(|at| at.from <= gradient);
        let [red, green, blue, opacity] = acting.fold(self.sample(value), |before, at| {
            let range = [at.from, at.to].map(f64::from);
            mix(range, [before, sample_points(&at.points, value.into())], gradient.into())
        });
        [red, green, blue, opacity * self.opacity_factor(gradient)]
    }

    /// Factor on the opacity where the gradient has a length in its unit.
    fn opacity_factor(&self, gradient: f32) -> f32 {
        let points = &self.gradient_opacity;
        let node = |point: &GradientPoint| (f64::from(point.gradient), [point.opacity]);
        let above = points.partition_point(|point| point.gradient <= gradient);
        let below = above.checked_sub(1).and_then(|below| points.get(below));
        let [factor] =
            between(below.map(node), points.get(above).map(node), gradient.into()).unwrap_or([1.0]);
        factor
    }

    /// Length of the gradient, in [`gradient_unit`](Self::gradient_unit), beyond which nothing changes. `None` if the gradient has no
    /// effect.
    pub fn last_gradient(&self) -> Option<f32> {
        let factors = self.gradient_opacity.iter();
        let has_factors = factors.clone().any(|point| point.opacity != 1.0);
        let factors = factors.filter(|_| has_factors).map(|point| point.gradient);
        let last = factors.chain(self.at_gradients.iter().map(|at| at.to)).reduce(f32::max);
        // A factor at or below 0 alone holds for all gradients.
        last.map(|last| last.max(f32::MIN_POSITIVE))
    }

    /// All control points, whatever the gradient.
    pub(super) fn all_points(&self) -> impl Iterator<Item = &ControlPoint> {
        self.points.iter().chain(self.at_gradients.iter().flat_map(|at| &at.points))
    }

    /// [`sample`](Self::sample) at `entries` evenly spaced values.
    ///
    /// The first and the last value are the ends of `range` (file units). A single entry is at the lower end.
    pub fn lookup_table(&self, range: [f64; 2], entries: usize) -> Vec<[f32; 4]> {
        let steps = entries.saturating_sub(1).max(1) as f64;
        let [low, high] = range;
        (0..entries)
            .map(|entry| {
                let t = entry as f64 / steps;
                sample_points(&self.points, low * (1.0 - t) + high * t)
            })
            .collect()
    }

    /// The lowest value, in file units, at which the opacity of [`points`](Self::points) reaches half of its maximum.
    ///
    /// It is an isovalue for a surface about where the eye sees one. `None` if the function is transparent everywhere.
    pub fn isovalue(&self) -> Option<f32> {
        let half = 0.5 * self.points.iter().map(|point| point.opacity).fold(0.0, f32::max);
        let index = self.points.iter().position(|point| half > 0.0 && point.opacity >= half)?;
        let reached = &self.points[index];
        let Some(before) = index.checked_sub(1).map(|before| &self.points[before]) else {
            return Some(reached.value);
        };
        let share = (half - before.opacity) / (reached.opacity - before.opacity);
        Some(before.value + share * (reached.value - before.value))
    }
}

/// Colour and opacity of sorted points at a value; all zero without points.
fn sample_points(points: &[ControlPoint], value: f64) -> [f32; 4] {
    let node = |point: &ControlPoint| {
        let [red, green, blue] = point.color;
        (f64::from(point.value), [red, green, blue, point.opacity])
    };
    let above = points.partition_point(|point| f64::from(point.value) <= value);
    let below = above.checked_sub(1).and_then(|below| points.get(below));
    between(below.map(node), points.get(above).map(node), value).unwrap_or_default()
}

/// A place of a piecewise linear function, with its outputs there.
pub(super) type Place<const N: usize> = (f64, [f32; N]);

/// The function between two places; constant where one is missing.
pub(super) fn between<const N: usize>(
    below: Option<Place<N>>,
    above: Option<Place<N>>,
    at: f64,
) -> Option<[f32; N]> {
    match (below, above) {
        (Some(a), Some(b)) => Some(mix([a.0, b.0], [a.1, b.1], at)),
        (Some(only), None) | (None, Some(only)) => Some(only.1),
        (None, None) => None,
    }
}

/// Interpolates linearly between two nodes; exact at both.
pub(super) fn mix<const N: usize>(at: [f64; 2], outputs: [[f32; N]; 2], value: f64) -> [f32; N] {
    let width = at[1] - at[0];
    let t = if width > 0.0 { ((value - at[0]) / width).clamp(0.0, 1.0) } else { 1.0 };
    std::array::from_fn(|index| {
        let [a, b] = outputs.map(|output| f64::from(output[index]));
        (a * (1.0 - t) + b * t) as f32
    })
}
