// Density of a voxel after clipping, as a whole number of 16 bits, so that sums are exact.

#define_import_path bevy_contextual_ao::voxel_density

#import bevy_contextual_ao::{
    density::{clipped_intensity, clipped_opacity},
    voxel_lines::filtering,
}

fn density_of(voxel: vec3<u32>) -> u32 {
    var density = 0.0;
    if filtering.is_of_intensities != 0u {
        density = (clipped_intensity(voxel, filtering.lowest) - filtering.lowest) * filtering.per_intensity;
    } else {
        density = clipped_opacity(voxel);
    }
    return u32(round(saturate(density) * 65535.0));
}
