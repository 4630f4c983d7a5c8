//! Resources that sweeping keeps on the GPU for a volume, and its settings (`sweeping.wgsl`).

use bevy::{
    prelude::*,
    render::{
        render_resource::{
            Buffer, BufferDescriptor, BufferUsages, DynamicUniformBuffer, ShaderType, TextureFormat,
            TextureUsages, TextureView, TextureViewDimension, UniformBuffer,
        },
        renderer::RenderDevice,
    },
};

use super::{
    geometry_term::geometry_term_table,
    planes::{SweepPlane, planes, tile_counts},
};
use crate::{
    diagnostics::GpuUsage,
    occlusion::OcclusionSweeping,
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

/// Format of the texture by which a surface is drawn. All devices filter and write it.
pub(super) const SURFACE_FORMAT: TextureFormat = TextureFormat::Rgba16Float;

/// The settings, as `Sweeping` in WGSL.
#[derive(Clone, Copy, Debug, Default, PartialEq, ShaderType)]
pub(crate) struct SweepingUniform {
    weights: [Vec4; 2],
    spacing_mm: Vec3,
    smallest_spacing_mm: f32,
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
    /// Uniforms of all planes of all octants.
    pub planes: DynamicUniformBuffer<SweepPlane>,
    /// Offset of each plane's uniform, and its workgroups, octant by octant.
    pub dispatches: Vec<(u32, UVec2)>,
    /// Light on its way from tile to tile: a number for every column along each axis.
    pub faces: Buffer,
    /// Visibility of every voxel: the octants' mean, or eight bytes. Before the sweeps, differences of intensities from
    /// the isovalue.
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
        let fits = |kept: &Self| {
            kept.distances.is_some() == settings.surface.isovalue().is_some()
                && kept.surface.is_some() == settings.draws_surface()
                && kept.keeps_octants == settings.keeps_octants()
        };
        // First free, then allocate.
        let kept = kept.filter(fits);
        let mut kept = kept.unwrap_or_else(|| {
            if settings.keeps_octants() {
                volume.resources.lookup_table.write_method_rows(&geometry_term_table(), &gpu.queue);
            }
            Self::new(volume.dimensions(), &settings, &gpu.device)
        });
        let stored = (volume.resources.rescale, volume.resources.gpu_volume.largest_stored);
        kept.uniform.set(uniform(&settings, volume.volume, stored));
        kept
    }

    fn new(dimensions: UVec3, settings: &OcclusionSweeping, device: &RenderDevice) -> Self {
        let [faces, found, distances] = settings.buffer_bytes(dimensions);
        let tiles = tile_counts(dimensions);
        let buffer = |label, size| {
            device.create_buffer(&BufferDescriptor {
                label: Some(label),
                size,
                usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let mut uniforms = DynamicUniformBuffer::default();
        let all = (0..8).flat_map(|octant| planes(octant, tiles));
        let dispatches = all.map(|(plane, groups)| (uniforms.push(&plane), groups)).collect();
        Self {
            uniform: default(),
            planes: uniforms,
            dispatches,
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

    /// Dispatches of the sweeps from octants that bring light, or from all octants.
    pub fn sweeps(&self, all: bool) -> impl Iterator<Item = (u32, UVec2)> + '_ {
        let weights = self.uniform.get().weights;
        let octants = self.dispatches.chunks(self.dispatches.len() / 8).enumerate();
        let needed = octants.filter(move |(octant, _)| all || weights[octant / 4][octant % 4] > 0.0);
        needed.flat_map(|(_, sweep)| sweep.iter().copied())
    }
}

/// Length of ways along the axes, over that of straight ways.
const LATTICE_DETOUR: f64 = 1.5;

/// Settings as shaders read them. `rescale` converts stored intensities to the file's units. The texture gives
/// `largest_stored` as 1.
fn uniform(
    settings: &OcclusionSweeping,
    volume: &ExtractedVolume,
    (rescale, largest_stored): (Rescale, f64),
) -> SweepingUniform {
    let spacing_mm = volume.geometry.spacing_mm;
    let step_mm = volume.occlusion.step_length_mm(&volume.geometry);
    // Light takes equally many steps along each axis. On average a step crosses the mean of the spacings. Steps along
    // axes are longer than the straight way, by the mean of |x| + |y| + |z| over all directions.
    let voxel_mm = spacing_mm.element_sum() / 3.0 / LATTICE_DETOUR;
    let side = rescale.slope.signum();
    let stored = |value| (f64::from(value) - rescale.intercept) / rescale.slope / largest_stored;
    let isovalue = settings.surface.isovalue().map_or(0.0, stored);
    let weights = volume.occlusion.sky.of_grid(&volume.geometry);
    SweepingUniform {
        weights: [Vec4::from_slice(&weights[..4]), Vec4::from_slice(&weights[4..])],
        spacing_mm: spacing_mm.as_vec3(),
        smallest_spacing_mm: spacing_mm.min_element() as f32,
        transmittance_exponent: (voxel_mm / step_mm) as f32,
        opacity: settings.opacity,
        power: settings.gamma.recip(),
        // Intensities are from 0 to 1.
        isovalue: isovalue.clamp(-2.0, 2.0) as f32,
        side: side as f32,
        keeps_octants: settings.keeps_octants().into(),
        least_stretch: volume.geometry.least_stretch() as f32,
    }
}
