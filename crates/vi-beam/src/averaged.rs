//! The averaged-strain discrete potential.
//!
//! ```text
//! U_d(q_n, q_{n+1}) = Σ_e ½ ℓ Σ_i C_i ε̄_i²,       ε̄ = ½ (ε(q_n) + ε(q_{n+1}))
//! D_1 U_d   = ½ ℓ Σ C_i ε̄_i 𝔹_i x_n
//! D_2 U_d   = ½ ℓ Σ C_i ε̄_i 𝔹_i x_{n+1}
//! D_2D_1U_d = ¼ ℓ Σ C_i (𝔹_i x_n)(𝔹_i x_{n+1})ᵀ
//! D_1D_1U_d = ¼ ℓ Σ C_i (𝔹_i x_n)(𝔹_i x_n)ᵀ + ½ ℓ Σ C_i ε̄_i 𝔹_i
//! ```
//! Symmetric, of order 2, equal to the midpoint rule for linear problems. A rigid rotation between the
//! ends is strain-free, whereas the midpoint configuration is shrunk by `cos(ϑ/2)` and shows the strain
//! `−sin²(ϑ/2) ≈ −(hω)²/4`: multiplied by `EA` it stretches stiff beams, and beyond about
//! `h = √(L/(c ω))`, `c = √(EA/ρA)`, the step fails altogether. With stiff sections this is the
//! potential to use. No geometric term in the Newton matrix.
//!
//! Source: theory §6, "Discrete potential".
#![allow(non_snake_case)] // U_d, C

use crate::element::{Element, Elements};
use crate::strain::Strain;
use vi_core::Configuration;
use vi_core::interval::Interval;
use vi_core::potential::{DiscretePotential, Potential};
use vi_core::sparse::Entries;

/// `U_d` of all elements.
#[derive(Clone, Debug)]
pub struct AveragedStrains(pub Elements);

/// `ε̄`.
fn mean_strain(element: &Element, s: &Interval) -> Strain {
    let at = |q: &[f64]| element.strain(&element.coordinates(q));
    0.5 * (at(&s.q0) + at(&s.q1)) // [6.11]
}

impl AveragedStrains {
    fn add_slot(&self, s: &Interval, q: &[f64], scale: f64, out: &mut [f64]) {
        for (element, C) in self.0.iter() {
            let n = 0.5 * scale * element.length * C.component_mul(&mean_strain(element, s));
            element.scatter(&(element.gradients(&element.coordinates(q)) * n), out);
        }
    }
}

impl DiscretePotential for AveragedStrains {
    fn value(&self, s: &Interval) -> f64 {
        let energy = |(element, C): (&Element, Strain)| {
            let eps = mean_strain(element, s);
            0.5 * element.length * C.component_mul(&eps).dot(&eps) // [6.12]
        };
        self.0.iter().map(energy).sum()
    }

    fn add_d1(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        self.add_slot(s, &s.q0, scale, out);
    }

    fn add_d2(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        self.add_slot(s, &s.q1, scale, out);
    }

    fn add_d2_d1(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        for (element, C) in self.0.iter() {
            let mut rows = element.gradients(&element.coordinates(&s.q0));
            let columns = element.gradients(&element.coordinates(&s.q1));
            for i in 0..6 {
                rows.column_mut(i).scale_mut(0.25 * scale * element.length * C[i]);
            }
            element.emit(&(rows * columns.transpose()), out);
        }
    }

    fn add_d1_d1(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        for (element, C) in self.0.iter() {
            let x = element.coordinates(&s.q0);
            let weight = 0.5 * scale * element.length * C;
            let n = weight.component_mul(&mean_strain(element, s));
            element.emit(&element.tangent(&x, &(0.5 * weight), &n), out);
        }
    }

    fn potential(&self, at: Configuration<'_>) -> f64 {
        self.0.value(at.q)
    }

    fn add_gradient(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]) {
        self.0.add_gradient(at.q, scale, out);
    }

    fn add_hessian(&self, at: Configuration<'_>, scale: f64, out: &mut dyn Entries) {
        self.0.add_hessian(at.q, scale, out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::tests::random_elements;
    use nalgebra::{DMatrix, Vector3};
    use vi_core::potential::Midpoint;
    use vi_rigid::{directors, rotation};
    use vi_testkit::Sample;

    fn interval(q0: &[f64], q1: &[f64]) -> Interval {
        let mut s = Interval::new(q0.len());
        s.open(0.0, 0.1, q0);
        s.q1.copy_from_slice(q1);
        s.close_from_end();
        s
    }

    #[test]
    fn slot_derivatives_match_central_differences() {
        let mut sample = Sample::new(21);
        let (elements, q0) = random_elements(&mut sample);
        let q1: Vec<f64> = q0.iter().map(|q| q + 0.3 * sample.number()).collect();
        let U_d = AveragedStrains(elements);
        let at = interval(&q0, &q1);
        let (mut d1, mut d2) = (vec![0.0; 36], vec![0.0; 36]);
        U_d.add_d1(&at, 1.0, &mut d1);
        U_d.add_d2(&at, 1.0, &mut d2);
        let mut mixed = DMatrix::zeros(36, 36);
        U_d.add_d2_d1(&at, 1.0, &mut mixed);
        let mut same = DMatrix::zeros(36, 36);
        U_d.add_d1_d1(&at, 1.0, &mut same);
        let (e, mut worst) = (1e-5, 0.0_f64);
        let moved = |q: &[f64], i: usize, by: f64| {
            let mut q = q.to_vec();
            q[i] += by;
            q
        };
        for j in 0..36 {
            let value = |by| U_d.value(&interval(&moved(&q0, j, by), &q1));
            worst = worst.max(((value(e) - value(-e)) / (2.0 * e) - d1[j]).abs());
            let value = |by| U_d.value(&interval(&q0, &moved(&q1, j, by)));
            worst = worst.max(((value(e) - value(-e)) / (2.0 * e) - d2[j]).abs());
            let slot = |by| {
                let mut out = vec![0.0; 36];
                U_d.add_d1(&interval(&q0, &moved(&q1, j, by)), 1.0, &mut out);
                out
            };
            let (plus, minus) = (slot(e), slot(-e));
            for i in 0..36 {
                worst = worst.max(((plus[i] - minus[i]) / (2.0 * e) - mixed[(i, j)]).abs());
            }
            let slot = |by| {
                let mut out = vec![0.0; 36];
                U_d.add_d1(&interval(&moved(&q0, j, by), &q1), 1.0, &mut out);
                out
            };
            let (plus, minus) = (slot(e), slot(-e));
            for i in 0..36 {
                worst = worst.max(((plus[i] - minus[i]) / (2.0 * e) - same[(i, j)]).abs());
            }
        }
        println!("slot derivatives off by {worst:.1e}");
        assert!(worst < 1e-7, "{worst:e}");
    }

    #[test]
    fn a_rigid_rotation_is_free_of_strain_here_and_not_at_the_midpoint() {
        let mut sample = Sample::new(22);
        let (mut elements, q0) = random_elements(&mut sample);
        let stress_free: Vec<_> = elements.list().to_vec();
        let sections: Vec<_> = stress_free.iter().map(|e| *elements.section(e)).collect();
        elements = Elements::new();
        for (element, section) in stress_free.iter().zip(sections) {
            let section = elements.add_section(section);
            elements.add_stress_free(element.nodes, element.length, section, &q0).unwrap();
        }
        let turn = rotation::exp(&Vector3::new(0.9, -0.4, 0.7));
        let mut q1 = q0.clone();
        for k in 0..3 {
            let own = 12 * k..12 * k + 12;
            let (center, triad) =
                (directors::center(&q0[own.clone()]), directors::triad(&q0[own.clone()]));
            directors::set_frame(&mut q1[own], &(turn * center), &(turn * triad));
        }
        let s = interval(&q0, &q1);
        let (here, there) =
            (AveragedStrains(elements.clone()).value(&s), Midpoint(elements).value(&s));
        println!("energy of a rigid turn: averaged {here:.1e}, midpoint {there:.1e}");
        assert!(here < 1e-28 && there > 1e-3, "{here:e}, {there:e}");
    }
}
