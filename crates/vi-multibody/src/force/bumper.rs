//! Elastic stops of a joint coordinate.
//!
//! ```text
//! δ = a − θ or θ − b,   F = max(0, kδ + cδ̇) where δ > 0,   τ = F at the lower limit, −F at the upper one
//! ```
//! The damper never pulls, so that the contact ends before `δ = 0` where the coordinate leaves it.
//! Steps are to resolve the contact: a twentieth of `π√(M/k)` or less.

use crate::joint_force::JointLaw;
use vi_core::Number;
use vi_core::coordinate_force::EffortSlopes;

/// Bumpers at the limits of a coordinate, m or rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bumper<T = f64> {
    /// The lower limit `a`.
    pub lower: Option<T>,
    /// The upper limit `b`.
    pub upper: Option<T>,
    /// `k`, N/m or N·m/rad.
    pub stiffness: T,
    /// `c`, N·s/m or N·m·s/rad.
    pub damping: T,
}

impl<T: Number> Bumper<T> {
    /// The direction in which a bumper pushes, and `F > 0`.
    fn push(&self, coordinate: f64, rate: f64) -> Option<(f64, T)> {
        let below = self.lower.map(|lower| (1.0, lower - T::of(coordinate)));
        let above = self.upper.map(|upper| (-1.0, T::of(coordinate) - upper));
        let mut both = below.into_iter().chain(above);
        let (sign, depth) = both.find(|(_, depth)| Number::real(*depth) > 0.0)?;
        let force = self.stiffness * depth - self.damping * T::of(sign) * T::of(rate);
        (Number::real(force) > 0.0).then_some((sign, force))
    }

    /// `τ`.
    pub fn effort_at(&self, coordinate: f64, rate: f64) -> T {
        self.push(coordinate, rate).map_or_else(|| T::of(0.0), |(sign, force)| T::of(sign) * force)
    }
}

impl JointLaw for Bumper {
    fn effort(&self, _t: f64, coordinate: f64, rate: f64) -> f64 {
        self.effort_at(coordinate, rate)
    }
    fn slopes(&self, _t: f64, coordinate: f64, rate: f64) -> EffortSlopes {
        match self.push(coordinate, rate) {
            Some(_) => EffortSlopes { by_coordinate: -self.stiffness, by_rate: -self.damping },
            None => EffortSlopes::default(),
        }
    }
    fn is_dissipative(&self) -> bool {
        self.damping != 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BUMPER: Bumper =
        Bumper { lower: Some(-0.5), upper: Some(1.0), stiffness: 20.0, damping: 3.0 };

    #[test]
    fn it_pushes_back_and_never_pulls() {
        let effort = |coordinate, rate| BUMPER.effort(0.0, coordinate, rate);
        assert_eq!(effort(0.9, 5.0), 0.0);
        assert!((effort(1.25, 0.0) + 5.0).abs() < 1e-15);
        assert!((effort(1.25, 2.0) + 11.0).abs() < 1e-15);
        assert_eq!(effort(1.25, -2.0), 0.0);
        assert!((effort(-0.75, 0.0) - 5.0).abs() < 1e-15);
        assert!((effort(-0.75, -2.0) - 11.0).abs() < 1e-15);
        assert_eq!(effort(-0.75, 2.0), 0.0);
        let one_sided = Bumper { lower: None, ..BUMPER };
        assert_eq!(one_sided.effort(0.0, -9.0, -1.0), 0.0);
    }

    #[test]
    fn slopes_are_the_differences_of_the_effort() {
        let step = 1e-6;
        for (coordinate, rate) in [(1.3, 0.4), (-0.9, 0.2), (0.2, 1.0), (1.2, -3.0)] {
            let slopes = BUMPER.slopes(0.0, coordinate, rate);
            let by = |x: f64, v: f64| {
                let at = |sign: f64| BUMPER.effort(0.0, coordinate + sign * x, rate + sign * v);
                (at(1.0) - at(-1.0)) / (2.0 * step)
            };
            assert!((by(step, 0.0) - slopes.by_coordinate).abs() < 1e-7);
            assert!((by(0.0, step) - slopes.by_rate).abs() < 1e-7);
        }
    }
}
