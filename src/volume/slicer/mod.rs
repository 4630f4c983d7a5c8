//! 3D Slicer's volume properties, in both of its formats.

mod curve;
mod json;
mod lines;
mod nodes;

use super::transfer_function::TransferFunction;
use super::transfer_function_error::TransferFunctionError;

pub(super) use json::is_json;

/// Reads a volume property without validating it.
pub(super) fn read(text: &str) -> Result<TransferFunction, TransferFunctionError> {
    if text.trim_start().starts_with('{') { Ok(json::read(text)?) } else { lines::read(text) }
}
