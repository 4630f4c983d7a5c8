// Shadow of a volume: the depth at which light is stopped (`stop`), along the rays of a light's window onto the volume. It is
// kept until the light or the volume changes. `maps.wgsl` puts it into one of Bevy's shadow maps.
//
// Matter that is translucent stops the light in some texels alone, by blue noise: so shadows, which are means over some
// texels, are as dark as the matter is opaque. It stops the light at its far side, so that noise does not show on itself.
// An isosurface that is drawn alone stops all light.

#import bevy_contextual_ao::{
    marched_view::{MarchedView, depth_of, ray_through},
    view_ray::{ViewRay, noise},
}
#ifdef ISOSURFACE
#import bevy_contextual_ao::surface_ray::surface_hit
#else
#import bevy_contextual_ao::{next_run::begin_march, stop::stop_of}
#endif

@group(#{VOLUME_BIND_GROUP}) @binding(12) var<uniform> marched_view: MarchedView;

// Matter of this opacity stops all light: a shadow begins where its surface does.
const DARK: f32 = 0.95;

@fragment
fn fragment(@builtin(position) position: vec4<f32>) -> @builtin(frag_depth) f32 {
    // The place in the shadow map.
    let place = position.xy + vec2<f32>(marched_view.window.first);
    let ray = ray_through(marched_view, place);
#ifdef ISOSURFACE
    let hit = surface_hit(ray);
    let along_mm = hit.along_mm;
    let is_there = hit.alpha > 0.0;
#else
    let stop = stop_of(ray, begin_march(ray), DARK);
    let along_mm = stop.along_mm;
    let is_there = stop.alpha > min(noise(place), DARK - 0.01);
#endif
    if !is_there {
        discard;
    }
    return depth_of(marched_view, ray, along_mm);
}
