//! What `snapshot`, `measure` and the tests share: an app without a window, and scenes from
//! command-line options.

pub mod headless;
pub mod scene;
