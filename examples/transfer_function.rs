//! A transfer function in code: the space bar takes the skin off and puts it on again.

use bevy::{core_pipeline::tonemapping::Tonemapping, prelude::*};
use bevy_contextual_ao::prelude::*;

/// Transfer function of the head.
#[derive(Resource)]
struct Function(Handle<TransferFunction>);

fn main() {
    App::new()
        .add_plugins((DefaultPlugins, ContextualAoPlugin))
        .add_systems(Startup, setup)
        .add_systems(Update, toggle_skin)
        .run();
}

/// Colours and opacities by Hounsfield units.
fn function(skin_opacity: f32) -> TransferFunction {
    let point = |value, color, opacity| ControlPoint { value, color, opacity };
    let (skin, bone) = ([0.9, 0.66, 0.52], [0.95, 0.92, 0.82]);
    TransferFunction {
        points: vec![
            point(-700.0, skin, 0.0),
            point(-250.0, skin, skin_opacity),
            point(-100.0, skin, skin_opacity),
            point(100.0, skin, 0.0),
            point(250.0, bone, 0.0),
            point(500.0, bone, 1.0),
        ],
        ..default()
    }
}

fn setup(mut commands: Commands, assets: Res<AssetServer>, mut functions: ResMut<Assets<TransferFunction>>) {
    let near = Projection::Perspective(PerspectiveProjection { near: 0.001, ..default() });
    let view = Transform::from_xyz(0.25, 0.15, 0.5).looking_at(Vec3::ZERO, Vec3::Y);
    // Shows the colours of the transfer function unchanged.
    commands.spawn((Camera3d::default(), Tonemapping::None, near, view));
    let handle = functions.add(function(0.8));
    let head = VolumeBundle::new(assets.load("head_phantom.nrrd"));
    commands.spawn(head.with_transfer_function(handle.clone()));
    commands.insert_resource(Function(handle));
}

fn toggle_skin(
    keys: Res<ButtonInput<KeyCode>>,
    handle: Res<Function>,
    mut functions: ResMut<Assets<TransferFunction>>,
    mut is_off: Local<bool>,
) {
    if keys.just_pressed(KeyCode::Space) {
        *is_off = !*is_off;
        // Volumes that show the function change in the same frame.
        if let Some(mut shown) = functions.get_mut(&handle.0) {
            *shown = function(if *is_off { 0.0 } else { 0.8 });
        }
    }
}
