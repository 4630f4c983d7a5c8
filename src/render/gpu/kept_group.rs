//! Bind groups that live as long as the resources that they bind.

use bevy::render::render_resource::BindGroup;

/// Bind groups, with the identities of resources that they bind. Everything else that they bind lives as long as these.
pub(crate) struct KeptGroup<K, G = BindGroup>(Option<(K, G)>);

impl<K, G> Default for KeptGroup<K, G> {
    fn default() -> Self {
        Self(None)
    }
}

impl<K: PartialEq, G: Clone> KeptGroup<K, G> {
    /// The groups of some resources, made anew if they bind others.
    pub fn of(&mut self, bound: K, make: impl FnOnce() -> G) -> G {
        match &self.0 {
            Some((before, groups)) if *before == bound => groups.clone(),
            _ => self.0.insert((bound, make())).1.clone(),
        }
    }
}
