//! Discrete derivatives `D̄V(q_n, q_{n+1})` of potentials.
//!
//! ```text
//! directionality   D̄V(q_n, q_{n+1})·Δq = V(q_{n+1}) − V(q_n)
//! consistency      D̄V(q, q) = ∇V(q)
//! symmetry         D̄V(q_n, q_{n+1}) = D̄V(q_{n+1}, q_n)
//! equivariance     ξ_{R^n}(q_{n+1/2})·D̄V = 0 for every symmetry ξ of V
//! ```
//! Directionality makes the scheme conserve energy, symmetry gives order 2, equivariance conserves
//! the momentum map. Linear potentials are their own discrete derivative (here). Functions of
//! quadratic invariants have an exact and equivariant one ([`crate::invariant`]). Everything else
//! is served by the formula of [`crate::gonzalez`], which is equivariant under no more than happens
//! to be so. Beam elements implement the trait where their strains are known:
//! `D̄V = Σ_e ℓ Σ_i C_i ε̄_i 𝔹_i x_{n+1/2}`, theory of Betsch & Leyendecker 2006.
//!
//! Letters: `V` potential (J), `D̄V` discrete derivative, shape `n` (N for positions, N·m for
//! directors). Source: Gonzalez, J. Nonlinear Sci. 6 (1996) 449–467 (G96).

use vi_core::Configuration;
use vi_core::interval::Interval;
use vi_core::potential::{LinearPotential, Potential};
use vi_core::sparse::Entries;

/// A potential with a discrete derivative.
///
/// Open for extension.
pub trait DiscreteGradient: Send + Sync {
    /// `V(q)`, J.
    fn potential(&self, at: Configuration<'_>) -> f64;
    /// `out ← out + scale ∇V(q)`, shape `n`.
    fn add_gradient(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]);
    /// `out ← out + scale D̄V(q_n, q_{n+1})`, shape `n`.
    fn add(&self, s: &Interval, scale: f64, out: &mut [f64]);
    /// Emits `scale ∂D̄V/∂q_{n+1}`, shape `n × n`, in general not symmetric; always the same places
    /// in the same order.
    fn add_derivative(&self, s: &Interval, scale: f64, out: &mut dyn Entries);
}

/// `V = −w·q`, gravity for one: `D̄V = −w`.
impl DiscreteGradient for LinearPotential {
    fn potential(&self, at: Configuration<'_>) -> f64 {
        self.value(at.q)
    }
    fn add_gradient(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]) {
        Potential::add_gradient(self, at.q, scale, out);
    }
    fn add(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        Potential::add_gradient(self, &s.q_mid, scale, out);
    }
    fn add_derivative(&self, _s: &Interval, _scale: f64, _out: &mut dyn Entries) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gonzalez::Gonzalez;
    use crate::invariant::InvariantPotential;
    use nalgebra::{DMatrix, Vector3};
    use vi_core::num_dual::DualNum;
    use vi_core::potential::{DualPotential, ScalarField};
    use vi_multibody::form::Form;
    use vi_multibody::spring::{Spring, SpringLaw};

    struct Rough;
    impl ScalarField<6> for Rough {
        fn value<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D; 6]) -> D {
            (q[0] * q[4] - q[2]).powi(3) + (q[3] * q[1] + q[5]).sin() * q[0] + q[5].exp()
        }
    }

    fn spring(law: SpringLaw) -> Spring {
        let between = Form::particle(3, 3).minus(&Form::particle(0, 3));
        Spring { between, stiffness: 8.0, natural_length: 0.6, law }
    }

    fn gradients() -> Vec<(&'static str, Box<dyn DiscreteGradient>)> {
        let linear = LinearPotential { force: vec![1.0, -2.0, 0.5, 0.3, 0.0, -9.81] };
        let invariant = |law| Box::new(InvariantPotential::from(spring(law)));
        vec![
            ("gravity", Box::new(linear)),
            ("spring", invariant(SpringLaw::Linear)),
            ("quadratic spring", invariant(SpringLaw::QuadraticStretch)),
            ("G96 spring", Box::new(Gonzalez::new(spring(SpringLaw::Linear), 6))),
            ("G96 other", Box::new(Gonzalez::new(DualPotential(Rough), 6))),
        ]
    }

    fn interval(step: f64) -> Interval {
        let mut s = Interval::new(6);
        s.open(0.0, 0.1, &[0.1, 0.2, -0.3, 0.9, 0.7, 0.4]);
        for (k, dq) in s.dq.iter_mut().enumerate() {
            *dq = step * [0.5, -1.0, 0.3, 0.8, -0.2, 0.6][k];
        }
        s.close_from_increment();
        s
    }

    fn derivative(gradient: &dyn DiscreteGradient, s: &Interval) -> Vec<f64> {
        let mut out = vec![0.0; 6];
        gradient.add(s, 1.0, &mut out);
        out
    }

    #[test]
    fn directionality_consistency_and_symmetry_for_any_length_of_the_step() {
        for (name, gradient) in gradients() {
            let (mut direction, mut symmetry) = (0.0_f64, 0.0_f64);
            let at_rest = derivative(&*gradient, &interval(0.0));
            for k in 0..33 {
                let step = 0.5 * 10.0_f64.powf(-0.5 * f64::from(k));
                let s = interval(step);
                let found = derivative(&*gradient, &s);
                let work: f64 = found.iter().zip(&s.dq).map(|(d, dq)| d * dq).sum();
                let rise = gradient.potential(s.end()) - gradient.potential(s.start());
                direction = direction.max((work - rise).abs());
                let mut back = s.clone();
                std::mem::swap(&mut back.q0, &mut back.q1);
                back.dq.iter_mut().for_each(|dq| *dq = -*dq);
                for (a, b) in found.iter().zip(derivative(&*gradient, &back)) {
                    symmetry = symmetry.max((a - b).abs());
                }
                for (a, b) in found.iter().zip(&at_rest) {
                    assert!((a - b).abs() < 40.0 * step + 1e-14, "{name}: consistency at {step:e}");
                }
            }
            println!("{name:<17} D̄V·Δq − ΔV {direction:.1e}, asymmetry {symmetry:.1e}");
            assert!(direction < 1e-14 && symmetry < 2e-14, "{name}: {direction:e} {symmetry:e}");
        }
    }

    #[test]
    fn derivatives_against_central_differences() {
        for (name, gradient) in gradients() {
            for step in [0.5, 1e-2, 1e-4] {
                let s = interval(step);
                let mut exact = DMatrix::zeros(6, 6);
                gradient.add_derivative(&s, 1.0, &mut exact);
                let e = (1e-2 * step).min(1e-5);
                let mut worst = 0.0_f64;
                for j in 0..6 {
                    let at = |by: f64| {
                        let mut s = s.clone();
                        s.dq[j] += by;
                        s.close_from_increment();
                        derivative(&*gradient, &s)
                    };
                    let (plus, minus) = (at(e), at(-e));
                    for i in 0..6 {
                        let slope = (plus[i] - minus[i]) / (2.0 * e);
                        worst = worst.max((slope - exact[(i, j)]).abs());
                    }
                }
                println!("{name:<17} |Δq| ~ {step:.0e}: derivative off by {worst:.1e}");
                assert!(worst < 1e-10 / e, "{name} at {step}: {worst:e}");
                assert!(worst < 1e-4, "{name} at {step}: {worst:e}");
            }
        }
    }

    /// Resultant moment of `D̄V` about the origin at the averaged points.
    #[test]
    fn only_the_invariant_derivative_has_no_moment() {
        for (name, gradient) in gradients().into_iter().skip(1).take(3) {
            let s = interval(0.5);
            let f = derivative(&*gradient, &s);
            let vector = |x: &[f64], k: usize| Vector3::new(x[k], x[k + 1], x[k + 2]);
            let moment: Vector3<f64> =
                [0, 3].iter().map(|&k| vector(&s.q_mid, k).cross(&vector(&f, k))).sum();
            let resultant = vector(&f, 0) + vector(&f, 3);
            println!("{name:<17} force {:.1e}, moment {:.1e}", resultant.norm(), moment.norm());
            if name.starts_with("G96") {
                assert!(moment.norm() > 1e-3, "G96 kept the moment: {moment}");
            } else {
                assert!(resultant.norm() + moment.norm() < 1e-14, "{name}: {resultant} {moment}");
            }
        }
    }
}
