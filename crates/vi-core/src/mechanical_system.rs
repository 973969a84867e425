//! What every discretization starts from: `M`, `V(q)`, `f(t, q, v)`.
//!
//! ```text
//! M q̈ = −∇V(q) + f(t, q, q̇)                                          without constraints
//! ```

use crate::configuration::{Configuration, Motion};
use crate::galerkin::{GaussLobatto, GaussPoint};
use crate::interpolation::StrainInterpolation;
use crate::interval::Interval;
use crate::sparse::{Entries, Product, SparseMatrix};

/// A mechanical system: a constant mass matrix, a potential, generalized forces.
///
/// Its discretizations are [`crate::DiscreteLagrangian`]s and those of other families of schemes.
pub trait MechanicalSystem: Send + Sync {
    /// The constant mass matrix `M`, shape `n × n`.
    fn mass(&self) -> &SparseMatrix;
    /// Whether discrete potentials add to `M`.
    fn adds_mass(&self) -> bool {
        false
    }
    /// Emits the mass that discrete potentials add to `M` in steps `h` from a configuration, shape
    /// `n × n`; none for most systems. Always the same places in the same order.
    fn add_mass_of_step(&self, _at: Configuration<'_>, _h: f64, _out: &mut dyn Entries) {}
    /// Emits `∂(A v)/∂q` of the mass `A` that discrete potentials add, shape `n × n`.
    fn added_mass_slope(&self, _at: Configuration<'_>, _h: f64, _v: &[f64], _: &mut dyn Entries) {}
    /// Emits `∂(A v)/∂z`, shape `n ×` all internal variables.
    fn added_mass_by_internal(
        &self,
        _at: Configuration<'_>,
        _h: f64,
        _v: &[f64],
        _out: &mut dyn Entries,
    ) {
    }
    /// `V(q)`, J.
    fn potential_energy(&self, at: Configuration<'_>) -> f64;
    /// `out ← out + scale ∇V(q)`, shape `n`.
    fn add_potential_gradient(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]);
    /// `out ← out + f(t, q, v)`: the generalized force, N.
    fn add_force(&self, _at: Motion<'_>, _out: &mut [f64]) {}
    /// Whether `f − ∇V` is the same always and everywhere.
    fn has_constant_force(&self) -> bool {
        false
    }
    /// Whether any force dissipates: backward sub-steps of a composition are then refused.
    fn is_dissipative(&self) -> bool {
        false
    }
    /// Whether values are sampled at nodes and held, or kept for later: a motion is not retraced.
    fn is_sampled(&self) -> bool {
        false
    }
    /// Whether a force, a potential or a signal has internal variables that follow a step.
    fn has_memory(&self) -> bool {
        false
    }
    /// What of a Galerkin step depends on interpolated strains; `None` for most systems. The rest
    /// is evaluated at Gauss nodes.
    fn interpolation(&self) -> Option<&dyn StrainInterpolation> {
        None
    }
    /// Internal variables at the Gauss nodes of a Galerkin step `s`, and at its `end`, that follow
    /// its motion; those of most systems do not, and `end` stays empty.
    fn collocate(
        &self,
        _s: &Interval,
        _constants: &GaussLobatto,
        _gauss: &mut [GaussPoint],
        _end: &mut Vec<f64>,
    ) {
    }
    /// `V(q)` at a Gauss node without [`MechanicalSystem::interpolation`], J.
    fn gauss_energy(&self, at: Configuration<'_>) -> f64 {
        self.potential_energy(at)
    }
    /// `out ← out + f − ∇V` at a Gauss node without [`MechanicalSystem::interpolation`], shape `n`,
    /// N.
    fn add_gauss_force(&self, at: Motion<'_>, out: &mut [f64]) {
        self.add_potential_gradient(at.configuration(), -1.0, out);
        self.add_force(at, out);
    }
    /// Emits `∇²V(q)`, shape `n × n`; always the same places in the same order. For iterations:
    /// nothing is allowed.
    fn potential_stiffness(&self, _at: Configuration<'_>, _out: &mut dyn Entries) {}
    /// Emits `−∂f/∂v`, shape `n × n`, N·s/m; always the same places in the same order. For
    /// iterations: nothing is allowed.
    fn force_damping(&self, _at: Motion<'_>, _out: &mut dyn Entries) {}

    /// Number `n` of coordinates.
    fn dim(&self) -> usize {
        self.mass().shape().0
    }
    /// Emits `M` and what is added to it in steps `h`; `h = 0`: `M`.
    fn emit_mass_of_step(&self, at: Configuration<'_>, h: f64, out: &mut dyn Entries) {
        self.mass().emit(out);
        self.add_mass_of_step(at, h, out);
    }
    /// `out ← out + M v`, with what is added to `M` in steps `h`, shape `n`.
    fn add_momentum_of_step(&self, at: Configuration<'_>, h: f64, v: &[f64], out: &mut [f64]) {
        self.mass().mul_add(1.0, v, out);
        self.add_mass_of_step(at, h, &mut Product { v, out });
    }
    /// `½ vᵀ M v`, J.
    fn kinetic_energy(&self, v: &[f64]) -> f64 {
        0.5 * self.mass().bilinear(v, v)
    }
}
