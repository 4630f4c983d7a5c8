//! The fields of NIfTI headers, the same for both versions.

use nifti::{Endianness, NiftiHeader};

use super::header::DataLocation;
use crate::volume::error::VolumeError;

/// Bytes of a NIfTI-1 header.
pub(super) const VERSION_1_BYTES: u64 = 348;

/// The fields that the reader uses, as written.
#[derive(Debug)]
pub(super) struct Fields {
    pub(super) big_endian: bool,
    /// Whether the data are in the header's file.
    pub(super) attached: bool,
    /// Lowest offset of data in the header's file: after the header and four bytes of flags.
    pub(super) first_data_byte: u64,
    pub(super) dim: [i64; 8],
    pub(super) intent_code: i32,
    pub(super) datatype: i16,
    pub(super) pixdim: [f64; 8],
    pub(super) vox_offset: f64,
    pub(super) scl_slope: f64,
    pub(super) scl_inter: f64,
    pub(super) xyzt_units: i32,
    pub(super) qform_code: i32,
    pub(super) sform_code: i32,
    /// b, c and d.
    pub(super) quatern: [f64; 3],
    pub(super) qoffset: [f64; 3],
    /// Rows for x, y and z.
    pub(super) srow: [[f64; 4]; 3],
}

impl Fields {
    /// Reads the fields of a NIfTI-1 header.
    ///
    /// The `nifti` crate takes the byte order from the number of dimensions and ignores the header's own size.
    /// The two must agree.
    pub(super) fn version_1(bytes: &[u8]) -> Result<Self, VolumeError> {
        let header = NiftiHeader::from_reader(bytes).map_err(|_| not_nifti())?;
        if header.sizeof_hdr as u64 != VERSION_1_BYTES {
            return Err(not_nifti());
        }
        Ok(Self {
            big_endian: header.endianness == Endianness::Big,
            attached: &header.magic == b"n+1\0",
            first_data_byte: VERSION_1_BYTES + 4,
            // Sizes are signed in the format; the crate reads them unsigned.
            dim: header.dim.map(|size| (size as i16).into()),
            intent_code: header.intent_code.into(),
            datatype: header.datatype,
            pixdim: header.pixdim.map(f64::from),
            vox_offset: header.vox_offset.into(),
            scl_slope: header.scl_slope.into(),
            scl_inter: header.scl_inter.into(),
            xyzt_units: header.xyzt_units.into(),
            qform_code: header.qform_code.into(),
            sform_code: header.sform_code.into(),
            quatern: [header.quatern_b, header.quatern_c, header.quatern_d].map(f64::from),
            qoffset: [header.quatern_x, header.quatern_y, header.quatern_z].map(f64::from),
            srow: [header.srow_x, header.srow_y, header.srow_z].map(|row| row.map(f64::from)),
        })
    }

    /// The file that holds the data.
    pub(super) fn data_location(&self) -> DataLocation {
        if self.attached { DataLocation::Attached { offset: 0 } } else { DataLocation::NiftiPair }
    }
}

/// The error of a file that is not NIfTI.
pub(super) fn not_nifti() -> VolumeError {
    VolumeError::NotThisFormat { expected: "a NIfTI file of version 1 or 2" }
}
