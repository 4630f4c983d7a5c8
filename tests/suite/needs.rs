//! Resources that not every machine has. If one is missing, a line says so, and the calling test must return.
//! `.ci/test` counts these lines.
//!
//! `#[ignore]` and features are chosen for a build. A machine's resources show only when a test runs.

use bevy::render::{
    render_resource::WgpuFeatures,
    renderer::{RenderAdapterInfo, RenderDevice},
};
use std::{io::Write, path::PathBuf, process::Command, thread};

use crate::{headless::project_folder, scene::TestScene};

/// Features of which either lets Bevy read numbers from a device.
pub const QUERIES: WgpuFeatures =
    WgpuFeatures::TIMESTAMP_QUERY.union(WgpuFeatures::PIPELINE_STATISTICS_QUERY);

/// The folder of real volumes: `../shared/volumes`, unless `CONTEXTUAL_AO_VOLUMES` names another.
pub fn shared_volumes() -> Option<PathBuf> {
    let named = std::env::var_os("CONTEXTUAL_AO_VOLUMES").map(PathBuf::from);
    let folder = named.unwrap_or_else(|| project_folder().join("../shared/volumes"));
    if folder.is_dir() {
        return Some(folder);
    }
    skip("../shared/volumes");
    None
}

/// A program of another reader, for comparison: its path by the environment variable, else `name`.
///
/// It is there if it runs with `arguments`.
pub fn program(variable: &str, name: &str, arguments: &[&str]) -> Option<Command> {
    let path = std::env::var_os(variable).unwrap_or_else(|| name.into());
    let runs = Command::new(&path).args(arguments).output();
    // `dcm2niix -v` ends with a code of its own.
    if runs.is_ok_and(|output| output.status.code().is_some_and(|code| code != 1)) {
        return Some(Command::new(path));
    }
    skip(&format!("{name} ({})", arguments.join(" ")));
    None
}

/// Whether the device can count work: Bevy reads buffers only where it reads queries.
pub fn counters(scene: &mut TestScene) -> bool {
    one_of(scene, QUERIES, "queries of time or statistics")
}

/// Whether the device keeps intensities of 16 bits as they are.
pub fn wide_intensities(scene: &mut TestScene) -> bool {
    let formats = WgpuFeatures::TEXTURE_FORMAT_16BIT_NORM | WgpuFeatures::FLOAT32_FILTERABLE;
    one_of(scene, formats, "intensities of 16 bits")
}

/// Whether Bevy draws atmospheres on the device. Mesa 22.3 crashes in them, with or without volumes.
pub fn atmospheres(scene: &mut TestScene) -> bool {
    let what = "a driver that draws Bevy's atmosphere";
    let is_crashing = scene.world().resource::<RenderAdapterInfo>().driver_info.contains("Mesa 22.");
    if is_crashing {
        skip(what);
    }
    !is_crashing && one_of(scene, WgpuFeatures::FLOAT32_FILTERABLE, what)
}

fn one_of(scene: &mut TestScene, features: WgpuFeatures, what: &str) -> bool {
    let has_one = scene.world().resource::<RenderDevice>().features().intersects(features);
    if !has_one {
        skip(what);
    }
    has_one
}

fn skip(what: &str) {
    let thread = thread::current();
    let test = thread.name().unwrap_or("a test");
    // The line is written directly, because printed output of passing tests is not shown.
    let _ = writeln!(std::io::stderr(), "skipped: {test} needs {what}");
}

/// Folder for pictures of a session, if a runtime for headsets is to be used: `.ci/headset` starts one, and names the folder.
pub fn headset() -> Option<PathBuf> {
    let pictures = std::env::var_os("CONTEXTUAL_AO_HEADSET").map(PathBuf::from);
    if pictures.is_none() {
        skip("a runtime for headsets (.ci/headset)");
    }
    pictures
}
