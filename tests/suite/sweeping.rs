//! Occlusion sweeping on the GPU against its formulas, evaluated in double precision, voxel after voxel.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::{
    diagnostics::RenderStatus,
    occlusion::{GeometryTerm, OcclusionSweeping, SweepingSurface},
    prelude::*,
    render::VolumeTexture,
    volume::VolumeGeometry,
};
use contextual_ao_kit::mode::ShadingMode;

use crate::{
    headless::voxel_at,
    scene::{TestScene, folded_volume, is_empty, opaque_ramp, translucent_ramp, volume_from},
};

/// A grid of numbers, x fastest.
struct Grid {
    size: UVec3,
    spacing: DVec3,
}

impl Grid {
    fn index(&self, voxel: UVec3) -> usize {
        ((voxel.z * self.size.y + voxel.y) * self.size.x + voxel.x) as usize
    }

    fn voxels(&self) -> impl Iterator<Item = UVec3> {
        let size = self.size;
        (0..size.element_product()).map(move |index| voxel_at(index, size))
    }

    /// Voxels in the order of a sweep whose light comes from an octant.
    fn sweep(&self, octant: usize) -> impl Iterator<Item = UVec3> {
        let size = self.size;
        self.voxels().map(move |voxel| {
            let turned = |axis: usize| {
                if octant >> axis & 1 == 1 { size[axis] - 1 - voxel[axis] } else { voxel[axis] }
            };
            UVec3::new(turned(0), turned(1), turned(2))
        })
    }

    /// A neighbour along an axis, if it is in the grid.
    fn neighbor(&self, voxel: UVec3, axis: usize, forward: bool) -> Option<usize> {
        let mut neighbor = voxel;
        neighbor[axis] = if forward { voxel[axis] + 1 } else { voxel[axis].checked_sub(1)? };
        (neighbor[axis] < self.size[axis]).then(|| self.index(neighbor))
    }

    /// Visibilities of all octants, by equation 6.
    fn visibilities(&self, transmittance: &[f64]) -> [Vec<f64>; 8] {
        core::array::from_fn(|octant| {
            let mut visibility = vec![1.0; transmittance.len()];
            for voxel in self.sweep(octant) {
                let light = |axis: usize| match self.neighbor(voxel, axis, octant >> axis & 1 == 1) {
                    Some(neighbor) => visibility[neighbor] * transmittance[neighbor],
                    None => 1.0,
                };
                visibility[self.index(voxel)] = (light(0) + light(1) + light(2)) / 3.0;
            }
            visibility
        })
    }

    /// Signed distances by fast sweeping (equation 1, for any spacing). Differences above 0 are inside.
    fn distances(&self, differences: &[f64]) -> Vec<f64> {
        let mut distances: Vec<f64> = Vec::new();
        for voxel in self.voxels() {
            let here = differences[self.index(voxel)];
            let mut closeness = 0.0;
            for axis in 0..3 {
                let ways = [false, true].into_iter().filter_map(|forward| {
                    let there = differences[self.neighbor(voxel, axis, forward)?];
                    ((here > 0.0) != (there > 0.0)).then(|| here / (here - there))
                });
                let way = ways.fold(f64::INFINITY, f64::min);
                closeness += (way.max(1e-6) * self.spacing[axis]).powi(-2);
            }
            distances.push(if closeness > 0.0 { closeness.powf(-0.5) } else { 1e18 });
        }
        for octant in 0..8 {
            for voxel in self.sweep(octant) {
                let before = |axis: usize| {
                    let neighbor = self.neighbor(voxel, axis, octant >> axis & 1 == 1);
                    (neighbor.map_or(1e18, |neighbor| distances[neighbor]), self.spacing[axis])
                };
                let found = distance_beyond([before(0), before(1), before(2)]);
                let known = &mut distances[self.index(voxel)];
                *known = known.min(found);
            }
        }
        let signed = distances.iter().zip(differences);
        signed.map(|(distance, inside)| if *inside > 0.0 { -distance } else { *distance }).collect()
    }
}

/// Distance d with the sum of ((d - a) / h)² = 1 over the neighbours nearer than d.
fn distance_beyond(mut neighbors: [(f64, f64); 3]) -> f64 {
    neighbors.sort_by(|a, b| a.0.total_cmp(&b.0));
    let nearest = neighbors[0].0;
    let mut sums = [0.0, 0.0, -1.0];
    let mut found = 0.0;
    for (k, (a, h)) in neighbors.into_iter().enumerate() {
        let (a, w) = (a - nearest, 1.0 / (h * h));
        if k > 0 && found <= a {
            break;
        }
        sums = [sums[0] + w, sums[1] + w * a, sums[2] + w * a * a];
        found = (sums[1] + (sums[1] * sums[1] - sums[0] * sums[2]).max(0.0).sqrt()) / sums[0];
    }
    nearest + found
}

struct Case {
    size: UVec3,
    spacing: DVec3,
    function: TransferFunction,
    sweeping: OcclusionSweeping,
    sky: Sky,
    is_carved: bool,
}

impl Default for Case {
    fn default() -> Self {
        Self {
            size: UVec3::new(19, 22, 17),
            spacing: DVec3::ONE,
            function: opaque_ramp(),
            sweeping: OcclusionSweeping { gamma: 1.0, ..default() },
            sky: default(),
            is_carved: false,
        }
    }
}

impl Case {
    /// The scene with its occlusion computed, the opacities of its voxels, and their visibilities of every octant by
    /// the formulas.
    fn run(&self) -> (TestScene, Vec<f64>, [Vec<f64>; 8]) {
        let volume = folded_volume(self.size, self.spacing);
        let values: Vec<f64> = (0..self.size.element_product())
            .map(|index| volume.value_at(voxel_at(index, self.size)).unwrap_or_default())
            .collect();
        let occlusion =
            AmbientOcclusion { method: OcclusionMethod::Sweeping(self.sweeping), sky: self.sky, ..default() };
        let mut scene = TestScene::new(volume, self.function.clone(), occlusion, ShadingMode::Cao);
        if self.is_carved {
            // A voxel's opacity then tells whether it is clipped.
            scene.set_clip(|settings| settings.coverage = CoverageRule::Center);
            // The third of the patient's axes is upright.
            let place = 0.3 * self.size.as_vec3() * self.spacing.as_vec3();
            let place = Transform::from_xyz(place.x, place.z, place.y);
            scene.carve(Sphere::new(6.0), ClipMesh::default(), place);
        }
        scene.settle();
        let grid = Grid { size: self.size, spacing: self.spacing };
        let opacities: Vec<f64> = scene.opacities().iter().map(|byte| f64::from(*byte) / 255.0).collect();
        let transmittance: Vec<f64> = match self.sweeping.surface {
            SweepingSurface::Opacity => {
                // Ways along the axes are 1.5 times as long as straight ones.
                let exponent = self.spacing.element_sum() / 3.0 / 1.5 / self.spacing.min_element();
                opacities.iter().map(|opacity| (1.0 - opacity).powf(exponent)).collect()
            }
            surface => {
                let isovalue = surface.isovalue().expect("a surface at an isovalue");
                let clipped = |value: &f64, opacity: f64| {
                    let inside = value - f64::from(isovalue);
                    if opacity > 0.0 { inside } else { -inside.abs() }
                };
                let differences: Vec<f64> =
                    values.iter().zip(&opacities).map(|(v, o)| clipped(v, *o)).collect();
                let distances = grid.distances(&differences);
                self.check_distances(&scene, &distances);
                let h = self.spacing.min_element();
                distances.iter().map(|distance| (distance / h + 0.5).clamp(0.0, 1.0)).collect()
            }
        };
        let alpha = f64::from(self.sweeping.opacity);
        let transmittance: Vec<f64> = transmittance.iter().map(|t| 1.0 - (1.0 - t) * alpha).collect();
        let visibilities = grid.visibilities(&transmittance);
        (scene, opacities, visibilities)
    }

    /// Weight of each octant of the grid. The grid's axes are those of volume space, in another order and sense.
    fn weights(&self) -> [f64; 8] {
        let axes = VolumeGeometry::of(&folded_volume(self.size, self.spacing)).local_from_voxel.matrix3;
        core::array::from_fn(|octant| {
            let signs = [0, 1, 2].map(|axis| if octant >> axis & 1 == 1 { 1.0 } else { -1.0 });
            let local = axes * DVec3::from_array(signs);
            f64::from(self.sky.0[local.cmpgt(DVec3::ZERO).bitmask() as usize])
        })
    }

    fn check_distances(&self, scene: &TestScene, expected: &[f64]) {
        let found = scene.headless.signed_distances(scene.volume);
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(expected) {
            let error = (f64::from(*found) - expected).abs();
            // Intensities are 32-bit floats. Cancellation in a difference of about 1 of 255 leaves 1e-5. Roots of
            // small discriminants leave the root of 1e-7, over and over.
            assert!(error <= 2e-3 * expected.abs().max(1.0), "distance {found}, expected {expected}");
        }
    }

    /// Checks the octants' mean, without a geometry term.
    fn check(&self) {
        let (scene, opacities, visibilities) = self.run();
        assert!(!self.is_carved || opacities.contains(&0.0));
        let found = scene.headless.voxels(scene.volume, VolumeTexture::Occlusion);
        let weights = self.weights();
        let sum: f64 = weights.iter().sum();
        let mut spread = [u8::MAX, u8::MIN];
        for (index, found) in found.iter().enumerate() {
            let mean = (0..8).map(|octant| weights[octant] * visibilities[octant][index]).sum::<f64>() / sum;
            let expected = 255.0 * mean.powf(1.0 / f64::from(self.sweeping.gamma));
            // Half a byte is rounding. The rest is for powers of 32-bit floats, at an error of 1e-6 of the mean.
            let error = (expected - f64::from(*found)).abs();
            assert!(error <= 0.5 + 0.25, "{index}: {found}, expected {expected}");
            spread = [spread[0].min(*found), spread[1].max(*found)];
        }
        assert!(spread[1] - spread[0] > 60, "there is little to see: {spread:?}");
    }
}

#[test]
fn opacities_stop_light_as_defined() {
    Case { is_carved: true, ..default() }.check();
    let translucent = OcclusionSweeping { opacity: 0.5, gamma: 2.0, ..default() };
    Case { function: translucent_ramp(), sweeping: translucent, ..default() }.check();
}

#[test]
fn grids_of_any_size_and_spacing_are_swept() {
    for size in [UVec3::new(5, 23, 7), UVec3::new(16, 3, 24), UVec3::new(33, 8, 9)] {
        Case { size, spacing: DVec3::new(0.7, 1.1, 1.9), ..default() }.check();
    }
}

#[test]
fn an_isosurface_stops_light_as_defined() {
    let surface = SweepingSurface::Isovalue(100.5);
    // All intensities have opacity, so a voxel's opacity tells whether it is clipped.
    let everything = TransferFunction::ramp(-100.0, 255.0, 0.9, [1.0; 3]).expect("a valid ramp");
    let sweeping = OcclusionSweeping { surface, gamma: 1.0, ..default() };
    let case = Case { function: everything, sweeping, is_carved: true, ..default() };
    case.check();
    Case { spacing: DVec3::new(0.7, 1.1, 1.9), size: UVec3::new(21, 7, 18), ..case }.check();
}

#[test]
fn light_comes_from_the_octants_of_the_sky() {
    Case { sky: Sky::octant(2), ..default() }.check();
    Case { sky: Sky([1.0, 0.0, 2.0, 0.5, 0.0, 0.0, 3.0, 1.0]), ..default() }.check();
}

#[test]
fn all_octants_are_kept_for_the_geometry_term() {
    let sweeping = OcclusionSweeping { geometry_term: GeometryTerm::Cosine, ..default() };
    let (scene, _, visibilities) = Case { sweeping, ..default() }.run();
    let bytes = scene.headless.texels(scene.volume, VolumeTexture::Occlusion);
    let voxels = visibilities[0].len();
    assert_eq!(bytes.len(), 8 * voxels);
    for (octant, visibilities) in visibilities.iter().enumerate() {
        for (index, visibility) in visibilities.iter().enumerate() {
            let found = bytes[4 * (octant / 4 * voxels + index) + octant % 4];
            assert!((255.0 * visibility - f64::from(found)).abs() <= 0.51, "{octant} {index}");
        }
    }
}

#[test]
fn distances_are_those_of_a_sphere() {
    const SIZE: u32 = 28;
    // Largest and mean error, in voxels, for a sphere of half the grid's width.
    let errors = |size: u32| {
        let spacing = f64::from(SIZE) / f64::from(size);
        let radius = 0.25 * f64::from(SIZE);
        let half = 0.5 * f64::from(SIZE);
        let at = move |p: DVec3| half * p.length() - radius;
        // Intensity is linear in the distance near the surface.
        let volume = volume_from(UVec3::splat(size), DVec3::splat(spacing), |p| 0.5 - at(p) / half);
        let surface = SweepingSurface::Isovalue(127.5);
        let occlusion = AmbientOcclusion::by(OcclusionSweeping { surface, ..default() });
        let mut scene = TestScene::new(volume, opaque_ramp(), occlusion, ShadingMode::Cao);
        scene.settle();
        let found = scene.headless.signed_distances(scene.volume);
        let centers = (0..size.pow(3)).map(|index| {
            (voxel_at(index, UVec3::splat(size)).as_dvec3() + 0.5) / f64::from(size) * 2.0 - 1.0
        });
        let errors = centers.zip(found).map(|(p, found)| (f64::from(found) - at(p)).abs() / spacing);
        errors.fold((0f64, 0.0), |(most, sum), error| (most.max(error), sum + error / f64::from(size.pow(3))))
    };
    let (coarse, fine) = (errors(14), errors(28));
    println!("errors of distances, voxels: {coarse:?}, {fine:?}");
    // In mm, finer voxels bring smaller errors.
    assert!(fine.1 < 0.75 * 2.0 * coarse.1, "{coarse:?} {fine:?}");
    // The method is of first order: errors grow by the logarithm of the distance from the surface. In voxels, they
    // hardly change with the voxels' size. The largest errors are at the corners and the centre.
    assert!(coarse.0 < 1.0 && fine.0 < 1.0, "{coarse:?} {fine:?}");
    assert!(coarse.1 < 0.4 && fine.1 < 0.4, "{coarse:?} {fine:?}");
}

#[test]
fn methods_on_the_way_leave_no_trace_and_nothing_is_swept_at_rest() {
    let sweeping = |geometry_term| OcclusionSweeping { geometry_term, opacity: 0.7, ..default() };
    for geometry_term in [GeometryTerm::None, GeometryTerm::Cosine, GeometryTerm::BothSides] {
        let (mut scene, ..) = Case { sweeping: sweeping(geometry_term), ..default() }.run();
        let image = scene.headless.image();
        assert!(!is_empty(&image));
        let jobs = |scene: &TestScene| scene.status().passes.jobs(OcclusionSweeping::SPAN);
        scene.headless.frames(2);
        let before: RenderStatus = scene.status();
        assert!(jobs(&scene) > 0);
        scene.headless.frames(3);
        assert_eq!(before.passes.total_jobs(), scene.status().passes.total_jobs());
        // The method changes, and changes back.
        let volume = scene.volume;
        let mut method = |method| {
            if let Some(mut occlusion) = scene.world().get_mut::<AmbientOcclusion>(volume) {
                occlusion.method = method;
            }
            scene.settle();
        };
        method(OcclusionMethod::Sweeping(sweeping(GeometryTerm::None)));
        method(default());
        method(OcclusionMethod::Sweeping(sweeping(geometry_term)));
        assert!(scene.headless.image() == image);
    }
}

#[test]
fn settings_without_sense_are_harmless() {
    let wild = [
        OcclusionSweeping {
            surface: SweepingSurface::Isovalue(f32::NAN),
            opacity: f32::NAN,
            gamma: 0.0,
            ..default()
        },
        OcclusionSweeping {
            surface: SweepingSurface::Isovalue(f32::INFINITY),
            geometry_term: GeometryTerm::BothSides,
            opacity: 1e9,
            gamma: f32::INFINITY,
            light: Some(Vec3::NAN),
        },
        OcclusionSweeping { opacity: -1.0, gamma: f32::NAN, light: Some(Vec3::ZERO), ..default() },
        OcclusionSweeping { surface: SweepingSurface::Isosurface(f32::NAN), ..default() },
        OcclusionSweeping { surface: SweepingSurface::Isosurface(-f32::INFINITY), opacity: 0.0, ..default() },
    ];
    for sweeping in wild {
        let occlusion = AmbientOcclusion::by(sweeping);
        let volume = folded_volume(UVec3::new(9, 10, 11), DVec3::ONE);
        let mut scene = TestScene::new(volume, opaque_ramp(), occlusion, ShadingMode::Cao);
        scene.settle();
        let found = scene.headless.voxels(scene.volume, VolumeTexture::Occlusion);
        // No voxel is inside, or all voxels let light through.
        assert!(found.len() >= 9 * 10 * 11 && found.iter().all(|byte| *byte == u8::MAX), "{sweeping:?}");
    }
}
