//! A step of as many members as there are lanes.

use super::history::LaneHistory;
use super::link::{self, ColumnWork, Link, MOST, Work};
use crate::geometry::lane_spatial::{Columns, Spatial};
use crate::geometry::lane_vectors::Screw;
use crate::solver::tree_step::link::Constants;
use crate::tree::Tree;
use vi_core::lanes::{Lanes, Register};
use vi_core::newton::{Block, BlockKind, CLOSING_SIZE, Convergence, Limits, NewtonSettings};
use vi_rigid::rotation::MAX_ROTATION;

/// What a lane is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Lane {
    /// It is corrected by Newton's method.
    Running,
    /// Its step is solved.
    Solved,
    /// Newton's method does not find its step from the extrapolated increments.
    Refused,
    /// Its member does not move.
    Idle,
}

/// State and work of the members of a group; everything in lanes.
#[derive(Debug)]
pub(super) struct Kernel<T: Register> {
    pub(super) lanes: T,
    pub(super) links: Vec<Link<T::Lanes>>,
    pub(super) works: Vec<Work<T::Lanes>>,
    pub(super) columns: Vec<ColumnWork<T::Lanes>>, // d
    pub(super) gains: Vec<Columns<T::Lanes>>,
    pub(super) sums: Vec<(Spatial<T::Lanes>, Screw<T::Lanes>)>, // of the children of each link
    pub(super) weight: Vec<T::Lanes>,                           // n  constant forces
    pub(super) q: Vec<T::Lanes>,                                // n
    pub(super) p: Vec<T::Lanes>,                                // n
    pub(super) compensation: Vec<T::Lanes>,                     // n
    pub(super) balance: Vec<T::Lanes>,                          // d  residual of the last balance
    pub(super) history: LaneHistory<T>,
    pub(super) q1: Vec<T::Lanes>,     // n
    pub(super) end: Vec<T::Lanes>,    // n  q_{n+1} as the step computed it
    pub(super) dq: Vec<T::Lanes>,     // n
    pub(super) u: Vec<T::Lanes>,      // d
    pub(super) r: Vec<T::Lanes>,      // d
    pub(super) x: Vec<T::Lanes>,      // d
    pub(super) floors: Vec<T::Lanes>, // of the blocks
    pub(super) blocks: Vec<Block>,
    pub(super) marked: Vec<u8>, // lanes whose link has lost round-off, a bit each
    pub(super) scratch: Vec<f64>, // n
    start: [Vec<T::Lanes>; 4],  // of a composition: q, p, compensation, balance
    pub(super) what: [Lane; MOST],
}

impl<T: Register> Kernel<T> {
    /// For members of these constants and constant forces, as many as there are lanes, and a
    /// composition of `sub_steps`.
    pub(super) fn new(
        lanes: T,
        (members, weights): (&[&[Constants]], &[Vec<f64>]),
        tree: &Tree,
        sub_steps: usize,
    ) -> Option<Self> {
        let links = link::links(lanes, members)?;
        let (n, d, count) = (weights[0].len(), tree.dof(), links.len());
        let (zero, blocks) = (lanes.splat(0.0), tree.blocks());
        let sum = (Spatial::zero(lanes), Screw::zero(lanes));
        Some(Self {
            lanes,
            works: vec![Work::zero(lanes); count],
            columns: vec![ColumnWork::zero(lanes); d],
            gains: vec![Columns::zero(lanes); count],
            sums: vec![sum; count],
            weight: (0..n).map(|i| lanes.gather(|k| weights[k][i])).collect(),
            q: vec![zero; n],
            p: vec![zero; n],
            compensation: vec![zero; n],
            balance: vec![zero; d],
            history: LaneHistory::new(lanes, d, sub_steps),
            q1: vec![zero; n],
            end: vec![zero; n],
            dq: vec![zero; n],
            u: vec![zero; d],
            r: vec![zero; d],
            x: vec![zero; d],
            floors: vec![zero; blocks.len()],
            blocks,
            marked: vec![0; count],
            scratch: vec![0.0; n],
            start: [n, n, n, d].map(|size| vec![zero; if sub_steps > 1 { size } else { 0 }]),
            what: [Lane::Idle; MOST],
            links,
        })
    }

    /// Keeps the node where a composition starts.
    pub(super) fn keep_start(&mut self) {
        let Self { q, p, compensation, balance, start, .. } = self;
        for (start, own) in start.iter_mut().zip([q, p, compensation, balance]) {
            start.copy_from_slice(own);
        }
    }

    /// Moves a lane back to where its composition has started; its increments are forgotten.
    pub(super) fn return_to_start(&mut self, lane: usize) {
        let Self { lanes, q, p, compensation, balance, start, history, .. } = self;
        for (start, own) in start.iter().zip([q, p, compensation, balance]) {
            for (own, start) in own.iter_mut().zip(start) {
                let others = *own;
                *own = lanes.gather(|k| if k == lane { start.at(k) } else { others.at(k) });
            }
        }
        history.forget(lane);
    }

    /// The largest velocity of a centre of mass along an axis, m/s.
    pub(super) fn fastest(&self) -> T::Lanes {
        self.lanes.run(
            #[inline(always)]
            || self.largest_velocity(),
        )
    }

    #[inline(always)]
    fn largest_velocity(&self) -> T::Lanes {
        let zero = self.lanes.splat(0.0);
        let mut fastest = zero;
        for link in &self.links {
            for p in &self.p[link.frame..link.frame + 3] {
                let mass = link.mass[0][0];
                let speed = mass.if_at_most(zero, zero, p.over(mass));
                fastest = fastest.larger(speed).larger(zero - speed);
            }
        }
        fastest
    }

    /// Solves sub-step `index` of length `h`; lanes that are not idle are then solved or refused.
    pub(super) fn solve(&mut self, index: usize, h: f64, settings: &NewtonSettings) {
        let (lanes, count) = (self.lanes, T::Lanes::COUNT);
        self.history.weigh();
        lanes.run(
            #[inline(always)]
            || {
                self.history.predict(index, &mut self.u);
                self.open(h);
            },
        );
        for lane in 0..count {
            if self.what[lane] != Lane::Idle {
                let known = self.history.knows(index, lane, h);
                self.what[lane] = if known { Lane::Running } else { Lane::Refused };
            }
        }
        let residual = self.evaluate(h);
        let mut seen: [Convergence; MOST] =
            std::array::from_fn(|k| Convergence::new(if k < count { residual.at(k) } else { 0.0 }));
        for iteration in 1..=settings.max_iterations {
            if !self.what[..count].contains(&Lane::Running) {
                return;
            }
            let (size, resolved) = lanes.run(
                #[inline(always)]
                || self.correct(h),
            );
            let residual = self.evaluate(h);
            for lane in 0..count {
                if self.what[lane] != Lane::Running {
                    continue;
                }
                let (size, next) = (size.at(lane), residual.at(lane));
                let limits = Limits {
                    tolerance: settings.tolerance.max(0.25 * f64::EPSILON),
                    noise: 1e-9,
                    closing_size: CLOSING_SIZE,
                    least_ratio: 0.0,
                };
                let reached = seen[lane].judge(size, next, limits).is_reached;
                if !(size.is_finite() && next.is_finite()) {
                    self.what[lane] = Lane::Refused;
                } else if reached || resolved.at(lane) <= 0.0 {
                    self.what[lane] = Lane::Solved;
                } else if iteration == settings.max_iterations {
                    self.what[lane] = Lane::Refused;
                }
            }
        }
    }

    /// Residuals at `u`, and the largest entry of each lane; lanes that turn too far are refused.
    fn evaluate(&mut self, h: f64) -> T::Lanes {
        let lanes = self.lanes;
        let (residual, turned) = lanes.run(
            #[inline(always)]
            || {
                self.advance(h);
                self.pull_back();
                let (zero, mut residual) = (self.lanes.splat(0.0), self.lanes.splat(0.0));
                let mut sum = zero; // not finite where an entry is not
                for (r, error) in self.r.iter_mut().zip(&self.balance) {
                    *r = *r + *error;
                    residual = residual.larger(*r).larger(zero - *r);
                    sum = sum + *r * 0.0;
                }
                (residual + sum, self.largest_turn())
            },
        );
        for lane in 0..T::Lanes::COUNT {
            let is_in_chart = turned.at(lane) <= MAX_ROTATION * MAX_ROTATION;
            if self.what[lane] == Lane::Running && !is_in_chart {
                self.what[lane] = Lane::Refused;
            }
        }
        residual
    }

    /// Square of the largest rotation among the increments.
    #[inline(always)]
    fn largest_turn(&self) -> T::Lanes {
        let mut largest = self.lanes.splat(0.0);
        for block in self.blocks.iter().filter(|block| block.kind == BlockKind::Rotation) {
            let mut square = self.lanes.splat(0.0);
            for u in &self.u[block.range.clone()] {
                square = square + *u * *u;
            }
            largest = largest.larger(square);
        }
        largest
    }

    /// A correction of the lanes that run: its relative size, and what is left of it above
    /// rounding.
    #[inline(always)]
    fn correct(&mut self, h: f64) -> (T::Lanes, T::Lanes) {
        for (x, r) in self.x.iter_mut().zip(&self.r) {
            *x = *r * -h;
        }
        self.eliminate();
        let turn = self.substitute();
        let Self { lanes, x, u, blocks, floors, what, .. } = self;
        if what[..T::Lanes::COUNT].iter().any(|what| *what != Lane::Running) {
            let (runs, zero) =
                (lanes.gather(|k| f64::from(what[k] == Lane::Running)), lanes.splat(0.0));
            for x in x.iter_mut() {
                *x = lanes.splat(1.0).if_at_most(runs, *x, zero);
            }
        }
        let zero = lanes.splat(0.0);
        let (mut size, mut sum) = (zero, zero);
        let mut kinds = [(zero, zero); 2]; // largest correction and scale of each kind
        for (block, floor) in blocks.iter().zip(floors.iter()) {
            let (mut scale, mut correction) = (*floor, zero);
            for i in block.range.clone() {
                scale = scale.larger(u[i]).larger(zero - u[i]);
                correction = correction.larger(x[i]).larger(zero - x[i]);
                sum = sum + x[i] * 0.0; // not finite where a correction is not
                u[i] = u[i] - x[i];
            }
            size = size.larger(correction.over(scale));
            let kind = &mut kinds[usize::from(block.kind == BlockKind::Rotation)];
            *kind = (kind.0.larger(correction), kind.1.larger(scale));
        }
        let left = |(correction, scale): (T::Lanes, T::Lanes)| {
            let (turn, rounding) = (turn, 0.25 * f64::EPSILON);
            lanes.gather(
                #[inline(always)]
                |k| turn.at(k).sqrt() * correction.at(k) - rounding * scale.at(k),
            )
        };
        (size + sum, left(kinds[0]).larger(left(kinds[1])))
    }

    /// Moves all lanes to the end of the sub-step that was solved.
    pub(super) fn end(&mut self, index: usize, h: f64, trees: &[Tree]) {
        let lanes = self.lanes;
        self.history.remember(index, h, &self.u);
        lanes.run(
            #[inline(always)]
            || {
                self.close();
                self.end.copy_from_slice(&self.q1);
                self.glance();
            },
        );
        self.clean(trees);
        lanes.run(
            #[inline(always)]
            || {
                self.write_momenta(h);
                self.pull_back();
                for (balance, r) in self.balance.iter_mut().zip(&self.r) {
                    *balance = *balance + *r;
                }
                self.move_to_end();
            },
        );
    }
}
