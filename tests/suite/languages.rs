//! Shaders as wgpu would write them for Metal, Direct3D 12 and Vulkan. No test runs on the first two. Their other limits are
//! in `docs/drivers.md`.

use bevy::{
    asset::AssetId,
    core_pipeline::{
        oit::OrderIndependentTransparencySettings, prepass::MotionVectorPrepass, tonemapping::Tonemapping,
    },
    math::DVec3,
    prelude::*,
    render::{
        RenderApp,
        render_resource::{PipelineCache, PipelineDescriptor, WgpuFeatures},
        renderer::{RenderAdapter, RenderDevice},
    },
    shader::{Shader, ShaderCache, ShaderCacheError, ShaderCacheSource, ShaderDefVal, ValidateShader},
};
use bevy_contextual_ao::{
    occlusion::{ScreenSpaceBlur, ScreenSpaceOcclusion},
    prelude::*,
};
use contextual_ao_kit::mode::ShadingMode;
use naga::{
    Module,
    back::{hlsl, msl, spv},
    valid::{Capabilities, ValidationFlags, Validator},
};

use crate::scene::{TestScene, few_rays, folded_volume, translucent_ramp};

/// First version of Metal with equal positions in two pipelines (`@invariant`). `clip_draw.wgsl` needs this, as
/// Bevy's meshes do.
const METAL_VERSION: (u8, u8) = (2, 1);
/// Shader model of the compiler that every Windows has.
const SHADER_MODEL: hlsl::ShaderModel = hlsl::ShaderModel::V5_1;

/// Writes a shader in all languages, or says why one language cannot express it.
pub fn write(module: &Module) -> Result<(), String> {
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::all());
    let info = validator.validate(module).map_err(|error| format!("{:?}", error.into_inner()))?;
    let options = msl::Options { lang_version: METAL_VERSION, ..Default::default() };
    let (text, written) = msl::write_string(module, &info, &options, &Default::default())
        .map_err(|error| format!("Metal: {error:?}"))?;
    for entry_point in written.entry_point_names {
        let name = entry_point.map_err(|error| format!("Metal: {error:?}"))?;
        assert!(text.contains(&name), "Metal: there is no {name}");
    }
    let mut text = String::new();
    let options = hlsl::Options { shader_model: SHADER_MODEL, ..Default::default() };
    let written = hlsl::Writer::new(&mut text, &options, &Default::default())
        .write(module, &info, None)
        .map_err(|error| format!("Direct3D: {error:?}"))?;
    for entry_point in written.entry_point_names {
        let name = entry_point.map_err(|error| format!("Direct3D: {error:?}"))?;
        assert!(text.contains(&name), "Direct3D: there is no {name}");
    }
    let mut words = Vec::new();
    spv::Writer::new(&Default::default())
        .and_then(|mut writer| writer.write(module, &info, None, &None, &mut words))
        .map_err(|error| format!("Vulkan: {error:?}"))
}

fn write_source(_: &(), source: ShaderCacheSource, _: &ValidateShader) -> Result<(), ShaderCacheError> {
    match source {
        ShaderCacheSource::Naga(module) => write(&module).map_err(ShaderCacheError::CreateShaderModule),
        _ => Err(ShaderCacheError::CreateShaderModule("it is not composed by naga".into())),
    }
}

/// A shader of this crate that draws and the definitions that it is compiled with.
type Drawn = (AssetId<Shader>, Vec<ShaderDefVal>);

/// Fragment and compute shaders that have drawn volumes so far; the paths of the shaders end with `file`.
fn drawn(scene: &TestScene, file: &str) -> Vec<Drawn> {
    let shaders = scene.headless.app.world().resource::<Assets<Shader>>();
    let is_of_file = |id| shaders.get(id).is_some_and(|shader: &Shader| shader.path.ends_with(file));
    let cache = scene.headless.app.sub_app(RenderApp).world().resource::<PipelineCache>();
    let pipelines = cache.pipelines().filter_map(|pipeline| match &pipeline.descriptor {
        PipelineDescriptor::RenderPipelineDescriptor(descriptor) => {
            let fragment = descriptor.fragment.as_ref()?;
            Some((fragment.shader.id(), fragment.shader_defs.clone()))
        }
        PipelineDescriptor::ComputePipelineDescriptor(descriptor) => {
            Some((descriptor.shader.id(), descriptor.shader_defs.clone()))
        }
    });
    pipelines.filter(|(id, _)| is_of_file(*id)).collect()
}

/// The given shaders, in all variants of volumes.
fn in_all_variants(drawn: Vec<Drawn>) -> Vec<Drawn> {
    const TEXELS: [&[&str]; 3] = [&[], &["OCTANTS"], &["MODULATED"]];
    const SURFACES: [&[&str]; 2] = [&[], &["ISOSURFACE"]];
    const DEPTHS: [&[&str]; 2] = [&[], &["DEPTH_PREPASS"]];
    const FILTERS: [&[&str]; 2] = [&[], &["TRICUBIC"]];
    let is_varied = |def: &ShaderDefVal| {
        let ShaderDefVal::Bool(name, _) = def else { return false };
        let lists = [&TEXELS[..], &SURFACES[..], &DEPTHS[..], &FILTERS[..]].concat();
        lists.concat().contains(&name.as_str())
    };
    let mut variants = Vec::new();
    for (id, defs) in drawn {
        let kept: Vec<_> = defs.into_iter().filter(|def| !is_varied(def)).collect();
        for (texels, surface) in TEXELS.iter().flat_map(|texels| SURFACES.map(|surface| (texels, surface))) {
            for (depth, filter) in DEPTHS.iter().flat_map(|depth| FILTERS.map(|filter| (depth, filter))) {
                let chosen = [*texels, surface, depth, filter].concat().into_iter().map(ShaderDefVal::from);
                variants.push((id, kept.iter().cloned().chain(chosen).collect()));
            }
        }
    }
    variants
}

#[test]
fn shaders_that_draw_are_written_for_metal_and_direct3d() {
    let volume = folded_volume(UVec3::splat(12), DVec3::ONE);
    let mut scene = TestScene::new(volume, translucent_ramp(), few_rays(), ShadingMode::Cao);
    scene.settle();
    let (camera, volume) = (scene.camera(), scene.volume);
    scene.world().entity_mut(camera).insert(MotionVectorPrepass);
    scene.world().entity_mut(volume).insert(VolumeDepth::default());
    // Views that sort transparent fragments have one sample.
    scene.world().entity_mut(camera).insert(OrderIndependentTransparencySettings::default());
    scene.headless.frames(3);
    scene.world().entity_mut(camera).remove::<OrderIndependentTransparencySettings>();
    for tonemapping in [Tonemapping::Reinhard, Tonemapping::TonyMcMapface, Tonemapping::None] {
        scene.world().entity_mut(camera).insert(tonemapping);
        let blur = if tonemapping == Tonemapping::None { ScreenSpaceBlur::None } else { default() };
        let screen_space = ScreenSpaceOcclusion { blur, ..default() };
        for method in [OcclusionMethod::ScreenSpace(screen_space), OcclusionMethod::Directional(default())] {
            scene.world().entity_mut(volume).insert(AmbientOcclusion::by(method));
            scene.headless.frames(3);
        }
    }
    // Outlines are shaded in multisampled views.
    scene.world().entity_mut(volume).insert(few_rays());
    scene.world().entity_mut(camera).insert(Msaa::Sample4);
    scene.settle();
    let outlines = drawn(&scene, "drawing/outline_colors.wgsl");
    assert!(!outlines.is_empty(), "no outlines were shaded");
    let mut shaders = in_all_variants([drawn(&scene, "drawing/volume.wgsl"), outlines].concat());
    assert!(shaders.len() >= 4 * 24, "{} variants of drawing", shaders.len());
    let others = [
        ("directional/composite.wgsl", 3),
        ("screen_space/darken.wgsl", 2),
        ("drawing/depth.wgsl", 1),
        ("drawing/motion_vectors.wgsl", 1),
    ];
    for (file, least) in others {
        let drawn = drawn(&scene, file);
        assert!(drawn.len() >= least, "{} variants of {file}", drawn.len());
        shaders.extend(drawn);
    }
    let world = scene.headless.app.world();
    // Bevy adds this definition to all shaders.
    let available = world.resource::<RenderDevice>().limits().max_storage_buffers_per_shader_stage;
    let available = ShaderDefVal::UInt("AVAILABLE_STORAGE_BUFFER_BINDINGS".into(), available);
    shaders.iter_mut().for_each(|(_, definitions)| definitions.push(available.clone()));
    let downlevel = world.resource::<RenderAdapter>().get_downlevel_capabilities();
    let mut cache = ShaderCache::new((), WgpuFeatures::all(), downlevel.flags, write_source);
    let sources = world.resource::<Assets<Shader>>();
    for (id, shader) in sources.iter() {
        cache.set_shader(id, shader.clone());
    }
    for (pipeline, (id, definitions)) in shaders.iter().enumerate() {
        if let Err(error) = cache.get(pipeline, *id, definitions) {
            let path = sources.get(*id).map(|shader| &shader.path);
            panic!("{path:?} with {definitions:?}: {error}");
        }
    }
}
