//! Methods of ambient occlusion: keys 1 to 7 choose a method, 0 shows the volume without occlusion.

use bevy::{core_pipeline::tonemapping::Tonemapping, prelude::*};
use bevy_contextual_ao::prelude::*;

const KEYS: [KeyCode; 7] = [
    KeyCode::Digit1,
    KeyCode::Digit2,
    KeyCode::Digit3,
    KeyCode::Digit4,
    KeyCode::Digit5,
    KeyCode::Digit6,
    KeyCode::Digit7,
];

fn main() {
    App::new()
        .add_plugins((DefaultPlugins, ContextualAoPlugin))
        .add_systems(Startup, setup)
        .add_systems(Update, (choose, swing))
        .run();
}

fn setup(mut commands: Commands, assets: Res<AssetServer>, mut meshes: ResMut<Assets<Mesh>>) {
    let near = Projection::Perspective(PerspectiveProjection { near: 0.001, ..default() });
    let view = Transform::from_xyz(-0.3, 0.15, 0.45).looking_at(Vec3::ZERO, Vec3::Y);
    // Shows the colours of the transfer function unchanged.
    commands.spawn((Camera3d::default(), Tonemapping::None, near, view));
    let head = VolumeBundle::new(assets.load("head_phantom.nrrd"))
        .with_transfer_function(assets.load("head_phantom.tf.ron"));
    commands.spawn(head);
    commands.spawn((ClipMesh::default(), Mesh3d(meshes.add(Sphere::new(0.05)))));
}

/// Changes the settings by keys, and writes the name of the method into the window's title.
fn choose(
    keys: Res<ButtonInput<KeyCode>>,
    mut volumes: Query<(&mut AmbientOcclusion, &mut VolumeShading)>,
    mut windows: Query<&mut Window>,
) {
    for (mut occlusion, mut shading) in &mut volumes {
        if keys.just_pressed(KeyCode::Digit0) {
            shading.ambient_occlusion = false;
        }
        for (key, method) in KEYS.into_iter().zip(OcclusionMethod::all()) {
            if keys.just_pressed(key) {
                shading.ambient_occlusion = true;
                occlusion.method = method;
            }
        }
        for mut window in windows.iter_mut().filter(|_| occlusion.is_changed() || shading.is_changed()) {
            let is_shown = shading.ambient_occlusion;
            window.title = if is_shown { occlusion.method.name().into() } else { "no occlusion".into() };
        }
    }
}

/// Moves the carvers to and fro.
fn swing(time: Res<Time>, mut carvers: Query<&mut Transform, With<ClipMesh>>) {
    for mut carver in &mut carvers {
        let swing = (0.5 * time.elapsed_secs()).sin();
        carver.translation = Vec3::new(0.06 * swing, 0.06, 0.08);
    }
}
