//! Short runs of the figures of `measure --stability`. Each figure keeps within its bound.

use bevy::prelude::*;
use std::collections::HashSet;

use contextual_ao_kit::{
    shapes::Triangles,
    stability::{Figure, inside_test, motion, resolution, soak, walks},
};

/// Collects figures, and fails with those beyond their bound.
fn assert_all_hold(run: impl FnOnce(&mut Vec<Figure>)) -> Vec<Figure> {
    let mut figures = Vec::new();
    run(&mut figures);
    let broken: Vec<_> = figures.iter().filter(|figure| !figure.holds()).map(Figure::to_json).collect();
    assert!(broken.is_empty(), "{broken:#?}");
    assert!(figures.iter().any(|figure| figure.bound.is_some()), "nothing was bounded");
    figures
}

/// Values of the figures of a name, published rule first.
fn values(figures: &[Figure], name: &str) -> Vec<f64> {
    let values: Vec<_> =
        figures.iter().filter(|figure| figure.figure == name).map(|figure| figure.value).collect();
    assert!(!values.is_empty(), "no figure is called {name}");
    values
}

#[test]
fn small_motions_change_little() {
    let figures = assert_all_hold(|figures| motion::sweeps(12, &mut |figure| figures.push(figure)));
    // The carver did move, and the published rule did jump.
    assert!(values(&figures, "largest change of coverage").iter().all(|&value| value > 0.0));
}

#[test]
fn coverage_is_closer_to_the_exact_share_than_published() {
    assert_all_hold(|figures| motion::coverage_errors(60, &mut |figure| figures.push(figure)));
}

#[test]
fn a_trembling_hand_flickers_less_than_published() {
    let mut figures = Vec::new();
    motion::tremors(8, &mut |figure| figures.push(figure));
    for pair in values(&figures, "RMS change of coverage").chunks(2) {
        assert!(0.0 < pair[1] && pair[1] < pair[0], "{pair:?}");
    }
}

#[test]
fn concave_meshes_carve_what_is_inside_them() {
    let figures = assert_all_hold(|figures| inside_test::shapes(32, &mut |figure| figures.push(figure)));
    let layers = values(&figures, "layers");
    assert!(layers.contains(&1.0) && layers.iter().any(|&count| count > 1.0), "{layers:?}");
}

#[test]
fn finer_maps_are_closer() {
    let mut figures = Vec::new();
    resolution::table(&[64, 512], 30, &mut |figure| figures.push(figure));
    for pair in values(&figures, "wrong points").chunks(2) {
        assert!(pair[1] < pair[0], "{pair:?}");
    }
}

#[test]
fn random_walks_leave_no_trace() {
    assert_all_hold(|figures| walks::paths(40, &mut |figure| figures.push(figure)));
}

#[test]
fn a_long_life_leaves_nothing_behind() {
    assert_all_hold(|figures| {
        // Other tests share the process: their memory is not this scene's. `measure --stability soak` bounds it.
        soak::run(150, &mut |figure| {
            figures.extend((figure.figure != soak::PROCESS_MEMORY).then_some(figure))
        });
    });
}

/// Whether every edge is shared by two triangles that run along it in opposite directions.
fn is_closed(mesh: &Triangles) -> bool {
    let edges = || mesh.indices.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
    let unique: HashSet<_> = edges().collect();
    unique.len() == 3 * mesh.indices.len() && edges().all(|(a, b)| unique.contains(&(b, a)))
}

/// Signed volume; positive where the triangles face outwards.
fn signed_volume(mesh: &Triangles) -> f32 {
    mesh.corners().map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
}

#[test]
fn the_meshes_are_closed_and_face_outwards() {
    // The expected volumes are those of the smooth shapes. The trefoil's volume was measured.
    let shapes = [
        ("sphere", Triangles::sphere(1.0, 16), 4.19),
        ("cuboid", Triangles::cuboid(Vec3::new(1.0, 2.0, 0.5)), 1.0),
        ("torus", Triangles::torus(2.0, 0.5, 64, 32), 9.87),
        ("bowl", Triangles::bowl(1.0, 0.8, 64), 1.022),
        ("trefoil tube", Triangles::trefoil_tube(1.0, 0.4, 200, 16), 14.1),
        ("L-bracket", Triangles::l_bracket(1.0, 0.3, 0.4), 0.204),
        ("two spheres", Triangles::two_spheres(1.0, 3.0, 16), 8.38),
    ];
    for (name, mesh, volume) in shapes {
        assert!(is_closed(&mesh), "{name} is open");
        let found = signed_volume(&mesh);
        assert!((found / volume - 1.0).abs() < 0.03, "{name} has volume {found}, not {volume}");
        assert!(signed_volume(&mesh.flipped()) < 0.0, "{name} flipped");
    }
}
