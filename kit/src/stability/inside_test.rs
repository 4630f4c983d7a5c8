//! Concave meshes: compares the clip test for points inside with an exact test.

use crate::mode::ShadingMode;
use bevy::{math::Affine3A, prelude::*};
use bevy_contextual_ao::{clip::ClipFrame, prelude::*, volume::VolumeGeometry};

use super::{
    super::{
        headless::voxel_at,
        inside::InsideTest,
        shapes::Triangles,
        small_scene::{TestScene, few_rays, opaque_ramp, solid_volume},
    },
    Figure,
};

/// Meshes that hide parts of themselves, about 30 mm in size. Most are turned, so that no side of their bounds lies
/// along their own axes.
pub fn concave_meshes() -> Vec<(String, Triangles)> {
    let turned = |mesh: Triangles, x: f32, y: f32| {
        mesh.rotated(Quat::from_euler(EulerRot::XYZ, x.to_radians(), y.to_radians(), 0.0))
    };
    let torus = || Triangles::torus(10.0, 3.5, 96, 48);
    let mut meshes: Vec<_> = [(0, 0), (30, 0), (45, 45), (60, 20), (90, 0), (0, 90)]
        .into_iter()
        .map(|(x, y)| (format!("torus turned {x}, {y} degrees"), turned(torus(), x as f32, y as f32)))
        .collect();
    let bowl = || Triangles::bowl(14.0, 11.0, 64);
    let bracket = || Triangles::l_bracket(24.0, 7.0, 14.0);
    let spheres = || Triangles::two_spheres(6.0, 16.0, 24);
    // The blocks share a face, where their triangles coincide.
    let blocks = Triangles::cuboid(Vec3::new(8.0, 20.0, 8.0))
        .merged(Triangles::cuboid(Vec3::new(8.0, 8.0, 8.0)).translated(Vec3::new(8.0, 6.0, 0.0)));
    let overlapping =
        Triangles::sphere(8.0, 24).merged(Triangles::sphere(8.0, 24).translated(Vec3::new(3.0, 4.0, 6.0)));
    meshes.extend(
        [
            ("bowl", bowl()),
            ("bowl turned", turned(bowl(), 65.0, 20.0)),
            ("trefoil tube", Triangles::trefoil_tube(4.5, 1.8, 240, 24)),
            ("trefoil tube turned", turned(Triangles::trefoil_tube(4.5, 1.8, 240, 24), 80.0, 30.0)),
            ("L-bracket", bracket()),
            ("L-bracket turned", turned(bracket(), 50.0, 40.0)),
            ("two spheres", turned(spheres(), 0.0, 85.0)),
            ("two blocks that share a face", turned(blocks, 20.0, 70.0)),
            ("two spheres that overlap", overlapping),
            ("flipped bowl", turned(bowl().flipped(), 65.0, 20.0)),
        ]
        .map(|(name, mesh)| (name.to_string(), mesh)),
    );
    meshes
}

/// Tests the voxel centres of a cube with every concave mesh. `voxels` counts along each side.
pub fn shapes(voxels: u32, report: &mut impl FnMut(Figure)) {
    let mut cases: Vec<_> =
        concave_meshes().into_iter().map(|(name, mesh)| (name, mesh.clone(), mesh, Some(0.0))).collect();
    // Flipped faces may balance along a line of sight. Then the inside cannot be told.
    let bowl = Triangles::bowl(14.0, 11.0, 64).rotated(Quat::from_rotation_x(1.1));
    cases.push(("bowl, every other face flipped".into(), bowl.clone().half_flipped(), bowl, None));
    let mut judge = Judge::new(voxels);
    for (name, mesh, truth, bound) in cases {
        let verdict = judge.judge(&mesh, &truth, |_| {});
        let figure = |figure, unit, bound, value| Figure {
            case: name.clone(),
            method: "peeled layers".into(),
            figure,
            unit,
            bound,
            value,
        };
        report(figure("layers", "pairs of depths", None, f64::from(verdict.layers)));
        report(figure("wrong more than a texel from the surface", "points", bound, verdict.far_wrong as f64));
        report(figure("wrong at all", "share of points", None, verdict.wrong_share));
    }
}

/// Errors of the clip test.
pub struct Verdict {
    /// Layers of the depth maps.
    pub layers: u32,
    /// Wrong points that are farther than a depth texel from the surface.
    pub far_wrong: usize,
    /// Share of points that are wrong, near the surface or not.
    pub wrong_share: f64,
    /// Points inside.
    pub inside: usize,
}

/// A cube of voxels. Their centres are tested.
pub struct Judge {
    scene: TestScene,
    voxels: u32,
    carver: Option<Entity>,
}

impl Judge {
    /// Creates a cube with `voxels` per side.
    pub fn new(voxels: u32) -> Self {
        let volume = solid_volume(UVec3::splat(voxels));
        let mut scene = TestScene::new(volume, opaque_ramp(), few_rays(), ShadingMode::Phong);
        scene.set_clip(|clip| clip.coverage = CoverageRule::Center);
        Self { scene, voxels, carver: None }
    }

    /// Compares the clip test of `mesh` with the exact test of `truth`, which has the same bounds.
    pub fn judge(
        &mut self,
        mesh: &Triangles,
        truth: &Triangles,
        change: impl FnOnce(&mut ClipSettings),
    ) -> Verdict {
        let (lower, upper) = mesh.positions.iter().fold((Vec3::MAX, Vec3::MIN), |(lower, upper), &p| {
            (lower.min(Vec3::from(p)), upper.max(Vec3::from(p)))
        });
        let to_center = Affine3A::from_translation(-0.5 * (lower + upper));
        let centered = mesh.clone().transformed(to_center);
        let half = 0.5 * (upper - lower);
        let size = UVec3::splat(self.voxels);
        let geometry = VolumeGeometry::of(&solid_volume(size));
        // The mesh fills the volume except for a voxel. Odd factors keep its flat faces off voxel centres.
        let fit = (0.5 * self.voxels as f32 - 1.07) / half.max_element();
        let scene = &mut self.scene;
        if let Some(before) = self.carver.take() {
            scene.world().despawn(before);
        }
        scene.set_clip(change);
        let map_size = scene.world().resource::<ClipSettings>().depth_map_size;
        self.carver = Some(scene.carve_with(&centered, Transform::from_scale(Vec3::splat(fit))));
        scene.settle();
        scene.headless.frame();
        // Larger side of a texel, mesh units. The clip camera looks along the shortest side of the mesh.
        let frame = ClipFrame::around(Vec3::ZERO, half).expect("the mesh has an extent");
        let texels_per_unit = frame.clip_from_local().matrix3.transpose();
        let texel =
            (texels_per_unit.x_axis.length().min(texels_per_unit.y_axis.length()) * map_size as f32).recip();
        let exact = InsideTest::new(&truth.clone().transformed(to_center));
        let opacities = scene.opacities();
        let (mut far_wrong, mut wrong, mut inside) = (0, 0, 0);
        for (index, &opacity) in (0u32..).zip(&opacities) {
            let voxel = voxel_at(index, size);
            let p = geometry.local_from_voxel.transform_point3(voxel.as_dvec3()).as_vec3() / fit;
            let is_inside = exact.contains(p);
            inside += usize::from(is_inside);
            if is_inside != (opacity == 0) {
                wrong += 1;
                far_wrong += usize::from(exact.distance(p) > texel);
            }
        }
        let layers = scene.status().clip_layers;
        Verdict { layers, far_wrong, wrong_share: wrong as f64 / opacities.len() as f64, inside }
    }
}
