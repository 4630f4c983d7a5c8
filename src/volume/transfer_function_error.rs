//! Errors of transfer functions.

/// Reason why values or a text make no transfer function.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TransferFunctionError {
    /// There are no control points.
    #[error("there are no control points")]
    Empty,
    /// A control point, or a point of the gradient opacity, cannot be used.
    #[error("control point {index}: {field} is {value}, {reason}")]
    Point {
        /// Index of the point, from zero.
        index: usize,
        /// Name of the point's field.
        field: &'static str,
        /// The field's value.
        value: f32,
        /// Condition that the value does not meet.
        reason: &'static str,
    },
    /// The points for longer gradients cannot be used.
    #[error("at_gradients {index}: {error}")]
    AtGradients {
        /// Index in [`TransferFunction::at_gradients`](super::TransferFunction::at_gradients), from zero.
        index: usize,
        /// Reason why they cannot be used.
        error: Box<TransferFunctionError>,
    },
    /// The opacity's unit of length is not a positive number.
    #[error("opacity_unit_distance_mm is {0}, must be finite and positive")]
    UnitDistance(f32),
    /// The file or text has another format.
    #[error(
        "{found}, not a transfer function: those of 3D Slicer (.vp, .vp.json) and in RON (.tf.ron) can be read"
    )]
    NotATransferFunction {
        /// The likely format, with its article.
        found: &'static str,
    },
    /// The text is not a transfer function in RON.
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
        /// Name of the expected entry.
        field: &'static str,
        /// Reason why the entry cannot be read.
        reason: String,
    },
}
