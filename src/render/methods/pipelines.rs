//! Pipelines of an occlusion method are compiled when a volume first wants the method. Until they are there, the
//! volume keeps the method before, so that no change of settings shows it without occlusion.

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
    render::{carvers::passes::CarverPasses, clipping::passes::ClippingPasses},
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

/// The methods that were wanted so far, by their names, with whether their pipelines are there. In both worlds.
#[derive(Resource, Clone)]
pub(crate) struct MethodPipelines(Arc<Mutex<HashMap<&'static str, (OcclusionMethod, bool)>>>);

impl Default for MethodPipelines {
    /// With the default method: what it needs is compiled while volumes are being read.
    fn default() -> Self {
        let method = OcclusionMethod::default();
        Self(Arc::new(Mutex::new([(method.name(), (method, false))].into_iter().collect())))
    }
}

impl MethodPipelines {
    /// Whether the pipelines of a method are there. They are wanted from now on.
    pub fn are_there_for(&self, method: &OcclusionMethod) -> bool {
        let wanted = || (method.clone(), false);
        self.0.lock().is_ok_and(|mut methods| methods.entry(method.name()).or_insert_with(wanted).1)
    }

    /// Whether a method of this name was ever wanted.
    pub fn wants(&self, name: &str) -> bool {
        self.0.lock().is_ok_and(|methods| methods.contains_key(name))
    }
}

/// In this schedule those ask for pipelines whose methods draw into views. It is run once a frame, and once more
/// where pipelines were missing.
#[derive(ScheduleLabel, Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct AskForPipelines;

/// Whether the pipelines of a method of views are there, of those that are wanted.
#[derive(Resource, Default)]
pub(crate) struct ViewPipelines(HashMap<&'static str, bool>);

impl ViewPipelines {
    /// Tells whether they are there.
    pub fn tell(&mut self, method: &'static str, are_there: bool) {
        self.0.insert(method, are_there);
    }
}

/// Whether all that was asked for is there.
#[derive(Resource, Default)]
pub(crate) struct AllAreThere(bool);

/// Compiles what is wanted, and says what is there.
pub(crate) fn find_ready(world: &mut World) {
    world.run_schedule(AskForPipelines);
    if !world.resource::<AllAreThere>().0 {
        // At once, rather than later in the frame: where nothing is compiled in the background, this frame has it.
        world.resource_mut::<PipelineCache>().process_queue();
        world.run_schedule(AskForPipelines);
    }
}

/// Asks all passes that are wanted, whatever others say.
pub(crate) fn ask(
    carvers: CarverPasses,
    clipping: ClippingPasses,
    voxels: Res<VoxelMethods>,
    views: Res<ViewPipelines>,
    cache: Res<PipelineCache>,
    methods: Res<MethodPipelines>,
    mut all: ResMut<AllAreThere>,
) {
    let Ok(mut wanted) = methods.0.lock() else {
        return;
    };
    let can_clip = clipping.are_ready();
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
