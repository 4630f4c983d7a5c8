//! Depths of volumes: of a ball by closed form, and what they hide.

use bevy::{
    pbr::{ExtendedMaterial, MaterialExtension},
    prelude::*,
    render::render_resource::AsBindGroup,
};
use bevy_contextual_ao::{prelude::*, volume::WORLD_UNITS_PER_MM};
use contextual_ao_kit::scene::view_from;

use crate::{
    balls::{Balls, SHEET, STEP_MM},
    scene::IMAGE,
};

/// Where the near plane of a test's camera is.
const NEAR: f64 = 1e-4;

/// Largest difference of the depth from closed form, mm along a ray, and the pixels with a depth.
fn compare_depths(balls: &mut Balls) -> (f64, usize) {
    let (camera, view) = (balls.scene.camera(), balls.view());
    let depths = balls.scene.headless.depths(camera);
    let forward = balls.scene.world().get::<GlobalTransform>(camera).expect("a place").forward().as_dvec3();
    let mm = f64::from(WORLD_UNITS_PER_MM);
    let (mut largest, mut with_depth) = (0.0f64, 0);
    for (index, depth) in (0..).zip(&depths) {
        let pixel = UVec2::new(index % IMAGE.x, index / IMAGE.x);
        let Some(expected) = balls.distance(&view, pixel) else {
            continue;
        };
        if expected.is_infinite() {
            assert_eq!(*depth, 0.0, "{pixel} beside the ball has a depth");
            continue;
        }
        let (_, direction) = view.ray(pixel.as_dvec2() + 0.5);
        // Depth is the near plane's distance over that of the point.
        let along = (NEAR / f64::from(*depth) - NEAR) / direction.dot(forward) / mm;
        largest = largest.max((along - expected).abs());
        with_depth += 1;
    }
    println!("{with_depth} pixels, off by at most {largest:.3} mm");
    (largest, with_depth)
}

// The point lies in the middle of the slice that stops the light: half a step from where it is stopped. Trilinear intensities
// put a surface up to 1/96 mm from a ball's, 6 times as far along a ray at the edge of what is compared.
const MOST_MM: f64 = STEP_MM;

#[test]
fn a_ball_has_the_depth_of_a_ball() {
    let mut balls = Balls::new();
    let (camera, volume) = (balls.scene.camera(), balls.scene.volume);
    balls.settle();
    let none = balls.scene.headless.depths(camera);
    assert!(none.iter().all(|depth| *depth == 0.0), "a volume has a depth that nobody asked for");
    balls.scene.world().entity_mut(volume).insert(VolumeDepth::default());
    balls.settle();
    let (largest, pixels) = compare_depths(&mut balls);
    assert!(pixels > 500 && largest < MOST_MM, "{pixels} pixels, off by {largest} mm");
    // A cut has its depth in the frame of the carve.
    let view = view_from(Vec3::new(40.0, 10.0, 45.0));
    balls.scene.world().entity_mut(camera).insert(view);
    balls.settle();
    balls.halve();
    balls.scene.settle();
    let (largest, pixels) = compare_depths(&mut balls);
    assert!(pixels > 500 && largest < MOST_MM, "{pixels} pixels of half a ball, off by {largest} mm");
    balls.scene.world().entity_mut(volume).remove::<VolumeDepth>();
    balls.scene.headless.frame();
    assert!(balls.scene.headless.depths(camera).iter().all(|depth| *depth == 0.0), "the depth stays");
}

#[test]
fn mist_has_the_depth_at_which_it_is_as_opaque_as_asked_for() {
    let mut balls = Balls::new();
    let (camera, volume) = (balls.scene.camera(), balls.scene.volume);
    let per_mm = 0.1;
    let mist = TransferFunction::ramp(126.0, 129.0, per_mm, [1.0; 3]).expect("a valid ramp");
    let function = balls.scene.world().resource_mut::<Assets<TransferFunction>>().add(mist);
    balls.scene.world().entity_mut(volume).insert(VolumeTransferFunction(function));
    let middle = (IMAGE.y / 2 * IMAGE.x + IMAGE.x / 2) as usize;
    // 24 mm of mist stop 0.92 of the light.
    for (opacity, is_there) in [(0.2, true), (0.5, true), (0.85, true), (0.95, false)] {
        balls.scene.world().entity_mut(volume).insert(VolumeDepth { opacity });
        balls.settle();
        let depth = f64::from(balls.scene.headless.depths(camera)[middle]);
        assert_eq!(depth > 0.0, is_there, "opacity {opacity}: depth {depth}");
        if is_there {
            let along = (NEAR / depth) / f64::from(WORLD_UNITS_PER_MM);
            let expected = 60.0 - 12.0 + (1.0 - f64::from(opacity)).ln() / (1.0 - f64::from(per_mm)).ln();
            println!("opacity {opacity}: {along:.2} mm, expected {expected:.2}");
            // Half a step, and the millimetre over which the ramp rises at the ball's edge, whose mean is its middle.
            assert!((along - expected).abs() < STEP_MM, "opacity {opacity}: {along} mm, expected {expected}");
        }
    }
}

/// A sheet whose middle is nearer than the ball's, so that it is drawn later, and whose upper part is behind the ball.
fn leaning_sheet() -> Transform {
    Transform::from_xyz(0.0, -3.0, 13.0).with_rotation(Quat::from_rotation_x(-0.6))
}

#[test]
fn what_is_drawn_later_is_hidden_where_it_is_behind() {
    for is_halved in [false, true] {
        let mut balls = Balls::new();
        let (camera, volume) = (balls.scene.camera(), balls.scene.volume);
        balls.scene.world().entity_mut(volume).insert(VolumeDepth::default());
        if is_halved {
            balls.halve();
            balls.scene.world().entity_mut(camera).insert(view_from(Vec3::new(40.0, 10.0, 45.0)));
        }
        let pose = if is_halved {
            // Its middle is in the hollow.
            Transform::from_xyz(6.0, 0.0, 4.0)
        } else {
            leaning_sheet()
        };
        balls.add_sheet(pose, Vec2::new(30.0, 60.0));
        balls.settle();
        let seen = balls.compare();
        assert!(seen.before > 50 && seen.behind > 50, "{seen:?}");
        // Half floats.
        assert!(seen.largest < 0.002, "{seen:?}");
        balls.scene.world().entity_mut(volume).remove::<VolumeDepth>();
        balls.scene.headless.frames(2);
        let without = balls.compare();
        assert!(without.off > 50, "the sheet is hidden without a depth: {without:?}");
    }
}

#[test]
fn samples_of_a_pixel_have_the_depth() {
    let mut balls = Balls::new();
    let (camera, volume) = (balls.scene.camera(), balls.scene.volume);
    balls.scene.world().entity_mut(camera).insert(Msaa::Sample4);
    balls.scene.world().entity_mut(volume).insert(VolumeDepth::default());
    balls.add_sheet(leaning_sheet(), Vec2::new(30.0, 60.0));
    balls.settle();
    let seen = balls.compare();
    assert!(seen.before > 50 && seen.behind > 50 && seen.largest < 0.002, "{seen:?}");
}

/// A standard material that Bevy's prepass does not draw.
#[derive(Asset, AsBindGroup, Reflect, Clone, Default)]
struct WithoutPrepass {}

impl MaterialExtension for WithoutPrepass {
    fn enable_prepass() -> bool {
        false
    }
}

type Unprepared = ExtendedMaterial<StandardMaterial, WithoutPrepass>;

#[test]
fn meshes_without_a_prepass_show_in_front_alone() {
    let mut balls = Balls::with(|app| _ = app.add_plugins(MaterialPlugin::<Unprepared>::default()));
    let sheet = balls.add_sheet(leaning_sheet(), Vec2::new(30.0, 60.0));
    let color = Color::linear_rgb(SHEET.x as f32, SHEET.y as f32, SHEET.z as f32);
    let base = StandardMaterial { base_color: color, unlit: true, cull_mode: None, ..default() };
    let mut materials = balls.scene.world().resource_mut::<Assets<Unprepared>>();
    let material = materials.add(ExtendedMaterial { base, extension: default() });
    balls.set_opaque(sheet, MeshMaterial3d(material));
    balls.settle();
    let seen = balls.compare();
    // Half floats.
    assert!(seen.before > 50 && seen.behind > 50 && seen.largest < 0.002, "{seen:?}");
}
