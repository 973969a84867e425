//! Round-off of a motion.

/// Round-off of `steps` steps that the motion enlarges: `10 ε √N` times the growth.
pub(super) fn round_off(steps: u64, growth: f64) -> f64 {
    10.0 * f64::EPSILON * (steps as f64).sqrt() * growth
}
