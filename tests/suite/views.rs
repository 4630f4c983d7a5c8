//! Every kind of view of a volume, placed in any way, against the volume rendering integral.

use bevy::{
    camera::{CameraProjection, Hdr, ScalingMode, SubCameraView, Viewport},
    core_pipeline::tonemapping::Tonemapping,
    math::{DAffine3, DMat3, DVec3, Vec3A},
    prelude::*,
};
use bevy_contextual_ao::{prelude::*, volume::WORLD_UNITS_PER_MM};
use contextual_ao_kit::mode::ShadingMode;

use crate::{
    integral::{Integral, Pixel, View, srgb_byte},
    scene::{IMAGE, TestScene, few_rays, folded_volume, in_world_units, translucent_ramp},
};
use contextual_ao_kit::shapes::Triangles;

/// Linear background, not black, so that undrawn pixels show.
pub const BACKGROUND: DVec3 = DVec3::new(0.1, 0.2, 0.05);
pub const SIZE: UVec3 = UVec3::new(24, 20, 26);
pub const SPACING: DVec3 = DVec3::new(1.0, 1.2, 0.9);
/// Half the size of the box that carves, mm.
const BOX: DVec3 = DVec3::new(5.0, 4.0, 7.0);

fn box_pose() -> Transform {
    let turn = Quat::from_euler(EulerRot::XYZ, 0.5, -0.8, 1.1);
    Transform::from_xyz(5.0, 4.0, 7.0).with_rotation(turn)
}

/// Whether a point, mm, is in the box that carves.
fn is_in_box(p: DVec3) -> bool {
    let p = box_pose().to_matrix().as_dmat4().inverse().transform_point3(p);
    p.abs().cmplt(BOX).all()
}

pub fn volume() -> Volume {
    folded_volume(SIZE, SPACING)
}

/// A translucent volume in its own colours, which a box carves.
pub fn scene(volume: Volume) -> TestScene {
    let mut scene = scene_of(volume, translucent_ramp(), ShadingMode::Solid);
    scene.carve_with(&Triangles::cuboid((2.0 * BOX).as_vec3()), box_pose());
    scene
}

pub fn scene_of(volume: Volume, function: TransferFunction, mode: ShadingMode) -> TestScene {
    let mut scene = TestScene::with(volume, function, few_rays(), mode, |app| {
        let [r, g, b] = BACKGROUND.as_vec3().to_array();
        app.insert_resource(ClearColor(Color::linear_rgb(r, g, b)));
    });
    let volume = scene.volume;
    let mut shading = scene.world().get_mut::<VolumeShading>(volume).expect("shading");
    (shading.step_voxels, shading.jitter) = (0.125, false);
    scene
}

pub fn carved(volume: &Volume) -> Integral<'static> {
    Integral { is_clipped: &is_in_box, ..Integral::of(volume, &translucent_ramp()) }
}

/// Pose of a camera that looks at the world's centre from a place, mm.
fn looking_from(x: f32, y: f32, z: f32) -> Transform {
    Transform::from_translation(Vec3::new(x, y, z) * WORLD_UNITS_PER_MM).looking_at(Vec3::ZERO, Vec3::Y)
}

/// Colour of a pixel in front of the background.
pub fn in_front(pixel: Pixel) -> DVec3 {
    pixel.color + pixel.transmittance * BACKGROUND
}

/// Compares a part of the image with the expected colours.
fn assert_shows(name: &str, scene: &TestScene, part: [UVec2; 2], expected: impl Fn(UVec2) -> DVec3) {
    // The largest of three roundings is 3/8 of a byte on average. Steps of an eighth of a voxel, filter weights of 8 bits
    // and mapping tones are off by half as much again.
    // Where a carver or a mesh is seen edge-on, a texel of its depth map or half a step decides.
    assert_shows_within([0.6, FAR_SHARE], name, scene, part, expected);
}

/// Share of pixels that may be off by more than 3 bytes.
pub const FAR_SHARE: f64 = 0.01;

/// The same with the most bytes by which pixels may be off on average, and the share that may be by more than 3.
pub fn assert_shows_within(
    [most_mean, most_far]: [f64; 2],
    name: &str,
    scene: &TestScene,
    [first, size]: [UVec2; 2],
    expected: impl Fn(UVec2) -> DVec3,
) {
    let image = scene.headless.image();
    let background = BACKGROUND.to_array().map(srgb_byte);
    let mut differences = Vec::new();
    for index in 0..size.element_product() {
        let pixel = UVec2::new(index % size.x, index / size.x);
        let place = 4 * ((first + pixel).y * IMAGE.x + (first + pixel).x) as usize;
        let expected = expected(pixel).to_array().map(srgb_byte);
        let from =
            |bytes: [f64; 3]| expected.iter().zip(bytes).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let difference = from([0, 1, 2].map(|channel| f64::from(image[place + channel])));
        assert!(expected.iter().all(|byte| byte.is_finite()), "{name}: {pixel} has no expected colour");
        if from(background) > 8.0 {
            differences.push(difference);
        } else {
            assert!(difference < 10.0, "{name}: {pixel} shows something else than the background");
        }
    }
    let (shown, count) = (differences.len(), size.element_product() as usize);
    let mean = differences.iter().sum::<f64>() / shown as f64;
    let most = differences.iter().copied().fold(0.0, f64::max);
    let far = differences.iter().filter(|&&difference| difference > 3.0).count();
    println!(
        "{name}: {shown} of {count} pixels, off by {mean:.3} bytes, {far} by more than 3, at most {most:.1}"
    );
    assert!(shown > count / 8, "{name}: {shown} of {count} pixels show the volume");
    assert!(mean < most_mean, "{name}: pixels are off by {mean} bytes");
    assert!(
        far as f64 <= most_far * shown as f64,
        "{name}: {far} of {shown} pixels are off by more than 3 bytes"
    );
}

pub const ALL: [UVec2; 2] = [UVec2::ZERO, IMAGE];

/// Compares the image of the scene's only camera with the integral.
pub fn check(name: &str, scene: &mut TestScene, integral: &Integral) {
    let camera = scene.camera();
    let view = View::of(scene, camera, IMAGE);
    assert_shows(name, scene, ALL, |pixel| in_front(integral.pixel(&view, pixel)));
}

/// A frustum with its axis beside the middle, as headsets have. Its sides are given at a distance of 1.
#[derive(Clone, Copy, Debug)]
pub struct OffAxis {
    pub low: Vec2,
    pub high: Vec2,
    pub near: f32,
}

impl CameraProjection for OffAxis {
    fn get_clip_from_view(&self) -> Mat4 {
        let (size, sum) = (self.high - self.low, self.high + self.low);
        // Depth is reversed, without a far end.
        Mat4::from_cols(
            Vec4::new(2.0 / size.x, 0.0, 0.0, 0.0),
            Vec4::new(0.0, 2.0 / size.y, 0.0, 0.0),
            Vec4::new(sum.x / size.x, sum.y / size.y, 0.0, -1.0),
            Vec4::new(0.0, 0.0, self.near, 0.0),
        )
    }

    fn get_clip_from_view_for_sub(&self, _: &SubCameraView) -> Mat4 {
        self.get_clip_from_view()
    }

    fn update(&mut self, _: f32, _: f32) {}

    fn far(&self) -> f32 {
        100.0
    }

    fn get_frustum_corners(&self, near: f32, far: f32) -> [Vec3A; 8] {
        let Self { low, high, .. } = *self;
        let corner = |x: f32, y: f32, depth: f32| Vec3A::new(x * depth.abs(), y * depth.abs(), depth);
        let at = |z| {
            [
                corner(high.x, low.y, z),
                corner(high.x, high.y, z),
                corner(low.x, high.y, z),
                corner(low.x, low.y, z),
            ]
        };
        let [a, b, c, d] = at(near);
        let [e, f, g, h] = at(far);
        [a, b, c, d, e, f, g, h]
    }
}

fn perspective(fov: f32) -> Projection {
    Projection::Perspective(PerspectiveProjection { near: 1e-4, fov, ..default() })
}

fn orthographic(height_mm: f32) -> Projection {
    let viewport_height = height_mm * WORLD_UNITS_PER_MM;
    Projection::Orthographic(OrthographicProjection {
        scaling_mode: ScalingMode::FixedVertical { viewport_height },
        near: 0.0,
        ..OrthographicProjection::default_3d()
    })
}

#[test]
fn every_projection_shows_the_integral() {
    let volume = volume();
    let (mut scene, integral) = (scene(volume.clone()), carved(&volume));
    let off_axis = OffAxis { low: Vec2::new(-0.15, -0.6), high: Vec2::new(0.55, 0.1), near: 1e-3 };
    let inside = Transform::from_xyz(-0.004, 0.003, -0.005).looking_to(Vec3::new(0.5, 0.2, 1.0), Vec3::Y);
    for (name, pose, projection) in [
        ("perspective", looking_from(20.0, 17.0, 40.0), perspective(0.7)),
        ("orthographic", looking_from(-20.0, 31.0, 28.0), orthographic(34.0)),
        // The near plane cuts the volume.
        ("orthographic from within", looking_from(-1.0, 0.5, 2.0), orthographic(26.0)),
        ("along an axis", looking_from(0.0, 0.0, 45.0), perspective(0.6)),
        ("from inside", inside, perspective(1.6)),
        ("off-axis", looking_from(14.0, 25.0, 33.0), Projection::custom(off_axis)),
    ] {
        let camera = scene.camera();
        scene.world().entity_mut(camera).insert((pose, projection));
        scene.settle();
        check(name, &mut scene, &integral);
    }
    // The camera shows a part of a larger view.
    let camera = scene.camera();
    scene.world().entity_mut(camera).insert((looking_from(20.0, 17.0, 40.0), perspective(1.0)));
    let part = SubCameraView { full_size: IMAGE * 2, offset: Vec2::new(40.0, 55.0), size: IMAGE };
    scene.world().get_mut::<Camera>(camera).expect("a camera").sub_camera_view = Some(part);
    scene.settle();
    check("a part", &mut scene, &integral);
}

#[test]
fn a_volume_placed_in_any_way_shows_the_integral() {
    let volume = volume();
    let mut scene = scene(volume.clone());
    let turn = Quat::from_euler(EulerRot::XYZ, 0.4, -0.7, 0.3);
    let child = Transform::from_xyz(0.001, -0.002, 0.003).with_rotation(turn);
    let stretched = Vec3::new(1.2, 0.7, 0.9);
    let parent = scene.world().spawn((Transform::default(), Visibility::default())).id();
    for (name, parent_pose, pose) in [
        ("turned", Transform::default(), child),
        ("scaled", Transform::default(), child.with_scale(stretched)),
        ("mirrored", Transform::default(), child.with_scale(stretched * Vec3::new(1.0, -1.0, 1.0))),
        ("sheared", Transform::from_scale(stretched), child),
        ("sheared and mirrored", Transform::from_scale(stretched * Vec3::new(-1.0, 1.0, 1.0)), child),
    ] {
        let entity = scene.volume;
        scene.world().entity_mut(parent).insert(parent_pose);
        scene.world().entity_mut(entity).insert(ChildOf(parent));
        scene.place_volume(pose);
        scene.settle();
        let mut integral = carved(&volume);
        // The pose is computed in double precision, apart from the scene.
        let pose = parent_pose.to_matrix().as_dmat4() * pose.to_matrix().as_dmat4();
        integral.world_from_local = pose * integral.world_from_local;
        check(name, &mut scene, &integral);
    }
}

#[test]
fn a_sheared_grid_shows_the_integral() {
    let axes =
        DMat3::from_cols(DVec3::new(1.0, 0.2, 0.0), DVec3::new(0.5, 1.1, 0.1), DVec3::new(-0.1, 0.3, 0.9));
    let data = volume();
    let grid = DAffine3::from_mat3(axes);
    let sheared = Volume::new(SIZE, grid, data.intensities().clone(), data.rescale()).expect("a volume");
    let mut scene = scene(sheared.clone());
    scene.settle();
    check("sheared grid", &mut scene, &carved(&sheared));
}

#[test]
fn viewports_of_several_cameras_show_the_integral() {
    let volume = volume();
    let (mut scene, integral) = (scene(volume.clone()), carved(&volume));
    let viewports = [
        [UVec2::new(5, 9), UVec2::new(40, 52)],
        [UVec2::new(50, 0), UVec2::new(46, 33)],
        [UVec2::new(48, 40), UVec2::new(32, 50)],
    ];
    let views = [
        (looking_from(20.0, 17.0, 40.0), perspective(0.7)),
        (looking_from(-20.0, 31.0, -28.0), orthographic(31.0)),
        (looking_from(0.0, -30.0, 30.0), perspective(0.8)),
    ];
    let first = scene.camera();
    let others = [(); 2].map(|()| scene.headless.camera());
    let others = others.map(|camera| scene.world().spawn(camera).id());
    let cameras = [first, others[0], others[1]];
    for (order, (camera, [physical_position, physical_size])) in
        cameras.into_iter().zip(viewports).enumerate()
    {
        let viewport = Viewport { physical_position, physical_size, ..default() };
        // Only the first camera clears, and it clears the whole image.
        let clear_color = if order == 0 { default() } else { ClearColorConfig::None };
        let (pose, projection) = views[order].clone();
        let camera_of = Camera { viewport: Some(viewport), order: order as isize, clear_color, ..default() };
        scene.world().entity_mut(camera).insert((camera_of, pose, projection));
    }
    scene.settle();
    scene.headless.frame();
    for (order, (camera, viewport)) in cameras.into_iter().zip(viewports).enumerate() {
        let view = View::of(&mut scene, camera, viewport[1]);
        let name = format!("camera {order}");
        assert_shows(&name, &scene, viewport, |pixel| in_front(integral.pixel(&view, pixel)));
    }
    // Nothing is drawn beside the viewports.
    let image = scene.headless.image();
    let is_in = |pixel: UVec2| {
        viewports.iter().any(|[first, size]| pixel.cmpge(*first).all() && pixel.cmplt(*first + *size).all())
    };
    for index in 0..IMAGE.element_product() {
        let pixel = UVec2::new(index % IMAGE.x, index / IMAGE.x);
        let color = &image[4 * index as usize..][..3];
        assert!(is_in(pixel) || *color == image[..3], "{pixel} shows {color:?}");
    }
}

#[test]
fn samples_and_tones_are_as_they_are_to_be() {
    let volume = volume();
    let (mut scene, integral) = (scene(volume.clone()), carved(&volume));
    let camera = scene.camera();
    // Smooth outlines are another test's.
    let entity = scene.volume;
    scene.world().get_mut::<VolumeShading>(entity).expect("shading").outline_rays = 1;
    scene.settle();
    let view = View::of(&mut scene, camera, IMAGE);
    let reinhard = |color: DVec3| color / (1.0 + color);
    let plain = |pixel: UVec2| in_front(integral.pixel(&view, pixel));
    // The volume's colour is mapped before it is put in front of the background.
    let mapped = |pixel: UVec2| {
        let Pixel { color, transmittance } = integral.pixel(&view, pixel);
        let opacity = 1.0 - transmittance;
        let color = if opacity > 0.0 { opacity * reinhard(color / opacity) } else { color };
        in_front(Pixel { color, transmittance })
    };
    let all_mapped = |pixel: UVec2| reinhard(plain(pixel));
    type Change = fn(&mut EntityWorldMut);
    let changes: [(&str, Change, &dyn Fn(UVec2) -> DVec3); 5] = [
        ("Msaa", |camera| _ = camera.insert(Msaa::Sample4), &plain),
        ("Msaa, tones mapped", |camera| _ = camera.insert(Tonemapping::Reinhard), &mapped),
        ("tones mapped", |camera| _ = camera.insert(Msaa::Off), &mapped),
        ("HDR, tones mapped", |camera| _ = camera.insert(Hdr), &all_mapped),
        ("HDR", |camera| _ = camera.insert(Tonemapping::None), &plain),
    ];
    for (name, change, expected) in changes {
        change(&mut scene.world().entity_mut(camera));
        // The previous image must not pass for this one.
        scene.settle();
        scene.headless.frames(3);
        assert_shows(name, &scene, ALL, expected);
    }
}

/// Adds a red box to a scene. Returns the distance to it, mm, from a point in a direction.
pub fn add_box(scene: &mut TestScene) -> impl Fn(DVec3, DVec3) -> f64 + use<> {
    let half = DVec3::new(3.0, 8.0, 4.0);
    let pose = Transform::from_xyz(-3.0, 1.0, -2.0).with_rotation(Quat::from_rotation_z(0.4));
    let world = scene.world();
    let mesh = world.resource_mut::<Assets<Mesh>>().add(Cuboid::from_size((2.0 * half).as_vec3()));
    let red = StandardMaterial { base_color: Color::linear_rgb(1.0, 0.0, 0.0), unlit: true, ..default() };
    let material = world.resource_mut::<Assets<StandardMaterial>>().add(red);
    world.spawn((Mesh3d(mesh), MeshMaterial3d(material), in_world_units(pose)));
    scene.settle();
    // The mesh's shaders are still being read.
    let shows_it =
        |headless: &crate::headless::Headless| headless.image().chunks(4).any(|pixel| pixel[0] > 200);
    assert!(scene.headless.frames_until(shows_it), "the mesh is not drawn");
    scene.headless.frames(2);
    let from_world = pose.to_matrix().as_dmat4().inverse();
    move |origin: DVec3, direction: DVec3| {
        let (p, d) = (from_world.transform_point3(origin), from_world.transform_vector3(direction));
        let (a, b) = ((-half - p) / d, (half - p) / d);
        let (begin, end) = (a.min(b).max_element(), a.max(b).min_element());
        if begin < end { begin } else { f64::INFINITY }
    }
}

#[test]
fn an_opaque_mesh_in_a_volume_ends_the_integral() {
    let volume = volume();
    let mut scene = scene(volume.clone());
    let opaque = add_box(&mut scene);
    let with_mesh = Integral { opaque: &opaque, ..carved(&volume) };
    let camera = scene.camera();
    let view = View::of(&mut scene, camera, IMAGE);
    let expected = |pixel: UVec2| {
        let behind = if view.meets(pixel.as_dvec2() + 0.5, &opaque) { DVec3::X } else { BACKGROUND };
        let Pixel { color, transmittance } = with_mesh.pixel(&view, pixel);
        color + transmittance * behind
    };
    assert_shows("a mesh inside", &scene, ALL, expected);
}
