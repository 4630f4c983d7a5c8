// Step V of the CAO paper (sections 3.4 and 3.5): the ambient factor of voxels, cast along a
// spherical pattern of rays (equations 2 and 3). A workgroup takes the pending voxels of some mask words.
// Its invocations cast the same ray of a voxel each. Where there are more invocations than voxels, several
// share the rays of a voxel.
//
// The result has the same bits for any number of voxels and any optimizations. Factors and
// transmittances are added up in whole numbers, so that order does not matter and n equal samples
// count n times. Leaps pass only over samples that are exactly 0. A ray that lets through less than
// half a quantum of the stored byte counts as opaque, even if it goes on.

#import bevy_contextual_ao::{
    brick_bindings::distance_at,
    bricks::{PENDING, leap_along, mask_at, samples_within, steps_to_leave, voxel_of_bit, voxel_of_word},
    cast_state::{CastState, FACTOR_UNIT, RayPass},
    listed::list,
    volume_bindings::{volume, voxel_index},
    work_list::ROW,
}
#ifdef PROGRESSIVE
#import bevy_contextual_ao::running_mean::{
    MOST, WordProgress, begun_anew, factor_of, keep_progress, noise_of, progress_of, running_means, touched,
}
#endif

// Opacities after clipping, V_o.
@group(1) @binding(0) var opacities: texture_3d<f32>;
// Its border is transparent where the device has such samplers, else it clamps to the edge.
@group(1) @binding(1) var grid_sampler: sampler;
@group(1) @binding(2) var<uniform> ray_pass: RayPass;
// Three entries a ray: the offset of the first sample with the ray's weight, and the step between samples,
// both in texture coordinates; then steps per voxel along each axis.
@group(1) @binding(3) var<storage, read> rays: array<vec4<f32>>;
@group(1) @binding(5) var<storage, read_write> voxel_masks: array<u32>;
#ifdef STORE_R8
@group(1) @binding(6) var occlusion: texture_storage_3d<r8unorm, write>;
#else
@group(1) @binding(6) var occlusion: texture_storage_3d<rgba8unorm, write>;
#endif
@group(1) @binding(9) var<storage, read> cast_state: CastState;
@group(1) @binding(10) var<uniform> slice: u32;
#ifdef COUNT_WORK
// Voxels cast, samples taken and distances looked up, each as low and high word.
@group(1) @binding(7) var<storage, read_write> work: array<atomic<u32>, 6>;

var<workgroup> samples_taken: atomic<u32>;
var<workgroup> distances_read: atomic<u32>;

fn count_work(counter: u32, amount: u32) {
    let before = atomicAdd(&work[2u * counter], amount);
    if before + amount < before {
        atomicAdd(&work[2u * counter + 1u], 1u);
    }
}
#endif

// Invocations of a workgroup, most words that it takes, and their voxels.
const WIDTH: u32 = 64u;
const MOST_WORDS: u32 = 8u;
const MOST_VOXELS: u32 = 32u * MOST_WORDS;
// Half a quantum of the stored byte.
const OPAQUE: f32 = 1.0 / 512.0;
// Unit in which transmittances are added up.
const TRANSMITTANCE_UNIT: f32 = 1.0 / 65536.0;

// The words, and the masks of their voxels to be cast.
var<workgroup> words: array<u32, MOST_WORDS>;
var<workgroup> masks: array<u32, MOST_WORDS>;
// Voxels to be cast, as numbers of a word and of a bit, 5 bits, and the sums of their ray factors.
var<workgroup> voxels: array<u32, MOST_VOXELS>;
var<workgroup> sums: array<atomic<u32>, MOST_VOXELS>;
#ifdef PROGRESSIVE
// Progress of the words before this frame and in it, and number of rays that this frame casts.
var<workgroup> progress_before: array<WordProgress, MOST_WORDS>;
var<workgroup> progress_now: array<WordProgress, MOST_WORDS>;
var<workgroup> rays_now: array<u32, MOST_WORDS>;

// Rays go on with the first one behind the last one.
fn place_of_ray(ray: u32) -> u32 {
    return 3u * (ray % ray_pass.all_rays);
}

// Takes up the progress of a word, of which a frame touched some voxels. Returns the voxels to cast.
fn take_up(k: u32, word: u32, touched_voxels: u32) -> u32 {
    progress_before[k] = progress_of(word);
    var progress = progress_before[k];
    if touched_voxels != 0u {
        progress = touched(progress_before[k], touched_voxels, ray_pass.kept);
    }
    let count = min(ray_pass.end_ray - ray_pass.first_ray, ray_pass.all_rays - progress.rays);
    for (var i = 0u; i < count; i += 1u) {
        progress.weight += rays[place_of_ray(ray_pass.first_ray + i)].w;
    }
    progress.rays += count;
    var ended = progress;
    if progress.rays == ray_pass.all_rays {
        progress.weight = 1.0;
        ended = progress;
        ended.going = 0u;
    }
    progress_now[k] = progress;
    rays_now[k] = count;
    keep_progress(word, ended);
    return progress.going;
}
#else
fn place_of_ray(ray: u32) -> u32 {
    return 3u * ray;
}
#endif

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
fn cast_ray(start: vec3<f32>, step: vec3<f32>, inverse: vec3<f32>) -> f32 {
    let dimensions = vec3<f32>(volume.dimensions);
    let leap = leap_along(inverse);
    let first_brick = 0.25 * start * dimensions;
    let step_bricks = 0.25 * step * dimensions;
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
            let point = first_brick + f32(i) * step_bricks;
            let distance = distance_at(point);
#ifdef COUNT_WORK
            atomicAdd(&distances_read, 1u);
#endif
            let passed = min(end - i, samples_within(point, leap, max(distance, 1u)));
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

fn voxel_of(number: u32) -> vec3<u32> {
    return voxel_of_word(words[number >> 5u]) + voxel_of_bit(number & 31u);
}

@compute @workgroup_size(WIDTH)
fn ray_cast(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let words_per_group = cast_state.words_per_group;
    let in_slice = (group.y * ROW + group.x) * words_per_group + lane;
    let place = cast_state.first + slice * ray_pass.words_per_slice + in_slice;
    if lane < words_per_group && in_slice < ray_pass.words_per_slice && place < cast_state.end {
        let word = list.items[place % arrayLength(&list.items)];
        let pending = mask_at(PENDING, word);
        words[lane] = word;
        masks[lane] = voxel_masks[pending];
        voxel_masks[pending] = 0u;
#ifdef PROGRESSIVE
        masks[lane] = take_up(lane, word, masks[lane]);
#endif
    }
    workgroupBarrier();
    // Lists the voxels of all words one behind the other.
    var before = 0u;
    for (var k = 0u; k < words_per_group; k += 1u) {
        let mask = masks[k];
        let bit = lane & 31u;
        if lane >> 5u == (k & 1u) && extractBits(mask, bit, 1u) != 0u {
            voxels[before + countOneBits(extractBits(mask, 0u, bit))] = (k << 5u) | bit;
        }
        before += countOneBits(mask);
    }
    let count = before;
    workgroupBarrier();
    for (var first = 0u; first < count; first += WIDTH) {
        let at_once = min(count - first, WIDTH);
        // An invocation keeps to one voxel and shares its rays with `team` - 1 others.
        let team = WIDTH / at_once;
        if lane < team * at_once {
            let place = first + lane % at_once;
            let middle = vec3<f32>(voxel_of(voxels[place])) + 0.5 * f32(volume.occlusion_stride);
            let center = middle / vec3<f32>(volume.dimensions);
            var sum = 0u;
            let first_ray = ray_pass.first_ray + lane / at_once;
#ifdef PROGRESSIVE
            let end_ray = ray_pass.first_ray + rays_now[voxels[place] >> 5u];
#else
            let end_ray = ray_pass.end_ray;
#endif
            for (var ray = first_ray; ray < end_ray; ray += team) {
                let at = place_of_ray(ray);
                let start = rays[at];
                let factor = start.w * cast_ray(center + start.xyz, rays[at + 1u].xyz, rays[at + 2u].xyz);
                sum += u32(factor / FACTOR_UNIT + 0.5);
            }
            atomicAdd(&sums[place], sum);
        }
    }
    workgroupBarrier();
    for (var place = lane; place < count; place += WIDTH) {
        let voxel = voxel_of(voxels[place]);
#ifdef PROGRESSIVE
        let k = voxels[place] >> 5u;
        let index = voxel_index(voxel);
        var mean = running_means[index];
        // The first rays after a touch.
        if progress_now[k].rays == rays_now[k] {
            let was_going = extractBits(progress_before[k].going, voxels[place] & 31u, 1u) != 0u;
            mean = begun_anew(mean, progress_before[k], was_going, noise_of(index ^ (ray_pass.first_ray << 20u)));
        }
        let sum = min((mean >> 8u) + atomicLoad(&sums[place]), MOST);
        mean = (sum << 8u) | (mean & 0xffu);
        running_means[index] = mean;
        let ambient = factor_of(mean, progress_now[k]);
#else
        let ambient = f32(atomicLoad(&sums[place])) * FACTOR_UNIT;
#endif
        textureStore(occlusion, voxel / volume.occlusion_stride, vec4(ambient, 0.0, 0.0, 0.0));
    }
#ifdef COUNT_WORK
    if lane == 0u {
        count_work(0u, count);
        count_work(1u, atomicLoad(&samples_taken));
        count_work(2u, atomicLoad(&distances_read));
    }
#endif
}
