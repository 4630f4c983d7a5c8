//! A session of an OpenXR runtime without a headset, in which a script moves head and hands. `.ci/headset` starts the
//! runtime.

mod eyes;
mod remote;
mod scene;
mod script;

use bevy::math::Vec2;
use bevy_contextual_ao::{
    diagnostics::{PassLog, SPAN_CLIP, SPAN_MARCH},
    prelude::*,
};
use bevy_mod_xr::session::{XrCreateSessionMessage, XrRequestExitMessage, XrState};
use contextual_ao_kit::headless::different_pixels;

use crate::needs;
use remote::{Remote, RemoteHand};
use scene::{InHeadset, Recomputed};
use script::{AT_REST_FROM, FRAMES, Moment, Part};

/// Every how many frames both eyes are compared with a full recomputation.
const SAMPLED: u32 = 40;

/// Frames of a part in which things moved or rested, and passes that ran in them.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    moving: u64,
    clipped: u64,
    marched: u64,
    cast: u64,
    at_rest: u64,
    /// Passes of any kind that ran at rest.
    ran_at_rest: u64,
}

impl Counts {
    /// Adds a frame. What the first frames of a part count may be of the part before.
    fn add(&mut self, moment: &Moment, before: &PassLog, now: &PassLog) {
        let ran = |span| u64::from(now.jobs(span) > before.jobs(span));
        match moment.in_part {
            0..6 => {}
            6..AT_REST_FROM => {
                self.moving += 1;
                self.clipped += ran(SPAN_CLIP);
                self.marched += ran(SPAN_MARCH);
                self.cast += ran(OcclusionRays::SPAN_CAST);
            }
            _ if moment.in_part > AT_REST_FROM + 6 => {
                self.at_rest += 1;
                self.ran_at_rest += now.total_jobs() - before.total_jobs();
            }
            _ => {}
        }
    }

    /// Asserts that passes ran where something moved, and no others. A frame may come before the pose that was sent for it,
    /// and find nothing moved.
    fn assert_follow(&self, part: Part) {
        assert!(self.moving > 100 && self.at_rest > 10, "{part:?} is too short");
        assert_eq!(self.ran_at_rest, 0, "passes that ran at rest, {part:?}");
        let most = |count: u64| 4 * count > 3 * self.moving;
        assert!(most(self.marched) && most(self.cast), "views are not followed, {part:?}");
        if part == Part::Look {
            assert_eq!(self.clipped, 0, "nothing carves while the head walks");
        } else {
            assert!(most(self.clipped), "carvers do not clip, {part:?}");
        }
    }
}

/// Each button of either hand arrives at that hand.
fn assert_buttons_arrive(remote: &mut Remote, headset: &mut InHeadset) {
    let head = Moment::of(FRAMES - 1).head;
    let pressed =
        RemoteHand { stick: Vec2::new(0.25, -0.75), shape: true, operation: true, ..RemoteHand::default() };
    for hands in [[pressed, RemoteHand::default()], [RemoteHand::default(), pressed]] {
        remote.send(head, hands).expect("the remote driver listens");
        for _ in 0..6 {
            headset.frame(false);
        }
        for (sent, controls) in hands.into_iter().zip(headset.controls()) {
            assert!(controls.is_tracked, "{controls:?}");
            assert!(controls.stick.distance(sent.stick) < 1e-3, "{sent:?} {controls:?}");
            assert_eq!([controls.shape, controls.operation], [sent.shape, sent.operation], "{controls:?}");
        }
    }
}

#[test]
fn a_script_carves_with_both_hands() {
    let Some(pictures) = needs::headset() else {
        return;
    };
    let mut remote = Remote::connect().expect("the remote driver listens");
    let mut headset = InHeadset::new();
    let mut recomputed = Recomputed::new();
    headset.run_until(XrState::Running);
    let mut counts = [Counts::default(); Part::COUNT];
    let mut before = headset.passes();
    for frame in 0..FRAMES {
        let moment = Moment::of(frame);
        remote.send(moment.head, moment.hands).expect("the remote driver listens");
        let is_sampled = frame % SAMPLED == SAMPLED - 1;
        headset.frame(is_sampled);
        let now = headset.passes();
        counts[moment.part as usize].add(&moment, &before, &now);
        before = now;
        if is_sampled {
            let seen = headset.eyes();
            let expected = recomputed.draw(&headset.poses());
            for eye in 0..2 {
                let differ = different_pixels(&seen[eye], &expected[eye]);
                assert_eq!(differ, 0, "pixels of eye {eye} that are stale in frame {frame}");
            }
            assert!(seen[0] != seen[1], "both eyes see the same");
            for (name, eye) in ["left", "right"].into_iter().zip(seen) {
                let path = pictures.join(format!("{frame:04}_{name}.png"));
                let [width, height] = headset.resolution().to_array();
                image::save_buffer(path, &eye, width, height, image::ColorType::Rgba8).expect("a picture");
            }
        }
    }
    for (part, counts) in Part::ALL.into_iter().zip(counts) {
        println!("{part:?}: {counts:?}");
        counts.assert_follow(part);
    }
    assert_buttons_arrive(&mut remote, &mut headset);
    // A session ends, and another begins.
    headset.send(XrRequestExitMessage);
    headset.run_until(XrState::Available);
    headset.send(XrCreateSessionMessage);
    headset.run_until(XrState::Running);
    headset.frame(true);
    headset.send(XrRequestExitMessage);
    headset.run_until(XrState::Available);
}
