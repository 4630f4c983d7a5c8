//! Times of passes, and their growth with the volume.

use bevy::prelude::*;
use bevy_contextual_ao::{diagnostics::SPAN_MARCH, prelude::*};
use contextual_ao_kit::scene::SceneParts;

use super::{
    model::{GROWTH, TURNING_OVER_DRAWING},
    recorder::Recorder,
};
use crate::{figures::ratio, shell, stage::Stage, times};

/// Rays and samples of a ray: the paper's finest, and the default.
const RAYS: [(RayPattern, u32); 2] = [(RayPattern::Rubik54, 50), (RayPattern::Fibonacci(36), 20)];

/// Passes of a carve frame, of a frame with a camera that turns, and at rest.
pub fn passes(record: &mut Recorder) -> Result<(), String> {
    for (pattern, steps) in RAYS {
        let rays = pattern.rays();
        let name = format!("{rays} rays x {steps}");
        if record.has_time_for(&name) {
            let mut parts = record.shell(record.scale.voxels)?;
            set_rays(&mut parts, pattern, steps);
            parts.shading.step_voxels = 0.5;
            let stage = record.stage(parts, record.scale.eye);
            frames(record, &name, stage)?;
        }
    }
    Ok(())
}

/// Changes the rays of a scene.
pub fn set_rays(parts: &mut SceneParts, pattern: RayPattern, steps: u32) {
    if let Some(rays) = parts.occlusion.method.rays_mut() {
        (rays.pattern, rays.steps) = (pattern, steps);
    }
}

fn frames(record: &mut Recorder, name: &str, mut stage: Stage) -> Result<(), String> {
    let (options, device) = (record.options, record.device);
    let rays = stage.rays();
    let pixels = 2 * record.scale.eye.element_product();
    let march_and_mark = |device: super::model::Device| device.march_and_mark_ms(pixels);
    stage.open_second_eye();

    let case = format!("{name}, a carver moves");
    let carved = times::ours(&mut stage, options)?;
    record.times_beside(&case, carved, |pass| match pass {
        "clip" => device.map(|device| device.clip_ms()),
        "cast" => device.map(|device| device.cast_ms(rays.pattern.rays(), rays.steps)),
        _ => None,
    });
    let both = carved.of(SPAN_MARCH) + carved.of(OcclusionRays::SPAN_MARK);
    record.row_beside(&case, "march and mark", "ms", both, device.map(march_and_mark));
    let work = stage.count(|stage| stage.carve(options.warmup + options.frames));
    record.work(&case, work);
    stage.carve(0);

    let [drawn, turned] = times::turning(&mut stage, options);
    record.times(&format!("{name}, the camera turns, no occlusion"), drawn);
    let case = format!("{name}, the camera turns");
    record.times(&case, turned);
    let both = turned.of(SPAN_MARCH) + turned.of(OcclusionRays::SPAN_MARK);
    record.row_beside(&case, "march and mark", "ms", both, device.map(march_and_mark));
    let over = turned.total / drawn.total;
    record.row_beside(&case, "over no occlusion", "", over, Some(TURNING_OVER_DRAWING));

    let case = format!("{name}, at rest");
    let rest = stage.medians(options.warmup, options.frames, |_, _| {});
    record.times(&case, rest);
    record.row_beside(&case, "jobs of passes", "", stage.jobs_at_rest() as f64, Some(0.0));
    Ok(())
}

/// Carve frames in more and more voxels.
pub fn growth(record: &mut Recorder) -> Result<(), String> {
    let largest = record.scale.voxels;
    let mut last: Option<shell::Measured> = None;
    for size in shell::SIZES.into_iter().filter(|size| *size <= largest) {
        let case = format!("{size} x {size} x {size}");
        if !record.has_time_for(&case) {
            continue;
        }
        let parts = record.shell(size)?;
        let mut stage = record.stage(parts, UVec2::splat(size));
        let OcclusionRays { pattern, steps, .. } = stage.rays();
        let device = record.device.filter(|_| size == 512);
        let measured = shell::grown(&mut stage, record.options)?;
        record.times_beside(&case, measured.times, |pass| {
            device.filter(|_| pass == "cast").map(|device| device.cast_ms(pattern.rays(), steps))
        });
        record.work(&case, measured.work);
        if let Some(last) = &last {
            let samples = ratio(measured.work.samples, last.work.samples);
            record.row_beside(&case, "samples over the size before", "", samples, Some(GROWTH));
            let frame = measured.times.total / last.times.total;
            record.row_beside(&case, "frame over the size before", "", frame, Some(GROWTH));
            let [bricks, bytes] = shell::Measured::touched_over(&measured.clipped, &last.clipped);
            record.row_beside(
                &case,
                "bricks touched by clipping over the size before",
                "",
                bricks,
                Some(GROWTH),
            );
            record.row_beside(
                &case,
                "bytes touched by clipping over the size before",
                "",
                bytes,
                Some(GROWTH),
            );
        }
        last = Some(measured);
    }
    Ok(())
}
