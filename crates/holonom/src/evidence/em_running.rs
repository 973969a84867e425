//! An energy–momentum integrator as a [`Motion`].

use super::running::{momentum_size, nature};
use super::subject::{Kept, Motion, Nature, Values};
use vi_constraints::Constraints;
use vi_constraints::scheme::Condition;
use vi_constraints::tangent_map::Tangents;
use vi_core::interval::Interval;
use vi_core::linear::norm_inf;
use vi_core::{MechanicalSystem, SeparableSystem, SparseMatrix};
use vi_emscheme::tangent_map::EmTangentMap;
use vi_emscheme::{EmIntegrator, EmSystem};
use vi_multibody::mechanism::Mechanism;

/// An energy–momentum integrator in motion.
pub struct EmRunning {
    run: EmIntegrator<Mechanism>,
    forces: SeparableSystem, // the same system, to ask for its potential and forces
    tangent: Option<EmTangentMap>,
}

impl EmRunning {
    /// From its present node; `forces` is the variational description of the same system.
    #[must_use]
    pub fn new(run: EmIntegrator<Mechanism>, forces: SeparableSystem) -> Self {
        Self { run, forces, tangent: None }
    }
}

impl Motion for EmRunning {
    fn step(&mut self) -> Result<(), String> {
        self.run.step().map_err(|e| e.to_string())?;
        self.forces.accept(&self.run.state().q);
        Ok(())
    }

    fn reverse(&mut self) {
        self.run.reverse();
    }

    fn q(&self) -> &[f64] {
        &self.run.state().q
    }

    fn values(&mut self) -> Result<Values, String> {
        let node = self.run.observe().map_err(|e| e.to_string())?.clone();
        let (mechanism, state) = (self.run.constraints(), self.run.state());
        let redundant = self.run.rows().len() < Constraints::len(mechanism);
        let (mean, single) = match redundant {
            true => (node.constraint_force, node.constraint_force_mid),
            false => (node.lambda, node.lambda_mid),
        };
        let composed = self.run.is_composed(); // no multiplier of a step belongs to a node
        let some = |lambda: Vec<f64>| (!composed && !lambda.is_empty()).then_some(lambda);
        Ok(Values {
            q: state.q.clone(),
            p: node.p,
            p_constrained: None,
            lambda: some(mean),
            lambda_other: some(single),
        })
    }

    fn kept(&mut self) -> Result<Kept, String> {
        let node = self.run.node_before().clone();
        let (at, mechanism) = (self.run.before(), self.run.constraints());
        let momentum = |p: &[f64]| mechanism.momentum(&at.q, p);
        let kinetic = self.forces.kinetic_energy(&at.v);
        Ok(Kept {
            energy: node.energy,
            discrete_energy: node.energy,
            energy_size: kinetic.max((node.energy - kinetic).abs()),
            momentum: momentum(&node.p),
            momentum_size: momentum_size(&momentum, &node.p),
            residuals: [node.position_residual, node.velocity_residual, node.momentum_residual],
            size: norm_inf(&at.q),
        })
    }

    fn nature(&mut self) -> Result<Nature, String> {
        let (state, mechanism) = (self.run.state(), self.run.constraints());
        let at = (state.t, &state.q[..], &state.v[..]);
        let momentum = |p: &[f64]| mechanism.momentum(&state.q, p);
        let (m, n) = (Constraints::len(mechanism), mechanism.dim());
        let emit = |out: &mut dyn vi_core::Entries| mechanism.jacobian(state.t, &state.q, out);
        let jacobian = SparseMatrix::assemble(m, n, emit);
        Ok(nature(&self.forces, mechanism.is_rheonomic(), at, (&momentum, &jacobian)))
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
        let mut each = |at: (&EmSystem, &Mechanism), s: &Interval, mu: &[f64]| {
            if pushed.is_ok() {
                pushed = map.push(at.0, at.1, (s, mu), tangents);
            }
        };
        self.run.step_with(&mut each).map_err(|e| e.to_string())?;
        self.forces.accept(&self.run.state().q);
        pushed.map_err(|e| e.to_string())
    }
}
