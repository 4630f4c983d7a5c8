//! Registry of the methods that plugins add, each behind the same trait.

use bevy::{
    prelude::*,
    render::{RenderApp, render_resource::PipelineCache},
};
use core::marker::PhantomData;

use super::voxel_method::{KeptVolume, VolumeFrame, VoxelMethod};
use crate::{
    occlusion::{OcclusionMethod, Optimizations},
    render::{
        clipping::step::Demand,
        extract::ExtractedScene,
        gpu::{device::Gpu, frame::Frame},
        volumes::{kept::MethodResources, store::VolumeStore},
    },
};

/// Adds a method that computes the occlusion of voxels. Add this plugin after Bevy's `DefaultPlugins`.
pub struct VoxelMethodPlugin<M>(PhantomData<fn() -> M>);

impl<M> Default for VoxelMethodPlugin<M> {
    fn default() -> Self {
        Self(PhantomData)
    }
}

impl<M: VoxelMethod> Plugin for VoxelMethodPlugin<M> {
    fn build(&self, app: &mut App) {
        if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
            let mut makers = render_app.world_mut().get_resource_or_init::<MethodMakers>();
            makers
                .0
                .push(|world| Box::new(Registered::<M> { method: M::from_world(world), jobs: Vec::new() }));
        }
    }
}

/// Constructors of the methods, run when there is a device.
#[derive(Resource, Default, Clone)]
struct MethodMakers(Vec<fn(&mut World) -> Box<dyn AnyVoxelMethod>>);

/// The methods, in the order in which they were added.
#[derive(Resource)]
pub(crate) struct VoxelMethods(Vec<Box<dyn AnyVoxelMethod>>);

impl FromWorld for VoxelMethods {
    fn from_world(world: &mut World) -> Self {
        let makers = world.get_resource_or_init::<MethodMakers>().clone();
        Self(makers.0.into_iter().map(|make| make(world)).collect())
    }
}

impl VoxelMethods {
    /// The method that computes the occlusion of some settings.
    pub fn of(&self, method: &OcclusionMethod) -> Option<&dyn AnyVoxelMethod> {
        self.0.iter().find(|voxels| voxels.computes(method)).map(|voxels| &**voxels)
    }

    /// The same method, mutable for planning.
    pub fn of_mut(&mut self, method: &OcclusionMethod) -> Option<&mut Box<dyn AnyVoxelMethod>> {
        self.0.iter_mut().find(|voxels| voxels.computes(method))
    }

    /// Encodes the passes of all methods.
    pub fn encode(&self, frame: &mut Frame, cache: &PipelineCache) {
        for method in &self.0 {
            method.encode(frame, cache);
        }
    }
}

/// A [`VoxelMethod`] of any type.
pub(crate) trait AnyVoxelMethod: Send + Sync {
    fn computes(&self, method: &OcclusionMethod) -> bool;
    fn is_ready(&self, method: &OcclusionMethod, cache: &PipelineCache) -> bool;
    /// Forgets the jobs of the previous frame, and reads the world.
    fn begin_frame(&mut self, world: &World);
    fn keep(
        &self,
        kept: Option<Box<dyn MethodResources>>,
        volume: &KeptVolume,
        gpu: &Gpu,
    ) -> Box<dyn MethodResources>;
    fn demand(&self, volume: &KeptVolume, optimizations: &Optimizations) -> Demand;
    fn plan(&mut self, kept: &mut dyn MethodResources, volume: &VolumeFrame, gpu: &Gpu);
    fn encode(&self, frame: &mut Frame, cache: &PipelineCache);
}

struct Registered<M: VoxelMethod> {
    method: M,
    jobs: Vec<M::Job>,
}

impl<M: VoxelMethod> AnyVoxelMethod for Registered<M> {
    fn computes(&self, method: &OcclusionMethod) -> bool {
        self.method.computes(method)
    }

    fn is_ready(&self, method: &OcclusionMethod, cache: &PipelineCache) -> bool {
        self.method.is_ready(method, cache)
    }

    fn begin_frame(&mut self, world: &World) {
        self.jobs.clear();
        self.method.read(world);
    }

    fn keep(
        &self,
        kept: Option<Box<dyn MethodResources>>,
        volume: &KeptVolume,
        gpu: &Gpu,
    ) -> Box<dyn MethodResources> {
        // Resources of another method are freed before new ones are made.
        let kept = kept.and_then(|kept| kept.take::<M::Kept>()).map(|kept| *kept);
        Box::new(self.method.keep(kept, volume, gpu))
    }

    fn demand(&self, volume: &KeptVolume, optimizations: &Optimizations) -> Demand {
        self.method.demand(volume, optimizations)
    }

    fn plan(&mut self, kept: &mut dyn MethodResources, volume: &VolumeFrame, gpu: &Gpu) {
        if let Some(kept) = kept.get_mut::<M::Kept>() {
            self.jobs.extend(self.method.plan(kept, volume, gpu));
        }
    }

    fn encode(&self, frame: &mut Frame, cache: &PipelineCache) {
        self.method.encode(&self.jobs, frame, cache);
    }
}

/// Lets methods read the render world, once a frame.
pub(crate) fn begin_methods(world: &mut World) {
    world.resource_scope(|world, mut methods: Mut<VoxelMethods>| {
        for method in &mut methods.0 {
            method.begin_frame(world);
        }
    });
}

/// Keeps each volume's resources for its method, and frees those of other methods, before drawing binds them.
pub(crate) fn keep_for_methods(
    scene: Res<ExtractedScene>,
    methods: Res<VoxelMethods>,
    gpu: Gpu,
    mut store: ResMut<VolumeStore>,
) {
    for volume in &scene.volumes {
        let Some(resources) = store.0.get_mut(&volume.entity) else {
            continue;
        };
        let kept = resources.kept.take();
        let method = methods.of(&volume.occlusion.method);
        let kept = method.map(|method| method.keep(kept, &KeptVolume { volume, resources }, &gpu));
        resources.kept = kept;
    }
}
