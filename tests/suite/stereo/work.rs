//! Work for two eyes: occlusion is cast once, for all that either eye reads.

use bevy::prelude::*;
use bevy_contextual_ao::{
    diagnostics::{SPAN_CLIP, SPAN_MARCH},
    prelude::*,
};

use crate::needs;

use super::rig::{Eye, TwoEyes, eyes_of, head_from};

fn head(frame: u32) -> [Eye; 2] {
    let turn = 0.02 * frame as f32;
    eyes_of(head_from(Vec3::new(turn.sin(), 0.3, turn.cos())))
}

/// Makes all occlusion stale, and counts the voxels whose rays are cast for these eyes. Returns the number, and which
/// voxels are known then.
fn cast_anew(two: &mut TwoEyes, eyes: [Eye; 2], step_mm: f32) -> (u64, Vec<bool>) {
    two.pose(head(3), eyes);
    two.set_step_mm(step_mm);
    let volume = two.scene.volume;
    let voxels = two.scene.headless.count_work(volume).voxels;
    (voxels, two.scene.occlusion().iter().map(Option::is_some).collect())
}

#[test]
fn rays_are_cast_once_for_what_either_eye_reads() {
    let mut two = TwoEyes::new();
    if !needs::counters(&mut two.scene) {
        return;
    }
    two.pose(head(0), head(0));
    two.settle();
    let [left, right] = head(0);
    // The first frames mark more voxels: they do not know yet how precisely the device filters.
    cast_anew(&mut two, [left, right], 1.04);
    let (of_left, left_known) = cast_anew(&mut two, [left; 2], 1.01);
    let (of_right, right_known) = cast_anew(&mut two, [right; 2], 1.02);
    let (of_both, both_known) = cast_anew(&mut two, [left, right], 1.03);
    let union: Vec<_> = left_known.iter().zip(&right_known).map(|(a, b)| *a || *b).collect();
    let count = |known: &[bool]| known.iter().filter(|known| **known).count() as u64;
    let shared = of_left + of_right - of_both;
    println!(
        "{of_left} voxels for the left eye, {of_right} for the right, {of_both} for both: {shared} are read by both"
    );
    assert!(both_known == union, "{} voxels are known, {} in either eye", count(&both_known), count(&union));
    assert_eq!([of_left, of_right, of_both], [&left_known, &right_known, &union].map(|known| count(known)));
    // The eyes see nearly the same.
    assert!(of_left > 300 && 2 * of_both < 3 * of_left.max(of_right), "{of_both} voxels for both");
}

#[test]
fn passes_run_once_for_both_eyes_while_all_moves() {
    let mut two = TwoEyes::new();
    two.pose(head(0), head(0));
    two.settle();
    two.scene.headless.frame();
    let mut before = two.scene.status().passes;
    for frame in 1..4 {
        two.carve(frame);
        two.pose(head(frame), head(frame + 1));
        // The report of a frame arrives in the next one.
        two.scene.headless.frames(2);
        let after = two.scene.status().passes;
        for span in [SPAN_CLIP, SPAN_MARCH, OcclusionRays::SPAN_CAST] {
            assert_eq!(after.jobs(span) - before.jobs(span), 1, "{span} in frame {frame}");
        }
        before = after;
    }
}

#[test]
fn no_pass_runs_while_late_poses_rest() {
    let mut two = TwoEyes::new();
    two.pose(head(0), head(0));
    two.settle();
    two.scene.headless.frame();
    let (before, images) = (two.scene.status().passes, two.images());
    // Predictions differ from frame to frame, and the head does not move.
    for frame in 1..5 {
        let seen = two.draw(head(frame), head(0));
        assert!(seen == images, "frame {frame} differs");
    }
    assert_eq!(two.scene.status().passes, before);
}

#[test]
fn a_voxel_has_one_factor_in_both_eyes() {
    let mut two = TwoEyes::new();
    let mut known_by = |eye: Eye, step_mm: f32| {
        two.pose([eye; 2], [eye; 2]);
        two.set_step_mm(step_mm);
        two.settle();
        // Other rays, so that the next eye finds nothing known.
        let occlusion = two.scene.occlusion();
        two.set_step_mm(2.0 * step_mm);
        two.settle();
        occlusion
    };
    let [left, right] = head(0);
    let [left, right] = [left, right].map(|eye| known_by(eye, 1.01));
    let both = || left.iter().zip(&right).filter_map(|(left, right)| Some(((*left)?, (*right)?)));
    let differ = both().filter(|(left, right)| left != right).count();
    println!("{} voxels are read by either eye, {differ} have two factors", both().count());
    assert!(both().count() > 300, "the eyes share {} voxels", both().count());
    assert_eq!(differ, 0);
}
