// Ambient light at points that are drawn, from the occlusion volume (V_AO, step VI of the CAO paper, section 3.5).
//
// The paper interpolates trilinearly. Across a surface, occlusion changes much within a voxel: the kinks at voxels then show
// as grain. With SMOOTH_OCCLUSION a quadratic B-spline takes the nearest 27 texels, by 8 filtered samples.

#define_import_path bevy_contextual_ao::ambient_light

#ifdef OCTANTS
#import bevy_contextual_ao::{
    octants::{Octants, high_octants_at, low_octants_at, octants_factor},
    orientation::{mean_inward, orientation_at},
}
#endif
#import bevy_contextual_ao::{orientation::Cut, reconstruction::quadratic, volume_bindings::{edge_sampler, volume}}

@group(#{VOLUME_BIND_GROUP}) @binding(10) var occlusion: texture_3d<f32>;

// Occlusion factor at a point.
fn factor_at(p: vec3<f32>) -> f32 {
    let place = p * volume.occlusion_from_texture;
#ifdef SMOOTH_OCCLUSION
    let texels = quadratic(place, vec3<f32>(textureDimensions(occlusion)));
    var sum = 0.0;
    for (var k = 0u; k < 8u; k += 1u) {
        let is_low = vec3((k & 1u) != 0u, (k & 2u) != 0u, (k & 4u) != 0u);
        let weight = select(1.0 - texels.low_weight, texels.low_weight, is_low);
        let factor = textureSampleLevel(occlusion, edge_sampler, select(texels.high, texels.low, is_low), 0.0).r;
        sum += weight.x * weight.y * weight.z * factor;
    }
    return sum;
#else
    return textureSampleLevel(occlusion, edge_sampler, place, 0.0).r;
#endif
}

// The share of the light that reaches a point.
fn ambient_at(p: vec3<f32>, cut: Cut) -> f32 {
#ifdef OCTANTS
    let low = textureSampleLevel(occlusion, edge_sampler, low_octants_at(p), 0.0);
    let high = textureSampleLevel(occlusion, edge_sampler, high_octants_at(p), 0.0);
    let factor = octants_factor(Octants(low, high), mean_inward(orientation_at(p, cut)));
#else
    let factor = factor_at(p);
#endif
    let light = pow(saturate(factor * volume.occlusion_scale), volume.occlusion_intensity);
    return mix(1.0, light, volume.occlusion_share);
}

#ifdef MODULATED
// Factor on the opacity at a point.
fn opacity_share_at(p: vec3<f32>) -> f32 {
    return mix(1.0, textureSampleLevel(occlusion, edge_sampler, p, 0.0).g, volume.occlusion_share);
}
#endif
