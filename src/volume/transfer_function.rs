//! Transfer functions: from values to colour and opacity.

use bevy::reflect::{Reflect, std_traits::ReflectDefault};
use serde::{Deserialize, Serialize};

use super::asset::Volume;
use super::otsu;
use super::transfer_function_error::TransferFunctionError;

/// Colour and opacity at one value.
#[derive(Reflect, Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[reflect(Debug, Clone, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct ControlPoint {
    /// The value, in the volume file's units.
    pub value: f32,
    /// Red, green and blue, 0 to 1, as displayed (sRGB-encoded).
    pub color: [f32; 3],
    /// Share of the light that is stopped over
    /// [`opacity_unit_distance_mm`](TransferFunction::opacity_unit_distance_mm), 0 to 1.
    pub opacity: f32,
}

/// Opacity factor at one length of the value's gradient.
#[derive(Reflect, Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[reflect(Debug, Clone, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct GradientPoint {
    /// Length of the value's gradient, in the volume file's units per millimetre.
    pub gradient: f32,
    /// Factor on the opacity, 0 to 1.
    pub opacity: f32,
}

/// Colour and opacity for every value: linear between control points, constant beyond the outermost.
///
/// The fields can be changed freely, as in an editor. Values that [`validate`](Self::validate) refuses cause
/// no panic, but may not look as intended.
#[derive(bevy::asset::Asset, Reflect, Clone, Debug, PartialEq, Serialize, Deserialize)]
#[reflect(Default, Debug, Clone, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct TransferFunction {
    /// Control points, sorted by value. Two points at one value make a step.
    pub points: Vec<ControlPoint>,
    /// Length of matter, mm, over which it has the opacity of the points.
    #[serde(default = "one")]
    pub opacity_unit_distance_mm: f32,
    /// Opacity by gradient, sorted by gradient, linear between points; empty if the gradient has no effect.
    ///
    /// This field is read and written, but not yet drawn.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub gradient_opacity: Vec<GradientPoint>,
}

fn one() -> f32 {
    1.0
}

impl Default for TransferFunction {
    /// White, transparent at 0 and opaque at 1.
    fn default() -> Self {
        let point = |value| ControlPoint { value, color: [1.0; 3], opacity: value };
        Self {
            points: vec![point(0.0), point(1.0)],
            opacity_unit_distance_mm: 1.0,
            gradient_opacity: Vec::new(),
        }
    }
}

impl TransferFunction {
    /// Makes a transfer function from points in any order; points of one value keep their order.
    ///
    /// # Errors
    ///
    /// As [`validate`](Self::validate), except for the order of points.
    pub fn new(
        mut points: Vec<ControlPoint>,
        opacity_unit_distance_mm: f32,
    ) -> Result<Self, TransferFunctionError> {
        points.sort_by(|a, b| a.value.total_cmp(&b.value));
        let function = Self { points, opacity_unit_distance_mm, gradient_opacity: Vec::new() };
        function.validate()?;
        Ok(function)
    }

    /// Makes a ramp of one colour (sRGB-encoded): opacity zero up to the value `from`, `opacity` beyond `to`, linear
    /// between them. The unit of length is one millimetre.
    ///
    /// # Errors
    ///
    /// As [`new`](Self::new). `from` may lie above `to`; low values are then opaque.
    pub fn ramp(from: f32, to: f32, opacity: f32, color: [f32; 3]) -> Result<Self, TransferFunctionError> {
        let point = |value, opacity| ControlPoint { value, color, opacity };
        Self::new(vec![point(from, 0.0), point(to, opacity)], 1.0)
    }

    /// Checks that all fields hold valid values.
    ///
    /// # Errors
    ///
    /// - [`TransferFunctionError::Empty`] without control points.
    /// - [`TransferFunctionError::Point`] for the first invalid point. Its value or gradient is not finite or is
    ///   below its predecessor's, or its colour or opacity is not from 0 to 1.
    /// - [`TransferFunctionError::UnitDistance`] if the unit of length is not finite and positive.
    pub fn validate(&self) -> Result<(), TransferFunctionError> {
        if self.points.is_empty() {
            return Err(TransferFunctionError::Empty);
        }
        let mut before = f32::NEG_INFINITY;
        for (index, point) in self.points.iter().enumerate() {
            check_order(index, "value", point.value, &mut before)?;
            let [red, green, blue] = point.color;
            for (field, share) in [("red", red), ("green", green), ("blue", blue), ("opacity", point.opacity)]
            {
                check_share(index, field, share)?;
            }
        }
        let mut before = f32::NEG_INFINITY;
        for (index, point) in self.gradient_opacity.iter().enumerate() {
            check_order(index, "gradient", point.gradient, &mut before)?;
            check_share(index, "gradient_opacity", point.opacity)?;
        }
        let unit = self.opacity_unit_distance_mm;
        if !unit.is_finite() || unit <= 0.0 {
            return Err(TransferFunctionError::UnitDistance(unit));
        }
        Ok(())
    }

    /// Red, green, blue (sRGB-encoded) and opacity at a value in file units.
    ///
    /// At a step, the result is that of the upper side. Without points it is all zero.
    pub fn sample(&self, value: f32) -> [f32; 4] {
        self.at(value.into())
    }

    /// [`sample`](Self::sample)s at `entries` evenly spaced values.
    ///
    /// The first and the last value are the ends of `range` (file units). A single entry is at the lower end.
    pub fn lookup_table(&self, range: [f64; 2], entries: usize) -> Vec<[f32; 4]> {
        let steps = entries.saturating_sub(1).max(1) as f64;
        let [low, high] = range;
        (0..entries)
            .map(|entry| {
                let t = entry as f64 / steps;
                self.at(low * (1.0 - t) + high * t)
            })
            .collect()
    }

    fn at(&self, value: f64) -> [f32; 4] {
        let colors = |point: &ControlPoint| {
            let [red, green, blue] = point.color;
            [red, green, blue, point.opacity]
        };
        let above = self.points.partition_point(|point| f64::from(point.value) <= value);
        let below = above.checked_sub(1).and_then(|below| self.points.get(below));
        match (below, self.points.get(above)) {
            (Some(a), Some(b)) => mix([a.value.into(), b.value.into()], [colors(a), colors(b)], value),
            (Some(only), None) | (None, Some(only)) => colors(only),
            (None, None) => [0.0; 4],
        }
    }

    /// The lowest value, in file units, at which the opacity reaches half of its maximum.
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

    /// Makes a first transfer function for a volume of unknown content.
    ///
    /// Otsu's threshold splits the volume's histogram best in two. Values above it become opaque, in the colour
    /// of bone.
    pub fn for_volume(volume: &Volume) -> Self {
        let [low, high] = volume.range();
        let threshold = volume.to_file_units(otsu::threshold(volume));
        // A tenth of the range is soft enough to show no steps. A volume of one value has no range.
        let half = match (high - low) / 20.0 {
            0.0 => 0.5,
            half => half,
        };
        let clamp = |value: f64| value.clamp(f32::MIN.into(), f32::MAX.into()) as f32;
        let spacing = volume.spacing_mm().min_element();
        Self {
            points: vec![
                ControlPoint { value: clamp(threshold - half), color: [0.62, 0.42, 0.30], opacity: 0.0 },
                ControlPoint { value: clamp(threshold + half), color: [0.95, 0.89, 0.78], opacity: 0.9 },
            ],
            opacity_unit_distance_mm: spacing,
            gradient_opacity: Vec::new(),
        }
    }
}

/// Checks that a point's value is finite and not below `before`, then stores it in `before`.
fn check_order(
    index: usize,
    field: &'static str,
    value: f32,
    before: &mut f32,
) -> Result<(), TransferFunctionError> {
    let error = |reason| Err(TransferFunctionError::Point { index, field, value, reason });
    if !value.is_finite() {
        return error("must be finite");
    }
    if value < *before {
        return error("must not be below the one before");
    }
    *before = value;
    Ok(())
}

fn check_share(index: usize, field: &'static str, value: f32) -> Result<(), TransferFunctionError> {
    if (0.0..=1.0).contains(&value) {
        return Ok(());
    }
    Err(TransferFunctionError::Point { index, field, value, reason: "must be from 0 to 1" })
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
