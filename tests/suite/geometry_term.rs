//! Drawing by occlusion sweeping with a geometry term, against its definition (Singh et al., equations 3 to 5). Each
//! octant adds its visibility times the cosine integrated over its directions. The integral is a numerical sum.

use bevy::{
    math::{DAffine3, DQuat, DVec3},
    prelude::*,
};
use bevy_contextual_ao::{
    occlusion::{GeometryTerm, OcclusionSweeping, SweepingSurface},
    prelude::*,
    render::VolumeTexture,
    volume::{Intensities, Rescale, VolumeGeometry, WORLD_UNITS_PER_MM},
};
use contextual_ao_kit::mode::ShadingMode;
use core::f64::consts::{FRAC_PI_2, PI};

use crate::{
    field::Field,
    headless::voxel_at,
    integral::{Integral, Sample, View, srgb_byte},
    scene::{IMAGE, TestScene},
};

const SIZE: UVec3 = UVec3::new(26, 22, 24);
const SPACING: DVec3 = DVec3::new(0.9, 1.1, 1.0);
/// Distance from the ball's centre, mm, at which intensity is half of the highest.
const RADIUS: f64 = 7.0;
const ISOVALUE: f32 = 127.5;

/// A ball in a rotated grid. Intensity falls outwards, over 6 mm.
fn ball() -> Volume {
    let turn = DQuat::from_scaled_axis(DVec3::new(0.4, -0.3, 0.5));
    let center = 0.5 * (SIZE.as_dvec3() - 1.0);
    let value = |index| {
        let distance = ((voxel_at(index, SIZE).as_dvec3() - center) * SPACING).length();
        (255.0 * (0.5 - (distance - RADIUS) / 6.0).clamp(0.0, 1.0)).round() as u8
    };
    let values = (0..SIZE.element_product()).map(value).collect();
    let grid = DAffine3::from_quat(turn) * DAffine3::from_scale(SPACING);
    Volume::new(SIZE, grid, Intensities::U8(values), Rescale::default()).expect("a valid volume")
}

/// Directions of an octant, along the grid's axes: `side` x `side` midpoints of equal parts of the sphere.
fn directions(octant: usize, side: u32) -> impl Iterator<Item = DVec3> {
    let signs = DVec3::from_array([0, 1, 2].map(|axis| if octant >> axis & 1 == 1 { 1.0 } else { -1.0 }));
    let middle = move |k: u32| (f64::from(k) + 0.5) / f64::from(side);
    (0..side * side).map(move |k| {
        // Even steps in height and angle are even on the sphere.
        let (height, angle) = (middle(k % side), FRAC_PI_2 * middle(k / side));
        let across = (1.0 - height * height).sqrt();
        signs * DVec3::new(across * angle.cos(), across * angle.sin(), height)
    })
}

/// The mean of a function over an octant.
fn mean_over(octant: usize, side: u32, of: impl Fn(DVec3) -> f64) -> f64 {
    let (sum, count) =
        directions(octant, side).fold((0.0, 0), |(sum, count), way| (sum + of(way), count + 1));
    sum / f64::from(count)
}

/// G_s: the geometry term g of a normal over the directions of an octant.
fn over_octant(octant: usize, normal: DVec3, term: GeometryTerm) -> f64 {
    FRAC_PI_2
        * mean_over(octant, 24, |direction| {
            let cosine = normal.dot(direction);
            if term == GeometryTerm::BothSides { cosine.abs() } else { cosine.max(0.0) }
        })
}

/// Settings to compare, and the sky that the light comes from.
struct Case {
    sweeping: OcclusionSweeping,
    sky: Sky,
}

/// Light at points, by the formulas.
struct Light {
    case: Case,
    axes: [DVec3; 3],
    /// Weight of the light from each octant of the grid.
    weights: [f64; 8],
    visibilities: [Field; 8],
}

impl Light {
    /// Light of a case. Its visibilities are those that the scene computed; `sweeping` checks them.
    fn of(case: Case, scene: &TestScene, geometry: &VolumeGeometry) -> Self {
        let bytes = scene.headless.texels(scene.volume, VolumeTexture::Occlusion);
        let voxels = SIZE.element_product() as usize;
        assert_eq!(bytes.len(), 8 * voxels);
        let visibility = |octant: usize| {
            let first = 4 * (octant / 4 * voxels) + octant % 4;
            Field::of_bytes(SIZE, (0..voxels).map(|index| bytes[first + 4 * index]))
        };
        let axes = geometry.local_from_voxel.matrix3;
        let axes = [axes.x_axis, axes.y_axis, axes.z_axis].map(DVec3::normalize);
        // The sky's octants are those of volume space, in which the grid is rotated. Few of the many directions lie
        // beside an edge.
        let weight = |way: DVec3| {
            let local = way.x * axes[0] + way.y * axes[1] + way.z * axes[2];
            f64::from(case.sky.0[local.cmpgt(DVec3::ZERO).bitmask() as usize])
        };
        let weights = core::array::from_fn(|octant| mean_over(octant, 400, weight));
        Self { case, axes, weights, visibilities: core::array::from_fn(visibility) }
    }

    /// Light at a place (voxels) on a surface with a normal.
    fn at(&self, voxel: DVec3, normal: DVec3) -> f64 {
        let Case { sweeping, .. } = &self.case;
        let normal = DVec3::from_array(self.axes.map(|axis| axis.dot(normal)));
        let most = self.weights.iter().copied().fold(0.0, f64::max);
        let lit = (0..8).filter(|&octant| self.weights[octant] > 0.0).map(|octant| {
            let term = over_octant(octant, normal, sweeping.geometry_term);
            self.weights[octant] / most * self.visibilities[octant].at(voxel) * term
        });
        let sides = if sweeping.geometry_term == GeometryTerm::BothSides { 2.0 } else { 1.0 };
        (lit.sum::<f64>() / (sides * PI)).clamp(0.0, 1.0).powf(f64::from(sweeping.gamma).recip())
    }
}

/// Cases of single octants without occlusion, and of several octants with and without it.
fn cases(surface: SweepingSurface) -> Vec<Case> {
    let sweeping = |geometry_term, opacity, gamma| OcclusionSweeping {
        surface,
        geometry_term,
        opacity,
        gamma,
        light: None,
    };
    let single = (0..8)
        .map(|octant| Case { sweeping: sweeping(GeometryTerm::Cosine, 0.0, 1.0), sky: Sky::octant(octant) });
    let some = Sky([1.0, 0.0, 2.0, 0.5, 0.0, 0.0, 3.0, 1.0]);
    let both = [
        (GeometryTerm::BothSides, 0.0, 1.0),
        (GeometryTerm::Cosine, 0.8, 2.0),
        (GeometryTerm::BothSides, 0.6, 1.0),
    ];
    let several =
        both.map(|(term, opacity, gamma)| Case { sweeping: sweeping(term, opacity, gamma), sky: some });
    let behind = Case { sweeping: sweeping(GeometryTerm::BothSides, 0.0, 1.0), sky: Sky::octant(5) };
    single.chain(several).chain([behind]).collect()
}

/// Compares every fourth pixel each way, in views from two opposite sides. `expected` gives the light of a pixel. The
/// bounds are those of the mean and of the largest difference, bytes.
fn check(
    surface: SweepingSurface,
    [most_mean, most]: [f64; 2],
    expected: impl Fn(&Light, &Volume, &TransferFunction, &View, UVec2) -> Option<f64>,
) {
    let volume = ball();
    let geometry = VolumeGeometry::of(&volume);
    let white = TransferFunction::ramp(20.0, 235.0, 0.8, [1.0; 3]).expect("a valid ramp");
    let mut scene = TestScene::with(volume.clone(), white.clone(), default(), ShadingMode::Cao, |app| {
        app.insert_resource(ClearColor(Color::BLACK));
    });
    let entity = scene.volume;
    let shading = VolumeShading { step_voxels: 0.25, jitter: false, ..default() };
    scene.world().entity_mut(entity).insert(shading);
    let camera = scene.camera();
    for (number, case) in cases(surface).into_iter().enumerate() {
        let side = if number % 2 == 0 { 1.0 } else { -1.0 };
        let place = side * Vec3::new(12.0, 14.0, 32.0) * WORLD_UNITS_PER_MM;
        let pose = Transform::from_translation(place).looking_at(Vec3::ZERO, Vec3::Y);
        let method = OcclusionMethod::Sweeping(case.sweeping);
        let name = format!(
            "{:?} of {:?}, opacity {}",
            case.sweeping.geometry_term, case.sky.0, case.sweeping.opacity
        );
        scene.world().entity_mut(camera).insert(pose);
        scene.world().entity_mut(entity).insert(AmbientOcclusion { method, sky: case.sky, ..default() });
        scene.settle();
        let image = scene.headless.image();
        let view = View::of(&mut scene, camera, IMAGE);
        let light = Light::of(case, &scene, &geometry);
        let mut differences = Vec::new();
        for index in (0..IMAGE.element_product())
            .filter(|k| (k % IMAGE.x).is_multiple_of(4) && (k / IMAGE.x).is_multiple_of(4))
        {
            let pixel = UVec2::new(index % IMAGE.x, index / IMAGE.x);
            let Some(expected) = expected(&light, &volume, &white, &view, pixel) else { continue };
            let expected = srgb_byte(expected);
            differences.push((f64::from(image[4 * index as usize]) - expected).abs());
        }
        let mean = differences.iter().sum::<f64>() / differences.len() as f64;
        let largest = differences.iter().copied().fold(0.0, f64::max);
        println!("{name}: {} pixels off by {mean:.2}, at most {largest:.2} bytes", differences.len());
        assert!(differences.len() > 60, "{name}: {} pixels", differences.len());
        assert!(mean < most_mean && largest < most, "{name}: off by {mean}, at most {largest} bytes");
    }
}

#[test]
fn a_translucent_ball_is_lit_by_the_integrated_cosine() {
    // A byte's rounding is a quarter of a byte on average. The table is off by up to 1/248, a byte, where it has a
    // kink. Under a single octant one pixel is off by 5.5 bytes; its cause is not known.
    check(SweepingSurface::Opacity, [0.8, 6.0], |light, volume, function, view, pixel| {
        let shade = |sample: &Sample| sample.color * light.at(sample.voxel, sample.local.normalize());
        let integral = Integral { shade: &shade, ..Integral::of(volume, function) };
        let shown = integral.pixel(view, pixel);
        (shown.transmittance < 0.9).then_some(shown.color.x)
    });
}

#[test]
fn an_isosurface_is_lit_by_the_integrated_cosine() {
    // Swept distances are of first order: their gradient is off by a degree or two. Under a single octant that is
    // up to 1.98 bytes on average, on three drivers.
    check(SweepingSurface::Isosurface(ISOVALUE), [2.0, 9.0], |light, volume, _, view, pixel| {
        let (origin, direction) = view.ray(pixel.as_dvec2() + 0.5);
        let origin = origin / f64::from(WORLD_UNITS_PER_MM);
        let nearest = -origin.dot(direction);
        let half = (RADIUS * RADIUS - (origin + nearest * direction).length_squared()).sqrt();
        // The outline is left out: a pixel there is larger than the surface that it shows.
        if half.is_nan() || half < 0.4 * RADIUS {
            return None;
        }
        let hit = origin + (nearest - half) * direction;
        let voxel = VolumeGeometry::of(volume).local_from_voxel.inverse().transform_point3(hit);
        Some(light.at(voxel, hit.normalize()))
    });
}
