//! Rays against pictures: a pixel shows the volume where its ray is stopped.

use bevy::{camera::Hdr, math::DVec3, prelude::*};
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::{mode::ShadingMode, shapes::Triangles};

use super::bodies::hit_by;
use crate::{
    scene::{IMAGE, TestScene, opaque_ramp, translucent_ramp},
    views::{self, BACKGROUND},
};

/// Opacities this close to a half are too close to call: a ray and a picture sample different places of a step, and what is
/// drawn is rounded.
const CLOSE: f64 = 0.02;

/// A volume of one colour, carved by a box, in a view of half floats.
fn scene(function: TransferFunction, reconstruction: Reconstruction) -> (TestScene, Entity) {
    let mut scene = views::scene_of(views::volume(), function, ShadingMode::Solid);
    let pose =
        Transform::from_xyz(5.0, 4.0, 7.0).with_rotation(Quat::from_euler(EulerRot::XYZ, 0.5, -0.8, 1.1));
    scene.carve_with(&Triangles::cuboid(Vec3::new(10.0, 8.0, 14.0)), pose);
    let entity = scene.volume;
    let mut shading = scene.world().get_mut::<VolumeShading>(entity).expect("shading");
    (shading.step_voxels, shading.reconstruction) = (0.5, reconstruction);
    let camera = scene.camera();
    scene.headless.render_floats(camera, IMAGE);
    (scene, camera)
}

/// Opacity of every pixel, of a volume of one colour in front of another colour.
fn opacities(scene: &TestScene, color: DVec3, behind: DVec3) -> Vec<f64> {
    let way = color - behind;
    let share = |light: &[f64; 3]| (DVec3::from_array(*light) - behind).dot(way) / way.length_squared();
    scene.headless.light().iter().map(share).collect()
}

/// The colour of a transfer function that has one.
fn color_of(function: &TransferFunction) -> DVec3 {
    let [r, g, b] = function.points[0].color;
    LinearRgba::from(Srgba::rgb(r, g, b)).to_vec3().as_dvec3()
}

/// The ray of every pixel.
fn rays(scene: &mut TestScene, camera: Entity) -> Vec<Ray3d> {
    let camera = scene.world().entity(camera);
    let (camera, place) = camera.components::<(&Camera, &GlobalTransform)>();
    let pixels = (0..IMAGE.element_product()).map(|k| UVec2::new(k % IMAGE.x, k / IMAGE.x).as_vec2() + 0.5);
    pixels.map(|pixel| camera.viewport_to_world(place, pixel).expect("a ray")).collect()
}

/// Compares pixels' opacities with hits, and returns the numbers of hits, of misses and of faults.
fn compare(opacities: &[f64], is_hit: impl Fn(usize) -> bool) -> [usize; 3] {
    let mut counts = [0; 3];
    for (pixel, opacity) in opacities.iter().enumerate() {
        if (opacity - 0.5).abs() < CLOSE {
            continue;
        }
        let is_hit = is_hit(pixel);
        counts[if is_hit { 0 } else { 1 }] += 1;
        counts[2] += usize::from(is_hit != (*opacity > 0.5));
    }
    counts
}

#[test]
fn pixels_that_show_the_volume_are_hit() {
    for (name, function, reconstruction) in [
        ("opaque", opaque_ramp(), Reconstruction::Trilinear),
        ("translucent", translucent_ramp(), Reconstruction::Trilinear),
        ("tricubic", translucent_ramp(), Reconstruction::Tricubic),
    ] {
        let (mut scene, camera) = scene(function.clone(), reconstruction);
        scene.settle();
        let shown = opacities(&scene, color_of(&function), BACKGROUND);
        let rays = rays(&mut scene, camera);
        let hits: Vec<_> = rays.iter().map(|ray| hit_by(scene.world(), *ray, &default())).collect();
        let [hit, missed, faults] = compare(&shown, |pixel| hits[pixel].is_some());
        let on_cut = hits.iter().flatten().filter(|hit| hit.carver.is_some()).count();
        println!("{name}: {hit} pixels are hit, {on_cut} of them on cuts, {missed} are not, {faults} differ");
        // In translucent matter half of the light goes on far behind a cut.
        let is_cut_seen = on_cut > 100 || name != "opaque";
        assert!(hit > 1000 && missed > 1000 && is_cut_seen, "{name}: {hit}, {missed}, {on_cut}");
        // At the outline of a cut, a texel of its depth map decides.
        assert!(faults * 400 <= hit, "{name}: {faults} pixels differ");
    }
}

#[test]
fn hits_are_as_deep_as_the_picture_shows() {
    let function = translucent_ramp();
    let (mut scene, camera) = scene(function.clone(), Reconstruction::Trilinear);
    let world = scene.world();
    let material = StandardMaterial { base_color: Color::BLACK, unlit: true, ..default() };
    let material = world.resource_mut::<Assets<StandardMaterial>>().add(material);
    let plane = world.resource_mut::<Assets<Mesh>>().add(Rectangle::new(1.0, 1.0));
    let view = *world.get::<Transform>(camera).expect("a place");
    let plane = world.spawn((Mesh3d(plane), MeshMaterial3d(material), view)).id();
    assert!(scene.world().get::<Hdr>(camera).is_some());
    scene.settle();
    let rays = rays(&mut scene, camera);
    let hits: Vec<_> = rays.iter().map(|ray| hit_by(scene.world(), *ray, &default())).collect();
    let middle = view.translation.length();
    let (mut hit, mut missed, mut faults) = (0, 0, 0);
    // A black wall goes through the volume, from front to back.
    for step in -9..10 {
        let depth = middle + 0.001 * step as f32;
        let place = view.translation + view.forward() * depth;
        scene.world().entity_mut(plane).insert(view.with_translation(place));
        scene.headless.frames(2);
        let shown = opacities(&scene, color_of(&function), DVec3::ZERO);
        let is_before_wall = |pixel: usize| {
            hits[pixel]
                .is_some_and(|hit: VolumeHit| (hit.position - view.translation).dot(*view.forward()) < depth)
        };
        let [before, behind, different] = compare(&shown, is_before_wall);
        (hit, missed, faults) = (hit + before, missed + behind, faults + different);
    }
    println!("{hit} pixels are hit before the wall, {missed} are not, {faults} differ");
    assert!(hit > 5000 && missed > 5000, "{hit} and {missed}");
    assert!(faults * 400 <= hit, "{faults} pixels differ");
}
