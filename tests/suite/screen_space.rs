//! Screen-space occlusion against a direct evaluation of its kernel on boxes that view rays hit. Further tests check
//! its effect in scenes. White things on black show the factor itself.

mod reference;

use bevy::{
    camera::Viewport,
    math::{DVec2, DVec3},
    prelude::*,
};
use bevy_contextual_ao::{
    diagnostics::TimePassesByClock,
    occlusion::{ScreenSpaceBlur, ScreenSpaceOcclusion},
    prelude::*,
    volume::VolumeGeometry,
};
use contextual_ao_kit::mode::ShadingMode;

use crate::scene::{IMAGE, TestScene, in_world_units, solid_volume, volume_from};
use reference::{Block, EYE, Lens, Reference, looking_from};

/// A slab that lies across the view, and a block on its left half: a step of 6 mm.
const SLAB: Block = [DVec3::new(-10.0, -10.0, -8.0), DVec3::new(10.0, 10.0, -2.0)];
const STEP: Block = [DVec3::new(-10.0, -10.0, -8.0), DVec3::new(0.0, 10.0, 4.0)];

/// Half of the points lie within 6 mm, the height of the step. Blur is off, so that single pixels are compared.
const SETTINGS: ScreenSpaceOcclusion = ScreenSpaceOcclusion {
    opacity_threshold: 0.5,
    radius_mm: Some(20.0),
    bias_mm: Some(0.5),
    samples: 64,
    blur: ScreenSpaceBlur::None,
};

/// A volume of blocks. Its voxels have 1 mm; the blocks end between voxels.
fn volume_of(blocks: &[Block]) -> Volume {
    let dimensions = UVec3::splat(24);
    let geometry = VolumeGeometry::of(&solid_volume(dimensions));
    volume_from(dimensions, DVec3::ONE, |p| {
        let voxel = (p + 1.0) * 0.5 * dimensions.as_dvec3() - 0.5;
        let point = geometry.local_from_voxel.transform_point3(voxel);
        let is_inside = |[low, high]: &Block| point.cmpge(*low).all() && point.cmple(*high).all();
        f64::from(blocks.iter().any(is_inside))
    })
}

fn scene(volume: Volume, settings: ScreenSpaceOcclusion) -> TestScene {
    let white = TransferFunction::ramp(100.0, 160.0, 1.0, [1.0; 3]).expect("a valid ramp");
    let occlusion = AmbientOcclusion::by(settings);
    let mut scene = TestScene::with(volume, white, occlusion, ShadingMode::Cao, |app| {
        app.insert_resource(ClearColor(Color::BLACK));
    });
    let camera = scene.camera();
    scene.world().entity_mut(camera).insert(looking_from(EYE));
    scene
}

/// The linear red of each pixel.
fn reds(scene: &TestScene) -> Vec<f64> {
    let linear = |byte: u8| {
        let value = f64::from(byte) / 255.0;
        if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
    };
    scene.headless.image().chunks(4).map(|pixel| linear(pixel[0])).collect()
}

#[test]
fn a_step_darkens_as_its_geometry_says() {
    let blocks = [SLAB, STEP];
    let mut scene = scene(volume_of(&blocks), SETTINGS);
    scene.settle();
    let reference = Reference { blocks: &blocks, lens: Lens::default(), settings: SETTINGS };
    let (compared, darkened) = reference.compare(&reds(&scene));
    assert!(compared > 2000 && darkened > 200, "{compared} pixels, {darkened} dark");

    // The rays are parallel.
    let camera = scene.camera();
    let projection = OrthographicProjection { scale: 0.4e-3, ..OrthographicProjection::default_3d() };
    scene.world().entity_mut(camera).insert(Projection::Orthographic(projection));
    scene.headless.frames(3);
    let lens = Lens::Orthographic(0.4 * f64::from(IMAGE.y) / 2.0);
    let (compared, darkened) = Reference { blocks: &blocks, lens, settings: SETTINGS }.compare(&reds(&scene));
    assert!(compared > 1200 && darkened > 120, "{compared} pixels, {darkened} dark");
}

#[test]
fn blurs_are_the_means_that_they_say() {
    let [raw, gaussian, even] = [ScreenSpaceBlur::None, ScreenSpaceBlur::Gaussian, ScreenSpaceBlur::Even]
        .map(|blur| {
            let mut scene = scene(volume_of(&[SLAB, STEP]), ScreenSpaceOcclusion { blur, ..SETTINGS });
            scene.settle();
            reds(&scene)
        });
    let mut scene = scene(volume_of(&[SLAB, STEP]), SETTINGS);
    scene.set_mode(ShadingMode::Solid);
    scene.settle();
    let whites = reds(&scene);
    let at = |image: &[f64], pixel: IVec2| image[(pixel.y * IMAGE.x as i32 + pixel.x) as usize];
    // VTK's weights, to four digits. All surfaces are nearer to each other than the radius.
    let vtk = |offset: IVec2| [0.1953, 0.1233, 0.0778][offset.abs().element_sum() as usize];
    let around = |first: i32, last: i32| {
        (first..=last).flat_map(move |y| (first..=last).map(move |x| IVec2::new(x, y)))
    };
    let mut compared = 0;
    for pixel in around(2, IMAGE.min_element() as i32 - 3) {
        // Where a pixel is not quite white, its factor is not known.
        if around(-2, 1).any(|offset| at(&whites, pixel + offset) < 0.999) {
            continue;
        }
        let by_vtk: f64 = around(-1, 1).map(|offset| vtk(offset) * at(&raw, pixel + offset)).sum();
        let by_mean = around(-2, 1).map(|offset| at(&raw, pixel + offset)).sum::<f64>() / 16.0;
        // Two roundings to bytes, of at most 0.005 where they are brightest.
        assert!((at(&gaussian, pixel) - by_vtk).abs() < 0.01, "{pixel}");
        assert!((at(&even, pixel) - by_mean).abs() < 0.01, "{pixel}");
        compared += 1;
    }
    assert!(compared > 1000 && raw != gaussian && raw != even, "{compared} pixels");
}

#[test]
fn meshes_and_volumes_darken_each_other() {
    // The block on the slab is an opaque mesh.
    let blocks = [SLAB, STEP];
    let mut scene = scene(volume_of(&blocks[..1]), SETTINGS);
    let world = scene.world();
    let [low, high] = STEP;
    let mesh = world.resource_mut::<Assets<Mesh>>().add(Cuboid::from_size((high - low).as_vec3()));
    let white = StandardMaterial { base_color: Color::WHITE, unlit: true, ..default() };
    let material = world.resource_mut::<Assets<StandardMaterial>>().add(white);
    let place = in_world_units(Transform::from_translation((0.5 * (low + high)).as_vec3()));
    let mesh = world.spawn((Mesh3d(mesh), MeshMaterial3d(material), place)).id();
    scene.settle();
    let reference = Reference { blocks: &blocks, lens: Lens::default(), settings: SETTINGS };
    let hits = reference.hits();
    let shown = hits.iter().flatten().count();
    // The mesh's shaders are still being read.
    let shows_all = |headless: &crate::headless::Headless| {
        headless.image().chunks(4).filter(|pixel| pixel[0] > 0).count() * 100 > shown * 95
    };
    assert!(scene.headless.frames_until(shows_all), "the mesh is not drawn");
    scene.headless.frames(3);
    reference.compare(&reds(&scene));
    // With several samples of each pixel's depth, the first sample gives the same result.
    let camera = scene.camera();
    scene.world().entity_mut(camera).insert(Msaa::Sample4);
    scene.headless.frames(3);
    assert!(scene.headless.frames_until(shows_all), "nothing is drawn with several samples");
    reference.compare(&reds(&scene));
    scene.world().despawn(mesh);
    scene.headless.frames(3);
    // A flat slab alone is open everywhere.
    let alone = Reference { blocks: &blocks[..1], ..reference };
    assert_eq!(alone.compare(&reds(&scene)).1, 0, "dark without the mesh");
}

#[test]
fn of_several_volumes_the_nearest_counts() {
    let blocks = [SLAB, STEP];
    let mut scene = scene(volume_of(&blocks[..1]), SETTINGS);
    let volume = scene.volume;
    let world = scene.world();
    let step = world.resource_mut::<Assets<Volume>>().add(volume_of(&blocks[1..]));
    let function = world.get::<VolumeTransferFunction>(volume).expect("a transfer function").clone();
    let mut bundle = VolumeBundle::new(step).with_transfer_function(function.0);
    bundle.occlusion = world.get::<AmbientOcclusion>(volume).expect("settings").clone();
    let step = world.spawn(bundle).id();
    scene.settle();
    scene.headless.until_ready(step).expect("it can be shown");
    scene.headless.frames(3);
    let reference = Reference { blocks: &blocks, lens: Lens::default(), settings: SETTINGS };
    let (compared, darkened) = reference.compare(&reds(&scene));
    assert!(compared > 2000 && darkened > 200, "{compared} pixels, {darkened} dark");
}

#[test]
fn a_carved_pocket_is_dark_and_leaves_no_trace() {
    let settings = ScreenSpaceOcclusion { radius_mm: Some(12.0), blur: default(), ..SETTINGS };
    let mut scene = scene(volume_of(&[SLAB]), settings);
    let camera = scene.camera();
    scene.world().entity_mut(camera).insert(looking_from(DVec3::new(0.0, 0.0, 30.0)));
    scene.settle();
    scene.headless.frames(2);
    let before = scene.headless.image();
    let carver = scene.carve(Sphere::new(4.0), ClipMesh::default(), Transform::from_xyz(0.0, 0.0, -2.0));
    scene.settle();
    scene.headless.frames(2);
    let carved = reds(&scene);
    // At 32 mm from the camera, the image's height shows 26.5 mm.
    let pixels_per_mm = f64::from(IMAGE.y) / (64.0 * (core::f64::consts::FRAC_PI_4 * 0.5).tan());
    let mean = |from_mm: f64, to_mm: f64| {
        let from_center = |index: usize| {
            let pixel = DVec2::new((index as u32 % IMAGE.x) as f64, (index as u32 / IMAGE.x) as f64);
            (pixel + 0.5 - 0.5 * IMAGE.as_dvec2()).length() / pixels_per_mm
        };
        let ring: Vec<_> =
            (0..carved.len()).filter(|&index| (from_mm..to_mm).contains(&from_center(index))).collect();
        ring.iter().map(|&index| carved[index]).sum::<f64>() / ring.len() as f64
    };
    let (wall, around) = (mean(2.0, 3.7), mean(5.0, 8.0));
    assert!(wall < 0.9, "the pocket's wall has {wall} of the light");
    assert!(around > 0.98, "the plane around it has {around}");
    scene.world().despawn(carver);
    scene.settle();
    scene.headless.frames(2);
    assert!(scene.headless.image() == before, "the carver left a trace");
}

#[test]
fn each_view_is_shaded_by_itself() {
    let mut scene = scene(volume_of(&[SLAB, STEP]), ScreenSpaceOcclusion { blur: default(), ..SETTINGS });
    let left = scene.camera();
    let half = UVec2::new(IMAGE.x / 2, IMAGE.y);
    let viewport =
        |x: u32| Some(Viewport { physical_position: UVec2::new(x, 0), physical_size: half, depth: 0.0..1.0 });
    let bundle = scene.headless.camera();
    let near = Projection::Perspective(PerspectiveProjection { near: 1e-4, ..default() });
    let world = scene.world();
    let right = world.spawn((bundle, near, looking_from(DVec3::new(-12.0, 20.0, 30.0)))).id();
    for (camera, x, order) in [(left, 0, 0), (right, half.x, 1)] {
        let mut camera = world.get_mut::<Camera>(camera).expect("a camera");
        camera.viewport = viewport(x);
        camera.order = order;
        // The image of the first camera stays.
        camera.clear_color = if order == 0 { default() } else { ClearColorConfig::None };
    }
    scene.settle();
    let mut image_of = |active: [bool; 2], clear: ClearColorConfig| {
        for (camera, is_active) in [left, right].into_iter().zip(active) {
            scene.world().get_mut::<Camera>(camera).expect("a camera").is_active = is_active;
        }
        scene.world().get_mut::<Camera>(right).expect("a camera").clear_color = clear;
        scene.headless.frames(3);
        scene.headless.image()
    };
    let both = image_of([true, true], ClearColorConfig::None);
    let first = image_of([true, false], ClearColorConfig::None);
    let second = image_of([false, true], ClearColorConfig::Default);
    let is_left = |index: usize| (index / 4) as u32 % IMAGE.x < half.x;
    for (index, byte) in both.iter().enumerate() {
        let alone = if is_left(index) { first[index] } else { second[index] };
        assert_eq!(*byte, alone, "byte {index}, {}", if is_left(index) { "left" } else { "right" });
    }
    let dark = |is_counted: &dyn Fn(usize) -> bool| {
        let pixels = both.chunks(4).enumerate().filter(|(index, _)| is_counted(4 * index));
        pixels.filter(|(_, pixel)| (1..230).contains(&pixel[0])).count()
    };
    let (left, right) = (dark(&is_left), dark(&|index| !is_left(index)));
    assert!(left > 50 && right > 50, "{left} and {right} dark pixels");
}

#[test]
fn nothing_is_done_where_it_is_off() {
    let mut scene = scene(volume_of(&[SLAB, STEP]), SETTINGS);
    scene.settle();
    let volume = scene.volume;
    let runs = |scene: &TestScene| scene.status().passes.jobs(ScreenSpaceOcclusion::SPAN);
    let frames = |scene: &mut TestScene| {
        scene.headless.frames(2);
        let before = runs(scene);
        scene.headless.frames(3);
        (scene.headless.image(), runs(scene) - before)
    };
    let method = |scene: &mut TestScene, method: OcclusionMethod| {
        scene.world().get_mut::<AmbientOcclusion>(volume).expect("settings").method = method;
        scene.settle();
    };
    let (shaded, ran) = frames(&mut scene);
    assert_eq!(ran, 3, "runs in three frames");
    for mode in [ShadingMode::Solid, ShadingMode::Phong] {
        method(&mut scene, OcclusionMethod::ScreenSpace(SETTINGS));
        scene.set_mode(mode);
        let (image, ran) = frames(&mut scene);
        assert_eq!(ran, 0, "{}", mode.name());
        assert!(image != shaded, "{} is shaded", mode.name());
        method(&mut scene, default());
        assert!(image == frames(&mut scene).0, "{} depends on the method", mode.name());
    }
    // Modes with light are darkened too. LAO gives the same image as CAO.
    method(&mut scene, OcclusionMethod::ScreenSpace(SETTINGS));
    let phong = frames(&mut scene).0;
    scene.set_mode(ShadingMode::PhongCao);
    let (phong_shaded, ran) = frames(&mut scene);
    assert_eq!(ran, 3);
    let darker = phong.iter().zip(&phong_shaded).filter(|(a, b)| a > b).count();
    assert!(darker > 500 && phong.iter().zip(&phong_shaded).all(|(a, b)| a >= b), "{darker} darker bytes");
    scene.set_mode(ShadingMode::Lao);
    assert!(frames(&mut scene).0 == shaded, "LAO and CAO differ");
    // Settings that find no occlusion, and invalid settings, darken nothing.
    scene.set_mode(ShadingMode::Solid);
    let solid = frames(&mut scene).0;
    scene.set_mode(ShadingMode::Cao);
    for nothing in [
        ScreenSpaceOcclusion { samples: 0, ..SETTINGS },
        ScreenSpaceOcclusion { radius_mm: Some(f32::NAN), ..SETTINGS },
        ScreenSpaceOcclusion { bias_mm: Some(1e30), ..SETTINGS },
    ] {
        method(&mut scene, OcclusionMethod::ScreenSpace(nothing));
        assert!(frames(&mut scene).0 == solid, "{nothing:?} darkens");
    }
    method(&mut scene, OcclusionMethod::ScreenSpace(SETTINGS));
    assert!(frames(&mut scene).0 == shaded, "it does not come back as it was");
    // Timed by the clock, passes run one by one. Otherwise they all run at the frame's end.
    for by_clock in [false, true] {
        scene.world().insert_resource(TimePassesByClock(by_clock));
        let (image, ran) = frames(&mut scene);
        assert!(image == shaded && ran == 3, "timed by the clock: {by_clock}, {ran} runs");
        let ms = scene.status().passes.clock_ms(ScreenSpaceOcclusion::SPAN);
        assert_eq!(ms.is_some(), by_clock);
    }
    scene.world().despawn(volume);
    assert_eq!(frames(&mut scene).1, 0, "runs without a volume");
}
