//! Data of a volume, for every shader (`bindings.wgsl`).

use bevy::{
    math::{DMat3, DMat4, DVec3},
    prelude::*,
    render::render_resource::ShaderType,
};

use super::preintegration::StepLengths;
use crate::{
    occlusion::{AmbientScale, Optimizations, VolumeLighting, VoxelOpacities},
    render::extract::ExtractedVolume,
    volume::{LookupTable, VolumeGeometry},
};

/// One volume, as `VolumeUniform` in WGSL.
#[derive(Clone, Debug, Default, PartialEq, ShaderType)]
pub(crate) struct VolumeUniform {
    texture_from_local: Mat4,
    local_from_voxel: Mat4,
    local_from_world: Mat4,
    world_from_local: Mat4,
    dimensions: UVec3,
    occlusion_share: f32,
    light_share: f32,
    jitter_share: f32,
    largest_stored: f32,
    table_first: f32,
    table_density: f32,
    gradient_density: f32,
    last_gradient_row: f32,
    occlusion_exponent: f32,
    draw_exponent: f32,
    draw_step_mm: f32,
    voxel_mm: f32,
    depth_map_size: f32,
    dilation_map_size: f32,
    brick_radius_mm: f32,
    reach_mm: f32,
    footprint_mm: f32,
    tests_all_carvers: u32,
    draw_leaps: u32,
    visible_intensities: Vec2,
    occlusion_from_texture: Vec3,
    occlusion_stride: u32,
    occlusion_widening: f32,
    occlusion_shift: f32,
    deciding_voxels: u32,
    footprint_share: f32,
    occlusion_scale: f32,
    occlusion_intensity: f32,
    exposure: f32,
    octant_axes: Mat3,
    low_octants: Vec4,
    high_octants: Vec4,
    occlusion_power: f32,
    both_sides: f32,
    perceptual_roughness: f32,
    reflectance: f32,
    receives_shadows: u32,
    depth_opacity: f32,
}

impl VolumeUniform {
    /// Lengths over which opacities accumulate.
    pub fn step_lengths(&self) -> StepLengths {
        StepLengths { drawing: self.draw_exponent, occlusion: self.occlusion_exponent }
    }

    /// Describes a volume.
    ///
    /// `largest_stored` is the stored intensity that the texture gives as 1. Without occlusion, samples are drawn
    /// unoccluded. `drawn` has the bounds of drawn intensities if only a surface is drawn. The sizes are those of the
    /// depth and the dilation maps.
    pub fn new(
        volume: &ExtractedVolume,
        largest_stored: f64,
        has_occlusion: bool,
        drawn: Option<Vec2>,
        [depth_map_size, dilation_map_size]: [u32; 2],
        carvers: usize,
        optimizations: &Optimizations,
    ) -> Self {
        let geometry = &volume.geometry;
        let texture_from_voxel = geometry.texture_from_voxel();
        let [lo, hi] = volume.table.stored_range;
        let table_density = if hi > lo { (LookupTable::ENTRIES - 1) as f64 / (hi - lo) } else { 0.0 };
        let last_gradient_row = f64::from(volume.table.rows() - 1);
        let last_gradient = volume.table.last_gradient.filter(|_| volume.by_gradient);
        let gradient_density = last_gradient
            .map_or(0.0, |last| (largest_stored * last_gradient_row / last).min(f32::MAX.into()));
        let unit = volume.table.opacity_unit_distance_mm as f64;
        let draw_step = geometry.spacing_mm.min_element() * f64::from(volume.shading.drawn_step_voxels());
        let is_of_voxels = volume.occlusion.method.kind().is_of_voxels();
        let stride = volume.occlusion.texels().stride();
        let method = volume.occlusion.method.settings();
        let drawing = method.drawing();
        let light_axes = method.light_axes(geometry);
        let weights = volume.occlusion.octant_weights(geometry);
        // A surface that faces octants of full weight can get all light.
        let octants = weights.map(|weight| weight / weights.into_iter().fold(0.0, f32::max));
        let flat_factor = match volume.shading.ambient_scale {
            AmbientScale::FlatSurface => volume.occlusion.flat_factor(geometry),
            AmbientScale::Published => 1.0,
        };
        let reads_farther = volume.smooths_occlusion() && volume.shading.reconstruction.is_tricubic();
        let [occlusion_intensity, exposure] = volume.shading.drawn_light();
        let [perceptual_roughness, reflectance] = volume.shading.drawn_surface();
        // Blocks at the far edges count whole, with their part beyond the grid.
        let covered = (geometry.dimensions + (stride - 1)) / stride * stride;
        Self {
            texture_from_local: DMat4::from(texture_from_voxel * geometry.local_from_voxel.inverse())
                .as_mat4(),
            local_from_voxel: DMat4::from(geometry.local_from_voxel).as_mat4(),
            local_from_world: Mat4::from(volume.world_from_local.inverse()),
            world_from_local: Mat4::from(volume.world_from_local),
            dimensions: geometry.dimensions,
            occlusion_share: f32::from(volume.shading.ambient_occlusion && has_occlusion && is_of_voxels),
            light_share: f32::from(volume.shading.lighting != VolumeLighting::Unlit),
            jitter_share: f32::from(volume.shading.jitter),
            largest_stored: largest_stored as f32,
            table_first: lo as f32,
            table_density: table_density as f32,
            gradient_density: gradient_density as f32,
            last_gradient_row: last_gradient_row as f32,
            occlusion_exponent: (volume.occlusion.step_length_mm(geometry) / unit) as f32,
            draw_exponent: (draw_step / unit) as f32,
            draw_step_mm: draw_step as f32,
            voxel_mm: geometry.spacing_mm.min_element() as f32,
            depth_map_size: depth_map_size as f32,
            dilation_map_size: dilation_map_size as f32,
            // Half of a brick's diagonal, which spans four cells. Rounding must not make it too short.
            brick_radius_mm: (2.001 * geometry.cell_diagonal_mm()) as f32,
            reach_mm: volume.occlusion.reach_mm(geometry) as f32,
            footprint_mm: volume.footprint_mm() as f32,
            tests_all_carvers: if optimizations.near_carvers { 0 } else { carver_bits(carvers) },
            draw_leaps: optimizations.draw_leaps.into(),
            visible_intensities: drawn
                .unwrap_or_else(|| visible_intensities(&volume.table, largest_stored, table_density)),
            occlusion_from_texture: geometry.dimensions.as_vec3() / covered.as_vec3(),
            occlusion_stride: stride,
            occlusion_widening: f32::from(volume.smooths_occlusion()),
            occlusion_shift: volume.occlusion_shift_voxels(),
            deciding_voxels: if reads_farther { 4 } else { 3 },
            footprint_share: f32::from(volume.occlusion.opacities == VoxelOpacities::Means),
            occlusion_scale: flat_factor.recip() as f32,
            occlusion_intensity,
            exposure,
            octant_axes: light_axes.unwrap_or_else(|| grid_axes(geometry)).as_mat3(),
            low_octants: Vec4::from_slice(&octants[..4]),
            high_octants: Vec4::from_slice(&octants[4..]),
            occlusion_power: drawing.power,
            both_sides: f32::from(drawing.both_sides),
            perceptual_roughness,
            reflectance,
            receives_shadows: volume.receives_shadows.into(),
            depth_opacity: volume.depth_opacity.unwrap_or_default(),
        }
    }
}

/// The grid's axes in volume space, of unit length.
fn grid_axes(geometry: &VolumeGeometry) -> DMat3 {
    let DMat3 { x_axis, y_axis, z_axis } = geometry.local_from_voxel.matrix3;
    let [x, y, z] = [x_axis, y_axis, z_axis].map(DVec3::normalize);
    DMat3::from_cols(x, y, z)
}

/// Lower and upper bound of intensities with opacity in a table, as the texture gives them. At an end of the table with
/// opacity there is no bound: the function is constant beyond it.
fn visible_intensities(table: &LookupTable, largest_stored: f64, density: f64) -> Vec2 {
    let first = table.largest_opacities().position(|opacity| opacity > 0.0);
    let last = table.largest_opacities().rposition(|opacity| opacity > 0.0);
    let (Some(first), Some(last)) = (first, last) else {
        return Vec2::new(f32::MAX, f32::MIN);
    };
    // More than the shader's rounding of stored intensities (`lookup_entry`).
    const MARGIN: f64 = 0.05;
    // An entry beside the first or last entry with opacity is transparent. Intensities between the two entries are not.
    let stored = |entry: f64| table.stored_range[0] + entry / density;
    let has_ends = density > 0.0;
    let from = (has_ends && first > 0).then(|| stored(first as f64 - 1.0) - MARGIN);
    let to = (has_ends && last + 1 < LookupTable::ENTRIES).then(|| stored(last as f64 + 1.0) + MARGIN);
    let intensity = |stored: f64| (stored / largest_stored) as f32;
    Vec2::new(from.map_or(f32::MIN, intensity), to.map_or(f32::MAX, intensity))
}

/// Number of bits for the carvers near a brick, `CARVER_BITS` in WGSL.
pub(crate) const CARVER_BITS: u32 = 24;

/// The bits of this many carvers.
fn carver_bits(carvers: usize) -> u32 {
    (1 << (carvers as u32).min(CARVER_BITS)) - 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{ControlPoint, Intensities, Rescale, TransferFunction, Volume};
    use bevy::math::DAffine3;

    /// Table entry of an intensity, as the shader finds it.
    fn lookup_entry(intensity: f32, largest_stored: f32, first: f32, density: f32) -> f32 {
        let stored = intensity * largest_stored;
        let is_whole = (stored - stored.round()).abs() < 1e-3 + 3e-7 * stored;
        (if is_whole { stored.round() } else { stored } - first) * density
    }

    #[test]
    fn what_has_opacity_may_be_visible() {
        let ends = [(0u32, 255u32), (3, 9), (32_768, 34_800), (100, 60_000), (65_000, 65_535)];
        for (lo, hi) in ends {
            let largest = if hi < 256 { 255.0 } else { 65_535.0 };
            for (from, to) in [(lo, lo + 1), (lo + 1, hi - 1), (lo + 2, lo + 2), (hi - 1, hi), (hi, hi)] {
                // A ramp or a step that ends in a plateau, or that ends in 0 again.
                for end in [1.0, 0.0] {
                    let points = [(from, 0.0), (to, 1.0), (hi, end)];
                    check(points, largest, [lo, hi]);
                }
            }
        }
    }

    fn check(points: [(u32, f32); 3], largest: f64, [lo, hi]: [u32; 2]) {
        let intensities = Intensities::U16([lo, hi].map(|end| end as u16).into());
        let volume = Volume::new(UVec3::new(2, 1, 1), DAffine3::IDENTITY, intensities, Rescale::default());
        let points = points.map(|(at, opacity)| ControlPoint { value: at as f32, color: [1.0; 3], opacity });
        let function = TransferFunction::new(points.into(), 1.0).expect("valid points");
        let table = LookupTable::bake(&function, &volume.expect("two voxels"));
        let density = (LookupTable::ENTRIES - 1) as f64 / (table.stored_range[1] - table.stored_range[0]);
        let visible = visible_intensities(&table, largest, density);
        for stored in lo..=hi {
            for part in [0.0, 0.01, 0.03, 0.5, 0.97, 0.99] {
                let intensity = ((f64::from(stored) + part) / largest) as f32;
                let first = table.stored_range[0] as f32;
                let entry = lookup_entry(intensity, largest as f32, first, density as f32);
                let entry = entry.clamp(0.0, (LookupTable::ENTRIES - 1) as f32);
                let around = [entry.floor(), entry.ceil()].map(|entry| table.entries[entry as usize][3]);
                let is_visible = around[0] > 0.0 || around[1] > 0.0;
                let may_be = intensity > visible.x && intensity < visible.y;
                assert!(may_be || !is_visible, "{points:?} {stored} + {part}: {visible}");
            }
        }
    }
}
