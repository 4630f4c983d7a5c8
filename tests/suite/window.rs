//! Parts of the `carve` example that need no window: dropped files, double clicks, views that follow the volume's size, digits and
//! pictures.

use bevy::{
    asset::RenderAssetUsages,
    camera::Viewport,
    math::DVec3,
    picking::{PickingSettings, hover::Hovered},
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
    window::FileDragAndDrop,
};
use bevy_contextual_ao::prelude::*;
use bevy_panorbit_camera::PanOrbitCamera;
use contextual_ao_kit::{
    digits::{decimals, significant},
    files::FileOptions,
    mode::ShadingMode,
};
use std::{
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use crate::picking::pointers::{MIDDLE, Pointing};
use crate::scene::{folded_volume, is_empty, volume_from};
use contextual_ao_kit::headless::Headless;

mod series;

/// Modules of the `carve` example, as its own main file has them.
#[allow(dead_code, reason = "some of it is for the window")]
#[path = "../../examples/carve"]
mod carve {
    pub mod carvers;
    pub mod content;
    pub mod dicom;
    pub mod dropping;
    pub mod hands;
    pub mod joint_histogram;
    pub mod loading;
    pub mod picture;
    pub mod shown;
    pub mod view;
}

use carve::{
    carvers::Carver,
    dicom::DicomPlugin,
    dropping::{CannotOpen, DroppingPlugin, FileKind, OpenDicom, OpenFile},
    hands::{Hand, put},
    joint_histogram::{COLUMNS, JointHistogram, ROWS},
    loading::LoadingPlugin,
    picture::save_numbered,
    shown::{FunctionSource, Shown},
    view,
};

/// Creates an empty temporary folder for one test.
fn folder(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("bevy_contextual_ao_{name}_{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).expect("the temporary folder can be made");
    path
}

/// Writes a volume of `voxels` voxels along each side.
fn write_volume(path: &Path, voxels: usize) {
    let header = format!(
        "NRRD0004\ntype: unsigned char\ndimension: 3\nsizes: {voxels} {voxels} {voxels}\nspacings: 1 1 1\n\
         encoding: raw\n\n"
    );
    let values = (0..voxels.pow(3)).map(|k| (k % 251) as u8);
    std::fs::write(path, header.into_bytes().into_iter().chain(values).collect::<Vec<_>>()).expect("write");
}

#[test]
fn a_view_follows_the_size_of_its_volume() {
    // The first volume has a head's size. The second is 1.6 x 2.1 x 0.8 mm of micro-CT. The third is 4.2 m long.
    let images = [5.0, 0.04, 80.0].map(|spacing_mm| {
        let size = UVec2::splat(64);
        let mut headless = Headless::new(size, |app| {
            app.add_observer(view::show_all);
        });
        let camera = headless.camera();
        let world = headless.app.world_mut();
        let camera = world.spawn((camera, PanOrbitCamera::default())).id();
        let volume = folded_volume(UVec3::new(40, 52, 20), DVec3::splat(spacing_mm));
        let volume = world.resource_mut::<Assets<Volume>>().add(volume);
        let mut function = TransferFunction::ramp(100.0, 160.0, 1.0, [0.9, 0.8, 0.7]).expect("a valid ramp");
        function.opacity_unit_distance_mm = spacing_mm as f32;
        let function = world.resource_mut::<Assets<TransferFunction>>().add(function);
        let mut bundle = VolumeBundle::new(volume).with_transfer_function(function);
        ShadingMode::Phong.apply(&mut bundle.shading, &mut bundle.occlusion);
        let volume = world.spawn(bundle).id();
        headless.until_ready(volume).expect("the volume can be shown");
        let orbit = *headless.app.world().get::<PanOrbitCamera>(camera).expect("the camera");
        let view = |distance: f32| {
            let place = orbit.target_focus + distance * Vec3::new(0.4, 0.3, 1.0).normalize();
            Transform::from_translation(place).looking_at(orbit.target_focus, Vec3::Y)
        };
        let from = [orbit.target_radius, orbit.zoom_lower_limit, orbit.zoom_upper_limit.unwrap_or_default()];
        from.map(|distance| {
            headless.app.world_mut().entity_mut(camera).insert(view(distance));
            headless.frame();
            headless.image()
        })
    });
    for (of_size, image) in images.iter().flatten().enumerate() {
        assert!(!is_empty(image), "view {} of volume {} is empty", of_size % 3, of_size / 3);
    }
    for other in &images[1..] {
        for (other, image) in other.iter().zip(&images[0]) {
            let pairs = other.iter().zip(image);
            let different = pairs.filter(|(a, b)| a.abs_diff(**b) > 2).count();
            // Lengths are rounded, which may move the outline by a pixel here and there. One byte in a hundred may
            // differ.
            assert!(different * 100 < image.len(), "{different} of {} bytes differ", image.len());
        }
    }
}

#[test]
fn a_double_click_puts_the_selected_carver_onto_the_surface() {
    let mut pointing = Pointing::new();
    let home = Transform::from_xyz(1.0, 0.0, 0.0);
    let world = pointing.scene.world();
    world.resource_mut::<PickingSettings>().multi_click_interval = Duration::from_secs(60);
    let carver = world.spawn((Carver { index: 0, name: "ball", home }, home, Hovered::default())).id();
    world.insert_resource(Hand { selected: Some(carver), ..default() });
    world.add_observer(put);
    let place =
        |pointing: &mut Pointing| pointing.scene.world().get::<Transform>(carver).copied().expect("a place");
    pointing.click(MIDDLE);
    assert_eq!(place(&mut pointing), home, "a single click");
    pointing.click(MIDDLE);
    let found = place(&mut pointing);
    // The ball is seen about 7 mm from its middle.
    assert!((found.translation.length() - 0.0072).abs() < 0.001, "{}", found.translation);
    assert_eq!((found.rotation, found.scale), (home.rotation, home.scale));
    // Two clicks on a carver are the carver's own.
    pointing.scene.world().entity_mut(carver).insert((home, Hovered(true)));
    pointing.click(MIDDLE);
    pointing.click(MIDDLE);
    assert_eq!(place(&mut pointing), home);
}

#[test]
fn files_are_told_apart_by_their_names() {
    for (name, kind) in [
        ("head.nii", FileKind::Volume),
        ("a.b/HEAD.NII.GZ", FileKind::Volume),
        ("x.hdr", FileKind::Volume),
        ("x.nhdr", FileKind::Volume),
        ("x.mha", FileKind::Volume),
        ("Bone.VP", FileKind::TransferFunction),
        ("bone.vp.json", FileKind::TransferFunction),
        ("x.tf.ron", FileKind::TransferFunction),
        ("1.DCM", FileKind::Dicom),
        ("a.ima", FileKind::Dicom),
        ("Head.ZIP", FileKind::Dicom),
        // A folder.
        ("/", FileKind::Dicom),
    ] {
        assert_eq!(FileKind::of(Path::new(name)), Ok(kind), "{name}");
    }
    for name in ["notes.txt", "x.ron", "nii", "", "x.vp.bak"] {
        let reason = FileKind::of(Path::new(name)).expect_err(name);
        assert!(reason.starts_with(name) && reason.contains(".nrrd"), "{reason}");
    }
}

/// The example's app without a window, showing a volume of 8 voxels along each side.
struct Window {
    headless: Headless,
    folder: PathBuf,
}

impl Window {
    fn new(name: &str, preset: Option<Preset>) -> Self {
        let folder = folder(name);
        write_volume(&folder.join("first.nrrd"), 8);
        let options = FileOptions { file: Some(folder.join("first.nrrd")), preset, ..default() };
        let headless = Headless::new(UVec2::splat(16), |app| {
            app.insert_resource(options).add_plugins((LoadingPlugin, DroppingPlugin, DicomPlugin));
        });
        let mut window = Self { headless, folder };
        window.until(|window| window.shown().content.is_some());
        window
    }

    fn shown(&self) -> &Shown {
        self.headless.app.world().resource()
    }

    fn until(&mut self, holds: impl Fn(&Self) -> bool) {
        // Files are read and pictures written meanwhile. This takes time, and not a number of frames.
        let begin = Instant::now();
        while begin.elapsed() < Duration::from_secs(60) {
            if holds(self) {
                return;
            }
            self.headless.frame();
        }
        let Shown { name, errors, .. } = self.shown();
        panic!("it never came to hold; shown is {name}, errors are {errors:?}");
    }

    fn drop_file(&mut self, name: &str) {
        let path_buf = self.folder.join(name);
        let world = self.headless.app.world_mut();
        world.write_message(FileDragAndDrop::DroppedFile { window: Entity::PLACEHOLDER, path_buf });
        self.headless.frame();
    }

    /// Voxels along the x axis of the shown volume, and its transfer function.
    fn content(&mut self) -> (u32, TransferFunction) {
        let world = self.headless.app.world_mut();
        let mut entities = world.query::<(&Volume3d, &VolumeTransferFunction)>();
        let (volume, function) = entities.single(world).expect("one volume");
        let volume = world.resource::<Assets<Volume>>().get(&volume.0).expect("it has been read");
        let functions = world.resource::<Assets<TransferFunction>>();
        (volume.dimensions().x, functions.get(&function.0).expect("it has been read").clone())
    }
}

#[test]
fn a_dropped_volume_is_shown_once_it_is_read() {
    let mut window = Window::new("dropped_volume", Some(Preset::MrHead));
    write_volume(&window.folder.join("second.nrrd"), 12);
    let (size, first) = window.content();
    assert_eq!(size, 8);
    window.drop_file("second.nrrd");
    window.until(|window| window.shown().name == "second.nrrd");
    window.headless.frames(2);
    let (size, second) = window.content();
    assert_eq!(size, 12);
    assert!(
        window.shown().content.as_ref().is_some_and(|content| content.summary.starts_with("12 x 12 x 12"))
    );
    // The preset is made anew, so its unit distance follows the volume's size.
    assert!(second.opacity_unit_distance_mm > 1.4 * first.opacity_unit_distance_mm);
}

#[test]
fn a_dropped_transfer_function_stays_when_a_volume_follows() {
    let mut window = Window::new("dropped_function", None);
    let guessed = window.content().1;
    let ramp = TransferFunction::ramp(3.0, 5.0, 0.5, [1.0; 3]).expect("a valid ramp");
    std::fs::write(window.folder.join("ramp.tf.ron"), ramp.to_ron().expect("it can be written"))
        .expect("write");
    write_volume(&window.folder.join("second.nrrd"), 12);
    assert!(guessed != ramp);
    window.drop_file("ramp.tf.ron");
    window.until(|window| window.shown().function == FunctionSource::File);
    assert_eq!(window.content(), (8, ramp.clone()));
    window.drop_file("second.nrrd");
    window.until(|window| window.shown().name == "second.nrrd");
    window.headless.frames(2);
    assert_eq!(window.content(), (12, ramp));
}

#[test]
fn a_dropped_file_that_cannot_be_shown_changes_nothing() {
    let mut window = Window::new("dropped_nonsense", None);
    std::fs::write(window.folder.join("broken.nrrd"), "NRRD0004\ntype: unsigned char\n\n").expect("write");
    std::fs::write(window.folder.join("broken.vp"), "not numbers").expect("write");
    write_volume(&window.folder.join("large.nrrd"), 128);
    // Depth maps take 21 MiB. The large volume takes 8 MiB.
    window.headless.app.insert_resource(VolumeBudget { max_bytes: 25 << 20, halves: false });
    let before = window.content();
    for (name, words) in [
        ("notes.txt", "neither a volume"),
        ("absent.nii", "absent.nii"),
        ("broken.nrrd", "broken.nrrd"),
        ("broken.vp", "broken.vp"),
        ("large.nrrd", "--halve"),
    ] {
        window.drop_file(name);
        window.until(|window| window.shown().errors.len() == 1);
        assert!(window.shown().errors[0].contains(words), "{:?}", window.shown().errors);
        window.headless.frames(5);
        assert_eq!(window.shown().name, "first.nrrd");
        assert_eq!(window.content(), before, "{name}");
        let summary = window.shown().content.as_ref().map(|content| content.summary.clone());
        assert_eq!(summary.as_deref(), Some("8 x 8 x 8 voxels of 1 x 1 x 1 mm"), "{name}");
    }
}

#[test]
fn values_show_as_many_digits_as_their_range_asks_for() {
    for (value, text) in [
        (0.0004, "0.0004"),
        (0.9375, "0.938"),
        (1.0, "1"),
        (2.5, "2.5"),
        (512.3, "512"),
        (1234567.0, "1234567"),
        (0.0, "0"),
        (1.5e-9, "0.0000000015"),
    ] {
        assert_eq!(significant(value), text);
    }
    // Two values a thousandth of the range apart read differently.
    for (width, least) in [(0.004, 0.001), (1.0, 0.5), (255.0, 17.0), (4095.0, -1000.0), (2e-9, 1e-9)] {
        let text = |value: f32| format!("{value:.*}", decimals(width));
        assert_ne!(text(least), text(least + width / 1000.0), "{width}");
    }
    assert_eq!(decimals(4095.0), 0);
    assert!(decimals(0.0) < 10 && decimals(f32::NAN) < 10 && decimals(f32::INFINITY) < 10);
}

#[test]
fn pictures_never_overwrite_and_leave_the_panel_out() {
    let folder = folder("pictures");
    // Pixels are red where the panel is, else green. They are transparent, which must not matter.
    let pixels: Vec<u8> =
        (0..12 * 5).flat_map(|k| if k % 12 < 4 { [255, 0, 0, 0] } else { [0, 255, 0, 0] }).collect();
    let size = Extent3d { width: 12, height: 5, depth_or_array_layers: 1 };
    let format = TextureFormat::Rgba8UnormSrgb;
    let image = Image::new(size, TextureDimension::D2, pixels, format, RenderAssetUsages::MAIN_WORLD);
    let viewport =
        Viewport { physical_position: UVec2::new(4, 0), physical_size: UVec2::new(8, 5), ..default() };
    std::fs::write(folder.join("carved-002.png"), "precious").expect("write");
    let names = [(); 2].map(|()| save_numbered(&image, Some(&viewport), &folder));
    assert_eq!(names, ["carved-001.png", "carved-003.png"].map(|name| Ok(name.to_owned())));
    assert_eq!(std::fs::read(folder.join("carved-002.png")).expect("read"), b"precious");
    let picture = image::open(folder.join("carved-001.png")).expect("a picture").to_rgba8();
    assert_eq!(picture.dimensions(), (8, 5));
    assert!(picture.pixels().all(|pixel| pixel.0 == [0, 255, 0, 255]));
    let nowhere = save_numbered(&image, None, &folder.join("nowhere")).expect_err("no such folder");
    assert!(nowhere.contains("nowhere") && nowhere.contains("carved-001.png"), "{nowhere}");
}

#[test]
fn drops_ask_for_files_or_tell_why_not() {
    #[derive(Resource, Default)]
    struct Asked(Vec<Result<OpenFile, CannotOpen>>, Vec<OpenDicom>);
    let mut app = App::new();
    app.add_message::<FileDragAndDrop>()
        .init_resource::<Asked>()
        .add_plugins(DroppingPlugin)
        .add_observer(|open: On<OpenFile>, mut asked: ResMut<Asked>| asked.0.push(Ok(open.clone())))
        .add_observer(|open: On<OpenDicom>, mut asked: ResMut<Asked>| asked.1.push(open.clone()))
        .add_observer(|cannot: On<CannotOpen>, mut asked: ResMut<Asked>| asked.0.push(Err(cannot.clone())));
    let window = Entity::PLACEHOLDER;
    for name in ["a.nii", "b.vp", "c.txt", "d.dcm", "e.zip"] {
        let path_buf = PathBuf::from(name);
        app.world_mut().write_message(FileDragAndDrop::HoveredFile { window, path_buf: path_buf.clone() });
        app.world_mut().write_message(FileDragAndDrop::DroppedFile { window, path_buf });
    }
    app.update();
    let asked = &app.world().resource::<Asked>().0;
    let open = |path: &str, kind| Ok(OpenFile { path: path.into(), kind });
    assert_eq!(asked[..2], [open("a.nii", FileKind::Volume), open("b.vp", FileKind::TransferFunction)]);
    assert!(asked.len() == 3 && asked[2].is_err(), "{asked:?}");
    // Files of a series that are dropped together are looked at together.
    let together = OpenDicom { paths: ["d.dcm", "e.zip"].map(PathBuf::from).to_vec(), ..default() };
    assert_eq!(app.world().resource::<Asked>().1, [together]);
}

#[test]
fn the_joint_histogram_has_values_and_their_gradients() {
    // Half of the volume is a ramp of 6 values per voxel of 2 mm, the other half is even.
    let ramp = |p: DVec3| 0.5 + (p.x * 16.0 - 0.5) * 6.0 / 255.0;
    let volume =
        volume_from(UVec3::new(32, 8, 8), DVec3::splat(2.0), |p| if p.x < 0.0 { 0.5 } else { ramp(p) });
    let histogram = JointHistogram::of(&volume);
    assert!((histogram.last_per_mm - 3.0).abs() < 0.3, "{}", histogram.last_per_mm);
    let row = |row: usize| &histogram.frequencies[row * COLUMNS..(row + 1) * COLUMNS];
    let shown = |row: &[f32]| row.iter().filter(|frequency| **frequency > 0.0).count();
    assert_eq!((shown(row(0)), row(0)[0]), (1, 1.0), "the even half has one value, and is most frequent");
    let steep = (2 * ROWS / 3..ROWS).map(|steep| shown(row(steep))).sum::<usize>();
    assert!(steep >= 12, "the ramp has {steep} values");
    assert!((2..ROWS / 3).all(|between| shown(row(between)) <= 1), "only the kink lies between");
}
