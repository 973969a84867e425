//! What is strained: elements with two nodes and Gauss points behind one interface.
#![allow(non_snake_case)] // K

use crate::element::Element;
use crate::section::Section;
use crate::strain::Strain;
use vi_core::sparse::Entries;

/// What is strained: a two-node element, or a Gauss point of one of higher order.
pub(crate) trait Strained {
    /// `ℓ C_i`, N·m.
    fn stiffness(&self) -> Strain;
    /// `ℓ C_i τ_i`, N·m·s.
    fn viscosity(&self) -> Strain;
    /// Whether the section has damping.
    fn is_damped(&self) -> bool;
    /// `ε(q)`.
    fn strain(&self, q: &[f64]) -> Strain;
    /// `(𝔹_i q)·v`.
    fn strain_rate(&self, q: &[f64], v: &[f64]) -> Strain;
    /// `out ← out + Σ n_i 𝔹_i q`.
    fn add(&self, q: &[f64], n: &Strain, out: &mut [f64]);
    /// Emits `Σ c_i (𝔹_i a)(𝔹_i b)ᵀ + Σ n_i 𝔹_i`.
    fn emit(&self, a: &[f64], b: &[f64], c: &Strain, n: &Strain, out: &mut dyn Entries);
    /// Emits `Σ c_i (𝔹_i a)(𝔹_i b)ᵀ`.
    fn emit_outer(&self, a: &[f64], b: &[f64], c: &Strain, out: &mut dyn Entries);
}

/// A two-node element with its section.
pub(crate) struct TwoNode<'a> {
    pub(crate) element: &'a Element,
    pub(crate) section: &'a Section,
}

impl Strained for TwoNode<'_> {
    fn stiffness(&self) -> Strain {
        self.element.length * Strain::from(*self.section.stiffness())
    }

    fn viscosity(&self) -> Strain {
        self.element.length * self.section.viscosity()
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

    fn emit(&self, a: &[f64], b: &[f64], c: &Strain, n: &Strain, out: &mut dyn Entries) {
        let element = self.element;
        let K = element.product(&element.coordinates(a), &element.coordinates(b), c, n);
        element.emit(&K, out);
    }

    fn emit_outer(&self, a: &[f64], b: &[f64], c: &Strain, out: &mut dyn Entries) {
        let element = self.element;
        element.emit_outer(&element.coordinates(a), &element.coordinates(b), c, out);
    }
}
