//! Why there is no transfer function.

/// Why values or a text make no transfer function.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TransferFunctionError {
    /// There are no control points.
    #[error("there are no control points")]
    Empty,
    /// A control point, or one of the gradient's opacity, cannot be used.
    #[error("control point {index}: {field} is {value}, {reason}")]
    Point {
        /// Which one, counted from zero.
        index: usize,
        /// Which of its fields.
        field: &'static str,
        /// The field's value.
        value: f32,
        /// What it should be.
        reason: &'static str,
    },
    /// The opacity's unit of length is not a positive number.
    #[error("opacity_unit_distance_mm is {0}, must be finite and positive")]
    UnitDistance(f32),
    /// The file or text is something else.
    #[error(
        "{found}, not a transfer function: those of 3D Slicer (.vp, .vp.json) and in RON (.tf.ron) can be read"
    )]
    NotATransferFunction {
        /// What it seems to be, with its article.
        found: &'static str,
    },
    /// The text is not RON, or not that of a transfer function.
    #[error("not a transfer function in RON: {0}")]
    Ron(#[from] ron::error::SpannedError),
    /// The transfer function could not be written as RON.
    #[error("cannot be written as RON: {0}")]
    WriteRon(#[from] ron::Error),
    /// The text is not a Slicer volume property in JSON.
    #[cfg(feature = "slicer")]
    #[error("not a volume property of 3D Slicer: {0}")]
    SlicerJson(#[from] serde_json::Error),
    /// The text is not a Slicer volume property in lines.
    #[error("line {line}: {field}: {reason}")]
    Slicer {
        /// The line at fault, counted from one.
        line: usize,
        /// What was to be read there.
        field: &'static str,
        /// What is wrong with it.
        reason: String,
    },
}
