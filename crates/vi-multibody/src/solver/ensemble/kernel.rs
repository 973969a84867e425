//! A step of as many members as there are lanes.

use super::history::LaneHistory;
use super::link::{self, MOST, put_lane, take_lane};
use super::member::{EnsembleMember, LaneOf};
use crate::geometry::matrix::{Columns, Spatial};
use crate::geometry::members::{EachMember, LanesVector};
use crate::geometry::one_tree::One;
use crate::geometry::space::Space;
use crate::solver::run::MechanismIntegrator;
use crate::sweep::advance::{Seen, Turn, advance};
use crate::sweep::eliminate::{UpToApex, eliminate};
use crate::sweep::finish::{Next, StepEnds, close, finish};
use crate::sweep::link::{ColumnWork, Gain, Link, Sums, Work, column_mut};
use crate::sweep::open::open;
use crate::sweep::pull_back::pull_back;
use crate::sweep::substitute::substitute;
use vi_core::lanes::{Lanes, Register};
use vi_core::newton::{
    BlockKind, Convergence, CorrectionLimits, NewtonSettings, Precision, UnknownBlock,
};
use vi_core::state::State;
use vi_rigid::rotation::MAX_ROTATION;

/// What a lane is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LaneState {
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
    links: Vec<Link<EachMember<T::Lanes>>>,
    works: Vec<Work<EachMember<T::Lanes>>>,
    columns: Vec<ColumnWork<EachMember<T::Lanes>>>, // d
    turns: Vec<Turn<T::Lanes>>,                     // d
    gains: Vec<Gain<EachMember<T::Lanes>>>,
    sums: Vec<Sums<EachMember<T::Lanes>>>,
    part: UpToApex<EachMember<T::Lanes>>,
    weight: Vec<T::Lanes>,                      // n  constant forces
    impulse: Vec<T::Lanes>,                     // n  of them in half a step
    pub(super) q: Vec<T::Lanes>,                // n
    pub(super) p: Vec<T::Lanes>,                // n
    pub(super) compensation: Vec<T::Lanes>,     // n
    pub(super) balance: Vec<T::Lanes>,          // d  residual of the last balance
    acts_along: bool, // whether anything acts along unknowns of any member
    added: Vec<Spatial<LanesVector<T::Lanes>>>, // to the blocks of bodies, by what acts on them
    pub(super) history: LaneHistory<T>,
    end: Vec<T::Lanes>,               // n  q_{n+1} as the step computed it
    next: Vec<T::Lanes>,              // n  q_{n+1} without round-off
    rounding: Vec<T::Lanes>,          // n  its rounding error
    dq: Vec<T::Lanes>,                // n
    u: Vec<T::Lanes>,                 // d
    r: Vec<T::Lanes>,                 // d
    x: Vec<T::Lanes>,                 // d
    pub(super) floors: Vec<T::Lanes>, // of the blocks
    blocks: Vec<UnknownBlock>,
    scratch: Vec<f64>,         // n
    start: [Vec<T::Lanes>; 4], // of a composition: q, p, compensation, balance
    pub(super) what: [LaneState; MOST],
}

impl<T: Register> Kernel<T> {
    /// For members of these constants and constant forces, as many as there are lanes, and a
    /// composition of `sub_steps`.
    pub(super) fn new(
        lanes: T,
        members: &[&[Link<One>]],
        weights: &[Vec<f64>],
        own: &[EnsembleMember],
        sub_steps: usize,
    ) -> Option<Self> {
        let tree = &own[0].tree;
        let links = link::links(lanes, members)?;
        let (n, d, count) = (weights[0].len(), tree.dof(), links.len());
        let (zero, blocks) = (lanes.splat(0.0), tree.blocks());
        let slots = links.iter().filter(|link| link.slot.is_some()).count();
        let variable = own.iter().any(EnsembleMember::has_body_forces);
        // adding −0 changes no bit of a member on which nothing acts
        let none = Columns([lanes.vector([-0.0; 3]); 3]);
        let none = Spatial { ll: none, la: none, al: none, aa: none };
        Some(Self {
            lanes,
            works: vec![Work::zero(lanes); count],
            columns: vec![ColumnWork::zero(lanes); d],
            turns: vec![Turn::by(lanes, zero); d],
            gains: vec![Columns::zero(lanes).held(); count],
            sums: vec![Sums::zero(lanes); slots],
            part: UpToApex::new(lanes),
            weight: (0..n).map(|i| lanes.gather(|k| weights[k][i])).collect(),
            impulse: vec![zero; n],
            q: vec![zero; n],
            p: vec![zero; n],
            compensation: vec![zero; n],
            balance: vec![zero; d],
            acts_along: own.iter().any(EnsembleMember::has_efforts),
            added: vec![none; if variable { count } else { 0 }],
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
            what: [LaneState::Idle; MOST],
            links,
        })
    }

    /// Takes the state of a member into a lane.
    pub(super) fn load(&mut self, lane: usize, state: &State) {
        let Self { q, p, compensation, balance, history, what, .. } = self;
        put_lane(&state.q, lane, q);
        put_lane(&state.p, lane, p);
        put_lane(&state.compensation.q, lane, compensation);
        // empty before the first step
        balance.iter_mut().for_each(|all| all.set(lane, 0.0));
        put_lane(&state.compensation.balance, lane, balance);
        history.load(lane, &state.history);
        what[lane] = LaneState::Solved;
    }

    /// Writes what a lane knows of the state of its member, at the start of a macro step of which
    /// `undone` sub-steps were taken.
    pub(super) fn write(&self, lane: usize, undone: usize, state: &mut State) {
        let Self { q, p, compensation, balance, history, .. } = self;
        take_lane(q, lane, &mut state.q);
        take_lane(p, lane, &mut state.p);
        take_lane(compensation, lane, &mut state.compensation.q);
        state.compensation.balance.resize(balance.len(), 0.0);
        take_lane(balance, lane, &mut state.compensation.balance);
        history.write(lane, undone, &mut state.history);
    }

    /// Keeps the node where a composition starts.
    pub(super) fn keep_start(&mut self) {
        let Self { q, p, compensation, balance, start, history, .. } = self;
        for (start, own) in start.iter_mut().zip([q, p, compensation, balance]) {
            start.copy_from_slice(own);
        }
        history.keep_start();
    }

    /// Moves a lane back to where its composition has started, but for its increments.
    pub(super) fn return_to_start(&mut self, lane: usize) {
        let Self { q, p, compensation, balance, start, .. } = self;
        for (start, own) in start.iter().zip([q, p, compensation, balance]) {
            for (own, start) in own.iter_mut().zip(start) {
                own.set(lane, start.at(lane));
            }
        }
    }

    /// Whether anything acts beside constant forces.
    pub(super) fn acts(&self) -> bool {
        self.acts_along || !self.added.is_empty()
    }

    /// Coordinates at the start of a sub-step and their rounding errors.
    pub(super) fn coordinates(&self) -> [&[T::Lanes]; 2] {
        [&self.q, &self.compensation]
    }

    /// `q_{n+1}` and `Δq` of the last sub-step.
    pub(super) fn last_change(&self) -> [&[T::Lanes]; 2] {
        [&self.end, &self.dq]
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
        index: usize,
        h: f64,
        members: &[MechanismIntegrator],
        own: &mut [EnsembleMember],
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
            if self.what[lane] != LaneState::Idle {
                let known = self.history.knows(index, lane, h);
                self.what[lane] = if known { LaneState::Running } else { LaneState::Refused };
            }
        }
        let residual = self.evaluate(h, members, own);
        let mut seen: [Convergence; MOST] =
            std::array::from_fn(|k| Convergence::new(if k < count { residual.at(k) } else { 0.0 }));
        let limits = CorrectionLimits::of(settings.tolerance, &Precision::of_balances(), 0.0);
        for iteration in 1..=settings.max_iterations {
            if !self.what[..count].contains(&LaneState::Running) {
                return;
            }
            if self.acts() {
                self.assemble(members, own);
            }
            let (size, resolved) = lanes.run(
                #[inline(always)]
                || self.correct(h),
            );
            let residual = self.evaluate(h, members, own);
            for lane in 0..count {
                if self.what[lane] != LaneState::Running {
                    continue;
                }
                let (size, next) = (size.at(lane), residual.at(lane));
                let reached = seen[lane].judge(size, next, limits).is_reached;
                if !(size.is_finite() && next.is_finite()) {
                    self.what[lane] = LaneState::Refused;
                } else if reached || (own[lane].is_affine() && resolved.at(lane) <= 0.0) {
                    self.what[lane] = LaneState::Solved;
                } else if iteration == settings.max_iterations {
                    self.what[lane] = LaneState::Refused;
                }
            }
        }
    }

    /// Residuals at `u`, and the largest entry of each lane; lanes that turn too far are refused.
    /// Where a lane does not run, nothing acts.
    fn evaluate(
        &mut self,
        h: f64,
        members: &[MechanismIntegrator],
        own: &mut [EnsembleMember],
    ) -> T::Lanes {
        let Self { lanes, links, works, columns, turns, u, r, added, .. } = self;
        let seen = lanes.run(
            #[inline(always)]
            || {
                let seen = advance(*lanes, links, works, (columns, turns), u, Some(h));
                if added.is_empty() {
                    pull_back(*lanes, links, works, columns, r);
                }
                seen
            },
        );
        self.refuse_large_rotations(seen);
        if !self.added.is_empty() {
            self.add_body_forces(h, members, own);
        }
        let Self { lanes, u, r, balance, acts_along, what, .. } = self;
        for (lane, (run, own)) in members.iter().zip(own).enumerate().filter(|_| *acts_along) {
            if what[lane] == LaneState::Running {
                own.add_efforts(LaneOf { lane, run }, u, r);
            }
        }
        lanes.run(
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
        )
    }

    /// The balances with forces on bodies that vary, at the end of the step as it is now.
    fn add_body_forces(
        &mut self,
        h: f64,
        members: &[MechanismIntegrator],
        own: &mut [EnsembleMember],
    ) {
        let Self {
            lanes, links, works, columns, q, compensation, end, dq, r, floors, what, ..
        } = self;
        lanes.run(
            #[inline(always)]
            || {
                close(
                    *lanes,
                    links,
                    works,
                    StepEnds { h, q0: q, compensation, q1: end, dq, middle: None },
                )
            },
        );
        for (lane, (run, own)) in members.iter().zip(own).enumerate() {
            if what[lane] == LaneState::Running && own.has_body_forces() {
                own.add_wrenches(LaneOf { lane, run }, [end, dq], works);
                for (floor, block) in floors.iter_mut().zip(own.increments.blocks()) {
                    floor.set(lane, block.floor);
                }
            }
        }
        lanes.run(
            #[inline(always)]
            || pull_back(*lanes, links, works, columns, r),
        );
    }

    /// What acts adds to the matrix.
    fn assemble(&mut self, members: &[MechanismIntegrator], own: &mut [EnsembleMember]) {
        let Self { links, works, columns, added, what, .. } = self;
        for (lane, (run, own)) in members.iter().zip(own).enumerate() {
            if what[lane] == LaneState::Running {
                own.add_to_matrix(LaneOf { lane, run }, added, |link, unknown, slope| {
                    let column = column_mut(&links[link], &mut works[link], columns, unknown);
                    column.slope.set(lane, slope);
                });
            }
        }
    }

    fn refuse_large_rotations(&mut self, seen: Seen<T::Lanes>) {
        for lane in 0..T::Lanes::COUNT {
            let is_in_chart = seen.rotation.at(lane) <= MAX_ROTATION * MAX_ROTATION
                && seen.finite.at(lane) <= 0.0;
            if self.what[lane] == LaneState::Running && !is_in_chart {
                self.what[lane] = LaneState::Refused;
            }
        }
    }

    /// A correction of the lanes that run: its relative size, and what is left of it above
    /// rounding.
    #[inline(always)]
    fn correct(&mut self, h: f64) -> (T::Lanes, T::Lanes) {
        let Self { lanes, links, works, columns, gains, sums, part, added, x, u, r, .. } = self;
        for (x, r) in x.iter_mut().zip(&*r) {
            *x = *r * -h;
        }
        let all = 0..links.len();
        part.links = all.clone();
        eliminate(*lanes, links, works, (columns, gains), (sums, added, part), x);
        let turn = substitute(*lanes, (links, all), works, (columns, gains), u, x);
        let Self { lanes, x, u, blocks, floors, what, .. } = self;
        if what[..T::Lanes::COUNT].iter().any(|what| *what != LaneState::Running) {
            let (runs, zero) =
                (lanes.gather(|k| f64::from(what[k] == LaneState::Running)), lanes.splat(0.0));
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

    /// Moves all lanes to the end of the sub-step that was solved. Returns those in which a link
    /// was not as it should be, a bit each.
    pub(super) fn end(
        &mut self,
        index: usize,
        h: f64,
        members: &[MechanismIntegrator],
        own: &mut [EnsembleMember],
    ) -> u8 {
        self.history.remember(index, h, &self.u);
        let Self { lanes, links, works, columns, q, p, compensation, balance, impulse, .. } = self;
        let Self { end, next, rounding, dq, r, scratch, added, acts_along, what, .. } = self;
        let bodies = !added.is_empty();
        for (lane, own) in own.iter_mut().enumerate().filter(|_| bodies) {
            own.take_momentum(lane, p);
        }
        let off = lanes.run(
            #[inline(always)]
            || {
                let clean = |k: usize, off: u8, q: &mut [T::Lanes]| {
                    let link = &links[k];
                    let frames = (link.frame, link.parent_frame);
                    clean_lanes(k, frames, &*own, off, q, scratch)
                };
                let ends = StepEnds { h, q0: q, compensation, q1: end, dq, middle: None };
                let next = Next { q: next, rounding, p };
                let off = finish(*lanes, links, works, clean, Some(impulse), ends, next);
                if !bodies {
                    pull_back(*lanes, links, works, columns, r);
                }
                off
            },
        );
        let moves = |lane: &usize| what[*lane] != LaneState::Idle;
        if bodies {
            for lane in (0..own.len()).filter(moves) {
                let run = &members[lane];
                own[lane].end_bodies(LaneOf { lane, run }, [end, dq], works, p);
            }
            lanes.run(
                #[inline(always)]
                || pull_back(*lanes, links, works, columns, r),
            );
        }
        for lane in (0..own.len()).filter(|lane| *acts_along && moves(lane)) {
            let run = &members[lane];
            own[lane].end_efforts(LaneOf { lane, run }, end, p, r);
        }
        for (balance, r) in balance.iter_mut().zip(&*r) {
            *balance = *balance + *r;
        }
        std::mem::swap(q, next);
        std::mem::swap(compensation, rounding);
        off
    }
}

/// Removes round-off from link `k`, as [`Tree::clean`] does, in the lanes that are `off`; returns
/// those in which it has moved.
#[cold]
#[inline(never)]
fn clean_lanes<L: Lanes>(
    k: usize,
    (frame, parent_frame): (usize, usize),
    own: &[EnsembleMember],
    off: u8,
    q: &mut [L],
    scratch: &mut [f64],
) -> u8 {
    let mut moved = 0;
    for (lane, own) in own.iter().enumerate().filter(|(lane, _)| off & (1 << lane) != 0) {
        let tree = &own.tree;
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
