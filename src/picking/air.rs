//! Where a volume shows nothing, so that rays may leap.

use bevy::math::{DVec3, UVec3};

use super::{carved::through_box, crossings::Line};
use crate::volume::{Intensities, Volume};

/// Voxels of a brick along each axis.
const SIDE: u32 = 8;
/// Voxels around a brick that a point in it may read, by the tricubic filter.
const FOOTPRINT: u32 = 2;

/// Lowest and highest stored intensity in and around every brick, x fastest.
pub(super) struct BrickRanges {
    counts: UVec3,
    ranges: Vec<[u16; 2]>,
}

impl BrickRanges {
    pub fn of(volume: &Volume) -> Self {
        let size = volume.dimensions();
        let counts = size.map(|voxels| voxels.div_ceil(SIDE));
        let mut ranges = vec![[u16::MAX, 0]; counts.element_product() as usize];
        match volume.intensities() {
            Intensities::U8(values) => visit(values, size, counts, &mut ranges),
            Intensities::U16(values) => visit(values, size, counts, &mut ranges),
        }
        Self { counts, ranges }
    }
}

/// Widens the ranges of the bricks that may read each voxel.
fn visit<T: Copy + Ord + Into<u16>>(values: &[T], size: UVec3, counts: UVec3, ranges: &mut [[u16; 2]]) {
    let bricks = |voxel: u32, count: u32| {
        voxel.saturating_sub(FOOTPRINT) / SIDE..=((voxel + FOOTPRINT) / SIDE).min(count - 1)
    };
    for (row, values) in values.chunks(size.x as usize).enumerate() {
        let (y, z) = (row as u32 % size.y, row as u32 / size.y);
        for x in 0..counts.x {
            let [first, end] =
                [(x * SIDE).saturating_sub(FOOTPRINT), ((x + 1) * SIDE + FOOTPRINT).min(size.x)];
            let part = &values[first as usize..end as usize];
            let low = part.iter().copied().min().map_or(u16::MAX, Into::into);
            let high = part.iter().copied().max().map_or(0, Into::into);
            for k in bricks(z, counts.z) {
                for j in bricks(y, counts.y) {
                    let range = &mut ranges[((k * counts.y + j) * counts.x + x) as usize];
                    *range = [range[0].min(low), range[1].max(high)];
                }
            }
        }
    }
}

/// Bricks in which nothing is seen.
pub(super) struct Air {
    counts: UVec3,
    is_air: Vec<bool>,
}

impl Air {
    /// `is_transparent`: whether nothing between two stored intensities is seen.
    pub fn new(bricks: &BrickRanges, is_transparent: impl Fn(f64, f64) -> bool) -> Self {
        let is_air =
            bricks.ranges.iter().map(|&[low, high]| is_transparent(low.into(), high.into())).collect();
        Self { counts: bricks.counts, is_air }
    }

    /// Where a line leaves the brick that it is in at a distance, if nothing is seen there. The line is in voxels.
    pub fn end(&self, line: &Line, distance: f64) -> Option<f64> {
        let place = (line.at(distance) + 0.5) / f64::from(SIDE);
        let brick = place.floor().clamp(DVec3::ZERO, (self.counts - 1).as_dvec3());
        let UVec3 { x, y, z } = brick.as_uvec3();
        let index = (z * self.counts.y + y) * self.counts.x + x;
        if !*self.is_air.get(index as usize)? {
            return None;
        }
        let low = brick * f64::from(SIDE) - 0.5;
        let ([_, end], _) = through_box(line, low, low + f64::from(SIDE));
        (end > distance).then_some(end)
    }
}
