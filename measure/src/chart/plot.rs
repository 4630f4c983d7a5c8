//! Draws the charts of rows: a PNG and an SVG for each scene and kind of frame.

use bevy::math::{Rect, UVec2, Vec2};
use plotters::prelude::*;
use std::path::Path;

use super::{
    canvas::{Align, Canvas, SHAPES, text_width},
    methods::SOLID,
    panel::{INK, LogAxis, Point, TEXT, draw},
};
use contextual_ao_kit::{
    chart::{KINDS, Row},
    font,
};

/// Width and height of a chart, pixels.
const SIZE: UVec2 = UVec2::new(1400, 1640);
/// PNGs are drawn larger by this factor and made smaller again, so that lines are smooth.
const OVERSAMPLING: u32 = 3;
/// Smaller errors are drawn as this error.
const LEAST_ERROR: f64 = 1e-4;

const COLORS: [RGBColor; 15] = [
    RGBColor(40, 40, 40),
    RGBColor(130, 130, 130),
    RGBColor(210, 60, 0),
    RGBColor(0, 140, 90),
    RGBColor(175, 50, 150),
    RGBColor(165, 120, 0),
    RGBColor(0, 115, 190),
    RGBColor(125, 75, 35),
    RGBColor(85, 70, 200),
    RGBColor(0, 150, 165),
    RGBColor(235, 125, 150),
    RGBColor(190, 20, 60),
    RGBColor(95, 125, 20),
    RGBColor(20, 90, 60),
    RGBColor(110, 160, 220),
];

const ABBREVIATIONS: &str = "6 to 54: rays, F on a Fibonacci lattice; progr.: rays of a frame; filters, SAT, shells: \
    radius in voxels, opac. by opacity; SSAO: samples; DOS: samples over the cone's base, its half angle";

const TITLES: [&str; KINDS.len()] =
    ["frames in which a carver moves", "frames at rest", "frames after an edit of the transfer function"];

/// Draws all charts into a folder.
pub fn plot(rows: &[Row], device: &str, out: &Path) -> Result<(), String> {
    font::register()?;
    for scene in distinct(rows.iter().map(|row| row.scene.as_str())) {
        let of_scene: Vec<&Row> = rows.iter().filter(|row| row.scene == scene).collect();
        for (kind, name) in KINDS.into_iter().enumerate() {
            let chart = Chart { rows: &of_scene, device, kind };
            let file = out.join(format!("{}_{name}", scene.replace([' ', '/'], "_")));
            chart.write_svg(&file.with_extension("svg"))?;
            chart.write_png(&file.with_extension("png"))?;
            println!("{}", file.with_extension("png").display());
        }
    }
    Ok(())
}

/// Each name once, in the order of first appearance.
fn distinct<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut distinct = Vec::new();
    names.for_each(|name| {
        if !distinct.contains(&name) {
            distinct.push(name);
        }
    });
    distinct
}

/// Chart of one scene and one kind of frame.
struct Chart<'a> {
    rows: &'a [&'a Row],
    device: &'a str,
    kind: usize,
}

impl Chart<'_> {
    fn write_svg(&self, file: &Path) -> Result<(), String> {
        let area = SVGBackend::new(file, SIZE.into()).into_drawing_area();
        self.draw(&Canvas { area, scale: 1.0, text_drop: 0.0 })
    }

    fn write_png(&self, file: &Path) -> Result<(), String> {
        let large = SIZE * OVERSAMPLING;
        let mut pixels = vec![255; 3 * large.element_product() as usize];
        let area = BitMapBackend::with_buffer(&mut pixels, large.into()).into_drawing_area();
        self.draw(&Canvas { area, scale: OVERSAMPLING as f32, text_drop: 0.2 })?;
        let image = image::RgbImage::from_raw(large.x, large.y, pixels).ok_or("there is no image")?;
        let image = image::imageops::thumbnail(&image, SIZE.x, SIZE.y);
        image.save(file).map_err(|error| format!("{}: {error}", file.display()))
    }

    fn draw<DB: DrawingBackend<ErrorType: 'static>>(&self, canvas: &Canvas<DB>) -> Result<(), String> {
        canvas.area.fill(&WHITE).map_err(|error| error.to_string())?;
        let Some(first) = self.rows.first() else {
            return Ok(());
        };
        let size = SIZE.as_vec2();
        let title = format!("{}: {}", first.scene, TITLES[self.kind]);
        canvas.text(&title, Vec2::new(40.0, 34.0), Align::Left, 30.0, INK)?;
        let [x, y, z] = first.voxels;
        let [width, height] = first.pixels;
        let subtitle = format!("{x} × {y} × {z} voxels, {width} × {height} pixels; {}", self.device);
        canvas.text(&subtitle, Vec2::new(40.0, 64.0), Align::Left, TEXT, INK)?;
        let below_legend = self.draw_legend(canvas, 94.0)?;
        let relative = |row: &Row| row.relative(self.kind);
        let solid = self.rows.iter().find(|row| row.family == SOLID).map(|row| relative(row));
        let x_axis = LogAxis::around(self.rows.iter().map(|row| relative(row)));
        let top = below_legend + 58.0;
        let gap = 76.0;
        let panel_height = 0.5 * (size.y - top - gap - 96.0);
        let errors: [(&str, fn(&Row) -> Option<f64>); 2] = [
            ("RMS error of the occlusion of voxels, 0 to 1, brightness fitted", |row| {
                row.voxels_fit.map(|fit| fit.fitted_rms)
            }),
            ("RMS error of the object's pixels, 0 to 1, brightness fitted", |row| {
                row.image_fit.map(|fit| fit.fitted_rms)
            }),
        ];
        for (index, (title, error)) in errors.into_iter().enumerate() {
            let top = top + index as f32 * (panel_height + gap);
            let frame = Rect::new(86.0, top, size.x - 30.0, top + panel_height);
            let points = self.points(error);
            let y_axis = LogAxis::around(points.iter().map(|point| point.at[1]));
            draw(canvas, frame, title, [x_axis, y_axis], &points, solid)?;
        }
        let axis =
            "time of a frame, of that of dense local ambient occlusion by 54 rays while a carver moves";
        canvas.text(axis, Vec2::new(0.5 * size.x, size.y - 52.0), Align::Middle, TEXT, INK)?;
        canvas.text(ABBREVIATIONS, Vec2::new(0.5 * size.x, size.y - 22.0), Align::Middle, 0.9 * TEXT, INK)?;
        canvas.area.present().map_err(|error| error.to_string())
    }

    fn families(&self) -> Vec<&str> {
        let drawn = self.rows.iter().filter(|row| row.family != SOLID && row.ms[0].is_finite());
        distinct(drawn.map(|row| row.family.as_str()))
    }

    fn points(&self, error: fn(&Row) -> Option<f64>) -> Vec<Point> {
        let families = self.families();
        let light = self.rows.first().map(|row| row.light.as_str());
        let points = self.rows.iter().filter(|row| row.family != SOLID).filter_map(|row| {
            // What is not timed has no place.
            row.relative(self.kind).is_finite().then_some(())?;
            let style = families.iter().position(|family| *family == row.family)?;
            Some(Point {
                quartiles: row.quartiles_ms[self.kind].map(|ms| ms / row.dense_ms),
                at: [row.relative(self.kind), error(row)?.max(LEAST_ERROR)],
                label: row.label.clone(),
                color: COLORS[style % COLORS.len()],
                shape: style % SHAPES,
                is_comparable: Some(row.light.as_str()) == light,
            })
        });
        points.collect()
    }

    /// Draws the legend, and returns where it ends.
    fn draw_legend<DB: DrawingBackend<ErrorType: 'static>>(
        &self,
        canvas: &Canvas<DB>,
        top: f32,
    ) -> Result<f32, String> {
        let (left, mut place) = (48.0, Vec2::new(48.0, top));
        let notes = ["grey line: no setting is faster and as close", "dashed: no occlusion"];
        let entries = self.families().into_iter().enumerate().map(|(style, family)| (Some(style), family));
        for (style, text) in entries.chain(notes.map(|note| (None, note))) {
            let width = text_width(text, TEXT);
            if place.x + width > SIZE.x as f32 - 30.0 {
                place = Vec2::new(left, place.y + 26.0);
            }
            if let Some(style) = style {
                canvas.mark(place, style % SHAPES, 7.0, COLORS[style % COLORS.len()])?;
            }
            canvas.text(text, place + Vec2::new(14.0, 0.0), Align::Left, TEXT, INK)?;
            place.x += width + 50.0;
        }
        Ok(place.y)
    }
}
