//! Scenes from command-line options.

use bevy::{mesh::CylinderMeshBuilder, prelude::*};
use bevy_contextual_ao::{
    prelude::*,
    volume::{VolumeGeometry, WORLD_UNITS_PER_MM, read_volume_file},
};
use clap::Args;
use std::{path::PathBuf, str::FromStr};

use super::headless::{Headless, project_folder};

/// What is shown, and from where.
#[derive(Args, Clone, Debug)]
pub struct SceneOptions {
    /// The volume: NIfTI, NRRD or MetaImage [default: the head phantom in assets/].
    #[arg(long)]
    pub volume: Option<PathBuf>,
    /// Slicer .vp, .tf.ron, or ramp:FROM,TO,OPACITY in the volume's own units [default: the
    /// phantom's, or one guessed from the volume's histogram].
    #[arg(long)]
    pub transfer_function: Option<String>,
    /// A cutter, in mm from the volume's centre (x to the patient's left, y up, z to the front):
    /// sphere:x,y,z,r  box:x,y,z,a,b,c  torus:x,y,z,R,r  cylinder:x,y,z,r,h, each optionally
    /// followed by three angles in degrees; with `keep:` in front it keeps what is inside.
    #[arg(long = "carver", allow_hyphen_values = true)]
    pub carvers: Vec<Carver>,
    /// Samples per occlusion ray.
    #[arg(long, default_value_t = AmbientOcclusion::default().steps)]
    pub steps: u32,
    /// Distance between them, mm.
    #[arg(long, default_value_t = AmbientOcclusion::default().step_mm)]
    pub step_mm: f32,
    /// Width and height of the image, pixels.
    #[arg(long, default_value = "800x800", value_parser = parse_size)]
    pub size: UVec2,
    /// Where the camera is, mm from the volume's centre, which it looks at [default: three
    /// quarters from the front, all in view].
    #[arg(long, value_parser = parse_vec3, allow_hyphen_values = true)]
    pub camera: Option<Vec3>,
    /// Vertical field of view, degrees.
    #[arg(long, default_value_t = 30.0)]
    pub fov: f32,
    /// Distance between samples of a view ray, voxels.
    #[arg(long, default_value_t = VolumeShading::default().step_voxels)]
    pub step_voxels: f32,
    /// A shortcut to do without (see `Shortcuts`), or `all`; several may be given.
    #[arg(long, num_args = 1..)]
    pub without: Vec<String>,
    /// Start view rays by a fixed pattern.
    #[arg(long, default_value_t = VolumeShading::default().jitter, action = clap::ArgAction::Set)]
    pub jitter: bool,
}

/// The entities of a scene.
pub struct Scene {
    pub volume: Entity,
    pub carvers: Vec<Entity>,
    /// Where the camera looks from.
    pub view: Transform,
    pub voxels: u64,
    /// Smallest voxel spacing, mm.
    pub voxel_mm: f32,
    /// The volume file's name, or `head_phantom`.
    pub name: String,
}

impl SceneOptions {
    /// The shortcuts that are left.
    pub fn shortcuts(&self) -> Result<Shortcuts, String> {
        self.without.iter().try_fold(Shortcuts::default(), |shortcuts, name| {
            if name == "all" {
                return Ok(Shortcuts::NONE);
            }
            let names = Shortcuts::NAMES.join(", ");
            shortcuts.without(name).ok_or_else(|| format!("--without {name}: expected all, {names}"))
        })
    }

    /// Reads the files and spawns everything.
    pub fn spawn(&self, headless: &mut Headless) -> Result<Scene, String> {
        let assets = project_folder().join("assets");
        let phantom = assets.join("head_phantom.nrrd");
        let path = self.volume.as_ref().unwrap_or(&phantom);
        let volume = read_volume_file(path).map_err(|error| error.to_string())?;
        let geometry = VolumeGeometry::of(&volume);
        let voxels = volume.voxel_count();
        let default_function = self.volume.is_none().then(|| assets.join("head_phantom.tf.ron"));
        let function = match (&self.transfer_function, default_function) {
            (Some(function), _) => Some(read_transfer_function(function)?),
            (None, Some(path)) => Some(read_transfer_function(&path.to_string_lossy())?),
            (None, None) => None,
        };
        let view = self.view(&geometry);
        let camera = headless.camera();
        let world = headless.app.world_mut();
        world.insert_resource(self.shortcuts()?);
        let handle = world.resource_mut::<Assets<Volume>>().add(volume);
        let mut bundle = VolumeBundle::new(handle);
        if let Some(function) = function {
            let function = world.resource_mut::<Assets<TransferFunction>>().add(function);
            bundle = bundle.with_transfer_function(function);
        }
        bundle.occlusion.steps = self.steps;
        bundle.occlusion.step_mm = self.step_mm;
        bundle.shading.step_voxels = self.step_voxels;
        bundle.shading.jitter = self.jitter;
        let volume = world.spawn(bundle).id();
        let projection = Projection::Perspective(PerspectiveProjection {
            fov: self.fov.to_radians(),
            near: 0.001,
            ..default()
        });
        world.spawn((camera, projection, view));
        let carvers = self
            .carvers
            .iter()
            .map(|carver| {
                let mesh = world.resource_mut::<Assets<Mesh>>().add(carver.mesh());
                world.spawn((carver.clip_mesh(), Mesh3d(mesh), carver.transform())).id()
            })
            .collect();
        Ok(Scene {
            volume,
            carvers,
            view,
            voxels,
            voxel_mm: geometry.spacing_mm.min_element() as f32,
            name: path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        })
    }

    fn view(&self, geometry: &VolumeGeometry) -> Transform {
        let radius = geometry.corners()[0].length() as f32;
        let position = self.camera.unwrap_or_else(|| {
            let distance = 0.85 * radius / (0.5 * self.fov.to_radians()).sin();
            distance * Vec3::new(0.55, 0.35, 0.8).normalize()
        });
        Transform::from_translation(position * WORLD_UNITS_PER_MM).looking_at(Vec3::ZERO, Vec3::Y)
    }
}

/// A transfer function from a file, or `ramp:FROM,TO,OPACITY`.
fn read_transfer_function(name: &str) -> Result<TransferFunction, String> {
    if let Some(ramp) = name.strip_prefix("ramp:") {
        let [from, to, opacity] = parse_numbers(ramp)?;
        let bone = [0.95, 0.9, 0.82];
        return TransferFunction::ramp(from, to, opacity, bone).map_err(|error| format!("{name}: {error}"));
    }
    let text = std::fs::read_to_string(name).map_err(|error| format!("{name}: {error}"))?;
    if name.to_ascii_lowercase().ends_with(".vp") {
        TransferFunction::from_slicer_vp(&text)
    } else {
        TransferFunction::from_ron(&text)
    }
    .map_err(|error| format!("{name}: {error}"))
}

/// A cutter as given on the command line; lengths in mm.
#[derive(Clone, Debug)]
pub struct Carver {
    shape: Shape,
    position: Vec3,
    rotation: Quat,
    keeps: bool,
}

#[derive(Clone, Copy, Debug)]
enum Shape {
    Sphere { radius: f32 },
    Box { size: Vec3 },
    Torus { ring: f32, tube: f32 },
    Cylinder { radius: f32, height: f32 },
}

impl Carver {
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
        Ok(Self {
            shape,
            position: Vec3::new(n[0], n[1], n[2]),
            rotation: Quat::from_euler(EulerRot::XYZ, angles[0], angles[1], angles[2]),
            keeps,
        })
    }
}

fn parse_list(text: &str) -> Result<Vec<f32>, String> {
    text.split(',')
        .map(|part| match part.trim().parse::<f32>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(format!("`{part}` is not a number")),
        })
        .collect()
}

fn parse_numbers<const N: usize>(text: &str) -> Result<[f32; N], String> {
    parse_list(text)?.try_into().map_err(|_| format!("`{text}`: expected {N} numbers"))
}

fn parse_vec3(text: &str) -> Result<Vec3, String> {
    parse_numbers(text).map(Vec3::from_array)
}

fn parse_size(text: &str) -> Result<UVec2, String> {
    let parts = text.split_once('x').map(|(width, height)| (width.parse(), height.parse()));
    match parts {
        Some((Ok(x @ 1..=8192), Ok(y @ 1..=8192))) => Ok(UVec2::new(x, y)),
        _ => Err(format!("`{text}`: expected WIDTHxHEIGHT, 1 to 8192 each")),
    }
}
