//! An isosurface that is drawn alone, by view rays that leap by its distance field.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::{
    occlusion::{GeometryTerm, OcclusionSweeping, SweepingSurface},
    prelude::*,
};

use crate::scene::{
    IMAGE, TestScene, few_rays, folded_volume, in_world_units, is_empty, opaque_ramp, volume_from,
};

const ISOVALUE: f32 = 127.5;

fn isosurface(geometry_term: GeometryTerm) -> AmbientOcclusion {
    let surface = SweepingSurface::Isosurface(ISOVALUE);
    let sweeping = OcclusionSweeping { surface, geometry_term, ..default() };
    AmbientOcclusion { method: OcclusionMethod::Sweeping(sweeping), ..default() }
}

fn set_occlusion(scene: &mut TestScene, occlusion: AmbientOcclusion) {
    let volume = scene.volume;
    scene.world().entity_mut(volume).insert(occlusion);
}

/// Two carvers, and one that keeps.
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

/// The byte that shows a linear value.
fn srgb_byte(linear: f64) -> f64 {
    let encoded = if linear <= 0.0031308 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    255.0 * encoded.clamp(0.0, 1.0)
}

#[test]
fn a_sphere_is_where_it_is_and_lit_by_its_normals() {
    const SIZE: u32 = 28;
    const RADIUS_MM: f64 = 9.0;
    // Linear in the distance from the surface.
    let half = 0.5 * f64::from(SIZE);
    let volume = volume_from(UVec3::splat(SIZE), DVec3::ONE, move |p| 0.5 - (p.length() - RADIUS_MM / half));
    let mut scene = TestScene::new(volume, opaque_ramp(), isosurface(GeometryTerm::None), ShadingMode::Phong);
    scene.settle();
    let image = scene.headless.image();
    let camera = scene.camera();
    let view = *scene.world().get::<Transform>(camera).expect("a place");
    let eye = view.translation.as_dvec3() / f64::from(bevy_contextual_ao::volume::WORLD_UNITS_PER_MM);
    let tangent = (0.125 * std::f64::consts::PI).tan();
    // The function's red, decoded.
    let red = ((0.9f64 + 0.055) / 1.055).powf(2.4);
    let mut differences = Vec::new();
    for (k, pixel) in image.chunks(4).enumerate() {
        let place = (UVec2::new(k as u32 % IMAGE.x, k as u32 / IMAGE.x).as_dvec2() + 0.5) / IMAGE.as_dvec2();
        let right = view.right().as_dvec3() * (2.0 * place.x - 1.0) * tangent;
        let up = view.up().as_dvec3() * (1.0 - 2.0 * place.y) * tangent;
        let direction = (view.forward().as_dvec3() + right + up).normalize();
        let nearest = -eye.dot(direction);
        let miss = (eye + nearest * direction).length();
        let is_drawn = *pixel != image[..4];
        // On the outline it may be either.
        if (miss - RADIUS_MM).abs() > 0.2 {
            assert_eq!(is_drawn, miss < RADIUS_MM, "{place}: {miss} mm from the centre");
        }
        if is_drawn && miss < 0.9 * RADIUS_MM {
            let facing = (1.0 - (miss / RADIUS_MM).powi(2)).sqrt();
            // Blinn-Phong as in `shading.wgsl`.
            let expected = red * (0.3 + 0.7 * facing) + 0.2 * facing.powi(16);
            differences.push((srgb_byte(expected) - f64::from(pixel[0])).abs());
        }
    }
    assert!(differences.len() > 500, "{} pixels", differences.len());
    let mean = differences.iter().sum::<f64>() / differences.len() as f64;
    let most = differences.into_iter().fold(0.0, f64::max);
    println!("differences of shading, bytes: mean {mean:.2}, largest {most:.2}");
    assert!(mean < 1.5 && most < 8.0, "bytes: mean {mean}, largest {most}");
}

#[test]
fn leaping_changes_no_bit() {
    for (mode, geometry_term) in [
        (ShadingMode::Phong, GeometryTerm::None),
        (ShadingMode::Cao, GeometryTerm::None),
        (ShadingMode::PhongCao, GeometryTerm::Cosine),
    ] {
        let images = [true, false].map(|draw_leaps| {
            let mut scene = folded_scene(isosurface(geometry_term), mode);
            scene.world().insert_resource(Shortcuts { draw_leaps, ..default() });
            let carver = carve(&mut scene);
            scene.settle();
            let before = scene.headless.image();
            scene.move_carver(carver, Transform::from_xyz(2.0, 5.0, 9.0));
            scene.headless.frame();
            let image = scene.headless.image();
            assert!(!is_empty(&image) && image != before, "{mode:?}");
            image
        });
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
        assert_eq!(scene.status().passes.total_jobs(), before);
        assert!(scene.headless.image() == solid);
        set_occlusion(&mut scene, few_rays());
        scene.settle();
        assert!(scene.headless.image() == by_rays);
    }
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
