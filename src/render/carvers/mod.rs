//! Steps II and III of the CAO paper: depth maps of carvers, in as many layers as their meshes have, and their
//! dilation.

pub(super) mod clip_draw;
pub(super) mod clip_keys;
pub(super) mod clip_maps;
pub(super) mod clip_textures;
pub(super) mod count_surfaces;
pub(super) mod dilate;
pub(super) mod passes;
pub(super) mod peel;
pub(super) mod plan;
pub(super) mod surface_count;

use bevy::{asset::embedded_asset, prelude::*};

/// Adds the shaders.
pub(super) fn add_shaders(app: &mut App) {
    embedded_asset!(app, "clip_draw.wgsl");
    embedded_asset!(app, "count_surfaces.wgsl");
    embedded_asset!(app, "peel.wgsl");
    embedded_asset!(app, "dilate.wgsl");
}
