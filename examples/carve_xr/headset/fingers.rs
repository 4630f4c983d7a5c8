//! Hands without controllers: pinches take the place of buttons.

use bevy::prelude::*;
use bevy_contextual_ao::prelude::*;
use bevy_mod_xr::{
    hands::{HandBone, LeftHand, RightHand, XrHandBoneEntities},
    spaces::XrSpaceLocationFlags,
};

use super::super::controls::{Controls, Side};

/// `Hand::pinch` from which a pinch counts as a pressed button.
const PRESSED: f32 = 0.6;

type Joint = (&'static Transform, &'static XrSpaceLocationFlags);
type Joints<'w, 's> = Query<'w, 's, Joint, (With<HandBone>, Without<Controls>)>;

/// Joints of a hand, in the space of the tracking root.
struct Fingers<'a> {
    bones: &'a XrHandBoneEntities,
    joints: &'a Joints<'a, 'a>,
}

impl Fingers<'_> {
    /// A joint; `None` while it is not tracked.
    fn joint(&self, bone: HandBone) -> Option<Transform> {
        let (pose, located) = self.joints.get(self.bones[bone as usize]).ok()?;
        (located.position_tracked && located.rotation_tracked).then_some(*pose)
    }

    fn tip(&self, bone: HandBone) -> Option<Vec3> {
        Some(self.joint(bone)?.translation)
    }

    /// How far the thumb pinches another finger, 0 to 1.
    fn pinch(&self, finger: HandBone) -> Option<f32> {
        Some(Hand::pinch(self.tip(HandBone::ThumbTip)?, self.tip(finger)?))
    }

    /// Pose of the hand: between thumb and index finger, as the palm lies.
    fn pose(&self) -> Option<Transform> {
        let palm = self.joint(HandBone::Palm)?;
        let between = self.tip(HandBone::ThumbTip)?.midpoint(self.tip(HandBone::IndexTip)?);
        Some(palm.with_translation(between))
    }

    /// The controls of a hand without a controller: the index finger carves, the middle finger grabs, the others take the
    /// place of buttons.
    fn controls(&self, side: Side) -> Option<Controls> {
        Some(Controls {
            trigger: self.pinch(HandBone::IndexTip)?,
            grip: self.pinch(HandBone::MiddleTip)?,
            shape: self.pinch(HandBone::RingTip)? >= PRESSED,
            operation: self.pinch(HandBone::LittleTip)? >= PRESSED,
            is_tracked: true,
            ..Controls::new(side)
        })
    }
}

/// Reads tracked hands, for hands that hold no controller. The tip of the index finger counts in both cases.
pub(super) fn read(
    mut hands: Query<(&mut Controls, &mut Transform), Without<HandBone>>,
    bones: Query<(&XrHandBoneEntities, Has<LeftHand>, Has<RightHand>)>,
    joints: Query<Joint, (With<HandBone>, Without<Controls>)>,
) {
    for (mut controls, mut transform) in &mut hands {
        let side = controls.side;
        let is_of_side = |left: bool, right: bool| if side == Side::Left { left } else { right };
        let Some((bones, ..)) = bones.iter().find(|(_, left, right)| is_of_side(*left, *right)) else {
            continue;
        };
        let fingers = Fingers { bones, joints: &joints };
        if !controls.is_tracked
            && let (Some(read), Some(pose)) = (fingers.controls(side), fingers.pose())
        {
            *controls = read;
            transform.set_if_neq(pose);
        }
        let to_hand = transform.compute_affine().inverse();
        controls.finger = fingers.tip(HandBone::IndexTip).map(|tip| to_hand.transform_point3(tip));
    }
}
