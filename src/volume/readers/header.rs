//! The common header of all formats, and the checks that they share.

use bevy::math::{DAffine3, DVec3, UVec3};

use crate::volume::{
    asset::{Rescale, check_grid_to_patient, check_rescale},
    error::VolumeError,
};

/// Largest number of voxels of a volume along one axis.
pub(crate) const MAX_AXIS: u64 = 65_535;
/// Largest number of voxels of a volume.
pub(crate) const MAX_VOXELS: u64 = 1 << 33;
/// Largest number of voxels of all components of a file together.
const MAX_FILE_VOXELS: u64 = 1 << 48;

/// The number type of voxels in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ScalarType {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F32,
    F64,
}

impl ScalarType {
    /// Bytes per voxel.
    pub(crate) fn bytes(self) -> u64 {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
        }
    }
}

/// Encoding of the voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Encoding {
    /// Plain bytes.
    Raw,
    /// Plain bytes, or gzip if the data begin like gzip: NIfTI tells gzip by the file's name only.
    RawOrGzip,
    /// Gzip, in one or several members.
    Gzip,
    /// A zlib stream, or gzip if the data begin like gzip: MetaImage readers accept both.
    Zlib,
    /// Numbers as text, separated by white space or commas.
    Ascii,
}

/// The file that holds the voxels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum DataLocation {
    /// The header's own file, from byte `offset` as it lies on disk.
    Attached { offset: usize },
    /// Another file, named relative to the header's folder; see [`check_data_file_name`].
    Detached { file: String },
    /// The file whose name differs from the header's in its ending: `.img` or `.img.gz`.
    NiftiPair,
}

/// Bytes before the first voxel, after decompression.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ByteSkip {
    /// Skips this many bytes.
    FromStart(u64),
    /// Skips all bytes but the last ones, which the voxels take (NRRD's and MetaImage's -1).
    FromEnd,
}

/// Layout of a file's components: volumes on one grid, of which one is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Components {
    /// Number of components; not zero.
    pub(crate) count: u64,
    /// Index of the component that is read, from zero.
    pub(crate) index: u64,
    /// Number of whole grid axes before the component axis: 0 if components alternate voxel by voxel, 3 if
    /// one volume follows the other.
    pub(crate) axes_before: usize,
}

/// A checked grid from a file's header: decoding can fail only on the data.
#[derive(Clone, Debug)]
pub(crate) struct GridHeader {
    /// Voxels along x, y and z.
    pub(crate) dimensions: UVec3,
    /// The volumes in the file, and the volume to read.
    pub(crate) components: Components,
    /// The voxels' number type.
    pub(crate) scalar: ScalarType,
    /// Whether a voxel's most significant byte comes first.
    pub(crate) big_endian: bool,
    /// Encoding of the voxels.
    pub(crate) encoding: Encoding,
    /// Transform from voxel index to patient millimetres, RAS+.
    pub(crate) grid_to_patient: DAffine3,
    /// Conversion from the file's numbers to its units.
    pub(crate) rescale: Rescale,
    /// The file that holds the voxels.
    pub(crate) data: DataLocation,
    /// Lines to skip first, before decompression.
    pub(crate) line_skip: u64,
    /// Bytes to skip then, after decompression.
    pub(crate) byte_skip: ByteSkip,
}

impl GridHeader {
    /// Checks the conditions of [`Volume::new`](crate::volume::Volume::new) before the data are decoded.
    pub(crate) fn checked(self) -> Result<Self, VolumeError> {
        let voxels = self.voxels().checked_mul(self.components.count);
        if voxels.is_none_or(|voxels| voxels > MAX_FILE_VOXELS) {
            let mut sizes = self.dimensions.to_array().map(u64::from).to_vec();
            sizes.push(self.components.count);
            let reason = format!("at most {MAX_FILE_VOXELS} voxels in a file can be read");
            return Err(VolumeError::Dimensions { sizes, reason });
        }
        check_grid_to_patient(&self.grid_to_patient)?;
        check_rescale(self.rescale)?;
        if let DataLocation::Detached { file } = &self.data {
            check_data_file_name(file)?;
        }
        Ok(self)
    }

    /// Number of voxels of the grid.
    pub(crate) fn voxels(&self) -> u64 {
        self.dimensions.to_array().into_iter().map(u64::from).product()
    }

    /// Decompressed bytes of one component's voxels, at most 2^36.
    pub(crate) fn volume_bytes(&self) -> u64 {
        self.voxels() * self.scalar.bytes()
    }

    /// Decompressed bytes of all components' voxels, at most 2^51.
    pub(crate) fn data_bytes(&self) -> u64 {
        self.volume_bytes() * self.components.count
    }

    /// Number of voxels of one component that follow each other in the file.
    pub(crate) fn run(&self) -> u64 {
        self.dimensions.to_array().into_iter().take(self.components.axes_before).map(u64::from).product()
    }
}

/// The grid's dimensions, if there are three axes of valid length.
pub(crate) fn checked_dimensions(sizes: &[u64]) -> Result<UVec3, VolumeError> {
    let error = |reason: String| VolumeError::Dimensions { sizes: sizes.to_vec(), reason };
    let &[x, y, z] = sizes else {
        return Err(error("three are needed".into()));
    };
    let axis = |size: u64| match u32::try_from(size) {
        Ok(0) => Err(error("a dimension is zero".into())),
        Ok(fits) if size <= MAX_AXIS => Ok(fits),
        _ => Err(error(format!("at most {MAX_AXIS} voxels along an axis can be read"))),
    };
    let dimensions = UVec3::new(axis(x)?, axis(y)?, axis(z)?);
    // Three factors below 2^16 cannot overflow.
    if x * y * z > MAX_VOXELS {
        return Err(error(format!("at most {MAX_VOXELS} voxels can be read")));
    }
    Ok(dimensions)
}

/// Checks that a data file's name stays in the header's folder or below it.
///
/// A header may come from anywhere. It must not make a program read other files of its user.
pub(crate) fn check_data_file_name(file: &str) -> Result<(), VolumeError> {
    let error = |reason| Err(VolumeError::field("data file", file, reason));
    // Both separators count: the header may be written or read on either system.
    let is_separator = |c| c == '/' || c == '\\';
    if file.is_empty() || file.ends_with(is_separator) {
        return error("names no file");
    }
    if file.contains('\0') {
        return error("contains a zero byte");
    }
    // `C:\file`, `C:file` and `source://file` all leave the folder.
    if file.starts_with(is_separator) || file.as_bytes().get(1) == Some(&b':') || file.contains("://") {
        return error("must be relative to the header");
    }
    if file.split(is_separator).any(|part| part == "..") {
        return error("must not leave the header's folder");
    }
    Ok(())
}

/// Turns a transform in a format's patient axes to RAS+ by flipping x, y or both.
pub(crate) fn to_ras(grid_to_patient: DAffine3, flip_x: bool, flip_y: bool) -> DAffine3 {
    let sign = |flip| if flip { -1.0 } else { 1.0 };
    DAffine3::from_scale(DVec3::new(sign(flip_x), sign(flip_y), 1.0)) * grid_to_patient
}

/// The next line of `bytes` from `at` on, without its ending, and the start of the line after it.
/// `None` at the end of the bytes.
pub(crate) fn next_line(bytes: &[u8], at: usize) -> Option<(&[u8], usize)> {
    let rest = bytes.get(at..).filter(|rest| !rest.is_empty())?;
    let end = rest.iter().position(|&byte| byte == b'\n');
    let line = rest.get(..end.unwrap_or(rest.len()))?;
    let next = at + end.map_or(rest.len(), |end| end + 1);
    Some((line.strip_suffix(b"\r").unwrap_or(line), next))
}

/// Parses whitespace-separated numbers of a header field.
pub(crate) fn parse_numbers<T: std::str::FromStr>(
    field: &'static str,
    text: &str,
) -> Result<Vec<T>, VolumeError> {
    text.split_whitespace()
        .map(|word| word.parse().ok())
        .collect::<Option<_>>()
        .ok_or_else(|| VolumeError::field(field, text, "not a list of numbers"))
}

/// Parses exactly `count` whitespace-separated numbers of a header field.
pub(crate) fn parse_count(field: &'static str, text: &str, count: usize) -> Result<Vec<f64>, VolumeError> {
    let numbers = parse_numbers(field, text)?;
    if numbers.len() != count {
        return Err(VolumeError::field(field, text, format!("{count} numbers are needed")));
    }
    Ok(numbers)
}
