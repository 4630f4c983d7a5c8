// Inputs of every pass over a volume and its carvers. The Rust side is `uniform.rs` and `carver_uniform.rs` (data),
// `layouts.rs` and `bindings.rs`. The group is 0 in compute passes and another when drawing.

#define_import_path bevy_contextual_ao::volume_bindings

struct VolumeUniform {
    // Volume space (mm, around the centre) → texture coordinates in [0, 1].
    texture_from_local: mat4x4<f32>,
    // Voxel index, at voxel centres → volume space (mm).
    local_from_voxel: mat4x4<f32>,
    local_from_world: mat4x4<f32>,
    world_from_local: mat4x4<f32>,
    // Number of voxels.
    dimensions: vec3<u32>,
    // Shares, 0 or 1: of shading by occlusion, of shading by a light, and of the jitter of view rays.
    occlusion_share: f32,
    light_share: f32,
    jitter_share: f32,
    // Stored intensity that the texture gives as 1; stored intensity of the table's first entry; table entries per unit
    // of stored intensity.
    largest_stored: f32,
    table_first: f32,
    table_density: f32,
    // Rows of gradients per unit of the intensity's gradient per mm (0: it has no effect), and the last row.
    gradient_density: f32,
    last_gradient_row: f32,
    // Exponents of the opacity correction (length of a step / opacity unit distance).
    occlusion_exponent: f32,
    draw_exponent: f32,
    // Length of a drawing step, mm.
    draw_step_mm: f32,
    // Smallest distance between voxels.
    voxel_mm: f32,
    // Texels per side of the depth maps and of the dilation maps.
    depth_map_size: f32,
    dilation_map_size: f32,
    // Radii of balls, mm: around the middle of a brick, all points of the brick; around a voxel, all points that decide
    // its occlusion, and all points that decide its opacity.
    brick_radius_mm: f32,
    reach_mm: f32,
    footprint_mm: f32,
    // Bits of the carvers to test in every brick (`bricks.wgsl`): all carvers or none.
    tests_all_carvers: u32,
    // 1: view rays leap over empty bricks.
    draw_leaps: u32,
    // Lower and upper bound of drawn intensities, as the texture gives them.
    visible_intensities: vec2<f32>,
    // Texture coordinates → coordinates of the occlusion texture; voxels along each side of a block with one factor.
    occlusion_from_texture: vec3<f32>,
    occlusion_stride: u32,
    // 1: occlusion is looked up by the nearest 27 texels. 0: by 8.
    occlusion_widening: f32,
    // Farthest way of a look-up from the point that is seen, voxels.
    occlusion_shift: f32,
    // Farthest voxel along an axis whose intensity decides whether drawing reads a voxel's occlusion.
    deciding_voxels: u32,
    // 1: opacities for occlusion are means over voxels. 0: those of the voxels' own intensities.
    footprint_share: f32,
    // Factor on occlusion factors before they are cut off at 1, exponent of the light that is left, and factor on all light.
    occlusion_scale: f32,
    occlusion_intensity: f32,
    exposure: f32,
    // For octants, which are drawn by the normal: their axes (columns, volume space, of unit length), and the weights of
    // octants 0 to 3 and of 4 to 7, the largest 1. Then the exponent of the light that reaches a point, and 1 where surfaces are lit from both sides.
    octant_axes: mat3x3<f32>,
    low_octants: vec4<f32>,
    high_octants: vec4<f32>,
    occlusion_power: f32,
    both_sides: f32,
    // Roughness and reflectance of surfaces under the scene's lights, as Bevy's materials have them.
    perceptual_roughness: f32,
    reflectance: f32,
    // 1: meshes and volumes cast shadows onto the volume.
    receives_shadows: u32,
    // Opacity up to the point whose depth is written.
    depth_opacity: f32,
}

struct Carver {
    // Volume space (mm) → clip map space, as three rows.
    clip_from_local: array<vec4<f32>, 3>,
    // Clip map space → dilation map: xy * scale + offset.
    dilation_offset: vec2<f32>,
    dilation_scale: vec2<f32>,
    // A voxel's footprint as a box with one edge along the line of sight, clip map space. Its half edges are
    // `footprint_x`, (0, footprint_y) and (0, 0, footprint_z).
    footprint_x: vec3<f32>,
    footprint_z: f32,
    footprint_y: vec2<f32>,
    // Range of layers of the depth maps and of the dilation maps.
    first_layer: u32,
    end_layer: u32,
    // OPERATION_*
    operation: u32,
    padding: u32,
}

// Operation of the entries behind the last carver. Loops over carvers end there or at MAX_CARVERS, not at a number of
// carvers (1 in docs/drivers.md).
const OPERATION_NONE: u32 = 0u;
const OPERATION_SUBTRACT: u32 = 1u;
const OPERATION_INTERSECT: u32 = 2u;
// Operation of a former carver that has no maps any more. It affects everything within reach of its clip camera's view.
const OPERATION_REGION: u32 = 3u;
const MAX_CARVERS: u32 = 128u;

@group(#{VOLUME_BIND_GROUP}) @binding(0) var<uniform> volume: VolumeUniform;
@group(#{VOLUME_BIND_GROUP}) @binding(1) var<uniform> carvers: array<Carver, MAX_CARVERS>;
@group(#{VOLUME_BIND_GROUP}) @binding(2) var intensities: texture_3d<f32>;
@group(#{VOLUME_BIND_GROUP}) @binding(3) var lookup_table: texture_2d<f32>;
@group(#{VOLUME_BIND_GROUP}) @binding(4) var depth_maps: texture_2d_array<f32>;
@group(#{VOLUME_BIND_GROUP}) @binding(5) var dilation_maps: texture_2d_array<f32>;
@group(#{VOLUME_BIND_GROUP}) @binding(6) var edge_sampler: sampler;

// Index of a voxel in a buffer of all voxels, x fastest.
fn voxel_index(voxel: vec3<u32>) -> u32 {
    return (voxel.z * volume.dimensions.y + voxel.y) * volume.dimensions.x + voxel.x;
}

// Table entry of an intensity, as a texture gives it. Stored intensities are whole numbers. Values that are whole but
// for rounding are rounded, because a transparent intensity may have a visible neighbour.
fn lookup_entry(intensity: f32) -> f32 {
    let stored = intensity * volume.largest_stored;
    let nearest = round(stored);
    let is_whole = abs(stored - nearest) < 1e-3 + 3e-7 * stored;
    return (select(stored, nearest, is_whole) - volume.table_first) * volume.table_density;
}

// Whether an intensity lies between the bounds of drawn intensities.
fn may_be_visible(intensity: f32) -> bool {
    return intensity > volume.visible_intensities.x && intensity < volume.visible_intensities.y;
}

// Whether any intensity between two does.
fn may_be_visible_between(a: f32, b: f32) -> bool {
    return max(a, b) > volume.visible_intensities.x && min(a, b) < volume.visible_intensities.y;
}
