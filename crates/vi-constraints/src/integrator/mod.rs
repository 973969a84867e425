//! A system, its constraints, a scheme and an order: ready to step.
//!
//! ```
//! use vi_constraints::{ConstraintFn, InitialValues, Integrator, Options, SchemeKind};
//! use vi_core::{SeparableSystem, potential::LinearPotential};
//!
//! // a planar pendulum: M = I, V = −(0, −9.81)·q, g = ½(|q|² − 1), G = qᵀ
//! let system = SeparableSystem::with_diagonal_mass(&[1.0, 1.0])
//!     .potential(LinearPotential { force: vec![0.0, -9.81] });
//! let rod = ConstraintFn::new(2, 1,
//!     |q, g| g[0] = 0.5 * (q[0] * q[0] + q[1] * q[1] - 1.0),
//!     |q, G| { G[(0, 0)] = q[0]; G[(0, 1)] = q[1]; });
//! let options = Options::new(SchemeKind::Nodal, 0.01); // or any other of the four
//! let at = InitialValues::new(0.0, &[1.0, 0.0], &[0.0, 0.0]);
//! let mut run = Integrator::new(system, rod, options, at)?;
//! for _ in 0..100 {
//!     run.step()?;
//! }
//! let node = run.observe()?;
//! assert!(node.position_residual < 1e-14);
//! assert!((run.state().q[0] - -0.98629).abs() < 2e-3); // exact: −0.986291751132
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod checks;
mod construction;
pub mod discretization;
mod error;
pub mod kernels;
mod nodes;
mod origin;
mod report;
pub mod setup;
mod steps;

pub use checks::check_shapes;
pub use error::{ObserveError, ResumeError};
pub use nodes::NodeInStep;
pub use report::StepReport;
pub use setup::{Options, OrderMethod, SetupError, SingularStart, check_dense};

use crate::closure::ClosureWatch;
use crate::constraints::Constraints;
use crate::costate_sweep::{CostateChoice, CostateSweep, CostateTangents};
use crate::discretization::Discretization;
use crate::initialization::StartReport;
use crate::nonsmooth::Nonsmooth;
use crate::saddle_point::IndependentRows;
use crate::scheme::{ConditionNumbers, Scheme, StepSolver};
use nodes::TrialStep;
use origin::Origin;
use std::sync::Arc;
use vi_core::interval::Interval;
use vi_core::state::State;

/// A running integration: macro steps of one scheme at one order.
///
/// The bits of every later step are a function of what it was made from and of its [`State`]:
/// [`Integrator::resume`] continues a motion from a state that was stored.
pub struct Integrator<S: Discretization<C>, C> {
    system: S,
    constraints: Arc<C>,
    scheme: Box<dyn Scheme<S, C>>,
    solver: StepSolver,
    observer: S::Observer,
    start_observer: Option<S::Observer>, // where the start has fewer independent constraints
    rows: IndependentRows,
    gammas: Vec<f64>,
    method: OrderMethod,
    step: f64,
    origin: Origin,
    state: State,
    before: State, // the node the last macro step started from
    trial: Box<TrialStep>,
    start: StartReport,
    initial_velocity: Vec<f64>,
    watch: ClosureWatch,
    nonsmooth: Option<Box<Nonsmooth>>,
    costates: Option<CostateChoice<S, C>>,
}

impl<S: Discretization<C>, C> std::fmt::Debug for Integrator<S, C> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Integrator")
            .field("step", &self.step)
            .field("gammas", &self.gammas)
            .field("state", &self.state)
            .finish_non_exhaustive()
    }
}

impl<S: Discretization<C>, C: Constraints> Integrator<S, C> {
    /// The current state.
    #[must_use]
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The state that the last macro step started from.
    #[must_use]
    pub fn before(&self) -> &State {
        &self.before
    }

    /// How the order is reached.
    #[must_use]
    pub fn method(&self) -> OrderMethod {
        self.method
    }

    /// The interval of the last (sub-)step.
    #[must_use]
    pub fn interval(&self) -> &Interval {
        self.scheme.interval()
    }

    /// How consistent the start was.
    #[must_use]
    pub fn start_report(&self) -> &StartReport {
        &self.start
    }

    /// The velocity at the start, after projection.
    #[must_use]
    pub fn initial_velocity(&self) -> &[f64] {
        &self.initial_velocity
    }

    /// The system.
    #[must_use]
    pub fn system(&self) -> &S {
        &self.system
    }

    /// The constraints.
    #[must_use]
    pub fn constraints(&self) -> &C {
        &self.constraints
    }

    /// The independent constraints.
    #[must_use]
    pub fn rows(&self) -> &IndependentRows {
        &self.rows
    }

    /// Contacts, and what they did in the last step.
    #[must_use]
    pub fn nonsmooth(&self) -> Option<&Nonsmooth> {
        self.nonsmooth.as_deref()
    }

    /// What pulls costates back over steps by the structure of the mechanism, where that is known.
    #[must_use]
    pub fn costate_sweep(&self, along: CostateTangents) -> Option<Box<dyn CostateSweep<S, C>>> {
        let choice = self.costates?;
        choice(&self.system, &self.constraints, &self.rows, (self.method, along))
    }

    /// Condition numbers of the Newton matrix of the last step.
    pub fn condition(&mut self) -> Option<ConditionNumbers> {
        self.scheme.condition(&self.system, &self.constraints, self.solver.solution())
    }
}
