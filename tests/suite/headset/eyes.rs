//! What the eyes of a session are drawn by, and a texture that their pictures can be read from.

use bevy::{
    prelude::*,
    render::{Render, RenderApp, render_resource::Texture, texture::ManualTextureViews, view::ExtractedView},
};
use bevy_mod_openxr::render::{XR_TEXTURE_INDEX, insert_texture_views, update_views_render_world};
use bevy_mod_xr::{camera::XrCamera, session::XrRenderSystems};

use crate::eye_layers::insert_layers;

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
    insert_layers(texture, XR_TEXTURE_INDEX, &mut views);
}

fn note(mut drawn: ResMut<DrawnEyes>, views: Query<(&ExtractedView, &XrCamera)>) {
    drawn.0 = [None; 2];
    for (view, eye) in &views {
        let ExtractedView { world_from_view, clip_from_view, .. } = *view;
        drawn.0[eye.0 as usize] = Some(DrawnEye { world_from_view, clip_from_view });
    }
}
