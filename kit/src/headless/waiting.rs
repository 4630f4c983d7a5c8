//! Waits for files, meshes and shaders, with an error if they do not come.

use bevy::{
    prelude::*,
    render::render_resource::{CachedPipeline, CachedPipelineState, PipelineCache},
    shader::ShaderCacheError,
};
use bevy_contextual_ao::{clip::ClipCamera, prelude::*, volume::LookupTable};
use std::time::{Duration, Instant};

use super::{Failures, Headless};

/// Longest wait for a device, for files and for compilers. They take seconds at most.
pub(super) const PATIENCE: Duration = Duration::from_secs(60);

impl Headless {
    /// Runs frames until `holds` is true, for up to a minute. Returns whether it became true. The limit is a time,
    /// not a number of frames, because shaders and meshes are read meanwhile.
    pub fn frames_until(&mut self, holds: impl Fn(&Self) -> bool) -> bool {
        let begin = Instant::now();
        while begin.elapsed() < PATIENCE {
            self.frame();
            if holds(self) {
                return true;
            }
        }
        false
    }

    /// Runs frames until the volume has been read and drawn for the first time with all its occlusion. Fails if its
    /// file could not be read, or after [`Self::patience`] without progress.
    pub fn until_ready(&mut self, volume: Entity) -> Result<(), String> {
        // Nobody looks at the image meanwhile.
        self.set_cameras_active(false);
        // A change shows in the progress after this many frames: asset event, frame, report.
        const FRAMES: u32 = 3;
        self.frames(FRAMES);
        let mut waits_for = Vec::new();
        let (mut since, mut frames) = (Instant::now(), 0);
        loop {
            self.frame();
            if let Some(error) = self.app.world().resource::<Failures>().0.first() {
                return Err(error.clone());
            }
            if let Some(error) = self.pipeline_error() {
                return Err(error);
            }
            let rest = self.missing(volume);
            if rest.is_empty() {
                self.set_cameras_active(true);
                self.frame();
                return Ok(());
            }
            if rest != waits_for {
                (waits_for, since, frames) = (rest, Instant::now(), 0);
            } else if since.elapsed() >= self.patience && frames > FRAMES {
                // A single frame may take long on a software driver.
                let seconds = since.elapsed().as_secs();
                return Err(format!("waited {seconds} s in vain for {}", waits_for.join(", ")));
            }
            frames += 1;
        }
    }

    fn set_cameras_active(&mut self, is_active: bool) {
        let world = self.app.world_mut();
        for mut camera in world.query::<&mut Camera>().iter_mut(world) {
            camera.is_active = is_active;
        }
    }

    /// Error of a shader, if there is one.
    fn pipeline_error(&self) -> Option<String> {
        let cache = self.render_world().resource::<PipelineCache>();
        cache.pipelines().find_map(|pipeline| match &pipeline.state {
            // Other errors are about shaders that are still being read.
            CachedPipelineState::Err(error @ ShaderCacheError::ProcessShaderError(_))
            | CachedPipelineState::Err(error @ ShaderCacheError::CreateShaderModule(_)) => {
                Some(error.to_string())
            }
            _ => None,
        })
    }

    /// Names of the parts that a volume still waits for. Empty if the volume is ready.
    fn missing(&mut self, volume: Entity) -> Vec<String> {
        let world = self.app.world_mut();
        if world.get::<OcclusionReady>(volume).is_some_and(|ready| ready.0) {
            return Vec::new();
        }
        let mut missing = vec!["the volume's occlusion".to_owned()];
        if world.get::<LookupTable>(volume).is_none() {
            missing.push("its file or transfer function".into());
        }
        let carvers = world.query::<&ClipCamera>().iter(world).len();
        let cache = self.render_world().resource::<PipelineCache>();
        let is_ready = |pipeline: &&CachedPipeline| matches!(pipeline.state, CachedPipelineState::Ok(_));
        let shaders = cache.pipelines().filter(|pipeline| !is_ready(pipeline)).count();
        if shaders > 0 {
            missing.push(format!("{shaders} shaders"));
        } else if carvers > 0 {
            missing.push(format!("the meshes of {carvers} carvers"));
        }
        missing
    }
}
