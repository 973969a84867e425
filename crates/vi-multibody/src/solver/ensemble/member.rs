//! What a member has beside its lane: time and angles, floors, and what acts beside constant
//! forces.
//!
//! Springs, dampers, motors and loads are evaluated one member after the other, by the functions
//! that its own integrator calls: a member has the bits of that.

use super::link::{add_screw, put_lane, put_screw, put_spatial, take_lane};
use crate::geometry::matrix::Spatial;
use crate::geometry::members::{EachMember, LanesVector};
use crate::geometry::one_tree::One;
use crate::solver::efforts::{Efforts, StepTimes};
use crate::solver::run::MechanismIntegrator;
use crate::solver::tree_step::body_forces::BodyForces;
use crate::solver::tree_step::emitted::wrench;
use crate::solver::tree_step::space::SPACE;
use crate::sweep::link::{Link, Work};
use crate::tree::Tree;
use vi_constraints::Constraints;
use vi_constraints::unknowns::Increments;
use vi_core::MechanicalSystem;
use vi_core::interval::Interval;
use vi_core::lanes::Lanes;
use vi_core::state::State;

/// What lanes need of a member.
pub(super) struct MemberModel {
    pub(super) links: Vec<Link<One>>,
    pub(super) weight: Vec<f64>,
    pub(super) sub_steps: Vec<f64>,
}

/// A lane and the integrator of its member.
#[derive(Clone, Copy)]
pub(super) struct LaneOf<'a> {
    pub(super) lane: usize,
    pub(super) run: &'a MechanismIntegrator,
}

/// A member beside its lane.
#[derive(Debug)]
pub(super) struct EnsembleMember {
    pub(super) tree: Tree,
    pub(super) increments: Increments, // for its floors
    /// Time, step, angles and internal variables; the rest as it was last taken from the lane.
    pub(super) now: State,
    /// The sub-step, where it [`EnsembleMember::has_interval`].
    pub(super) s: Interval,
    /// Whether the step is read when it is taken.
    pub(super) is_read: bool,
    start: State,          // of the macro step: time, angles, internal variables
    origin: (f64, u64),    // time and step from which time is counted
    links: Vec<Link<One>>, // where forces act on bodies
    bodies: Option<BodyForces>,
    efforts: Option<Efforts>,
    numbers: Vec<f64>, // d  scratch
}

impl EnsembleMember {
    pub(super) fn new(model: &MemberModel, run: &MechanismIntegrator) -> Self {
        let (tree, system, state) = (run.constraints().tree().clone(), run.system(), run.state());
        let acts_along = system.along_unknowns().next().is_some();
        let bodies = BodyForces::new(run.constraints(), system, &[]);
        let links = if bodies.is_some() { model.links.clone() } else { Vec::new() };
        Self {
            increments: Increments::new(tree.blocks()),
            now: state.clone(),
            s: Interval::new(system.dim()),
            is_read: false,
            start: State::default(),
            origin: run.counted_from(),
            links,
            bodies,
            efforts: acts_along.then(|| Efforts::new(&model.links, system)),
            numbers: vec![0.0; tree.dof()],
            tree,
        }
    }

    /// Whether variable forces act on its bodies.
    pub(super) fn has_body_forces(&self) -> bool {
        self.bodies.is_some()
    }

    /// Whether anything acts along its unknowns.
    pub(super) fn has_efforts(&self) -> bool {
        self.efforts.is_some()
    }

    /// Whether a sub-step has to be opened.
    pub(super) fn is_opened(&self) -> bool {
        self.has_interval() || self.has_efforts()
    }

    /// Whether its interval is written.
    fn has_interval(&self) -> bool {
        self.is_read || self.bodies.is_some()
    }

    /// Whether Newton's method sees affine functions of the increments alone, but for rotations.
    pub(super) fn is_affine(&self) -> bool {
        self.bodies.is_none() && self.efforts.as_ref().is_none_or(Efforts::are_affine)
    }

    /// Keeps what [`EnsembleMember::return_to_start`] needs.
    pub(super) fn keep_start(&mut self) {
        self.start.t = self.now.t;
        self.start.angles.clone_from(&self.now.angles);
        self.start.internal.clone_from(&self.now.internal);
    }

    /// Returns to where its composition has started.
    pub(super) fn return_to_start(&mut self) {
        self.now.t = self.start.t;
        self.now.angles.clone_from(&self.start.angles);
        self.now.internal.clone_from(&self.start.internal);
    }

    /// Where a sub-step of length `h` ends, s; the last one of a macro step of length `step` at its
    /// node.
    pub(super) fn end_of(&self, h: f64, last: Option<f64>) -> f64 {
        let ((t, from), next) = (self.origin, self.now.step + 1);
        last.map_or(self.now.t + h, |step| t + (next - from) as f64 * step)
    }

    /// Opens a sub-step at the coordinates of its lane and their rounding errors.
    pub(super) fn open<L: Lanes>(
        &mut self,
        LaneOf { lane, run }: LaneOf<'_>,
        (h, t_end): (f64, f64),
        [q, rounding]: [&[L]; 2],
    ) {
        take_lane(q, lane, &mut self.now.q);
        if self.has_interval() {
            take_lane(rounding, lane, &mut self.now.compensation.q);
        }
        self.now.open_start(&mut self.s, h);
        self.s.end_at(t_end);
        if let Some(efforts) = &mut self.efforts {
            efforts.begin(run.system(), self.now.configuration());
        }
    }

    /// The floors of its increments for a sub-step in which nothing moves farther than a distance,
    /// m.
    pub(super) fn set_floors(&mut self, run: &MechanismIntegrator, distance: f64) {
        self.increments.reset();
        if self.bodies.is_some() {
            self.increments.reach(run.constraints(), &self.s.q0);
        }
        run.constraints().raise_floors_by(distance, self.increments.blocks_mut());
    }

    /// Completes the interval with `q_{n+1}` and `Δq` of its lane.
    pub(super) fn close<L: Lanes>(&mut self, lane: usize, [q1, dq]: [&[L]; 2]) {
        take_lane(q1, lane, &mut self.s.q1);
        take_lane(dq, lane, &mut self.s.dq);
        self.s.close();
    }

    /// Adds forces on bodies to the balances of the links, at the end that its lane has reached.
    pub(super) fn add_wrenches<L: Lanes>(
        &mut self,
        LaneOf { lane, run }: LaneOf<'_>,
        end: [&[L]; 2],
        works: &mut [Work<EachMember<L>>],
    ) {
        if self.bodies.is_none() {
            return;
        }
        self.close(lane, end);
        self.increments.reach(run.constraints(), &self.s.q1);
        let Self { bodies: Some(bodies), s, links, .. } = self else { return };
        bodies.wrenches(run.system(), s, links, |k, own| {
            add_screw(own, lane, &mut works[k].wrench);
        });
    }

    /// `r ← r + σ (h/2) τ` at the increments `u`.
    pub(super) fn add_efforts<L: Lanes>(
        &mut self,
        LaneOf { lane, run }: LaneOf<'_>,
        u: &[L],
        r: &mut [L],
    ) {
        let Self { efforts: Some(efforts), s, numbers, .. } = self else { return };
        take_lane(u, lane, numbers);
        efforts.evaluate(run.system(), StepTimes::of(s), numbers);
        self.add_last_efforts(lane, r);
    }

    /// The same of the last evaluation.
    fn add_last_efforts<L: Lanes>(&mut self, lane: usize, r: &mut [L]) {
        let Self { efforts: Some(efforts), numbers, .. } = self else { return };
        take_lane(r, lane, numbers);
        efforts.add_balance(numbers);
        put_lane(numbers, lane, r);
    }

    /// What acts adds to the matrix: `slope(link, unknown, value)` along unknowns, blocks of the
    /// links to `added`.
    pub(super) fn add_to_matrix<L: Lanes>(
        &mut self,
        LaneOf { lane, run }: LaneOf<'_>,
        added: &mut [Spatial<LanesVector<L>>],
        slope: impl FnMut(usize, usize, f64),
    ) {
        let Self { tree, efforts, bodies, s, links, .. } = self;
        if let Some(efforts) = efforts {
            efforts.slopes(run.system(), StepTimes::of(s), slope);
        }
        if let Some(bodies) = bodies {
            bodies.assemble(run.system(), s, tree, links);
            for (all, own) in added.iter_mut().zip(bodies.blocks()) {
                put_spatial(own.take(SPACE), lane, all);
            }
        }
    }

    /// Before the end of a sub-step: `p̄_n`, where forces on bodies need it.
    pub(super) fn take_momentum<L: Lanes>(&mut self, lane: usize, p: &[L]) {
        if self.bodies.is_some() {
            take_lane(p, lane, &mut self.now.p);
        }
    }

    /// At the end of a sub-step: with forces on bodies `p̄_{n+1}`, internal variables, and the
    /// balances of the links.
    pub(super) fn end_bodies<L: Lanes>(
        &mut self,
        LaneOf { lane, run }: LaneOf<'_>,
        end: [&[L]; 2],
        works: &mut [Work<EachMember<L>>],
        p: &mut [L],
    ) {
        if self.bodies.is_none() {
            return;
        }
        self.close(lane, end);
        let Self { bodies: Some(bodies), now, s, links, .. } = self else { return };
        let rest = bodies.rest(run.system(), s, &now.p);
        for (link, work) in links.iter().zip(works) {
            put_screw(wrench(link, &s.q0, rest), lane, &mut work.wrench);
        }
        now.move_momentum(run.system(), s);
        put_lane(&now.p, lane, p);
    }

    /// At the end of a sub-step: what acts along unknowns, where it is not among the forces on
    /// bodies: `r ← r + σ (h/2) τ`, `p ← p + (h/2) τ ∇θ(q)`.
    pub(super) fn end_efforts<L: Lanes>(
        &mut self,
        LaneOf { lane, run }: LaneOf<'_>,
        q: &[L],
        p: &mut [L],
        r: &mut [L],
    ) {
        if self.bodies.is_some() || self.efforts.is_none() {
            return;
        }
        self.add_last_efforts(lane, r);
        let Self { efforts: Some(efforts), now, .. } = self else { return };
        take_lane(q, lane, &mut now.q);
        take_lane(p, lane, &mut now.p);
        efforts.add_momentum(run.system(), &now.q, &mut now.p);
        put_lane(&now.p, lane, p);
    }

    /// Goes on to the end of a sub-step, with the revolutions of joints; `last`: of the macro step.
    pub(super) fn move_on<L: Lanes>(
        &mut self,
        LaneOf { lane, run }: LaneOf<'_>,
        t_end: f64,
        last: bool,
        q: &[L],
    ) {
        self.now.t = t_end;
        self.now.step += u64::from(last);
        if !self.now.angles.is_empty() {
            take_lane(q, lane, &mut self.now.q);
            run.constraints().unwrap_angles(&self.now.q, &mut self.now.angles);
        }
    }
}
