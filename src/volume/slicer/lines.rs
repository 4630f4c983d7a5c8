//! Volume properties in lines (`.vp`).
//!
//! The file has six numbers for interpolation and shading, then three functions: scalar opacity, gradient
//! opacity, colour. Each function begins with the count of its numbers. A node has two numbers (value,
//! opacity) or four (value, red, green, blue). Slicer writes one entry per line. Text after `=>` on a line is
//! an explanation, as in the manual's example.

use super::nodes::{Functions, Node};
use crate::volume::{transfer_function::TransferFunction, transfer_function_error::TransferFunctionError};

/// The numbers before the first function.
const SETTINGS: [&str; 6] =
    ["interpolation type", "shade", "diffuse", "ambient", "specular", "specular power"];

/// Reads a volume property. The format has no unit of length; the unit is 1 mm.
pub(super) fn read(text: &str) -> Result<TransferFunction, TransferFunctionError> {
    let mut words = Words::new(text);
    for setting in SETTINGS {
        words.number(setting)?;
    }
    let functions = Functions {
        opacity: words.function("scalar opacity")?,
        gradient_opacity: words.function("gradient opacity")?,
        color: words.function("color")?,
        opacity_unit_distance_mm: 1.0,
    };
    Ok(functions.transfer_function())
}

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

    /// Reads the next number.
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

    /// Reads the next function: the count of its numbers, then its nodes. They are sorted by value, with steps kept.
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
