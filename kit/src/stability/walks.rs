//! Independence of the result from the path that carvers took, from the camera, and from rest.

use crate::mode::ShadingMode;
use bevy::{math::DVec3, prelude::*};

use super::{
    super::{
        random::Random,
        shapes::Triangles,
        small_scene::{TestScene, count_different, few_rays, folded_volume, translucent_ramp},
    },
    Figure,
};

const CARVERS: usize = 4;

fn scene() -> TestScene {
    let volume = folded_volume(UVec3::new(28, 25, 23), DVec3::ONE);
    TestScene::new(volume, translucent_ramp(), few_rays(), ShadingMode::Cao)
}

fn mesh(k: usize) -> Triangles {
    match k {
        0 => Triangles::sphere(6.0, 16),
        1 => Triangles::cuboid(Vec3::new(7.0, 9.0, 8.0)),
        2 => Triangles::torus(6.0, 2.0, 32, 16).rotated(Quat::from_rotation_x(0.7)),
        _ => Triangles::trefoil_tube(2.0, 0.8, 80, 8),
    }
}

fn pose(random: &mut Random) -> Transform {
    Transform {
        translation: 10.0 * random.point(),
        rotation: random.rotation(3.0),
        scale: Vec3::splat(1.0 + 0.3 * random.signed()),
    }
}

/// Compares random walks of several carvers with a fresh start where the walks end. Carvers also go and come again.
/// Two cameras are compared, and frames at rest.
pub fn paths(steps: usize, report: &mut impl FnMut(Figure)) {
    let mut random = Random(42);
    let goals: Vec<_> = (0..CARVERS).map(|_| pose(&mut random)).collect();
    let mut walked = scene();
    let mut carvers: Vec<_> = (0..CARVERS).map(|k| walked.carve_with(&mesh(k), pose(&mut random))).collect();
    for _ in 0..steps {
        let k = random.below(CARVERS);
        let to = pose(&mut random);
        if random.below(6) == 0 {
            walked.world().despawn(carvers[k]);
            walked.headless.frame();
            carvers[k] = walked.carve_with(&mesh(k), to);
        } else {
            walked.move_carver(carvers[k], to);
        }
        walked.headless.frame();
    }
    for (&carver, &goal) in carvers.iter().zip(&goals) {
        walked.move_carver(carver, goal);
    }
    walked.settle();
    let mut fresh = scene();
    for (k, &goal) in goals.iter().enumerate().rev() {
        fresh.carve_with(&mesh(k), goal);
    }
    fresh.settle();
    let name = format!("random walk, {steps} steps, {CARVERS} carvers");
    let differ = |a: &[u8], b: &[u8]| a.iter().zip(b).filter(|(a, b)| a != b).count() as f64;
    let mut figure = |figure, unit, value| {
        report(Figure { case: name.clone(), method: "cao".into(), figure, unit, bound: Some(0.0), value });
    };
    figure(
        "different from a fresh start",
        "voxels",
        count_different(&walked.occlusion(), &fresh.occlusion()) as f64,
    );
    figure(
        "different from a fresh start",
        "bytes of the image",
        differ(&walked.headless.image(), &fresh.headless.image()),
    );

    let (occlusion, image) = (walked.occlusion(), walked.headless.image());
    walked.headless.frame();
    let passes = walked.status().passes.total_jobs();
    walked.headless.frame();
    walked.headless.frame();
    figure("passes run in a frame at rest", "passes", (walked.status().passes.total_jobs() - passes) as f64);
    figure("different at rest", "bytes of the image", differ(&walked.headless.image(), &image));
    let camera = walked.camera();
    walked
        .world()
        .entity_mut(camera)
        .insert(Transform::from_xyz(-0.03, 0.04, 0.02).looking_at(Vec3::ZERO, Vec3::Y));
    // Moving a carver there and back computes everything again, as seen by the new view.
    walked.move_carver(carvers[0], Transform::default());
    walked.headless.frame();
    walked.move_carver(carvers[0], goals[0]);
    walked.headless.frame();
    assert!(walked.headless.image() != image, "the view did not change");
    let different = count_different(&walked.occlusion(), &occlusion);
    figure("different for another camera", "voxels", different as f64);
}
