//! A discrete Lagrangian, its slot derivatives and its discrete forces.

use crate::configuration::{Configuration, Motion};
use crate::interval::{Interval, Slot, StepChange};
use crate::mechanical_system::MechanicalSystem;
use crate::signals::StateRates;
use crate::sparse::{Block, Entries};

/// The derivative by the time step is not known.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{what} has no derivative by the time step")]
pub struct NoStepSlope {
    /// Of what.
    pub what: String,
}

/// The discrete Lagrangian of a system with its discrete forces, and their slot derivatives.
///
/// Implementors provide the discrete functions of one [`Interval`]; the forced terms default to
/// none. Open for extension: anything with these slot derivatives can be integrated.
pub trait DiscreteLagrangian: MechanicalSystem {
    /// Derives what a step needs again and again from its `q_n`, after it was opened: see
    /// [`crate::potential::DiscretePotential::derive`].
    fn prepare(&self, _s: &mut Interval) {}
    /// Derives what the functions of a step have in common at its end, after `q_{n+1}` was written:
    /// see [`crate::potential::DiscretePotential::derive_end`].
    fn reach(&self, _s: &mut Interval) {}
    /// `L_d(q_n, q_{n+1})`, J·s.
    fn discrete_lagrangian(&self, s: &Interval) -> f64;
    /// `out ← D_1 L_d(q_n, q_{n+1})`, shape `n`, unit of momentum.
    fn d1(&self, s: &Interval, out: &mut [f64]);
    /// `out ← D_2 L_d(q_n, q_{n+1})`, shape `n`, unit of momentum.
    fn d2(&self, s: &Interval, out: &mut [f64]);
    /// Emits `D_2 D_1 L_d`, shape `n × n`; always the same places in the same order.
    fn d2_d1(&self, s: &Interval, out: &mut dyn Entries);
    /// Emits `D_1 D_1 L_d`, shape `n × n`; always the same places in the same order. No step needs
    /// it: it is part of the tangent of a step.
    fn d1_d1(&self, s: &Interval, out: &mut dyn Entries);
    /// Emits `D_2 D_2 L_d`, as [`DiscreteLagrangian::d1_d1`].
    fn d2_d2(&self, s: &Interval, out: &mut dyn Entries);
    /// Emits `scale ∇²V(q)` of the continuous potential, shape `n × n`; always the same places in
    /// the same order. No step needs it: it is part of the tangent of a step.
    fn potential_hessian(&self, at: Configuration<'_>, scale: f64, out: &mut dyn Entries);
    /// Emits `by_q ∂(f − ∇V)/∂q + by_v ∂f/∂v` at a Gauss node, without
    /// [`MechanicalSystem::interpolation`]; shape `n × n`, always the same places in the same
    /// order where the same factors are zero. No step needs it: it is part of the tangent of a
    /// Galerkin step. The default knows no forces.
    fn gauss_slopes(&self, at: Motion<'_>, [by_q, _]: [f64; 2], out: &mut dyn Entries) {
        self.potential_hessian(at.configuration(), -by_q, out);
    }
    /// The same of all potentials and forces, [`MechanicalSystem::interpolation`] among them: part
    /// of the tangent of the acceleration level.
    fn level_slopes(&self, at: Motion<'_>, by: [f64; 2], out: &mut dyn Entries) {
        self.gauss_slopes(at, by, out);
    }
    /// Emits `∂f/∂z`, shape `n ×` all internal variables: states of signals that forces read.
    fn state_slopes(&self, _at: Motion<'_>, _out: &mut dyn Entries) {}
    /// The rates of the continuous states of signals where all internal variables are listed;
    /// `None` where there are none. Allocates.
    fn state_rates(&self, _at: Motion<'_>) -> Option<StateRates> {
        None
    }
    /// `out ← out + f_d^-(q_n, q_{n+1})`, N·s.
    fn add_force_minus(&self, _s: &Interval, _out: &mut [f64]) {}
    /// `out ← out + f_d^+(q_n, q_{n+1})`, N·s.
    fn add_force_plus(&self, _s: &Interval, _out: &mut [f64]) {}
    /// Emits `D_2 f_d^-`, shape `n × n`; always the same places in the same order.
    fn force_minus_d2(&self, _s: &Interval, _out: &mut dyn Entries) {}
    /// Emits `D_by f_d^of`, shape `n × n`; for each always the same places in the same order.
    /// Beside `D_2 f_d^-` no step needs it: it is part of the tangent of a step.
    fn force_slope(&self, _s: &Interval, _of: Slot, _by: Slot, _out: &mut dyn Entries) {}
    /// Emits `∂f_d^of/∂z`, shape `n ×` internal variables.
    fn internal_slope(&self, _s: &Interval, _of: Slot, _out: &mut dyn Entries) {}
    /// Emits `∂z_{n+1}/∂q_n` or `∂z_{n+1}/∂q_{n+1}`, shape internal variables `× n`.
    fn advance_slope(&self, _s: &Interval, _by: Slot, _out: &mut dyn Entries) {}
    /// Emits `∂z_{n+1}/∂z_n`.
    fn advance_internal_slope(&self, _s: &Interval, _out: &mut dyn Entries) {}
    /// `out ← out +` the change of `D_1 L_d + f_d^-`, or of `D_2 L_d + f_d^+`, with the step at
    /// fixed configurations.
    ///
    /// # Errors
    /// [`NoStepSlope`], unless said otherwise.
    fn add_step_slope(
        &self,
        _s: &Interval,
        _of: Slot,
        _change: StepChange,
        _out: &mut [f64],
    ) -> Result<(), NoStepSlope> {
        Err(NoStepSlope { what: "the discrete Lagrangian".into() })
    }
    /// `out ←` the change of `h (f − ∇V)` at a Gauss node of a Galerkin step `h` with the step, at
    /// fixed control points: the velocity `v` is divided by `h`. Without
    /// [`MechanicalSystem::interpolation`].
    ///
    /// # Errors
    /// [`NoStepSlope`], unless said otherwise.
    fn gauss_step_slope(
        &self,
        _at: Motion<'_>,
        _h: f64,
        _change: StepChange,
        _out: &mut [f64],
    ) -> Result<(), NoStepSlope> {
        Err(NoStepSlope { what: "the action of a Galerkin step".into() })
    }
    /// Number of internal variables of forces and potentials.
    fn internal_variables(&self) -> usize {
        0
    }
    /// `out ← z_0`, the internal variables at the start of a motion from `q` with the velocity `v`;
    /// shape [`Self::internal_variables`].
    fn begin_internal(&self, _at: Motion<'_>, _out: &mut [f64]) {}
    /// Whether internal variables change at the node of this number, before the step from there.
    fn samples(&self, _step: u64) -> bool {
        false
    }
    /// Changes them at a node with the velocity `v`, of `ᵠp_n`; `at` has no internal variables.
    fn sample(&self, _step: u64, _at: Motion<'_>, _internal: &mut [f64]) {}
    /// `out ← z_{n+1}`, the internal variables at the end of a step, from `z_n`; shape
    /// [`Self::internal_variables`].
    fn advance_internal(&self, _s: &Interval, _out: &mut [f64]) {}
    /// `Σ U_d(q_n, q_{n+1})`, J: the potential part of `E_d`, LMO08 (52).
    fn discrete_potential_energy(&self, s: &Interval) -> f64;
    /// `Σ K_d(q_n, q_{n+1})`, J: what added masses contribute to the kinetic part of `E_d`.
    fn added_kinetic_energy(&self, _s: &Interval) -> f64 {
        0.0
    }

    /// `out ← D_1 L_d + f_d^-`: what balances `p̄_n`.
    fn forced_d1(&self, s: &Interval, out: &mut [f64]) {
        self.d1(s, out);
        self.add_force_minus(s, out);
    }
    /// `out ← D_2 L_d + f_d^+`: the momentum `p̄_{n+1}` of the next step.
    fn forced_d2(&self, s: &Interval, out: &mut [f64]) {
        self.d2(s, out);
        self.add_force_plus(s, out);
    }
    /// Emits `D_2 (D_1 L_d + f_d^-)`.
    fn forced_d2_d1(&self, s: &Interval, out: &mut dyn Entries) {
        self.d2_d1(s, out);
        self.force_minus_d2(s, out);
    }
    /// Emits `D_1 (D_1 L_d + f_d^-)`, shape `n × n`.
    fn forced_d1_d1(&self, s: &Interval, out: &mut dyn Entries) {
        self.d1_d1(s, out);
        self.force_slope(s, Slot::First, Slot::First, out);
    }
    /// Emits `C = D_1 (D_2 L_d + f_d^+)`, shape `n × n`.
    fn forced_d1_d2(&self, s: &Interval, out: &mut dyn Entries) {
        let mut transposed = Block { into: out, row: 0, column: 0, scale: 1.0, transposed: true };
        self.d2_d1(s, &mut transposed);
        self.force_slope(s, Slot::Second, Slot::First, out);
    }
    /// Emits `D = D_2 (D_2 L_d + f_d^+)`, shape `n × n`.
    fn forced_d2_d2(&self, s: &Interval, out: &mut dyn Entries) {
        self.d2_d2(s, out);
        self.force_slope(s, Slot::Second, Slot::Second, out);
    }
}
