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

use crate::element::ElementKind;
use crate::elements::Elements;
use crate::mass_kind::MassKind;
use crate::model::{Beam, BeamElements};
use crate::section::Section;
use crate::strain::ElementCoordinates;
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
pub(crate) struct Frequencies<'a> {
    model: &'a BeamElements,
    last: Option<(ElementKey, usize, f64)>, // which element, 1/s
}

impl<'a> Frequencies<'a> {
    pub(crate) fn new(model: &'a BeamElements) -> Self {
        Self { model, last: None }
    }

    /// `ω_e`, 1/s, of an element in the configuration `q`.
    fn of(&mut self, index: usize, q: &[f64]) -> f64 {
        self.known(index, q).1
    }

    /// The same with the element of which it was computed.
    fn known(&mut self, index: usize, q: &[f64]) -> (usize, f64) {
        let kind = self.key(index);
        if let Some((last, first, omega)) = self.last
            && kind == (ElementKey { length: kind.length, ..last })
            && (kind.length - last.length).abs() <= 1e-12 * kind.length
        {
            return (first, omega);
        }
        let element = &self.model.elements.list()[index];
        let omega = element_frequency(&kind, element.coordinates(q).as_slice());
        self.last = Some((kind, index, omega));
        (index, omega)
    }

    fn key(&self, index: usize) -> ElementKey {
        let element = &self.model.elements.list()[index];
        let section = *self.model.elements.section(element);
        let (mass, strains) = (element.mass, element.law.kind());
        ElementKey { length: element.length, section, mass, strains }
    }

    /// The highest vibrations of an element in the configuration `q`, and the element of which they
    /// are; `None` where a motion carries no mass.
    pub(crate) fn highest(&mut self, index: usize, q: &[f64]) -> Option<(Highest, usize)> {
        let (first, _) = self.known(index, q);
        let x = self.model.elements.list()[first].coordinates(q);
        let Standard { P, L, matrix } = Standard::of(&self.key(first), x.as_slice()).ok()?;
        let eigen = matrix.symmetric_eigen();
        let vectors = P * L.transpose().solve_upper_triangular(&eigen.eigenvectors)?;
        let modes = (0..vectors.ncols()).map(|k| {
            let mode = ElementCoordinates::from_column_slice(vectors.column(k).as_slice());
            (eigen.eigenvalues[k], mode)
        });
        let square = eigen.eigenvalues.max();
        Some((Highest { square, modes: modes.collect() }, first))
    }
}

/// The vibrations of an element.
pub(crate) struct Highest {
    /// `ω²` of the highest, 1/s².
    pub(crate) square: f64,
    modes: Vec<(f64, ElementCoordinates)>, // ω², x with xᵀMx = 1
}

impl Highest {
    /// Those whose `ω²` is the highest but for a part of it.
    pub(crate) fn together(&self, part: f64) -> Vec<ElementCoordinates> {
        let highest = self.modes.iter().filter(|(own, _)| *own >= (1.0 - part) * self.square);
        highest.map(|(_, mode)| *mode).collect()
    }
}

/// `L⁻¹KL⁻ᵀ` of an element, `M = LLᵀ`, reduced by `P_in` of its nodes.
struct Standard {
    P: DMatrix<f64>,
    L: DMatrix<f64>,
    matrix: DMatrix<f64>,
}

impl Standard {
    /// Of an element that is stress-free where its nodes have the coordinates `q`.
    ///
    /// # Errors
    /// What its frequency is instead: infinite, or not a number where there is no such element.
    fn of(kind: &ElementKey, q: &[f64]) -> Result<Self, f64> {
        let n = q.len();
        let (mut K, mut M) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
        let mut alone = Elements::new();
        let section = alone.add_section(kind.section);
        let added = alone.add_stress_free([0, 1], kind.length, section, q);
        let set = added.and_then(|own| alone.set_strains(own..own + 1, kind.strains, q));
        set.map_err(|_| f64::NAN)?;
        alone.set_mass(0..1, kind.mass);
        alone.add_hessian(q, 1.0, &mut K);
        alone.emit_mass(&mut M);
        let mut P = DMatrix::zeros(n, n / 2);
        for node in 0..2 {
            let own = null_space::matrix(&q[12 * node..12 * node + 12]);
            P.view_mut((12 * node, 6 * node), (12, 6)).copy_from(&own);
        }
        let (K, M) = (P.tr_mul(&(K * &P)), P.tr_mul(&(M * &P)));
        let L = M.cholesky().ok_or(f64::INFINITY)?.l();
        let half = L.solve_lower_triangular(&K).map(|half| half.transpose()); // (L⁻¹K)ᵀ
        let matrix = half.and_then(|half| L.solve_lower_triangular(&half));
        Ok(Self { matrix: matrix.ok_or(f64::INFINITY)?, P, L })
    }
}

/// `ω_e` of an element that is stress-free where its nodes have the coordinates `q`.
fn element_frequency(kind: &ElementKey, q: &[f64]) -> f64 {
    match Standard::of(kind, q) {
        Ok(own) => own.matrix.symmetric_eigenvalues().max().max(0.0).sqrt(),
        Err(omega) => omega,
    }
}
