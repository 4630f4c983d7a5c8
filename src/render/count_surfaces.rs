//! How many surfaces a clip mesh has along the lines of sight of its clip camera: counted on the
//! device when the mesh changes, known here a frame later.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, Buffer,
            BufferDescriptor, BufferUsages, CachedComputePipelineId, CommandEncoder, ComputePassDescriptor,
            ComputePipelineDescriptor, MapMode, PipelineCache, ShaderStages, TextureSampleType,
            binding_types::{storage_buffer_sized, texture_2d},
        },
        renderer::RenderDevice,
    },
};
use std::sync::{Arc, OnceLock};

use super::{
    clip_draw::{ClipMeshDraw, Draw, MeshSource},
    clip_maps::{ClipMaps, DepthKey},
    clip_textures::ClipTextures,
};

const BYTES: u64 = 4;

/// What is known about the surfaces of one carver's mesh.
#[derive(Default)]
pub(crate) struct SurfaceCount {
    counted: Option<(DepthKey, u32)>,
    pending: Option<Pending>,
}

/// A count under way.
struct Pending {
    of: DepthKey,
    staging: Buffer,
    /// Whether the staging buffer could be read, once that is known; `None` before it is asked for.
    arrived: Option<Arc<OnceLock<bool>>>,
}

impl SurfaceCount {
    /// The most surfaces along a line of sight, of the latest form of `mesh` that was counted: one
    /// that deforms goes on being drawn while the count of its new form is under way.
    pub fn of(&self, mesh: AssetId<Mesh>) -> Option<u32> {
        self.counted.filter(|(key, _)| key.mesh == mesh).map(|(_, count)| count)
    }

    /// Whether the count is that of `key` itself.
    pub fn is_final(&self, key: &DepthKey) -> bool {
        self.counted.is_some_and(|(counted, _)| counted == *key)
    }

    /// Whether a count has to be made.
    pub fn is_wanted(&self, key: &DepthKey) -> bool {
        self.pending.is_none() && !self.is_final(key)
    }

    /// Takes over a count that has arrived.
    pub fn receive(&mut self, device: &RenderDevice) {
        let Some(Pending { arrived: Some(arrived), of, staging }) = &self.pending else {
            return;
        };
        // An error means that the device was lost.
        let _ = device.poll(bevy::render::render_resource::PollType::Poll);
        let Some(&is_readable) = arrived.get() else {
            return;
        };
        if is_readable {
            let bytes = staging.slice(..).get_mapped_range();
            self.counted = Some((*of, bytemuck::pod_read_unaligned(&bytes)));
        }
        self.pending = None;
    }

    /// Asks for the count, once it is submitted.
    fn request(&mut self, device: &RenderDevice) {
        if let Some(Pending { arrived: arrived @ None, staging, .. }) = &mut self.pending {
            let result = Arc::new(OnceLock::new());
            *arrived = Some(result.clone());
            device.map_buffer(&staging.slice(..), MapMode::Read, move |mapped| {
                let _ = result.set(mapped.is_ok());
            });
        }
    }
}

/// Asks for the counts that were made this frame.
pub(crate) fn request_counts(mut clip_maps: ResMut<ClipMaps>, device: Res<RenderDevice>) {
    for slot in clip_maps.slots.values_mut() {
        slot.count.request(&device);
    }
}

#[derive(Resource)]
pub(crate) struct CountPipeline {
    layout: BindGroupLayoutDescriptor,
    pipeline: CachedComputePipelineId,
}

impl FromWorld for CountPipeline {
    fn from_world(world: &mut World) -> Self {
        let layout = BindGroupLayoutDescriptor::new(
            "contextual_ao_count_surfaces",
            &BindGroupLayoutEntries::sequential(
                ShaderStages::COMPUTE,
                (
                    texture_2d(TextureSampleType::Float { filterable: false }),
                    storage_buffer_sized(false, core::num::NonZeroU64::new(BYTES)),
                ),
            ),
        );
        let descriptor = ComputePipelineDescriptor {
            label: Some("contextual_ao_count_surfaces".into()),
            layout: vec![layout.clone()],
            shader: load_embedded_asset!(world, "count_surfaces.wgsl"),
            ..default()
        };
        Self { pipeline: world.resource::<PipelineCache>().queue_compute_pipeline(descriptor), layout }
    }
}

impl CountPipeline {
    pub fn is_ready(&self, cache: &PipelineCache) -> bool {
        cache.get_compute_pipeline(self.pipeline).is_some()
    }

    /// Begins to count the surfaces of a mesh.
    pub fn begin(
        &self,
        draw: ClipMeshDraw,
        key: DepthKey,
        count: &mut SurfaceCount,
        textures: &ClipTextures,
        cache: &PipelineCache,
        device: &RenderDevice,
    ) -> CountJob {
        let buffer = |label, usage| {
            device.create_buffer(&BufferDescriptor {
                label: Some(label),
                size: BYTES,
                usage,
                mapped_at_creation: false,
            })
        };
        let most = buffer("contextual_ao_surface_count", BufferUsages::STORAGE | BufferUsages::COPY_SRC);
        let staging =
            buffer("contextual_ao_surface_count_read", BufferUsages::MAP_READ | BufferUsages::COPY_DST);
        let group = device.create_bind_group(
            "contextual_ao_count_surfaces",
            &cache.get_bind_group_layout(&self.layout),
            &BindGroupEntries::sequential((&textures.counts.view, most.as_entire_binding())),
        );
        count.pending = Some(Pending { of: key, staging: staging.clone(), arrived: None });
        CountJob { draw, group, most, staging }
    }
}

/// One mesh whose surfaces are to be counted.
pub(crate) struct CountJob {
    draw: ClipMeshDraw,
    group: BindGroup,
    most: Buffer,
    staging: Buffer,
}

impl CountJob {
    pub fn encode(
        &self,
        encoder: &mut CommandEncoder,
        pipeline: &CountPipeline,
        textures: &ClipTextures,
        source: &MeshSource,
    ) {
        let Some(pipeline) = source.cache.get_compute_pipeline(pipeline.pipeline) else {
            return;
        };
        self.draw.encode(Draw::Count, encoder, &textures.counts.view, None, source);
        let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor {
            label: Some("contextual_ao_count_surfaces"),
            timestamp_writes: None,
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        // An invocation has 16x16 texels, a workgroup 8x8 invocations.
        let groups = textures.depth_map_size.div_ceil(16 * 8);
        pass.dispatch_workgroups(groups, groups, 1);
        drop(pass);
        encoder.copy_buffer_to_buffer(&self.most, 0, &self.staging, 0, BYTES);
    }
}
