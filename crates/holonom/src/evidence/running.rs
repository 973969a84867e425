//! An integrator as a [`Motion`].

use super::subject::{Kept, Motion, Nature, Values};
use vi_constraints::scheme::Condition;
use vi_constraints::tangent_map::{TangentMap, Tangents};
use vi_constraints::{Constraints, Integrator};
use vi_core::linear::norm_inf;
use vi_core::momentum_map::Momentum;
use vi_core::{MechanicalSystem, SparseMatrix};

/// The momentum map `J(q, p)` of a system, linear in `p`.
pub type MomentumMap<C> = fn(&C, &[f64], &[f64]) -> Momentum;

/// An integrator in motion, with its momentum map.
pub struct Running<S, C> {
    run: Integrator<S, C>,
    momentum: MomentumMap<C>,
    tangent: Option<TangentMap>,
    discrete_energy: f64, // J  Σ γ_i E_{d,i} of the last step
}

impl<S: MechanicalSystem + 'static, C: Constraints + 'static> Running<S, C> {
    /// From its present node.
    pub fn new(run: Integrator<S, C>, momentum: MomentumMap<C>) -> Self {
        Self { run, momentum, tangent: None, discrete_energy: 0.0 }
    }

    /// `λ` as it is compared: itself, or the force `Gᵀλ` where rows are redundant.
    fn unique(&self, lambda: Vec<f64>) -> Vec<f64> {
        let (constraints, state) = (self.run.constraints(), self.run.state());
        let (m, n) = (constraints.len(), constraints.dim());
        if self.run.rows().len() == m {
            return lambda;
        }
        let emit = |out: &mut dyn vi_core::Entries| constraints.jacobian(state.t, &state.q, out);
        let mut force = vec![0.0; n];
        SparseMatrix::assemble(m, n, emit).tr_mul_add(1.0, &lambda, &mut force);
        force
    }
}

/// Each component of a momentum map with the absolute values of its terms summed up.
pub(crate) fn momentum_size(of: &dyn Fn(&[f64]) -> Momentum, p: &[f64]) -> Momentum {
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

/// Whether translations and rotations leave `∇V`, the force and `g` alone at a placement.
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
    let kept = |generator: &Vec<f64>| {
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
    out.iter_mut().zip(&generators).for_each(|(out, generator)| *out = kept(generator));
    out
}

/// What holds of a system at a node `(t, q, v)` with its momentum map and its Jacobian.
pub(crate) fn nature(
    system: &impl MechanicalSystem,
    rheonomic: bool,
    (t, q, v): (f64, &[f64], &[f64]),
    (momentum, jacobian): (&dyn Fn(&[f64]) -> Momentum, &SparseMatrix),
) -> Nature {
    let (mut gradient, mut force) = (vec![0.0; q.len()], vec![0.0; q.len()]);
    system.add_potential_gradient(q, 1.0, &mut gradient);
    system.add_force(t, q, v, &mut force);
    Nature {
        symmetries: symmetries(momentum, jacobian, [&gradient, &force]),
        conservative: norm_inf(&force) == 0.0 && !rheonomic,
        dissipative: system.is_dissipative(),
    }
}

impl<S: MechanicalSystem + 'static, C: Constraints + 'static> Motion for Running<S, C> {
    fn step(&mut self) -> Result<(), String> {
        let (mut action_rate, mut length) = (0.0, 0.0); // −∂/∂h of the action: E_d weighted with the sub-steps
        let stepped = self.run.step_with(&mut |system, _, s| {
            action_rate += s.h * system.discrete_energy(s);
            length += s.h;
        });
        stepped.map_err(|e| e.to_string())?;
        self.discrete_energy = action_rate / length;
        Ok(())
    }

    fn reverse(&mut self) {
        self.run.reverse();
    }

    fn q(&self) -> &[f64] {
        &self.run.state().q
    }

    fn values(&mut self) -> Result<Values, String> {
        let acceleration = self.run.acceleration_multiplier().map_err(|e| e.to_string())?;
        let (q, m) = (self.run.state().q.clone(), acceleration.len());
        let node = self.run.observe().map_err(|e| e.to_string())?.clone();
        let of_a_step = !self.run.is_composed();
        Ok(Values {
            q,
            p: node.p_projected,
            p_constrained: (of_a_step && node.hamiltonian.is_some()).then_some(node.p),
            lambda: (of_a_step && m > 0).then(|| self.unique(node.lambda)),
            lambda_other: (m > 0).then(|| self.unique(acceleration)),
        })
    }

    fn kept(&mut self) -> Result<Kept, String> {
        let node = self.run.node_before().map_err(|e| e.to_string())?.clone();
        let (at, constraints) = (self.run.before(), self.run.constraints());
        let momentum = |p: &[f64]| (self.momentum)(constraints, &at.q, p);
        let kinetic = self.run.system().kinetic_energy(&node.v);
        let potential = node.hamiltonian_projected.total() - kinetic;
        Ok(Kept {
            energy: node.hamiltonian_projected.total(),
            discrete_energy: self.discrete_energy,
            energy_size: kinetic.abs().max(potential.abs()),
            momentum: momentum(&node.p_projected),
            momentum_size: momentum_size(&momentum, &node.p_projected),
            residuals: [node.position_residual, node.velocity_residual, node.momentum_residual],
            size: norm_inf(&at.q),
        })
    }

    fn nature(&mut self) -> Result<Nature, String> {
        let v = self.run.observe_state().map_err(|e| e.to_string())?.v.clone();
        let (state, constraints) = (self.run.state(), self.run.constraints());
        let (m, n) = (constraints.len(), constraints.dim());
        let emit = |out: &mut dyn vi_core::Entries| constraints.jacobian(state.t, &state.q, out);
        let jacobian = SparseMatrix::assemble(m, n, emit);
        let momentum = |p: &[f64]| (self.momentum)(constraints, &state.q, p);
        let (at, rheonomic) = ((state.t, &state.q[..], &v[..]), constraints.is_rheonomic());
        Ok(nature(self.run.system(), rheonomic, at, (&momentum, &jacobian)))
    }

    fn condition(&mut self) -> Option<Condition> {
        self.run.condition()
    }

    fn tangents(&mut self) -> Tangents {
        let (constraints, rows, state) =
            (self.run.constraints(), self.run.rows(), self.run.state());
        self.tangent = Some(TangentMap::new(constraints.len(), rows, &state.p));
        Tangents::canonical(constraints, rows, (state.t, &state.q))
    }

    fn step_tangents(&mut self, tangents: &mut Tangents) -> Result<(), String> {
        let map = self.tangent.as_mut().ok_or("no tangent vectors were asked for")?;
        let mut pushed = Ok(());
        let stepped = self.run.step_with(&mut |system, constraints, s| {
            if pushed.is_ok() {
                pushed = map.push(system, constraints, s, tangents);
            }
        });
        stepped.map_err(|e| e.to_string())?;
        pushed.map_err(|e| e.to_string())
    }
}
