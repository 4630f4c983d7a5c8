//! View rays meet runs of samples, which are stored: rays with more runs than there is room for, and many views.

use bevy::{camera::Viewport, math::DVec3, prelude::*};
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::mode::ShadingMode;

use crate::{
    exact::assert_exact,
    integral::Integral,
    scene::{IMAGE, translucent_ramp, volume_from},
    views::{check, scene_of},
};

/// Bytes of a run.
pub const RUN_BYTES: u64 = 16;
/// Slabs across z.
const SLABS: u32 = 11;

/// Translucent slabs with gaps between them, so that a ray has a run in each.
pub fn slabs(count: u32) -> Volume {
    let size = UVec3::new(18, 17, 4 * count);
    volume_from(size, DVec3::ONE, |p| {
        let z = ((p.z + 1.0) / 2.0 * f64::from(size.z)) as u32;
        if z % 4 == 2 { 0.5 } else { 0.0 }
    })
}

#[test]
fn rays_that_find_no_room_for_their_runs_are_drawn_and_exact() {
    let mut scene = scene_of(slabs(SLABS), translucent_ramp(), ShadingMode::Solid);
    scene.settle();
    check("slabs", &mut scene, &Integral::of(&slabs(SLABS), &translucent_ramp()));
    let image = scene.headless.image();
    let shown = image.chunks(4).filter(|pixel| pixel[..3] != image[..3]).count() as u64;
    let room = scene.status().usage.view_bytes / RUN_BYTES;
    assert!(room < shown * u64::from(SLABS) / 2, "there is room for {room} runs, in {shown} pixels");
    scene.carve(Sphere::new(7.0), ClipMesh::default(), Transform::from_xyz(3.0, 2.0, 8.0));
    scene.set_mode(ShadingMode::Cao);
    assert_exact(&mut scene, "slabs");
}

#[test]
fn more_views_than_one_dispatch_has_are_alike() {
    const TILES: UVec2 = UVec2::new(5, 4);
    let mut scene = scene_of(slabs(SLABS), translucent_ramp(), ShadingMode::Cao);
    let first = scene.camera();
    let size = IMAGE / TILES;
    let pose = *scene.world().get::<Transform>(first).expect("a camera");
    let projection = scene.world().get::<Projection>(first).expect("a camera").clone();
    for tile in 0..TILES.element_product() {
        let position = UVec2::new(tile % TILES.x, tile / TILES.x) * size;
        let viewport = Some(Viewport { physical_position: position, physical_size: size, ..default() });
        let clear_color = if tile == 0 { ClearColorConfig::Default } else { ClearColorConfig::None };
        let camera = Camera { viewport, order: tile as isize, clear_color, ..default() };
        if tile == 0 {
            scene.world().entity_mut(first).insert(camera);
        } else {
            let target = scene.headless.camera();
            scene.world().spawn((target, projection.clone(), pose)).insert(camera);
        }
    }
    let carver = scene.carve(Sphere::new(7.0), ClipMesh::default(), Transform::from_xyz(3.0, 2.0, 8.0));
    scene.settle();
    // A part of each view is marched anew.
    scene.move_carver(carver, Transform::from_xyz(1.0, 3.0, 9.0));
    scene.headless.frame();
    let image = scene.headless.image();
    let pixel = |place: UVec2| &image[4 * (place.y * IMAGE.x + place.x) as usize..][..3];
    let mut shown = 0;
    for index in 0..size.element_product() {
        let place = UVec2::new(index % size.x, index / size.x);
        let expected = pixel(place);
        shown += u32::from(expected != pixel(UVec2::ZERO));
        for tile in 1..TILES.element_product() {
            let there = place + UVec2::new(tile % TILES.x, tile / TILES.x) * size;
            let differs = pixel(there).iter().zip(expected).any(|(a, b)| a.abs_diff(*b) > 1);
            assert!(!differs, "tile {tile}, {place}: {:?} for {expected:?}", pixel(there));
        }
    }
    assert!(shown > size.element_product() / 8, "{shown} pixels show the volume");
}
