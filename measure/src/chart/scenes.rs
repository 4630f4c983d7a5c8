//! Scenes of the chart, with one carver each: an opaque surface, a translucent volume, and thin layers.

use bevy::{
    math::{DAffine3, DVec3},
    prelude::*,
};
use bevy_contextual_ao::{
    prelude::*,
    volume::{
        Intensities, Rescale, VolumeGeometry,
        phantom::{HeadPhantom, head_phantom},
    },
};

use crate::{
    Options,
    counting::{CountingScene, ball, place, published_look},
};
use contextual_ao_kit::scene::SceneParts;

/// Number of voxels from the phantom's neck to its vertex, before halving.
const PHANTOM_VOXELS_HIGH: u32 = 192;
/// Places of the phantom's carver and of the camera, as shares of the grid's extent to the right, front and top.
const PHANTOM_CARVER: DVec3 = DVec3::new(0.68, 0.72, 0.8);
const PHANTOM_CAMERA: DVec3 = DVec3::new(1.25, 1.85, 1.25);
/// Below this intensity (Hounsfield units) skin, fat and muscle of the phantom are left out.
const PHANTOM_FROM: f32 = -28.0;

/// Number of times that volumes and images are halved. Both are halved alike, so methods of voxels and methods of
/// pixels compare as at full size.
pub fn halvings(options: &Options) -> u32 {
    options.halvings.unwrap_or(if options.quick { 2 } else { 1 }).min(5)
}

/// Width and height of the images, pixels.
pub fn image_size(options: &Options) -> UVec2 {
    (options.scene.size >> halvings(options)).max(UVec2::ONE)
}

/// Loads the scenes whose files are there, and the phantom.
pub fn load(options: &Options) -> Result<Vec<SceneParts>, String> {
    let halvings = halvings(options);
    let mut scenes = Vec::new();
    for scene in [CountingScene::EngineOpaque, CountingScene::MrBrain] {
        scenes.extend(scene.load_halved(halvings)?);
    }
    scenes.push(phantom(PHANTOM_VOXELS_HIGH >> halvings)?);
    Ok(scenes)
}

/// The generated head without skin, fat and muscle. Its skull is opened above the right eye.
pub fn phantom(voxels_high: u32) -> Result<SceneParts, String> {
    let HeadPhantom { dimensions, spacing_mm, values } = head_phantom(voxels_high);
    let function = include_str!("../../../assets/head_phantom.tf.ron");
    let mut function = TransferFunction::from_ron(function).map_err(|error| error.to_string())?;
    for point in function.points.iter_mut().filter(|point| point.value <= PHANTOM_FROM) {
        point.opacity = 0.0;
    }
    // The unit of opacity is one voxel.
    function.opacity_unit_distance_mm = spacing_mm;
    // Stored values are not negative.
    let lowest = values.iter().copied().min().unwrap_or_default();
    let intensities = values.iter().map(|value| value.abs_diff(lowest)).collect();
    let rescale = Rescale { slope: 1.0, intercept: lowest.into() };
    let grid_to_patient = DAffine3::from_scale(DVec3::splat(spacing_mm.into()));
    let volume = Volume::new(dimensions, grid_to_patient, Intensities::U16(intensities), rescale);
    let volume = volume.map_err(|error| error.to_string())?;
    let geometry = VolumeGeometry::of(&volume);
    Ok(SceneParts {
        name: "phantom".to_owned(),
        volume,
        transfer_function: Some(function),
        budget: default(),
        occlusion: AmbientOcclusion::by(OcclusionRays {
            pattern: RayPattern::Rubik54,
            // Rays are those of the whole phantom, however coarse it is.
            step_mm: Some(spacing_mm * voxels_high as f32 / PHANTOM_VOXELS_HIGH as f32),
            ..default()
        }),
        shading: published_look(),
        carvers: vec![ball(&geometry, PHANTOM_CARVER, 0.28)],
        camera: place(&geometry, PHANTOM_CAMERA),
        fov: 2.0 * 0.5f32.atan().to_degrees(),
    })
}
