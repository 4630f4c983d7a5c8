//! Tests that shared structs and constants agree in Rust and WGSL. Structs are compared member by member, by name,
//! type and offset, so that two members of one type cannot be swapped.

use bevy::render::render_resource::{ShaderType, encase::private::StructMetadata};
use naga::{ArraySize, Handle, Module, Scalar, ScalarKind, StructMember, Type, TypeInner};
use std::{collections::BTreeSet, fs, path::Path};

use super::{
    carvers::{
        clip_textures::{PEEL_BYTES_PER_TEXEL, TEXELS_PER_TILE},
        dilate::DilationUniform,
        peel::LayerRangeUniform,
    },
    gpu::compute_pass::{LIST_HEAD, ListEnd, WIDTH},
    methods::{
        FilteringData, KernelUniform, Part, RayPassUniform, SIDE, SLICE_TILE, ScreenSpaceUniform, Shell,
        SlicingData, SweepPlane, SweepingUniform,
    },
    views::{
        dispatch::{VIEWS_AT_ONCE, ViewArray},
        outline_lists::{COLOR_WORDS, OUTLINE_HEAD, ROW},
        runs::MarchedViewUniform,
    },
    volumes::{
        bricks::{MASKS, PENDING},
        carver_uniform::{CarverUniform, OPERATION_INTERSECT, OPERATION_REGION, OPERATION_SUBTRACT},
        clip_pass::{ClipPassUniform, Queue},
        store::VoxelMask,
        uniform::{CARVER_BITS, VolumeUniform},
    },
    windows::WindowUniform,
};
use crate::{
    clip::{CoverageRule, MAX_CARVERS},
    occlusion::{DensityEstimate, OcclusionSweeping},
};

const BINDINGS: &str = include_str!("volumes/bindings.wgsl");
const BRICKS: &str = include_str!("volumes/bricks.wgsl");
const PASS: &str = include_str!("volumes/clip_pass.wgsl");
const WORK_LIST: &str = include_str!("volumes/work_list.wgsl");
const DILATE: &str = include_str!("carvers/dilate.wgsl");
const FILTERING: &str = include_str!("methods/filtering/voxel_lines.wgsl");
const MARCHED_VIEW: &str = include_str!("views/marched_view.wgsl");
const OUTLINE_COLORS: &str = include_str!("../drawing/outline_colors.wgsl");
const SWEEP: &str = include_str!("methods/sweeping/sweep.wgsl");
const SLICES: &str = include_str!("methods/directional/slices.wgsl");
const OCTANTS: &str = include_str!("methods/sweeping/octants.wgsl");

/// Name, Rust type and offset of a struct's member.
type Member = (String, String, u64);

/// Size and members of a struct.
type Layout = (u64, Vec<Member>);

/// A struct that is defined in both Rust and WGSL.
struct Shared {
    rust: String,
    wgsl: &'static str,
    size: u64,
    offsets: Vec<u64>,
}

fn shared<T: ShaderType<ExtraMetadata = StructMetadata<N>>, const N: usize>(wgsl: &'static str) -> Shared {
    let path = core::any::type_name::<T>();
    Shared {
        rust: path.rsplit("::").next().unwrap_or(path).into(),
        wgsl,
        size: T::min_size().get(),
        offsets: (0..N).map(|member| T::METADATA.offset(member)).collect(),
    }
}

/// All shared structs. A test checks that none is missing.
fn all_shared() -> [Shared; 16] {
    [
        shared::<VolumeUniform, _>("VolumeUniform"),
        shared::<CarverUniform, _>("Carver"),
        shared::<ClipPassUniform, _>("ClipPass"),
        shared::<RayPassUniform, _>("RayPass"),
        shared::<FilteringData, _>("Filtering"),
        shared::<Shell, _>("Shell"),
        shared::<ScreenSpaceUniform, _>("ScreenSpaceView"),
        shared::<KernelUniform, _>("Kernel"),
        shared::<WindowUniform, _>("Window"),
        shared::<MarchedViewUniform, _>("MarchedView"),
        shared::<Part, _>("Part"),
        shared::<SlicingData, _>("Slicing"),
        shared::<SweepingUniform, _>("Sweeping"),
        shared::<SweepPlane, _>("Plane"),
        shared::<LayerRangeUniform, _>("LayerRange"),
        shared::<DilationUniform, _>("Dilation"),
    ]
}

/// Texts of all files in `src` whose names have this ending.
fn sources(ending: &str) -> Vec<String> {
    let project = std::env::var("CARGO_MANIFEST_DIR");
    let project = project.as_deref().unwrap_or(env!("CARGO_MANIFEST_DIR"));
    let (mut folders, mut texts) = (vec![Path::new(project).join("src")], Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("a folder of sources") {
            let path = entry.expect("a source").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.to_string_lossy().ends_with(ending) {
                texts.push(fs::read_to_string(path).expect("a text"));
            }
        }
    }
    texts
}

/// Text of a struct. Rust and WGSL differ in the text of members alone.
fn struct_text<'a>(sources: &'a [String], name: &str) -> &'a str {
    let header = format!("struct {name} {{\n");
    let found: Vec<_> =
        sources.iter().filter_map(|text| text.find(&header).map(|begin| &text[begin..])).collect();
    let [text] = found[..] else { panic!("{} structs {name}", found.len()) };
    text.split_inclusive("\n}").next().expect("the struct ends")
}

/// Layout of a struct in Rust. Names and types are in the source alone.
fn rust_layout(sources: &[String], shared: &Shared) -> Layout {
    let lines = struct_text(sources, &shared.rust).lines().map(str::trim);
    let members = lines.filter(|line| !line.starts_with("//")).filter_map(|line| {
        let (name, found) = line.strip_suffix(',')?.split_once(": ")?;
        Some((name.rsplit(' ').next()?.to_owned(), found.to_owned()))
    });
    let members: Vec<_> = members.collect();
    assert_eq!(members.len(), shared.offsets.len(), "members of {}", shared.rust);
    let with_offset = |((name, found), offset): (_, &u64)| (name, found, *offset);
    (shared.size, members.into_iter().zip(&shared.offsets).map(with_offset).collect())
}

/// Layout of a WGSL struct. Other structs that it contains are among the shared ones.
fn wgsl_layout(sources: &[String], name: &str) -> Layout {
    let text = struct_text(sources, name);
    let contained = all_shared().map(|shared| shared.wgsl);
    let contained = contained.iter().filter(|other| text.contains(&format!(": {other},")));
    let text =
        contained.map(|other| struct_text(sources, other)).chain([text]).collect::<Vec<_>>().join("\n");
    let module = naga::front::wgsl::parse_str(&text).expect("the struct is valid");
    let found = module.types.iter().find(|(_, found)| found.name.as_deref() == Some(name));
    let (_, found) = found.expect("naga keeps it");
    let TypeInner::Struct { members, span } = &found.inner else { panic!("{name} is no struct") };
    let member = |member: &StructMember| {
        let name = member.name.clone().unwrap_or_default();
        (name, rust_type(&module, member.ty), member.offset.into())
    };
    ((*span).into(), members.iter().map(member).collect())
}

/// Rust type of a WGSL member. An atomic member counts as its scalar.
fn rust_type(module: &Module, handle: Handle<Type>) -> String {
    let name = |scalar: Scalar| match scalar.kind {
        ScalarKind::Float => "f32",
        ScalarKind::Uint => "u32",
        other => panic!("no member is {other:?}"),
    };
    match module.types[handle].inner {
        TypeInner::Scalar(scalar) | TypeInner::Atomic(scalar) => name(scalar).into(),
        TypeInner::Vector { size, scalar } => {
            let letter = if name(scalar) == "u32" { "U" } else { "" };
            format!("{letter}Vec{}", size as u8)
        }
        TypeInner::Matrix { columns, .. } => format!("Mat{}", columns as u8),
        TypeInner::Array { base, size: ArraySize::Constant(count), .. } => {
            format!("[{}; {count}]", rust_type(module, base))
        }
        TypeInner::Struct { .. } => {
            let name = module.types[handle].name.as_deref();
            let shared = all_shared().into_iter().find(|shared| Some(shared.wgsl) == name);
            shared.map(|shared| shared.rust).unwrap_or_else(|| panic!("{name:?} is not shared"))
        }
        ref other => panic!("no member is {other:?}"),
    }
}

#[test]
fn structs_have_the_same_members_in_rust_and_wgsl() {
    let (rust, wgsl) = (sources(".rs"), sources(".wgsl"));
    for shared in all_shared() {
        assert_eq!(rust_layout(&rust, &shared), wgsl_layout(&wgsl, shared.wgsl), "{}", shared.rust);
    }
    // These structs are in shaders alone. Rust knows only their sizes.
    let head = wgsl_layout(&wgsl, "Head");
    assert_eq!(head, wgsl_layout(&wgsl, "ListedHead"));
    assert_eq!(head.0, u64::from(4 * LIST_HEAD));
    assert_eq!(wgsl_layout(&wgsl, "Progress").0, PEEL_BYTES_PER_TEXEL);
}

#[test]
fn no_shared_struct_goes_unlisted() {
    let listed = all_shared();
    let names = |text: &String, from: &str, until: char| -> Vec<String> {
        let parts = text.split(from).skip(1);
        parts.map(|part| part.split(until).next().unwrap_or_default().trim().to_owned()).collect()
    };
    let derived = sources(".rs");
    let derived = derived.iter().flat_map(|text| names(text, "ShaderType)]", '{'));
    let derived: BTreeSet<_> =
        derived.filter_map(|head| Some(head.rsplit_once("struct ")?.1.to_owned())).collect();
    let mut expected: BTreeSet<_> = listed.iter().map(|shared| shared.rust.clone()).collect();
    // In WGSL it is an array of `Carver`.
    expected.insert("CarverTable".into());
    assert_eq!(derived, expected, "what derives `ShaderType`");

    let bound = sources(".wgsl");
    let bound = ["var<uniform>", "var<storage"]
        .into_iter()
        .flat_map(|space| bound.iter().flat_map(|text| names(text, space, ';')).collect::<Vec<_>>());
    let bound = bound.filter_map(|variable| {
        let (_, found) = variable.split_once(": ")?;
        let element = found.trim_start_matches("array<").split([',', '>']).next()?.to_owned();
        element.starts_with(char::is_uppercase).then_some(element)
    });
    let bound: BTreeSet<_> = bound.collect();
    // The first six are in shaders alone, the last is Bevy's.
    let others = ["FurtherRuns", "WorkList", "List", "Progress", "Superbrick", "CastState", "View"];
    let expected: BTreeSet<_> =
        listed.iter().map(|shared| shared.wgsl).chain(others).map(String::from).collect();
    assert_eq!(bound, expected, "what shaders bind");
}

#[test]
fn uniform_arrays_of_views_are_bound_at_offsets_of_whole_arrays() {
    // The largest alignment that a device may ask for. Drawing binds one view.
    assert!(ViewArray::<MarchedViewUniform>::BYTES.is_multiple_of(256));
    assert!((VIEWS_AT_ONCE * ViewArray::<Part>::BYTES).is_multiple_of(256));
}

#[test]
fn constants_are_the_same_in_rust_and_wgsl() {
    for (shader, name, value) in [
        (BINDINGS, "MAX_CARVERS", MAX_CARVERS as u32),
        (BINDINGS, "OPERATION_NONE", CarverUniform::default().operation),
        (BINDINGS, "OPERATION_SUBTRACT", OPERATION_SUBTRACT),
        (BINDINGS, "OPERATION_INTERSECT", OPERATION_INTERSECT),
        (BINDINGS, "OPERATION_REGION", OPERATION_REGION),
        (BRICKS, "WIDTH", WIDTH),
        (BRICKS, "VALID", VoxelMask::Valid as u32),
        (BRICKS, "PENDING", PENDING),
        (BRICKS, "HIDDEN", VoxelMask::Hidden as u32),
        (BRICKS, "MASKS", MASKS),
        (BRICKS, "CARVER_BITS", CARVER_BITS),
        (MARCHED_VIEW, "VIEWS", VIEWS_AT_ONCE),
        (MARCHED_VIEW, "OUTLINE_HEAD", OUTLINE_HEAD as u32),
        (MARCHED_VIEW, "COLOR_WORDS", COLOR_WORDS as u32),
        (OUTLINE_COLORS, "WIDTH", WIDTH),
        (WORK_LIST, "ROW", ROW),
        (SWEEP, "TILE", OcclusionSweeping::TILE),
        (DILATE, "TILE", TEXELS_PER_TILE),
        (SLICES, "TILE", SLICE_TILE),
        (OCTANTS, "SIDE", SIDE as u32),
        (WORK_LIST, "FRONT", ListEnd::Front as u32),
        (WORK_LIST, "BACK", ListEnd::Back as u32),
        (PASS, "QUEUE_NONE", Queue::None as u32),
        (PASS, "QUEUE_SAMPLEABLE", Queue::Sampleable as u32),
        (PASS, "QUEUE_VISIBLE", Queue::Visible as u32),
        (PASS, "QUEUE_ALL", Queue::All as u32),
        (PASS, "COVERAGE_LINES", CoverageRule::Lines as u32),
        (PASS, "COVERAGE_POINTS", CoverageRule::Points as u32),
        (PASS, "COVERAGE_CENTER", CoverageRule::Center as u32),
        (FILTERING, "ESTIMATE_CHEBYSHEV", DensityEstimate::Chebyshev as u32),
        (FILTERING, "ESTIMATE_POWER", DensityEstimate::Power as u32),
        (FILTERING, "ESTIMATE_GAUSSIAN", DensityEstimate::Gaussian as u32),
        (FILTERING, "ESTIMATE_CHEBYSHEV_OPEN", DensityEstimate::ChebyshevOpen as u32),
    ] {
        let line = format!("const {name}: u32 = {value}u;");
        assert!(shader.contains(&line), "`{line}` is not in the shader");
    }
}
