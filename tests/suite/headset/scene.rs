//! A volume before the eyes of a session, with a carver in each hand; and the same before one camera that recomputes
//! everything.

use bevy::{
    app::PluginGroupBuilder,
    core_pipeline::tonemapping::{DebandDither, Tonemapping},
    prelude::*,
    render::{RenderApp, renderer::RenderDevice},
};
use bevy_contextual_ao::{diagnostics::PassLog, prelude::*};
use bevy_mod_openxr::{add_xr_plugins, init::OxrInitPlugin, resources::OxrCurrentSessionConfig};
use bevy_mod_xr::{
    camera::{XrCamera, XrProjection},
    session::{XrState, XrTrackingRoot},
};
use contextual_ao_kit::{
    headless::{Headless, project_folder},
    mode::ShadingMode,
    picture::field::Field,
};
use std::time::Duration;

use super::eyes::{DrawnEye, DrawnEyes, ReadableEyes, watch};
use crate::{
    carve_xr::example::{
        controls::{Controls, ControlsPlugin, Side},
        headset::HeadsetPlugin,
    },
    eye_layers::{eye_texture, read_layers, set_late_poses, take_late_poses},
    scene::{TestScene, few_rays},
};

/// Place of the volume, m.
pub const VOLUME_AT: Vec3 = Vec3::new(0.0, 1.4, -0.5);
/// Voxels of the head along its height.
const VOXELS_HIGH: u32 = 48;
const PLAIN: (Tonemapping, DebandDither, Msaa) = (Tonemapping::None, DebandDither::Disabled, Msaa::Off);

/// Poses that decide what is seen, as they are in a frame of the session.
pub struct Poses {
    volume: Transform,
    /// Left and right, with what their carvers do.
    hands: [(Transform, bool); 2],
    eyes: [DrawnEye; 2],
}

fn scene_in(headless: Headless, mode: ShadingMode) -> TestScene {
    let head = Field::of_head(Vec::new(), VOXELS_HIGH).volume().expect("a head");
    let function = project_folder().join("assets/head_phantom.tf.ron");
    let function = std::fs::read_to_string(function).expect("the demo's transfer function");
    let function = TransferFunction::from_ron(&function).expect("the demo's transfer function");
    let mut occlusion = few_rays();
    occlusion.method.rays_mut().expect("rays").step_mm = Some(head.spacing_mm().x);
    let mut scene = TestScene::in_app(headless, head, function, occlusion, mode);
    scene.set_clip(|clip| clip.depth_map_size = 256);
    scene.place_volume(Transform::from_translation(VOLUME_AT));
    let volume = scene.volume;
    let world = scene.world();
    world.entity_mut(volume).insert(Grabbable::default());
    world.get_mut::<VolumeShading>(volume).expect("shading").jitter = false;
    scene
}

/// A hand with a carver in it, below an entity.
fn spawn_hand(world: &mut World, side: Side, root: Entity) -> Entity {
    let shape: Mesh = match side {
        Side::Left => Cuboid::from_length(0.08).into(),
        Side::Right => Sphere::new(0.05).into(),
    };
    let mesh = world.resource_mut::<Assets<Mesh>>().add(shape);
    let carver = (HeldCarver::default(), Mesh3d(mesh), Transform::from_xyz(0.0, 0.0, -0.03));
    let hand = Hand { reach: 0.2, ..default() };
    world.spawn((Controls::new(side), hand, ChildOf(root), children![carver])).id()
}

/// The scene in a session.
pub struct InHeadset {
    scene: TestScene,
    hands: [Entity; 2],
}

impl InHeadset {
    pub fn new() -> Self {
        let plugins = |plugins: PluginGroupBuilder| {
            let init = OxrInitPlugin { synchronous_pipeline_compilation: true, ..default() };
            add_xr_plugins(plugins).set(init)
        };
        let headless = Headless::with_plugins(UVec2::splat(16), plugins, |app| {
            app.add_plugins((HeadsetPlugin, ControlsPlugin)).add_systems(PreUpdate, make_plain);
            watch(app);
        });
        let mut scene = scene_in(headless, ShadingMode::PhongCao);
        let camera = scene.camera();
        let world = scene.world();
        world.despawn(camera);
        let root =
            world.query_filtered::<Entity, With<XrTrackingRoot>>().single(world).expect("a tracking root");
        let hands = [Side::Left, Side::Right].map(|side| spawn_hand(world, side, root));
        Self { scene, hands }
    }

    pub fn send<M: Message>(&mut self, message: M) {
        self.scene.world().write_message(message);
    }

    /// Runs frames until the session is in a state.
    pub fn run_until(&mut self, state: XrState) {
        for _ in 0..600 {
            self.scene.headless.frame();
            if *self.scene.world().resource::<XrState>() == state {
                return;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        let now = *self.scene.world().resource::<XrState>();
        panic!("the session is {now:?} and not {state:?}");
    }

    /// Runs a frame, whose eyes can be read or not.
    pub fn frame(&mut self, is_readable: bool) {
        let texture = is_readable.then(|| {
            eye_texture(self.scene.headless.app.world().resource::<RenderDevice>(), self.resolution())
        });
        self.render_world().insert_resource(ReadableEyes(texture));
        self.scene.headless.frame();
    }

    /// Pixels of an eye.
    pub fn resolution(&self) -> UVec2 {
        self.scene.headless.app.world().resource::<OxrCurrentSessionConfig>().resolution
    }

    /// What both eyes saw in the latest frame, if it can be read.
    pub fn eyes(&self) -> [Vec<u8>; 2] {
        let readable = self.scene.headless.app.sub_app(RenderApp).world().resource::<ReadableEyes>();
        read_layers(&self.scene.headless, readable.0.as_ref().expect("a readable frame"))
    }

    pub fn poses(&mut self) -> Poses {
        let eyes = self.render_world().resource::<DrawnEyes>().0.map(|eye| eye.expect("both eyes are drawn"));
        let world = self.scene.headless.app.world();
        let pose = |entity| *world.get::<Transform>(entity).expect("a pose");
        let carves = |hand| {
            let carver = world.get::<Children>(hand).expect("a carver")[0];
            world.get::<ClipMesh>(carver).expect("a carver").is_active
        };
        Poses {
            volume: pose(self.scene.volume),
            hands: self.hands.map(|hand| (pose(hand), carves(hand))),
            eyes,
        }
    }

    /// What the hands' devices say, left and right.
    pub fn controls(&self) -> [Controls; 2] {
        self.hands.map(|hand| *self.scene.headless.app.world().get::<Controls>(hand).expect("a hand"))
    }

    pub fn passes(&self) -> PassLog {
        self.scene.status().passes
    }

    fn render_world(&mut self) -> &mut World {
        self.scene.headless.app.sub_app_mut(RenderApp).world_mut()
    }
}

/// Eyes show the colours of the transfer function unchanged.
fn make_plain(eyes: Query<Entity, Added<XrCamera>>, mut commands: Commands) {
    for eye in &eyes {
        commands.entity(eye).insert(PLAIN);
    }
}

/// The same scene before one camera, in which all occlusion is cast in every frame.
pub struct Recomputed {
    scene: TestScene,
    hands: [Entity; 2],
}

impl Recomputed {
    pub fn new() -> Self {
        let mut headless = Headless::new(UVec2::new(320, 240), |_| {});
        take_late_poses(&mut headless);
        let mut scene = scene_in(headless, ShadingMode::PhongCao);
        let volume = scene.volume;
        let mut occlusion = scene.world().get_mut::<AmbientOcclusion>(volume).expect("occlusion");
        occlusion.recompute = bevy_contextual_ao::occlusion::Recompute::Everything;
        let camera = scene.camera();
        let world = scene.world();
        world.entity_mut(camera).insert(PLAIN);
        let root = world.spawn((Transform::default(), Visibility::default())).id();
        let hands = [Side::Left, Side::Right].map(|side| spawn_hand(world, side, root));
        scene.settle();
        Self { scene, hands }
    }

    /// What both eyes should have seen.
    pub fn draw(&mut self, poses: &Poses) -> [Vec<u8>; 2] {
        let camera = self.scene.camera();
        self.scene.place_volume(poses.volume);
        for (entity, (pose, carves)) in self.hands.into_iter().zip(poses.hands) {
            let mut hand = self.scene.world().entity_mut(entity);
            hand.insert(pose);
            hand.get_mut::<Hand>().expect("a hand").trigger = f32::from(carves);
        }
        poses.eyes.map(|eye| {
            let projection = XrProjection { projection_matrix: eye.clip_from_view, ..default() };
            self.scene
                .world()
                .entity_mut(camera)
                .insert((Projection::custom(projection), Transform::from(eye.world_from_view)));
            set_late_poses(&mut self.scene.headless, vec![(camera, eye.world_from_view)]);
            self.scene.headless.frame();
            self.scene.headless.image()
        })
    }
}
