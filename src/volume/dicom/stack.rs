//! Slices in order along their normal, and the grid that they make.

use bevy::math::{DAffine3, DMat3, DVec3, UVec3};

use super::{
    left_out::Reason,
    settings::{DicomReadSettings, UnevenSlices},
    slice::Slice,
};
use crate::volume::{asset::check_grid_to_patient, budget::VolumeSize, error::VolumeError};

/// Largest distance of a slice from its place in an even stack, as a share of the step.
const TOLERANCE: f64 = 0.01;
/// Largest number of voxels along an axis.
const MAX_AXIS: usize = 65_535;

/// Slices of one volume, from first to last along the normal.
#[derive(Clone, Debug)]
pub(super) struct Stack {
    pub slices: Vec<Slice>,
    /// Place of each slice along the normal, mm from the first.
    heights: Vec<f64>,
    /// Way of the slices per millimetre of height: beside the normal where the gantry was tilted.
    direction: DVec3,
    is_even: bool,
}

/// The grid of a volume.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Grid {
    pub dimensions: UVec3,
    pub grid_to_patient: DAffine3,
    /// For slices that are interpolated: two slices and the share of the second, for each of the grid's.
    pub between: Option<Vec<(usize, usize, f64)>>,
}

impl Stack {
    /// Puts slices in order, or tells why they make no volume.
    pub fn of(mut slices: Vec<Slice>) -> Result<Self, Reason> {
        let [first, _, ..] = &slices[..] else { return Err(Reason::SingleSlice) };
        let normal = first.normal();
        slices.sort_by(|a, b| a.position.dot(normal).total_cmp(&b.position.dot(normal)));
        let [first, .., last] = &slices[..] else { return Err(Reason::SingleSlice) };
        let heights: Vec<f64> =
            slices.iter().map(|slice| (slice.position - first.position).dot(normal)).collect();
        let height = (last.position - first.position).dot(normal);
        if height <= 0.0 {
            return Err(Reason::SingleSlice);
        }
        let direction = (last.position - first.position) / height;
        let step = height / (slices.len() - 1) as f64;
        let is_even = slices.iter().enumerate().all(|(index, slice)| {
            let expected = first.position + direction * (step * index as f64);
            slice.position.distance(expected) <= TOLERANCE * step
        });
        let error = |reason: &str| VolumeError::field("ImagePositionPatient", "", reason);
        if !is_even {
            let shift = slices
                .iter()
                .zip(&heights)
                .map(|(slice, height)| slice.position.distance(first.position + direction * *height));
            if shift.fold(0.0, f64::max) > TOLERANCE * step {
                return Err(error("the slices' corners do not lie in one line").into());
            }
            let least = heights.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
            if least < 0.05 * step {
                return Err(error("two slices lie nearly at one place").into());
            }
        }
        Ok(Self { heights, direction, is_even, slices })
    }

    fn height(&self) -> f64 {
        self.heights.last().copied().unwrap_or(0.0)
    }

    pub fn is_even(&self) -> bool {
        self.is_even
    }

    /// Distances of slices along the normal: the smallest, and the largest.
    pub fn steps_mm(&self) -> [f64; 2] {
        let steps = self.heights.windows(2).map(|pair| pair[1] - pair[0]);
        steps.fold([f64::INFINITY, 0.0], |[low, high], step| [low.min(step), high.max(step)])
    }

    /// Steps along the normal, from first to last: how many there are of a length, mm, and the length.
    pub fn steps(&self) -> Vec<(usize, f64)> {
        let steps: Vec<f64> = self.heights.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let same = |a: &f64, b: &f64| (a - b).abs() <= TOLERANCE * a;
        steps.chunk_by(same).map(|run| (run.len(), run.iter().sum::<f64>() / run.len() as f64)).collect()
    }

    /// The mean of the steps that are about as small as the smallest.
    fn single_step(&self) -> f64 {
        let [least, _] = self.steps_mm();
        let steps = self.heights.windows(2).map(|pair| pair[1] - pair[0]);
        let small: Vec<f64> = steps.filter(|step| *step <= 1.05 * least).collect();
        small.iter().sum::<f64>() / small.len().max(1) as f64
    }

    /// The grid, if it is allowed and fits the budget.
    pub fn grid(&self, settings: &DicomReadSettings) -> Result<Grid, VolumeError> {
        let [first, ..] = &self.slices[..] else { return Err(no_slices()) };
        let image = &first.image;
        let size = |planes: usize| {
            let whole = UVec3::new(image.columns, image.rows, planes as u32);
            let halved = whole.map(|voxels| voxels.div_ceil(1 << settings.halvings.min(8)));
            VolumeSize::of_grid(halved, if image.format.bits_stored <= 8 { 1 } else { 2 }).bytes()
        };
        let fits = |planes: usize| planes <= MAX_AXIS && size(planes) <= settings.max_bytes;
        let planes = if self.is_even { self.slices.len() } else { self.planes(settings, fits)? };
        if !fits(planes) {
            let sizes = vec![image.columns.into(), image.rows.into(), planes as u64];
            let [needed, allowed] = [size(planes), settings.max_bytes].map(|bytes| bytes.div_ceil(1 << 20));
            let reason =
                format!("take {needed} MiB on the graphics device, and max_bytes allows {allowed} MiB");
            return Err(VolumeError::Dimensions { sizes, reason });
        }
        let step = self.height() / (planes - 1) as f64;
        let [along, down] = first.axes;
        let to_ras = DVec3::new(-1.0, -1.0, 1.0);
        let columns = [along * first.spacing[0], down * first.spacing[1], self.direction * step];
        let [x, y, z] = columns.map(|column| column * to_ras);
        let grid_to_patient =
            DAffine3::from_mat3_translation(DMat3::from_cols(x, y, z), first.position * to_ras);
        check_grid_to_patient(&grid_to_patient)?;
        Ok(Grid {
            dimensions: UVec3::new(image.columns, image.rows, planes as u32),
            grid_to_patient,
            between: (!self.is_even)
                .then(|| (0..planes).map(|plane| self.at(plane as f64 * step, step)).collect()),
        })
    }

    /// Number of planes at the finest even step that fits.
    fn planes(
        &self,
        settings: &DicomReadSettings,
        fits: impl Fn(usize) -> bool,
    ) -> Result<usize, VolumeError> {
        if settings.uneven == UnevenSlices::Refuse {
            let [least, most] = self.steps_mm();
            let steps = format!("{least:.2} to {most:.2} mm");
            return Err(VolumeError::field("step of ImagePositionPatient", steps, "must be even"));
        }
        let finest = ((self.height() / self.single_step()).round() as usize).clamp(1, MAX_AXIS - 1) + 1;
        // Sizes grow with the number of planes.
        let [mut low, mut high] = [2, finest];
        while low < high {
            let middle = (low + high).div_ceil(2);
            if fits(middle) { low = middle } else { high = middle - 1 }
        }
        Ok(low)
    }

    /// The slices around a height. A slice within the tolerance is taken as it is.
    fn at(&self, height: f64, step: f64) -> (usize, usize, f64) {
        let after = self.heights.partition_point(|&of| of <= height).clamp(1, self.heights.len() - 1);
        let [low, high] = [self.heights[after - 1], self.heights[after]];
        let near = |of: f64| (of - height).abs() <= TOLERANCE * step;
        let share = match (near(low), near(high)) {
            (true, _) => 0.0,
            (_, true) => 1.0,
            _ => ((height - low) / (high - low)).clamp(0.0, 1.0),
        };
        (after - 1, after, share)
    }
}

fn no_slices() -> VolumeError {
    VolumeError::Dimensions { sizes: vec![0], reason: "there are no slices".into() }
}
