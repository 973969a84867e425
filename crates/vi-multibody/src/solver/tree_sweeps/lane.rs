//! One control point of a tree that is swept in lanes, as the loops on top of it see it.
#![allow(non_snake_case)] // SA

use super::TreeSweeps;
use super::factors::Factors;
use super::weights::control_point;
use crate::geometry::control_points::Points;
use crate::geometry::matrix::{Columns, Screw, Spatial};
use crate::geometry::members::LanesVector;
use crate::geometry::one_tree::{HeldVector, One, three};
use crate::geometry::space::{Space, Vector as _};
use crate::pair::Twist;
use crate::solver::tree_step::space::SPACE;
use crate::solver::tree_step::workspace::Workspace;
use crate::sweep::columns::Motion;
use crate::sweep::finish::{StepEnds, close};
use crate::sweep::link::{ColumnWork, Sums};
use std::ops::Range;
use vi_constraints::galerkin::control_points::ControlPoints;
use vi_core::lanes::{Lanes, Register};
use vi_core::newton::Fault;

/// A vector in one lane.
fn held<L: Lanes>(v: &LanesVector<L>, lane: usize) -> HeldVector {
    SPACE.vector(three!(i => v.0[i].at(lane))).held()
}

fn screw<L: Lanes>(s: &Screw<LanesVector<L>>, lane: usize) -> Screw<HeldVector> {
    Screw { linear: held(&s.linear, lane), angular: held(&s.angular, lane) }
}

fn columns<L: Lanes>(m: &Columns<LanesVector<L>>, lane: usize) -> Columns<HeldVector> {
    Columns(three!(j => held(&m.0[j], lane)))
}

fn put<L: Lanes>(v: &mut LanesVector<L>, lane: usize, x: &HeldVector) {
    v.0.iter_mut().zip(x.xyz()).for_each(|(all, x)| all.set(lane, x));
}

fn put_columns<L: Lanes>(m: &mut Columns<LanesVector<L>>, lane: usize, x: &Columns<HeldVector>) {
    for j in 0..3 {
        put(&mut m.0[j], lane, &x.0[j]);
    }
}

/// The axis of a column, at both ends of a motion that stays where it is.
fn write_axis<L: Lanes>(from: &ColumnWork<Points<L>>, lane: usize, to: &mut ColumnWork<One>) {
    to.axis = held(&from.axis, lane);
    to.axis_next = to.axis;
}

impl<T: Register> TreeSweeps<T> {
    /// Writes the configurations of the control points.
    pub(in crate::solver) fn write_points(&mut self, points: &mut ControlPoints) {
        let Self { space, links, works, q0, error, q, dq, weights, .. } = self;
        space.0.run(
            #[inline(always)]
            || {
                let ends =
                    StepEnds { h: weights.h, q0, compensation: error, q1: q, dq, middle: None };
                close(*space, links, works, ends);
            },
        );
        for place in 0..self.stages {
            let point = points.point_mut(control_point(place, self.stages));
            point.q1.iter_mut().zip(&self.q).for_each(|(own, q)| *own = q.at(place));
            point.dq.iter_mut().zip(&self.dq).for_each(|(own, dq)| *own = dq.at(place));
        }
    }

    /// Moves the factors to the control points.
    pub(in crate::solver) fn stand(&mut self) {
        let Self { space, links, factors, q, .. } = self;
        space.0.run(
            #[inline(always)]
            || factors.move_to(links, q),
        );
    }

    /// Writes the axes and levers of the factors at a control point.
    pub(in crate::solver) fn write_joints(&self, j: usize, at: &mut Workspace) {
        let (lane, Factors { works, columns, .. }) = (j % self.stages, &self.factors);
        for (from, to) in works.iter().zip(&mut at.works) {
            to.lever = held(&from.lever, lane);
            to.lever_next = to.lever;
            write_axis(&from.column, lane, &mut to.column);
        }
        columns.iter().zip(&mut at.columns).for_each(|(from, to)| write_axis(from, lane, to));
    }

    /// Takes residuals as right-hand sides: `ρ_j = h Σ_i (K̂⁻¹)_ji r_i`.
    pub(in crate::solver) fn take_sides(&mut self, r: &[f64]) {
        let Self { space, weights, r: all, x, stages, .. } = self;
        let d = all.len();
        space.0.run(
            #[inline(always)]
            || {
                for (k, (all, x)) in all.iter_mut().zip(x).enumerate() {
                    *all = space.0.gather(
                        #[inline(always)]
                        |i| if i < *stages { r[i * d + k] } else { 0.0 },
                    );
                    *x = weights.solve(*all);
                }
            },
        );
    }

    /// Unknown `k` of the right-hand side, or of the solution, at a control point.
    pub(in crate::solver) fn side(&self, j: usize, k: usize) -> f64 {
        self.x[k].at(j % self.stages)
    }

    /// Writes it.
    pub(in crate::solver) fn put_side(&mut self, j: usize, k: usize, value: f64) {
        self.x[k].set(j % self.stages, value);
    }
}

/// Sweeps of the linear system, some links at a time.
impl<T: Register> TreeSweeps<T> {
    /// Prepares for closed loops that hang on the links `apexes`.
    pub(in crate::solver) fn carry_loops(&mut self, apexes: impl Iterator<Item = usize>) {
        let Self { links, factors: Factors { space, sums, part, .. }, .. } = self;
        part.carry(*space, links, sums, apexes);
    }

    /// Before the sweeps of a linear system: nothing hangs on any link.
    pub(in crate::solver) fn release_links(&mut self) {
        let Factors { space, sums, part, .. } = &mut self.factors;
        part.release(*space, sums);
    }

    /// Eliminates a range of links.
    pub(in crate::solver) fn eliminate(&mut self, range: Range<usize>) -> Result<(), Fault> {
        let Self { links, factors, x, .. } = self;
        factors.space.0.run(
            #[inline(always)]
            || factors.eliminate(links, range, x),
        )
    }

    /// Substitutes a range of links.
    pub(in crate::solver) fn substitute(&mut self, range: Range<usize>) {
        let Self { links, factors, u, x, .. } = self;
        factors.space.0.run(
            #[inline(always)]
            || factors.substitute(links, range, u, x),
        );
    }

    /// Writes what the elimination of a range of links has left at a control point.
    pub(in crate::solver) fn write_factors(
        &self,
        range: Range<usize>,
        j: usize,
        at: &mut Workspace,
    ) {
        let (lane, own) = (j % self.stages, &self.factors);
        for k in range {
            let first = self.links[k].unknown;
            match self.links[k].motion {
                Motion::Fixed => {}
                Motion::Along(_) => {
                    let force = write_column(&own.works[k].column, lane, &mut at.works[k].column);
                    at.part.forces[first] = force;
                }
                Motion::Several(several) => {
                    for unknown in first..first + several.len() {
                        let column = &own.columns[unknown];
                        at.part.forces[unknown] =
                            write_column(column, lane, &mut at.columns[unknown]);
                    }
                }
                Motion::Spherical | Motion::Free => {
                    at.gains[k] = columns(&own.gains[k], lane);
                    let Some(to) = at.part.rotations.get_mut(k) else { continue };
                    let from = &own.part.rotations[k];
                    to.inverse = columns(&from.inverse, lane);
                    to.coupling = columns(&from.coupling, lane);
                    to.translation = columns(&from.translation, lane);
                }
            }
        }
    }

    /// Changes the sums of link `k` over what hangs on it at a control point.
    pub(in crate::solver) fn change_sums(
        &mut self,
        k: usize,
        j: usize,
        change: impl FnOnce(&mut Sums<One>),
    ) {
        let lane = j % self.stages;
        let Some(slot) = self.links[k].slot else { return };
        let Sums { matrix: Spatial { ll, la, al, aa }, wrench } = &mut self.factors.sums[slot];
        let matrix = Spatial {
            ll: columns(ll, lane),
            la: columns(la, lane),
            al: columns(al, lane),
            aa: columns(aa, lane),
        };
        let mut own = Sums { matrix, wrench: screw(wrench, lane) };
        change(&mut own);
        put_columns(ll, lane, &own.matrix.ll);
        put_columns(la, lane, &own.matrix.la);
        put_columns(al, lane, &own.matrix.al);
        put_columns(aa, lane, &own.matrix.aa);
        put(&mut wrench.linear, lane, &own.wrench.linear);
        put(&mut wrench.angular, lane, &own.wrench.angular);
    }

    /// `δt'` of link `k` at a control point after the substitution.
    pub(in crate::solver) fn twist(&self, k: usize, j: usize) -> Twist {
        let twist = screw(&self.factors.works[k].twist, j % self.stages);
        Twist::new(twist.linear.xyz().into(), twist.angular.xyz().into())
    }
}

/// The factors of a column; returns `Ã S' = (Sᵀ Ã)ᵀ`.
fn write_column<L: Lanes>(
    from: &ColumnWork<Points<L>>,
    lane: usize,
    to: &mut ColumnWork<One>,
) -> Screw<HeldVector> {
    to.SA = screw(&from.SA, lane);
    to.inverse = from.inverse.at(lane);
    to.SA
}
