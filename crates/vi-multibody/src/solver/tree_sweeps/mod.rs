//! The sweeps of the Galerkin scheme on a tree, at all control points at once.
//!
//! Numbers of control points stand side by side ([`vi_core::lanes`]): place 0 holds control point
//! `s`, places `1 … s−1` the points between. The rows `i = 0 … s−1` of [2.28] have the same places;
//! only at place 0 they belong to another configuration, `q_n`.
//! ```text
//! root → leaf   q_j = F_d(u_j, q_n)                                                     [`advance`]
//! leaf → root   w_i [2.26] of each body, b = P_inᵀ w_i + Σ Xᵀ b,  r_i = Sᵀ b            [`pull_back`]
//!               ρ_j = h Σ_i (K̂⁻¹)_ji r_i
//! leaf → root   P(q_j)ᵀ M P(q_j) ν_j = ρ_j,   δu_j = T_j⁻¹ ν_j                          [`Factors`]
//! ```
//! The formulas stand in `crate::sweep`, as those of all trees of bodies. What is computed of a
//! motion are its increments from `q_n`, never differences of configurations. `X, S` of the rows
//! are those of the present configurations, the factors keep their own.
#![allow(non_snake_case)] // K

mod factors;
mod lane;
mod step;
mod weights;

use crate::geometry::control_points::{PointRegisters, Points};
use crate::geometry::matrix::Columns;
use crate::geometry::members::LanesVector;
use crate::geometry::one_tree::three;
use crate::geometry::space::Space;
use crate::mechanism::Mechanism;
use crate::sweep::advance::{Turn, advance, check_rotations};
use crate::sweep::columns::Motion;
use crate::sweep::link::{self, ColumnWork, Link, Work};
use crate::sweep::open::open_joints;
use crate::sweep::place::{balance, change};
use crate::sweep::pull_back::pull_back;
use crate::tree::Tree;
use factors::Factors;
use vi_constraints::galerkin::control_points;
use vi_core::galerkin::{GaussLobatto, Stages};
use vi_core::lanes::{Lanes, Register};
use vi_core::newton::{Fault, UnknownBlock};
use vi_core::state::State;
use vi_core::{MechanicalSystem, SeparableSystem};
use vi_rigid::rotation::MAX_ROTATION;
use weights::{SchemeWeights, control_point};

/// [`vi_constraints::galerkin::Sweeps`] of a tree of bodies, `O(N)`.
#[derive(Debug)]
pub struct TreeSweeps<T: Register> {
    space: PointRegisters<T>,
    stages: usize,
    tree: Tree,
    blocks: Vec<UnknownBlock>,
    links: Vec<Link<Points<T::Lanes>>>,
    weights: SchemeWeights<T::Lanes>,
    constant: bool,                             // the force
    force: Vec<f64>,                            // n  the constant one
    start: Vec<f64>,                            // n  q_n
    works: Vec<Work<Points<T::Lanes>>>,         // from q_n to the control points
    columns: Vec<ColumnWork<Points<T::Lanes>>>, // d  of joints of several columns, else empty
    turns: Vec<Turn<T::Lanes>>,                 // d
    dq: Vec<T::Lanes>,                          // n  Δ_j
    base: Vec<T::Lanes>,                        // n  w_i without the momenta of the increments
    factors: Factors<T>,
    q0: Vec<T::Lanes>,    // n  q_n
    error: Vec<T::Lanes>, // n  its rounding error
    q: Vec<T::Lanes>,     // n  q_j
    u: Vec<T::Lanes>,     // d
    r: Vec<T::Lanes>,     // d
    x: Vec<T::Lanes>,     // d  corrections
}

impl<T: Register> TreeSweeps<T> {
    /// For a tree of bodies; `None` where a pair, or the mass of a body, is of another kind, or
    /// `lanes` are too few.
    #[must_use]
    pub fn new(
        lanes: T,
        mechanism: &Mechanism,
        system: &SeparableSystem,
        stages: Stages,
    ) -> Option<Self> {
        let (s, space, tree) = (stages.count(), PointRegisters(lanes), mechanism.tree());
        if s > T::Lanes::COUNT {
            return None;
        }
        let (links, _) = link::constants(mechanism, system)?;
        let links: Vec<Link<_>> =
            links.iter().map(|own| own.with_constants(|of| of(own))).collect();
        let (n, d, zero) = (system.dim(), tree.dof(), lanes.splat(0.0));
        let several = links.iter().any(|link| matches!(link.motion, Motion::Several(_)));
        let columns = if several { d } else { 0 };
        Some(Self {
            space,
            stages: s,
            tree: tree.clone(),
            blocks: tree.blocks(),
            weights: SchemeWeights::new(lanes, &GaussLobatto::new(stages), &[], 0.0),
            constant: false,
            force: vec![0.0; n],
            start: vec![0.0; n],
            works: vec![Work::zero(space); links.len()],
            columns: vec![ColumnWork::zero(space); columns],
            turns: vec![Turn::by(space, zero); d],
            dq: vec![zero; n],
            base: vec![zero; n],
            factors: Factors::new(space, &links, columns),
            q0: vec![zero; n],
            error: vec![zero; n],
            q: vec![zero; n],
            u: vec![zero; d],
            r: vec![zero; d],
            x: vec![zero; d],
            links,
        })
    }

    /// Reads the unknowns of all control points.
    fn read(&mut self, u: &[f64]) {
        let (d, s) = (self.u.len(), self.stages);
        for (k, own) in self.u.iter_mut().enumerate() {
            *own = self.space.0.gather(
                #[inline(always)]
                |place| if place < s { u[(control_point(place, s) - 1) * d + k] } else { 0.0 },
            );
        }
    }

    /// Refuses what is no number, and rotations of more than half a revolution.
    #[cold]
    fn refuse(&self, u: &[f64]) -> Result<(), Fault> {
        if u.iter().any(|u| !u.is_finite()) {
            return Err(Fault::NotFinite);
        }
        for link in &self.links {
            for place in 0..self.stages {
                let u = |k: usize| self.u[link.unknown + k].at(place);
                check_rotations(link.motion, link.unknown, u)?;
            }
        }
        Ok(())
    }

    /// Everything at `q_n`.
    #[inline(always)]
    fn open_at(&mut self, state: &State) {
        let Self { space, links, works, columns, start, q0, error, .. } = self;
        start.copy_from_slice(&state.q);
        for i in 0..start.len() {
            q0[i] = space.number(state.q[i]);
            error[i] = space.number(state.compensation.q[i]);
        }
        open_joints(*space, links, works, columns, q0);
    }

    /// Root → leaf: increments of the control points; whether all are in the chart.
    #[inline(always)]
    fn advance(&mut self) -> bool {
        let Self { space: s, links, works, columns, turns, start, dq, u, .. } = self;
        let seen = advance(*s, links, works, (columns, turns), u, None);
        for (link, work) in links.iter().zip(works) {
            let d = directors(*s, start, link.frame);
            let anchor = d.mul(s.constant(&link.anchor));
            s.write_frame(change(*s, work, &d, anchor), dq, link.frame);
        }
        seen.rotation.are_at_most(MAX_ROTATION * MAX_ROTATION) && seen.finite.are_at_most(0.0)
    }

    /// Factors at the control points.
    #[inline(always)]
    fn move_factors(&mut self) {
        let Self { links, factors, q0, dq, q, .. } = self;
        for ((q, q0), dq) in q.iter_mut().zip(q0).zip(dq) {
            *q = *q0 + *dq;
        }
        factors.move_to(links, q);
    }

    /// Leaf → root: residuals.
    #[inline(always)]
    fn balance(&mut self) {
        let Self { space: s, links, weights, works, columns, start, dq, base, r, .. } = self;
        for (k, link) in links.iter().enumerate() {
            let (work, m) = (&mut works[k], &weights.masses[k]);
            let (delta, mut w) = (s.read_frame(dq, link.frame), s.read_frame(base, link.frame));
            let mixed = [
                weights.mix(&delta[0]),
                weights.mix(&delta[1]),
                weights.mix(&delta[2]),
                weights.mix(&delta[3]),
            ];
            // w_i  [2.26]
            for i in 0..4 {
                if link.is_diagonal {
                    w[i] = w[i] + mixed[i] * m[i][i];
                } else {
                    for j in 0..4 {
                        w[i] = w[i] + mixed[j] * m[i][j];
                    }
                }
            }
            let at = directors(*s, start, link.frame);
            let d = Columns(three!(i => at.0[i] + at_rows(delta[i + 1])));
            work.wrench = balance(&d, d.mul(s.constant(&link.anchor)), w).held();
            work.lever_next = with_first(work.lever_next, work.lever);
            let column = &mut work.column;
            column.axis_next = with_first(column.axis_next, column.axis);
        }
        for column in columns.iter_mut() {
            column.axis_next = with_first(column.axis_next, column.axis);
        }
        pull_back(*s, links, works, columns, r);
    }

    /// Residuals, `r_i ← P(q_i)ᵀ w_i`.
    pub(in crate::solver) fn write_balances(&mut self, r: &mut [f64]) {
        self.space.0.run(
            #[inline(always)]
            || self.balance(),
        );
        for (i, r) in r.chunks_exact_mut(self.r.len()).enumerate() {
            r.iter_mut().zip(&self.r).for_each(|(r, all)| *r = all.at(i));
        }
    }

    /// `p ← p̄_{n+1} = w_s`.
    pub(in crate::solver) fn write_momenta(
        &self,
        points: &control_points::ControlPoints,
        p: &mut [f64],
    ) {
        let Self { links, weights, dq, force, constant, .. } = self;
        for (k, link) in links.iter().enumerate() {
            let own = link.frame..link.frame + 12;
            let mut mixed = [0.0; 12];
            for (mixed, dq) in mixed.iter_mut().zip(&dq[own.clone()]) {
                *mixed = weights.last.iter().enumerate().map(|(l, K)| K * dq.at(l)).sum();
            }
            for (i, at) in own.enumerate() {
                let force = |k: usize| if *constant { force[at] } else { points.force(k)[at] };
                let weighed = weights.of_last.iter().enumerate();
                let impulse: f64 = weighed.map(|(k, weight)| weight * force(k)).sum();
                let momentum: f64 =
                    (0..4).map(|v| weights.masses[k][i / 3][v] * mixed[3 * v + i % 3]).sum();
                p[at] = impulse + momentum; // [2.29]
            }
        }
    }

    /// Corrections of all control points.
    pub(in crate::solver) fn write_corrections(&self, du: &mut [f64]) {
        let (d, s) = (self.x.len(), self.stages);
        for place in 0..s {
            let j = control_point(place, s);
            for (du, x) in du[(j - 1) * d..j * d].iter_mut().zip(&self.x) {
                *du = x.at(place);
            }
        }
    }

    /// Corrections.
    #[inline(always)]
    fn correct(&mut self) -> Result<(), Fault> {
        let Self { links, weights, factors, u, r, x, .. } = self;
        for (x, r) in x.iter_mut().zip(r) {
            *x = weights.solve(*r);
        }
        factors.solve(links, u, x)
    }

    /// `w_i` without momenta of increments: `δ_i0 p̄_n` and the impulses of forces, for each vector
    /// of each frame.
    #[inline(always)]
    fn add_impulses(&mut self, points: &control_points::ControlPoints) {
        let Self { space, weights, base, force, constant, .. } = self;
        for (at, (base, p)) in base.iter_mut().zip(points.momentum()).enumerate() {
            let mut sum = space.number(0.0).with_first(*p);
            if *constant {
                sum = sum + weights.total * force[at];
            } else {
                for k in 0..weights.force.len() {
                    sum = sum + weights.force[k] * points.force(k)[at];
                }
            }
            *base = sum;
        }
    }
}

/// The directors of the frame that begins at a coordinate, in all lanes.
#[inline(always)]
fn directors<S: Space>(s: S, q: &[f64], first: usize) -> Columns<S::Vector> {
    let q = &q[first + 3..first + 12];
    Columns(three!(i => s.vector([q[3 * i], q[3 * i + 1], q[3 * i + 2]])))
}

/// The increment of control points as that of rows: none of the first.
#[inline(always)]
fn at_rows<L: Lanes>(delta: LanesVector<L>) -> LanesVector<L> {
    delta.with_first(&[0.0; 3])
}

/// At the control points, and in the first lane as at the start.
#[inline(always)]
fn with_first<L: Lanes>(end: LanesVector<L>, start: LanesVector<L>) -> LanesVector<L> {
    end.with_first(&three!(i => start.0[i].at(0)))
}
