//! Occlusion by filtering against a direct evaluation of its formulas in double precision. The evaluation visits the
//! whole box around each voxel.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::{
    occlusion::{DensityEstimate, DensitySource, OcclusionFiltering, OpacityModulation},
    prelude::*,
    render::VolumeTexture,
};
use contextual_ao_kit::mode::ShadingMode;

use crate::{
    headless::{different_pixels, voxel_at},
    scene::{TestScene, folded_volume, is_empty, opaque_ramp, solid_volume, translucent_ramp, volume_from},
};

const ESTIMATES: [DensityEstimate; 4] = [
    DensityEstimate::Chebyshev,
    DensityEstimate::ChebyshevOpen,
    DensityEstimate::Power,
    DensityEstimate::Gaussian,
];
/// Lower limit of variances; smaller ones are not told apart (`estimate.wgsl`).
const LEAST_VARIANCE: f64 = 4.5 / (65_535.0 * 65_535.0);

/// Densities in [0, 1], x fastest.
struct Densities {
    dimensions: UVec3,
    values: Vec<f64>,
}

/// Statistics of the box around a voxel.
struct Found {
    mean: f64,
    variance: f64,
    lowest: f64,
    highest: f64,
}

impl Densities {
    fn index(&self, voxel: IVec3) -> usize {
        let size = self.dimensions.as_ivec3();
        ((voxel.z * size.y + voxel.y) * size.x + voxel.x) as usize
    }

    fn voxels(&self) -> impl Iterator<Item = IVec3> {
        let dimensions = self.dimensions;
        (0..dimensions.element_product()).map(move |index| voxel_at(index, dimensions).as_ivec3())
    }

    /// Statistics of the box around a voxel; densities beyond the grid are 0.
    fn around(&self, voxel: IVec3, radii: IVec3) -> Found {
        let count = (2 * radii + 1).as_dvec3().element_product();
        let (low, high) = (voxel - radii, voxel + radii);
        let last = self.dimensions.as_ivec3() - 1;
        let leaves = low.cmplt(IVec3::ZERO).any() || high.cmpgt(last).any();
        let (mut sum, mut lowest, mut highest) = (0.0, if leaves { 0.0 } else { 1.0 }, 0.0f64);
        let (low, high) = (low.max(IVec3::ZERO), high.min(last));
        let all = || {
            (low.z..=high.z)
                .flat_map(move |z| (low.y..=high.y).map(move |y| (y, z)))
                .flat_map(move |(y, z)| (low.x..=high.x).map(move |x| IVec3::new(x, y, z)))
                .map(|voxel| self.values[self.index(voxel)])
        };
        let mut inside = 0.0;
        for value in all() {
            sum += value;
            inside += 1.0;
            lowest = value.min(lowest);
            highest = value.max(highest);
        }
        let mean: f64 = sum / count;
        let squares: f64 = all().map(|value| (value - mean).powi(2)).sum();
        Found { mean, variance: (squares + (count - inside) * mean * mean) / count, lowest, highest }
    }

    fn share(&self, voxel: IVec3, radii: IVec3, estimate: DensityEstimate) -> f64 {
        let density = self.values[self.index(voxel)];
        let Found { mean, variance, lowest, highest } = self.around(voxel, radii);
        let (above, variance) = (density - mean, variance.max(LEAST_VARIANCE));
        match estimate {
            DensityEstimate::Chebyshev if above <= 1e-12 => 0.0,
            DensityEstimate::ChebyshevOpen if above <= 1e-12 => 1.0,
            DensityEstimate::Chebyshev | DensityEstimate::ChebyshevOpen => {
                1.0 - variance / (variance + above * above)
            }
            DensityEstimate::Gaussian => 0.5 * (1.0 + erf(above / (2.0 * variance).sqrt())),
            DensityEstimate::Power if density >= highest => 1.0,
            _ => {
                let t = (density - lowest) / (highest - lowest);
                t.powf((mean - lowest) / (highest - mean))
            }
        }
    }
}

/// Error function, by the paper's approximation.
fn erf(x: f64) -> f64 {
    let a = 0.140_012;
    let squared = x * x;
    let fraction = (4.0 / core::f64::consts::PI + a * squared) / (1.0 + a * squared);
    x.signum() * (1.0 - (-squared * fraction).exp()).sqrt()
}

/// The largest difference of stored bytes from values in [0, 1].
fn largest_error(stored: &[u8], expected: &[f64]) -> f64 {
    assert_eq!(stored.len(), expected.len());
    let errors = stored.iter().zip(expected).map(|(&byte, value)| (f64::from(byte) / 255.0 - value).abs());
    errors.fold(0.0, f64::max)
}

/// Tolerance of a factor: half a byte of rounding, and the error of single precision in powers and exponentials.
const TOLERANCE: f64 = 0.5 / 255.0 + 2e-4;

/// Creates a scene, with a ball that carves if asked for.
fn scene(volume: Volume, function: TransferFunction, carves: bool) -> TestScene {
    let occlusion = AmbientOcclusion::default();
    let mut scene = TestScene::new(volume, function, occlusion, ShadingMode::Cao);
    if carves {
        // A voxel is clipped or not, so its opacity tells which.
        scene.set_clip(|clip| clip.coverage = CoverageRule::Center);
        scene.carve(Sphere::new(5.5), ClipMesh::default(), Transform::from_xyz(3.0, 2.0, 4.0));
    }
    scene
}

fn set_method(scene: &mut TestScene, method: OcclusionMethod) {
    let volume = scene.volume;
    if let Some(mut occlusion) = scene.world().get_mut::<AmbientOcclusion>(volume) {
        occlusion.method = method;
    }
}

fn filter(scene: &mut TestScene, settings: OcclusionFiltering) -> Vec<u8> {
    set_method(scene, OcclusionMethod::Filtering(settings));
    scene.settle();
    scene.headless.voxels(scene.volume, VolumeTexture::Occlusion)
}

fn radii(settings: &OcclusionFiltering, spacing: DVec3) -> IVec3 {
    (f64::from(settings.radius_mm.expect("set")) / spacing)
        .round()
        .as_ivec3()
        .clamp(IVec3::ONE, IVec3::splat(127))
}

/// Compares all estimates for some radii.
fn check(scene: &mut TestScene, densities: &Densities, density: DensitySource, spacing: DVec3, mm: &[f32]) {
    for &radius_mm in mm {
        for estimate in ESTIMATES {
            let settings = OcclusionFiltering { estimate, density, radius_mm: Some(radius_mm), ..default() };
            let found = filter(scene, settings);
            let radii = radii(&settings, spacing);
            let expected: Vec<_> =
                densities.voxels().map(|voxel| densities.share(voxel, radii, estimate)).collect();
            let error = largest_error(&found, &expected);
            let mean = expected.iter().sum::<f64>() / expected.len() as f64;
            println!("{estimate:?} {density:?} {radii}: mean {mean:.3}, largest error {error:.5}");
            assert!(error <= TOLERANCE, "{estimate:?} of {density:?} with {radii}: {error}");
            // The shares are not all alike. In a very large box few voxels are above the mean, and all others are open.
            let is_wide_open = estimate == DensityEstimate::ChebyshevOpen && radii.min_element() > 100;
            assert!(is_wide_open || expected.iter().any(|share| (share - mean).abs() > 0.2));
        }
    }
}

fn densities_of_opacities(scene: &TestScene, dimensions: UVec3) -> Densities {
    let values = scene.opacities().into_iter().map(|byte| f64::from(byte) / 255.0).collect();
    Densities { dimensions, values }
}

#[test]
fn opacities_are_filtered_as_defined() {
    let (dimensions, spacing) = (UVec3::new(17, 15, 13), DVec3::new(0.8, 1.0, 1.9));
    let mut scene = scene(folded_volume(dimensions, spacing), translucent_ramp(), true);
    filter(&mut scene, default());
    let densities = densities_of_opacities(&scene, dimensions);
    assert!(densities.values.contains(&0.0));
    check(&mut scene, &densities, DensitySource::Opacity, spacing, &[0.1, 3.0, 1e9]);
}

#[test]
fn intensities_are_filtered_as_defined() {
    let (dimensions, spacing) = (UVec3::new(16, 14, 11), DVec3::ONE);
    // Intensities start above 0. All are opaque, so opacities tell which voxels are clipped.
    let volume =
        volume_from(dimensions, spacing, |p| 0.2 + 0.6 * (5.0 * p.x).sin() * (4.0 * p.y + p.z).cos());
    let range = volume.range();
    let value = |voxel: IVec3| {
        let value = volume.value_at(voxel.as_uvec3()).unwrap_or_default();
        (value - range[0]) / (range[1] - range[0])
    };
    let function = TransferFunction::ramp(-2.0, -1.0, 1.0, [1.0; 3]).expect("a valid ramp");
    let mut scene = scene(volume.clone(), function, true);
    filter(&mut scene, OcclusionFiltering { density: DensitySource::Intensity, ..default() });
    let opacities = scene.opacities();
    assert!(opacities.iter().all(|opacity| [0, 255].contains(opacity)) && opacities.contains(&0));
    let mut densities = Densities { dimensions, values: Vec::new() };
    let shown = opacities.iter().map(|&opacity| f64::from(opacity) / 255.0);
    densities.values = densities.voxels().zip(shown).map(|(voxel, shown)| shown * value(voxel)).collect();
    check(&mut scene, &densities, DensitySource::Intensity, spacing, &[1.0, 3.0, 40.0]);
}

#[test]
fn modulation_is_as_defined() {
    let (dimensions, spacing) = (UVec3::new(15, 14, 12), DVec3::ONE);
    let mut scene = scene(folded_volume(dimensions, spacing), opaque_ramp(), true);
    for estimate in ESTIMATES {
        let settings = OcclusionFiltering {
            estimate,
            density: DensitySource::Opacity,
            radius_mm: Some(2.0),
            brightness: 1.5,
            ..default()
        };
        let radii = radii(&settings, spacing);
        for modulation in [OpacityModulation::Variance(0.05), OpacityModulation::Gradient(0.2)] {
            let found = filter(&mut scene, OcclusionFiltering { modulation, ..settings });
            let densities = densities_of_opacities(&scene, dimensions);
            let share = |voxel: IVec3| densities.share(voxel, radii, estimate);
            let shares: Vec<_> = densities.voxels().map(share).collect();
            let factors: Vec<_> = shares.iter().map(|share| (1.5 * share).min(1.0)).collect();
            let drawn = densities.voxels().map(|voxel| match modulation {
                OpacityModulation::Gradient(most) => {
                    (gradient(&densities, &shares, voxel).length() / f64::from(most)).min(1.0)
                }
                OpacityModulation::Variance(most) => {
                    (densities.around(voxel, radii).variance / f64::from(most)).min(1.0)
                }
                _ => 1.0,
            });
            let drawn: Vec<_> = drawn.collect();
            let error = largest_error(&found, &factors);
            assert!(error <= 1.5 * TOLERANCE, "{estimate:?} {modulation:?}: {error}");
            let found = scene.headless.channel(scene.volume, VolumeTexture::Occlusion, 1);
            let error = largest_error(&found, &drawn);
            println!("{estimate:?} {modulation:?}: largest error of the share drawn {error:.5}");
            // The gradient of the shares is divided by 0.2, which multiplies its error by five.
            assert!(error <= 0.5 / 255.0 + 5.0 * 2e-4, "{estimate:?} {modulation:?}: {error}");
            assert!(drawn.contains(&1.0) && drawn.iter().any(|&drawn| drawn < 0.5));
        }
    }
}

/// Gradient of the shares, by linear regression over the 26 neighbours. Weights are the reciprocals of their
/// distances.
fn gradient(densities: &Densities, shares: &[f64], voxel: IVec3) -> DVec3 {
    let last = densities.dimensions.as_ivec3() - 1;
    let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
    for k in (0..27).filter(|&k| k != 13) {
        let offset = IVec3::new(k % 3, k / 3 % 3, k / 9) - 1;
        let weight = offset.as_dvec3().length().recip();
        let neighbor = (voxel + offset).clamp(IVec3::ZERO, last);
        sum += weight * shares[densities.index(neighbor)] * offset.as_dvec3();
        weights += weight * f64::from(offset.x * offset.x);
    }
    sum / weights
}

#[test]
fn what_is_uniform_is_occluded_evenly() {
    let dimensions = UVec3::splat(9);
    let function = TransferFunction::ramp(-2.0, -1.0, 0.3, [1.0; 3]).expect("a valid ramp");
    let mut scene = scene(solid_volume(dimensions), function, false);
    let middle = (dimensions.element_product() / 2) as usize;
    // The box around the middle voxel is in the grid. If all intensities are the same, each is the lowest.
    for (estimate, expected) in ESTIMATES.into_iter().zip([0, 255, 255, 128]) {
        for density in [DensitySource::Opacity, DensitySource::Intensity] {
            let settings = OcclusionFiltering { estimate, density, radius_mm: Some(2.0), ..default() };
            assert_eq!(filter(&mut scene, settings)[middle], expected, "{estimate:?} {density:?}");
        }
    }
    // The middle has neither variance nor gradient.
    for modulation in [OpacityModulation::Variance(0.1), OpacityModulation::Gradient(0.1)] {
        filter(&mut scene, OcclusionFiltering { radius_mm: Some(2.0), modulation, ..default() });
        let drawn = scene.headless.channel(scene.volume, VolumeTexture::Occlusion, 1);
        assert_eq!(drawn[middle], 0);
    }
}

#[test]
fn modulation_shows_only_with_occlusion() {
    let mut scene = scene(folded_volume(UVec3::splat(16), DVec3::ONE), opaque_ramp(), false);
    scene.set_mode(ShadingMode::Solid);
    scene.settle();
    let solid = scene.headless.image();
    assert!(!is_empty(&solid));
    let with = |modulation| OcclusionMethod::Filtering(OcclusionFiltering { modulation, ..default() });
    set_method(&mut scene, with(OpacityModulation::Variance(f32::INFINITY)));
    scene.settle();
    assert_eq!(different_pixels(&scene.headless.image(), &solid), 0);
    scene.set_mode(ShadingMode::Cao);
    scene.settle();
    assert!(is_empty(&scene.headless.image()), "no variance is enough");
    // With these limits, any variance or gradient is enough.
    for modulation in [OpacityModulation::Variance(f32::NAN), OpacityModulation::Gradient(-1.0)] {
        set_method(&mut scene, with(modulation));
        scene.settle();
        let image = scene.headless.image();
        set_method(&mut scene, with(OpacityModulation::None));
        scene.settle();
        assert_eq!(different_pixels(&scene.headless.image(), &image), 0, "{modulation:?}");
    }
}

#[test]
fn filtering_follows_changes_and_rests() {
    let size = UVec3::new(20, 18, 16);
    let mut scene = scene(folded_volume(size, DVec3::ONE), opaque_ramp(), false);
    scene.settle();
    scene.headless.frame();
    let before = scene.status().usage;
    // Settings that are NaN do not keep the method busy.
    let settings = OcclusionFiltering { radius_mm: Some(f32::NAN), brightness: f32::NAN, ..default() };
    let narrow = filter(&mut scene, settings);
    assert_eq!(narrow, filter(&mut scene, OcclusionFiltering { radius_mm: Some(1.0), ..default() }));
    filter(&mut scene, settings);
    scene.headless.frames(2);
    let rested = scene.status();
    scene.headless.frames(3);
    assert_eq!(scene.status().passes, rested.passes);
    assert_eq!(rested.usage.buffers, before.buffers + 4);
    assert_eq!(rested.usage.bytes, before.bytes + 16 * u64::from(size.element_product()));

    // A moved carver is filtered once, with the result of a full recomputation.
    let carver = scene.carve(Sphere::new(5.0), ClipMesh::default(), Transform::from_xyz(4.0, 3.0, 3.0));
    scene.settle();
    scene.headless.frame();
    let jobs = scene.status().passes.jobs(OcclusionFiltering::SPAN);
    scene.move_carver(carver, Transform::from_xyz(2.0, 3.0, 4.0));
    scene.headless.frame();
    let carved = scene.headless.voxels(scene.volume, VolumeTexture::Occlusion);
    scene.headless.frames(2);
    assert_eq!(scene.status().passes.jobs(OcclusionFiltering::SPAN), jobs + 1);
    assert!(carved != narrow, "is the same");
    scene.set_mode(ShadingMode::Lao);
    scene.headless.frame();
    assert_eq!(scene.headless.voxels(scene.volume, VolumeTexture::Occlusion), carved);

    scene.set_mode(ShadingMode::Cao);
    scene.world().despawn(carver);
    set_method(&mut scene, default());
    scene.settle();
    scene.headless.frame();
    assert_eq!(scene.status().usage.buffers, before.buffers);
}
