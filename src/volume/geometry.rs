//! Places of a volume's voxels: the frames that rendering uses.

use bevy::math::{DAffine3, DMat3, DVec3, UVec3};

use super::Volume;

/// The grid of a [`Volume`] in *volume space*: millimetres around the volume's centre.
///
/// The axes are x to the patient's left, y up (superior) and z to the front (anterior). So a patient stands
/// upright in Bevy's axes and looks along +z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeGeometry {
    /// Number of voxels along each axis of the grid.
    pub dimensions: UVec3,
    /// Distance between voxel centres along each axis of the grid, mm.
    pub spacing_mm: DVec3,
    /// Voxel index, at voxel centres → volume space (mm).
    pub local_from_voxel: DAffine3,
}

/// Patient space (RAS+) → volume space: a rotation.
const LOCAL_FROM_PATIENT: DMat3 = DMat3::from_cols(DVec3::NEG_X, DVec3::Z, DVec3::Y);

impl VolumeGeometry {
    /// The geometry of a volume.
    pub fn of(volume: &Volume) -> Self {
        let grid = volume.grid_to_patient().matrix3;
        let linear = LOCAL_FROM_PATIENT * grid;
        let dimensions = volume.dimensions();
        let center = (dimensions.as_dvec3() - 1.0) * 0.5;
        Self {
            dimensions,
            spacing_mm: DVec3::new(grid.x_axis.length(), grid.y_axis.length(), grid.z_axis.length()),
            local_from_voxel: DAffine3::from_mat3_translation(linear, -(linear * center)),
        }
    }

    /// Voxel index, at voxel centres → texture coordinates in [0, 1].
    pub fn texture_from_voxel(&self) -> DAffine3 {
        let scale = self.dimensions.as_dvec3().recip();
        DAffine3::from_mat3_translation(DMat3::from_diagonal(scale), 0.5 * scale)
    }

    /// The longest diagonal of a voxel, mm.
    pub fn cell_diagonal_mm(&self) -> f64 {
        let axes = self.local_from_voxel.matrix3;
        let signs = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
        signs
            .map(|(y, z)| (axes.x_axis + y * axes.y_axis + z * axes.z_axis).length())
            .into_iter()
            .fold(0.0, f64::max)
    }

    /// Longest length, mm, of a step of one voxel in any direction; an upper bound if the grid is sheared.
    pub fn longest_stretch_mm(&self) -> f64 {
        longest_stretch(self.local_from_voxel.matrix3)
    }

    /// Lower bound of the ratio of a length to the same length with perpendicular axes of the same spacings.
    pub(crate) fn least_stretch(&self) -> f64 {
        let DMat3 { x_axis, y_axis, z_axis } = self.local_from_voxel.matrix3;
        let axes = [x_axis, y_axis, z_axis].map(DVec3::normalize);
        longest_stretch(DMat3::from_cols(axes[0], axes[1], axes[2]).inverse()).recip()
    }

    /// The 8 corners of the box that the voxels fill, volume space (mm).
    ///
    /// Corner `k` is at the far end of grid axis `a` if bit `a` of `k` is set.
    pub fn corners(&self) -> [DVec3; 8] {
        core::array::from_fn(|k| {
            let far = DVec3::from_array([0, 1, 2].map(|axis| ((k >> axis) & 1) as f64));
            self.local_from_voxel.transform_point3(far * self.dimensions.as_dvec3() - 0.5)
        })
    }
}

/// Upper bound of the factor by which a matrix stretches a length; exact unless the matrix shears.
pub(crate) fn longest_stretch(matrix: DMat3) -> f64 {
    let lengths = DVec3::new(matrix.x_axis.length(), matrix.y_axis.length(), matrix.z_axis.length());
    let longest = lengths.max_element();
    let gram = matrix.transpose() * matrix;
    let shears = !gram.abs_diff_eq(DMat3::from_diagonal(lengths * lengths), longest * longest * 1e-4);
    // The Frobenius norm bounds the largest singular value.
    if shears { lengths.length() } else { longest }
}
