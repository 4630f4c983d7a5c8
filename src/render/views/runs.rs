//! Storage of the runs of a volume's views (`runs.wgsl`), and the parts of views to march in a frame.

use bevy::{
    prelude::*,
    render::{
        render_resource::{Buffer, BufferDescriptor, BufferId, BufferUsages, ShaderType},
        renderer::RenderDevice,
        sync_world::MainEntity,
    },
};

use super::dispatch::{ViewArray, ViewParts};
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
        let bytes = |runs: &ViewRuns| runs.runs.as_ref().map_or(0, |runs| runs.size());
        GpuUsage { view_bytes: self.0.iter().map(bytes).sum(), ..default() }
    }
}

/// The runs of one volume, in all its views.
#[derive(Default)]
pub(crate) struct ViewRuns {
    pub(super) views: ViewArray<MarchedViewUniform>,
    pub(super) runs: Option<Buffer>,
    pub(super) further_runs: Option<Buffer>,
    /// Entities of the views.
    entities: Vec<Entity>,
    /// Bind group for marching.
    pub(super) group: KeptGroup<[BufferId; 3]>,
}

/// A view of a volume, `MarchedView` in WGSL (`marched_view.wgsl`).
#[derive(Clone, Copy, Debug, Default, PartialEq, ShaderType)]
pub(crate) struct MarchedViewUniform {
    window: WindowUniform,
    clip_from_local: Mat4,
    part_first: UVec2,
    part_end: UVec2,
    first_run: u32,
    end_run: u32,
    has_runs: u32,
    is_mirrored: u32,
}

impl MarchedViewUniform {
    fn without_runs(window: &VolumeWindow) -> Self {
        Self {
            window: window.uniform,
            clip_from_local: window.clip_from_local,
            is_mirrored: window.is_mirrored.into(),
            ..default()
        }
    }
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
        self.entities.iter().position(|entity| *entity == view)
    }

    /// Dynamic offset of a view.
    pub fn offset_of(&self, view: Entity) -> Option<u32> {
        Some(self.index_of(view)? as u32 * ViewArray::<MarchedViewUniform>::BYTES)
    }

    /// Arguments of the draw of a view's rays that found no room for all runs: buffer, and first byte.
    pub fn cut_off_draw(&self, view: Entity) -> Option<(&Buffer, u64)> {
        Some((self.further_runs.as_ref()?, further_offset(self.index_of(view)?)))
    }

    /// Buffers for drawing: views and runs.
    pub fn buffers(&self) -> Option<[&Buffer; 2]> {
        Some([self.views.buffer()?, self.runs.as_ref()?])
    }

    /// Finds the parts of views to march, and records them as marched: a planned march always runs. `None` if no part
    /// is to be marched.
    pub(super) fn plan(&mut self, windows: &[VolumeWindow], stale: &Stale, gpu: &Gpu) -> Option<ViewParts> {
        let pixels: u64 = windows.iter().map(pixels_of).sum();
        let is_new = self.keep_room(pixels * (1 + FURTHER_RUNS), windows.len(), &gpu.device);
        let capacity = self.runs.as_ref().map_or(0, |runs| runs.size() / RUN_BYTES);
        let room = rooms(windows, capacity);
        let mut largest = UVec2::ZERO;
        let mut views = Vec::with_capacity(windows.len());
        for (index, (window, [first_run, end_run])) in windows.iter().zip(room).enumerate() {
            let has_same_place = |before: &&MarchedViewUniform| {
                (before.window, before.first_run, before.end_run) == (window.uniform, first_run, end_run)
            };
            let is_same = !is_new
                && self.entities.get(index) == Some(&window.view)
                && self.views.get().get(index).filter(has_same_place).is_some();
            let part = stale.part_of(window, !is_same);
            let [part_first, part_end] = part.map_or([UVec2::ZERO; 2], |part| [part.first, part.end]);
            let has_runs = is_same && !matches!(stale, Stale::Everything);
            if let Some(counts) = self.further_runs.as_ref().filter(|_| !has_runs) {
                let reset = [BOX_VERTICES, 0, 0, 0, 0];
                gpu.queue.write_buffer(counts, further_offset(index), bytemuck::cast_slice(&reset));
            }
            largest = largest.max(part_end - part_first);
            views.push(MarchedViewUniform {
                part_first,
                part_end,
                first_run,
                end_run,
                has_runs: has_runs.into(),
                ..MarchedViewUniform::without_runs(window)
            });
        }
        self.write(windows, views, gpu);
        (largest != UVec2::ZERO).then_some(ViewParts { largest, count: windows.len() as u32 })
    }

    /// The same for views that draw without runs.
    pub fn plan_without(&mut self, windows: &[VolumeWindow], gpu: &Gpu) {
        self.keep_room(0, windows.len(), &gpu.device);
        self.write(windows, windows.iter().map(MarchedViewUniform::without_runs).collect(), gpu);
    }

    fn write(&mut self, windows: &[VolumeWindow], views: Vec<MarchedViewUniform>, gpu: &Gpu) {
        self.entities.clear();
        self.entities.extend(windows.iter().map(|window| window.view));
        self.views.write(views, gpu);
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
        let buffer = |label, size| {
            device.create_buffer(&BufferDescriptor {
                label: Some(label),
                size,
                usage: BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::INDIRECT,
                mapped_at_creation: false,
            })
        };
        // A window that grows from frame to frame does not need new buffers in every frame.
        let room = if has == 0 { needed } else { (needed + needed / 4).min(most) };
        self.runs = Some(buffer("contextual_ao_runs", RUN_BYTES * room));
        self.further_runs = Some(buffer("contextual_ao_further_runs", further_offset(views.max(1))));
        true
    }
}

/// First byte of a view's further runs.
fn further_offset(index: usize) -> u64 {
    4 * FURTHER_WORDS * index as u64
}

fn pixels_of(window: &VolumeWindow) -> u64 {
    (window.uniform.end - window.uniform.first).as_u64vec2().element_product()
}

/// First and end run of each window. Where there is too little room, later windows get less or none.
fn rooms(windows: &[VolumeWindow], capacity: u64) -> Vec<[u32; 2]> {
    let mut first = 0;
    let rooms = windows.iter().map(|window| {
        let end = (first + pixels_of(window) * (1 + FURTHER_RUNS)).min(capacity);
        let room = [first as u32, end as u32];
        first = end;
        room
    });
    rooms.collect()
}
