//! An integrator as a [`RunningMotion`].

use super::equations::{Equations, Observables, OfSystem};
use super::family::{EnergyMomentum, Variational, VerifiedFamily};
use super::frequency::frequency;
use super::subject::{Invariants, Nature, NodeValues, RunningMotion};
use vi_constraints::discretization::Discretization;
use vi_constraints::initialization::{InitialValues, start};
use vi_constraints::scheme::ConditionNumbers;
use vi_constraints::tangent_map::Tangents;
use vi_constraints::{Constraints, Integrator};
use vi_core::linear::norm_inf;
use vi_core::momentum_map::Momentum;
use vi_core::{
    Configuration, DiscreteLagrangian, Entries, MechanicalSystem, Motion, SeparableSystem,
    SparseMatrix,
};
use vi_emscheme::EmIntegrator;
use vi_emscheme::constraint::DiscreteConstraints;

/// An integrator in motion.
pub struct RunningSystem<F: VerifiedFamily<C>, C: Constraints> {
    run: Integrator<F::System, C>,
    family: F,
    discrete_energy: Option<f64>, // J  Σ γ_i E_{d,i} of the last step
}

impl<F: VerifiedFamily<C>, C: Constraints> std::fmt::Debug for RunningSystem<F, C> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Running").finish_non_exhaustive()
    }
}

impl<S: DiscreteLagrangian, C: Observables> RunningSystem<Variational<S>, C> {
    /// A variational integrator, from its present node.
    #[must_use]
    pub fn variational(run: Integrator<S, C>) -> Self {
        Self { run, family: Variational::default(), discrete_energy: None }
    }
}

impl<C: Observables + DiscreteConstraints> RunningSystem<EnergyMomentum, C> {
    /// An energy–momentum integrator, from its present node; `forces` is the variational
    /// description of the same system.
    #[must_use]
    pub fn energy_momentum(run: EmIntegrator<C>, forces: SeparableSystem) -> Self {
        let family = EnergyMomentum::new(forces);
        Self { run, family, discrete_energy: None }
    }
}

/// Each component of a momentum map with the absolute values of its terms summed up.
fn momentum_size(of: &dyn Fn(&[f64]) -> Momentum, p: &[f64]) -> Momentum {
    let (mut size, mut one) = (Momentum::default(), vec![0.0; p.len()]);
    for (k, p) in p.iter().enumerate() {
        one[k] = *p;
        let term = of(&one);
        for i in 0..3 {
            size.linear[i] += term.linear[i].abs();
            size.angular[i] += term.angular[i].abs();
        }
        one[k] = 0.0;
    }
    size
}

/// Whether translations and rotations leave `∇V`, the force and `g` alone at a configuration.
///
/// The generator of a component of `J` is `ξ = ∂J/∂p`; invariance means `G ξ = 0`, `∇V·ξ = 0`,
/// `f·ξ = 0`.
fn symmetries(
    of: &dyn Fn(&[f64]) -> Momentum,
    jacobian: &SparseMatrix,
    forces: [&[f64]; 2],
) -> [bool; 6] {
    let (m, n) = jacobian.shape();
    let mut generators = vec![vec![0.0; n]; 6];
    let mut one = vec![0.0; n];
    for k in 0..n {
        one[k] = 1.0;
        let Momentum { linear, angular } = of(&one);
        for (generator, component) in generators.iter_mut().zip(linear.iter().chain(&angular)) {
            generator[k] = *component;
        }
        one[k] = 0.0;
    }
    let rows = norm_inf(jacobian.as_sprs().data());
    let conserved = |generator: &Vec<f64>| {
        let size = norm_inf(generator);
        let mut rate = vec![0.0; m];
        jacobian.mul_add(1.0, generator, &mut rate);
        let still = |force: &&[f64]| {
            let power: f64 = force.iter().zip(generator).map(|(f, x)| f * x).sum();
            power.abs() <= 1e-9 * norm_inf(force) * size
        };
        size > 0.0 && norm_inf(&rate) <= 1e-9 * rows * size && forces.iter().all(still)
    };
    let mut out = [false; 6];
    out.iter_mut().zip(&generators).for_each(|(out, generator)| *out = conserved(generator));
    out
}

/// What holds of a system at a node `(t, q, v)`.
fn nature(
    system: &impl MechanicalSystem,
    constraints: &impl Observables,
    at: Motion<'_>,
) -> Nature {
    let Motion { t, q, .. } = at;
    let momentum = |p: &[f64]| constraints.momentum_map(q, p);
    let emit = |out: &mut dyn Entries| constraints.jacobian(t, q, out);
    let jacobian = SparseMatrix::assemble(constraints.len(), constraints.dim(), emit);
    let (mut gradient, mut force) = (vec![0.0; q.len()], vec![0.0; q.len()]);
    system.add_potential_gradient(at.configuration(), 1.0, &mut gradient);
    system.add_force(at, &mut force);
    Nature {
        symmetries: symmetries(&momentum, &jacobian, [&gradient, &force]),
        conservative: norm_inf(&force) == 0.0 && !constraints.is_rheonomic(),
        forced: norm_inf(&force) != 0.0,
        dissipative: system.is_dissipative() || system.is_sampled(),
        nonholonomic: constraints.constrains_velocities(),
    }
}

impl<F: VerifiedFamily<C>, C: Observables> RunningMotion for RunningSystem<F, C> {
    fn step(&mut self) -> Result<(), String> {
        let mut action_rate = Some(0.0); // −∂/∂h of the action: E_d weighted with the sub-steps
        let mut length = 0.0;
        let stepped = self.run.step_with(&mut |system, _, step| {
            let added = system.discrete_energy(step).zip(action_rate);
            action_rate = added.map(|(energy, rate)| rate + step.s.h * energy);
            length += step.s.h;
        });
        stepped.map_err(|e| e.to_string())?;
        self.discrete_energy = action_rate.map(|rate| rate / length);
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

    fn internal(&self) -> &[f64] {
        &self.run.state().internal
    }

    fn p(&self) -> Vec<f64> {
        self.run.state().p.clone()
    }

    fn velocity(&mut self) -> Result<Vec<f64>, String> {
        Ok(self.run.observe_state().map_err(|e| e.to_string())?.v.clone())
    }

    fn consistent(&self, q: &[f64], v: &[f64]) -> Result<(Vec<f64>, Vec<f64>), String> {
        let (system, constraints) = (self.family.exact(&self.run), self.run.constraints());
        let at = self.run.state().t;
        let found = start(system, constraints, self.run.rows(), InitialValues::new(at, q, v));
        found.map(|found| (found.state.q, found.v)).map_err(|e| e.to_string())
    }

    fn frequency(&mut self) -> Result<Option<f64>, String> {
        let lambda = self.run.acceleration_multiplier().map_err(|e| e.to_string())?;
        let (state, rows) = (self.run.state(), self.run.rows());
        let at = state.configuration();
        let system = self.family.exact(&self.run);
        Ok(frequency(system, self.run.constraints(), rows, at, &lambda))
    }

    fn equations(&self) -> Box<dyn Equations + '_> {
        let (system, constraints) = (self.family.exact(&self.run), self.run.constraints());
        let angles = &self.run.state().angles;
        let redundant = self.run.rows().len() < constraints.len();
        Box::new(OfSystem { system, constraints, angles, redundant })
    }

    fn values(&mut self) -> Result<NodeValues, String> {
        F::values(&mut self.run)
    }

    fn invariants(&mut self) -> Result<Invariants, String> {
        let node = self.run.node_before().map_err(|e| e.to_string())?.clone();
        let (at, constraints) = (self.run.before(), self.run.constraints());
        let momentum = |p: &[f64]| constraints.momentum_map(&at.q, p);
        let composed = self.run.reads_states();
        let energy = node.hamiltonian_projected.total();
        let kinetic = self.run.system().kinetic_energy(&node.v);
        Ok(Invariants {
            energy,
            discrete_energy: self.discrete_energy.unwrap_or(energy),
            energy_size: kinetic.abs().max((energy - kinetic).abs()),
            momentum: momentum(&node.p_projected),
            momentum_size: momentum_size(&momentum, &node.p_projected),
            position: beyond_allowances(constraints, at.configuration(), node.position_residual),
            // with a singular M, and at the nodes of a composition, there is no p_n to speak of
            momentum_level: (!composed && node.hamiltonian.is_some())
                .then_some(node.momentum_residual),
            size: norm_inf(&at.q),
        })
    }

    fn nature(&mut self) -> Result<Nature, String> {
        let v = self.velocity()?;
        let (system, state) = (self.family.exact(&self.run), self.run.state());
        Ok(nature(system, self.run.constraints(), state.configuration().moving(&v)))
    }

    fn condition(&mut self) -> Option<ConditionNumbers> {
        self.run.condition()
    }

    fn tangents(&mut self) -> Tangents {
        self.family.tangents(&self.run)
    }

    fn step_tangents(&mut self, tangents: &mut Tangents) -> Result<(), String> {
        let Self { run, family, .. } = self;
        let mut pushed = Ok(());
        let stepped = run.step_with(&mut |system, constraints, step| {
            if pushed.is_ok() {
                pushed = family.push(system, constraints, step, tangents);
            }
        });
        stepped.map_err(|e| e.to_string())?;
        pushed
    }
}

/// The largest residual beyond what constraints may keep that nearly follow from others; `all`:
/// that of all constraints.
fn beyond_allowances(constraints: &impl Constraints, at: Configuration<'_>, all: f64) -> f64 {
    let allowances = constraints.allowances();
    if allowances.is_empty() {
        return all;
    }
    let mut g = vec![0.0; constraints.len()];
    constraints.residual(at, &mut g);
    let beyond = g.iter().zip(allowances).filter(|(g, allowed)| g.is_nan() || g.abs() > **allowed);
    norm_inf(&beyond.map(|(g, _)| *g).collect::<Vec<f64>>())
}
