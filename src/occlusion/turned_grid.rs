//! A grid turned towards a light, through which occlusion sweeping takes the light (Singh, Yuksel, House 2009, section
//! 4.1; pure maths).

use bevy::math::{DAffine3, DMat3, DQuat, DVec3, UVec3};
use core::f64::consts::TAU;

use super::octants::octant_center;
use crate::volume::VolumeGeometry;

/// Turns about the light's direction that are tried, to find a grid with few cells.
const TURNS: u32 = 24;
/// Cells become larger by this factor until they are few enough.
const COARSER: f64 = 1.05;

/// A grid of cubic cells around a volume. The middle of its octant 7 lies in the direction of the light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TurnedGrid {
    /// Number of cells along each axis.
    pub cells: UVec3,
    /// Distance between cells, mm. It is the mean voxel spacing, or more if the cells would be too many.
    pub cell_mm: f64,
    /// Volume space → cell index, at the cells' centres.
    pub cell_from_local: DAffine3,
}

impl TurnedGrid {
    /// The grid for a light from a direction (volume space, any length but 0). `is_small` tells whether a number of cells
    /// along each axis is not too large. A single cell must not be.
    pub fn new(geometry: &VolumeGeometry, direction: DVec3, is_small: impl Fn(UVec3) -> bool) -> Self {
        let corners = geometry.corners();
        let mut least: Option<(f64, DMat3, DVec3, DVec3)> = None;
        for turn in 0..TURNS {
            let axes = axes_towards(direction, TAU / 3.0 * f64::from(turn) / f64::from(TURNS));
            let places = corners.map(|corner| axes.transpose() * corner);
            let first = places.into_iter().fold(DVec3::INFINITY, DVec3::min);
            let extent = places.into_iter().fold(DVec3::NEG_INFINITY, DVec3::max) - first;
            let volume = extent.element_product();
            // Rounding does not decide between turns.
            if least.is_none_or(|(known, ..)| volume < known * (1.0 - 1e-9)) {
                least = Some((volume, axes, first, extent));
            }
        }
        let (_, axes, first, extent) = least.unwrap_or_default();
        let mut cell_mm = geometry.local_from_voxel.matrix3.determinant().abs().cbrt();
        // A whole number of cells, but for rounding, has no further cell.
        let cells_of = |cell_mm: f64| (extent / cell_mm - 1e-6).ceil().as_uvec3().max(UVec3::ONE);
        while !is_small(cells_of(cell_mm)) && cells_of(cell_mm) != UVec3::ONE {
            cell_mm *= COARSER;
        }
        let cells = cells_of(cell_mm);
        // The volume lies in the middle of the cells.
        let margin = 0.5 * (cells.as_dvec3() * cell_mm - extent);
        let from_local = DMat3::from_diagonal(DVec3::splat(cell_mm.recip())) * axes.transpose();
        let shift = (margin - first) / cell_mm - 0.5;
        Self { cells, cell_mm, cell_from_local: DAffine3::from_mat3_translation(from_local, shift) }
    }

    /// The grid's axes in volume space, of unit length, as columns.
    pub fn axes(&self) -> DMat3 {
        self.cell_from_local.matrix3.transpose() * self.cell_mm
    }
}

/// Perpendicular axes whose sum points in a direction. Among them are those of the direction's octant of volume space,
/// turned by as little as possible, and then by an angle about the direction.
fn axes_towards(direction: DVec3, angle: f64) -> DMat3 {
    let toward = direction.normalize();
    let signs = octant_center(toward.cmpge(DVec3::ZERO).bitmask() as usize);
    let turn = DQuat::from_axis_angle(toward, angle) * DQuat::from_rotation_arc(signs.normalize(), toward);
    DMat3::from_quat(turn) * DMat3::from_diagonal(signs)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::occlusion::fibonacci_direction;

    fn geometry(dimensions: UVec3, axes: DMat3) -> VolumeGeometry {
        let center = (dimensions.as_dvec3() - 1.0) * 0.5;
        VolumeGeometry {
            dimensions,
            spacing_mm: DVec3::new(axes.x_axis.length(), axes.y_axis.length(), axes.z_axis.length()),
            local_from_voxel: DAffine3::from_mat3_translation(axes, -(axes * center)),
        }
    }

    #[test]
    fn a_light_along_a_diagonal_takes_the_grid_of_the_volume() {
        let cube = geometry(UVec3::splat(9), DMat3::IDENTITY);
        for octant in 0..8 {
            let grid = TurnedGrid::new(&cube, octant_center(octant), |_| true);
            assert_eq!((grid.cells, grid.cell_mm), (UVec3::splat(9), 1.0));
            assert!(grid.axes().abs_diff_eq(DMat3::from_diagonal(octant_center(octant)), 1e-12));
            let center = grid.cell_from_local.transform_point3(DVec3::ZERO);
            assert!(center.abs_diff_eq(DVec3::splat(4.0), 1e-9), "{center}");
        }
    }

    #[test]
    fn cells_cover_the_volume_and_are_few() {
        let oblique = DMat3::from_quat(DQuat::from_scaled_axis(DVec3::new(0.3, 0.5, -0.2)));
        for (dimensions, axes) in [
            (UVec3::new(20, 31, 9), DMat3::from_diagonal(DVec3::new(1.0, 0.5, 2.5))),
            (UVec3::new(1, 300, 2), oblique),
            (UVec3::ONE, DMat3::IDENTITY),
        ] {
            let geometry = geometry(dimensions, axes);
            let voxels = dimensions.element_product();
            for direction in (0..40).map(|k| fibonacci_direction(k, 40)).chain([DVec3::X, DVec3::NEG_Y]) {
                let grid =
                    TurnedGrid::new(&geometry, direction, |cells| cells.element_product() <= 2 * voxels);
                assert!(grid.cells.element_product() <= 2 * voxels, "{grid:?}");
                let diagonal = grid.axes() * DVec3::ONE;
                assert!(diagonal.normalize().abs_diff_eq(direction.normalize(), 1e-9), "{grid:?}");
                for corner in geometry.corners() {
                    let cell = grid.cell_from_local.transform_point3(corner);
                    let beyond = (cell + 0.5).min(grid.cells.as_dvec3() - 0.5 - cell).min_element();
                    assert!(beyond > -1e-5, "{grid:?}: {corner} is {beyond} cells outside");
                }
            }
        }
    }
}
