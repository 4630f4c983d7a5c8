//! The volume itself: a grid of stored intensities with its place in the patient.

use std::{fmt, sync::Arc};

use bevy::math::{DAffine3, UVec3, Vec3};

use super::VolumeError;

/// Stored voxel values, x fastest, then y, then z.
#[derive(Clone, PartialEq, Eq)]
pub enum Intensities {
    /// Eight bits per voxel.
    U8(Vec<u8>),
    /// Sixteen bits per voxel.
    U16(Vec<u16>),
}

impl Intensities {
    /// Number of voxels.
    pub fn len(&self) -> usize {
        match self {
            Self::U8(values) => values.len(),
            Self::U16(values) => values.len(),
        }
    }

    /// Whether there are no voxels.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The stored value of voxel `index`, or `None` past the end.
    pub fn get(&self, index: usize) -> Option<u16> {
        match self {
            Self::U8(values) => values.get(index).map(|&value| value.into()),
            Self::U16(values) => values.get(index).copied(),
        }
    }

    /// Smallest and largest stored value; `[0, 0]` without voxels.
    fn range(&self) -> [u16; 2] {
        fn of<T: Copy + Ord + Into<u16>>(values: &[T]) -> [u16; 2] {
            let low = values.iter().copied().min().map_or(0, Into::into);
            let high = values.iter().copied().max().map_or(0, Into::into);
            [low, high]
        }
        match self {
            Self::U8(values) => of(values),
            Self::U16(values) => of(values),
        }
    }
}

impl fmt::Debug for Intensities {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = match self {
            Self::U8(_) => "U8",
            Self::U16(_) => "U16",
        };
        write!(f, "{name}([{} voxels])", self.len())
    }
}

/// Conversion of a stored value to the file's units (such as Hounsfield units):
/// `slope * stored + intercept`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rescale {
    /// File units per stored step; finite, not zero, may be negative.
    pub slope: f64,
    /// File units at stored value zero; finite.
    pub intercept: f64,
}

impl Default for Rescale {
    /// Stored values are file units.
    fn default() -> Self {
        Self { slope: 1.0, intercept: 0.0 }
    }
}

/// A scalar volume: a grid of intensities and its place in the patient. Copies share the intensities.
#[derive(Clone, Debug, PartialEq, bevy::asset::Asset, bevy::reflect::TypePath)]
pub struct Volume {
    dimensions: UVec3,
    grid_to_patient: DAffine3,
    spacing_mm: Vec3,
    /// Shared by all copies.
    intensities: Arc<Intensities>,
    stored_range: [u16; 2],
    rescale: Rescale,
    background_voxels: u64,
}

impl Volume {
    /// Makes a volume of `dimensions` voxels from `intensities` (x fastest).
    ///
    /// `grid_to_patient` maps a voxel index (i, j, k), whole numbers at voxel centres, to patient millimetres.
    /// The patient axes are RAS+: x to the right, y to the front, z up.
    /// The transform may be oblique, mirrored or sheared.
    ///
    /// # Errors
    ///
    /// [`VolumeError::Dimensions`] if a dimension is zero, or if their product is not the number of
    /// intensities. [`VolumeError::Field`] if `grid_to_patient` is not finite or not invertible,
    /// if `rescale` is not finite, or if its slope is zero.
    pub fn new(
        dimensions: UVec3,
        grid_to_patient: DAffine3,
        intensities: Intensities,
        rescale: Rescale,
    ) -> Result<Self, VolumeError> {
        let sizes = dimensions.to_array().map(u64::from);
        let voxels = sizes.iter().try_fold(1u64, |a, &b| a.checked_mul(b));
        let dimension_error = |reason: String| VolumeError::Dimensions { sizes: sizes.to_vec(), reason };
        if voxels == Some(0) {
            return Err(dimension_error("a dimension is zero".into()));
        }
        if voxels != u64::try_from(intensities.len()).ok() {
            let found = intensities.len();
            return Err(dimension_error(format!("but there are {found} voxels")));
        }
        let spacing_mm = check_grid_to_patient(&grid_to_patient)?;
        check_rescale(rescale)?;
        Ok(Self {
            dimensions,
            grid_to_patient,
            spacing_mm,
            stored_range: intensities.range(),
            intensities: Arc::new(intensities),
            rescale,
            background_voxels: 0,
        })
    }

    /// Sets the number of voxels that are NaN or infinite in the file.
    pub(crate) fn with_background_voxels(self, background_voxels: u64) -> Self {
        Self { background_voxels, ..self }
    }

    /// Number of voxels along x, y and z; none is zero.
    pub fn dimensions(&self) -> UVec3 {
        self.dimensions
    }

    /// Number of voxels.
    pub fn voxel_count(&self) -> u64 {
        self.dimensions.to_array().into_iter().map(u64::from).product()
    }

    /// Distance between neighbouring voxel centres along each axis, in millimetres; finite and positive.
    pub fn spacing_mm(&self) -> Vec3 {
        self.spacing_mm
    }

    /// Transform from voxel indices (whole numbers at voxel centres) to patient millimetres, RAS+.
    pub fn grid_to_patient(&self) -> DAffine3 {
        self.grid_to_patient
    }

    /// The stored values, x fastest.
    pub fn intensities(&self) -> &Intensities {
        &self.intensities
    }

    /// The stored values, shared by copies of the volume.
    pub(crate) fn shared_intensities(&self) -> &Arc<Intensities> {
        &self.intensities
    }

    /// Number of voxels that are NaN or infinite in the file, as resampling leaves outside of the field of view.
    ///
    /// Such voxels are background and have the lowest value of the file. Their value is zero if all others are whole
    /// numbers from 0 to 65535, as in label maps.
    pub fn background_voxels(&self) -> u64 {
        self.background_voxels
    }

    /// Conversion of stored values to file units.
    pub fn rescale(&self) -> Rescale {
        self.rescale
    }

    /// Smallest and largest stored value.
    pub fn stored_range(&self) -> [u16; 2] {
        self.stored_range
    }

    /// Smallest and largest value in file units, in this order even if the slope is negative.
    pub fn range(&self) -> [f64; 2] {
        let [a, b] = self.stored_range.map(|stored| self.to_file_units(stored.into()));
        [a.min(b), a.max(b)]
    }

    /// The value of voxel `index` in file units, or `None` outside the grid.
    pub fn value_at(&self, index: UVec3) -> Option<f64> {
        if index.cmpge(self.dimensions).any() {
            return None;
        }
        let [x, y, z] = index.to_array().map(u64::from);
        let [width, height, _] = self.dimensions.to_array().map(u64::from);
        let at = usize::try_from((z * height + y) * width + x).ok()?;
        let stored = self.intensities.get(at)?;
        Some(self.to_file_units(stored.into()))
    }

    /// Converts a stored value, or a value between two, to file units.
    pub fn to_file_units(&self, stored: f64) -> f64 {
        self.rescale.slope * stored + self.rescale.intercept
    }

    /// Converts a value in file units to a stored value, not rounded and not limited to the storable range.
    pub fn to_stored(&self, file_units: f64) -> f64 {
        (file_units - self.rescale.intercept) / self.rescale.slope
    }
}

/// Spacing of the grid, mm, or an error if the transform cannot be used.
pub(crate) fn check_grid_to_patient(grid_to_patient: &DAffine3) -> Result<Vec3, VolumeError> {
    let error = |reason: &str| {
        let columns = grid_to_patient.to_cols_array_2d();
        VolumeError::field("grid to patient transform", format!("{columns:?}"), reason)
    };
    if !grid_to_patient.is_finite() {
        return Err(error("not finite"));
    }
    let matrix = grid_to_patient.matrix3;
    let lengths = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|axis| axis.length());
    let spacing = Vec3::from_array(lengths.map(|length| length as f32));
    // A tiny but normal spacing is valid; a spacing that vanishes in f32 is not.
    if !spacing.is_finite() || spacing.cmplt(Vec3::splat(f32::MIN_POSITIVE)).any() {
        return Err(error("a spacing is not finite and positive"));
    }
    let [x, y, z] = lengths;
    // The volume spanned by the axes' directions: 1 if they are at right angles, 0 if in one plane.
    let spanned = (matrix.x_axis / x).dot((matrix.y_axis / y).cross(matrix.z_axis / z));
    if spanned.is_nan() || spanned.abs() < 1e-6 {
        return Err(error("its axes lie in one plane"));
    }
    Ok(spacing)
}

/// Checks that a rescale works in both directions.
pub(crate) fn check_rescale(rescale: Rescale) -> Result<(), VolumeError> {
    let Rescale { slope, intercept } = rescale;
    if !slope.is_finite() || slope == 0.0 {
        return Err(VolumeError::field("slope", slope, "must be finite and not zero"));
    }
    // With the largest stored value, so that every voxel's value is finite.
    if !intercept.is_finite() || !(slope * f64::from(u16::MAX) + intercept).is_finite() {
        return Err(VolumeError::field("intercept", intercept, "all values must be finite"));
    }
    Ok(())
}
