//! The worth of each optimization, and the paper's tables in generated volumes.

use contextual_ao_kit::headless::different_pixels;

use super::recorder::Recorder;
use crate::{
    ablation,
    chart::scenes::phantom,
    tables::{self, PATTERNS},
};

/// All optimizations, then all without one at a time.
pub fn ablation(record: &mut Recorder) -> Result<(), String> {
    let parts = record.shell(record.scale.voxels_without)?;
    let mut stage = record.stage(parts, record.scale.image);
    let mut with_all: Option<Vec<u8>> = None;
    for (without, optimizations) in ablation::variants()? {
        let case = if without == "nothing" { "with all".to_owned() } else { format!("without {without}") };
        if record.has_time_for(&case) {
            let found = ablation::measure(&mut stage, without, optimizations, record.options)?;
            record.times(&case, found.times);
            record.row(&case, "at rest", "ms", found.rest.total);
            record.work(&case, found.work);
            let image = with_all.get_or_insert_with(|| found.image.clone());
            let different = different_pixels(&found.image, image) as f64;
            record.row_beside(&case, "pixels that differ", "", different, Some(0.0));
        }
    }
    Ok(())
}

/// Ratios of times, and errors against many rays.
pub fn paper(record: &mut Recorder) -> Result<(), String> {
    let scenes = [record.shell(record.scale.voxels_dense)?, phantom(record.scale.phantom)?];
    for parts in scenes {
        let name = parts.name.clone();
        if !record.has_time_for(&name) {
            continue;
        }
        let mut stage = record.stage(parts, record.scale.image);
        let found = tables::measure(&mut stage, None, true, Some(record.deadline), record.options)?;
        let [published, ours] = found.recast_percent;
        record.row(&name, "voxels cast as published", "%", published);
        record.row(&name, "voxels cast", "%", ours);
        for of_rays in &found.by_rays {
            let case = format!("{name}, {} rays", of_rays.rays);
            if let Some([published, ours]) = of_rays.dense_over_ours() {
                record.row(&case, "LAO over CAO as published", "", published);
                record.row(&case, "LAO over CAO", "", ours);
            }
            record.row(&case, "CAO over no occlusion", "", of_rays.ours_over_solid());
            record.row(&case, "CAO", "ms", of_rays.ours.total);
            record.row(&case, "frame rate that a second carver takes", "%", of_rays.percent_lost());
            let patterns = ["the paper's rays", "Fibonacci"];
            for (k, pattern) in patterns.into_iter().enumerate() {
                record.row(&case, &format!("RMS of voxels, {pattern}"), "0 to 1", of_rays.voxel_rms[k]);
                record.row(&case, &format!("RMS of pixels, {pattern}"), "0 to 255", of_rays.pixel_rms[k]);
            }
        }
        for [pattern, _] in PATTERNS.iter().skip(found.by_rays.len()) {
            record.leave_out(&format!("{name}, {} rays", pattern.rays()), "the time was up");
        }
    }
    Ok(())
}
