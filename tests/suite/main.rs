//! The integration tests, in one binary: linking Bevy is the longest part of building them.
//!
//! Those that draw run real GPU code in apps without a window, on whatever Vulkan driver there is;
//! a software driver will do.

#[path = "../../examples/common/mod.rs"]
mod common;

use common::{device, headless, small_scene as scene};

mod assets;
mod awkward;
mod awkward_data;
mod awkward_meshes;
mod awkward_poses;
mod broken_files;
mod chart;
mod direct;
mod drawing;
mod exact;
mod faults;
mod features;
mod filtering;
mod independence;
mod isosurface;
mod languages;
mod lifecycle;
mod methods;
mod oracle;
mod properties;
mod ray_methods;
mod readers;
mod screen_space;
mod shaders;
mod shortcuts;
mod small_files;
mod stability;
mod sweeping;
mod transfer_function;
