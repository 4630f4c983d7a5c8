// Depth of a volume: that of the point up to which the light is stopped as far as the volume's setting says. A pixel that is
// less opaque has none. An isosurface that is drawn alone has the depth of its hits.

#import bevy_contextual_ao::{
    drawn_box::corner_of_box,
    marched_view::{MarchedView, depth_of, ray_through},
}
#ifdef ISOSURFACE
#import bevy_contextual_ao::surface_ray::surface_hit
#else
#import bevy_contextual_ao::{seen::first_run, stop::stop_behind_first_run, volume_bindings::volume}
#endif

@group(#{VOLUME_BIND_GROUP}) @binding(12) var<uniform> marched_view: MarchedView;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return corner_of_box(marched_view, index);
}

@fragment
fn fragment(@builtin(position) position: vec4<f32>) -> @builtin(frag_depth) f32 {
    let ray = ray_through(marched_view, position.xy);
#ifdef ISOSURFACE
    let hit = surface_hit(ray);
    let along_mm = hit.along_mm;
    let is_there = hit.alpha > 0.0;
#else
    let stop = stop_behind_first_run(ray, first_run(marched_view, vec2<u32>(position.xy)), volume.depth_opacity);
    let along_mm = stop.along_mm;
    let is_there = stop.alpha >= volume.depth_opacity;
#endif
    if !is_there {
        discard;
    }
    return depth_of(marched_view, ray, along_mm);
}
