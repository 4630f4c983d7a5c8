//! Hands grab, move, turn and scale things, and control carvers: against closed forms, and in pictures.

mod bench;
mod carvers;
mod grabbing;
mod motion;
mod pictures;
mod robustness;
