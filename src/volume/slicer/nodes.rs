//! Piecewise linear functions, and their conversion to a transfer function.

use crate::volume::transfer_function::{ControlPoint, GradientPoint, GradientUnit, TransferFunction};
use crate::volume::transfer_function_samples::between;

/// A node of a piecewise linear function with `N` outputs.
pub(super) type Node<const N: usize> = (f32, [f32; N]);

/// The functions of a volume property, each sorted by value. Two nodes of one value make a step.
pub(super) struct Functions {
    pub(super) opacity: Vec<Node<1>>,
    pub(super) gradient_opacity: Vec<Node<1>>,
    pub(super) color: Vec<Node<3>>,
    pub(super) opacity_unit_distance_mm: f32,
}

impl Functions {
    /// Converts the functions to a transfer function, which is not validated.
    pub(super) fn transfer_function(&self) -> TransferFunction {
        let gradient_point = |&(gradient, [opacity]): &Node<1>| GradientPoint { gradient, opacity };
        TransferFunction {
            points: merge(&self.opacity, &self.color),
            opacity_unit_distance_mm: self.opacity_unit_distance_mm,
            gradient_opacity: self.gradient_opacity.iter().map(gradient_point).collect(),
            at_gradients: Vec::new(),
            gradient_unit: GradientUnit::PerVoxel,
        }
    }
}

/// Makes one control point at every node of either function, and two where a function has a step.
fn merge(opacities: &[Node<1>], colors: &[Node<3>]) -> Vec<ControlPoint> {
    let mut values: Vec<f32> = opacities.iter().map(|node| node.0).collect();
    values.extend(colors.iter().map(|node| node.0));
    values.sort_by(f32::total_cmp);
    values.dedup();
    let mut points = Vec::new();
    for value in values {
        let side = |upper: bool| ControlPoint {
            value,
            // A property without colours is white, a property without opacities transparent.
            color: evaluate(colors, value, upper).unwrap_or([1.0; 3]),
            opacity: evaluate(opacities, value, upper).map_or(0.0, |[opacity]| opacity),
        };
        let (lower, upper) = (side(false), side(true));
        points.push(lower);
        if lower != upper {
            points.push(upper);
        }
    }
    points
}

/// Evaluates a function, constant beyond its outermost nodes. At a step, `upper` chooses the side.
fn evaluate<const N: usize>(nodes: &[Node<N>], value: f32, upper: bool) -> Option<[f32; N]> {
    let above = nodes.partition_point(|node| node.0 < value || (upper && node.0 == value));
    let below = above.checked_sub(1).and_then(|below| nodes.get(below));
    let place = |node: &Node<N>| (f64::from(node.0), node.1);
    between(below.map(place), nodes.get(above).map(place), value.into())
}
