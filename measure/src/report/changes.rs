//! Second eyes, more carvers, and edits of the transfer function.

use bevy::{math::DVec3, prelude::*};
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::mode::ShadingMode;

use super::{
    model::{SECOND_EYE, second_eye_carving},
    passes::set_rays,
    recorder::Recorder,
};
use crate::{
    counts::count_edit,
    figures::{FrameTimes, ratio},
    shell, times,
};

/// Cells of lattices with a carver each, and the radius of carvers at rest as a share of the width.
const LATTICES: [(DVec3, f64); 5] = [
    (DVec3::ONE, 0.0),
    (DVec3::new(2.0, 1.0, 1.0), 0.14),
    (DVec3::splat(2.0), 0.11),
    (DVec3::new(4.0, 4.0, 2.0), 0.07),
    (DVec3::new(8.0, 4.0, 4.0), 0.044),
];

/// Shift of the transfer function's first point in an edit.
const EDIT: f32 = 1.0;

/// One eye and two: at rest, while the head turns, and while a carver moves.
pub fn two_eyes(record: &mut Recorder) -> Result<(), String> {
    let OcclusionRays { pattern, steps, .. } = default();
    let mut parts = record.shell(record.scale.voxels)?;
    set_rays(&mut parts, pattern, steps);
    parts.shading.step_voxels = 0.5;
    let mut stage = record.stage(parts, record.scale.eye);
    // The model's share of casting is that of the large scene.
    let carving = (!record.options.quick)
        .then(|| second_eye_carving(pattern.rays(), steps, record.scale.eye.element_product()));
    for (case, change) in times::EYE_CASES {
        if record.has_time_for(case) {
            let [one, both] = times::eyes(&mut stage, change, record.options)?;
            record.times(&format!("{case}, one eye"), one);
            let two = format!("{case}, two eyes");
            record.times(&two, both);
            let predicted = if case == times::CARVING { carving } else { Some(SECOND_EYE) };
            record.row_beside(&two, "over one eye", "", both.total / one.total, predicted);
        }
    }
    Ok(())
}

/// One carver that moves, beside more and more at rest.
pub fn carvers(record: &mut Recorder) -> Result<(), String> {
    let parts = record.shell(record.scale.voxels)?;
    let mut stage = record.stage(parts, record.scale.image);
    let geometry = stage.scene.geometry;
    let mut alone: Option<FrameTimes> = None;
    for (cells, radius) in LATTICES {
        let others = times::lattice(&geometry, cells, shell::CARVER, radius);
        let case = format!("one moves, {} at rest", others.len());
        if record.has_time_for(&case) {
            let times = times::with(&mut stage, &others, record.options)?;
            record.times(&case, times);
            let one = alone.get_or_insert(times);
            let over = times.total / one.total;
            record.row(&case, "over one carver", "", over);
        }
    }
    Ok(())
}

/// Edits of an opaque and of a translucent transfer function.
pub fn edits(record: &mut Recorder) -> Result<(), String> {
    for (name, size, opacity) in
        [("opaque", record.scale.voxels, None), ("translucent", record.scale.voxels_without, Some(0.1))]
    {
        let case = format!("{name}, {size} x {size} x {size}");
        if !record.has_time_for(&case) {
            continue;
        }
        let mut parts = record.shell(size)?;
        for point in parts.transfer_function.iter_mut().flat_map(|function| &mut function.points) {
            point.opacity = opacity.unwrap_or(point.opacity).min(point.opacity);
        }
        let mut stage = record.stage(parts, record.scale.image);
        stage.prepare(ShadingMode::Cao, stage.rays().pattern)?;
        let times = stage.medians(record.options.warmup, record.options.frames, |stage, frame| {
            stage.edit_transfer_function(if frame.is_multiple_of(2) { EDIT } else { -EDIT });
        });
        record.times(&case, times);
        let work = count_edit(&mut stage);
        record.work(&case, work);
        let share = ratio(work.samples, stage.dense_samples());
        record.row(&case, "samples of a dense LAO", "%", 100.0 * share);
    }
    Ok(())
}
