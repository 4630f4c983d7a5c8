//! A session of an OpenXR runtime without a headset, in which a script moves head and hands. `.ci/headset` starts the
//! runtime.

mod eyes;
mod remote;
mod scene;
mod script;

use bevy::prelude::*;
use bevy_contextual_ao::diagnostics::{SPAN_CLIP, SPAN_MARCH};
use bevy_contextual_ao::prelude::*;
use bevy_mod_xr::session::{XrCreateSessionMessage, XrRequestExitMessage, XrState};
use contextual_ao_kit::headless::different_pixels;

use crate::needs;
use remote::Remote;
use scene::{InHeadset, Recomputed};
use script::{FRAMES, Moment};

/// Modules of the `carve_xr` example, as its own main file has them.
#[allow(dead_code, reason = "some of it is for the window")]
#[path = "../../examples/carve_xr"]
mod carve_xr {
    pub mod controls;
    pub mod headset;
}

/// Every how many frames both eyes are compared with a full recomputation.
const SAMPLED: u32 = 40;

#[test]
fn a_script_carves_with_both_hands() {
    let Some(pictures) = needs::headset() else {
        return;
    };
    let mut remote = Remote::connect().expect("the remote driver listens");
    let mut headset = InHeadset::new();
    let mut recomputed = Recomputed::new();
    headset.run_until(XrState::Running);
    let mut carved = 0;
    let mut before = headset.passes();
    for frame in 0..FRAMES {
        let moment = Moment::of(frame);
        remote.send(moment.head, moment.hands).expect("the remote driver listens");
        let is_sampled = frame % SAMPLED == SAMPLED - 1;
        headset.frame(is_sampled);
        let now = headset.passes();
        let jobs = |span| now.jobs(span) - before.jobs(span);
        // The report of a frame arrives in the next one.
        if Moment::of(frame.saturating_sub(4)).is_at_rest && moment.is_at_rest {
            assert_eq!(now, before, "passes run at rest, frame {frame}");
        }
        carved += jobs(SPAN_CLIP);
        if is_sampled {
            let seen = headset.eyes();
            let expected = recomputed.draw(&headset.poses());
            for eye in 0..2 {
                let differ = different_pixels(&seen[eye], &expected[eye]);
                assert_eq!(differ, 0, "pixels of eye {eye} that are stale in frame {frame}");
            }
            assert!(seen[0] != seen[1], "both eyes see the same");
        }
        before = now;
    }
    println!("{carved} clips in {FRAMES} frames; marched {}", before.jobs(SPAN_MARCH));
    for (name, eye) in ["left", "right"].into_iter().zip(headset.eyes()) {
        let [width, height] = headset.resolution().to_array();
        let path = pictures.join(name).with_extension("png");
        image::save_buffer(path, &eye, width, height, image::ColorType::Rgba8).expect("a picture is written");
    }
    // A session ends, and another begins.
    headset.send(XrRequestExitMessage);
    headset.run_until(XrState::Available);
    headset.send(XrCreateSessionMessage);
    headset.run_until(XrState::Running);
    headset.frame(true);
    headset.send(XrRequestExitMessage);
    headset.run_until(XrState::Available);
}
