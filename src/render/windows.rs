//! Windows of views onto volumes, found once a frame.

use bevy::{
    camera::visibility::RenderLayers,
    diagnostic::FrameCount,
    ecs::{query::QueryData, system::SystemParam},
    math::Vec4Swizzles,
    pbr::ShadowView,
    platform::collections::HashMap,
    prelude::*,
    render::{
        camera::{ExtractedCamera, TemporalJitter},
        render_resource::ShaderType,
        sync_world::MainEntity,
        view::{ExtractedView, RenderVisibleEntities},
    },
};

use super::extract::{ExtractedScene, ExtractedVolume};
use crate::volume::DrawnBox;

/// Window of a view onto a volume, `Window` in WGSL (`window.wgsl`).
#[derive(Clone, Copy, Debug, Default, PartialEq, ShaderType)]
pub(crate) struct WindowUniform {
    pub view_from_clip: Mat4,
    pub world_from_view: Mat4,
    /// Origin and size, pixels.
    pub viewport: Vec4,
    /// First and end of the pixels in which the volume may be seen.
    pub first: UVec2,
    pub end: UVec2,
}

/// Entity of a view in the render world, and of a volume in the main world.
pub(crate) type VolumeInView = (Entity, MainEntity);

/// Windows onto every volume. A volume that no view shows has none.
#[derive(Resource, Default)]
pub(crate) struct VolumeWindows(HashMap<MainEntity, WindowsOnto>);

/// Windows onto a volume: those of cameras, and those of shadow maps that it is drawn into.
#[derive(Default)]
struct WindowsOnto {
    cameras: Vec<VolumeWindow>,
    lights: Vec<VolumeWindow>,
}

impl VolumeWindows {
    /// Windows of cameras onto a volume, given by its entity in the main world.
    pub fn onto(&self, volume: MainEntity) -> &[VolumeWindow] {
        self.0.get(&volume).map_or(&[], |onto| &onto.cameras)
    }

    /// Windows of lights onto a volume that casts shadows: one for each shadow map.
    pub fn of_lights(&self, volume: MainEntity) -> &[VolumeWindow] {
        self.0.get(&volume).map_or(&[], |onto| &onto.lights)
    }

    /// Whether any view shows a volume, or its shadow. Nothing is computed for another volume.
    pub fn show(&self, volume: &ExtractedVolume) -> bool {
        !self.onto(volume.entity).is_empty() || !self.of_lights(volume.entity).is_empty()
    }
}

/// A view of the scene.
#[derive(QueryData)]
pub(crate) struct View {
    entity: Entity,
    view: &'static ExtractedView,
    jitter: Option<&'static TemporalJitter>,
    msaa: &'static Msaa,
    visible: &'static RenderVisibleEntities,
}

/// All views that draw volumes.
#[derive(SystemParam)]
pub(crate) struct Views<'w, 's> {
    cameras: Query<'w, 's, View, With<ExtractedCamera>>,
    lights: Query<'w, 's, (Entity, &'static ExtractedView, Option<&'static RenderLayers>), With<ShadowView>>,
    frame: Res<'w, FrameCount>,
}

/// Window of a view onto one volume.
pub(crate) struct VolumeWindow {
    /// The entity of the view.
    pub view: Entity,
    pub uniform: WindowUniform,
    /// Transform from volume space (mm) to clip space.
    pub clip_from_local: Mat4,
    /// The same without the projection's jitter.
    pub unjittered: Mat4,
    /// Whether the view shows the voxels mirrored, so that the faces of their box have the other winding.
    pub is_mirrored: bool,
    /// Number of rays of each pixel at an outline; 0 if all pixels have one.
    pub outline_rays: u32,
    /// Shift of the noise in this frame. Views whose projection is jittered, for an average over frames, have another one
    /// in each.
    pub noise_shift: f32,
}

impl VolumeWindow {
    /// Whether pixels at outlines have several rays.
    pub fn smooths_outlines(&self) -> bool {
        self.outline_rays > 0
    }

    /// Part of the window in which some boxes may be seen, each given by its corners in volume space (mm).
    /// `None` if no box may be seen.
    pub fn around(&self, boxes: &[[Vec3; 8]]) -> Option<WindowUniform> {
        let WindowUniform { viewport, first, end, .. } = self.uniform;
        let parts = boxes.iter().map(|corners| pixels_of_box(self.clip_from_local, *corners, viewport));
        let (lower, upper) = parts
            .filter(|(first, end)| first.cmplt(*end).all())
            .reduce(|(a, b), (c, d)| (a.min(c), b.max(d)))?;
        let (first, end) = (first.max(lower), end.min(upper));
        first.cmplt(end).all().then_some(WindowUniform { first, end, ..self.uniform })
    }
}

/// Finds the windows onto every volume.
pub(crate) fn find_windows(scene: Res<ExtractedScene>, views: Views, mut windows: ResMut<VolumeWindows>) {
    // Lists keep their room from frame to frame.
    windows.0.retain(|entity, _| scene.volumes.iter().any(|volume| volume.entity == *entity));
    for volume in &scene.volumes {
        let onto = windows.0.entry(volume.entity).or_default();
        onto.cameras.clear();
        onto.lights.clear();
        if volume.is_placed {
            onto.cameras.extend(views.of(volume));
            onto.lights.extend(views.of_lights(volume));
        }
    }
}

impl Views<'_, '_> {
    /// Windows onto a volume, in the views that show it.
    fn of(&self, volume: &ExtractedVolume) -> impl Iterator<Item = VolumeWindow> {
        self.cameras
            .iter()
            .filter(|view| volume.drawn_on.is_some_and(|drawn_on| shows(view.visible, drawn_on)))
            .filter_map(|view| window(&view, volume, self.frame.0))
    }

    /// Windows of the shadow maps that a volume is drawn into.
    fn of_lights(&self, volume: &ExtractedVolume) -> impl Iterator<Item = VolumeWindow> {
        let lights = self.lights.iter().filter(|_| volume.casts_shadows);
        lights
            .filter(|(.., layers)| layers.is_none_or(|layers| layers.intersects(&volume.layers)))
            .filter_map(|(light, view, _)| window_of_light(light, view, volume))
    }
}

/// Whether a view shows the box of a volume.
pub(crate) fn shows(visible: &RenderVisibleEntities, drawn_box: MainEntity) -> bool {
    visible.get::<DrawnBox>().is_some_and(|boxes| boxes.iter_visible().any(|(_, other)| *other == drawn_box))
}

/// Window of a view around a volume's box. `None` if the box is out of view.
fn window(
    ViewItem { entity, view, jitter, msaa, .. }: &ViewItem,
    volume: &ExtractedVolume,
    frame: u32,
) -> Option<VolumeWindow> {
    let viewport = view.viewport.as_vec4();
    let mut clip_from_view = view.clip_from_view;
    if let Some(jitter) = jitter {
        jitter.jitter_projection(&mut clip_from_view, viewport.zw());
    }
    let world_from_view = view.world_from_view.to_matrix();
    let view_from_local = world_from_view.inverse() * Mat4::from(volume.world_from_local);
    let clip_from_local = clip_from_view * view_from_local;
    let (first, end) =
        pixels_of_box(clip_from_local, volume.geometry.corners().map(|c| c.as_vec3()), viewport);
    let uniform =
        WindowUniform { view_from_clip: clip_from_view.inverse(), world_from_view, viewport, first, end };
    first.cmplt(end).all().then_some(VolumeWindow {
        view: *entity,
        uniform,
        clip_from_local,
        unjittered: view.clip_from_view * view_from_local,
        is_mirrored: is_mirrored(view, volume),
        noise_shift: jitter.map_or(0.0, |_| noise_shift(frame)),
        outline_rays: if msaa.samples() > 1 { volume.outline_rays() } else { 0 },
    })
}

/// Window of a shadow map around a volume's box. `None` if the box is out of view.
fn window_of_light(light: Entity, view: &ExtractedView, volume: &ExtractedVolume) -> Option<VolumeWindow> {
    let viewport = view.viewport.as_vec4();
    let corners = volume.geometry.corners().map(|corner| corner.as_vec3());
    let view_from_clip = view.clip_from_view.inverse();
    let mut world_from_view = view.world_from_view.to_matrix();
    let view_from_local = world_from_view.inverse() * Mat4::from(volume.world_from_local);
    let clip_from_local = view.clip_from_view * view_from_local;
    let is_parallel = view.clip_from_view.w_axis.w == 1.0;
    let mut flat_from_local = clip_from_local;
    if is_parallel {
        // What is in front of the near plane casts a shadow, too: rays begin in front of the volume.
        let near = view_from_clip.project_point3(Vec3::Z).z;
        let nearest =
            corners.map(|corner| view_from_local.transform_point3(corner).z).into_iter().fold(near, f32::max);
        world_from_view *= Mat4::from_translation((nearest - near) * Vec3::Z);
        flat_from_local = Mat4::from_scale(Vec3::new(1.0, 1.0, 0.0)) * clip_from_local;
    }
    let (first, end) = pixels_of_box(flat_from_local, corners, viewport);
    first.cmplt(end).all().then_some(VolumeWindow {
        view: light,
        uniform: WindowUniform { view_from_clip, world_from_view, viewport, first, end },
        clip_from_local,
        unjittered: clip_from_local,
        is_mirrored: is_mirrored(view, volume),
        outline_rays: 0,
        noise_shift: 0.0,
    })
}

/// Whether a view shows a volume's voxels mirrored.
fn is_mirrored(view: &ExtractedView, volume: &ExtractedVolume) -> bool {
    view.invert_culling
        ^ (volume.world_from_local.matrix3.determinant() < 0.0)
        ^ (volume.geometry.local_from_voxel.matrix3.determinant() < 0.0)
}

/// Shift of the noise in a frame, [0, 1): steps of the golden ratio, so that any number of frames fill the range evenly.
fn noise_shift(frame: u32) -> f32 {
    (f64::from(frame) * (0.5 * (5f64.sqrt() - 1.0))).fract() as f32
}

/// First and end pixel of a box's image, in a viewport given by origin and size.
fn pixels_of_box(clip_from_local: Mat4, corners: [Vec3; 8], viewport: Vec4) -> (UVec2, UVec2) {
    let (origin, size) = (viewport.xy(), viewport.zw());
    let mut lower = Vec2::MAX;
    let mut upper = Vec2::MIN;
    for corner in corners {
        let clip = clip_from_local * corner.extend(1.0);
        if clip.w <= 0.0 || clip.z > clip.w {
            // The corner is in front of the near plane. The box's image may be anywhere.
            (lower, upper) = (Vec2::ZERO, size);
            break;
        }
        let place = (clip.xy() / clip.w * Vec2::new(0.5, -0.5) + 0.5) * size;
        lower = lower.min(place);
        upper = upper.max(place);
    }
    // One more pixel on every side allows for rounding.
    let first = (origin + (lower - 1.0).floor().clamp(Vec2::ZERO, size)).as_uvec2();
    let end = (origin + (upper + 1.0).ceil().clamp(Vec2::ZERO, size)).as_uvec2();
    (first, end)
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: [Vec3; 8] = [
        Vec3::new(-1.0, -1.0, -1.0),
        Vec3::new(1.0, -1.0, -1.0),
        Vec3::new(-1.0, 1.0, -1.0),
        Vec3::new(1.0, 1.0, -1.0),
        Vec3::new(-1.0, -1.0, 1.0),
        Vec3::new(1.0, -1.0, 1.0),
        Vec3::new(-1.0, 1.0, 1.0),
        Vec3::new(1.0, 1.0, 1.0),
    ];

    #[test]
    fn a_box_far_away_fills_few_pixels_and_one_around_the_camera_all() {
        let projection = Mat4::perspective_infinite_reverse_rh(1.0, 1.0, 0.1);
        let viewport = Vec4::new(10.0, 20.0, 200.0, 200.0);
        let far = projection * Mat4::from_translation(Vec3::new(0.0, 0.0, -50.0));
        let (first, end) = pixels_of_box(far, UNIT, viewport);
        assert!(first.x > 100 && end.x < 120 && first.y > 110 && end.y < 130, "{first} {end}");
        let around = pixels_of_box(projection, UNIT, viewport);
        assert_eq!(around, (UVec2::new(10, 20), UVec2::new(210, 220)));
        let window = VolumeWindow {
            view: Entity::PLACEHOLDER,
            uniform: WindowUniform { viewport, first, end, ..default() },
            clip_from_local: far,
            unjittered: far,
            is_mirrored: false,
            outline_rays: 0,
            noise_shift: 0.0,
        };
        let half = |side: f32| UNIT.map(|corner| Vec3::new(side.max(side * corner.x), corner.y, corner.z));
        let right = window.around(&[half(1.0)]).expect("half of the box is seen");
        assert!(right.first.x > first.x && right.end == end, "{right:?} of {first} {end}");
        assert_eq!(window.around(&[half(1.0), UNIT]).map(|both| (both.first, both.end)), Some((first, end)));
        assert_eq!(window.around(&[UNIT.map(|corner| corner + 20.0 * Vec3::X)]), None);
        let aside = projection * Mat4::from_translation(Vec3::new(500.0, 0.0, -50.0));
        let (first, end) = pixels_of_box(aside, UNIT, viewport);
        assert!(first.x >= end.x, "out of view: {first} {end}");
    }
}
