// Step V of the CAO paper (sections 3.4 and 3.5): the ambient factor of voxels, cast along a
// spherical pattern of rays (equations 2 and 3). A workgroup takes the pending voxels of one mask word
// and deals out their rays to its invocations. Neighbouring invocations cast in the same direction.
//
// The result has the same bits for any number of voxels and any optimizations. Factors and
// transmittances are added up in whole numbers, so that order does not matter and n equal samples
// count n times. Leaps pass only over samples that are exactly 0. A ray that lets through less than
// half a quantum of the stored byte counts as opaque, even if it goes on.

#import bevy_contextual_ao::{
    brick_bindings::distance_at,
    bricks::{PENDING, inverse_step, mask_at, samples_within, steps_to_leave, voxel_of_bit, voxel_of_word},
    listed::{NOTHING, listed_item},
    volume_bindings::{volume, voxel_index},
    work_list::FRONT,
}

// Rays that a frame casts.
struct RayPass {
    // First and end ray, and number of samples of each.
    first_ray: u32,
    end_ray: u32,
    steps: u32,
    // 1: rays end when nothing more can change them. 1: rays leap over empty bricks.
    ends_early: u32,
    leaps: u32,
    // Progressive rays: share of the earlier sums that counts, and the total weight of the new sums.
    kept: f32,
    found_weight: f32,
    // 1: other rays of the same voxels follow in the next frame.
    goes_on: u32,
}

// Opacities after clipping, V_o.
@group(1) @binding(0) var opacities: texture_3d<f32>;
// Its border is transparent where the device has such samplers, else it clamps to the edge.
@group(1) @binding(1) var grid_sampler: sampler;
@group(1) @binding(2) var<uniform> ray_pass: RayPass;
// Two entries a ray, in texture coordinates: the offset of the first sample with the ray's weight, then
// the step between samples.
@group(1) @binding(3) var<storage, read> rays: array<vec4<f32>>;
@group(1) @binding(5) var<storage, read_write> voxel_masks: array<u32>;
#ifdef STORE_R8
@group(1) @binding(6) var occlusion: texture_storage_3d<r8unorm, write>;
#else
@group(1) @binding(6) var occlusion: texture_storage_3d<rgba8unorm, write>;
#endif
#ifdef PROGRESSIVE
// Sum of every voxel's ray factors so far, each times its weight.
@group(1) @binding(8) var<storage, read_write> ray_sums: array<f32>;
#endif
#ifdef COUNT_WORK
// Voxels cast, samples taken and distances looked up, each as low and high word.
@group(1) @binding(7) var<storage, read_write> work: array<atomic<u32>, 6>;

var<workgroup> samples_taken: atomic<u32>;
var<workgroup> distances_read: atomic<u32>;

fn count(counter: u32, amount: u32) {
    let before = atomicAdd(&work[2u * counter], amount);
    if before + amount < before {
        atomicAdd(&work[2u * counter + 1u], 1u);
    }
}
#endif

// Invocations of a workgroup.
const WIDTH: u32 = 64u;
// Half a quantum of the stored byte.
const OPAQUE: f32 = 1.0 / 512.0;
// Units in which transmittances and ray factors are added up.
const TRANSMITTANCE_UNIT: f32 = 1.0 / 65536.0;
const FACTOR_UNIT: f32 = 1.0 / 268435456.0;

// Voxels to be cast, as numbers of bits in the mask word, and the sums of their ray factors.
var<workgroup> voxels: array<u32, 32>;
var<workgroup> sums: array<atomic<u32>, 32>;

// Opacity at a point: trilinear, and transparent outside the grid.
fn opacity_at(p: vec3<f32>) -> f32 {
    let opacity = textureSampleLevel(opacities, grid_sampler, p, 0.0).r;
#ifdef GRID_BORDER
    return opacity;
#else
    // Interpolation with a transparent neighbour beyond the outermost voxel centres.
    let half = 0.5 * vec3<f32>(volume.dimensions);
    let overhang = max(abs(p * 2.0 - 1.0) * half - (half - 0.5), vec3(0.0));
    let rest = saturate(1.0 - overhang);
    return opacity * rest.x * rest.y * rest.z;
#endif
}

// Number of samples of a ray (voxels) before it leaves the reach of the grid's outermost voxels. A ray
// starts in the grid, so that it leaves for good. Rounding may add one sample, which is transparent.
fn samples_in_grid(start: vec3<f32>, inverse: vec3<f32>) -> u32 {
    let steps = steps_to_leave(start, inverse, vec3(-0.51), vec3<f32>(volume.dimensions) + 0.51);
    return u32(clamp(ceil(steps), 0.0, 1e6));
}

// Equation 2 with M = steps + 1: the mean transmittance along the ray, the voxel itself included.
fn cast_ray(start: vec3<f32>, step: vec3<f32>) -> f32 {
    let dimensions = vec3<f32>(volume.dimensions);
    let inverse = inverse_step(step * dimensions);
    let steps = ray_pass.steps;
    var end = steps;
    if ray_pass.ends_early != 0u {
        end = min(end, samples_in_grid(start * dimensions, inverse));
    }
    var transmittance = 1.0;
    // Transmittance in whole units. The voxel's own is 1.
    var unit = u32(1.0 / TRANSMITTANCE_UNIT);
    var sum = unit;
    var i = 0u;
    // The samples before this one lie in a brick that is known to be not empty.
    var known = select(end, 0u, ray_pass.leaps != 0u);
    while i < end {
        // Leaps have a loop of their own, because lanes that leap would wait for those that take samples.
        while i >= known && i < end {
            let point = (start + f32(i) * step) * dimensions;
            let distance = distance_at(point);
#ifdef COUNT_WORK
            atomicAdd(&distances_read, 1u);
#endif
            let passed = min(end - i, samples_within(point, inverse, max(distance, 1u)));
            known = i + passed;
            if distance == 0u {
                break;
            }
            sum += passed * unit;
            i = known;
        }
        if i >= end {
            break;
        }
        transmittance *= 1.0 - opacity_at(start + f32(i) * step);
#ifdef COUNT_WORK
        atomicAdd(&samples_taken, 1u);
#endif
        if transmittance < OPAQUE {
            transmittance = 0.0;
            end = select(end, i + 1u, ray_pass.ends_early != 0u);
        }
        unit = u32(transmittance / TRANSMITTANCE_UNIT + 0.5);
        sum += unit;
        i += 1u;
    }
    // The remaining samples have the last transmittance.
    sum += (steps - i) * unit;
    return f32(sum) * TRANSMITTANCE_UNIT / f32(steps + 1u);
}

@compute @workgroup_size(WIDTH)
fn ray_cast(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let word = listed_item(FRONT, group);
    if word == NOTHING {
        return;
    }
    let pending = voxel_masks[mask_at(PENDING, word)];
    let count_of_voxels = countOneBits(pending);
    if lane < 32u && extractBits(pending, lane, 1u) != 0u {
        voxels[countOneBits(extractBits(pending, 0u, lane))] = lane;
    }
    workgroupBarrier();
    if lane == 0u && ray_pass.goes_on == 0u {
        voxel_masks[mask_at(PENDING, word)] = 0u;
    }
    // An invocation keeps to one voxel and shares its rays with `team` - 1 others.
    let first = voxel_of_word(word);
    let team = WIDTH / max(count_of_voxels, 1u);
    if lane < team * count_of_voxels {
        let place = lane % count_of_voxels;
        let voxel = first + voxel_of_bit(voxels[place]);
        let middle = vec3<f32>(voxel) + 0.5 * f32(volume.occlusion_stride);
        let center = middle / vec3<f32>(volume.dimensions);
        var sum = 0u;
        let first_ray = ray_pass.first_ray + lane / count_of_voxels;
        for (var ray = first_ray; ray < ray_pass.end_ray; ray += team) {
            let start = rays[2u * ray];
            let factor = start.w * cast_ray(center + start.xyz, rays[2u * ray + 1u].xyz);
            sum += u32(factor / FACTOR_UNIT + 0.5);
        }
        atomicAdd(&sums[place], sum);
    }
    workgroupBarrier();
    if lane < count_of_voxels {
        let voxel = first + voxel_of_bit(voxels[lane]);
        var ambient = f32(atomicLoad(&sums[lane])) * FACTOR_UNIT;
#ifdef PROGRESSIVE
        let index = voxel_index(voxel);
        ambient += ray_pass.kept * ray_sums[index];
        ray_sums[index] = ambient;
        ambient /= ray_pass.found_weight;
#endif
        textureStore(occlusion, voxel / volume.occlusion_stride, vec4(ambient, 0.0, 0.0, 0.0));
    }
#ifdef COUNT_WORK
    if lane == 0u {
        count(0u, count_of_voxels);
        count(1u, atomicLoad(&samples_taken));
        count(2u, atomicLoad(&distances_read));
    }
#endif
}
