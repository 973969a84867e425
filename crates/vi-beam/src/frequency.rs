//! A bound of the highest frequency of a discretized beam, element by element.
//!
//! ```text
//! ω_max ≤ max_e ω_e,     K_e x = ω_e² M_e x,     K_e, M_e reduced by P_in of the element's own nodes
//! ```
//! Assembly, joints and further masses only lower it. Bounded energy, and the order of a
//! composition, need `h ω_max` of about 1 or less; with more, momentum and symplectic form stay
//! exact, but stiff vibrations are not resolved.
//!
//! Source: theory §6, "Solving"; B. Irons, G. Treharne, Proc. 3rd Conf. Matrix Methods Struct.
//! Mech. (1971).
#![allow(non_snake_case)] // K, M, P, L

use crate::element::{ElementKind, Elements};
use crate::mass_kind::MassKind;
use crate::model::{Beam, BeamElements};
use crate::section::Section;
use nalgebra::DMatrix;
use vi_core::potential::Potential;
use vi_rigid::null_space;

/// The stiffest element of a beam.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stiffest {
    /// Which element of the beam.
    pub element: usize,
    /// `max_e ω_e`, rad/s; infinite where a motion of an element carries no mass.
    pub omega: f64,
}

/// The bound for a beam in its stress-free configuration `q`.
#[must_use]
pub fn highest_frequency(model: &BeamElements, beam: &Beam, q: &[f64]) -> Stiffest {
    let mut frequencies = Frequencies::new(model);
    let mut stiffest = Stiffest::default();
    for (element, index) in beam.elements.clone().enumerate() {
        let omega = frequencies.of(index, q);
        if omega > stiffest.omega || omega.is_nan() {
            stiffest = Stiffest { element, omega };
        }
    }
    stiffest
}

/// `1/ω_e²` of all elements in their initial configuration `q`, s²; zero where a motion carries no
/// mass.
pub(crate) fn slowness(model: &BeamElements, q: &[f64]) -> Vec<f64> {
    let mut frequencies = Frequencies::new(model);
    let mut of = |index: usize| {
        let omega = frequencies.of(index, q);
        if omega.is_nan() { 0.0 } else { (omega * omega).recip() }
    };
    (0..model.elements.list().len()).map(&mut of).collect()
}

/// What the frequency of a straight element depends on.
#[derive(Clone, Copy, PartialEq)]
struct ElementKey {
    length: f64, // m
    section: Section,
    mass: MassKind,
    strains: ElementKind,
}

/// Frequencies of elements, computed once for neighbours of the same kind.
struct Frequencies<'a> {
    model: &'a BeamElements,
    last: Option<(ElementKey, f64)>, // 1/s
}

impl<'a> Frequencies<'a> {
    fn new(model: &'a BeamElements) -> Self {
        Self { model, last: None }
    }

    /// `ω_e`, 1/s, of an element in the configuration `q`.
    fn of(&mut self, index: usize, q: &[f64]) -> f64 {
        let element = &self.model.elements.list()[index];
        let section = *self.model.elements.section(element);
        let (mass, strains) = (element.mass, element.law.kind());
        let kind = ElementKey { length: element.length, section, mass, strains };
        if let Some((last, omega)) = self.last
            && kind == (ElementKey { length: kind.length, ..last })
            && (kind.length - last.length).abs() <= 1e-12 * kind.length
        {
            return omega;
        }
        let omega = element_frequency(&kind, element.coordinates(q).as_slice());
        self.last = Some((kind, omega));
        omega
    }
}

/// `ω_e` of an element that is stress-free where its nodes have the coordinates `q`.
fn element_frequency(kind: &ElementKey, q: &[f64]) -> f64 {
    let n = q.len();
    let (mut K, mut M) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
    let mut alone = Elements::new();
    let section = alone.add_section(kind.section);
    let added = alone.add_stress_free([0, 1], kind.length, section, q);
    if added.and_then(|own| alone.set_strains(own..own + 1, kind.strains, q)).is_err() {
        return f64::NAN;
    }
    alone.set_mass(0..1, kind.mass);
    alone.add_hessian(q, 1.0, &mut K);
    alone.emit_mass(&mut M);
    let mut P = DMatrix::zeros(n, n / 2);
    for node in 0..2 {
        let own = null_space::matrix(&q[12 * node..12 * node + 12]);
        P.view_mut((12 * node, 6 * node), (12, 6)).copy_from(&own);
    }
    let (K, M) = (P.tr_mul(&(K * &P)), P.tr_mul(&(M * &P)));
    let Some(cholesky) = M.cholesky() else { return f64::INFINITY };
    let L = cholesky.l();
    let half = L.solve_lower_triangular(&K).map(|half| half.transpose()); // (L⁻¹K)ᵀ
    let Some(standard) = half.and_then(|half| L.solve_lower_triangular(&half)) else {
        return f64::INFINITY;
    };
    standard.symmetric_eigenvalues().max().max(0.0).sqrt()
}
