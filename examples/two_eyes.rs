//! Two eyes side by side: occlusion is computed once for both.

use bevy::{camera::Viewport, core_pipeline::tonemapping::Tonemapping, prelude::*};
use bevy_contextual_ao::prelude::*;

/// Distance between the eyes, metres.
const APART: f32 = 0.064;

/// 0 is the left eye, 1 the right one.
#[derive(Component)]
struct Eye(u32);

fn main() {
    App::new()
        .add_plugins((DefaultPlugins, ContextualAoPlugin))
        .add_systems(Startup, setup)
        .add_systems(Update, (split_window, swing))
        .run();
}

fn setup(mut commands: Commands, assets: Res<AssetServer>, mut meshes: ResMut<Assets<Mesh>>) {
    for eye in [0, 1] {
        let near = Projection::Perspective(PerspectiveProjection { near: 0.001, ..default() });
        let side = (eye as f32 - 0.5) * APART;
        let view = Transform::from_xyz(side, 0.1, 0.6).looking_at(Vec3::ZERO, Vec3::Y);
        let camera = Camera { order: eye as isize, ..default() };
        commands.spawn((Camera3d::default(), Tonemapping::None, camera, near, view, Eye(eye)));
    }
    let head = VolumeBundle::new(assets.load("head_phantom.nrrd"))
        .with_transfer_function(assets.load("head_phantom.tf.ron"));
    commands.spawn(head);
    commands.spawn((ClipMesh::default(), Mesh3d(meshes.add(Sphere::new(0.05)))));
}

/// Gives each eye a half of the window.
fn split_window(windows: Query<&Window, Changed<Window>>, mut eyes: Query<(&mut Camera, &Eye)>) {
    for window in &windows {
        let half = UVec2::new(window.physical_width() / 2, window.physical_height()).max(UVec2::ONE);
        for (mut camera, eye) in &mut eyes {
            let physical_position = UVec2::new(eye.0 * half.x, 0);
            camera.viewport = Some(Viewport { physical_position, physical_size: half, ..default() });
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
