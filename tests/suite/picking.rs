//! Rays and pointers hit volumes where they are seen: against closed forms, without a renderer.

mod bodies;
mod cuts;
mod pictures;
pub mod pointers;

use bevy::{camera::visibility::RenderLayers, math::DVec3, prelude::*};
use bevy_contextual_ao::{
    occlusion::{OcclusionSweeping, SweepingSurface},
    prelude::*,
};
use contextual_ao_kit::random::Random;

use bodies::{Ball, Bench, Grid, STEP_MM, opaque_from, slabs, world_ray};

const RADIUS_MM: f64 = 11.0;

/// Places of a volume in the world: a scene's, in any pose, mirrored, and sheared by a parent.
fn places() -> Vec<Vec<Transform>> {
    let turn = Quat::from_euler(EulerRot::XYZ, 0.4, -1.1, 0.7);
    let pose = Transform::from_xyz(0.4, -0.2, 1.3).with_rotation(turn);
    vec![
        vec![Transform::IDENTITY],
        vec![pose.with_scale(Vec3::splat(2.5))],
        vec![pose.with_scale(Vec3::new(-1.3, 0.8, 1.1))],
        vec![Transform::from_xyz(0.1, 0.0, 0.0).with_scale(Vec3::new(1.0, 2.0, 0.7)), pose],
    ]
}

#[test]
fn a_ball_is_hit_where_it_is_and_faces_its_viewer() {
    let mut random = Random(5);
    let (mut most_mm, mut most_degrees, mut hits, mut misses) = (0.0f64, 0.0f64, 0, 0);
    for grid in [Grid::even(), Grid::uneven(), Grid::sheared()] {
        for place in places() {
            let ball = Ball { radius_mm: RADIUS_MM };
            let mut bench = Bench::new(&grid, &place, |p| ball.value(p), opaque_from(0.5));
            for _ in 0..40 {
                let (from, to) = (random.point().as_dvec3(), random.point().as_dvec3());
                let (from, to) = (from.normalize() * 40.0, to * 1.3 * RADIUS_MM);
                let ray = world_ray(&bench.world_from_mm(), from, to);
                let found = bench.cast(ray);
                let expected = ball.enter(from, to);
                // Rays that graze the ball are too close to call.
                if expected.is_none_or(|[near, far]| far - near < 2.0) {
                    let way = (to - from).normalize();
                    let miss = from.reject_from(way).length();
                    if miss > RADIUS_MM + 0.2 {
                        assert_eq!(found, None, "{miss} mm from the middle");
                        misses += 1;
                    }
                    continue;
                }
                let hit = found.expect("the ball is hit");
                let at = bench.to_mm(hit.position);
                let on_ray = (to - from).normalize() * expected.expect("a hit")[0] + from;
                // Between voxels the ball is a little flat: a grazing ray sees that from the side.
                most_mm = most_mm.max((at.length() - RADIUS_MM).abs());
                assert!((at - from).reject_from(to - from).length() < 1e-3, "beside the ray");
                assert!((at - on_ray).length() < 0.5, "{at}, expected {on_ray}");
                most_degrees = most_degrees.max(bench.degrees_between(hit.normal, on_ray, ray));
                assert!((hit.distance - hit.position.distance(ray.origin)).abs() < 1e-5);
                let voxel = grid.voxel_at(at);
                assert!(voxel.distance(hit.place_voxels.as_dvec3()) < 0.01, "{voxel} {}", hit.place_voxels);
                assert_eq!(hit.voxel, voxel.round().as_uvec3());
                assert!((hit.value / 65_535.0 - 0.5).abs() < 0.002, "{}", hit.value);
                assert_eq!((hit.volume, hit.carver), (bench.volume, None));
                hits += 1;
            }
        }
    }
    println!("{hits} hits and {misses} misses: at most {most_mm:.4} mm and {most_degrees:.2} degrees off");
    assert!(hits > 200 && misses > 20, "{hits} hits, {misses} misses");
    assert!(most_mm < 0.15 * STEP_MM, "off by {most_mm} mm");
    assert!(most_degrees < 2.0, "off by {most_degrees} degrees");
}

#[test]
fn a_hit_has_the_set_share_of_the_light_in_front() {
    // A translucent layer from 20 to 32 mm along x, air, and an opaque wall from 40 mm on.
    let mut bench = Bench::new(&Grid::long(), &[Transform::IDENTITY], |p| p.x / 64.0 + 0.5, slabs());
    let half = 32.0;
    for (share, slope) in [(0.1f64, 0.0), (0.3, 0.4), (0.4, 0.2), (0.45, 0.0), (0.5, 0.4), (0.8, 0.0)] {
        let way = DVec3::new(1.0, slope, -0.5 * slope).normalize();
        let from = DVec3::new(-half - 3.0, -6.0, 2.0);
        let ray = world_ray(&bench.world_from_mm(), from, from + way);
        let settings = VolumeRayCastSettings::default().with_stopped_light(share as f32);
        let hit = bench.cast_by(ray, &settings).expect("a wall");
        let depth_mm = -(1.0 - share).ln() / bodies::EXTINCTION_PER_MM * way.x;
        let expected = if depth_mm < bodies::LAYER[1] - bodies::LAYER[0] {
            bodies::LAYER[0] + depth_mm
        } else {
            bodies::WALL
        };
        let found = bench.to_mm(hit.position).x + half;
        println!("{share}: {found:.3} mm, expected {expected:.3}");
        assert!((found - expected).abs() < 0.15 * STEP_MM, "{share}: {found} mm, expected {expected}");
    }
    // The layer stops 0.43 of the light: what reaches no further hits nothing.
    let from = DVec3::new(-half - 3.0, 0.0, 0.0);
    let ray = world_ray(&bench.world_from_mm(), from, DVec3::ZERO);
    let to_wall = |mm: f32| VolumeRayCastSettings::default().with_max_distance(mm * 0.001);
    assert_eq!(bench.cast_by(ray, &to_wall(42.9)), None);
    assert!(bench.cast_by(ray, &to_wall(43.1)).is_some());
}

#[test]
fn a_camera_inside_hits_what_is_before_it() {
    let ball = Ball { radius_mm: RADIUS_MM };
    // A hollow: matter is outside of the ball.
    let mut bench =
        Bench::new(&Grid::even(), &[Transform::IDENTITY], |p| 1.0 - ball.value(p), opaque_from(0.5));
    let from = DVec3::new(2.0, -3.0, 1.0);
    for towards in [DVec3::X * 20.0, DVec3::new(-9.0, 7.0, 3.0), DVec3::new(1.0, -9.0, 20.0)] {
        let ray = world_ray(&bench.world_from_mm(), from, towards);
        let hit = bench.cast(ray).expect("the wall");
        let at = bench.to_mm(hit.position);
        assert!((at.length() - RADIUS_MM).abs() < 0.1 * STEP_MM, "{at}");
        assert!(hit.normal.as_dvec3().dot(-at.normalize()) > 0.999, "{:?} at {at}", hit.normal);
    }
    let inside_matter = DVec3::new(14.0, 0.0, 0.0);
    let hit = bench.cast(world_ray(&bench.world_from_mm(), inside_matter, DVec3::ZERO)).expect("matter");
    assert!(hit.distance < 1e-4, "{}", hit.distance);
}

#[test]
fn the_end_of_the_grid_has_a_face() {
    let mut bench = Bench::new(&Grid::uneven(), &places()[1], |_| 1.0, opaque_from(0.5));
    let (from, to) = (DVec3::new(3.0, 1.0, 60.0), DVec3::new(1.0, 2.0, 0.0));
    let ray = world_ray(&bench.world_from_mm(), from, to);
    let hit = bench.cast(ray).expect("a solid block");
    let normal = (bench.world_from_mm().matrix3 * DVec3::Z).normalize();
    assert!(hit.normal.as_dvec3().dot(normal) > 0.999_99, "{:?}, not {normal}", hit.normal);
    let face_mm = bench.to_mm(hit.position).z;
    assert!((face_mm - Grid::uneven().half_mm().z).abs() < 0.02 * STEP_MM, "{face_mm}");
    assert_eq!(hit.carver, None);
}

#[test]
fn an_isosurface_alone_is_hit_at_its_isovalue() {
    let ball = Ball { radius_mm: RADIUS_MM };
    // The transfer function shows more than the surface.
    let mut bench = Bench::new(&Grid::even(), &[Transform::IDENTITY], |p| ball.value(p), opaque_from(0.3));
    let isovalue = 0.6 * 65_535.0;
    let sweeping = OcclusionSweeping { surface: SweepingSurface::Isosurface(isovalue), ..default() };
    let (from, to) = (DVec3::new(30.0, 2.0, 4.0), DVec3::new(0.0, 1.0, -2.0));
    let ray = world_ray(&bench.world_from_mm(), from, to);
    let radius = |bench: &mut Bench| bench.cast(ray).map(|hit| bench.to_mm(hit.position).length());
    let shown = radius(&mut bench).expect("a hit");
    assert!((shown - ball.radius_of(0.3)).abs() < 0.15 * STEP_MM, "{shown}");
    bench.insert(AmbientOcclusion::by(sweeping));
    let surface = radius(&mut bench).expect("a hit");
    assert!((surface - ball.radius_of(0.6)).abs() < 0.1 * STEP_MM, "{surface}");
    let nowhere = OcclusionSweeping { surface: SweepingSurface::Isosurface(f32::NAN), ..default() };
    bench.insert(AmbientOcclusion::by(nowhere));
    assert_eq!(radius(&mut bench), None);
}

#[test]
fn a_gradient_decides_where_the_function_asks_it() {
    // Gentle edges, half up at -20 mm, and a steep one, half up at 12 mm.
    let value = |p: DVec3| if p.x < 8.0 { 1.0 - (p.x + 12.0).abs() / 16.0 } else { (p.x - 10.0) / 4.0 };
    let at = |function: TransferFunction| {
        let mut bench = Bench::new(&Grid::long(), &[Transform::IDENTITY], value, function);
        let from = DVec3::new(-40.0, 0.3, 0.2);
        let ray = world_ray(&bench.world_from_mm(), from, from + DVec3::X);
        bench.cast(ray).map(|hit| bench.to_mm(hit.position).x)
    };
    let gentle = at(opaque_from(0.5)).expect("the first edge");
    assert!((gentle + 20.0).abs() < 0.15 * STEP_MM, "{gentle}");
    // Gentle edges have 4,096 per mm, the steep one 16,384.
    let factor = |gradient: f32, opacity: f32| GradientPoint { gradient, opacity };
    let gradient_opacity = vec![factor(0.0, 0.0), factor(8000.0, 0.0), factor(12_000.0, 1.0)];
    let steep = at(TransferFunction { gradient_opacity, ..opaque_from(0.5) }).expect("the last edge");
    assert!((steep - 12.0).abs() < 0.15 * STEP_MM, "{steep}");
}

#[test]
fn what_is_not_shown_is_not_hit() {
    let ball = Ball { radius_mm: RADIUS_MM };
    let mut bench = Bench::new(&Grid::even(), &[Transform::IDENTITY], |p| ball.value(p), opaque_from(0.5));
    let ray = world_ray(&bench.world_from_mm(), DVec3::Z * 40.0, DVec3::ZERO);
    let behind = world_ray(&bench.world_from_mm(), DVec3::Z * 40.0, DVec3::Z * 80.0);
    let settings = VolumeRayCastSettings::default;
    assert!(bench.cast(ray).is_some());
    assert_eq!(bench.cast(behind), None);
    let volume = bench.volume;
    assert_eq!(bench.cast_by(ray, &settings().with_filter(&|entity| entity != volume)), None);
    bench.insert(RenderLayers::layer(3));
    assert!(bench.cast(ray).is_some());
    assert!(bench.cast_by(ray, &settings().with_layers(RenderLayers::layer(3))).is_some());
    assert_eq!(bench.cast_by(ray, &settings().with_layers(RenderLayers::default())), None);
    bench.insert(Visibility::Hidden);
    assert_eq!(bench.cast(ray), None);
    assert!(bench.cast_by(ray, &settings().with_hidden()).is_some());
    bench.insert(Visibility::Inherited);
    bench.insert(Transform::from_scale(Vec3::new(1.0, 0.0, 1.0)));
    assert_eq!(bench.cast(ray), None);
    bench.insert(Transform::IDENTITY);
    assert!(bench.cast(ray).is_some());
    // Settings and rays that mean nothing.
    for strange in [f32::NAN, f32::INFINITY, -1.0] {
        let _ = bench.cast_by(ray, &settings().with_stopped_light(strange));
        let _ = bench.cast_by(ray, &settings().with_max_distance(strange));
        let _ = bench.cast(Ray3d::new(Vec3::splat(strange), Dir3::X));
    }
    bench.insert(VolumeShading { step_voxels: f32::NAN, ..default() });
    assert!(bench.cast(ray).is_some());
    // Another file is being read.
    bench.insert(Volume3d::default());
    bench.app.world_mut().entity_mut(volume).remove::<Volume3d>();
    assert_eq!(bench.cast(ray), None);
}

#[test]
fn the_nearest_volume_comes_first() {
    let ball = Ball { radius_mm: RADIUS_MM };
    let mut bench = Bench::new(&Grid::even(), &[Transform::IDENTITY], |p| ball.value(p), opaque_from(0.5));
    let world = bench.app.world_mut();
    let (volume, function) = {
        let of = world.entity(bench.volume);
        (
            of.get::<Volume3d>().expect("a volume").clone(),
            of.get::<VolumeTransferFunction>().expect("one").clone(),
        )
    };
    let other = world.spawn((volume, function, Transform::from_xyz(0.0, 0.0, 0.1))).id();
    let ray = world_ray(&bench.world_from_mm(), DVec3::Z * 200.0, DVec3::ZERO);
    let hits = bench.cast_all(ray);
    assert_eq!(hits.iter().map(|hit| hit.volume).collect::<Vec<_>>(), [other, bench.volume]);
    assert!((hits[1].distance - hits[0].distance - 0.1).abs() < 1e-4);
    assert_eq!(bench.cast(ray), Some(hits[0]));
}
