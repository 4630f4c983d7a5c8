//! Every table on a machine that has nothing but this program, as one Markdown file and one CSV file. Scenes are
//! generated. Sections run one after the other, and both files are written after each.

mod changes;
mod first_frame;
mod machine;
mod model;
mod passes;
mod peers;
mod recorder;
mod tables;

use bevy::prelude::*;
use contextual_ao_kit::report::{LeftOut, Report, Section, to_csv, to_markdown};
use std::{
    any::Any,
    fs,
    panic::{AssertUnwindSafe, catch_unwind},
    path::Path,
    time::{Duration, Instant},
};

use crate::Options;
use machine::Machine;
use recorder::{Recorder, Shells};

/// A section that can be measured.
struct Plan {
    name: &'static str,
    about: &'static str,
    /// Share of the time. Sections after one that took more or less share the rest.
    share: f64,
    measure: fn(&mut Recorder) -> Result<(), String>,
}

/// Time after which no case is begun: less than eight minutes, as the last case takes its time. With --quick the second
/// is for a software driver.
const SECONDS: [f64; 2] = [450.0, 270.0];

/// All sections, the most important first.
const PLANS: [Plan; 9] = [
    Plan {
        name: "First frame and memory",
        about: "From a volume in main memory to a frame with all its occlusion. Reading a file is left out. The first \
                volume of an app waits for its shaders as well. Memory is that of the plugin on the device.",
        share: 40.0,
        measure: first_frame::measure,
    },
    Plan {
        name: "Passes",
        about: "Two eyes, a sample of a view ray every half voxel. Milliseconds are medians.",
        share: 80.0,
        measure: passes::passes,
    },
    Plan {
        name: "Growth",
        about: "Carve frames of the shell in more and more voxels, 26 rays of 20 samples. The image grows alike. The \
                surface grows by 4, the volume by 8.",
        share: 45.0,
        measure: passes::growth,
    },
    Plan {
        name: "Two eyes",
        about: "A second eye, a whole image beside the first. The ratio is that of whole frames.",
        share: 60.0,
        measure: changes::two_eyes,
    },
    Plan {
        name: "Carvers",
        about: "One ball moves, others rest. The ratio is that of whole frames.",
        share: 45.0,
        measure: changes::carvers,
    },
    Plan {
        name: "Edits of the transfer function",
        about: "Frames in which the transfer function changed: all occlusion that is seen is cast again.",
        share: 30.0,
        measure: changes::edits,
    },
    Plan {
        name: "Optimizations",
        about: "Carve frames with all optimizations, then without one at a time. None changes a pixel.",
        share: 70.0,
        measure: tables::ablation,
    },
    Plan {
        name: "Tables of the paper",
        about: "What tables 2 to 6 of the CAO paper show, in generated volumes. LAO is dense, and without any \
                optimization, as published.",
        share: 60.0,
        measure: tables::paper,
    },
    Plan {
        name: "Peers",
        about: "The scene of benches/peers, where VTK draws the same: the cut and the camera move. The image has 512 x \
                512 pixels, with --quick 200 x 200.",
        share: 50.0,
        measure: peers::peers,
    },
];

/// Tables that cannot be measured, with the options that measure them elsewhere.
const LEFT_OUT: [&str; 6] = ["--counts", "--times", "--directions", "--chart", "--filtering", "--isosurface"];

/// Measures all sections and writes them into `folder`.
pub fn run(folder: &Path, options: &Options) -> Result<(), String> {
    let error = |error: std::io::Error| format!("{}: {error}", folder.display());
    fs::create_dir_all(folder).map_err(error)?;
    let machine = Machine::of(options);
    let scale = recorder::Scale::of(options);
    let options = &scale.repeats(options);
    let mut report = Report {
        title: format!("Measured on {}", machine.device),
        machine: machine.facts.clone(),
        sections: Vec::new(),
    };
    let device = model::Device::named(&machine.device).filter(|_| !options.quick);
    let mut shells = Shells::default();
    let end = Instant::now() + Duration::from_secs_f64(SECONDS[usize::from(options.quick)]);
    for (index, plan) in PLANS.iter().enumerate() {
        let begin = Instant::now();
        let shares: f64 = PLANS[index..].iter().map(|plan| plan.share).sum();
        let deadline = begin + end.saturating_duration_since(begin).mul_f64(plan.share / shares);
        let section = Section { name: plan.name, about: plan.about.to_owned(), ..default() };
        let mut recorder = Recorder { section, options, scale, device, shells: &mut shells, deadline };
        // The renderer's errors are panics. They end a section, not the report.
        let outcome = catch_unwind(AssertUnwindSafe(|| (plan.measure)(&mut recorder)));
        let outcome = outcome.unwrap_or_else(|panic| Err(message(panic.as_ref())));
        let mut section = recorder.section;
        section.error = outcome.err();
        section.seconds = begin.elapsed().as_secs_f64();
        eprintln!("{}: {:.0} s", section.name, section.seconds);
        report.sections.push(section);
        write(folder, &machine.file_name, &report)?;
    }
    report.sections.push(not_here());
    write(folder, &machine.file_name, &report)
}

/// The section that names all tables of other volumes.
fn not_here() -> Section {
    let left_out = LEFT_OUT.map(|option| LeftOut {
        case: format!("measure {option}"),
        reason: "it needs CT and MRI volumes, which are no part of the program".to_owned(),
    });
    Section {
        name: "Other tables",
        about: "The whole report is measured in generated volumes.".to_owned(),
        left_out: left_out.to_vec(),
        ..default()
    }
}

fn write(folder: &Path, file_name: &str, report: &Report) -> Result<(), String> {
    for (extension, text) in [("md", to_markdown(report)), ("csv", to_csv(report))] {
        let file = folder.join(file_name).with_extension(extension);
        fs::write(&file, text).map_err(|error| format!("{}: {error}", file.display()))?;
    }
    Ok(())
}

/// Message of a panic.
fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
    text.unwrap_or("a panic without a message").to_owned()
}
