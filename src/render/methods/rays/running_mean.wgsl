// Running mean of progressive rays (Hernell et al. cast a ray a frame; CAO paper, section 2). Rays cycle through the
// pattern. Where a change touched a voxel, its factor becomes the earlier one, and the rays from then on replace it by
// their weights:
//
//     factor = (S + q (1 - p) E) / (p + q (1 - p))
//
// S is the sum of the rays' weighted factors, p the sum of their weights, of 1 for the pattern. E is the earlier factor,
// and q its weight. Once all rays have been cast, p is 1, and the factor is S: that of all rays at once, to the bit.

#define_import_path bevy_contextual_ao::running_mean

#import bevy_contextual_ao::{cast_state::FACTOR_UNIT, volume_bindings::volume}

// Of every voxel: S in 24 bits, and E in 8 bits, where 0 is none. Behind the voxels, of every word of the mask a
// `WordProgress`.
@group(1) @binding(8) var<storage, read_write> running_means: array<u32>;

struct WordProgress {
    // Voxels whose rays go on, as a mask.
    going: u32,
    // Number of rays since the last touch, and p.
    rays: u32,
    weight: f32,
    // q, of patterns.
    earlier_weight: f32,
}

// The largest S, in `FACTOR_UNIT`.
const MOST: u32 = 0xffffffu;

fn progress_at(word: u32) -> u32 {
    return volume.dimensions.x * volume.dimensions.y * volume.dimensions.z + 4u * word;
}

fn progress_of(word: u32) -> WordProgress {
    let at = progress_at(word);
    return WordProgress(
        running_means[at],
        running_means[at + 1u],
        bitcast<f32>(running_means[at + 2u]),
        bitcast<f32>(running_means[at + 3u]),
    );
}

fn keep_progress(word: u32, progress: WordProgress) {
    let at = progress_at(word);
    running_means[at] = progress.going;
    running_means[at + 1u] = progress.rays;
    running_means[at + 2u] = bitcast<u32>(progress.weight);
    running_means[at + 3u] = bitcast<u32>(progress.earlier_weight);
}

// Progress of a word of which voxels were touched. What its factors weigh is at most `most_kept`.
fn touched(before: WordProgress, voxels: u32, most_kept: f32) -> WordProgress {
    let weight = before.weight + before.earlier_weight * (1.0 - before.weight);
    return WordProgress(before.going | voxels, 0u, 0.0, min(weight, most_kept));
}

// The factor of a voxel whose rays go on.
fn factor_of(mean: u32, progress: WordProgress) -> f32 {
    let sum = f32(mean >> 8u) * FACTOR_UNIT;
    let earlier = mean & 0xffu;
    let weight = select(0.0, progress.earlier_weight * (1.0 - progress.weight), earlier != 0u);
    // No rounding where the sum is all there is.
    if progress.weight >= 1.0 {
        return sum;
    }
    return (sum + weight * f32(earlier) / 255.0) / max(progress.weight + weight, FACTOR_UNIT);
}

// The voxel's mean after a touch: without rays, and with its factor as the earlier one. Rounding by noise is right on
// average, so that means do not get stuck.
fn begun_anew(mean: u32, before: WordProgress, was_going: bool, noise: f32) -> u32 {
    if mean == 0u {
        return 0u;
    }
    var factor = f32(mean >> 8u) * FACTOR_UNIT;
    if was_going {
        factor = factor_of(mean, before);
    }
    return clamp(u32(factor * 255.0 + noise), 1u, 255u);
}

// Even noise, 0 to 1 (O'Neill: PCG, 2014, as a hash).
fn noise_of(seed: u32) -> f32 {
    let state = seed * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return f32(((word >> 22u) ^ word) & 0xffffu) / 65536.0;
}
