//! Outlines in multisampled views: of a volume before its background, and of cuts.

use bevy::{
    camera::Viewport,
    math::{DMat4, DVec2, DVec3},
    prelude::*,
};
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::{headless::Headless, mode::ShadingMode};

use crate::{
    exact::assert_exact,
    integral::{Integral, Pixel, View, srgb_byte},
    scene::{IMAGE, TestScene, folded_volume, in_world_units, opaque_ramp},
    views::{self, in_front, scene_of},
};

const HALF: DVec3 = DVec3::new(9.0, 8.0, 10.0);

fn pose(shift: f32) -> Transform {
    let turn = Quat::from_euler(EulerRot::XYZ, 0.5, -0.8, 1.1);
    Transform::from_xyz(6.0 + shift, 5.0, 8.0).with_rotation(turn)
}

/// A solid volume that a turned box carves, in a view with four samples a pixel.
pub fn carved(volume: &Volume, mode: ShadingMode) -> (TestScene, Entity) {
    let mut scene = scene_of(volume.clone(), opaque_ramp(), mode);
    let camera = scene.camera();
    scene.world().entity_mut(camera).insert(Msaa::Sample4);
    let carver = scene.carve(Cuboid::from_size((2.0 * HALF).as_vec3()), ClipMesh::default(), pose(0.0));
    scene.settle();
    (scene, carver)
}

fn set_rays(scene: &mut TestScene, rays: u32) {
    let volume = scene.volume;
    scene.world().get_mut::<VolumeShading>(volume).expect("shading").outline_rays = rays;
    scene.settle();
    scene.headless.frames(2);
}

pub fn volume() -> Volume {
    folded_volume(UVec3::new(34, 30, 36), DVec3::ONE)
}

/// A pixel at an outline, and its expected bytes.
pub type OutlinePixel = (UVec2, [f64; 3]);

/// Pixels at outlines of the carved volume, moved by `shift_mm`. Each has the mean over 16 places in it.
pub fn outline_of(scene: &mut TestScene, volume: &Volume, shift_mm: DVec3) -> Vec<OutlinePixel> {
    let from_box = pose(0.0).to_matrix().as_dmat4().inverse();
    let is_clipped = |p: DVec3| from_box.transform_point3(p).abs().cmplt(HALF).all();
    let mut integral = Integral { is_clipped: &is_clipped, ..Integral::of(volume, &opaque_ramp()) };
    integral.world_from_local *= DMat4::from_translation(shift_mm);
    let camera = scene.camera();
    let view = View::of(scene, camera, IMAGE);
    let color_at = |place: DVec2| in_front(integral.pixel_at(&view, place));
    let spread = |colors: &[DVec3]| {
        let low = colors.iter().copied().fold(DVec3::MAX, DVec3::min);
        let high = colors.iter().copied().fold(DVec3::MIN, DVec3::max);
        (high - low).max_element()
    };
    let pixels = || (0..IMAGE.element_product()).map(|index| UVec2::new(index % IMAGE.x, index / IMAGE.x));
    let centers: Vec<_> = pixels().map(|pixel| color_at(pixel.as_dvec2() + 0.5)).collect();
    let center = |x: u32, y: u32| centers[(y.min(IMAGE.y - 1) * IMAGE.x + x.min(IMAGE.x - 1)) as usize];
    let may_be_outline = |pixel: &UVec2| {
        let [x, y] = [pixel.x, pixel.y];
        let around = [(x, y), (x + 1, y), (x.saturating_sub(1), y), (x, y + 1), (x, y.saturating_sub(1))];
        spread(&around.map(|(x, y)| center(x, y))) > 0.1
    };
    let places = (0..16).map(|k| (DVec2::new(f64::from(k % 4), f64::from(k / 4)) + 0.5) / 4.0);
    let colors_of = |pixel: UVec2| places.clone().map(|place| color_at(pixel.as_dvec2() + place)).collect();
    let outline: Vec<_> = pixels()
        .filter(may_be_outline)
        .map(|pixel| (pixel, colors_of(pixel)))
        .filter(|(_, colors): &(_, Vec<DVec3>)| spread(colors) > 0.1)
        .map(|(pixel, colors)| (pixel, (colors.iter().sum::<DVec3>() / 16.0).to_array().map(srgb_byte)))
        .collect();
    assert!(outline.len() > 100, "{} pixels at outlines", outline.len());
    outline
}

/// Mean error of pixels at outlines, bytes; of each the largest of its channels.
pub fn error_at(outline: &[OutlinePixel], scene: &TestScene) -> f64 {
    let image = scene.headless.image();
    let errors = outline.iter().map(|(pixel, expected)| {
        let place = 4 * (pixel.y * IMAGE.x + pixel.x) as usize;
        let difference = |channel: usize| (f64::from(image[place + channel]) - expected[channel]).abs();
        (0..3).map(difference).fold(0.0, f64::max)
    });
    errors.sum::<f64>() / outline.len() as f64
}

#[test]
fn outlines_are_means_over_their_pixels() {
    let volume = volume();
    let (mut scene, _) = carved(&volume, ShadingMode::Solid);
    let outline = outline_of(&mut scene, &volume, DVec3::ZERO);
    let errors = [1, 4, 8, 32].map(|rays| {
        set_rays(&mut scene, rays);
        error_at(&outline, &scene)
    });
    println!("{} pixels at outlines, off by {errors:.1?} bytes by 1, 4, 8 and 32 rays", outline.len());
    // The expected colours are means of 16 themselves.
    assert!(errors[1] < 0.5 * errors[0] && errors[2] < 0.35 * errors[0], "off by {errors:?} bytes");
    assert!(errors[3] < 0.2 * errors[0], "off by {errors:?} bytes");
}

#[test]
fn outlines_are_exact() {
    let (mut scene, carver) = carved(&volume(), ShadingMode::Cao);
    let camera = scene.camera();
    for step in 0..3u8 {
        scene.move_carver(carver, pose(f32::from(step)));
        assert_exact(&mut scene, "outlines");
        let turn = Quat::from_rotation_y(0.1);
        scene.world().get_mut::<Transform>(camera).expect("a place").rotate_around(Vec3::ZERO, turn);
    }
    // Two halves of the image, seen by two cameras.
    let size = UVec2::new(IMAGE.x / 2, IMAGE.y);
    let half = |order: u32| {
        let viewport =
            Viewport { physical_position: UVec2::new(order * size.x, 0), physical_size: size, ..default() };
        let clear_color = if order == 0 { default() } else { ClearColorConfig::None };
        Camera { viewport: Some(viewport), order: order as isize, clear_color, ..default() }
    };
    let other = scene.headless.camera();
    let place = in_world_units(Transform::from_xyz(-40.0, 30.0, 60.0)).looking_at(Vec3::ZERO, Vec3::Y);
    scene.world().entity_mut(camera).insert(half(0));
    scene.world().spawn((other, place)).insert((Msaa::Sample4, half(1)));
    assert_exact(&mut scene, "outlines of two views");
}

/// Places of the four samples in a pixel, as Vulkan and Direct3D have them.
const SAMPLES: [DVec2; 4] =
    [DVec2::new(0.375, 0.125), DVec2::new(0.875, 0.375), DVec2::new(0.125, 0.625), DVec2::new(0.625, 0.875)];

#[test]
fn outlines_of_meshes_mix_with_a_volume() {
    let volume = views::volume();
    let mut scene = views::scene(volume.clone());
    let camera = scene.camera();
    scene.world().entity_mut(camera).insert(Msaa::Sample4);
    let opaque = views::add_box(&mut scene);
    let with_mesh = Integral { opaque: &opaque, ..views::carved(&volume) };
    let view = View::of(&mut scene, camera, IMAGE);
    let expected = |pixel: UVec2| {
        let of_sample = |sample: DVec2| {
            let at = pixel.as_dvec2() + sample;
            let behind = if view.meets(at, &opaque) { DVec3::X } else { views::BACKGROUND };
            let Pixel { color, transmittance } = with_mesh.pixel_at(&view, at);
            color + transmittance * behind
        };
        SAMPLES.into_iter().map(of_sample).sum::<DVec3>() / 4.0
    };
    let is_mixed = |pixel: UVec2| {
        let met = SAMPLES.iter().filter(|sample| view.meets(pixel.as_dvec2() + **sample, &opaque)).count();
        met % 4 != 0
    };
    let pixels = || (0..IMAGE.element_product()).map(|index| UVec2::new(index % IMAGE.x, index / IMAGE.x));
    let outline: Vec<_> = pixels().filter(|pixel| is_mixed(*pixel)).collect();
    assert!(outline.len() > 60, "{} pixels of the outline", outline.len());
    let image = scene.headless.image();
    let differences = outline.iter().map(|pixel| {
        let place = 4 * (pixel.y * IMAGE.x + pixel.x) as usize;
        let expected = expected(*pixel).to_array().map(srgb_byte);
        (0..3)
            .map(|channel| (f64::from(image[place + channel]) - expected[channel]).abs())
            .fold(0.0, f64::max)
    });
    let sum: f64 = differences.clone().sum();
    let (mean, most) = (sum / outline.len() as f64, differences.fold(0.0, f64::max));
    println!("{} pixels of the outline, off by {mean:.2} bytes, at most {most:.1}", outline.len());
    // The ray of a pixel's centre stands for all of its samples: 2.2 on average. With one depth for all it is 12, and 82 at
    // most. Where an edge touches a sample, the device's rounding decides a quarter of a pixel.
    assert!(mean < 3.0 && most < 40.0, "off by {mean} bytes, at most {most}");
}

#[test]
fn a_mesh_in_front_hides_outlines() {
    let (mut scene, _) = carved(&volume(), ShadingMode::Solid);
    let before = scene.headless.image();
    let camera = scene.camera();
    let place = *scene.world().get::<Transform>(camera).expect("a place");
    let world = scene.world();
    let mesh = world.resource_mut::<Assets<Mesh>>().add(Rectangle::new(10.0, 10.0));
    let red = StandardMaterial { base_color: Color::linear_rgb(1.0, 0.0, 0.0), unlit: true, ..default() };
    let material = world.resource_mut::<Assets<StandardMaterial>>().add(red);
    // Before the volume, and across the whole view.
    let in_front = place.with_translation(0.8 * place.translation);
    world.spawn((Mesh3d(mesh), MeshMaterial3d(material), in_front));
    let red = |headless: &Headless| headless.image().chunks(4).filter(|pixel| pixel[0] > 200).count();
    // The mesh's shaders are still being read.
    assert!(
        scene.headless.frames_until(|headless| red(headless) > before.len() / 8),
        "the mesh is not drawn"
    );
    scene.headless.frames(2);
    let image = scene.headless.image();
    let others = image.chunks(4).filter(|pixel| *pixel != &image[..4]).count();
    assert_eq!(others, 0, "{others} pixels show something else");
}
