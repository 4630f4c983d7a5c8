//! The font of charts and captions.

use plotters::style::{FontStyle, register_font};

/// Its name for `plotters`.
pub const NAME: &str = "sans-serif";

/// Makes it known. It is the one that the examples' user interface is written in.
pub fn register() -> Result<(), String> {
    let font = epaint_default_fonts::UBUNTU_LIGHT;
    register_font(NAME, FontStyle::Normal, font).map_err(|_| "the font cannot be read".to_owned())
}
