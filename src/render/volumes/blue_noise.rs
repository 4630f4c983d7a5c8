//! Blue noise for the starts of view rays: neighbouring pixels differ as much as they can, and no pattern shows.
//!
//! The ranks of 64x64 pixels were found by the void-and-cluster method (Ulichney 1993). A test finds them anew.

/// Pixels along each side of the tile.
const SIDE: usize = 64;
const PIXELS: usize = SIDE * SIDE;
/// Rank of each pixel, 16 bits, little-endian.
const RANKS: &[u8; 2 * PIXELS] = include_bytes!("blue_noise.bin");

/// The tile as a row of the lookup table's texture: values in (0, 1), evenly spaced, x fastest.
pub(super) fn row() -> Vec<[f32; 4]> {
    let ranks = RANKS.chunks_exact(2).map(|bytes| u16::from_le_bytes([bytes[0], bytes[1]]));
    ranks.map(|rank| [(f32::from(rank) + 0.5) / PIXELS as f32, 0.0, 0.0, 0.0]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::LookupTable;
    use core::f64::consts::TAU;

    /// Standard deviation of the filter that finds voids and clusters, pixels.
    const SIGMA: f64 = 1.9;

    /// Pixels with a mark, and how close each pixel is to marks.
    struct Pattern {
        marked: Vec<bool>,
        energies: Vec<f64>,
        kernel: Vec<f64>,
    }

    impl Pattern {
        fn new() -> Self {
            let along = |k: usize| k.min(SIDE - k) as f64;
            let kernel = (0..PIXELS).map(|k| {
                let (x, y) = (along(k % SIDE), along(k / SIDE));
                (-(x * x + y * y) / (2.0 * SIGMA * SIGMA)).exp()
            });
            Self { marked: vec![false; PIXELS], energies: vec![0.0; PIXELS], kernel: kernel.collect() }
        }

        fn set(&mut self, pixel: usize, is_marked: bool) {
            self.marked[pixel] = is_marked;
            let sign = if is_marked { 1.0 } else { -1.0 };
            let (x, y) = (pixel % SIDE, pixel / SIDE);
            for (k, energy) in self.energies.iter_mut().enumerate() {
                let across = (k % SIDE + SIDE - x) % SIDE;
                let down = (k / SIDE + SIDE - y) % SIDE;
                *energy += sign * self.kernel[down * SIDE + across];
            }
        }

        fn tightest_cluster(&self) -> usize {
            let marked = (0..PIXELS).filter(|pixel| self.marked[*pixel]);
            marked.max_by(|a, b| self.energies[*a].total_cmp(&self.energies[*b])).expect("a marked pixel")
        }

        fn largest_void(&self) -> usize {
            let free = (0..PIXELS).filter(|pixel| !self.marked[*pixel]);
            free.min_by(|a, b| self.energies[*a].total_cmp(&self.energies[*b])).expect("a free pixel")
        }
    }

    fn ranks() -> Vec<u16> {
        let mut pattern = Pattern::new();
        let mut state = 1u64;
        let count = PIXELS / 10;
        while pattern.marked.iter().filter(|marked| **marked).count() < count {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let pixel = (state >> 33) as usize % PIXELS;
            if !pattern.marked[pixel] {
                pattern.set(pixel, true);
            }
        }
        // Marks move from clusters to voids until they are even.
        loop {
            let cluster = pattern.tightest_cluster();
            pattern.set(cluster, false);
            let void = pattern.largest_void();
            pattern.set(void, true);
            if void == cluster {
                break;
            }
        }
        let mut ranks = vec![0; PIXELS];
        let marked = pattern.marked.clone();
        for rank in (0..count).rev() {
            let cluster = pattern.tightest_cluster();
            pattern.set(cluster, false);
            ranks[cluster] = rank as u16;
        }
        for pixel in (0..PIXELS).filter(|pixel| marked[*pixel]) {
            pattern.set(pixel, true);
        }
        for rank in count..PIXELS {
            let void = pattern.largest_void();
            pattern.set(void, true);
            ranks[void] = rank as u16;
        }
        ranks
    }

    #[test]
    fn the_ranks_are_those_of_void_and_cluster() {
        let found: Vec<u8> = ranks().into_iter().flat_map(u16::to_le_bytes).collect();
        if let Ok(file) = std::env::var("WRITE_BLUE_NOISE") {
            std::fs::write(file, &found).expect("it can be written");
        }
        assert!(found == RANKS, "the tile has other ranks");
        assert_eq!(row().len(), LookupTable::ENTRIES);
    }

    /// Largest power of a wave in a tile, and the mean power of waves of four pixels and more; the mean of all is 1.
    fn spectrum(values: &[f64]) -> [f64; 2] {
        let mean = values.iter().sum::<f64>() / PIXELS as f64;
        let wave = |k: usize, n: usize| (TAU * (k * n % SIDE) as f64 / SIDE as f64).sin_cos();
        let transform = |values: &[[f64; 2]], stride: usize, across: usize| -> Vec<[f64; 2]> {
            let at = |index: usize| {
                let (k, other) = (index % SIDE, index / SIDE);
                let terms = (0..SIDE).map(|n| {
                    let [re, im] = values[n * stride + other * across];
                    let (sin, cos) = wave(k, n);
                    [re * cos + im * sin, im * cos - re * sin]
                });
                terms.fold([0.0; 2], |sum, term| [sum[0] + term[0], sum[1] + term[1]])
            };
            (0..PIXELS).map(at).collect()
        };
        let centred: Vec<_> = values.iter().map(|value| [value - mean, 0.0]).collect();
        let waves = transform(&transform(&centred, 1, SIDE), SIDE, 1);
        let powers: Vec<f64> = waves.iter().map(|[re, im]| re * re + im * im).collect();
        let all = powers.iter().sum::<f64>() / (PIXELS - 1) as f64;
        let along = |k: usize| k.min(SIDE - k) as f64;
        // The second transform put rows where columns were: lengths of waves do not change.
        let is_long = |k: usize| {
            let frequency = along(k % SIDE).hypot(along(k / SIDE));
            frequency > 0.0 && frequency < SIDE as f64 / 4.0
        };
        let long: Vec<f64> = (0..PIXELS).filter(|k| is_long(*k)).map(|k| powers[k] / all).collect();
        let largest = powers.iter().copied().fold(0.0, f64::max) / all;
        [largest, long.iter().sum::<f64>() / long.len() as f64]
    }

    #[test]
    fn no_pattern_shows() {
        let tile: Vec<f64> = row().iter().map(|texel| f64::from(texel[0])).collect();
        let [largest, long] = spectrum(&tile);
        // Interleaved gradient noise (Jimenez 2014), which hatches pictures.
        let gradient = |k: usize| {
            let (x, y) = ((k % SIDE) as f64, (k / SIDE) as f64);
            (52.9829189 * (0.06711056 * x + 0.00583715 * y).fract()).fract()
        };
        let hatch = spectrum(&(0..PIXELS).map(gradient).collect::<Vec<_>>());
        println!("largest wave {largest:.1}, long waves {long:.4}; of gradient noise {hatch:.1?}");
        // White noise of as many pixels has a largest wave of about ln 4096 = 8, and long waves of 1. Here the short waves
        // have all the power.
        assert!(largest < 12.0 && long < 0.05, "largest wave {largest}, long waves {long}");
        assert!(hatch[0] > 100.0, "the figure tells patterns: {hatch:?}");
    }
}
