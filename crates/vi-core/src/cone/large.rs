//! Many contacts: sweeps over the sparse rows of `W` with conjugate directions. The cost of a sweep
//! is linear in the number of entries.
#![allow(non_snake_case)] // W, A

use super::conjugate::Conjugate;
use super::local;
use super::problem::Cone;
use super::residual::violation;
use super::{ConeFault, ConeReport};
use crate::linear::norm_inf;
use nalgebra::{Matrix3, Vector3};

/// How well the laws hold, relative to the sizes of the terms of their rows.
const TARGET: f64 = 1e-11;
/// Sweeps between two looks at that.
const BETWEEN: usize = 4;
/// Most sweeps forth and back.
const SWEEPS: usize = 4000;

/// A matrix in sparse rows, the places of a row in ascending order.
#[derive(Clone, Copy, Debug)]
pub struct SparseRows<'a> {
    /// Where each row ends, shape `k`.
    pub ends: &'a [usize],
    /// Columns of the entries.
    pub places: &'a [u32],
    /// The entries.
    pub values: &'a [f64],
}

impl SparseRows<'_> {
    fn range(ends: &[usize], i: usize) -> std::ops::Range<usize> {
        i.checked_sub(1).map_or(0, |before| ends[before])..ends[i]
    }
}

/// A contact with its block of `W`.
#[derive(Clone, Copy, Debug)]
struct Contact {
    cone: Cone,
    row: usize,
    block: Matrix3<f64>,
}

/// The solver with its memory, which grows to the largest problem; then nothing is allocated.
#[derive(Clone, Debug, Default)]
pub struct LargeConeSolver {
    contacts: Vec<Contact>,
    units: Vec<f64>, // k
    ends: Vec<usize>,
    places: Vec<u32>,
    values: Vec<f64>,  // W in units
    w: Vec<f64>,       // k
    impulse: Vec<f64>, // k
    conjugate: Conjugate,
}

impl LargeConeSolver {
    /// Finds the impulses of `y = WΛ + w` to `1e-11` of the sizes of the terms.
    ///
    /// `w`, `lambda`: as of [`super::ConeSolver::solve`].
    ///
    /// # Errors
    /// [`ConeFault::NotFinite`], [`ConeFault::NoConvergence`] with the last impulses.
    pub fn solve(
        &mut self,
        cones: &[Cone],
        W: SparseRows<'_>,
        w: &[f64],
        lambda: &mut [f64],
    ) -> Result<ConeReport, ConeFault> {
        if !W.values.iter().chain(w).chain(&*lambda).all(|x| x.is_finite()) {
            return Err(ConeFault::NotFinite);
        }
        self.load(cones, W, w, lambda);
        let outcome = self.iterate();
        for ((lambda, own), unit) in lambda.iter_mut().zip(&self.impulse).zip(&self.units) {
            *lambda = own * unit;
        }
        outcome
    }

    /// Takes the problem over into units in which the largest diagonal of a contact is one.
    fn load(&mut self, cones: &[Cone], W: SparseRows<'_>, w: &[f64], lambda: &[f64]) {
        let entry = |i: usize, j: usize| {
            let own = SparseRows::range(W.ends, i);
            let place = W.places[own.clone()].binary_search(&(j as u32));
            place.map_or(0.0, |place| W.values[own.start + place])
        };
        self.contacts.clear();
        self.units.clear();
        for &cone in cones {
            let (row, rows) = (self.units.len(), cone.rows());
            let diagonal = |i: usize| entry(row + i, row + i);
            let largest = (0..rows).map(diagonal).fold(0.0, f64::max);
            let unit = if largest > 0.0 { 1.0 / largest.sqrt() } else { 1.0 };
            self.units.resize(row + rows, unit);
            let block = Matrix3::from_fn(|i, j| match i.max(j) < rows {
                true => entry(row + i, row + j) * unit * unit,
                false => 0.0,
            });
            self.contacts.push(Contact { cone: cone.in_units(unit), row, block });
        }
        let Self { units, ends, places, values, impulse, .. } = self;
        let copies = [(impulse, lambda, true), (&mut self.w, w, false)];
        for (to, from, is_impulse) in copies {
            to.clear();
            let scaled = from.iter().zip(&*units);
            to.extend(scaled.map(|(x, unit)| if is_impulse { x / unit } else { x * unit }));
        }
        self.conjugate.begin(w.len());
        ends.clear();
        ends.extend_from_slice(W.ends);
        places.clear();
        places.extend_from_slice(W.places);
        values.clear();
        for (i, unit) in units.iter().enumerate() {
            let own = SparseRows::range(W.ends, i);
            let scaled = W.places[own.clone()].iter().zip(&W.values[own]);
            values.extend(scaled.map(|(j, value)| value * unit * units[*j as usize]));
        }
    }

    fn iterate(&mut self) -> Result<ConeReport, ConeFault> {
        let mut residual = self.residual();
        for sweep in 0..SWEEPS {
            if sweep % BETWEEN == 0 {
                if sweep > 0 {
                    residual = self.residual();
                }
                if residual <= TARGET {
                    return Ok(ConeReport { residual, rounds: sweep });
                }
            }
            self.conjugate.before(&self.impulse);
            (0..self.contacts.len()).for_each(|k| self.settle(k));
            (0..self.contacts.len()).rev().for_each(|k| self.settle(k));
            self.conjugate.after(&mut self.impulse);
        }
        // without the last direction the impulses are in their cones
        (0..self.contacts.len()).for_each(|k| self.settle(k));
        let residual = self.residual();
        match residual <= TARGET {
            true => Ok(ConeReport { residual, rounds: SWEEPS }),
            false => Err(ConeFault::NoConvergence { residual, cones: self.contacts.len() }),
        }
    }

    /// `y_i`, and the size of its terms.
    fn velocity(&self, i: usize) -> (f64, f64) {
        let own = SparseRows::range(&self.ends, i);
        let entries = self.places[own.clone()].iter().zip(&self.values[own]);
        let (mut y, mut size) = (self.w[i], self.w[i].abs());
        for (j, value) in entries {
            let term = value * self.impulse[*j as usize];
            y += term;
            size += term.abs();
        }
        (y, size)
    }

    /// Solves the law of a contact at the impulses of the others.
    fn settle(&mut self, contact: usize) {
        let Contact { cone, row, block } = self.contacts[contact];
        let rows = cone.rows();
        let now = Vector3::from_fn(|i, _| if i < rows { self.impulse[row + i] } else { 0.0 });
        let y = Vector3::from_fn(|i, _| if i < rows { self.velocity(row + i).0 } else { 0.0 });
        let next = local::law(cone, (&block, &(y - block * now)), 1.0, &now);
        self.impulse[row..row + rows].copy_from_slice(&next.as_slice()[..rows]);
    }

    /// The largest violation of a law relative to the sizes of the terms of its rows.
    fn residual(&self) -> f64 {
        let mut worst = 0.0_f64;
        for &Contact { cone, row, .. } in &self.contacts {
            let rows = cone.rows();
            let (mut y, mut F, mut size) = ([0.0; 3], [0.0; 3], 0.0_f64);
            for i in 0..rows {
                let (own, terms) = self.velocity(row + i);
                y[i] = own;
                size = size.max(terms + self.impulse[row + i].abs());
            }
            let impulse = &self.impulse[row..row + rows];
            violation(cone, (&y[..rows], impulse), 1.0, &mut F[..rows]);
            let fault = norm_inf(&F[..rows]);
            worst = worst.max(if fault == 0.0 { 0.0 } else { fault / size });
        }
        worst
    }
}
