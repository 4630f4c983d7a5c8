//! One panel of a chart: logarithmic axes, marks with labels, the Pareto front.

use bevy::math::{Rect, Vec2};
use plotters::prelude::*;

use super::{
    canvas::{Align, Canvas, text_width},
    labels::{leader_end, place},
};
use contextual_ao_kit::chart::pareto_front;

/// Text heights, pixels.
pub const TEXT: f32 = 18.0;
const LABEL: f32 = 16.0;
const MARK_RADIUS: f32 = 5.5;

const GRID: RGBColor = RGBColor(228, 228, 228);
const FRONT: RGBColor = RGBColor(170, 170, 170);
pub const INK: RGBColor = RGBColor(40, 40, 40);

/// A logarithmic axis.
#[derive(Clone, Copy)]
pub struct LogAxis {
    from: f64,
    to: f64,
}

/// A setting's place in a panel.
pub struct Point {
    /// Time and error.
    pub at: [f64; 2],
    /// Lower and upper quartile of the time.
    pub quartiles: [f64; 2],
    pub label: String,
    pub color: RGBColor,
    pub shape: usize,
    /// Whether the point may be on the front.
    pub is_comparable: bool,
}

impl LogAxis {
    /// Axis from below the lowest to above the highest of some values above 0.
    pub fn around(values: impl Iterator<Item = f64>) -> Self {
        let logs = values.filter(|value| value.is_finite() && *value > 0.0).map(f64::log10);
        let (from, to) =
            logs.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), log| (low.min(log), high.max(log)));
        if from > to {
            return Self { from: -1.0, to: 0.0 };
        }
        let margin = 0.06 * (to - from) + 0.05;
        // Labels of fast settings need room on either side.
        Self { from: from - 1.5 * margin, to: to + margin }
    }

    /// Place of a value on the axis, from 0 to 1.
    fn share(self, value: f64) -> f32 {
        ((value.max(1e-12).log10() - self.from) / (self.to - self.from)).clamp(0.0, 1.0) as f32
    }

    /// Values with a line, and whether each has a number.
    fn ticks(self) -> impl Iterator<Item = (f64, bool)> {
        let (first, last) = (self.from.floor() as i32, self.to.ceil() as i32);
        let numbers_more = self.to - self.from < 2.2;
        let decades = (first..=last).flat_map(|decade| (1..10).map(move |digit| (digit, decade)));
        decades
            .map(move |(digit, decade)| {
                let has_number = digit == 1 || numbers_more && (digit == 2 || digit == 5);
                (f64::from(digit) * 10f64.powi(decade), has_number)
            })
            .filter(move |(value, _)| (self.from..=self.to).contains(&value.log10()))
    }
}

/// Draws a panel within a frame. A vertical line stands at the time of drawing alone.
pub fn draw<DB: DrawingBackend<ErrorType: 'static>>(
    canvas: &Canvas<DB>,
    frame: Rect,
    title: &str,
    [x_axis, y_axis]: [LogAxis; 2],
    points: &[Point],
    solid: Option<f64>,
) -> Result<(), String> {
    let place_of =
        |[x, y]: [f64; 2]| frame.min + frame.size() * Vec2::new(x_axis.share(x), 1.0 - y_axis.share(y));
    canvas.text(title, frame.min - Vec2::new(0.0, 18.0), Align::Left, TEXT, INK)?;
    for (value, has_number) in x_axis.ticks() {
        let x = place_of([value, 1.0]).x;
        let [top, bottom] = [frame.min.y, frame.max.y].map(|y| Vec2::new(x, y));
        canvas.line(&[top, bottom], GRID, if has_number { 2.0 } else { 1.0 })?;
        if has_number {
            canvas.text(&number(value), bottom + 16.0 * Vec2::Y, Align::Middle, TEXT, INK)?;
        }
    }
    for (value, has_number) in y_axis.ticks() {
        let y = place_of([1.0, value]).y;
        let [left, right] = [frame.min.x, frame.max.x].map(|x| Vec2::new(x, y));
        canvas.line(&[left, right], GRID, if has_number { 2.0 } else { 1.0 })?;
        if has_number {
            canvas.text(&number(value), left - 8.0 * Vec2::X, Align::Right, TEXT, INK)?;
        }
    }
    let corners =
        [frame.min, Vec2::new(frame.max.x, frame.min.y), frame.max, Vec2::new(frame.min.x, frame.max.y)];
    canvas.line(&[corners[0], corners[1], corners[2], corners[3], corners[0]], FRONT, 1.0)?;
    // Lines that labels should not cover.
    let mut lines = Vec::new();
    if let Some(solid) = solid {
        let x = place_of([solid, 1.0]).x;
        dashes(canvas, Vec2::new(x, frame.min.y), Vec2::new(x, frame.max.y))?;
        lines.push([Vec2::new(x, frame.min.y), Vec2::new(x, frame.max.y)]);
    }
    let front = front(frame, points, &place_of);
    if !front.is_empty() {
        canvas.line(&front, FRONT, 3.0)?;
    }
    lines.extend(front.windows(2).map(|pair| [pair[0], pair[1]]));
    for point in points {
        let ends = point.quartiles.map(|time| place_of([time, point.at[1]]));
        canvas.line(&ends, point.color, 1.5)?;
    }
    let places: Vec<Vec2> = points.iter().map(|point| place_of(point.at)).collect();
    let sizes = points.iter().map(|point| Vec2::new(text_width(&point.label, LABEL) + 2.0, LABEL - 1.0));
    let labels: Vec<(Vec2, Vec2)> = places.iter().copied().zip(sizes).collect();
    let rects = place(&labels, &lines, frame.inflate(-3.0));
    for ((point, &mark), rect) in points.iter().zip(&places).zip(&rects) {
        let end = leader_end(mark, *rect);
        if mark.distance(end) > 12.0 {
            canvas.line(&[mark, end], blend(point.color), 1.0)?;
        }
    }
    for (point, &mark) in points.iter().zip(&places) {
        canvas.mark(mark, point.shape, MARK_RADIUS, point.color)?;
    }
    for (point, rect) in points.iter().zip(&rects) {
        canvas.text(&point.label, rect.center(), Align::Middle, LABEL, darker(point.color))?;
    }
    Ok(())
}

/// Line along the best error of any setting up to each time.
fn front(frame: Rect, points: &[Point], place_of: &impl Fn([f64; 2]) -> Vec2) -> Vec<Vec2> {
    let compared: Vec<[f64; 2]> =
        points.iter().filter(|point| point.is_comparable).map(|point| point.at).collect();
    let front: Vec<Vec2> =
        pareto_front(&compared).into_iter().map(|index| place_of(compared[index])).collect();
    let (Some(first), Some(last)) = (front.first(), front.last()) else {
        return Vec::new();
    };
    let mut steps = vec![Vec2::new(first.x, frame.min.y), *first];
    for pair in front.windows(2) {
        steps.extend([Vec2::new(pair[1].x, pair[0].y), pair[1]]);
    }
    steps.push(Vec2::new(frame.max.x, last.y));
    steps
}

fn dashes<DB: DrawingBackend<ErrorType: 'static>>(
    canvas: &Canvas<DB>,
    from: Vec2,
    to: Vec2,
) -> Result<(), String> {
    let count = (from.distance(to) / 8.0) as u16;
    let at = |k: u16| from.lerp(to, f32::from(k) / f32::from(count.max(1)));
    (0..count).step_by(2).try_for_each(|k| canvas.line(&[at(k), at(k + 1)], INK, 1.5))
}

/// A number without needless digits.
fn number(value: f64) -> String {
    if value >= 1.0 {
        format!("{value:.0}")
    } else {
        let text = format!("{value:.6}");
        text.trim_end_matches('0').to_owned()
    }
}

/// The colour halfway to white.
fn blend(RGBColor(red, green, blue): RGBColor) -> RGBColor {
    let [red, green, blue] = [red, green, blue].map(|channel| 128 + channel / 2);
    RGBColor(red, green, blue)
}

/// A darker colour for text, which is thin.
fn darker(RGBColor(red, green, blue): RGBColor) -> RGBColor {
    let [red, green, blue] = [red, green, blue].map(|channel| channel / 4 * 3);
    RGBColor(red, green, blue)
}
