//! Random samples for tests, reproducible by their seed.

use nalgebra::{DMatrix, Rotation3, Vector3};

/// A linear congruential generator (Knuth's MMIX constants).
#[derive(Clone, Debug)]
pub struct Sample(u64);

impl Sample {
    /// With the given seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        let mut sample = Self(seed);
        for _ in 0..4 {
            sample.number();
        }
        sample
    }

    /// Uniform in [−1, 1).
    pub fn number(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// One of `0..count`.
    pub fn index(&mut self, count: usize) -> usize {
        (0.5 * (self.number() + 1.0) * count as f64) as usize
    }

    /// Components uniform in [−1, 1).
    pub fn vector(&mut self) -> Vector3<f64> {
        Vector3::new(self.number(), self.number(), self.number())
    }

    /// A vector of the given length.
    pub fn of_length(&mut self, length: f64) -> Vector3<f64> {
        loop {
            let v = self.vector();
            if v.norm() > 0.1 {
                return v * (length / v.norm());
            }
        }
    }

    /// Components uniform in [−1, 1).
    pub fn array<const N: usize>(&mut self) -> [f64; N] {
        std::array::from_fn(|_| self.number())
    }

    /// Entries uniform in [−1, 1).
    pub fn matrix(&mut self, rows: usize, columns: usize) -> DMatrix<f64> {
        DMatrix::from_fn(rows, columns, |_, _| self.number())
    }

    /// Centre and directors `(φ, d_1, d_2, d_3)` of a frame.
    pub fn frame(&mut self) -> [f64; 12] {
        let angle = 3.0 * self.number();
        let triad = Rotation3::new(self.of_length(angle)).into_inner();
        let center = 2.0 * self.vector();
        let mut q = [0.0; 12];
        q[..3].copy_from_slice(center.as_slice());
        q[3..].copy_from_slice(triad.as_slice());
        q
    }
}
