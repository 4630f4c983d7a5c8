//! Rays hit cuts where the carver's mesh is.

use bevy::{
    math::DVec3,
    mesh::{
        VertexAttributeValues,
        skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    },
    prelude::*,
};
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::random::Random;

use super::{
    RADIUS_MM,
    bodies::{self, Ball, Bench, Grid, Parts, STEP_MM, opaque_from, world_ray},
    places,
};

#[test]
fn cuts_are_hit_as_the_carver_is() {
    let mut random = Random(8);
    let ball = Ball { radius_mm: RADIUS_MM };
    let [mut most_mm, mut most_degrees] = [0.0f64; 2];
    let (mut cuts, mut surfaces, mut misses) = (0, 0, 0);
    for place in places() {
        for operation in [ClipMesh::default(), ClipMesh::intersect()] {
            let keeps = operation.operation == ClipOperation::Intersect;
            let mut bench = Bench::new(&Grid::uneven(), &place, |p| ball.value(p), opaque_from(0.5));
            let pose = Transform::from_xyz(5.0, 4.0, 3.0).with_rotation(Quat::from_euler(
                EulerRot::XYZ,
                0.5,
                -0.8,
                1.1,
            ));
            let half = DVec3::new(6.0, 9.0, 7.0);
            let carver = bench.carve(Cuboid::from_size(2.0 * half.as_vec3()).into(), operation, pose);
            for _ in 0..60 {
                let (from, to) = (random.point().as_dvec3(), random.point().as_dvec3());
                let (from, to) = (from.normalize() * 45.0, to * RADIUS_MM);
                let ray = world_ray(&bench.world_from_mm(), from, to);
                let matter = ball.enter(from, to);
                let cut = bodies::through_cuboid(pose, half, from, to);
                let Some(expected) = Parts { matter, cut: cut.map(|(range, _)| range), keeps }.first(0.5)
                else {
                    continue;
                };
                let found = bench.cast(ray);
                let Some((distance, is_cut)) = expected else {
                    assert_eq!(found, None);
                    misses += 1;
                    continue;
                };
                let hit = found.expect("something is left");
                let on_ray = from + (to - from).normalize() * distance;
                let at = bench.to_mm(hit.position);
                assert_eq!(hit.carver, is_cut.then_some(carver), "{on_ray}");
                if is_cut {
                    most_mm = most_mm.max((at - on_ray).length());
                    let (_, [enters, leaves]) = cut.expect("a cut");
                    let normal = if keeps { enters } else { leaves };
                    most_degrees = most_degrees.max(bench.degrees_between(hit.normal, normal, ray));
                    cuts += 1;
                } else {
                    assert!((at.length() - RADIUS_MM).abs() < 0.15 * STEP_MM, "{at}, expected {on_ray}");
                    surfaces += 1;
                }
            }
        }
    }
    println!(
        "{cuts} cuts, {surfaces} surfaces, {misses} misses: cuts are at most {most_mm:.4} mm and {most_degrees:.3} degrees off"
    );
    assert!(cuts > 60 && surfaces > 60 && misses > 20, "{cuts} cuts, {surfaces} surfaces, {misses} misses");
    assert!(most_mm < 0.03 * STEP_MM, "off by {most_mm} mm");
    assert!(most_degrees < 0.1, "off by {most_degrees} degrees");
}

#[test]
fn round_and_several_carvers_leave_what_is_left() {
    let mut bench = Bench::new(&Grid::even(), &[Transform::IDENTITY], |_| 1.0, opaque_from(0.5));
    let half = Grid::even().half_mm();
    let top = DVec3::new(0.0, half.y + 20.0, 0.0);
    let depth_mm = |bench: &mut Bench, x: f64| {
        let from = top + DVec3::X * x;
        let hit = bench.cast(world_ray(&bench.world_from_mm(), from, from - DVec3::Y))?;
        Some((half.y - bench.to_mm(hit.position).y, hit))
    };
    let near = |a: f64, b: f64| (a - b).abs() < 0.1 * STEP_MM;
    assert!(depth_mm(&mut bench, 1.3).is_some_and(|(depth, _)| near(depth, 0.0)));
    // A fine ball, half in the block.
    let sphere = Sphere::new(8.0).mesh().ico(60).expect("a fine ball");
    let pose = Transform::from_translation((half.y * DVec3::Y).as_vec3());
    let ball = bench.carve(sphere, ClipMesh::default(), pose);
    let (depth, hit) = depth_mm(&mut bench, 1.3).expect("the bottom of the hollow");
    let expected = (64.0f64 - 1.3 * 1.3).sqrt();
    assert!(near(depth, expected), "{depth} mm, expected {expected}");
    let outward = DVec3::new(1.3, -expected, 0.0).normalize();
    assert!(hit.normal.as_dvec3().dot(-outward) > 0.999, "{:?}", hit.normal);
    assert_eq!(hit.carver, Some(ball));
    // A shaft through its bottom goes deeper.
    let shaft = bench.carve(Cuboid::new(4.0, 24.0, 4.0).into(), ClipMesh::default(), pose);
    assert!(
        depth_mm(&mut bench, 1.3).is_some_and(|(depth, hit)| near(depth, 12.0) && hit.carver == Some(shaft))
    );
    assert!(depth_mm(&mut bench, 2.5).is_some_and(|(_, hit)| hit.carver == Some(ball)));
    // Carvers that do not act here.
    for clip in [
        ClipMesh { is_active: false, ..default() },
        ClipMesh { targets: ClipTargets::Only(vec![ball]), ..default() },
    ] {
        bench.app.world_mut().entity_mut(shaft).insert(clip);
        assert!(depth_mm(&mut bench, 1.3).is_some_and(|(depth, _)| near(depth, expected)));
    }
    bench
        .app
        .world_mut()
        .entity_mut(shaft)
        .insert(ClipMesh { targets: ClipTargets::Only(vec![bench.volume]), ..ClipMesh::intersect() });
    // All that is left is below the ball and inside the shaft.
    assert!(depth_mm(&mut bench, 1.3).is_some_and(|(depth, _)| near(depth, expected)));
    assert_eq!(depth_mm(&mut bench, 2.5).map(|(depth, _)| depth), None);
    // A new mesh counts once it is there, and a collapsed carver does not.
    bench.app.world_mut().entity_mut(shaft).insert(Transform::from_scale(Vec3::ZERO));
    assert!(depth_mm(&mut bench, 2.5).is_some());
    bench.app.world_mut().entity_mut(ball).despawn();
    assert!(depth_mm(&mut bench, 1.3).is_some_and(|(depth, _)| near(depth, 0.0)));
}

#[test]
fn a_skinned_carver_is_hit_in_its_pose() {
    let mut bench = Bench::new(&Grid::even(), &[Transform::IDENTITY], |_| 1.0, opaque_from(0.5));
    let top = Grid::even().half_mm().y;
    let mesh = Mesh::from(Cuboid::from_length(6.0));
    let corners = mesh.count_vertices();
    let mesh = mesh
        .with_inserted_attribute(
            Mesh::ATTRIBUTE_JOINT_INDEX,
            VertexAttributeValues::Uint16x4(vec![[0; 4]; corners]),
        )
        .with_inserted_attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT, vec![[1.0f32, 0.0, 0.0, 0.0]; corners]);
    let carver = bench.carve(mesh, ClipMesh::default(), Transform::from_xyz(0.0, top as f32, 0.0));
    let world = bench.app.world_mut();
    // The joint shifts the vertices, which are in mm.
    let joint = world.spawn((Transform::from_xyz(0.0, -2.0, 0.0), ChildOf(carver))).id();
    let bindposes = SkinnedMeshInverseBindposes::from(vec![Mat4::IDENTITY]);
    let inverse_bindposes = world.resource_mut::<Assets<SkinnedMeshInverseBindposes>>().add(bindposes);
    world.entity_mut(carver).insert(SkinnedMesh { inverse_bindposes, joints: vec![joint] });
    let from = DVec3::new(0.5, top + 9.0, 0.3);
    let ray = world_ray(&bench.world_from_mm(), from, from - DVec3::Y);
    for depth in [5.0, 1.0] {
        bench.app.world_mut().entity_mut(joint).insert(Transform::from_xyz(0.0, 3.0 - depth as f32, 0.0));
        bench.app.update();
        let hit = bench.cast(ray).expect("the bottom");
        let found = top - bench.to_mm(hit.position).y;
        assert!((found - depth).abs() < 0.03 * STEP_MM, "{found} mm, expected {depth}");
        assert_eq!(hit.carver, Some(carver));
    }
}
