// Puts the kept depths of a light's window onto a volume (`depths.wgsl`) into a shadow map, behind those of meshes.

#import bevy_contextual_ao::marched_view::MarchedView

@group(0) @binding(0) var depths: texture_depth_2d;
@group(0) @binding(1) var<uniform> marched_view: MarchedView;

@fragment
fn fragment(@builtin(position) position: vec4<f32>) -> @builtin(frag_depth) f32 {
    let depth = textureLoad(depths, vec2<i32>(position.xy) - vec2<i32>(marched_view.window.first), 0);
    if depth <= 0.0 {
        discard;
    }
    return depth;
}
