// Share of the voxels in the box around a voxel that are not denser than it, O(x) = P(v <= v_x). The filters' results
// give an estimate (Ruiz et al., sections 3.1 to 3.3). Also the share of a voxel's opacity that is drawn, where this
// share depends on the variance (section 4.2).

#import bevy_contextual_ao::{
    bricks::{WIDTH, invocation_index},
    voxel_density::density_of,
    voxel_lines::{ESTIMATE_CHEBYSHEV, ESTIMATE_CHEBYSHEV_OPEN, ESTIMATE_POWER, filtering, number_of_voxels, voxel_at},
}

// Mean density, extrema and mean square, as `means` and `extrema` leave them. A quantity that the estimate does not
// need is any buffer.
@group(1) @binding(3) var<storage, read> means: array<u32>;
@group(1) @binding(4) var<storage, read> extrema: array<u32>;
@group(1) @binding(5) var<storage, read> squares: array<u32>;
#ifdef SHARES
// Input of the pass that finds the shares' gradient.
@group(1) @binding(6) var<storage, read_write> shares: array<f32>;
#else
#ifdef MODULATED
@group(1) @binding(6) var occlusion: texture_storage_3d<rgba8unorm, write>;
#else
#ifdef STORE_R8
@group(1) @binding(6) var occlusion: texture_storage_3d<r8unorm, write>;
#else
@group(1) @binding(6) var occlusion: texture_storage_3d<rgba8unorm, write>;
#endif
#endif
#endif

// Error of the variance, in squares of 16-bit steps. Mean squares are known to 1.5 and squares of means to 3, by
// three roundings each. A smaller variance counts as this one, a deviation of 2.1 steps.
const LEAST_VARIANCE: f32 = 4.5;

// Mean square less square of the mean, in whole numbers because they can be nearly the same.
fn variance_at(index: u32) -> f32 {
    let high = means[index] >> 16u;
    let low = means[index] & 0xffffu;
    let product = high * low;
    // The square is high^2 + product / 2^15 + low^2 / 2^32.
    let whole = bitcast<i32>(squares[index] - high * high - (product >> 15u));
    let fraction = f32(product & 0x7fffu) / 32768.0 + f32(low * low) / 4294967296.0;
    return max(f32(whole) - fraction, 0.0);
}

// Number of 16-bit steps by which a density exceeds a mean.
fn above_mean(density: u32, mean: u32) -> f32 {
    let scaled = density << 16u;
    return select(-f32(mean - scaled), f32(scaled - mean), scaled >= mean) / 65536.0;
}

// Penner and Mitchell 2008: Chebyshev's one-tailed inequality bounds the share of voxels that are as dense or denser.
// At least the rest is less dense. Below the mean the inequality says nothing. Without light there, pictures are dark, as
// those of Ruiz et al. Their section 4.1 calls such voxels not occluded.
fn chebyshev(above: f32, variance: f32, below_mean: f32) -> f32 {
    let squared = above * above;
    return select(below_mean, squared / (variance + squared), above > 0.0);
}

// Approximation of Winitzki 2008.
fn erf(x: f32) -> f32 {
    let a = 0.140012;
    let squared = x * x;
    let exponent = -squared * (4.0 / 3.14159265 + a * squared) / (1.0 + a * squared);
    return sign(x) * sqrt(1.0 - exp(exponent));
}

// Equation 4. Where all densities are the same, the share is a half, the limit for a vanishing share of others.
fn gaussian(above: f32, variance: f32) -> f32 {
    return 0.5 + 0.5 * erf(above / sqrt(2.0 * variance));
}

// Section 3.2: a distribution t^beta. The share is 1 at the highest density, also where all are the same, and 0 at
// the lowest.
fn power(density: u32, mean: u32, word: u32) -> f32 {
    let lowest = 0xffffu - (word >> 16u);
    let highest = word & 0xffffu;
    if density >= highest {
        return 1.0;
    }
    let below_highest = (highest << 16u) - mean;
    // If `below_highest` is 0, too few voxels are below the highest density to change the mean.
    if density <= lowest || below_highest == 0u {
        return 0.0;
    }
    let beta = f32(mean - (lowest << 16u)) / f32(below_highest);
    return pow(f32(density - lowest) / f32(highest - lowest), beta);
}

@compute @workgroup_size(WIDTH)
fn estimate(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let index = invocation_index(id, groups);
    if index >= number_of_voxels() {
        return;
    }
    let voxel = voxel_at(index);
    let density = density_of(voxel);
    var share = 0.0;
    if filtering.estimate == ESTIMATE_POWER {
        share = power(density, means[index], extrema[index]);
    } else {
        let above = above_mean(density, means[index]);
        let variance = max(variance_at(index), LEAST_VARIANCE);
        if filtering.estimate == ESTIMATE_CHEBYSHEV {
            share = chebyshev(above, variance, 0.0);
        } else if filtering.estimate == ESTIMATE_CHEBYSHEV_OPEN {
            share = chebyshev(above, variance, 1.0);
        } else {
            share = gaussian(above, variance);
        }
    }
#ifdef SHARES
    shares[index] = share;
#else
    let factor = saturate(filtering.brightness * share);
    var drawn = 1.0;
#ifdef MODULATED
    let variance = variance_at(index) / (65535.0 * 65535.0);
    if variance < filtering.threshold {
        drawn = variance / filtering.threshold;
    }
#endif
    textureStore(occlusion, voxel, vec4(factor, drawn, 0.0, 0.0));
#endif
}
