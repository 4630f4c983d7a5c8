//! Scenes from command-line options or from code.

use bevy::prelude::*;
use bevy_contextual_ao::occlusion::Optimizations;
use bevy_contextual_ao::{
    prelude::*,
    volume::{
        VolumeGeometry, VolumeReadSettings, WORLD_UNITS_PER_MM,
        dicom::{DicomProgress, read_dicom},
        read_volume_file_with,
    },
};
use clap::Args;
use std::path::{Path, PathBuf};

use super::{
    budget::BudgetOptions,
    carver::{Carver, parse_numbers},
    dicom::{self, is_dicom},
    framing::Framing,
    headless::{Headless, project_folder},
};

/// Colour of ramp transfer functions.
pub const BONE: [f32; 3] = [0.95, 0.9, 0.82];

/// Content of a scene, and its camera.
#[derive(Args, Clone, Debug)]
pub struct SceneOptions {
    /// The volume: NIfTI, NRRD, MetaImage, or a folder, an archive or a file of DICOM [default: the head phantom in
    /// assets/].
    #[arg(long)]
    pub volume: Option<PathBuf>,
    /// Index of the series among those of DICOM files, as they are listed [default: that with the most voxels].
    #[arg(long)]
    pub series: Option<u32>,
    /// Index of the volume in a file or in a series that holds several, such as times or echoes; counted from zero.
    #[arg(long)]
    pub component: Option<u32>,
    /// Transfer function: Slicer .vp or .vp.json, .tf.ron, or ramp:FROM,TO,OPACITY in the volume's own units
    /// [default: the phantom's, or one guessed from the volume's histogram].
    #[arg(long)]
    pub transfer_function: Option<String>,
    /// Transfer function for a common examination, instead of a file or ramp: ct_bone, ct_soft_tissue, ct_vessels,
    /// ct_lung, mr_head or mr_angiography.
    #[arg(long, conflicts_with = "transfer_function")]
    pub preset: Option<Preset>,
    #[command(flatten)]
    pub budget: BudgetOptions,
    /// A carver, in mm from the volume's centre (x to the patient's left, y up, z to the front):
    /// sphere:x,y,z,r  box:x,y,z,a,b,c  torus:x,y,z,R,r  cylinder:x,y,z,r,h. Three angles in degrees may follow each.
    /// With `keep:` in front, the carver keeps its inside.
    #[arg(long = "carver", allow_hyphen_values = true)]
    pub carvers: Vec<Carver>,
    /// Method that computes occlusion: rays, progressive, sweeping, filtering, summed_area, screen_space, directional.
    #[arg(long, default_value = "rays")]
    pub method: OcclusionMethod,
    /// Samples per occlusion ray.
    #[arg(long, default_value_t = OcclusionRays::default().steps)]
    pub steps: u32,
    /// Distance between samples of an occlusion ray, mm.
    #[arg(long)]
    pub step_mm: Option<f32>,
    /// Width and height of the image, pixels.
    #[arg(long, default_value = "800x800", value_parser = parse_size)]
    pub size: UVec2,
    /// Position of the camera, mm from the volume's centre, which the camera looks at [default: three quarters from
    /// the front, all in view].
    #[arg(long, value_parser = parse_vec3, allow_hyphen_values = true)]
    pub camera: Option<Vec3>,
    /// Vertical field of view, degrees.
    #[arg(long, default_value_t = 30.0)]
    pub fov: f32,
    /// Distance between samples of a view ray, voxels.
    #[arg(long, default_value_t = VolumeShading::default().step_voxels)]
    pub step_voxels: f32,
    /// Interpolation of intensities: trilinear, smooth_colors, smooth_occlusion or tricubic [default: that of `VolumeShading`].
    #[arg(long)]
    pub reconstruction: Option<Reconstruction>,
    /// Optimization to switch off (see `Optimizations`), or `all`; several may be given.
    #[arg(long, num_args = 1..)]
    pub without: Vec<String>,
    /// Moves the starts of view rays by a fixed pattern.
    #[arg(long, default_value_t = VolumeShading::default().jitter, action = clap::ArgAction::Set)]
    pub jitter: bool,
}

/// Parts of a scene, before they are spawned.
pub struct SceneParts {
    /// The name used in figures.
    pub name: String,
    pub volume: Volume,
    /// `None`: guessed from the volume's histogram.
    pub transfer_function: Option<TransferFunction>,
    pub budget: VolumeBudget,
    pub occlusion: AmbientOcclusion,
    pub shading: VolumeShading,
    pub carvers: Vec<Carver>,
    /// Position of the camera, mm from the volume's centre, which the camera looks at.
    pub camera: Vec3,
    /// Vertical field of view, degrees.
    pub fov: f32,
}

/// The entities of a scene.
pub struct Scene {
    pub volume: Entity,
    pub camera: Entity,
    pub carvers: Vec<Entity>,
    /// Transform of the camera.
    pub view: Transform,
    pub voxels: u64,
    /// Place of the volume's voxels.
    pub geometry: VolumeGeometry,
    /// Smallest voxel spacing, mm.
    pub voxel_mm: f32,
    /// The volume file's name, or the series of DICOM files.
    pub name: String,
}

/// A volume that was read.
struct Read {
    name: String,
    volume: Volume,
    /// The transfer function that the files ask for.
    first_look: Option<TransferFunction>,
}

impl SceneParts {
    /// Spawns all parts.
    pub fn spawn(self, headless: &mut Headless) -> Scene {
        let (name, voxels, geometry) =
            (self.name, self.volume.voxel_count(), VolumeGeometry::of(&self.volume));
        let voxel_mm = self.volume.spacing_mm().min_element();
        let view = view_from(self.camera);
        let camera = headless.camera();
        let world = headless.app.world_mut();
        world.insert_resource(self.budget);
        let mut bundle = VolumeBundle::new(world.resource_mut::<Assets<Volume>>().add(self.volume));
        if let Some(function) = self.transfer_function {
            let function = world.resource_mut::<Assets<TransferFunction>>().add(function);
            bundle = bundle.with_transfer_function(function);
        }
        bundle.occlusion = self.occlusion;
        bundle.shading = self.shading;
        let volume = world.spawn(bundle).id();
        let mut projection = PerspectiveProjection { fov: self.fov.to_radians(), ..default() };
        if let Some(framing) = framing(&geometry) {
            framing.set_planes(&mut projection);
        }
        let camera = world.spawn((camera, Projection::Perspective(projection), view)).id();
        let carvers = self.carvers.iter().map(|carver| carver.spawn(world)).collect();
        Scene { volume, camera, carvers, view, voxels, geometry, voxel_mm, name }
    }
}

/// Framing of a volume at the world's origin.
fn framing(geometry: &VolumeGeometry) -> Option<Framing> {
    Framing::of(geometry.corners().map(|corner| corner.as_vec3() * WORLD_UNITS_PER_MM))
}

/// Transform of a camera that looks at the volume's centre. `place` is in mm from that centre.
pub fn view_from(place: Vec3) -> Transform {
    Transform::from_translation(place * WORLD_UNITS_PER_MM).looking_at(Vec3::ZERO, Vec3::Y)
}

impl SceneOptions {
    /// Optimizations that stay switched on.
    pub fn optimizations(&self) -> Result<Optimizations, String> {
        self.without.iter().try_fold(Optimizations::default(), |optimizations, name| {
            if name == "all" {
                return Ok(Optimizations::NONE);
            }
            let names = Optimizations::names().collect::<Vec<_>>().join(", ");
            optimizations.without(name).ok_or_else(|| format!("--without {name}: expected all, {names}"))
        })
    }

    /// Reads the files and spawns all parts.
    pub fn spawn(&self, headless: &mut Headless) -> Result<Scene, String> {
        let parts = self.parts()?;
        headless.app.insert_resource(self.optimizations()?);
        Ok(parts.spawn(headless))
    }

    /// Reads the files.
    pub fn parts(&self) -> Result<SceneParts, String> {
        let assets = project_folder().join("assets");
        let phantom = assets.join("head_phantom.nrrd");
        let path = self.volume.as_ref().unwrap_or(&phantom);
        let Read { name, volume, first_look } = self.read(path)?;
        let default_function = self.volume.is_none().then(|| assets.join("head_phantom.tf.ron"));
        let transfer_function = match (&self.transfer_function, self.preset, default_function) {
            (Some(function), _, _) => Some(read_transfer_function(function)?),
            (None, Some(preset), _) => Some(preset.transfer_function(&volume)),
            (None, None, Some(path)) => Some(read_transfer_function(&path.to_string_lossy())?),
            (None, None, None) => first_look,
        };
        Ok(SceneParts {
            name,
            camera: self.camera.unwrap_or_else(|| self.overview(&VolumeGeometry::of(&volume))),
            volume,
            transfer_function,
            budget: self.budget.budget(),
            occlusion: AmbientOcclusion::by(self.method()),
            shading: VolumeShading {
                step_voxels: self.step_voxels,
                reconstruction: self.reconstruction.unwrap_or_default(),
                jitter: self.jitter,
                ..default()
            },
            carvers: self.carvers.clone(),
            fov: self.fov,
        })
    }

    fn read(&self, path: &Path) -> Result<Read, String> {
        std::fs::metadata(path).map_err(|error| format!("{}: {error}", path.display()))?;
        if is_dicom(path) {
            return self.read_dicom(path);
        }
        if let Some(series) = self.series {
            return Err(format!("--series {series}: {} is not DICOM", path.display()));
        }
        let settings = VolumeReadSettings { component: self.component, ..default() };
        let volume = read_volume_file_with(path, &settings).map_err(|error| error.to_string())?;
        // The reader's warning goes to the log, which is off here.
        if volume.background_voxels() > 0 {
            let (path, count) = (path.display(), volume.background_voxels());
            eprintln!("{path}: {count} voxels are NaN or infinite: they are shown as background");
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Read { name, volume, first_look: None })
    }

    /// Reads the chosen volume, and lists all of them if there are several and none was chosen.
    fn read_dicom(&self, path: &Path) -> Result<Read, String> {
        let at = |error: String| format!("{}: {error}", path.display());
        let dicom = read_dicom(&[path]).map_err(|error| error.to_string())?;
        let choice = dicom::choose(&dicom, self.series, self.component).map_err(at)?;
        let (series, listed) = choice.of(&dicom).ok_or_else(|| at("no volume".into()))?;
        let is_alone = dicom.series.len() == 1 && series.volumes.len() == 1;
        if self.series.or(self.component).is_none() && !is_alone {
            eprintln!("{}", dicom::list(&dicom, choice));
        }
        let name = dicom::title(series, choice.volume);
        for warning in listed.warnings() {
            eprintln!("{name}: {warning}");
        }
        let settings = dicom::settings(listed, &self.budget.budget()).map_err(at)?;
        let volume = listed.read(&settings, &DicomProgress::default()).map_err(|error| error.to_string())?;
        let first_look = Some(listed.first_look(&volume));
        Ok(Read { name, volume, first_look })
    }

    /// The method with the requested rays.
    fn method(&self) -> OcclusionMethod {
        let mut method = self.method.clone();
        if let Some(rays) = method.rays_mut() {
            (rays.steps, rays.step_mm) = (self.steps, self.step_mm);
        }
        method
    }

    /// Position from which a camera has the whole volume in view.
    fn overview(&self, geometry: &VolumeGeometry) -> Vec3 {
        let aspect_ratio = self.size.x as f32 / self.size.y as f32;
        let distance = framing(geometry).map(|framing| framing.distance(self.fov.to_radians(), aspect_ratio));
        distance.unwrap_or(1.0) / WORLD_UNITS_PER_MM * Vec3::new(0.55, 0.35, 0.8).normalize()
    }
}

/// A transfer function from a file, or `ramp:FROM,TO,OPACITY`.
fn read_transfer_function(name: &str) -> Result<TransferFunction, String> {
    if let Some(ramp) = name.strip_prefix("ramp:") {
        let [from, to, opacity] = parse_numbers(ramp)?;
        return TransferFunction::ramp(from, to, opacity, BONE).map_err(|error| format!("{name}: {error}"));
    }
    let bytes = std::fs::read(name).map_err(|error| format!("{name}: {error}"))?;
    TransferFunction::from_bytes(&bytes).map_err(|error| format!("{name}: {error}"))
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
