//! The sweeps of the Galerkin scheme on trees whose members are coupled by stiff potentials: beams.
//!
//! ```text
//! r_i = P(q_i)ᵀ w_i,   y = (T⁻¹ K̂⁻¹ ⊗ I) r,   (A + h α B + h² α² C) z = y for each mode,   ν = h (T ⊗ I) z       [2.34]
//! A = Pᵀ M P,  B = −Pᵀ ∂f/∂v P,  C = Pᵀ ∇²V P  at q_n
//! ```
//! `P(q_i)` has the directors of `q_i` as the axes of free nodes (material rates): `A` does not
//! change then with a rotation of the whole, and `C` hardly. One factorization a step serves all
//! control points and all sweeps.

use super::layout::{MapColumns, VelocityLayout};
use super::mode_factors::ModeFactors;
use super::{extent, with_floors};
use crate::mechanism::Mechanism;
use vi_constraints::galerkin::Sweeps;
use vi_constraints::galerkin::control_points::ControlPoints;
use vi_constraints::galerkin::sweeps::mix;
use vi_constraints::scheme::SubStep;
use vi_core::galerkin::{GaussLobatto, Stages};
use vi_core::galerkin_pencil::GalerkinPencil;
use vi_core::mechanical_system::MechanicalSystem;
use vi_core::newton::{Fault, UnknownBlock};
use vi_core::sparse::Entries;
use vi_core::state::State;

crate::opaque_debug!(CoupledSweeps);

/// [`Sweeps`] of a tree with elements.
pub struct CoupledSweeps {
    layout: VelocityLayout,
    blocks: Vec<UnknownBlock>,
    pencil: GalerkinPencil,
    factors: ModeFactors,
    start: MapColumns,   // P(q_n)
    columns: MapColumns, // P(q_i)
    w: Vec<f64>,         // n  balance of a control point
    rest: Vec<f64>,      // n  zeros
    r: Vec<f64>,         // s d  residual, while corrections are made of it
    z: Vec<f64>,         // s d  the same by modes
}

impl CoupledSweeps {
    /// For the tree of a mechanism without point masses, with the extent of `q`.
    #[must_use]
    pub fn new(mechanism: &Mechanism, stages: Stages, q: &[f64]) -> Self {
        let layout = VelocityLayout::new(mechanism);
        let pencil = GalerkinPencil::new(&GaussLobatto::new(stages));
        let (n, size) = (layout.dim(), stages.count() * layout.dof());
        let mut blocks = layout.blocks();
        with_floors(&mut blocks, 1e-5 * extent(q).max(1e-5), 1e-5);
        let [start, columns] = [0, 1].map(|_| layout.separated_columns());
        Self {
            factors: ModeFactors::new(&layout, &pencil),
            layout,
            blocks,
            pencil,
            start,
            columns,
            w: vec![0.0; n],
            rest: vec![0.0; n],
            r: vec![0.0; size],
            z: vec![0.0; size],
        }
    }
}

impl Sweeps for CoupledSweeps {
    fn dof(&self) -> usize {
        self.layout.dof()
    }

    fn blocks(&self) -> &[UnknownBlock] {
        &self.blocks
    }

    fn open(
        &mut self,
        system: &impl MechanicalSystem,
        points: &mut ControlPoints,
        step: SubStep,
        state: &State,
    ) {
        points.open(step, state);
        let Self { layout, factors, start, rest, .. } = self;
        layout.null_space_by_screws(&state.q, start);
        let at = state.configuration();
        let mass = |out: &mut dyn Entries| system.mass().emit(out);
        let damping = |out: &mut dyn Entries| system.force_damping(at.moving(rest), out);
        let stiffness = |out: &mut dyn Entries| system.potential_stiffness(at, out);
        factors.factorize(layout, start, [&mass, &damping, &stiffness], step.h);
    }

    fn residual(
        &mut self,
        system: &impl MechanicalSystem,
        points: &mut ControlPoints,
        u: &[f64],
        r: &mut [f64],
        _anew: bool,
    ) -> Result<(), Fault> {
        self.settle(system, points, u)?;
        let Self { layout, start, columns, w, .. } = self;
        for (i, r) in r.chunks_exact_mut(layout.dof()).enumerate() {
            points.balance(system, i, w);
            if i > 0 {
                layout.null_space_by_screws(points.q(i), columns);
            }
            layout.pull_back(if i > 0 { columns } else { start }, w, r); // P(q_i)ᵀ w_i
        }
        Ok(())
    }

    fn settle(
        &mut self,
        system: &impl MechanicalSystem,
        points: &mut ControlPoints,
        u: &[f64],
    ) -> Result<(), Fault> {
        for (j, u) in u.chunks_exact(self.layout.dof()).enumerate() {
            self.layout.reparametrize(u, points.point_mut(j + 1))?; // q_j = F_d(u_j, q_n)
        }
        points.evaluate(system);
        Ok(())
    }

    fn correction(
        &mut self,
        points: &ControlPoints,
        u: &[f64],
        du: &mut [f64],
    ) -> Result<(), Fault> {
        let Self { layout, pencil, factors, start, r, z, .. } = self;
        let (d, h) = (layout.dof(), points.h());
        r.copy_from_slice(du);
        for (m, z) in z.chunks_exact_mut(d).enumerate() {
            mix(|i| pencil.from_residual[(m, i)], r, z);
            layout.apply_roots(start, z);
        }
        for (k, mode) in pencil.modes.iter().enumerate() {
            factors.solve(k, &mut z[mode.first * d..(mode.first + mode.size()) * d])?;
        }
        z.chunks_exact_mut(d).for_each(|z| layout.apply_roots_transposed(start, z));
        for (j, du) in du.chunks_exact_mut(d).enumerate() {
            mix(|m| h * pencil.T[(j, m)], z, du);
            layout.material_rates_to_increments(points.q(j + 1), &u[j * d..(j + 1) * d], du);
        }
        Ok(())
    }

    fn compose(&self, first: &[f64], u: &mut [f64]) {
        self.layout.compose(first, u);
    }

    fn clean(&mut self, _t: f64, q: &mut [f64]) {
        self.layout.clean(q);
    }
}
