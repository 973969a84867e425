//! Holonomic constraints and the four equivalent variational schemes on any `q ∈ R^n`.
//!
//! This crate knows constraints but no geometry. A mass matrix, a potential and `g(q)` are enough
//! for all four schemes; with `P` and `F_d` of one's own schemes 3 and 4 become cheaper.
//! [`integrator`] has the ten-line example.
//!
//! | file | concept |
//! |---|---|
//! | [`constraints`] | `g`, `G`, second derivatives |
//! | [`design`] | derivatives of the equations of a step by parameters |
//! | [`null_space`] | `P` and the rank by column-pivoted QR |
//! | [`saddle_point`] | `[A Gᵀ; G 0]` over independent rows |
//! | [`redundancy`] | independence of rows, null vectors of `Gᵀ` |
//! | [`least_norm`] | multipliers of the least norm |
//! | [`unit_rows`] | the same of rows of length one: free of units |
//! | [`reparametrization`] | `P`, `F_d`, `∂F_d/∂u`, dense or as operators |
//! | [`tangent_space`] | `F_d` of any constraints: a step in the tangent space, projected |
//! | [`constrained`], [`dalembert`], [`nodal`], [`reduced`] | schemes 1 to 4; [`nodal_operators`]: the last two by operators |
//! | [`scheme`], [`discretization`] | their common interface; what a family of schemes provides |
//! | [`initialization`], [`closest`] | consistent starts; the configuration next to a given one, also where nothing overlaps |
//! | [`agreement`] | dependent constraints that contradict each other at the start |
//! | [`nearby`] | whether they depend on one another next to it, too |
//! | [`closure`] | the residual `g(q_n)` of every step against round-off |
//! | [`projection`] | `R_d`, `Q`, `M⁻¹` at a node |
//! | [`node_solvers`] | the same from the structure of a mechanism, in linear time |
//! | [`fastest_motion`] | the fastest vibration about a node, by Lanczos' method |
//! | [`legendre`] | discrete Legendre transforms, multipliers, energies of given configurations |
//! | [`node`] | the same along an integration, and hidden constraints |
//! | [`galerkin`] | schemes of order `2s` with `s` control points per step |
//! | [`nonsmooth`] | impulses of contacts, joint stops and dry friction at nodes; steps with nodes at first touches |
//! | [`setup`], [`integrator`] | options and refusals; all of it together |
//!
//! | type | is |
//! |---|---|
//! | [`Constraints`], `IndependentRows` | trait: `g`, `G`, `D²g`, rates in time; which of them are enforced |
//! | [`Reparametrization`], [`NodalOperators`] | traits: `P`, `F_d`, `∂F_d/∂u`, as matrices or as operators |
//! | [`NodalEquations`](nodal::NodalEquations) | trait: (28) in the unknowns of a mechanism |
//! | [`Sweeps`](galerkin::Sweeps), [`ControlPointOperators`] | traits: what the nodal form of the Galerkin schemes asks of a mechanism, for all control points or for one |
//! | [`Scheme`](scheme::Scheme), [`Discretization`](discretization::Discretization) | traits: the equations of a step; what a family of schemes provides |
//! | [`StepSolver`](scheme::StepSolver), [`Options`], [`InitialValues`] | Newton's method for any scheme; what to integrate with; what from |
//! | [`Integrator`], [`Transition`](discretization::Transition), [`Node`](node::Node) | system + constraints + scheme + composition: an iterator of steps; the node before a step, the step, the node after it; the quantities of a node |
//! | [`NodeSolvers`](node_solvers::NodeSolvers), [`RateOperators`](node_solvers::RateOperators) | `v̂` and `λ` of a node from the structure of a mechanism; without them by the saddle-point matrix |
//! | [`FastestMotions`](fastest_motion::FastestMotions) | the fastest vibrations about a node, with and without potentials: what a step has to resolve |
//! | [`LegendreTransforms`], [`TangentMap`](tangent_map::TangentMap) | (34)–(42) of given configurations; the exact tangent of a step |
//! | [`StepLinearization`](linearization::StepLinearization), [`GalerkinLinearization`](galerkin::GalerkinLinearization), [`Linearization`](costate_sweep::Linearization) | the same with forces, sources and memory, forward and backward: of a step, of a Galerkin step, of any |
//! | [`GaussSlopes`](galerkin::GaussSlopes), [`Parts`](galerkin::Parts) | what acts in a Galerkin step, differentiated; its Gauss nodes and constraints with their costates |
//! | [`CostateSweep`](costate_sweep::CostateSweep) | trait: backward for costates, by these or by the structure of a mechanism |
//!
//! Source: S. Leyendecker, J. E. Marsden, M. Ortiz, ZAMM 88 (2008) 677–708 (LMO08).
#![cfg_attr(not(test), deny(clippy::disallowed_methods))] // equal bits on every machine
#![forbid(unsafe_code)]
#![deny(missing_debug_implementations, missing_docs)]
#![cfg_attr(test, allow(clippy::float_cmp))] // tests compare exactly representable numbers

pub mod closure;
pub mod constraints;
pub mod design;
mod initial;
pub mod integrator;
mod manifold;
mod nodes;
pub mod nonsmooth;
mod rows;
pub mod scheme;

pub use initial::{agreement, closest, initialization, nearby};
#[doc(inline)]
pub use integrator::{discretization, setup};
pub use manifold::{null_space, reparametrization, tangent_space};
pub use nodes::{fastest_motion, legendre, node, node_solvers, projection};
pub use rows::{connected, least_norm, redundancy, saddle_point, unit_rows};
#[doc(inline)]
pub use scheme::{
    constrained, costate_sweep, dalembert, galerkin, linearization, nodal, nodal_operators,
    reduced, tangent_map, unknowns,
};

// What the interface of this crate speaks of, for those who depend on it alone.
pub use nalgebra;
pub use vi_core;

pub use constraints::{ConstraintFn, Constraints, Unconstrained};
pub use galerkin::{ControlPointOperators, DenseControlPoints};
pub use initialization::InitialValues;
pub use integrator::{Integrator, Options};
pub use legendre::LegendreTransforms;
pub use reparametrization::{DenseNodal, NodalOperators, Reparametrization};
pub use scheme::SchemeKind;
pub use setup::OrderMethod;
pub use tangent_space::TangentSpace;

#[cfg(test)]
mod pendulum_tests;
