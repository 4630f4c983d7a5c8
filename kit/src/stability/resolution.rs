//! Resolution of the clip maps against error and time, which the CAO paper leaves open (section 5).

use bevy::prelude::*;
use bevy_contextual_ao::diagnostics::{SPAN_CLIP, SPAN_DEPTH, SPAN_DILATE};

use super::{
    super::{inside::InsideTest, shapes::Triangles},
    Figure,
    inside_test::Judge,
    motion::{SolidScene, coverage_error},
};

/// Measures maps of these sizes.
pub fn table(sizes: &[u32], voxels: usize, report: &mut impl FnMut(Figure)) {
    let tilted =
        Transform::from_xyz(6.0, 6.0, 7.0).with_rotation(Quat::from_euler(EulerRot::XYZ, 0.4, 0.7, 0.2));
    let shapes = [
        ("sphere", Triangles::sphere(9.0, 64)),
        // Turned in its own space, so that the clip camera sees slanted faces.
        ("turned box", Triangles::cuboid(Vec3::new(14.0, 11.0, 12.0)).rotated(Quat::from_rotation_x(0.5))),
        ("trefoil tube", Triangles::trefoil_tube(3.0, 1.2, 240, 24)),
    ];
    let (mut solid, mut judge) = (SolidScene::default(), Judge::new(40));
    for (name, mesh) in shapes {
        let exact = InsideTest::new(&mesh);
        for &size in sizes {
            solid.carve(&mesh, tilted, |clip| clip.depth_map_size = size);
            let scene = &mut solid.scene;
            let error = coverage_error(scene, &exact, tilted, voxels);
            let wrong = judge.judge(&mesh, &mesh, |clip| clip.depth_map_size = size);
            scene.headless.frame();
            let maps_ms = scene.headless.pass_ms(SPAN_DEPTH) + scene.headless.pass_ms(SPAN_DILATE);
            let figures = [
                ("RMS error of coverage", "of full range", error.rms),
                ("wrong points", "share of points", wrong.wrong_share),
                ("depth and dilation maps", "ms", maps_ms),
                ("clipping the voxels", "ms", scene.headless.pass_ms(SPAN_CLIP)),
            ];
            for (figure, unit, value) in figures {
                let (case, method) = (name.to_string(), format!("{size} x {size} texels"));
                report(Figure { case, method, figure, unit, bound: None, value });
            }
        }
    }
}
