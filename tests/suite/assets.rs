//! Files that Bevy's asset server loads, and the demo asset.

use bevy::{asset::AssetPath, prelude::*};
use bevy_contextual_ao::{
    prelude::*,
    volume::{
        Intensities, TransferFunctionLoader, VolumeReadSettings,
        phantom::{brain_mask, head_phantom},
        read_volume_file,
    },
};
use std::{
    path::{Path, PathBuf},
    sync::{Arc, Mutex},
};

use crate::{
    headless::{Headless, project_folder, voxel_at},
    scene::IMAGE,
};

/// Creates a temporary folder for one test.
fn folder(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("bevy_contextual_ao_{name}_{}", std::process::id()));
    std::fs::create_dir_all(&path).expect("the temporary folder can be made");
    path
}

#[derive(Resource, Default)]
struct Seen {
    loaded: u32,
    failed: Vec<String>,
}

fn app() -> Headless {
    Headless::new(IMAGE, |app| {
        app.init_resource::<Seen>()
            .add_observer(|_: On<VolumeLoaded>, mut seen: ResMut<Seen>| seen.loaded += 1)
            .add_observer(|event: On<VolumeFailed>, mut seen: ResMut<Seen>| {
                seen.failed.push(event.reason.to_string())
            });
    })
}

/// Shows the file, and runs frames until its reading succeeds or fails.
fn load(app: &mut Headless, path: &Path) -> Entity {
    load_with(app, path, VolumeReadSettings::default())
}

fn load_with(app: &mut Headless, path: &Path, chosen: VolumeReadSettings) -> Entity {
    let world = app.app.world_mut();
    let handle: Handle<Volume> = world
        .resource::<AssetServer>()
        .load_builder()
        .with_settings(move |settings: &mut VolumeReadSettings| *settings = chosen.clone())
        .load(AssetPath::from_path_buf(path.to_owned()));
    let entity = world.spawn(VolumeBundle::new(handle)).id();
    let before = (world.resource::<Seen>().loaded, world.resource::<Seen>().failed.len());
    let came = app.frames_until(|headless| {
        let seen = headless.app.world().resource::<Seen>();
        (seen.loaded, seen.failed.len()) != before
    });
    assert!(came, "neither VolumeLoaded nor VolumeFailed for {}", path.display());
    entity
}

#[test]
fn files_load_and_failures_name_file_and_cause() {
    let folder = folder("loaders");
    let header =
        "NRRD0004\ntype: unsigned char\ndimension: 3\nsizes: 4 3 2\nspacings: 1 2 3\nencoding: raw\n";
    std::fs::write(folder.join("split.nhdr"), format!("{header}data file: split.raw\n")).expect("write");
    std::fs::write(folder.join("split.raw"), [7; 24]).expect("write");
    std::fs::write(folder.join("short.nrrd"), format!("{header}\nonly a few")).expect("write");
    std::fs::write(folder.join("lost.nhdr"), format!("{header}data file: nowhere.raw\n")).expect("write");

    let mut app = app();
    let entity = load(&mut app, &folder.join("split.nhdr"));
    let world = app.app.world();
    assert!(world.resource::<Seen>().failed.is_empty(), "{:?}", world.resource::<Seen>().failed);
    let handle = world.get::<Volume3d>(entity).expect("the volume");
    let volume = world.resource::<Assets<Volume>>().get(&handle.0).expect("loaded");
    assert_eq!(volume.dimensions(), UVec3::new(4, 3, 2));
    assert_eq!(volume.intensities(), &Intensities::U8(vec![7; 24]));

    for (file, names) in
        [("short.nrrd", ["short.nrrd", "truncated"]), ("lost.nhdr", ["lost.nhdr", "nowhere.raw"])]
    {
        load(&mut app, &folder.join(file));
        let error = app.app.world().resource::<Seen>().failed.last().cloned().unwrap_or_default();
        for name in names {
            assert!(error.contains(name), "{file}: `{error}` does not name {name}");
        }
    }
    let _ = std::fs::remove_dir_all(folder);
}

#[test]
fn the_loaders_settings_choose_a_component() {
    let folder = folder("components");
    let header = "NRRD0004\ntype: uchar\ndimension: 4\nsizes: 2 2 2 3\nkinds: space space space time\n";
    let file = [format!("{header}encoding: raw\n\n").into_bytes(), (0..24).collect()].concat();
    std::fs::write(folder.join("time.nrrd"), &file).expect("write");
    std::fs::write(folder.join("chosen.nrrd"), &file).expect("write");

    let mut app = app();
    let entity = load_with(
        &mut app,
        &folder.join("chosen.nrrd"),
        VolumeReadSettings { component: Some(1), ..default() },
    );
    let world = app.app.world();
    let handle = world.get::<Volume3d>(entity).expect("the volume");
    let volume = world.resource::<Assets<Volume>>().get(&handle.0).expect("loaded");
    assert!(*volume.intensities() == Intensities::U8((8..16).collect()));

    load(&mut app, &folder.join("time.nrrd"));
    let errors = &app.app.world().resource::<Seen>().failed;
    let message = "3 volumes (time): choose one by its component, 0 to 2";
    assert!(errors.iter().any(|error| error.contains(message)), "{errors:?}");
    let _ = std::fs::remove_dir_all(folder);
}

/// Log output, as text.
#[derive(Clone, Default)]
struct Log(Arc<Mutex<Vec<u8>>>);

impl std::io::Write for Log {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().expect("no test panics here").write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[test]
fn voxels_that_are_no_numbers_are_warned_of_once() {
    use bevy::log::tracing_subscriber::{fmt, util::SubscriberInitExt};
    let folder = folder("nan");
    let header = "NRRD0004\ntype: float\ndimension: 3\nsizes: 2 2 2\nencoding: text\n\n";
    std::fs::write(folder.join("some.nrrd"), format!("{header}1 nan 3 4 -inf 6 nan 8")).expect("write");
    std::fs::write(folder.join("none.nrrd"), format!("{header}1 2 3 4 5 6 7 8")).expect("write");

    let log = Log::default();
    let writer = log.clone();
    let _until_the_end = fmt().with_writer(move || writer.clone()).with_ansi(false).set_default();
    for file in ["some.nrrd", "none.nrrd"] {
        read_volume_file(&folder.join(file)).expect("a volume");
    }
    let log = String::from_utf8(log.0.lock().expect("no test panics here").clone()).expect("text");
    let lines: Vec<&str> = log.lines().collect();
    let parts = ["WARN", "some.nrrd", "3 of 8 voxels are NaN or infinite"];
    assert!(lines.len() == 1 && parts.iter().all(|part| lines[0].contains(part)), "{log}");
    let _ = std::fs::remove_dir_all(folder);
}

#[test]
fn the_demo_asset_is_what_the_generator_makes() {
    let assets = project_folder().join("assets");
    let volume = read_volume_file(&assets.join("head_phantom.nrrd")).expect("the demo volume");
    let phantom = head_phantom(160);
    assert_eq!(volume.dimensions(), phantom.dimensions);
    assert!((volume.spacing_mm() - phantom.spacing_mm).abs().max_element() < 1e-6);
    let width = phantom.dimensions.x as usize * phantom.dimensions.y as usize;
    for (z, slice) in phantom.values.chunks(width).enumerate() {
        for (k, expected) in slice.iter().enumerate().step_by(7) {
            let voxel =
                UVec3::new(k as u32 % phantom.dimensions.x, k as u32 / phantom.dimensions.x, z as u32);
            assert_eq!(volume.value_at(voxel), Some(*expected as f64), "{voxel}");
        }
    }
    let brain = read_volume_file(&assets.join("head_phantom_brain.nrrd")).expect("the mask of its brain");
    assert_eq!(
        (brain.dimensions(), brain.grid_to_patient()),
        (volume.dimensions(), volume.grid_to_patient())
    );
    for (index, expected) in (0..).zip(brain_mask(160)).step_by(7) {
        assert_eq!(
            brain.value_at(voxel_at(index, brain.dimensions())),
            Some(expected.into()),
            "voxel {index}"
        );
    }
    let text =
        std::fs::read_to_string(assets.join("head_phantom.tf.ron")).expect("the demo transfer function");
    TransferFunction::from_ron(&text).expect("a valid transfer function");
}

#[test]
fn every_kind_of_transfer_function_file_loads() {
    use bevy::asset::AssetLoader;
    assert_eq!(TransferFunctionLoader.extensions(), ["vp", "vp.json", "tf.ron"]);
    let folder = folder("functions");
    let ron = TransferFunction::ramp(10.0, 20.0, 0.5, [1.0, 0.5, 0.25]).expect("a ramp");
    std::fs::write(folder.join("ramp.tf.ron"), ron.to_ron().expect("ron")).expect("write");
    std::fs::write(
        folder.join("ramp.vp"),
        "1\n1\n0.2\n0.8\n0.1\n5\n4 10 0 20 0.5\n4 0 1 255 1\n8 10 1 0.5 0.25 20 1 0.5 0.25\n",
    )
    .expect("write");
    std::fs::write(
        folder.join("ramp.vp.json"),
        r#"{"volumeProperties": [{"components": [{"scalarOpacity": {"points": [{"x": 10, "y": 0}, {"x": 20, "y": 0.5}]}}]}]}"#,
    )
    .expect("write");
    let mut app = app();
    let world = app.app.world_mut();
    let handles: Vec<Handle<TransferFunction>> = ["ramp.tf.ron", "ramp.vp", "ramp.vp.json"]
        .map(|file| world.resource::<AssetServer>().load(AssetPath::from_path_buf(folder.join(file))))
        .into();
    let functions = |headless: &Headless| {
        let functions = headless.app.world().resource::<Assets<TransferFunction>>();
        handles.iter().filter_map(|handle| functions.get(handle).cloned()).collect::<Vec<_>>()
    };
    assert!(
        app.frames_until(|headless| functions(headless).len() == handles.len()),
        "the transfer functions do not load"
    );
    for function in functions(&app) {
        let sample = function.sample(15.0);
        assert!((sample[3] - 0.25).abs() < 1e-6, "{sample:?}");
    }
    let _ = std::fs::remove_dir_all(folder);
}
