//! Scenes, clones and inspectors: settings go with their entities and can be edited live, and nothing derived is kept.

mod clones;
mod edits;
mod scenes;

use bevy::{
    ecs::reflect::{AppTypeRegistry, ReflectComponent, ReflectResource},
    prelude::*,
    reflect::{TypeRegistration, TypeRegistry},
};
use bevy_contextual_ao::ContextualAoPlugin;
use std::{collections::BTreeMap, fs, path::Path};
use syn::{Item, Visibility as SynVisibility};

use crate::headless::project_folder;

/// Public components and resources that are no settings: what is derived, measured or lives on the GPU.
const DERIVED: [&str; 10] = [
    "ClipCamera",
    "DicomLoads",
    "HeldBy",
    "Holds",
    "ListedBricks",
    "LookupTable",
    "OcclusionReady",
    "PlanTime",
    "RenderStatus",
    "VolumeStore",
];

/// Whether a type is one of this crate.
fn is_ours(registration: &TypeRegistration) -> bool {
    registration.type_info().type_path().starts_with("bevy_contextual_ao::")
}

/// Types that scenes keep and inspectors edit.
fn kept_types(registry: &TypeRegistry) -> impl Iterator<Item = &TypeRegistration> {
    registry.iter().filter(|registration| {
        is_ours(registration)
            && (registration.data::<ReflectComponent>().is_some()
                || registration.data::<ReflectResource>().is_some())
    })
}

/// Public structs that derive a component or a resource, by name, with the file.
fn public_types(folder: &Path, found: &mut BTreeMap<String, String>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("a file").path();
        if path.is_dir() {
            public_types(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let source = fs::read_to_string(&path).expect("a source");
            let file = syn::parse_file(&source).expect("Rust");
            let structs = file.items.iter().filter_map(|item| match item {
                Item::Struct(item) if matches!(item.vis, SynVisibility::Public(_)) => Some(item),
                _ => None,
            });
            for item in structs {
                let derives = |name: &str| {
                    item.attrs.iter().filter(|attribute| attribute.path().is_ident("derive")).any(|derive| {
                        let mut has = false;
                        let _ = derive.parse_nested_meta(|meta| {
                            has |= meta.path.is_ident(name);
                            Ok(())
                        });
                        has
                    })
                };
                if derives("Component") || derives("Resource") {
                    found.insert(item.ident.to_string(), path.display().to_string());
                }
            }
        }
    }
}

#[test]
fn every_setting_is_registered_with_its_default_and_nothing_else_is() {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, AssetPlugin::default(), bevy::mesh::MeshPlugin, ContextualAoPlugin));
    let registry = app.world().resource::<AppTypeRegistry>().read();
    // Scenes tell volumes' boxes by it.
    let mark = "BoxMark";
    let kept: BTreeMap<_, _> = kept_types(&registry)
        .map(|registration| {
            (registration.type_info().type_path_table().ident().expect("a name"), registration)
        })
        .collect();
    let mut public = BTreeMap::new();
    public_types(&project_folder().join("src"), &mut public);
    assert!(public.len() > 15, "{public:?}");
    for (name, file) in &public {
        let is_derived = DERIVED.contains(&name.as_str());
        assert_eq!(kept.contains_key(name.as_str()), !is_derived, "{name} in {file}");
    }
    for derived in DERIVED {
        assert!(public.contains_key(derived), "there is no {derived}");
    }
    for (name, registration) in kept {
        assert!(public.contains_key(name) || name == mark, "{name} is not public");
        assert!(registration.data::<ReflectDefault>().is_some(), "{name} has no default");
        assert!(registration.data::<ReflectFromReflect>().is_some(), "{name} cannot be read");
    }
}
