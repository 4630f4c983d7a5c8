//! The panel: file, shading, transfer function, timings and help.

use bevy::{
    asset::AssetMut, camera::Viewport, diagnostic::DiagnosticsStore, ecs::system::SystemParam, prelude::*,
    window::PrimaryWindow,
};
use bevy_contextual_ao::{
    diagnostics::{RenderStatus, TimePassesByClock},
    prelude::*,
    volume::VolumeGeometry,
};
use bevy_egui::{
    EguiContexts, EguiInput, EguiPreUpdateSet, EguiPrimaryContextPass,
    egui::{self, ComboBox, Grid, RichText, Slider, Ui, scroll_area::ScrollSource},
    input::egui_wants_any_keyboard_input,
};
use bevy_panorbit_camera::PanOrbitCamera;
use contextual_ao_kit::mode::ShadingMode;

use super::{
    carvers::Carver,
    content::Content,
    dicom::{self, OpenVolume, panel::Textures},
    file_panel::{self, Files},
    hands::{HELP, Hand},
    occlusion_panel,
    shown::{FunctionSource, Shown},
    timings::{self, LastRuns},
    transfer_editor::{self, TransferEditor},
};

/// Width of the panel, in points of the screen.
const WIDTH: f32 = 330.0;
const PADDING: f32 = 10.0;
/// Dragging moves points and sliders, and does not scroll.
const SCROLLED_BY: ScrollSource = ScrollSource { drag: false, ..ScrollSource::ALL };
const EXPOSURE: core::ops::RangeInclusive<f32> = 0.25..=4.0;
const OCCLUSION_INTENSITY: core::ops::RangeInclusive<f32> = 0.0..=4.0;
const STEP_VOXELS: core::ops::RangeInclusive<f32> = 0.1..=4.0;

pub struct PanelPlugin;

impl Plugin for PanelPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<TransferEditor>()
            .add_observer(show_all_values)
            .add_systems(
                PreUpdate,
                keep_tab_key.after(EguiPreUpdateSet::ProcessInput).before(EguiPreUpdateSet::BeginPass),
            )
            .add_systems(Update, (leave_room, choose_mode_by_key.run_if(not(egui_wants_any_keyboard_input))))
            .add_systems(EguiPrimaryContextPass, show);
    }
}

/// The volume and its settings.
type ShownVolume = (
    &'static Volume3d,
    &'static mut VolumeTransferFunction,
    &'static OcclusionReady,
    &'static mut AmbientOcclusion,
    &'static mut VolumeShading,
);

/// Data that the panel only reads.
#[derive(SystemParam)]
struct Readings<'w, 's> {
    volumes: Res<'w, Assets<Volume>>,
    diagnostics: Res<'w, DiagnosticsStore>,
    status: Res<'w, RenderStatus>,
    hand: Res<'w, Hand>,
    carvers: Query<'w, 's, (&'static Carver, &'static ClipMesh)>,
}

/// Keeps the Tab key for selecting carvers, not widgets.
fn keep_tab_key(mut inputs: Query<&mut EguiInput>) {
    let is_tab = |event: &egui::Event| matches!(event, egui::Event::Key { key: egui::Key::Tab, .. });
    for mut input in &mut inputs {
        input.events.retain(|event| !is_tab(event));
    }
}

/// Gives the scene's camera the part of the window that the panel leaves free.
fn leave_room(
    windows: Query<&Window, With<PrimaryWindow>>,
    mut cameras: Query<&mut Camera, With<PanOrbitCamera>>,
) {
    let Ok(window) = windows.single() else {
        return;
    };
    let size = window.physical_size();
    let left = ((WIDTH * window.scale_factor()) as u32).min(size.x.saturating_sub(1));
    let free = UVec2::new(size.x - left, size.y).max(UVec2::ONE);
    for mut camera in &mut cameras {
        let current = camera.viewport.as_ref();
        if current.map(|viewport| viewport.physical_size) != Some(free) {
            camera.viewport =
                Some(Viewport { physical_position: UVec2::new(left, 0), physical_size: free, ..default() });
        }
    }
}

/// Resets the editor: another volume has other values.
fn show_all_values(_: On<VolumeLoaded>, mut editor: ResMut<TransferEditor>) {
    *editor = default();
}

fn choose_mode_by_key(
    keys: Res<ButtonInput<KeyCode>>,
    mut volumes: Query<(&mut VolumeShading, &mut AmbientOcclusion)>,
) {
    let digits = [KeyCode::Digit1, KeyCode::Digit2, KeyCode::Digit3, KeyCode::Digit4, KeyCode::Digit5];
    for (key, mode) in digits.into_iter().zip(ShadingMode::ALL) {
        if keys.just_pressed(key) {
            for (mut shading, mut occlusion) in &mut volumes {
                mode.apply(&mut shading, &mut occlusion);
            }
        }
    }
}

fn show(
    mut commands: Commands,
    mut contexts: EguiContexts,
    files: Files,
    readings: Readings,
    mut shown: ResMut<Shown>,
    mut volumes: Query<ShownVolume>,
    mut functions: ResMut<Assets<TransferFunction>>,
    mut editor: ResMut<TransferEditor>,
    mut last_runs: Local<LastRuns>,
    mut textures: Local<Textures>,
    by_clock: ResMut<TimePassesByClock>,
) -> Result {
    let mut by_clock = Mut::from(by_clock);
    let context = contexts.ctx_mut()?;
    let height = context.content_rect().height();
    let area = egui::Area::new("panel".into()).fixed_pos(egui::Pos2::ZERO).movable(false);
    area.show(context, |ui| {
        let frame = egui::Frame::side_top_panel(ui.style()).inner_margin(PADDING);
        frame.show(ui, |ui| {
            ui.set_width(WIDTH - 2.0 * PADDING);
            ui.set_height((height - 2.0 * PADDING).max(0.0));
            let scroll = egui::ScrollArea::vertical().auto_shrink(false).scroll_source(SCROLLED_BY);
            scroll.show(ui, |ui| {
                for (volume, mut function, ready, mut occlusion, shading) in &mut volumes {
                    file_panel::show(ui, &files, &shown, volume, *ready);
                    let chosen = files.reading.chosen(&files.list, &shown);
                    if let Some(choice) = dicom::panel::show(ui, &files.list, chosen, &mut textures) {
                        commands.trigger(OpenVolume(choice));
                    }
                    ui.separator();
                    show_shading(ui, shading, &mut occlusion);
                    if let Some(volume) = readings.volumes.get(&volume.0) {
                        let geometry = VolumeGeometry::of(volume);
                        occlusion_panel::show(ui, occlusion, functions.get(&function.0), &geometry);
                    }
                    ui.separator();
                    if let Some(volume) = readings.volumes.get(&volume.0)
                        && let Some(preset) = file_panel::choose_preset(ui, shown.function)
                    {
                        shown.function = FunctionSource::Preset(preset);
                        function.0 = functions.add(preset.transfer_function(volume));
                        *editor = default();
                    }
                    if let Some(content) = &shown.content {
                        edit_function(ui, &mut editor, functions.get_mut(&function.0), content);
                        ui.separator();
                    }
                }
                show_carver(ui, &readings);
                timings::show(
                    ui,
                    &readings.diagnostics,
                    &readings.status,
                    &mut last_runs,
                    by_clock.reborrow(),
                );
                show_help(ui);
            });
        });
    });
    give_keys_back(context);
    Ok(())
}

/// Takes the keyboard from a slider after its use. Only text fields that are being edited may keep it.
fn give_keys_back(context: &egui::Context) {
    if !context.text_edit_focused()
        && let Some(focused) = context.memory(|memory| memory.focused())
    {
        context.memory_mut(|memory| memory.surrender_focus(focused));
    }
}

fn show_shading(ui: &mut Ui, mut shading: Mut<VolumeShading>, occlusion: &mut Mut<AmbientOcclusion>) {
    let (mut new, mut new_occlusion) = (shading.clone(), (**occlusion).clone());
    let mut mode = ShadingMode::of(&new, &new_occlusion);
    ui.horizontal_wrapped(|ui| {
        for other in ShadingMode::ALL {
            ui.selectable_value(&mut mode, other, other.name());
        }
    });
    mode.apply(&mut new, &mut new_occlusion);
    choose_quality(ui, &mut new, &mut new_occlusion);
    occlusion.set_if_neq(new_occlusion);
    ui.add(Slider::new(&mut new.exposure, EXPOSURE).text("exposure"));
    ui.add(Slider::new(&mut new.occlusion_intensity, OCCLUSION_INTENSITY).text("occlusion intensity"));
    ui.add(Slider::new(&mut new.step_voxels, STEP_VOXELS).text("drawing step, voxels"));
    ui.checkbox(&mut new.jitter, "jitter the drawing steps");
    shading.set_if_neq(new);
}

/// Shows a menu of quality presets.
fn choose_quality(ui: &mut Ui, shading: &mut VolumeShading, occlusion: &mut AmbientOcclusion) {
    let current = Quality::of(shading, occlusion);
    let name = current.map_or("own settings", Quality::name);
    ComboBox::from_label("quality").selected_text(name).show_ui(ui, |ui| {
        for quality in Quality::ALL {
            if ui.selectable_label(current == Some(quality), quality.name()).clicked() {
                quality.apply(shading, occlusion);
            }
        }
    });
}

fn edit_function(
    ui: &mut Ui,
    editor: &mut TransferEditor,
    function: Option<AssetMut<TransferFunction>>,
    content: &Content,
) {
    let Some(mut function) = function else {
        ui.weak("the transfer function is being read");
        return;
    };
    let mut new = function.clone();
    transfer_editor::show(ui, editor, &mut new, content);
    if new != *function {
        *function = new;
    }
}

fn show_carver(ui: &mut Ui, readings: &Readings) {
    let selected = readings.hand.selected;
    if let Some((carver, clip)) = selected.and_then(|entity| readings.carvers.get(entity).ok()) {
        let does = match clip.operation {
            ClipOperation::Subtract => "removes what is inside",
            _ => "keeps what is inside",
        };
        ui.label(format!("selected: {}, {does}", carver.name));
    }
}

fn show_help(ui: &mut Ui) {
    egui::CollapsingHeader::new("help").default_open(true).show(ui, |ui| {
        Grid::new("help").num_columns(2).show(ui, |ui| {
            for [keys, effect] in HELP {
                ui.label(RichText::new(keys).strong());
                ui.label(effect);
                ui.end_row();
            }
        });
    });
}
