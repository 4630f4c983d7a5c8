//! The budget is a cap. Each volume reports once if it, or its occlusion, does not fit.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::{
    diagnostics::RenderStatus,
    occlusion::{DensityEstimate, GeometryTerm, OcclusionFallback, OpacityModulation, SweepingSurface},
    prelude::*,
    volume::{Intensities, Rescale},
};
use contextual_ao_kit::mode::ShadingMode;

use crate::scene::{FEW_RAYS, TestScene, few_rays, folded_volume, is_empty, opaque_ramp, progressive_rays};
use contextual_ao_kit::headless::{Headless, different_pixels};

const SIZE: UVec3 = UVec3::new(40, 38, 36);

#[derive(Resource, Default)]
struct Told {
    failed: Vec<(Entity, VolumeFailure)>,
    unoccluded: Vec<OcclusionFailed>,
    occluded: Vec<Entity>,
}

fn listen(app: &mut App) {
    app.init_resource::<Told>()
        .add_observer(|event: On<VolumeFailed>, mut told: ResMut<Told>| {
            told.failed.push((event.entity, event.reason.clone()));
        })
        .add_observer(|event: On<OcclusionFailed>, mut told: ResMut<Told>| {
            told.unoccluded.push(*event.event());
        })
        .add_observer(|event: On<VolumeOccluded>, mut told: ResMut<Told>| told.occluded.push(event.entity));
}

/// A volume of 8 or of 16 bits.
fn volume(is_wide: bool) -> Volume {
    let narrow = folded_volume(SIZE, DVec3::ONE);
    let Intensities::U8(values) = narrow.intensities() else { panic!("8 bits") };
    if !is_wide {
        return narrow;
    }
    let values = values.iter().map(|value| u16::from(*value) * 256).collect();
    let rescale = Rescale { slope: 1.0 / 256.0, intercept: 0.0 };
    Volume::new(SIZE, narrow.grid_to_patient(), Intensities::U16(values), rescale).expect("a valid volume")
}

fn scene(is_wide: bool, method: OcclusionMethod) -> TestScene {
    let occlusion = AmbientOcclusion::by(method);
    let mut scene = TestScene::with(volume(is_wide), opaque_ramp(), occlusion, ShadingMode::Cao, listen);
    scene.set_clip(|clip| clip.depth_map_size = 64);
    scene.carve(Sphere::new(6.0), ClipMesh::default(), Transform::from_xyz(4.0, 3.0, 4.0));
    scene
}

/// Number of failures that a scene reports with a budget, and bytes that the scene takes.
fn with_budget(scene: &mut TestScene, max_bytes: u64) -> (usize, u64) {
    scene.world().insert_resource(Told::default());
    scene.world().resource_mut::<VolumeBudget>().max_bytes = max_bytes;
    scene.headless.frames(5);
    let told = scene.world().resource::<Told>();
    let told = told.failed.len() + told.unoccluded.len();
    (told, scene.status().usage.bytes)
}

/// Bytes of an 8-bit scene whose occlusion keeps nothing of its own.
fn bytes_of_rays() -> u64 {
    with_budget(&mut scene(false, FEW_RAYS.into()), 4 << 30).1
}

#[test]
fn the_budget_counts_what_is_allocated() {
    let sweeping = |surface, geometry_term| {
        OcclusionMethod::Sweeping(OcclusionSweeping { surface, geometry_term, ..default() })
    };
    let filtering = |estimate, modulation| {
        OcclusionMethod::Filtering(OcclusionFiltering { estimate, modulation, ..default() })
    };
    let methods = [
        FEW_RAYS.into(),
        progressive_rays(),
        sweeping(SweepingSurface::Opacity, GeometryTerm::None),
        sweeping(SweepingSurface::Isosurface(130.0), GeometryTerm::Cosine),
        OcclusionMethod::Sweeping(OcclusionSweeping { light: Some(Vec3::X), ..default() }),
        filtering(DensityEstimate::Gaussian, OpacityModulation::None),
        filtering(DensityEstimate::Power, OpacityModulation::Variance(0.1)),
        OcclusionMethod::SummedArea(default()),
    ];
    let wide = (true, FEW_RAYS.into());
    for (is_wide, method) in methods.into_iter().map(|method| (false, method)).chain([wide]) {
        let mut scene = scene(is_wide, method.clone());
        let (told, bytes) = with_budget(&mut scene, 4 << 30);
        assert_eq!(told, 0, "{method:?}");
        assert_eq!(with_budget(&mut scene, bytes), (0, bytes), "{method:?} does not fit what it takes");
        let (told, less) = with_budget(&mut scene, bytes - 1);
        assert!(told > 0 && less < bytes, "{method:?}: {told} told, {less} of {bytes} bytes");
    }
}

#[test]
fn a_volume_without_occlusion_is_told_of_once_for_every_volume() {
    let method = OcclusionMethod::Filtering(default());
    let bytes = bytes_of_rays();
    let mut scene = scene(false, method.clone());
    // The budget holds two volumes of this size, but the filtering resources of neither.
    scene.world().resource_mut::<VolumeBudget>().max_bytes = 2 * bytes;
    let first = scene.volume;
    let world = scene.world();
    let data = world.get::<Volume3d>(first).expect("a volume").clone();
    let occlusion = AmbientOcclusion::by(method);
    let second = world.spawn((data, occlusion, Transform::from_xyz(0.0, 0.0, -5.0))).id();
    scene.headless.frames(8);
    let told = scene.world().resource::<Told>();
    let mut entities: Vec<_> = told.unoccluded.iter().map(|event| event.entity).collect();
    entities.sort();
    let mut both = [first, second];
    both.sort();
    assert_eq!(entities, both);
    assert!(told.unoccluded.iter().all(|event| event.shortfall.fallback == OcclusionFallback::Unoccluded));
    assert!(told.occluded.is_empty(), "said to be occluded: {:?}", told.occluded);
    // The volume is still drawn, as in solid mode.
    let image = scene.headless.image();
    assert!(!is_empty(&image));
    scene.set_mode(ShadingMode::Solid);
    scene.headless.frame();
    assert_eq!(different_pixels(&scene.headless.image(), &image), 0);
    // With more room, the volume gets its occlusion, and reports it.
    scene.set_mode(ShadingMode::Cao);
    *scene.world().resource_mut::<VolumeBudget>() = default();
    scene.headless.frames(3);
    assert!(different_pixels(&scene.headless.image(), &image) > 500);
    assert_eq!(scene.world().resource::<Told>().occluded.len(), 2);
}

#[test]
fn a_volume_that_was_refused_comes_when_another_goes() {
    let bytes = bytes_of_rays();
    let mut scene = scene(false, FEW_RAYS.into());
    scene.world().resource_mut::<VolumeBudget>().max_bytes = bytes;
    scene.settle();
    let image = scene.headless.image();
    assert!(!is_empty(&image));
    let first = scene.volume;
    let world = scene.world();
    let data = world.resource_mut::<Assets<Volume>>().add(volume(false));
    let function = world.get::<VolumeTransferFunction>(first).expect("a function").clone();
    let shading = world.get::<VolumeShading>(first).expect("shading").clone();
    let second = world.spawn((Volume3d(data), function, shading, few_rays())).id();
    scene.headless.frames(6);
    let told: Vec<_> = scene.world().resource::<Told>().failed.iter().map(|(entity, _)| *entity).collect();
    assert_eq!(told, [second]);
    scene.world().despawn(first);
    scene.headless.frames(4);
    assert_eq!(different_pixels(&scene.headless.image(), &image), 0);
    assert_eq!(scene.world().resource::<Told>().failed.len(), 1);
}

#[test]
fn a_volume_that_was_halved_is_whole_when_another_goes() {
    let bytes = bytes_of_rays();
    let mut scene = scene(false, FEW_RAYS.into());
    scene.settle();
    let image = scene.headless.image();
    // The second volume fits beside the first only at half its size.
    *scene.world().resource_mut::<VolumeBudget>() = VolumeBudget { max_bytes: 2 * bytes - 1, halves: true };
    let first = scene.volume;
    let world = scene.world();
    let data = world.resource_mut::<Assets<Volume>>().add(volume(false));
    let function = world.get::<VolumeTransferFunction>(first).expect("a function").clone();
    let shading = world.get::<VolumeShading>(first).expect("shading").clone();
    let second = world.spawn((Volume3d(data), function, shading, few_rays(), Visibility::Hidden)).id();
    // The second volume is halved in the background.
    let are_both_there =
        |headless: &Headless| headless.app.world().resource::<RenderStatus>().usage.bytes > bytes;
    assert!(scene.headless.frames_until(are_both_there), "the second does not come");
    scene.world().despawn(first);
    scene.world().entity_mut(second).insert(Visibility::Visible);
    scene.headless.frames(6);
    assert_eq!(different_pixels(&scene.headless.image(), &image), 0);
    assert!(scene.world().resource::<Told>().failed.is_empty());
}

#[test]
fn every_failure_is_told_once_with_its_reason() {
    let mut scene = scene(false, FEW_RAYS.into());
    scene.settle();
    let before = {
        scene.headless.frame();
        scene.headless.image()
    };
    let volume = scene.volume;
    let missing = scene.world().resource::<AssetServer>().load::<Volume>("no_such_file.nrrd");
    scene.world().entity_mut(volume).insert(Volume3d(missing.clone()));
    let is_told = |scene: &mut TestScene, count: usize| {
        for _ in 0..200 {
            scene.headless.frame();
            std::thread::sleep(std::time::Duration::from_millis(2));
            if scene.world().resource::<Told>().failed.len() >= count {
                break;
            }
        }
        scene.headless.frames(4);
        scene.world().resource::<Told>().failed.len() == count
    };
    assert!(is_told(&mut scene, 1));
    assert_eq!(different_pixels(&scene.headless.image(), &before), 0, "the old volume is gone");
    // A new entity with a file that failed before is reported too, once.
    let late = scene.world().spawn(Volume3d(missing)).id();
    assert!(is_told(&mut scene, 2));
    let function = scene.world().resource::<AssetServer>().load::<TransferFunction>("no_such_function.vp");
    scene.world().entity_mut(volume).insert(VolumeTransferFunction(function));
    assert!(is_told(&mut scene, 3));
    let told = &scene.world().resource::<Told>().failed;
    assert!(matches!(&told[0], (entity, VolumeFailure::Volume(_)) if *entity == volume));
    assert!(matches!(&told[1], (entity, VolumeFailure::Volume(_)) if *entity == late));
    assert!(matches!(&told[2], (entity, VolumeFailure::TransferFunction(_)) if *entity == volume));
    for (_, reason) in told {
        let text = reason.to_string();
        assert_eq!(text.matches("no_such_f").count(), 1, "`{text}` names the file once");
    }
}
