//! What XR crates draw eyes with: layers of one texture, and poses that change in the render world.

use bevy::{
    camera::ManualTextureViewHandle,
    prelude::*,
    render::{
        Render, RenderApp, RenderSystems,
        render_resource::{
            Extent3d, Texture, TextureDescriptor, TextureDimension, TextureFormat, TextureUsages,
            TextureViewDescriptor, TextureViewDimension,
        },
        renderer::RenderDevice,
        sync_world::MainEntity,
        texture::{ManualTextureView, ManualTextureViews},
        view::ExtractedView,
    },
};
use contextual_ao_kit::headless::Headless;

/// A texture with a layer for each eye, which can be read back.
pub fn eye_texture(device: &RenderDevice, size: UVec2) -> Texture {
    device.create_texture(&TextureDescriptor {
        label: Some("two eyes"),
        size: Extent3d { width: size.x, height: size.y, depth_or_array_layers: 2 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format: TextureFormat::Rgba8UnormSrgb,
        usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}

/// Adds a view of each layer, with successive handles.
pub fn insert_layers(texture: &Texture, first_handle: u32, views: &mut ManualTextureViews) {
    let size = UVec2::new(texture.width(), texture.height());
    for layer in 0..2 {
        let view = texture.create_view(&TextureViewDescriptor {
            dimension: Some(TextureViewDimension::D2),
            base_array_layer: layer,
            array_layer_count: Some(1),
            ..default()
        });
        let view = ManualTextureView::with_default_format(view, size);
        views.insert(ManualTextureViewHandle(first_handle + layer), view);
    }
}

/// Both layers of a texture.
pub fn read_layers(headless: &Headless, texture: &Texture) -> [Vec<u8>; 2] {
    let mut first = headless.bytes_of(texture);
    let second = first.split_off(first.len() / 2);
    [first, second]
}

/// Poses that cameras get in the render world.
#[derive(Resource, Default)]
struct LatePoses(Vec<(Entity, GlobalTransform)>);

/// Overwrites the poses of views, as bevy_mod_openxr does.
fn overwrite_poses(poses: Res<LatePoses>, mut views: Query<(&MainEntity, &mut ExtractedView)>) {
    for (entity, mut view) in &mut views {
        if let Some((_, pose)) = poses.0.iter().find(|(eye, _)| *eye == entity.id()) {
            view.world_from_view = *pose;
        }
    }
}

/// Lets [`set_late_poses`] have an effect.
pub fn take_late_poses(headless: &mut Headless) {
    headless.app.sub_app_mut(RenderApp).init_resource::<LatePoses>().add_systems(
        Render,
        // The set of bevy_mod_xr for late poses.
        overwrite_poses
            .after(RenderSystems::ExtractCommands)
            .before(RenderSystems::PrepareAssets)
            .before(RenderSystems::CreateViews),
    );
}

/// Sets the poses of cameras for the next frames.
pub fn set_late_poses(headless: &mut Headless, poses: Vec<(Entity, GlobalTransform)>) {
    headless.app.sub_app_mut(RenderApp).world_mut().insert_resource(LatePoses(poses));
}
