//! A hand, and what it intends.

use bevy::prelude::*;

/// A hand that holds things: any entity with a pose.
///
/// The app sets the pose and the intents in every frame, from any device. NaN leaves things as they are.
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(Transform, Visibility, HandState)]
pub struct Hand {
    /// How far the hand is closed, from 0 (open) to 1: a grip button, or a pinch ([`Self::pinch`]).
    pub grip: f32,
    /// How far the trigger is pulled, from 0 to 1.
    pub trigger: f32,
    /// Speed at which carvers in the hand grow, from -1 (shrink) to 1: a thumbstick. Dead zones are for the app.
    pub scaling: f32,
    /// Distance from the hand's origin at which it still grabs a thing's box, world units. A longer one takes less aim, and
    /// takes things that were not meant.
    pub reach: f32,
    /// `grip` at which the hand closes, and `trigger` at which it is pulled.
    pub press_at: f32,
    /// `grip` at which the hand opens, and `trigger` at which it is let go. The farther below `press_at`, the steadier a
    /// wavering grip holds, and the later it lets go.
    pub release_at: f32,
}

impl Default for Hand {
    /// An open hand.
    fn default() -> Self {
        Self { grip: 0.0, trigger: 0.0, scaling: 0.0, reach: 0.05, press_at: 0.6, release_at: 0.4 }
    }
}

impl Hand {
    /// The grip of a hand that pinches: 1 where the tips of thumb and index finger are 1 cm apart or less, 0 from 5 cm on.
    ///
    /// Tips are in world units. Tracked tips lie inside the fingers, so they never meet.
    pub fn pinch(thumb_tip: Vec3, index_tip: Vec3) -> f32 {
        ((0.05 - thumb_tip.distance(index_tip)) / 0.04).clamp(0.0, 1.0)
    }

    /// Whether an input is pressed, given whether it was.
    fn is_pressed(&self, input: f32, was: bool) -> bool {
        // Comparisons with NaN are false: it stays as it was.
        if was {
            input.is_nan() || input > self.release_at.min(self.press_at)
        } else {
            input >= self.press_at
        }
    }
}

/// Whether a hand is closed and its trigger pulled.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct HandState {
    pub is_closed: bool,
    /// Whether the hand closed in this frame.
    pub closes: bool,
    /// Whether the hand opened in this frame.
    pub opens: bool,
    pub is_triggered: bool,
}

pub(super) fn read_intents(mut hands: Query<(&Hand, &mut HandState)>) {
    for (hand, mut state) in &mut hands {
        let is_closed = hand.is_pressed(hand.grip, state.is_closed);
        let [closes, opens] = [is_closed && !state.is_closed, !is_closed && state.is_closed];
        let is_triggered = hand.is_pressed(hand.trigger, state.is_triggered);
        state.set_if_neq(HandState { is_closed, closes, opens, is_triggered });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inputs_have_two_thresholds_and_nan_changes_nothing() {
        let hand = Hand::default();
        for was in [false, true] {
            assert_eq!(hand.is_pressed(0.5, was), was);
            assert_eq!(hand.is_pressed(f32::NAN, was), was);
            assert!(hand.is_pressed(7.0, was) && hand.is_pressed(f32::INFINITY, was));
            assert!(!hand.is_pressed(-3.0, was) && !hand.is_pressed(f32::NEG_INFINITY, was));
        }
        // Thresholds the wrong way round do not flicker.
        let crossed = Hand { press_at: 0.3, release_at: 0.8, ..hand };
        assert!(crossed.is_pressed(0.5, false) && crossed.is_pressed(0.5, true));
    }

    #[test]
    fn a_pinch_closes_where_the_tips_are_near() {
        let pinch = |distance| Hand::pinch(Vec3::ONE, Vec3::ONE + distance * Vec3::X);
        assert!(pinch(0.0) == 1.0 && pinch(0.2) == 0.0 && (pinch(0.03) - 0.5).abs() < 1e-4);
        assert!(pinch(f32::NAN).is_nan());
    }
}
