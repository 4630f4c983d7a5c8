//! Time that the CPU takes to plan a frame with many carvers: at rest, and while one or all of them move.
//!
//! `cargo bench --profile dev --bench plan`. The profile is that of all else here, so that Bevy is not built again.

#![allow(missing_docs, reason = "a macro makes the public function")]

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::{diagnostics::PlanTime, prelude::*};
use contextual_ao_kit::{
    mode::ShadingMode,
    small_scene::{TestScene, few_rays, folded_volume, opaque_ramp},
};
use criterion::{Criterion, criterion_group, criterion_main};
use std::{hint::black_box, time::Duration};

const CARVERS: u32 = 128;

/// Place of a carver in a frame. Carvers that move do so by a twentieth of a millimetre.
fn at(carver: u32, frame: u64) -> Transform {
    let cell = UVec3::new(carver % 8, carver / 8 % 4, carver / 32).as_vec3();
    Transform::from_translation(4.0 * cell - Vec3::new(14.0, 6.0, 6.0) + 0.05 * (frame % 9) as f32)
}

fn plan(criterion: &mut Criterion) {
    let volume = folded_volume(UVec3::splat(32), DVec3::ONE);
    let mut scene = TestScene::new(volume, opaque_ramp(), few_rays(), ShadingMode::Cao);
    let carvers: Vec<_> =
        (0..CARVERS).map(|k| scene.carve(Sphere::new(1.5), ClipMesh::default(), at(k, 0))).collect();
    scene.settle();
    let mut frame = 0;
    for (case, moving) in [("at rest", 0), ("one moves", 1), ("all move", CARVERS as usize)] {
        criterion.bench_function(&format!("plan of {CARVERS} carvers, {case}"), |bencher| {
            bencher.iter_custom(|frames| {
                let mut sum = Duration::ZERO;
                for _ in 0..frames {
                    frame += 1;
                    for (k, carver) in (0..).zip(&carvers[..moving]) {
                        scene.move_carver(*carver, at(k, frame));
                    }
                    // The time of a frame is known in the next one.
                    scene.headless.frame();
                    scene.headless.app.update();
                    sum += black_box(scene.headless.app.world().resource::<PlanTime>().0);
                }
                sum
            });
        });
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10).measurement_time(Duration::from_secs(3));
    targets = plan
}
criterion_main!(benches);
