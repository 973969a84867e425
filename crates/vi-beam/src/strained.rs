//! What is strained: elements with two nodes and Gauss points behind one interface.
#![allow(non_snake_case)] // K

use crate::element::Element;
use crate::section::Section;
use crate::strain::Strain;
use nalgebra::Matrix6;
use vi_core::sparse::Entries;

/// What is strained: a two-node element, or a Gauss point of one of higher order.
pub(crate) trait Strained {
    /// `ℓ C`, N·m.
    fn stiffness(&self) -> Matrix6<f64>;
    /// `ℓ V`, N·m·s.
    fn viscosity(&self) -> Matrix6<f64>;
    /// Whether the section has damping.
    fn is_damped(&self) -> bool;
    /// `ε(q)`.
    fn strain(&self, q: &[f64]) -> Strain;
    /// `∇ε_i·v`.
    fn strain_rate(&self, q: &[f64], v: &[f64]) -> Strain;
    /// `out ← out + Σ n_i ∇ε_i`.
    fn add(&self, q: &[f64], n: &Strain, out: &mut [f64]);
    /// Emits `Σ c_ij ∇ε_i ∇ε_jᵀ + Σ n_i ∇²ε_i`.
    fn emit(&self, q: &[f64], c: &Matrix6<f64>, n: &Strain, out: &mut dyn Entries);
    /// Emits `Σ c_ij ∇ε_i (∇²ε_j v)ᵀ + Σ n_i ∇²ε_i`.
    fn emit_rates(&self, qv: [&[f64]; 2], c: &Matrix6<f64>, n: &Strain, out: &mut dyn Entries);
    /// Emits `Σ c_ij ∇ε_i(a) ∇ε_j(b)ᵀ`.
    fn emit_outer(&self, a: &[f64], b: &[f64], c: &Matrix6<f64>, out: &mut dyn Entries);
}

/// A two-node element with its section.
pub(crate) struct TwoNode<'a> {
    pub(crate) element: &'a Element,
    pub(crate) section: &'a Section,
}

impl Strained for TwoNode<'_> {
    fn stiffness(&self) -> Matrix6<f64> {
        self.element.length * self.element.stiffness(self.section)
    }

    fn viscosity(&self) -> Matrix6<f64> {
        self.element.length * self.element.viscosity(self.section)
    }

    fn is_damped(&self) -> bool {
        self.section.is_damped()
    }

    fn strain(&self, q: &[f64]) -> Strain {
        self.element.strain(&self.element.coordinates(q))
    }

    fn strain_rate(&self, q: &[f64], v: &[f64]) -> Strain {
        let element = self.element;
        element.gradients(&element.coordinates(q)).tr_mul(&element.coordinates(v))
    }

    fn add(&self, q: &[f64], n: &Strain, out: &mut [f64]) {
        let element = self.element;
        element.scatter(&element.force(&element.coordinates(q), n), out);
    }

    fn emit(&self, q: &[f64], c: &Matrix6<f64>, n: &Strain, out: &mut dyn Entries) {
        let element = self.element;
        element.emit(&element.tangent(&element.coordinates(q), c, n), out);
    }

    fn emit_rates(&self, [q, v]: [&[f64]; 2], c: &Matrix6<f64>, n: &Strain, out: &mut dyn Entries) {
        let element = self.element;
        let K = element.tangent_of_rates([q, v].map(|q| element.coordinates(q)), c, n);
        element.emit(&K, out);
    }

    fn emit_outer(&self, a: &[f64], b: &[f64], c: &Matrix6<f64>, out: &mut dyn Entries) {
        let element = self.element;
        element.emit_outer(&element.coordinates(a), &element.coordinates(b), c, out);
    }
}
