//! Edits how a transfer function follows the gradient: below the curve of values, over the volume's joint histogram.

use bevy_contextual_ao::prelude::*;
use bevy_egui::egui::{
    Color32, Mesh, Painter, PointerButton, Pos2, Rect, Sense, Shape, Stroke, Ui, emath::RectTransform, pos2,
    vec2,
};
use contextual_ao_kit::digits::significant;

use super::{
    content::Content,
    joint_histogram::{COLUMNS, ROWS},
};

const HEIGHT: f32 = 90.0;
/// Distance from which points and lines are caught, in points of the screen.
const CATCH_RADIUS: f32 = 8.0;
const POINT_RADIUS: f32 = 4.0;
const MATT: Color32 = Color32::from_gray(28);
/// Range of new points, as shares of the shown gradients.
const NEW_RANGE: [f32; 2] = [0.3, 0.4];

/// State of the editor between frames.
#[derive(Default)]
pub struct GradientEditor {
    /// Index of the edited points in `at_gradients`; `None` for those of short gradients.
    pub edited: Option<usize>,
    dragged: Option<Handle>,
}

/// What is dragged.
#[derive(Clone, Copy)]
enum Handle {
    /// A point of the opacity's factor.
    Factor(usize),
    /// The gradient up to which points have no effect, and the gradient from which on they alone count.
    From(usize),
    To(usize),
}

/// Shows the editor. Values from left to right are those of the curve above.
pub fn show(
    ui: &mut Ui,
    editor: &mut GradientEditor,
    function: &mut TransferFunction,
    content: &Content,
    [left, right]: [f32; 2],
) {
    let (response, painter) =
        ui.allocate_painter(vec2(ui.available_width(), HEIGHT), Sense::click_and_drag());
    let last = function.last_gradient().unwrap_or_default().max(content.last_gradient(function));
    let values = Rect::from_min_max(pos2(left, last), pos2(right, 0.0));
    let to_screen = RectTransform::from_to(values, response.rect);
    let pressed_at =
        response.ctx.input(|input| input.pointer.press_origin()).or(response.interact_pointer_pos());
    if response.drag_started_by(PointerButton::Primary) {
        editor.dragged = pressed_at.and_then(|at| nearest(function, &to_screen, at));
    }
    if !response.dragged_by(PointerButton::Primary) {
        editor.dragged = None;
    }
    if let Some(at) = response.interact_pointer_pos() {
        if let Some(dragged) = editor.dragged {
            drag(dragged, function, &to_screen, at);
        } else if response.double_clicked() && nearest(function, &to_screen, at).is_none() {
            let (gradient, opacity) = (gradient_at(&to_screen, at), share_at(&to_screen, at));
            let index = function.gradient_opacity.partition_point(|point| point.gradient <= gradient);
            function.gradient_opacity.insert(index, GradientPoint { gradient, opacity });
        } else if response.secondary_clicked()
            && let Some(Handle::Factor(index)) = nearest(function, &to_screen, at)
        {
            function.gradient_opacity.remove(index);
        }
    }
    draw(&painter.with_clip_rect(response.rect), &to_screen, function, content);
    ui.weak("gradient: double-click adds a point of the opacity's factor, right-click removes it");
    choose_points(ui, editor, function, last);
}

fn gradient_at(to_screen: &RectTransform, at: Pos2) -> f32 {
    to_screen.inverse().transform_pos_clamped(at).y
}

/// A factor, 0 to 1 from left to right.
fn share_at(to_screen: &RectTransform, at: Pos2) -> f32 {
    ((at.x - to_screen.to().left()) / to_screen.to().width()).clamp(0.0, 1.0)
}

fn place_of_factor(to_screen: &RectTransform, point: &GradientPoint) -> Pos2 {
    let rect = to_screen.to();
    pos2(rect.left() + point.opacity * rect.width(), height_of(to_screen, point.gradient))
}

fn height_of(to_screen: &RectTransform, gradient: f32) -> f32 {
    to_screen.transform_pos(pos2(0.0, gradient)).y
}

/// What lies near a place, points first.
fn nearest(function: &TransferFunction, to_screen: &RectTransform, at: Pos2) -> Option<Handle> {
    let points = function.gradient_opacity.iter().enumerate();
    let points =
        points.map(|(index, point)| (Handle::Factor(index), place_of_factor(to_screen, point).distance(at)));
    let lines = function.at_gradients.iter().enumerate().flat_map(|(index, points)| {
        let distance = |gradient| (height_of(to_screen, gradient) - at.y).abs();
        // Where both lines are one, a drag upwards takes the upper.
        [(Handle::To(index), distance(points.to)), (Handle::From(index), distance(points.from) + 1e-3)]
    });
    let caught = |handles: &mut dyn Iterator<Item = (Handle, f32)>| {
        handles.filter(|handle| handle.1 < CATCH_RADIUS).min_by(|a, b| a.1.total_cmp(&b.1))
    };
    caught(&mut { points }).or_else(|| caught(&mut { lines })).map(|handle| handle.0)
}

fn drag(handle: Handle, function: &mut TransferFunction, to_screen: &RectTransform, at: Pos2) {
    let gradient = gradient_at(to_screen, at);
    match handle {
        Handle::Factor(index) => {
            let neighbour = |index: usize| function.gradient_opacity.get(index).map(|point| point.gradient);
            let low = index.checked_sub(1).and_then(neighbour).unwrap_or(0.0);
            let high = neighbour(index + 1).unwrap_or(f32::MAX).max(low);
            if let Some(point) = function.gradient_opacity.get_mut(index) {
                point.gradient = gradient.clamp(low, high);
                point.opacity = share_at(to_screen, at);
            }
        }
        Handle::From(index) => {
            if let Some(points) = function.at_gradients.get_mut(index) {
                points.from = gradient.min(points.to);
            }
        }
        Handle::To(index) => {
            if let Some(points) = function.at_gradients.get_mut(index) {
                points.to = gradient.max(points.from);
            }
        }
    }
}

fn draw(painter: &Painter, to_screen: &RectTransform, function: &TransferFunction, content: &Content) {
    let rect = *to_screen.to();
    painter.rect_filled(rect, 3.0, MATT);
    let mut cells = Mesh::default();
    let [low, high] = content.range;
    let last = content.last_gradient(function);
    for (index, frequency) in content.gradients.frequencies.iter().enumerate().filter(|cell| *cell.1 > 0.0) {
        let value = |column: usize| low + (high - low) * column as f32 / COLUMNS as f32;
        let gradient = |row: usize| last * row as f32 / ROWS as f32;
        let (column, row) = (index % COLUMNS, index / COLUMNS);
        let corners = [(column, row), (column + 1, row + 1)]
            .map(|(column, row)| to_screen.transform_pos(pos2(value(column), gradient(row))));
        // The function's own colour, where it has opacity.
        let [red, green, blue, opacity] = function.sample_at(value(column), gradient(row));
        let shown = [red, green, blue].map(|share| 40.0 + 150.0 * (opacity * share + 0.25 * (1.0 - opacity)));
        let [red, green, blue] = shown.map(|byte| (byte * (0.3 + 0.7 * frequency)) as u8);
        cells.add_colored_rect(
            Rect::from_two_pos(corners[0], corners[1]),
            Color32::from_rgb(red, green, blue),
        );
    }
    painter.add(Shape::mesh(cells));
    for points in &function.at_gradients {
        for (gradient, width) in [(points.from, 1.0), (points.to, 2.0_f32)] {
            painter.hline(rect.x_range(), height_of(to_screen, gradient), Stroke::new(width, Color32::WHITE));
        }
    }
    let places: Vec<_> =
        function.gradient_opacity.iter().map(|point| place_of_factor(to_screen, point)).collect();
    painter.add(Shape::line(places.clone(), Stroke::new(1.0_f32, Color32::from_gray(190))));
    for place in places {
        painter.circle(place, POINT_RADIUS, Color32::GOLD, Stroke::new(1.0_f32, Color32::from_gray(20)));
    }
}

/// Chooses the points that the curve of values shows; adds and removes those for longer gradients.
fn choose_points(ui: &mut Ui, editor: &mut GradientEditor, function: &mut TransferFunction, last: f32) {
    ui.horizontal_wrapped(|ui| {
        ui.label("points for gradients");
        ui.selectable_value(&mut editor.edited, None, "from 0");
        for (index, points) in function.at_gradients.iter().enumerate() {
            ui.selectable_value(&mut editor.edited, Some(index), format!("from {}", significant(points.to)));
        }
        if ui.small_button("+").on_hover_text("points for longer gradients").clicked() {
            let from = function.at_gradients.last().map_or(NEW_RANGE[0] * last, |points| points.to);
            let to = from + (NEW_RANGE[1] - NEW_RANGE[0]) * last;
            let points =
                function.at_gradients.last().map_or(&function.points, |points| &points.points).clone();
            function.at_gradients.push(PointsAtGradient { from, to, points });
            editor.edited = Some(function.at_gradients.len() - 1);
        }
        if let Some(edited) = editor.edited
            && ui.small_button("delete").clicked()
        {
            function.at_gradients.remove(edited);
            editor.edited = None;
        }
    });
}
