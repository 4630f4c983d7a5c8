//! Shaded views, and the bind groups of their passes.

use bevy::{
    core_pipeline::prepass::ViewPrepassTextures,
    ecs::{entity::EntityHashMap, system::SystemParam},
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntries, CachedRenderPipelineId, Extent3d, SpecializedRenderPipelines,
            TextureDescriptor, TextureDimension, TextureFormat, TextureUsages, TextureView, UniformBuffer,
        },
        sync_world::MainEntity,
        texture::TextureCache,
        view::ViewTarget,
    },
};

use super::{
    darken::{DarkenKey, DarkenPipeline},
    passes::ScreenSpacePasses,
    uniform::{KernelUniform, SURFACE_FORMAT, ScreenSpaceUniform},
};
use crate::{
    occlusion::ScreenSpaceOcclusion,
    render::{
        extract::{ExtractedScene, ExtractedVolume},
        gpu::{device::Gpu, uniforms::BuffersOf},
        methods::pipelines::MethodPipelines,
        volumes::store::{VolumeResources, VolumeStore},
        windows::{VolumeInView, VolumeWindows, WindowUniform},
    },
    volume::longest_stretch,
};

/// Passes over the shaded views of this frame, by the views' entities.
#[derive(Resource, Default)]
pub(crate) struct ScreenSpaceViews(pub EntityHashMap<ViewJob>);

/// Uniforms of views, and of volumes in them.
#[derive(Resource, Default)]
pub(super) struct ScreenSpaceUniforms {
    views: BuffersOf<Entity, UniformBuffer<ScreenSpaceUniform>>,
    kernels: BuffersOf<Entity, UniformBuffer<KernelUniform>>,
    windows: BuffersOf<VolumeInView, UniformBuffer<WindowUniform>>,
    thresholds: BuffersOf<VolumeInView, UniformBuffer<f32>>,
}

impl ScreenSpaceUniforms {
    fn begin_frame(&mut self) {
        self.views.begin_frame();
        self.kernels.begin_frame();
        self.windows.begin_frame();
        self.thresholds.begin_frame();
    }
}

/// The passes over one view.
pub(crate) struct ViewJob {
    /// Origin and size, pixels.
    pub viewport: Vec4,
    pub size: UVec2,
    /// Number of samples of the depth prepass; 0 without a prepass.
    pub depth_samples: u32,
    pub opaque: BindGroup,
    /// Bind groups of each volume, and whether its transfer function follows the gradient.
    pub volumes: Vec<([BindGroup; 2], bool)>,
    pub occlusion: BindGroup,
    pub darken: BindGroup,
    pub darken_pipeline: CachedRenderPipelineId,
}

/// A volume in a view.
struct SeenVolume<'a> {
    entity: MainEntity,
    resources: &'a VolumeResources,
    window: WindowUniform,
    settings: ScreenSpaceOcclusion,
    by_gradient: bool,
    /// In world units.
    radius: f32,
    bias: f32,
}

/// Inputs for making the jobs.
#[derive(SystemParam)]
pub(crate) struct JobParts<'w> {
    passes: Res<'w, ScreenSpacePasses>,
    darken: Res<'w, DarkenPipeline>,
    darken_pipelines: ResMut<'w, SpecializedRenderPipelines<DarkenPipeline>>,
    textures: ResMut<'w, TextureCache>,
    uniforms: ResMut<'w, ScreenSpaceUniforms>,
    gpu: Gpu<'w>,
}

/// Finds the views that show volumes with this method.
pub(crate) fn prepare_views(
    scene: Res<ExtractedScene>,
    store: Res<VolumeStore>,
    windows: Res<VolumeWindows>,
    pipelines: Res<MethodPipelines>,
    cameras: Query<(&ViewTarget, Option<&ViewPrepassTextures>)>,
    mut parts: JobParts,
    mut jobs: ResMut<ScreenSpaceViews>,
) {
    jobs.0.clear();
    parts.uniforms.begin_frame();
    let mut seen = EntityHashMap::<Vec<SeenVolume>>::default();
    let is_ready = |volume: &&ExtractedVolume| pipelines.are_there_for(&volume.occlusion.method);
    for volume in scene.volumes.iter().filter(|volume| volume.is_placed).filter(is_ready) {
        let Some(settings) = volume.occlusion.method.get::<ScreenSpaceOcclusion>().copied() else {
            continue;
        };
        let Some(resources) = store.0.get(&volume.entity) else {
            continue;
        };
        let stretch = longest_stretch(volume.world_from_local.matrix3.as_dmat3());
        let [radius, bias] = settings.lengths_mm(&volume.geometry).map(|mm| (mm * stretch) as f32);
        if !volume.shading.ambient_occlusion || radius <= 0.0 || settings.samples == 0 {
            // The method changes nothing for this volume.
            continue;
        }
        for view in windows.onto(volume.entity) {
            let (entity, window, by_gradient) = (volume.entity, view.uniform, volume.by_gradient);
            let seen = seen.entry(view.view).or_default();
            seen.push(SeenVolume { entity, resources, window, settings, by_gradient, radius, bias });
        }
    }
    for (entity, volumes) in seen {
        let Ok((target, prepass)) = cameras.get(entity) else {
            continue;
        };
        if let Some(job) = parts.job(entity, &volumes, target.main_texture_format(), prepass) {
            jobs.0.insert(entity, job);
        }
    }
}

impl JobParts<'_> {
    fn job(
        &mut self,
        entity: Entity,
        volumes: &[SeenVolume],
        format: TextureFormat,
        prepass: Option<&ViewPrepassTextures>,
    ) -> Option<ViewJob> {
        // Where settings of volumes differ, the view takes the largest.
        let settings = volumes.iter().map(|volume| volume.settings).reduce(|a, b| ScreenSpaceOcclusion {
            samples: a.samples.max(b.samples),
            blur: a.blur.max(b.blur),
            ..a
        })?;
        let most = |length: fn(&SeenVolume) -> f32| volumes.iter().map(length).fold(0.0, f32::max);
        let window = volumes.first()?.window;
        let viewport = window.viewport;
        let size = UVec2::new(viewport.z as u32, viewport.w as u32);
        let view = ScreenSpaceUniform {
            clip_from_view: window.view_from_clip.inverse(),
            view_from_clip: window.view_from_clip,
            viewport,
            radius: most(|volume| volume.radius),
            bias: most(|volume| volume.bias),
        };
        let (gpu, uniforms) = (&self.gpu, &mut *self.uniforms);
        let view = uniforms.views.write(entity, view, gpu)?;
        let kernel = uniforms.kernels.write(entity, KernelUniform::of(&settings), gpu)?;
        let Gpu { device, cache, .. } = gpu;
        let mut texture = |format| {
            let descriptor = view_texture(size, format);
            self.textures.get(device, descriptor).default_view
        };
        // Each pass reads the surfaces that the previous pass wrote.
        let surfaces = [texture(SURFACE_FORMAT), texture(SURFACE_FORMAT)];
        let factors = texture(gpu.formats.scalar);
        let last = &surfaces[volumes.len() % 2];
        let passes = &self.passes;
        let depth = prepass.and_then(|prepass| prepass.depth.as_ref());
        let depth_samples = depth.map_or(0, |depth| depth.texture.texture.sample_count());
        let opaque = passes.surfaces.opaque(depth_samples);
        let opaque = match depth {
            Some(depth) => {
                let depth: &TextureView = &depth.texture.default_view;
                opaque.bind((view.clone(), &surfaces[0], depth), cache, device)
            }
            None => opaque.bind((view.clone(), &surfaces[0]), cache, device),
        };
        let bind_volume = |(k, volume): (usize, &SeenVolume)| {
            let key = (entity, volume.entity);
            let window = uniforms.windows.write(key, volume.window, gpu)?;
            let threshold = uniforms.thresholds.write(key, volume.settings.opacity_threshold, gpu)?;
            let between = [&surfaces[k % 2], &surfaces[(k + 1) % 2]];
            let groups = passes.surfaces.bind_volume(volume.resources, [window, threshold], between, gpu)?;
            Some((groups, volume.by_gradient))
        };
        let volumes = volumes.iter().enumerate().map(bind_volume).collect::<Option<_>>()?;
        let darken = device.create_bind_group(
            "contextual_ao_darken",
            &cache.get_bind_group_layout(&self.darken.layout),
            &BindGroupEntries::sequential((view.clone(), &factors, last)),
        );
        let key = DarkenKey { format, blur: settings.blur };
        Some(ViewJob {
            viewport,
            size,
            depth_samples,
            opaque,
            volumes,
            occlusion: passes.occlusion.bind((view.clone(), kernel, last, &factors), cache, device),
            darken,
            darken_pipeline: self.darken_pipelines.specialize(cache, &self.darken, key),
        })
    }
}

/// Descriptor of a texture with one texel for each pixel of a viewport.
fn view_texture(size: UVec2, format: TextureFormat) -> TextureDescriptor<'static> {
    TextureDescriptor {
        label: Some("contextual_ao_screen_space"),
        size: Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format,
        usage: TextureUsages::TEXTURE_BINDING | TextureUsages::STORAGE_BINDING,
        view_formats: &[],
    }
}
