//! Rigid multibody systems: kinematic pairs, trees, closed loops.
//!
//! A body is a frame of twelve director coordinates, a joint is a [`pair`] between two frames, and
//! a [`Mechanism`] is everything that is joined: its constraints, its mass matrix, its spanning
//! tree. Point masses joined by rigid bars belong to it too.
//!
//! ```text
//! q = (φ, d_1, d_2, d_3) of every body, then 2 or 3 coordinates of every point mass
//! g = six internal constraints of every body (56), then the rows of the joints, of the bars, of the
//!     scalar constraints
//! t² = X t¹ + S τ,   P = P_in P_ex                                              LMO08 (71)–(75)
//! q_{n+1} = F_d(u, q_n): pair maps, parent before child                         LMO08 (76)–(86)
//! ```
//!
//! | folder | concept |
//! |---|---|
//! | `geometry` | twists, spatial matrices; points and vectors as linear forms in `q` ([`form`]) |
//! | [`pair`] | joints: anchors `ϱ`, axes `n, m_1, m_2`, gap `r` (62), (63); the kinematic pairs, one file each |
//! | `constraint` | [`joint_coordinate`] with derivatives; [`scalar_constraint`]: distances, guides, gears, prescribed motion |
//! | [`tree`] | sweeps over bodies; point masses on bars ([`particle`]) |
//! | [`mechanism`] | bodies, joints and bars as data ([`description`]) and as one system; spanning tree; [`initial_rates`]; [`prescribed`] motions that contradict each other |
//! | `sweep` | the sweeps over the links of a tree, each once for one tree and for many at once |
//! | `force` | [`spring`]: between two points; [`joint_force`]: springs, dampers, motors along joint coordinates; [`bumper`]: elastic stops; [`stribeck`]: smooth friction |
//! | [`contact`] | joint stops and dry friction of joint coordinates, contacts of shapes, rigid and compliant |
//! | `solver` | [`tree_step`]: a step of trees in sweeps over their links, [`tree_nodal`]: the same for emitted matrices, [`ensemble`]: many at once; [`closed_loop`]; [`sparse_nodal`]: bodies coupled by potentials; [`tree_map`]: dense; [`run`]: the choice |
//! | `output` | [`joint_motion`]: coordinates and rates along a run; [`reaction`]: of joints and bars, from the wrenches that joints transmit; [`tree_multipliers`]: frame by frame |
//! | [`builder`] | a mechanism described in Rust |
//! | [`design`] | derivatives by the numbers of a mechanism: of the equations of a step, of the start |
//!
//! Each folder uses only those above it.
//!
//! | type | is |
//! |---|---|
//! | [`PairKind`], `MotionSubspace`, `PairConstraint` | pairs; the columns of `S` and the rows of `g_ex` that define one |
//! | [`Joint`], [`Description`], [`Mechanism`] | joints; a mechanism as data; its constraints, mass, spanning tree |
//! | [`MechanismBuilder`], [`ForceElements`] | a mechanism described in Rust; what acts on it, as data for any family of schemes |
//! | `JointCoordinate`, `JointSpring`, `JointForce` | a length or an angle of a joint; what acts along it |
//! | `NearlyRedundant`, `LoopSurvey` | constraints of loops that are redundant but for the digits of a file; loops as they are found, locked or not |
//! | `TreeStep`, `TreeVelocity`; `LoopStep`, `LoopVelocity` | the nodal scheme on trees of bodies, in sweeps of its own; `v̂` of a node by them; the same with closed loops on top |
//! | `TreeCostates`, `LoopCostates` | costates of the end of a step to those of its start, on trees of bodies; with few rows of loops on top |
//! | `TreeNodal`, `LoopNodal`, `SparseNodal`, `TreeDescriptor`, `Beside` | `NodalOperators`: trees, closed loops, coupled bodies and beams, deep coupled trees and point masses, bodies beside point masses |
//! | `TreeSweeps`, `LoopSweeps`, `CoupledSweeps` | Galerkin schemes on trees with control points side by side, on closed loops, on trees with beams |
//! | `Ensemble` | many members of one tree in the lanes of wide registers, each as its own integrator would move it |
//! | [`ReactionObserver`], `ClosureForces` | what joints transmit, from the constraint force of a node; multipliers of the closures for it |
//!
//! Conserved to round-off: the constraints at positions and velocities, and the momentum maps of
//! every symmetry that gravity, springs and ground joints leave. This crate knows no beam and no
//! file.
//!
//! Source: S. Leyendecker, J. E. Marsden, M. Ortiz, ZAMM 88 (2008) 677–708, §5, cited as LMO08 with
//! its equation numbers.
#![cfg_attr(not(test), deny(clippy::disallowed_methods))] // equal bits on every machine
#![forbid(unsafe_code)]
#![deny(missing_docs)]
#![warn(missing_debug_implementations)]
#![cfg_attr(test, allow(clippy::float_cmp))] // tests compare exactly representable numbers

/// `Debug` of a workspace: its name.
macro_rules! opaque_debug {
    ($($name:ident),*) => {
        $(impl std::fmt::Debug for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.debug_struct(stringify!($name)).finish_non_exhaustive()
            }
        })*
    };
}
pub(crate) use opaque_debug;

pub mod builder;
mod constraint;
pub mod contact;
pub mod design;
mod force;
mod geometry;
pub mod mechanism;
mod output;
pub mod pair;
mod solver;
mod sweep;
pub mod tree;

// What the interface of this crate speaks of, for those who depend on it alone.
pub use nalgebra;
pub use vi_constraints;
pub use vi_core;
pub use vi_rigid;

pub use constraint::{joint_coordinate, rolling, scalar_constraint, velocity_constraint};
pub use force::{
    bumper, bushing, held_effort, joint_force, law, particle_load, spring, stored_energy, stribeck,
    tension, wrench_law,
};
pub use geometry::{form, six_coordinates, spatial};
pub use mechanism::{description, initial_rates, prescribed};
pub use output::{joint_motion, reaction, tree_multipliers};
pub use pair::joint;
pub use solver::closed_loop::loop_rank;
pub use solver::closed_loop::survey as loop_survey;
pub use solver::{
    closed_loop, ensemble, run, sparse_nodal, tree_descriptor, tree_map, tree_nodal, tree_step,
    tree_sweeps,
};
pub use tree::particle;

pub use builder::{BuildError, BuiltMechanism, ForceElements, MechanismBuilder};
pub use joint_motion::JointMotion;
pub use mechanism::{Description, Mechanism};
pub use pair::PairKind;
pub use pair::joint::{FrameId, Joint, Side};
pub use reaction::{BarTension, NodeReactions, Reaction, ReactionObserver, Reactions};
