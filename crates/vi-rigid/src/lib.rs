//! One rigid body in director coordinates.
//!
//! The configuration of a body is a frame of twelve coordinates `q = (φ, d_1, d_2, d_3)`: its
//! centre of mass `φ` and a body-fixed orthonormal triad along the principal axes of inertia. The
//! mass matrix is then constant, at the price of six internal constraints per body, which the null
//! space matrix `P_in` and the reparametrization by the exponential map take out again.
//!
//! | file | concept | LMO08 |
//! |---|---|---|
//! | [`rotation`] | `θ̂`, `exp θ̂`, its tangent, the polar step | §4 |
//! | [`directors`] | a frame in a slice, internal constraints | (56) |
//! | [`null_space`] | `P_in` | (59) |
//! | [`reparametrization`] | `F_d` of one body and its tangent | (61) |
//! | [`inertia`], [`shape`], [`composite`] | Euler tensor, homogeneous shapes, several parts | (57) |
//! | [`polyhedron`] | homogeneous solids bounded by triangles | |
//! | [`body`] | mass matrix of one body | (58) |
//! | [`load`], [`time_history`] | wrenches on a frame | |
//! | [`gap`] | gaps between shapes, rows and slip of their contacts | |
//! | [`single_body`] | a body that is free or held at one point | §4 |
//!
//! | type | is |
//! |---|---|
//! | [`RigidBody`], [`PrincipalInertia`], [`SingleBody`] | mass matrix and internal constraints of one body; its inertia; a body that is free or held at a point |
//! | [`Polyhedron`] | mass properties of a closed surface of triangles |
//! | [`Load`], [`TimeHistory`] | wrenches on a frame, with a factor in time |
//!
//! Directors are numbered from 0 in code and from 1 in formulas and messages. This crate knows no
//! joint except the fixed point and no system of bodies.
//!
//! Source: S. Leyendecker, J. E. Marsden, M. Ortiz, Variational integrators for constrained
//! dynamical systems, ZAMM 88 (2008) 677–708, cited as LMO08 with its equation numbers.
#![cfg_attr(not(test), deny(clippy::disallowed_methods))] // equal bits on every machine
#![forbid(unsafe_code)]
#![deny(missing_docs)]
#![warn(missing_debug_implementations)]

pub mod body;
pub mod composite;
pub mod directors;
pub mod gap;
pub mod inertia;
pub mod load;
pub mod null_space;
pub mod polyhedron;
pub mod reparametrization;
pub mod rotation;
pub mod shape;
pub mod single_body;
pub mod time_history;

// What the interface of this crate speaks of, for those who depend on it alone.
pub use nalgebra;
pub use vi_constraints;
pub use vi_core;

pub use body::RigidBody;
pub use composite::{Part, compose};
pub use inertia::{EulerMoments, InertiaError, PrincipalAxes, PrincipalInertia};
pub use load::{Load, LoadError, LoadKind};
pub use polyhedron::{Polyhedron, SurfaceError};
pub use reparametrization::RotationTooLarge;
pub use shape::{MassProperties, Shape};
pub use single_body::{SingleBody, Support};
pub use time_history::{HistoryError, TimeFunction, TimeHistory};
