//! The machine and the program that a report is of.

use bevy::{
    prelude::*,
    render::{
        renderer::{RenderAdapterInfo, RenderDevice},
        settings::WgpuFeatures,
    },
};
use contextual_ao_kit::headless::Headless;
use std::{env::consts, thread::available_parallelism};

use crate::Options;

/// Description of the machine.
pub struct Machine {
    /// Name of the graphics device.
    pub device: String,
    /// Name of the report's files, made from the device's name.
    pub file_name: String,
    /// Names and values for the report.
    pub facts: Vec<(&'static str, String)>,
}

impl Machine {
    /// Opens the device for a moment.
    pub fn of(options: &Options) -> Self {
        let headless = Headless::new(UVec2::splat(16), |_| {});
        let world = headless.app.world();
        let adapter = world.resource::<RenderAdapterInfo>();
        let device = world.resource::<RenderDevice>();
        let features = device.features();
        let (limits, has) = (device.limits(), |feature| yes_or_no(features.contains(feature)));
        let timed = if headless.is_software() {
            "the clock, after each pass: this driver's timestamps say nothing about compute passes"
        } else if features.contains(WgpuFeatures::TIMESTAMP_QUERY) {
            "timestamps"
        } else {
            "nothing: the device has no timestamps"
        };
        let facts = vec![
            ("Device", adapter.name.clone()),
            ("Kind", format!("{:?}", adapter.device_type)),
            ("Backend", format!("{:?}", adapter.backend)),
            ("Driver", format!("{} {}", adapter.driver, adapter.driver_info)),
            ("Passes timed by", timed.to_owned()),
            ("Timestamp queries", has(WgpuFeatures::TIMESTAMP_QUERY)),
            ("Timestamps inside passes", has(WgpuFeatures::TIMESTAMP_QUERY_INSIDE_PASSES)),
            ("Pipeline statistics", has(WgpuFeatures::PIPELINE_STATISTICS_QUERY)),
            ("Subgroups", has(WgpuFeatures::SUBGROUP)),
            ("Formats of 16 bits, normalized", has(WgpuFeatures::TEXTURE_FORMAT_16BIT_NORM)),
            ("Largest 3D texture, texels", limits.max_texture_dimension_3d.to_string()),
            ("Largest 2D texture, texels", limits.max_texture_dimension_2d.to_string()),
            ("Largest buffer, MiB", mib(limits.max_buffer_size)),
            ("Largest storage binding, MiB", mib(limits.max_storage_buffer_binding_size)),
            ("Storage buffers of a stage", limits.max_storage_buffers_per_shader_stage.to_string()),
            ("Storage textures of a stage", limits.max_storage_textures_per_shader_stage.to_string()),
            ("Invocations of a workgroup", limits.max_compute_invocations_per_workgroup.to_string()),
            ("Workgroups along a dimension", limits.max_compute_workgroups_per_dimension.to_string()),
            ("Workgroup memory, bytes", limits.max_compute_workgroup_storage_size.to_string()),
            ("Processors", available_parallelism().map_or(0, usize::from).to_string()),
            ("System", format!("{} {}", consts::OS, consts::ARCH)),
            ("bevy_contextual_ao", version().to_owned()),
            ("Debug assertions", yes_or_no(cfg!(debug_assertions))),
            ("Size", if options.quick { "small, with --quick" } else { "full" }.to_owned()),
            ("Frames of a median", super::recorder::Scale::of(options).repeats(options).frames.to_string()),
        ];
        Self { file_name: file_name(&adapter.name), device: adapter.name.clone(), facts }
    }
}

/// Version of the crate that is measured.
fn version() -> &'static str {
    let manifest = include_str!("../../../Cargo.toml");
    let version = manifest.lines().find_map(|line| line.strip_prefix("version = "));
    version.unwrap_or_default().trim_matches('"')
}

fn yes_or_no(is_so: bool) -> String {
    if is_so { "yes" } else { "no" }.to_owned()
}

fn mib(bytes: u64) -> String {
    (bytes >> 20).to_string()
}

/// Letters and digits of a device's name, joined by hyphens.
fn file_name(device: &str) -> String {
    let words = device.split(|letter: char| !letter.is_ascii_alphanumeric());
    let words: Vec<_> = words.filter(|word| !word.is_empty()).map(str::to_ascii_lowercase).collect();
    if words.is_empty() { "device".to_owned() } else { words.join("-") }
}
