//! Storage of the runs of a volume's views (`runs.wgsl`), and the parts of views to march in a frame.

use bevy::{
    prelude::*,
    render::{
        render_resource::{Buffer, BufferDescriptor, BufferId, BufferUsages, ShaderType},
        renderer::RenderDevice,
        sync_world::MainEntity,
    },
};

use super::{
    dispatch::{ViewArray, ViewParts},
    outline_lists::{
        OUTLINE_HEAD, largest_of, lists, outline_words, pixels_of, rays_of_outlines, workgroups_of,
    },
};
use crate::{
    diagnostics::GpuUsage,
    occlusion::Optimizations,
    render::{
        clipping::step::{ClipStep, outlines},
        gpu::{device::Gpu, kept_group::KeptGroup, uniforms::BuffersOf},
        windows::{VolumeWindow, WindowUniform},
    },
    volume::VolumeGeometry,
};

/// Binding of the runs for passes that read them (`seen.wgsl`).
pub(crate) const RUNS_BINDING: u32 = 11;
/// Bytes of a run.
const RUN_BYTES: u64 = 16;
/// Vertices of a volume's box as a strip of triangles.
pub(crate) const BOX_VERTICES: u32 = 14;
/// Words for the further runs of a view, `FurtherRuns` in WGSL.
const FURTHER_WORDS: u64 = 5;
/// Most runs: `NO_RUN` in WGSL, which is no index.
const MOST_RUNS: u64 = 0x3ff_ffff;
/// Room for further runs, for each first run of a pixel.
const FURTHER_RUNS: u64 = 1;

/// The runs of all seen volumes.
#[derive(Resource, Default)]
pub(crate) struct VolumeRuns(BuffersOf<MainEntity, ViewRuns>);

impl VolumeRuns {
    /// Begins a frame. Frees the runs of volumes that the previous frame did not march.
    pub fn begin_frame(&mut self) {
        self.0.begin_frame();
    }

    pub fn of_mut(&mut self, volume: MainEntity) -> &mut ViewRuns {
        self.0.of(volume)
    }

    /// Runs of a volume that this frame marched, or kept.
    pub fn of(&self, volume: MainEntity) -> Option<&ViewRuns> {
        self.0.get(volume)
    }

    pub fn usage(&self) -> GpuUsage {
        let bytes = |runs: &ViewRuns| {
            [&runs.runs, &runs.outlines].into_iter().flatten().map(|buffer| buffer.size()).sum::<u64>()
        };
        GpuUsage { view_bytes: self.0.iter().map(bytes).sum(), ..default() }
    }
}

/// The runs of one volume, in all its views.
#[derive(Default)]
pub(crate) struct ViewRuns {
    pub(super) views: ViewArray<MarchedViewUniform>,
    pub(super) runs: Option<Buffer>,
    pub(super) further_runs: Option<Buffer>,
    /// Lists of the pixels at outlines (`outlines.wgsl`).
    pub(super) outlines: Option<Buffer>,
    /// Entities of the views, then those of the views whose outlines are smooth.
    entities: Vec<Entity>,
    /// Number of the views.
    count: usize,
    /// Number of changes so far.
    revision: u32,
    /// Bind groups for marching, and for finding outlines.
    pub(super) group: KeptGroup<[BufferId; 4]>,
    pub(super) outline_group: KeptGroup<[BufferId; 3]>,
}

/// A view of a volume, `MarchedView` in WGSL (`marched_view.wgsl`).
#[derive(Clone, Copy, Debug, Default, PartialEq, ShaderType)]
pub(crate) struct MarchedViewUniform {
    window: WindowUniform,
    clip_from_local: Mat4,
    part_first: u32,
    part_end: u32,
    first_run: u32,
    end_run: u32,
    flags: u32,
    first_outline: u32,
    most_outlines: u32,
    noise_shift: f32,
}

/// Outlines of a view.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OutlinesOfView {
    /// Dynamic offset of their rays.
    pub offset: u32,
    /// Workgroups that shade all of them (`outline_colors.wgsl`), columns and rows.
    pub workgroups: UVec2,
}

/// Flags of a view, as in WGSL.
const HAS_RUNS: u32 = 1;
const IS_MIRRORED: u32 = 2;
const OF_OUTLINES: u32 = 4;
/// First bit of the number of rays for each pixel of an outline.
const OUTLINE_RAYS_BIT: u32 = 16;

/// A pixel in 32 bits, as `unpack_pixel` reads it.
pub(crate) fn pack_pixel(pixel: UVec2) -> u32 {
    pixel.x | (pixel.y << 16)
}

impl MarchedViewUniform {
    pub fn without_runs(window: &VolumeWindow) -> Self {
        Self {
            window: window.uniform,
            clip_from_local: window.clip_from_local,
            noise_shift: window.noise_shift,
            flags: (window.outline_rays << OUTLINE_RAYS_BIT)
                | if window.is_mirrored { IS_MIRRORED } else { 0 },
            ..default()
        }
    }
}

/// What to march in a frame.
#[derive(Clone, Copy)]
pub(super) struct MarchParts {
    /// Parts of the views.
    pub views: ViewParts,
    /// Sizes of the largest window, and of the largest one of rays of outlines, pixels.
    pub whole: [UVec2; 2],
    /// Number of views with smooth outlines, which follow the others. All their outlines are found anew.
    pub outlines: u32,
}

/// Change of a volume since its views were last visited.
pub(crate) enum Stale {
    Nothing,
    /// Only within these boxes, each given by its corners in volume space (mm).
    Within(Vec<[Vec3; 8]>),
    Everything,
}

impl Stale {
    /// The change by a step of clipping, which shows within a radius of the carvers that changed.
    pub fn by(
        step: &ClipStep,
        radius_mm: f64,
        geometry: &VolumeGeometry,
        optimizations: &Optimizations,
    ) -> Self {
        let Some(changes) = &step.changes else {
            return if optimizations.rest { Self::Nothing } else { Self::Everything };
        };
        let boxes = (optimizations.outlines && !step.is_all_stale)
            .then(|| outlines(changes, radius_mm, geometry))
            .flatten();
        boxes.map_or(Self::Everything, Self::Within)
    }

    /// Part of a view to visit again; all of a new view. `None` if nothing changed there.
    pub fn part_of(&self, view: &VolumeWindow, is_new: bool) -> Option<WindowUniform> {
        match self {
            Self::Nothing if !is_new => None,
            Self::Within(boxes) if !is_new => view.around(boxes),
            _ => Some(view.uniform),
        }
    }
}

impl ViewRuns {
    fn index_of(&self, view: Entity) -> Option<usize> {
        self.entities[..self.count].iter().position(|entity| *entity == view)
    }

    /// Dynamic offset of a view.
    pub fn offset_of(&self, view: Entity) -> Option<u32> {
        Some(self.index_of(view)? as u32 * ViewArray::<MarchedViewUniform>::BYTES)
    }

    /// Tells apart what the runs hold: it changes with every march.
    pub fn revision(&self) -> u32 {
        self.revision
    }

    /// Outlines of a view, if they are smooth.
    pub fn outlines_of(&self, view: Entity) -> Option<OutlinesOfView> {
        let index = self.count + self.entities[self.count..].iter().position(|entity| *entity == view)?;
        let uniform = self.views.get().get(index)?;
        Some(OutlinesOfView {
            offset: index as u32 * ViewArray::<MarchedViewUniform>::BYTES,
            workgroups: workgroups_of(uniform.most_outlines, uniform.flags >> OUTLINE_RAYS_BIT),
        })
    }

    /// Whole windows with the rays of outlines, in the order of views behind the others.
    pub fn outline_windows(&self) -> impl Iterator<Item = WindowUniform> {
        self.views.get().iter().take(self.entities.len()).skip(self.count).map(|view| view.window)
    }

    /// Arguments of the draw of a view's rays that found no room for all runs: buffer, and first byte.
    pub fn cut_off_draw(&self, view: Entity) -> Option<(&Buffer, u64)> {
        Some((self.further_runs.as_ref()?, further_offset(self.index_of(view)?)))
    }

    /// Buffers for drawing: views, runs, and lists of outlines.
    pub fn buffers(&self) -> Option<[&Buffer; 3]> {
        Some([self.views.buffer()?, self.runs.as_ref()?, self.outlines.as_ref()?])
    }

    /// Finds the parts of views to march, and records them as marched: a planned march always runs. `None` if no part
    /// is to be marched.
    pub(super) fn plan(&mut self, windows: &[VolumeWindow], stale: &Stale, gpu: &Gpu) -> Option<MarchParts> {
        let outlined = || windows.iter().filter(|window| window.smooths_outlines());
        let [views, outlined_views] = [windows.len(), outlined().count()];
        let whole = |window: &VolumeWindow| window.uniform;
        let pixels = || {
            windows.iter().map(whole).chain(outlined().map(rays_of_outlines)).map(|window| pixels_of(&window))
        };
        let had_outlines = self.entities.get(self.count..).unwrap_or_default();
        let is_new = !had_outlines.iter().eq(outlined().map(|window| &window.view))
            | self.keep_room(pixels().sum::<u64>() * (1 + FURTHER_RUNS), views + outlined_views, &gpu.device)
            | self.keep_outlines(outlined().map(outline_words).sum(), &gpu.device);
        let capacity = self.runs.as_ref().map_or(0, |runs| runs.size() / RUN_BYTES);
        let room = rooms(pixels(), capacity);
        let mut lists = lists(outlined());
        let mut largest = UVec2::ZERO;
        let mut views = Vec::with_capacity(windows.len());
        let mut of_outlines = Vec::new();
        for (index, (window, &[first_run, end_run])) in windows.iter().zip(&room).enumerate() {
            let has_same_place = |before: &&MarchedViewUniform| {
                (before.window, before.first_run, before.end_run) == (window.uniform, first_run, end_run)
                    && before.noise_shift == window.noise_shift
                    && before.flags >> OUTLINE_RAYS_BIT == window.outline_rays
            };
            let is_same = !is_new
                && self.entities.get(index) == Some(&window.view)
                && self.views.get().get(index).filter(has_same_place).is_some();
            let part = stale.part_of(window, !is_same);
            let [part_first, part_end] = part.map_or([UVec2::ZERO; 2], |part| [part.first, part.end]);
            let [first_outline, most_outlines] =
                if window.smooths_outlines() { lists.next().unwrap_or_default() } else { [0; 2] };
            let has_runs = is_same && !matches!(stale, Stale::Everything);
            if let Some(counts) = self.further_runs.as_ref().filter(|_| !has_runs) {
                let reset = [BOX_VERTICES, 0, 0, 0, 0];
                gpu.queue.write_buffer(counts, further_offset(index), bytemuck::cast_slice(&reset));
            }
            largest = largest.max(part_end - part_first);
            let view = MarchedViewUniform::without_runs(window);
            let view = MarchedViewUniform {
                part_first: pack_pixel(part_first),
                part_end: pack_pixel(part_end),
                first_run,
                end_run,
                flags: view.flags | if has_runs { HAS_RUNS } else { 0 },
                first_outline,
                most_outlines,
                ..view
            };
            views.push(view);
            if window.smooths_outlines() {
                let rays = rays_of_outlines(window);
                let [first_run, end_run] = room[windows.len() + of_outlines.len()];
                of_outlines.push(MarchedViewUniform {
                    window: rays,
                    part_first: pack_pixel(rays.first),
                    part_end: pack_pixel(rays.end),
                    first_run,
                    end_run,
                    flags: (view.flags & !HAS_RUNS) | OF_OUTLINES,
                    ..view
                });
            }
        }
        let is_marched = largest != UVec2::ZERO;
        if is_marched {
            self.revision = self.revision.wrapping_add(1);
            self.reset_outlines(windows.len(), &of_outlines, gpu);
        }
        let parts = MarchParts {
            views: ViewParts { largest, first: 0, count: windows.len() as u32 },
            whole: [
                largest_of(windows.iter().map(whole)),
                largest_of(of_outlines.iter().map(|view| view.window)),
            ],
            outlines: of_outlines.len() as u32,
        };
        views.extend(of_outlines);
        self.write(windows, views, gpu);
        is_marched.then_some(parts)
    }

    /// Empties the lists of outlines, and the further runs of their rays: both are found anew.
    fn reset_outlines(&self, views: usize, of_outlines: &[MarchedViewUniform], gpu: &Gpu) {
        let (Some(lists), Some(counts)) = (&self.outlines, &self.further_runs) else {
            return;
        };
        for (index, view) in of_outlines.iter().enumerate() {
            let head = [0, view.first_run];
            gpu.queue.write_buffer(lists, 4 * u64::from(view.first_outline), bytemuck::cast_slice(&head));
            let reset = [BOX_VERTICES, 0, 0, 0, 0];
            gpu.queue.write_buffer(counts, further_offset(views + index), bytemuck::cast_slice(&reset));
        }
    }

    /// The same for views that draw without runs.
    pub fn plan_without(&mut self, windows: &[VolumeWindow], gpu: &Gpu) {
        self.keep_room(0, windows.len(), &gpu.device);
        self.keep_outlines(0, &gpu.device);
        self.write(windows, windows.iter().map(MarchedViewUniform::without_runs).collect(), gpu);
    }

    fn write(&mut self, windows: &[VolumeWindow], views: Vec<MarchedViewUniform>, gpu: &Gpu) {
        self.entities.clear();
        self.count = windows.len();
        let outlined =
            windows.iter().filter(|window| window.smooths_outlines() && views.len() > windows.len());
        self.entities.extend(windows.iter().chain(outlined).map(|window| window.view));
        self.views.write(views, gpu);
    }

    /// Makes a buffer with enough room for lists of outlines. Returns whether it is new.
    fn keep_outlines(&mut self, words: u64, device: &RenderDevice) -> bool {
        // Bindings are never empty.
        let needed = 4 * words.max(OUTLINE_HEAD + 1);
        let has = self.outlines.as_ref().map_or(0, |lists| lists.size());
        if needed <= has && has <= 4 * needed {
            return false;
        }
        self.outlines = Some(run_buffer("contextual_ao_outlines", needed, device));
        true
    }

    /// Makes buffers with enough room for a number of runs. Returns whether they are new.
    fn keep_room(&mut self, wanted: u64, views: usize, device: &RenderDevice) -> bool {
        let most = (device.limits().max_storage_buffer_binding_size / RUN_BYTES).min(MOST_RUNS);
        let needed = wanted.clamp(1, most);
        let has = self.runs.as_ref().map_or(0, |runs| runs.size() / RUN_BYTES);
        let counts = self.further_runs.as_ref().map_or(0, |counts| counts.size());
        if needed <= has && has <= 4 * needed && further_offset(views) <= counts {
            return false;
        }
        // A window that grows from frame to frame does not need new buffers in every frame.
        let room = if has == 0 { needed } else { (needed + needed / 4).min(most) };
        self.runs = Some(run_buffer("contextual_ao_runs", RUN_BYTES * room, device));
        let further_bytes = further_offset(views.max(1));
        self.further_runs = Some(run_buffer("contextual_ao_further_runs", further_bytes, device));
        true
    }
}

/// A buffer that march writes.
fn run_buffer(label: &'static str, size: u64, device: &RenderDevice) -> Buffer {
    device.create_buffer(&BufferDescriptor {
        label: Some(label),
        size,
        usage: BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::INDIRECT,
        mapped_at_creation: false,
    })
}

/// First byte of a view's further runs.
fn further_offset(index: usize) -> u64 {
    4 * FURTHER_WORDS * index as u64
}

/// First and end run of windows, by their pixels. Where there is too little room, later windows get less or none.
fn rooms(pixels: impl Iterator<Item = u64>, capacity: u64) -> Vec<[u32; 2]> {
    let mut first = 0;
    let rooms = pixels.map(|pixels| {
        let end = (first + pixels * (1 + FURTHER_RUNS)).min(capacity);
        let room = [first as u32, end as u32];
        first = end;
        room
    });
    rooms.collect()
}
