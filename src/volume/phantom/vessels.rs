//! Contrast-filled vessels: the arteries from the neck through the circle of Willis over the
//! cortex, the arteries of the scalp, and the large venous sinuses.

use super::sdf::{at, hash, signed_unit};
use super::skull::cavity;
use super::tubes::{Tubes, mirror};
use bevy::math::Vec3;

/// All vessels.
#[derive(Debug)]
pub(super) struct Vessels {
    tubes: Tubes,
}

impl Vessels {
    /// Grows the vessels, none of them with a radius below `thinnest`.
    pub(super) fn new(thinnest: f32) -> Self {
        let mut vessels = Self { tubes: Tubes::new(thinnest) };
        for side in [-1.0, 1.0] {
            vessels.neck_arteries(side);
            vessels.brain_arteries(side);
            vessels.scalp_arteries(side);
            vessels.transverse_sinus(side);
        }
        vessels.basilar_and_midline();
        vessels
    }

    /// Distance to the nearest vessel wall, cut off at a few millimetres.
    pub(super) fn distance(&self, p: Vec3) -> f32 {
        self.tubes.distance(p)
    }

    /// Carotid and vertebral arteries.
    fn neck_arteries(&mut self, side: f32) {
        let internal = [
            (at(24.0, -6.0, -130.0), 3.4),
            (at(25.0, -2.0, -90.0), 3.4),
            (at(26.0, -5.0, -55.0), 2.8),
            (at(24.0, -8.0, -22.0), 2.6),
            (at(18.0, -2.0, -4.0), 2.5),
            (at(10.0, 6.0, 10.0), 2.5),
            (at(9.0, 13.0, 18.0), 2.4),
            (at(9.0, 8.0, 26.0), 2.3),
        ];
        let vertebral = [
            (at(21.0, -26.0, -130.0), 2.0),
            (at(21.0, -27.0, -60.0), 2.0),
            (at(24.0, -34.0, -38.0), 2.0),
            (at(12.0, -36.0, -28.0), 2.0),
            (at(4.0, -20.0, -14.0), 2.0),
            (at(0.0, -8.0, -4.0), 2.0),
        ];
        self.tubes.path(side, &internal);
        self.tubes.path(side, &vertebral);
    }

    /// The basilar artery and the sinus along the middle of the vault.
    fn basilar_and_midline(&mut self) {
        let basilar = [(at(0.0, -8.0, -4.0), 2.1), (at(0.0, -3.0, 10.0), 2.1), (at(0.0, -2.0, 23.0), 2.0)];
        self.tubes.path(1.0, &basilar);
        // Front communicating artery closes the circle of Willis.
        self.tubes.add((at(-4.0, 19.0, 28.0), 1.4), (at(4.0, 19.0, 28.0), 1.4));
        let sinus: Vec<_> = [
            (54.0, 50.0),
            (52.0, 78.0),
            (30.0, 97.0),
            (0.0, 106.0),
            (-30.0, 103.0),
            (-60.0, 90.0),
            (-80.0, 66.0),
            (-86.0, 44.0),
            (-84.0, 26.0),
        ]
        .iter()
        .enumerate()
        .map(|(i, &(y, z))| (on_cavity(at(0.0, y, z), -1.5), 1.2 + 0.15 * i as f32))
        .collect();
        self.tubes.path(1.0, &sinus);
    }

    /// Circle of Willis and the arteries that leave it for the cortex.
    fn brain_arteries(&mut self, side: f32) {
        let carotid_end = (at(9.0, 8.0, 26.0), 2.2);
        let basilar_end = (at(0.0, -2.0, 23.0), 2.0);
        self.tubes.path(side, &[carotid_end, (at(7.0, 3.0, 25.0), 1.3), basilar_end]);
        let posterior = [
            basilar_end,
            (at(10.0, -4.0, 24.0), 1.9),
            (at(18.0, -20.0, 25.0), 1.8),
            (at(17.0, -40.0, 35.0), 1.7),
            (at(8.0, -60.0, 42.0), 1.6),
        ];
        let anterior = [
            carotid_end,
            (at(4.0, 19.0, 28.0), 1.8),
            (at(2.2, 36.0, 36.0), 1.7),
            (at(2.0, 40.0, 50.0), 1.3),
            (at(2.0, 26.0, 62.0), 1.1),
            (at(2.0, -6.0, 68.0), 1.0),
            (at(2.0, -36.0, 64.0), 0.8),
        ];
        let middle = [
            carotid_end,
            (at(20.0, 12.0, 27.0), 2.1),
            (at(34.0, 13.0, 27.0), 2.0),
            (at(46.0, 10.0, 27.5), 2.0),
            (on_cavity(at(54.0, 8.0, 28.0), -2.2), 1.9),
        ];
        self.tubes.path(side, &posterior);
        self.tubes.path(side, &anterior);
        self.tubes.path(side, &middle);
        let end = mirror(middle[4].0, side);
        let seed = if side < 0.0 { 100 } else { 200 };
        // The branches of the middle cerebral artery fan out over the outside of the cortex.
        for (i, (y, z)) in
            [(0.9, 0.5), (0.6, 1.2), (0.0, 1.0), (-0.7, 0.9), (-1.0, 0.35), (-0.7, -0.5), (0.4, -0.9)]
                .into_iter()
                .enumerate()
        {
            self.grow(Tip {
                position: end,
                towards: at(0.0, y, z),
                radius: 1.4,
                level: -2.0,
                seed: hash(seed + i as u32),
            });
        }
        // The anterior artery's branches climb over the edge of the hemisphere.
        for (i, (y, z)) in
            [(50.0, 70.0), (28.0, 98.0), (0.0, 106.0), (-34.0, 102.0), (-62.0, 88.0)].into_iter().enumerate()
        {
            let start = on_cavity(at(7.0 * side, y, z), -2.0);
            self.grow(Tip {
                position: start,
                towards: at(side, -0.3, 0.0),
                radius: 1.1,
                level: -2.0,
                seed: hash(seed + 50 + i as u32),
            });
        }
        for (i, (y, z)) in [(-84.0, 40.0), (-80.0, 56.0)].into_iter().enumerate() {
            let start = on_cavity(at(8.0 * side, y, z), -2.0);
            self.grow(Tip {
                position: start,
                towards: at(side, 0.0, 0.2),
                radius: 1.1,
                level: -2.0,
                seed: hash(seed + 80 + i as u32),
            });
        }
    }

    /// External carotid and superficial temporal arteries.
    fn scalp_arteries(&mut self, side: f32) {
        let external = [
            (at(25.0, -2.0, -88.0), 2.6),
            (at(34.0, -2.0, -66.0), 2.2),
            (at(52.0, -9.0, -42.0), 1.8),
            (at(54.0, -8.5, -22.0), 1.7),
            (at(63.5, -5.0, -1.0), 1.4),
            (on_cavity(at(66.0, -4.0, 20.0), 6.4), 1.7),
        ];
        self.tubes.path(side, &external);
        let end = mirror(external[5].0, side);
        for (i, (y, z)) in [(0.7, 0.8), (-0.4, 1.0)].into_iter().enumerate() {
            let seed = hash(300 + i as u32 + if side < 0.0 { 10 } else { 0 });
            self.grow(Tip { position: end, towards: at(0.0, y, z), radius: 1.3, level: 7.2, seed });
        }
    }

    /// Transverse and sigmoid sinus, which drain into the jugular vein.
    fn transverse_sinus(&mut self, side: f32) {
        let course = [
            (on_cavity(at(0.0, -84.0, 26.0), -1.5), 2.6),
            (on_cavity(at(26.0, -80.0, 24.0), -1.5), 2.6),
            (on_cavity(at(44.0, -58.0, 20.0), -1.5), 2.6),
            (on_cavity(at(46.0, -42.0, 10.0), -1.5), 2.6),
            (on_cavity(at(38.0, -30.0, -8.0), -1.5), 2.6),
            (at(30.0, -18.0, -26.0), 3.6),
            (at(32.0, -10.0, -60.0), 4.2),
            (at(32.0, -8.0, -130.0), 4.8),
        ];
        self.tubes.path(side, &course);
    }

    /// Grows a vessel over the shape of the brain case, bending and branching on its way.
    fn grow(&mut self, tip: Tip) {
        const STEP: f32 = 4.0;
        // A work list with a limit replaces recursion, so that growth ends in any case.
        let mut tips = vec![tip];
        let mut budget = 90;
        while let Some(mut tip) = tips.pop() {
            let mut since_fork = 0;
            while tip.radius > 0.55 && budget > 0 {
                budget -= 1;
                let random = |n: u32| signed_unit(hash(tip.seed ^ hash(n)));
                let bend = at(random(1), random(2), random(3));
                let wanted = (tip.towards + 0.85 * bend).normalize_or_zero();
                let position = on_cavity(tip.position + wanted * STEP, tip.level);
                if position.x * tip.position.x < 0.0 || position.x.abs() < 4.0 || position.z < -20.0 {
                    // The middle belongs to the sinus, and the base to the large arteries.
                    break;
                }
                let radius = tip.radius * 0.97;
                self.tubes.add((tip.position, tip.radius), (position, radius));
                let towards = (position - tip.position).normalize_or_zero();
                since_fork += 1;
                let seed = hash(tip.seed.wrapping_add(0x9e37));
                if since_fork > 6 && random(4) > 0.1 {
                    since_fork = 0;
                    let outwards = position - on_cavity(position, tip.level - 3.0);
                    let across = towards.cross(outwards).normalize_or_zero();
                    let turn = if random(5) > 0.0 { across } else { -across };
                    tips.push(Tip {
                        position,
                        towards: towards + 0.9 * turn,
                        radius: radius * 0.84,
                        level: tip.level,
                        seed: hash(seed ^ 77),
                    });
                    tip.towards = towards - 0.35 * turn;
                    tip.radius = radius * 0.93;
                } else {
                    tip.towards = towards;
                    tip.radius = radius;
                }
                (tip.position, tip.seed) = (position, seed);
            }
        }
    }
}

/// The growing end of a vessel.
struct Tip {
    position: Vec3,
    towards: Vec3,
    radius: f32,
    /// Distance that the vessel keeps to the inside of the brain case.
    level: f32,
    seed: u32,
}

/// Moves `p` to the nearest place with the given distance to the inside of the brain case.
fn on_cavity(p: Vec3, level: f32) -> Vec3 {
    const EPSILON: f32 = 0.5;
    let value = |p: Vec3| cavity(p.abs().with_y(p.y).with_z(p.z));
    (0..4).fold(p, |p, _| {
        let here = value(p);
        let gradient = at(
            value(p + Vec3::X * EPSILON) - here,
            value(p + Vec3::Y * EPSILON) - here,
            value(p + Vec3::Z * EPSILON) - here,
        ) / EPSILON;
        p - gradient * ((here - level) / gradient.length_squared().max(0.25))
    })
}
