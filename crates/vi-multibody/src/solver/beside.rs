//! Bodies beside point masses: the operators of the ones and of the others, side by side.
//!
//! ```text
//! q = (q_b, q_p),   F_d = (F_d^b(u_b, q_b), F_d^p(u_p, q_p)),   P = diag(P_b, P_p)
//! Pᵀ K ∂F_d/∂u = diag(A_b, A_p)         where K couples no body with a point mass
//! ```
//! Bars join point masses to one another and to the ground, joints and scalar constraints act on
//! bodies, so no constraint couples the two. Where no potential does either, each takes a
//! correction of its own, by the operators that it would have alone: a point mass beside a
//! mechanism costs what it costs by itself.
#![allow(non_snake_case)] // K

use crate::mechanism::Mechanism;
use std::ops::Range;
use std::sync::Arc;
use vi_constraints::node_solvers::RateOperators;
use vi_constraints::reparametrization::{Emission, LastStep};
use vi_constraints::{Constraints, NodalOperators};
use vi_core::Configuration;
use vi_core::interval::Interval;
use vi_core::newton::{Fault, Precision, UnknownBlock, largest_rotation};
use vi_core::predictor::Degree;
use vi_core::sparse::{Entries, OuterProduct};
use vi_core::state::Memory;

/// Which coordinates and unknowns belong to the bodies, or to the point masses.
#[derive(Clone, Debug)]
pub(in crate::solver) struct Subsystem {
    /// The mechanism of these members alone.
    pub(in crate::solver) mechanism: Arc<Mechanism>,
    q: Range<usize>,
    u: Range<usize>,
}

/// Bodies, then point masses; `None` for a mechanism that has not both.
pub(in crate::solver) fn shares(mechanism: &Mechanism) -> Option<[Subsystem; 2]> {
    let [bodies, points] = mechanism.bodies_and_points()?;
    let split = (bodies.dim(), mechanism.tree().dof());
    let end = (mechanism.dim(), split.1 + mechanism.particle_tree().dof());
    let share = |mechanism, q, u| Subsystem { mechanism: Arc::new(mechanism), q, u };
    Some([share(bodies, 0..split.0, 0..split.1), share(points, split.0..end.0, split.1..end.1)])
}

/// Whether a matrix over the coordinates couples bodies with point masses.
pub(in crate::solver) fn couples(mechanism: &Mechanism, matrix: &Emission<'_>) -> bool {
    struct Crossing {
        first: usize, // coordinate of a point mass
        met: bool,
    }
    impl Entries for Crossing {
        fn add(&mut self, row: usize, column: usize, _value: f64) {
            self.met |= (row < self.first) != (column < self.first);
        }
        fn add_along(&mut self, _j: usize, _value: f64) -> bool {
            true
        }
    }
    let mut found = Crossing { first: 12 * mechanism.description().bodies.len(), met: false };
    matrix(&mut found);
    found.met
}

impl Subsystem {
    /// Its part of what is emitted over the coordinates of all members.
    pub(in crate::solver) fn emit(&self, matrix: &Emission<'_>, into: &mut dyn Entries) {
        let Self { q, u, .. } = self;
        matrix(&mut OwnEntries { into, q: q.clone(), u: u.clone() });
    }

    /// Its coordinates.
    pub(in crate::solver) fn of<'a>(&self, q: &'a [f64]) -> &'a [f64] {
        &q[self.q.clone()]
    }
}

/// Receives the entries between some coordinates, numbered from the first of them on.
struct OwnEntries<'a> {
    into: &'a mut dyn Entries,
    q: Range<usize>,
    u: Range<usize>,
}

impl OwnEntries<'_> {
    fn place(&self, row: usize, column: usize) -> Option<(usize, usize)> {
        let own = self.q.contains(&row) && self.q.contains(&column);
        own.then(|| (row - self.q.start, column - self.q.start))
    }
}

impl Entries for OwnEntries<'_> {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        if let Some((i, j)) = self.place(row, column) {
            self.into.add(i, j, value);
        }
    }

    fn add_multiple(&mut self, row: usize, column: usize, value: f64) {
        if let Some((i, j)) = self.place(row, column) {
            self.into.add_multiple(i, j, value);
        }
    }

    fn add_block(&mut self, row: usize, column: usize, block: &nalgebra::Matrix3<f64>) {
        if let Some((i, j)) = self.place(row, column) {
            self.into.add_block(i, j, block);
        }
    }

    /// What acts along an unknown of the others is taken: none of its entries follow.
    fn add_along(&mut self, j: usize, value: f64) -> bool {
        !self.u.contains(&j) || self.into.add_along(j - self.u.start, value)
    }

    /// Between frames, whose coordinates come first.
    fn add_outer(&mut self, product: &OuterProduct<'_>) {
        if self.q.start == 0 {
            self.into.add_outer(product);
        }
    }

    fn reduces_at(&self, starts: &[usize], at: [&[f64]; 2]) -> bool {
        self.q.start == 0 && self.into.reduces_at(starts, at)
    }

    fn add_reduced(&mut self, product: &OuterProduct<'_>) {
        self.into.add_reduced(product);
    }
}

/// [`NodalOperators`] of bodies and point masses side by side.
#[derive(Debug)]
pub(super) struct SideBySide<O: ?Sized> {
    parts: [OwnOperators<O>; 2],
    blocks: Vec<UnknownBlock>,
}

/// The bodies, or the point masses.
struct OwnOperators<O: ?Sized> {
    share: Subsystem,
    s: Interval,    // its step
    last: Interval, // and the one before it, for the reduced scheme
    operators: Box<O>,
}

impl<O: ?Sized> std::fmt::Debug for OwnOperators<O> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("OwnOperators").field("share", &self.share).finish_non_exhaustive()
    }
}

impl<O: NodalOperators + ?Sized> SideBySide<O> {
    /// Of the operators of each share.
    pub(in crate::solver) fn new(shares: [Subsystem; 2], operators: [Box<O>; 2]) -> Self {
        let (mut blocks, mut first) = (Vec::new(), 0);
        let mut of_all = shares.into_iter().zip(operators);
        let parts = std::array::from_fn(|_| {
            let (mut share, operators) = of_all.next().expect("two of each");
            // those of loops of bars are fewer than those of their tree
            share.u = first..first + operators.dof();
            first = share.u.end;
            blocks.extend(operators.blocks().iter().cloned().map(|mut block| {
                let (start, end) = (block.range.start, block.range.end);
                block.range = share.u.start + start..share.u.start + end;
                block
            }));
            let [s, last] = [0, 1].map(|_| Interval::new(share.q.len()));
            OwnOperators { share, s, last, operators }
        });
        Self { parts, blocks }
    }
}

impl<O: NodalOperators + ?Sized> NodalOperators for SideBySide<O> {
    fn dof(&self) -> usize {
        self.parts.iter().map(|part| part.operators.dof()).sum()
    }

    fn blocks(&self) -> &[UnknownBlock] {
        &self.blocks
    }

    fn take_momentum(&mut self, p: &[f64], h: f64) {
        for OwnOperators { share, operators, .. } in &mut self.parts {
            operators.take_momentum(share.of(p), h);
        }
    }

    /// The bodies find their numbers first in the memory, point masses at its end.
    fn begin(&mut self, s: &Interval, memory: &Memory, last: Option<LastStep<'_>>) {
        for OwnOperators { share, s: own, last: own_last, operators } in &mut self.parts {
            own.take_part(s, share.q.start);
            let last = last.map(|LastStep { u, s }| {
                own_last.take_part(s, share.q.start);
                LastStep { u: &u[share.u.clone()], s: &*own_last }
            });
            operators.begin(own, memory, last);
        }
    }

    fn remember(&self, memory: &mut Memory) {
        self.parts.iter().for_each(|part| part.operators.remember(memory));
    }

    fn reparametrize(&mut self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        for OwnOperators { share, s: own, operators, .. } in &mut self.parts {
            operators.reparametrize(&u[share.u.clone()], own)?;
            own.write_part(share.q.start, s);
        }
        Ok(())
    }

    fn pull_back(&mut self, w: &[f64], out: &mut [f64]) {
        for OwnOperators { share, operators, .. } in &mut self.parts {
            operators.pull_back(share.of(w), &mut out[share.u.clone()]);
        }
    }

    fn close(&mut self, r: &mut [f64]) {
        self.parts.iter_mut().for_each(|part| part.operators.close(&mut r[part.share.u.clone()]));
    }

    fn carry_balance(&self, r: &mut [f64]) {
        for OwnOperators { share, operators, .. } in &self.parts {
            operators.carry_balance(&mut r[share.u.clone()]);
        }
    }

    fn take_balance(&mut self, r: &mut [f64]) {
        for OwnOperators { share, operators, .. } in &mut self.parts {
            operators.take_balance(&mut r[share.u.clone()]);
        }
    }

    fn solve(
        &mut self,
        mixed: &Emission<'_>,
        u: &[f64],
        _s: &Interval,
        x: &mut [f64],
    ) -> Result<(), Fault> {
        for OwnOperators { share, s, operators, .. } in &mut self.parts {
            let own = |out: &mut dyn Entries| share.emit(mixed, out);
            operators.solve(&own, &u[share.u.clone()], s, &mut x[share.u.clone()])?;
        }
        Ok(())
    }

    fn clean(&mut self, t: f64, q: &mut [f64]) {
        self.parts
            .iter_mut()
            .for_each(|part| part.operators.clean(t, &mut q[part.share.q.clone()]));
    }

    /// That of the least exact part.
    fn precision(&self) -> Precision {
        let mut all = Precision::of_balances();
        all.closing_size = f64::INFINITY;
        for part in &self.parts {
            let own = part.operators.precision();
            all.noise = all.noise.max(own.noise);
            all.closing_size = all.closing_size.min(own.closing_size);
            if own.degree != Degree::Fitting {
                all.degree = own.degree;
            }
        }
        all
    }

    fn forget_factors(&mut self) {
        self.parts.iter_mut().for_each(|part| part.operators.forget_factors());
    }

    fn rotation(&self, u: &[f64]) -> f64 {
        largest_rotation(&self.blocks, u)
    }
}

impl<O: RateOperators + ?Sized> RateOperators for SideBySide<O> {
    fn stand(&mut self, s: &mut Interval, memory: &Memory, rest: &[f64]) -> Result<(), Fault> {
        for OwnOperators { share, s: own, operators, .. } in &mut self.parts {
            own.take_part(s, share.q.start);
            operators.stand(own, memory, &rest[share.u.clone()])?;
        }
        Ok(())
    }

    fn close_rates(&mut self, at: Configuration<'_>, r: &mut [f64]) {
        for OwnOperators { share, operators, .. } in &mut self.parts {
            let own = Configuration { q: &at.q[share.q.clone()], ..at };
            operators.close_rates(own, &mut r[share.u.clone()]);
        }
    }

    fn push_forward(&mut self, nu: &[f64], v: &mut [f64]) {
        for OwnOperators { share, operators, .. } in &mut self.parts {
            operators.push_forward(&nu[share.u.clone()], &mut v[share.q.clone()]);
        }
    }
}
