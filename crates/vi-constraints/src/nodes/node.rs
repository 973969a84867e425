//! What can be said at a node: multipliers, momenta, energies, hidden constraints.
//!
//! ```text
//! λ_n, p_n, ᵠp_n, E_d, H_d    (34), (36)–(40), (47), (52), (53): the functions of [`crate::legendre`]
//! f_d = G(q_{n+1/2}) Δq/h (rheonomic: Δg/h),   h_d = G(q_n) M⁻¹ p_n                        (45), (46)
//! ```
//! An integrator carries `p̄_n` from step to step, so a node needs no interval before it. Letters
//! as in LMO08 §3.

use crate::constraints::Constraints;
use crate::fastest_motion::{ConstrainedMass, FastestMotions, fastest_motion, quotient};
use crate::legendre::add_constraint_impulse;
use crate::node_solvers::NodeSolvers;
use crate::nonsmooth::ContactImpulse;
use crate::projection::{NodeMotion, Projections, hamiltonian, kinetic_energy};
use crate::reparametrization::Emission;
use crate::saddle_point::IndependentRows;
use crate::scheme::linearization::{StepLinearization, Tangent};
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::interval::Interval;
use vi_core::legendre::{Energies, discrete_energy, p_minus};
use vi_core::linear::{Singular, norm_inf};
use vi_core::sparse::{Entries, SparseMatrix};
use vi_core::state::State;
use vi_core::{Configuration, Motion};

/// Quantities of the node `n`, all buffers sized once.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Node {
    /// `λ_n` by (36), at the start by (47); minimum norm when `G` is rank deficient. Shape `m`;
    /// empty where it is not wanted.
    pub lambda: Vec<f64>,
    /// `G(q_n)ᵀ λ_n`, N; unique even where `λ_n` is not. Shape `n`.
    pub constraint_force: Vec<f64>,
    /// `λ_{n+1/2}` of the step that starts here, of schemes that find it; else empty. Shape `m`.
    pub lambda_mid: Vec<f64>,
    /// The constraint force of `λ_{n+1/2}`, N, likewise. Shape `n`.
    pub constraint_force_mid: Vec<f64>,
    /// Constrained Legendre transform `p_n` (34), (35). Shape `n`.
    pub p: Vec<f64>,
    /// `p̄_n`, with what contacts add to it up to the velocity of the node. Shape `n`.
    pub p_bar: Vec<f64>,
    /// Velocity `v̂` of the projected momentum. Shape `n`.
    pub v: Vec<f64>,
    /// Projected Legendre transform `ᵠp_n = M v̂` of `p_bar` (39), (40). Shape `n`.
    pub p_projected: Vec<f64>,
    /// `q̈` of the acceleration level, where its constraint force was found; else what it was.
    /// Shape `n`.
    pub acceleration: Vec<f64>,
    /// `E_d(q_n, q_{n+1})` (52).
    pub discrete_energy: Energies,
    /// `H_d` (53) with `p_n`; `None` when `M` is singular or a discrete potential adds to it.
    pub hamiltonian: Option<Energies>,
    /// `H_d` (53) with `ᵠp_n`.
    pub hamiltonian_projected: Energies,
    /// `|g(q_n)|_∞`.
    pub position_residual: f64,
    /// `|f_d|_∞` (45); for rheonomic constraints `|Δg/h|_∞`.
    pub velocity_residual: f64,
    /// `|h_d|_∞` (46) with `p_n`, with `ᵠp_n` where `p_n` has no velocity.
    pub momentum_residual: f64,
}

/// Computes [`Node`]s.
#[derive(Debug)]
pub struct NodeObserver {
    projections: Projections,
    solvers: NodeSolvers,
    rows: IndependentRows,
    linearized: Option<Box<(StepLinearization, Tangent)>>, // the last step, where asked for
    multipliers: bool,                                     // whether they are wanted
    m_work: Vec<f64>,                                      // m
    n_work: Vec<f64>,                                      // n
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
            solvers: NodeSolvers::default(),
            rows: rows.clone(),
            linearized: None,
            multipliers: true,
            m_work: zeros(m),
            n_work: zeros(n),
            node: Node {
                lambda: zeros(m),
                constraint_force: zeros(n),
                p: zeros(n),
                p_bar: zeros(n),
                v: zeros(n),
                p_projected: zeros(n),
                ..Node::default()
            },
        }
    }

    /// Takes what the mechanism offers in the place of the saddle-point matrix.
    pub fn solve_with(&mut self, solvers: NodeSolvers) {
        self.solvers = solvers;
    }

    /// Whether `λ_n` is found; where it is not, it is empty, and the constraint force is that of
    /// the momentum balance.
    pub fn record_multipliers(&mut self, wanted: bool) {
        self.multipliers = wanted;
    }

    /// The last node computed.
    #[must_use]
    pub fn node(&self) -> &Node {
        &self.node
    }

    /// Everything at a node from the step that starts there, `s.q0 = q_n`, with the impulse of
    /// contacts at the node.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub fn observe(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        state: &State,
        impulse: ContactImpulse<'_>,
        s: &Interval,
    ) -> Result<&Node, Singular> {
        self.project(system, constraints, state, impulse.up_to, s.h)?;
        self.impulse(system, constraints, state, impulse.whole, s)?;
        let Self { projections, node, m_work, n_work, .. } = self;
        node.discrete_energy = discrete_energy(system, s); // (52)
        let has_velocity = projections.free_velocity(system, &node.p, n_work)?;
        let kinetic = has_velocity.then(|| kinetic_energy(n_work, &node.p));
        node.hamiltonian =
            kinetic.map(|kinetic| Energies { kinetic, ..node.hamiltonian_projected }); // (53)
        let v = if has_velocity { &n_work[..] } else { &node.v };
        node.momentum_residual = rate(constraints, s.start().moving(v), m_work); // (46)
        node.velocity_residual = if constraints.is_rheonomic() {
            constraints.residual(s.end(), m_work);
            norm_inf(m_work) / s.h.abs()
        } else {
            constraints.step_rates(s, m_work);
            norm_inf(m_work) // (45)
        };
        Ok(&self.node)
    }

    /// The part that needs no step from here: `v̂`, `ᵠp_n`, `H_d(ᵠp_n)`, `g(q_n)`; all there is at
    /// the macro nodes of a composition. `discrete_energy` is set to `H_d(ᵠp_n)`, the velocity
    /// residual to that of `v̂`. `impulse`: what contacts add to `p̄_n`, shape `n` or empty; `h`:
    /// the step, for a mass that is added to `M`; 0 in compositions, where such masses cancel to
    /// the order.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub fn observe_state(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        state: &State,
        impulse: &[f64],
        h: f64,
    ) -> Result<&Node, Singular> {
        self.project(system, constraints, state, impulse, h)?;
        let Self { node, m_work, .. } = self;
        node.hamiltonian = None;
        node.discrete_energy = node.hamiltonian_projected;
        node.velocity_residual = rate(constraints, state.configuration().moving(&node.v), m_work);
        node.momentum_residual = node.velocity_residual;
        Ok(&self.node)
    }

    /// `g(q_n)`, `v̂`, `ᵠp_n`, `H_d(ᵠp_n)`.
    fn project(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        state: &State,
        impulse: &[f64],
        h: f64,
    ) -> Result<(), Singular> {
        let Self { projections, solvers, node, m_work, .. } = self;
        let at = state.configuration();
        constraints.residual(at, m_work);
        node.position_residual = norm_inf(m_work);

        let mut mass = MassAtNode { projections, solvers, system, constraints, state };
        node.p_bar.copy_from_slice(&state.p);
        node.p_bar.iter_mut().zip(impulse).for_each(|(p, impulse)| *p += impulse);
        mass.velocity(at.t, h, &node.p_bar, &mut node.v)?;
        node.p_projected.fill(0.0);
        system.add_momentum_of_step(at, h, &node.v, &mut node.p_projected); // (40)
        let moving = at.moving(&node.v);
        node.hamiltonian_projected = hamiltonian(system, moving, &node.p_projected); // (53)
        Ok(())
    }

    /// `v ← v̂` of a momentum `p` at the node of a state, before a step `h`. Shape `n`.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub fn velocity(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        state: &State,
        h: f64,
        p: &[f64],
        v: &mut [f64],
    ) -> Result<(), Singular> {
        let Self { projections, solvers, .. } = self;
        let mut mass = MassAtNode { projections, solvers, system, constraints, state };
        mass.velocity(state.t, h, p, v)
    }

    /// `p ← p + D_1 L_d + f_d^- = h Gᵀλ_n` (36) of a step from the momentum `p`, shape `n`.
    pub fn constraint_impulse(
        &mut self,
        system: &impl DiscreteLagrangian,
        s: &Interval,
        p: &mut [f64],
    ) {
        let Self { n_work, .. } = self;
        p_minus(system, s, n_work);
        p.iter_mut().zip(&*n_work).for_each(|(p, own)| *p -= own);
    }

    /// Replaces changes `δp̄_n` of the momentum from which a step was taken, `p`, by the changes
    /// `δq_{n+1}` of its end [2.37]. `changes`: one of shape `n` after the other.
    ///
    /// # Errors
    /// [`Singular`], also of velocity constraints.
    pub fn step_response(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        s: &Interval,
        p: &[f64],
        changes: &mut [f64],
    ) -> Result<(), Singular> {
        if constraints.constrains_velocities() {
            return Err(Singular);
        }
        let (n, m) = (s.dim(), constraints.len());
        let Self { rows, linearized, .. } = self;
        let (step, tangent) = &mut **linearized.get_or_insert_with(|| {
            let internal = system.internal_variables();
            Box::new((StepLinearization::new(n, m, rows), Tangent::zero(n, internal)))
        });
        step.linearize(system, constraints, s, p)?;
        for change in changes.chunks_exact_mut(n) {
            tangent.q.fill(0.0);
            tangent.z.fill(0.0);
            tangent.p.copy_from_slice(change);
            step.push_free(system, constraints, s, tangent)?;
            change.copy_from_slice(&tangent.q);
        }
        Ok(())
    }

    /// `v ← v̂` of no momentum at the configuration of a state and the time `t`: the least motion
    /// that prescribed motions need. Shape `n`.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub fn prescribed_velocity(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        state: &State,
        t: f64,
        v: &mut [f64],
    ) -> Result<(), Singular> {
        let rest = vec![0.0; v.len()];
        let Self { projections, solvers, .. } = self;
        MassAtNode { projections, solvers, system, constraints, state }.velocity(t, 0.0, &rest, v)
    }

    /// The fastest motions about a node: with the stiffness of potentials and constraint forces,
    /// and with that of the forces of those constraints alone that are `counted`; `stiffness` emits
    /// `∇²V`, shape `n × n`.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank, or a direction they leave free has no
    /// mass.
    pub fn fastest_motions(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        state: &State,
        stiffness: &Emission<'_>,
        counted: &dyn Fn(usize) -> bool,
    ) -> Result<FastestMotions, Singular> {
        let (n, m) = (system.dim(), constraints.len());
        let (mut lambda, mut prescribed) = (vec![0.0; m], Vec::new());
        if self.solvers.multipliers.is_some() {
            let mut force = vec![0.0; n];
            self.acceleration_force(system, constraints, state, &mut force, Some(&mut lambda))?;
        } else {
            self.observe_state(system, constraints, state, &[], 0.0)?;
            let Self { projections, node, .. } = self;
            let at = state.configuration();
            projections.independent_multiplier(
                system,
                constraints,
                at.moving(&node.v),
                &mut lambda,
            )?;
        }
        if constraints.is_rheonomic() {
            prescribed.resize(n, 0.0);
            self.prescribed_velocity(system, constraints, state, state.t, &mut prescribed)?;
        }
        let matrix = |lambda: &[f64], stiffness: &Emission<'_>| {
            SparseMatrix::assemble(n, n, |out| {
                stiffness(out);
                constraints.weighted_hessian(state.t, &state.q, lambda, 1.0, out);
            })
        };
        let whole = matrix(&lambda, stiffness);
        for (_, lambda) in lambda.iter_mut().enumerate().filter(|(row, _)| !counted(*row)) {
            *lambda = 0.0;
        }
        let geometric = matrix(&lambda, &|_| ());
        let Self { projections, solvers, .. } = self;
        let mass = MassAtNode { projections, solvers, system, constraints, state };
        let mut mass = AllowedMass { mass, prescribed };
        let all = fastest_motion(&whole, &mut mass)?;
        let by_constraint_forces = fastest_motion(&geometric, &mut mass)?;
        let held = quotient(&whole, &by_constraint_forces.velocity) - by_constraint_forces.squared;
        let held = held > by_constraint_forces.squared.abs();
        Ok(FastestMotions { all, by_constraint_forces, held })
    }

    /// `p_n` (34), the constraint force and, where they are wanted, the multipliers. The step
    /// equation says
    /// ```text
    /// w = p̄_n + BᵀΛ_n + D_1 L_d + f_d^- = h Gᵀλ_n,     ½ h Gᵀλ_0 at the start, where p̄_0 = p(0)       (36), (47)
    /// ```
    /// so the force is `w` over its weight, and `λ_n` needs a solution only where it is asked for.
    fn impulse(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        state: &State,
        impulse: &[f64],
        s: &Interval,
    ) -> Result<(), Singular> {
        let Self { projections, solvers, n_work: w, node, .. } = self;
        let Node { lambda, constraint_force, p: p_n, .. } = node;
        p_minus(system, s, p_n);
        for (w, (p, p_n)) in w.iter_mut().zip(state.p.iter().zip(&*p_n)) {
            *w = p - p_n;
        }
        w.iter_mut().zip(impulse).for_each(|(w, impulse)| *w += impulse);
        let weight = if state.step == 0 { 0.5 * s.h } else { s.h }; // (47) : (36)
        let at = s.start();
        let scale = 1.0 / weight;
        constraint_force.iter_mut().zip(&*w).for_each(|(force, w)| *force = scale * *w);
        lambda.resize(if self.multipliers { constraints.len() } else { 0 }, 0.0);
        if self.multipliers {
            match &mut solvers.multipliers {
                Some(sweep) => {
                    let jacobian = projections.jacobian(constraints, at);
                    sweep.multipliers(jacobian, constraint_force, lambda)?;
                }
                None => {
                    projections.multiplier(constraints, at, w, weight, lambda, constraint_force)?;
                }
            }
        }
        add_constraint_impulse(0.5 * s.h, constraint_force, p_n); // (34)
        Ok(())
    }

    /// `force ← Gᵀλ` of the acceleration level with the velocity of the node, shape `n`, and `λ`,
    /// shape `m`, where it is asked for; they have the order of that velocity, also at the macro
    /// nodes of a composition.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub fn acceleration_force(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        state: &State,
        force: &mut [f64],
        mut lambda: Option<&mut [f64]>,
    ) -> Result<(), Singular> {
        self.observe_state(system, constraints, state, &[], 0.0)?;
        let Self { projections, solvers, node, m_work, .. } = self;
        let (at, v) = (state.configuration(), &node.v[..]);
        let here = NodeMotion { at, v, memory: &state.memory };
        let swept = projections.acceleration_sweeps(
            system,
            constraints,
            here,
            solvers,
            force,
            lambda.as_deref_mut(),
        );
        if swept.is_err() {
            let lambda = lambda.unwrap_or(m_work);
            projections.acceleration_force(system, constraints, at.moving(v), force, lambda)?;
        }
        node.acceleration.clear();
        node.acceleration.extend_from_slice(projections.acceleration());
        Ok(())
    }
}

/// The mass of a system on the directions that its constraints allow at a node, rates of prescribed
/// motions among them.
struct MassAtNode<'a, S, C> {
    projections: &'a mut Projections,
    solvers: &'a mut NodeSolvers,
    system: &'a S,
    constraints: &'a C,
    state: &'a State,
}

impl<S: DiscreteLagrangian, C: Constraints> MassAtNode<'_, S, C> {
    /// `v ← v̂` of a momentum `p` at the configuration of the state and the time `t`, with what is
    /// added to the mass in steps `h`.
    fn velocity(&mut self, t: f64, h: f64, p: &[f64], v: &mut [f64]) -> Result<(), Singular> {
        let (system, state) = (self.system, self.state);
        let at = Configuration { t, ..state.configuration() };
        let mass = |out: &mut dyn Entries| system.emit_mass_of_step(at, h, out);
        if let Some(solver) = &mut self.solvers.velocity
            && solver.velocity(&mass, at, &state.memory, p, v).is_ok()
        {
            return Ok(());
        }
        self.projections.velocity(system, self.constraints, at, h, p, v)
    }
}

/// The mass on the directions of the tangent space.
struct AllowedMass<'a, S, C> {
    mass: MassAtNode<'a, S, C>,
    prescribed: Vec<f64>, // n  v̂ of no momentum; empty where no motion is prescribed
}

impl<S: DiscreteLagrangian, C: Constraints> ConstrainedMass for AllowedMass<'_, S, C> {
    fn velocity(&mut self, p: &[f64], v: &mut [f64]) -> Result<(), Singular> {
        self.mass.velocity(self.mass.state.t, 0.0, p, v)?;
        v.iter_mut().zip(&self.prescribed).for_each(|(v, own)| *v -= own);
        Ok(())
    }

    fn momentum(&mut self, v: &[f64], p: &mut [f64]) {
        p.fill(0.0);
        let at = self.mass.state.configuration();
        self.mass.system.add_momentum_of_step(at, 0.0, v, p);
    }
}

/// `|G(q) v + ∂g/∂t|_∞`.
fn rate(constraints: &impl Constraints, at: Motion<'_>, work: &mut [f64]) -> f64 {
    constraints.time_derivative(at.t, at.q, work);
    constraints.add_rates(at.t, at.q, at.v, work);
    norm_inf(work)
}
