//! Canvas of charts: lines, marks and text, in pixels of the finished chart.

use bevy::math::Vec2;
use plotters::{
    coord::Shift,
    prelude::*,
    style::text_anchor::{HPos, Pos, VPos},
};
use std::f32::consts::TAU;

use contextual_ao_kit::font;

/// Drawing area, and the number of its own units in a pixel.
pub struct Canvas<DB: DrawingBackend> {
    pub area: DrawingArea<DB, Shift>,
    pub scale: f32,
    /// Share of its height by which text is lowered, so that its middle is at the given place.
    pub text_drop: f32,
}

/// Part of a text that is at the given place.
#[derive(Clone, Copy)]
pub enum Align {
    Left,
    Middle,
    Right,
}

/// Number of shapes of marks.
pub const SHAPES: usize = 6;

/// Width of a text of this height.
pub fn text_width(text: &str, height: f32) -> f32 {
    // Measured in large type, because the size is in whole units.
    let large = (font::NAME, 100.0).into_font().box_size(text);
    large.map_or(0.0, |(width, _)| width as f32 * height / 100.0)
}

impl<DB: DrawingBackend<ErrorType: 'static>> Canvas<DB> {
    fn at(&self, p: Vec2) -> (i32, i32) {
        let p = (p * self.scale).round();
        (p.x as i32, p.y as i32)
    }

    /// Draws a line through points.
    pub fn line(&self, points: &[Vec2], color: RGBColor, width: f32) -> Result<(), String> {
        let style = color.stroke_width((width * self.scale).round().max(1.0) as u32);
        let points: Vec<_> = points.iter().map(|&p| self.at(p)).collect();
        self.area.draw(&PathElement::new(points, style)).map_err(|error| error.to_string())
    }

    /// Draws a mark of one of [`SHAPES`], with a white rim.
    pub fn mark(&self, center: Vec2, shape: usize, radius: f32, color: RGBColor) -> Result<(), String> {
        let polygon = |radius: f32| -> Vec<(i32, i32)> {
            outline(shape).into_iter().map(|p| self.at(center + p * radius)).collect()
        };
        for (radius, color) in [(radius + 1.5, WHITE), (radius, color)] {
            let filled = Polygon::new(polygon(radius), color.filled());
            self.area.draw(&filled).map_err(|error| error.to_string())?;
        }
        Ok(())
    }

    /// Draws text whose middle is at the height of a place.
    pub fn text(
        &self,
        text: &str,
        place: Vec2,
        align: Align,
        height: f32,
        color: RGBColor,
    ) -> Result<(), String> {
        let h_pos = match align {
            Align::Left => HPos::Left,
            Align::Middle => HPos::Center,
            Align::Right => HPos::Right,
        };
        let style = TextStyle::from((font::NAME, height * self.scale).into_font())
            .color(&color)
            .pos(Pos::new(h_pos, VPos::Center));
        let at = self.at(place + Vec2::Y * height * self.text_drop);
        self.area.draw_text(text, &style, at).map_err(|error| error.to_string())
    }
}

/// Outline of a shape around the origin. All shapes have about the same area.
fn outline(shape: usize) -> Vec<Vec2> {
    let regular = |corners: u8, turn: f32, radius: f32| -> Vec<Vec2> {
        (0..corners)
            .map(|k| radius * Vec2::from_angle((f32::from(k) / f32::from(corners) + turn) * TAU))
            .collect()
    };
    match shape % SHAPES {
        0 => regular(32, 0.0, 1.0),
        1 => regular(4, 0.125, 1.25),
        2 => regular(3, 0.75, 1.4),
        3 => regular(4, 0.0, 1.3),
        4 => regular(3, 0.25, 1.4),
        _ => {
            let spike = |k: u8| if k.is_multiple_of(2) { 1.5 } else { 0.65 };
            (0..10).map(|k| spike(k) * Vec2::from_angle((f32::from(k) / 10.0 + 0.75) * TAU)).collect()
        }
    }
}
