//! Translucent meshes in volumes.

use bevy::{
    math::{DVec2, DVec3},
    prelude::*,
};

use super::{MIDDLE, check, look_from, scene_of, three};
use crate::{
    integral::{Integral, Pixel, View, merged_pixel, merged_pixel_up_to, srgb_byte},
    scene::{IMAGE, TestScene, in_world_units},
    views::{FAR_SHARE, in_front},
};

/// A pane that faces the camera: its distance from the world's centre towards the camera, mm.
fn pane(scene: &mut TestScene) -> Entity {
    let world = scene.world();
    let mesh = world.resource_mut::<Assets<Mesh>>().add(Rectangle::new(0.2, 0.2));
    let material = StandardMaterial {
        base_color: Color::linear_rgba(PANE[0], PANE[1], PANE[2], PANE[3]),
        alpha_mode: AlphaMode::Blend,
        unlit: true,
        ..default()
    };
    let material = world.resource_mut::<Assets<StandardMaterial>>().add(material);
    world.spawn((Mesh3d(mesh), MeshMaterial3d(material))).id()
}

/// Colour of the pane, and its opacity.
const PANE: [f32; 4] = [0.1, 0.5, 0.9, 0.5];

/// What volumes show with a pane in them, which faces along its z axis; lengths in mm.
fn with_pane(volumes: &[&Integral], view: &View, at: DVec2, pose: Transform) -> Pixel {
    let (point, normal) = (pose.translation.as_dvec3(), (pose.rotation * Vec3::Z).as_dvec3());
    let plane = |origin: DVec3, direction: DVec3| (point - origin).dot(normal) / direction.dot(normal);
    let front = merged_pixel_up_to(&plane, volumes, view, at);
    let whole = merged_pixel(volumes, view, at);
    let opacity = f64::from(PANE[3]);
    let pane = Vec4::from(PANE).truncate().as_dvec3();
    // What is behind the pane, behind what is in front of it.
    let behind = whole.color - front.color;
    Pixel {
        color: front.color + front.transmittance * opacity * pane + (1.0 - opacity) * behind,
        transmittance: (1.0 - opacity) * whole.transmittance,
    }
}

#[test]
fn a_translucent_mesh_divides_volumes_and_goes_on_doing_so_as_it_moves() {
    let placed = three();
    for count in [1, 3] {
        let placed: Vec<_> = placed.iter().take(count).collect();
        let integrals: Vec<_> = placed.iter().map(|placed| placed.integral()).collect();
        let all: Vec<_> = integrals.iter().collect();
        let mut scene = scene_of(&placed);
        look_from(&mut scene, Vec3::Z);
        let pane = pane(&mut scene);
        // Its material is read, and its pipelines are compiled.
        scene.headless.frames(8);
        for pane_mm in [30.0, 7.0, 1.0, -4.0, -30.0] {
            let pose = Transform::from_xyz(0.0, 0.0, pane_mm);
            scene.world().entity_mut(pane).insert(in_world_units(pose).with_scale(Vec3::ONE));
            scene.headless.frame();
            check(&format!("{count} volumes, pane at {pane_mm} mm"), FAR_SHARE, &mut scene, &|view, at| {
                with_pane(&all, view, at, pose)
            });
        }
    }
}

#[test]
fn a_tilted_mesh_is_nearer_to_the_truth_inside_than_before_or_behind() {
    let placed = &three()[0];
    let integral = placed.integral();
    let mut scene = scene_of(&[placed]);
    look_from(&mut scene, Vec3::Z);
    let pane = pane(&mut scene);
    let tilted = Transform::from_rotation(Quat::from_rotation_y(0.5));
    scene.world().entity_mut(pane).insert(tilted);
    scene.headless.frames(8);
    let camera = scene.camera();
    let view = View::of(&mut scene, camera, IMAGE);
    let image = scene.headless.image();
    let [first, size] = MIDDLE;
    let truth = |pose: Transform| {
        let pixels =
            (0..size.element_product()).map(|index| first + UVec2::new(index % size.x, index / size.x));
        let light = |pixel: UVec2| in_front(with_pane(&[&integral], &view, pixel.as_dvec2() + 0.5, pose));
        pixels.flat_map(|pixel| light(pixel).to_array().map(srgb_byte)).collect::<Vec<_>>()
    };
    let drawn = (0..size.element_product()).flat_map(|index| {
        let pixel = first + UVec2::new(index % size.x, index / size.x);
        let place = 4 * (pixel.y * IMAGE.x + pixel.x) as usize;
        [0, 1, 2].map(|channel| f64::from(image[place + channel]))
    });
    let drawn: Vec<_> = drawn.collect();
    let tilted = truth(tilted);
    let off = |other: &[f64]| {
        other.iter().zip(&tilted).map(|(a, b)| (a - b).abs()).sum::<f64>() / tilted.len() as f64
    };
    let [before, behind] = [30.0, -30.0].map(|z| off(&truth(Transform::from_xyz(0.0, 0.0, z))));
    let drawn = off(&drawn);
    println!(
        "a tilted pane: off by {drawn:.2} bytes; drawn before the volume {before:.2}, behind it {behind:.2}"
    );
    assert!(drawn < 0.75 * before.min(behind), "{drawn} {before} {behind}");
}
