//! 3D Slicer's volume property files (`.vp`).
//!
//! Six numbers for interpolation and shading, then three functions: scalar opacity, gradient opacity,
//! colour. Each begins with how many numbers follow: two (value, opacity) or four (value, red, green,
//! blue) per node. Slicer writes one entry per line; what follows `=>` on a line is an explanation,
//! as in its manual's example.

use super::transfer_function::{ControlPoint, TransferFunctionError, mix};

/// The numbers before the first function.
const SETTINGS: [&str; 6] =
    ["interpolation type", "shade", "diffuse", "ambient", "specular", "specular power"];

/// The control points of a volume property: one at every node of its opacity and colour functions.
pub(super) fn control_points(text: &str) -> Result<Vec<ControlPoint>, TransferFunctionError> {
    let mut words = Words::new(text);
    for setting in SETTINGS {
        words.number(setting)?;
    }
    let opacities = words.function("scalar opacity")?;
    words.function::<1>("gradient opacity")?;
    let colors = words.function("color")?;
    Ok(merge(&opacities, &colors))
}

/// A node of a piecewise linear function with `N` outputs.
type Node<const N: usize> = (f32, [f32; N]);

struct Words<'a> {
    words: Vec<(usize, &'a str)>,
    next: usize,
    last_line: usize,
}

impl<'a> Words<'a> {
    fn new(text: &'a str) -> Self {
        let lines = text.lines().enumerate();
        let words = lines.flat_map(|(index, line)| {
            let line = line.split("=>").next().unwrap_or_default();
            line.split_whitespace().map(move |word| (index + 1, word))
        });
        Self { words: words.collect(), next: 0, last_line: text.lines().count().max(1) }
    }

    /// The next number, or why there is none.
    fn number(&mut self, field: &'static str) -> Result<f32, TransferFunctionError> {
        let Some(&(line, word)) = self.words.get(self.next) else {
            return Err(TransferFunctionError::Slicer {
                line: self.last_line,
                field,
                reason: "the file ends before".into(),
            });
        };
        self.next += 1;
        match word.parse::<f32>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(TransferFunctionError::Slicer {
                line,
                field,
                reason: format!("{:?} is no number", word.chars().take(40).collect::<String>()),
            }),
        }
    }

    /// The next function: how many numbers it has, then its nodes. Sorted by value, steps kept.
    fn function<const N: usize>(
        &mut self,
        field: &'static str,
    ) -> Result<Vec<Node<N>>, TransferFunctionError> {
        let line = self.words.get(self.next).map_or(self.last_line, |word| word.0);
        let count = self.number(field)?;
        let each = N + 1;
        let left = self.words.len() - self.next;
        let numbers = count as usize;
        if numbers as f32 != count || numbers > left || !numbers.is_multiple_of(each) {
            return Err(TransferFunctionError::Slicer {
                line,
                field,
                reason: format!("{count} is not how many numbers follow, {each} per node: {left} are left"),
            });
        }
        let mut nodes = Vec::new();
        for _ in 0..numbers / each {
            let value = self.number(field)?;
            let mut outputs = [0.0; N];
            for output in &mut outputs {
                *output = self.number(field)?;
            }
            nodes.push((value, outputs));
        }
        nodes.sort_by(|a: &Node<N>, b| a.0.total_cmp(&b.0));
        Ok(nodes)
    }
}

/// One control point wherever either function has a node, two where one of them has a step.
fn merge(opacities: &[Node<1>], colors: &[Node<3>]) -> Vec<ControlPoint> {
    let mut values: Vec<f32> = opacities.iter().map(|node| node.0).collect();
    values.extend(colors.iter().map(|node| node.0));
    values.sort_by(f32::total_cmp);
    values.dedup();
    let mut points = Vec::new();
    for value in values {
        let side = |upper: bool| ControlPoint {
            value,
            // A property without colours is white, one without opacities clear.
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

/// A function at a value, constant beyond its outermost nodes; at a step its lower or upper side.
fn evaluate<const N: usize>(nodes: &[Node<N>], value: f32, upper: bool) -> Option<[f32; N]> {
    let above = nodes.partition_point(|node| node.0 < value || (upper && node.0 == value));
    let below = above.checked_sub(1).and_then(|below| nodes.get(below));
    match (below, nodes.get(above)) {
        (Some(a), Some(b)) => Some(mix([a.0.into(), b.0.into()], [a.1, b.1], value.into())),
        (Some(only), None) | (None, Some(only)) => Some(only.1),
        (None, None) => None,
    }
}
