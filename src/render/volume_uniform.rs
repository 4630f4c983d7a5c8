//! The data that the shaders read of a volume and its carvers (`volume_bindings.wgsl`).

use bevy::{
    math::{DMat3, DMat4, DVec3, Vec3Swizzles},
    prelude::*,
    render::render_resource::ShaderType,
};

use super::{
    clip_maps::ReadyCarver,
    extract::{ExtractedCarver, ExtractedVolume},
};
use crate::{
    clip::{ClipOperation, MAX_CARVERS},
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
            table_scale: (largest_stored * entries_per_stored) as f32,
            table_offset: (-lo * entries_per_stored) as f32,
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
        }
    }
}

/// The bits, modulo 32, of so many carvers.
fn bits_of(carvers: usize) -> u32 {
    if carvers < 32 { (1 << carvers) - 1 } else { u32::MAX }
}

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
    operation: u32,
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
    /// At most [`MAX_CARVERS`].
    fn from_iter<I: IntoIterator<Item = CarverUniform>>(carvers: I) -> Self {
        let mut table = Self::default();
        for (entry, carver) in table.carvers.iter_mut().zip(carvers) {
            *entry = carver;
        }
        table
    }
}

impl CarverUniform {
    pub fn new(carver: &ExtractedCarver, ready: &ReadyCarver, volume: &ExtractedVolume) -> Self {
        let local_from_volume = carver.world_from_local.inverse() * volume.world_from_local;
        let clip = ready.frame.clip_from_local() * local_from_volume;
        let voxel = clip.matrix3.as_dmat3() * volume.geometry.local_from_voxel.matrix3;
        let edges = lower_triangular(voxel).as_mat3();
        let dilation = ready.dilation.frame();
        let matrix = clip.matrix3.transpose();
        let row = |row: Vec3A, offset: f32| Vec3::from(row).extend(offset);
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

    /// What stands for a carver that was, and whose maps are gone; `None` for one that acted everywhere.
    pub fn region(self) -> Option<Self> {
        (self.operation != OPERATION_INTERSECT).then_some(Self { operation: OPERATION_REGION, ..self })
    }

    #[cfg(test)]
    pub fn at(place: f32, operation: ClipOperation) -> Self {
        let clip_from_local = [Vec4::splat(place); 3];
        Self { clip_from_local, operation: operation_code(operation), ..default() }
    }
}

const OPERATION_SUBTRACT: u32 = 1;
const OPERATION_INTERSECT: u32 = 2;
const OPERATION_REGION: u32 = 3;

/// An operation as `OPERATION_*` in WGSL.
fn operation_code(operation: ClipOperation) -> u32 {
    match operation {
        ClipOperation::Subtract => OPERATION_SUBTRACT,
        ClipOperation::Intersect => OPERATION_INTERSECT,
    }
}

/// The half edges of a box with the same variance as the box with the half edges `edges`, lower
/// triangular: the third edge lies along z (Cholesky factor of `edges edges^T`).
fn lower_triangular(edges: DMat3) -> DMat3 {
    let gram = edges * edges.transpose();
    let [xx, xy, xz] = gram.x_axis.to_array();
    let x = DVec3::new(xx, xy, xz) / xx.sqrt();
    let yy = (gram.y_axis.y - x.y * x.y).sqrt();
    let y = DVec3::new(0.0, yy, (gram.y_axis.z - x.y * x.z) / yy);
    let z = DVec3::new(0.0, 0.0, (gram.z_axis.z - x.z * x.z - y.z * y.z).sqrt());
    DMat3::from_cols(x, y, z)
}

/// Which stale voxels are cast without being asked for by a view, as `QUEUE_*` in WGSL.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Queue {
    #[default]
    None,
    Sampleable,
    Visible,
    All,
}

/// What a frame does to a volume, as `OcclusionPass` in WGSL.
#[derive(Clone, Copy, Debug, Default, PartialEq, ShaderType)]
pub(crate) struct OcclusionPassUniform {
    pub lists_all: u32,
    pub is_all_stale: u32,
    pub queue: u32,
    pub changes: u32,
    pub past_changes: u32,
    pub coverage: u32,
    pub rays: u32,
    pub steps: u32,
    pub ends_early: u32,
    pub leaps: u32,
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clip::CoverageRule;
    use bevy::render::render_resource::encase::private::StructMetadata;
    use naga::{Module, TypeInner};

    /// The WGSL side, as it is without Bevy's preprocessor.
    fn module() -> Module {
        let source: String = [include_str!("volume_bindings.wgsl"), include_str!("occlusion_pass.wgsl")]
            .concat()
            .lines()
            .filter(|line| !line.starts_with('#'))
            .map(|line| line.replace("#{VOLUME_BIND_GROUP}", "0") + "\n")
            .collect();
        naga::front::wgsl::parse_str(&source).expect("the shader libraries are valid")
    }

    /// Size and offsets of a WGSL struct.
    fn wgsl_layout(name: &str) -> (u64, Vec<u64>) {
        let module = module();
        let (_, found) =
            module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name)).expect("the struct is there");
        let TypeInner::Struct { members, span } = &found.inner else { panic!("{name} is no struct") };
        (*span as u64, members.iter().map(|member| member.offset as u64).collect())
    }

    fn rust_layout<T: ShaderType<ExtraMetadata = StructMetadata<N>>, const N: usize>() -> (u64, Vec<u64>) {
        let offsets = (0..N).map(|member| T::METADATA.offset(member)).collect();
        (T::min_size().get(), offsets)
    }

    #[test]
    fn rust_and_wgsl_agree() {
        assert_eq!(rust_layout::<VolumeUniform, 19>(), wgsl_layout("VolumeUniform"));
        assert_eq!(rust_layout::<CarverUniform, 10>(), wgsl_layout("Carver"));
        assert_eq!(rust_layout::<OcclusionPassUniform, 10>(), wgsl_layout("OcclusionPass"));
        let (bindings, pass) = (include_str!("volume_bindings.wgsl"), include_str!("occlusion_pass.wgsl"));
        for (shader, name, value) in [
            (bindings, "MAX_CARVERS", MAX_CARVERS as u32),
            (bindings, "OPERATION_NONE", CarverUniform::default().operation),
            (bindings, "OPERATION_SUBTRACT", operation_code(ClipOperation::Subtract)),
            (bindings, "OPERATION_INTERSECT", operation_code(ClipOperation::Intersect)),
            (bindings, "OPERATION_REGION", OPERATION_REGION),
            (pass, "QUEUE_NONE", Queue::None as u32),
            (pass, "QUEUE_SAMPLEABLE", Queue::Sampleable as u32),
            (pass, "QUEUE_VISIBLE", Queue::Visible as u32),
            (pass, "QUEUE_ALL", Queue::All as u32),
            (pass, "COVERAGE_LINES", CoverageRule::Lines as u32),
            (pass, "COVERAGE_POINTS", CoverageRule::Points as u32),
            (pass, "COVERAGE_CENTER", CoverageRule::Center as u32),
        ] {
            let line = format!("const {name}: u32 = {value}u;");
            assert!(shader.contains(&line), "`{line}` is not in the shader");
        }
    }
}
