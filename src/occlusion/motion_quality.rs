//! The component that lets a volume be drawn with fewer samples while something moves.

use bevy::{
    ecs::{lifecycle::HookContext, world::DeferredWorld},
    prelude::*,
};

use super::{Quality, step_control::StepControl};

/// Draws a volume with fewer samples along view rays while something moves, as the frame time demands. Insert it on
/// the entity of a [`Volume3d`](crate::volume::Volume3d). Without it, every frame is drawn in full.
///
/// Motion is a change of place between the volume and a camera of its render layers, or a carver that acts on it. A
/// camera's projection and a carver's vertices count as well. Values that are written again unchanged do not, nor does
/// a rig that moves as a whole. The present samples are those of [`VolumeShading`](super::VolumeShading), which is
/// never written: while something moves, the samples lie farther apart, at most as far as those of `lowest`. So a still
/// picture is always the full one, bit for bit. Removing the component restores it at once.
///
/// Rays are the same in motion. Other rays would make all occlusion stale, and casting it anew costs more than any
/// frame saves. So this helps where drawing takes the time: at high resolutions, with two eyes, in translucent data.
/// Whenever the distance of samples changes, all view rays of the volume are followed again. It therefore changes in
/// few and large steps.
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(MotionSampling)]
#[component(on_remove = remove_sampling)]
pub struct MotionQuality {
    /// The floor: view samples never lie farther apart than those of this preset. A lower one makes faster frames
    /// possible, and shows slices in motion. One that is no lower than the volume's own setting has no effect.
    pub lowest: Quality,
    /// Longest frame time, milliseconds, by [`Time<Real>`]. A higher one keeps more samples in motion, a lower one drops
    /// them sooner. Where frames wait for a display, it needs to be a third longer than the display's interval: waiting
    /// hides how much faster a frame could be.
    pub target_frame_ms: f32,
    /// Seconds without motion after which the picture is full again. A longer time bridges pauses of a hand, a shorter
    /// one shows the full picture sooner. At 0 the first frame without motion is full.
    pub settle_s: f32,
}

impl Default for MotionQuality {
    fn default() -> Self {
        // 60 frames a second, and a third more.
        Self { lowest: Quality::Low, target_frame_ms: 22.0, settle_s: 0.2 }
    }
}

/// Removes what the plugin keeps for the component.
fn remove_sampling(mut world: DeferredWorld, removed: HookContext) {
    world.commands().entity(removed.entity).try_remove::<MotionSampling>();
}

/// View samples of a volume with [`MotionQuality`].
#[derive(Component, Clone, Debug, Default)]
pub(crate) struct MotionSampling {
    /// Fingerprint of all places in the previous frame.
    places: Option<u64>,
    is_in_motion: bool,
    /// Seconds since the last motion.
    rest_s: f32,
    control: StepControl,
}

impl MotionSampling {
    /// Distance of samples in this frame, voxels; `None` for the volume's own.
    pub fn step_voxels(&self) -> Option<f32> {
        self.is_in_motion.then_some(self.control.step_voxels)
    }

    /// Takes note of a frame: a fingerprint of all places, the volume's own distance of samples, and the time since the
    /// previous frame.
    pub fn follow(&mut self, places: u64, quality: &MotionQuality, full_voxels: f32, frame_s: f32) {
        let has_moved = self.places.replace(places).is_some_and(|before| before != places);
        let floor_voxels = quality.lowest.shading().step_voxels;
        if !has_moved {
            self.rest_s += frame_s;
            self.is_in_motion &= self.rest_s < quality.settle_s;
        } else if self.is_in_motion && self.rest_s == 0.0 {
            // The time is that of a frame in motion.
            self.control = self.control.after(1e3 * frame_s, quality.target_frame_ms);
        } else {
            (self.is_in_motion, self.rest_s) = (true, 0.0);
            self.control = self.control.in_new_motion();
        }
        self.control = self.control.within(full_voxels, floor_voxels);
        self.is_in_motion &= full_voxels < floor_voxels;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FULL: f32 = 0.25;
    const FRAME_S: f32 = 0.01;

    /// Steps of frames in which everything moves or nothing does.
    fn steps(quality: &MotionQuality, moves: impl IntoIterator<Item = bool>) -> Vec<Option<f32>> {
        let mut sampling = MotionSampling::default();
        sampling.follow(0, quality, FULL, FRAME_S);
        let mut places = 0;
        let follow = |is_moving: bool| {
            places += u64::from(is_moving);
            sampling.follow(places, quality, FULL, FRAME_S);
            sampling.step_voxels()
        };
        moves.into_iter().map(follow).collect()
    }

    fn moves_then_rests(frames: usize) -> impl Iterator<Item = bool> {
        (0..2 * frames).map(move |frame| frame < frames)
    }

    #[test]
    fn samples_are_full_before_motion_and_after_it_settles() {
        let quality = MotionQuality { target_frame_ms: 1.0, settle_s: 0.035, ..default() };
        let steps = steps(&quality, moves_then_rests(20));
        assert_eq!(steps[0], Some(FULL), "nothing is known of the first frame's time");
        assert_eq!(steps[19], Some(Quality::Low.shading().step_voxels));
        assert_eq!(steps[22], steps[19], "it does not change while it settles");
        assert_eq!(steps[23], None);
        let impatient = MotionQuality { settle_s: f32::NAN, ..quality };
        assert_eq!(self::steps(&impatient, moves_then_rests(20))[20], None);
    }

    #[test]
    fn the_next_motion_begins_as_the_last_one_ended() {
        let quality = MotionQuality { target_frame_ms: 1.0, settle_s: 0.0, ..default() };
        let twice = steps(&quality, moves_then_rests(20).chain([true]));
        assert_eq!(twice.last(), Some(&Some(Quality::Low.shading().step_voxels)));
    }

    #[test]
    fn a_floor_above_the_volumes_own_setting_has_no_effect() {
        for lowest in [Quality::High, Quality::Reference] {
            let quality = MotionQuality { lowest, target_frame_ms: 1.0, ..default() };
            assert!(steps(&quality, [true; 20]).iter().all(Option::is_none), "{lowest}");
        }
    }
}
