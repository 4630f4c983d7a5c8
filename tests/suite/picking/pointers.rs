//! Pointers on volumes, from their input to the events.

use bevy::{
    camera::{RenderTarget, visibility::RenderLayers},
    math::DVec3,
    picking::pointer::{Location, PointerAction, PointerId, PointerInput},
    prelude::*,
    window::PrimaryWindow,
};
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::mode::ShadingMode;

use crate::scene::{IMAGE, TestScene, few_rays, opaque_ramp, volume_from};

/// Events at the volume, with their hits.
#[derive(Resource, Default)]
struct Seen(Vec<(&'static str, Option<VolumeHit>, Option<Vec3>)>);

fn note<E: core::fmt::Debug + Clone + Reflect>(
    name: &'static str,
    hit: impl Fn(&E) -> bevy::picking::backend::HitData,
) -> impl Fn(On<Pointer<E>>, ResMut<Seen>) {
    move |event, mut seen| {
        let hit = hit(&event.event().event);
        seen.0.push((name, hit.extra_as::<VolumeHit>().copied(), hit.position));
    }
}

/// A scene with a ball, and a window that pointers belong to.
pub struct Pointing {
    pub scene: TestScene,
    pub camera: Entity,
}

impl Pointing {
    pub fn new() -> Self {
        let ball = |p: DVec3| 0.5 - (p.length() - 0.6) / 0.4;
        let volume = volume_from(UVec3::splat(24), DVec3::ONE, ball);
        let mut scene = TestScene::new(volume, opaque_ramp(), few_rays(), ShadingMode::Solid);
        let (camera, entity) = (scene.camera(), scene.volume);
        let world = scene.world();
        // Bevy asks for a window before it asks where a pointer is.
        world.spawn((Window::default(), PrimaryWindow));
        world.init_resource::<Seen>();
        world
            .entity_mut(entity)
            .observe(note("over", |over: &Over| over.hit.clone()))
            .observe(note("out", |out: &Out| out.hit.clone()))
            .observe(note("click", |click: &Click| click.hit.clone()))
            .observe(note("drag", |drag: &DragStart| drag.hit.clone()));
        scene.settle();
        Self { scene, camera }
    }

    fn input(&mut self, position: Vec2, action: PointerAction) {
        let camera = self.camera;
        let world = self.scene.world();
        let target = world.get::<RenderTarget>(camera).and_then(|target| target.normalize(None));
        let location = Location { target: target.expect("an image"), position };
        world.write_message(PointerInput::new(PointerId::Mouse, location, action));
        self.scene.headless.frame();
    }

    fn point_at(&mut self, position: Vec2) {
        self.input(position, PointerAction::Move { delta: Vec2::ONE });
    }

    pub fn click(&mut self, position: Vec2) {
        self.point_at(position);
        self.input(position, PointerAction::Press(PointerButton::Primary));
        self.input(position, PointerAction::Release(PointerButton::Primary));
    }

    fn seen(&mut self) -> Vec<(&'static str, Option<VolumeHit>, Option<Vec3>)> {
        core::mem::take(&mut self.scene.world().resource_mut::<Seen>().0)
    }

    fn names(&mut self) -> Vec<&'static str> {
        self.seen().into_iter().map(|(name, ..)| name).collect()
    }
}

pub const MIDDLE: Vec2 = Vec2::new(48.0, 48.0);
const CORNER: Vec2 = Vec2::new(3.0, 3.0);

#[test]
fn pointers_hover_and_click_the_volume_where_it_is_seen() {
    let mut pointing = Pointing::new();
    pointing.point_at(CORNER);
    assert_eq!(pointing.names(), [""; 0]);
    // Inside of the volume's box, beside the ball.
    pointing.point_at(Vec2::new(48.0, 8.0));
    assert_eq!(pointing.names(), [""; 0]);
    pointing.click(MIDDLE);
    let seen = pointing.seen();
    let names: Vec<_> = seen.iter().map(|(name, ..)| *name).collect();
    assert_eq!(names, ["over", "click"]);
    let view = *pointing.scene.world().get::<Transform>(pointing.camera).expect("a place");
    // The ramp's opacity is high at half of the highest value, 0.6 of 12 mm from the middle.
    let expected = -view.forward().as_vec3() * 0.0072;
    for (name, hit, position) in seen {
        let hit = hit.unwrap_or_else(|| panic!("{name} tells no hit"));
        assert_eq!((hit.volume, Some(hit.position)), (pointing.scene.volume, position));
        assert!(hit.position.distance(expected) < 0.0008, "{name}: {}, expected {expected}", hit.position);
        assert!(hit.normal.dot(-*view.forward()) > 0.99, "{name}: {:?}", hit.normal);
    }
    pointing.input(MIDDLE, PointerAction::Press(PointerButton::Primary));
    pointing.point_at(MIDDLE + 9.0);
    assert_eq!(pointing.names(), ["drag"]);
    pointing.input(MIDDLE + 9.0, PointerAction::Release(PointerButton::Primary));
    pointing.seen();
    pointing.point_at(CORNER);
    assert_eq!(pointing.names(), ["out"]);
}

#[test]
fn settings_markers_layers_and_visibility_decide() {
    let mut pointing = Pointing::new();
    let volume = pointing.scene.volume;
    let hovers = |pointing: &mut Pointing| {
        pointing.point_at(CORNER);
        pointing.seen();
        pointing.point_at(MIDDLE);
        pointing.names() == ["over"]
    };
    assert!(hovers(&mut pointing));
    pointing.scene.world().entity_mut(volume).insert(Pickable::IGNORE);
    assert!(!hovers(&mut pointing));
    pointing.scene.world().entity_mut(volume).remove::<Pickable>().insert(Visibility::Hidden);
    pointing.scene.headless.frame();
    assert!(!hovers(&mut pointing));
    pointing.scene.world().entity_mut(volume).insert((Visibility::Inherited, RenderLayers::layer(2)));
    pointing.scene.headless.frame();
    assert!(!hovers(&mut pointing));
    let camera = pointing.camera;
    pointing.scene.world().entity_mut(camera).insert(RenderLayers::from_layers(&[0, 2]));
    assert!(hovers(&mut pointing));
    pointing.scene.world().resource_mut::<VolumePickingSettings>().require_markers = true;
    assert!(!hovers(&mut pointing));
    pointing.scene.world().entity_mut(camera).insert(VolumePickingCamera);
    assert!(!hovers(&mut pointing));
    pointing.scene.world().entity_mut(volume).insert(Pickable::default());
    assert!(hovers(&mut pointing));
    // A carver around everything.
    pointing.scene.carve(Sphere::new(90.0), ClipMesh::default(), Transform::IDENTITY);
    pointing.scene.settle();
    assert!(!hovers(&mut pointing));
    assert_eq!(IMAGE, UVec2::splat(96));
}
