//! What can be said at a node: multipliers, momenta, energies, hidden constraints.
//!
//! ```text
//! λ_n   = R_dᵀ [p̄_n + D_1 L_d(q_n, q_{n+1}) + f_d^-],  R_d = G_dᵀ (G_d G_dᵀ)⁻¹,  G_d = h G    (36)–(38)
//! λ_0   = 2 R_dᵀ [p(0) + D_1 L_d(q_0, q_1) + f_d^-]                                            (47)
//! p_n   = −D_1 L_d(q_n, q_{n+1}) − f_d^- + ½ G_dᵀ λ_n                                          (34)
//! v̂     : [M Gᵀ; G 0](v̂, μ) = (p̄_n, −∂g/∂t),   ᵠp_n = M v̂                                    (39), (40)
//! E_d   = ½ (Δq/h)ᵀ M (Δq/h) + U_d                                                             (52)
//! H_d   = ½ p_nᵀ M⁻¹ p_n + V(q_n)  with p_n, or ½ v̂ᵀ M v̂ + V(q_n)  with ᵠp_n                   (53)
//! f_d   = G(q_{n+1/2}) Δq/h (+ rates),   h_d = G(q_n) M⁻¹ p_n                                   (45), (46)
//! λ(a)  : [M Gᵀ; G 0](a, λ) = (f − ∇V, −D²g[v̂, v̂])           acceleration level
//! ```
//! Redundant constraints: the constraint force `Gᵀλ` is unique, the multipliers are given in their
//! minimum-norm form. Letters as in LMO08 §3.

use crate::constraints::Constraints;
use crate::null_space::NullSpaceQr;
use crate::saddle_point::{IndependentRows, SaddlePoint};
use nalgebra::{DMatrix, DVector};
use vi_core::discrete_lagrangian::MechanicalSystem;
use vi_core::interval::Interval;
use vi_core::linear::{Singular, SparseLu, norm_inf};
use vi_core::sparse::{Entries, SparseMatrix};

/// Quantities of the node `n`, all buffers sized once.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Node {
    /// `λ_n` by (36), at the start by (47); minimum norm when `G` is rank deficient. Shape `m`.
    pub lambda: Vec<f64>,
    /// `G(q_n)ᵀ λ_n`, N; unique even where `λ_n` is not. Shape `n`.
    pub constraint_force: Vec<f64>,
    /// Constrained Legendre transform `p_n` (34), (35). Shape `n`.
    pub p: Vec<f64>,
    /// Velocity `v̂` of the projected momentum. Shape `n`.
    pub v: Vec<f64>,
    /// Projected Legendre transform `ᵠp_n = M v̂` (39), (40). Shape `n`.
    pub p_projected: Vec<f64>,
    /// `E_d(q_n, q_{n+1})` (52), J.
    pub discrete_energy: f64,
    /// `H_d` (53) with `p_n`, J; `None` when `M` is singular.
    pub hamiltonian: Option<f64>,
    /// `H_d` (53) with `ᵠp_n`, J.
    pub hamiltonian_projected: f64,
    /// `|g(q_n)|_∞`.
    pub position_residual: f64,
    /// `|f_d|_∞` (45); for rheonomic constraints `|Δg/h|_∞`.
    pub velocity_residual: f64,
    /// `|h_d|_∞` (46) with `p_n`, with `ᵠp_n` when `M` is singular.
    pub momentum_residual: f64,
}

/// Computes [`Node`]s.
pub struct NodeObserver {
    n: usize,
    mass_system: SaddlePoint,       // [M Gᵀ; G 0]
    identity_system: SaddlePoint,   // [I Gᵀ; G 0]
    mass_lu: Option<SparseLu>,      // None: M singular
    jacobian: Option<SparseMatrix>, // m × n
    x: Vec<f64>,                    // n + r
    m_work: Vec<f64>,               // m
    n_work: Vec<f64>,               // n
    node: Node,
}

impl NodeObserver {
    /// For a system and an independent set of its constraints.
    #[must_use]
    pub fn new(system: &impl MechanicalSystem, m: usize, rows: &IndependentRows) -> Self {
        let n = system.dim();
        let mass_lu = SparseLu::new(system.mass()).ok().and_then(|mut lu| {
            let mut probe = vec![1.0; n];
            lu.solve(system.mass(), &mut probe).ok().map(|()| lu)
        });
        let zeros = |k: usize| vec![0.0; k];
        Self {
            n,
            mass_system: SaddlePoint::new(n, rows.clone()),
            identity_system: SaddlePoint::new(n, rows.clone()),
            mass_lu,
            jacobian: None,
            x: zeros(n + rows.len()),
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
        self.mass_lu.is_none()
    }

    /// Everything at `q_n = s.q0` from the step that starts there and the momentum `p̄_n` it started
    /// with; `first`: `p̄_0 = p(0)`, so (47) holds in the place of (36).
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub fn observe(
        &mut self,
        system: &impl MechanicalSystem,
        constraints: &impl Constraints,
        s: &Interval,
        p: &[f64],
        first: bool,
    ) -> Result<&Node, Singular> {
        self.observe_state(system, constraints, s.t, &s.q0, p)?;
        self.multipliers(system, constraints, s, p, first)?;
        let node = &mut self.node;
        node.discrete_energy = system.discrete_energy(s);
        if let Some(lu) = &mut self.mass_lu {
            self.n_work.copy_from_slice(&node.p);
            lu.solve(system.mass(), &mut self.n_work)?; // M⁻¹ p_n
            let kinetic = 0.5 * dot(&self.n_work, &node.p);
            node.hamiltonian = Some(kinetic + system.potential_energy(&s.q0));
            constraints.time_derivative(s.t, &s.q0, &mut self.m_work);
            let jacobian = self.jacobian.as_ref().expect("filled by observe_state");
            jacobian.mul_add(1.0, &self.n_work, &mut self.m_work);
            node.momentum_residual = norm_inf(&self.m_work); // (46)
        }
        if constraints.is_rheonomic() {
            constraints.value(s.t_end(), &s.q1, &mut self.m_work);
            node.velocity_residual = norm_inf(&self.m_work) / s.h.abs();
        } else {
            let jacobian = self.jacobian.as_mut().expect("filled by observe_state");
            jacobian.refill(|out| constraints.jacobian(s.t_mid(), &s.q_mid, out));
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
        system: &impl MechanicalSystem,
        constraints: &impl Constraints,
        t: f64,
        q: &[f64],
        p: &[f64],
    ) -> Result<&Node, Singular> {
        let n = self.n;
        let m = constraints.len();
        let emit = |out: &mut dyn Entries| constraints.jacobian(t, q, out);
        SparseMatrix::update(&mut self.jacobian, (m, n), emit);
        let node = &mut self.node;
        constraints.value(t, q, &mut self.m_work);
        node.position_residual = norm_inf(&self.m_work);

        constraints.time_derivative(t, q, &mut self.m_work);
        self.m_work.iter_mut().for_each(|b| *b = -*b);
        let mass = |out: &mut dyn Entries| system.mass().emit(out);
        let (at, right) = ((t, q), (p, &self.m_work[..]));
        self.mass_system.solve_at(constraints, &mass, at, right, &mut self.x)?;
        node.v.copy_from_slice(&self.x[..n]);
        node.p_projected.fill(0.0);
        system.mass().mul_add(1.0, &node.v, &mut node.p_projected); // (40)
        node.hamiltonian_projected =
            0.5 * dot(&node.v, &node.p_projected) + system.potential_energy(q);
        node.hamiltonian = None;
        node.discrete_energy = node.hamiltonian_projected;
        let jacobian = self.jacobian.as_ref().expect("filled above");
        self.m_work.iter_mut().for_each(|b| *b = -*b);
        jacobian.mul_add(1.0, &node.v, &mut self.m_work);
        node.velocity_residual = norm_inf(&self.m_work);
        node.momentum_residual = node.velocity_residual;
        Ok(&self.node)
    }

    fn multipliers(
        &mut self,
        system: &impl MechanicalSystem,
        constraints: &impl Constraints,
        s: &Interval,
        p: &[f64],
        first: bool,
    ) -> Result<(), Singular> {
        let n = self.n;
        let node = &mut self.node;
        system.forced_d1(s, &mut node.p);
        for i in 0..n {
            self.n_work[i] = p[i] + node.p[i];
        }
        self.m_work.fill(0.0);
        let identity = |out: &mut dyn Entries| (0..n).for_each(|i| out.add(i, i, 1.0));
        let (at, right) = ((s.t, &s.q0[..]), (&self.n_work[..], &self.m_work[..]));
        self.identity_system.solve_at(constraints, &identity, at, right, &mut self.x)?;
        let factor = if first { 2.0 } else { 1.0 }; // (47) : (36)
        let rows = self.identity_system.rows();
        rows.scatter(&self.x[n..], &mut node.lambda);
        node.lambda.iter_mut().for_each(|l| *l *= factor / s.h);
        let jacobian = self.jacobian.as_ref().expect("filled by observe_state");
        node.constraint_force.fill(0.0);
        jacobian.tr_mul_add(1.0, &node.lambda, &mut node.constraint_force);
        for i in 0..n {
            node.p[i] = -node.p[i] + 0.5 * s.h * node.constraint_force[i]; // (34)
        }
        if rows.len() < constraints.len() {
            minimum_norm(jacobian, rows.len(), &mut node.lambda);
        }
        Ok(())
    }

    /// The multiplier of the acceleration level at `(t, q)` with the velocity `v`; it has the order of
    /// `v`, also at the macro nodes of a composition.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub fn acceleration_multiplier(
        &mut self,
        system: &impl MechanicalSystem,
        constraints: &impl Constraints,
        (t, q, v): (f64, &[f64], &[f64]),
        lambda: &mut [f64],
    ) -> Result<(), Singular> {
        let n = self.n;
        constraints.acceleration_terms(t, q, v, &mut self.m_work);
        self.m_work.iter_mut().for_each(|b| *b = -*b);
        self.n_work.fill(0.0);
        system.add_potential_gradient(q, -1.0, &mut self.n_work);
        system.add_force(t, q, v, &mut self.n_work);
        let mass = |out: &mut dyn Entries| system.mass().emit(out);
        let (at, right) = ((t, q), (&self.n_work[..], &self.m_work[..]));
        self.mass_system.solve_at(constraints, &mass, at, right, &mut self.x)?;
        let rows = self.mass_system.rows();
        rows.scatter(&self.x[n..], lambda);
        if rows.len() < constraints.len() {
            let emit = |out: &mut dyn Entries| constraints.jacobian(t, q, out);
            minimum_norm(&SparseMatrix::assemble(constraints.len(), n, emit), rows.len(), lambda);
        }
        Ok(())
    }
}

/// The multipliers of the least norm with the same force `Gᵀλ`: with `G = C G_s`, `G_s` the `rank` rows
/// that are most clearly independent here, `λ ← C (CᵀC)⁻¹ Cᵀλ`. Dense; only where constraints are
/// redundant.
pub fn minimum_norm(jacobian: &SparseMatrix, rank: usize, lambda: &mut [f64]) {
    let g = jacobian.to_dense();
    let mut qr = NullSpaceQr::new(g.ncols(), g.nrows());
    qr.factorize(&g);
    let chosen = DMatrix::from_fn(rank, g.ncols(), |i, j| g[(qr.pivots()[i], j)]);
    let gram = &chosen * chosen.transpose();
    let Some(cholesky) = gram.cholesky() else { return };
    let c = cholesky.solve(&(&chosen * g.transpose())).transpose(); // G G_sᵀ (G_s G_sᵀ)⁻¹
    let projected = c.transpose() * DVector::from_column_slice(lambda);
    if let Some(cholesky) = (c.transpose() * &c).cholesky() {
        lambda.copy_from_slice((c * cholesky.solve(&projected)).as_slice());
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
