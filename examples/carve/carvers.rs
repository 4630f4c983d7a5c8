//! The three carvers: their shapes, starts and looks.

use bevy::{camera::primitives::Aabb, mesh::MeshMergeError, picking::hover::Hovered, prelude::*};
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::outlines::Outlines;

use super::{hands::Hand, view};

pub struct CarversPlugin;

impl Plugin for CarversPlugin {
    fn build(&self, app: &mut App) {
        app.add_observer(place_carvers).add_systems(Update, paint);
    }
}

/// A carver that is moved by hand. Carvers are numbered from 0, in the order of the Tab key.
#[derive(Component)]
pub struct Carver {
    pub index: usize,
    pub name: &'static str,
    /// Transform at the start and after a reset.
    pub home: Transform,
}

/// The coat of a carver: drawn faintly over the whole shape, or as its outline.
#[derive(Component, Clone, Copy)]
enum Coat {
    Body,
    Outline,
}

/// Radius of the ring's tube. The tube bends around a circle of radius 1.
const RING_TUBE: f32 = 0.3;
/// Half the size of the box.
const BOX: Vec3 = Vec3::new(1.0, 0.6, 0.6);
/// The lines of an outline, where the shape has a radius of 1.
const LINES: Outlines = Outlines { line_radius: 0.01 };
/// Depth bias in diagonals of the volume's box. Carvers are drawn after the volume, wherever they are: they are not
/// part of the picture.
const IN_FRONT: f32 = 100.0;
const SUBTRACTING: Srgba = Srgba::rgb(0.42, 0.78, 1.0);
const INTERSECTING: Srgba = Srgba::rgb(0.55, 1.0, 0.45);
/// Opacity of body and outline: at rest, selected, under the pointer or in the hand.
const OPACITIES: [[f32; 2]; 3] = [[0.01, 0.35], [0.02, 0.65], [0.05, 0.95]];

/// Name, size, place and rotation of a carver. The size is in units of the smallest half side of the volume's box.
/// The place is from the box's middle, in units of its half sides.
type Start = (&'static str, f32, Vec3, Quat);

fn starts() -> [Start; 3] {
    [
        ("sphere", 0.55, Vec3::new(0.42, 0.62, 0.62), Quat::IDENTITY),
        ("box", 0.34, Vec3::new(0.66, -0.35, 0.32), Quat::from_rotation_y(-0.5)),
        ("ring", 0.38, Vec3::new(0.02, -0.42, 0.64), Quat::from_rotation_x(1.4)),
    ]
}

/// Gives carvers to a loaded volume, in place of those of a volume of another size.
fn place_carvers(
    loaded: On<VolumeLoaded>,
    mut commands: Commands,
    volumes: Query<(&Volume3d, &Transform), Without<Carver>>,
    assets: Res<Assets<Volume>>,
    carvers: Query<(Entity, &Carver)>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    mut hand: ResMut<Hand>,
) -> Result {
    let (volume, transform) = volumes.get(loaded.entity)?;
    let corners = assets.get(&volume.0).map(|volume| view::corners(volume, transform));
    let Some(bounds) = corners.and_then(Aabb::enclosing) else {
        return Ok(());
    };
    let homes = starts().map(|start| home(&bounds, start));
    if !carvers.is_empty() && carvers.iter().all(|(_, carver)| carver.home == homes[carver.index]) {
        return Ok(());
    }
    for (carver, _) in &carvers {
        commands.entity(carver).despawn();
    }
    *hand = Hand::default();
    let in_front = IN_FRONT * bounds.half_extents.length();
    for (index, (home, (name, ..))) in homes.into_iter().zip(starts()).enumerate() {
        let (body, outline) = shape(index)?;
        let carver = commands
            .spawn((
                Carver { index, name, home },
                ClipMesh::default(),
                home,
                Mesh3d(meshes.add(body)),
                MeshMaterial3d(materials.add(coat_material(in_front))),
                Coat::Body,
                Hovered::default(),
                children![(
                    Mesh3d(meshes.add(outline)),
                    MeshMaterial3d(materials.add(coat_material(in_front))),
                    Coat::Outline,
                    Pickable::IGNORE,
                )],
            ))
            .id();
        if index == 0 {
            hand.selected = Some(carver);
        }
    }
    Ok(())
}

/// Start of a carver in a volume's box.
fn home(bounds: &Aabb, (_, size, place, rotation): Start) -> Transform {
    let (center, half) = (Vec3::from(bounds.center), Vec3::from(bounds.half_extents));
    Transform { translation: center + place * half, rotation, scale: Vec3::splat(size * half.min_element()) }
}

fn coat_material(in_front: f32) -> StandardMaterial {
    StandardMaterial { alpha_mode: AlphaMode::Blend, unlit: true, depth_bias: in_front, ..default() }
}

/// The closed mesh of a carver, and its outline.
fn shape(index: usize) -> Result<(Mesh, Mesh), MeshMergeError> {
    Ok(match index {
        0 => (Sphere::new(1.0).mesh().uv(64, 32), LINES.sphere(1.0)?),
        1 => (Cuboid::from_size(2.0 * BOX).into(), LINES.cuboid(BOX)?),
        _ => {
            let ring = Torus { minor_radius: RING_TUBE, major_radius: 1.0 };
            let body = ring.mesh().minor_resolution(32).major_resolution(64).build();
            (body, LINES.torus(1.0, RING_TUBE)?)
        }
    })
}

/// Colours carvers by their operation. A carver in the hand is brighter.
fn paint(
    hand: Res<Hand>,
    carvers: Query<(Entity, &ClipMesh, &Hovered, &Children), With<Carver>>,
    coats: Query<(&Coat, &MeshMaterial3d<StandardMaterial>)>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    for (entity, clip, hovered, outline) in &carvers {
        let color = match clip.operation {
            ClipOperation::Subtract => SUBTRACTING,
            _ => INTERSECTING,
        };
        let is_in_hand = hand.grabbed.map_or(hovered.get(), |grabbed| grabbed == entity);
        let attention = match (is_in_hand, hand.selected == Some(entity)) {
            (true, _) => 2,
            (false, true) => 1,
            (false, false) => 0,
        };
        for (coat, material) in coats.iter_many(outline.iter().chain([entity])) {
            let [body, line] = OPACITIES[attention];
            let opacity = match coat {
                Coat::Body => body,
                Coat::Outline => line,
            };
            let wanted = Color::from(color.with_alpha(opacity));
            if let Some(mut material) = materials.get_mut(&material.0)
                && material.base_color != wanted
            {
                material.base_color = wanted;
            }
        }
    }
}
