//! Gizmos lie where the geometry says, are those that are asked for, and cost nothing while there are none.

use bevy::{
    color::palettes::basic::{LIME, RED},
    gizmos::{GizmoAsset, GizmoHandles},
    math::DVec3,
    platform::collections::HashSet,
    prelude::*,
};
use bevy_contextual_ao::{prelude::*, render::VoxelMask, volume::VolumeGeometry};
use contextual_ao_kit::{headless::voxel_at, mode::ShadingMode};
use core::any::TypeId;

use crate::scene::{TestScene, few_rays, folded_volume, in_world_units, opaque_ramp};

const SIZE: UVec3 = UVec3::new(26, 24, 22);
/// Half the extents of the volume, mm: patients stand upright.
const HALF_MM: Vec3 = Vec3::new(13.0, 11.0, 12.0);
const LINES_OF_BOX: usize = 12;
/// The clip camera leaves a 512th of the extent free at either side, twice.
const CLIP_MARGIN: f32 = 1.0 + 2.0 / 512.0;

/// No gizmos but those that tests ask for.
const NONE: VolumeGizmoConfigGroup = VolumeGizmoConfigGroup {
    draw_all: true,
    volume_boxes: None,
    clip_cameras: None,
    reaches: None,
    listed_bricks: None,
    most_bricks: 100_000,
};
const SOME: Option<Color> = Some(Color::Srgba(LIME));

fn scene() -> TestScene {
    let volume = folded_volume(SIZE, DVec3::ONE);
    TestScene::new(volume, opaque_ramp(), few_rays(), ShadingMode::Cao)
}

fn set(scene: &mut TestScene, group: VolumeGizmoConfigGroup) {
    *scene.world().resource_mut::<GizmoConfigStore>().config_mut::<VolumeGizmoConfigGroup>().1 = group;
}

/// Ends and colours of the lines that the last frame drew.
fn lines(scene: &TestScene) -> Vec<([Vec3; 2], LinearRgba)> {
    let world = scene.headless.app.world();
    let handles = world.resource::<GizmoHandles>().handles();
    let Some(Some(handle)) = handles.get(&TypeId::of::<VolumeGizmoConfigGroup>()) else {
        return Vec::new();
    };
    let buffer = world.resource::<Assets<GizmoAsset>>().get(handle).expect("the gizmos").buffer();
    let pairs = |positions: &[Vec3], colors: &[LinearRgba], step: usize| -> Vec<_> {
        let pairs = positions.windows(2).zip(colors).step_by(step);
        pairs.map(|(ends, color)| ([ends[0], ends[1]], *color)).collect()
    };
    let list = pairs(&buffer.list_positions, &buffer.list_colors, 2);
    // Strips end with what is no number.
    let strips = pairs(&buffer.strip_positions, &buffer.strip_colors, 1);
    let drawn = |([a, b], _): &([Vec3; 2], LinearRgba)| !a.is_nan() && !b.is_nan();
    list.into_iter().chain(strips).filter(drawn).collect()
}

/// Corners of a box around the origin, in the world.
fn corners(half: Vec3, world_from_box: GlobalTransform) -> [Vec3; 8] {
    core::array::from_fn(|k| {
        let sign = Vec3::from_array([0, 1, 2].map(|axis| if k >> axis & 1 == 1 { 1.0 } else { -1.0 }));
        world_from_box.transform_point(sign * half)
    })
}

/// Pairs of corners that an edge joins.
fn edges(corners: &[Vec3; 8]) -> Vec<[Vec3; 2]> {
    let pairs = (0..8usize).flat_map(|a| (0..3).map(move |axis| (a, a | 1 << axis)));
    pairs.filter(|(a, b)| a != b).map(|(a, b)| [corners[a], corners[b]]).collect()
}

/// Asserts that lines are the edges of a box, within a distance.
fn assert_is_box(lines: &[[Vec3; 2]], corners: &[Vec3; 8], within: f32) {
    assert_eq!(lines.len(), LINES_OF_BOX);
    for [a, b] in edges(corners) {
        let is_it = |[c, d]: &[Vec3; 2]| {
            let off = |p: Vec3, q: Vec3| a.distance(p).max(b.distance(q));
            off(*c, *d).min(off(*d, *c)) <= within
        };
        assert!(lines.iter().any(is_it), "no line from {a} to {b} in {lines:?}");
    }
}

fn ends(lines: Vec<([Vec3; 2], LinearRgba)>) -> Vec<[Vec3; 2]> {
    lines.into_iter().map(|(ends, _)| ends).collect()
}

fn pose() -> Transform {
    Transform::from_xyz(0.004, -0.003, 0.002)
        .with_rotation(Quat::from_euler(EulerRot::XYZ, 0.3, -0.5, 0.2))
        .with_scale(Vec3::new(1.2, 0.9, 1.1))
}

#[test]
fn the_box_of_a_volume_is_drawn_around_its_voxels() {
    let mut scene = scene();
    scene.place_volume(pose());
    scene.settle();
    set(&mut scene, VolumeGizmoConfigGroup { volume_boxes: SOME, ..NONE });
    scene.headless.frame();
    let expected = corners(HALF_MM * 0.001, pose().into());
    // Rounding of single precision.
    assert_is_box(&ends(lines(&scene)), &expected, 1e-7);
}

#[test]
fn a_clip_camera_is_drawn_around_its_mesh_with_its_line_of_sight() {
    let mut scene = scene();
    let place = Transform { scale: Vec3::new(1.0, 1.4, 0.8), ..Transform::from_xyz(4.0, 3.0, 4.0) };
    let place = place.with_rotation(Quat::from_rotation_y(0.7));
    let half = Vec3::new(5.0, 4.0, 3.0);
    scene.carve(Cuboid::from_size(2.0 * half), ClipMesh::default(), place);
    scene.settle();
    set(&mut scene, VolumeGizmoConfigGroup { clip_cameras: SOME, ..NONE });
    scene.headless.frame();
    let world = in_world_units(place).into();
    let drawn = ends(lines(&scene));
    // A tip has four lines.
    assert_eq!(drawn.len(), LINES_OF_BOX + 5);
    // The line of sight is along the shortest side, through the middle.
    let on_axis = |p: &Vec3| p.truncate().length() < 1e-4 * half.x;
    let local = GlobalTransform::affine(&world).inverse();
    let (of_arrow, of_box): (Vec<_>, Vec<_>) =
        drawn.into_iter().partition(|ends| ends.iter().any(|end| on_axis(&local.transform_point3(*end))));
    assert_is_box(&of_box, &corners(half * CLIP_MARGIN, world), 1e-6);
    let length = of_arrow.iter().map(|[a, b]| a.distance(*b)).fold(0.0, f32::max);
    let expected = 2.0 * half.z * CLIP_MARGIN * place.scale.z * 0.001;
    assert!((length - expected).abs() < 1e-6, "the line of sight is {length} long, expected {expected}");
}

#[test]
fn the_reach_holds_all_that_a_carver_changes() {
    let mut scene = scene();
    let volume = scene.volume;
    scene.place_volume(Transform::from_scale(Vec3::splat(2.0)));
    let (radius, from, to) = (8.0, Vec3::new(5.0, 0.0, 1.0), Vec3::new(7.0, 1.0, 2.0));
    let carver = scene.carve(Sphere::new(radius), ClipMesh::default(), Transform::from_translation(from));
    scene.settle();
    set(&mut scene, VolumeGizmoConfigGroup { reaches: SOME, ..NONE });
    scene.headless.frame();
    let geometry = VolumeGeometry::of(&folded_volume(SIZE, DVec3::ONE));
    // The reach is a length in the volume, which is twice as large in the world.
    let reach_world = 2e-3 * few_rays().reach_mm(&geometry) as f32;
    let half = Vec3::splat(1e-3 * radius * CLIP_MARGIN + reach_world);
    let box_at = |at: Vec3| corners(half, Transform::from_translation(1e-3 * at).into());
    // The sphere is made of flat triangles.
    let within = 1e-3 * radius * 0.01;
    assert_is_box(&ends(lines(&scene)), &box_at(from), within);
    let before = scene.occlusion();
    scene.move_carver(carver, Transform::from_translation(to));
    scene.headless.frame();
    assert_is_box(&ends(lines(&scene)), &box_at(to), within);
    let (mut changed, mut farthest) = (0, 0.0f32);
    for (k, (before, after)) in before.iter().zip(scene.occlusion()).enumerate() {
        if before.is_some() && after.is_some() && *before != after {
            let voxel = voxel_at(k as u32, SIZE).as_dvec3();
            let p = 2e-3 * geometry.local_from_voxel.transform_point3(voxel).as_vec3();
            let off = |at: Vec3| (p - 1e-3 * at).abs().max_element();
            farthest = farthest.max(off(from).min(off(to)));
            changed += 1;
        }
    }
    assert!(changed > 50 && farthest <= half.x, "{changed} voxels, up to {farthest} of {}", half.x);
    // Changes come near its end: it is not merely large.
    assert!(farthest > 1e-3 * radius + 0.4 * reach_world, "changes end at {farthest}");

    // A carver of other volumes reaches nothing here. One that keeps its inside acts everywhere.
    let elsewhere = scene.world().spawn_empty().id();
    for clip_mesh in
        [ClipMesh::intersect(), ClipMesh { targets: ClipTargets::Only(vec![elsewhere]), ..default() }]
    {
        scene.world().entity_mut(carver).insert(clip_mesh);
        scene.headless.frame();
        assert_eq!(lines(&scene), []);
    }
    scene
        .world()
        .entity_mut(carver)
        .insert(ClipMesh { targets: ClipTargets::Only(vec![volume, elsewhere]), ..default() });
    scene.headless.frame();
    assert_eq!(lines(&scene).len(), LINES_OF_BOX);
}

/// Bricks with voxels for which this holds.
fn bricks(holds: impl Fn(usize) -> bool) -> HashSet<UVec3> {
    let voxels = (0..SIZE.element_product()).filter(|k| holds(*k as usize));
    voxels.map(|k| voxel_at(k, SIZE) / 4).collect()
}

fn listed(scene: &mut TestScene) -> HashSet<UVec3> {
    let volume = scene.volume;
    // The lists arrive some frames late.
    scene.headless.frames(4);
    let listed = scene.world().get::<ListedBricks>(volume).expect("a list");
    assert!(listed.bricks.is_sorted_by_key(|brick| (brick.z, brick.y, brick.x)));
    listed.bricks.iter().copied().collect()
}

#[test]
fn listed_bricks_are_those_whose_voxels_the_latest_cast_cast() {
    let mut scene = scene();
    let volume = scene.volume;
    set(&mut scene, VolumeGizmoConfigGroup { listed_bricks: SOME, ..NONE });
    let carver = scene.carve(Sphere::new(5.0), ClipMesh::default(), Transform::from_xyz(6.0, 4.0, 6.0));
    scene.settle();
    // A change of the settings makes everything stale: what is valid afterwards was cast at once.
    let occlusion = AmbientOcclusion { sky: Sky::above(Vec3::Y), ..few_rays() };
    scene.world().entity_mut(volume).insert(occlusion);
    let all = listed(&mut scene);
    let (valid, hidden) = (scene.headless.mask(volume, VoxelMask::Valid), scene.hidden());
    let known = bricks(|k| valid[k] && !hidden[k]);
    assert!(known.len() > 40, "{} bricks", known.len());
    assert_eq!(all, known);

    // A small move lists the bricks in which occlusion changed, and not all.
    let before = scene.occlusion();
    scene.move_carver(carver, Transform::from_xyz(6.5, 4.0, 6.0));
    let moved = listed(&mut scene);
    let after = scene.occlusion();
    let changed = bricks(|k| after[k].is_some() && before[k] != after[k]);
    assert!(
        !changed.is_empty() && changed.is_subset(&moved),
        "{:?} are not listed",
        changed.difference(&moved)
    );
    assert!(moved.len() < all.len(), "{} of {}", moved.len(), all.len());
    // At rest the list stays.
    assert_eq!(listed(&mut scene), moved);

    // Their boxes are drawn: all, or so many.
    assert_eq!(lines(&scene).len(), LINES_OF_BOX * moved.len());
    let brick = scene.world().get::<ListedBricks>(volume).expect("a list").bricks[0];
    let (first, end) = (4.0 * brick.as_dvec3(), (4.0 * brick.as_dvec3() + 4.0).min(SIZE.as_dvec3()));
    let from_voxel = VolumeGeometry::of(&folded_volume(SIZE, DVec3::ONE)).local_from_voxel;
    let world = |p: DVec3| 1e-3 * from_voxel.transform_point3(p).as_vec3();
    let [a, b] = [world(first - 0.5), world(end - 0.5)];
    let place = Transform::from_translation(0.5 * (a + b)).into();
    set(&mut scene, VolumeGizmoConfigGroup { listed_bricks: SOME, most_bricks: 1, ..NONE });
    scene.headless.frame();
    assert_is_box(&ends(lines(&scene)), &corners(0.5 * (b - a).abs(), place), 1e-7);

    // Other methods list nothing.
    let summed = AmbientOcclusion::by(SummedAreaOcclusion::default());
    scene.world().entity_mut(volume).insert(summed);
    assert!(listed(&mut scene).is_empty());
}

#[test]
fn only_what_is_asked_for_is_drawn_and_nothing_is_read_back_otherwise() {
    let mut scene = scene();
    let volume = scene.volume;
    let carver = scene.carve(Sphere::new(5.0), ClipMesh::default(), Transform::from_xyz(6.0, 4.0, 6.0));
    scene.settle();
    let before = scene.headless.image();
    let has_list = |scene: &mut TestScene| scene.world().get::<ListedBricks>(volume).is_some();
    assert!(lines(&scene).is_empty() && !has_list(&mut scene), "something is drawn by default");

    // One entity, in its own colour.
    scene.world().entity_mut(carver).insert(ShowVolumeGizmos { color: Some(RED.into()) });
    scene.headless.frame();
    let drawn = lines(&scene);
    assert_eq!(drawn.len(), LINES_OF_BOX + 5 + LINES_OF_BOX, "a clip camera and a reach");
    assert!(drawn.iter().all(|(_, color)| *color == LinearRgba::from(RED)));
    assert!(!has_list(&mut scene));
    scene.world().entity_mut(volume).insert(ShowVolumeGizmos::default());
    let shown = listed(&mut scene);
    assert_eq!(lines(&scene).len(), drawn.len() + LINES_OF_BOX * (1 + shown.len()));

    // Switched off as a whole.
    let switch = |scene: &mut TestScene, is_on: bool| {
        let mut store = scene.world().resource_mut::<GizmoConfigStore>();
        store.config_mut::<VolumeGizmoConfigGroup>().0.enabled = is_on;
        scene.headless.frames(2);
    };
    switch(&mut scene, false);
    assert!(lines(&scene).is_empty() && !has_list(&mut scene), "it is not off");
    assert!(scene.headless.image() == before, "the picture is not as before");
    switch(&mut scene, true);
    assert!(!lines(&scene).is_empty() && has_list(&mut scene));
    scene.world().entity_mut(volume).remove::<ShowVolumeGizmos>();
    scene.world().entity_mut(carver).remove::<ShowVolumeGizmos>();
    scene.headless.frames(2);
    assert!(lines(&scene).is_empty() && !has_list(&mut scene), "it is not gone");
}

#[test]
fn what_has_no_volume_and_no_place_has_no_gizmos() {
    let mut scene = scene();
    let volume = scene.volume;
    let carver = scene.carve(Sphere::new(5.0), ClipMesh::default(), Transform::default());
    scene.settle();
    set(&mut scene, VolumeGizmoConfigGroup { draw_all: true, ..default() });
    let flat = Transform::from_scale(Vec3::new(1.0, 0.0, 1.0));
    scene.world().entity_mut(volume).insert(flat);
    scene.world().entity_mut(carver).insert(flat);
    let (unread, meshless) = (Volume3d::default(), ClipMesh::default());
    scene.world().spawn((ShowVolumeGizmos::default(), Transform::default()));
    scene.world().spawn((ShowVolumeGizmos::default(), unread));
    scene.world().spawn((ShowVolumeGizmos::default(), meshless));
    scene.headless.frames(2);
    assert_eq!(lines(&scene), []);
    scene.world().entity_mut(volume).insert((Transform::default(), Visibility::Hidden));
    scene.world().entity_mut(carver).insert((Transform::from_scale(Vec3::splat(0.001)), Visibility::Hidden));
    scene.headless.frames(2);
    assert_eq!(lines(&scene).len(), LINES_OF_BOX + 5, "a carver carves unseen, a hidden volume is not drawn");
    scene.world().despawn(volume);
    scene.world().despawn(carver);
    scene.headless.frames(2);
    assert_eq!(lines(&scene), []);
}
