//! A report of measurements: figures in sections, written as Markdown to read and as comma-separated values to compute
//! with.

mod csv;
mod markdown;

pub use csv::to_csv;
pub use markdown::to_markdown;

/// Measurements of one machine.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// Title of the report.
    pub title: String,
    /// Names and values that describe the machine and the program.
    pub machine: Vec<(&'static str, String)>,
    /// Sections, in the order in which they were measured.
    pub sections: Vec<Section>,
}

/// Figures that belong together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Section {
    /// Name of the section. No other section of a report has it.
    pub name: &'static str,
    /// What is measured, in whole sentences.
    pub about: String,
    /// The figures, case by case.
    pub rows: Vec<Row>,
    /// Cases that were not measured.
    pub left_out: Vec<LeftOut>,
    /// Error that ended the section. Rows before it stay.
    pub error: Option<String>,
    /// Seconds that the section took; 0 if nothing was measured.
    pub seconds: f64,
}

/// One figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Name of the measured case.
    pub case: String,
    /// Name of the figure. A case has it once.
    pub figure: String,
    /// Unit of both values.
    pub unit: &'static str,
    /// Measured value.
    pub measured: f64,
    /// Value that a model predicts, if it says anything about the figure.
    pub predicted: Option<f64>,
}

/// A case that was not measured.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LeftOut {
    /// Name of the case.
    pub case: String,
    /// Reason why it was not measured.
    pub reason: String,
}
