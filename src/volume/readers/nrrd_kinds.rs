//! The kinds of axes that NRRD knows.

use std::fmt;

use crate::volume::error::{VolumeError, excerpt};

/// Kind of the samples along an axis.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Places in the grid.
    Grid,
    /// Not given by the header.
    Unknown,
    /// Volumes on the same grid: `time` or `list`.
    Components(&'static str),
    /// A single number.
    Scalar,
    /// Values that belong together: the kind of image, with the header's word for it.
    Values(String),
}

impl Kind {
    /// The kind of a name, in upper or lower case.
    pub(super) fn named(name: &str) -> Result<Self, VolumeError> {
        let lower = name.to_ascii_lowercase();
        let image = match lower.as_str() {
            "domain" | "space" => return Ok(Self::Grid),
            "none" | "???" => return Ok(Self::Unknown),
            "time" => return Ok(Self::Components("time")),
            "list" => return Ok(Self::Components("list")),
            "stub" | "scalar" => return Ok(Self::Scalar),
            "3-color" | "rgb-color" | "hsv-color" | "xyz-color" | "4-color" | "rgba-color" => {
                "a colour image"
            }
            "complex" => "an image of complex numbers",
            "point" => "an image of points",
            "quaternion" => "an image of quaternions",
            "vector" | "covariant-vector" | "normal" | "2-vector" | "3-vector" | "3-gradient"
            | "3-normal" | "4-vector" => "an image of vectors",
            "2d-symmetric-matrix"
            | "2d-masked-symmetric-matrix"
            | "2d-matrix"
            | "2d-masked-matrix"
            | "3d-symmetric-matrix"
            | "3d-masked-symmetric-matrix"
            | "3d-matrix"
            | "3d-masked-matrix" => "an image of matrices",
            _ => return Err(VolumeError::field("kinds", name, "not a kind of axis")),
        };
        Ok(Self::Values(format!("{image} (NRRD kind {})", excerpt(name))))
    }

    /// Whether an axis of this kind can be an axis of the grid.
    pub(super) fn may_be_of_a_grid(&self) -> bool {
        matches!(self, Self::Grid | Self::Unknown)
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Grid => "domain",
            Self::Unknown => "none",
            Self::Components(name) => name,
            Self::Scalar => "scalar",
            Self::Values(image) => image,
        })
    }
}
