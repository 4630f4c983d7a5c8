//! Files to open, from command-line options.

use bevy::prelude::*;
use bevy_contextual_ao::prelude::*;
use clap::Args;
use std::path::PathBuf;

/// A volume and its look.
#[derive(Args, Resource, Clone, Debug, Default)]
pub struct FileOptions {
    /// Volume to open: .nii, .nii.gz, .hdr, .nrrd, .nhdr, .mha or .mhd; a folder, an archive (.zip) or a file of DICOM.
    /// A generated head if left out.
    pub file: Option<PathBuf>,
    /// Index of the series to open among those of DICOM files [default: the only one, else what is clicked].
    #[arg(long, value_name = "N", requires = "file")]
    pub series: Option<u32>,
    /// Index of the volume in a file or in a series that holds several, such as times or echoes; counted from zero.
    #[arg(long, value_name = "N", requires = "file")]
    pub component: Option<u32>,
    /// Colours and opacities: a volume property of 3D Slicer (.vp, .vp.json) or .tf.ron.
    #[arg(long, value_name = "FILE", conflicts_with = "preset")]
    pub transfer_function: Option<PathBuf>,
    /// Colours and opacities for a common examination: ct_bone, ct_soft_tissue, ct_vessels, ct_lung, mr_head or
    /// mr_angiography.
    #[arg(long, value_name = "NAME")]
    pub preset: Option<Preset>,
}
