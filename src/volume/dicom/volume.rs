//! Series and their volumes, as a list: no pixels have been read yet.

use std::fmt;

use bevy::math::{DAffine3, DVec3, UVec3, Vec3};

use super::{
    settings::DicomReadSettings,
    slice::{Slice, SpacingFrom, Window, has_units},
    stack::Stack,
};
use crate::volume::error::VolumeFileError;

/// A series: what a scanner, or a program, made in one go.
#[derive(Clone, Debug)]
pub struct DicomSeries {
    /// Kind of the scanner, such as `CT`, `MR` or `PT`.
    pub modality: String,
    /// The series' number in its study.
    pub number: Option<i32>,
    /// The volumes, that with the most slices first: phases, echoes, b-values, or grids of their own.
    pub volumes: Vec<DicomVolume>,
}

/// A volume of a series, whose slices were found and put in order.
#[derive(Clone, Debug)]
pub struct DicomVolume {
    label: String,
    pub(super) stack: Stack,
    warnings: Vec<String>,
}

/// Unit of a volume's values.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum DicomUnit {
    /// Hounsfield units, of CT.
    Hounsfield,
    /// Standardised uptake by body weight, g/ml, of PET.
    Suv,
    /// Another unit, by its code in the file.
    Other(String),
    /// The file names none, as those of most MR.
    Unknown,
}

/// Place of a volume's voxels in the patient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DicomGrid {
    /// Voxels along each axis.
    pub dimensions: UVec3,
    /// As [`Volume::grid_to_patient`](crate::volume::Volume::grid_to_patient).
    pub grid_to_patient: DAffine3,
}

impl DicomGrid {
    /// Distance of voxels along each axis, mm.
    pub fn spacing_mm(&self) -> Vec3 {
        let matrix = self.grid_to_patient.matrix3;
        DVec3::new(matrix.x_axis.length(), matrix.y_axis.length(), matrix.z_axis.length()).as_vec3()
    }
}

impl DicomVolume {
    pub(super) fn new(label: String, stack: Stack, warning: Option<String>) -> Self {
        let mut warnings: Vec<String> = warning.into_iter().collect();
        warnings.extend(warnings_of(&stack));
        Self { label, stack, warnings }
    }

    /// Difference from the series' other volumes, such as `echo time 4.6`; empty if there is no other at its place.
    pub fn label(&self) -> &str {
        &self.label
    }

    /// Number of slices in the files.
    pub fn slices(&self) -> usize {
        self.stack.slices.len()
    }

    /// All that was not as it should be: slices at uneven distances, a guess in place of a missing field.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// The grid of the volume when it is read with these settings, before they halve it.
    ///
    /// # Errors
    ///
    /// If the settings refuse the volume. The error names its first file.
    pub fn grid(&self, settings: &DicomReadSettings) -> Result<DicomGrid, VolumeFileError> {
        let grid = self.stack.grid(settings).map_err(|cause| self.first().image.source.error(cause))?;
        Ok(DicomGrid { dimensions: grid.dimensions, grid_to_patient: grid.grid_to_patient })
    }

    /// Unit of the values.
    pub fn unit(&self) -> DicomUnit {
        let image = &self.first().image;
        if matches!(image.suv, Some(Ok(_))) {
            return DicomUnit::Suv;
        }
        match self.first().unit.as_deref() {
            // CT is in Hounsfield units unless the file says otherwise.
            None | Some("HU") if image.modality == "CT" => DicomUnit::Hounsfield,
            // Unspecified.
            None | Some("US") => DicomUnit::Unknown,
            Some(unit) => DicomUnit::Other(unit.into()),
        }
    }

    /// Ranges of values worth looking at, in [file units](crate::volume::Volume::to_file_units), by the slice in the
    /// middle.
    pub fn windows(&self) -> Vec<Window> {
        let slice = &self.stack.slices[self.stack.slices.len() / 2];
        let image = &slice.image;
        let sign = if image.format.inverted && !has_units(image) { -1.0 } else { 1.0 };
        let factor = image.suv.and_then(Result::ok).map_or(1.0, |suv| suv.0);
        let in_units =
            |window: &Window| Window { center: sign * factor * window.center, width: factor * window.width };
        slice.windows.iter().map(in_units).collect()
    }

    /// Kind of the scanner.
    pub fn modality(&self) -> &str {
        &self.first().image.modality
    }

    pub(super) fn first(&self) -> &Slice {
        // A stack has two slices or more.
        &self.stack.slices[0]
    }
}

fn warnings_of(stack: &Stack) -> Vec<String> {
    let mut warnings = Vec::new();
    let first = &stack.slices[0];
    let image = &first.image;
    match first.spacing_from {
        SpacingFrom::Patient => {}
        SpacingFrom::Detector => {
            warnings.push("PixelSpacing is missing: ImagerPixelSpacing, the detector's, is taken".into());
        }
        SpacingFrom::Nothing => {
            warnings
                .push("PixelSpacing and ImagerPixelSpacing are missing: pixels are taken for 1 mm".into());
        }
    }
    if !stack.is_even() {
        let steps = stack.steps();
        let named: Vec<_> =
            steps.iter().take(8).map(|(count, mm)| format!("{count} of {mm:.2} mm")).collect();
        let more = if steps.len() > 8 { ", and so on" } else { "" };
        let named = named.join(", ");
        let text = format!("slices are interpolated, because their steps are uneven: {named}{more}");
        warnings.push(text);
    }
    if image.format.inverted {
        let way = if has_units(image) { "its values have units and stay" } else { "its values are negated" };
        warnings.push(format!("MONOCHROME1, high values are dark: {way}"));
    }
    if let Some(Err(reason)) = image.suv {
        warnings.push(format!("the values are no SUV: {reason}"));
    }
    warnings
}

impl fmt::Display for DicomSeries {
    /// The modality, the number, and the count and size of the volumes; nothing of the patient.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.modality)?;
        if let Some(number) = self.number {
            write!(f, " series {number}")?;
        }
        for (index, volume) in self.volumes.iter().enumerate() {
            let image = &volume.first().image;
            let separator = if index == 0 { ": " } else { "; " };
            write!(f, "{separator}{}x{}, {} slices", image.columns, image.rows, volume.slices())?;
            if !volume.label.is_empty() {
                write!(f, " ({})", volume.label)?;
            }
        }
        Ok(())
    }
}
