//! Where a hand points at the panel, and what egui is told of it. A finger that is near touches, else the hand's ray points.

use bevy::{math::Affine3A, prelude::*};
use bevy_egui::{
    egui::{Event, Modifiers, PointerButton, Pos2},
    input::EguiInputEvent,
};

use super::{
    super::controls::{Controls, Side, TriggerUse, is_pressed},
    surface::{POINTS, Panel, SIZE},
};

/// Distance of a fingertip to the panel at which it presses, and from which it lets go, metres. A tracked tip lies inside
/// the finger.
const TOUCH: f32 = 0.01;
const LET_GO: f32 = 0.02;
/// Distance from which on a finger points, and the ray no more.
const NEAR: f32 = 0.06;

/// A place on the panel, from its upper left corner (0) to its lower right one (1), and whether it is pressed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pointed {
    pub place: Vec2,
    pub is_pressed: bool,
}

/// Where the panel is pointed at.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct PanelPointer(pub Option<Pointed>);

/// The dot where the panel is pointed at.
#[derive(Component)]
pub struct Dot;

/// Where a ray meets the front of the panel. It is given in the panel's space.
pub fn ray_hit(origin: Vec3, direction: Vec3) -> Option<Vec2> {
    let distance = -origin.z / direction.z;
    let is_in_front = origin.z > 0.0 && direction.z < 0.0;
    place_of(origin + distance * direction).filter(|_| is_in_front)
}

/// The place of a point in front of the panel, or behind it, on the panel.
fn place_of(point: Vec3) -> Option<Vec2> {
    let place = Vec2::new(0.5 + point.x / SIZE.x, 0.5 - point.y / SIZE.y);
    (place.cmpge(Vec2::ZERO) & place.cmple(Vec2::ONE)).all().then_some(place)
}

/// What a fingertip touches or is near to, given whether it touched in the previous frame. It is given in the panel's space.
pub fn touched(tip: Vec3, was: bool) -> Option<Pointed> {
    let is_pressed = tip.z.abs() <= if was { LET_GO } else { TOUCH };
    let is_near = (-LET_GO..=NEAR).contains(&tip.z);
    place_of(tip).filter(|_| is_near).map(|place| Pointed { place, is_pressed })
}

/// Where a hand points, given where it pointed in the previous frame.
pub fn pointed(panel_from_hand: Affine3A, controls: &Controls, was: Option<Pointed>) -> Option<Pointed> {
    if !controls.is_tracked {
        return None;
    }
    let was = was.is_some_and(|was| was.is_pressed);
    let touch = controls.finger.and_then(|tip| touched(panel_from_hand.transform_point3(tip), was));
    touch.or_else(|| {
        let aim = panel_from_hand * Affine3A::from(controls.aim);
        let place = ray_hit(aim.translation.into(), aim.transform_vector3(Vec3::NEG_Z))?;
        Some(Pointed { place, is_pressed: is_pressed(controls.trigger, was) })
    })
}

/// Finds where the right hand points, and decides what its trigger is for.
pub fn point(
    mut pointer: ResMut<PanelPointer>,
    panels: Query<(&ChildOf, &Transform), With<Panel>>,
    mut hands: Query<(Entity, &Controls, &Transform, &mut TriggerUse), Without<Panel>>,
) {
    let Ok((holder, panel)) = panels.single() else {
        return;
    };
    let Ok(holder) =
        hands.get(holder.parent()).map(|(_, controls, hand, _)| controls.is_tracked.then_some(*hand))
    else {
        return;
    };
    for (_, controls, hand, mut trigger_use) in &mut hands {
        if controls.side == Side::Left {
            continue;
        }
        // Both hands move in the same space.
        let panel_from_hand =
            holder.map(|holder| (holder * *panel).compute_affine().inverse() * hand.compute_affine());
        let found = panel_from_hand.and_then(|from_hand| pointed(from_hand, controls, pointer.0));
        let is_pulled = is_pressed(controls.trigger, *trigger_use == TriggerUse::Panel);
        let next = trigger_use.next(found.is_some(), is_pulled);
        trigger_use.set_if_neq(next);
        // A hand that carves carves on across the panel.
        pointer.set_if_neq(PanelPointer(found.filter(|_| next == TriggerUse::Panel)));
    }
}

/// Passes the pointer on to egui, which reads it in the next frame.
pub fn tell_egui(
    pointer: Res<PanelPointer>,
    panels: Query<&Panel>,
    mut before: Local<Option<Pointed>>,
    mut events: MessageWriter<EguiInputEvent>,
) {
    let Ok(&Panel { context }) = panels.single() else {
        return;
    };
    let mut tell = |event| {
        events.write(EguiInputEvent { context, event });
    };
    let button = |place: Vec2, pressed| Event::PointerButton {
        pos: position(place),
        button: PointerButton::Primary,
        pressed,
        modifiers: Modifiers::NONE,
    };
    let was_pressed = before.is_some_and(|before| before.is_pressed);
    match pointer.0 {
        Some(Pointed { place, is_pressed }) => {
            tell(Event::PointerMoved(position(place)));
            if is_pressed != was_pressed {
                tell(button(place, is_pressed));
            }
        }
        None => {
            if let Some(Pointed { place, is_pressed: true }) = *before {
                tell(button(place, false));
            }
            if before.is_some() {
                tell(Event::PointerGone);
            }
        }
    }
    *before = pointer.0;
}

fn position(place: Vec2) -> Pos2 {
    let Vec2 { x, y } = place * POINTS;
    Pos2 { x, y }
}

pub fn show_dot(pointer: Res<PanelPointer>, mut dots: Query<(&mut Transform, &mut Visibility), With<Dot>>) {
    for (mut transform, mut visibility) in &mut dots {
        if let Some(Pointed { place, .. }) = pointer.0 {
            let on_panel = SIZE * Vec2::new(place.x - 0.5, 0.5 - place.y);
            transform.translation = on_panel.extend(0.001);
        }
        visibility.set_if_neq(if pointer.0.is_some() { Visibility::Inherited } else { Visibility::Hidden });
    }
}
