// Occlusion of every voxel from mean opacities of the shells of a box around it, by a summed-area table. One shell is the
// method of Díaz et al. 2010, several are that of Schlegel, Makhinya, Pajarola 2011, as Titov et al. describe them (section
// 2).
//
// Shells absorb light one after the other (Max 1995), and all of the way gives light evenly, as along the rays of local
// ambient occlusion. A part s of a shell of mean opacity m lets (1 - m)^s through, in steps, for which opacities are given. The
// factor is the mean over the way to the outermost shell. Of a single shell it is 1 - m.

#import bevy_contextual_ao::volume_bindings::{volume, voxel_index}

struct Shell {
    // Half the width of the shell's outer box, without the voxel itself, voxels.
    radii: vec3<u32>,
    // Thickness, steps; 0 for a single shell.
    steps: f32,
}

@group(1) @binding(0) var<storage, read> table: array<u32>;
// From the inside out. Each one's outer box is the next one's inner box.
@group(1) @binding(1) var<storage, read> shells: array<Shell>;
#ifdef STORE_R8
@group(1) @binding(2) var occlusion: texture_storage_3d<r8unorm, write>;
#else
@group(1) @binding(2) var occlusion: texture_storage_3d<rgba8unorm, write>;
#endif

// Mean of exp(-s) over a way of this optical depth.
fn mean_light(depth: f32) -> f32 {
    let series = 1.0 - depth * (0.5 - depth / 6.0);
    return select((1.0 - exp(-depth)) / depth, series, depth < 1e-2);
}

// Optical depth of an opaque shell.
const OPAQUE_DEPTH: f32 = 1e30;
// Opacity of an opaque voxel in the table.
const OPAQUE: u32 = 255u;

// Sum over all voxels with no larger index than the corner's along any axis.
fn sum_up_to(corner: vec3<i32>) -> u32 {
    let sum = table[voxel_index(vec3<u32>(max(corner, vec3(0))))];
    return select(sum, 0u, any(corner < vec3(0)));
}

// Sum over the voxels of a box in the grid; those beyond it are empty.
fn sum_of_box(voxel: vec3<i32>, radii: vec3<i32>) -> u32 {
    let high = min(voxel + radii, vec3<i32>(volume.dimensions) - 1);
    let low = voxel - radii - 1;
    var sum = 0u;
    for (var corner = 0u; corner < 8u; corner += 1u) {
        let is_low = (vec3(corner) & vec3(1u, 2u, 4u)) != vec3(0u);
        let part = sum_up_to(select(high, low, is_low));
        // Sums wrap around.
        sum += select(part, 0u - part, (countOneBits(corner) & 1u) != 0u);
    }
    return sum;
}

@compute @workgroup_size(4, 4, 4)
fn evaluate_boxes(@builtin(global_invocation_id) voxel: vec3<u32>) {
    if any(voxel >= volume.dimensions) {
        return;
    }
    // Sum over the box, and its sum if all of it were opaque.
    var inner = vec2(0u);
    var light = 0.0;
    var steps = 0.0;
    // Optical depth of the shells further in.
    var depth = 0.0;
    for (var k = 0u; k < arrayLength(&shells); k += 1u) {
        let shell = shells[k];
        let width = 2u * shell.radii + 1u;
        let sum = sum_of_box(vec3<i32>(voxel), vec3<i32>(shell.radii));
        let outer = vec2(sum, OPAQUE * width.x * width.y * width.z);
        let between = outer - inner;
        let transparency = f32(between.y - between.x) / f32(between.y);
        let shell_depth = select(OPAQUE_DEPTH, -log(transparency) * shell.steps, transparency > 0.0);
        light += exp(-depth) * select(mean_light(shell_depth) * shell.steps, transparency, shell.steps == 0.0);
        steps += select(shell.steps, 1.0, shell.steps == 0.0);
        depth += shell_depth;
        inner = outer;
    }
    textureStore(occlusion, voxel, vec4(light / steps, 0.0, 0.0, 0.0));
}
