//! Unusual carver meshes: edge-on, thin, flipped, open, doubled, empty, huge, not finite, deforming.

use bevy::{
    asset::RenderAssetUsages,
    math::DVec3,
    mesh::{
        PrimitiveTopology, VertexAttributeValues,
        morph::{MeshMorphWeights, MorphAttributes},
        skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    },
    prelude::*,
};
use bevy_contextual_ao::{diagnostics::SPAN_DEPTH, prelude::*, volume::WORLD_UNITS_PER_MM};
use contextual_ao_kit::mode::ShadingMode;

use crate::{
    exact::assert_exact,
    headless::voxel_at,
    scene::{TestScene, count_different, few_rays, folded_volume, is_empty, opaque_ramp},
};
use contextual_ao_kit::{
    inside::InsideTest,
    shapes::Triangles,
    stability::{
        inside_test::{Judge, concave_meshes},
        motion::SolidScene,
    },
};

const SIZE: UVec3 = UVec3::new(26, 24, 22);
const PLACE: Vec3 = Vec3::new(5.0, 5.0, 5.0);

#[derive(Resource, Default)]
struct Reported {
    failed: Vec<String>,
    cut_off: Vec<(Entity, u32, u32)>,
}

fn scene() -> TestScene {
    TestScene::with(folded_volume(SIZE, DVec3::ONE), opaque_ramp(), few_rays(), ShadingMode::Cao, |app| {
        app.init_resource::<Reported>()
            .add_observer(|event: On<ClipMeshFailed>, mut reported: ResMut<Reported>| {
                reported.failed.push(event.reason.clone());
            })
            .add_observer(|event: On<ClipMeshCutOff>, mut reported: ResMut<Reported>| {
                reported.cut_off.push((event.entity, event.has_layers, event.gets_layers));
            });
    })
}

fn sphere() -> Triangles {
    Triangles::sphere(7.0, 24)
}

/// Occlusion and image after carving with a mesh.
fn carved_with(mesh: Mesh) -> (Vec<Option<u8>>, Vec<u8>) {
    let mut scene = scene();
    scene.carve(mesh, ClipMesh::default(), Transform::from_translation(PLACE));
    scene.settle();
    assert!(scene.world().resource::<Reported>().failed.is_empty());
    (scene.occlusion(), scene.headless.image())
}

fn untouched_image() -> Vec<u8> {
    let mut scene = scene();
    scene.settle();
    scene.headless.image()
}

#[test]
fn faces_edge_on_to_the_clip_camera_are_no_gap() {
    let mut judge = Judge::new(30);
    for (name, mesh) in [
        ("box", Triangles::cuboid(Vec3::new(12.0, 9.0, 7.0))),
        ("plate", Triangles::cuboid(Vec3::new(12.0, 12.0, 2.0))),
    ] {
        let verdict = judge.judge(&mesh, &mesh, |_| {});
        assert_eq!((verdict.far_wrong, verdict.layers), (0, 1), "{name}");
        assert!(verdict.inside > 300, "{name}: {} points inside", verdict.inside);
    }
}

#[test]
fn a_carver_thinner_than_a_voxel_is_exact() {
    for (name, size) in [("plate", Vec3::new(12.0, 0.3, 12.0)), ("needle", Vec3::new(0.3, 0.3, 14.0))] {
        let mut scene = scene();
        scene.settle();
        let hidden = scene.hidden();
        let tilted = Transform::from_translation(PLACE).with_rotation(Quat::from_rotation_x(0.4));
        scene.carve(Triangles::cuboid(size).mesh(), ClipMesh::default(), tilted);
        assert_exact(&mut scene, name);
        // The carver removes only the part that it covers, so no voxel becomes empty.
        scene.settle();
        assert!(scene.hidden() == hidden, "{name}");
        // From opaque voxels, the carver removes as much as its own volume.
        let mut solid = SolidScene::default();
        solid.carve(&Triangles::cuboid(size), tilted, |_| {});
        let taken: f32 =
            solid.scene.opacities().iter().map(|opacity| 1.0 - f32::from(*opacity) / 255.0).sum();
        let share = taken / size.element_product();
        // Coverage is taken over two voxels each way, so eight voxels share each place. Each voxel counts an eighth
        // of it. Lines are a voxel apart. They meet a plate everywhere, but miss a needle that lies between them.
        let least = if name == "plate" { 0.85 } else { 0.0 };
        assert!((least..1.15).contains(&share), "{name}: {share} of it are taken");
    }
}

#[test]
fn winding_doubles_and_empty_triangles_change_nothing() {
    let expected = carved_with(sphere().mesh());
    assert!(expected.1 != untouched_image(), "a sphere carves nothing");
    let mut doubled = sphere();
    doubled.indices.extend_from_within(..);
    let mut degenerate = sphere();
    degenerate.indices.extend((0..50).flat_map(|k| [[k, k, k + 1], [k, k + 1, k]]));
    let soup = sphere().mesh().with_duplicated_vertices();
    for (name, mesh) in [
        ("flipped", sphere().flipped().mesh()),
        ("with every other triangle flipped", sphere().half_flipped().mesh()),
        ("doubled", doubled.mesh()),
        ("with triangles of no area", degenerate.mesh()),
        ("without indices", soup),
    ] {
        assert!(carved_with(mesh) == expected, "a sphere {name} is not the same");
    }
}

#[test]
fn an_open_mesh_carves_where_it_has_two_surfaces() {
    let mut open = sphere();
    let positions = open.positions.clone();
    let is_kept = |triangle: &[u32; 3]| triangle.iter().all(|&corner| positions[corner as usize][0] < 3.0);
    open.indices.retain(is_kept);
    assert!(open.indices.len() < sphere().indices.len());
    let exact = InsideTest::new(&sphere());
    let mut scene = scene();
    scene.set_clip(|clip| clip.coverage = CoverageRule::Center);
    scene.carve(open.mesh(), ClipMesh::default(), Transform::default());
    scene.settle();
    scene.set_mode(ShadingMode::Phong);
    scene.headless.frame();
    let untouched = {
        let mut scene = self::scene();
        scene.settle();
        scene.opacities()
    };
    let (mut carved, mut outside) = (0, 0);
    for (index, (now, before)) in scene.opacities().iter().zip(&untouched).enumerate() {
        if now != before {
            carved += 1;
            let voxel = voxel_at(index as u32, SIZE);
            // The grid's axes point to the right, to the front and up.
            let centered = voxel.as_vec3() - Vec3::new(12.5, 11.5, 10.5);
            let p = Vec3::new(-centered.x, centered.z, centered.y);
            outside += usize::from(!exact.contains(p) && exact.distance(p) > 0.1);
        }
    }
    assert!(carved > 100, "{carved} voxels");
    assert_eq!(outside, 0, "of {carved} carved voxels lie outside the sphere");
}

#[test]
fn meshes_that_cannot_carve_say_why() {
    let empty = |topology| Mesh::new(topology, RenderAssetUsages::default());
    let mesh = |topology, positions: Vec<[f32; 3]>| {
        empty(topology).with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
    };
    let (triangles, points) = (PrimitiveTopology::TriangleList, PrimitiveTopology::PointList);
    let mut not_finite = sphere();
    not_finite.positions[5] = [f32::NAN, 1.0, 2.0];
    let mut scene = scene();
    scene.settle();
    let untouched = (scene.occlusion(), scene.headless.image());
    assert!(!is_empty(&untouched.1));
    for broken in [
        mesh(triangles, vec![]),
        mesh(triangles, vec![[1.0; 3]; 3]),
        mesh(points, vec![[0.0; 3], [1.0; 3], [2.0; 3]]),
        not_finite.mesh(),
        empty(triangles),
    ] {
        scene.carve(broken, ClipMesh::default(), Transform::from_translation(PLACE));
    }
    scene.settle();
    let mut reasons = scene.world().resource::<Reported>().failed.clone();
    reasons.sort();
    assert_eq!(
        reasons,
        [
            "a position is not finite",
            "it has no extent",
            "it has no positions",
            "it has no positions",
            "it is not made of triangles",
        ]
    );
    assert!((scene.occlusion(), scene.headless.image()) == untouched, "they carve");
}

#[test]
fn a_million_triangles_are_carved_exactly() {
    let sphere = Triangles::sphere(9.0, 500);
    assert!(sphere.indices.len() > 990_000, "{}", sphere.indices.len());
    let verdict = Judge::new(24).judge(&sphere, &sphere, |_| {});
    assert_eq!((verdict.far_wrong, verdict.layers), (0, 1));
}

#[test]
fn more_layers_than_allowed_are_filled_with_a_warning() {
    let (_, knot) =
        concave_meshes().into_iter().find(|(name, _)| name == "trefoil tube turned").expect("a trefoil");
    let has = Judge::new(24).judge(&knot, &knot, |_| {}).layers;
    assert!(has > 1);
    let mut scene = scene();
    scene.set_clip(|clip| clip.max_layers = 1);
    let carver = scene.carve_with(&knot, Transform::default());
    scene.settle();
    scene.headless.frame();
    assert_eq!(scene.world().resource::<Reported>().cut_off, [(carver, has, 1)]);
    assert_eq!(scene.status().clip_layers, 1);
    let filled = scene.occlusion();
    assert_exact(&mut scene, "filled");
    scene.set_clip(|clip| clip.max_layers = 8);
    scene.settle();
    scene.headless.frame();
    assert_eq!(scene.status().clip_layers, has);
    assert!(scene.occlusion() != filled, "nothing was filled");
    assert_exact(&mut scene, "peeled");
}

/// A box of two halves with a joint each, and a morph target that widens it.
fn rigged_box() -> Mesh {
    let base = Triangles::cuboid(Vec3::new(6.0, 12.0, 6.0));
    let joints = base.positions.iter().map(|p| if p[1] > 0.0 { [1, 0, 0, 0] } else { [0; 4] });
    let joints = VertexAttributeValues::Uint16x4(joints.collect());
    let weights = vec![[1.0f32, 0.0, 0.0, 0.0]; base.positions.len()];
    let widened = base
        .positions
        .iter()
        .map(|p| MorphAttributes { position: Vec3::new(0.5 * p[0], 0.0, 0.0), ..default() });
    let targets = widened.collect();
    base.mesh()
        .with_inserted_attribute(Mesh::ATTRIBUTE_JOINT_INDEX, joints)
        .with_inserted_attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT, weights)
        .with_morph_targets(targets)
}

/// The box, with its corners moved by `change`.
fn moved_box(change: impl Fn([f32; 3]) -> [f32; 3]) -> Mesh {
    let mut base = Triangles::cuboid(Vec3::new(6.0, 12.0, 6.0));
    base.positions.iter_mut().for_each(|p| *p = change(*p));
    base.mesh()
}

#[test]
fn skinned_and_morphing_meshes_carve_as_they_are_posed() {
    let place =
        Transform::from_translation(PLACE * WORLD_UNITS_PER_MM).with_scale(Vec3::splat(WORLD_UNITS_PER_MM));
    let mut scene = scene();
    let carver = scene.carve(rigged_box(), ClipMesh::default(), Transform::from_translation(PLACE));
    let world = scene.world();
    let joints: Vec<_> = (0..2).map(|_| world.spawn(place).id()).collect();
    // The joints rest where the mesh is.
    let bindposes = SkinnedMeshInverseBindposes::from(vec![Mat4::IDENTITY; 2]);
    let inverse_bindposes = world.resource_mut::<Assets<SkinnedMeshInverseBindposes>>().add(bindposes);
    world.entity_mut(carver).insert((
        SkinnedMesh { inverse_bindposes, joints: joints.clone() },
        MeshMorphWeights::Value { weights: vec![0.0] },
    ));
    scene.settle();
    let rest = (scene.occlusion(), scene.headless.image());
    assert!(rest == carved_with(moved_box(|p| p)), "at rest");

    // The upper half moves up, and is carved in the same frame.
    let mut raised = place;
    raised.translation.y += 4.0 * WORLD_UNITS_PER_MM;
    scene.world().entity_mut(joints[1]).insert(raised);
    scene.headless.frame();
    let expected = carved_with(moved_box(|[x, y, z]| [x, if y > 0.0 { y + 4.0 } else { y }, z]));
    assert!((scene.occlusion(), scene.headless.image()) == expected, "skinned");
    assert!(expected.1 != rest.1, "raised is as at rest");
    let raised = expected;

    // The box widens.
    scene.world().entity_mut(carver).insert(MeshMorphWeights::Value { weights: vec![1.0] });
    scene.headless.frame();
    let expected = carved_with(moved_box(|[x, y, z]| [1.5 * x, if y > 0.0 { y + 4.0 } else { y }, z]));
    assert!((scene.occlusion(), scene.headless.image()) == expected, "morphed");
    assert!(expected.1 != raised.1, "widened is as before");

    // A rig that moves as a whole needs no new depth maps.
    scene.settle();
    scene.headless.frame();
    let drawn = scene.status().passes.jobs(SPAN_DEPTH);
    for entity in [joints[0], joints[1], carver] {
        scene.world().get_mut::<Transform>(entity).expect("a transform").translation.x += 0.002;
    }
    scene.headless.frames(2);
    assert_eq!(scene.status().passes.jobs(SPAN_DEPTH), drawn);

    // Without a rig, the carver is the mesh itself again.
    scene.world().entity_mut(carver).remove::<(SkinnedMesh, MeshMorphWeights)>();
    scene.move_carver(carver, Transform::from_translation(PLACE));
    scene.settle();
    assert_eq!(count_different(&scene.occlusion(), &rest.0), 0, "unrigged");
    assert!(scene.headless.image() == rest.1, "unrigged");
}

#[test]
fn vertices_edited_every_frame_carve_in_that_frame() {
    let mut scene = scene();
    let carver = scene.carve(moved_box(|p| p), ClipMesh::default(), Transform::from_translation(PLACE));
    scene.settle();
    let mut before = scene.headless.image();
    let handle = scene.world().get::<Mesh3d>(carver).expect("a mesh").0.clone();
    for step in 1..4 {
        let longer = 1.0 + 0.2 * step as f32;
        let edited = moved_box(|[x, y, z]| [x, longer * y, z]);
        let Some(VertexAttributeValues::Float32x3(positions)) =
            edited.attribute(Mesh::ATTRIBUTE_POSITION).cloned()
        else {
            panic!("the box has positions")
        };
        let world = scene.world();
        let mut meshes = world.resource_mut::<Assets<Mesh>>();
        meshes.get_mut(&handle).expect("the box").insert_attribute(Mesh::ATTRIBUTE_POSITION, positions);
        scene.headless.frame();
        let now = (scene.occlusion(), scene.headless.image());
        let fresh = carved_with(edited);
        // Which voxels were asked for beside those that are read depends on what is known of the device by then.
        assert_eq!(count_different(&now.0, &fresh.0), 0, "step {step}");
        assert!(now.1 == fresh.1, "step {step}: the image is not the same");
        assert!(now.1 != before, "step {step} shows nothing new");
        before = now.1;
    }
}
