//! A head on a table, in a room with a window, a lamp and a glass: volumes under the lights of the scene, with shadows both
//! ways. A mask of its brain, which the ball does not carve, shares the head's space. Drag the ball, or the tool; drag with
//! the right button to look around, scroll to come nearer.

use bevy::{
    camera::Exposure,
    core_pipeline::tonemapping::Tonemapping,
    input::mouse::{AccumulatedMouseMotion, AccumulatedMouseScroll},
    light::{CascadeShadowConfigBuilder, NotShadowCaster},
    picking::pointer::PointerButton,
    prelude::*,
};
use bevy_contextual_ao::{prelude::*, volume::TransferFunctionError};

/// Height of the table's top, metres. The head's centre is above it.
const TABLE: f32 = -0.128;

/// What the camera looks at.
const TARGET: Vec3 = Vec3::new(0.02, -0.01, 0.0);

/// What the mouse can move.
#[derive(Component)]
struct Movable;

/// The lamp, which swings.
#[derive(Component)]
struct Lamp;

fn main() {
    App::new()
        .add_plugins((DefaultPlugins, MeshPickingPlugin, ContextualAoPlugin))
        .insert_resource(ClearColor(Color::srgb(0.55, 0.7, 0.9)))
        .insert_resource(GlobalAmbientLight { brightness: 300.0, ..default() })
        .add_systems(Startup, (build_room, furnish, spawn_head))
        .add_systems(Update, (swing, orbit))
        .add_observer(drag)
        .run();
}

/// Walls with a window, through which the sun shines.
fn build_room(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let wall = materials.add(StandardMaterial {
        base_color: Color::srgb(0.82, 0.78, 0.7),
        perceptual_roughness: 0.95,
        reflectance: 0.2,
        ..default()
    });
    let mut part = |size: Vec3, place: Vec3| {
        let mesh = Mesh3d(meshes.add(Cuboid::from_size(size)));
        commands.spawn((mesh, MeshMaterial3d(wall.clone()), Transform::from_translation(place)));
    };
    // Back, right and floor; on the left four parts around the window.
    part(Vec3::new(3.0, 2.0, 0.05), Vec3::new(0.0, 0.2, -1.1));
    part(Vec3::new(0.05, 2.0, 3.0), Vec3::new(1.3, 0.2, 0.0));
    part(Vec3::new(3.0, 0.05, 3.0), Vec3::new(0.0, -0.8, 0.0));
    part(Vec3::new(0.05, 0.8, 3.0), Vec3::new(-1.3, -0.4, 0.0));
    part(Vec3::new(0.05, 0.5, 3.0), Vec3::new(-1.3, 1.0, 0.0));
    part(Vec3::new(0.05, 2.0, 1.1), Vec3::new(-1.3, 0.2, -0.9));
    part(Vec3::new(0.05, 2.0, 1.1), Vec3::new(-1.3, 0.2, 0.9));
    let sun = DirectionalLight {
        illuminance: 2500.0,
        color: Color::srgb(1.0, 0.95, 0.85),
        shadow_maps_enabled: true,
        // A head is small: Bevy's own bias of 2 cm would leave out the shadow under a chin.
        shadow_depth_bias: 0.002,
        ..default()
    };
    let cascades = CascadeShadowConfigBuilder {
        num_cascades: 2,
        minimum_distance: 0.05,
        first_cascade_far_bound: 0.9,
        maximum_distance: 3.0,
        ..default()
    };
    let from = Transform::from_xyz(-1.6, 1.0, 0.5).looking_at(Vec3::ZERO, Vec3::Y);
    commands.spawn((sun, cascades.build(), from));
    commands.spawn((
        Camera3d::default(),
        Tonemapping::AcesFitted,
        Exposure { ev100: 8.0 },
        Msaa::Sample4,
        Projection::Perspective(PerspectiveProjection { near: 0.005, ..default() }),
        Transform::from_xyz(0.22, 0.1, 0.56).looking_at(TARGET, Vec3::Y),
    ));
}

/// A table with a glass and a tool, and a lamp over it.
fn furnish(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let wood = materials.add(StandardMaterial {
        base_color: Color::srgb(0.45, 0.28, 0.16),
        perceptual_roughness: 0.6,
        ..default()
    });
    commands.spawn((
        Mesh3d(meshes.add(Cuboid::new(1.1, 0.03, 0.7))),
        MeshMaterial3d(wood),
        Transform::from_xyz(0.0, TABLE - 0.015, 0.0),
    ));
    let glass = materials.add(StandardMaterial {
        base_color: Color::srgba(0.75, 0.9, 0.95, 0.25),
        alpha_mode: AlphaMode::Blend,
        perceptual_roughness: 0.05,
        ..default()
    });
    commands.spawn((
        Mesh3d(meshes.add(Cylinder::new(0.035, 0.11))),
        MeshMaterial3d(glass),
        Transform::from_xyz(0.17, TABLE + 0.055, 0.13),
        NotShadowCaster,
    ));
    let steel = materials.add(StandardMaterial {
        base_color: Color::srgb(0.7, 0.72, 0.75),
        metallic: 1.0,
        perceptual_roughness: 0.35,
        ..default()
    });
    commands.spawn((
        Mesh3d(meshes.add(Capsule3d::new(0.006, 0.16))),
        MeshMaterial3d(steel),
        Transform::from_xyz(-0.16, TABLE + 0.07, 0.12).with_rotation(Quat::from_rotation_z(-1.1)),
        Movable,
    ));
    let lamp = PointLight {
        intensity: 9000.0,
        color: Color::srgb(1.0, 0.75, 0.45),
        range: 3.0,
        shadow_maps_enabled: true,
        shadow_depth_bias: 0.004,
        ..default()
    };
    let bulb =
        materials.add(StandardMaterial { emissive: LinearRgba::rgb(900.0, 620.0, 330.0), ..default() });
    let bulb = (Mesh3d(meshes.add(Sphere::new(0.02))), MeshMaterial3d(bulb), NotShadowCaster);
    // The bulb is an entity of its own: a light with a mesh shines only while the mesh is in view.
    commands.spawn((lamp, Transform::default(), Visibility::default(), Lamp, children![bulb]));
}

/// The head with the mask of its brain, and the ball that carves the head alone.
fn spawn_head(
    mut commands: Commands,
    assets: Res<AssetServer>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    mut functions: ResMut<Assets<TransferFunction>>,
) -> Result {
    let mut head = VolumeBundle::new(assets.load("head_phantom.nrrd"))
        .with_transfer_function(assets.load("head_phantom.tf.ron"));
    head.shading.lighting = VolumeLighting::SceneLights;
    let head = commands.spawn(head).id();
    let mut brain = VolumeBundle::new(assets.load("head_phantom_brain.nrrd"))
        .with_transfer_function(functions.add(glow()?));
    brain.shading.lighting = VolumeLighting::SceneLights;
    commands.spawn((brain, NotShadowCaster));
    // A faint ball is seen, and carves.
    let faint = materials.add(StandardMaterial {
        base_color: Color::srgba(0.4, 0.6, 1.0, 0.08),
        alpha_mode: AlphaMode::Blend,
        ..default()
    });
    commands.spawn((
        ClipMesh { targets: ClipTargets::Only(vec![head]), ..default() },
        Mesh3d(meshes.add(Sphere::new(0.06))),
        MeshMaterial3d(faint),
        (Transform::from_xyz(0.06, 0.075, 0.065), NotShadowCaster, Movable),
    ));
    Ok(())
}

/// Colours and opacities for the mask of the brain: the inside glows faintly.
fn glow() -> Result<TransferFunction, TransferFunctionError> {
    TransferFunction::ramp(60.0, 255.0, 0.12, [0.2, 0.85, 0.75])
}

/// Swings the lamp.
fn swing(time: Res<Time>, mut lamps: Query<&mut Transform, With<Lamp>>) {
    let swing = (0.6 * time.elapsed_secs()).sin();
    for mut lamp in &mut lamps {
        lamp.translation = Vec3::new(0.35 * swing + 0.1, 0.35, 0.25);
    }
}

/// Moves what is dragged in the plane that faces the camera.
fn drag(
    drag: On<Pointer<Drag>>,
    mut movables: Query<&mut Transform, With<Movable>>,
    cameras: Query<(&Camera, &GlobalTransform)>,
) {
    let (Ok(mut moved), Ok((camera, view))) = (movables.get_mut(drag.entity), cameras.single()) else {
        return;
    };
    let (Some(size), PointerButton::Primary) = (camera.logical_viewport_size(), drag.button) else {
        return;
    };
    let distance = (moved.translation - view.translation()).dot(*view.forward());
    // A perspective of 45 degrees.
    let per_pixel = 2.0 * distance * 22.5f32.to_radians().tan() / size.y;
    moved.translation += per_pixel * (drag.delta.x * view.right() + drag.delta.y * view.down());
}

/// Looks around with the right button, and comes nearer with the wheel.
fn orbit(
    buttons: Res<ButtonInput<MouseButton>>,
    (motion, scroll): (Res<AccumulatedMouseMotion>, Res<AccumulatedMouseScroll>),
    mut camera: Single<&mut Transform, With<Camera3d>>,
) {
    let target = TARGET;
    if buttons.pressed(MouseButton::Right) {
        let around = Quat::from_rotation_y(-0.005 * motion.delta.x);
        let up = Quat::from_axis_angle(*camera.right(), -0.005 * motion.delta.y);
        camera.rotate_around(target, around * up);
    }
    if scroll.delta.y != 0.0 {
        let nearer = 0.9f32.powf(scroll.delta.y.clamp(-3.0, 3.0));
        camera.translation = target + nearer * (camera.translation - target);
    }
    camera.look_at(target, Vec3::Y);
}
