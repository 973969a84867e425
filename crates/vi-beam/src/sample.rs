//! Random valid configurations for the tests, reproducible by their seed.

use nalgebra::Vector3;
use vi_rigid::{directors, rotation};

/// A linear congruential generator (Knuth's MMIX constants).
pub(crate) struct Sample(u64);

impl Sample {
    pub(crate) fn new(seed: u64) -> Self {
        let mut sample = Self(seed);
        for _ in 0..4 {
            sample.number();
        }
        sample
    }

    /// Uniform in [−1, 1).
    pub(crate) fn number(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    pub(crate) fn vector(&mut self) -> Vector3<f64> {
        Vector3::new(self.number(), self.number(), self.number())
    }

    /// A vector of the given length.
    pub(crate) fn of_length(&mut self, length: f64) -> Vector3<f64> {
        loop {
            let v = self.vector();
            if v.norm() > 0.1 {
                return v * (length / v.norm());
            }
        }
    }

    pub(crate) fn array<const N: usize>(&mut self) -> [f64; N] {
        std::array::from_fn(|_| self.number())
    }

    /// A frame with an orthonormal triad.
    pub(crate) fn frame(&mut self) -> [f64; 12] {
        let angle = 3.0 * self.number();
        let mut triad = rotation::exp(&self.of_length(angle));
        rotation::polar_step(&mut triad);
        let mut q = [0.0; 12];
        directors::set_frame(&mut q, &(2.0 * self.vector()), &triad);
        q
    }
}
