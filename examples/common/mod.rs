//! What `snapshot`, `measure` and the tests share: an app without a window, scenes from
//! command-line options, small scenes, meshes with a known inside, figures of stability, and what a chart
//! is made of.

#![allow(dead_code, reason = "not every example that includes this folder needs all of it")]

pub mod budget;
pub mod carver;
pub mod chart;
pub mod device;
pub mod font;
pub mod framing;
pub mod headless;
pub mod inside;
pub mod random;
pub mod scene;
pub mod shapes;
pub mod small_scene;
pub mod stability;
