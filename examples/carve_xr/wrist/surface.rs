//! The surface of the panel: a rectangle above the left hand, with the image that egui draws.

use bevy::{
    camera::{RenderTarget, visibility::RenderLayers},
    ecs::schedule::ScheduleLabel,
    prelude::*,
    render::render_resource::TextureFormat,
};
use bevy_egui::EguiMultipassSchedule;

use super::{
    super::controls::{Controls, Side},
    pointer::Dot,
};

/// Width and height of the panel, metres.
pub const SIZE: Vec2 = Vec2::new(0.18, 0.24);
/// Its size in egui's points. Fewer make all larger.
pub const POINTS: Vec2 = Vec2::new(330.0, 440.0);
/// Pixels of the image per point. More are sharper near the eye.
pub const PIXELS_PER_POINT: f32 = 2.0;
const BACKGROUND: Color = Color::srgb(0.09, 0.095, 0.105);
const DOT_RADIUS: f32 = 0.002;

/// Place of the panel's middle in the left hand: along the forearm, turned up by 75 degrees. There it hides no carver.
pub const PLACE: Isometry3d = Isometry3d {
    rotation: Quat::from_xyzw(-0.608_761_4, 0.0, 0.0, 0.793_353_3),
    translation: bevy::math::Vec3A::new(0.0, 0.045, 0.17),
};

/// The panel's pass of egui.
#[derive(ScheduleLabel, Clone, Debug, PartialEq, Eq, Hash)]
pub struct PanelPass;

/// The panel's rectangle, in its own space: z is towards the reader.
#[derive(Component)]
pub struct Panel {
    /// The camera of its image, which is egui's context.
    pub context: Entity,
}

/// Gives the left hand the panel.
pub fn give_panel(
    hand: On<Add, Controls>,
    mut commands: Commands,
    hands: Query<&Controls>,
    mut images: ResMut<Assets<Image>>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    if !hands.get(hand.entity).is_ok_and(|controls| controls.side == Side::Left) {
        return;
    }
    let pixels = (PIXELS_PER_POINT * POINTS).as_uvec2();
    let image = Image::new_target_texture(pixels.x, pixels.y, TextureFormat::Rgba8UnormSrgb, None);
    let image = images.add(image);
    let context = commands
        .spawn((
            Camera2d,
            Camera { order: -1, clear_color: ClearColorConfig::Custom(BACKGROUND), ..default() },
            RenderTarget::Image(image.clone().into()),
            RenderLayers::none(),
            Msaa::Off,
            EguiMultipassSchedule::new(PanelPass),
        ))
        .id();
    let mut unlit = |material: StandardMaterial| {
        MeshMaterial3d(materials.add(StandardMaterial { unlit: true, ..material }))
    };
    let front = unlit(StandardMaterial { base_color_texture: Some(image), ..default() });
    let back = unlit(BACKGROUND.into());
    let light = unlit(Color::srgb(1.0, 0.6, 0.1).into());
    commands.entity(hand.entity).with_child((
        Panel { context },
        Mesh3d(meshes.add(Rectangle::from_size(SIZE))),
        front,
        Transform::from_isometry(PLACE),
        children![
            (
                Mesh3d(meshes.add(Cuboid::new(SIZE.x + 0.008, SIZE.y + 0.008, 0.004))),
                back,
                Transform::from_xyz(0.0, 0.0, -0.0025),
            ),
            (Dot, Mesh3d(meshes.add(Sphere::new(DOT_RADIUS))), light, Visibility::Hidden),
        ],
    ));
}
