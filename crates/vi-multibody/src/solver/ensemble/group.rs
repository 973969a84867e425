//! Members in the lanes of one kernel: their states in and out, steps, failures.

use super::acting::Acting;
use super::kernel::{Kernel, Lane};
use super::link::{MOST, put_lane, take_lane};
use crate::geometry::one_tree::One;
use crate::solver::run::MechanismIntegrator;
use crate::sweep::link::Link;
use crate::tree::Tree;
use std::fmt::Debug;
use vi_constraints::integrator::ResumeError;
use vi_constraints::scheme::StepError;
use vi_constraints::unknowns::Increments;
use vi_constraints::{Constraints, Options};
use vi_core::SeparableSystem;
#[cfg(target_arch = "x86_64")]
use vi_core::lanes::Wide;
use vi_core::lanes::{Lanes, Plain, Register, Twice};
use vi_core::newton::{Fault, NewtonError, NewtonSettings};
use vi_core::state::State;

/// What lanes need of a member.
pub(super) struct Model {
    pub(super) links: Vec<Link<One>>,
    pub(super) weight: Vec<f64>,
    pub(super) sub_steps: Vec<f64>,
}

/// Members that move together.
pub(super) trait Group: Send + Debug {
    /// How many.
    fn count(&self) -> usize;
    /// Steps that members have taken alone.
    fn alone(&self) -> u64;
    /// Takes `steps` steps with those that have not failed.
    fn advance(
        &mut self,
        members: &mut [MechanismIntegrator],
        failures: &mut [Option<StepError>],
        steps: u64,
    );
}

/// The first of the members in as many lanes as they fill; `None` where their topologies differ.
pub(super) fn wide(
    models: &[Model],
    members: &[MechanismIntegrator],
    options: &Options,
) -> Option<Box<dyn Group>> {
    #[cfg(target_arch = "x86_64")]
    if let Some(lanes) = Wide::detect() {
        return match models.len() {
            ..=4 => boxed(Lanewise::new(lanes, models, members, options)),
            _ => boxed(Lanewise::new(Twice(lanes), models, members, options)),
        };
    }
    // eight numbers in registers that hold two or four are no faster
    boxed(Lanewise::new(Plain, models, members, options))
}

fn boxed<T: Register>(group: Option<Lanewise<T>>) -> Option<Box<dyn Group>> {
    Some(Box::new(group?))
}

/// A group in lanes of one kind.
#[derive(Debug)]
pub(super) struct Lanewise<T: Register> {
    kernel: Kernel<T>,
    count: usize,
    alone: u64, // steps
    sub_steps: Vec<f64>,
    newton: NewtonSettings,
    step: f64,                   // s
    trees: Vec<Tree>,            // of the members
    increments: Vec<Increments>, // of the members, for their floors
    raised: bool,                // the floors, and before the first step
    origins: Vec<(f64, u64)>,    // time and step from which time is counted
    at: Vec<(f64, u64)>,         // time and step of the members
    angles: Vec<Vec<f64>>,       // unwrapped, of the members
    start_angles: Vec<Vec<f64>>, // the same when the step began
    q: Vec<f64>,                 // n  scratch
}

impl<T: Register> Lanewise<T> {
    fn new(
        lanes: T,
        models: &[Model],
        members: &[MechanismIntegrator],
        options: &Options,
    ) -> Option<Self> {
        let count = models.len().min(T::Lanes::COUNT);
        let of = |lane: usize| &models[lane.min(count - 1)]; // lanes to spare are idle
        let links: Vec<&[Link<One>]> = (0..T::Lanes::COUNT).map(|k| &of(k).links[..]).collect();
        let weights: Vec<Vec<f64>> = (0..T::Lanes::COUNT).map(|k| of(k).weight.clone()).collect();
        let sub_steps = of(0).sub_steps.clone();
        let trees: Vec<Tree> =
            members[..count].iter().map(|run| run.constraints().tree().clone()).collect();
        let systems: Vec<(&[Link<One>], &SeparableSystem)> = models
            .iter()
            .zip(&members[..count])
            .map(|(own, run)| (&own.links[..], run.system()))
            .collect();
        let at = (&trees[0], Acting::new(&systems, trees[0].dof()));
        let kernel = Kernel::new(lanes, (&links, &weights), at, sub_steps.len())?;
        let origins = members[..count].iter().map(|run| (run.state().t, run.state().step));
        Some(Self {
            kernel,
            count,
            alone: 0,
            sub_steps,
            newton: options.newton,
            step: options.step,
            raised: true,
            increments: trees.iter().map(|tree| Increments::new(tree.blocks())).collect(),
            at: vec![(0.0, 0); count],
            angles: vec![Vec::new(); count],
            start_angles: Vec::new(),
            q: vec![0.0; members[0].state().q.len()],
            origins: origins.collect(),
            trees,
        })
    }

    /// Takes the state of a member into a lane.
    fn load(&mut self, lane: usize, state: &State) {
        let Kernel { q, p, compensation, balance, history, what, .. } = &mut self.kernel;
        put_lane(&state.q, lane, q);
        put_lane(&state.p, lane, p);
        put_lane(&state.compensation.q, lane, compensation);
        // empty before the first step
        balance.iter_mut().for_each(|all| *all = all.with(lane, 0.0));
        put_lane(&state.compensation.balance, lane, balance);
        let (d, sub_steps) = (balance.len(), self.sub_steps.len());
        let mut known = state.history.clone();
        known.fit(d, sub_steps, 0..0);
        history.load(lane, &known);
        what[lane] = Lane::Solved;
        self.at[lane] = (state.t, state.step);
        self.angles[lane].clone_from(&state.angles);
    }

    /// Counts the revolutions of a member on to its present configuration.
    fn unwrap_angles(&mut self, lane: usize, member: &MechanismIntegrator) {
        let angles = &mut self.angles[lane];
        if !angles.is_empty() {
            take_lane(&self.kernel.q, lane, &mut self.q);
            member.constraints().unwrap_angles(&self.q, angles);
        }
    }

    /// The state of a lane, after `like`.
    fn state(&self, lane: usize, like: &State) -> State {
        let mut state = like.clone();
        let Kernel { q, p, compensation, balance, history, .. } = &self.kernel;
        let numbers = |own: &mut Vec<f64>, all: &[T::Lanes]| {
            own.resize(all.len(), 0.0);
            take_lane(all, lane, own);
        };
        numbers(&mut state.q, q);
        numbers(&mut state.p, p);
        numbers(&mut state.compensation.q, compensation);
        numbers(&mut state.compensation.balance, balance);
        state.history = history.of(lane);
        state.angles.clone_from(&self.angles[lane]);
        (state.t, state.step) = self.at[lane];
        state
    }

    /// The floors of the increments for a sub-step of length `h`.
    fn raise_floors(&mut self, members: &[MechanismIntegrator], h: f64) {
        let (fastest, lanes) = (self.kernel.fastest(), self.kernel.lanes);
        let raises = |(lane, member): (usize, &MechanismIntegrator)| {
            member.constraints().raises_floors(h.abs() * fastest.at(lane))
        };
        let raised = members.iter().enumerate().any(raises);
        if !raised && !self.raised {
            return;
        }
        self.raised = raised;
        for (lane, (member, increments)) in members.iter().zip(&mut self.increments).enumerate() {
            increments.reset();
            let distance = h.abs() * fastest.at(lane);
            member.constraints().raise_floors_by(distance, increments.blocks_mut());
        }
        let (increments, last) = (&self.increments, self.count - 1);
        for (i, floor) in self.kernel.floors.iter_mut().enumerate() {
            *floor = lanes.gather(|k| increments[k.min(last)].blocks()[i].floor);
        }
    }

    /// A macro step of all lanes that are not idle. A member whose lane is refused takes it alone.
    fn step(&mut self, members: &mut [MechanismIntegrator], failures: &mut [Option<StepError>]) {
        let sub_steps = self.sub_steps.len();
        let mut alone = [false; MOST];
        let mut times = [0.0; MOST];
        times.iter_mut().zip(&self.at).for_each(|(time, (t, _))| *time = *t);
        if sub_steps > 1 {
            self.kernel.keep_start();
            self.start_angles.clone_from(&self.angles);
        }
        for index in 0..sub_steps {
            let h = self.sub_steps[index] * self.step;
            self.raise_floors(members, h);
            for (lane, member) in members.iter().enumerate() {
                let at = (times[lane], &self.angles[lane][..]);
                self.kernel.open_lane((lane, member.system()), at, h);
                times[lane] += h;
            }
            self.kernel.solve((index, h), members, &self.newton);
            for lane in 0..self.count {
                if self.kernel.what[lane] == Lane::Refused {
                    (self.kernel.what[lane], alone[lane]) = (Lane::Idle, true);
                    if index > 0 {
                        self.kernel.return_to_start(lane);
                        self.angles[lane].clone_from(&self.start_angles[lane]);
                    }
                    let start = self.state(lane, members[lane].state());
                    self.alone += 1;
                    failures[lane] = take_alone(&mut members[lane], start).err();
                }
            }
            self.kernel.end((index, h), members, &self.trees);
            for (lane, member) in members.iter().enumerate() {
                if self.kernel.what[lane] != Lane::Idle {
                    self.unwrap_angles(lane, member);
                }
            }
        }
        for lane in 0..self.count {
            if alone[lane] && failures[lane].is_none() {
                self.load(lane, members[lane].state());
            } else if self.kernel.what[lane] != Lane::Idle {
                let ((t, from), step) = (self.origins[lane], self.at[lane].1 + 1);
                self.at[lane] = (t + (step - from) as f64 * self.step, step);
            }
        }
    }
}

/// A step by the integrator of the member.
fn take_alone(member: &mut MechanismIntegrator, start: State) -> Result<(), StepError> {
    put(member, start)?;
    member.step().map(|_| ())
}

/// Moves a member to a state of its motion.
fn put(member: &mut MechanismIntegrator, state: State) -> Result<(), StepError> {
    member.resume(state).map_err(|error| match error {
        ResumeError::Violated(error) => error,
        _ => StepError::Newton(NewtonError::Refused { fault: Fault::NotFinite, iteration: 0 }),
    })
}

impl<T: Register> Group for Lanewise<T> {
    fn count(&self) -> usize {
        self.count
    }

    fn alone(&self) -> u64 {
        self.alone
    }

    fn advance(
        &mut self,
        members: &mut [MechanismIntegrator],
        failures: &mut [Option<StepError>],
        steps: u64,
    ) {
        for (lane, (member, failure)) in members.iter().zip(failures.iter()).enumerate() {
            self.load(lane, member.state());
            if failure.is_some() {
                self.kernel.what[lane] = Lane::Idle;
            }
        }
        for _ in 0..steps {
            if self.kernel.what[..self.count].iter().all(|what| *what == Lane::Idle) {
                break;
            }
            self.step(members, failures);
        }
        for (lane, (member, failure)) in members.iter_mut().zip(failures).enumerate() {
            if self.kernel.what[lane] != Lane::Idle {
                let state = self.state(lane, member.state());
                *failure = put(member, state).err();
            }
        }
    }
}
