//! An isosurface that is drawn alone, by view rays that leap by its distance field.

use bevy::{
    math::{DAffine3, DMat3, DVec2, DVec3},
    prelude::*,
};
use bevy_contextual_ao::occlusion::Optimizations;
use bevy_contextual_ao::{
    occlusion::{GeometryTerm, OcclusionSweeping, SweepingSurface},
    prelude::*,
    volume::WORLD_UNITS_PER_MM,
};
use contextual_ao_kit::mode::ShadingMode;

use crate::integral::srgb_byte;
use crate::scene::{
    IMAGE, TestScene, few_rays, folded_volume, in_world_units, is_empty, opaque_ramp, solid_volume,
    volume_from,
};

const ISOVALUE: f32 = 127.5;

fn isosurface(geometry_term: GeometryTerm) -> AmbientOcclusion {
    let surface = SweepingSurface::Isosurface(ISOVALUE);
    let sweeping = OcclusionSweeping { surface, geometry_term, ..default() };
    AmbientOcclusion::by(sweeping)
}

fn set_occlusion(scene: &mut TestScene, occlusion: AmbientOcclusion) {
    let volume = scene.volume;
    scene.world().entity_mut(volume).insert(occlusion);
}

/// Adds two carvers that subtract and one that intersects. Returns the last.
fn carve(scene: &mut TestScene) -> Entity {
    let at = |x: f32, y: f32| Transform::from_xyz(x, y, 5.0).with_rotation(Quat::from_rotation_x(x));
    scene.carve(Cuboid::new(8.0, 9.0, 30.0), ClipMesh::default(), at(-4.0, 6.0));
    scene.carve(Sphere::new(24.0), ClipMesh::intersect(), at(9.0, 0.0));
    scene.carve(Sphere::new(7.0), ClipMesh::default(), at(6.0, 4.0))
}

fn folded_scene(occlusion: AmbientOcclusion, mode: ShadingMode) -> TestScene {
    let volume = folded_volume(UVec3::new(38, 33, 29), DVec3::new(1.0, 0.8, 1.9));
    TestScene::new(volume, opaque_ramp(), occlusion, mode)
}

/// The eye, mm from the volume's centre, and the direction of every pixel's ray.
fn view_rays(scene: &mut TestScene) -> (DVec3, Vec<DVec3>) {
    let camera = scene.camera();
    let view = *scene.world().get::<Transform>(camera).expect("a place");
    let tangent = (0.125 * std::f64::consts::PI).tan();
    let directions = (0..IMAGE.element_product()).map(|k| {
        let place = (UVec2::new(k % IMAGE.x, k / IMAGE.x).as_dvec2() + 0.5) / IMAGE.as_dvec2();
        let right = view.right().as_dvec3() * (2.0 * place.x - 1.0) * tangent;
        let up = view.up().as_dvec3() * (1.0 - 2.0 * place.y) * tangent;
        (view.forward().as_dvec3() + right + up).normalize()
    });
    (view.translation.as_dvec3() / f64::from(WORLD_UNITS_PER_MM), directions.collect())
}

/// Byte of the test function's red under Blinn-Phong (`shading.wgsl`).
fn phong_byte(facing: f64) -> f64 {
    let red = ((0.9f64 + 0.055) / 1.055).powf(2.4);
    srgb_byte(red * (0.3 + 0.7 * facing) + 0.2 * facing.powi(16))
}

#[test]
fn a_sphere_is_where_it_is_and_lit_by_its_normals() {
    const SIZE: u32 = 28;
    const RADIUS_MM: f64 = 9.0;
    // Intensity is linear in the distance from the surface.
    let half = 0.5 * f64::from(SIZE);
    let volume = volume_from(UVec3::splat(SIZE), DVec3::ONE, move |p| 0.5 - (p.length() - RADIUS_MM / half));
    let mut scene = TestScene::new(volume, opaque_ramp(), isosurface(GeometryTerm::None), ShadingMode::Phong);
    scene.settle();
    let image = scene.headless.image();
    let (eye, directions) = view_rays(&mut scene);
    let mut differences = Vec::new();
    for (pixel, direction) in image.chunks(4).zip(directions) {
        let nearest = -eye.dot(direction);
        let miss = (eye + nearest * direction).length();
        let is_drawn = *pixel != image[..4];
        // A pixel on the outline may be drawn or not.
        if (miss - RADIUS_MM).abs() > 0.2 {
            assert_eq!(is_drawn, miss < RADIUS_MM, "{direction}: {miss} mm from the centre");
        }
        if is_drawn && miss < 0.9 * RADIUS_MM {
            let facing = (1.0 - (miss / RADIUS_MM).powi(2)).sqrt();
            differences.push((phong_byte(facing) - f64::from(pixel[0])).abs());
        }
    }
    assert!(differences.len() > 500, "{} pixels", differences.len());
    let mean = differences.iter().sum::<f64>() / differences.len() as f64;
    let most = differences.into_iter().fold(0.0, f64::max);
    println!("differences of shading, bytes: mean {mean:.2}, largest {most:.2}");
    assert!(mean < 1.5 && most < 8.0, "bytes: mean {mean}, largest {most}");
}

#[test]
fn a_solid_faces_the_way_that_the_end_of_the_grid_cuts_it() {
    const SIZE: u32 = 24;
    let mut scene = TestScene::new(
        solid_volume(UVec3::splat(SIZE)),
        opaque_ramp(),
        isosurface(GeometryTerm::None),
        ShadingMode::Phong,
    );
    scene.settle();
    let image = scene.headless.image();
    let (eye, directions) = view_rays(&mut scene);
    let mut compared = 0;
    for (pixel, direction) in image.chunks(4).zip(directions) {
        // The eye is beyond all three faces that it sees. A ray enters through the last face that it crosses.
        let half = 0.5 * f64::from(SIZE);
        let crossings = (DVec3::splat(half) - eye) / direction;
        let along = crossings.max_element();
        let hit = (eye + along * direction).abs();
        let facing = (0..3).find(|&axis| crossings[axis] == along).map_or(0.0, |axis| -direction[axis]);
        // Pixels at the edges are left out.
        let [_, second, first] = sorted(hit);
        if first <= half + 1e-6 && second < half - 0.3 {
            let difference = (phong_byte(facing) - f64::from(pixel[0])).abs();
            assert!(difference <= 1.0, "{direction}: {} instead of {}", pixel[0], phong_byte(facing));
            compared += 1;
        }
    }
    assert!(compared > 500, "{compared} pixels");
}

fn sorted(v: DVec3) -> [f64; 3] {
    let mut sorted = v.to_array();
    sorted.sort_by(f64::total_cmp);
    sorted
}

/// Images of a scene with and without leaps, after its carver moved.
fn images_with_and_without_leaps(build: impl Fn() -> (TestScene, Entity), to: Transform) -> [Vec<u8>; 2] {
    [true, false].map(|draw_leaps| {
        let (mut scene, carver) = build();
        scene.world().insert_resource(Optimizations { draw_leaps, ..default() });
        scene.settle();
        let before = scene.headless.image();
        scene.move_carver(carver, to);
        scene.headless.frame();
        let image = scene.headless.image();
        assert!(!is_empty(&image) && image != before);
        image
    })
}

#[test]
fn what_carvers_leave_thinner_than_a_voxel_is_not_leapt_over() {
    // A block lies in a large empty grid. Two boxes leave a plate of it, and tapering leftovers where they cross.
    let volume = || {
        let is_inside = |p: DVec3| if p.abs().max_element() < 0.6 { 1.0 } else { 0.0 };
        volume_from(UVec3::splat(40), DVec3::ONE, is_inside)
    };
    for thickness in [0.3, 0.7, 1.2] {
        let turn = Quat::from_rotation_z(0.15);
        let at = |y: f32, angle: f32| {
            Transform::from_translation(turn * Vec3::Y * y).with_rotation(turn * Quat::from_rotation_x(angle))
        };
        let build = || {
            let mut scene =
                TestScene::new(volume(), opaque_ramp(), isosurface(GeometryTerm::None), ShadingMode::Phong);
            let mut carve = |y| scene.carve(Cuboid::new(60.0, 20.0, 60.0), ClipMesh::default(), at(y, 0.0));
            carve(-10.0);
            let above = carve(16.0);
            (scene, above)
        };
        for angle in [0.0, 0.04] {
            let [leaping, stepping] = images_with_and_without_leaps(build, at(10.0 + thickness, angle));
            assert!(leaping == stepping, "{thickness} voxels, {angle}");
        }
    }
}

#[test]
fn sheared_grids_are_not_leapt_through() {
    // The axes are at 60 or 120 degrees. A small ball is in the middle. Along one diagonal, the ball is nearer than
    // the distance field says.
    for cosine in [0.5, -0.5] {
        let images = [true, false].map(|draw_leaps| {
            let (size, radius) = (UVec3::new(60, 60, 12), 4.0);
            let ball = volume_from(size, DVec3::ONE, |p| {
                let place = 0.5 * size.as_dvec3() * p;
                let sheared =
                    DVec2::new(place.x + cosine * place.y, (1.0 - cosine * cosine).sqrt() * place.y);
                0.5 - (sheared.extend(place.z).length() - radius) / 8.0
            });
            let axis = DVec3::new(cosine, (1.0 - cosine * cosine).sqrt(), 0.0);
            let axes = DAffine3::from_mat3(DMat3::from_cols(DVec3::X, axis, DVec3::Z));
            let volume = Volume::new(size, axes, ball.intensities().clone(), ball.rescale());
            let volume = volume.expect("a valid volume");
            let mut scene =
                TestScene::new(volume, opaque_ramp(), isosurface(GeometryTerm::None), ShadingMode::Phong);
            scene.world().insert_resource(Optimizations { draw_leaps, ..default() });
            scene.settle();
            let camera = scene.camera();
            let around = (0..12).map(|k| {
                let place = in_world_units(Transform::from_translation(
                    Quat::from_rotation_y(0.5 * k as f32) * Vec3::new(0.0, 5.0, 80.0),
                ));
                let view = Transform::from_translation(place.translation).looking_at(Vec3::ZERO, Vec3::Y);
                scene.world().entity_mut(camera).insert(view);
                scene.headless.frame();
                let image = scene.headless.image();
                assert!(!is_empty(&image), "{cosine}, view {k}");
                image
            });
            around.collect::<Vec<_>>()
        });
        assert!(images[0] == images[1], "{cosine}");
    }
}

#[test]
fn leaping_changes_no_bit() {
    for (mode, geometry_term) in [
        (ShadingMode::Phong, GeometryTerm::None),
        (ShadingMode::Cao, GeometryTerm::None),
        (ShadingMode::PhongCao, GeometryTerm::Cosine),
    ] {
        let build = || {
            let mut scene = folded_scene(isosurface(geometry_term), mode);
            let carver = carve(&mut scene);
            (scene, carver)
        };
        let images = images_with_and_without_leaps(build, Transform::from_xyz(2.0, 5.0, 9.0));
        assert!(images[0] == images[1], "{mode:?}");
    }
}

#[test]
fn it_is_drawn_where_what_is_denser_is_opaque() {
    let mut scene = folded_scene(isosurface(GeometryTerm::None), ShadingMode::Solid);
    carve(&mut scene);
    scene.settle();
    let surface = scene.headless.image();
    let function = TransferFunction::ramp(ISOVALUE - 0.5, ISOVALUE + 0.5, 1.0, [0.9, 0.8, 0.7]);
    let function = scene.world().resource_mut::<Assets<_>>().add(function.expect("a valid ramp"));
    let volume = scene.volume;
    scene.world().entity_mut(volume).insert(VolumeTransferFunction(function));
    set_occlusion(&mut scene, few_rays());
    scene.settle();
    let opaque = scene.headless.image();
    let is_drawn =
        |image: &[u8]| -> Vec<bool> { image.chunks(4).map(|pixel| *pixel != image[..4]).collect() };
    let (surface, opaque) = (is_drawn(&surface), is_drawn(&opaque));
    let drawn = opaque.iter().filter(|drawn| **drawn).count();
    let different = surface.iter().zip(&opaque).filter(|(a, b)| a != b).count();
    assert!(drawn > 500 && different * 100 <= drawn, "{different} of {drawn} pixels differ");
}

#[test]
fn modes_and_methods_can_be_changed_and_nothing_is_swept_at_rest() {
    let expected = |mode| {
        let mut scene = folded_scene(isosurface(GeometryTerm::None), mode);
        carve(&mut scene);
        scene.settle();
        scene.headless.image()
    };
    let (solid, cao) = (expected(ShadingMode::Solid), expected(ShadingMode::Cao));
    assert!(solid != cao && !is_empty(&cao));
    let mut scene = folded_scene(few_rays(), ShadingMode::Solid);
    carve(&mut scene);
    scene.settle();
    let by_rays = scene.headless.image();
    assert!(!is_empty(&by_rays) && by_rays != solid);
    for _ in 0..2 {
        set_occlusion(&mut scene, isosurface(GeometryTerm::None));
        scene.settle();
        assert!(scene.headless.image() == solid);
        scene.set_mode(ShadingMode::Cao);
        scene.settle();
        assert!(scene.headless.image() == cao);
        scene.set_mode(ShadingMode::Solid);
        scene.settle();
        let before = scene.status().passes.total_jobs();
        scene.headless.frames(3);
        assert_eq!(scene.status().passes.total_jobs(), before, "something is computed at rest");
        assert!(scene.headless.image() == solid);
        set_occlusion(&mut scene, few_rays());
        scene.settle();
        assert!(scene.headless.image() == by_rays);
    }
}

#[test]
fn an_edit_of_the_transfer_function_sweeps_nothing() {
    let mut scene = folded_scene(isosurface(GeometryTerm::None), ShadingMode::Cao);
    carve(&mut scene);
    scene.settle();
    scene.headless.frames(2);
    let (image, swept) = (scene.headless.image(), scene.status().passes.jobs(OcclusionSweeping::SPAN));
    assert!(swept > 0);
    let blue = TransferFunction::ramp(90.0, 150.0, 0.5, [0.2, 0.4, 0.9]).expect("a valid ramp");
    let blue = scene.world().resource_mut::<Assets<_>>().add(blue);
    let volume = scene.volume;
    scene.world().entity_mut(volume).insert(VolumeTransferFunction(blue));
    scene.headless.frames(4);
    assert!(scene.headless.image() != image);
    assert_eq!(scene.status().passes.jobs(OcclusionSweeping::SPAN), swept);
    // Sweeping of opacities does depend on the transfer function.
    let sweeping = OcclusionMethod::Sweeping(default());
    set_occlusion(&mut scene, AmbientOcclusion::by(sweeping));
    scene.settle();
    scene.headless.frames(2);
    let swept = scene.status().passes.jobs(OcclusionSweeping::SPAN);
    let opaque = scene.world().resource_mut::<Assets<_>>().add(opaque_ramp());
    scene.world().entity_mut(volume).insert(VolumeTransferFunction(opaque));
    scene.headless.frames(4);
    assert!(scene.status().passes.jobs(OcclusionSweeping::SPAN) > swept);
}

#[test]
fn the_camera_may_be_inside() {
    let hollow = volume_from(UVec3::splat(24), DVec3::ONE, |p| (p.length() - 0.6) * 6.0);
    let mut scene = TestScene::new(hollow, opaque_ramp(), isosurface(GeometryTerm::None), ShadingMode::Solid);
    let camera = scene.camera();
    let place = in_world_units(Transform::from_xyz(1.0, 2.0, -1.0));
    scene.world().entity_mut(camera).insert(place.with_scale(Vec3::ONE).looking_at(Vec3::X, Vec3::Y));
    scene.settle();
    let image = scene.headless.image();
    let lit = image.chunks(4).filter(|pixel| pixel[0] > 60).count();
    assert_eq!(lit as u32, IMAGE.element_product(), "pixels that see the wall");
}
