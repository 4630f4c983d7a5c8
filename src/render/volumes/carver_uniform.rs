//! Data of a volume's carvers, for every shader (`bindings.wgsl`).

use bevy::{
    math::{Affine3A, DAffine3, DMat3, DVec3, Vec3Swizzles, Vec4Swizzles},
    prelude::*,
    render::render_resource::ShaderType,
};

use crate::{
    clip::{ClipOperation, MAX_CARVERS},
    render::{
        carvers::clip_maps::ReadyCarver,
        extract::{ExtractedCarver, ExtractedVolume},
    },
};

/// One carver as one volume sees it, as `Carver` in WGSL.
#[derive(Clone, Copy, Debug, Default, PartialEq, ShaderType)]
pub(crate) struct CarverUniform {
    clip_from_local: [Vec4; 3],
    dilation_offset: Vec2,
    dilation_scale: Vec2,
    footprint_x: Vec3,
    footprint_z: f32,
    footprint_y: Vec2,
    first_layer: u32,
    end_layer: u32,
    pub operation: u32,
    padding: u32,
}

/// The carvers of one volume, as `carvers` in WGSL.
#[derive(Clone, Debug, PartialEq, ShaderType)]
pub(crate) struct CarverTable {
    pub carvers: [CarverUniform; MAX_CARVERS],
}

impl Default for CarverTable {
    fn default() -> Self {
        Self { carvers: [default(); MAX_CARVERS] }
    }
}

impl FromIterator<CarverUniform> for CarverTable {
    /// Takes at most [`MAX_CARVERS`] carvers.
    fn from_iter<I: IntoIterator<Item = CarverUniform>>(carvers: I) -> Self {
        let mut table = Self::default();
        for (entry, carver) in table.carvers.iter_mut().zip(carvers) {
            *entry = carver;
        }
        table
    }
}

impl CarverUniform {
    /// Describes a carver. `carver_from_volume` maps volume space (mm) to the carver's space.
    pub fn new(
        carver: &ExtractedCarver,
        ready: &ReadyCarver,
        volume: &ExtractedVolume,
        carver_from_volume: DAffine3,
    ) -> Self {
        let frame = ready.frame.clip_from_local();
        let (linear, offset) = (frame.matrix3.as_dmat3(), frame.translation.as_dvec3());
        let clip = DAffine3::from_mat3_translation(linear, offset) * carver_from_volume;
        let voxel = clip.matrix3 * volume.geometry.local_from_voxel.matrix3;
        let edges = lower_triangular(voxel).as_mat3();
        let dilation = ready.dilation.frame();
        let matrix = clip.matrix3.transpose();
        let row = |row: DVec3, offset: f64| row.extend(offset).as_vec4();
        let scale = dilation.size.recip();
        Self {
            clip_from_local: [
                row(matrix.x_axis, clip.translation.x),
                row(matrix.y_axis, clip.translation.y),
                row(matrix.z_axis, clip.translation.z),
            ],
            dilation_offset: -dilation.min * scale,
            dilation_scale: scale,
            footprint_x: edges.x_axis,
            footprint_z: edges.z_axis.z,
            footprint_y: edges.y_axis.yz(),
            first_layer: ready.layers.first,
            end_layer: ready.layers.first + ready.layers.count,
            operation: operation_code(carver.clip_mesh.operation),
            padding: 0,
        }
    }

    /// Corners, in volume space (mm), of a box that holds all points within a radius of the removed region. `None` if
    /// the carver removes its outside, or has no inside.
    pub fn outline(&self, radius_mm: f32) -> Option<[Vec3; 8]> {
        let [x, y, z] = self.clip_from_local;
        let linear = Mat3::from_cols(x.xyz(), y.xyz(), z.xyz()).transpose();
        let clip_from_local = Affine3A::from_mat3_translation(linear, Vec3::new(x.w, y.w, z.w));
        let margin = radius_mm * Vec3::new(x.xyz().length(), y.xyz().length(), z.xyz().length());
        let local_from_clip = clip_from_local.inverse();
        let corners = [0u32, 1, 2, 3, 4, 5, 6, 7].map(|k| {
            let far = BVec3::new(k & 1 != 0, k & 2 != 0, k & 4 != 0);
            local_from_clip.transform_point3(Vec3::select(far, 1.0 + margin, -margin))
        });
        let is_bounded =
            self.operation != OPERATION_INTERSECT && corners.iter().all(|corner| corner.is_finite());
        is_bounded.then_some(corners)
    }

    /// Whether another carver carves the same, in whichever layers its maps are.
    pub fn carves_as(&self, other: &Self) -> bool {
        self.at_layers_of(other) == *other
    }

    /// The same carver with the map layers of another carver.
    pub fn at_layers_of(&self, other: &Self) -> Self {
        Self { first_layer: other.first_layer, end_layer: other.end_layer, ..*self }
    }

    /// Stand-in for a former carver whose maps are gone. `None` for a carver that acted everywhere.
    pub fn region(self) -> Option<Self> {
        (self.operation != OPERATION_INTERSECT).then_some(Self { operation: OPERATION_REGION, ..self })
    }

    #[cfg(test)]
    pub fn at(place: f32, operation: ClipOperation) -> Self {
        let clip_from_local = [Vec4::splat(place); 3];
        Self { clip_from_local, operation: operation_code(operation), ..default() }
    }

    #[cfg(test)]
    pub fn with_layers(self, first_layer: u32, end_layer: u32) -> Self {
        Self { first_layer, end_layer, ..self }
    }
}

pub(crate) const OPERATION_SUBTRACT: u32 = 1;
pub(crate) const OPERATION_INTERSECT: u32 = 2;
pub(crate) const OPERATION_REGION: u32 = 3;

/// An operation as `OPERATION_*` in WGSL.
fn operation_code(operation: ClipOperation) -> u32 {
    match operation {
        ClipOperation::Subtract => OPERATION_SUBTRACT,
        ClipOperation::Intersect => OPERATION_INTERSECT,
    }
}

/// Half edges of a box with the same variance as the box with the half edges `edges`. They are lower triangular: the
/// third edge lies along z (Cholesky factor of `edges edges^T`).
fn lower_triangular(edges: DMat3) -> DMat3 {
    let gram = edges * edges.transpose();
    let [xx, xy, xz] = gram.x_axis.to_array();
    let x = DVec3::new(xx, xy, xz) / xx.sqrt();
    let yy = (gram.y_axis.y - x.y * x.y).sqrt();
    let y = DVec3::new(0.0, yy, (gram.y_axis.z - x.y * x.z) / yy);
    let z = DVec3::new(0.0, 0.0, (gram.z_axis.z - x.z * x.z - y.z * y.z).sqrt());
    DMat3::from_cols(x, y, z)
}
