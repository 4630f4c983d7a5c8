//! A carved volume before two eyes, or before one ordinary camera.

use bevy::{
    camera::{ManualTextureViewHandle, RenderTarget},
    core_pipeline::tonemapping::{DebandDither, Tonemapping},
    math::DVec3,
    prelude::*,
    render::{render_resource::Texture, renderer::RenderDevice, texture::ManualTextureViews},
};
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::mode::ShadingMode;

use crate::{
    eye_layers::{eye_texture, insert_layers, read_layers, set_late_poses, take_late_poses},
    scene::{IMAGE, TestScene, few_rays, folded_volume, opaque_ramp, translucent_ramp},
    views::OffAxis,
};

/// Distance between the eyes, m.
const APART: f32 = 0.063;
/// Factor on the volume's size: headsets show nothing nearer than 0.1 m.
const SCALE: f32 = 10.0;

/// How a volume is drawn, and by what kind of cameras.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    pub is_translucent: bool,
    pub mode: ShadingMode,
    pub has_scene_lights: bool,
    pub jitter: bool,
    pub msaa: Msaa,
    pub tonemapping: Tonemapping,
    pub deband: DebandDither,
}

/// Opaque, lit and occluded, with the noise that is on by default.
pub const OPAQUE: Look = Look {
    is_translucent: false,
    mode: ShadingMode::PhongCao,
    has_scene_lights: false,
    jitter: true,
    msaa: Msaa::Off,
    tonemapping: Tonemapping::None,
    deband: DebandDither::Disabled,
};

/// A volume that a block and a ball carve. The ball moves.
pub struct Carved {
    pub scene: TestScene,
    carver: Entity,
}

impl Carved {
    fn new() -> Self {
        let volume = folded_volume(UVec3::splat(24), DVec3::ONE);
        let mut scene = TestScene::with(volume, opaque_ramp(), few_rays(), ShadingMode::PhongCao, |app| {
            app.insert_resource(ClearColor(Color::linear_rgb(0.1, 0.2, 0.05)))
                .insert_resource(GlobalAmbientLight { brightness: 800.0, ..default() });
        });
        scene.place_volume(Transform::from_scale(Vec3::splat(SCALE)));
        scene.carve(
            Cuboid::new(90.0, 70.0, 300.0),
            ClipMesh::default(),
            Transform::from_xyz(-60.0, 70.0, 0.0),
        );
        let carver = scene.carve(Sphere::new(60.0), ClipMesh::default(), Transform::default());
        let sun = DirectionalLight { illuminance: 6_000.0, ..default() };
        let world = scene.world();
        world.spawn((sun, Transform::from_xyz(1.0, 2.0, 1.5).looking_at(Vec3::ZERO, Vec3::Y)));
        let lamp = PointLight { intensity: 40_000.0, range: 5.0, ..default() };
        world.spawn((lamp, Transform::from_xyz(-0.3, 0.3, 0.4)));
        let mut carved = Self { scene, carver };
        carved.carve(0);
        carved
    }

    /// Puts the ball where it is in a frame: on its way around the volume.
    pub fn carve(&mut self, frame: u32) {
        let angle = 0.11 * frame as f32;
        let place = Vec3::new(100.0 * angle.sin(), 30.0, 100.0 * angle.cos());
        self.scene.move_carver(self.carver, Transform::from_translation(place));
    }

    /// Shows the volume by a look, in all cameras.
    pub fn set_look(&mut self, look: Look) {
        let volume = self.scene.volume;
        self.scene.set_mode(look.mode);
        let world = self.scene.world();
        let function = if look.is_translucent { translucent_ramp() } else { opaque_ramp() };
        let function = world.resource_mut::<Assets<TransferFunction>>().add(function);
        world.entity_mut(volume).insert(VolumeTransferFunction(function));
        let mut shading = world.get_mut::<VolumeShading>(volume).expect("shading");
        shading.jitter = look.jitter;
        if look.has_scene_lights {
            shading.lighting = VolumeLighting::SceneLights;
        }
        let cameras: Vec<_> = world.query_filtered::<Entity, With<Camera3d>>().iter(world).collect();
        for camera in cameras {
            world.entity_mut(camera).insert((look.msaa, look.tonemapping, look.deband));
        }
        self.settle();
    }

    /// Sets the length of occlusion steps, which makes all occlusion stale.
    pub fn set_step_mm(&mut self, step_mm: f32) {
        let volume = self.scene.volume;
        let mut occlusion = self.scene.world().get_mut::<AmbientOcclusion>(volume).expect("occlusion");
        occlusion.method.rays_mut().expect("rays").step_mm = Some(step_mm);
    }

    pub fn settle(&mut self) {
        self.scene.settle();
        // A changed asset is drawn a frame later.
        self.scene.headless.frames(2);
    }
}

/// Pose and projection of an eye.
#[derive(Clone, Copy, Debug)]
pub struct Eye {
    pub pose: Transform,
    pub projection: OffAxis,
}

/// The eyes of a head. Each sees farther to its own side.
pub fn eyes_of(head: Transform) -> [Eye; 2] {
    [-1.0, 1.0].map(|side: f32| {
        let (outer, inner) = (0.55 * side, -0.4 * side);
        let projection = OffAxis {
            low: Vec2::new(outer.min(inner), -0.45),
            high: Vec2::new(outer.max(inner), 0.5),
            near: 0.1,
        };
        Eye { pose: head * Transform::from_xyz(0.5 * side * APART, 0.0, 0.0), projection }
    })
}

/// A head that looks at the volume from a direction, from a distance of 0.6 m.
pub fn head_from(direction: Vec3) -> Transform {
    Transform::from_translation(0.6 * direction.normalize()).looking_at(Vec3::ZERO, Vec3::Y)
}

/// The scene before one camera on an ordinary image.
#[derive(Deref, DerefMut)]
pub struct OneCamera(Carved);

impl OneCamera {
    pub fn new() -> Self {
        Self(Carved::new())
    }

    /// Draws what an eye sees.
    pub fn draw(&mut self, eye: Eye) -> Vec<u8> {
        let camera = self.scene.camera();
        self.scene.world().entity_mut(camera).insert((eye.pose, Projection::custom(eye.projection)));
        self.scene.headless.frame();
        self.scene.headless.image()
    }
}

/// The scene before two eyes.
#[derive(Deref, DerefMut)]
pub struct TwoEyes {
    #[deref]
    carved: Carved,
    pub cameras: [Entity; 2],
    /// A layer for each eye.
    texture: Texture,
}

impl TwoEyes {
    pub fn new() -> Self {
        let mut carved = Carved::new();
        let camera = carved.scene.camera();
        carved.scene.world().despawn(camera);
        let world = carved.scene.world();
        let texture = eye_texture(world.resource::<RenderDevice>(), IMAGE);
        insert_layers(&texture, 0, &mut world.resource_mut::<ManualTextureViews>());
        let plain = (Tonemapping::None, DebandDither::Disabled, Msaa::Off);
        let cameras = [0, 1].map(|eye| {
            let target = RenderTarget::TextureView(ManualTextureViewHandle(eye));
            let order = Camera { order: eye as isize, ..default() };
            carved.scene.world().spawn((Camera3d::default(), target, order, plain)).id()
        });
        take_late_poses(&mut carved.scene.headless);
        Self { carved, cameras, texture }
    }

    /// Draws a frame with the poses of `early` in the main world, and those of `late` in the render world. Returns both
    /// images.
    pub fn draw(&mut self, early: [Eye; 2], late: [Eye; 2]) -> [Vec<u8>; 2] {
        self.pose(early, late);
        self.scene.headless.frame();
        self.images()
    }

    /// Sets the poses for the next frames. The projections are those of `late`.
    pub fn pose(&mut self, early: [Eye; 2], late: [Eye; 2]) {
        let cameras = self.cameras;
        for (camera, (early, late)) in cameras.into_iter().zip(early.into_iter().zip(late)) {
            self.scene.world().entity_mut(camera).insert((early.pose, Projection::custom(late.projection)));
        }
        let poses = cameras.into_iter().zip(late.map(|eye| GlobalTransform::from(eye.pose))).collect();
        set_late_poses(&mut self.scene.headless, poses);
    }

    pub fn images(&self) -> [Vec<u8>; 2] {
        read_layers(&self.scene.headless, &self.texture)
    }
}

/// Asserts that two eyes see the same as one camera does, and that each sees something else.
pub fn assert_same(name: &str, eyes: &[Vec<u8>; 2], one: &[Vec<u8>; 2]) {
    for (eye, (seen, expected)) in eyes.iter().zip(one).enumerate() {
        let shown = seen.chunks(4).filter(|pixel| **pixel != seen[..4]).count();
        assert!(shown > 1000, "{name}, eye {eye}: {shown} pixels show the volume");
        let differ = seen.chunks(4).zip(expected.chunks(4)).filter(|(a, b)| a != b).count();
        assert_eq!(differ, 0, "{name}, eye {eye}: pixels that one camera shows otherwise");
    }
    assert!(eyes[0] != eyes[1], "{name}: both eyes see the same");
}
