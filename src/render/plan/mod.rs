//! Decides, before anything is encoded, which passes this frame needs: a frame in which nothing
//! changed needs none.

mod budget;
mod carvers;
mod volumes;
mod work;

pub(crate) use carvers::plan_carvers;
pub(crate) use volumes::{VolumeJob, plan_volumes};

use bevy::{platform::collections::HashMap, prelude::*};

use super::{
    clip_maps::{DilationKey, LayerRange},
    count_surfaces::CountJob,
    dilate::DilateJob,
    peel::PeelJob,
};
use crate::{clip::ClipFrame, diagnostics::CutOff};

/// The passes of this frame, in the order in which they are encoded.
#[derive(Resource, Default)]
pub(crate) struct FramePlan {
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
    pub cut_off: Vec<CutOff>,
    /// Counts maps redrawn.
    pub maps_revision: u64,
    pub counts_work: bool,
    pub times_by_clock: bool,
}

/// A carver that takes part in this frame.
#[derive(Clone, Copy)]
pub(crate) struct ReadyCarver {
    pub layers: LayerRange,
    /// The view that its maps show.
    pub frame: ClipFrame,
    pub dilation: DilationKey,
    /// Tells these maps from all others.
    pub revision: u64,
}
