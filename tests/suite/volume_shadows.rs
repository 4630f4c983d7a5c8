//! Shadows of volumes beyond those of a solid ball: carved, translucent, on themselves, out of view, and switched off.

use bevy::{
    camera::visibility::RenderLayers,
    diagnostic::{Diagnostic, DiagnosticPath},
    light::{
        CascadeShadowConfig, CascadeShadowConfigBuilder, DirectionalLightShadowMap, NotShadowCaster,
        NotShadowReceiver,
    },
    math::DVec3,
    prelude::*,
};
use bevy_contextual_ao::{diagnostics::SPAN_SHADOWS, prelude::*};
use contextual_ao_kit::mode::ShadingMode;

use crate::scene::{IMAGE, TestScene, volume_from};

const SIDE: u32 = 32;
/// Opacity of the slab's whole depth where it is translucent.
const OPACITY: f64 = 0.6;
const SLAB_MM: f64 = 8.0;

/// A white floor 24 mm below a volume's centre, lit from straight above and seen from above, by a camera that does not show the
/// volume.
struct Floor {
    scene: TestScene,
}

impl Floor {
    fn new(volume: Volume, function: TransferFunction) -> Self {
        let mut scene = TestScene::new(volume, function, default(), ShadingMode::Solid);
        let camera = scene.camera();
        scene.headless.render_floats(camera, IMAGE);
        let world = scene.world();
        world.insert_resource(ClearColor(Color::NONE));
        world.insert_resource(GlobalAmbientLight::NONE);
        world.insert_resource(DirectionalLightShadowMap { size: 512 });
        // Bevy's own bias of 2 cm is more than the way from the volume to the floor.
        let light = DirectionalLight {
            illuminance: 4000.0,
            shadow_maps_enabled: true,
            shadow_depth_bias: 0.001,
            ..default()
        };
        let down = Transform::from_xyz(0.0, 1.0, 0.0).looking_at(Vec3::ZERO, Vec3::X);
        world.spawn((light, near_cascade(), down, RenderLayers::from_layers(&[0, 1])));
        let mesh = world.resource_mut::<Assets<Mesh>>().add(Cuboid::new(0.08, 0.002, 0.08));
        let material = StandardMaterial { perceptual_roughness: 1.0, reflectance: 0.0, ..default() };
        let material = world.resource_mut::<Assets<StandardMaterial>>().add(material);
        let place = Transform::from_xyz(0.0, -0.024, 0.0);
        world.spawn((Mesh3d(mesh), MeshMaterial3d(material), place, RenderLayers::layer(1)));
        world.entity_mut(camera).insert((
            RenderLayers::layer(1),
            Transform::from_xyz(0.0, 0.08, 0.0).looking_at(Vec3::ZERO, Vec3::X),
        ));
        Self { scene }
    }

    /// Light of the floor, as shares of the brightest.
    fn light(&mut self) -> Vec<f64> {
        self.scene.settle();
        self.scene.headless.frames(3);
        self.now()
    }

    /// The same in the last frame.
    fn now(&mut self) -> Vec<f64> {
        let light = self.scene.headless.light();
        let brightest = light.iter().map(|light| light[0]).fold(0.0, f64::max);
        assert!(brightest > 0.1, "the floor is dark");
        light.iter().map(|light| light[0] / brightest).collect()
    }
}

/// One shadow map for what is 1 cm to 0.3 m from the camera.
pub fn near_cascade() -> CascadeShadowConfig {
    CascadeShadowConfigBuilder { num_cascades: 1, minimum_distance: 0.01, maximum_distance: 0.3, ..default() }
        .build()
}

/// A share of the light of the floor's middle, or of a place beside it.
fn mean_around(light: &[f64], center: IVec2) -> f64 {
    let mut sum = 0.0;
    for y in -4..4 {
        for x in -4..4 {
            let at = center + IVec2::new(x, y);
            sum += light[(at.y * IMAGE.x as i32 + at.x) as usize];
        }
    }
    sum / 64.0
}

const MIDDLE: IVec2 = IVec2::splat(IMAGE.x as i32 / 2);

/// A slab, which is upright to the light, of half the grid's width.
fn slab() -> Volume {
    volume_from(UVec3::splat(SIDE), DVec3::ONE, |p| {
        let half = SLAB_MM / f64::from(SIDE);
        f64::from(u8::from(p.z.abs() < half && p.x.abs() < 0.5 && p.y.abs() < 0.5))
    })
}

fn opaque() -> TransferFunction {
    TransferFunction::ramp(120.0, 130.0, 1.0, [1.0; 3]).expect("a valid ramp")
}

#[test]
fn translucent_matter_stops_light_in_proportion() {
    let mut floor = Floor::new(slab(), opaque());
    assert!(mean_around(&floor.light(), MIDDLE) < 0.02, "an opaque slab lets light through");
    // Each millimetre lets the same share through. Between voxels the slab is as deep as its voxels are.
    let per_mm = 1.0 - (1.0 - OPACITY).powf(1.0 / SLAB_MM);
    let mist = TransferFunction::ramp(120.0, 130.0, per_mm as f32, [1.0; 3]).expect("a valid ramp");
    let function = floor.scene.world().resource_mut::<Assets<TransferFunction>>().add(mist);
    let volume = floor.scene.volume;
    floor.scene.world().entity_mut(volume).insert(VolumeTransferFunction(function));
    floor.scene.settle();
    let through = mean_around(&floor.light(), MIDDLE);
    println!("{through:.3} of the light comes through, {:.3} by the slab's opacity", 1.0 - OPACITY);
    assert!((through - (1.0 - OPACITY)).abs() < 0.05, "{through} of the light comes through");
}

#[test]
fn a_carve_changes_the_shadow_in_its_frame() {
    let mut floor = Floor::new(slab(), opaque());
    let carver = floor.scene.carve(
        Cuboid::new(8.0, 40.0, 8.0),
        ClipMesh::default(),
        Transform::from_xyz(100.0, 0.0, 0.0),
    );
    floor.scene.settle();
    let before = mean_around(&floor.light(), MIDDLE);
    floor.scene.move_carver(carver, Transform::default());
    floor.scene.headless.frame();
    let carved = floor.now();
    // Shadow maps of 1.6 mm blur the light through a hole of 8 mm.
    let through = mean_around(&carved, MIDDLE);
    assert!(before < 0.02 && through > 0.5, "{before} before the carve, {through} in its frame");
    assert_eq!(carved, floor.light(), "the shadow changes after the frame of the carve");
}

#[test]
fn shadows_are_switched_off_by_bevys_own_components() {
    let mut floor = Floor::new(slab(), opaque());
    let volume = floor.scene.volume;
    assert!(mean_around(&floor.light(), MIDDLE) < 0.02);
    floor.scene.world().entity_mut(volume).insert(NotShadowCaster);
    assert!(mean_around(&floor.light(), MIDDLE) > 0.98, "it casts a shadow");
    floor.scene.world().entity_mut(volume).remove::<NotShadowCaster>().insert(Visibility::Hidden);
    assert!(mean_around(&floor.light(), MIDDLE) > 0.98, "a hidden volume casts a shadow");
}

#[test]
fn a_volume_shades_itself_unless_it_receives_no_shadows() {
    // A slab over another one, which is wider.
    let volume = volume_from(UVec3::splat(SIDE), DVec3::ONE, |p| {
        let is_roof = p.z > 0.5 && p.x.abs() < 0.4 && p.y.abs() < 0.4;
        f64::from(u8::from(p.z < -0.5 || is_roof))
    });
    let mut floor = Floor::new(volume, opaque());
    let (camera, volume) = (floor.scene.camera(), floor.scene.volume);
    let view = Transform::from_xyz(0.0, 0.02, 0.05).looking_at(Vec3::new(0.0, -0.008, 0.0), Vec3::Y);
    floor.scene.world().entity_mut(camera).insert((RenderLayers::layer(0), view));
    let mut shading = floor.scene.world().get_mut::<VolumeShading>(volume).expect("shading");
    shading.lighting = VolumeLighting::SceneLights;
    floor.scene.settle();
    let shaded = |floor: &mut Floor| {
        let light = floor.light();
        light.iter().filter(|light| **light > 0.0 && **light < 0.3).count()
    };
    let with = shaded(&mut floor);
    floor.scene.world().entity_mut(volume).insert(NotShadowReceiver);
    let without = shaded(&mut floor);
    println!("{with} pixels are dark, without shadows {without}");
    assert!(with > without + 100, "{with} pixels are dark, without shadows {without}");
}

#[test]
fn rays_of_lights_are_followed_once_the_light_or_the_volume_changed() {
    let mut floor = Floor::new(slab(), opaque());
    let path = DiagnosticPath::from_components(["render", SPAN_SHADOWS, "elapsed_cpu"]);
    let latest = |floor: &mut Floor| {
        // Spans arrive some frames later.
        floor.scene.headless.frames(8);
        let diagnostics = floor.scene.headless.diagnostics();
        diagnostics.get(&path).and_then(Diagnostic::measurement).map(|latest| latest.time)
    };
    floor.light();
    let first = latest(&mut floor);
    assert!(first.is_some(), "the pass has run");
    assert_eq!(latest(&mut floor), first, "the pass runs at rest");
    let world = floor.scene.world();
    let mut lights = world.query_filtered::<&mut Transform, With<DirectionalLight>>();
    lights.single_mut(world).expect("a light").rotate_x(0.1);
    let turned = latest(&mut floor);
    assert_ne!(turned, first, "the pass runs when the light turns");
    let carver = ClipMesh::default();
    floor.scene.carve(Cuboid::new(8.0, 40.0, 8.0), carver, Transform::default());
    floor.scene.settle();
    assert_ne!(latest(&mut floor), turned, "the pass runs when the volume is carved");
}
