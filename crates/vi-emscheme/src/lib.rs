//! The energy–momentum scheme: the comparator of the variational integrators.
//!
//! ```text
//! (2/h) M (q_{n+1} − q_n) − 2 M v_n + h D̄V(q_n, q_{n+1}) + h Ḡ(q_n, q_{n+1})ᵀ λ = h f̄
//! g(q_{n+1}) = 0,    v_{n+1} = (2/h)(q_{n+1} − q_n) − v_n
//! ```
//! Conserved along a step without load, up to what Newton's method leaves over: energy, linear and
//! angular momentum (with an equivariant `D̄V`), the constraints. Not symplectic. Order 2 in `q`
//! and `p`, and 4, 6, 8 by composition of pairs of steps ([`scheme::sub_steps`]); the multiplier
//! belongs to the middle of the step and alternates by `O(h)` from step to step, the mean of two
//! neighbours has order 2 ([`node`]). The same three forms as the variational schemes, so that both
//! methods are compared on equal footing.
//!
//! | file | concept |
//! |---|---|
//! | [`discrete_gradient`] | `D̄V`: the trait; linear potentials |
//! | [`invariant`] | `D̄V` of functions of `D·D`: springs |
//! | [`beam`] | `D̄V` of beams: averaged strains |
//! | [`coordinate`] | `D̄θ` of joint coordinates |
//! | [`joint`] | springs, dampers, motors on joint coordinates |
//! | [`gonzalez`] | `D̄V` of anything else, G96 |
//! | [`load`] | wrenches and dampers at the midpoint |
//! | [`constraint`] | `Ḡ` with `Ḡ Δq = Δg` |
//! | [`em_system`] | mass, potentials, loads: the bracket and its derivative |
//! | [`null_space`] | `P̄` with `Ḡ P̄ = 0`, and why its derivative is not needed |
//! | [`constrained`], [`dalembert`], [`nodal`] | the three forms; [`loop_nodal`]: the last on closed loops |
//! | [`dense_operators`], [`sparse_operators`] | the algebra of the nodal form |
//! | [`scheme`] | the names of the forms; the end of a step |
//! | [`node`] | energy, momenta, multipliers, residuals |
//! | [`tangent_map`] | the tangent of a step: the symplectic form is not kept |
//! | [`integrator`], [`run`] | the integrator of any constraints; of mechanisms |
//!
//! | type | is |
//! |---|---|
//! | [`EmSystem`], [`DiscreteGradient`], [`DiscreteConstraints`] | the system of the energy–momentum schemes; traits: `D̄V`, `Ḡ` |
//! | [`EmIntegrator`], [`EmForm`] | their integrator of any constraints, and its three forms |
//!
//! Sources: P. Betsch, S. Leyendecker, IJNME 67 (2006) 499–552 (BL06); O. Gonzalez, J. Nonlinear
//! Sci. 6 (1996) 449–467 (G96).
#![cfg_attr(not(test), deny(clippy::disallowed_methods))] // equal bits on every machine
#![forbid(unsafe_code)]
#![deny(missing_debug_implementations, missing_docs)]
#![cfg_attr(test, allow(clippy::float_cmp))] // tests compare exactly representable numbers

mod balance;
pub mod beam;
pub mod constrained;
pub mod constraint;
pub mod coordinate;
pub mod dalembert;
pub mod dense_operators;
pub mod discrete_gradient;
mod discretization;
pub mod em_system;
mod form;
pub mod gonzalez;
pub mod integrator;
pub mod invariant;
pub mod joint;
pub mod load;
pub mod loop_nodal;
pub mod nodal;
pub mod node;
pub mod null_space;

pub mod run;
pub mod scheme;
mod setup;
pub mod sparse_operators;
pub mod tangent_map;

#[cfg(test)]
extern crate self as vi_emscheme; // the models of the tests name the crate
#[cfg(test)]
#[path = "../tests/common/mod.rs"]
mod common;

// What the interface of this crate speaks of, for those who depend on it alone.
pub use nalgebra;
pub use vi_beam;
pub use vi_constraints;
pub use vi_core;
pub use vi_multibody;
pub use vi_rigid;

pub use constraint::DiscreteConstraints;
pub use discrete_gradient::DiscreteGradient;
pub use em_system::EmSystem;
pub use form::EmForm;
pub use integrator::{EmAlgebra, EmIntegrator, EmOptions};
pub use null_space::EmLinearization;
