//! The nodal step LMO08 (28) of a single body, in its shortest form.
#![allow(clippy::unwrap_used)] // a helper of tests
#![allow(dead_code)] // each test uses its share

use vi_constraints::{Constraints, DenseNodal, NodalOperators};
use vi_core::legendre::discrete_energy;
use vi_core::newton::{Fault, Newton, NewtonProblem, NewtonSettings, UnknownBlock};
use vi_core::state::Memory;
use vi_core::{DiscreteLagrangian, Entries, Interval, SeparableSystem, State};
use vi_rigid::SingleBody;

struct Problem {
    system: SeparableSystem,
    operators: DenseNodal<SingleBody>,
    s: Interval,
    p: Vec<f64>,
    bracket: Vec<f64>,
}

impl NewtonProblem for Problem {
    fn blocks(&self) -> &[UnknownBlock] {
        self.operators.blocks()
    }
    fn residual(&mut self, u: &[f64], r: &mut [f64]) -> Result<(), Fault> {
        self.operators.reparametrize(u, &mut self.s)?;
        self.system.forced_d1(&self.s, &mut self.bracket);
        for (b, p) in self.bracket.iter_mut().zip(&self.p) {
            *b += p;
        }
        self.operators.pull_back(&self.bracket, r);
        Ok(())
    }
    fn correction(&mut self, u: &[f64], dx: &mut [f64]) -> Result<(), Fault> {
        let Self { system, operators, s, .. } = self;
        operators.solve(&|out: &mut dyn Entries| system.forced_d2_d1(s, out), u, s, dx)
    }
}

/// Steps one body; the initial guess of each step is the last increment.
pub(crate) struct Stepper {
    problem: Problem,
    newton: Newton,
    u: Vec<f64>,
}

impl Stepper {
    pub(crate) fn new(body: SingleBody, system: SeparableSystem) -> Self {
        let n = body.dim();
        let operators = DenseNodal::new(n, body);
        let dof = operators.dof();
        let (p, bracket) = (vec![0.0; n], vec![0.0; n]);
        let problem = Problem { system, operators, s: Interval::new(n), p, bracket };
        Self { problem, newton: Newton::new(dof, NewtonSettings::default()), u: vec![0.0; dof] }
    }

    pub(crate) fn step(&mut self, h: f64, state: &mut State) -> usize {
        let problem = &mut self.problem;
        problem.s.open(state.t, h, &state.q);
        problem.p.copy_from_slice(&state.p);
        problem.operators.begin(&problem.s, &Memory::default(), None);
        let report = self.newton.solve(problem, &mut self.u).unwrap();
        problem.system.forced_d2(&problem.s, &mut state.p);
        state.q.copy_from_slice(&problem.s.q1);
        problem.operators.clean(state.t + h, &mut state.q);
        state.t += h;
        state.step += 1;
        report.iterations
    }

    pub(crate) fn discrete_energy(&self) -> f64 {
        discrete_energy(&self.problem.system, &self.problem.s).total()
    }
}
