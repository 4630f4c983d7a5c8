//! A folder as a hospital gives it out: two series, and files that are no slices.

use std::path::Path;

use bevy::math::{DVec3, UVec3};
use contextual_ao_kit::random::Random;

use super::{scan::Scan, written::Syntax};

/// A scan of twelve bits, not turned.
pub fn scan(seed: u64, size: UVec3, modality: &'static str) -> Scan {
    let mut random = Random(seed);
    let mut scan = Scan::random(&mut random);
    scan.size = size;
    scan.spacing = [1.0, 2.0];
    scan.axes = [DVec3::X, DVec3::Y];
    scan.step = DVec3::new(0.0, 0.0, 3.0);
    (scan.bits_allocated, scan.bits_stored, scan.high_bit, scan.signed) = (16, 12, 11, false);
    scan.rescale = vec![[1.0, -1000.0]; size.z as usize];
    scan.values = (0..size.element_product()).map(|_| random.below(4096) as i64).collect();
    (scan.syntax, scan.modality) = (Syntax::Explicit, modality);
    scan
}

/// Writes a CT of 12 x 8 x 3 voxels, an MR with two echoes of 6 x 5 x 4 voxels, and files that are left out.
pub fn write(folder: &Path) {
    let write = |name: String, bytes: &[u8]| std::fs::write(folder.join(name), bytes).unwrap();
    std::fs::create_dir_all(folder).unwrap();
    let ct = scan(1, UVec3::new(12, 8, 3), "CT");
    (0..3).for_each(|z| write(format!("Doe_John_ct{z}"), &ct.slice(z, z)));
    ct.others().iter().for_each(|(name, bytes)| write(name.clone(), bytes));
    for (echo, echo_ms) in [(1, 5.0), (2, 9.0)] {
        let mut mr = scan(2, UVec3::new(6, 5, 4), "MR");
        mr.echo_ms = echo_ms;
        (0..4).for_each(|z| write(format!("mr{echo}{z}"), &of_other_series(mr.slice(z, 100 * echo + z))));
    }
    let mut packed = scan(3, UVec3::new(4, 4, 2), "CT");
    packed.bits_allocated = 12;
    (0..2).for_each(|z| write(format!("packed{z}"), &packed.slice(z, 500 + z)));
}

/// The file with another identifier of its series.
fn of_other_series(mut file: Vec<u8>) -> Vec<u8> {
    let at = file.windows(6).position(|window| window == b"1.2.3\0").expect("the series' identifier");
    file[at + 2] = b'9';
    file
}
