//! An energy–momentum integrator as a [`Motion`].

use super::equations::{Equations, Observed, OfSystem};
use super::frequency::frequency;
use super::running::{Product, momentum_size, nature};
use super::subject::{Invariants, Motion, Nature, Reactions, Values};
use vi_constraints::Constraints;
use vi_constraints::discretization::Step;
use vi_constraints::initialization::{InitialValues, start};
use vi_constraints::scheme::Condition;
use vi_constraints::tangent_map::Tangents;
use vi_core::interval::Interval;
use vi_core::linear::norm_inf;
use vi_core::{MechanicalSystem, SeparableSystem};
use vi_emscheme::constraint::DiscreteConstraints;
use vi_emscheme::tangent_map::EmTangentMap;
use vi_emscheme::{EmIntegrator, EmSystem};
use vi_multibody::mechanism::Mechanism;

/// An energy–momentum integrator in motion.
pub struct EmRunning {
    run: EmIntegrator<Mechanism>,
    forces: SeparableSystem, // the same system, to ask for its potential and forces
    tangent: Option<EmTangentMap>,
    velocity_level: f64, // the largest Ḡ Δq/h of the sub-steps of a composition
}

impl EmRunning {
    /// From its present node; `forces` is the variational description of the same system.
    #[must_use]
    pub fn new(run: EmIntegrator<Mechanism>, forces: SeparableSystem) -> Self {
        Self { run, forces, tangent: None, velocity_level: 0.0 }
    }
}

impl Motion for EmRunning {
    fn step(&mut self) -> Result<(), String> {
        let mut levels = vec![0.0];
        let stepped = match self.run.is_composed() {
            true => self.run.step_with(&mut |_, mechanism, Step { s, .. }| {
                levels.push(velocity_level(mechanism, s));
            }),
            false => self.run.step(),
        };
        stepped.map_err(|e| e.to_string())?;
        self.velocity_level = norm_inf(&levels);
        Ok(())
    }

    fn reverse(&mut self) {
        self.run.reverse();
    }

    fn q(&self) -> &[f64] {
        &self.run.state().q
    }

    fn time(&self) -> f64 {
        self.run.state().t
    }

    fn p(&self) -> Vec<f64> {
        let v = &self.run.state().v;
        let mut p = vec![0.0; v.len()];
        self.run.system().mass().mul_add(1.0, v, &mut p);
        p
    }

    fn velocity(&mut self) -> Result<Vec<f64>, String> {
        Ok(self.run.state().v.clone())
    }

    fn consistent(&self, q: &[f64], v: &[f64]) -> Result<(Vec<f64>, Vec<f64>), String> {
        let (mechanism, at) = (self.run.constraints(), self.run.state().t);
        let found = start(&self.forces, mechanism, self.run.rows(), InitialValues::new(at, q, v));
        found.map(|found| (found.state.q, found.v)).map_err(|e| e.to_string())
    }

    fn frequency(&mut self) -> Result<Option<f64>, String> {
        let lambda = self.run.acceleration_multiplier().map_err(|e| e.to_string())?;
        let (mechanism, state, rows) = (self.run.constraints(), self.run.state(), self.run.rows());
        Ok(frequency(&self.forces, mechanism, rows, ((state.t, &state.q), &lambda)))
    }

    fn equations(&self) -> Box<dyn Equations + '_> {
        let (constraints, angles) = (self.run.constraints(), &self.run.state().angles[..]);
        let redundant = self.run.rows().len() < Constraints::len(constraints);
        Box::new(OfSystem { system: &self.forces, constraints, angles, redundant })
    }

    fn values(&mut self) -> Result<Values, String> {
        let node = self.run.observe().map_err(|e| e.to_string())?.clone();
        let (mechanism, state) = (self.run.constraints(), self.run.state());
        let redundant = self.run.rows().len() < Constraints::len(mechanism);
        let joints = mechanism.reactions((state.t, &state.q), &node.lambda, self.run.rows());
        let composed = self.run.is_composed(); // no multiplier of a step belongs to a node
        let reactions = (!composed && !joints.is_empty())
            .then(|| Reactions { lambda: node.lambda.clone(), joints });
        let (mean, single) = match redundant {
            true => (node.constraint_force, node.constraint_force_mid),
            false => (node.lambda, node.lambda_mid),
        };
        let some = |lambda: Vec<f64>| (!composed && !lambda.is_empty()).then_some(lambda);
        Ok(Values {
            reactions,
            q: state.q.clone(),
            p: node.p,
            p_constrained: None,
            lambda: some(mean),
            lambda_other: some(single),
        })
    }

    fn invariants(&mut self) -> Result<Invariants, String> {
        let node = self.run.node_before().map_err(|e| e.to_string())?.clone();
        let (at, mechanism) = (self.run.before(), self.run.constraints());
        let momentum = |p: &[f64]| mechanism.momentum(&at.q, p);
        let energy = node.hamiltonian_projected.total();
        let kinetic = node.hamiltonian_projected.kinetic;
        Ok(Invariants {
            energy,
            discrete_energy: energy,
            energy_size: kinetic.max((energy - kinetic).abs()),
            momentum: momentum(&node.p),
            momentum_size: momentum_size(&momentum, &node.p),
            position: node.position_residual,
            velocity: if self.run.is_composed() {
                self.velocity_level
            } else {
                node.velocity_residual
            },
            // in a composition it is of higher order and soon at round-off
            momentum_level: (!self.run.is_composed()).then_some(node.momentum_residual),
            size: norm_inf(&at.q),
        })
    }

    fn nature(&mut self) -> Result<Nature, String> {
        let (state, mechanism) = (self.run.state(), self.run.constraints());
        Ok(nature(&self.forces, mechanism, (state.configuration(), &state.v)))
    }

    fn condition(&mut self) -> Option<Condition> {
        self.run.condition()
    }

    fn tangents(&mut self) -> Tangents {
        let (state, rows) = (self.run.state(), self.run.rows());
        let at = (state.t, &state.q[..]);
        let (map, tangents) =
            EmTangentMap::begin(self.run.system(), self.run.constraints(), rows, at);
        self.tangent = Some(map);
        tangents
    }

    fn step_tangents(&mut self, tangents: &mut Tangents) -> Result<(), String> {
        let map = self.tangent.as_mut().ok_or("no tangent vectors were asked for")?;
        let mut pushed = Ok(());
        let mut each = |system: &EmSystem, mechanism: &Mechanism, step: Step<'_>| {
            if pushed.is_ok() {
                pushed = map.push(system, mechanism, (step.s, step.multipliers), tangents);
            }
        };
        self.run.step_with(&mut each).map_err(|e| e.to_string())?;
        pushed.map_err(|e| e.to_string())
    }
}

/// `|Ḡ Δq/h|_∞`; of constraints that depend on time `|Δg/h|_∞`.
fn velocity_level(mechanism: &Mechanism, s: &Interval) -> f64 {
    let mut rate = vec![0.0; Constraints::len(mechanism)];
    if mechanism.is_rheonomic() {
        mechanism.value(s.end(), &mut rate);
        return norm_inf(&rate) / s.h.abs();
    }
    mechanism.discrete_jacobian(s, &mut Product { v: &s.v_mid, out: &mut rate });
    norm_inf(&rate)
}
