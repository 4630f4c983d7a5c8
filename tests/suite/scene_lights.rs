//! Volumes under the lights of a scene, beside meshes of Bevy's standard material.

use bevy::{
    asset::RenderAssetUsages,
    camera::visibility::RenderLayers,
    light::{DirectionalLightShadowMap, PointLightShadowMap},
    math::DVec3,
    mesh::SphereKind,
    pbr::{DistanceFog, FogFalloff},
    prelude::*,
    render::render_resource::{
        Extent3d, TextureDimension, TextureFormat, TextureViewDescriptor, TextureViewDimension,
    },
};
use bevy_contextual_ao::{prelude::*, volume::WORLD_UNITS_PER_MM};
use contextual_ao_kit::mode::ShadingMode;
use half::f16;

use crate::{
    scene::{IMAGE, TestScene, volume_from},
    volume_shadows::near_cascade,
};

const SIDE: u32 = 48;
const RADIUS_MM: f64 = 20.0;
const RADIUS: f32 = RADIUS_MM as f32 * WORLD_UNITS_PER_MM;
const COLOR: [f32; 3] = [0.8, 0.5, 0.3];

/// A solid ball, whose intensity falls evenly over four voxels, beside the same ball as a mesh.
struct Pair {
    scene: TestScene,
    ball: Entity,
}

impl Pair {
    fn new() -> Self {
        let volume = volume_from(UVec3::splat(SIDE), DVec3::ONE, |p| {
            (RADIUS_MM - p.length() * f64::from(SIDE) / 2.0) / 4.0 + 0.5
        });
        let function = TransferFunction::ramp(126.0, 129.0, 1.0, COLOR).expect("a valid ramp");
        let mut scene = TestScene::new(volume, function, default(), ShadingMode::Solid);
        let (camera, volume) = (scene.camera(), scene.volume);
        scene.headless.render_floats(camera, IMAGE);
        let world = scene.world();
        world.insert_resource(ClearColor(Color::NONE));
        world.insert_resource(GlobalAmbientLight::NONE);
        // Small ones: a software driver draws them slowly.
        world.insert_resource(DirectionalLightShadowMap { size: 512 });
        world.insert_resource(PointLightShadowMap { size: 512 });
        let mut shading = world.get_mut::<VolumeShading>(volume).expect("shading");
        shading.lighting = VolumeLighting::SceneLights;
        let sphere = Sphere::new(RADIUS).mesh().kind(SphereKind::Uv { sectors: 128, stacks: 64 });
        let mesh = world.resource_mut::<Assets<Mesh>>().add(sphere);
        let material = StandardMaterial {
            base_color: Color::srgb(COLOR[0], COLOR[1], COLOR[2]),
            perceptual_roughness: 0.5,
            reflectance: 0.5,
            ..default()
        };
        let material = world.resource_mut::<Assets<StandardMaterial>>().add(material);
        let ball = world.spawn((Mesh3d(mesh), MeshMaterial3d(material), Visibility::Hidden)).id();
        Self { scene, ball }
    }

    fn shading(&mut self) -> Mut<'_, VolumeShading> {
        let volume = self.scene.volume;
        self.scene.world().get_mut::<VolumeShading>(volume).expect("shading")
    }

    /// Changes the mesh's material.
    fn set_material(&mut self, change: impl FnOnce(&mut StandardMaterial)) {
        let world = self.scene.world();
        let material =
            world.get::<MeshMaterial3d<StandardMaterial>>(self.ball).expect("a material").0.clone();
        change(
            &mut world.resource_mut::<Assets<StandardMaterial>>().get_mut(&material).expect("the material"),
        );
    }

    /// Light of the volume and of the mesh.
    fn pictures(&mut self) -> [Vec<[f64; 3]>; 2] {
        let (volume, ball) = (self.scene.volume, self.ball);
        [(volume, ball), (ball, volume)].map(|(shown, hidden)| {
            self.scene.world().entity_mut(shown).insert(Visibility::Inherited);
            self.scene.world().entity_mut(hidden).insert(Visibility::Hidden);
            if shown == volume {
                self.scene.settle();
            }
            // Bevy assigns spot lights to clusters some frames after they or a camera appear.
            self.scene.headless.frames(5);
            self.scene.headless.light()
        })
    }

    /// Largest and mean difference between volume and mesh, as shares of the brightest light, in pixels of the mesh that are
    /// `margin` pixels from its outline.
    fn compare(&mut self, margin: i32) -> Difference {
        let [volume, mesh] = self.pictures();
        let is_mesh = |at: IVec2| {
            let is_in = at.cmpge(IVec2::ZERO).all() && at.cmplt(IMAGE.as_ivec2()).all();
            is_in && mesh[(at.y * IMAGE.x as i32 + at.x) as usize].iter().any(|light| *light > 0.0)
        };
        let is_inner = |at: IVec2| {
            (-margin..=margin).all(|y| (-margin..=margin).all(|x| is_mesh(at + IVec2::new(x, y))))
        };
        let brightest = mesh.iter().flatten().copied().fold(0.0, f64::max);
        let (mut largest, mut sum, mut count) = (0.0f64, 0.0, 0);
        for y in 0..IMAGE.y as i32 {
            for x in (0..IMAGE.x as i32).filter(|x| is_inner(IVec2::new(*x, y))) {
                let index = (y * IMAGE.x as i32 + x) as usize;
                let off = (0..3).map(|k| (volume[index][k] - mesh[index][k]).abs() / brightest);
                let off = off.fold(0.0, f64::max);
                largest = largest.max(off);
                sum += off;
                count += 1;
            }
        }
        Difference { largest, mean: sum / f64::from(count.max(1)), pixels: count, brightest }
    }
}

#[derive(Debug)]
struct Difference {
    largest: f64,
    mean: f64,
    pixels: i32,
    brightest: f64,
}

impl Difference {
    /// Asserts bounds of the largest and of the mean difference.
    fn below(&self, name: &str, largest: f64, mean: f64) {
        println!("{name}: {self:?}");
        assert!(self.pixels > 300, "{name}: {self:?}");
        assert!(self.brightest > 0.1, "{name}: {self:?}");
        assert!(self.largest < largest && self.mean < mean, "{name}: {self:?}");
    }
}

/// Turns towards the ball's centre.
fn towards_center(from: Vec3) -> Transform {
    Transform::from_translation(from).looking_at(Vec3::ZERO, Vec3::Y)
}

/// A light of each kind, from the viewer's right above. Bevy's own biases and near planes are those of larger scenes.
fn spawn_light(world: &mut World, kind: usize, has_shadows: bool) -> Entity {
    let place = towards_center(Vec3::new(0.1, 0.09, 0.06));
    match kind {
        0 => {
            let light = DirectionalLight {
                illuminance: 4000.0,
                shadow_maps_enabled: has_shadows,
                shadow_depth_bias: 0.002,
                ..default()
            };
            world.spawn((light, near_cascade(), place)).id()
        }
        1 => {
            let intensity = 1000.0;
            let light = PointLight {
                intensity,
                shadow_maps_enabled: has_shadows,
                shadow_depth_bias: 0.003,
                shadow_map_near_z: 0.005,
                ..default()
            };
            world.spawn((light, place)).id()
        }
        _ => {
            let (intensity, outer_angle) = (1000.0, 0.1);
            let light = SpotLight {
                intensity,
                outer_angle,
                inner_angle: 0.05,
                shadow_maps_enabled: has_shadows,
                shadow_depth_bias: 0.003,
                shadow_map_near_z: 0.005,
                ..default()
            };
            world.spawn((light, place)).id()
        }
    }
}

/// An environment that is equally bright all around.
fn even_environment(world: &mut World) -> EnvironmentMapLight {
    let texel: Vec<u8> =
        [1.0, 1.0, 1.0, 1.0].into_iter().flat_map(|value| f16::from_f32(value).to_le_bytes()).collect();
    let size = Extent3d { width: 1, height: 1, depth_or_array_layers: 6 };
    let mut image = Image::new_fill(
        size,
        TextureDimension::D2,
        &texel,
        TextureFormat::Rgba16Float,
        RenderAssetUsages::all(),
    );
    image.texture_view_descriptor =
        Some(TextureViewDescriptor { dimension: Some(TextureViewDimension::Cube), ..default() });
    let map = world.resource_mut::<Assets<Image>>().add(image);
    EnvironmentMapLight { diffuse_map: map.clone(), specular_map: map, intensity: 800.0, ..default() }
}

#[test]
fn single_lights_show_a_ball_as_they_show_a_mesh() {
    let mut pair = Pair::new();
    for (kind, name) in ["directional", "point", "spot"].into_iter().enumerate() {
        // A normal that is off by half a degree moves a highlight of this roughness by a tenth of its width.
        for (roughness, largest) in [(0.25, 0.1), (0.9, 0.01)] {
            pair.shading().perceptual_roughness = roughness;
            pair.set_material(|material| material.perceptual_roughness = roughness);
            let light = spawn_light(pair.scene.world(), kind, false);
            pair.compare(2).below(&format!("{name}, roughness {roughness}"), largest, 0.002);
            pair.scene.world().despawn(light);
        }
    }
}

#[test]
fn light_from_all_around_shows_a_ball_as_it_shows_a_mesh() {
    let mut pair = Pair::new();
    pair.scene.world().insert_resource(GlobalAmbientLight { brightness: 800.0, ..default() });
    pair.compare(2).below("ambient", 0.005, 0.001);
    pair.scene.world().insert_resource(GlobalAmbientLight::NONE);
    let camera = pair.scene.camera();
    let environment = even_environment(pair.scene.world());
    pair.scene.world().entity_mut(camera).insert(environment);
    pair.compare(2).below("environment", 0.005, 0.001);
    // A white furnace: a white ball that reflects nothing by Fresnel is as bright as what is around it.
    pair.set_material(|material| (material.base_color, material.reflectance) = (Color::WHITE, 0.0));
    let white = TransferFunction::ramp(126.0, 129.0, 1.0, [1.0; 3]).expect("a valid ramp");
    let white = pair.scene.world().resource_mut::<Assets<TransferFunction>>().add(white);
    let volume = pair.scene.volume;
    pair.scene.world().entity_mut(volume).insert(VolumeTransferFunction(white));
    pair.shading().reflectance = 0.0;
    let difference = pair.compare(2);
    difference.below("white furnace", 0.001, 0.001);
    // 800 cd/m^2 at the default exposure of 9.7 EV.
    let around = 800.0 / (1.2 * 9.7f64.exp2());
    assert!((difference.brightest - around).abs() < 0.03 * around, "{difference:?}, around {around}");
}

#[test]
fn occlusion_darkens_indirect_light_alone() {
    let mut pair = Pair::new();
    let volume = pair.scene.volume;
    let centre = |pair: &mut Pair| {
        pair.scene.settle();
        pair.scene.headless.frame();
        pair.scene.headless.light()[(IMAGE.y / 2 * IMAGE.x + IMAGE.x / 2) as usize][0]
    };
    let with_occlusion = |pair: &mut Pair, is_on: bool| {
        pair.shading().ambient_occlusion = is_on;
        centre(pair)
    };
    // A hole that the light shines into along the line of sight.
    let camera = pair.scene.camera();
    let view = *pair.scene.world().get::<Transform>(camera).expect("a place");
    let mut scale = pair.scene.world().get_mut::<AmbientOcclusion>(volume).expect("occlusion");
    scale.set_if_neq(AmbientOcclusion::by(OcclusionRays { steps: 20, ..default() }));
    pair.shading().ambient_scale = AmbientScale::FlatSurface;
    let direction = view.rotation;
    let hole = Transform::from_rotation(direction).with_translation(direction * Vec3::Z * 15.0);
    pair.scene.carve(Cuboid::new(8.0, 8.0, 24.0), ClipMesh::default(), hole);
    let light = pair.scene.world().spawn((DirectionalLight { illuminance: 4000.0, ..default() }, view)).id();
    let direct = [false, true].map(|is_on| with_occlusion(&mut pair, is_on));
    assert!(direct[0] > 0.1 && (direct[1] - direct[0]).abs() < 0.002 * direct[0], "{direct:?}");
    pair.scene.world().despawn(light);
    pair.scene.world().insert_resource(GlobalAmbientLight { brightness: 800.0, ..default() });
    let indirect = [false, true].map(|is_on| with_occlusion(&mut pair, is_on));
    assert!(indirect[0] > 0.1 && indirect[1] < 0.6 * indirect[0], "{indirect:?}");
}

/// Spawns a mesh of a white, matt material.
fn spawn_mesh(world: &mut World, mesh: impl Into<Mesh>, place: Transform) -> Entity {
    let mesh = world.resource_mut::<Assets<Mesh>>().add(mesh.into());
    let material = world.resource_mut::<Assets<StandardMaterial>>().add(StandardMaterial {
        base_color: Color::WHITE,
        perceptual_roughness: 1.0,
        reflectance: 0.0,
        ..default()
    });
    world.spawn((Mesh3d(mesh), MeshMaterial3d(material), place)).id()
}

#[test]
fn meshes_cast_shadows_onto_volumes() {
    for (kind, name) in ["directional", "point", "spot"].into_iter().enumerate() {
        let mut pair = Pair::new();
        let world = pair.scene.world();
        let light = spawn_light(world, kind, true);
        // The light sees the bar, the camera does not.
        world.entity_mut(light).insert(RenderLayers::from_layers(&[0, 1]));
        let place = Transform::from_translation(Vec3::new(0.05, 0.045, 0.03));
        let bar = spawn_mesh(world, Cuboid::new(0.004, 0.1, 0.004), place);
        world.entity_mut(bar).insert(RenderLayers::layer(1));
        let lit = pair.compare(2);
        assert!(lit.largest < 0.03 && lit.mean < 0.003, "{name}: {lit:?}");
        let [with, _] = pair.pictures();
        pair.scene.world().despawn(bar);
        let [without, _] = pair.pictures();
        let darker = with.iter().zip(&without).filter(|(with, without)| with[0] < 0.5 * without[0]).count();
        println!("{name}: {lit:?}, {darker} pixels in shadow");
        assert!(darker > 25, "{name}: {darker} pixels in shadow");
    }
}

#[test]
fn volumes_cast_shadows_onto_meshes() {
    for (kind, name) in ["directional", "point", "spot"].into_iter().enumerate() {
        let mut pair = Pair::new();
        let world = pair.scene.world();
        spawn_light(world, kind, true);
        spawn_mesh(world, Cuboid::new(0.2, 0.002, 0.2), Transform::from_xyz(0.0, -0.025, 0.0));
        let [volume, mesh] = pair.pictures();
        let brightest = mesh.iter().flatten().copied().fold(0.0, f64::max);
        let off = volume.iter().zip(&mesh).filter(|(a, b)| (a[0] - b[0]).abs() > 0.1 * brightest).count();
        // The shadow of the mesh: the floor is darker than without the ball, and not hidden by it.
        let (ball, volume_entity) = (pair.ball, pair.scene.volume);
        for entity in [ball, volume_entity] {
            pair.scene.world().entity_mut(entity).insert(Visibility::Hidden);
        }
        pair.scene.headless.frames(2);
        let empty = pair.scene.headless.light();
        let shaded = mesh.iter().zip(&empty).filter(|(with, without)| with[0] < 0.2 * without[0]).count();
        println!("{name}: {off} pixels off, {shaded} in the shadow of the mesh");
        assert!(shaded > 100, "{name}: {shaded}");
        assert!(off * 20 < shaded, "{name}: {off} pixels off, {shaded} in shadow");
    }
}

#[test]
fn fog_hides_a_volume_as_it_hides_a_mesh() {
    let mut pair = Pair::new();
    spawn_light(pair.scene.world(), 0, false);
    let camera = pair.scene.camera();
    let falloff = FogFalloff::Linear { start: 0.05, end: 0.2 };
    let fog = DistanceFog { color: Color::srgb(0.2, 0.4, 0.8), falloff, ..default() };
    let clear = pair.pictures()[0].clone();
    pair.scene.world().entity_mut(camera).insert(fog);
    pair.compare(2).below("fog", 0.03, 0.003);
    let foggy = pair.pictures()[0].clone();
    let center = (IMAGE.y / 2 * IMAGE.x + IMAGE.x / 2) as usize;
    assert!((foggy[center][2] - clear[center][2]).abs() > 0.05, "{:?}, {:?}", foggy[center], clear[center]);
}

#[test]
fn outlines_under_msaa_are_those_of_a_mesh() {
    let mut pair = Pair::new();
    pair.scene.world().insert_resource(GlobalAmbientLight { brightness: 2000.0, ..default() });
    let camera = pair.scene.camera();
    let off_at_outlines = |pair: &mut Pair| {
        let [volume, mesh] = pair.pictures();
        let brightest = mesh.iter().flatten().copied().fold(0.0, f64::max);
        // Pixels that the mesh fills in part, or that are beside them.
        let is_outline = |index: usize| {
            let around = [index - 1, index + 1, index - IMAGE.x as usize, index + IMAGE.x as usize];
            let light = |index: usize| mesh[index][0];
            around.iter().any(|other| (light(*other) - light(index)).abs() > 0.2 * brightest)
        };
        let row = IMAGE.x as usize;
        let outline: Vec<_> = (row..mesh.len() - row).filter(|index| is_outline(*index)).collect();
        let squares = outline.iter().map(|index| ((volume[*index][0] - mesh[*index][0]) / brightest).powi(2));
        (squares.sum::<f64>() / outline.len() as f64).sqrt()
    };
    pair.scene.world().entity_mut(camera).insert(Msaa::Sample4);
    let smooth = off_at_outlines(&mut pair);
    pair.shading().outline_rays = 1;
    let alone = off_at_outlines(&mut pair);
    println!("off by {smooth:.3} at outlines, by {alone:.3} with one ray");
    assert!(smooth < 0.13 && smooth < 0.6 * alone, "off by {smooth}, by {alone} with one ray");
}

#[test]
fn matter_without_a_surface_is_lit_everywhere() {
    let mut pair = Pair::new();
    let (camera, volume) = (pair.scene.camera(), pair.scene.volume);
    let view = *pair.scene.world().get::<Transform>(camera).expect("a place");
    pair.scene.world().spawn((DirectionalLight { illuminance: 4000.0, ..default() }, view));
    let mist = TransferFunction::ramp(126.0, 129.0, 0.2, COLOR).expect("a valid ramp");
    let mist = pair.scene.world().resource_mut::<Assets<TransferFunction>>().add(mist);
    pair.scene.world().entity_mut(volume).insert((VolumeTransferFunction(mist), Visibility::Inherited));
    pair.scene.settle();
    pair.scene.headless.frames(5);
    // Inside it counts as facing the viewer: rounding of that cosine must not show.
    let light = pair.scene.headless.light();
    let row = IMAGE.x as usize;
    let middle = (38..59).flat_map(|y| (38..59).map(move |x| y * row + x)).map(|index| light[index][0]);
    let darkest =
        middle.map(|light| if light.is_finite() { light } else { 0.0 }).fold(f64::INFINITY, f64::min);
    assert!(darkest > 0.1, "the darkest pixel of the middle has {darkest}");
}
