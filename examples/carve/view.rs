//! Cameras of the scene and of the panel. The scene's camera shows all of a volume once it is loaded.

use bevy::{
    camera::{CameraOutputMode, visibility::RenderLayers},
    core_pipeline::tonemapping::Tonemapping,
    prelude::*,
    render::render_resource::BlendState,
};
use bevy_contextual_ao::{
    prelude::*,
    volume::{VolumeGeometry, WORLD_UNITS_PER_MM},
};
use bevy_egui::{EguiGlobalSettings, PrimaryEguiContext};
use bevy_panorbit_camera::{FocusBoundsShape, PanOrbitCamera};

use contextual_ao_kit::framing::Framing;

/// First place of the camera around the volume: to its left and a little above, radians.
const FIRST_YAW: f32 = 0.55;
const FIRST_PITCH: f32 = 0.25;

pub struct ViewPlugin;

impl Plugin for ViewPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(Startup, (spawn_camera, spawn_panel_camera)).add_observer(show_all);
    }
}

fn spawn_camera(mut commands: Commands) {
    commands.spawn(scene_camera());
}

pub fn scene_camera() -> impl Bundle {
    (
        PanOrbitCamera { yaw: Some(FIRST_YAW), pitch: Some(FIRST_PITCH), ..default() },
        Projection::Perspective(default()),
        Tonemapping::None,
        Msaa::Off,
    )
}

/// Spawns a camera above the scene's camera. The scene's camera covers only the part that the panel leaves free.
fn spawn_panel_camera(mut commands: Commands, mut egui_settings: ResMut<EguiGlobalSettings>) {
    egui_settings.auto_create_primary_context = false;
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

/// Corners of a volume in the world.
pub fn corners(volume: &Volume, transform: &Transform) -> [Vec3; 8] {
    let corners = VolumeGeometry::of(volume).corners();
    corners.map(|corner| transform.transform_point(corner.as_vec3() * WORLD_UNITS_PER_MM))
}

/// Shows all of a loaded volume. The camera's lengths follow the volume's size.
pub fn show_all(
    loaded: On<VolumeLoaded>,
    volumes: Res<Assets<Volume>>,
    entities: Query<(&Volume3d, &Transform)>,
    mut cameras: Query<(&mut PanOrbitCamera, &mut Projection)>,
) {
    let Ok((handle, transform)) = entities.get(loaded.entity) else {
        return;
    };
    let framing = volumes.get(&handle.0).and_then(|volume| Framing::of(corners(volume, transform)));
    let Some(framing) = framing else {
        return;
    };
    let [nearest, farthest] = framing.distances();
    for (mut camera, mut projection) in &mut cameras {
        let Projection::Perspective(perspective) = &mut *projection else {
            continue;
        };
        framing.set_planes(perspective);
        let distance = framing.distance(perspective.fov, perspective.aspect_ratio);
        camera.focus = framing.center;
        camera.target_focus = framing.center;
        camera.focus_bounds_origin = framing.center;
        camera.focus_bounds_shape = Some(FocusBoundsShape::Sphere(Sphere::new(framing.farthest_focus())));
        camera.radius = Some(distance);
        camera.target_radius = distance;
        camera.zoom_lower_limit = nearest;
        camera.zoom_upper_limit = Some(farthest);
        camera.force_update = true;
    }
}
