//! Sizes of the lists of pixels at outlines (`outlines.wgsl`), and of what their rays take.

use bevy::prelude::*;

use crate::render::{
    gpu::compute_pass::WIDTH,
    windows::{VolumeWindow, WindowUniform},
};

/// Words before the pixels in a list of outlines, `OUTLINE_HEAD` in WGSL.
pub(in crate::render) const OUTLINE_HEAD: u64 = 2;
/// Words of what the rays of a listed pixel see, `COLOR_WORDS` in WGSL.
pub(in crate::render) const COLOR_WORDS: u64 = 3;
/// Most workgroups in a row, `ROW` in WGSL.
pub(in crate::render) const ROW: u32 = 32_768;
/// One of this many pixels may be at an outline.
const OUTLINE_SHARE: u64 = 4;

/// Number of a window's pixels.
pub(super) fn pixels_of(window: &WindowUniform) -> u64 {
    (window.end - window.first).as_u64vec2().element_product()
}

/// Size of the largest window, pixels.
pub(super) fn largest_of(windows: impl Iterator<Item = WindowUniform>) -> UVec2 {
    windows.map(|window| window.end - window.first).fold(UVec2::ZERO, UVec2::max)
}

/// A window with a place for each ray of a view's outlines: as wide, and higher.
pub(super) fn rays_of_outlines(window: &VolumeWindow) -> WindowUniform {
    let WindowUniform { first, end, .. } = window.uniform;
    let rows = (window.outline_rays * (end.y - first.y)).div_ceil(OUTLINE_SHARE as u32);
    WindowUniform { end: UVec2::new(end.x, first.y + rows), ..window.uniform }
}

/// Most pixels in a window's list of outlines.
fn most_outlines(window: &VolumeWindow) -> u64 {
    pixels_of(&window.uniform) / OUTLINE_SHARE
}

/// Words of a window's list of outlines, of what is seen there, and of the places of its pixels in the list.
pub(super) fn outline_words(window: &VolumeWindow) -> u64 {
    OUTLINE_HEAD + (1 + COLOR_WORDS) * most_outlines(window) + pixels_of(&window.uniform)
}

/// Workgroups that shade a list of so many pixels at most, by so many rays each. A workgroup takes whole pixels.
pub(super) fn workgroups_of(most_pixels: u32, rays: u32) -> UVec2 {
    let workgroups = most_pixels.div_ceil((WIDTH / rays.max(1)).max(1));
    UVec2::new(workgroups.min(ROW), workgroups.div_ceil(ROW))
}

/// First word of each window's list of outlines, and most pixels in it.
pub(super) fn lists<'w>(windows: impl Iterator<Item = &'w VolumeWindow>) -> impl Iterator<Item = [u32; 2]> {
    let mut first = 0;
    windows.map(move |window| {
        let list = [first as u32, most_outlines(window) as u32];
        first += outline_words(window);
        list
    })
}
