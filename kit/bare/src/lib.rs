//! Checks that the crate compiles without its features, and exports the rest. It is built by itself, since a build
//! with tests has all features: `cargo build -p bare`.

pub use bevy_contextual_ao::prelude::*;
