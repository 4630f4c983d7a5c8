//! The truth that pictures are judged against, where it is known in closed form.

use bevy::{
    math::{DVec2, DVec3, UVec2},
    prelude::*,
};
use bevy_contextual_ao::volume::{Intensities, phantom::head_phantom};
use contextual_ao_kit::picture::{
    edge,
    field::{ColorPoint, Field, Tissue},
    occlusion::{ambient, directions},
    scenes::{MATTER, PictureScene},
    solid::Solid,
    truth::{Eye, Truth, facing_of, lit},
};

const STEPS: u32 = 20;

/// A solid of one colour and opacity, with an edge so sharp that it has no width: the transfer function is a step.
fn field(solid: Solid, opacity: f64) -> Field {
    let point = |opacity| ColorPoint { value: 500.0, color: DVec3::ONE, opacity };
    Field::new(vec![Tissue { solid, value: MATTER }], vec![point(0.0), point(opacity)], 64, 1.0)
}

fn ball() -> Field {
    field(Solid::Ball { center: DVec3::ZERO, radius: 20.0 }, 1.0)
}

/// A slab so thick that only one of its sides counts.
fn wall(normal: DVec3) -> Field {
    field(Solid::Slab { normal, thickness: 40.0 }, 1.0)
}

#[test]
fn the_profile_of_an_edge_is_the_error_function() {
    // Abramowitz and Stegun, table 26.1.
    for (away, below) in [(0.0, 0.5), (1.0, 0.841_344_746_068_543), (2.5, 0.993_790_334_674_224)] {
        assert!((edge::share(away) - (1.0 - below)).abs() < 1e-10, "{away}");
        assert!((edge::share(-away) - below).abs() < 1e-10, "{away}");
    }
}

#[test]
fn a_thin_wall_is_blurred_from_both_sides() {
    let normal = DVec3::new(0.3, 0.8, 0.5).normalize();
    for thickness in [0.3, 1.5, 24.0] {
        let field = field(Solid::Slab { normal, thickness }, 1.0);
        for along in [0.0, 0.4, -1.3] {
            // By hand: the wall's share of a Gaussian of the scanner's blur, as a sum.
            let blur = field.blur_mm();
            let at = |k: i32| (f64::from(k) + 0.5) * 0.001;
            let bell = |away: f64| (-0.5 * (away / blur).powi(2)).exp();
            let inside = |away: f64| f64::from(u8::from((along + away).abs() < 0.5 * thickness));
            let sums = (-8000..8000)
                .map(at)
                .fold(DVec2::ZERO, |sum, away| sum + bell(away) * DVec2::new(inside(away), 1.0));
            let found = field.value(along * normal + DVec3::new(-0.8, 0.3, 0.0));
            assert!((found - MATTER * sums.x / sums.y).abs() < 0.5, "{thickness} {along}: {found} {sums}");
        }
    }
}

#[test]
fn a_slab_lets_through_the_power_of_its_thickness() {
    let field = field(Solid::Slab { normal: DVec3::Z, thickness: 10.0 }, 0.2);
    let truth = Truth::new(&field, STEPS);
    for direction in [DVec3::NEG_Z, DVec3::new(0.3, 0.2, -1.0).normalize()] {
        let pixel = truth.pixel(DVec3::new(0.0, 0.0, 60.0), direction);
        let facing = direction.z.abs();
        let through = |depth: f64| 0.8f64.powf(depth / facing);
        let found = 1.0 - pixel.alpha;
        assert!((found - through(10.0)).abs() < 1e-4, "{found} {}", through(10.0));
        // Within a voxel of either side there is a surface.
        let inside = through(1.0) - through(9.0);
        let expected = inside + (1.0 - through(10.0) - inside) * lit(DVec3::ONE, facing, 1.0).x;
        assert!((pixel.lit.x - expected).abs() < 1e-3, "{} {expected}", pixel.lit.x);
    }
}

#[test]
fn a_ball_faces_by_the_angle_at_its_surface() {
    let field = ball();
    let truth = Truth::new(&field, STEPS);
    for off_axis in [0.0, 5.0, 19.0] {
        let pixel = truth.pixel(DVec3::new(off_axis, 0.0, 60.0), DVec3::NEG_Z);
        let facing = (1.0 - (off_axis / 20.0f64).powi(2)).sqrt();
        assert!((pixel.facing - facing).abs() < 1e-3, "{off_axis}: {} {facing}", pixel.facing);
        assert!((pixel.lit - lit(DVec3::ONE, facing, 1.0)).length() < 1e-3);
        assert!((facing_of(pixel.lit.x, 1.0) - pixel.facing).abs() < 1e-6);
    }
    assert_eq!(truth.pixel(DVec3::new(21.0, 0.0, 60.0), DVec3::NEG_Z).alpha, 0.0);
}

#[test]
fn the_middle_of_a_picture_looks_at_the_origin() {
    let eye = Eye { position: DVec3::new(30.0, 20.0, 90.0), fov: 0.5, size: UVec2::new(9, 5) };
    assert!(eye.direction(UVec2::new(4, 2)).distance(-eye.position.normalize()) < 1e-12);
    // The upper edge is half the field of view away.
    let above = Eye { size: UVec2::new(9, 1000), ..eye }.direction(UVec2::new(4, 0));
    assert!(
        (above.angle_between(-eye.position) - 0.25).abs() < 1e-3 && above.y > -eye.position.normalize().y
    );
}

#[test]
fn half_of_the_rays_leave_a_wall() {
    let normal = DVec3::new(0.3, 0.8, 0.5).normalize();
    let field = wall(normal);
    let all = directions(4096);
    for above in [0.01, 1.0, 3.3] {
        // By hand: a ray towards the wall passes its samples up to the first in it.
        let passed = |direction: DVec3| {
            let towards = -direction.dot(normal);
            let is_out = |i: &u32| above - towards * (3f64.sqrt() + f64::from(*i)) > 0.0;
            (0..STEPS).take_while(is_out).count() as f64
        };
        let by_hand =
            all.iter().map(|d| (1.0 + passed(*d)) / f64::from(STEPS + 1)).sum::<f64>() / all.len() as f64;
        let found = ambient(&field, normal * (20.0 + above), &all, STEPS);
        assert!((found - by_hand).abs() < 1e-9, "{above}: {found} {by_hand}");
    }
    // On the surface half of the rays pass all samples, the others none but the point itself.
    let half = 0.5 + 0.5 / f64::from(STEPS + 1);
    assert!((ambient(&field, normal * 20.000_001, &all, STEPS) - half).abs() < 1e-3);
}

#[test]
fn what_is_cut_away_is_not_seen_and_casts_no_shadow() {
    let mut field = wall(DVec3::Z);
    field.cuts.push(Solid::Ball { center: DVec3::new(0.0, 0.0, 20.0), radius: 12.0 });
    let truth = Truth::new(&field, STEPS);
    let cosine = 0.8f64;
    let offset = 12.0 * (1.0 - cosine * cosine).sqrt();
    let pixel = truth.pixel(DVec3::new(offset, 0.0, 60.0), DVec3::NEG_Z);
    // The normal is that of the ball, and what is seen is the ball's surface.
    assert!((pixel.facing - cosine).abs() < 1e-4, "{}", pixel.facing);
    let place = DVec3::new(offset, 0.0, 20.0 - 12.0 * cosine);
    let expected = ambient(&field, place, &directions(512), STEPS);
    assert!((pixel.occluded.x - expected).abs() < 1e-3, "{} {expected}", pixel.occluded);
}

#[test]
fn a_ball_s_occlusion_is_one_shade() {
    let scenes = PictureScene::all(48, 32).expect("scenes");
    let scene = &scenes[0];
    let truth = Truth::new(&scene.field, STEPS);
    let pixels = truth.picture(&scene.eye);
    let shades: Vec<f64> = pixels.iter().filter(|p| p.facing > 0.7).map(|p| p.occluded.x).collect();
    let [low, high] = [f64::min, f64::max].map(|of| shades.iter().copied().reduce(of).unwrap_or_default());
    assert!(shades.len() > 100 && low > 0.2 && high - low < 0.03, "{} {low} {high}", shades.len());
}

#[test]
fn the_head_is_the_demo_s() {
    let head = head_phantom(40);
    let volume = Field::of_head(Vec::new(), 40).volume().expect("a volume");
    let UVec3 { x: width, y: depth, z: height } = head.dimensions;
    assert_eq!(volume.dimensions(), UVec3::new(width, height, depth));
    let stored = |k: usize| match volume.intensities() {
        Intensities::U8(values) => f64::from(values[k]),
        Intensities::U16(values) => f64::from(values[k]),
    };
    // The demo's axes point to the patient's right, front and top; the scene's x and z to the left and to the front.
    for (k, value) in head.values.iter().enumerate() {
        let k = k as u32;
        let [x, y, z] = [width - 1 - k % width, k / width % depth, k / (width * depth)];
        let found = volume.rescale().intercept + stored((x + width * (z + height * y)) as usize);
        assert_eq!(found, f64::from(*value), "{x} {y} {z}");
    }
}

#[test]
fn smaller_steps_leave_pictures_as_they_are() {
    for scene in PictureScene::all(48, 8).expect("scenes") {
        let mut truth = Truth::new(&scene.field, STEPS);
        let pixels = truth.picture(&scene.eye);
        truth.coarseness = 0.25;
        for (pixel, finer) in pixels.iter().zip(truth.picture(&scene.eye)) {
            // A quarter of a level.
            let apart = (pixel.lit_occluded - finer.lit_occluded).abs().max_element();
            assert!(apart < 1e-3, "{} {}: {apart}", scene.name, scene.transfer);
        }
    }
}
