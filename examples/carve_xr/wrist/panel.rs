//! What the panel shows.

use bevy::{
    diagnostic::{DiagnosticsStore, FrameTimeDiagnosticsPlugin},
    ecs::system::SystemParam,
    prelude::*,
};
use bevy_contextual_ao::prelude::*;
use bevy_egui::{
    EguiContext,
    egui::{self, Area, ComboBox, Frame, ScrollArea, Ui},
};

use super::{
    super::{
        carve::{
            dicom::{
                self, OpenVolume, Reading, SeriesList,
                panel::{ERROR, Textures},
            },
            loading::Opening,
            shown::{FunctionSource, Shown},
        },
        carvers::{LastCut, RemoveAll},
        controls::{Controls, LeaveHere, Side},
        headset::Passthrough,
        scene::Reset,
        shapes::Shapes,
    },
    surface::{PIXELS_PER_POINT, POINTS, Panel},
};

const MARGIN: i8 = 8;
/// Way of a hand during a click, in egui's points. Hands are less steady than a mouse, and slower.
const SHAKE: f32 = 20.0;

/// What the user should know about this start.
#[derive(Resource, Clone, Debug, Default)]
pub struct Notice(pub Option<&'static str>);

/// Hands, and what is told of files and frames.
#[derive(SystemParam)]
pub struct State<'w, 's> {
    notice: Res<'w, Notice>,
    shapes: Res<'w, Shapes>,
    series: Res<'w, SeriesList>,
    reading: Res<'w, Reading>,
    opening: Res<'w, Opening>,
    diagnostics: Res<'w, DiagnosticsStore>,
    hands: Query<'w, 's, (Entity, &'static Controls, &'static Children)>,
}

type HeldCarvers<'w, 's> =
    Query<'w, 's, (&'static mut HeldCarver, &'static ClipMesh, &'static Mesh3d, Has<LastCut>)>;

type ShownVolume = (
    &'static Volume3d,
    &'static mut VolumeTransferFunction,
    &'static mut AmbientOcclusion,
    &'static mut VolumeShading,
);

/// Draws the panel.
pub fn show(
    mut commands: Commands,
    mut contexts: Query<&mut EguiContext>,
    panels: Query<&Panel>,
    state: State,
    mut carvers: HeldCarvers,
    mut volumes: Query<ShownVolume>,
    assets: Res<Assets<Volume>>,
    mut functions: ResMut<Assets<TransferFunction>>,
    mut shown: ResMut<Shown>,
    mut passthrough: ResMut<Passthrough>,
    mut textures: Local<Textures>,
) {
    let Some(mut context) = panels.iter().next().and_then(|panel| contexts.get_mut(panel.context).ok())
    else {
        return;
    };
    let context = context.get_mut();
    context.set_zoom_factor(PIXELS_PER_POINT);
    context.options_mut(|options| {
        let input = &mut options.input_options;
        (input.max_click_dist, input.max_click_duration) = (SHAKE, f64::INFINITY);
    });
    Area::new("panel".into()).fixed_pos(egui::Pos2::ZERO).movable(false).show(context, |ui| {
        Frame::new().inner_margin(MARGIN).show(ui, |ui| {
            enlarge(ui);
            ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                if let Some(notice) = state.notice.0 {
                    ui.weak(notice);
                }
                show_hands(ui, &state, &mut commands, &carvers);
                show_cuts(ui, &mut commands, &mut carvers);
                ui.separator();
                for (volume, mut function, occlusion, shading) in &mut volumes {
                    choose_preset(ui, assets.get(&volume.0), &mut function, &mut functions, &mut shown);
                    choose_look(ui, occlusion, shading);
                }
                if passthrough.is_available {
                    let mut is_on = passthrough.is_on;
                    ui.checkbox(&mut is_on, "see the real room");
                    let new = Passthrough { is_on, ..*passthrough };
                    passthrough.set_if_neq(new);
                }
                ui.separator();
                show_files(ui, &state, &shown, &mut commands, &mut textures);
                show_frame_time(ui, &state.diagnostics);
            });
        });
    });
}

/// Buttons that a hand hits.
fn enlarge(ui: &mut Ui) {
    ui.set_width(POINTS.x - 2.0 * f32::from(MARGIN));
    ui.set_height(POINTS.y - 2.0 * f32::from(MARGIN));
    let spacing = ui.spacing_mut();
    spacing.button_padding = egui::vec2(8.0, 5.0);
    spacing.interact_size.y = 26.0;
    spacing.item_spacing = egui::vec2(6.0, 6.0);
}

/// What the carver in each hand does, and a button that leaves it.
fn show_hands(ui: &mut Ui, state: &State, commands: &mut Commands, carvers: &HeldCarvers) {
    let mut hands: Vec<_> = state.hands.iter().collect();
    hands.sort_by_key(|(_, controls, _)| controls.side == Side::Right);
    for (hand, controls, children) in hands {
        for (_, clip_mesh, mesh, has_cut) in carvers.iter_many(children) {
            let name = state.shapes.of(&mesh.0).map_or("mesh", |shape| shape.name);
            let side = match controls.side {
                Side::Left => "left",
                Side::Right => "right",
            };
            let does = match clip_mesh.operation {
                ClipOperation::Subtract => "removes",
                _ => "keeps",
            };
            ui.horizontal(|ui| {
                if ui.button(name).on_hover_text("the next shape").clicked() {
                    commands.trigger(ChangeShape { entity: hand, steps: 1 });
                }
                if ui.button(does).on_hover_text("remove or keep what is inside").clicked() {
                    commands.trigger(ToggleOperation { entity: hand });
                }
                if ui.add_enabled(has_cut, egui::Button::new("leave it here")).clicked() {
                    commands.trigger(LeaveHere { entity: hand });
                }
                ui.weak(side);
            });
        }
    }
}

/// When carvers cut, what was left, and the way back.
fn show_cuts(ui: &mut Ui, commands: &mut Commands, carvers: &mut HeldCarvers) {
    let always = carvers.iter().any(|(held, ..)| held.carves == CarveWhile::Active);
    let mut carves = if always { CarveWhile::Active } else { CarveWhile::Triggered };
    ui.horizontal(|ui| {
        ui.label("cuts:");
        ui.selectable_value(&mut carves, CarveWhile::Triggered, "by the trigger");
        ui.selectable_value(&mut carves, CarveWhile::Active, "always");
    });
    for (mut held, ..) in carvers.iter_mut().filter(|(held, ..)| held.carves != carves) {
        held.carves = carves;
    }
    ui.horizontal(|ui| {
        if ui.button("remove all").on_hover_text("cuts that were left").clicked() {
            commands.trigger(RemoveAll);
        }
        if ui.button("reset").on_hover_text("back onto the stand").clicked() {
            commands.trigger(Reset);
        }
    });
}

fn choose_preset(
    ui: &mut Ui,
    volume: Option<&Volume>,
    function: &mut VolumeTransferFunction,
    functions: &mut Assets<TransferFunction>,
    shown: &mut Shown,
) {
    let current = match shown.function {
        FunctionSource::Volume => "from the volume",
        FunctionSource::Preset(preset) => preset.name(),
        FunctionSource::File => "from a file",
    };
    ComboBox::from_label("colours").selected_text(current).show_ui(ui, |ui| {
        for preset in Preset::ALL {
            let is_chosen = shown.function == FunctionSource::Preset(preset);
            if let (true, Some(volume)) = (ui.selectable_label(is_chosen, preset.name()).clicked(), volume) {
                shown.function = FunctionSource::Preset(preset);
                function.0 = functions.add(preset.transfer_function(volume));
            }
        }
    });
}

/// Quality, and methods whose occlusion is the same in both eyes.
fn choose_look(ui: &mut Ui, mut occlusion: Mut<AmbientOcclusion>, mut shading: Mut<VolumeShading>) {
    let (mut new_occlusion, mut new_shading) = (occlusion.clone(), shading.clone());
    let apply = |quality: Quality, shading: &mut VolumeShading, occlusion: &mut AmbientOcclusion| {
        quality.apply(shading, occlusion);
        // Its grain would differ between eyes.
        shading.jitter = false;
    };
    let current = Quality::ALL.into_iter().find(|quality| {
        let (mut with_shading, mut with_occlusion) = (shading.clone(), occlusion.clone());
        apply(*quality, &mut with_shading, &mut with_occlusion);
        with_shading == *shading && with_occlusion == *occlusion
    });
    let name = current.map_or("own settings", Quality::name);
    ComboBox::from_label("quality").selected_text(name).show_ui(ui, |ui| {
        for quality in Quality::ALL {
            if ui.selectable_label(current == Some(quality), quality.name()).clicked() {
                apply(quality, &mut new_shading, &mut new_occlusion);
            }
        }
    });
    let method = occlusion.method.name();
    ComboBox::from_label("occlusion").selected_text(method).show_ui(ui, |ui| {
        for other in OcclusionMethod::all().into_iter().filter(|method| method.kind().is_of_voxels()) {
            if ui.selectable_label(method == other.name(), other.name()).clicked() && method != other.name() {
                new_occlusion.method = other;
            }
        }
    });
    occlusion.set_if_neq(new_occlusion);
    shading.set_if_neq(new_shading);
}

/// The file, and series of DICOM files.
fn show_files(ui: &mut Ui, state: &State, shown: &Shown, commands: &mut Commands, textures: &mut Textures) {
    ui.strong(&shown.name);
    for error in &shown.errors {
        ui.colored_label(ERROR, error);
    }
    if state.opening.is_busy() || state.series.progress().is_some() || state.reading.progress().is_some() {
        ui.weak("files are being read");
    }
    let chosen = state.reading.chosen(&state.series, shown);
    if let Some(choice) = dicom::panel::show(ui, &state.series, chosen, textures) {
        commands.trigger(OpenVolume(choice));
    }
}

fn show_frame_time(ui: &mut Ui, diagnostics: &DiagnosticsStore) {
    let frame = diagnostics.get(&FrameTimeDiagnosticsPlugin::FRAME_TIME);
    if let Some(ms) = frame.and_then(|frame| frame.smoothed()) {
        ui.weak(format!("{ms:.1} ms a frame"));
    }
}
