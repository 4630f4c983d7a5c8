//! The picture of a volume among meshes in every kind of camera, beside that of one plain camera in half floats.

use bevy::{
    camera::{Hdr, RenderTarget, ScalingMode, visibility::RenderLayers},
    core_pipeline::{
        prepass::{DeferredPrepass, DepthPrepass, MotionVectorPrepass, NormalPrepass},
        tonemapping::{DebandDither, Tonemapping},
    },
    material::OpaqueRendererMethod,
    math::DVec3,
    prelude::*,
    render::render_resource::TextureFormat,
};
use bevy_contextual_ao::prelude::*;
use contextual_ao_kit::mode::ShadingMode;

use crate::{
    integral::srgb_byte,
    scene::{IMAGE, TestScene, few_rays, folded_volume, in_world_units, opaque_ramp},
};

/// A kind of camera.
#[derive(Clone, Copy, Debug)]
struct Kind {
    hdr: bool,
    deferred: bool,
    prepass: Prepass,
    msaa: Msaa,
    tonemapping: Tonemapping,
    deband: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Prepass {
    None,
    Depth,
    All,
}

/// A carved volume, an opaque mesh that reaches out of it, and a translucent one in front.
struct Company {
    scene: TestScene,
    opaque: Entity,
    translucent: Entity,
}

impl Company {
    fn new() -> Self {
        let volume = folded_volume(UVec3::splat(20), DVec3::ONE);
        let mut scene = TestScene::new(volume, opaque_ramp(), few_rays(), ShadingMode::PhongCao);
        let entity = scene.volume;
        scene.world().insert_resource(ClearColor(Color::linear_rgb(0.1, 0.2, 0.05)));
        let mut shading = scene.world().get_mut::<VolumeShading>(entity).expect("shading");
        // Smooth outlines are another test's.
        (shading.jitter, shading.outline_rays) = (false, 1);
        let carver = Transform::from_xyz(3.0, 2.0, 5.0);
        scene.carve(Cuboid::new(9.0, 9.0, 30.0), ClipMesh::default(), carver);
        let opaque = spawn(&mut scene, Cuboid::new(6.0, 14.0, 6.0), Color::linear_rgb(0.7, 0.1, 0.1), {
            Transform::from_xyz(-8.0, 6.0, 6.0)
        });
        let translucent =
            spawn(&mut scene, Rectangle::new(9.0, 16.0), Color::linear_rgba(0.1, 0.5, 0.3, 0.4), {
                Transform::from_xyz(7.0, 2.0, 18.0)
            });
        Self { scene, opaque, translucent }
    }

    /// Replaces the camera by one of another kind.
    fn set_kind(&mut self, kind: Kind) {
        let before = self.scene.camera();
        let plain = self.scene.headless.camera();
        let renders =
            if kind.deferred { OpaqueRendererMethod::Deferred } else { OpaqueRendererMethod::Forward };
        let world = self.scene.world();
        let material =
            world.get::<MeshMaterial3d<StandardMaterial>>(self.opaque).expect("a material").0.clone();
        let mut materials = world.resource_mut::<Assets<StandardMaterial>>();
        materials.get_mut(&material).expect("a material").opaque_render_method = renders;
        let deband = if kind.deband { DebandDither::Enabled } else { DebandDither::Disabled };
        let place = *world.get::<Transform>(before).expect("a place");
        let projection = world.get::<Projection>(before).expect("a projection").clone();
        world.despawn(before);
        let mut camera = world.spawn((plain, place, projection));
        camera.insert((kind.msaa, kind.tonemapping, deband));
        if kind.hdr {
            camera.insert(Hdr);
        }
        if kind.deferred {
            camera.insert((DeferredPrepass, DepthPrepass));
        }
        match kind.prepass {
            Prepass::None => {}
            Prepass::Depth => _ = camera.insert(DepthPrepass),
            Prepass::All => _ = camera.insert((DepthPrepass, NormalPrepass, MotionVectorPrepass)),
        }
    }

    fn settle(&mut self) {
        self.scene.settle();
        self.scene.headless.frames(4);
    }
}

/// Spawns a mesh of one colour; the transform is in mm.
fn spawn(scene: &mut TestScene, mesh: impl Into<Mesh>, color: Color, pose: Transform) -> Entity {
    let world = scene.world();
    let mesh = world.resource_mut::<Assets<Mesh>>().add(mesh.into());
    let alpha_mode = if color.alpha() < 1.0 { AlphaMode::Blend } else { AlphaMode::Opaque };
    let material =
        StandardMaterial { base_color: color, unlit: true, alpha_mode, cull_mode: None, ..default() };
    let material = world.resource_mut::<Assets<StandardMaterial>>().add(material);
    world.spawn((Mesh3d(mesh), MeshMaterial3d(material), in_world_units(pose))).id()
}

/// Largest difference of a byte. Without HDR, bytes are rounded when each of up to three objects is blended, and once in the
/// end; Bevy moves those of meshes by half a byte against bands.
const MOST_BYTES: f64 = 2.5;

/// What a plain camera shows in half floats.
struct Reference {
    /// Light of every pixel.
    light: Vec<DVec3>,
    /// Pixels in which the opaque volume alone is seen.
    is_volume: Vec<bool>,
    /// Pixels that are not at outlines of meshes.
    is_inner: Vec<bool>,
}

impl Reference {
    fn new() -> Self {
        let mut company = Company::new();
        let camera = company.scene.camera();
        company.scene.headless.render_floats(camera, IMAGE);
        let mut light = |opaque, translucent, volume, background| {
            let entities = [company.opaque, company.translucent, company.scene.volume];
            for (entity, is_shown) in entities.into_iter().zip([opaque, translucent, volume]) {
                let visibility = if is_shown { Visibility::Inherited } else { Visibility::Hidden };
                company.scene.world().entity_mut(entity).insert(visibility);
            }
            let mut camera = company.scene.world().get_mut::<Camera>(camera).expect("a camera");
            camera.clear_color = ClearColorConfig::Custom(background);
            company.settle();
            company.scene.headless.light().into_iter().map(DVec3::from_array).collect::<Vec<_>>()
        };
        let background = Color::linear_rgb(0.1, 0.2, 0.05);
        let all = light(true, true, true, background);
        let [black, white] = [Color::BLACK, Color::WHITE].map(|color| light(false, false, true, color));
        let meshes = [light(true, false, false, Color::BLACK), light(false, true, false, Color::BLACK)];
        let is_volume = (0..all.len()).map(|k| black[k] == white[k] && all[k] == black[k]).collect();
        let covered = |k: usize| [0, 1].map(|mesh: usize| meshes[mesh][k] != DVec3::ZERO);
        let is_inner = |k: usize| {
            let (x, y) = (k as u32 % IMAGE.x, k as u32 / IMAGE.x);
            let xs = x.saturating_sub(1)..(x + 2).min(IMAGE.x);
            let ys = y.saturating_sub(1)..(y + 2).min(IMAGE.y);
            ys.flat_map(|y| xs.clone().map(move |x| (y * IMAGE.x + x) as usize))
                .all(|near| covered(near) == covered(k))
        };
        let is_inner = (0..all.len()).map(is_inner).collect();
        Self { light: all, is_volume, is_inner }
    }

    /// Asserts that an image shows the same, by the tones of a kind of camera.
    fn compare(&self, kind: Kind, image: &[u8]) {
        let maps_tones = kind.tonemapping != Tonemapping::None;
        let (mut compared, mut of_volume, mut far, mut sum, mut largest) = (0, 0, 0, 0.0, 0.0f64);
        for (k, light) in self.light.iter().enumerate() {
            // At outlines a multisampled view shows means. Without HDR each object's tones are mapped before it is blended.
            let is_left_out = kind.msaa != Msaa::Off && !self.is_inner[k];
            if is_left_out || maps_tones && !kind.hdr && !self.is_volume[k] {
                continue;
            }
            let light = if maps_tones { aces_fitted(*light) } else { *light };
            let shown = &image[4 * k..4 * k + 3];
            let off =
                light.to_array().into_iter().zip(shown).map(|(a, b)| (srgb_byte(a) - f64::from(*b)).abs());
            let off = off.fold(0.0, f64::max);
            compared += 1;
            of_volume += usize::from(self.is_volume[k]);
            far += usize::from(off > MOST_BYTES);
            sum += off;
            largest = largest.max(off);
        }
        let mean = sum / compared.max(1) as f64;
        println!(
            "{kind:?}: {compared} pixels, {of_volume} of the volume alone, off by {mean:.3} bytes, {far} by more than {MOST_BYTES}, at most {largest:.2}"
        );
        assert!(of_volume > 250, "{kind:?}: {of_volume} pixels of the volume");
        // Where a multisampled mesh is seen edge-on, rays of a pixel end in different depths.
        let most_far = if kind.msaa == Msaa::Off { 0 } else { compared / 200 };
        assert!(
            far <= most_far && mean < 0.6,
            "{kind:?}: off by {mean} bytes, {far} pixels by more, at most {largest}"
        );
    }
}

/// Tones by the fit of Stephen Hill to the Academy Color Encoding System.
fn aces_fitted(color: DVec3) -> DVec3 {
    let weigh = |rows: [[f64; 3]; 3], color: DVec3| {
        DVec3::from_array(rows.map(|row| DVec3::from_array(row).dot(color)))
    };
    let input =
        weigh([[0.59719, 0.35458, 0.04823], [0.076, 0.90834, 0.01566], [0.0284, 0.13383, 0.83777]], color);
    let fitted =
        input.map(|v| (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.432951) + 0.238081));
    let output =
        [[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]];
    weigh(output, fitted).clamp(DVec3::ZERO, DVec3::ONE)
}

/// All ways to draw meshes, by HDR, prepasses and samples. Deferred views have one sample.
fn kinds() -> impl Iterator<Item = Kind> {
    let ways = [(false, Msaa::Off), (true, Msaa::Off), (false, Msaa::Sample4)];
    let prepasses = [Prepass::None, Prepass::Depth, Prepass::All];
    [false, true].into_iter().flat_map(move |hdr| {
        ways.into_iter().flat_map(move |(deferred, msaa)| {
            prepasses.map(|prepass| Kind {
                hdr,
                deferred,
                prepass,
                msaa,
                tonemapping: Tonemapping::None,
                deband: true,
            })
        })
    })
}

#[test]
fn every_kind_of_camera_shows_the_same() {
    let reference = Reference::new();
    let mut company = Company::new();
    for kind in kinds() {
        company.set_kind(kind);
        company.settle();
        reference.compare(kind, &company.scene.headless.image());
    }
}

#[test]
fn tones_are_mapped_and_bands_broken_as_those_of_meshes() {
    let reference = Reference::new();
    let mut company = Company::new();
    let is_plain = |kind: &Kind| kind.prepass == Prepass::None && !kind.deferred && kind.msaa == Msaa::Off;
    for plain in kinds().filter(is_plain) {
        let tones = [Tonemapping::None, Tonemapping::AcesFitted];
        for tonemapping in tones {
            let images = [false, true].map(|deband| {
                let kind = Kind { tonemapping, deband, ..plain };
                company.set_kind(kind);
                company.settle();
                let image = company.scene.headless.image();
                reference.compare(kind, &image);
                image
            });
            let pairs = images[0].chunks(4).zip(images[1].chunks(4)).zip(&reference.is_volume);
            let differ = pairs.filter(|((a, b), is_volume)| **is_volume && a != b).count();
            let all = reference.is_volume.iter().filter(|is_volume| **is_volume).count();
            println!("{tonemapping:?}: bands are broken in {differ} of {all} pixels");
            // A shift of up to half a byte changes half of all roundings.
            let is_broken = differ > all / 3;
            let is_mapped = tonemapping != Tonemapping::None;
            assert_eq!(is_broken, is_mapped, "{plain:?}, {tonemapping:?}: {differ} of {all} pixels");
            assert!(is_mapped || differ == 0, "{plain:?}: colours as they are change in {differ} pixels");
        }
    }
}

#[test]
fn a_picture_on_a_mesh_is_that_of_a_camera() {
    let mut company = Company::new();
    company.settle();
    let direct = company.scene.headless.image();
    // The camera now renders into a texture, which a second one shows on a rectangle.
    let first = company.scene.camera();
    let world = company.scene.world();
    let target = Image::new_target_texture(IMAGE.x, IMAGE.y, TextureFormat::Rgba8UnormSrgb, None);
    let target = world.resource_mut::<Assets<Image>>().add(target);
    let screen = world.get::<RenderTarget>(first).expect("a target").clone();
    let camera_of = Camera { order: -1, ..default() };
    world.entity_mut(first).insert((RenderTarget::Image(target.clone().into()), camera_of));
    let mesh = world.resource_mut::<Assets<Mesh>>().add(Rectangle::new(1.0, 1.0));
    let material = StandardMaterial { base_color_texture: Some(target), unlit: true, ..default() };
    let material = world.resource_mut::<Assets<StandardMaterial>>().add(material);
    world.spawn((Mesh3d(mesh), MeshMaterial3d(material), RenderLayers::layer(3)));
    let viewport_height = 1.0;
    let projection = Projection::Orthographic(OrthographicProjection {
        scaling_mode: ScalingMode::FixedVertical { viewport_height },
        ..OrthographicProjection::default_3d()
    });
    let place = Transform::from_xyz(0.0, 0.0, 1.0);
    let plain = (Camera3d::default(), screen, Tonemapping::None, DebandDither::Disabled, Msaa::Off);
    world.spawn((plain, projection, place, RenderLayers::layer(3)));
    company.settle();
    let shown = company.scene.headless.image();
    let off = direct.iter().zip(&shown).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or_default();
    let different = shown.chunks(4).filter(|pixel| **pixel != shown[..4]).count();
    println!("{different} pixels show something, off by at most {off} bytes");
    // The picture is decoded and encoded once more.
    assert!(different > 1000 && off <= 1, "{different} pixels, off by {off} bytes");
}

#[test]
fn cameras_over_each_other_show_the_layers_of_each() {
    let mut company = Company::new();
    // The meshes go to a camera that draws over the volume's.
    let (first, volume) = (company.scene.camera(), company.scene.volume);
    let [opaque, translucent] = [company.opaque, company.translucent];
    let inside = in_world_units(Transform::from_xyz(-2.0, 0.0, -2.0));
    company.scene.world().entity_mut(opaque).insert(inside);
    company.settle();
    let both = company.scene.headless.image();
    for mesh in [opaque, translucent] {
        company.scene.world().entity_mut(mesh).insert(RenderLayers::layer(2));
    }
    let (camera, place) =
        (company.scene.headless.camera(), *company.scene.world().get::<Transform>(first).expect("a place"));
    let near = Projection::Perspective(PerspectiveProjection { near: 1e-4, ..default() });
    let over = Camera { order: 1, clear_color: ClearColorConfig::None, ..default() };
    let second = company.scene.world().spawn((camera, over, near, place, RenderLayers::layer(2))).id();
    company.settle();
    let apart = company.scene.headless.image();
    company.scene.world().entity_mut(second).despawn();
    company.settle();
    let alone = company.scene.headless.image();
    let is_red = |pixel: &[u8]| pixel[0] > 200 && pixel[1] < 100;
    let count = |image: &[u8]| image.chunks(4).filter(|pixel| is_red(pixel)).count();
    let [hidden, shown] = [count(&both), count(&apart)];
    // The box is inside the volume. Over it, all of it shows.
    assert!(shown > hidden + 100, "{hidden} pixels of the box, {shown} over the volume");
    let beside = alone.chunks(4).zip(apart.chunks(4)).filter(|(alone, apart)| alone == apart).count();
    assert!(beside > 3000, "{beside} pixels beside the meshes are as without them");
    // The volume is on no layer of the second camera, which draws it not again.
    company.scene.world().entity_mut(volume).insert(RenderLayers::layer(5));
    company.scene.headless.frames(2);
    let nothing = company.scene.headless.image();
    assert!(nothing.chunks(4).all(|pixel| *pixel == nothing[..4]), "a volume shows on no layer");
}
