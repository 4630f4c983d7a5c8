//! Carves a volume by hand in a window: `cargo run --release --example carve -- [FILE]`.
//!
//! Drag the sphere, the box and the ring through the head. A double click puts the selected one there. The panel on the
//! left explains the keys and sets the shading and the transfer function. It also shows the time of each pass. Files and
//! folders dropped on the window are opened. Series of DICOM files are listed in the panel.

mod carvers;
mod content;
mod dicom;
mod dropping;
mod file_panel;
mod gizmos;
mod gradient_editor;
mod hands;
mod joint_histogram;
mod loading;
mod occlusion_panel;
mod panel;
mod picture;
mod shown;
mod timings;
mod transfer_editor;
mod view;

use bevy::{
    asset::UnapprovedPathMode, diagnostic::FrameTimeDiagnosticsPlugin, prelude::*,
    render::diagnostic::RenderDiagnosticsPlugin,
};
use bevy_contextual_ao::prelude::*;
use bevy_egui::EguiPlugin;
use bevy_panorbit_camera::PanOrbitCameraPlugin;
use clap::Parser;
use contextual_ao_kit::{budget::BudgetOptions, files::FileOptions};

/// Carves a volume by hand, shaded with contextual ambient occlusion.
#[derive(Parser)]
struct Arguments {
    #[command(flatten)]
    files: FileOptions,
    #[command(flatten)]
    budget: BudgetOptions,
}

const BACKGROUND: Color = Color::srgb(0.09, 0.095, 0.105);
/// Folder of the generated head, in the project's folder. The project may lie elsewhere than where it was built.
fn assets_folder() -> String {
    let project = std::env::var("CARGO_MANIFEST_DIR");
    format!("{}/assets", project.as_deref().unwrap_or(env!("CARGO_MANIFEST_DIR")))
}

fn main() -> AppExit {
    let arguments = Arguments::parse();
    let window = Window { title: "carve".into(), ..default() };
    App::new()
        .insert_resource(arguments.budget.budget())
        .insert_resource(arguments.files)
        .insert_resource(ClearColor(BACKGROUND))
        .add_plugins(
            DefaultPlugins
                .set(AssetPlugin {
                    file_path: assets_folder(),
                    // Files named on the command line may lie anywhere.
                    unapproved_path_mode: UnapprovedPathMode::Allow,
                    ..default()
                })
                .set(WindowPlugin { primary_window: Some(window), ..default() }),
        )
        .add_plugins((
            ContextualAoPlugin,
            EguiPlugin::default(),
            MeshPickingPlugin,
            PanOrbitCameraPlugin,
            FrameTimeDiagnosticsPlugin::default(),
            RenderDiagnosticsPlugin,
        ))
        .add_plugins((
            loading::LoadingPlugin,
            dropping::DroppingPlugin,
            dicom::DicomPlugin,
            view::ViewPlugin,
            carvers::CarversPlugin,
            hands::HandsPlugin,
            panel::PanelPlugin,
            picture::PicturePlugin,
            gizmos::GizmosPlugin,
        ))
        .run()
}
