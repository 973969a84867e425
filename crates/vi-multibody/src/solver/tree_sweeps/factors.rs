//! `P(q_j)ᵀ M P(q_j)` at all control points, factorized at some configurations.
//!
//! The tree stands still at each control point: its matrix is that of a step `u = 0` from there.

use crate::geometry::control_points::{PointRegisters, Points};
use crate::geometry::matrix::Columns;
use crate::sweep::eliminate::{EliminatedRotation, UpToApex, eliminate};
use crate::sweep::link::{ColumnWork, Gain, Link, Sums, Work};
use crate::sweep::open::open_at_rest;
use crate::sweep::right_side::eliminate_side;
use crate::sweep::substitute::substitute;
use std::ops::Range;
use vi_core::lanes::{Lanes, Register};
use vi_core::newton::Fault;

/// The links where they were factorized.
#[derive(Debug)]
pub(super) struct Factors<T: Register> {
    pub(super) space: PointRegisters<T>,
    pub(super) works: Vec<Work<Points<T::Lanes>>>,
    pub(super) columns: Vec<ColumnWork<Points<T::Lanes>>>, // d  of joints of several, else none
    pub(super) gains: Vec<Gain<Points<T::Lanes>>>,
    pub(super) sums: Vec<Sums<Points<T::Lanes>>>,
    pub(super) part: UpToApex<Points<T::Lanes>>,
    outdated: bool,
}

impl<T: Register> Factors<T> {
    /// For links with `columns` of joints of several.
    pub(super) fn new(
        space: PointRegisters<T>,
        links: &[Link<Points<T::Lanes>>],
        columns: usize,
    ) -> Self {
        let slots = links.iter().filter(|link| link.slot.is_some()).count();
        let mut part = UpToApex::new(space);
        part.rotations = vec![EliminatedRotation::zero(space); links.len()];
        Self {
            space,
            works: vec![Work::zero(space); links.len()],
            columns: vec![ColumnWork::zero(space); columns],
            gains: vec![Columns::zero(space).held(); links.len()],
            sums: vec![Sums::zero(space); slots],
            part,
            outdated: true,
        }
    }

    /// Takes up `q_j`; the next right-hand side is eliminated with the matrix.
    #[inline(always)]
    pub(super) fn move_to(&mut self, links: &[Link<Points<T::Lanes>>], q: &[T::Lanes]) {
        open_at_rest(self.space, links, &mut self.works, &mut self.columns, q);
        self.outdated = true;
    }

    /// `x ← δu_j` of the right-hand sides `x`, at the increments `u`.
    #[inline(always)]
    pub(super) fn solve(
        &mut self,
        links: &[Link<Points<T::Lanes>>],
        u: &[T::Lanes],
        x: &mut [T::Lanes],
    ) -> Result<(), Fault> {
        if self.outdated {
            self.eliminate(links, 0..links.len(), x)?;
            self.outdated = false;
        } else {
            let Self { space, works, columns, gains, part, .. } = self;
            eliminate_side(*space, links, works, (columns, gains, &part.rotations), x);
        }
        self.substitute(links, 0..links.len(), u, x);
        Ok(())
    }

    /// Eliminates a range of links with the right-hand sides `x`.
    #[inline(always)]
    pub(super) fn eliminate(
        &mut self,
        links: &[Link<Points<T::Lanes>>],
        range: Range<usize>,
        x: &mut [T::Lanes],
    ) -> Result<(), Fault> {
        let Self { space, works, columns, gains, sums, part, .. } = self;
        part.links = range;
        let pivots = eliminate(*space, links, works, (columns, gains), (sums, &[], part), x);
        if pivots.are_at_most(0.0) { Ok(()) } else { Err(Fault::SingularTangent) }
    }

    /// Substitutes a range of links at the increments `u`.
    #[inline(always)]
    pub(super) fn substitute(
        &mut self,
        links: &[Link<Points<T::Lanes>>],
        range: Range<usize>,
        u: &[T::Lanes],
        x: &mut [T::Lanes],
    ) {
        let Self { space, works, columns, gains, .. } = self;
        substitute(*space, (links, range), works, (columns, gains), u, x);
    }
}
