//! Every variant of every compute shader composes and validates, without a device: those too that
//! the device at hand would not use. The material's variants are drawn in `drawing`.

use naga_oil::compose::{
    ComposableModuleDescriptor, Composer, NagaModuleDescriptor, ShaderDefValue, ShaderLanguage, ShaderType,
};
use std::collections::HashMap;

/// A shader that is compiled with every combination of its definitions.
struct Entry {
    name: &'static str,
    source: &'static str,
    definitions: &'static [&'static str],
}

const LIBRARIES: [(&str, &str); 4] = [
    ("volume_bindings.wgsl", include_str!("../../src/render/volume_bindings.wgsl")),
    ("clip_test.wgsl", include_str!("../../src/render/clip_test.wgsl")),
    ("occlusion_pass.wgsl", include_str!("../../src/render/occlusion_pass.wgsl")),
    ("coverage.wgsl", include_str!("../../src/render/coverage.wgsl")),
];

const ENTRIES: [Entry; 6] = [
    Entry {
        name: "clip_draw.wgsl",
        source: include_str!("../../src/render/clip_draw.wgsl"),
        definitions: &["COUNT", "COMPARE"],
    },
    Entry {
        name: "count_surfaces.wgsl",
        source: include_str!("../../src/render/count_surfaces.wgsl"),
        definitions: &[],
    },
    Entry {
        name: "peel.wgsl",
        source: include_str!("../../src/render/peel.wgsl"),
        definitions: &["SEVERAL_LAYERS"],
    },
    Entry {
        name: "dilate.wgsl",
        source: include_str!("../../src/render/dilate.wgsl"),
        definitions: &["REDUCE"],
    },
    Entry {
        name: "classify.wgsl",
        source: include_str!("../../src/render/classify.wgsl"),
        definitions: &["STORE_R8"],
    },
    Entry {
        name: "ray_cast.wgsl",
        source: include_str!("../../src/render/ray_cast.wgsl"),
        definitions: &["STORE_R8", "GRID_BORDER", "COUNT_WORK"],
    },
];

#[test]
fn every_variant_composes_and_validates() {
    for entry in &ENTRIES {
        for chosen in 0..1u32 << entry.definitions.len() {
            let names = entry.definitions.iter().enumerate().filter(|(bit, _)| chosen >> bit & 1 == 1);
            let mut definitions: HashMap<String, ShaderDefValue> =
                names.map(|(_, name)| (name.to_string(), ShaderDefValue::Bool(true))).collect();
            definitions.insert("VOLUME_BIND_GROUP".into(), ShaderDefValue::UInt(0));
            if let Err(error) = compose(entry, definitions.clone()) {
                panic!("{} with {definitions:?}: {error}", entry.name);
            }
        }
    }
}

/// Composes and, as naga_oil does, validates.
fn compose(entry: &Entry, shader_defs: HashMap<String, ShaderDefValue>) -> Result<(), String> {
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
            source: entry.source,
            file_path: entry.name,
            shader_type: ShaderType::Wgsl,
            shader_defs,
            ..Default::default()
        })
        .map(|_| ())
        .map_err(|error| error.emit_to_string(&composer))
}
