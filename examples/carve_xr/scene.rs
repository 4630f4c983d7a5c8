//! A room with a stand, and the volume on it.

use bevy::prelude::*;
use bevy_contextual_ao::{
    prelude::*,
    volume::{VolumeGeometry, WORLD_UNITS_PER_MM},
};

use super::{carvers::RemoveAll, headset::Passthrough, rig::ROOM};

/// Height of the stand, and radius of its top, metres.
const STAND: f32 = 1.0;
const STAND_RADIUS: f32 = 0.17;
const WALL_HEIGHT: f32 = 2.6;
const FLOOR: Color = Color::srgb(0.32, 0.34, 0.36);
const WALL: Color = Color::srgb(0.46, 0.48, 0.5);
const STAND_COLOR: Color = Color::srgb(0.62, 0.6, 0.57);

pub struct ScenePlugin;

impl Plugin for ScenePlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Passthrough>()
            .insert_resource(GlobalAmbientLight { brightness: 500.0, ..default() })
            .add_systems(Startup, build_room)
            .add_systems(Update, show_room.run_if(resource_changed::<Passthrough>))
            .add_observer(set_up_volume)
            .add_observer(welcome)
            .add_observer(reset);
    }
}

/// Asks to put volumes back onto the stand, at life-size.
#[derive(Event, Clone, Copy, Debug)]
pub struct Reset;

/// A part of the room. Where the real room is seen, it is hidden.
#[derive(Component)]
struct Room;

fn build_room(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let mut matt = |color| {
        let matt =
            StandardMaterial { base_color: color, perceptual_roughness: 0.95, reflectance: 0.1, ..default() };
        MeshMaterial3d(materials.add(matt))
    };
    let (floor, wall, stand) = (matt(FLOOR), matt(WALL), matt(STAND_COLOR));
    let mut part = |mesh: Mesh, material: &MeshMaterial3d<StandardMaterial>, place: Transform| {
        commands.spawn((Room, Mesh3d(meshes.add(mesh)), material.clone(), place));
    };
    part(Plane3d::new(Vec3::Y, ROOM).into(), &floor, Transform::IDENTITY);
    for turns in 0..4 {
        let towards = Quat::from_rotation_y(turns as f32 * core::f32::consts::FRAC_PI_2);
        let half = Vec2::new(ROOM.x, 0.5 * WALL_HEIGHT);
        let place = Transform::from_translation(towards * Vec3::new(0.0, half.y, -ROOM.y));
        part(Plane3d::new(Vec3::Z, half).into(), &wall, place.with_rotation(towards));
    }
    let column = Cylinder::new(0.7 * STAND_RADIUS, STAND).mesh().resolution(64).build();
    part(column, &stand, Transform::from_xyz(0.0, 0.5 * STAND, 0.0));
    let top = Cylinder::new(STAND_RADIUS, 0.02).mesh().resolution(64).build();
    part(top, &stand, Transform::from_xyz(0.0, STAND - 0.01, 0.0));
    // Two lights from above, without shadows: they cost little.
    for (illuminance, from) in [(1800.0, Vec3::new(-1.0, 2.5, 1.5)), (700.0, Vec3::new(1.5, 1.0, 0.5))] {
        let light = DirectionalLight { illuminance, ..default() };
        commands.spawn((light, Transform::from_translation(from).looking_at(Vec3::ZERO, Vec3::Y)));
    }
}

fn show_room(passthrough: Res<Passthrough>, mut room: Query<&mut Visibility, With<Room>>) {
    for mut part in &mut room {
        part.set_if_neq(if passthrough.is_on { Visibility::Hidden } else { Visibility::Inherited });
    }
}

/// Lets hands grab a volume, and sets its look. A headlight costs little, and cuts are lit wherever they face.
fn set_up_volume(volume: On<Add, Volume3d>, mut commands: Commands, mut volumes: Query<&mut VolumeShading>) {
    if let Ok(mut shading) = volumes.get_mut(volume.entity) {
        shading.lighting = VolumeLighting::Headlight;
        // Its grain would differ between eyes.
        shading.jitter = false;
    }
    commands.entity(volume.entity).insert(Grabbable { min_scale: 0.05, max_scale: 20.0, ..default() });
}

/// Puts a volume that was loaded onto the stand. What was left in the one before means nothing to it.
fn welcome(_: On<VolumeLoaded>, mut commands: Commands) {
    commands.trigger(Reset);
    commands.trigger(RemoveAll);
}

fn reset(_: On<Reset>, mut volumes: Query<(&Volume3d, &mut Transform)>, assets: Res<Assets<Volume>>) {
    for (volume, mut transform) in &mut volumes {
        if let Some(volume) = assets.get(&volume.0) {
            *transform = on_stand(volume);
        }
    }
}

/// Place of a life-size volume on the stand.
fn on_stand(volume: &Volume) -> Transform {
    let corners = VolumeGeometry::of(volume).corners().map(|corner| corner.as_vec3() * WORLD_UNITS_PER_MM);
    let lowest = corners.iter().map(|corner| corner.y).fold(f32::INFINITY, f32::min);
    Transform::from_xyz(0.0, STAND - lowest, 0.0)
}
