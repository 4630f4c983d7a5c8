//! A Bevy app without a window that renders into an image, frame by frame.

mod images;
mod waiting;

use bevy::{
    app::{PluginGroupBuilder, PluginsState},
    asset::UnapprovedPathMode,
    camera::{Hdr, RenderTarget},
    core_pipeline::tonemapping::Tonemapping,
    diagnostic::DiagnosticsStore,
    ecs::schedule::ScheduleLabel,
    prelude::*,
    render::{
        RenderApp, RenderPlugin,
        diagnostic::RenderDiagnosticsPlugin,
        error_handler::{RenderErrorHandler, RenderErrorPolicy},
        render_asset::RenderAssets,
        render_resource::{PollType, Texture, TextureFormat},
        renderer::{RenderAdapterInfo, RenderDevice},
        settings::WgpuSettings,
        sync_world::RenderEntity,
        texture::GpuImage,
        view::ViewDepthTexture,
    },
    window::ExitCondition,
    winit::WinitPlugin,
};
use bevy_contextual_ao::{
    diagnostics::{
        ClipWork, CountWork, RenderStatus, TimePassesByClock, Work, latest_clip_work, latest_gpu_ms,
        latest_work,
    },
    prelude::*,
    render::{VolumeStore, VolumeTexture, VoxelMask},
};
use half::f16;
use images::{add_target, read_back, read_texture};
use std::{
    path::PathBuf,
    time::{Duration, Instant},
};

use super::{device, mode::ShadingMode};
use waiting::PATIENCE;

use super::budget::explain;

/// Folder of this project. Cargo runs the project or a package in it, possibly elsewhere than where it was built.
pub fn project_folder() -> PathBuf {
    let package: PathBuf = std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default().into();
    let built = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..");
    let folders = [package.clone(), package.join(".."), built.clone()];
    folders.into_iter().find(|folder| folder.join("assets/head_phantom.nrrd").is_file()).unwrap_or(built)
}

/// The app and the image that it renders into.
pub struct Headless {
    /// The app; its frames are run with [`Headless::frame`].
    pub app: App,
    /// How long [`Self::until_ready`] waits without progress.
    pub patience: Duration,
    target: Handle<Image>,
}

/// Errors that the renderer reported.
#[derive(Resource, Default)]
struct RenderErrors(Vec<String>);

/// Reasons why volumes could not be shown.
#[derive(Resource, Default)]
struct Failures(Vec<String>);

impl Headless {
    /// Creates an app with the plugin and an image of `size` pixels to render into. `setup` may add more.
    pub fn new(size: UVec2, setup: impl FnOnce(&mut App)) -> Self {
        Self::with_settings(size, device::settings(), setup)
    }

    /// [`Self::new`] on a device with these settings.
    pub fn with_settings(size: UVec2, settings: WgpuSettings, setup: impl FnOnce(&mut App)) -> Self {
        Self::with_renderer(size, settings, true, |plugins| plugins, setup)
    }

    /// [`Self::new`] with other plugins of Bevy: `change` gets those of [`Self::new`].
    pub fn with_plugins(
        size: UVec2,
        change: impl FnOnce(PluginGroupBuilder) -> PluginGroupBuilder,
        setup: impl FnOnce(&mut App),
    ) -> Self {
        Self::with_renderer(size, device::settings(), true, change, setup)
    }

    /// [`Self::new`] as in apps with a window: frames are drawn while shaders compile.
    pub fn compiling_in_background(size: UVec2, setup: impl FnOnce(&mut App)) -> Self {
        Self::with_renderer(size, device::settings(), false, |plugins| plugins, setup)
    }

    fn with_renderer(
        size: UVec2,
        settings: WgpuSettings,
        synchronous_pipeline_compilation: bool,
        change: impl FnOnce(PluginGroupBuilder) -> PluginGroupBuilder,
        setup: impl FnOnce(&mut App),
    ) -> Self {
        let mut app = App::new();
        let plugins = DefaultPlugins
            .set(WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() })
            .set(RenderPlugin {
                synchronous_pipeline_compilation,
                render_creation: settings.into(),
                ..default()
            })
            .set(AssetPlugin {
                file_path: project_folder().join("assets").to_string_lossy().into_owned(),
                unapproved_path_mode: UnapprovedPathMode::Allow,
                ..default()
            })
            .disable::<WinitPlugin>()
            // Without pipelining, a change made before a frame shows in that frame's image.
            .disable::<bevy::render::pipelined_rendering::PipelinedRenderingPlugin>()
            .disable::<bevy::log::LogPlugin>();
        let alone = device::alone();
        app.add_plugins((change(plugins), RenderDiagnosticsPlugin, ContextualAoPlugin));
        drop(alone);
        app.init_resource::<Failures>()
            .init_resource::<RenderErrors>()
            .insert_resource(RenderErrorHandler(|error, main_world, _| {
                main_world.resource_mut::<RenderErrors>().0.push(format!("{error:?}"));
                RenderErrorPolicy::StopRendering
            }))
            .add_observer(|failed: On<VolumeFailed>, mut failures: ResMut<Failures>| {
                failures.0.push(explain(&failed.reason));
            });
        setup(&mut app);
        let begin = Instant::now();
        while app.plugins_state() == PluginsState::Adding {
            assert!(begin.elapsed() < PATIENCE, "waited in vain for a graphics device");
            bevy::tasks::tick_global_task_pools_on_main_thread();
        }
        app.finish();
        app.cleanup();
        let target = add_target(&mut app, size, TextureFormat::Rgba8UnormSrgb);
        let mut headless = Self { app, patience: PATIENCE, target };
        // Timestamps of software drivers say nothing about compute passes.
        let by_clock = TimePassesByClock(headless.is_software());
        headless.app.insert_resource(by_clock);
        headless
    }

    /// Whether the device is a CPU.
    pub fn is_software(&self) -> bool {
        format!("{:?}", self.app.world().resource::<RenderAdapterInfo>().device_type) == "Cpu"
    }

    /// Components of a camera that renders into the image.
    pub fn camera(&self) -> impl Bundle {
        (
            Camera3d::default(),
            RenderTarget::Image(self.target.clone().into()),
            // Shows the colours of the transfer function unchanged.
            Tonemapping::None,
            Msaa::Off,
        )
    }

    /// Lets a camera render half floats, for [`Self::light`]: nothing is rounded to bytes.
    pub fn render_floats(&mut self, camera: Entity, size: UVec2) {
        self.target = add_target(&mut self.app, size, TextureFormat::Rgba16Float);
        let target = RenderTarget::Image(self.target.clone().into());
        self.app.world_mut().entity_mut(camera).insert((target, Hdr));
    }

    /// Runs one frame and waits for the GPU to finish it. Panics if the renderer reports an error.
    pub fn frame(&mut self) {
        self.app.update();
        let device = self.app.world().resource::<RenderDevice>();
        // An error means that the device was lost. Later frames show nothing.
        let _ = device.poll(PollType::wait_indefinitely());
        let errors = &self.app.world().resource::<RenderErrors>().0;
        assert!(errors.is_empty(), "the renderer complains: {}", errors[0]);
    }

    /// Runs `count` frames.
    pub fn frames(&mut self, count: u32) {
        for _ in 0..count {
            self.frame();
        }
    }

    /// The rendered image: RGBA, rows from top to bottom.
    pub fn image(&self) -> Vec<u8> {
        let world = self.render_world();
        let images = world.resource::<RenderAssets<GpuImage>>();
        let image = images.get(&self.target).expect("a frame has been run");
        read_texture(world, &image.texture)
    }

    /// Light of the pixels of an image of half floats: red, green and blue, rows from top to bottom.
    pub fn light(&self) -> Vec<[f64; 3]> {
        let value = |bytes: &[u8]| f16::from_le_bytes([bytes[0], bytes[1]]).to_f64();
        self.image()
            .chunks_exact(8)
            .map(|texel| [0, 1, 2].map(|channel| value(&texel[2 * channel..])))
            .collect()
    }

    /// Depths of a camera's main pass, rows from top to bottom: 1 on the near plane, 0 infinitely far. Not with `Msaa`.
    pub fn depths(&self, camera: Entity) -> Vec<f32> {
        let world = self.render_world();
        let view = self.app.world().get::<RenderEntity>(camera).map(|entity| entity.id());
        let depth = view.and_then(|view| world.get::<ViewDepthTexture>(view)).expect("a frame has been run");
        let bytes = read_texture(world, &depth.texture);
        bytes
            .chunks_exact(4)
            .map(|bytes| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
            .collect()
    }

    /// First channel of a volume's texture: one value per voxel, 0 to 255, x fastest. Empty while there is no such
    /// volume.
    pub fn voxels(&self, volume: Entity, which: VolumeTexture) -> Vec<u8> {
        self.channel(volume, which, 0)
    }

    /// [`Self::voxels`] for another channel.
    pub fn channel(&self, volume: Entity, which: VolumeTexture, channel: usize) -> Vec<u8> {
        let Some(texture) = self.texture(volume, which) else {
            return Vec::new();
        };
        let bytes_per_voxel = texture.format().block_copy_size(None).unwrap_or(1) as usize;
        let bytes = read_texture(self.render_world(), &texture);
        bytes.into_iter().skip(channel).step_by(bytes_per_voxel).collect()
    }

    /// All bytes of a volume's texture, x fastest. Empty while there is no such volume.
    pub fn texels(&self, volume: Entity, which: VolumeTexture) -> Vec<u8> {
        self.texture(volume, which)
            .map(|texture| read_texture(self.render_world(), &texture))
            .unwrap_or_default()
    }

    /// The words of a volume's bricks, x fastest: carvers near each brick, and the distance that rays may leap in the
    /// highest 4 bits. Empty while there is no such volume.
    pub fn brick_words(&self, volume: Entity) -> Vec<u32> {
        let world = self.render_world();
        let texture = world.resource::<VolumeStore>().brick_words(volume).cloned();
        let bytes = texture.map(|texture| read_texture(world, &texture)).unwrap_or_default();
        bytes.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])).collect()
    }

    /// Signed distances of a volume that is swept by an isovalue, mm, x fastest. Empty for other volumes.
    pub fn signed_distances(&self, volume: Entity) -> Vec<f32> {
        let world = self.render_world();
        let Some(buffer) = world.resource::<VolumeStore>().signed_distances(volume) else {
            return Vec::new();
        };
        let bytes = read_back(world, buffer.size(), |encoder, target| {
            encoder.copy_buffer_to_buffer(buffer, 0, target, 0, buffer.size());
        });
        bytes
            .chunks_exact(4)
            .map(|bytes| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
            .collect()
    }

    /// Whether a mask holds for each voxel, x fastest. Empty while there is no such volume.
    pub fn mask(&self, volume: Entity, which: VoxelMask) -> Vec<bool> {
        let world = self.render_world();
        let store = world.resource::<VolumeStore>();
        let (Some((buffer, first, size)), Some(texture)) =
            (store.mask(volume, which), store.texture(volume, VolumeTexture::Opacities))
        else {
            return Vec::new();
        };
        let bytes = read_back(world, size, |encoder, target| {
            encoder.copy_buffer_to_buffer(buffer, first, target, 0, size);
        });
        let size = texture.size();
        let dimensions = UVec3::new(size.width, size.height, size.depth_or_array_layers);
        let bricks = (dimensions + 3) / 4;
        let holds = |voxel: UVec3| {
            let brick = voxel / 4;
            let index = (brick.z * bricks.y + brick.y) * bricks.x + brick.x;
            let inside = voxel % 4;
            let bit = (index * 64 + inside.z * 16 + inside.y * 4 + inside.x) as usize;
            bytes[bit / 8] >> (bit % 8) & 1 == 1
        };
        (0..dimensions.element_product()).map(|index| holds(voxel_at(index, dimensions))).collect()
    }

    fn texture(&self, volume: Entity, which: VolumeTexture) -> Option<Texture> {
        self.render_world().resource::<VolumeStore>().texture(volume, which).cloned()
    }

    fn render_world(&self) -> &World {
        self.app.sub_app(RenderApp).world()
    }

    /// Milliseconds of a pass when it last ran.
    pub fn pass_ms(&self, span: &str) -> f64 {
        let status = self.app.world().resource::<RenderStatus>();
        let by_clock = status.passes.clock_ms(span);
        by_clock.or_else(|| latest_gpu_ms(self.diagnostics(), span)).unwrap_or(0.0)
    }

    /// Work of the ray cast in one frame. Zero if no ray was cast.
    pub fn count_work(&mut self, volume: Entity) -> Work {
        self.count_all_work(volume).0
    }

    /// The same, and the work of clipping.
    pub fn count_all_work(&mut self, volume: Entity) -> (Work, ClipWork) {
        let world = self.app.world_mut();
        world.insert_resource(CountWork(true));
        let mode = self.mode(volume);
        let world = self.app.world_mut();
        let status = |world: &World| world.resource::<RenderStatus>().passes.jobs(OcclusionRays::SPAN_CAST);
        let before = status(world);
        self.frame();
        // The counts arrive a few frames later. Nothing may be computed meanwhile.
        self.app.insert_resource(CountWork(false));
        self.set_mode(volume, ShadingMode::Solid);
        self.frames(4);
        self.set_mode(volume, mode);
        let clipped = latest_clip_work(self.diagnostics(), self.app.world().resource::<RenderStatus>())
            .unwrap_or_default();
        if status(self.app.world()) == before {
            return (Work::default(), clipped);
        }
        (latest_work(self.diagnostics()).unwrap_or_default(), clipped)
    }

    /// Shading mode of a volume.
    pub fn mode(&self, volume: Entity) -> ShadingMode {
        let world = self.app.world();
        let settings = world.get::<VolumeShading>(volume).zip(world.get::<AmbientOcclusion>(volume));
        settings.map_or_else(default, |(shading, occlusion)| ShadingMode::of(shading, occlusion))
    }

    /// Changes the shading mode of a volume.
    pub fn set_mode(&mut self, volume: Entity, mode: ShadingMode) {
        if let Ok(mut volume) = self.app.world_mut().get_entity_mut(volume)
            && let Ok((mut shading, mut occlusion)) =
                volume.get_components_mut::<(&mut VolumeShading, &mut AmbientOcclusion)>()
        {
            mode.apply(&mut shading, &mut occlusion);
        }
    }

    /// Diagnostics of the frames so far.
    pub fn diagnostics(&self) -> &DiagnosticsStore {
        self.app.world().resource::<DiagnosticsStore>()
    }

    /// Adds a system to a schedule of the render world; for tests.
    pub fn add_render_system<M>(
        &mut self,
        schedule: impl ScheduleLabel,
        system: impl IntoSystem<(), (), M> + 'static,
    ) {
        self.app.sub_app_mut(RenderApp).add_systems(schedule, system);
    }
}

impl Drop for Headless {
    fn drop(&mut self) {
        // The device is dropped with the app.
        let _alone = device::alone();
        self.app = App::empty();
    }
}

/// Voxel at an index into a volume's voxels, x fastest.
pub fn voxel_at(index: u32, dimensions: UVec3) -> UVec3 {
    let UVec3 { x, y, .. } = dimensions;
    UVec3::new(index % x, index / x % y, index / (x * y))
}

/// Number of pixels that differ between two RGBA images of one size. Panics if neither image shows anything: the
/// comparison would be empty.
pub fn different_pixels(a: &[u8], b: &[u8]) -> usize {
    assert_eq!(a.len(), b.len());
    assert!([a, b].iter().any(|image| image.chunks(4).any(|pixel| *pixel != image[..4])), "nothing is shown");
    a.chunks(4).zip(b.chunks(4)).filter(|(a, b)| a != b).count()
}
