//! What `snapshot`, `measure` and the tests share: an app without a window, scenes from
//! command-line options, small scenes, meshes with a known inside, and figures of stability.

#![allow(dead_code, reason = "not every example that includes this folder needs all of it")]

pub mod carver;
pub mod font;
pub mod headless;
pub mod inside;
pub mod random;
pub mod scene;
pub mod shapes;
pub mod small_scene;
pub mod stability;
