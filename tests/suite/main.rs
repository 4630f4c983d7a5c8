//! The integration tests, in one binary: linking Bevy is the longest part of building them.
//!
//! Those that draw run real GPU code in apps without a window, on whatever Vulkan driver there is;
//! a software driver will do.

#[path = "../../examples/common/headless.rs"]
mod headless;

mod assets;
mod awkward;
mod broken_files;
mod drawing;
mod exact;
mod independence;
mod lifecycle;
mod oracle;
mod properties;
mod readers;
mod scene;
mod shaders;
mod small_files;
mod transfer_function;
