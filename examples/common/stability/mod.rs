//! How steady and how exact clipping is where such methods fail, as figures. Each is a case with a
//! bound; the tests run them short, `measure --stability` long.

mod changes;
pub mod inside_test;
pub mod motion;
pub mod resolution;
pub mod soak;
pub mod walks;

use bevy_contextual_ao::prelude::*;
use serde_json::{Value, json};

/// One figure.
#[derive(Clone, Debug)]
pub struct Figure {
    /// What is looked at.
    pub case: String,
    /// By which method.
    pub method: String,
    /// What is measured.
    pub figure: &'static str,
    /// The unit of the value and the bound.
    pub unit: &'static str,
    /// What the value must not exceed, where there is such a bound.
    pub bound: Option<f64>,
    /// What was measured.
    pub value: f64,
}

impl Figure {
    /// Whether the value keeps within its bound.
    pub fn holds(&self) -> bool {
        self.bound.is_none_or(|bound| self.value <= bound)
    }

    /// As a line of JSON.
    pub fn to_json(&self) -> Value {
        let Self { case, method, figure, unit, bound, value } = self;
        json!({ "case": case, "method": method, "figure": figure, "unit": unit, "bound": bound, "value": value })
    }
}

/// The name of a coverage rule in figures.
pub fn rule_name(rule: CoverageRule) -> &'static str {
    match rule {
        CoverageRule::Lines => "lines",
        CoverageRule::Points => "published 9 + 32",
        CoverageRule::Center => "centre",
    }
}

/// Runs all cases in full length, and hands out each figure as it comes.
pub fn run_all(mut report: impl FnMut(Figure)) {
    motion::sweeps(64, &mut report);
    motion::coverage_errors(400, &mut report);
    motion::tremors(200, &mut report);
    inside_test::shapes(48, &mut report);
    resolution::table(&[128, 256, 512, 1024, 2048], 300, &mut report);
    walks::paths(200, &mut report);
    soak::run(10_000, &mut report);
}
