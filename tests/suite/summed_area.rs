//! Occlusion by summed-area tables against a direct evaluation of its formulas in double precision. The evaluation visits
//! every voxel of every shell.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::{prelude::*, render::VolumeTexture};
use contextual_ao_kit::mode::ShadingMode;

use crate::{
    headless::voxel_at,
    scene::{TestScene, folded_volume, opaque_ramp, solid_volume, translucent_ramp},
};

/// Tolerance of a factor. A byte rounds by half a step. WGSL wants logarithms within 2^-21. All steps together are at most
/// 302 here, and a mean of light changes by at most half of the optical depth's change: 302 / 2^22 = 7e-5. Cancellation at an
/// optical depth of 0.01 adds 6e-8 / 0.01 = 6e-6.
const TOLERANCE: f64 = 0.5 / 255.0 + 1e-4;

/// Opacities of steps as bytes, x fastest.
struct Opacities {
    dimensions: UVec3,
    values: Vec<u8>,
}

/// Half the width of a box, voxels.
fn radii(radius_mm: f64, spacing_mm: DVec3) -> IVec3 {
    (radius_mm / spacing_mm).round().as_ivec3().clamp(IVec3::ONE, IVec3::splat(127))
}

impl Opacities {
    fn of(scene: &TestScene, dimensions: UVec3) -> Self {
        Self { dimensions, values: scene.opacities() }
    }

    fn voxels(&self) -> impl Iterator<Item = IVec3> {
        let dimensions = self.dimensions;
        (0..dimensions.element_product()).map(move |index| voxel_at(index, dimensions).as_ivec3())
    }

    /// Mean opacity of the voxels in one box that are not in another; those beyond the grid are empty. `None` if the
    /// boxes are the same.
    fn mean_between(&self, voxel: IVec3, inner: Option<IVec3>, outer: IVec3) -> Option<f64> {
        let is_within = |other: IVec3, radii: IVec3| (other - voxel).abs().cmple(radii).all();
        let others = self.voxels().zip(&self.values);
        let between = others.filter(|(other, _)| {
            is_within(*other, outer) && inner.is_none_or(|inner| !is_within(*other, inner))
        });
        let sum: u64 = between.map(|(_, value)| u64::from(*value)).sum();
        let count = |radii: IVec3| (2 * radii + 1).as_i64vec3().element_product();
        let number = count(outer) - inner.map_or(0, count);
        (number > 0).then(|| sum as f64 / 255.0 / number as f64)
    }

    /// Factor of a voxel. Shells that are empty in whole voxels thicken the one within them.
    fn factor(&self, voxel: IVec3, settings: SummedAreaOcclusion, spacing_mm: DVec3) -> f64 {
        let least_mm = spacing_mm.min_element();
        let set_mm = settings.radius_mm.map_or(10.0 * least_mm, f64::from);
        let radius_mm = set_mm.clamp(least_mm, 127.0 * spacing_mm.max_element());
        if settings.shells == 1 {
            return 1.0 - self.mean_between(voxel, None, radii(radius_mm, spacing_mm)).expect("a box");
        }
        let number = f64::from(settings.shells);
        let outer = |shell: u32| radii(radius_mm * f64::from(shell) / number, spacing_mm);
        let (mut inner, mut mean, mut through, mut light) = (None, 0.0, 1.0, 0.0);
        let steps = radius_mm / number / least_mm;
        for shell in 1..=settings.shells {
            mean = self.mean_between(voxel, inner, outer(shell)).unwrap_or(mean);
            // The integral of (1 - mean)^s over the shell's steps.
            let depth = -(1.0f64 - mean).ln() * steps;
            light += through * steps * if depth > 0.0 { (1.0 - (-depth).exp()) / depth } else { 1.0 };
            through *= (-depth).exp();
            inner = Some(outer(shell));
        }
        light / (number * steps)
    }
}

/// Creates a scene, with a ball that carves if asked for.
fn scene(volume: Volume, function: TransferFunction, carves: bool) -> TestScene {
    let mut scene = TestScene::new(volume, function, AmbientOcclusion::default(), ShadingMode::Cao);
    if carves {
        scene.carve(Sphere::new(4.5), ClipMesh::default(), Transform::from_xyz(2.0, 2.0, 3.0));
    }
    scene
}

fn set(scene: &mut TestScene, settings: SummedAreaOcclusion) {
    let volume = scene.volume;
    let mut occlusion = scene.world().get_mut::<AmbientOcclusion>(volume).expect("occlusion");
    occlusion.method = OcclusionMethod::SummedArea(settings);
}

fn factors(scene: &TestScene) -> Vec<u8> {
    scene.headless.voxels(scene.volume, VolumeTexture::Occlusion)
}

fn evaluate(scene: &mut TestScene, settings: SummedAreaOcclusion) -> Vec<u8> {
    set(scene, settings);
    scene.settle();
    factors(scene)
}

fn of(radius_mm: f32, shells: u32) -> SummedAreaOcclusion {
    SummedAreaOcclusion { radius_mm: Some(radius_mm), shells }
}

/// Compares all voxels' factors for several settings.
fn check(function: TransferFunction, carves: bool) {
    let (dimensions, spacing_mm) = (UVec3::new(13, 11, 9), DVec3::new(0.8, 1.0, 1.9));
    let mut scene = scene(folded_volume(dimensions, spacing_mm), function, carves);
    let settings = [
        of(3.3, 1),
        of(3.3, 2),
        of(3.3, 4),
        // Shells thinner than voxels.
        of(2.1, 9),
        // Larger than the grid.
        of(40.0, 1),
        of(40.0, 3),
        of(1e9, 1),
        of(1e9, 2),
        SummedAreaOcclusion::default(),
    ];
    for settings in settings {
        let found = evaluate(&mut scene, settings);
        let opacities = Opacities::of(&scene, dimensions);
        let expected: Vec<_> =
            opacities.voxels().map(|voxel| opacities.factor(voxel, settings, spacing_mm)).collect();
        assert_eq!(found.len(), expected.len());
        let errors =
            found.iter().zip(&expected).map(|(&found, expected)| f64::from(found) / 255.0 - expected);
        let error = errors.fold(0.0, |largest, error: f64| error.abs().max(largest));
        let (least, most) = expected.iter().fold((1.0f64, 0.0f64), |(a, b), &e| (a.min(e), b.max(e)));
        println!("{settings:?}, carves {carves}: {least:.3} to {most:.3}, largest error {error:.6}");
        assert!(error <= TOLERANCE, "{settings:?}, carves {carves}: {error}");
        // The factors differ, unless the boxes are much larger than the grid.
        assert!(settings.radius_mm.is_some_and(|mm| mm > 20.0) || most - least > 0.1);
    }
}

#[test]
fn translucent_voxels_are_occluded_as_defined() {
    check(translucent_ramp(), false);
    check(translucent_ramp(), true);
}

#[test]
fn opaque_voxels_are_occluded_as_defined() {
    check(opaque_ramp(), false);
    check(opaque_ramp(), true);
}

#[test]
fn what_is_uniform_absorbs_evenly_along_the_radius() {
    let dimensions = UVec3::splat(13);
    let function = TransferFunction::ramp(-2.0, -1.0, 0.3, [1.0; 3]).expect("a valid ramp");
    let mut scene = scene(solid_volume(dimensions), function, false);
    let middle = (dimensions.element_product() / 2) as usize;
    for shells in 1..=6 {
        let found = evaluate(&mut scene, of(5.0, shells))[middle];
        let transparency = 1.0 - f64::from(scene.opacities()[middle]) / 255.0;
        // The mean of what five steps let through, wherever the light comes from.
        let along = (1.0 - transparency.powi(5)) / (-5.0 * transparency.ln());
        let expected = if shells == 1 { transparency } else { along };
        assert!((f64::from(found) / 255.0 - expected).abs() <= TOLERANCE, "{shells} shells: {found}");
    }
    // A byte of 255 is opaque, however thin a shell is.
    let function = TransferFunction::ramp(-2.0, -1.0, 1.0, [1.0; 3]).expect("a valid ramp");
    let mut scene = self::scene(solid_volume(dimensions), function, false);
    for shells in [1, 5] {
        assert_eq!(evaluate(&mut scene, of(5.0, shells))[middle], 0, "{shells} shells");
    }
}

#[test]
fn a_carver_that_goes_away_again_leaves_no_trace() {
    let mut scene = scene(folded_volume(UVec3::new(21, 18, 17), DVec3::ONE), translucent_ramp(), false);
    for settings in [of(4.0, 1), of(5.0, 3)] {
        let uncarved = evaluate(&mut scene, settings);
        let at = |x: f32| Transform::from_xyz(x, 3.0, 3.0);
        let carver = scene.carve(Sphere::new(5.0), ClipMesh::default(), at(4.0));
        scene.settle();
        let carved = factors(&scene);
        assert!(carved != uncarved, "nothing is carved");
        for x in [1.0, -3.5, 40.0] {
            scene.move_carver(carver, at(x));
            scene.headless.frame();
            assert_eq!(factors(&scene) == uncarved, x == 40.0, "at {x}");
        }
        scene.move_carver(carver, at(4.0));
        scene.headless.frame();
        assert!(factors(&scene) == carved, "another result at the same place");
        scene.world().despawn(carver);
        scene.headless.frames(2);
        assert!(factors(&scene) == uncarved, "the carver left a trace");
    }
}

/// Numbers of tables and of evaluations since the start. Passes that ran are reported a frame later.
fn jobs(scene: &mut TestScene) -> [u64; 2] {
    scene.headless.frames(2);
    let passes = scene.status().passes;
    [SummedAreaOcclusion::SPAN_TABLE, SummedAreaOcclusion::SPAN_BOXES].map(|span| passes.jobs(span))
}

#[test]
fn settings_keep_the_table_and_changed_opacities_do_not() {
    let size = UVec3::new(20, 18, 16);
    let mut scene = scene(folded_volume(size, DVec3::ONE), opaque_ramp(), false);
    let carver = scene.carve(Sphere::new(5.0), ClipMesh::default(), Transform::from_xyz(4.0, 3.0, 3.0));
    scene.settle();
    scene.headless.frame();
    let before = scene.status().usage;
    evaluate(&mut scene, of(3.0, 1));
    assert_eq!(jobs(&mut scene), [1, 1]);
    let usage = scene.status().usage;
    assert_eq!(usage.buffers, before.buffers + 1);
    assert_eq!(usage.bytes, before.bytes + 4 * u64::from(size.element_product()));
    assert_eq!(jobs(&mut scene), [1, 1], "computed anew for nothing");

    for settings in [of(6.0, 1), of(6.0, 4), of(2.0, 2), of(9.0, 9)] {
        let [tables, boxes] = jobs(&mut scene);
        let found = evaluate(&mut scene, settings);
        assert_eq!(jobs(&mut scene), [tables, boxes + 1], "{settings:?}");
        // This mode sums a table in every frame.
        scene.set_mode(ShadingMode::Lao);
        scene.headless.frame();
        assert!(factors(&scene) == found, "{settings:?}: another result by a table of its own");
        scene.set_mode(ShadingMode::Cao);
    }

    // Opacities change in the same frame as the settings, or alone.
    let changes: [fn(&mut TestScene, Entity); 3] = [
        |scene, carver| {
            set(scene, of(4.0, 2));
            scene.move_carver(carver, Transform::from_xyz(2.0, 3.0, 4.0));
        },
        |scene, carver| scene.move_carver(carver, Transform::from_xyz(1.0, 2.0, 4.0)),
        |scene, _| {
            let volume = scene.volume;
            let mut occlusion = scene.world().get_mut::<AmbientOcclusion>(volume).expect("occlusion");
            occlusion.opacities = VoxelOpacities::OfCenters;
        },
    ];
    for (number, change) in changes.into_iter().enumerate() {
        let [tables, boxes] = jobs(&mut scene);
        let old = factors(&scene);
        change(&mut scene, carver);
        scene.headless.frame();
        let found = factors(&scene);
        assert_eq!(jobs(&mut scene), [tables + 1, boxes + 1], "change {number}");
        assert!(found != old, "change {number} changes nothing");
        scene.set_mode(ShadingMode::Lao);
        scene.headless.frame();
        assert!(factors(&scene) == found, "change {number}: another result when all is computed");
        scene.set_mode(ShadingMode::Cao);
    }
}

#[test]
fn settings_without_sense_do_no_harm() {
    let mut scene = scene(folded_volume(UVec3::new(9, 7, 1), DVec3::ONE), opaque_ramp(), true);
    let narrowest = evaluate(&mut scene, of(1.0, 1));
    for radius_mm in [f32::NAN, f32::NEG_INFINITY, -3.0, 0.0] {
        assert_eq!(evaluate(&mut scene, of(radius_mm, 0)), narrowest, "{radius_mm} mm");
    }
    let widest = evaluate(&mut scene, of(127.0, 127));
    for radius_mm in [f32::INFINITY, f32::MAX] {
        assert_eq!(evaluate(&mut scene, of(radius_mm, u32::MAX)), widest, "{radius_mm} mm");
    }
    // Settings that are NaN do not keep the method busy.
    evaluate(&mut scene, of(f32::NAN, 3));
    let rested = jobs(&mut scene);
    assert_eq!(jobs(&mut scene), rested);
}
