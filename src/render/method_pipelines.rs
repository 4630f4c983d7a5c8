//! Pipelines of an occlusion method are compiled when a volume first wants the method. Until they are there, the
//! volume keeps the method before, so that no change of settings shows it without occlusion.

use bevy::{
    ecs::system::SystemParam,
    platform::collections::HashMap,
    prelude::*,
    render::{RenderPlugin, render_resource::PipelineCache},
};
use core::mem::{Discriminant, discriminant};
use std::sync::{Arc, Mutex};

use super::{
    extract::ExtractedScene,
    methods::{direct::CompositePipelines, screen_space::DarkenPipelines},
    passes::Passes,
};
use crate::occlusion::OcclusionMethod;

/// Whether frames are drawn while a shader is being compiled.
#[derive(Resource)]
pub(crate) struct CompilesInBackground(pub bool);

impl CompilesInBackground {
    pub fn of(app: &App) -> Self {
        let plugins = app.get_added_plugins::<RenderPlugin>();
        Self(plugins.iter().any(|plugin| !plugin.synchronous_pipeline_compilation))
    }
}

/// The methods that were wanted so far, with whether their pipelines are there. In both worlds.
#[derive(Resource, Clone)]
pub(crate) struct MethodPipelines(
    Arc<Mutex<HashMap<Discriminant<OcclusionMethod>, (OcclusionMethod, bool)>>>,
);

impl Default for MethodPipelines {
    /// With rays: what they need is compiled while volumes are being read.
    fn default() -> Self {
        let rays = OcclusionMethod::Rays;
        Self(Arc::new(Mutex::new([(discriminant(&rays), (rays, false))].into_iter().collect())))
    }
}

impl MethodPipelines {
    /// Whether the pipelines of a method are there. They are wanted from now on.
    pub fn are_there_for(&self, method: &OcclusionMethod) -> bool {
        self.0.lock().is_ok_and(|mut wanted| wanted.entry(discriminant(method)).or_insert((*method, false)).1)
    }
}

/// What draws into views.
#[derive(SystemParam)]
pub(super) struct ViewPipelines<'w, 's> {
    darken: DarkenPipelines<'w, 's>,
    composite: CompositePipelines<'w, 's>,
}

impl ViewPipelines<'_, '_> {
    fn are_ready_for(&mut self, method: &OcclusionMethod, cache: &PipelineCache) -> bool {
        match method {
            OcclusionMethod::ScreenSpace(_) => self.darken.are_ready(cache),
            OcclusionMethod::Direct(_) => self.composite.are_ready(cache),
            _ => true,
        }
    }
}

/// Compiles what is wanted, and says what is there.
pub(super) fn find_ready(
    mut pipelines_or_cache: ParamSet<((Passes, ViewPipelines), ResMut<PipelineCache>)>,
    methods: Res<MethodPipelines>,
    scene: Res<ExtractedScene>,
) {
    let Ok(mut wanted) = methods.0.lock() else {
        return;
    };
    let mut are_there = |(passes, mut views): (Passes, ViewPipelines)| {
        wanted.values_mut().fold(passes.over_carvers_are_ready(), |are_there, (method, is_there)| {
            // All are asked, whatever the others say.
            *is_there =
                passes.are_ready_for(method, scene.count_work) & views.are_ready_for(method, &passes.cache);
            are_there && *is_there
        })
    };
    if !are_there(pipelines_or_cache.p0()) {
        // At once, rather than later in the frame: where nothing is compiled in the background, this frame has it.
        pipelines_or_cache.p1().process_queue();
        are_there(pipelines_or_cache.p0());
    }
}
