//! Statics and small vibrations of multibody systems: bodies, beams, point masses, joints, force
//! elements.
//!
//! ```text
//! ∇V(q) − f(t, q) + G(t, q)ᵀ μ = 0,    g(t, q) = 0        equilibrium, t the load parameter
//! K_r x = ω² M_r x                                        vibrations about it
//! ```
//!
//! | file | concept |
//! |---|---|
//! | [`problem`] | load stepping |
//! | [`arc_length`] | continuation by arc length, through limit points |
//! | `branch` | from a path that turns unstable to the branch it meets there |
//! | [`relaxation`] | an initial configuration that is no equilibrium; directions without stiffness |
//! | [`mod@modes`] | small vibrations about an equilibrium |
//! | [`mod@vibrations`] | the same with damping and gyroscopic terms |
//! | [`buckling`] | critical loads of a static state |
//! | [`harmonic`] | harmonic response about a state |
//! | `lowest` | the lowest modes of a large system |
//! | [`first_order`] | small motions with constraints on velocities and states of signals |
//! | [`path`] | equilibria, paths, why a path ends |
//! | [`rotation`] | steady rotation of a whole system |
//! | [`steady_motion`] | a motion whose wheels and rotors spin |
//! | `field` | what a steady motion does with a system |
//! | [`stability`] | whether an equilibrium is stable: the signs of its stiffness |
//! | [`step_stability`] | stability of a time step about a steady rotation |
//! | [`step_bounds`] | bounds of the change of one step: jumps to other equilibria |
//! | [`limit`] | bending of an element between its nodes |
//! | `equations` | residual, exact sparse tangent, independent rows, scaled solution |
//!
//! | type | is |
//! |---|---|
//! | [`StaticProblem`], [`StaticPath`] | equilibria and paths of equilibria |
//! | [`Modes`], [`Vibrations`] | small vibrations, undamped, and with dampers or gyroscopic forces |
//!
//! A system is any [`vi_core::SeparableSystem`] on a [`vi_multibody::Mechanism`]. This crate knows
//! no beam: elastic elements are potentials, and the pairs of frames between which a step may not
//! bend too far.
#![cfg_attr(not(test), deny(clippy::disallowed_methods))] // equal bits on every machine
#![forbid(unsafe_code)]
#![deny(missing_docs)]
#![warn(missing_debug_implementations)]
#![cfg_attr(test, allow(clippy::float_cmp))] // tests compare exactly representable numbers

pub mod arc_length;
mod branch;
pub mod buckling;
mod equations;
mod field;
pub mod first_order;
mod first_order_terms;
pub mod harmonic;
mod jump;
pub mod limit;
mod lowest;
pub mod modes;
pub mod path;
pub mod problem;
pub mod relaxation;
pub mod rotation;
pub mod stability;
pub mod steady_motion;
pub mod step_bounds;
pub mod step_stability;
pub mod vibrations;

// What the interface of this crate speaks of, for those who depend on it alone.
pub use nalgebra;
pub use vi_constraints;
pub use vi_core;
pub use vi_multibody;
pub use vi_rigid;

pub use arc_length::{ArcLengthSettings, Continuation};
pub use buckling::{Buckling, BucklingError};
pub use first_order::FirstOrder;
pub use harmonic::{AddedDamping, HarmonicResponse};
pub use limit::{BendingBounds, LimitReport};
pub use modes::{ModeError, Modes, StaticLinearization, modes};
pub use path::{Equilibrium, StaticError, StaticPath, StaticSettings};
pub use problem::StaticProblem;
pub use rotation::{RotationError, SteadyRotation};
pub use steady_motion::{SteadyMotion, SteadyMotionError};
pub use step_bounds::StepBounds;
pub use step_stability::{SteadyStep, StepStabilityError};
pub use vibrations::{MotionKind, Vibration, Vibrations, vibrations};
