//! The shapes of carvers, with their outlines.

use bevy::{mesh::MeshMergeError, prelude::*};
use contextual_ao_kit::outlines::Outlines;
use core::f32::consts::FRAC_PI_2;

/// Sizes, metres.
const SPHERE: f32 = 0.03;
/// Half the size of the box.
const BOX: Vec3 = Vec3::new(0.035, 0.02, 0.02);
const RING: f32 = 0.03;
const RING_TUBE: f32 = 0.01;
const DRILL_RADIUS: f32 = 0.006;
const DRILL_LENGTH: f32 = 0.12;
const LINES: Outlines = Outlines { line_radius: 0.0004 };

/// The shapes, in the order of the button.
#[derive(Resource)]
pub struct Shapes(pub [Shape; 4]);

/// A closed mesh, and its outline.
pub struct Shape {
    pub name: &'static str,
    pub body: Handle<Mesh>,
    pub outline: Handle<Mesh>,
}

impl Shapes {
    /// The shape with this mesh.
    pub fn of(&self, body: &Handle<Mesh>) -> Option<&Shape> {
        self.0.iter().find(|shape| shape.body == *body)
    }
}

/// Makes the meshes.
pub fn add_shapes(mut commands: Commands, mut meshes: ResMut<Assets<Mesh>>) -> Result {
    let ring = Torus { minor_radius: RING_TUBE, major_radius: RING };
    let ring = ring.mesh().minor_resolution(24).major_resolution(48).build();
    let (drill, drill_lines) = drill()?;
    let mut shape = |name, body: Mesh, outline: Mesh| Shape {
        name,
        body: meshes.add(body),
        outline: meshes.add(outline),
    };
    commands.insert_resource(Shapes([
        shape("sphere", Sphere::new(SPHERE).mesh().uv(48, 24), LINES.sphere(SPHERE)?),
        shape("box", Cuboid::from_size(2.0 * BOX).into(), LINES.cuboid(BOX)?),
        shape("ring", ring, LINES.torus(RING, RING_TUBE)?),
        shape("drill", drill, drill_lines),
    ]));
    Ok(())
}

/// A rod along -z, and circles along it. It begins at the hand.
fn drill() -> Result<(Mesh, Mesh), MeshMergeError> {
    let along_z = Quat::from_rotation_x(FRAC_PI_2);
    let middle = 0.25 * DRILL_LENGTH * Vec3::NEG_Z;
    let place = |mesh: Mesh| mesh.rotated_by(along_z).translated_by(middle);
    let rod = Cylinder::new(DRILL_RADIUS, DRILL_LENGTH).mesh().resolution(24).build();
    let circles = (0..=6).map(|k| {
        let along = (k as f32 / 6.0 - 0.5) * DRILL_LENGTH;
        LINES.circle(DRILL_RADIUS).translated_by(along * Vec3::Y)
    });
    Ok((place(rod), place(LINES.merged(circles)?)))
}
