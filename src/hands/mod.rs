//! Hands: they hold carvers, and grab, turn and scale things.
//!
//! A [`Hand`] is any entity with a [`Transform`]: a controller, a tracked hand, an entity that the mouse moves. The app sets its
//! pose and what it intends ([`Hand::grip`], [`Hand::trigger`], [`Hand::scaling`]), and knows the device alone. A hand that
//! closes at a [`Grabbable`] takes it along. A second hand turns and scales it as well. A [`HeldCarver`] that hangs from a hand carves
//! while the trigger is pulled.
//!
//! ```no_run
//! # use bevy::prelude::*;
//! # use bevy_contextual_ao::prelude::*;
//! fn setup(mut commands: Commands, assets: Res<AssetServer>, mut meshes: ResMut<Assets<Mesh>>) {
//!     commands.spawn((VolumeBundle::new(assets.load("head.nii.gz")), Grabbable::default()));
//!     let shapes = vec![meshes.add(Sphere::new(0.02)), meshes.add(Cuboid::from_length(0.03))];
//!     let carver = (
//!         Mesh3d(shapes[0].clone()),
//!         HeldCarver { shapes, ..default() },
//!         // In front of the hand.
//!         Transform::from_xyz(0.0, 0.0, -0.08),
//!     );
//!     commands.spawn((Hand::default(), children![carver]));
//! }
//!
//! fn press(mut hands: Query<(Entity, &mut Hand)>, keys: Res<ButtonInput<KeyCode>>, mut commands: Commands) {
//!     for (entity, mut hand) in &mut hands {
//!         hand.grip = f32::from(keys.pressed(KeyCode::KeyG));
//!         hand.trigger = f32::from(keys.pressed(KeyCode::KeyT));
//!         if keys.just_pressed(KeyCode::KeyN) {
//!             commands.trigger(ChangeShape { entity, steps: 1 });
//!         }
//!     }
//! }
//! ```
//!
//! Poses that are set before [`HandSystems`] count in the same frame: what is held is drawn, and carves, where the hand is drawn.

mod carvers;
mod follow;
mod grab;
mod grabbable;
mod grasp;
mod hand;
mod motion;
mod places;
mod reach;

use bevy::prelude::*;

pub use carvers::{CarveWhile, ChangeShape, HeldCarver, ToggleOperation};
pub use grabbable::{Grabbable, Grabbed, HeldBy, Holds, Released};
pub use hand::Hand;

/// The systems of hands, in [`PostUpdate`] before [`TransformSystems::Propagate`].
#[derive(SystemSet, Clone, Debug, PartialEq, Eq, Hash)]
pub struct HandSystems;

/// Lets hands grab things and control their carvers.
pub(crate) struct HandPlugin;

impl Plugin for HandPlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<Hand>()
            .register_type::<Grabbable>()
            .register_type::<HeldCarver>()
            .add_observer(grabbable::announce_grab)
            .add_observer(grabbable::announce_release)
            .add_observer(grabbable::let_go_without_hand)
            .add_observer(grabbable::let_go_of_thing)
            .add_observer(carvers::change_shape)
            .add_observer(carvers::toggle_operation)
            .add_systems(
                PostUpdate,
                (
                    hand::read_intents,
                    // Things follow the hands that held them up to now, and stay where that led.
                    follow::follow_hands,
                    grab::open_and_close,
                    carvers::switch_carvers,
                    carvers::scale_carvers.run_if(resource_exists::<Time>),
                    follow::renew_grasps,
                )
                    .chain()
                    .in_set(HandSystems)
                    .before(TransformSystems::Propagate),
            );
    }
}
