//! Whether structs and constants that stand in Rust and in WGSL are the same in both.

use bevy::render::render_resource::{ShaderType, encase::private::StructMetadata};
use naga::TypeInner;

use super::{
    brick_resources::{MASKS, PENDING},
    carver_uniform::{CarverUniform, OPERATION_INTERSECT, OPERATION_REGION, OPERATION_SUBTRACT},
    compute_pass::{ListEnd, WIDTH},
    direct::SlicingData,
    filtering::FilteringData,
    pass_uniforms::{OcclusionPassUniform, Queue, WindowUniform},
    screen_space::views::ScreenSpaceUniform,
    sweeping::{SIDE, SweepPlane, SweepingUniform, TILE},
    volume_store::VoxelMask,
    volume_uniform::VolumeUniform,
};
use crate::{
    clip::{CoverageRule, MAX_CARVERS},
    occlusion::DensityEstimate,
};

const BINDINGS: &str = include_str!("volume_bindings.wgsl");
const BRICKS: &str = include_str!("bricks.wgsl");
const PASS: &str = include_str!("occlusion_pass.wgsl");
const WORK_LIST: &str = include_str!("work_list.wgsl");
const FILTERING: &str = include_str!("filtering/voxel_lines.wgsl");
const SCREEN_SPACE: &str = include_str!("screen_space/bindings.wgsl");
const WINDOW: &str = include_str!("window.wgsl");
const SLICES: &str = include_str!("direct/slices.wgsl");
const SWEEPING: &str = include_str!("sweeping/sweeping.wgsl");
const SWEEP: &str = include_str!("sweeping/sweep.wgsl");
const OCTANTS: &str = include_str!("../material/octants.wgsl");

/// Size and offsets of a WGSL struct, which has no other struct in it.
fn wgsl_layout(shader: &str, name: &str) -> (u64, Vec<u64>) {
    let begin = shader.find(&format!("struct {name} {{")).expect("the struct is there");
    let text = shader[begin..].split_inclusive("\n}").next().expect("the struct ends");
    let module = naga::front::wgsl::parse_str(text).expect("the struct is valid");
    let found = module.types.iter().find(|(_, found)| found.name.as_deref() == Some(name));
    let (_, found) = found.expect("naga keeps it");
    let TypeInner::Struct { members, span } = &found.inner else { panic!("{name} is no struct") };
    (*span as u64, members.iter().map(|member| member.offset as u64).collect())
}

fn rust_layout<T: ShaderType<ExtraMetadata = StructMetadata<N>>, const N: usize>() -> (u64, Vec<u64>) {
    let offsets = (0..N).map(|member| T::METADATA.offset(member)).collect();
    (T::min_size().get(), offsets)
}

#[test]
fn rust_and_wgsl_agree() {
    assert_eq!(rust_layout::<VolumeUniform, 28>(), wgsl_layout(BINDINGS, "VolumeUniform"));
    assert_eq!(rust_layout::<CarverUniform, 10>(), wgsl_layout(BINDINGS, "Carver"));
    assert_eq!(rust_layout::<OcclusionPassUniform, 13>(), wgsl_layout(PASS, "OcclusionPass"));
    assert_eq!(rust_layout::<FilteringData, 8>(), wgsl_layout(FILTERING, "Filtering"));
    assert_eq!(rust_layout::<ScreenSpaceUniform, 5>(), wgsl_layout(SCREEN_SPACE, "ScreenSpaceView"));
    assert_eq!(rust_layout::<WindowUniform, 5>(), wgsl_layout(WINDOW, "Window"));
    assert_eq!(rust_layout::<SlicingData, 9>(), wgsl_layout(SLICES, "Slicing"));
    assert_eq!(rust_layout::<SweepingUniform, 10>(), wgsl_layout(SWEEPING, "Sweeping"));
    assert_eq!(rust_layout::<SweepPlane, 3>(), wgsl_layout(SWEEP, "Plane"));
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
        (SWEEP, "TILE", TILE),
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
    ] {
        let line = format!("const {name}: u32 = {value}u;");
        assert!(shader.contains(&line), "`{line}` is not in the shader");
    }
}
