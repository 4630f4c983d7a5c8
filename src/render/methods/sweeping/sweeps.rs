//! The sweeps over one volume (`sweep.wgsl`), plane by plane.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::render_resource::{
        BindGroup, BindGroupEntry, BindGroupLayoutEntry, BindingResource, CommandEncoder, PipelineCache,
        ShaderStages, TextureSampleType,
        binding_types::{storage_buffer_read_only_sized, storage_buffer_sized, texture_3d, uniform_buffer},
    },
};

use super::{
    planes::{PlaneDispatch, SweepPlane},
    resources::{DISTANCES, FACES, FOUND, OPACITIES, PLANE, SETTINGS, SweepResources, SweepingUniform},
};
use crate::render::{
    gpu::{
        compute_pass::{ComputePass, PassDescriptor},
        device::Gpu,
    },
    volumes::{layouts::bricks_layout, store::VolumeResources},
};

/// What the sweeps carry, and what stops the light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Swept {
    /// Light through opacities.
    Opacities,
    /// Light around an isosurface, and the distances from it.
    Isosurface,
    /// Distances from an isosurface.
    Distances,
    /// Light through opacities, in a turned grid.
    TurnedOpacities,
    /// Light around an isosurface of known distances, in a turned grid.
    TurnedIsosurface,
}

impl Swept {
    /// All, in the order of their numbers.
    const ALL: [Self; 5] =
        [Self::Opacities, Self::Isosurface, Self::Distances, Self::TurnedOpacities, Self::TurnedIsosurface];

    fn shader_defs(self) -> &'static [&'static str] {
        match self {
            Self::Opacities => &["LIGHT"],
            Self::Isosurface => &["LIGHT", "DISTANCES", "BY_DISTANCE"],
            Self::Distances => &["DISTANCES", "BY_DISTANCE"],
            Self::TurnedOpacities => &["LIGHT", "TURNED"],
            Self::TurnedIsosurface => &["LIGHT", "TURNED", "BY_DISTANCE"],
        }
    }

    /// Bindings of the pass.
    fn bindings(self) -> &'static [u32] {
        match self {
            Self::Opacities | Self::TurnedOpacities => &[OPACITIES, SETTINGS, PLANE, FACES, FOUND],
            Self::Isosurface | Self::TurnedIsosurface => &[SETTINGS, PLANE, FACES, FOUND, DISTANCES],
            Self::Distances => &[SETTINGS, PLANE, DISTANCES],
        }
    }

    fn layout(self) -> Vec<BindGroupLayoutEntry> {
        let stages = ShaderStages::COMPUTE;
        let entry = |&binding: &u32| match binding {
            OPACITIES => texture_3d(TextureSampleType::Float { filterable: true }).build(OPACITIES, stages),
            SETTINGS => uniform_buffer::<SweepingUniform>(false).build(SETTINGS, stages),
            PLANE => uniform_buffer::<SweepPlane>(true).build(PLANE, stages),
            DISTANCES if self == Self::TurnedIsosurface => {
                storage_buffer_read_only_sized(false, None).build(DISTANCES, stages)
            }
            _ => storage_buffer_sized(false, None).build(binding, stages),
        };
        self.bindings().iter().map(entry).collect()
    }
}

/// The passes, in the order of [`Swept::ALL`].
pub(super) struct SweepKinds([ComputePass; Swept::ALL.len()]);

/// Sweeps of one kind over a volume.
pub(super) struct Sweep {
    what: Swept,
    group: BindGroup,
    planes: Vec<PlaneDispatch>,
}

impl FromWorld for SweepKinds {
    fn from_world(world: &mut World) -> Self {
        let shader: Handle<Shader> = load_embedded_asset!(world, "sweep.wgsl");
        Self(Swept::ALL.map(|what| {
            let descriptor = PassDescriptor {
                name: "contextual_ao_sweep",
                shader: shader.clone(),
                shader_defs: what.shader_defs().iter().map(|&def| def.into()).collect(),
                before: vec![bricks_layout()],
                own: &what.layout(),
                ..default()
            };
            ComputePass::new(world, descriptor)
        }))
    }
}

impl SweepKinds {
    pub fn all(&self) -> impl Iterator<Item = &ComputePass> {
        self.0.iter()
    }

    /// The sweeps that a volume needs, in order. `distances_alone` leaves out the light, if there are distances.
    pub fn plan(
        &self,
        volume: &VolumeResources,
        sweeping: &SweepResources,
        distances_alone: bool,
        gpu: &Gpu,
    ) -> Option<Vec<Sweep>> {
        let plan = &sweeping.plan;
        let all = || plan.octants(|_| true);
        let turned = plan.turned().map(<[PlaneDispatch]>::to_vec);
        let sweeps = match (&sweeping.distances, turned) {
            (None, None) => vec![(Swept::Opacities, plan.octants(|octant| sweeping.has_light(octant)))],
            (None, Some(turned)) => vec![(Swept::TurnedOpacities, turned)],
            (Some(_), _) if distances_alone => vec![(Swept::Distances, all())],
            (Some(_), None) => vec![(Swept::Isosurface, all())],
            (Some(_), Some(turned)) => vec![(Swept::Distances, all()), (Swept::TurnedIsosurface, turned)],
        };
        let bind = |(what, planes): (Swept, Vec<PlaneDispatch>)| {
            let resource = |&binding: &u32| {
                let resource = match binding {
                    OPACITIES => BindingResource::TextureView(&volume.opacities.view),
                    SETTINGS => sweeping.uniform.binding()?,
                    PLANE => sweeping.plan.uniforms.binding()?,
                    FACES => sweeping.faces.as_entire_binding(),
                    DISTANCES => sweeping.distances.as_ref()?.as_entire_binding(),
                    _ => sweeping.found.as_entire_binding(),
                };
                Some(BindGroupEntry { binding, resource })
            };
            let entries: Option<Vec<_>> = what.bindings().iter().map(resource).collect();
            let group = self.of(what).bind_entries(&entries?, &gpu.cache, &gpu.device);
            Some(Sweep { what, group, planes })
        };
        sweeps.into_iter().map(bind).collect()
    }

    fn of(&self, what: Swept) -> &ComputePass {
        &self.0[what as usize]
    }

    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        volume: &BindGroup,
        sweep: &Sweep,
        cache: &PipelineCache,
    ) {
        let planes = sweep.planes.iter().copied();
        self.of(sweep.what).encode_steps(encoder, [volume, &sweep.group], planes, cache);
    }
}
