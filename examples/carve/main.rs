//! Carves a volume by hand in a window: `cargo run --release --example carve -- [FILE]`.
//!
//! Drag the sphere, the box and the ring through the head; the panel on the left explains the keys,
//! sets the shading and the transfer function, and shows what each pass takes.

mod cutters;
mod hands;
mod loading;
mod occlusion_panel;
mod panel;
mod timings;
mod transfer_editor;

use bevy::{
    asset::UnapprovedPathMode,
    camera::{CameraOutputMode, visibility::RenderLayers},
    core_pipeline::tonemapping::Tonemapping,
    diagnostic::FrameTimeDiagnosticsPlugin,
    prelude::*,
    render::{diagnostic::RenderDiagnosticsPlugin, render_resource::BlendState},
};
use bevy_contextual_ao::prelude::*;
use bevy_egui::{EguiGlobalSettings, EguiPlugin, PrimaryEguiContext};
use bevy_panorbit_camera::{PanOrbitCamera, PanOrbitCameraPlugin};
use clap::Parser;
use std::path::PathBuf;

/// Carves a volume by hand, shaded with contextual ambient occlusion.
#[derive(Parser, Resource, Clone)]
pub struct Arguments {
    /// Volume to open: .nii, .nii.gz, .hdr, .nrrd, .nhdr, .mha or .mhd. A generated head if left out.
    file: Option<PathBuf>,
    /// Colours and opacities: a volume property of 3D Slicer (.vp) or .tf.ron.
    #[arg(long, value_name = "FILE")]
    transfer_function: Option<PathBuf>,
}

const BACKGROUND: Color = Color::srgb(0.09, 0.095, 0.105);
/// Where the camera stands at first, around the volume: to its left and a little above, radians.
const FIRST_YAW: f32 = 0.55;
const FIRST_PITCH: f32 = 0.25;
/// The nearest visible point, metres.
const NEAR: f32 = 0.005;

/// Where the generated head lies: in the project's folder, which need not be where it was built.
fn assets_folder() -> String {
    let project = std::env::var("CARGO_MANIFEST_DIR");
    format!("{}/assets", project.as_deref().unwrap_or(env!("CARGO_MANIFEST_DIR")))
}

fn main() -> AppExit {
    let arguments = Arguments::parse();
    let window = Window { title: "carve".into(), ..default() };
    App::new()
        .insert_resource(arguments)
        .insert_resource(ClearColor(BACKGROUND))
        .add_plugins(
            DefaultPlugins
                .set(AssetPlugin {
                    file_path: assets_folder(),
                    // Files named on the command line lie anywhere.
                    unapproved_path_mode: UnapprovedPathMode::Allow,
                    ..default()
                })
                .set(WindowPlugin { primary_window: Some(window), ..default() }),
        )
        .add_plugins((
            ContextualAoPlugin::default(),
            EguiPlugin::default(),
            MeshPickingPlugin,
            PanOrbitCameraPlugin,
            FrameTimeDiagnosticsPlugin::default(),
            RenderDiagnosticsPlugin,
        ))
        .add_plugins((loading::LoadingPlugin, cutters::CuttersPlugin, hands::HandsPlugin, panel::PanelPlugin))
        .add_systems(Startup, spawn_cameras)
        .run()
}

/// The camera of the scene, and one above it for the panel: the scene's is only as large as what the
/// panel leaves free.
fn spawn_cameras(mut commands: Commands, mut egui_settings: ResMut<EguiGlobalSettings>) {
    egui_settings.auto_create_primary_context = false;
    commands.spawn((
        PanOrbitCamera { yaw: Some(FIRST_YAW), pitch: Some(FIRST_PITCH), ..default() },
        Projection::Perspective(PerspectiveProjection { near: NEAR, ..default() }),
        Tonemapping::None,
        Msaa::Off,
    ));
    commands.spawn((
        PrimaryEguiContext,
        Camera2d,
        RenderLayers::none(),
        Camera {
            order: 1,
            output_mode: CameraOutputMode::Write {
                blend_state: Some(BlendState::ALPHA_BLENDING),
                clear_color: ClearColorConfig::None,
            },
            clear_color: ClearColorConfig::Custom(Color::NONE),
            ..default()
        },
        Msaa::Off,
    ));
}
