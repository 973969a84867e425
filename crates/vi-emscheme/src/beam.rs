//! The discrete derivative of beams: averaged strains.
//!
//! ```text
//! D̄V = Σ_e ℓ Σ_i (C ε̄)_i 𝔹_i x_{n+1/2},      ε̄ = ½ (ε(q_n) + ε(q_{n+1}))
//! ∂D̄V/∂q_{n+1} = ½ Σ_e ℓ Σ_i C_i [𝔹_i x_{n+1/2} (𝔹_i x_{n+1})ᵀ + ε̄_i 𝔹_i]
//! ```
//! Exact, since every strain is quadratic: `Dε(q_{n+1/2}) Δq = Δε`. Equivariant, since strains are
//! invariant under rigid motions of any `x`. Helicoidal strains are functions `η(y)` of quadratic
//! forms `y_k = ½ xᵀ𝔹_k x`, whose discrete derivative `∂̄η` takes the place of a gradient:
//! ```text
//! D̄V = Σ_e ℓ Σ_k c_k 𝔹_k x_{n+1/2},   c = ∂̄ηᵀ C η̄,   ∂̄η Δy = Δη,   𝔹_k x_{n+1/2}·Δx = Δy_k
//! ∂D̄V/∂q_{n+1} = Σ_e ℓ [ 𝔹x_{n+1/2} (½ ∂̄ηᵀ C ∇η + ∂c/∂y) (𝔹x_{n+1})ᵀ + ½ Σ_k c_k 𝔹_k ]
//! ```
//!
//! Letters: `ε_i`, `η_i` strains, `C` stiffness, `ℓ` length, `𝔹_i x` gradients of forms. Source:
//! BL06; O. Gonzalez, J. Nonlinear Sci. 6 (1996) 449–467.
#![allow(non_snake_case)] // C, K

use crate::discrete_gradient::DiscreteGradient;
use vi_beam::element::Element;
use vi_beam::elements::Elements;
use vi_beam::nalgebra::Matrix6;
use vi_beam::strain::Strain;
use vi_core::Configuration;
use vi_core::interval::Interval;
use vi_core::potential::Potential;
use vi_core::sparse::Entries;

/// `D̄V` of all elements.
#[derive(Clone, Debug)]
pub struct BeamGradient(pub Elements);

/// `C ε̄` and its derivative by `ε_{n+1}`.
fn mean_stress(element: &Element, C: &Matrix6<f64>, s: &Interval) -> (Strain, Matrix6<f64>) {
    let at = |q: &[f64]| element.strain(&element.coordinates(q));
    element.mean_stress(C, [&at(&s.q0), &at(&s.q1)])
}

impl DiscreteGradient for BeamGradient {
    fn potential(&self, at: Configuration<'_>) -> f64 {
        self.0.value(at.q)
    }

    fn add_gradient(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]) {
        self.0.add_gradient(at.q, scale, out);
    }

    fn add(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        for (element, C) in self.0.iter() {
            let n = scale * (element.length * mean_stress(element, C, s).0);
            element.scatter(&element.discrete_force(s, &n), out);
        }
    }

    fn add_derivative(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        for (element, C) in self.0.iter() {
            let (stress, slope) = mean_stress(element, C, s);
            let c = scale * element.length * slope;
            let n = scale * (element.length * stress);
            element.emit(&element.discrete_tangent(s, &c, &n), out);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, Vector3};
    use vi_beam::Rest;
    use vi_beam::element::ElementKind;
    use vi_beam::section::Section;
    use vi_rigid::{directors, rotation};

    /// Two elements through three frames that are nowhere near orthonormal, and another
    /// configuration.
    fn placements() -> (Elements, Vec<f64>, Vec<f64>) {
        let number = |i: usize, k: f64| ((i as f64 + 0.3) * k).sin();
        let mut q0 = vec![0.0; 36];
        for (k, own) in q0.chunks_mut(12).enumerate() {
            let turn = rotation::exp(&Vector3::new(0.2 * k as f64, -0.3, 0.1));
            directors::set_frame(own, &Vector3::new(0.1, 0.2, 0.8 * k as f64), &turn);
        }
        let q1 = q0.iter().enumerate().map(|(i, q)| q + 0.2 * number(i, 1.9)).collect();
        let mut elements = Elements::new();
        let section = Section::new([3.0, 2.0, 5.0, 1.0, 1.5, 0.7], [1.0, 0.1, 0.2, 0.0]).unwrap();
        let section = elements.add_section(section);
        elements.add_stress_free([0, 1], 0.8, section, &q0).unwrap();
        elements.add_stress_free([1, 2], 0.8, section, &q0).unwrap();
        (elements, q0, q1)
    }

    fn interval(q0: &[f64], q1: &[f64]) -> Interval {
        let mut s = Interval::new(q0.len());
        s.open(0.0, 0.1, q0);
        s.q1.copy_from_slice(q1);
        s.close_from_end();
        s
    }

    #[test]
    fn it_is_directional_equivariant_and_has_its_derivative() {
        let (elements, q0, q1) = placements();
        check(&BeamGradient(elements.clone()), &q0, &q1);
        for kind in [ElementKind::Helicoidal, ElementKind::SecondOrder] {
            let mut elements = elements.clone();
            elements.set_strains(0..2, kind, &q0).unwrap();
            check(&BeamGradient(elements), &q0, &q1);
        }
        // one rope is taut at both ends of the step or slack at both, the other changes
        for stretch in [0.7, 0.98, 1.02, 1.3] {
            let mut elements = elements.clone();
            elements.set_strains(0..2, ElementKind::Rope, &q0).unwrap();
            elements.set_rest(0..1, &Rest::Shape { stretch, curvature: None }, &q0);
            check(&BeamGradient(elements), &q0, &q1);
        }
    }

    fn check(gradient: &impl DiscreteGradient, q0: &[f64], q1: &[f64]) {
        let at = |q1: &[f64]| {
            let mut out = vec![0.0; 36];
            gradient.add(&interval(q0, q1), 1.0, &mut out);
            out
        };
        let (s, found) = (interval(q0, q1), at(q1));
        let work: f64 = found.iter().zip(&s.dq).map(|(d, dq)| d * dq).sum();
        let change = gradient.potential(s.end()) - gradient.potential(s.start());
        let moment: Vector3<f64> = (0..12)
            .map(|k| {
                let part = |x: &[f64]| Vector3::from_column_slice(&x[3 * k..3 * k + 3]);
                part(&s.q_mid).cross(&part(&found))
            })
            .sum();
        println!("directionality {:.1e}, moment {:.1e}", work - change, moment.amax());
        assert!((work - change).abs() < 1e-14 && moment.amax() < 1e-14);

        let mut derivative = DMatrix::zeros(36, 36);
        gradient.add_derivative(&s, 1.0, &mut derivative);
        let (e, mut worst) = (1e-5, 0.0_f64);
        for j in 0..36 {
            let moved = |by: f64| {
                let mut q = q1.to_vec();
                q[j] += by;
                at(&q)
            };
            let (plus, minus) = (moved(e), moved(-e));
            for i in 0..36 {
                let slope = (plus[i] - minus[i]) / (2.0 * e);
                worst = worst.max((slope - derivative[(i, j)]).abs());
            }
        }
        println!("derivative off by {worst:.1e}");
        assert!(worst < 1e-8, "{worst:e}");
    }
}
