//! Rigid multibody systems: kinematic pairs, trees, closed loops.
//!
//! A body is a frame of twelve director coordinates, a joint is a [`pair`] between two frames, and a
//! [`Mechanism`] is everything that is joined: its constraints, its mass matrix, its spanning tree.
//! Point masses joined by rigid bars belong to it too.
//!
//! ```text
//! q = (φ, d_1, d_2, d_3) of every body, then 2 or 3 coordinates of every point mass
//! g = six internal constraints of every body (56), then the rows of the joints, of the bars, of the
//!     single constraints
//! t² = X t¹ + S τ,   P = P_in P_ex                                              LMO08 (71)–(75)
//! q_{n+1} = F_d(u, q_n): pair maps, parent before child                         LMO08 (76)–(86)
//! ```
//!
//! | file | concept |
//! |---|---|
//! | [`form`] | points and vectors as linear forms in `q`; constraint rows as their products |
//! | [`joint`] | anchors `ϱ`, axes `n, m_1, m_2`, gap `r` (62), (63) |
//! | [`pair`] | the kinematic pairs, one file each; the joint table |
//! | [`description`], [`mechanism`] | bodies, point masses, joints and bars; the same as one system |
//! | [`builder`], [`initial_rates`] | a mechanism described in Rust; velocities from joint rates |
//! | [`tree`], [`particle`] | sweeps over bodies; point masses on bars |
//! | [`map`] | `P`, `F_d`, `∂F_d/∂u` of the spanning tree as dense matrices |
//! | [`articulated`] | the Newton step on trees in linear time |
//! | [`closed_loop`] | loops on top of a tree, redundant constraints, singular configurations |
//! | [`sparse_nodal`] | the Newton step on trees whose members are coupled by potentials |
//! | [`scalar_constraint`] | distances, guides, couplings, prescribed motion |
//! | [`coordinate`], [`joint_force`] | joint coordinates with their revolutions; springs, dampers, motors on them |
//! | [`spring`] | springs and dampers between two points |
//! | [`prescribed`] | prescribed motions that contradict each other along their paths |
//! | [`reaction`] | joint reactions and bar tensions from multipliers |
//! | [`coordinates`] | all coordinates of a joint along a run, and their rates, as output |
//! | [`run`] | which operators carry which scheme |
//!
//! Conserved to round-off: the constraints at positions and velocities, and the momentum maps of every
//! symmetry that gravity, springs and ground joints leave. This crate knows no beam and no file.
//!
//! Source: S. Leyendecker, J. E. Marsden, M. Ortiz, ZAMM 88 (2008) 677–708, §5, cited as LMO08 with
//! its equation numbers.
#![forbid(unsafe_code)]
#![deny(missing_docs)]
#![cfg_attr(test, allow(clippy::float_cmp))] // tests compare exactly representable numbers

pub mod articulated;
pub mod builder;
pub mod closed_loop;
pub mod coordinate;
pub mod coordinates;
pub mod description;
pub mod form;
pub mod initial_rates;
pub mod joint;
pub mod joint_force;
pub mod map;
pub mod mechanism;
pub mod pair;
pub mod particle;
pub mod placement;
pub mod prescribed;
pub mod reaction;
pub mod run;
pub mod scalar_constraint;
mod spanning;
pub mod sparse_nodal;
pub mod spatial;
pub mod spring;
pub mod tree;

pub use builder::{BuildError, BuiltMechanism, ForceElements, MechanismBuilder};
pub use coordinates::JointCoordinates;
pub use joint::{FrameId, Joint, Side};
pub use mechanism::{Description, Mechanism};
pub use pair::PairKind;
pub use reaction::{Reaction, Reactions, Tension};

/// The example of the README is compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
