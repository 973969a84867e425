//! Functions of a quadratic invariant `s = D·D` of two points.
//!
//! ```text
//! D = X_b − X_a, a linear form of q;  D̄ = D(q_{n+1/2}),  D_n = D(q_n)
//! D̄V         = σ 2 D̄·∂D,     σ = (V(s_{n+1}) − V(s_n)) / (s_{n+1} − s_n)
//! ∂D̄V/∂q_{n+1} = ∂Dᵀ [σ I + 4 σ' D̄ D_{n+1}ᵀ] ∂D,     σ' = ∂σ/∂s_{n+1}
//! ```
//! `Ds(q_{n+1/2})·Δq = 2 D̄·ΔD = s_{n+1} − s_n` exactly, so the chain rule keeps directionality;
//! the force pair passes along `D̄`, so linear and angular momentum are kept too. For springs the
//! quotient has a closed form, with `l = √s`:
//! ```text
//! V = ½ k (l − l_0)²      σ = ½ k (1 − 2 l_0/(l_n + l_{n+1})),    σ' = ½ k l_0 / (l_{n+1} (l_n + l_{n+1})²)
//! V = ½ k (l² − l_0²)²    σ = ½ k (s_n + s_{n+1} − 2 l_0²),       σ' = ½ k
//! ```
//! Source: G96 §4, Betsch & Leyendecker 2006.

use crate::discrete_gradient::DiscreteGradient;
use nalgebra::Matrix3;
use vi_core::Configuration;
use vi_core::interval::Interval;
use vi_core::sparse::Entries;
use vi_multibody::form::Form;
use vi_multibody::spring::{Spring, SpringLaw};

/// Relative difference of the arguments below which the quotient is integrated, not divided.
const NEAR: f64 = 1e-3;
/// Abscissae and weights of Gauss–Legendre quadrature on `[0, 1]`, exact to degree 5.
const GAUSS: [(f64, f64); 3] = [
    (0.112_701_665_379_258_31, 5.0 / 18.0),
    (0.5, 8.0 / 18.0),
    (0.887_298_334_620_741_7, 5.0 / 18.0),
];

/// A potential as a function of `s = D·D ≥ 0`.
pub trait InvariantLaw: Send + Sync {
    /// `V(s)`, J.
    fn value(&self, s: f64) -> f64;
    /// `V'(s)`.
    fn slope(&self, s: f64) -> f64;
    /// `V''(s)`.
    fn bend(&self, s: f64) -> f64;

    /// `σ = (V(s1) − V(s0))/(s1 − s0)`, `V'` where they meet.
    ///
    /// The default divides the differences when they are large, and integrates `V'` otherwise.
    fn quotient(&self, s0: f64, s1: f64) -> f64 {
        let ds = s1 - s0;
        if ds.abs() > NEAR * (s0.abs() + s1.abs()) {
            return (self.value(s1) - self.value(s0)) / ds;
        }
        GAUSS.iter().map(|(x, w)| w * self.slope(s0 + x * ds)).sum()
    }

    /// `∂σ/∂s1`.
    fn quotient_derivative(&self, s0: f64, s1: f64) -> f64 {
        let ds = s1 - s0;
        if ds.abs() > NEAR * (s0.abs() + s1.abs()) {
            return (self.slope(s1) - self.quotient(s0, s1)) / ds;
        }
        GAUSS.iter().map(|(x, w)| w * x * self.bend(s0 + x * ds)).sum()
    }
}

/// The law of a spring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elastic {
    /// `k`, N/m or N/m³.
    pub stiffness: f64,
    /// `l_0`, m.
    pub natural_length: f64,
    /// Which law.
    pub law: SpringLaw,
}

impl InvariantLaw for Elastic {
    fn value(&self, s: f64) -> f64 {
        let l0 = self.natural_length;
        let stretch = match self.law {
            SpringLaw::Linear => s.sqrt() - l0,
            SpringLaw::QuadraticStretch => s - l0 * l0,
        };
        0.5 * self.stiffness * stretch * stretch
    }

    fn slope(&self, s: f64) -> f64 {
        self.quotient(s, s)
    }

    fn bend(&self, s: f64) -> f64 {
        2.0 * self.quotient_derivative(s, s)
    }

    fn quotient(&self, s0: f64, s1: f64) -> f64 {
        let (k, l0) = (self.stiffness, self.natural_length);
        match self.law {
            SpringLaw::Linear if l0 == 0.0 => 0.5 * k,
            SpringLaw::Linear => 0.5 * k * (1.0 - 2.0 * l0 / (s0.sqrt() + s1.sqrt())),
            SpringLaw::QuadraticStretch => 0.5 * k * (s0 + s1 - 2.0 * l0 * l0),
        }
    }

    fn quotient_derivative(&self, s0: f64, s1: f64) -> f64 {
        let (k, l0) = (self.stiffness, self.natural_length);
        match self.law {
            SpringLaw::Linear if l0 == 0.0 => 0.0,
            SpringLaw::Linear => {
                let sum = s0.sqrt() + s1.sqrt();
                0.5 * k * l0 / (s1.sqrt() * sum * sum)
            }
            SpringLaw::QuadraticStretch => 0.5 * k,
        }
    }
}

/// `V(D·D)`.
#[derive(Clone, Debug, PartialEq)]
pub struct InvariantPotential<L> {
    /// `D = X_b − X_a`.
    pub between: Form,
    /// `V(s)`.
    pub law: L,
}

impl From<Spring> for InvariantPotential<Elastic> {
    fn from(spring: Spring) -> Self {
        let Spring { between, stiffness, natural_length, law } = spring;
        Self { between, law: Elastic { stiffness, natural_length, law } }
    }
}

impl<L: InvariantLaw> InvariantPotential<L> {
    /// `(s_n, s_{n+1})`.
    fn invariants(&self, s: &Interval) -> (f64, f64) {
        (self.between.at(&s.q0).norm_squared(), self.between.at(&s.q1).norm_squared())
    }
}

impl<L: InvariantLaw> DiscreteGradient for InvariantPotential<L> {
    fn potential(&self, Configuration { q, .. }: Configuration<'_>) -> f64 {
        self.law.value(self.between.at(q).norm_squared())
    }

    fn add_gradient(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]) {
        let d = self.between.at(at.q);
        let s = d.norm_squared();
        self.between.add_transposed(&(2.0 * scale * self.law.quotient(s, s) * d), out);
    }

    fn add(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        let (s0, s1) = self.invariants(s);
        let sigma = self.law.quotient(s0, s1);
        self.between.add_transposed(&(2.0 * scale * sigma * self.between.at(&s.q_mid)), out);
    }

    fn add_derivative(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        let (s0, s1) = self.invariants(s);
        let (mid, end) = (self.between.at(&s.q_mid), self.between.at(&s.q1));
        let stiff = 4.0 * self.law.quotient_derivative(s0, s1);
        let w = self.law.quotient(s0, s1) * Matrix3::identity() + stiff * mid * end.transpose();
        self.between.emit_congruence(&(scale * w), out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same law without its closed form.
    struct Plain(Elastic);
    impl InvariantLaw for Plain {
        fn value(&self, s: f64) -> f64 {
            self.0.value(s)
        }
        fn slope(&self, s: f64) -> f64 {
            self.0.slope(s)
        }
        fn bend(&self, s: f64) -> f64 {
            self.0.bend(s)
        }
    }

    #[test]
    fn the_closed_quotients_are_those_of_the_default() {
        let mut worst = [0.0_f64; 2];
        for law in [SpringLaw::Linear, SpringLaw::QuadraticStretch] {
            let elastic = Elastic { stiffness: 3.0, natural_length: 0.8, law };
            for k in 0..17 {
                let (s0, s1) = (1.3, 1.3 + 0.9 * 10.0_f64.powi(-k));
                let plain = Plain(elastic);
                let off = elastic.quotient(s0, s1) - plain.quotient(s0, s1);
                worst[0] = worst[0].max(off.abs());
                let off = elastic.quotient_derivative(s0, s1) - plain.quotient_derivative(s0, s1);
                worst[1] = worst[1].max(off.abs());
            }
        }
        println!("quotients off by {:.1e}, their derivatives by {:.1e}", worst[0], worst[1]);
        assert!(worst[0] < 1e-12 && worst[1] < 1e-9, "{worst:?}");
    }
}
