//! Small motions: how much coverage, occlusion and image change from one frame to the next. The published coverage
//! rule and the default are compared. Both are also compared with the exact coverage.

use crate::mode::ShadingMode;
use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::occlusion::Optimizations;
use bevy_contextual_ao::{prelude::*, volume::VolumeGeometry};

use super::{
    super::{
        headless::voxel_at,
        inside::InsideTest,
        random::Random,
        shapes::Triangles,
        small_scene::{TestScene, few_rays, opaque_ramp, solid_volume},
    },
    Figure,
    changes::Changes,
    rule_name,
};

/// The published rule first, then the default.
const RULES: [CoverageRule; 2] = [CoverageRule::Points, CoverageRule::Lines];
const SIZE: UVec3 = UVec3::new(32, 30, 28);
/// Place of the carvers: the corner of the volume that the camera sees.
const PLACE: Vec3 = Vec3::new(6.0, 6.0, 7.0);

/// Rays of pixels at outlines that are compared in multisampled views.
const OUTLINE_RAYS: [(u32, &str); 4] = [
    (1, "one ray a pixel"),
    (4, "4 rays at outlines"),
    (8, "8 rays at outlines"),
    (32, "32 rays at outlines"),
];

struct Case {
    name: &'static str,
    mesh: Triangles,
    pose: Transform,
}

fn cases() -> [Case; 6] {
    let at = Transform::from_translation(PLACE);
    let oblique = Vec3::new(1.0, 2.0, 3.0).normalize();
    let tilted = at.with_rotation(Quat::from_axis_angle(oblique, 30f32.to_radians()));
    let cuboid = || Triangles::cuboid(Vec3::new(14.0, 11.0, 12.0));
    let torus = || Triangles::torus(8.0, 3.0, 96, 48);
    [
        Case { name: "sphere", mesh: Triangles::sphere(8.0, 48), pose: at },
        Case { name: "box", mesh: cuboid(), pose: at },
        Case { name: "box at 30 degrees", mesh: cuboid(), pose: tilted },
        Case { name: "torus", mesh: torus(), pose: at },
        Case { name: "torus at 30 degrees", mesh: torus(), pose: tilted },
        Case { name: "sphere of a voxel's radius", mesh: Triangles::sphere(1.0, 24), pose: at },
    ]
}

/// A solid, opaque volume with one carver at a time. The opacity of a voxel is its coverage.
pub struct SolidScene {
    pub scene: TestScene,
    carver: Option<Entity>,
}

impl Default for SolidScene {
    fn default() -> Self {
        let scene = TestScene::new(solid_volume(SIZE), opaque_ramp(), few_rays(), ShadingMode::Cao);
        Self { scene, carver: None }
    }
}

impl SolidScene {
    /// Sets the samples of a pixel, and its rays at an outline.
    fn set_samples(&mut self, msaa: Msaa, rays: u32) {
        let volume = self.scene.volume;
        let world = self.scene.world();
        world.get_mut::<VolumeShading>(volume).expect("shading").outline_rays = rays;
        let cameras: Vec<_> = world.query_filtered::<Entity, With<Camera3d>>().iter(world).collect();
        for camera in cameras {
            world.entity_mut(camera).insert(msaa);
        }
    }

    /// Carves with a mesh, which replaces the mesh before.
    pub fn carve(
        &mut self,
        mesh: &Triangles,
        pose: Transform,
        change: impl FnOnce(&mut ClipSettings),
    ) -> Entity {
        if let Some(before) = self.carver.take() {
            self.scene.world().despawn(before);
        }
        self.scene.set_clip(change);
        let carver = self.scene.carve_with(mesh, pose);
        self.carver = Some(carver);
        self.scene.settle();
        carver
    }
}

/// Changes of coverage, occlusion and image.
#[derive(Default)]
struct Watched([Changes; 3]);

const WATCHED: [[&str; 2]; 3] = [
    ["largest change of coverage", "RMS change of coverage"],
    ["largest change of occlusion", "RMS change of occlusion"],
    ["largest change of the image", "RMS change of the image"],
];

impl Watched {
    fn of(
        solid: &mut SolidScene,
        case: &Case,
        rule: CoverageRule,
        frames: u32,
        pose: impl Fn(u32) -> Transform,
    ) -> Self {
        // Occlusion is also watched where the camera does not see it.
        solid.scene.world().insert_resource(Optimizations { demand: false, ..default() });
        let carver = solid.carve(&case.mesh, case.pose, |clip| clip.coverage = rule);
        let scene = &mut solid.scene;
        let mut watched = Self::default();
        for frame in 0..=frames {
            scene.move_carver(carver, pose(frame));
            scene.headless.frame();
            let seen = |bytes: Vec<u8>| bytes.into_iter().map(Some).collect();
            let now = [seen(scene.opacities()), scene.occlusion(), seen(scene.headless.image())];
            for (changes, now) in watched.0.iter_mut().zip(now) {
                changes.add(now);
            }
        }
        watched
    }
}

/// Compares both rules. `bounds_largest` bounds the default's largest change of coverage, as a share of the published
/// rule's.
fn compare(
    solid: &mut SolidScene,
    (name, case): (String, &Case),
    frames: u32,
    pose: impl Fn(u32) -> Transform,
    bounds_largest: Option<f64>,
    report: &mut impl FnMut(Figure),
) {
    let watched = RULES.map(|rule| Watched::of(solid, case, rule, frames, &pose));
    for (k, figures) in WATCHED.into_iter().enumerate() {
        let [published, default] = [&watched[0].0[k], &watched[1].0[k]];
        for (rule, changes, other) in [(RULES[0], published, default), (RULES[1], default, published)] {
            let is_bounded = rule == CoverageRule::Lines && k == 0;
            let bound = bounds_largest.filter(|_| is_bounded).map(|share| share * published.largest());
            let figure = |figure, value, bound| Figure {
                case: name.clone(),
                method: rule_name(rule).into(),
                figure,
                unit: "of full range",
                bound,
                value,
            };
            report(figure(figures[0], changes.largest(), bound));
            report(figure(figures[1], changes.rms(other), None));
        }
    }
}

/// Moves carvers by 1/32 voxel per frame, in an oblique direction and along a grid axis.
pub fn sweeps(frames: u32, report: &mut impl FnMut(Figure)) {
    let mut solid = SolidScene::default();
    for case in &cases() {
        for (direction, name) in [(Vec3::new(0.48, 0.6, 0.64), "oblique"), (Vec3::X, "along x")] {
            let pose = |frame| {
                let moved = case.pose.translation + direction * (frame as f32 / 32.0);
                case.pose.with_translation(moved)
            };
            // The default at least halves the largest change.
            let name = format!("sweep {name}, {}", case.name);
            compare(&mut solid, (name.clone(), case), frames, pose, Some(0.5), report);
            // The outline of an upright box lies on the volume's faces, and stays there.
            let is_told = case.pose.rotation != Quat::IDENTITY && direction != Vec3::X;
            for (rays, method) in OUTLINE_RAYS.into_iter().filter(|_| is_told) {
                solid.set_samples(Msaa::Sample4, rays);
                let [.., image] = Watched::of(&mut solid, case, RULES[1], frames, pose).0;
                report(Figure {
                    case: name.clone(),
                    method: method.into(),
                    figure: "largest change of the image with Msaa",
                    unit: "of full range",
                    bound: None,
                    value: image.largest(),
                });
            }
            solid.set_samples(Msaa::Off, 4);
        }
    }
}

/// Moves carvers by a tracked hand's noise: up to 0.1 mm and 0.1 degree.
pub fn tremors(frames: u32, report: &mut impl FnMut(Figure)) {
    let mut solid = SolidScene::default();
    for case in &cases()[..4] {
        let pose = |frame| {
            let mut random = Random(u64::from(frame) * 0x9e37_79b9 + 1);
            // The first values of a generator depend too plainly on its seed.
            let _ = random.point();
            Transform {
                translation: case.pose.translation + 0.1 * random.point(),
                rotation: random.rotation(0.1f32.to_radians()) * case.pose.rotation,
                scale: case.pose.scale,
            }
        };
        compare(&mut solid, (format!("tremor, {}", case.name), case), frames, pose, None, report);
    }
}

/// Error of coverage against the exact share of the box of [-1, 1]^3 voxels outside the mesh. Only voxels that the
/// surface passes through are compared.
pub fn coverage_errors(voxels: usize, report: &mut impl FnMut(Figure)) {
    let mut solid = SolidScene::default();
    for case in &cases() {
        let exact = InsideTest::new(&case.mesh);
        let [published, default] = RULES.map(|rule| {
            solid.carve(&case.mesh, case.pose, |clip| clip.coverage = rule);
            coverage_error(&solid.scene, &exact, case.pose, voxels)
        });
        for (rule, error, bound) in [(RULES[0], published, None), (RULES[1], default, Some(published))] {
            for (figure, value, bound) in [
                ("RMS error of coverage", error.rms, bound.map(|bound| bound.rms)),
                ("largest error of coverage", error.largest, bound.map(|bound| bound.largest)),
            ] {
                let (case, method) = (case.name.to_string(), rule_name(rule).to_string());
                report(Figure { case, method, figure, unit: "of full range", bound, value });
            }
        }
    }
}

/// Error of a set of values.
#[derive(Clone, Copy)]
pub struct Error {
    /// Root mean square.
    pub rms: f64,
    /// The largest.
    pub largest: f64,
}

/// Error of the coverage of a solid scene's voxels, with a mesh at a pose (mm).
pub fn coverage_error(scene: &TestScene, exact: &InsideTest, pose: Transform, voxels: usize) -> Error {
    let opacities = scene.opacities();
    let geometry = VolumeGeometry::of(&solid_volume(SIZE));
    let mesh_from_volume = pose.to_matrix().inverse();
    let mesh_point = |voxel: DVec3| {
        mesh_from_volume.transform_point3(geometry.local_from_voxel.transform_point3(voxel).as_vec3())
    };
    let voxel = |index: u32| voxel_at(index, SIZE).as_dvec3();
    // 1.74 is half the diagonal of the box: the surface passes through no farther box. Poses do not scale, so
    // distances in the mesh's space are voxels too.
    let near: Vec<u32> = (0..SIZE.element_product())
        .filter(|&index| exact.distance(mesh_point(voxel(index))) < 1.74)
        .collect();
    let (mut largest, mut squares, mut count) = (0f64, 0.0, 0);
    for &index in near.iter().step_by((near.len() / voxels).max(1)) {
        let covered = (0..4096u32)
            .filter(|k| {
                let offset = UVec3::new(k % 16, k / 16 % 16, k / 256).as_dvec3();
                !exact.contains(mesh_point(voxel(index) + (offset + 0.5) / 8.0 - 1.0))
            })
            .count();
        let error = (covered as f64 / 4096.0 - f64::from(opacities[index as usize]) / 255.0).abs();
        largest = largest.max(error);
        squares += error * error;
        count += 1;
    }
    Error { rms: (squares / count as f64).sqrt(), largest }
}
