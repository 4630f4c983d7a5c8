// Colours of the pixels at outlines (`outlines.wgsl`): the mean of what several rays see, an invocation each. Drawing by
// fragments would follow these rays one behind the other, in every group of pixels that an outline passes.
//
// Opaque meshes are not known yet. Drawing compares them with the end of what the rays see.

#import bevy_contextual_ao::{
    compositing::{Pixel, completed, pixel_of_ray},
    marched_view::{
        MarchedView, OUTLINE_HEAD, outline_offset, outline_ray, outline_rays, ray_through, unpack_pixel, word_of_color,
    },
    seen::run_at,
    work_list::ROW,
}

@group(#{VOLUME_BIND_GROUP}) @binding(12) var<uniform> marched_view: MarchedView;
// Lists of the pixels at outlines.
@group(1) @binding(0) var<storage, read_write> outlines: array<u32>;

const WIDTH: u32 = 64u;

// What each ray of the workgroup sees.
var<workgroup> colors: array<vec4<f32>, WIDTH>;
var<workgroup> ends_mm: array<f32, WIDTH>;

@compute @workgroup_size(WIDTH)
fn color_outlines(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let rays = outline_rays(marched_view);
    let first = marched_view.first_outline;
    let own = outline_ray(marched_view, outlines[first], group.y * ROW + group.x, WIDTH, lane);
    if own.is_listed {
        let pixel = vec2<f32>(unpack_pixel(outlines[first + OUTLINE_HEAD + own.slot]));
        let ray = ray_through(marched_view, pixel + outline_offset(marched_view, own.number));
        let run = run_at(marched_view, marched_view.first_run + rays * own.slot + own.number);
        let seen = completed(pixel_of_ray(ray, run));
        colors[lane] = vec4(seen.color, seen.alpha);
        ends_mm[lane] = seen.end_mm;
    }
    workgroupBarrier();
    if own.is_listed && own.number == 0u {
        var sum = vec4(0.0);
        var end_mm = 0.0;
        for (var k = 0u; k < rays; k += 1u) {
            sum += colors[lane + k];
            end_mm = max(end_mm, ends_mm[lane + k]);
        }
        let color = sum / f32(rays);
        let word = word_of_color(marched_view, own.slot);
        outlines[word] = pack2x16float(color.rg);
        outlines[word + 1u] = pack2x16float(color.ba);
        outlines[word + 2u] = bitcast<u32>(end_mm);
    }
}
