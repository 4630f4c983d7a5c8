//! Opens the volume, fits the camera to it when it is there, and keeps what went wrong.

use bevy::{
    asset::{AssetPath, LoadState},
    camera::primitives::Aabb,
    prelude::*,
};
use bevy_contextual_ao::{
    prelude::*,
    volume::{VolumeGeometry, WORLD_UNITS_PER_MM},
};
use bevy_panorbit_camera::PanOrbitCamera;
use std::path::{Path, PathBuf};

use crate::Arguments;

const DEFAULT_VOLUME: &str = "head_phantom.nrrd";
const DEFAULT_TRANSFER_FUNCTION: &str = "head_phantom.tf.ron";
/// How near the camera may come to the middle of a volume, and how far away, in radii of the volume.
const NEAREST_VIEW: f32 = 0.1;
const FARTHEST_VIEW: f32 = 12.0;
/// What is seen of a volume rarely reaches into all corners of its box.
const FIT: f32 = 0.8;
/// Bars of the histogram behind the transfer function.
const HISTOGRAM_BARS: usize = 512;
/// A histogram of a large volume counts about this many of its voxels.
const HISTOGRAM_SAMPLES: usize = 1 << 20;

pub struct LoadingPlugin;

impl Plugin for LoadingPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Shown>()
            .add_systems(Startup, open)
            .add_systems(Update, own_function)
            .add_observer(prepare)
            .add_observer(note_failure);
    }
}

/// What the panel says about the volume.
#[derive(Resource, Default)]
pub struct Shown {
    /// The name of the file.
    pub name: String,
    /// What is known of the volume once it has been read.
    pub content: Option<Content>,
    /// Why the volume or its transfer function could not be loaded.
    pub errors: Vec<String>,
}

/// What is known of a volume that has been read.
pub struct Content {
    /// Its voxels, in one line.
    pub summary: String,
    /// Smallest and largest value.
    pub range: [f32; 2],
    /// How common values are, evenly spaced over the range: 0 to 1, logarithmic.
    pub histogram: Vec<f32>,
}

fn open(
    mut commands: Commands,
    arguments: Res<Arguments>,
    assets: Res<AssetServer>,
    mut shown: ResMut<Shown>,
) {
    let file = arguments.file.as_deref();
    shown.name =
        file.and_then(Path::file_name).map_or(DEFAULT_VOLUME.into(), |name| name.to_string_lossy().into());
    let volume = assets.load(match file {
        Some(file) => outside_assets(file),
        None => AssetPath::from(DEFAULT_VOLUME),
    });
    let function = match (&arguments.transfer_function, file) {
        (Some(file), _) => Some(outside_assets(file)),
        (None, None) => Some(AssetPath::from(DEFAULT_TRANSFER_FUNCTION)),
        (None, Some(_)) => None,
    };
    let mut bundle = VolumeBundle::new(volume);
    if let Some(function) = function {
        bundle = bundle.with_transfer_function(assets.load(function));
    }
    // The box of the volume would catch every drag of a cutter inside it.
    commands.spawn(bundle);
}

/// The place of a file given relative to the working directory.
fn outside_assets(file: &Path) -> AssetPath<'static> {
    let absolute = std::path::absolute(file).unwrap_or_else(|_| PathBuf::from(file));
    AssetPath::from_path_buf(absolute)
}

/// The box around a volume, in the world.
pub fn bounds(volume: &Volume, transform: &Transform) -> Option<Aabb> {
    let corners = VolumeGeometry::of(volume).corners();
    Aabb::enclosing(corners.map(|corner| transform.transform_point(corner.as_vec3() * WORLD_UNITS_PER_MM)))
}

/// Describes the volume, and shows all of it.
fn prepare(
    loaded: On<VolumeLoaded>,
    volumes: Res<Assets<Volume>>,
    entities: Query<(&Volume3d, &Transform)>,
    mut cameras: Query<(&mut PanOrbitCamera, &Projection)>,
    mut shown: ResMut<Shown>,
) {
    let Ok((handle, transform)) = entities.get(loaded.entity) else {
        return;
    };
    let Some(volume) = volumes.get(&handle.0) else {
        return;
    };
    shown.content = Some(describe(volume));
    let Some(bounds) = bounds(volume, transform) else {
        return;
    };
    let radius = bounds.half_extents.length();
    for (mut camera, projection) in &mut cameras {
        let Projection::Perspective(perspective) = projection else {
            continue;
        };
        let half_height = (perspective.fov / 2.0).tan();
        let half_angle = (half_height * perspective.aspect_ratio.min(1.0)).atan();
        let distance = FIT * radius / half_angle.sin();
        camera.focus = bounds.center.into();
        camera.target_focus = camera.focus;
        camera.radius = Some(distance);
        camera.target_radius = distance;
        camera.zoom_lower_limit = NEAREST_VIEW * radius;
        camera.zoom_upper_limit = Some(FARTHEST_VIEW * radius);
        camera.force_update = true;
    }
}

fn describe(volume: &Volume) -> Content {
    let (size, spacing) = (volume.dimensions(), volume.spacing_mm());
    Content {
        summary: format!(
            "{} x {} x {} voxels of {:.2} x {:.2} x {:.2} mm",
            size.x, size.y, size.z, spacing.x, spacing.y, spacing.z
        ),
        range: volume.range().map(|value| value as f32),
        histogram: histogram(volume),
    }
}

fn histogram(volume: &Volume) -> Vec<f32> {
    let [low, high] = volume.range();
    let width = (high - low).max(f64::MIN_POSITIVE);
    let mut counts = vec![0u32; HISTOGRAM_BARS];
    let voxels = volume.intensities();
    for index in (0..voxels.len()).step_by(voxels.len() / HISTOGRAM_SAMPLES + 1) {
        let Some(stored) = voxels.get(index) else {
            break;
        };
        let t = (volume.to_file_units(stored.into()) - low) / width;
        let bar = (t * HISTOGRAM_BARS as f64) as usize;
        counts[bar.min(HISTOGRAM_BARS - 1)] += 1;
    }
    let logarithms = counts.into_iter().map(|count| (1.0 + count as f32).ln());
    let largest = logarithms.clone().fold(1.0, f32::max);
    logarithms.map(|logarithm| logarithm / largest).collect()
}

/// Keeps what went wrong. A volume without its transfer function gets the automatic one.
fn note_failure(
    failed: On<VolumeFailed>,
    assets: Res<AssetServer>,
    mut functions: Query<&mut VolumeTransferFunction>,
    mut shown: ResMut<Shown>,
) {
    let error = failed.reason.to_string();
    if !shown.errors.contains(&error) {
        shown.errors.push(error);
    }
    if let Ok(mut function) = functions.get_mut(failed.entity)
        && let Some(LoadState::Failed(_)) = assets.get_load_state(&function.0)
    {
        function.0 = Handle::default();
    }
}

/// Replaces the automatic transfer function, which is nobody's asset, by one that can be edited.
fn own_function(
    volumes: Res<Assets<Volume>>,
    mut functions: ResMut<Assets<TransferFunction>>,
    mut entities: Query<(&Volume3d, &mut VolumeTransferFunction)>,
) {
    for (volume, mut function) in &mut entities {
        if function.0 == Handle::default()
            && let Some(volume) = volumes.get(&volume.0)
        {
            function.0 = functions.add(TransferFunction::for_volume(volume));
        }
    }
}
