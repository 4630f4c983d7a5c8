//! Transfer functions: from values to colour and opacity.

use bevy::{
    math::Vec3,
    reflect::{Reflect, std_traits::ReflectDefault},
};
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

/// Unit of lengths of the value's gradient.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[reflect(Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum GradientUnit {
    /// File units per millimetre: volumes of any resolution show the same.
    #[default]
    PerMm,
    /// File units per voxel, whose length is the mean of its three sides: as VTK and 3D Slicer measure.
    PerVoxel,
}

impl GradientUnit {
    /// The unit's length, mm, in a volume with this spacing of voxels.
    pub fn mm(self, spacing_mm: Vec3) -> f32 {
        match self {
            Self::PerMm => 1.0,
            Self::PerVoxel => spacing_mm.element_sum() / 3.0,
        }
    }
}

/// Opacity factor at one length of the value's gradient.
#[derive(Reflect, Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[reflect(Debug, Clone, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct GradientPoint {
    /// Length of the value's gradient, in [`TransferFunction::gradient_unit`].
    pub gradient: f32,
    /// Factor on the opacity, 0 to 1.
    pub opacity: f32,
}

/// Control points for longer gradients of the value.
#[derive(Reflect, Clone, Debug, PartialEq, Serialize, Deserialize)]
#[reflect(Debug, Clone, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct PointsAtGradient {
    /// Length of the value's gradient up to which the points have no effect, in [`TransferFunction::gradient_unit`].
    pub from: f32,
    /// Length from which on they alone count. Between the two, colour and opacity change evenly.
    pub to: f32,
    /// Control points, sorted by value.
    pub points: Vec<ControlPoint>,
}

/// Colour and opacity for every value: linear between control points, constant beyond the outermost.
///
/// The length of the value's gradient may have a say too: it is short inside matter, and long where one kind of matter
/// meets another (Kniss, Kindlmann and Hansen 2002). [`gradient_opacity`](Self::gradient_opacity) is a factor for
/// all values, and [`at_gradients`](Self::at_gradients) has other points for longer gradients.
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
    /// Factor on the opacity by gradient, sorted by gradient, linear between points. Empty: 1.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub gradient_opacity: Vec<GradientPoint>,
    /// Control points that take over for longer gradients, one after the other.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub at_gradients: Vec<PointsAtGradient>,
    /// Unit of both.
    #[serde(default, skip_serializing_if = "is_default")]
    pub gradient_unit: GradientUnit,
}

fn is_default(unit: &GradientUnit) -> bool {
    *unit == GradientUnit::default()
}

fn one() -> f32 {
    1.0
}

impl Default for TransferFunction {
    /// White, transparent at 0 and opaque at 1.
    fn default() -> Self {
        let point = |value| ControlPoint { value, color: [1.0; 3], opacity: value };
        Self::of_values(vec![point(0.0), point(1.0)], 1.0)
    }
}

impl TransferFunction {
    /// A function of the value alone, not validated.
    pub(super) fn of_values(points: Vec<ControlPoint>, opacity_unit_distance_mm: f32) -> Self {
        Self {
            points,
            opacity_unit_distance_mm,
            gradient_opacity: Vec::new(),
            at_gradients: Vec::new(),
            gradient_unit: GradientUnit::default(),
        }
    }

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
        let function = Self::of_values(points, opacity_unit_distance_mm);
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
    ///   below its predecessor's, or its colour or opacity is not from 0 to 1. A range of gradients counts as a point.
    /// - [`TransferFunctionError::AtGradients`] with the error of the first invalid points for longer gradients.
    /// - [`TransferFunctionError::UnitDistance`] if the unit of length is not finite and positive.
    pub fn validate(&self) -> Result<(), TransferFunctionError> {
        check_points(&self.points)?;
        let mut before = f32::NEG_INFINITY;
        for (index, point) in self.gradient_opacity.iter().enumerate() {
            check_order(index, "gradient", point.gradient, &mut before)?;
            check_share(index, "gradient_opacity", point.opacity)?;
        }
        for (index, at) in self.at_gradients.iter().enumerate() {
            let mut before = 0.0;
            check_order(index, "from", at.from, &mut before)?;
            check_order(index, "to", at.to, &mut before)?;
            let error = |error| TransferFunctionError::AtGradients { index, error: Box::new(error) };
            check_points(&at.points).map_err(error)?;
        }
        let unit = self.opacity_unit_distance_mm;
        if !unit.is_finite() || unit <= 0.0 {
            return Err(TransferFunctionError::UnitDistance(unit));
        }
        Ok(())
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
        let points = vec![
            ControlPoint { value: clamp(threshold - half), color: [0.62, 0.42, 0.30], opacity: 0.0 },
            ControlPoint { value: clamp(threshold + half), color: [0.95, 0.89, 0.78], opacity: 0.9 },
        ];
        Self::of_values(points, spacing)
    }
}

/// Checks that control points hold valid values, in order.
fn check_points(points: &[ControlPoint]) -> Result<(), TransferFunctionError> {
    if points.is_empty() {
        return Err(TransferFunctionError::Empty);
    }
    let mut before = f32::NEG_INFINITY;
    for (index, point) in points.iter().enumerate() {
        check_order(index, "value", point.value, &mut before)?;
        let [red, green, blue] = point.color;
        for (field, share) in [("red", red), ("green", green), ("blue", blue), ("opacity", point.opacity)] {
            check_share(index, field, share)?;
        }
    }
    Ok(())
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
