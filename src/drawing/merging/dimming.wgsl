// Dims what is behind a part of a volume that shares its space, by the transmittance of that part (`merged`). Opaque meshes
// end the part, sample by sample.

#import bevy_contextual_ao::{
    drawn_box::corner_of_box,
    marched_view::MarchedView,
    merged::{DARK, own_curves, record, transmittance_to},
}
#ifdef DEPTH_PREPASS
#import bevy_pbr::{prepass_utils::prepass_depth, view_transformations::depth_ndc_to_view_z}
#endif

@group(#{VOLUME_BIND_GROUP}) @binding(12) var<uniform> marched_view: MarchedView;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return corner_of_box(marched_view, index);
}

@fragment
fn fragment(
    @builtin(position) position: vec4<f32>,
#ifdef MULTISAMPLED
    @builtin(sample_index) sample_index: u32,
#endif
) -> @location(0) vec4<f32> {
    let curves = own_curves();
    let pixel = vec2<u32>(position.xy);
    let begin_depth = bitcast<f32>(record[0]);
    var end_depth = bitcast<f32>(record[1]);
#ifdef DEPTH_PREPASS
#ifdef MULTISAMPLED
    let opaque = prepass_depth(position, sample_index);
#else
    let opaque = prepass_depth(position, 0u);
#endif
    // Depth is reversed: 0 is infinitely far.
    if opaque > 0.0 {
        end_depth = min(end_depth, -depth_ndc_to_view_z(opaque));
    }
#endif
    let before = transmittance_to(curves, pixel, begin_depth);
    let opacity = 1.0 - transmittance_to(curves, pixel, max(begin_depth, end_depth)) / max(before, DARK);
    if opacity <= 0.0 {
        discard;
    }
    return vec4(0.0, 0.0, 0.0, opacity);
}
