//! Reach of occlusion methods.

use bevy::math::DVec3;
use bevy_contextual_ao::prelude::*;

/// The method with this reach, for a grid of these spacings (mm); `None` if it has no such setting.
pub fn reaching(occlusion: &AmbientOcclusion, reach_mm: f32, spacing_mm: DVec3) -> Option<AmbientOcclusion> {
    let mut changed = occlusion.clone();
    match &mut changed.method {
        OcclusionMethod::Rays(rays) | OcclusionMethod::Progressive(ProgressiveRays { rays, .. }) => {
            let start = OcclusionRays::start_mm(spacing_mm) as f32;
            rays.step_mm = Some((reach_mm - start) / (rays.steps - 1) as f32);
        }
        OcclusionMethod::Filtering(filtering) => filtering.radius_mm = Some(reach_mm),
        OcclusionMethod::SummedArea(boxes) => boxes.radius_mm = Some(reach_mm),
        OcclusionMethod::ScreenSpace(screen) => screen.radius_mm = Some(reach_mm),
        _ => return None,
    }
    Some(changed)
}
