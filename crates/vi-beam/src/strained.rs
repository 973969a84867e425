//! What is strained and damped: an element with its section.
#![allow(non_snake_case)] // K

use crate::element::Element;
use crate::elements::Elements;
use crate::section::Section;
use crate::strain::Strain;
use nalgebra::Matrix6;
use vi_core::interval::{Interval, Slot};
use vi_core::sparse::Entries;

/// An element with its section.
pub(crate) struct Strained<'a> {
    pub(crate) element: &'a Element,
    pub(crate) section: &'a Section,
}

impl Elements {
    /// All elements with their sections.
    pub(crate) fn strained(&self) -> impl Iterator<Item = Strained<'_>> {
        self.list().iter().map(|element| Strained { element, section: self.section(element) })
    }
}

impl Strained<'_> {
    /// `ℓ C`, N·m.
    pub(crate) fn stiffness(&self) -> Matrix6<f64> {
        self.element.length * *self.element.stiffness(self.section)
    }

    /// `ℓ V`, N·m·s.
    pub(crate) fn viscosity(&self) -> Matrix6<f64> {
        self.element.length * self.element.viscosity(self.section)
    }

    /// Whether the section has damping.
    pub(crate) fn is_damped(&self) -> bool {
        self.section.is_damped()
    }

    /// `ε(q)`.
    pub(crate) fn strain(&self, q: &[f64]) -> Strain {
        self.element.strain(&self.element.coordinates(q))
    }

    /// `∇ε_i·v`.
    pub(crate) fn strain_rate(&self, q: &[f64], v: &[f64]) -> Strain {
        self.element.within(q).rate(&self.element.coordinates(v))
    }

    /// `Δε` of a step in which it is the element `index`.
    pub(crate) fn change(&self, s: &Interval, index: usize) -> Strain {
        let [start, end] = self.element.strains_of(s, index);
        end - start
    }

    /// `out ← out + Σ n_i ∇ε_i` at an end of such a step.
    pub(crate) fn add_at(&self, s: &Interval, index: usize, of: Slot, n: &Strain, out: &mut [f64]) {
        match of {
            Slot::First => self.element.at_start(s, index).scatter(n, out),
            Slot::Second => self.element.at_end(s, index).scatter(n, out),
        }
    }

    /// Emits `Σ c_ij ∇ε_i ∇ε_jᵀ` of such a step, the first gradients those of one end, the second
    /// those of the other.
    pub(crate) fn emit_between(
        &self,
        s: &Interval,
        index: usize,
        of: Slot,
        c: &Matrix6<f64>,
        out: &mut dyn Entries,
    ) {
        let end = self.element.at_end(s, index);
        match of {
            Slot::First => self.element.at_start(s, index).emit_outer(&end, c, out),
            Slot::Second => end.emit_outer(&self.element.within(&s.q0), c, out),
        }
    }

    /// `out ← out + Σ n_i ∇ε_i`.
    pub(crate) fn add(&self, q: &[f64], n: &Strain, out: &mut [f64]) {
        self.element.within(q).scatter(n, out);
    }

    /// The entries of `Σ n_i ∇ε_i`, always in the same order.
    pub(crate) fn for_each(&self, q: &[f64], n: &Strain, mut visit: impl FnMut(usize, f64)) {
        let force = self.element.within(q).force(n);
        force.iter().enumerate().for_each(|(row, f)| visit(self.element.place(row), *f));
    }

    /// Emits `Σ c_ij ∇ε_i ∇ε_jᵀ + Σ n_i ∇²ε_i`.
    pub(crate) fn emit(&self, q: &[f64], c: &Matrix6<f64>, n: &Strain, out: &mut dyn Entries) {
        self.element.within(q).emit_tangent(c, n, out);
    }

    /// Emits `Σ c_ij ∇ε_i (∇²ε_j v)ᵀ + Σ n_i ∇²ε_i`.
    pub(crate) fn emit_rates(
        &self,
        [q, v]: [&[f64]; 2],
        c: &Matrix6<f64>,
        n: &Strain,
        out: &mut dyn Entries,
    ) {
        let K = self.element.within(q).tangent_of_rates(&self.element.coordinates(v), c, n);
        self.element.emit(&K, out);
    }

    /// Emits `Σ c_ij ∇ε_i(a) ∇ε_j(b)ᵀ`.
    pub(crate) fn emit_outer(&self, a: &[f64], b: &[f64], c: &Matrix6<f64>, out: &mut dyn Entries) {
        self.element.within(a).emit_outer(&self.element.within(b), c, out);
    }
}
