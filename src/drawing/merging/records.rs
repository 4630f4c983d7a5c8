//! The buffer that merged draws read (`merged.wgsl`): a record for each draw, lists of the volumes that share space, and room
//! for the curves of pixels.

use bevy::{
    prelude::*,
    render::{
        render_resource::{
            BindGroupEntry, BindGroupLayoutDescriptor, BindGroupLayoutEntries, BindingResource, Buffer,
            BufferBinding, BufferDescriptor, BufferUsages, ShaderStages,
            binding_types::storage_buffer_read_only_sized,
        },
        sync_world::MainEntity,
    },
};

use core::num::NonZero;

use super::parts::DrawnPart;
use crate::render::{Gpu, VolumeWindows, pack_pixel};

/// Group of the buffer for drawing. The others have no such group: Bevy's views and volumes come near to the web's limit of 8
/// storage buffers.
pub(in crate::drawing) const MERGED_BIND_GROUP: usize = 3;

/// Words of a record, of the curves of a volume, and of one curve, as in WGSL.
const RECORD_WORDS: usize = 8;
/// Words from a record to the next: a dynamic offset of every graphics device.
const RECORD_STRIDE: usize = 64;
const CURVES_WORDS: usize = 3;
const CURVE_WORDS: u64 = 16;

/// Merged draws of this frame. The index of a draw is its instance, by which its record is bound.
#[derive(Resource, Default)]
pub(in crate::drawing) struct MergedDraws {
    groups: Vec<MergedGroup>,
    draws: Vec<MergedDraw>,
    /// Curves of this frame.
    pub curves: Vec<CurvesOf>,
    /// Records and lists, as last written.
    head: Vec<u32>,
    pub buffer: Option<Buffer>,
}

/// First and end pixel of a view's window onto a volume.
type WindowOf<'a> = dyn Fn(Entity, MainEntity) -> Option<[UVec2; 2]> + 'a;

/// Volumes that may share space in a view.
struct MergedGroup {
    view: Entity,
    volumes: Vec<MainEntity>,
}

/// A part of a volume in a group.
struct MergedDraw {
    group: usize,
    member: usize,
    part: DrawnPart,
}

/// Curves of a volume in a view, for the pixels in which other volumes may share its space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::drawing) struct CurvesOf {
    pub view: Entity,
    pub volume: MainEntity,
    /// First and end pixel.
    pub first: UVec2,
    pub end: UVec2,
    /// Word of the first pixel's curve.
    pub word: u32,
}

impl CurvesOf {
    fn curves(&self) -> u64 {
        (self.end - self.first).as_u64vec2().element_product()
    }

    /// As shaders read it.
    pub fn words(&self) -> [u32; CURVES_WORDS] {
        [pack_pixel(self.first), pack_pixel(self.end), self.word]
    }
}

impl MergedDraws {
    pub fn begin_frame(&mut self) {
        self.groups.clear();
        self.draws.clear();
        self.curves.clear();
    }

    /// Adds volumes that may share space in a view. Returns the group's index.
    pub fn add_group(&mut self, view: Entity, volumes: Vec<MainEntity>) -> usize {
        self.groups.push(MergedGroup { view, volumes });
        self.groups.len() - 1
    }

    /// Adds a part of a group's member. Returns the draw's instance.
    pub fn add_draw(&mut self, group: usize, member: usize, part: DrawnPart) -> u32 {
        self.draws.push(MergedDraw { group, member, part });
        self.draws.len() as u32 - 1
    }

    /// Finds the curves of a group's members: those of pixels in which another one may be. A member without any is drawn as if
    /// it were alone.
    fn curves_of(group: &MergedGroup, window_of: &WindowOf, first_word: u64) -> Vec<CurvesOf> {
        let windows: Vec<_> =
            group.volumes.iter().map(|volume| window_of(group.view, *volume).unwrap_or_default()).collect();
        let mut word = first_word;
        let members = group.volumes.iter().zip(&windows).enumerate();
        members
            .map(|(index, (volume, [first, end]))| {
                let others = windows.iter().enumerate().filter(|(other, _)| *other != index);
                let shared = others.map(|(_, [low, high])| [low.max(*first), high.min(*end)]);
                let shared = shared.filter(|[low, high]| low.cmplt(*high).all());
                let around = shared.reduce(|[a, b], [low, high]| [a.min(low), b.max(high)]);
                let [first, end] = around.unwrap_or_default();
                let found = CurvesOf { view: group.view, volume: *volume, first, end, word: word as u32 };
                word += CURVE_WORDS * found.curves();
                found
            })
            .collect()
    }

    /// The records and lists, and the curves behind them. Groups whose curves find no room have none.
    fn lay_out(&mut self, window_of: &WindowOf, most_words: u64) -> (Vec<u32>, u64) {
        let others = |group: &MergedGroup| group.volumes.len() * (group.volumes.len() - 1);
        let others: usize = self.groups.iter().map(others).sum();
        let lists_at = RECORD_STRIDE * self.draws.len();
        let mut end_word = (lists_at + CURVES_WORDS * others) as u64;
        let mut lists = Vec::new();
        let mut own = Vec::new();
        for group in &self.groups {
            let mut curves = Self::curves_of(group, window_of, end_word);
            let after = end_word + CURVE_WORDS * curves.iter().map(CurvesOf::curves).sum::<u64>();
            if after > most_words {
                warn_once!(
                    "volumes that share space are drawn one after the other: their transmittances take {after} \
                     words, but a buffer of this graphics device holds {most_words}"
                );
                curves.iter_mut().for_each(|curves| curves.end = curves.first);
            } else {
                end_word = after;
            }
            let mut of_members = Vec::new();
            for (member, own) in curves.iter().enumerate() {
                of_members.push((*own, lists_at + lists.len()));
                let others = curves.iter().enumerate().filter(|(other, _)| *other != member);
                lists.extend(others.flat_map(|(_, curves)| curves.words()));
            }
            own.push(of_members);
            self.curves.extend(curves.into_iter().filter(|curves| curves.curves() > 0));
        }
        let records = self.draws.iter().flat_map(|MergedDraw { group, member, part }| {
            let (curves, list) = own[*group][*member];
            let [first, end, word] = curves.words();
            let others = own[*group].len() as u32 - 1;
            let depths = [part.begin_depth, part.end_depth].map(f32::to_bits);
            let record = [depths[0], depths[1], first, end, word, others, list as u32, 0];
            let mut words = [0; RECORD_STRIDE];
            words[..RECORD_WORDS].copy_from_slice(&record);
            words
        });
        (records.chain(lists).collect(), end_word)
    }

    /// Writes the records, into a buffer with room for the curves.
    fn write(&mut self, windows: &VolumeWindows, gpu: &Gpu) {
        let most_words = gpu.device.limits().max_storage_buffer_binding_size / 4;
        let window_of = |view, volume| {
            let window = windows.onto(volume).iter().find(|window| window.view == view)?;
            Some([window.uniform.first, window.uniform.end])
        };
        let (head, words) = self.lay_out(&window_of, most_words);
        // Bindings are never empty.
        let needed = 4 * words.max(RECORD_STRIDE as u64);
        let has = self.buffer.as_ref().map_or(0, |buffer| buffer.size());
        if needed > has || has > 4 * needed.max(1024) {
            self.buffer = Some(gpu.device.create_buffer(&BufferDescriptor {
                label: Some("contextual_ao_merged"),
                size: needed,
                usage: BufferUsages::STORAGE | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }));
            self.head.clear();
        }
        if let Some(buffer) = self.buffer.as_ref().filter(|_| self.head != head) {
            gpu.queue.write_buffer(buffer, 0, bytemuck::cast_slice(&head));
            self.head = head;
        }
    }
}

/// Layout of the group of the buffer: the record of a draw, and all of it.
pub(in crate::drawing) fn merged_layout() -> BindGroupLayoutDescriptor {
    let [record, all] = [true, false].map(|offset| storage_buffer_read_only_sized(offset, None));
    BindGroupLayoutDescriptor::new(
        "contextual_ao_merged",
        &BindGroupLayoutEntries::sequential(ShaderStages::FRAGMENT, (record, all)),
    )
}

/// Its bindings.
pub(in crate::drawing) fn merged_bindings(buffer: &Buffer) -> [BindGroupEntry<'_>; 2] {
    let size = NonZero::new(4 * RECORD_WORDS as u64);
    let record = BindingResource::Buffer(BufferBinding { buffer, offset: 0, size });
    let all = buffer.as_entire_binding();
    [BindGroupEntry { binding: 0, resource: record }, BindGroupEntry { binding: 1, resource: all }]
}

/// Dynamic offset of the record of a draw.
pub(in crate::drawing) fn offset_of_record(instance: u32) -> u32 {
    4 * RECORD_STRIDE as u32 * instance
}

/// Writes what merged draws of this frame read.
pub(in crate::drawing) fn write_records(
    windows: Res<VolumeWindows>,
    gpu: Gpu,
    mut merged: ResMut<MergedDraws>,
) {
    merged.write(&windows, &gpu);
}

#[cfg(test)]
mod tests {
    use super::*;

    const PART: DrawnPart = DrawnPart { begin_depth: 1.0, end_depth: 2.0, sorted_depth: 1.5 };

    fn entity(number: u32) -> Entity {
        Entity::from_raw_u32(number).expect("an entity")
    }

    /// Two volumes of 4 x 3 and 5 x 5 pixels, which share 2 x 2.
    fn two() -> (MergedDraws, impl Fn(Entity, MainEntity) -> Option<[UVec2; 2]>) {
        let mut merged = MergedDraws::default();
        let group = merged.add_group(entity(1), vec![entity(2).into(), entity(3).into()]);
        (0..2).for_each(|member| assert_eq!(merged.add_draw(group, member, PART), member as u32));
        let window_of = |view, volume: MainEntity| {
            assert_eq!(view, entity(1));
            let first = if volume.id() == entity(2) { [10, 10] } else { [12, 11] };
            let size = if volume.id() == entity(2) { [4, 3] } else { [5, 5] };
            Some([first.into(), UVec2::from(first) + UVec2::from(size)])
        };
        (merged, window_of)
    }

    #[test]
    fn sizes_are_those_of_the_shaders() {
        let shaders = concat!(include_str!("curve.wgsl"), include_str!("merged.wgsl"));
        for (name, size) in [("CURVES_WORDS", CURVES_WORDS as u64), ("CURVE_WORDS", CURVE_WORDS)] {
            assert!(shaders.contains(&format!("const {name}: u32 = {size}u;")), "{name} is not {size}");
        }
        let record = format!(
            "@group({MERGED_BIND_GROUP}) @binding(0) var<storage, read> record: array<u32, {RECORD_WORDS}>;"
        );
        assert!(shaders.contains(&record), "no `{record}`");
    }

    #[test]
    fn volumes_have_curves_in_the_pixels_that_they_share() {
        let (mut merged, window_of) = two();
        let (head, words) = merged.lay_out(&window_of, 10_000);
        let shared = [UVec2::new(12, 11), UVec2::new(14, 13)];
        let found: Vec<_> = merged.curves.iter().map(|curves| [curves.first, curves.end]).collect();
        assert_eq!(found, [shared; 2]);
        // Two records, and for each member a list of one other.
        let heads = 2 * RECORD_STRIDE + 2 * CURVES_WORDS;
        assert_eq!(head.len(), heads);
        assert_eq!(words, heads as u64 + 2 * 4 * CURVE_WORDS);
        let own: Vec<_> = merged.curves.iter().map(CurvesOf::words).collect();
        for (member, [curves, other]) in [[own[0], own[1]], [own[1], own[0]]].into_iter().enumerate() {
            let record = &head[RECORD_STRIDE * member..][..RECORD_WORDS];
            assert_eq!(record[..2], [1f32.to_bits(), 2f32.to_bits()]);
            assert_eq!((&record[2..5], record[5]), (&curves[..], 1));
            assert_eq!(head[record[6] as usize..][..CURVES_WORDS], other);
        }
    }

    #[test]
    fn without_room_volumes_are_drawn_as_if_each_were_alone() {
        let (mut merged, window_of) = two();
        let (head, words) = merged.lay_out(&window_of, 150);
        assert!(merged.curves.is_empty() && words <= 150, "{words}");
        assert_eq!(head[2], head[3], "no pixel is shared");
    }
}
