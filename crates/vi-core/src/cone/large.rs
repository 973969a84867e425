//! Many contacts: Newton's method with sparse factors from the warm start, from other impulses
//! ([`super::restart`]) and from where sweeps with conjugate directions end; where all fail, convex
//! programs in a sequence.
//! The cost of a sweep is linear in the number of entries.
#![allow(non_snake_case)] // W, A

use super::conjugate::Conjugate;
use super::interior::Interior;
use super::local;
use super::operator::Sparse;
use super::problem::{Cone, Placed, Rows};
use super::residual::{LawSlope, violation};
use super::restart::{Restart, Standing, from_elsewhere};
use super::{ConeFault, ConeReport};
use crate::linear::{SparseLu, norm_inf};
use crate::sparse::{Entries, SparseMatrix};
use nalgebra::{Matrix3, Vector3};

/// How well the laws hold, relative to the sizes of the terms of their rows.
const TARGET: f64 = 1e-11;
/// Sweeps between two looks at that.
const BETWEEN: usize = 4;
/// Most sweeps forth and back.
const SWEEPS: usize = 256;
/// Newton's method begins at once, after so many sweeps, and after twice as many again; where the
/// laws hold to `NEARLY`, each time after so many.
const FIRST: usize = 64;
const NEARLY: f64 = 1e-7;
const LOOKS: usize = 16;
/// Its steps: the violation may rise on the way.
const NEWTON_STEPS: usize = 30;
/// Steps in a row that find no smaller violation: they lead nowhere.
const PATIENCE: usize = 10;
/// The same where who asks corrects `w` next.
const SHORT: usize = 3;
/// So often a step is halved, if it makes the violation larger.
const HALVINGS: usize = 10;
/// Convex programs in a sequence.
const PROGRAMS: usize = 20;
/// Added to the diagonal of the derivative: impulses need not be unique. Near a solution, below
/// `CLOSE`, more is added as long as that leads on: rounding errors then do not move impulses along
/// what no law determines.
const SMALL: f64 = 1e-10;
const STEADY: f64 = 1e-5;
const CLOSE: f64 = 1e-6;

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
    /// Where the entries of a row stand.
    pub(super) fn range(&self, i: usize) -> std::ops::Range<usize> {
        range(self.ends, i)
    }
}

fn range(ends: &[usize], i: usize) -> std::ops::Range<usize> {
    i.checked_sub(1).map_or(0, |before| ends[before])..ends[i]
}

/// The solver with its memory, which grows to the largest problem; then nothing is allocated but
/// the factors of Newton's method and of convex programs.
#[derive(Debug, Default)]
pub struct LargeConeSolver {
    cones: Vec<Placed>,
    blocks: Vec<Matrix3<f64>>, // of W, of each cone
    units: Vec<f64>,           // k
    ends: Vec<usize>,
    places: Vec<u32>,
    values: Vec<f64>,  // W in units
    w: Vec<f64>,       // k
    errors: Vec<f64>,  // k  of w; empty: none
    impulse: Vec<f64>, // k
    conjugate: Conjugate,
    interior: Interior<Sparse>,
    F: Vec<f64>,     // k  of the last residual
    regular: f64,    // what is added to the diagonal
    excess: f64,     // the residual beside the errors of w
    step: Vec<f64>,  // k
    from: Vec<f64>,  // k
    best: Vec<f64>,  // k
    swept: Vec<f64>, // k
    ends_beyond: Option<f64>,
    nearest: Vec<f64>, // k
    least: f64,        // the residual of `nearest`
    derivative: Option<SparseMatrix>,
    factors: Option<SparseLu>,
}

impl LargeConeSolver {
    /// As [`super::ConeSolver::end_early`].
    pub fn end_early(&mut self, beyond: Option<f64>) {
        self.ends_beyond = beyond;
    }

    /// Finds the impulses of `y = WΛ + w` to `1e-11` of the sizes of the terms.
    ///
    /// `w` with its `errors`, `lambda`: as of [`super::ConeSolver::solve_within`].
    ///
    /// # Errors
    /// [`ConeFault::NotFinite`], [`ConeFault::NoConvergence`] with the nearest impulses that were
    /// found.
    pub fn solve_within(
        &mut self,
        cones: &[Cone],
        W: SparseRows<'_>,
        (w, errors): (&[f64], &[f64]),
        lambda: &mut [f64],
    ) -> Result<ConeReport, ConeFault> {
        if !W.values.iter().chain(w).chain(errors).chain(&*lambda).all(|x| x.is_finite()) {
            return Err(ConeFault::NotFinite);
        }
        self.load(cones, W, (w, errors), lambda);
        let outcome = self.iterate();
        for ((lambda, own), unit) in lambda.iter_mut().zip(&self.impulse).zip(&self.units) {
            *lambda = own * unit;
        }
        outcome
    }

    /// Takes the problem over into units in which the largest diagonal of a contact is one.
    fn load(
        &mut self,
        cones: &[Cone],
        W: SparseRows<'_>,
        (w, errors): (&[f64], &[f64]),
        lambda: &[f64],
    ) {
        let entry = |i: usize, j: usize| {
            let own = W.range(i);
            let place = W.places[own.clone()].binary_search(&(j as u32));
            place.map_or(0.0, |place| W.values[own.start + place])
        };
        let rows = self.cones.iter().map(|own| own.cone.rows());
        let has_pattern =
            rows.eq(cones.iter().map(Cone::rows)) && self.ends == W.ends && self.places == W.places;
        self.cones.clear();
        self.blocks.clear();
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
            self.blocks.push(block);
            self.cones.push(Placed { cone: cone.in_units(unit), row });
        }
        let Self { units, ends, places, values, impulse, .. } = self;
        let (own_w, own_errors) = (&mut self.w, &mut self.errors);
        let copies = [(impulse, lambda, true), (own_w, w, false), (own_errors, errors, false)];
        for (to, from, is_impulse) in copies {
            to.clear();
            let scaled = from.iter().zip(&*units);
            to.extend(scaled.map(|(x, unit)| if is_impulse { x / unit } else { x * unit }));
        }
        self.conjugate.begin(w.len());
        if !has_pattern {
            (self.derivative, self.factors) = (None, None);
            ends.clear();
            ends.extend_from_slice(W.ends);
            places.clear();
            places.extend_from_slice(W.places);
        }
        values.clear();
        for (i, unit) in units.iter().enumerate() {
            let own = W.range(i);
            let scaled = W.places[own.clone()].iter().zip(&W.values[own]);
            values.extend(scaled.map(|(j, value)| value * unit * units[*j as usize]));
        }
    }

    fn iterate(&mut self) -> Result<ConeReport, ConeFault> {
        let done = |residual, rounds| Ok(ConeReport { residual, rounds });
        let mut residual = self.residual();
        if residual <= TARGET {
            return done(residual, 0);
        }
        self.least = f64::INFINITY;
        self.swept.clone_from(&self.impulse);
        if self.ends_beyond.is_some_and(|beyond| residual > beyond) {
            self.least = residual;
            self.nearest.clone_from(&self.impulse);
            return self.end_nearby();
        }
        residual = self.newton();
        if self.excess <= TARGET {
            return done(residual, 1);
        }
        if self.ends_beyond.is_some() {
            return self.end_nearby();
        }
        self.residual(); // F at the best impulses
        if let Some((residual, starts)) = from_elsewhere(self) {
            return done(residual, 1 + starts);
        }
        self.impulse.clone_from(&self.swept);
        for sweep in 1..=SWEEPS {
            self.conjugate.before(&self.impulse);
            self.sweep();
            (0..self.cones.len()).rev().for_each(|k| self.settle(k));
            self.conjugate.after(&mut self.impulse);
            if sweep % BETWEEN == 0 {
                residual = self.residual();
            }
            let is_near = residual <= NEARLY && sweep % LOOKS == 0;
            if is_near || sweep >= FIRST && sweep.is_power_of_two() {
                self.swept.clone_from(&self.impulse);
                self.sweep(); // without the last direction the impulses are in their cones
                residual = self.newton();
                if self.excess <= TARGET {
                    return done(residual, 1 + sweep);
                }
                self.impulse.clone_from(&self.swept);
            }
            if residual <= TARGET {
                return done(residual, 1 + sweep);
            }
        }
        let mut interior = std::mem::take(&mut self.interior);
        let solved = self.by_programs(&mut interior);
        self.interior = interior;
        match solved {
            Some(solved) => Ok(solved),
            None => self.end_nearby(),
        }
    }

    /// The nearest impulses that were found.
    fn end_nearby(&mut self) -> Result<ConeReport, ConeFault> {
        self.impulse.clone_from(&self.nearest);
        Err(ConeFault::NoConvergence { residual: self.least, cones: self.cones.len() })
    }

    /// Convex programs in a sequence, each followed by Newton's method.
    fn by_programs(&mut self, interior: &mut Interior<Sparse>) -> Option<ConeReport> {
        interior.begin(self);
        for program in 1..=PROGRAMS {
            let part = if program > PROGRAMS / 2 { 0.5 } else { 1.0 };
            let impulse = interior.advance(self, part);
            self.impulse.copy_from_slice(impulse);
            let residual = self.newton();
            if self.excess <= TARGET {
                return Some(ConeReport { residual, rounds: 1 + SWEEPS + program });
            }
        }
        None
    }

    fn sweep(&mut self) {
        (0..self.cones.len()).for_each(|k| self.settle(k));
    }

    /// Newton's method from the present impulses; keeps the best point and returns its residual.
    fn newton(&mut self) -> f64 {
        let mut now = self.residual();
        let (mut least, mut excess, mut slow) = (now, self.excess, false);
        self.best.clone_from(&self.impulse);
        let (mut leads, mut idle) = (true, 0); // of steady steps
        for _ in 0..NEWTON_STEPS {
            let patience = if self.ends_beyond.is_some() { SHORT } else { PATIENCE };
            if least <= TARGET || excess <= TARGET && slow || idle == patience {
                break;
            }
            let is_steady = now <= CLOSE && leads;
            self.regular = if is_steady { STEADY } else { SMALL };
            if !self.find_step() {
                break;
            }
            self.from.clone_from(&self.impulse);
            let (last, mut part) = (now, 1.0);
            for _ in 0..HALVINGS {
                let moves = self.from.iter().zip(&self.step);
                let to = self.impulse.iter_mut().zip(moves);
                to.for_each(|(impulse, (from, step))| *impulse = from - part * step);
                now = self.residual();
                if now < last {
                    break;
                }
                part *= 0.5;
            }
            slow = now > 0.5 * least;
            leads &= !(is_steady && slow);
            idle += 1;
            // within the errors of w impulses stay where steps do not lead on
            if now < least && !(slow && excess <= TARGET) {
                idle = 0;
                (least, excess) = (now, self.excess);
                self.best.clone_from(&self.impulse);
            }
        }
        self.impulse.clone_from(&self.best);
        self.excess = excess;
        if least < self.least {
            self.least = least;
            self.nearest.clone_from(&self.best);
        }
        least
    }

    /// The step of Newton's method at the present impulses, where there is one.
    fn find_step(&mut self) -> bool {
        let k = self.w.len();
        let mut derivative = self.derivative.take();
        let matrix = SparseMatrix::update(&mut derivative, (k, k), |out| self.derivative(out));
        if self.factors.is_none() {
            self.factors = SparseLu::new(matrix).ok();
        }
        self.step.clone_from(&self.F);
        let solved = self.factors.as_mut().and_then(|own| own.solve(matrix, &mut self.step).ok());
        self.derivative = derivative;
        solved.is_some()
    }

    /// Emits `∂F/∂Λ` at the present impulses.
    fn derivative(&self, out: &mut dyn Entries) {
        for &Placed { cone, row } in &self.cones {
            let rows = cone.rows();
            let mut y = [0.0; 3];
            (0..rows).for_each(|i| y[i] = self.velocity(row + i).0);
            let slope = LawSlope::at(cone, (&y[..rows], &self.impulse[row..row + rows]), 1.0);
            for l in 0..rows {
                let unit = std::array::from_fn(|i| f64::from(u8::from(i == l)));
                let [of_y, own] = [slope.change(unit, [0.0; 3]), slope.change([0.0; 3], unit)];
                let entries = range(&self.ends, row + l);
                for i in 0..rows {
                    let places = self.places[entries.clone()].iter();
                    for (j, value) in places.zip(&self.values[entries.clone()]) {
                        out.add(row + i, *j as usize, of_y[i] * value);
                    }
                    let regular = if i == l { self.regular } else { 0.0 };
                    out.add(row + i, row + l, own[i] + regular);
                }
            }
        }
    }

    /// `y_i`, and the size of its terms.
    fn velocity(&self, i: usize) -> (f64, f64) {
        self.velocity_of(i, &self.impulse)
    }

    fn velocity_of(&self, i: usize, impulse: &[f64]) -> (f64, f64) {
        let own = range(&self.ends, i);
        let entries = self.places[own.clone()].iter().zip(&self.values[own]);
        let (mut y, mut size) = (self.w[i], self.w[i].abs());
        for (j, value) in entries {
            let term = value * impulse[*j as usize];
            y += term;
            size += term.abs();
        }
        (y, size)
    }

    /// Solves the law of a contact at the impulses of the others.
    fn settle(&mut self, contact: usize) {
        let (Placed { cone, row }, block) = (self.cones[contact], self.blocks[contact]);
        let rows = cone.rows();
        let now = Vector3::from_fn(|i, _| if i < rows { self.impulse[row + i] } else { 0.0 });
        let y = Vector3::from_fn(|i, _| if i < rows { self.velocity(row + i).0 } else { 0.0 });
        let next = local::law(cone, (&block, &(y - block * now)), 1.0, &now);
        self.impulse[row..row + rows].copy_from_slice(&next.as_slice()[..rows]);
    }

    /// The largest violation of a law relative to the sizes of the terms of its rows.
    fn residual(&mut self) -> f64 {
        let (mut worst, mut excess) = (0.0_f64, 0.0_f64);
        let mut all = std::mem::take(&mut self.F);
        all.resize(self.w.len(), 0.0);
        for &Placed { cone, row } in &self.cones {
            let rows = cone.rows();
            let (mut y, mut F, mut size) = ([0.0; 3], [0.0; 3], 0.0_f64);
            for i in 0..rows {
                let (own, terms) = self.velocity(row + i);
                y[i] = own;
                size = size.max(terms + self.impulse[row + i].abs());
            }
            let impulse = &self.impulse[row..row + rows];
            violation(cone, (&y[..rows], impulse), 1.0, &mut F[..rows]);
            all[row..row + rows].copy_from_slice(&F[..rows]);
            let fault = norm_inf(&F[..rows]);
            worst = norm_inf(&[worst, if fault == 0.0 { 0.0 } else { fault / size }]);
            let error = self.errors.get(row..row + rows).map_or(0.0, norm_inf);
            excess = norm_inf(&[excess, if fault <= error { 0.0 } else { (fault - error) / size }]);
        }
        (self.F, self.excess) = (all, excess);
        worst
    }
}

impl Restart for LargeConeSolver {
    fn standing(&mut self) -> Standing<'_> {
        let Self { cones, swept: warm, F, impulse, .. } = self;
        Standing { cones, warm, F, impulse }
    }

    fn attempt(&mut self) -> Option<f64> {
        let residual = self.newton();
        let solved = self.excess <= TARGET;
        self.residual(); // F at the best impulses
        solved.then_some(residual)
    }
}

impl Rows for LargeConeSolver {
    fn cones(&self) -> &[Placed] {
        &self.cones
    }

    fn w(&self) -> &[f64] {
        &self.w
    }

    fn for_each_entry(&self, visit: &mut dyn FnMut(usize, usize, f64)) {
        for i in 0..self.w.len() {
            let own = range(&self.ends, i);
            let entries = self.places[own.clone()].iter().zip(&self.values[own]);
            entries.for_each(|(j, value)| visit(i, *j as usize, *value));
        }
    }

    fn velocity(&self, i: usize, impulse: &[f64]) -> f64 {
        self.velocity_of(i, impulse).0
    }
}
