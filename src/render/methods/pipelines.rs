//! Compilation of an occlusion method's pipelines, when a volume first wants the method. Until they are ready, the
//! volume keeps its previous method, so that no change of settings shows it without occlusion.

use bevy::{
    ecs::schedule::ScheduleLabel,
    platform::collections::HashMap,
    prelude::*,
    render::{RenderPlugin, render_resource::PipelineCache},
};
use std::sync::{Arc, Mutex};

use super::registry::VoxelMethods;
use crate::{
    occlusion::OcclusionMethod,
    render::{carvers::passes::CarverPasses, clipping::passes::ClippingPasses, views::march::MarchPass},
};

/// Whether frames are drawn while a shader is being compiled.
#[derive(Resource)]
pub(crate) struct CompilesInBackground(pub bool);

impl CompilesInBackground {
    pub fn of(app: &App) -> Self {
        let plugins = app.get_added_plugins::<RenderPlugin>();
        Self(plugins.iter().any(|plugin| !plugin.synchronous_pipeline_compilation))
    }
}

/// Methods wanted so far, by name, with whether their pipelines are ready. Both worlds share them.
#[derive(Resource, Clone)]
pub(crate) struct MethodPipelines(Arc<Mutex<HashMap<&'static str, (OcclusionMethod, bool)>>>);

impl Default for MethodPipelines {
    /// Wants the default method, so that its pipelines are compiled while volumes are being read.
    fn default() -> Self {
        let method = OcclusionMethod::default();
        Self(Arc::new(Mutex::new([(method.name(), (method, false))].into_iter().collect())))
    }
}

impl MethodPipelines {
    /// Whether the pipelines of a method are ready. From now on they are wanted.
    pub fn are_there_for(&self, method: &OcclusionMethod) -> bool {
        let wanted = || (method.clone(), false);
        self.0.lock().is_ok_and(|mut methods| methods.entry(method.name()).or_insert_with(wanted).1)
    }

    /// Whether a method of this name was ever wanted.
    pub fn wants(&self, name: &str) -> bool {
        self.0.lock().is_ok_and(|methods| methods.contains_key(name))
    }
}

/// Schedule that asks for pipelines. Methods of views add their systems to it. It runs once a frame, and once more if
/// pipelines were missing.
#[derive(ScheduleLabel, Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct AskForPipelines;

/// Wanted methods of views, with whether their pipelines are ready.
#[derive(Resource, Default)]
pub(crate) struct ViewPipelines(HashMap<&'static str, bool>);

impl ViewPipelines {
    /// Records whether the pipelines of a method are ready.
    pub fn tell(&mut self, method: &'static str, are_there: bool) {
        self.0.insert(method, are_there);
    }
}

/// Whether all pipelines that were asked for are ready.
#[derive(Resource, Default)]
pub(crate) struct AllAreThere(bool);

/// Compiles the wanted pipelines, and records which are ready.
pub(crate) fn find_ready(world: &mut World) {
    world.run_schedule(AskForPipelines);
    if !world.resource::<AllAreThere>().0 {
        // Now, not later in the frame: without compilation in the background, this frame has the pipelines.
        world.resource_mut::<PipelineCache>().process_queue();
        world.run_schedule(AskForPipelines);
    }
}

/// Asks for the pipelines of all wanted passes, even after one is not ready.
pub(crate) fn ask(
    carvers: CarverPasses,
    (clipping, march): (ClippingPasses, Res<MarchPass>),
    voxels: Res<VoxelMethods>,
    views: Res<ViewPipelines>,
    cache: Res<PipelineCache>,
    methods: Res<MethodPipelines>,
    mut all: ResMut<AllAreThere>,
) {
    let Ok(mut wanted) = methods.0.lock() else {
        return;
    };
    let can_clip = clipping.are_ready() & march.is_ready(&cache);
    all.0 = carvers.are_ready();
    for (method, is_there) in wanted.values_mut() {
        let is_ready = if method.kind().is_of_voxels() {
            let voxels = voxels.of(method);
            voxels.map(|voxels| voxels.is_ready(method, &cache))
        } else {
            views.0.get(method.name()).copied()
        };
        if is_ready.is_none() {
            warn_once!("no plugin computes the occlusion method `{}`", method.name());
        }
        *is_there = can_clip & is_ready.unwrap_or(false);
        all.0 &= *is_there;
    }
}
