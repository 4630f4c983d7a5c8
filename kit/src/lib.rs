//! What examples, tests and `measure` share: an app without a window, scenes from
//! command-line options, small scenes, meshes with a known inside, figures of stability, and what a chart
//! is made of.

pub mod budget;
pub mod carver;
pub mod chart;
pub mod device;
pub mod font;
pub mod framing;
pub mod headless;
pub mod inside;
pub mod mode;
pub mod random;
pub mod scene;
pub mod shapes;
pub mod small_scene;
pub mod stability;
