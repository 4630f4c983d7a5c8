//! Decides, before anything is encoded, which passes this frame needs: a frame in which nothing
//! changed needs none.

mod carvers;
mod changes;
mod views;
mod volumes;
mod work;

pub(crate) use carvers::plan_carvers;
pub(crate) use views::{VolumeView, plan_views};
pub(crate) use volumes::{VolumeJob, plan_volumes};

use bevy::{platform::collections::HashMap, prelude::*, render::sync_world::MainEntity};

use super::{
    carvers::{clip_maps::ReadyCarver, count_surfaces::CountJob, dilate::DilateJob, peel::PeelJob},
    extract::ExtractedVolume,
};
use crate::clip::ClipMeshCutOff;

/// The passes of this frame, in the order in which they are encoded.
#[derive(Resource, Default)]
pub(crate) struct FramePlan {
    /// The views that see each volume; none of one that nobody sees.
    views: HashMap<MainEntity, Vec<VolumeView>>,
    pub counts: Vec<CountJob>,
    pub depth_maps: Vec<PeelJob>,
    pub dilations: Vec<DilateJob>,
    pub volumes: Vec<VolumeJob>,
    /// Carvers whose maps are there (or will be, when this frame's passes ran).
    pub carvers: HashMap<Entity, ReadyCarver>,
    /// Some carver's mesh or pipelines are not there yet.
    pub carvers_wait: bool,
    /// Layers that the carvers' meshes need in all.
    pub layers_wanted: u32,
    /// Carvers that get fewer.
    pub cut_off: Vec<ClipMeshCutOff>,
    /// Counts maps redrawn.
    pub maps_revision: u64,
    pub counts_work: bool,
    /// Whether to time by the clock, if nothing is counted.
    times_by_clock: bool,
}

impl FramePlan {
    /// The views of a volume, by its entity in the main world.
    pub fn views_of(&self, volume: MainEntity) -> &[VolumeView] {
        self.views.get(&volume).map_or(&[], Vec::as_slice)
    }

    /// Whether anybody sees a volume: what is not seen is not computed.
    pub fn sees(&self, volume: &ExtractedVolume) -> bool {
        !self.views_of(volume.entity).is_empty()
    }

    /// Whether every pass is waited for and timed by the clock.
    pub fn are_timed_by_clock(&self) -> bool {
        // The counters are cleared and read in the order of the frame.
        self.times_by_clock && !self.counts_work
    }
}
