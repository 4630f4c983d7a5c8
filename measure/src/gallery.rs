//! One scene by every method, side by side.

use bevy::prelude::*;
use bevy_contextual_ao::{
    occlusion::{GeometryTerm, OcclusionSweeping, ScreenSpaceOcclusion, SweepingSurface},
    prelude::*,
    volume::VolumeGeometry,
};
use contextual_ao_kit::mode::ShadingMode;
use plotters::prelude::{BitMapBackend, DrawingBackend, IntoFont, IntoTextStyle, RGBColor};

use crate::Options;
use contextual_ao_kit::{font, headless::Headless, scene::SceneOptions, stability::methods};

/// Number of pictures in a row.
const COLUMNS: u32 = 4;
/// Height of the letters, and of the strip that they stand in, pixels.
const LETTERS: u32 = 20;
const STRIP: u32 = 30;

/// Writes the picture.
pub fn run(options: &Options) -> Result<(), String> {
    std::fs::create_dir_all(&options.out).map_err(|error| format!("{}: {error}", options.out.display()))?;
    let path = options.out.join("methods.png");
    render(options)?.save(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    println!("{}", path.display());
    Ok(())
}

/// Renders the scene by every method, and unshaded and lit without occlusion, into one image.
fn render(options: &Options) -> Result<image::RgbImage, String> {
    let mut shown =
        vec![("no occlusion", ShadingMode::Solid, None), ("Blinn-Phong", ShadingMode::Phong, None)];
    let geometry = VolumeGeometry::of(&options.scene.parts()?.volume);
    let columns = methods::columns().into_iter().map(|column| match column.occlusion.method {
        OcclusionMethod::ScreenSpace(_) => {
            let recommended = OcclusionMethod::ScreenSpace(ScreenSpaceOcclusion::recommended(&geometry));
            ("screen space as in VTK", AmbientOcclusion::by(recommended))
        }
        _ => (column.name, column.occlusion),
    });
    let methods = columns.chain(isosurfaces(&options.scene)?);
    shown.extend(methods.map(|(name, occlusion)| (name, ShadingMode::Cao, Some(occlusion))));
    let mut pictures = Vec::new();
    for (name, mode, occlusion) in shown {
        eprintln!("{name}");
        pictures.push((name, picture(&options.scene, mode, occlusion.as_ref())?));
    }
    compose(&pictures, options.scene.size)
}

/// Settings for the isosurface of the scene's transfer function, as the paper on sweeping draws it, in all its
/// lights.
fn isosurfaces(options: &SceneOptions) -> Result<[(&'static str, AmbientOcclusion); 6], String> {
    let parts = options.parts()?;
    let isovalue = parts.transfer_function.as_ref().and_then(TransferFunction::isovalue);
    let surface = SweepingSurface::Isosurface(isovalue.unwrap_or_default());
    let swept = |sky, geometry_term, opacity| {
        let sweeping = OcclusionSweeping { surface, geometry_term, opacity, ..default() };
        AmbientOcclusion { method: OcclusionMethod::Sweeping(sweeping), sky, ..default() }
    };
    let above = Sky::above(Vec3::Y);
    // The light comes from above and from one side of the viewer.
    let light = Quat::from_rotation_y(0.8) * parts.camera.with_y(parts.camera.length());
    let octant = light.cmpgt(Vec3::ZERO).bitmask() as usize;
    let lit_from = |light: Vec3, geometry_term, opacity| {
        let sweeping = OcclusionSweeping { surface, geometry_term, opacity, light: Some(light), ..default() };
        AmbientOcclusion::by(sweeping)
    };
    let behind = -parts.camera;
    Ok([
        ("isosurface, swept", swept(default(), GeometryTerm::Cosine, 1.0)),
        ("cloudy sky", swept(above, GeometryTerm::Cosine, 1.0)),
        ("light from one octant", swept(Sky::octant(octant), GeometryTerm::Cosine, 1.0)),
        ("translucent", swept(default(), GeometryTerm::BothSides, 0.2)),
        ("one light, turned grid", lit_from(light, GeometryTerm::Cosine, 1.0)),
        ("translucent, lit from behind", lit_from(behind, GeometryTerm::BothSides, 0.1)),
    ])
}

/// Renders the scene by the method and at the resolution of some settings.
fn picture(
    options: &SceneOptions,
    mode: ShadingMode,
    settings: Option<&AmbientOcclusion>,
) -> Result<Vec<u8>, String> {
    let mut headless = Headless::new(options.size, |app| {
        app.insert_resource(ClearColor(Color::srgb(0.06, 0.07, 0.08)));
    });
    let scene = options.spawn(&mut headless)?;
    let world = headless.app.world_mut();
    let mut frames = 2;
    if let (Some(mut occlusion), Some(settings)) = (world.get_mut::<AmbientOcclusion>(scene.volume), settings)
    {
        *occlusion = settings.clone();
        if let OcclusionMethod::Progressive(progressive) = settings.method {
            // Only some of the rays: shows the image on the way.
            frames = progressive.rays.pattern.rays() / 4;
        }
    }
    headless.set_mode(scene.volume, mode);
    headless.until_ready(scene.volume)?;
    headless.frames(frames);
    Ok(headless.image())
}

/// Puts named pictures of one size into a sheet.
pub fn compose(pictures: &[(&str, Vec<u8>)], size: UVec2) -> Result<image::RgbImage, String> {
    let rows = (pictures.len() as u32).div_ceil(COLUMNS);
    let (width, height) = (COLUMNS * size.x, rows * (size.y + STRIP));
    let mut sheet = image::RgbImage::from_pixel(width, height, image::Rgb([255; 3]));
    let corner = |k: usize| UVec2::new(k as u32 % COLUMNS * size.x, k as u32 / COLUMNS * (size.y + STRIP));
    for (k, (_, pixels)) in pictures.iter().enumerate() {
        let corner = corner(k);
        for (place, pixel) in (0..).zip(pixels.chunks(4)) {
            let (x, y) = (corner.x + place % size.x, corner.y + STRIP + place / size.x);
            sheet.put_pixel(x, y, image::Rgb([pixel[0], pixel[1], pixel[2]]));
        }
    }
    font::register()?;
    let mut backend = BitMapBackend::with_buffer(&mut sheet, (width, height));
    let style = (font::NAME, f64::from(LETTERS))
        .into_font()
        .color(&RGBColor(20, 20, 20))
        .into_text_style(&(width, height));
    for (k, (name, _)) in pictures.iter().enumerate() {
        let corner = corner(k);
        let place = (corner.x as i32 + 8, corner.y as i32 + 5);
        backend.draw_text(name, &style, place).map_err(|error| error.to_string())?;
    }
    drop(backend);
    Ok(sheet)
}
