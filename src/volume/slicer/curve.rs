//! VTK's curves between the nodes of a function, as piecewise linear functions.

use super::nodes::Node;
use crate::volume::transfer_function_samples::mix;

/// Linear pieces of a curve: within 2.3 % of its height, by comparison over all sharpnesses.
const PIECES: u32 = 16;

/// A node with the shape of the curve up to the next one.
#[derive(Clone, Copy)]
pub(super) struct Knot<const N: usize> {
    pub(super) value: f32,
    pub(super) outputs: [f32; N],
    /// Place between the two nodes at which the curve is half way, 0 to 1.
    pub(super) midpoint: f64,
    /// Sharpness of the curve, from 0 (a straight line) to 1 (a step).
    pub(super) sharpness: f64,
}

/// Turns knots in any order into nodes of a piecewise linear function, sorted by value, with steps kept.
pub(super) fn straighten<const N: usize>(mut knots: Vec<Knot<N>>) -> Vec<Node<N>> {
    knots.sort_by(|a, b| a.value.total_cmp(&b.value));
    let mut nodes = Vec::new();
    for (index, knot) in knots.iter().enumerate() {
        nodes.push((knot.value, knot.outputs));
        if let Some(next) = knots.get(index + 1) {
            bend(knot, next, &mut nodes);
        }
    }
    nodes
}

/// Adds the nodes between two knots.
fn bend<const N: usize>(knot: &Knot<N>, next: &Knot<N>, nodes: &mut Vec<Node<N>>) {
    let (from, to) = (f64::from(knot.value), f64::from(next.value));
    let mut node = |place: f64, height: f64| {
        let value = (from + place * (to - from)) as f32;
        nodes.push((value, mix([0.0, 1.0], [knot.outputs, next.outputs], height)));
    };
    // As in vtkPiecewiseFunction.
    let midpoint = knot.midpoint.clamp(1e-5, 1.0 - 1e-5);
    let sharpness = knot.sharpness;
    if to <= from || (sharpness < 0.01 && midpoint == 0.5) {
        return;
    }
    if sharpness < 0.01 {
        return node(midpoint, 0.5);
    }
    if sharpness > 0.99 {
        node(midpoint, 0.0);
        return node(midpoint, 1.0);
    }
    let exponent = 1.0 / (1.0 + 10.0 * sharpness);
    for piece in 1..PIECES {
        // VTK warps a place, and its curve is smooth in the warped place: the steps are equal there.
        let warped = f64::from(piece) / f64::from(PIECES);
        let place = if warped < 0.5 {
            midpoint * (2.0 * warped).powf(exponent)
        } else {
            1.0 - (1.0 - midpoint) * (2.0 * (1.0 - warped)).powf(exponent)
        };
        let (square, cube) = (warped * warped, warped * warped * warped);
        // A Hermite curve from 0 to 1 with the same slope at both ends.
        let height = 3.0 * square - 2.0 * cube + (1.0 - sharpness) * (2.0 * cube - 3.0 * square + warped);
        node(place, height.clamp(0.0, 1.0));
    }
}
