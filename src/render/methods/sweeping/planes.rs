//! Order in which tiles are swept.

use bevy::{
    prelude::*,
    render::render_resource::{DynamicUniformBuffer, ShaderType},
};

use crate::occlusion::OcclusionSweeping;

/// The tiles of one dispatch, as `Plane` in WGSL.
#[derive(Clone, Copy, Debug, Default, PartialEq, ShaderType)]
pub(crate) struct SweepPlane {
    /// Octant from which the light comes.
    pub octant: u32,
    /// Sum of the tiles' three indices, counted from the beginning of the sweep.
    pub number: u32,
    /// The first two indices of the first workgroup's tile.
    pub first: UVec2,
}

/// Number of tiles along each axis. Incomplete tiles at the edges count as whole.
fn tile_counts(dimensions: UVec3) -> UVec3 {
    dimensions.map(|count| count.div_ceil(OcclusionSweeping::TILE))
}

/// Planes of one sweep, in order, each with the rectangle of workgroups that surrounds its tiles.
fn planes(octant: u32, tiles: UVec3) -> impl Iterator<Item = (SweepPlane, UVec2)> {
    let last = tiles - 1;
    (0..=last.element_sum()).map(move |number| {
        let least = |a: u32, b: u32| number.saturating_sub(a + b);
        let first = UVec2::new(least(last.y, last.z), least(last.x, last.z));
        let groups = last.truncate().min(UVec2::splat(number)) - first + 1;
        (SweepPlane { octant, number, first }, groups)
    })
}

/// Offset of a plane's uniform, and its workgroups.
pub(crate) type PlaneDispatch = (u32, UVec2);

/// All planes of the sweeps over a volume.
pub(crate) struct SweepPlan {
    pub uniforms: DynamicUniformBuffer<SweepPlane>,
    /// Planes of the sweep from each octant.
    octants: [Vec<PlaneDispatch>; 8],
    /// Number of cells of a turned grid, and planes of the sweep through it, which comes from octant 7.
    turned: Option<(UVec3, Vec<PlaneDispatch>)>,
}

impl SweepPlan {
    /// Plans the sweeps through a volume's grid, and through a turned grid with so many cells.
    pub fn new(dimensions: UVec3, cells: Option<UVec3>) -> Self {
        let mut uniforms = DynamicUniformBuffer::default();
        let mut sweep = |octant: usize, dimensions: UVec3| {
            let planes = planes(octant as u32, tile_counts(dimensions));
            planes.map(|(plane, groups)| (uniforms.push(&plane), groups)).collect::<Vec<_>>()
        };
        let octants = core::array::from_fn(|octant| sweep(octant, dimensions));
        let turned = cells.map(|cells| (cells, sweep(7, cells)));
        Self { uniforms, octants, turned }
    }

    /// Number of cells of the turned grid.
    pub fn cells(&self) -> Option<UVec3> {
        self.turned.as_ref().map(|(cells, _)| *cells)
    }

    /// Planes of the sweeps from these octants.
    pub fn octants(&self, octants: impl Fn(usize) -> bool) -> Vec<PlaneDispatch> {
        let chosen = self.octants.iter().enumerate().filter(|(octant, _)| octants(*octant));
        chosen.flat_map(|(_, planes)| planes).copied().collect()
    }

    /// Planes of the sweep through the turned grid, if there is one.
    pub fn turned(&self) -> Option<&[PlaneDispatch]> {
        self.turned.as_ref().map(|(_, planes)| planes.as_slice())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tile_is_in_a_workgroup_of_its_plane() {
        assert_eq!(tile_counts(UVec3::new(1, 8, 9)), UVec3::new(1, 1, 2));
        for tiles in [UVec3::ONE, UVec3::new(1, 5, 2), UVec3::new(4, 3, 6), UVec3::new(7, 1, 1)] {
            let mut found = Vec::new();
            for (plane, groups) in planes(3, tiles) {
                assert_eq!(plane.octant, 3);
                for (x, y) in (0..groups.y).flat_map(|y| (0..groups.x).map(move |x| (x, y))) {
                    let [x, y] = [plane.first.x + x, plane.first.y + y];
                    assert!(x < tiles.x && y < tiles.y);
                    if x + y <= plane.number && plane.number - x - y < tiles.z {
                        found.push([x, y, plane.number - x - y]);
                    }
                }
            }
            let count = found.len();
            found.sort_unstable();
            found.dedup();
            assert_eq!([count, found.len()], [tiles.element_product() as usize; 2], "{tiles}");
        }
    }
}
