//! Cargo gives a package one set of features in a build. A dev-dependency can therefore make tests differ from users'
//! builds.

use std::{
    collections::{BTreeMap, BTreeSet},
    process::Command,
};

use crate::headless::project_folder;

/// Features by package.
type Features = BTreeMap<String, BTreeSet<String>>;

/// Features that tests and examples have beyond those of users, and why they do no harm.
const ALLOWED: &[(&str, &[(&str, &str)])] = &[
    (
        "Windows and panels of the examples, as most apps have them",
        &[
            ("bevy", "bevy_window,bevy_winit,keyboard,mesh_picking,mouse,x11"),
            ("bevy_internal", "bevy_winit,keyboard,mesh_picking,mouse,x11"),
            ("bevy_input", "gamepad"),
            ("bevy_picking", "mesh_picking"),
        ],
    ),
    (
        "Bevy's anti-aliasing, which tests draw volumes with",
        &[("bevy", "bevy_anti_alias"), ("bevy_internal", "bevy_anti_alias")],
    ),
    (
        "Bevy's depth of field and fog, which read the depths of volumes",
        &[("bevy", "bevy_post_process"), ("bevy_internal", "bevy_post_process")],
    ),
    (
        "Bevy's lines of gizmos, which tests look at",
        &[("bevy", "bevy_gizmos_render"), ("bevy_internal", "bevy_gizmos_render")],
    ),
    (
        "Scenes that Bevy writes and reads, as in most apps",
        &[
            ("bevy", "bevy_world_serialization"),
            ("bevy_ecs", "serialize"),
            ("bevy_internal", "bevy_world_serialization"),
            ("indexmap", "serde"),
        ],
    ),
    (
        "Systems on several threads, as in most apps",
        &[
            ("bevy", "multi_threaded"),
            ("bevy_asset", "multi_threaded"),
            ("bevy_ecs", "multi_threaded"),
            ("bevy_internal", "multi_threaded"),
            ("bevy_render", "multi_threaded"),
            ("bevy_tasks", "multi_threaded"),
            ("bevy_transform", "multi_threaded"),
            ("downcast-rs", "sync"),
        ],
    ),
    (
        "Pictures that the examples write",
        &[
            ("bevy", "png"),
            ("bevy_image", "png,zstd,zstd_rust"),
            ("bevy_internal", "png"),
            ("image", "png"),
            ("simd-adler32", "const-generics,default,std"),
        ],
    ),
    ("Shaders written for Metal, beside what naga does otherwise", &[("naga", "msl-out")]),
    (
        "OpenGL and more of wgpu, which the headset's crate asks for; tests have Vulkan, Metal or Direct3D alone",
        &[
            ("naga", "glsl-out"),
            ("wgpu", "default,gles,parking_lot,std,vulkan-portability,web,webgpu"),
            ("wgpu-core", "gles,vulkan-portability"),
            ("wgpu-core-deps-windows-linux-android", "gles"),
            ("wgpu-hal", "gles"),
            ("wgpu-types", "web"),
        ],
    ),
    (
        "Small libraries' own additions, which nothing of ours calls",
        &[
            ("bevy_utils", "debug"),
            ("crc32fast", "default"),
            ("crossbeam-channel", "default"),
            ("hashbrown", "default-hasher"),
            ("linux-raw-sys", "system"),
            ("rustix", "system"),
            ("smol_str", "default"),
        ],
    ),
];

/// Features of all packages that these kinds of dependencies link to.
fn features(kinds: &str) -> Features {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let tree = Command::new(cargo)
        .current_dir(project_folder())
        .args([
            "tree",
            "--package",
            "bevy_contextual_ao",
            "--locked",
            "--offline",
            "--prefix",
            "none",
            "--format",
            "{p}|{f}",
            "--edges",
            kinds,
        ])
        .output()
        .expect("cargo runs");
    assert!(tree.status.success(), "{}", String::from_utf8_lossy(&tree.stderr));
    let mut features = Features::new();
    for line in String::from_utf8_lossy(&tree.stdout).lines() {
        let Some((package, of_it)) = line.split_once('|') else { continue };
        let name = package.split(" (").next().unwrap_or(package);
        // ` (*)` marks packages whose dependencies are further up.
        let of_it =
            of_it.trim_end_matches(" (*)").split(',').filter(|feature| !feature.is_empty()).map(String::from);
        features.entry(name.into()).or_default().extend(of_it);
    }
    features
}

#[test]
fn dev_dependencies_change_nothing_that_users_get() {
    let users = features("normal");
    assert!(users.keys().any(|package| package.starts_with("naga_oil v")), "it lists {users:?}");
    let mut tested = features("normal,dev");
    let mut added = Features::new();
    for (package, features) in &users {
        let tested = tested.remove(package).unwrap_or_default();
        let name = package.split(' ').next().unwrap_or(package);
        let more = tested.difference(features).cloned();
        added.entry(name.into()).or_default().extend(more);
    }
    added.retain(|_, features| !features.is_empty());
    let mut allowed = Features::new();
    for (package, features) in ALLOWED.iter().flat_map(|(_, packages)| *packages) {
        let features = features.split(',').map(String::from);
        allowed.entry((*package).into()).or_default().extend(features);
    }
    // An unneeded entry is wrong too: the list would end up allowing anything.
    assert_eq!(added, allowed, "dev-dependencies add these features (left) to packages that users get");
}
