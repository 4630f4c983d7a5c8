//! Decides, before anything is encoded, which passes this frame needs: a frame in which nothing
//! changed needs none.

mod budget;
mod carvers;
mod volumes;
mod work;

pub(crate) use carvers::plan_carvers;
pub(crate) use volumes::{VolumeJob, plan_volumes};

use bevy::{platform::collections::HashMap, prelude::*};

use super::{clip_depth::ClipDepthJob, clip_maps::DilationKey, dilate::DilateJob};
use crate::clip::ClipFrame;

/// The passes of this frame, in the order in which they are encoded.
#[derive(Resource, Default)]
pub(crate) struct FramePlan {
    pub depth_maps: Vec<ClipDepthJob>,
    pub dilations: Vec<DilateJob>,
    pub volumes: Vec<VolumeJob>,
    /// Carvers whose maps are there (or will be, when this frame's passes ran).
    pub carvers: HashMap<Entity, ReadyCarver>,
    /// Some carver's mesh or pipelines are not there yet.
    pub carvers_wait: bool,
    /// Counts maps redrawn.
    pub maps_revision: u64,
    pub counts_work: bool,
    pub times_by_clock: bool,
}

/// A carver that takes part in this frame.
#[derive(Clone, Copy)]
pub(crate) struct ReadyCarver {
    pub slot: u32,
    /// The view that its maps show.
    pub frame: ClipFrame,
    pub dilation: DilationKey,
    /// Tells these maps from all others.
    pub revision: u64,
}
