//! The energy that a law of one coordinate stores.
//!
//! ```text
//! joint coordinate   V(x) = −∫_{x_0}^{x} τ(s) ds
//! two points         V(l) =  ∫_{l_0}^{l} T(s) ds
//! ```
//! `x_0` is the coordinate at a configuration of reference. The step of such a law is
//! `−h D_1 V(x̄)`, `−h D_2 V(x̄)`: symplectic, although nobody integrated it. `V` is wanted at
//! nodes that are recorded alone; Gauss's rule with 8 nodes is applied to intervals that are halved
//! until it agrees with itself, and its polynomial with the law at both ends, so kinks and knots of
//! tables are met to rounding.

use super::joint_force::JointLaw;
use crate::constraint::joint_coordinate::JointCoordinate;
use crate::geometry::form::Form;
use std::sync::Arc;
use vi_core::Configuration;
use vi_core::galerkin::{GaussLobatto, Stages};

/// By how much the rule may disagree with itself, relative to the integral of the modulus.
const AGREEMENT: f64 = 1e-14;
/// Evaluations of a law for one energy, at most.
const EVALUATIONS: usize = 8192;

/// What a law acts along.
#[derive(Clone, Debug)]
pub enum Along {
    /// A joint coordinate.
    Coordinate(Box<JointCoordinate>),
    /// The distance of two points; effort is a tension.
    Distance(Form),
}

/// `V` of a law.
#[derive(Clone, Debug)]
pub struct StoredEnergy {
    along: Along,
    law: Arc<dyn JointLaw>,
    reference: f64,
    rule: Gauss,
}

impl StoredEnergy {
    /// Of a law that reads nothing but its coordinate; zero at a configuration.
    #[must_use]
    pub fn new(along: Along, law: Arc<dyn JointLaw>, zero: Configuration<'_>) -> Self {
        let reference = along.at(zero);
        Self { along, law, reference, rule: Gauss::new() }
    }

    /// The same law along the same coordinate as another mechanism lists it.
    #[must_use]
    pub fn moved_to(&self, along: Along) -> Self {
        Self { along, ..self.clone() }
    }

    /// `V`, J.
    #[must_use]
    pub fn value(&self, at: Configuration<'_>) -> f64 {
        let sign = match self.along {
            Along::Coordinate(_) => -1.0,
            Along::Distance(_) => 1.0,
        };
        let effort = |x: f64| sign * self.law.effort(at.t, x, 0.0);
        self.rule.integral(&effort, self.reference, self.along.at(at))
    }
}

impl Along {
    /// The coordinate, m or rad, with its revolutions where the mechanism counts them.
    #[must_use]
    pub fn at(&self, at: Configuration<'_>) -> f64 {
        match self {
            Self::Coordinate(coordinate) => coordinate.at(at),
            Self::Distance(between) => between.at(at.q).norm(),
        }
    }
}

/// Gauss's rule on `[0, 1]`.
#[derive(Clone, Debug)]
struct Gauss {
    nodes: Vec<f64>,
    weights: Vec<f64>,
    at_start: Vec<f64>, // the interpolating polynomial at 0; at 1 in the other order
}

/// What the rule finds on an interval.
#[derive(Clone, Copy, Debug)]
struct IntervalSums {
    integral: f64,
    modulus: f64, // ∫ |f|
    /// What a kink beyond the outer nodes may have hidden: how far the polynomial through the nodes
    /// misses `f` at an end, over half the way from there to the first node.
    hidden: f64,
}

impl Gauss {
    fn new() -> Self {
        let stages = Stages::new(Stages::MAX).expect("the largest degree is one");
        let GaussLobatto { gauss_nodes: nodes, gauss_weights: weights, .. } =
            GaussLobatto::new(stages);
        let at_start = |k: usize| {
            let others = nodes.iter().enumerate().filter(|(j, _)| *j != k);
            others.map(|(_, node)| node / (node - nodes[k])).product()
        };
        let at_start = (0..nodes.len()).map(at_start).collect();
        Self { nodes, weights, at_start }
    }

    fn of(&self, f: &dyn Fn(f64) -> f64, a: f64, b: f64) -> IntervalSums {
        let length = b - a;
        let (mut integral, mut modulus, mut ends) = (0.0, 0.0, [f(a), f(b)]);
        let count = self.nodes.len();
        for (k, (node, weight)) in self.nodes.iter().zip(&self.weights).enumerate() {
            let value = f(a + node * length);
            integral += length * weight * value;
            modulus += (length * weight * value).abs();
            ends[0] -= self.at_start[k] * value;
            ends[1] -= self.at_start[count - 1 - k] * value;
        }
        let miss = ends[0].abs().max(ends[1].abs());
        IntervalSums { integral, modulus, hidden: 0.5 * self.nodes[0] * length.abs() * miss }
    }

    /// `∫ f` from `a` to `b`: halves are added up from the left.
    fn integral(&self, f: &dyn Fn(f64) -> f64, a: f64, b: f64) -> f64 {
        if a.to_bits() == b.to_bits() {
            return 0.0;
        }
        let whole = self.of(f, a, b);
        let (mut sum, allowed) = (0.0, AGREEMENT * whole.modulus);
        let mut left = EVALUATIONS / (2 * self.nodes.len());
        let mut open = vec![(a, b, whole)];
        while let Some((a, b, whole)) = open.pop() {
            let middle = 0.5 * (a + b);
            let [first, second] = [self.of(f, a, middle), self.of(f, middle, b)];
            let halves = first.integral + second.integral;
            left = left.saturating_sub(1);
            // what is not a number is not apart, and stays so
            let apart = (halves - whole.integral).abs() > allowed
                || first.hidden.max(second.hidden) > allowed;
            if apart && left > 0 {
                open.push((middle, b, second));
                open.push((a, middle, first));
            } else {
                sum += halves;
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrals_are_met_to_rounding() {
        let rule = Gauss::new();
        let cases: [(&str, &dyn Fn(f64) -> f64, f64, f64, f64); 7] = [
            ("cubic", &|x| 4.0 * x * x * x, 0.0, 2.0, 16.0),
            ("backwards", &|x| 4.0 * x * x * x, 2.0, 0.0, -16.0),
            ("many waves", &libm::sin, 0.0, 100.0, 1.0 - libm::cos(100.0)),
            ("a kink", &|x: f64| (x - 0.3).max(0.0), -1.0, 1.0, 0.245),
            ("a kink near an end", &|x: f64| (x - 0.99).max(0.0), 0.0, 1.0, 5e-5),
            ("a jump", &|x| if x < 0.3 { -1.0 } else { 2.0 }, -1.0, 1.0, 0.1),
            ("nothing", &|_| 0.0, -1.0, 1.0, 0.0),
        ];
        for (name, f, a, b, exact) in cases {
            let error = (rule.integral(f, a, b) - exact).abs();
            let modulus = rule.integral(&|x| f(x).abs(), a, b).abs();
            println!("{name}: off by {error:.1e} of {modulus:.1e}");
            assert!(error <= 2e-13 * modulus, "{name}: {error:e}");
        }
        assert!(rule.integral(&|_| f64::NAN, 0.0, 1.0).is_nan());
    }
}
