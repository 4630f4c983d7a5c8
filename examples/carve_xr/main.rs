//! Carves a volume with both hands: `cargo run --release --example carve_xr -- [FILE]`.
//!
//! In an OpenXR headset, each hand holds a carver: the trigger cuts, the grip grabs the volume, both hands turn and scale it. The
//! panel on the left wrist has the settings. Without a headset, the mouse moves a hand. `docs/xr.md` lists the controls.

mod carvers;
mod controls;
mod desktop;
mod eyes;
mod frame_rate;
mod headset;
mod leaving;
mod rig;
mod scene;
mod shapes;
mod wrist;

/// Opening files, as `carve` does.
#[allow(dead_code, reason = "some of it is for the panel of `carve`")]
#[path = "../carve"]
mod carve {
    pub mod content;
    pub mod dicom;
    pub mod dropping;
    pub mod joint_histogram;
    pub mod loading;
    pub mod shown;
}

use bevy::{
    asset::UnapprovedPathMode, diagnostic::FrameTimeDiagnosticsPlugin, prelude::*,
    render::pipelined_rendering::PipelinedRenderingPlugin, window::ExitCondition,
};
use bevy_contextual_ao::prelude::*;
use bevy_egui::EguiPlugin;
use bevy_mod_openxr::add_xr_plugins;
use bevy_mod_xr::session::XrState;
use clap::Parser;
use contextual_ao_kit::{budget::BudgetOptions, files::FileOptions, headless::project_folder};
use frame_rate::FrameOptions;

/// Carves a volume with both hands, in a headset or on the desktop.
#[derive(Parser)]
struct Arguments {
    #[command(flatten)]
    files: FileOptions,
    #[command(flatten)]
    frames: FrameOptions,
    /// Stays on the desktop, and asks for no headset.
    #[arg(long)]
    desktop: bool,
    #[command(flatten)]
    budget: BudgetOptions,
}

const BACKGROUND: Color = Color::srgb(0.09, 0.095, 0.105);
const NO_RUNTIME: &str = "No OpenXR runtime was found: this is the desktop.";

fn main() -> AppExit {
    let arguments = Arguments::parse();
    let window = Window { title: "carve_xr".into(), ..default() };
    // A headset waits for its frames: they are not pipelined.
    let plugins = DefaultPlugins.build().disable::<PipelinedRenderingPlugin>();
    let plugins = if arguments.desktop { plugins } else { add_xr_plugins(plugins) };
    let mut app = App::new();
    app.insert_resource(arguments.budget.budget())
        .insert_resource(ClearColor(BACKGROUND))
        .add_plugins(
            plugins
                .set(AssetPlugin {
                    file_path: project_folder().join("assets").to_string_lossy().into_owned(),
                    // Files named on the command line may lie anywhere.
                    unapproved_path_mode: UnapprovedPathMode::Allow,
                    ..default()
                })
                .set(WindowPlugin {
                    primary_window: Some(window),
                    // `leaving` ends the app.
                    exit_condition: ExitCondition::DontExit,
                    ..default()
                }),
        )
        .add_plugins((ContextualAoPlugin, EguiPlugin::default(), FrameTimeDiagnosticsPlugin::default()))
        .add_plugins((
            carve::loading::LoadingPlugin,
            carve::dropping::DroppingPlugin,
            carve::dicom::DicomPlugin,
            controls::ControlsPlugin,
            rig::RigPlugin,
            eyes::EyesPlugin,
            carvers::CarversPlugin,
            scene::ScenePlugin,
            wrist::WristPlugin,
            frame_rate::FrameRatePlugin,
            leaving::LeavingPlugin,
        ));
    let has_runtime =
        app.world().get_resource::<XrState>().is_some_and(|state| *state != XrState::Unavailable);
    if has_runtime {
        app.add_plugins(headset::HeadsetPlugin);
    } else {
        app.add_plugins(desktop::DesktopPlugin);
    }
    if !has_runtime && !arguments.desktop {
        warn!("{NO_RUNTIME}");
        app.insert_resource(wrist::Notice(Some(NO_RUNTIME)));
    }
    app.insert_resource(arguments.files).insert_resource(arguments.frames).run()
}
