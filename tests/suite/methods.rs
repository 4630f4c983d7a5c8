//! Known failures of the methods of ambient occlusion, and cases that must not fail. The tests compare some figures
//! of `measure --stability methods`.

use bevy_contextual_ao::prelude::*;

use contextual_ao_kit::stability::methods::{columns, motion, places};

fn method(name: &str) -> AmbientOcclusion {
    let column = columns().into_iter().find(|column| column.name == name);
    column.expect("a column of that name").occlusion
}

/// Error of a factor from rounding alone: half a byte, where images are half as bright as possible.
const ROUNDING: f64 = 0.004;

#[test]
fn what_is_carved_away_leaves_no_ghost() {
    for name in ["rays", "rays, half", "sweeping", "filtering, Chebyshev", "SAT", "screen space"] {
        let ghost = motion::ghost(&method(name));
        assert!(ghost.shadow > 2.0 * ROUNDING, "{name}: the block cast no shadow ({})", ghost.shadow);
        assert!(
            ghost.at_once < ROUNDING && ghost.stays < ROUNDING,
            "{name}: {} {}",
            ghost.at_once,
            ghost.stays
        );
        assert_eq!(ghost.lag, 0, "{name}");
    }
}

#[test]
fn progressive_rays_lag() {
    let ghost = motion::ghost(&method("progressive"));
    assert!(ghost.at_once > 5.0 * ROUNDING && ghost.lag > 10, "{} {}", ghost.at_once, ghost.lag);
    assert!(ghost.stays < ROUNDING, "{}", ghost.stays);
}

#[test]
fn two_eyes_see_the_same_factor_where_it_is_of_voxels() {
    // The two images' samples lie a twentieth of a voxel apart on a surface.
    let rays = places::eyes(&method("rays"));
    assert!(rays < 0.005, "{rays}");
    let screen = places::eyes(&method("screen space"));
    assert!(screen > 1.5 * rays, "screen space {screen}, rays {rays}");
}

#[test]
fn a_thin_wall_counts_for_rays_and_hardly_when_densities_are_counted() {
    let [rays, counted] = ["rays", "filtering, Chebyshev"].map(|name| places::thin(&method(name)));
    // By the definition at the floor's points, over 4096 rays: 0.75. Here opacities are means over voxels.
    assert!(rays > 0.6 && counted < 0.25, "rays {rays}, counted {counted}");
}

#[test]
fn sweeping_depends_on_the_grid_and_rays_do_not() {
    let [rays, sweeping] = ["rays", "sweeping"].map(|name| places::turned(&method(name)));
    assert!(sweeping > 1.5 * rays, "rays {rays}, sweeping {sweeping}");
}

#[test]
fn whole_voxels_pop_as_the_radius_grows() {
    let pops = |name| motion::pops(&method(name)).expect("a method with a radius");
    let (rays, counted) = (pops("rays"), pops("filtering, Chebyshev"));
    assert!(counted > 1.5 * rays, "rays {rays}, filtering {counted}");
}

#[test]
fn a_normal_distribution_is_wrong_among_several_modes() {
    let [one, three] = places::modes(&method("filtering, Gaussian")).expect("densities are counted");
    assert!(three > 1.5 * one, "one mode {one}, three {three}");
    assert_eq!(places::modes(&method("rays")), None);
}
