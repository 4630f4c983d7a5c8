//! Scenes of real volumes in which work is counted: one ball carves near a corner of the grid. The files are no part
//! of the project. A scene without its file is skipped.

use bevy::{
    math::{DVec3, Vec3Swizzles},
    prelude::*,
};
use bevy_contextual_ao::{
    prelude::*,
    volume::{VolumeGeometry, read_volume_file},
};
use clap::ValueEnum;
use serde_json::json;
use std::path::PathBuf;

use crate::{Options, stage::Stage};
use contextual_ao_kit::{
    carver::{Carver, Shape},
    headless::project_folder,
    scene::{BONE, SceneParts},
};

/// Scenes of real volumes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum CountingScene {
    /// CT of an engine block, its metal opaque.
    EngineOpaque,
    /// CT of an engine block, translucent.
    EngineTranslucent,
    /// CT of a bonsai.
    Bonsai,
    /// CT of a stag beetle, with a third of the paper's resolution.
    Beetle,
    /// CT of a head, its bone.
    CtHead,
    /// CT of a torso, its bone.
    CtTorso,
    /// MRI of a brain, translucent.
    MrBrain,
}

/// Properties that differ from scene to scene.
struct Recipe {
    file: &'static str,
    /// Opacity rises from 0 at the first intensity to `opacity` at the second.
    ramp: [f32; 2],
    opacity: f32,
    /// Values that are 0 and 255 for the ramp, in the file's units; the volume's range, if not given.
    range: Option<[f64; 2]>,
    /// Samples per ray.
    steps: u32,
}

/// Place of the first carver, as shares of the grid's extent along its axes.
pub const CARVER: DVec3 = DVec3::new(0.7, 0.35, 0.7);
/// Radius of the first carver, as a share of the smaller of the first two dimensions.
const RADIUS: f64 = 0.28;
/// Place of the camera, as shares of the grid's extent. The camera looks at the middle.
const CAMERA: DVec3 = DVec3::new(1.6, -0.4, 1.9);

impl CountingScene {
    /// Name of the scene on command lines and in figures.
    pub fn name(self) -> String {
        self.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
    }

    fn recipe(self) -> Recipe {
        let recipe = |file, ramp, opacity, steps| Recipe { file, ramp, opacity, range: None, steps };
        match self {
            Self::EngineOpaque => recipe("engine.nii.gz", [100.0, 140.0], 1.0, 20),
            Self::EngineTranslucent => recipe("engine.nii.gz", [60.0, 160.0], 0.2, 20),
            Self::Bonsai => recipe("bonsai.nii.gz", [40.0, 120.0], 0.6, 40),
            // Rays are as long as the paper's 40 steps of its voxels.
            Self::Beetle => recipe("beetle/beetle.nhdr", [30.0, 80.0], 1.0, 13),
            Self::CtHead => {
                Recipe { range: Some([0.0, 3000.0]), ..recipe("ct_head.nrrd", [95.0, 130.0], 1.0, 40) }
            }
            Self::CtTorso => recipe("ct_torso_half.nrrd", [120.0, 160.0], 1.0, 40),
            Self::MrBrain => recipe("mr_brain_t1.nii.gz", [20.0, 160.0], 0.3, 40),
        }
    }

    /// Opens the scene in an app of its own; `None` as for [`Self::load`].
    pub fn open(self, options: &Options) -> Result<Option<Stage>, String> {
        Ok(self.load(options)?.map(|parts| Stage::new(parts, options.image_size())))
    }

    /// Parts of the scene, as [`Self::load_halved`], at half the resolution if that was asked for. The beetle is small
    /// already.
    pub fn load(self, options: &Options) -> Result<Option<SceneParts>, String> {
        self.load_halved((options.quick && self != Self::Beetle).into())
    }

    /// Parts of the scene with the paper's 54 rays, its volume halved `halvings` times. If its file is absent, prints
    /// a line that says so and returns `None`.
    pub fn load_halved(self, halvings: u32) -> Result<Option<SceneParts>, String> {
        let recipe = self.recipe();
        let path = volumes_folder().join(recipe.file);
        if !path.exists() {
            println!("{}", json!({ "scene": self.name(), "skipped": recipe.file }));
            return Ok(None);
        }
        let volume = read_volume_file(&path).map_err(|error| error.to_string())?;
        let [low, high] = recipe.range.unwrap_or(volume.range());
        let [from, to] = recipe.ramp.map(|value| (low + f64::from(value) / 255.0 * (high - low)) as f32);
        let function = TransferFunction::ramp(from, to, recipe.opacity, BONE);
        let mut function = function.map_err(|error| error.to_string())?;
        // Rays are those of the whole volume, however often it is halved.
        let ray_step_mm = volume.spacing_mm().min_element();
        let volume = (0..halvings).fold(volume, |volume, _| volume.halved());
        // The unit of opacity is a step of one voxel.
        let step_mm = volume.spacing_mm().min_element();
        function.opacity_unit_distance_mm = step_mm;
        let geometry = VolumeGeometry::of(&volume);
        Ok(Some(SceneParts {
            name: self.name(),
            volume,
            transfer_function: Some(function),
            budget: default(),
            occlusion: AmbientOcclusion::by(OcclusionRays {
                pattern: RayPattern::Rubik54,
                steps: recipe.steps,
                step_mm: Some(ray_step_mm),
                ..default()
            }),
            shading: published_look(),
            carvers: vec![ball(&geometry, CARVER, RADIUS)],
            camera: place(&geometry, CAMERA),
            // The view is as high as it is far away.
            fov: 2.0 * 0.5f32.atan().to_degrees(),
        }))
    }
}

/// A ball at a place in the grid's extent. Its radius is a share of the smaller of the first two dimensions.
pub fn ball(geometry: &VolumeGeometry, of_extent: DVec3, radius: f64) -> Carver {
    let size_mm = geometry.dimensions.as_dvec3() * geometry.spacing_mm;
    let radius = (radius * size_mm.xy().min_element()) as f32;
    Carver::new(Shape::Sphere { radius }, place(geometry, of_extent))
}

/// Converts a place in the grid's extent to mm from the volume's centre.
pub fn place(geometry: &VolumeGeometry, of_extent: DVec3) -> Vec3 {
    let voxel = of_extent * geometry.dimensions.as_dvec3() - 0.5;
    geometry.local_from_voxel.transform_point3(voxel).as_vec3()
}

fn volumes_folder() -> PathBuf {
    let named = std::env::var_os("CONTEXTUAL_AO_VOLUMES").map(PathBuf::from);
    named.unwrap_or_else(|| project_folder().join("../shared/volumes"))
}

/// Shading of scenes whose images are compared: samples a voxel apart without jitter, occlusion as published.
pub fn published_look() -> VolumeShading {
    VolumeShading { step_voxels: 1.0, jitter: false, ambient_scale: AmbientScale::Published, ..default() }
}
