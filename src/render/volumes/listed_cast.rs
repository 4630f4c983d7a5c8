//! The list of words that rays were cast for, as it stays on the GPU until the next cast. For display.

use bevy::{
    prelude::*,
    render::{
        render_resource::{Buffer, BufferId, CommandEncoder},
        sync_world::MainEntity,
    },
};

use super::{
    bricks::{LIST_HEADS, MASK_WORDS},
    kept::LatestCast,
    store::VolumeStore,
};

/// The latest cast over a volume, with the list of its words.
pub(crate) struct ListedCast<'a> {
    cast: LatestCast<'a>,
    words: &'a Buffer,
}

/// Bytes of the state.
const STATE_BYTES: u64 = 16;

impl VolumeStore {
    /// The latest cast over a volume, if its method casts listed words.
    pub(crate) fn listed_cast(&self, volume: Entity) -> Option<ListedCast<'_>> {
        let resources = self.0.get(&MainEntity::from(volume))?;
        Some(ListedCast { cast: resources.kept.as_ref()?.latest_cast()?, words: &resources.bricks.word_list })
    }
}

impl ListedCast<'_> {
    /// What tells this cast from others.
    pub fn id(&self) -> (u64, BufferId) {
        (self.cast.number, self.cast.state.id())
    }

    /// Number of bytes that [`Self::copy`] copies.
    pub fn bytes(&self) -> u64 {
        STATE_BYTES + self.words.size()
    }

    /// Copies the list, for [`listed_bricks`].
    pub fn copy(&self, target: &Buffer, encoder: &mut CommandEncoder) {
        encoder.copy_buffer_to_buffer(self.cast.state, 0, target, 0, STATE_BYTES);
        encoder.copy_buffer_to_buffer(self.words, 0, target, STATE_BYTES, self.words.size());
    }
}

/// The bricks whose words a cast cast, by their numbers, in order. The bytes are those of [`ListedCast::copy`].
pub(crate) fn listed_bricks(bytes: &[u8]) -> Vec<u32> {
    let words: Vec<_> = bytes.as_chunks().0.iter().map(|bytes| u32::from_le_bytes(*bytes)).collect();
    let (&[_, first, end, _, ..], Some(items)) = (&words[..], words.get(4 + LIST_HEADS as usize..)) else {
        return Vec::new();
    };
    if items.is_empty() {
        return Vec::new();
    }
    // Places go on behind the end from the beginning.
    let item = |place: u32| items[place as usize % items.len()];
    let mut bricks: Vec<_> = (first..end).take(items.len()).map(|place| item(place) / MASK_WORDS).collect();
    bricks.sort_unstable();
    bricks.dedup();
    bricks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bricks_of_a_list_are_in_order_and_go_on_from_its_beginning() {
        let list = |first: u32, end: u32, items: &[u32]| -> Vec<u32> {
            let words =
                [9, first, end, 1].into_iter().chain([7; LIST_HEADS as usize]).chain(items.iter().copied());
            listed_bricks(&words.flat_map(u32::to_le_bytes).collect::<Vec<_>>())
        };
        assert_eq!(list(0, 3, &[8, 3, 2, 20]), [1, 4]);
        assert_eq!(list(2, 5, &[8, 3, 2, 20]), [1, 4, 10]);
        assert!(list(3, 3, &[8, 3, 2, 20]).is_empty());
        // Nothing has been cast yet.
        assert!(list(0, u32::MAX, &[]).is_empty());
        assert!(listed_bricks(&[]).is_empty());
    }
}
