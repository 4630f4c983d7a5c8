//! What a section measures with: its scenes, its time, and the rows that it leaves.

use bevy::{platform::collections::HashMap, prelude::*};
use bevy_contextual_ao::{diagnostics::Work, prelude::*};
use contextual_ao_kit::{
    report::{LeftOut, Row, Section},
    scene::SceneParts,
};
use std::time::Instant;

use super::model::Device;
use crate::{Options, figures::FrameTimes, shell, stage::Stage};

/// Size of what is measured.
#[derive(Clone, Copy)]
pub struct Scale {
    /// Voxels along each side of the largest volume.
    pub voxels: u32,
    /// Voxels along each side where frames without optimizations are measured.
    pub voxels_without: u32,
    /// Voxels along each side where dense LAO is measured: as many as the paper's Engine has.
    pub voxels_dense: u32,
    /// Voxels from the phantom's neck to its vertex.
    pub phantom: u32,
    /// An eye's image, pixels.
    pub eye: UVec2,
    /// Other images, pixels.
    pub image: UVec2,
}

impl Scale {
    /// With --quick all is small enough for a software driver.
    pub fn of(options: &Options) -> Self {
        let image = options.image_size();
        if options.quick {
            Self { voxels: 128, voxels_without: 64, voxels_dense: 64, phantom: 64, eye: image, image }
        } else {
            let eye = UVec2::splat(2000);
            Self { voxels: 512, voxels_without: 256, voxels_dense: 192, phantom: 160, eye, image }
        }
    }

    /// Options with fewer frames where they are slow.
    pub fn repeats(self, options: &Options) -> Options {
        let options = options.clone();
        if options.quick {
            Options { warmup: options.warmup.min(1), frames: options.frames.min(3), ..options }
        } else {
            options
        }
    }
}

/// Generated volumes that are kept, by voxels along each side: the largest takes seconds to generate.
#[derive(Default)]
pub struct Shells(HashMap<u32, Volume>);

/// Records a section.
pub struct Recorder<'a> {
    /// The section so far.
    pub section: Section,
    pub options: &'a Options,
    pub scale: Scale,
    /// The model's device, if it knows this one and the scenes are its scenes.
    pub device: Option<Device>,
    pub shells: &'a mut Shells,
    /// No case is begun after this time.
    pub deadline: Instant,
}

impl Recorder<'_> {
    /// Whether there is time for a case. If not, the case is left out.
    pub fn has_time_for(&mut self, case: &str) -> bool {
        let has_time = Instant::now() < self.deadline;
        if !has_time {
            self.leave_out(case, "the time was up");
        }
        has_time
    }

    /// Notes that a case was not measured.
    pub fn leave_out(&mut self, case: &str, reason: &str) {
        self.section.left_out.push(LeftOut { case: case.to_owned(), reason: reason.to_owned() });
    }

    /// Adds a figure.
    pub fn row(&mut self, case: &str, figure: &str, unit: &'static str, measured: f64) {
        self.row_beside(case, figure, unit, measured, None);
    }

    /// Adds a figure, and what the model predicts for it.
    pub fn row_beside(
        &mut self,
        case: &str,
        figure: &str,
        unit: &'static str,
        measured: f64,
        predicted: Option<f64>,
    ) {
        let (case, figure) = (case.to_owned(), figure.to_owned());
        self.section.rows.push(Row { case, figure, unit, measured, predicted });
    }

    /// Adds the times of passes, 0 if they did not run, and of the frame.
    pub fn times(&mut self, case: &str, times: FrameTimes) {
        self.times_beside(case, times, |_| None);
    }

    /// [`Self::times`] with what the model predicts for a pass.
    pub fn times_beside(&mut self, case: &str, times: FrameTimes, predicted: impl Fn(&str) -> Option<f64>) {
        for (name, ms) in times.named().into_iter().filter(|(name, _)| *name != "clip_and_cast") {
            let name = if name == "total" { "whole frame" } else { name };
            self.row_beside(case, name, "ms", ms, predicted(name));
        }
    }

    /// Adds the work of a ray cast.
    pub fn work(&mut self, case: &str, work: Work) {
        for (figure, count) in
            [("voxels cast", work.voxels), ("samples", work.samples), ("distances", work.distances)]
        {
            self.row(case, figure, "10^6", count as f64 / 1e6);
        }
    }

    /// A scene in an app of its own, with an image of `size` pixels.
    pub fn stage(&self, parts: SceneParts, size: UVec2) -> Stage {
        let mut stage = Stage::new(parts, size);
        if self.options.quick {
            // A software driver takes long for the maps of many carvers.
            stage.headless.app.insert_resource(ClipSettings { depth_map_size: 256, ..default() });
        }
        stage
    }

    /// Parts of the shell with a ball that carves, `size` voxels along each side.
    pub fn shell(&mut self, size: u32) -> Result<SceneParts, String> {
        let volume = match self.shells.0.get(&size) {
            Some(volume) => volume.clone(),
            None => self.shells.0.entry(size).insert(shell::generate(size)?).get().clone(),
        };
        shell::carved(volume)
    }
}
