//! Other programs that draw the same scene.

use serde_json::Value;
use std::{
    io::{Read, Write},
    path::Path,
    process::{Child, Command, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

use super::recorder::Recorder;
use crate::shell;

/// The script that measures VTK. It goes to Python by a pipe, so that no file is needed.
const VTK: &str = include_str!("../../../benches/peers/vtk_shell.py");

/// Our frames, then VTK's if it is installed.
pub fn peers(record: &mut Recorder) -> Result<(), String> {
    let python = record.options.python.as_path();
    let pixels = if record.options.quick { record.scale.image } else { shell::PEER_IMAGE };
    let mut stage = shell::beside_peers(pixels, record.options)?;
    for (filter, mode) in shell::peer_cases() {
        let case = format!("ours, {}, {}", mode.name(), filter.name());
        if record.has_time_for(&case) {
            stage.set_shading(|shading| shading.reconstruction = filter);
            let found = shell::peer_frames(&mut stage, mode, record.options)?;
            record.times(&case, found.times);
        }
    }
    drop(stage);
    if !has_vtk(python) {
        record.leave_out("VTK", &format!("`{}` cannot import vtk", python.display()));
    } else if record.has_time_for("VTK") {
        let [frames, pixels] = [record.options.frames, pixels.x].map(|number| number.to_string());
        let arguments = ["--frames", &frames, "--pixels", &pixels];
        for line in run(python, VTK, &arguments, record.deadline)?.lines() {
            let line: Value = serde_json::from_str(line).map_err(|error| format!("VTK: {error}"))?;
            let text = |name: &str| line[name].as_str().unwrap_or_default();
            let case = format!("{}, {}, {}", text("peer"), text("mode"), text("gl"));
            match line["ms_median"].as_f64() {
                Some(ms) => record.row(&case, "whole frame", "ms", ms),
                None => record.leave_out(&case, text("unsupported")),
            }
        }
    }
    Ok(())
}

fn has_vtk(python: &Path) -> bool {
    let import = Command::new(python).args(["-c", "import vtk"]).stderr(Stdio::null()).status();
    import.is_ok_and(|status| status.success())
}

/// What a script prints. A script that is not done at the deadline is ended.
fn run(python: &Path, script: &str, arguments: &[&str], deadline: Instant) -> Result<String, String> {
    let mut command = Command::new(python);
    command.arg("-").args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = command.spawn().map_err(|error| format!("{}: {error}", python.display()))?;
    let outcome = talk(&mut child, script, deadline);
    if outcome.is_err() {
        // It may have ended already.
        let _ = child.kill();
        let _ = child.wait();
    }
    outcome
}

fn talk(child: &mut Child, script: &str, deadline: Instant) -> Result<String, String> {
    let error = |error: std::io::Error| error.to_string();
    if let Some(mut input) = child.stdin.take() {
        input.write_all(script.as_bytes()).map_err(error)?;
    }
    // A line per mode fits into the pipe.
    let status = loop {
        match child.try_wait().map_err(error)? {
            Some(status) => break status,
            None if Instant::now() > deadline => return Err("VTK was not done in time".to_owned()),
            None => sleep(Duration::from_millis(50)),
        }
    };
    let mut printed = String::new();
    if let Some(mut output) = child.stdout.take() {
        output.read_to_string(&mut printed).map_err(error)?;
    }
    if status.success() { Ok(printed) } else { Err(format!("VTK's script failed: {status}")) }
}
