//! Contextual ambient occlusion equals local ambient occlusion, bit for bit, wherever a renderer can read it. The
//! images are equal too.

use bevy::{math::DVec3, mesh::CylinderMeshBuilder, prelude::*};
use bevy_contextual_ao::{prelude::*, volume::VolumeGeometry};
use contextual_ao_kit::mode::ShadingMode;

use crate::headless::{different_pixels, voxel_at};
use crate::scene::{
    TestScene, count_different, few_rays, folded_volume, opaque_ramp, solid_volume, translucent_ramp,
};
use contextual_ao_kit::shapes::Triangles;

fn scene(spacing: DVec3, function: TransferFunction) -> TestScene {
    let volume = folded_volume(UVec3::new(34, 29, 26), spacing);
    TestScene::new(volume, function, few_rays(), ShadingMode::Cao)
}

fn torus() -> Mesh {
    Torus { minor_radius: 3.5, major_radius: 9.0 }.mesh().into()
}

/// Compares the image with that of a full recomputation. Returns the occlusion of both.
pub fn assert_images_are_exact(scene: &mut TestScene, name: &str) -> [Vec<Option<u8>>; 2] {
    scene.settle();
    let (cao, image) = (scene.occlusion(), scene.headless.image());
    scene.set_mode(ShadingMode::Lao);
    scene.headless.frame();
    let (lao, reference) = (scene.occlusion(), scene.headless.image());
    scene.set_mode(ShadingMode::Cao);
    assert_eq!(different_pixels(&image, &reference), 0, "{name}: pixels that differ");
    let lit = image.chunks(4).filter(|pixel| pixel[..3] != image[..3]).count();
    assert!(lit > image.len() / 4 / 40, "{name}: the image shows next to nothing ({lit} pixels)");
    [cao, lao]
}

/// Compares the scene with a full recomputation. Returns the share of unhidden voxels whose occlusion was computed.
pub fn assert_exact(scene: &mut TestScene, name: &str) -> f64 {
    let [cao, lao] = assert_images_are_exact(scene, name);
    let hidden = scene.hidden();
    assert_eq!(count_different(&cao, &lao), 0, "{name}: voxels that differ, of {}", cao.len());
    let known = cao.iter().flatten().count();
    let shown = hidden.iter().filter(|&&hidden| !hidden).count();
    known as f64 / shown as f64
}

#[test]
fn every_shape_is_exact() {
    let mut scene = scene(DVec3::ONE, opaque_ramp());
    let at = Transform::from_xyz(5.0, 6.0, 7.0);
    let tilted = at.with_rotation(Quat::from_euler(EulerRot::XYZ, 0.5, -0.8, 1.1));
    let shapes: [(&str, Mesh, Transform); 6] = [
        ("sphere", Sphere::new(8.0).into(), at),
        ("box", Cuboid::new(12.0, 9.0, 14.0).into(), at),
        ("torus", torus(), at),
        ("cylinder", CylinderMeshBuilder::new(6.0, 15.0, 32).into(), at),
        ("tilted box", Cuboid::new(12.0, 9.0, 14.0).into(), tilted),
        ("tilted torus", torus(), tilted),
    ];
    for (name, mesh, transform) in shapes {
        let carver = scene.carve(mesh, ClipMesh::default(), transform);
        let recast = assert_exact(&mut scene, name);
        // The occlusion is contextual: only a part was recomputed.
        assert!(recast < 0.9, "{name}: {recast}");
        scene.world().despawn(carver);
    }
}

#[test]
fn every_pose_is_exact() {
    let mut scene = scene(DVec3::new(0.8, 1.0, 1.6), translucent_ramp());
    let carver = scene.carve(Cuboid::new(10.0, 8.0, 12.0), ClipMesh::default(), Transform::default());
    let rotation = Quat::from_euler(EulerRot::XYZ, 0.4, 0.9, -0.3);
    let poses = [
        ("moved", Transform::from_xyz(4.0, -5.0, 6.0)),
        ("rotated", Transform::from_xyz(4.0, 5.0, -6.0).with_rotation(rotation)),
        ("scaled", Transform::from_xyz(4.0, 5.0, 6.0).with_scale(Vec3::new(0.5, 2.0, 0.9))),
        (
            "mirrored",
            Transform::from_xyz(4.0, 5.0, 6.0).with_scale(Vec3::new(-1.0, 1.2, 1.0)).with_rotation(rotation),
        ),
    ];
    for (name, pose) in poses {
        scene.move_carver(carver, pose);
        assert_exact(&mut scene, name);
    }
}

#[test]
fn several_carvers_and_probing_are_exact() {
    let mut scene = scene(DVec3::ONE, opaque_ramp());
    scene.carve(Sphere::new(8.0), ClipMesh::default(), Transform::from_xyz(5.0, 4.0, 6.0));
    scene.carve(Cuboid::new(9.0, 9.0, 9.0), ClipMesh::default(), Transform::from_xyz(9.0, 6.0, 2.0));
    assert_exact(&mut scene, "two overlapping");
    scene.carve(
        Sphere::new(14.0),
        ClipMesh::intersect(),
        Transform::from_xyz(1.0, 0.0, 1.0).with_scale(Vec3::new(1.0, 0.8, 1.1)),
    );
    assert_exact(&mut scene, "two in a probe");
}

#[test]
fn carvers_of_several_layers_are_exact() {
    let mut scene = scene(DVec3::new(1.0, 1.3, 0.8), translucent_ramp());
    let bowl = || Triangles::bowl(11.0, 7.0, 48).rotated(Quat::from_rotation_x(1.1)).mesh();
    let at = Transform::from_xyz(3.0, 2.0, 4.0).with_rotation(Quat::from_rotation_y(0.6));
    for (name, clip_mesh) in [("subtracts", ClipMesh::default()), ("keeps", ClipMesh::intersect())] {
        let carver = scene.carve(bowl(), clip_mesh, at);
        assert_exact(&mut scene, name);
        assert!(scene.status().clip_layers > 1, "the bowl has one layer");
        scene.world().despawn(carver);
    }
}

#[test]
fn every_coverage_rule_is_exact() {
    for rule in [CoverageRule::Points, CoverageRule::Center] {
        for function in [opaque_ramp(), translucent_ramp()] {
            let mut scene = scene(DVec3::new(0.8, 1.0, 1.6), function);
            scene.set_clip(|clip| clip.coverage = rule);
            let at = Transform::from_xyz(4.3, 5.1, 6.7);
            let sphere = scene.carve(Sphere::new(8.0), ClipMesh::default(), at);
            let tilted = at.with_rotation(Quat::from_euler(EulerRot::XYZ, 0.5, -0.8, 1.1));
            scene.carve(torus(), ClipMesh::default(), tilted);
            assert_exact(&mut scene, &format!("two carvers, {rule:?}"));
            scene.carve(Cuboid::new(26.0, 21.0, 30.0), ClipMesh::intersect(), tilted);
            assert_exact(&mut scene, &format!("two in a probe, {rule:?}"));
            // Voxels that the carver leaves are cast anew.
            scene.move_carver(sphere, at.with_translation(Vec3::new(2.9, 6.2, 4.4)));
            scene.headless.frame();
            assert_exact(&mut scene, &format!("moved, {rule:?}"));
        }
    }
}

#[test]
fn no_drawn_point_reads_a_hidden_voxel() {
    let volume = solid_volume(UVec3::new(34, 29, 26));
    let geometry = VolumeGeometry::of(&volume);
    let mut scene = TestScene::new(volume, opaque_ramp(), few_rays(), ShadingMode::Cao);
    let center = Vec3::new(3.0, 2.0, 4.0);
    let (ring, tube) = (9.0, 3.5);
    scene.carve(torus(), ClipMesh::default(), Transform::from_translation(center));
    scene.settle();
    let hidden = scene.hidden();
    let mut clipped = 0;
    for (index, _) in hidden.iter().enumerate().filter(|(_, hidden)| **hidden) {
        clipped += 1;
        let voxel = voxel_at(index as u32, geometry.dimensions);
        // Points that read this voxel with non-zero weight are less than one voxel away.
        for k in 0..512u32 {
            let offset = UVec3::new(k % 8, k / 8 % 8, k / 64).as_dvec3() / 3.5 - 1.0;
            let p = geometry.local_from_voxel.transform_point3(voxel.as_dvec3() + offset * 0.999).as_vec3()
                - center;
            let distance = Vec2::new(Vec2::new(p.x, p.z).length() - ring, p.y).length() - tube;
            // The mesh is a polyhedron of 32 x 24 sides inside the torus. The depth maps have texels of 25/256 mm. A
            // point this far outside is therefore not clipped.
            assert!(distance < 0.2, "voxel {voxel} is taken for hidden, but {p} is {distance} mm outside");
        }
    }
    assert!(clipped > 100, "{clipped}");
}
