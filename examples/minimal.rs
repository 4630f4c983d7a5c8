//! The shortest app that shows a volume cut open.

use bevy::{core_pipeline::tonemapping::Tonemapping, prelude::*};
use bevy_contextual_ao::prelude::*;

fn main() {
    App::new().add_plugins((DefaultPlugins, ContextualAoPlugin)).add_systems(Startup, setup).run();
}

fn setup(mut commands: Commands, assets: Res<AssetServer>, mut meshes: ResMut<Assets<Mesh>>) {
    // A near plane at 1 mm. By default a camera sees nothing nearer than 0.1 m, and slices close objects open.
    let near = Projection::Perspective(PerspectiveProjection { near: 0.001, ..default() });
    let view = Transform::from_xyz(0.0, 0.0, 0.6).looking_at(Vec3::ZERO, Vec3::Y);
    // Shows the colours of the transfer function unchanged.
    commands.spawn((Camera3d::default(), Tonemapping::None, near, view));
    commands.spawn(VolumeBundle::new(assets.load("head_phantom.nrrd")));
    let place = Transform::from_xyz(0.05, 0.05, 0.05);
    commands.spawn((ClipMesh::default(), Mesh3d(meshes.add(Sphere::new(0.05))), place));
}
