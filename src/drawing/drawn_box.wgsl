// The box of a volume in a view, drawn by its back faces: the camera may be inside.

#define_import_path bevy_contextual_ao::drawn_box

#import bevy_contextual_ao::{
    marched_view::{IS_MIRRORED, MarchedView, has_flag},
    volume_bindings::volume,
}

// A corner of the box in clip space, as one triangle strip around it.
fn corner_of_box(view: MarchedView, index: u32) -> vec4<f32> {
    let masks = vec3(0x287au, 0x02afu, 0x31e3u);
    var corner = vec3<f32>((masks >> vec3(index)) & vec3(1u));
    // The other way round, so that the faces still face outwards.
    corner.x = select(corner.x, 1.0 - corner.x, has_flag(view, IS_MIRRORED));
    let local = volume.local_from_voxel * vec4(corner * vec3<f32>(volume.dimensions) - 0.5, 1.0);
    return view.clip_from_local * local;
}
