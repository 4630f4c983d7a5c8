//! The drawn image with opaque meshes, from inside, and beside holes. `views` compares the image with the integral.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::{
    prelude::*,
    volume::{WORLD_UNITS_PER_MM, read_volume_file},
};
use contextual_ao_kit::mode::ShadingMode;

use crate::{
    headless::Headless,
    needs::shared_volumes,
    scene::{IMAGE, TestScene, few_rays, folded_volume, opaque_ramp, translucent_ramp, volume_from},
};

fn scene(function: TransferFunction) -> TestScene {
    TestScene::new(folded_volume(UVec3::splat(24), DVec3::ONE), function, few_rays(), ShadingMode::Cao)
}

fn pixels(image: &[u8], matches: impl Fn(&[u8]) -> bool) -> usize {
    image.chunks(4).filter(|pixel| matches(pixel)).count()
}

fn is_red(pixel: &[u8]) -> bool {
    pixel[0] > 200 && pixel[1] < 40 && pixel[2] < 40
}

fn camera(scene: &mut TestScene) -> Entity {
    let world = scene.world();
    world.query_filtered::<Entity, With<Camera3d>>().single(world).expect("one camera")
}

#[test]
fn opaque_meshes_hide_and_are_hidden() {
    let mut scene = scene(opaque_ramp());
    scene.settle();
    let camera = camera(&mut scene);
    let view = scene.world().get::<Transform>(camera).expect("a place").translation;
    let world = scene.world();
    let mesh = world.resource_mut::<Assets<Mesh>>().add(Sphere::new(0.004));
    let material = world.resource_mut::<Assets<StandardMaterial>>().add(StandardMaterial {
        base_color: Color::srgb(1.0, 0.0, 0.0),
        unlit: true,
        ..default()
    });
    let ball =
        world.spawn((Mesh3d(mesh), MeshMaterial3d(material), Transform::from_translation(view * 0.6))).id();
    let is_drawn = |headless: &Headless| pixels(&headless.image(), is_red) > 0;
    assert!(scene.headless.frames_until(is_drawn), "the mesh is not drawn");
    let mut red_at = |place: Vec3| {
        scene.world().entity_mut(ball).insert(Transform::from_translation(place));
        scene.headless.frame();
        scene.headless.frame();
        pixels(&scene.headless.image(), is_red)
    };
    let in_front = red_at(view * 0.6);
    assert!(in_front > 100, "{in_front} red pixels in front of the volume");
    let behind = red_at(-view * 0.6);
    assert!(behind < in_front / 20, "{behind} red pixels through the opaque volume");
    // The mesh is half inside the volume's corner, so it is partly seen.
    let beside = red_at(view * 0.28);
    assert!(beside > 20, "{beside} red pixels where the mesh sticks out");
}

#[test]
fn a_lit_mesh_is_drawn_beside_the_volume() {
    let mut scene = scene(opaque_ramp());
    scene.settle();
    let alone = scene.headless.image();
    let camera = camera(&mut scene);
    let view = *scene.world().get::<Transform>(camera).expect("a place");
    let world = scene.world();
    let mesh = world.resource_mut::<Assets<Mesh>>().add(Sphere::new(0.002));
    // On devices with binding arrays, Bevy puts materials and their textures into such arrays.
    let white = world.resource_mut::<Assets<Image>>().add(Image::default());
    let material = world.resource_mut::<Assets<StandardMaterial>>().add(StandardMaterial {
        base_color: Color::srgb(1.0, 0.0, 0.0),
        base_color_texture: Some(white),
        ..default()
    });
    // The mesh is in a corner of the image.
    let place = Transform::from_translation(view.transform_point(Vec3::new(0.016, 0.016, -0.05)));
    world.spawn((Mesh3d(mesh), MeshMaterial3d(material), place));
    world.spawn((DirectionalLight::default(), view));
    let is_reddish = |pixel: &[u8]| pixel[0] > 60 && pixel[0] / 3 > pixel[1];
    let is_drawn = |headless: &Headless| pixels(&headless.image(), is_reddish) > 20;
    assert!(scene.headless.frames_until(is_drawn), "the mesh is not drawn");
    let image = scene.headless.image();
    // The ball's image is 9 pixels wide. Its centre is 37 pixels to the right of the middle, and as many above it.
    let is_beside = |index: usize| {
        let place = IVec2::new(index as i32 % IMAGE.x as i32, index as i32 / IMAGE.x as i32);
        (place - IVec2::new(85, 11)).length_squared() > 49
    };
    let changed = alone.chunks(4).zip(image.chunks(4)).enumerate().filter(|(_, (before, now))| before != now);
    let beside = changed.filter(|(index, _)| is_beside(*index)).count();
    assert_eq!(beside, 0, "pixels changed beside the mesh");
}

#[test]
fn the_camera_may_be_inside() {
    let hollow = volume_from(UVec3::splat(24), DVec3::ONE, |p| (p.length() - 0.6) * 6.0);
    let mut scene = TestScene::new(hollow, opaque_ramp(), few_rays(), ShadingMode::Cao);
    let camera = camera(&mut scene);
    scene.world().entity_mut(camera).insert(Transform::default().looking_at(Vec3::X, Vec3::Y));
    scene.settle();
    let inside = scene.headless.image();
    // The wall of the hollow is all around.
    let lit = |image: &[u8]| pixels(image, |pixel| pixel[0] > 60) as f64 / (IMAGE.x * IMAGE.y) as f64;
    assert!(lit(&inside) > 0.99, "{} of the pixels see the wall", lit(&inside));
    // A mirrored box shows its faces the other way round.
    let volume = scene.volume;
    scene.world().get_mut::<Transform>(volume).expect("a transform").scale.x *= -1.0;
    scene.headless.frame();
    let mirrored = lit(&scene.headless.image());
    assert!(mirrored > 0.99, "{mirrored} of the pixels see the wall of the mirrored volume");
}

#[test]
fn a_hole_has_no_ghost_and_no_halo() {
    // A box that reaches far beyond the wall cuts it flat. The thinner wall that stays must be shaded like a wall
    // that was never thicker.
    let wall = |thickness: f64| {
        volume_from(UVec3::new(32, 32, 24), DVec3::ONE, move |p| if p.y < thickness { 1.0 } else { 0.0 })
    };
    // Axis 1 of the grid is z, the front of the volume. The cut is midway between two voxels.
    let shade = |volume: Volume, carves: bool| {
        let mut scene = TestScene::new(volume, opaque_ramp(), few_rays(), ShadingMode::Cao);
        if carves {
            scene.carve(
                Cuboid::new(60.0, 60.0, 20.0),
                ClipMesh::default(),
                Transform::from_xyz(0.0, 0.0, 10.0),
            );
        }
        scene.settle();
        scene.occlusion()
    };
    let (cut, thin) = (shade(wall(0.6), true), shade(wall(0.0), false));
    let mut compared = 0;
    for z in 6..18 {
        for x in 8..24 {
            // The voxel is in the outermost layer that stays.
            let index = (z * 32 + 15) * 32 + x;
            let (Some(cut), Some(thin)) = (cut[index], thin[index]) else {
                continue;
            };
            let difference = cut.abs_diff(thin);
            // A voxel's coverage is taken over two voxels. The layers next to the cut are half a voxel away. Their
            // coverages are 3/4 and 1/4, instead of all and nothing. A ghost or a halo is tens of bytes.
            assert!(difference <= 16, "cut {cut} and never there {thin}");
            compared += 1;
        }
    }
    assert!(compared > 12 * 16 / 2, "{compared} of them are seen");
}

#[test]
fn one_head_in_four_axis_orders_looks_the_same() {
    let Some(folder) = shared_volumes() else { return };
    let folder = folder.join("cases/axis_orders");
    let images: Vec<Vec<u8>> = ["RAS", "LPI", "ASR", "SAL"]
        .iter()
        .map(|order| {
            let volume = read_volume_file(&folder.join(format!("{order}.nii.gz"))).expect("a head");
            let mut headless = Headless::new(IMAGE, |_| {});
            let camera = headless.camera();
            let world = headless.app.world_mut();
            let data = world.resource_mut::<Assets<Volume>>().add(volume);
            let mut bundle = VolumeBundle::new(data);
            bundle.shading = VolumeShading { ambient_occlusion: false, jitter: false, ..default() };
            let volume = world.spawn(bundle).id();
            let view = Vec3::new(150.0, 120.0, 500.0) * WORLD_UNITS_PER_MM;
            world.spawn((camera, Transform::from_translation(view).looking_at(Vec3::ZERO, Vec3::Y)));
            headless.until_ready(volume).expect("it can be shown");
            headless.image()
        })
        .collect();
    let background = images[0][..4].to_vec();
    let shown = pixels(&images[0], |pixel| pixel != background);
    assert!(shown > 500, "{shown} pixels");
    for image in &images[1..] {
        let differs = |(a, b): (&[u8], &[u8])| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > 24);
        let different = images[0].chunks(4).zip(image.chunks(4)).filter(|&pair| differs(pair)).count();
        // The heads come from one source, but are cropped to different grids. Only outlines may differ.
        assert!(different < shown / 10, "{different} of {shown} pixels differ");
    }
}

#[test]
fn a_transparent_background_shows_through_as_much_as_volumes_let() {
    // What a headset blends with the room.
    let picture = |background: Color| {
        let mut scene = TestScene::with(
            folded_volume(UVec3::splat(24), DVec3::ONE),
            translucent_ramp(),
            few_rays(),
            ShadingMode::PhongCao,
            |app| {
                app.insert_resource(ClearColor(background));
            },
        );
        scene.settle();
        scene.headless.image()
    };
    let [none, black, white] = [Color::NONE, Color::BLACK, Color::WHITE].map(picture);
    let linear = |byte: u8| Color::srgb_u8(byte, byte, byte).to_linear().red;
    let mut translucent = 0;
    for ((none, black), white) in none.chunks(4).zip(black.chunks(4)).zip(white.chunks(4)) {
        assert_eq!(none[..3], black[..3], "light of the volume alone");
        let passes = linear(white[1]) - linear(black[1]);
        let opacity = f32::from(none[3]) / 255.0;
        translucent += usize::from((0.05..0.95).contains(&opacity));
        // Half a byte of the opacity, and half a byte of two colours where sRGB is steepest (near white, 2.3 bytes).
        assert!(
            (opacity - (1.0 - passes)).abs() < (0.5 + 2.0 * 0.5 * 2.3) / 255.0,
            "{none:?} {black:?} {white:?}"
        );
    }
    assert!(translucent > 500, "{translucent} pixels are translucent");
}
