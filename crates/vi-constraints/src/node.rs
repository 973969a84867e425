//! What can be said at a node: multipliers, momenta, energies, hidden constraints.
//!
//! ```text
//! λ_n, p_n, ᵠp_n, E_d, H_d    (34), (36)–(40), (47), (52), (53): the functions of [`crate::legendre`]
//! f_d = G(q_{n+1/2}) Δq/h (rheonomic: Δg/h),   h_d = G(q_n) M⁻¹ p_n                        (45), (46)
//! ```
//! An integrator carries `p̄_n` from step to step, so a node needs no interval before it. Letters as in
//! LMO08 §3.

use crate::constraints::Constraints;
use crate::legendre::add_constraint_impulse;
use crate::projection::{Projections, hamiltonian};
use crate::saddle_point::IndependentRows;
use vi_core::Configuration;
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::interval::Interval;
use vi_core::legendre::{Energies, discrete_energy, p_minus};
use vi_core::linear::{Singular, norm_inf};
use vi_core::sparse::{Entries, SparseMatrix};

/// Quantities of the node `n`, all buffers sized once.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Node {
    /// `λ_n` by (36), at the start by (47); minimum norm when `G` is rank deficient. Shape `m`.
    pub lambda: Vec<f64>,
    /// `G(q_n)ᵀ λ_n`, N; unique even where `λ_n` is not. Shape `n`.
    pub constraint_force: Vec<f64>,
    /// `λ_{n+1/2}` of the step that starts here, of schemes that find it; else empty. Shape `m`.
    pub lambda_mid: Vec<f64>,
    /// The constraint force of `λ_{n+1/2}`, N, likewise. Shape `n`.
    pub constraint_force_mid: Vec<f64>,
    /// Constrained Legendre transform `p_n` (34), (35). Shape `n`.
    pub p: Vec<f64>,
    /// Velocity `v̂` of the projected momentum. Shape `n`.
    pub v: Vec<f64>,
    /// Projected Legendre transform `ᵠp_n = M v̂` (39), (40). Shape `n`.
    pub p_projected: Vec<f64>,
    /// `E_d(q_n, q_{n+1})` (52).
    pub discrete_energy: Energies,
    /// `H_d` (53) with `p_n`; `None` when `M` is singular.
    pub hamiltonian: Option<Energies>,
    /// `H_d` (53) with `ᵠp_n`.
    pub hamiltonian_projected: Energies,
    /// `|g(q_n)|_∞`.
    pub position_residual: f64,
    /// `|f_d|_∞` (45); for rheonomic constraints `|Δg/h|_∞`.
    pub velocity_residual: f64,
    /// `|h_d|_∞` (46) with `p_n`, with `ᵠp_n` when `M` is singular.
    pub momentum_residual: f64,
}

/// Computes [`Node`]s.
#[derive(Debug)]
pub struct NodeObserver {
    projections: Projections,
    midpoint: Option<SparseMatrix>, // m × n  G(q_{n+1/2})
    m_work: Vec<f64>,               // m
    n_work: Vec<f64>,               // n
    node: Node,
}

impl NodeObserver {
    /// For a system and an independent set of its constraints.
    #[must_use]
    pub fn new(system: &impl DiscreteLagrangian, m: usize, rows: &IndependentRows) -> Self {
        let n = system.dim();
        let zeros = |k: usize| vec![0.0; k];
        Self {
            projections: Projections::new(system, m, rows),
            midpoint: None,
            m_work: zeros(m),
            n_work: zeros(n),
            node: Node {
                lambda: zeros(m),
                constraint_force: zeros(n),
                p: zeros(n),
                v: zeros(n),
                p_projected: zeros(n),
                ..Node::default()
            },
        }
    }

    /// The last node computed.
    #[must_use]
    pub fn node(&self) -> &Node {
        &self.node
    }

    /// Whether `M` is singular, so that `p_n` has no velocity.
    #[must_use]
    pub fn mass_is_singular(&self) -> bool {
        self.projections.mass_is_singular()
    }

    /// Everything at `q_n = s.q0` from the step that starts there and the momentum `p̄_n` it started
    /// with; `first`: `p̄_0 = p(0)`, so (47) holds in the place of (36).
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub fn observe(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        s: &Interval,
        p: &[f64],
        first: bool,
    ) -> Result<&Node, Singular> {
        self.observe_state(system, constraints, s.start(), p)?;
        self.multipliers(system, constraints, s, p, first)?;
        let node = &mut self.node;
        node.discrete_energy = discrete_energy(system, s); // (52)
        node.hamiltonian =
            self.projections.hamiltonian(system, s.start(), &node.p, &mut self.n_work)?; // (53)
        if node.hamiltonian.is_some() {
            constraints.time_derivative(s.t, &s.q0, &mut self.m_work);
            let jacobian = self.projections.jacobian(constraints, s.start());
            jacobian.mul_add(1.0, &self.n_work, &mut self.m_work);
            node.momentum_residual = norm_inf(&self.m_work); // (46)
        }
        if constraints.is_rheonomic() {
            constraints.value(s.end(), &mut self.m_work);
            node.velocity_residual = norm_inf(&self.m_work) / s.h.abs();
        } else {
            let shape = (constraints.len(), s.dim());
            let emit = |out: &mut dyn Entries| constraints.jacobian(s.t_mid(), &s.q_mid, out);
            let jacobian = SparseMatrix::update(&mut self.midpoint, shape, emit);
            self.m_work.fill(0.0);
            jacobian.mul_add(1.0, &s.v_mid, &mut self.m_work);
            node.velocity_residual = norm_inf(&self.m_work); // (45)
        }
        Ok(&self.node)
    }

    /// The part that needs no step from here: `v̂`, `ᵠp_n`, `H_d(ᵠp_n)`, `g(q_n)`; all there is at the
    /// macro nodes of a composition. `discrete_energy` is set to `H_d(ᵠp_n)`, the velocity residual to
    /// that of `v̂`.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub fn observe_state(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        at: Configuration<'_>,
        p: &[f64],
    ) -> Result<&Node, Singular> {
        let node = &mut self.node;
        constraints.value(at, &mut self.m_work);
        node.position_residual = norm_inf(&self.m_work);

        self.projections.velocity((system, constraints), at, p, &mut node.v)?;
        node.p_projected.fill(0.0);
        system.mass().mul_add(1.0, &node.v, &mut node.p_projected); // (40)
        node.hamiltonian_projected = hamiltonian(system, at, (&node.v, &node.p_projected)); // (53)
        node.hamiltonian = None;
        node.discrete_energy = node.hamiltonian_projected;
        constraints.time_derivative(at.t, at.q, &mut self.m_work);
        self.projections.jacobian(constraints, at).mul_add(1.0, &node.v, &mut self.m_work);
        node.velocity_residual = norm_inf(&self.m_work);
        node.momentum_residual = node.velocity_residual;
        Ok(&self.node)
    }

    fn multipliers(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        s: &Interval,
        p: &[f64],
        first: bool,
    ) -> Result<(), Singular> {
        let Node { lambda, constraint_force, p: p_n, .. } = &mut self.node;
        p_minus(system, s, p_n);
        for (w, (p, p_n)) in self.n_work.iter_mut().zip(p.iter().zip(&*p_n)) {
            *w = p - p_n;
        }
        let weight = if first { 0.5 * s.h } else { s.h }; // (47) : (36)
        let found = (&mut lambda[..], &mut constraint_force[..]);
        self.projections.multiplier(constraints, s.start(), &self.n_work, weight, found)?;
        add_constraint_impulse(0.5 * s.h, constraint_force, p_n); // (34)
        Ok(())
    }

    /// The multiplier of the acceleration level at `(t, q)` with the velocity `v`; it has the order of
    /// `v`, also at the macro nodes of a composition.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub fn acceleration_multiplier(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        at: (Configuration<'_>, &[f64]),
        lambda: &mut [f64],
    ) -> Result<(), Singular> {
        self.projections.acceleration_multiplier((system, constraints), at, lambda)
    }
}
