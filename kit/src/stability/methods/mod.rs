//! Where methods of ambient occlusion fail: one figure per known weakness, for every method.

mod floor;
pub mod motion;
pub mod places;

use bevy::prelude::*;
use bevy_contextual_ao::{
    occlusion::{
        DensityEstimate, DirectionalOcclusion, GeometryTerm, OcclusionFiltering, OcclusionSweeping,
        ProgressiveRays, ScreenSpaceOcclusion, SummedAreaOcclusion,
    },
    prelude::*,
};

use super::Figure;

/// A method with settings for about the same reach as the other methods.
#[derive(Clone)]
pub struct Column {
    /// Name in tables.
    pub name: &'static str,
    /// Settings of the method.
    pub occlusion: AmbientOcclusion,
}

/// Reach of methods whose reach can be set, mm.
const REACH_MM: f32 = 10.0;

/// Columns of the table.
pub fn columns() -> Vec<Column> {
    let rays = OcclusionRays { steps: 9, step_mm: Some(1.0), ..default() };
    let of = |name, method| Column { name, occlusion: AmbientOcclusion::by(method) };
    let sweeping = |geometry_term| {
        OcclusionMethod::Sweeping(OcclusionSweeping { geometry_term, gamma: 1.0, ..default() })
    };
    let filtering = |estimate| {
        OcclusionMethod::Filtering(OcclusionFiltering { estimate, radius_mm: Some(REACH_MM), ..default() })
    };
    let summed_area =
        |shells| OcclusionMethod::SummedArea(SummedAreaOcclusion { radius_mm: Some(REACH_MM), shells });
    let half = OcclusionRays { resolution: OcclusionResolution::Half, ..rays };
    vec![
        of("rays", rays.into()),
        of("rays, half", half.into()),
        of("progressive", ProgressiveRays { rays, ..default() }.into()),
        of("sweeping", sweeping(GeometryTerm::None)),
        of("sweeping, cosine", sweeping(GeometryTerm::Cosine)),
        of("filtering, Chebyshev", filtering(DensityEstimate::Chebyshev)),
        of("filtering, power", filtering(DensityEstimate::Power)),
        of("filtering, Gaussian", filtering(DensityEstimate::Gaussian)),
        of("SAT", summed_area(1)),
        of("shelled SAT", summed_area(5)),
        of(
            "screen space",
            OcclusionMethod::ScreenSpace(ScreenSpaceOcclusion {
                radius_mm: Some(REACH_MM),
                samples: 64,
                ..default()
            }),
        ),
        of("directional", OcclusionMethod::Directional(DirectionalOcclusion { samples: 5, ..default() })),
    ]
}

/// Reports all figures of one column. Only [`OcclusionMethod::Rays`] has bounds.
pub fn column(column: &Column, report: &mut impl FnMut(Figure)) {
    let mut add = |case: &str, figure, unit, bound, value| {
        report(Figure { case: case.into(), method: column.name.into(), figure, unit, bound, value });
    };
    let occlusion = &column.occlusion;
    let is_exact = matches!(occlusion.method, OcclusionMethod::Rays(_));
    let if_exact = |bound| is_exact.then_some(bound);
    const OF_RANGE: &str = "of full range";

    let ghost = motion::ghost(occlusion);
    add("a block is carved away", "shadow that it cast", OF_RANGE, None, ghost.shadow);
    add("a block is carved away", "ghost in the frame of the carve", OF_RANGE, if_exact(1e-9), ghost.at_once);
    add("a block is carved away", "ghost that stays", OF_RANGE, if_exact(1e-9), ghost.stays);
    add("a block is carved away", "lag", "frames", if_exact(0.0), ghost.lag as f64);
    // Two images of one surface differ by the places of their samples, even if their factors are the same.
    add("two eyes, 6 degrees apart", "RMS difference", OF_RANGE, if_exact(0.005), places::eyes(occlusion));
    let edges = places::edges(occlusion);
    add("around a round post", "unevenness", OF_RANGE, None, places::unevenness(occlusion));
    add("edges of a cube", "brighter than its face by", OF_RANGE, None, edges);
    add("grid turned by 45 degrees", "RMS difference", OF_RANGE, None, places::turned(occlusion));
    add("a wall one voxel thin", "share of a thick one's shadow", "", None, places::thin(occlusion));
    if let Some(pops) = motion::pops(occlusion) {
        add("reach grows steadily", "largest step over the mean step", "times", None, pops);
    }
    if let Some([one, three]) = places::modes(occlusion) {
        add("densities of one mode", "RMS error of the share", OF_RANGE, None, one);
        add("densities of three modes", "RMS error of the share", OF_RANGE, None, three);
    }
    let carving = motion::carver_flicker(occlusion);
    add("carver moves by 1/16 voxel a frame", "flicker", OF_RANGE, None, carving);
    let turning = motion::camera_flicker(occlusion);
    add("camera turns by 0.25 degrees a frame", "flicker", OF_RANGE, None, turning);
}

/// Reports all figures of all columns.
pub fn table(report: &mut impl FnMut(Figure)) {
    for one in columns() {
        column(&one, report);
    }
}
