//! Three carvers at once: a sphere cuts, a ring turns and cuts, a box keeps its inside.

use bevy::{core_pipeline::tonemapping::Tonemapping, prelude::*};
use bevy_contextual_ao::prelude::*;
use std::f32::consts::FRAC_PI_2;

/// Marks a carver that turns.
#[derive(Component)]
struct Turning;

fn main() {
    App::new()
        .add_plugins((DefaultPlugins, ContextualAoPlugin))
        .add_systems(Startup, setup)
        .add_systems(Update, turn)
        .run();
}

fn setup(
    mut commands: Commands,
    assets: Res<AssetServer>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let near = Projection::Perspective(PerspectiveProjection { near: 0.001, ..default() });
    let view = Transform::from_xyz(-0.25, 0.2, 0.45).looking_at(Vec3::ZERO, Vec3::Y);
    // Shows the colours of the transfer function unchanged.
    commands.spawn((Camera3d::default(), Tonemapping::None, near, view));
    commands.spawn((DirectionalLight { illuminance: light_consts::lux::OVERCAST_DAY, ..default() }, view));
    let head = VolumeBundle::new(assets.load("head_phantom.nrrd"))
        .with_transfer_function(assets.load("head_phantom.tf.ron"));
    commands.spawn(head);

    let sphere = Mesh3d(meshes.add(Sphere::new(0.05)));
    commands.spawn((ClipMesh::default(), sphere, Transform::from_xyz(-0.03, 0.08, 0.07)));

    // A carver with a material is drawn as well.
    let ring = Mesh3d(meshes.add(Torus { minor_radius: 0.006, major_radius: 0.07 }));
    let steel = MeshMaterial3d(materials.add(Color::srgb(0.7, 0.72, 0.75)));
    let lying = Transform::from_xyz(0.0, -0.02, 0.06).with_rotation(Quat::from_rotation_x(FRAC_PI_2));
    commands.spawn((ClipMesh::default(), ring, steel, lying, Turning));

    let keeps = Mesh3d(meshes.add(Cuboid::new(0.2, 0.2, 0.3)));
    commands.spawn((ClipMesh::intersect(), keeps, Transform::from_xyz(0.02, 0.0, 0.0)));
}

fn turn(time: Res<Time>, mut carvers: Query<&mut Transform, With<Turning>>) {
    for mut carver in &mut carvers {
        carver.rotate_y(time.delta_secs());
    }
}
