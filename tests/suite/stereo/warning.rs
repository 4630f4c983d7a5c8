//! A volume whose occlusion differs between two eyes says so, once.

use bevy::{
    camera::{ManualTextureViewHandle, RenderTarget, Viewport, visibility::RenderLayers},
    prelude::*,
};
use bevy_contextual_ao::{occlusion::OcclusionDiffersBetweenEyes, prelude::*};

use super::rig::{TwoEyes, eyes_of, head_from};
use crate::scene::{IMAGE, methods_of_few_rays};

/// Warnings so far.
#[derive(Resource, Default)]
struct Warnings(Vec<OcclusionDiffersBetweenEyes>);

fn eyes() -> TwoEyes {
    let mut two = TwoEyes::new();
    two.scene.headless.app.init_resource::<Warnings>().add_observer(
        |differs: On<OcclusionDiffersBetweenEyes>, mut warnings: ResMut<Warnings>| {
            warnings.0.push(*differs);
        },
    );
    let eyes = eyes_of(head_from(Vec3::new(0.2, 0.4, 1.0)));
    two.pose(eyes, eyes);
    two.settle();
    two
}

fn set_method(two: &mut TwoEyes, method: impl Into<OcclusionMethod>) {
    let volume = two.scene.volume;
    two.scene.world().entity_mut(volume).insert(AmbientOcclusion::by(method));
}

/// Warnings since the last call, after some frames.
fn warnings(two: &mut TwoEyes) -> Vec<OcclusionDiffersBetweenEyes> {
    two.scene.headless.frames(2);
    core::mem::take(&mut two.scene.world().resource_mut::<Warnings>().0)
}

#[test]
fn methods_of_views_are_warned_of_once() {
    let mut two = eyes();
    for method in methods_of_few_rays().filter(|method| method.kind().is_of_voxels()) {
        set_method(&mut two, method.clone());
        assert_eq!(warnings(&mut two), [], "{}", method.name());
    }
    set_method(&mut two, ScreenSpaceOcclusion::default());
    let entity = two.scene.volume;
    let method = OcclusionMethod::from(ScreenSpaceOcclusion::default()).name();
    assert_eq!(warnings(&mut two), [OcclusionDiffersBetweenEyes { entity, method }]);
    // All further frames are silent, and so is the other such method.
    assert_eq!(warnings(&mut two), []);
    set_method(&mut two, DirectionalOcclusion::default());
    assert_eq!(warnings(&mut two), []);
}

#[test]
fn cameras_that_are_not_two_eyes_are_not_warned_of() {
    let mut two = eyes();
    let [left, right] = two.cameras;
    let volume = two.scene.volume;
    // Occlusion is not shown.
    two.scene.world().get_mut::<VolumeShading>(volume).expect("shading").ambient_occlusion = false;
    set_method(&mut two, DirectionalOcclusion::default());
    assert_eq!(warnings(&mut two), [], "without occlusion");
    // One eye sees the volume.
    two.scene.world().entity_mut(right).insert(RenderLayers::layer(3));
    two.scene.world().get_mut::<VolumeShading>(volume).expect("shading").ambient_occlusion = true;
    assert_eq!(warnings(&mut two), [], "one eye sees it");
    // One eye is closed.
    two.scene.world().entity_mut(right).remove::<RenderLayers>();
    two.scene.world().get_mut::<Camera>(right).expect("a camera").is_active = false;
    assert_eq!(warnings(&mut two), [], "one eye is closed");
    // Halves of one layer, and of one image.
    let half = UVec2::new(IMAGE.x / 2, IMAGE.y);
    let image = two.scene.headless.camera();
    let other = two.scene.world().spawn(image).id();
    let image = two.scene.world().get::<RenderTarget>(other).expect("a target").clone();
    two.scene.world().despawn(other);
    for target in [RenderTarget::TextureView(ManualTextureViewHandle(0)), image] {
        for (place, camera) in [left, right].into_iter().enumerate() {
            let physical_position = UVec2::new(place as u32 * half.x, 0);
            let viewport = Viewport { physical_position, physical_size: half, ..default() };
            let camera_of = Camera { viewport: Some(viewport), order: place as isize, ..default() };
            two.scene.world().entity_mut(camera).insert((camera_of, target.clone()));
        }
        assert_eq!(warnings(&mut two), [], "split screen");
    }
    // The same volume is warned of as soon as both eyes see it.
    for (place, camera) in [left, right].into_iter().enumerate() {
        let target = RenderTarget::TextureView(ManualTextureViewHandle(place as u32));
        let camera_of = Camera { order: place as isize, ..default() };
        two.scene.world().entity_mut(camera).insert((camera_of, target));
    }
    assert_eq!(warnings(&mut two).len(), 1);
}
