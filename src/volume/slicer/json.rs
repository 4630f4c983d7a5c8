//! Volume properties in JSON (`.vp.json`), by Slicer's schema `volume-property-schema-v1.0.0.json`.
//!
//! Fields that the schema asks for may be missing if Slicer has defaults for them. Other fields are ignored.

use serde::{Deserialize, de::Error};

use super::curve::{Knot, straighten};
use super::nodes::Functions;
use crate::volume::transfer_function::TransferFunction;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct File {
    volume_properties: Vec<Property>,
}

#[derive(Deserialize)]
struct Property {
    components: Vec<Component>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Component {
    #[serde(default)]
    disable_gradient_opacity: bool,
    /// Millimetres.
    #[serde(default = "one")]
    scalar_opacity_unit_distance: f32,
    #[serde(default)]
    scalar_opacity: Function<Point>,
    #[serde(default)]
    gradient_opacity: Function<Point>,
    #[serde(default)]
    rgb_transfer_function: Function<ColorPoint>,
}

#[derive(Deserialize)]
struct Function<P> {
    points: Vec<P>,
}

impl<P> Default for Function<P> {
    fn default() -> Self {
        Self { points: Vec::new() }
    }
}

#[derive(Deserialize)]
struct Point {
    x: f32,
    y: f32,
    #[serde(default = "half")]
    midpoint: f64,
    #[serde(default)]
    sharpness: f64,
}

#[derive(Deserialize)]
struct ColorPoint {
    x: f32,
    color: [f32; 3],
    #[serde(default = "half")]
    midpoint: f64,
    #[serde(default)]
    sharpness: f64,
}

fn one() -> f32 {
    1.0
}

fn half() -> f64 {
    0.5
}

/// Whether a text looks like JSON with volume properties.
pub(in crate::volume) fn is_json(text: &str) -> bool {
    text.trim_start().starts_with('{') && text.contains("\"volumeProperties\"")
}

/// Reads the first component of the first volume property, as Slicer shows an image of one component.
pub(super) fn read(text: &str) -> Result<TransferFunction, serde_json::Error> {
    let file: File = serde_json::from_str(text)?;
    let component = file.volume_properties.into_iter().next().and_then(|it| it.components.into_iter().next());
    let component = component.ok_or_else(|| serde_json::Error::custom("it has no component"))?;
    let gradients =
        if component.disable_gradient_opacity { Vec::new() } else { component.gradient_opacity.points };
    let functions = Functions {
        opacity: straighten(component.scalar_opacity.points.into_iter().map(Knot::from).collect()),
        gradient_opacity: straighten(gradients.into_iter().map(Knot::from).collect()),
        color: straighten(component.rgb_transfer_function.points.into_iter().map(Knot::from).collect()),
        opacity_unit_distance_mm: component.scalar_opacity_unit_distance,
    };
    Ok(functions.transfer_function())
}

impl From<Point> for Knot<1> {
    fn from(Point { x, y, midpoint, sharpness }: Point) -> Self {
        Self { value: x, outputs: [y], midpoint, sharpness }
    }
}

impl From<ColorPoint> for Knot<3> {
    fn from(ColorPoint { x, color, midpoint, sharpness }: ColorPoint) -> Self {
        Self { value: x, outputs: color, midpoint, sharpness }
    }
}
