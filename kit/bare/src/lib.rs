//! That the crate compiles without its features, and what is left then: built by itself (`cargo build -p bare`), since
//! a build with tests has all features.

pub use bevy_contextual_ao::prelude::*;
