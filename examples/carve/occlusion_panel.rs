//! Part of the panel with the settings of ambient occlusion.

use bevy::prelude::*;
use bevy_contextual_ao::{
    occlusion::{
        DensityEstimate, DensitySource, DirectionalOcclusion, GeometryTerm, MethodSettings,
        OcclusionFiltering, OcclusionSweeping, OpacityModulation, ProgressiveRays, ScreenSpaceBlur,
        ScreenSpaceOcclusion, SummedAreaOcclusion, SweepingSurface,
    },
    prelude::*,
    volume::VolumeGeometry,
};
use bevy_egui::egui::{ComboBox, Slider, Ui};

const MAX_RAYS: u32 = 512;
const MAX_STEPS: u32 = 100;
const MAX_SHELLS: u32 = 20;
/// Ranges of lengths, voxels.
const STEP_VOXELS: [f32; 2] = [0.1, 10.0];
const RADIUS_VOXELS: [f32; 2] = [1.0, 60.0];
const BIAS_VOXELS: [f32; 2] = [0.0, 5.0];

/// A slider for a length, whose range follows the size of a voxel. The length is set when the slider is moved. Until
/// then the slider shows `unset_mm`.
fn length_slider(
    ui: &mut Ui,
    text: &str,
    length_mm: &mut Option<f32>,
    unset_mm: f64,
    [least, most]: [f32; 2],
    geometry: &VolumeGeometry,
) {
    let voxel_mm = geometry.spacing_mm.min_element() as f32;
    let mut shown_mm = length_mm.unwrap_or(unset_mm as f32);
    let range = least * voxel_mm..=most * voxel_mm;
    if ui.add(Slider::new(&mut shown_mm, range).logarithmic(least > 0.0).text(text)).changed() {
        *length_mm = Some(shown_mm);
    }
}

/// Shows the settings. Isovalues come from the transfer function; ranges of lengths follow the volume's voxels.
pub fn show(
    ui: &mut Ui,
    mut occlusion: Mut<AmbientOcclusion>,
    function: Option<&TransferFunction>,
    geometry: &VolumeGeometry,
) {
    let mut new = occlusion.clone();
    ComboBox::from_label("method").selected_text(new.method.name()).show_ui(ui, |ui| {
        for method in OcclusionMethod::all() {
            let is_chosen = method.name() == new.method.name();
            if ui.selectable_label(is_chosen, method.name()).clicked() && !is_chosen {
                new.method = method;
            }
        }
    });
    match &mut new.method {
        OcclusionMethod::Rays(rays) => show_rays(ui, rays, &mut new.sky, geometry),
        OcclusionMethod::Progressive(ProgressiveRays { rays, rays_per_frame, kept_on_change }) => {
            ui.add(Slider::new(rays_per_frame, 1..=64).logarithmic(true).text("rays a frame"));
            ui.add(Slider::new(kept_on_change, 0.0..=1.0).text("kept on change"));
            show_rays(ui, rays, &mut new.sky, geometry);
        }
        OcclusionMethod::Sweeping(sweeping) => {
            show_surface(ui, &mut sweeping.surface, function);
            show_sweeping(ui, sweeping);
            show_sky(ui, &mut new.sky);
        }
        OcclusionMethod::Filtering(filtering) => show_filtering(ui, filtering, geometry),
        OcclusionMethod::SummedArea(boxes) => show_summed_area(ui, boxes, geometry),
        OcclusionMethod::ScreenSpace(screen) => show_screen_space(ui, screen, geometry),
        OcclusionMethod::Directional(directional) => show_directional(ui, directional),
        _ => {}
    }
    // Any change restarts the computation.
    occlusion.set_if_neq(new);
}

fn show_rays(ui: &mut Ui, new: &mut OcclusionRays, sky: &mut Sky, geometry: &VolumeGeometry) {
    let rays = new.pattern.rays();
    let patterns = [
        RayPattern::Neighborhood6,
        RayPattern::Neighborhood14,
        RayPattern::Neighborhood26,
        RayPattern::Rubik54,
        RayPattern::Sphere512,
        // Has as many rays as the current pattern.
        RayPattern::Fibonacci(rays),
    ];
    let name = |pattern: RayPattern| match pattern {
        RayPattern::Fibonacci(_) => "fibonacci".into(),
        pattern => pattern.to_string(),
    };
    ComboBox::from_label("ray pattern").selected_text(name(new.pattern)).show_ui(ui, |ui| {
        for pattern in patterns {
            ui.selectable_value(&mut new.pattern, pattern, name(pattern));
        }
    });
    if let RayPattern::Fibonacci(rays) = &mut new.pattern {
        ui.add(Slider::new(rays, 1..=MAX_RAYS).logarithmic(true).text("rays"));
    }
    ui.add(Slider::new(&mut new.steps, 1..=MAX_STEPS).text("steps"));
    let unset_mm = new.step_length_mm(geometry);
    length_slider(ui, "step, mm", &mut new.step_mm, unset_mm, STEP_VOXELS, geometry);
    let mut is_half = new.resolution == OcclusionResolution::Half;
    ui.checkbox(&mut is_half, "half resolution");
    new.resolution = if is_half { OcclusionResolution::Half } else { OcclusionResolution::Full };
    show_sky(ui, sky);
}

/// Chooses an even sky, or a cloudy sky on one side of the patient.
fn show_sky(ui: &mut Ui, sky: &mut Sky) {
    ui.horizontal_wrapped(|ui| {
        ui.label("light from");
        ui.selectable_value(sky, Sky::default(), "all sides");
        let sides = [
            ("left", Vec3::X),
            ("right", Vec3::NEG_X),
            ("above", Vec3::Y),
            ("below", Vec3::NEG_Y),
            ("front", Vec3::Z),
            ("back", Vec3::NEG_Z),
        ];
        for (name, side) in sides {
            ui.selectable_value(sky, Sky::above(side), name);
        }
    });
}

/// Chooses the surface that stops the light, and whether it alone is drawn.
fn show_surface(ui: &mut Ui, surface: &mut SweepingSurface, function: Option<&TransferFunction>) {
    let guessed = function.and_then(TransferFunction::isovalue).unwrap_or_default();
    let value = surface.isovalue().unwrap_or(guessed);
    ui.horizontal_wrapped(|ui| {
        ui.selectable_value(surface, SweepingSurface::Opacity, "opacity");
        ui.selectable_value(surface, SweepingSurface::Isovalue(value), "isovalue");
        ui.selectable_value(surface, SweepingSurface::Isosurface(value), "isosurface alone");
    });
    if let SweepingSurface::Isovalue(value) | SweepingSurface::Isosurface(value) = surface {
        let points = function.map(|function| &function.points[..]);
        let ends = points.and_then(|points| Some(points.first()?.value..=points.last()?.value));
        ui.add(Slider::new(value, ends.unwrap_or(guessed..=guessed)).text("isovalue"));
    }
}

fn show_sweeping(ui: &mut Ui, sweeping: &mut OcclusionSweeping) {
    ui.horizontal_wrapped(|ui| {
        ui.label("geometry term");
        ui.selectable_value(&mut sweeping.geometry_term, GeometryTerm::None, "none");
        ui.selectable_value(&mut sweeping.geometry_term, GeometryTerm::Cosine, "cosine");
        ui.selectable_value(&mut sweeping.geometry_term, GeometryTerm::BothSides, "both sides");
    });
    ui.add(Slider::new(&mut sweeping.opacity, 0.0..=1.0).text("opacity"));
    ui.add(Slider::new(&mut sweeping.gamma, 0.5..=4.0).text("gamma"));
}

fn show_filtering(ui: &mut Ui, filtering: &mut OcclusionFiltering, geometry: &VolumeGeometry) {
    ui.horizontal_wrapped(|ui| {
        ui.selectable_value(&mut filtering.estimate, DensityEstimate::Chebyshev, "Chebyshev");
        ui.selectable_value(&mut filtering.estimate, DensityEstimate::Power, "power");
        ui.selectable_value(&mut filtering.estimate, DensityEstimate::Gaussian, "Gaussian");
        ui.selectable_value(&mut filtering.estimate, DensityEstimate::ChebyshevOpen, "Chebyshev, open");
    });
    ui.horizontal_wrapped(|ui| {
        ui.label("of the");
        ui.selectable_value(&mut filtering.density, DensitySource::Opacity, "opacity");
        ui.selectable_value(&mut filtering.density, DensitySource::Intensity, "intensity");
    });
    let unset_mm = filtering.radius_length_mm(geometry);
    length_slider(ui, "radius, mm", &mut filtering.radius_mm, unset_mm, RADIUS_VOXELS, geometry);
    ui.add(Slider::new(&mut filtering.brightness, 0.2..=4.0).text("brightness"));
    let threshold = match filtering.modulation {
        OpacityModulation::Variance(threshold) | OpacityModulation::Gradient(threshold) => threshold,
        _ => 0.05,
    };
    ui.horizontal_wrapped(|ui| {
        ui.label("fades by");
        ui.selectable_value(&mut filtering.modulation, OpacityModulation::None, "nothing");
        ui.selectable_value(&mut filtering.modulation, OpacityModulation::Variance(threshold), "variance");
        ui.selectable_value(&mut filtering.modulation, OpacityModulation::Gradient(threshold), "gradient");
    });
    if let OpacityModulation::Variance(threshold) | OpacityModulation::Gradient(threshold) =
        &mut filtering.modulation
    {
        ui.add(Slider::new(threshold, 0.001..=0.5).logarithmic(true).text("below"));
    }
}

fn show_summed_area(ui: &mut Ui, boxes: &mut SummedAreaOcclusion, geometry: &VolumeGeometry) {
    let unset_mm = boxes.radius_length_mm(geometry);
    length_slider(ui, "radius, mm", &mut boxes.radius_mm, unset_mm, RADIUS_VOXELS, geometry);
    ui.add(Slider::new(&mut boxes.shells, 1..=MAX_SHELLS).text("shells"));
}

fn show_screen_space(ui: &mut Ui, screen: &mut ScreenSpaceOcclusion, geometry: &VolumeGeometry) {
    ui.add(Slider::new(&mut screen.opacity_threshold, 0.01..=1.0).text("opacity threshold"));
    let [radius_mm, bias_mm] = screen.lengths_mm(geometry);
    length_slider(ui, "radius, mm", &mut screen.radius_mm, radius_mm, RADIUS_VOXELS, geometry);
    length_slider(ui, "bias, mm", &mut screen.bias_mm, bias_mm, BIAS_VOXELS, geometry);
    let samples = 1..=ScreenSpaceOcclusion::MAX_SAMPLES;
    ui.add(Slider::new(&mut screen.samples, samples).logarithmic(true).text("samples"));
    ui.horizontal_wrapped(|ui| {
        ui.label("blur");
        ui.selectable_value(&mut screen.blur, ScreenSpaceBlur::None, "none");
        ui.selectable_value(&mut screen.blur, ScreenSpaceBlur::Gaussian, "Gaussian");
        ui.selectable_value(&mut screen.blur, ScreenSpaceBlur::Even, "even");
    });
}

fn show_directional(ui: &mut Ui, directional: &mut DirectionalOcclusion) {
    ui.add(Slider::new(&mut directional.aperture_degrees, 1.0..=89.0).text("aperture, degrees"));
    ui.add(
        Slider::new(&mut directional.samples, 1..=DirectionalOcclusion::MAX_SAMPLES)
            .text("samples along a side"),
    );
    ui.add(Slider::new(&mut directional.slice_voxels, 0.25..=4.0).text("slice, voxels"));
    ui.checkbox(&mut directional.exact_distance, "exact distance");
}
