//! Figures of how steady and exact clipping is in cases where similar methods fail. A figure may have a bound. Tests
//! run the cases short, `measure --stability` runs them long.

mod changes;
pub mod inside_test;
pub mod methods;
pub mod motion;
pub mod resolution;
pub mod soak;
pub mod walks;

use bevy_contextual_ao::prelude::*;
use clap::ValueEnum;
use serde_json::{Value, json};

/// A measured value of one case and method.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Name of the case.
    pub case: String,
    /// Name of the method.
    pub method: String,
    /// Name of the measured quantity.
    pub figure: &'static str,
    /// The unit of the value and the bound.
    pub unit: &'static str,
    /// Largest value that is allowed, if there is a bound.
    pub bound: Option<f64>,
    /// The measured value.
    pub value: f64,
}

impl Figure {
    /// Whether the value keeps within its bound.
    pub fn holds(&self) -> bool {
        self.bound.is_none_or(|bound| self.value <= bound)
    }

    /// The figure as a line of JSON.
    pub fn to_json(&self) -> Value {
        let Self { case, method, figure, unit, bound, value } = self;
        json!({ "case": case, "method": method, "figure": figure, "unit": unit, "bound": bound, "value": value })
    }
}

/// Name of a coverage rule in figures.
pub fn rule_name(rule: CoverageRule) -> &'static str {
    match rule {
        CoverageRule::Lines => "lines",
        CoverageRule::Points => "published 9 + 32",
        _ => "centre",
    }
}

/// Runs the cases in full length, all or those of one group. Reports each figure as it comes.
pub fn run(group: Option<Group>, mut report: impl FnMut(Figure)) {
    for one in Group::value_variants().iter().filter(|one| group.is_none_or(|group| group == **one)) {
        let report = &mut report;
        match one {
            Group::Sweep => motion::sweeps(64, report),
            Group::Coverage => motion::coverage_errors(400, report),
            Group::Tremor => motion::tremors(200, report),
            Group::Inside => inside_test::shapes(48, report),
            Group::Resolution => resolution::table(&[128, 256, 512, 1024, 2048], 300, report),
            Group::Walk => walks::paths(200, report),
            Group::Methods => methods::table(report),
            Group::Soak => soak::run(10_000, report),
        }
    }
}

/// A group of cases that can be run by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Group {
    /// Carvers that move by 1/32 voxel a frame.
    Sweep,
    /// Coverage against the exact share.
    Coverage,
    /// The noise of a tracked hand.
    Tremor,
    /// Concave meshes against an exact inside test.
    Inside,
    /// Sizes of the clip maps.
    Resolution,
    /// Random walks against a fresh start.
    Walk,
    /// Where methods of ambient occlusion fail.
    Methods,
    /// 10,000 frames of random changes.
    Soak,
}
