//! Every variant of every compute shader composes, validates, and is written for other devices, without a device.
//! This includes variants that the device at hand would not use. `drawing` draws the variants of `drawing/volume.wgsl`,
//! `outlines` those of `drawing/outline_colors.wgsl`, `depth` those of `drawing/depth.wgsl`, `antialiasing` those of
//! `drawing/motion_vectors.wgsl`. `directional` draws those of `directional/composite.wgsl`, which imports Bevy's shaders.
//! `languages` writes them all.

use naga::{Binding, BuiltIn};
use naga_oil::compose::{
    ComposableModuleDescriptor, Composer, NagaModuleDescriptor, ShaderDefValue, ShaderLanguage, ShaderType,
};
use std::{collections::HashMap, path::Path};

use crate::{headless::project_folder, languages};

macro_rules! sources {
    ($($name:literal),* $(,)?) => {
        [$(($name, include_str!(concat!("../../src/render/", $name)))),*]
    };
}

/// Libraries, each after those that it imports.
const LIBRARIES: [(&str, &str); 36] = sources![
    "volumes/bindings.wgsl",
    "volumes/reconstruction.wgsl",
    "volumes/gradients.wgsl",
    "volumes/classification.wgsl",
    "volumes/preintegration.wgsl",
    "volumes/bricks.wgsl",
    "volumes/superbricks.wgsl",
    "volumes/brick_bindings.wgsl",
    "volumes/voxel_masks.wgsl",
    "volumes/work_list.wgsl",
    "volumes/listed.wgsl",
    "methods/rays/cast_state.wgsl",
    "methods/rays/running_mean.wgsl",
    "clipping/clip_test.wgsl",
    "volumes/clip_pass.wgsl",
    "clipping/changes.wgsl",
    "clipping/coverage.wgsl",
    "clipping/emptiness.wgsl",
    "views/window.wgsl",
    "views/view_ray.wgsl",
    "views/runs.wgsl",
    "views/lit_slices.wgsl",
    "views/next_run.wgsl",
    "views/stop.wgsl",
    "clipping/density.wgsl",
    "methods/filtering/voxel_lines.wgsl",
    "methods/filtering/voxel_density.wgsl",
    "views/cut_surface.wgsl",
    "views/orientation.wgsl",
    "views/marched_view.wgsl",
    "views/seen.wgsl",
    "methods/screen_space/bindings.wgsl",
    "methods/sweeping/sweeping.wgsl",
    "views/shading.wgsl",
    "methods/sweeping/octants.wgsl",
    "methods/sweeping/surface_ray.wgsl",
];

const ENTRIES: [(&str, &str); 34] = sources![
    "carvers/clip_draw.wgsl",
    "carvers/count_surfaces.wgsl",
    "carvers/peel.wgsl",
    "carvers/dilate.wgsl",
    "clipping/ranges.wgsl",
    "clipping/static_distances.wgsl",
    "clipping/cull_superbricks.wgsl",
    "clipping/cull_bricks.wgsl",
    "clipping/clip.wgsl",
    "clipping/expire.wgsl",
    "clipping/distances.wgsl",
    "views/march.wgsl",
    "views/outlines.wgsl",
    "methods/rays/mark.wgsl",
    "methods/rays/fill.wgsl",
    "methods/rays/go_on.wgsl",
    "methods/rays/share.wgsl",
    "methods/rays/filter_probe.wgsl",
    "methods/rays/cast.wgsl",
    "methods/filtering/densities.wgsl",
    "methods/filtering/means.wgsl",
    "methods/filtering/extrema.wgsl",
    "methods/filtering/estimate.wgsl",
    "methods/filtering/gradient.wgsl",
    "methods/summed_area/table.wgsl",
    "methods/summed_area/boxes.wgsl",
    "methods/screen_space/opaque_surface.wgsl",
    "methods/screen_space/volume_surface.wgsl",
    "methods/screen_space/occlusion.wgsl",
    "methods/directional/slices.wgsl",
    "methods/sweeping/isosurface.wgsl",
    "methods/sweeping/sweep.wgsl",
    "methods/sweeping/collect.wgsl",
    "methods/sweeping/surface.wgsl",
];

/// Shaders that import Bevy's shaders, and are drawn in tests.
const DRAWN: [&str; 2] = ["methods/directional/composite.wgsl", "methods/screen_space/darken.wgsl"];

/// Definitions with which an entry is compiled, in all combinations.
fn definitions_of(name: &str) -> &'static [&'static str] {
    match name {
        "carvers/clip_draw.wgsl" => &["COUNT", "COMPARE"],
        "carvers/peel.wgsl" => &["SEVERAL_LAYERS"],
        "carvers/dilate.wgsl" => &["REDUCE"],
        "clipping/clip.wgsl" => &["STORE_R8", "BY_GRADIENT"],
        "views/march.wgsl" => &["TRICUBIC", "BY_GRADIENT"],
        "methods/directional/slices.wgsl" => &["MULTISAMPLED", "BY_GRADIENT"],
        "clipping/static_distances.wgsl" => &["OCCUPY"],
        "clipping/distances.wgsl" => &["FIND_SEEN"],
        "methods/sweeping/sweep.wgsl" => &["LIGHT", "DISTANCES"],
        "methods/sweeping/collect.wgsl" => &["OCTANTS", "STORE_R8"],
        "methods/rays/fill.wgsl" => &["STORE_R8"],
        "methods/rays/cast.wgsl" => &["STORE_R8", "GRID_BORDER", "COUNT_WORK", "PROGRESSIVE"],
        "methods/filtering/means.wgsl" => &["OF_DENSITIES", "SQUARES"],
        "methods/filtering/extrema.wgsl" => &["OF_DENSITIES"],
        "methods/filtering/estimate.wgsl" => &["STORE_R8", "MODULATED", "SHARES"],
        "methods/summed_area/boxes.wgsl" => &["STORE_R8"],
        "methods/screen_space/opaque_surface.wgsl" => &["DEPTH", "DEPTH_MULTISAMPLED"],
        "methods/screen_space/volume_surface.wgsl" => &["BY_GRADIENT"],
        "methods/screen_space/occlusion.wgsl" => &["STORE_R8"],
        _ => &[],
    }
}

/// Whether a pass runs along an axis.
fn has_axis(name: &str) -> bool {
    matches!(
        name,
        "clipping/static_distances.wgsl"
            | "methods/filtering/means.wgsl"
            | "methods/filtering/extrema.wgsl"
            | "methods/summed_area/table.wgsl"
    )
}

/// Shaders in a folder of passes and its subfolders, by their paths within the folder.
fn shaders_in(folder: &Path, path: &str, found: &mut Vec<String>) {
    for file in std::fs::read_dir(folder).expect("a folder of passes") {
        let file = file.expect("a file in it").path();
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if file.is_dir() {
            shaders_in(&file, &format!("{path}{name}/"), found);
        } else if name.ends_with(".wgsl") {
            found.push(format!("{path}{name}"));
        }
    }
}

#[test]
fn every_variant_composes_validates_and_is_written_for_other_devices() {
    let mut shaders = Vec::new();
    shaders_in(&project_folder().join("src/render"), "", &mut shaders);
    shaders.sort_unstable();
    let mut listed: Vec<_> = LIBRARIES.iter().chain(&ENTRIES).map(|(name, _)| *name).collect();
    listed.extend(DRAWN);
    listed.sort_unstable();
    assert_eq!(shaders, listed, "not all shaders are checked here");
    for entry in ENTRIES {
        let optional = definitions_of(entry.0);
        for chosen in 0..1u32 << optional.len() {
            let names = optional.iter().enumerate().filter(|(bit, _)| chosen >> bit & 1 == 1);
            let mut definitions: HashMap<String, ShaderDefValue> =
                names.map(|(_, name)| (name.to_string(), ShaderDefValue::Bool(true))).collect();
            definitions.insert("VOLUME_BIND_GROUP".into(), ShaderDefValue::UInt(0));
            definitions.insert("RUNS_BIND_GROUP".into(), ShaderDefValue::UInt(1));
            for axis in 0..if has_axis(entry.0) { 3 } else { 1 } {
                definitions.insert("AXIS".into(), ShaderDefValue::UInt(axis));
                let written =
                    compose(entry, definitions.clone()).and_then(|module| languages::write(&module));
                if let Err(error) = written {
                    panic!("{} with {definitions:?}: {error}", entry.0);
                }
            }
        }
    }
}

/// Composes a shader; naga_oil also validates it.
fn compose(
    (file_path, source): (&str, &str),
    shader_defs: HashMap<String, ShaderDefValue>,
) -> Result<naga::Module, String> {
    let mut composer = Composer::default();
    for (file_path, source) in LIBRARIES {
        let module = ComposableModuleDescriptor {
            source,
            file_path,
            language: ShaderLanguage::Wgsl,
            shader_defs: shader_defs.clone(),
            ..Default::default()
        };
        let added = composer.add_composable_module(module).map(|_| ());
        added.map_err(|error| error.emit_to_string(&composer))?;
    }
    composer
        .make_naga_module(NagaModuleDescriptor {
            source,
            file_path,
            shader_type: ShaderType::Wgsl,
            shader_defs,
            ..Default::default()
        })
        .map_err(|error| error.emit_to_string(&composer))
}

/// Direct3D 12 gives an indirect dispatch no number of workgroups, if wgpu does not validate its arguments: it reads 0.
#[test]
fn passes_over_lists_do_not_ask_for_the_number_of_workgroups() {
    let over_lists: Vec<_> =
        ENTRIES.into_iter().filter(|(_, source)| source.contains("listed_item(")).collect();
    assert!(over_lists.len() >= 3, "{} passes run over lists", over_lists.len());
    for entry in over_lists {
        let definitions = HashMap::from(
            [("VOLUME_BIND_GROUP", 0), ("RUNS_BIND_GROUP", 1)]
                .map(|(name, group)| (name.into(), ShaderDefValue::UInt(group))),
        );
        let module = compose(entry, definitions).expect("a shader");
        let arguments = module.entry_points.iter().flat_map(|entry_point| &entry_point.function.arguments);
        let asks = |binding: &Option<Binding>| *binding == Some(Binding::BuiltIn(BuiltIn::NumWorkGroups));
        assert!(!arguments.into_iter().any(|argument| asks(&argument.binding)), "{}", entry.0);
    }
}
