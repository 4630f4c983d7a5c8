//! The data that every shader reads of a volume (`volume_bindings.wgsl`).

use bevy::{
    math::{DMat4, DVec3},
    prelude::*,
    render::render_resource::ShaderType,
};

use super::extract::ExtractedVolume;
use crate::{
    occlusion::{AmbientOcclusion, Shortcuts},
    volume::LookupTable,
};

/// One volume, as `VolumeUniform` in WGSL.
#[derive(Clone, Debug, Default, PartialEq, ShaderType)]
pub(crate) struct VolumeUniform {
    texture_from_local: Mat4,
    local_from_voxel: Mat4,
    local_from_world: Mat4,
    dimensions: UVec3,
    occlusion_share: f32,
    light_share: f32,
    jitter_share: f32,
    table_scale: f32,
    table_offset: f32,
    occlusion_exponent: f32,
    draw_exponent: f32,
    draw_step_mm: f32,
    depth_map_size: f32,
    dilation_map_size: f32,
    brick_radius_mm: f32,
    reach_mm: f32,
    footprint_mm: f32,
    tests_all_carvers: u32,
    draw_leaps: u32,
    visible_intensities: Vec2,
}

impl VolumeUniform {
    /// `largest_stored` is the stored intensity that the texture gives as 1; without occlusion
    /// samples are drawn unshaded; the sizes are those of the depth and the dilation maps.
    pub fn new(
        volume: &ExtractedVolume,
        largest_stored: f64,
        has_occlusion: bool,
        [depth_map_size, dilation_map_size]: [u32; 2],
        carvers: usize,
        shortcuts: &Shortcuts,
    ) -> Self {
        let geometry = &volume.geometry;
        let texture_from_voxel = geometry.texture_from_voxel();
        let [lo, hi] = volume.table.stored_range;
        let entries_per_stored = if hi > lo { (LookupTable::ENTRIES - 1) as f64 / (hi - lo) } else { 0.0 };
        let table_scale = largest_stored * entries_per_stored;
        let table_offset = -lo * entries_per_stored;
        let unit = volume.table.opacity_unit_distance_mm as f64;
        let draw_step = geometry.spacing_mm.min_element() * volume.shading.step_voxels.max(0.01) as f64;
        let mode = volume.shading.mode;
        Self {
            texture_from_local: DMat4::from(texture_from_voxel * geometry.local_from_voxel.inverse())
                .as_mat4(),
            local_from_voxel: DMat4::from(geometry.local_from_voxel).as_mat4(),
            local_from_world: Mat4::from(volume.world_from_local.inverse()),
            dimensions: geometry.dimensions,
            occlusion_share: f32::from(mode.uses_occlusion() && has_occlusion),
            light_share: f32::from(mode.uses_light()),
            jitter_share: f32::from(volume.shading.jitter),
            table_scale: table_scale as f32,
            table_offset: table_offset as f32,
            occlusion_exponent: (volume.occlusion.step_mm.max(0.0) as f64 / unit) as f32,
            draw_exponent: (draw_step / unit) as f32,
            draw_step_mm: draw_step as f32,
            depth_map_size: depth_map_size as f32,
            dilation_map_size: dilation_map_size as f32,
            // Half a brick's diagonal, which four cells have; rounding must not make it too short.
            brick_radius_mm: (2.001 * geometry.cell_diagonal_mm()) as f32,
            reach_mm: volume.occlusion.reach_mm(geometry) as f32,
            footprint_mm: AmbientOcclusion::footprint_mm(geometry) as f32,
            tests_all_carvers: if shortcuts.near_carvers { 0 } else { bits_of(carvers) },
            draw_leaps: shortcuts.draw_leaps.into(),
            visible_intensities: visible_intensities(&volume.table, table_scale, table_offset),
        }
    }
}

/// Between which intensities a table has opacity, an entry being an intensity times `scale` plus `offset`.
/// Where the function is constant beyond the table's ends, without end.
fn visible_intensities(table: &LookupTable, scale: f64, offset: f64) -> Vec2 {
    let has_opacity = |entry: &[f32; 4]| entry[3] > 0.0;
    let first = table.entries.iter().position(has_opacity);
    let last = table.entries.iter().rposition(has_opacity);
    let (Some(first), Some(last)) = (first, last) else {
        return Vec2::new(f32::MAX, f32::MIN);
    };
    // Entries beside one that has opacity are transparent, what is between is not; a bit more for rounding.
    let intensity = |entry: f64| ((entry - offset) / scale) as f32;
    let has_scale = scale > 0.0;
    let from = if first > 0 && has_scale { intensity(first as f64 - 1.01) } else { f32::MIN };
    let to =
        if last + 1 < table.entries.len() && has_scale { intensity(last as f64 + 1.01) } else { f32::MAX };
    Vec2::new(from, to)
}

/// The bits, modulo 32, of so many carvers.
fn bits_of(carvers: usize) -> u32 {
    if carvers < 32 { (1 << carvers) - 1 } else { u32::MAX }
}

/// The rays as the ray cast reads them: two entries a ray, in texture coordinates; the offset of
/// the first sample and the weight, then the step between samples.
pub(crate) fn ray_table(volume: &ExtractedVolume) -> Vec<Vec4> {
    let geometry = &volume.geometry;
    let texture_from_local = geometry.texture_from_voxel() * geometry.local_from_voxel.inverse();
    let start = AmbientOcclusion::start_mm(geometry.spacing_mm);
    let step = volume.occlusion.step_mm.max(0.0) as f64;
    let to_texture = |v: DVec3| texture_from_local.transform_vector3(v).as_vec3();
    volume
        .occlusion
        .pattern
        .directions()
        .into_iter()
        .flat_map(|ray| {
            [
                to_texture(ray.direction * start).extend(ray.weight as f32),
                to_texture(ray.direction * step).extend(0.0),
            ]
        })
        .collect()
}
