//! Settings of the gizmos.

use bevy::{color::palettes::tailwind, prelude::*};

/// What the gizmos of volumes and carvers show, and in which colours.
#[derive(Reflect, GizmoConfigGroup, Clone, Debug, PartialEq)]
#[reflect(Default, Clone, Debug, PartialEq)]
pub struct VolumeGizmoConfigGroup {
    /// Draws the gizmos of all volumes and carvers. Otherwise those of entities with [`ShowVolumeGizmos`] are drawn.
    pub draw_all: bool,
    /// Colour of the box that a volume's voxels fill; `None` draws none.
    pub volume_boxes: Option<Color>,
    /// Colour of a carver's clip camera: the box that it sees, and an arrow along its line of sight. `None` draws none.
    pub clip_cameras: Option<Color>,
    /// Colour of a carver's reach, for each volume that it carves: the box in which occlusion changes when the carver comes
    /// or goes. There is none around a carver that keeps its inside: that acts everywhere. `None` draws none.
    pub reaches: Option<Color>,
    /// Colour of the bricks of 4x4x4 voxels that the latest cast of rays listed ([`ListedBricks`](super::ListedBricks)).
    /// `None` draws none.
    pub listed_bricks: Option<Color>,
    /// Most bricks that are drawn of a volume. More show more of a large change, and cost time: a brick has 12 lines.
    pub most_bricks: u32,
}

impl Default for VolumeGizmoConfigGroup {
    fn default() -> Self {
        Self {
            draw_all: false,
            volume_boxes: Some(tailwind::GRAY_400.into()),
            clip_cameras: Some(tailwind::AMBER_400.into()),
            reaches: Some(tailwind::ROSE_400.into()),
            listed_bricks: Some(tailwind::CYAN_400.into()),
            most_bricks: 4096,
        }
    }
}

/// Draws the gizmos of this entity: of a volume its box and its listed bricks, of a carver its clip camera and its reach.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, Debug, PartialEq)]
pub struct ShowVolumeGizmos {
    /// Colour of these gizmos, in place of those of [`VolumeGizmoConfigGroup`].
    pub color: Option<Color>,
}

impl VolumeGizmoConfigGroup {
    /// Colour of one kind of gizmo on an entity, if it is drawn.
    pub(super) fn color(&self, kind: Option<Color>, show: Option<&ShowVolumeGizmos>) -> Option<Color> {
        match show {
            Some(show) => kind.map(|color| show.color.unwrap_or(color)),
            None => kind.filter(|_| self.draw_all),
        }
    }
}

/// Whether any gizmo may be drawn.
pub(super) fn is_enabled(store: Res<GizmoConfigStore>, shown: Query<(), With<ShowVolumeGizmos>>) -> bool {
    let (config, group) = store.config::<VolumeGizmoConfigGroup>();
    config.enabled && (group.draw_all || !shown.is_empty())
}
