//! Numbers without a pattern.

/// Numbers in [−1, 1), the same in every run.
pub(super) struct RandomNumbers(u64);

impl RandomNumbers {
    /// The first of them.
    pub(super) const FIRST: Self = Self(0x9e37_79b9_7f4a_7c15);

    pub(super) fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}
