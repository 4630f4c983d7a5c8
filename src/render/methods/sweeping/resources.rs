//! Resources that sweeping keeps on the GPU for a volume, and its settings (`sweeping.wgsl`).

use bevy::{
    math::{DAffine3, DMat4},
    prelude::*,
    render::{
        render_resource::{
            Buffer, BufferDescriptor, BufferUsages, ShaderType, TextureFormat, TextureUsages, TextureView,
            TextureViewDimension, UniformBuffer,
        },
        renderer::RenderDevice,
    },
};

use super::{geometry_term::geometry_term_table, planes::SweepPlan};
use crate::{
    diagnostics::GpuUsage,
    occlusion::{OcclusionSweeping, TurnedGrid},
    render::{
        extract::ExtractedVolume,
        gpu::{
            device::Gpu,
            formats::volume_texture,
            textures::{TextureAndView, usage_of, usage_of_buffers},
        },
        methods::voxel_method::KeptVolume,
        volumes::kept::MethodResources,
    },
    volume::Rescale,
};

/// Binding numbers of a volume's resources, in group 1 of the passes.
pub(super) const OPACITIES: u32 = 0;
pub(super) const CLIP_PASS: u32 = 2;
pub(super) const FACES: u32 = 4;
pub(super) const FOUND: u32 = 5;
pub(super) const DISTANCES: u32 = 6;
pub(super) const OCCLUSION: u32 = 7;
// Uniforms are behind that of the clip pass (5 in docs/drivers.md).
pub(super) const SETTINGS: u32 = 8;
pub(super) const PLANE: u32 = 9;
pub(super) const SURFACE: u32 = 10;

/// Format of the texture by which a surface is drawn. All devices filter and write it.
pub(super) const SURFACE_FORMAT: TextureFormat = TextureFormat::Rgba16Float;

/// The settings, as `Sweeping` in WGSL.
#[derive(Clone, Copy, Debug, Default, PartialEq, ShaderType)]
pub(crate) struct SweepingUniform {
    weights: [Vec4; 2],
    spacing_mm: Vec3,
    fade_mm: f32,
    cell_from_voxel: Mat4,
    voxel_from_cell: Mat4,
    cells: UVec3,
    transmittance_exponent: f32,
    opacity: f32,
    power: f32,
    isovalue: f32,
    side: f32,
    keeps_octants: u32,
    least_stretch: f32,
}

/// Buffers of one volume.
pub(crate) struct SweepResources {
    pub uniform: UniformBuffer<SweepingUniform>,
    pub plan: SweepPlan,
    /// Light on its way from tile to tile: a number for every column along each axis.
    pub faces: Buffer,
    /// Visibility of every voxel: the octants' mean, or eight bytes. From a turned grid, that of every cell. Before the
    /// sweeps, differences of intensities from the isovalue.
    pub found: Buffer,
    /// Signed distance of every voxel from the surface at the isovalue, mm, if this surface occludes.
    pub distances: Option<Buffer>,
    /// Gradient of the distance, and the distance (`surface.wgsl`), if views draw the surface alone.
    pub surface: Option<TextureAndView>,
    /// Whether each octant's visibility is kept, not their mean.
    pub keeps_octants: bool,
    pub dimensions: UVec3,
    /// Results computed since the last change.
    pub computed: Computed,
}

/// Results that have been computed. Each variant includes the one before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Computed {
    #[default]
    Nothing,
    /// Distance field of a surface that is drawn.
    Distances,
    Occlusion,
}

impl MethodResources for SweepResources {
    fn usage(&self) -> GpuUsage {
        usage_of_buffers([&self.faces, &self.found])
            + usage_of_buffers(&self.distances)
            + usage_of(self.surface.iter().map(|surface| &surface.texture))
    }

    fn orientations(&self) -> Option<&TextureView> {
        self.surface.as_ref().map(|surface| &surface.view)
    }

    fn drawn_intensities(&self) -> Option<Vec2> {
        let SweepingUniform { isovalue, side, .. } = *self.uniform.get();
        let drawn = if side > 0.0 { Vec2::new(isovalue, f32::MAX) } else { Vec2::new(f32::MIN, isovalue) };
        self.surface.is_some().then_some(drawn)
    }
}

impl SweepResources {
    /// Keeps the resources that fit a volume's settings, or makes new ones.
    pub fn kept(kept: Option<Self>, volume: &KeptVolume, gpu: &Gpu) -> Self {
        let settings: OcclusionSweeping = volume.settings().copied().unwrap_or_default();
        let turned = settings.turned_grid(volume.geometry());
        let cells = turned.map(|grid| grid.cells);
        let fits = |kept: &Self| {
            kept.distances.is_some() == settings.surface.isovalue().is_some()
                && kept.surface.is_some() == settings.draws_surface()
                && kept.keeps_octants == settings.keeps_octants()
                && kept.plan.cells().is_some() == settings.light.is_some()
        };
        // First free, then allocate.
        let kept = kept.filter(fits);
        let mut kept = kept.unwrap_or_else(|| {
            if settings.keeps_octants() {
                volume.resources.lookup_table.write_method_rows(&geometry_term_table(), &gpu.queue);
            }
            Self::new(volume.dimensions(), &settings, cells, &gpu.device)
        });
        if kept.plan.cells() != cells {
            kept.plan = SweepPlan::new(volume.dimensions(), cells);
        }
        let stored = (volume.resources.rescale, volume.resources.gpu_volume.largest_stored);
        kept.uniform.set(uniform(&settings, turned, volume.volume, stored));
        kept
    }

    fn new(
        dimensions: UVec3,
        settings: &OcclusionSweeping,
        cells: Option<UVec3>,
        device: &RenderDevice,
    ) -> Self {
        let [faces, found, distances] = settings.buffer_bytes(dimensions);
        let buffer = |label, size| {
            device.create_buffer(&BufferDescriptor {
                label: Some(label),
                size,
                usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        Self {
            uniform: default(),
            plan: SweepPlan::new(dimensions, cells),
            faces: buffer("contextual_ao_sweep_faces", faces),
            found: buffer("contextual_ao_sweep_found", found),
            distances: (distances > 0).then(|| buffer("contextual_ao_sweep_distances", distances)),
            surface: settings.draws_surface().then(|| {
                let descriptor = volume_texture(
                    "contextual_ao_sweep_surface",
                    dimensions,
                    SURFACE_FORMAT,
                    TextureUsages::STORAGE_BINDING,
                );
                TextureAndView::new(device, &descriptor, TextureViewDimension::D3)
            }),
            keeps_octants: settings.keeps_octants(),
            dimensions,
            computed: default(),
        }
    }

    /// Whether light comes from an octant of the volume's grid.
    pub fn has_light(&self, octant: usize) -> bool {
        self.uniform.get().weights[octant / 4][octant % 4] > 0.0
    }
}

/// Length of ways along the axes, over that of straight ways.
const LATTICE_DETOUR: f64 = 1.5;

/// Settings as shaders read them, with the grid of the light if it is not the volume's. `rescale` converts stored
/// intensities to the file's units. The texture gives `largest_stored` as 1.
fn uniform(
    settings: &OcclusionSweeping,
    turned: Option<TurnedGrid>,
    volume: &ExtractedVolume,
    (rescale, largest_stored): (Rescale, f64),
) -> SweepingUniform {
    let geometry = &volume.geometry;
    let spacing_mm = geometry.spacing_mm;
    let step_mm = volume.occlusion.step_length_mm(geometry);
    // Light takes equally many steps along each axis. On average a step crosses the mean of the spacings. Steps along
    // axes are longer than the straight way, by the mean of |x| + |y| + |z| over all directions.
    let mean_mm = turned.map_or(spacing_mm.element_sum() / 3.0, |grid| grid.cell_mm);
    let side = rescale.slope.signum();
    let stored = |value| (f64::from(value) - rescale.intercept) / rescale.slope / largest_stored;
    let isovalue = settings.surface.isovalue().map_or(0.0, stored);
    let weights = volume.occlusion.octant_weights(geometry);
    let cell_from_voxel =
        turned.map_or(DAffine3::IDENTITY, |grid| grid.cell_from_local * geometry.local_from_voxel);
    SweepingUniform {
        weights: [Vec4::from_slice(&weights[..4]), Vec4::from_slice(&weights[4..])],
        spacing_mm: spacing_mm.as_vec3(),
        fade_mm: turned.map_or(spacing_mm.min_element(), |grid| grid.cell_mm) as f32,
        cell_from_voxel: DMat4::from(cell_from_voxel).as_mat4(),
        voxel_from_cell: DMat4::from(cell_from_voxel.inverse()).as_mat4(),
        cells: turned.map_or(geometry.dimensions, |grid| grid.cells),
        transmittance_exponent: (mean_mm / LATTICE_DETOUR / step_mm) as f32,
        opacity: settings.opacity,
        power: settings.gamma.recip(),
        // Intensities are from 0 to 1.
        isovalue: isovalue.clamp(-2.0, 2.0) as f32,
        side: side as f32,
        // The light of a turned grid is that of one octant, and kept as it is.
        keeps_octants: (settings.keeps_octants() && turned.is_none()).into(),
        least_stretch: geometry.least_stretch() as f32,
    }
}
