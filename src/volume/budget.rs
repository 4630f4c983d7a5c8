//! What a volume may take on the graphics device, and what is done with one that takes more.

use bevy::{
    platform::collections::HashSet,
    prelude::*,
    render::{extract_resource::ExtractResource, render_resource::WgpuLimits, renderer::RenderDevice},
};

use super::{Intensities, Volume, Volume3d, VolumeFailed};

/// How much of the graphics device's memory a volume may take.
#[derive(Resource, ExtractResource, Reflect, Clone, Debug, PartialEq)]
#[reflect(Resource, Default, Debug, Clone, PartialEq)]
pub struct VolumeBudget {
    /// Bytes of one volume, with its opacities, occlusion and what is kept about its bricks: 3.8 a
    /// voxel for one of 8 bits, 4.8 for one of 16; more on a device that cannot store single bytes
    /// (6 more). A higher budget shows larger volumes, as long as the device has the memory; it cannot
    /// be asked how much that is.
    pub most_bytes: u64,
    /// Shows a volume beyond the budget, or beyond the largest texture of the device, at half its
    /// resolution, or a quarter, with a warning, instead of refusing it with [`VolumeFailed`].
    pub halves: bool,
}

impl Default for VolumeBudget {
    fn default() -> Self {
        Self { most_bytes: 4 << 30, halves: false }
    }
}

/// What decides whether a volume can be shown.
#[derive(Clone, Copy)]
pub(crate) struct VolumeSize {
    dimensions: UVec3,
    bytes_per_intensity: u64,
}

impl VolumeSize {
    pub fn of(volume: &Volume) -> Self {
        let bytes_per_intensity = match volume.intensities() {
            Intensities::U8(_) => 1,
            Intensities::U16(_) => 2,
        };
        Self { dimensions: volume.dimensions(), bytes_per_intensity }
    }

    fn halved(self) -> Self {
        Self { dimensions: self.dimensions.map(|voxels| voxels.div_ceil(2)), ..self }
    }

    /// With two more volumes of a byte a voxel, and what is kept about bricks.
    fn bytes(self) -> u64 {
        let voxels = self.dimensions.as_u64vec3().element_product();
        voxels * (2 + self.bytes_per_intensity) + self.bricks() * Self::BYTES_PER_BRICK
    }

    /// Bricks of 4x4x4 voxels.
    fn bricks(self) -> u64 {
        self.dimensions.map(|voxels| voxels.div_ceil(4)).as_u64vec3().element_product()
    }

    /// What the buffers hold of every brick, and the largest of them.
    const BYTES_PER_BRICK: u64 = 52;
    const MOST_BYTES_PER_BRICK: u64 = 24;
}

impl VolumeBudget {
    /// Why a volume cannot be shown, if it cannot; `device` is what it can hold.
    pub(crate) fn check(&self, size: VolumeSize, device: &WgpuLimits) -> Result<(), String> {
        let dimensions = size.dimensions;
        let most_per_axis = device.max_texture_dimension_3d;
        if dimensions.max_element() > most_per_axis {
            return Err(format!(
                "{dimensions} voxels: this graphics device holds at most {most_per_axis} along each axis"
            ));
        }
        let buffer = size.bricks() * VolumeSize::MOST_BYTES_PER_BRICK;
        let most_in_buffer = device.max_storage_buffer_binding_size;
        if buffer > most_in_buffer {
            return Err(format!(
                "{dimensions} voxels need a buffer of {buffer} bytes: this graphics device binds at most \
                 {most_in_buffer}"
            ));
        }
        if size.bytes() > self.most_bytes {
            let mib = |bytes: u64| bytes.div_ceil(1 << 20);
            return Err(format!(
                "{dimensions} voxels take {} MiB on the graphics device, and VolumeBudget allows {} MiB",
                mib(size.bytes()),
                mib(self.most_bytes)
            ));
        }
        Ok(())
    }

    /// How often a volume has to be halved to be shown, and its size then; `None` if not even one
    /// voxel can be.
    fn halvings(&self, mut size: VolumeSize, device: &WgpuLimits) -> Option<(u32, UVec3)> {
        for halvings in 0.. {
            if self.check(size, device).is_ok() {
                return Some((halvings, size.dimensions));
            }
            if size.dimensions == UVec3::ONE {
                break;
            }
            size = size.halved();
        }
        None
    }
}

/// What is shown of a [`Volume3d`].
#[derive(Component)]
pub(crate) struct ShownVolume {
    of: AssetId<Volume>,
    budget: VolumeBudget,
    /// The volume itself, or a smaller one; `None` if it cannot be shown.
    pub volume: Option<Handle<Volume>>,
}

/// Decides what is shown of volumes that came or changed.
pub(super) fn fit_volumes(
    mut commands: Commands,
    mut events: MessageReader<AssetEvent<Volume>>,
    entities: Query<(Entity, &Volume3d, Option<&ShownVolume>)>,
    orphans: Query<Entity, (With<ShownVolume>, Without<Volume3d>)>,
    budget: Res<VolumeBudget>,
    device: Option<Res<RenderDevice>>,
    mut volumes: ResMut<Assets<Volume>>,
) {
    let modified: HashSet<_> = events
        .read()
        .filter_map(|event| match event {
            AssetEvent::Modified { id } | AssetEvent::Removed { id } => Some(*id),
            _ => None,
        })
        .collect();
    // Without a device nothing is drawn, and nothing is too large.
    let unlimited = || WgpuLimits {
        max_texture_dimension_3d: u32::MAX,
        max_storage_buffer_binding_size: u64::MAX,
        ..default()
    };
    let limits = device.map_or_else(unlimited, |device| device.limits());
    for (entity, handle, shown) in &entities {
        let id = handle.id();
        let is_current = shown.is_some_and(|shown| shown.of == id);
        if is_current && !modified.contains(&id) && shown.is_some_and(|shown| shown.budget == *budget) {
            continue;
        }
        let Some(volume) = volumes.get(id) else {
            commands.entity(entity).try_remove::<ShownVolume>();
            continue;
        };
        let size = VolumeSize::of(volume);
        let volume = match budget.check(size, &limits) {
            Ok(()) => {
                if is_current && shown.is_some_and(|shown| shown.volume.as_ref() != Some(&handle.0)) {
                    // The renderer passed it over: marked as changed, it is seen anew, and shown
                    // in the next frame.
                    volumes.get_mut(id).as_deref_mut();
                    commands.entity(entity).try_remove::<ShownVolume>();
                    continue;
                }
                Some(handle.0.clone())
            }
            Err(reason) => match budget.halvings(size, &limits) {
                Some((halvings, dimensions)) if budget.halves => {
                    warn!("{reason}: {dimensions} voxels are shown on {entity}");
                    let fitted = (1..halvings).fold(volume.halved(), |volume, _| volume.halved());
                    Some(volumes.add(fitted))
                }
                would_fit => {
                    let would_fit = would_fit.map_or_else(String::new, |(_, dimensions)| {
                        format!("; {dimensions} would fit, which VolumeBudget::halves allows")
                    });
                    commands.trigger(VolumeFailed { entity, error: reason + &would_fit });
                    None
                }
            },
        };
        commands.entity(entity).try_insert(ShownVolume { of: id, budget: budget.clone(), volume });
    }
    for entity in &orphans {
        commands.entity(entity).try_remove::<ShownVolume>();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_volume_beyond_the_largest_buffer_is_refused_by_name() {
        let size = VolumeSize { dimensions: UVec3::splat(512), bytes_per_intensity: 1 };
        let small = WgpuLimits { max_storage_buffer_binding_size: 1 << 20, ..default() };
        let budget = VolumeBudget::default();
        let refused = budget.check(size, &small).expect_err("its masks have 48 MiB");
        assert!(refused.contains("buffer of 50331648 bytes"), "{refused}");
        let fits = budget.halvings(size, &small).expect("a quarter fits");
        assert_eq!(fits, (2, UVec3::splat(128)));
        assert_eq!(budget.check(size, &WgpuLimits::default()), Ok(()));
    }
}
