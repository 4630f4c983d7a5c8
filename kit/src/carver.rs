//! Carvers from the command line or from code.

use bevy::{mesh::CylinderMeshBuilder, prelude::*};
use bevy_contextual_ao::{prelude::*, volume::WORLD_UNITS_PER_MM};
use std::str::FromStr;

/// A carver; lengths in mm, relative to the volume's centre.
#[derive(Clone, Debug)]
pub struct Carver {
    /// Shape of the mesh.
    pub shape: Shape,
    /// Position of the centre.
    pub position: Vec3,
    /// Rotation of the mesh.
    pub rotation: Quat,
    /// Whether the carver keeps its inside and removes the rest.
    pub keeps: bool,
}

/// The shape of a carver, mm.
#[derive(Clone, Copy, Debug)]
pub enum Shape {
    /// A ball.
    Sphere { radius: f32 },
    /// A box; `size` is from face to face.
    Box { size: Vec3 },
    /// A tube of radius `tube` along a circle of radius `ring`.
    Torus { ring: f32, tube: f32 },
    /// A cylinder along y.
    Cylinder { radius: f32, height: f32 },
}

impl Carver {
    /// Creates a carver that is not turned.
    pub fn new(shape: Shape, position: Vec3) -> Self {
        Self { shape, position, rotation: Quat::IDENTITY, keeps: false }
    }

    pub fn spawn(&self, world: &mut World) -> Entity {
        let mesh = world.resource_mut::<Assets<Mesh>>().add(self.mesh());
        world.spawn((self.clip_mesh(), Mesh3d(mesh), self.transform())).id()
    }

    fn mesh(&self) -> Mesh {
        match self.shape {
            Shape::Sphere { radius } => {
                Sphere::new(radius).mesh().ico(16).unwrap_or_else(|_| Sphere::new(radius).into())
            }
            Shape::Box { size } => Cuboid::from_size(size).into(),
            Shape::Torus { ring, tube } => Torus { minor_radius: tube, major_radius: ring }
                .mesh()
                .major_resolution(96)
                .minor_resolution(48)
                .into(),
            Shape::Cylinder { radius, height } => CylinderMeshBuilder::new(radius, height, 96).into(),
        }
    }

    fn clip_mesh(&self) -> ClipMesh {
        if self.keeps { ClipMesh::intersect() } else { ClipMesh::default() }
    }

    fn transform(&self) -> Transform {
        Transform {
            translation: self.position * WORLD_UNITS_PER_MM,
            rotation: self.rotation,
            scale: Vec3::splat(WORLD_UNITS_PER_MM),
        }
    }
}

impl FromStr for Carver {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (keeps, rest) = match text.strip_prefix("keep:") {
            Some(rest) => (true, rest),
            None => (false, text),
        };
        let (name, numbers) = rest.split_once(':').ok_or("expected SHAPE:numbers")?;
        let lengths = match name {
            "sphere" => 4,
            "torus" | "cylinder" => 5,
            "box" => 6,
            _ => {
                return Err(format!("unknown shape `{name}`: expected sphere, box, torus or cylinder"));
            }
        };
        let mut n = parse_list(numbers)?;
        if n.len() == lengths {
            n.extend([0.0; 3]);
        }
        if n.len() != lengths + 3 {
            return Err(format!("`{name}` takes {lengths} numbers, or {} with angles", lengths + 3));
        }
        if n[3..lengths].iter().any(|&length| length <= 0.0) {
            return Err(format!("`{text}`: lengths must be above 0"));
        }
        let shape = match name {
            "sphere" => Shape::Sphere { radius: n[3] },
            "torus" => Shape::Torus { ring: n[3], tube: n[4] },
            "cylinder" => Shape::Cylinder { radius: n[3], height: n[4] },
            _ => Shape::Box { size: Vec3::new(n[3], n[4], n[5]) },
        };
        let angles: Vec<f32> = n[lengths..].iter().map(|angle| angle.to_radians()).collect();
        let rotation = Quat::from_euler(EulerRot::XYZ, angles[0], angles[1], angles[2]);
        Ok(Self { rotation, keeps, ..Self::new(shape, Vec3::new(n[0], n[1], n[2])) })
    }
}

/// Parses numbers separated by commas.
fn parse_list(text: &str) -> Result<Vec<f32>, String> {
    text.split(',')
        .map(|part| match part.trim().parse::<f32>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(format!("`{part}` is not a number")),
        })
        .collect()
}

/// Parses `N` numbers separated by commas.
pub fn parse_numbers<const N: usize>(text: &str) -> Result<[f32; N], String> {
    parse_list(text)?.try_into().map_err(|_| format!("`{text}`: expected {N} numbers"))
}
