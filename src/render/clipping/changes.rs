//! Changes since a volume's clipping was last computed.

use crate::render::volumes::{carver_uniform::CarverUniform, contents::Contents};

/// The difference between two [`Contents`].
#[derive(Debug, PartialEq)]
pub(super) enum Changes {
    /// Everything changed: no earlier result holds.
    All,
    /// Some carvers changed, given as past and present states. Results for voxels that none of them affects hold.
    Carvers {
        past: Vec<CarverUniform>,
        present: Vec<CarverUniform>,
        /// Whether all carvers keep their numbers. Then every past state has a present one, in the same order.
        keep_numbers: bool,
    },
}

impl Changes {
    pub fn between(old: Option<&Contents>, new: &Contents) -> Self {
        let Some(old) = old else {
            return Self::All;
        };
        let same = old.table_revision == new.table_revision
            && old.occlusion == new.occlusion
            && old.coverage == new.coverage;
        if !same {
            return Self::All;
        }
        // Mostly nothing moves, and then no carver need be looked for.
        if old.carvers == new.carvers {
            return Self::Carvers { past: Vec::new(), present: Vec::new(), keep_numbers: true };
        }
        let mut past = Vec::new();
        for &(carver, revision) in old.carvers.iter().filter(|carver| !acts_among(carver, &new.carvers)) {
            if let Some((now, _)) = new.carvers.iter().find(|(_, kept)| *kept == revision) {
                past.push(carver.at_layers_of(now));
            } else if let Some(region) = carver.region() {
                past.push(region);
            } else {
                return Self::All;
            }
        }
        let came = new.carvers.iter().filter(|carver| !acts_among(carver, &old.carvers));
        let present = came.map(|(carver, _)| *carver).collect();
        Self::Carvers { past, present, keep_numbers: keep_numbers(&old.carvers, &new.carvers) }
    }
}

/// Whether one of `others` has the same maps and acts in the same place. Its maps may be in other layers.
fn acts_among((carver, revision): &(CarverUniform, u64), others: &[(CarverUniform, u64)]) -> bool {
    others.iter().any(|(other, maps)| maps == revision && carver.carves_as(other))
}

/// Whether each carver is the same as before, or changed for one that is new.
fn keep_numbers(old: &[(CarverUniform, u64)], new: &[(CarverUniform, u64)]) -> bool {
    let is_in_place = |(old_one, new_one): (&(CarverUniform, u64), &(CarverUniform, u64))| {
        let is_same = old_one.1 == new_one.1 && old_one.0.carves_as(&new_one.0);
        is_same || !acts_among(old_one, new) && !acts_among(new_one, old)
    };
    old.len() == new.len() && old.iter().zip(new).all(is_in_place)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        clip::ClipOperation::{Intersect, Subtract},
        occlusion::{ProgressiveRays, Sky},
    };
    use bevy::prelude::default;

    fn contents(carvers: &[(CarverUniform, u64)]) -> Contents {
        Contents {
            table_revision: 0,
            by_gradient: false,
            occlusion: default(),
            coverage: default(),
            carvers: carvers.to_vec(),
        }
    }

    fn carvers(past: &[CarverUniform], present: &[CarverUniform]) -> Changes {
        let keep_numbers = past.len() == present.len();
        Changes::Carvers { past: past.to_vec(), present: present.to_vec(), keep_numbers }
    }

    #[test]
    fn a_moved_carver_changes_both_places_and_no_other() {
        let rests = (CarverUniform::at(9.0, Intersect), 7);
        let (from, to) = (CarverUniform::at(1.0, Subtract), CarverUniform::at(2.0, Subtract));
        let old = contents(&[(from, 3), rests]);
        let new = contents(&[(to, 3), rests]);
        assert_eq!(Changes::between(Some(&old), &new), carvers(&[from], &[to]));
        assert_eq!(Changes::between(Some(&new), &new), carvers(&[], &[]));
    }

    #[test]
    fn maps_that_moved_change_nothing() {
        let at = |place, layer| CarverUniform::at(place, Subtract).with_layers(layer, layer + 1);
        let old = contents(&[(at(1.0, 5), 3)]);
        let moved = contents(&[(at(1.0, 2), 3)]);
        assert_eq!(Changes::between(Some(&old), &moved), carvers(&[], &[]));
        // The carver's past place is looked up in the layers in which its maps are now.
        let both = contents(&[(at(2.0, 2), 3)]);
        assert_eq!(Changes::between(Some(&old), &both), carvers(&[at(1.0, 2)], &[at(2.0, 2)]));
    }

    #[test]
    fn where_maps_are_gone_the_region_counts() {
        let from = CarverUniform::at(1.0, Subtract);
        let region = from.region().expect("a subtracting carver acts in a region");
        let (old, gone) = (contents(&[(from, 3)]), contents(&[]));
        assert_eq!(Changes::between(Some(&old), &gone), carvers(&[region], &[]));
        let redrawn = contents(&[(from, 4)]);
        assert_eq!(Changes::between(Some(&old), &redrawn), carvers(&[region], &[from]));
        let probe = contents(&[(CarverUniform::at(1.0, Intersect), 3)]);
        assert_eq!(Changes::between(Some(&probe), &gone), Changes::All);
    }

    #[test]
    fn carvers_behind_one_that_left_have_other_numbers() {
        let [a, b, c] = [1.0, 2.0, 3.0].map(|place| CarverUniform::at(place, Subtract));
        let between = |old: &[_], new: &[_]| Changes::between(Some(&contents(old)), &contents(new));
        let left = between(&[(a, 1), (b, 2)], &[(b, 2), (c, 3)]);
        let region = a.region().expect("a subtracting carver acts in a region");
        assert_eq!(left, Changes::Carvers { past: vec![region], present: vec![c], keep_numbers: false });
        let in_place = between(&[(a, 1), (b, 2)], &[(c, 3), (b, 2)]);
        assert_eq!(in_place, Changes::Carvers { past: vec![region], present: vec![c], keep_numbers: true });
    }

    #[test]
    fn settings_change_everything() {
        let (old, mut new) = (contents(&[]), contents(&[]));
        new.occlusion.sky = Sky::octant(0);
        assert_eq!(Changes::between(Some(&old), &new), Changes::All);
        assert_eq!(Changes::between(None, &old), Changes::All);
    }

    #[test]
    fn settings_of_the_method_are_told_from_other_changes() {
        let (old, mut new) = (contents(&[]), contents(&[]));
        assert!(!old.differs_in_method_alone(&new));
        new.occlusion.method = ProgressiveRays::default().into();
        assert!(old.differs_in_method_alone(&new));
        let carved = Contents { carvers: vec![(CarverUniform::at(1.0, Subtract), 3)], ..new.clone() };
        let by_table = Contents { table_revision: 1, ..new.clone() };
        new.occlusion.sky = Sky::octant(0);
        assert!([carved, by_table, new].iter().all(|more| !old.differs_in_method_alone(more)));
    }
}
