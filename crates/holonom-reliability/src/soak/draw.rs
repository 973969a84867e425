//! Random draws of a mechanism, the same on every machine: additions, products, quotients and
//! square roots alone.

use vi_testkit::Sample;

/// Random choices, reproducible by their seed.
#[derive(Clone, Debug)]
pub struct Draw(Sample);

impl Draw {
    /// Of mechanism `index` of a run with this seed.
    #[must_use]
    pub fn new(seed: u64, index: u64) -> Self {
        // splitmix64: neighbouring numbers give unrelated sequences
        let mut z = seed.wrapping_add(index.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        Self(Sample::new(z ^ (z >> 31)))
    }

    /// Uniform in `[a, b)`.
    pub fn between(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * 0.5 * (self.0.number() + 1.0)
    }

    /// A number of a random order of magnitude: `10^k`, `k` of `decades`, times 1 to 10.
    pub fn magnitude(&mut self, decades: &[f64]) -> f64 {
        self.pick(decades) * self.between(1.0, 10.0)
    }

    /// `true` with this probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.between(0.0, 1.0) < probability
    }

    /// One of `0..count`; 0 of none.
    pub fn index(&mut self, count: usize) -> usize {
        self.0.index(count)
    }

    /// One of `a..=b`.
    pub fn count(&mut self, a: usize, b: usize) -> usize {
        a + self.index(b - a + 1)
    }

    /// One of these. Premise: there is one.
    pub fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.index(of.len())]
    }

    /// One of these with their weights. Premise: there is one.
    pub fn weighted<T: Copy>(&mut self, of: &[(u32, T)]) -> T {
        let sum: u32 = of.iter().map(|(weight, _)| weight).sum();
        let mut rest = self.between(0.0, f64::from(sum));
        for (weight, value) in of {
            rest -= f64::from(*weight);
            if rest < 0.0 {
                return *value;
            }
        }
        of[of.len() - 1].1
    }

    /// Components uniform in `[−size, size)`.
    pub fn vector(&mut self, size: f64) -> [f64; 3] {
        self.0.array().map(|x: f64| size * x)
    }

    /// A vector of length 1.
    pub fn direction(&mut self) -> [f64; 3] {
        self.0.of_length(1.0).into()
    }

    /// A unit quaternion `[w, x, y, z]`.
    pub fn quaternion(&mut self) -> [f64; 4] {
        loop {
            let q: [f64; 4] = self.0.array();
            let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
            if norm > 0.1 {
                return q.map(|x| x / norm);
            }
        }
    }
}

/// `a + s b`.
#[must_use]
pub fn along(a: [f64; 3], s: f64, b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] + s * b[i])
}

/// `a × b`.
#[must_use]
pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3])
}

/// A vector of length 1 normal to `axis`, which has length 1.
pub fn normal_to(axis: [f64; 3], draw: &mut Draw) -> [f64; 3] {
    loop {
        let normal = cross(axis, draw.direction());
        let norm = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
        if norm > 0.1 {
            return normal.map(|x| x / norm);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_are_those_of_their_seed_bit_for_bit() {
        let numbers = |seed, index| {
            let mut draw = Draw::new(seed, index);
            (draw.between(-1.0, 3.0).to_bits(), draw.quaternion().map(f64::to_bits))
        };
        assert_eq!(numbers(1, 7), numbers(1, 7));
        assert_ne!(numbers(1, 7), numbers(1, 8));
        assert_ne!(numbers(1, 7), numbers(2, 7));
        // of every machine
        assert_eq!(numbers(1, 7).0, 4_611_811_482_128_592_287, "{:?}", numbers(1, 7));
    }

    #[test]
    fn weights_are_frequencies() {
        let mut draw = Draw::new(0, 0);
        let ones = (0..4000).filter(|_| draw.weighted(&[(3, 0), (1, 1)]) == 1).count();
        println!("{ones} of 4000");
        assert!((900..1100).contains(&ones), "{ones}");
    }
}
