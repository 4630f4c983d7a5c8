//! The font of charts and captions.

use plotters::style::{FontStyle, register_font};

/// Name of the font for `plotters`.
pub const NAME: &str = "sans-serif";

/// Registers the font, which is that of the examples' user interface.
pub fn register() -> Result<(), String> {
    let font = epaint_default_fonts::UBUNTU_LIGHT;
    register_font(NAME, FontStyle::Normal, font).map_err(|_| "the font cannot be read".to_owned())
}
