//! The energy–momentum schemes as a [`Method`].
//!
//! The multiplier of a node is the mean of the steps beside it; where there is only one of them (at the
//! start, and where a step fails), and with a composition, it is taken from the acceleration level.

use super::work::Work;
use super::{Method, Reading};
use crate::sample::{Momenta, Residuals};
use vi_constraints::Constraints;
use vi_constraints::discretization::Step;
use vi_constraints::initialization::StartReport;
use vi_constraints::integrator::StepReport;
use vi_constraints::node::Node;
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::scheme::{Condition, StepError};
use vi_core::State;
use vi_core::linear::Singular;
use vi_emscheme::EmIntegrator;
use vi_multibody::mechanism::Mechanism;

/// One of the three forms.
pub(crate) struct EnergyMomentum {
    run: EmIntegrator<Mechanism>,
    momenta: bool, // whether they are asked for
    work: Work,
    scratch: Vec<f64>, // n
    rates: Vec<f64>,   // m  ∂g/∂t
}

impl EnergyMomentum {
    pub(crate) fn new(run: EmIntegrator<Mechanism>, momenta: bool) -> Self {
        let (start, mechanism) = (run.state(), run.constraints());
        let work = Work::new(&start.q, &start.v, false); // the multipliers of the step are at hand
        let driven = mechanism.is_rheonomic();
        let rates = vec![0.0; if driven { mechanism.len() } else { 0 }];
        let scratch = vec![0.0; start.q.len()];
        Self { run, momenta, work, scratch, rates }
    }

    /// What these schemes have of the momenta of a node: they have no discrete Lagrangian.
    fn momenta(&self, node: &Node) -> Option<Box<Momenta>> {
        if !self.momenta {
            return None;
        }
        Some(Box::new(Momenta {
            lambda: node.lambda.clone(),
            p: node.p.clone(),
            hamiltonian: node.hamiltonian,
            ..Momenta::default()
        }))
    }

    /// A node with its momenta and the work up to it; `before`: that of the step which started there is left out.
    fn read(&self, before: bool, at: &State, node: &Node) -> Reading {
        let (momenta, work) = (self.momenta(node), self.work.known(before));
        Reading { momenta, ..reading(self.run.constraints(), at, node, work) }
    }
}

fn reading(mechanism: &Mechanism, at: &State, node: &Node, work: f64) -> Reading {
    let energy = node.hamiltonian_projected.total();
    Reading {
        step: at.step,
        t: at.t,
        q: at.q.clone(),
        v: at.v.clone(),
        lambda: node.lambda.clone(),
        energy,
        hamiltonian: energy,
        shadow: Some(energy),
        work,
        momentum: mechanism.momentum(&at.q, &node.p),
        residuals: Residuals {
            position: node.position_residual,
            velocity: node.velocity_residual,
            momentum: node.momentum_residual,
        },
        momenta: None,
    }
}

impl Method for EnergyMomentum {
    fn step(&mut self) -> Result<StepReport, StepError> {
        let Self { run, work, scratch, rates, .. } = self;
        work.begin();
        let taken = run.step_with(&mut |system, mechanism, Step { s, multipliers: mu }| {
            work.add_known(system.work(s, scratch));
            if !rates.is_empty() {
                // prescribed motions do h λ·∂g/∂t, with μ = h²λ
                mechanism.time_derivative(s.t_mid(), &s.q_mid, rates);
                let power: f64 = mu.iter().zip(&*rates).map(|(mu, rate)| mu * rate).sum();
                work.add_known(power / s.h);
            }
        });
        if taken.is_err() {
            work.take_back();
        }
        taken
    }

    fn place(&self) -> (u64, f64, &[f64]) {
        let state = self.run.state();
        (state.step, state.t, &state.q)
    }

    fn reads_first(&self) -> bool {
        self.run.is_composed()
    }

    fn here(&mut self, multipliers: bool) -> Result<Reading, Singular> {
        let node = self.run.observe_state()?.clone();
        let mut found = self.read(false, self.run.state(), &node);
        found.lambda.clear();
        if multipliers || self.momenta {
            found.lambda = self.run.acceleration_multiplier()?;
        }
        if let Some(momenta) = &mut found.momenta {
            momenta.lambda.clone_from(&found.lambda);
        }
        Ok(found)
    }

    fn left(&mut self) -> Result<Reading, Singular> {
        let node = self.run.node_before()?.clone();
        Ok(self.read(true, self.run.before(), &node))
    }

    fn last(&mut self, multipliers: bool) -> Result<Reading, Singular> {
        if self.run.is_composed() {
            return self.here(multipliers);
        }
        match self.run.observe().cloned() {
            Ok(node) => Ok(self.read(false, self.run.state(), &node)),
            Err(_) => self.here(multipliers),
        }
    }

    fn mechanism(&self) -> &Mechanism {
        self.run.constraints()
    }

    fn rows(&self) -> &IndependentRows {
        self.run.rows()
    }

    fn start_report(&self) -> &StartReport {
        self.run.start_report()
    }

    fn condition(&mut self) -> Option<Condition> {
        self.run.condition()
    }

    fn energy_momentum(&mut self) -> Option<&mut EmIntegrator<Mechanism>> {
        Some(&mut self.run)
    }
}
