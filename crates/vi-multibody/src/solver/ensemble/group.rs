//! Members in the lanes of one kernel: their states in and out, steps, failures.

use super::kernel::{Kernel, LaneState};
use super::link::MOST;
use super::member::{EnsembleMember, LaneOf, MemberModel};
use crate::geometry::one_tree::One;
use crate::solver::run::MechanismIntegrator;
use crate::sweep::link::Link;
use std::fmt::Debug;
use vi_constraints::Options;
use vi_constraints::scheme::StepError;
#[cfg(target_arch = "x86_64")]
use vi_core::lanes::Wide;
use vi_core::lanes::{Lanes, Plain, Register, Twice};
use vi_core::newton::NewtonSettings;

/// Reads members after their steps.
pub(super) trait MemberReader {
    /// Whether a member, by its number in the group, is read after each step.
    fn wants(&self, member: usize) -> bool;
    /// Reads it.
    fn read(&mut self, member: usize, run: &mut MechanismIntegrator);
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
        reader: &mut dyn MemberReader,
    );
}

/// The first of the members in as many lanes as they fill; `None` where their topologies differ.
pub(super) fn wide(
    models: &[MemberModel],
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
    own: Vec<EnsembleMember>, // beside their lanes
    alone: u64,               // steps
    sub_steps: Vec<f64>,
    newton: NewtonSettings,
    step: f64,    // s
    raised: bool, // the floors, and before the first step
}

impl<T: Register> Lanewise<T> {
    fn new(
        lanes: T,
        models: &[MemberModel],
        members: &[MechanismIntegrator],
        options: &Options,
    ) -> Option<Self> {
        let count = models.len().min(T::Lanes::COUNT);
        let of = |lane: usize| &models[lane.min(count - 1)]; // lanes to spare are idle
        let links: Vec<&[Link<One>]> = (0..T::Lanes::COUNT).map(|k| &of(k).links[..]).collect();
        let weights: Vec<Vec<f64>> = (0..T::Lanes::COUNT).map(|k| of(k).weight.clone()).collect();
        let sub_steps = of(0).sub_steps.clone();
        let own: Vec<EnsembleMember> = models
            .iter()
            .zip(&members[..count])
            .map(|(of, run)| EnsembleMember::new(of, run))
            .collect();
        let kernel = Kernel::new(lanes, &links, &weights, &own, sub_steps.len())?;
        let (newton, step) = (options.newton, options.step);
        Some(Self { kernel, own, alone: 0, sub_steps, newton, step, raised: true })
    }

    /// Takes the state of a member into its lane.
    fn load(&mut self, lane: usize, run: &MechanismIntegrator) {
        let Self { kernel, own, sub_steps, .. } = self;
        let now = &mut own[lane].now;
        now.copy_from(run.state());
        now.history.fit(kernel.balance.len(), sub_steps.len(), 0..0);
        kernel.load(lane, now);
    }

    /// Moves the integrator of a member to the start of the macro step, of which `undone` sub-steps
    /// were taken.
    fn bring(&mut self, lane: usize, undone: usize, run: &mut MechanismIntegrator) {
        let now = &mut self.own[lane].now;
        if run.state().step != now.step {
            self.kernel.write(lane, undone, now);
            run.place_at(now);
        }
    }

    /// The floors of the increments for a sub-step of length `h`.
    fn raise_floors(&mut self, members: &[MechanismIntegrator], h: f64) {
        let (fastest, lanes) = (self.kernel.fastest(), self.kernel.lanes);
        let raises = |(lane, (run, own)): (usize, (&MechanismIntegrator, &EnsembleMember))| {
            own.has_body_forces() || run.constraints().raises_floors(h.abs() * fastest.at(lane))
        };
        let raised = members.iter().zip(&self.own).enumerate().any(raises);
        if !raised && !self.raised {
            return;
        }
        self.raised = raised;
        for (lane, (run, own)) in members.iter().zip(&mut self.own).enumerate() {
            own.set_floors(run, h.abs() * fastest.at(lane));
        }
        let (own, last) = (&self.own, self.own.len() - 1);
        for (i, floor) in self.kernel.floors.iter_mut().enumerate() {
            *floor = lanes.gather(|k| own[k.min(last)].increments.blocks()[i].floor);
        }
    }

    /// The lanes whose members move.
    fn moving(&self) -> impl Iterator<Item = usize> + use<T> {
        let what = self.kernel.what;
        (0..self.own.len()).filter(move |lane| what[*lane] != LaneState::Idle)
    }

    /// A macro step of all lanes that are not idle. A member whose lane is refused takes it alone.
    fn step(
        &mut self,
        members: &mut [MechanismIntegrator],
        failures: &mut [Option<StepError>],
        reader: &mut dyn MemberReader,
    ) {
        let count = self.sub_steps.len();
        let (mut alone, mut off) = ([false; MOST], 0);
        let reads = self.own.iter().any(|own| own.is_read);
        for lane in self.moving().filter(|_| reads) {
            if self.own[lane].is_read {
                self.bring(lane, 0, &mut members[lane]);
            }
        }
        if count > 1 {
            self.kernel.keep_start();
            self.own.iter_mut().for_each(EnsembleMember::keep_start);
        }
        for index in 0..count {
            let h = self.sub_steps[index] * self.step;
            let last = (index + 1 == count).then_some(self.step);
            for lane in self.moving().filter(|_| reads || self.kernel.acts()) {
                let (own, run) = (&mut self.own[lane], &members[lane]);
                if own.is_opened() {
                    let span = (h, own.end_of(h, last));
                    own.open(LaneOf { lane, run }, span, self.kernel.coordinates());
                }
            }
            self.raise_floors(members, h);
            self.kernel.solve(index, h, members, &mut self.own, &self.newton);
            for lane in self.moving() {
                if self.kernel.what[lane] == LaneState::Refused {
                    (self.kernel.what[lane], alone[lane]) = (LaneState::Idle, true);
                    failures[lane] = self.take_alone(lane, index, &mut members[lane]).err();
                }
            }
            off = self.kernel.end(index, h, members, &mut self.own);
            for lane in self.moving() {
                let (own, run) = (&mut self.own[lane], &members[lane]);
                let t_end = own.end_of(h, last);
                own.move_on(LaneOf { lane, run }, t_end, last.is_some(), &self.kernel.q);
            }
        }
        for lane in 0..self.own.len() {
            let run = &mut members[lane];
            if alone[lane] && failures[lane].is_none() {
                self.load(lane, run);
            } else if self.kernel.what[lane] == LaneState::Idle {
                continue;
            } else if self.own[lane].is_read {
                failures[lane] = self.give_back(lane, off & (1 << lane) == 0, run).err();
            }
            if failures[lane].is_some() {
                self.kernel.what[lane] = LaneState::Idle;
            } else if reads && reader.wants(lane) {
                reader.read(lane, run);
            }
        }
    }

    /// Gives the step of a lane to the integrator of the member, as if that had taken it.
    fn give_back(
        &mut self,
        lane: usize,
        is_clean: bool,
        run: &mut MechanismIntegrator,
    ) -> Result<(), StepError> {
        let own = &mut self.own[lane];
        own.close(lane, self.kernel.last_change());
        self.kernel.write(lane, 0, &mut own.now);
        run.take_over(&own.now, &mut own.s, is_clean)
    }

    /// A macro step by the integrator of the member, after `undone` sub-steps in its lane.
    fn take_alone(
        &mut self,
        lane: usize,
        undone: usize,
        run: &mut MechanismIntegrator,
    ) -> Result<(), StepError> {
        self.alone += 1;
        if undone > 0 {
            self.kernel.return_to_start(lane);
            self.own[lane].return_to_start();
        }
        self.bring(lane, undone, run);
        run.step().map(|_| ())
    }
}

impl<T: Register> Group for Lanewise<T> {
    fn count(&self) -> usize {
        self.own.len()
    }

    fn alone(&self) -> u64 {
        self.alone
    }

    fn advance(
        &mut self,
        members: &mut [MechanismIntegrator],
        failures: &mut [Option<StepError>],
        steps: u64,
        reader: &mut dyn MemberReader,
    ) {
        for (lane, (member, failure)) in members.iter().zip(failures.iter()).enumerate() {
            self.load(lane, member);
            if failure.is_some() {
                self.kernel.what[lane] = LaneState::Idle;
            }
        }
        for (lane, own) in self.own.iter_mut().enumerate() {
            own.is_read = reader.wants(lane);
        }
        for left in (0..steps).rev() {
            if self.moving().next().is_none() {
                break;
            }
            if left == 0 {
                self.own.iter_mut().for_each(|own| own.is_read = true);
            }
            self.step(members, failures, reader);
        }
    }
}
