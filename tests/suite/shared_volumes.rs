//! The real volumes, which not every machine has.

use std::{io::Write, path::PathBuf, thread};

use crate::headless::project_folder;

/// The folder of real volumes. Where it is missing, the calling test is to return: a line says so, of which
/// `.ci/test` counts how many there were.
///
/// `#[ignore]` and features are for who builds; whether there are volumes shows when a test runs.
pub fn shared_volumes() -> Option<PathBuf> {
    let folder = project_folder().join("../shared/volumes");
    if folder.is_dir() {
        return Some(folder);
    }
    let thread = thread::current();
    let test = thread.name().unwrap_or("a test");
    // Written by hand: what tests that pass print is not shown.
    let _ = writeln!(std::io::stderr(), "skipped: {test} needs ../shared/volumes");
    None
}
