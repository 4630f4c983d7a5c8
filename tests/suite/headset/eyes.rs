//! What the eyes of a session see, read back, and the same seen by one camera after a full recomputation.

use bevy::{
    camera::ManualTextureViewHandle,
    prelude::*,
    render::{
        Render, RenderApp,
        render_resource::{
            Extent3d, Texture, TextureDescriptor, TextureDimension, TextureFormat, TextureUsages,
            TextureViewDescriptor, TextureViewDimension,
        },
        renderer::RenderDevice,
        texture::{ManualTextureView, ManualTextureViews},
        view::ExtractedView,
    },
};
use bevy_mod_openxr::render::{XR_TEXTURE_INDEX, insert_texture_views, update_views_render_world};
use bevy_mod_xr::{camera::XrCamera, session::XrRenderSystems};

/// Pose and projection by which an eye is drawn.
#[derive(Clone, Copy, Debug)]
pub struct DrawnEye {
    pub world_from_view: GlobalTransform,
    pub clip_from_view: Mat4,
}

/// Eyes of the latest frame, left and right.
#[derive(Resource, Default)]
pub struct DrawnEyes(pub [Option<DrawnEye>; 2]);

/// A texture that takes the place of the runtime's images, which cannot be read back. A layer for each eye.
#[derive(Resource, Default)]
pub struct ReadableEyes(pub Option<Texture>);

/// Notes what eyes are drawn by, and draws them into [`ReadableEyes`] where there is one.
pub fn watch(app: &mut App) {
    app.sub_app_mut(RenderApp).init_resource::<DrawnEyes>().init_resource::<ReadableEyes>().add_systems(
        Render,
        (redirect.after(insert_texture_views), note.after(update_views_render_world))
            .in_set(XrRenderSystems::PreRender),
    );
}

fn redirect(readable: Res<ReadableEyes>, mut views: ResMut<ManualTextureViews>) {
    let Some(texture) = &readable.0 else {
        return;
    };
    for layer in 0..2 {
        let view = texture.create_view(&TextureViewDescriptor {
            dimension: Some(TextureViewDimension::D2),
            base_array_layer: layer,
            array_layer_count: Some(1),
            ..default()
        });
        let size = UVec2::new(texture.width(), texture.height());
        let view = ManualTextureView::with_default_format(view, size);
        views.insert(ManualTextureViewHandle(XR_TEXTURE_INDEX + layer), view);
    }
}

fn note(mut drawn: ResMut<DrawnEyes>, views: Query<(&ExtractedView, &XrCamera)>) {
    drawn.0 = [None; 2];
    for (view, eye) in &views {
        let ExtractedView { world_from_view, clip_from_view, .. } = *view;
        drawn.0[eye.0 as usize] = Some(DrawnEye { world_from_view, clip_from_view });
    }
}

/// A texture with two layers that can be read back.
pub fn readable_texture(device: &RenderDevice, size: UVec2) -> Texture {
    device.create_texture(&TextureDescriptor {
        label: Some("eyes"),
        size: Extent3d { width: size.x, height: size.y, depth_or_array_layers: 2 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format: TextureFormat::Rgba8UnormSrgb,
        usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}
