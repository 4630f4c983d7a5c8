//! Edits a transfer function: its points are dragged over the histogram of the volume. Below, `gradient_editor` edits how
//! it follows the gradient, and chooses the points to be dragged.

use bevy::prelude::*;
use bevy_contextual_ao::prelude::*;
use bevy_egui::egui::{
    Button, Color32, DragValue, Key, Mesh, Painter, PointerButton, Pos2, Rect, Response, Sense, Shape,
    Slider, Stroke, Ui, emath::RectTransform, pos2, vec2,
};
use contextual_ao_kit::digits::decimals;

use super::{
    content::Content,
    gradient_editor::{self, GradientEditor},
};

const HEIGHT: f32 = 150.0;
/// Distance from which points are caught, and the radius of their drawing, in points of the screen.
const CATCH_RADIUS: f32 = 12.0;
const POINT_RADIUS: f32 = 4.5;
/// Width of a stripe of the curve, in points of the screen.
const STRIPE_WIDTH: f32 = 1.0;
/// Zoom of one pixel of scrolling.
const ZOOM_PER_PIXEL: f32 = 0.004;
/// The narrowest visible range, as a share of the whole.
const SMALLEST_VIEW: f32 = 1e-3;
/// Share that the whole range shows more on either side.
const MARGIN: f32 = 0.03;
/// Range of the unit of opacity, voxels.
const UNIT_DISTANCE_VOXELS: [f32; 2] = [0.05, 50.0];
/// Pixels of dragging that change a value by the width of the visible range.
const PIXELS_PER_VIEW: f32 = 500.0;
const MATT: Color32 = Color32::from_gray(28);
const HISTOGRAM: Color32 = Color32::from_gray(62);

/// State of the editor between frames.
#[derive(Resource, Default)]
pub struct TransferEditor {
    /// Values at the left and right end; `None` shows all values.
    view: Option<[f32; 2]>,
    selected: Option<usize>,
    is_dragging: bool,
    gradients: GradientEditor,
}

/// Shows the editor and changes `function`, which always stays valid.
pub fn show(ui: &mut Ui, editor: &mut TransferEditor, function: &mut TransferFunction, content: &Content) {
    // The curve shows a function of the value alone.
    let edited = editor.gradients.edited.filter(|&index| index < function.at_gradients.len());
    editor.gradients.edited = edited;
    let mut curve = TransferFunction {
        points: edited.map_or(&function.points, |index| &function.at_gradients[index].points).clone(),
        opacity_unit_distance_mm: function.opacity_unit_distance_mm,
        ..default()
    };
    let view = show_curve(ui, editor, &mut curve, content);
    let points = match edited {
        Some(index) => &mut function.at_gradients[index].points,
        None => &mut function.points,
    };
    *points = curve.points;
    gradient_editor::show(ui, &mut editor.gradients, function, content, view);
    if editor.gradients.edited != edited {
        editor.selected = None;
    }
    show_unit(ui, function, content);
}

/// Shows the curve over the values. Returns the shown range of values.
fn show_curve(
    ui: &mut Ui,
    editor: &mut TransferEditor,
    function: &mut TransferFunction,
    content: &Content,
) -> [f32; 2] {
    editor.selected = editor.selected.filter(|&index| index < function.points.len());
    let (response, painter) =
        ui.allocate_painter(vec2(ui.available_width(), HEIGHT), Sense::click_and_drag());
    let whole = whole_view(function, content);
    let view = editor.view.unwrap_or(whole);
    let to_screen = screen_of(view, response.rect);
    edit_points(&response, editor, function, &to_screen);
    move_view(ui, &response, editor, view, whole);
    draw(&painter, &to_screen, editor, function, content);
    ui.horizontal(|ui| {
        ui.weak("double-click adds a point, scroll zooms");
        if editor.view.is_some() && ui.small_button("all").clicked() {
            editor.view = None;
        }
    });
    show_selected(ui, editor, function, view);
    view
}

/// Maps values to the right and opacity upwards.
fn screen_of([left, right]: [f32; 2], rect: Rect) -> RectTransform {
    let inner = rect.shrink2(vec2(0.0, POINT_RADIUS + 1.0));
    // The upper side of the curve's rectangle is opacity 1.
    let values = Rect::from_min_max(pos2(left, 1.0), pos2(right, 0.0));
    RectTransform::from_to(values, inner)
}

/// Range of all values of the volume and of all points.
fn whole_view(function: &TransferFunction, content: &Content) -> [f32; 2] {
    let values = function.points.iter().map(|point| point.value);
    let low = values.clone().fold(content.range[0], f32::min);
    let high = values.fold(content.range[1], f32::max);
    let margin = ((high - low) * MARGIN).max(f32::EPSILON * low.abs().max(1.0));
    [low - margin, high + margin]
}

fn nearest(function: &TransferFunction, to_screen: &RectTransform, at: Pos2) -> Option<usize> {
    let distance =
        |point: &ControlPoint| to_screen.transform_pos(pos2(point.value, point.opacity)).distance(at);
    let distances = function.points.iter().map(distance).enumerate();
    distances
        .filter(|&(_, distance)| distance < CATCH_RADIUS)
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(index, _)| index)
}

/// Selects, drags, adds and removes points.
fn edit_points(
    response: &Response,
    editor: &mut TransferEditor,
    function: &mut TransferFunction,
    to_screen: &RectTransform,
) {
    let pressed_at =
        response.ctx.input(|input| input.pointer.press_origin()).or(response.interact_pointer_pos());
    if response.drag_started_by(PointerButton::Primary) {
        editor.selected = pressed_at.and_then(|at| nearest(function, to_screen, at));
        editor.is_dragging = editor.selected.is_some();
    }
    if !response.dragged_by(PointerButton::Primary) {
        editor.is_dragging = false;
    }
    let Some(pointer) = response.interact_pointer_pos() else {
        return;
    };
    let at = to_screen.inverse().transform_pos(pointer);
    let opacity = at.y.clamp(0.0, 1.0);
    if let Some(index) = editor.selected.filter(|_| editor.is_dragging) {
        let [low, high] = neighbours(function, index);
        if let Some(point) = function.points.get_mut(index) {
            point.value = at.x.clamp(low, high);
            point.opacity = opacity;
        }
    } else if response.double_clicked() && nearest(function, to_screen, pointer).is_none() {
        let [red, green, blue, _] = function.sample(at.x);
        let index = function.points.partition_point(|point| point.value <= at.x);
        let point = ControlPoint { value: at.x, color: [red, green, blue], opacity };
        function.points.insert(index, point);
        editor.selected = Some(index);
    } else if response.clicked() {
        editor.selected = nearest(function, to_screen, pointer);
    }
}

/// The values between which a point may lie.
fn neighbours(function: &TransferFunction, index: usize) -> [f32; 2] {
    let value = |index: usize| function.points.get(index).map(|point| point.value);
    let low = index.checked_sub(1).and_then(value).unwrap_or(f32::MIN);
    [low, value(index + 1).unwrap_or(f32::MAX).max(low)]
}

/// Zooms with the wheel, pans with the right button.
fn move_view(
    ui: &Ui,
    response: &Response,
    editor: &mut TransferEditor,
    [left, right]: [f32; 2],
    whole: [f32; 2],
) {
    let width = right - left;
    if response.dragged_by(PointerButton::Secondary) {
        let shift = response.drag_delta().x / response.rect.width() * width;
        editor.view = Some([left - shift, right - shift]);
    }
    let Some(pointer) = response.hover_pos() else {
        return;
    };
    // Takes the scrolling from the panel, which would scroll too.
    let scrolled = ui.input_mut(|input| core::mem::take(&mut input.smooth_scroll_delta.y));
    if scrolled == 0.0 {
        return;
    }
    let t = (pointer.x - response.rect.left()) / response.rect.width();
    let fixed = left + t * width;
    let largest = whole[1] - whole[0];
    let new = (width * (-scrolled * ZOOM_PER_PIXEL).exp()).clamp(largest * SMALLEST_VIEW, largest);
    editor.view = (new < largest).then_some([fixed - t * new, fixed + (1.0 - t) * new]);
}

fn draw(
    painter: &Painter,
    to_screen: &RectTransform,
    editor: &TransferEditor,
    function: &TransferFunction,
    content: &Content,
) {
    let rect = painter.clip_rect().intersect(to_screen.to().expand(POINT_RADIUS + 1.0));
    let painter = painter.with_clip_rect(rect);
    painter.rect_filled(rect, 3.0, MATT);
    let inner = *to_screen.to();
    let [low, high] = content.range;
    let stripes = (inner.width() / STRIPE_WIDTH) as usize;
    let mut curve = Mesh::default();
    for stripe in 0..=stripes {
        let x = inner.left() + stripe as f32 * STRIPE_WIDTH;
        let value = to_screen.inverse().transform_pos(pos2(x, 0.0)).x;
        let t = (value - low) / (high - low).max(f32::MIN_POSITIVE);
        let bar = (t * content.histogram.len() as f32).floor();
        if (0.0..content.histogram.len() as f32).contains(&bar)
            && let Some(share) = content.histogram.get(bar as usize)
        {
            let top = inner.bottom() - share * inner.height();
            painter.vline(x, top..=inner.bottom(), Stroke::new(STRIPE_WIDTH, HISTOGRAM));
        }
        let [red, green, blue, opacity] = function.sample(value);
        let color = display([red, green, blue]);
        let top = to_screen.transform_pos(pos2(value, opacity)).y;
        curve.colored_vertex(pos2(x, top), color);
        curve.colored_vertex(pos2(x, inner.bottom()), color.gamma_multiply(0.35));
        if let Some(before) = (2 * stripe as u32).checked_sub(2) {
            curve.add_triangle(before, before + 1, before + 2);
            curve.add_triangle(before + 1, before + 2, before + 3);
        }
    }
    painter.add(Shape::mesh(curve));
    let places: Vec<Pos2> = function
        .points
        .iter()
        .map(|point| to_screen.transform_pos(pos2(point.value, point.opacity)))
        .collect();
    painter.add(Shape::line(places.clone(), Stroke::new(1.0_f32, Color32::from_gray(190))));
    for (index, (point, place)) in function.points.iter().zip(places).enumerate() {
        let edge = if editor.selected == Some(index) {
            Stroke::new(2.5_f32, Color32::WHITE)
        } else {
            Stroke::new(1.0_f32, Color32::from_gray(20))
        };
        painter.circle(place, POINT_RADIUS, display(point.color), edge);
    }
}

/// Converts a colour to egui's type.
fn display(color: [f32; 3]) -> Color32 {
    let [red, green, blue] = bytes(color);
    Color32::from_rgb(red, green, blue)
}

fn bytes(color: [f32; 3]) -> [u8; 3] {
    color.map(|share| (share * 255.0).round() as u8)
}

/// Shows the selected point in numbers, with the digits that tell values of the view apart.
fn show_selected(
    ui: &mut Ui,
    editor: &mut TransferEditor,
    function: &mut TransferFunction,
    [left, right]: [f32; 2],
) {
    let is_last = function.points.len() < 2;
    match editor.selected {
        Some(index) => {
            let [low, high] = neighbours(function, index);
            let mut is_deleted = !is_last && ui.input(|input| input.key_pressed(Key::Delete));
            ui.horizontal(|ui| {
                let Some(point) = function.points.get_mut(index) else {
                    return;
                };
                let mut color = bytes(point.color);
                if ui.color_edit_button_srgb(&mut color).changed() {
                    point.color = color.map(|byte| f32::from(byte) / 255.0);
                }
                let (width, decimals) = (right - left, decimals(right - left));
                let value = DragValue::new(&mut point.value).range(low..=high);
                ui.add(
                    value.speed(width / PIXELS_PER_VIEW).min_decimals(decimals).max_decimals(decimals + 1),
                );
                ui.add(DragValue::new(&mut point.opacity).range(0.0..=1.0).speed(0.01));
                is_deleted |= ui.add_enabled(!is_last, Button::new("delete")).clicked();
            });
            if is_deleted {
                function.points.remove(index);
                editor.selected = None;
            }
        }
        None => {
            ui.weak("no point selected");
        }
    }
}

fn show_unit(ui: &mut Ui, function: &mut TransferFunction, content: &Content) {
    let [least, most] = UNIT_DISTANCE_VOXELS.map(|voxels| voxels * content.spacing_mm.min_element());
    let unit = Slider::new(&mut function.opacity_unit_distance_mm, least..=most);
    ui.add(unit.logarithmic(true).text("opacity per so many mm"));
}
