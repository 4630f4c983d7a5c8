//! The integration tests, in one binary: linking Bevy is the longest part of building them.
//!
//! Tests that draw run real GPU code in apps without a window, on any Vulkan driver. A software driver is enough.

use contextual_ao_kit::{device, headless, small_scene as scene};

mod assets;
mod awkward;
mod awkward_data;
mod awkward_meshes;
mod awkward_poses;
mod background;
mod broken_files;
mod budget;
mod chart;
mod components;
mod coverage;
mod custom_methods;
mod direct;
mod drawing;
mod exact;
mod faults;
mod features;
mod field;
mod filtering;
mod geometry_term;
mod independence;
mod integral;
mod isosurface;
mod languages;
mod layers;
mod length_units;
mod lifecycle;
mod many_carvers;
mod methods;
mod needs;
mod nifti2;
mod optimizations;
mod options;
mod oracle;
mod presets;
mod properties;
mod ray_methods;
mod readers;
mod rigs;
mod runs;
mod screen_space;
mod settings_changes;
mod shaders;
mod small_files;
mod stability;
mod sweeping;
mod toy_method;
mod transfer_files;
mod transfer_function;
mod unseen;
mod users_own;
mod views;
mod window;
