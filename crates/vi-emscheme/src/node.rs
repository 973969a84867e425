//! What can be said at a node, and of the step that starts there.
//!
//! ```text
//! H_n = ½ v_nᵀ M v_n + V(q_n),    p_n = M v_n
//! λ_{n+1/2}   of the step n → n+1,    force Ḡᵀ λ_{n+1/2}
//! λ_n         = ½ (λ_{n-1/2} + λ_{n+1/2}),    force G(q_n)ᵀ λ_n
//! residuals   g(q_n),   Ḡ Δq/h  (zero; rheonomic: Δg/h),   G(q_n) v_n + ∂g/∂t  (O(h²))
//! ```
//! *Order of the multipliers.* `v_{n+1} = (2/h)Δq − v_n` turns the sign of the part of `v_n` that
//! is not tangential; a start with `G(q_0) v(0) = 0` misses the smooth solution there by `O(h²)`,
//! so this part alternates from node to node for ever, and `λ_{n+1/2} ~ M(v_{n+1} − v_n)/h` with
//! it, by `O(h)`: order 1 by itself, unless the start is at rest. The mean of two neighbours does
//! not see the alternation: it belongs to the node and has order 2, as `q_n` and `p_n` have.
//!
//! The mean of the two forces is no constraint force of the node: it has a part of order `h²`
//! outside the range of `G(q_n)ᵀ`, and what joints transmit would depend on how that is shared out.
//!
//! Redundant constraints: the force of a step is unique, the multipliers are given in minimum-norm
//! form. The force of a node is that of multipliers in units of their rows ([`UnitRows`]), which
//! are the same in all units of length.

use crate::constraint::DiscreteConstraints;
use crate::em_system::EmSystem;
use vi_constraints::discretization::{ObserveNode, Transition};
use vi_constraints::least_norm::LeastNorm;
use vi_constraints::node::Node;
use vi_constraints::null_space::RANK_TOLERANCE;
use vi_constraints::projection::Projections;
use vi_constraints::redundancy::minimum_norm;
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::unit_rows::UnitRows;
use vi_core::interval::Interval;
use vi_core::linear::{Singular, norm_inf};
use vi_core::sparse::{Entries, SparseMatrix};
use vi_core::state::State;
use vi_core::{Energies, MechanicalSystem};

/// Computes the [`Node`]s of energy–momentum schemes: `p_n = M v_n` is `p` and `ᵠp`, `H_n` is every
/// energy, `λ_n` is the mean of the steps beside the node (order 2), at the start the multiplier of
/// the step after it.
#[derive(Debug)]
pub struct EmObserver {
    node: Node,
    rows: IndependentRows,
    wanted: bool,                           // whether multipliers are
    projections: Option<Projections>,       // made when first asked for
    jacobian: Option<SparseMatrix>,         // m × n  Ḡ
    jacobian_of_node: Option<SparseMatrix>, // m × n  G
    least_norm: LeastNorm,
    unit_rows: Option<UnitRows>, // where constraints are redundant, made when first asked for
    own: Vec<f64>,               // m  the multipliers of the node that its force is of
    work: Vec<f64>,              // m
}

impl EmObserver {
    /// For `n` coordinates and an independent set of the `m` constraints.
    #[must_use]
    pub fn new(n: usize, m: usize, rows: &IndependentRows) -> Self {
        let zeros = |k: usize| vec![0.0; k];
        let node = Node {
            v: zeros(n),
            p: zeros(n),
            p_bar: zeros(n),
            p_projected: zeros(n),
            lambda: zeros(m),
            constraint_force: zeros(n),
            lambda_mid: zeros(m),
            constraint_force_mid: zeros(n),
            ..Node::default()
        };
        Self {
            node,
            rows: rows.clone(),
            wanted: true,
            projections: None,
            jacobian: None,
            jacobian_of_node: None,
            least_norm: LeastNorm::default(),
            unit_rows: None,
            own: zeros(m),
            work: zeros(m),
        }
    }

    /// Energy, momentum, residuals; no multipliers.
    fn read_state<C: DiscreteConstraints>(
        &mut self,
        system: &EmSystem,
        constraints: &C,
        state: &State,
    ) {
        let node = &mut self.node;
        node.v.copy_from_slice(&state.v);
        node.p.copy_from_slice(&state.p);
        node.p_bar.copy_from_slice(&state.p);
        node.p_projected.copy_from_slice(&state.p);
        let (kinetic, at) = (system.kinetic_energy(&state.v), state.configuration());
        let energy = Energies { kinetic, potential: system.potential_energy(at) };
        (node.discrete_energy, node.hamiltonian_projected) = (energy, energy);
        node.hamiltonian = Some(energy);
        constraints.residual(at, &mut self.work);
        node.position_residual = norm_inf(&self.work);

        constraints.time_derivative(state.t, &state.q, &mut self.work);
        constraints.add_rates(state.t, &state.q, &state.v, &mut self.work);
        node.momentum_residual = norm_inf(&self.work);
        node.velocity_residual = node.momentum_residual;
    }
}

impl EmObserver {
    /// `λ_{n+1/2}` of the step `s` and `λ_n` with their forces; the state remembers the step
    /// before.
    fn read_multipliers<C: DiscreteConstraints>(
        &mut self,
        constraints: &C,
        state: &State,
        s: &Interval,
        mu: &[f64],
    ) {
        self.own.fill(0.0);
        let before = state.memory.last.as_ref();
        if let Some(before) = before {
            let own = &state.memory.multipliers;
            self.read_step(constraints, before, own, s.h, 0.5);
            std::mem::swap(&mut self.node.lambda, &mut self.node.lambda_mid);
        }
        self.read_step(constraints, s, mu, s.h, if before.is_some() { 0.5 } else { 1.0 });
        let Self { node, jacobian_of_node, own, .. } = self;
        let Node { lambda, lambda_mid, constraint_force: force, .. } = node;
        match before {
            Some(_) => lambda.iter_mut().zip(lambda_mid).for_each(|(a, b)| *a = 0.5 * (*a + *b)),
            None => lambda.copy_from_slice(lambda_mid),
        }
        let emit = |out: &mut dyn Entries| constraints.jacobian(state.t, &state.q, out);
        let shape = (constraints.len(), constraints.dim());
        let at_node = SparseMatrix::update(jacobian_of_node, shape, emit);
        force.fill(0.0);
        at_node.tr_mul_add(1.0, own, force);
    }

    /// `λ_{n+1/2}` of a step with its force, the multipliers in minimum-norm form; adds `weight` of
    /// those that the force of the node is of.
    fn read_step<C: DiscreteConstraints>(
        &mut self,
        constraints: &C,
        s: &Interval,
        mu: &[f64],
        h: f64,
        weight: f64,
    ) {
        let Self { node, rows, jacobian, least_norm, unit_rows, own, work, .. } = self;
        let Node { lambda_mid: lambda, constraint_force_mid: force, .. } = node;
        let emit = |out: &mut dyn Entries| constraints.discrete_jacobian(s, out);
        let shape = (constraints.len(), constraints.dim());
        let jacobian = SparseMatrix::update(jacobian, shape, emit);
        let scale = 1.0 / (h * h);
        lambda.iter_mut().zip(mu).for_each(|(lambda, mu)| *lambda = scale * mu);
        force.fill(0.0);
        jacobian.tr_mul_add(1.0, lambda, force);
        let redundant = rows.len() < shape.0;
        if redundant {
            let unit_rows = unit_rows.get_or_insert_with(|| UnitRows::of(constraints));
            unit_rows.multipliers(jacobian, rows.len(), force, work);
            least_norm.decline(constraints.rank_tolerance() > RANK_TOLERANCE);
            minimum_norm(least_norm, jacobian, rows, force, lambda);
        }
        let of_force = if redundant { work } else { lambda };
        own.iter_mut().zip(&*of_force).for_each(|(own, lambda)| *own += weight * lambda);
    }
}

impl<C: DiscreteConstraints> ObserveNode<EmSystem, C> for EmObserver {
    fn record_multipliers(&mut self, wanted: bool) {
        self.wanted = wanted;
    }

    fn node(&self) -> &Node {
        &self.node
    }

    fn observe_state(
        &mut self,
        system: &EmSystem,
        constraints: &C,
        state: &State,
        _impulse: &[f64],
        _h: f64,
    ) -> Result<&Node, Singular> {
        self.read_state(system, constraints, state);
        Ok(&self.node)
    }

    /// The state remembers the step before.
    fn observe(
        &mut self,
        system: &EmSystem,
        constraints: &C,
        taken: Transition<'_>,
    ) -> Result<&Node, Singular> {
        let (state, s, mu) = (taken.before, taken.step.s, taken.step.multipliers);
        self.read_state(system, constraints, state);
        let (m, n) = (constraints.len(), constraints.dim());
        let Self { node, wanted, work, .. } = self;
        let emit = |out: &mut dyn Entries| constraints.discrete_jacobian(s, out);
        if constraints.is_rheonomic() {
            constraints.residual(s.end(), work);
            node.velocity_residual = norm_inf(work) / s.h.abs();
        } else {
            let jacobian = SparseMatrix::update(&mut self.jacobian, (m, n), emit);
            work.fill(0.0);
            jacobian.mul_add(1.0, &s.v_mid, work);
            node.velocity_residual = norm_inf(work);
        }
        let (size, width) = if *wanted { (m, n) } else { (0, 0) };
        for lambda in [&mut node.lambda, &mut node.lambda_mid] {
            lambda.resize(size, 0.0);
        }
        for force in [&mut node.constraint_force, &mut node.constraint_force_mid] {
            force.resize(width, 0.0);
        }
        if *wanted {
            self.read_multipliers(constraints, state, s, mu);
        }
        Ok(&self.node)
    }

    fn acceleration_force(
        &mut self,
        system: &EmSystem,
        constraints: &C,
        state: &State,
        force: &mut [f64],
        lambda: Option<&mut [f64]>,
    ) -> Result<(), Singular> {
        let make = || Projections::new(system, constraints.len(), &self.rows);
        let projections = self.projections.get_or_insert_with(make);
        let (at, v) = (state.configuration(), &state.v[..]);
        let lambda = lambda.unwrap_or(&mut self.work);
        projections.acceleration_force(system, constraints, at.moving(v), force, lambda)?;
        self.node.acceleration.clear();
        self.node.acceleration.extend_from_slice(projections.acceleration());
        Ok(())
    }
}
