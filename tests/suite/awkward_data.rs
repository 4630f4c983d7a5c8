//! Unusual volumes and rays. Volumes: constant, opaque, transparent, noisy, thin, of odd size, stretched, of 16 bits
//! in a narrow range. Rays: longer than the volume, without steps, a single ray.

use bevy::{
    math::{DAffine3, DVec3},
    prelude::*,
};
use bevy_contextual_ao::{
    prelude::*,
    volume::{Intensities, Rescale, VolumeGeometry},
};
use contextual_ao_kit::mode::ShadingMode;

use crate::{
    exact::assert_exact,
    headless::voxel_at,
    needs,
    scene::{
        TestScene, few_rays, folded_volume, is_empty, opaque_ramp, solid_volume, translucent_ramp,
        volume_from,
    },
};
use contextual_ao_kit::random::Random;

fn carve(volume: Volume, function: TransferFunction, occlusion: AmbientOcclusion) -> TestScene {
    let size = (volume.dimensions().as_vec3() * volume.spacing_mm()).min_element();
    let mut scene = TestScene::new(volume, function, occlusion, ShadingMode::Cao);
    // The carver cuts through the middle of the region that the camera sees.
    scene.carve(
        Sphere::new(0.4 * size.max(4.0)),
        ClipMesh::default(),
        Transform::from_translation(Vec3::splat(0.2 * size)),
    );
    scene
}

fn noise(dimensions: UVec3) -> Volume {
    let mut random = Random(3);
    let values = random.bytes(dimensions.element_product() as usize);
    Volume::new(dimensions, DAffine3::IDENTITY, Intensities::U8(values), Rescale::default()).expect("valid")
}

#[test]
fn volumes_of_every_kind_are_exact() {
    let size = UVec3::new(21, 19, 17);
    let odd = |x, y, z| folded_volume(UVec3::new(x, y, z), DVec3::ONE);
    let scenes = [
        ("constant and opaque", solid_volume(size), opaque_ramp()),
        ("constant and translucent", volume_from(size, DVec3::ONE, |_| 0.5), translucent_ramp()),
        ("noise", noise(size), opaque_ramp()),
        ("translucent noise", noise(size), translucent_ramp()),
        ("one voxel thick", volume_from(UVec3::new(24, 1, 24), DVec3::ONE, |_| 1.0), opaque_ramp()),
        ("a row of voxels", volume_from(UVec3::new(40, 1, 2), DVec3::ONE, |_| 1.0), opaque_ramp()),
        ("odd sizes", odd(31, 17, 13), opaque_ramp()),
        ("stretched 1:1:10", folded_volume(UVec3::new(24, 22, 5), DVec3::new(1.0, 1.0, 10.0)), opaque_ramp()),
    ];
    for (name, volume, function) in scenes {
        assert_exact(&mut carve(volume, function, few_rays()), name);
    }
}

#[test]
fn rays_of_every_kind_are_exact() {
    let rays = |pattern, steps, step_mm| {
        AmbientOcclusion::by(OcclusionRays { pattern, steps, step_mm: Some(step_mm), ..default() })
    };
    for (name, occlusion) in [
        ("a reach larger than the volume", rays(RayPattern::Fibonacci(6), 60, 1.0)),
        ("steps longer than the volume", rays(RayPattern::Fibonacci(6), 3, 100.0)),
        ("one ray", rays(RayPattern::Fibonacci(1), 8, 1.0)),
        ("no steps", rays(RayPattern::Fibonacci(6), 0, 1.0)),
    ] {
        let volume = folded_volume(UVec3::new(22, 20, 18), DVec3::ONE);
        assert_exact(&mut carve(volume, opaque_ramp(), occlusion), name);
    }
}

#[test]
fn a_transparent_volume_shows_nothing_and_occludes_nothing() {
    let clear = TransferFunction::ramp(0.0, 255.0, 0.0, [1.0; 3]).expect("a ramp");
    let mut scene = carve(folded_volume(UVec3::new(22, 20, 18), DVec3::ONE), clear, few_rays());
    scene.settle();
    assert!(is_empty(&scene.headless.image()));
    assert!(scene.occlusion().iter().all(Option::is_none));
    let opaque = scene.world().resource_mut::<Assets<TransferFunction>>().add(opaque_ramp());
    let volume = scene.volume;
    scene.world().entity_mut(volume).insert(VolumeTransferFunction(opaque));
    scene.settle();
    assert!(!is_empty(&scene.headless.image()), "it cannot be seen at all");
}

#[test]
fn a_narrow_window_of_16_bits_is_as_sharp_as_8_bits() {
    // Both volumes have the same shape. The 8-bit volume spans its whole range. The 16-bit volume spans 256 of 65,536
    // values.
    let size = UVec3::new(24, 22, 20);
    let fine = folded_volume(size, DVec3::ONE);
    let Intensities::U8(values) = fine.intensities() else { panic!("the test volume has 8 bits") };
    let narrow = values.iter().map(|&value| 30_000 + u16::from(value)).collect();
    let narrow = Volume::new(size, fine.grid_to_patient(), Intensities::U16(narrow), Rescale::default())
        .expect("valid");
    let window = TransferFunction::ramp(30_100.0, 30_160.0, 1.0, [0.9, 0.8, 0.7]).expect("a ramp");
    let mut narrow = carve(narrow, window, few_rays());
    if !needs::wide_intensities(&mut narrow) {
        return;
    }
    let mut fine = carve(fine.clone(), opaque_ramp(), few_rays());
    assert_exact(&mut narrow, "a narrow window");
    fine.settle();
    narrow.settle();
    let pairs = || narrow.opacities().into_iter().zip(fine.opacities()).collect::<Vec<_>>();
    // The ramp spans 60 intensities, so one intensity is 255/60 bytes. Rounding in the table is a small part of one
    // intensity.
    let largest = pairs().iter().map(|(a, b)| a.abs_diff(*b)).max();
    assert!(largest.is_some_and(|largest| largest <= 1), "{largest:?}");
}

#[test]
fn lists_longer_than_a_row_of_workgroups_are_worked_off() {
    // 33 x 33 x 33 bricks are more than the 32,768 workgroups of a row.
    const SIZE: UVec3 = UVec3::splat(132);
    let volume = solid_volume(SIZE);
    let local_from_voxel = VolumeGeometry::of(&volume).local_from_voxel;
    let mut scene = carve(volume, opaque_ramp(), few_rays());
    scene.set_clip(|clip| clip.coverage = CoverageRule::Center);
    scene.settle();
    let (center, radius) = (DVec3::splat(0.2 * 132.0), 0.4 * 132.0);
    let mut clipped = 0;
    for (index, opacity) in (0..).zip(scene.opacities()) {
        let place = local_from_voxel.transform_point3(voxel_at(index, SIZE).as_dvec3());
        let distance = place.distance(center) / radius;
        // The triangles of the carver's mesh lie within the ball by up to 1.1 % of its radius, and a texel of its depth
        // map is 0.4 %.
        assert!(distance < 1.01 || opacity == 255, "{place}: opacity {opacity} outside the ball");
        assert!(distance > 0.98 || opacity == 0, "{place}: opacity {opacity} inside the ball");
        clipped += u32::from(opacity == 0);
    }
    assert!(clipped > 100_000, "{clipped} voxels are clipped");
}
