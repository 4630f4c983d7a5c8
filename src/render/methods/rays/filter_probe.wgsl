// The largest error of the fractions by which the device interpolates texels, in units of 1/65536. Fractions have as few
// as 4 bits by Vulkan's rules. A half of the texture's own quantum counts with it.

@group(0) @binding(0) var two_texels: texture_3d<f32>;
@group(0) @binding(1) var edge_sampler: sampler;
// 1 and more once it is found.
@group(0) @binding(2) var<storage, read_write> error: atomic<u32>;

const WIDTH: u32 = 64u;
const FRACTIONS: u32 = 1024u;

@compute @workgroup_size(WIDTH)
fn probe(@builtin(local_invocation_index) lane: u32) {
    var largest = 0.0;
    for (var k = lane; k < FRACTIONS; k += WIDTH) {
        // Between the texels 0 and 1, the intensity is the fraction.
        let fraction = (f32(k) + 0.5) / f32(FRACTIONS);
        let found = textureSampleLevel(two_texels, edge_sampler, vec3(0.25 + 0.5 * fraction, 0.5, 0.5), 0.0).r;
        largest = max(largest, abs(found - fraction));
    }
    atomicMax(&error, 1u + u32(clamp(largest, 0.0, 1.0) * 65535.0));
}
