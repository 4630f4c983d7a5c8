//! Directional occlusion shading against its definition, slice by slice in double precision. Also its drawing of carvers,
//! opaque meshes and several cameras.

mod reference;

use bevy::{
    camera::{RenderTarget, ScalingMode},
    core_pipeline::tonemapping::Tonemapping,
    math::DVec3,
    prelude::*,
};
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::mode::ShadingMode;

use crate::headless::different_pixels as different;
use crate::scene::{
    IMAGE, TestScene, few_rays, folded_volume, is_empty, opaque_ramp, solid_volume, translucent_ramp,
};
use reference::Reference;

/// Background of the images. It is light, so that display values follow the linear ones.
const BACKGROUND: LinearRgba = LinearRgba::rgb(0.3, 0.3, 0.3);

/// Settings that are quick on a software driver.
fn coarse() -> DirectionalOcclusion {
    DirectionalOcclusion { slice_voxels: 1.0, ..default() }
}

fn occlusion(settings: DirectionalOcclusion) -> AmbientOcclusion {
    AmbientOcclusion::by(settings)
}

fn scene(volume: Volume, function: TransferFunction, settings: DirectionalOcclusion) -> TestScene {
    TestScene::with(volume, function, occlusion(settings), ShadingMode::Cao, |app| {
        app.insert_resource(ClearColor(BACKGROUND.into()));
    })
}

fn orthographic() -> Projection {
    Projection::Orthographic(OrthographicProjection {
        near: 0.0,
        far: 1.0,
        scaling_mode: ScalingMode::FixedVertical { viewport_height: 0.04 },
        ..OrthographicProjection::default_3d()
    })
}

/// Linear values of an image's pixels.
fn linear(image: &[u8]) -> Vec<Vec3> {
    image
        .chunks(4)
        .map(|p| LinearRgba::from(Srgba::rgb_u8(p[0], p[1], p[2])))
        .map(|color| Vec3::new(color.red, color.green, color.blue))
        .collect()
}

fn check(projection: Projection, settings: DirectionalOcclusion, function: TransferFunction) {
    let volume = folded_volume(UVec3::new(22, 19, 25), DVec3::new(1.0, 1.2, 0.9));
    let mut reference = Reference::new(&volume, &function, settings);
    let mut scene = scene(volume, function, settings);
    let camera = scene.camera();
    let pose = Transform::from_xyz(0.031, 0.022, 0.055).looking_at(Vec3::ZERO, Vec3::Y);
    scene.world().entity_mut(camera).insert((projection, pose));
    scene.settle();
    scene.headless.frame();
    let camera = scene.world().get::<Camera>(camera).expect("a camera");
    let expected = reference.image(camera.clip_from_view(), pose, IMAGE, BACKGROUND);
    let found = linear(&scene.headless.image());
    let differences: Vec<f32> =
        expected.iter().zip(&found).map(|(a, b)| (a.as_vec3() - *b).abs().max_element()).collect();
    let largest = differences.iter().copied().fold(0.0, f32::max);
    let rms = (differences.iter().map(|d| d * d).sum::<f32>() / differences.len() as f32).sqrt();
    let shown = found.iter().filter(|color| color.distance(Vec3::splat(0.3)) > 0.01).count();
    println!("{settings:?}: largest {largest:.4}, rms {rms:.5}, {shown} pixels");
    assert!(shown > 1000, "the volume fills {shown} pixels");
    // Half a display value is up to 0.0045 in linear light. Filter weights have 8 fractional bits. An intensity is
    // therefore off by up to 3/512 of the differences between its 8 neighbours. The light is off by up to 2/512 of
    // the differences between its 4 neighbours. These errors have either sign, and mostly cancel over slices and
    // samples.
    assert!(rms <= 0.004, "rms {rms}");
    // A sample of a pixel may miss the volume's box in only one of the two images.
    let far = differences.iter().filter(|&&difference| difference > 0.02).count();
    assert!(far <= found.len() / 1000, "{far} pixels differ, by up to {largest}");
}

#[test]
fn a_perspective_view_is_as_defined() {
    let perspective =
        || Projection::Perspective(PerspectiveProjection { near: 0.001, fov: 0.6, ..default() });
    let settings =
        DirectionalOcclusion { aperture_degrees: 60.0, samples: 3, slice_voxels: 1.0, exact_distance: false };
    check(perspective(), settings, translucent_ramp());
    check(
        perspective(),
        DirectionalOcclusion { exact_distance: true, samples: 4, ..settings },
        translucent_ramp(),
    );
    // The near plane cuts the box.
    let inside = Projection::Perspective(PerspectiveProjection { near: 0.062, fov: 0.6, ..default() });
    check(inside, settings, translucent_ramp());
}

#[test]
fn an_orthographic_view_is_as_defined() {
    let settings =
        DirectionalOcclusion { aperture_degrees: 75.0, samples: 2, slice_voxels: 0.7, exact_distance: true };
    check(orthographic(), settings, translucent_ramp());
    let settings = DirectionalOcclusion { samples: 5, exact_distance: false, ..settings };
    check(orthographic(), settings, opaque_ramp().with_opacity(0.6));
}

/// Limits the opacity of a transfer function.
trait WithOpacity {
    fn with_opacity(self, opacity: f32) -> Self;
}

impl WithOpacity for TransferFunction {
    fn with_opacity(mut self, opacity: f32) -> Self {
        for point in &mut self.points {
            point.opacity = point.opacity.min(opacity);
        }
        self
    }
}

#[test]
fn a_narrow_cone_sees_what_the_eye_sees() {
    // Light comes from the eye alone. A point seen through transmittance T gets the share T of the light. Slices of
    // opacity a and colour c therefore show sum(a T^2) c.
    let narrow = DirectionalOcclusion { aperture_degrees: 0.0, ..coarse() };
    let shade = |opacity: f32| {
        let function = TransferFunction::ramp(10.0, 11.0, opacity, [1.0; 3]).expect("a ramp");
        let mut scene = scene(solid_volume(UVec3::splat(16)), function, narrow);
        let camera = scene.camera();
        let pose = Transform::from_xyz(0.0, 0.0, 0.1).looking_at(Vec3::ZERO, Vec3::Y);
        scene.world().entity_mut(camera).insert((orthographic(), pose));
        scene.settle();
        scene.headless.frame();
        let image = linear(&scene.headless.image());
        image[(IMAGE.y / 2 * IMAGE.x + IMAGE.x / 2) as usize].x
    };
    let opaque = shade(1.0);
    assert!(opaque > 0.999, "an unoccluded surface has its colour, not {opaque}");
    let opacity = 0.2;
    // The 17 slices from face to face are a voxel apart.
    let expected: f64 = (0..17).map(|slice| 0.2 * 0.8f64.powi(2 * slice)).sum();
    let left = 0.8f64.powi(17) * 0.3;
    let found = shade(opacity);
    // A display value is 0.0035 wide here.
    assert!((f64::from(found) - expected - left).abs() < 0.003, "{found} instead of {}", expected + left);
}

/// A scene of a folded volume, and its image.
fn shown(settings: DirectionalOcclusion) -> (TestScene, Vec<u8>) {
    let mut scene = scene(folded_volume(UVec3::splat(24), DVec3::ONE), opaque_ramp(), settings);
    scene.settle();
    scene.headless.frame();
    let image = scene.headless.image();
    (scene, image)
}

#[test]
fn a_carver_is_seen_at_once_and_leaves_no_trace() {
    let (mut scene, before) = shown(coarse());
    assert!(!is_empty(&before));
    let place = Transform::from_xyz(6.0, 5.0, 9.0);
    let away = Transform::from_xyz(500.0, 0.0, 0.0);
    let carver = scene.carve(Sphere::new(7.0), ClipMesh::default(), away);
    scene.settle();
    assert_eq!(different(&scene.headless.image(), &before), 0, "a carver far away shows");
    scene.move_carver(carver, place);
    scene.headless.frame();
    let carved = scene.headless.image();
    assert!(different(&carved, &before) > 100, "the carver is not seen");
    scene.headless.frames(2);
    assert_eq!(different(&scene.headless.image(), &carved), 0, "it was not all there at once");
    scene.move_carver(carver, away);
    scene.headless.frame();
    assert_eq!(different(&scene.headless.image(), &before), 0, "the carver left a trace");
    scene.world().entity_mut(carver).despawn();
    scene.headless.frames(2);
    assert_eq!(different(&scene.headless.image(), &before), 0, "the carver left a trace");
}

#[test]
fn other_modes_and_methods_are_drawn_as_ever() {
    let (mut scene, direct) = shown(coarse());
    let jobs = scene.status().passes.jobs(DirectionalOcclusion::SPAN);
    assert!(jobs > 0, "the pass ran");
    scene.set_mode(ShadingMode::Solid);
    scene.headless.frames(2);
    let solid = scene.headless.image();
    let jobs = scene.status().passes.jobs(DirectionalOcclusion::SPAN);
    scene.headless.frames(2);
    assert_eq!(scene.status().passes.jobs(DirectionalOcclusion::SPAN), jobs, "nobody needs the pass");
    assert!(different(&solid, &direct) > 500);
    // Occlusion only darkens, and the silhouette stays. The outermost pixels are an exception: a ray may pass between
    // slices there.
    let brighter = |(a, b): (&[u8], &[u8])| a[0] > b[0] + 8;
    let is_background = |pixel: &[u8]| pixel == &solid[..4];
    let pairs = || direct.chunks(4).zip(solid.chunks(4)).filter(|(_, b)| !is_background(b));
    let (all, odd) = (pairs().count(), pairs().filter(|pair| brighter(*pair)).count());
    assert!(odd < all / 30, "{odd} of {all} pixels are brighter than without occlusion");
    scene.set_mode(ShadingMode::PhongCao);
    scene.headless.frames(2);
    assert!(different(&scene.headless.image(), &direct) > 500, "no light");
    scene.set_mode(ShadingMode::Cao);
    scene.headless.frames(2);
    assert_eq!(different(&scene.headless.image(), &direct), 0);
    // The scene switches to another method and back.
    let volume = scene.volume;
    scene.world().entity_mut(volume).insert(few_rays());
    scene.headless.frames(3);
    let rays = scene.headless.image();
    assert!(!is_empty(&rays) && different(&rays, &direct) > 500);
    scene.world().entity_mut(volume).insert(occlusion(coarse()));
    scene.headless.frames(3);
    assert_eq!(different(&scene.headless.image(), &direct), 0);
}

fn red(image: &[u8]) -> usize {
    image.chunks(4).filter(|pixel| pixel[0] > 200 && pixel[1] < 40 && pixel[2] < 40).count()
}

#[test]
fn opaque_meshes_hide_and_cut_off() {
    let (mut scene, _) = shown(coarse());
    let camera = scene.camera();
    let view = scene.world().get::<Transform>(camera).expect("a place").translation;
    let world = scene.world();
    let mesh = world.resource_mut::<Assets<Mesh>>().add(Sphere::new(0.004));
    let material = world.resource_mut::<Assets<StandardMaterial>>().add(StandardMaterial {
        base_color: Color::srgb(1.0, 0.0, 0.0),
        unlit: true,
        ..default()
    });
    let place = Transform::from_translation(view * 0.6);
    let ball = world.spawn((Mesh3d(mesh), MeshMaterial3d(material), place)).id();
    assert!(scene.headless.frames_until(|headless| red(&headless.image()) > 0), "the mesh is not drawn");
    let mut red_at = |place: Vec3| {
        scene.world().entity_mut(ball).insert(Transform::from_translation(place));
        scene.headless.frames(2);
        red(&scene.headless.image())
    };
    let in_front = red_at(view * 0.6);
    assert!(in_front > 100, "{in_front} red pixels in front of the volume");
    let behind = red_at(-view * 0.6);
    assert!(behind < in_front / 20, "{behind} red pixels through the opaque volume");
    let beside = red_at(view * 0.28);
    assert!(beside > 20, "{beside} red pixels where the mesh sticks out");

    // In a translucent volume, the mesh shows through the part in front of it, and hides the part behind it.
    let world = scene.world();
    let function = world.resource_mut::<Assets<TransferFunction>>().add(translucent_ramp());
    let volume = scene.volume;
    scene.world().entity_mut(volume).insert(VolumeTransferFunction(function));
    let mut green_at = |part: f32| {
        scene.world().entity_mut(ball).insert(Transform::from_translation(view * part));
        scene.headless.frames(3);
        linear(&scene.headless.image())[(IMAGE.y / 2 * IMAGE.x + IMAGE.x / 2) as usize].y
    };
    let (front, inside, behind) = (green_at(0.6), green_at(0.0), green_at(-0.6));
    assert!(front < 0.01 && inside > front + 0.05 && behind > inside + 0.02, "{front} {inside} {behind}");
}

#[test]
fn every_kind_of_camera_draws() {
    // A black background stays black, wherever tones are mapped.
    let (mut scene, _) = shown(coarse());
    scene.world().insert_resource(ClearColor(Color::BLACK));
    scene.headless.frame();
    let image = scene.headless.image();
    let camera = scene.camera();
    let changes: [(&str, Box<dyn Fn(&mut EntityWorldMut)>); 3] = [
        ("Msaa", Box::new(|camera| _ = camera.insert(Msaa::Sample4))),
        ("tonemapping", Box::new(|camera| _ = camera.insert(Tonemapping::Reinhard))),
        ("HDR", Box::new(|camera| _ = camera.insert((Msaa::Off, bevy::camera::Hdr)))),
    ];
    let mut images = vec![image];
    for (name, change) in changes {
        change(&mut scene.world().entity_mut(camera));
        scene.headless.frames(3);
        let image = scene.headless.image();
        let shown = image.chunks(4).filter(|pixel| *pixel != &image[..4]).count();
        assert!(shown > 300, "{name}: {shown} pixels");
        images.push(image);
    }
    let [plain, multisampled, mapped, hdr] = &images[..] else { unreachable!("four images") };
    assert_eq!(different(plain, multisampled), 0, "samples of a pixel differ");
    // Opaque pixels are mapped as they are. Translucent pixels, at outlines, are mapped before they cover black.
    let mapped_byte = |byte: &u8| {
        let color = LinearRgba::from(Srgba::rgb_u8(*byte, 0, 0)).red;
        255.0 * Srgba::from(LinearRgba::rgb(color / (1.0 + color), 0.0, 0.0)).red
    };
    let colors = || plain.iter().zip(mapped).filter(|(plain, _)| (1..255).contains(*plain));
    let (all, far) =
        (colors().count(), colors().filter(|(a, b)| (mapped_byte(a) - f32::from(**b)).abs() > 1.5));
    let far = far.count();
    assert!(all > 3000 && far < all / 15, "{far} of {all} values are not mapped so");
    // Mapping in the shader and mapping in a pass give the same tones. Only the blending of translucent edges
    // differs.
    let far = mapped.iter().zip(hdr).filter(|(a, b)| a.abs_diff(**b) > 3).count();
    assert!(far < 200, "{far} values differ");
}

#[test]
fn cameras_and_volumes_share_buffers_but_nothing_else() {
    let (mut scene, alone) = shown(coarse());
    // A second camera draws on the right, over the image of the first.
    let camera = scene.camera();
    let world = scene.world();
    let (target, pose) = {
        let camera = world.entity(camera);
        (camera.get::<RenderTarget>().cloned(), camera.get::<Transform>().copied())
    };
    let (target, pose) = (target.expect("a target"), pose.expect("a pose"));
    let viewport = bevy::camera::Viewport {
        physical_position: UVec2::new(IMAGE.x / 2, 0),
        physical_size: UVec2::new(IMAGE.x / 2, IMAGE.y / 3),
        ..default()
    };
    let turned = Transform::from_rotation(Quat::from_rotation_y(1.0)) * pose;
    let second = world
        .spawn((
            Camera3d::default(),
            Camera { order: 1, viewport: Some(viewport), ..default() },
            target,
            turned,
            Projection::Perspective(PerspectiveProjection { near: 1e-4, ..default() }),
            Tonemapping::None,
            Msaa::Off,
        ))
        .id();
    scene.headless.frames(3);
    let both = scene.headless.image();
    let is_right = |index: usize| {
        let place = UVec2::new(index as u32 % IMAGE.x, index as u32 / IMAGE.x);
        place.x >= IMAGE.x / 2 && place.y < IMAGE.y / 3
    };
    let pairs = || alone.chunks(4).zip(both.chunks(4)).enumerate();
    let outside = pairs().filter(|(index, (a, b))| !is_right(*index) && a != b).count();
    assert_eq!(outside, 0, "the second camera shows outside of its viewport");
    // Alone, the second camera shows the same, except behind translucent edges.
    scene.world().get_mut::<Camera>(camera).expect("a camera").is_active = false;
    scene.headless.frames(2);
    let by_itself = scene.headless.image();
    let pairs = by_itself.chunks(4).zip(both.chunks(4)).enumerate();
    let shown = pairs.filter(|(index, (a, _))| is_right(*index) && **a != by_itself[..4]);
    let [all, differ] =
        shown.fold([0, 0], |[all, differ], (_, (a, b))| [all + 1, differ + usize::from(a != b)]);
    assert!(all > 150 && differ < all / 8, "of {all} pixels of the second camera {differ} differ");
    scene.world().get_mut::<Camera>(camera).expect("a camera").is_active = true;
    scene.world().entity_mut(second).despawn();

    // A second volume is hidden behind the first. In front of the first, it shows.
    let hidden = Transform::from_translation(-pose.translation * 0.9);
    let data = folded_volume(UVec3::splat(12), DVec3::ONE);
    let world = scene.world();
    let data = world.resource_mut::<Assets<Volume>>().add(data);
    let function = world.resource_mut::<Assets<TransferFunction>>().add(opaque_ramp());
    let mut bundle = VolumeBundle::new(data).with_transfer_function(function);
    bundle.occlusion = occlusion(coarse());
    bundle.transform = hidden;
    let behind = world.spawn(bundle).id();
    scene.settle();
    scene.headless.frame();
    let visible = different(&scene.headless.image(), &alone);
    let in_front = Transform::from_translation(pose.translation * 0.5);
    scene.world().entity_mut(behind).insert(in_front);
    scene.headless.frames(2);
    let covering = different(&scene.headless.image(), &alone);
    assert!(visible < covering / 4, "{visible} pixels behind, {covering} in front");
    scene.world().entity_mut(behind).despawn();
    scene.headless.frames(2);
    assert_eq!(different(&scene.headless.image(), &alone), 0, "the second volume left a trace");
}

#[test]
fn any_settings_are_survived() {
    let (mut scene, _) = shown(coarse());
    let strange = |aperture_degrees, samples, slice_voxels| DirectionalOcclusion {
        aperture_degrees,
        samples,
        slice_voxels,
        exact_distance: true,
    };
    for settings in [
        strange(f32::NAN, 0, f32::NAN),
        strange(f32::INFINITY, 2, f32::INFINITY),
        strange(-1.0, 1, 0.4),
        strange(90.0, u32::MAX, 3.0),
    ] {
        let volume = scene.volume;
        scene.world().entity_mut(volume).insert(occlusion(settings));
        scene.headless.frames(2);
        let image = scene.headless.image();
        // Very thick slices may leave a single slice.
        assert!(settings.slice_voxels > 100.0 || !is_empty(&image), "{settings:?} shows nothing");
    }
}
