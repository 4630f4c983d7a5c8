//! The app goes on if the device lacks a feature, or is lost.

use bevy::{
    camera::Hdr,
    core_pipeline::oit::OrderIndependentTransparencySettings,
    light::{Atmosphere, atmosphere::ScatteringMedium},
    math::{DAffine3, DVec3},
    pbr::AtmosphereSettings,
    prelude::*,
    render::{
        error_handler::{RenderErrorHandler, RenderErrorPolicy},
        render_resource::{PollType, WgpuLimits},
        renderer::RenderDevice,
        settings::WgpuSettings,
    },
};
use bevy_contextual_ao::{
    diagnostics::Work,
    occlusion::{OcclusionSweeping, SweepingSurface},
    prelude::*,
    volume::{Intensities, LookupTable, Rescale},
};
use contextual_ao_kit::mode::ShadingMode;
use std::time::Duration;

use crate::{
    device,
    headless::Headless,
    needs,
    scene::{
        IMAGE, TestScene, count_different, few_rays, folded_volume, is_empty, opaque_ramp, progressive_rays,
    },
};

const SIZE: UVec3 = UVec3::new(24, 22, 20);

#[derive(Resource, Default)]
struct Errors(Vec<String>);

fn collect_errors(app: &mut App) {
    app.init_resource::<Errors>().add_observer(|event: On<VolumeFailed>, mut errors: ResMut<Errors>| {
        errors.0.push(event.reason.to_string())
    });
}

fn scene() -> TestScene {
    TestScene::with(
        folded_volume(SIZE, DVec3::ONE),
        opaque_ramp(),
        few_rays(),
        ShadingMode::Cao,
        collect_errors,
    )
}

#[test]
fn a_volume_too_large_for_the_device_is_refused_or_halved() {
    let mut headless = Headless::new(IMAGE, collect_errors);
    let camera = headless.camera();
    let world = headless.app.world_mut();
    world.spawn((camera, Transform::from_xyz(0.0, 0.0, 20.0).looking_at(Vec3::ZERO, Vec3::Y)));
    let dimensions = UVec3::new(20_000, 2, 2);
    let data =
        Volume::new(dimensions, DAffine3::IDENTITY, Intensities::U8(vec![9; 80_000]), Rescale::default());
    let data = world.resource_mut::<Assets<Volume>>().add(data.expect("a valid volume"));
    let volume = world.spawn(VolumeBundle::new(data)).id();
    headless.frames(4);
    let world = headless.app.world_mut();
    let most = world.resource::<RenderDevice>().limits().max_texture_dimension_3d;
    let errors = &world.resource::<Errors>().0;
    assert_eq!(errors.len(), 1, "{errors:?}");
    for part in ["20000", &most.to_string(), "would fit", "VolumeBudget::halves"] {
        assert!(errors[0].contains(part), "`{}` does not name {part}", errors[0]);
    }
    assert!(world.get::<LookupTable>(volume).is_none());

    world.resource_mut::<VolumeBudget>().halves = true;
    // The volume is halved in the background.
    assert!(headless.frames_until(|headless| headless.app.world().get::<LookupTable>(volume).is_some()));
    let table = headless.app.world().get::<LookupTable>(volume).expect("it is shown");
    assert!(table.geometry.dimensions.max_element() <= most);
    assert!((table.geometry.spacing_mm.x - (20_000 / table.geometry.dimensions.x) as f64).abs() < 1e-9);
}

#[test]
fn a_volume_beyond_the_budget_is_refused_halved_and_shown() {
    let mut scene = scene();
    // The budget holds a carver's depth maps (20.3 bytes a texel) and 410 kB of tables. It also holds an eighth of
    // the voxels, of up to 9 bytes each. All voxels take 41 kB or more.
    scene.world().resource_mut::<VolumeBudget>().max_bytes = 1_331_200 + 426_608;
    scene.headless.frames(4);
    assert!(is_empty(&scene.headless.image()));
    let errors = scene.world().resource::<Errors>().0.clone();
    assert_eq!(errors.len(), 1, "{errors:?}");
    assert!(errors[0].contains("24, 22, 20") && errors[0].contains("12, 11, 10"), "{errors:?}");

    scene.world().resource_mut::<VolumeBudget>().halves = true;
    let volume = scene.volume;
    let is_shown = |headless: &Headless| headless.app.world().get::<LookupTable>(volume).is_some();
    assert!(scene.headless.frames_until(is_shown));
    scene.headless.frames(2);
    let half = scene.world().get::<LookupTable>(volume).expect("it is shown").geometry;
    assert_eq!(half.dimensions, UVec3::new(12, 11, 10));
    assert!(!is_empty(&scene.headless.image()));

    // With more room, the volume is shown in full, as if the room had always been enough.
    *scene.world().resource_mut::<VolumeBudget>() = default();
    scene.headless.frames(3);
    scene.world().resource_mut::<Errors>().0.clear();
    scene.headless.frames(20);
    let mut fresh = self::scene();
    fresh.settle();
    fresh.headless.frames(2);
    let (now, fresh) = (scene.headless.image(), fresh.headless.image());
    assert!(!is_empty(&fresh) && now == fresh, "the way there shows");

    // A budget of zero refuses everything, and causes no panic.
    *scene.world().resource_mut::<VolumeBudget>() = VolumeBudget { max_bytes: 0, halves: true };
    scene.headless.frames(3);
    assert_eq!(scene.world().resource::<Errors>().0.len(), 1);
    assert!(is_empty(&scene.headless.image()));
}

#[test]
fn a_device_without_queries_counts_nothing() {
    let settings = WgpuSettings { disabled_features: Some(needs::QUERIES), ..device::settings() };
    let headless = Headless::with_settings(IMAGE, settings, |_| {});
    let volume = folded_volume(SIZE, DVec3::ONE);
    let mut scene = TestScene::in_app(headless, volume, opaque_ramp(), few_rays(), ShadingMode::Cao);
    scene.settle();
    let image = scene.headless.image();
    scene.carve(Sphere::new(6.0), ClipMesh::default(), Transform::from_xyz(4.0, 3.0, 4.0));
    scene.settle();
    assert_eq!(scene.headless.count_work(scene.volume), Work::default());
    assert!(scene.headless.image() != image, "nothing is carved");
}

#[test]
fn a_device_that_lacks_something_draws_the_rest() {
    // Bevy itself draws without storage textures. Step IV writes a storage texture.
    let limits = WgpuLimits { max_storage_textures_per_shader_stage: 0, ..WgpuLimits::default() };
    let mut headless = Headless::with_settings(IMAGE, device::limited(limits), |_| {});
    let camera = headless.camera();
    let world = headless.app.world_mut();
    world.spawn((camera, Transform::from_xyz(0.0, 0.0, 3.0).looking_at(Vec3::ZERO, Vec3::Y)));
    let data = world.resource_mut::<Assets<Volume>>().add(folded_volume(SIZE, DVec3::ONE));
    let volume = world.spawn(VolumeBundle::new(data)).id();
    let mesh = world.resource_mut::<Assets<Mesh>>().add(Sphere::new(0.5));
    let carver = world.spawn((ClipMesh::default(), Mesh3d(mesh.clone()))).id();
    headless.frames(3);
    assert!(is_empty(&headless.image()), "the volume is drawn");
    // The volume was still read, and other things are drawn.
    let world = headless.app.world_mut();
    assert!(world.get::<LookupTable>(volume).is_some());
    let material = StandardMaterial { unlit: true, ..default() };
    let material = world.resource_mut::<Assets<StandardMaterial>>().add(material);
    world.spawn((Mesh3d(mesh), MeshMaterial3d(material)));
    world.despawn(carver);
    assert!(headless.frames_until(|headless| !is_empty(&headless.image())), "nothing else is drawn");
}

#[test]
fn a_view_with_too_few_storage_buffers_shows_the_rest() {
    // Of 8, Bevy's clusters take three, its sorted fragments three and its atmosphere one. A volume takes two.
    let headless = Headless::with_settings(IMAGE, device::limited(WgpuLimits::default()), |_| {});
    let volume = folded_volume(SIZE, DVec3::ONE);
    let mut scene = TestScene::in_app(headless, volume, opaque_ramp(), few_rays(), ShadingMode::Cao);
    if !needs::atmospheres(&mut scene) {
        return;
    }
    let (camera, volume) = (scene.camera(), scene.volume);
    let sees_volume = |scene: &mut TestScene, is_seen| {
        scene.headless.frames(3);
        let with = scene.headless.image();
        scene.world().entity_mut(volume).insert(Visibility::Hidden);
        scene.headless.frames(3);
        let without = scene.headless.image();
        scene.world().entity_mut(volume).insert(Visibility::Visible);
        let pixels = with.chunks(4).zip(without.chunks(4)).filter(|(with, without)| with != without).count();
        assert_eq!(pixels > 500, is_seen, "{pixels} pixels");
    };
    let medium = scene.world().resource_mut::<Assets<ScatteringMedium>>().add(ScatteringMedium::default());
    scene.world().spawn(Atmosphere::earth(medium));
    scene.world().entity_mut(camera).insert((AtmosphereSettings::default(), Hdr));
    scene.settle();
    sees_volume(&mut scene, true);
    scene.world().entity_mut(camera).insert(OrderIndependentTransparencySettings::default());
    sees_volume(&mut scene, false);
    scene.world().entity_mut(camera).remove::<OrderIndependentTransparencySettings>();
    sees_volume(&mut scene, true);
}

#[test]
fn a_device_with_small_buffers_goes_without_what_does_not_fit() {
    // A buffer of four bytes a voxel does not fit this limit. Bevy itself needs this much.
    let (size, max_bytes) = (UVec3::new(48, 40, 36), 1 << 18);
    assert!(u64::from(4 * size.element_product()) > max_bytes);
    let limits = WgpuLimits { max_storage_buffer_binding_size: max_bytes, ..WgpuLimits::default() };
    let image = |occlusion: AmbientOcclusion, mode| {
        let method = occlusion.method.clone();
        let volume = folded_volume(size, DVec3::ONE);
        let headless = Headless::with_settings(IMAGE, device::limited(limits.clone()), |_| {});
        let mut scene = TestScene::in_app(headless, volume, opaque_ramp(), occlusion, mode);
        // A volume whose occlusion does not fit is never ready.
        if matches!(method, OcclusionMethod::Sweeping(_)) {
            assert!(scene.headless.frames_until(|headless| !is_empty(&headless.image())));
        } else {
            scene.settle();
        }
        scene.headless.image()
    };
    let of = |method| AmbientOcclusion::by(method);
    let rays = image(few_rays(), ShadingMode::Cao);
    assert!(!is_empty(&rays));
    // Progressive rays are all cast at once, in the first frame.
    assert!(image(of(progressive_rays()), ShadingMode::Cao) == rays);
    let solid = image(few_rays(), ShadingMode::Solid);
    assert!(!is_empty(&solid) && solid != rays);
    let surface = SweepingSurface::Isosurface(130.0);
    for sweeping in [default(), OcclusionSweeping { surface, ..default() }] {
        assert!(image(of(OcclusionMethod::Sweeping(sweeping)), ShadingMode::Cao) == solid);
    }
}

#[test]
fn a_volume_comes_back_after_the_device_is_lost() {
    let mut scene = scene();
    let place = Transform::from_xyz(4.0, 4.0, 6.0);
    let carver = scene.carve(Sphere::new(6.0), ClipMesh::default(), place);
    scene.settle();
    let (image, occlusion) = (scene.headless.image(), scene.occlusion());
    assert!(!is_empty(&image));
    let world = scene.world();
    world
        .insert_resource(RenderErrorHandler(|_, _, _| RenderErrorPolicy::Recover(device::settings().into())));
    let device = world.resource::<RenderDevice>().clone();
    device.wgpu_device().destroy();
    // The device is lost between two frames. Bevy itself panics if the device is lost within a frame.
    let _ = device.poll(PollType::wait_indefinitely());
    let alone = device::alone();
    scene.headless.frames(20);
    drop(alone);
    assert!(scene.headless.image() == image, "the image is not as it was");
    assert_eq!(count_different(&scene.occlusion(), &occlusion), 0, "the occlusion is not as it was");
    // The volume can be carved again.
    scene.move_carver(carver, place.with_translation(Vec3::new(-4.0, 4.0, 6.0)));
    scene.headless.frame();
    assert!(scene.headless.image() != image, "it is stuck");
    scene.move_carver(carver, place);
    scene.headless.frame();
    assert!(scene.headless.image() == image);
}

#[test]
fn waiting_ends_and_says_for_what() {
    let mut scene = scene();
    let lost = scene.world().resource::<Assets<Volume>>().reserve_handle();
    let volume = scene.world().spawn(VolumeBundle::new(lost)).id();
    // Waiting ends with the first frame in which nothing comes.
    scene.headless.patience = Duration::ZERO;
    let error = scene.headless.until_ready(volume).expect_err("it never comes");
    for part in ["in vain for", "the volume's occlusion", "its file"] {
        assert!(error.contains(part), "`{error}` does not say {part}");
    }
}
