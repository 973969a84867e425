//! A step of as many members as there are lanes.

use super::acting::Acting;
use super::history::LaneHistory;
use super::link::{self, MOST, put_lane, take_lane};
use crate::geometry::matrix::Columns;
use crate::geometry::members::Each;
use crate::geometry::one_tree::One;
use crate::solver::run::MechanismIntegrator;
use crate::sweep::advance::{Seen, Turn, advance};
use crate::sweep::eliminate::{Part, eliminate};
use crate::sweep::finish::{Ends, Next, finish};
use crate::sweep::link::{ColumnWork, Gain, Link, Sums, Work, column_mut};
use crate::sweep::open::open;
use crate::sweep::pull_back::pull_back;
use crate::sweep::substitute::substitute;
use crate::tree::Tree;
use vi_core::lanes::{Lanes, Register};
use vi_core::newton::{Block, BlockKind, Convergence, Limits, NewtonSettings, Precision};
use vi_core::{Configuration, SeparableSystem};
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
    links: Vec<Link<Each<T::Lanes>>>,
    works: Vec<Work<Each<T::Lanes>>>,
    columns: Vec<ColumnWork<Each<T::Lanes>>>, // d
    turns: Vec<Turn<T::Lanes>>,               // d
    gains: Vec<Gain<Each<T::Lanes>>>,
    sums: Vec<Sums<Each<T::Lanes>>>,
    part: Part<Each<T::Lanes>>,
    weight: Vec<T::Lanes>,                  // n  constant forces
    impulse: Vec<T::Lanes>,                 // n  of them in half a step
    pub(super) q: Vec<T::Lanes>,            // n
    pub(super) p: Vec<T::Lanes>,            // n
    pub(super) compensation: Vec<T::Lanes>, // n
    pub(super) balance: Vec<T::Lanes>,      // d  residual of the last balance
    pub(super) acting: Option<Acting>,
    pub(super) history: LaneHistory<T>,
    end: Vec<T::Lanes>,               // n  q_{n+1} as the step computed it
    next: Vec<T::Lanes>,              // n  q_{n+1} without round-off
    rounding: Vec<T::Lanes>,          // n  its rounding error
    dq: Vec<T::Lanes>,                // n
    u: Vec<T::Lanes>,                 // d
    r: Vec<T::Lanes>,                 // d
    x: Vec<T::Lanes>,                 // d
    pub(super) floors: Vec<T::Lanes>, // of the blocks
    blocks: Vec<Block>,
    scratch: Vec<f64>,         // n
    start: [Vec<T::Lanes>; 4], // of a composition: q, p, compensation, balance
    pub(super) what: [Lane; MOST],
}

impl<T: Register> Kernel<T> {
    /// For members of these constants and constant forces, as many as there are lanes, and a
    /// composition of `sub_steps`.
    pub(super) fn new(
        lanes: T,
        (members, weights): (&[&[Link<One>]], &[Vec<f64>]),
        (tree, acting): (&Tree, Option<Acting>),
        sub_steps: usize,
    ) -> Option<Self> {
        let links = link::links(lanes, members)?;
        let (n, d, count) = (weights[0].len(), tree.dof(), links.len());
        let (zero, blocks) = (lanes.splat(0.0), tree.blocks());
        let slots = links.iter().filter(|link| link.slot.is_some()).count();
        Some(Self {
            lanes,
            works: vec![Work::zero(lanes); count],
            columns: vec![ColumnWork::zero(lanes); d],
            turns: vec![Turn::by(lanes, zero); d],
            gains: vec![Columns::zero(lanes).held(); count],
            sums: vec![Sums::zero(lanes); slots],
            part: Part::new(lanes),
            weight: (0..n).map(|i| lanes.gather(|k| weights[k][i])).collect(),
            impulse: vec![zero; n],
            q: vec![zero; n],
            p: vec![zero; n],
            compensation: vec![zero; n],
            balance: vec![zero; d],
            acting,
            history: LaneHistory::new(lanes, d, sub_steps),
            end: vec![zero; n],
            next: vec![zero; n],
            rounding: vec![zero; n],
            dq: vec![zero; n],
            u: vec![zero; d],
            r: vec![zero; d],
            x: vec![zero; d],
            floors: vec![zero; blocks.len()],
            blocks,
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
        let Self { q, p, compensation, balance, start, history, .. } = self;
        for (start, own) in start.iter().zip([q, p, compensation, balance]) {
            for (own, start) in own.iter_mut().zip(start) {
                *own = own.with(lane, start.at(lane));
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
                fastest = fastest.larger(speed.abs());
            }
        }
        fastest
    }

    /// Solves sub-step `index` of length `h`; lanes that are not idle are then solved or refused.
    pub(super) fn solve(
        &mut self,
        (index, h): (usize, f64),
        members: &[MechanismIntegrator],
        settings: &NewtonSettings,
    ) {
        let (lanes, count) = (self.lanes, T::Lanes::COUNT);
        self.history.weigh();
        lanes.run(
            #[inline(always)]
            || {
                let Self { history, links, works, columns, q, p, weight, impulse, u, .. } = self;
                history.predict(index, u);
                let half = 0.5 * h;
                impulse.iter_mut().zip(&*weight).for_each(|(impulse, w)| *impulse = *w * half);
                open(lanes, links, works, columns, [q, p, impulse]);
            },
        );
        for lane in 0..count {
            if self.what[lane] != Lane::Idle {
                let known = self.history.knows(index, lane, h);
                self.what[lane] = if known { Lane::Running } else { Lane::Refused };
            }
        }
        let residual = self.evaluate(h, members);
        let mut seen: [Convergence; MOST] =
            std::array::from_fn(|k| Convergence::new(if k < count { residual.at(k) } else { 0.0 }));
        let limits = Limits::of(settings.tolerance, &Precision::of_balances(), 0.0);
        for iteration in 1..=settings.max_iterations {
            if !self.what[..count].contains(&Lane::Running) {
                return;
            }
            self.set_slopes(members);
            let (size, resolved) = lanes.run(
                #[inline(always)]
                || self.correct(h),
            );
            let residual = self.evaluate(h, members);
            for lane in 0..count {
                if self.what[lane] != Lane::Running {
                    continue;
                }
                let (size, next) = (size.at(lane), residual.at(lane));
                let reached = seen[lane].judge(size, next, limits).is_reached;
                if !(size.is_finite() && next.is_finite()) {
                    self.what[lane] = Lane::Refused;
                } else if reached || (self.is_affine(lane) && resolved.at(lane) <= 0.0) {
                    self.what[lane] = Lane::Solved;
                } else if iteration == settings.max_iterations {
                    self.what[lane] = Lane::Refused;
                }
            }
        }
    }

    /// Residuals at `u`, and the largest entry of each lane; lanes that turn too far are refused.
    fn evaluate(&mut self, h: f64, members: &[MechanismIntegrator]) -> T::Lanes {
        let Self { lanes, links, works, columns, turns, u, r, balance, acting, .. } = self;
        let seen = lanes.run(
            #[inline(always)]
            || {
                let seen = advance(*lanes, links, works, (columns, turns), u, Some(h));
                pull_back(*lanes, links, works, columns, r);
                seen
            },
        );
        if let Some(acting) = acting {
            acting.add_balance(members.iter().map(MechanismIntegrator::system), u, r);
        }
        let residual = lanes.run(
            #[inline(always)]
            || {
                let (zero, mut residual) = (lanes.splat(0.0), lanes.splat(0.0));
                let mut sum = zero; // not finite where an entry is not
                for (r, error) in r.iter_mut().zip(balance) {
                    *r = *r + *error;
                    residual = residual.larger(r.abs());
                    sum = sum + *r * 0.0;
                }
                residual + sum
            },
        );
        self.refuse_large_rotations(seen);
        residual
    }

    /// What acts along unknowns adds to the matrix.
    fn set_slopes(&mut self, members: &[MechanismIntegrator]) {
        let Self { acting, links, works, columns, .. } = self;
        let Some(acting) = acting else { return };
        let systems = members.iter().map(MechanismIntegrator::system);
        acting.slopes(systems, |lane, link, unknown, slope| {
            let column = column_mut(&links[link], &mut works[link], columns, unknown);
            column.slope = column.slope.with(lane, slope);
        });
    }

    fn is_affine(&self, lane: usize) -> bool {
        self.acting.as_ref().is_none_or(|acting| acting.is_affine(lane))
    }

    /// The configuration of a lane, for what acts along its unknowns.
    pub(super) fn open_lane(
        &mut self,
        (lane, system): (usize, &SeparableSystem),
        (t, angles): (f64, &[f64]),
        h: f64,
    ) {
        let Self { acting, q, scratch, .. } = self;
        let Some(acting) = acting else { return };
        take_lane(q, lane, scratch);
        let at = Configuration { angles, ..Configuration::new(t, scratch) };
        acting.open((lane, system), at, h);
    }

    fn refuse_large_rotations(&mut self, seen: Seen<T::Lanes>) {
        for lane in 0..T::Lanes::COUNT {
            let is_in_chart = seen.rotation.at(lane) <= MAX_ROTATION * MAX_ROTATION;
            if self.what[lane] == Lane::Running && !is_in_chart {
                self.what[lane] = Lane::Refused;
            }
        }
    }

    /// A correction of the lanes that run: its relative size, and what is left of it above
    /// rounding.
    #[inline(always)]
    fn correct(&mut self, h: f64) -> (T::Lanes, T::Lanes) {
        let Self { lanes, links, works, columns, gains, sums, part, x, u, r, .. } = self;
        for (x, r) in x.iter_mut().zip(&*r) {
            *x = *r * -h;
        }
        let all = 0..links.len();
        part.links = all.clone();
        eliminate(*lanes, links, works, (columns, gains), (sums, &[], part), x);
        let turn = substitute(*lanes, (links, all), works, (columns, gains), u, x);
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
                scale = scale.larger(u[i].abs());
                correction = correction.larger(x[i].abs());
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
    pub(super) fn end(
        &mut self,
        (index, h): (usize, f64),
        members: &[MechanismIntegrator],
        trees: &[Tree],
    ) {
        self.history.remember(index, h, &self.u);
        let Self { lanes, links, works, columns, q, p, compensation, balance, impulse, .. } = self;
        let Self { end, next, rounding, dq, r, scratch, acting, .. } = self;
        lanes.run(
            #[inline(always)]
            || {
                let clean = |k: usize, off: u8, q: &mut [T::Lanes]| {
                    let link = &links[k];
                    let frames = (link.frame, link.parent_frame);
                    clean_lanes((k, frames), (trees, off), q, scratch)
                };
                let ends = Ends { h, q0: q, compensation, q1: end, dq, middle: None };
                let next = Next { q: next, rounding, p };
                finish(*lanes, links, works, clean, Some(impulse), ends, next);
                pull_back(*lanes, links, works, columns, r);
            },
        );
        if let Some(acting) = acting {
            acting.add_last_balance(r);
            for (lane, member) in members.iter().enumerate() {
                acting.add_momentum((lane, member.system()), end, p);
            }
        }
        for (balance, r) in balance.iter_mut().zip(&*r) {
            *balance = *balance + *r;
        }
        std::mem::swap(q, next);
        std::mem::swap(compensation, rounding);
    }
}

/// Removes round-off from link `k`, as [`Tree::clean`] does, in the lanes that are `off`; returns
/// those in which it has moved.
#[cold]
#[inline(never)]
fn clean_lanes<L: Lanes>(
    (k, (frame, parent_frame)): (usize, (usize, usize)),
    (trees, off): (&[Tree], u8),
    q: &mut [L],
    scratch: &mut [f64],
) -> u8 {
    let mut moved = 0;
    for (lane, tree) in trees.iter().enumerate().filter(|(lane, _)| off & (1 << lane) != 0) {
        for first in [frame, parent_frame] {
            take_lane(&q[first..first + 12], lane, &mut scratch[first..first + 12]);
        }
        if !tree.clean_link(&tree.links()[k], scratch) {
            continue;
        }
        moved |= 1 << lane;
        put_lane(&scratch[frame..frame + 12], lane, &mut q[frame..frame + 12]);
    }
    moved
}
