// Step II of the CAO paper (section 3.4): pairs the surfaces that the clip camera sees into layers. A layer is a pair
// of depths between which a point is inside the clip mesh.
//
// A mesh with fewer than four surfaces along every line of sight is the paper's case: one layer, from the nearest to
// the farthest surface. Any other mesh is peeled, surface by surface. Where front and back faces along a line balance,
// a point with a winding number other than 0 is inside. Shells of one mesh may thus overlap or touch. Where faces do
// not balance (flipped or missing faces), surfaces lead in and out in turn.

struct LayerRange {
    first: u32,
    count: u32,
    // 1: the mesh has more layers than `count`, and the last layer reaches to the mesh's farthest surface.
    is_cut_off: u32,
}

@group(0) @binding(0) var<uniform> layers: LayerRange;
@group(0) @binding(1) var depth_maps: texture_storage_2d_array<rg32float, write>;
@group(0) @binding(2) var surface: texture_depth_2d;
@group(0) @binding(3) var other_surface: texture_depth_2d;

fn is_outside(texel: vec2<u32>) -> bool {
    return any(texel >= textureDimensions(depth_maps));
}

fn store(texel: vec2<u32>, layer: u32, near: f32, far: f32) {
    textureStore(depth_maps, texel, layers.first + layer, vec4(near, far, 0.0, 0.0));
}

#ifdef SEVERAL_LAYERS
// Front faces minus back faces along the line of sight: of all surfaces, and up to `surface`.
@group(1) @binding(0) var counts: texture_2d<f32>;
@group(1) @binding(1) var passed: texture_2d<f32>;

struct Progress {
    // Depth at which the layer being filled begins; 0 between layers.
    near: f32,
    layer: u32,
}
@group(1) @binding(2) var<storage, read_write> progress: array<Progress>;

fn progress_index(texel: vec2<u32>) -> u32 {
    return texel.y * textureDimensions(depth_maps).x + texel.x;
}

// Adds one more surface to the layers.
@compute @workgroup_size(8, 8)
fn append(@builtin(global_invocation_id) id: vec3<u32>) {
    if is_outside(id.xy) {
        return;
    }
    let depth = textureLoad(surface, id.xy, 0);
    let index = progress_index(id.xy);
    var current = progress[index];
    if depth >= 1.0 || current.layer >= layers.count {
        return;
    }
    let was_inside = current.near > 0.0;
    let is_balanced = textureLoad(counts, id.xy, 0).r == 0.0;
    let is_inside = select(!was_inside, textureLoad(passed, id.xy, 0).r != 0.0, is_balanced);
    let reaches_far = layers.is_cut_off != 0u && current.layer + 1u == layers.count;
    if is_inside && !was_inside {
        current.near = depth;
    } else if was_inside && !is_inside && !reaches_far {
        store(id.xy, current.layer, current.near, depth);
        current = Progress(0.0, current.layer + 1u);
    }
    progress[index] = current;
}

// Ends the last layer at the farthest surface.
@compute @workgroup_size(8, 8)
fn finish(@builtin(global_invocation_id) id: vec3<u32>) {
    if is_outside(id.xy) {
        return;
    }
    let current = progress[progress_index(id.xy)];
    let far = textureLoad(surface, id.xy, 0);
    var layer = current.layer;
    if layer < layers.count && current.near > 0.0 && far > current.near {
        store(id.xy, layer, current.near, far);
        layer += 1u;
    }
    for (; layer < layers.count; layer += 1u) {
        store(id.xy, layer, 1.0, 0.0);
    }
}
#else
// One layer from the nearest to the farthest surface.
@compute @workgroup_size(8, 8)
fn pair(@builtin(global_invocation_id) id: vec3<u32>) {
    if !is_outside(id.xy) {
        store(id.xy, 0u, textureLoad(surface, id.xy, 0), textureLoad(other_surface, id.xy, 0));
    }
}
#endif
