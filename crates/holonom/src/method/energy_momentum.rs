//! The energy–momentum schemes as a [`Method`].
//!
//! The multiplier of a node is the mean of the steps beside it; where there is only one of them (at the
//! start, and where a step fails), and with a composition, it is taken from the acceleration level, with the forces of the
//! variational description: in the limit of short steps both descriptions are the same system.

use super::work::Work;
use super::{Method, Reading};
use crate::sample::{Momenta, Residuals};
use vi_constraints::Constraints;
use vi_constraints::initialization::StartReport;
use vi_constraints::integrator::StepReport;
use vi_constraints::node::NodeObserver;
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::scheme::{Condition, StepError};
use vi_core::linear::Singular;
use vi_core::{Energies, MechanicalSystem, SeparableSystem, State};
use vi_emscheme::{EmIntegrator, EmNode};
use vi_multibody::mechanism::Mechanism;

/// One of the three forms.
pub(crate) struct EnergyMomentum {
    run: EmIntegrator<Mechanism>,
    forces: SeparableSystem,
    observer: Option<NodeObserver>, // made when first asked for
    momenta: bool,                  // whether they are asked for
    work: Work,
    rates: Vec<f64>, // m  ∂g/∂t
}

impl EnergyMomentum {
    pub(crate) fn new(
        run: EmIntegrator<Mechanism>,
        forces: SeparableSystem,
        momenta: bool,
    ) -> Self {
        let (start, mechanism) = (run.state(), run.constraints());
        let work = Work::new(&start.q, &start.v, false); // the multipliers of the step are at hand
        let driven = mechanism.is_rheonomic();
        let rates = vec![0.0; if driven { mechanism.len() } else { 0 }];
        Self { run, forces, observer: None, momenta, work, rates }
    }

    /// What these schemes have of the momenta of a node: they have no discrete Lagrangian.
    fn momenta(&self, at: &State, node: &EmNode) -> Option<Box<Momenta>> {
        if !self.momenta {
            return None;
        }
        let kinetic = self.forces.kinetic_energy(&at.v);
        let potential = self.run.system().potential_energy(at.configuration());
        Some(Box::new(Momenta {
            lambda: node.lambda.clone(),
            p: node.p.clone(),
            hamiltonian: Some(Energies { kinetic, potential }),
            ..Momenta::default()
        }))
    }

    /// A node with its momenta and the work up to it; `before`: that of the step which started there is left out.
    fn read(&self, before: bool, at: &State, node: &EmNode) -> Reading {
        let (momenta, work) = (self.momenta(at, node), self.work.known(before));
        Reading { momenta, ..reading(self.run.constraints(), at, node, work) }
    }

    fn acceleration_multiplier(&mut self) -> Result<Vec<f64>, Singular> {
        let (mechanism, rows, forces) = (self.run.constraints(), self.run.rows(), &self.forces);
        let mut lambda = vec![0.0; mechanism.len()];
        let observer =
            self.observer.get_or_insert_with(|| NodeObserver::new(forces, mechanism.len(), rows));
        let state = self.run.state();
        let at = (state.configuration(), &state.v[..]);
        observer.acceleration_multiplier(forces, mechanism, at, &mut lambda)?;
        Ok(lambda)
    }
}

fn reading(mechanism: &Mechanism, at: &State, node: &EmNode, work: f64) -> Reading {
    Reading {
        step: at.step,
        t: at.t,
        q: at.q.clone(),
        v: at.v.clone(),
        lambda: node.lambda.clone(),
        energy: node.energy,
        hamiltonian: node.energy,
        shadow: Some(node.energy),
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
        let Self { run, forces, work, rates, .. } = self;
        work.begin();
        let taken = run.step_with(&mut |(_, mechanism), s, mu| {
            work.add_forces(forces, s);
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
        let node = self.run.observe_state().clone();
        let mut found = self.read(false, self.run.state(), &node);
        found.lambda.clear();
        if multipliers || self.momenta {
            found.lambda = self.acceleration_multiplier()?;
        }
        if let Some(momenta) = &mut found.momenta {
            momenta.lambda.clone_from(&found.lambda);
        }
        Ok(found)
    }

    fn left(&mut self) -> Result<Reading, Singular> {
        let node = self.run.node_before().clone();
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
