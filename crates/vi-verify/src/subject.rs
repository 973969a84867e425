//! What is verified, as the measurements see it.
//!
//! A [`Subject`] can be started with any method and step; the [`RunningMotion`] it gives is
//! stepped, reversed and asked. Integrators become motions by [`crate::running`]; model files are
//! subjects, and so is a deliberately broken integrator.

use super::equations::{Equations, ReactionWrench};
use serde::{Deserialize, Serialize};
use vi_constraints::SchemeKind;
use vi_constraints::scheme::ConditionNumbers;
use vi_constraints::tangent_map::Tangents;
use vi_core::momentum_map::Momentum;
use vi_emscheme::EmForm;

/// A time-stepping method.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(untagged)]
pub enum SteppingMethod {
    /// One of the four variational schemes; orders 4, 6, 8 by composition.
    Variational(SchemeKind),
    /// A Galerkin scheme, order `2s` with `s` control points.
    Galerkin(GalerkinForm),
    /// One of the three forms of the energy–momentum scheme.
    EnergyMomentum(EmForm),
}

/// A form of the Galerkin schemes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum GalerkinForm {
    /// On the discrete null space.
    #[serde(rename = "galerkin")]
    Nodal,
    /// With multipliers.
    #[serde(rename = "galerkin-constrained")]
    Constrained,
}

impl GalerkinForm {
    /// The form of a scheme, where it has one.
    #[must_use]
    pub fn of(kind: SchemeKind) -> Option<Self> {
        match kind {
            SchemeKind::Nodal => Some(Self::Nodal),
            SchemeKind::Constrained => Some(Self::Constrained),
            SchemeKind::Dalembert | SchemeKind::Reduced => None,
        }
    }

    /// The scheme of order 2 in this form.
    #[must_use]
    pub fn kind(self) -> SchemeKind {
        match self {
            Self::Nodal => SchemeKind::Nodal,
            Self::Constrained => SchemeKind::Constrained,
        }
    }

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Nodal => "galerkin",
            Self::Constrained => "galerkin-constrained",
        }
    }
}

impl SteppingMethod {
    /// The production scheme.
    pub const NODAL: Self = Self::Variational(SchemeKind::Nodal);

    /// Whether it follows from a discrete action.
    #[must_use]
    pub fn is_variational(self) -> bool {
        matches!(self, Self::Variational(_) | Self::Galerkin(_))
    }

    /// The name in model files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Variational(kind) => kind.name(),
            Self::Galerkin(form) => form.name(),
            Self::EnergyMomentum(form) => form.name(),
        }
    }
}

/// What a motion is started with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SchemeSetting {
    /// The method.
    pub method: SteppingMethod,
    /// Its order: 2; 4, 6, 8 by composition; 2, 4 … 16 of Galerkin schemes.
    pub order: u32,
    /// `h`, s.
    pub step: f64,
    /// With dense matrices, so that there is a condition number.
    pub dense: bool,
}

impl SchemeSetting {
    /// A method of an order with a step `h`.
    #[must_use]
    pub fn new(method: SteppingMethod, order: u32, step: f64) -> Self {
        Self { method, order, step, dense: false }
    }
}

/// What converges, at a node.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NodeValues {
    /// `q_n`.
    pub q: Vec<f64>,
    /// `ᵠp_n`, the projected Legendre transform (39), (40); `M v_n` of energy–momentum schemes.
    pub p: Vec<f64>,
    /// The constrained Legendre transform `p_n` (34), (35); order 2 and regular `M` only.
    pub p_constrained: Option<Vec<f64>>,
    /// `λ_n` of (36), at the start of (47); order 2 only. Of energy–momentum schemes the mean of
    /// two neighbouring steps. Where constraints are redundant the force `Gᵀλ` instead, which is
    /// unique.
    pub lambda: Option<Vec<f64>>,
    /// `λ` of the acceleration level; of energy–momentum schemes that of a single step.
    pub lambda_other: Option<Vec<f64>>,
    /// What joints exert, with the multipliers that it follows from; `None` without joints.
    pub reactions: Option<ReactionValues>,
}

/// Reactions at a node.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReactionValues {
    /// The multipliers of all constraints, shape `m`; of least norm where constraints are
    /// redundant.
    pub lambda: Vec<f64>,
    /// Of each joint on its child, in space.
    pub joints: Vec<ReactionWrench>,
}

/// Energy, momentum maps and constraint residuals at a node.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Invariants {
    /// `H_d(q_n, ᵠp_n)`, J.
    pub energy: f64,
    /// `E_d = −∂L_d/∂h` of the step from here, `Σ γ_i E_{d,i}` of its sub-steps; of energy–momentum
    /// schemes the energy itself, J.
    pub discrete_energy: f64,
    /// `½ v̂ᵀ M v̂` or `|V|`, the larger: what the energy is made of, J.
    pub energy_size: f64,
    /// Momentum maps of the projected momentum.
    pub momentum: Momentum,
    /// Sums of the absolute values that they are made of.
    pub momentum_size: Momentum,
    /// `|g(q_n)|_∞`.
    pub position: f64,
    /// `|h_d|_∞` of (46) with `p_n`; `None` where it is not defined (composed steps, singular `M`).
    pub momentum_level: Option<f64>,
    /// `|q_n|_∞`.
    pub size: f64,
}

/// What holds of a system at a node, beyond numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Nature {
    /// Components of the linear and the angular momentum that are conserved by Noether's theorem:
    /// translations and rotations under which `g`, `V` and the forces are invariant.
    pub symmetries: [bool; 6],
    /// No force without a potential acts, and no constraint depends on time.
    pub conservative: bool,
    /// A force without a potential acts.
    pub forced: bool,
    /// A force takes energy out, or values are sampled and held: a motion is not retraced.
    pub dissipative: bool,
    /// Velocities are constrained beyond what configurations allow: rolling, blades.
    pub nonholonomic: bool,
}

/// Configuration and velocity of other initial values than those of the subject.
pub type Initial<'a> = (&'a [f64], &'a [f64]);

/// A system that can be set in motion.
pub trait Subject: Sync {
    /// Sets it in motion from its own initial values, or from the consistent `(q(0), v(0))` given.
    ///
    /// # Errors
    /// Why the method does not apply, in words.
    fn start_from(
        &self,
        setting: SchemeSetting,
        at: Option<Initial<'_>>,
    ) -> Result<Box<dyn RunningMotion>, String>;

    /// Sets it in motion from its own initial values.
    ///
    /// # Errors
    /// As [`Subject::start_from`].
    fn start(&self, setting: SchemeSetting) -> Result<Box<dyn RunningMotion>, String> {
        self.start_from(setting, None)
    }

    /// The exact motion at time `t`, where it is known.
    fn exact(&self, _t: f64) -> Option<NodeValues> {
        None
    }
}

/// A motion in progress.
pub trait RunningMotion {
    /// One macro step.
    ///
    /// # Errors
    /// Why it failed, in words.
    fn step(&mut self) -> Result<(), String>;
    /// Reverses the direction of time.
    fn reverse(&mut self);
    /// The configuration of the present node.
    fn q(&self) -> &[f64];
    /// The time of the present node, s.
    fn time(&self) -> f64;
    /// Internal variables of the system, on which the map of a step depends.
    fn internal(&self) -> &[f64];
    /// The momentum that the next step begins with: `p̄_n`, of energy–momentum schemes `M v_n`.
    fn p(&self) -> Vec<f64>;
    /// The velocity at the present node, tangential: `v̂` of the projected momentum, or `v_n`.
    ///
    /// # Errors
    /// As [`RunningMotion::values`].
    fn velocity(&mut self) -> Result<Vec<f64>, String>;
    /// The closest `(q, v)` that meets all constraints at the present time.
    ///
    /// # Errors
    /// Why there is none, in words.
    fn consistent(&self, q: &[f64], v: &[f64]) -> Result<(Vec<f64>, Vec<f64>), String>;
    /// The fastest vibration or rotation about the present node, rad/s; `None` where `Pᵀ M P` is
    /// singular.
    ///
    /// # Errors
    /// As [`RunningMotion::values`].
    fn frequency(&mut self) -> Result<Option<f64>, String>;
    /// The equations of motion, which outputs are compared with.
    fn equations(&self) -> Box<dyn Equations + '_>;
    /// What converges, at the present node; the motion goes on as if this had not been asked.
    ///
    /// # Errors
    /// Why it could not be observed, in words.
    fn values(&mut self) -> Result<NodeValues, String>;
    /// Energy, momentum maps and constraint residuals at the node that the last step started from.
    ///
    /// # Errors
    /// As [`RunningMotion::values`].
    fn invariants(&mut self) -> Result<Invariants, String>;
    /// What holds at the present node.
    ///
    /// # Errors
    /// As [`RunningMotion::values`].
    fn nature(&mut self) -> Result<Nature, String>;
    /// Condition numbers of the Newton matrix of the last step.
    fn condition(&mut self) -> Option<ConditionNumbers>;
    /// A canonical basis of tangent vectors at the present node.
    fn tangents(&mut self) -> Tangents;
    /// One macro step that takes tangent vectors along; begun by [`RunningMotion::tangents`].
    ///
    /// # Errors
    /// Why it failed, in words.
    fn step_tangents(&mut self, tangents: &mut Tangents) -> Result<(), String>;
}
