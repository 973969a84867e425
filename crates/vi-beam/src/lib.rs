//! Geometrically exact beams in director coordinates.
//!
//! A beam is a chain of frames (its nodes) and two-node elements between them. Nodes carry joints
//! as rigid bodies do, so beams and bodies mix freely; every strain is a quadratic form of the
//! coordinates, so energies, momenta and constraints are conserved exactly as for rigid bodies.
//!
//! | file | concept |
//! |---|---|
//! | [`strain`] | `Γ`, `K` as quadratic forms, `𝔹_i` |
//! | [`helicoidal`] | strains of order 4, stable in tension: functions of seven forms |
//! | [`section`] | stiffnesses and inertias, from numbers or from shape and material |
//! | [`element`] | energy, gradient, Hessian, mass |
//! | [`at_coordinates`] | gradients, force, tangent of an element |
//! | [`averaged`] | the averaged-strain discrete potential |
//! | [`interpolated`] | strains and material damping in Galerkin steps |
//! | [`damping`] | material damping |
//! | [`design`] | elements by the numbers of their sections |
//! | [`dissipation`] | algorithmic dissipation of unresolved vibrations |
//! | [`mesh`] | nodes along curves, triads by a rule |
//! | [`model`] | beams, bodies, joints as one mechanism |
//! | [`frequency`] | a bound of the highest frequency |
//! | [`section_force`] | section forces, centre line |
//! | [`section_slopes`] | their derivatives |
//!
//! | type | is |
//! |---|---|
//! | [`BeamBuilder`], [`BeamElements`] | `builder.beam(…)`: the nodes of a beam in a `MechanismBuilder`; the elements of all beams |
//! | [`BeamModel`] | beams and bodies in one `Description` that is edited by hand |
//! | [`Section`], [`BeamMesh`], [`Element`] | stiffness and inertia of a section; nodes along a curve; energy and mass between nodes |
//!
//! Source: theory §6; P. Betsch, P. Steinmann, IJNME 54 (2002) 1775–1788; S. Leyendecker, P.
//! Betsch, P. Steinmann, Multibody Syst. Dyn. 19 (2008) 45–72.
#![cfg_attr(not(test), deny(clippy::disallowed_methods))] // equal bits on every machine
#![forbid(unsafe_code)]
#![deny(missing_docs)]
#![warn(missing_debug_implementations)]
#![cfg_attr(test, allow(clippy::float_cmp))] // tests compare exactly representable numbers

pub mod at_coordinates;
mod at_ends;
pub mod averaged;
pub mod curved;
pub mod damping;
pub mod design;
pub mod dissipation;
pub mod element;
pub mod elements;
mod following;
pub mod frequency;
pub mod helicoidal;
pub mod interpolated;
pub mod mass_kind;
pub mod mesh;
pub mod model;
mod products;
pub mod profile;
pub mod rest;
pub mod sagging;
pub mod section;
pub mod section_force;
pub mod section_slopes;
mod section_state;
mod small;
pub mod strain;
mod strained;
mod system;
pub mod varying;

// What the interface of this crate speaks of, for those who depend on it alone.
pub use nalgebra;
pub use vi_constraints;
pub use vi_core;
pub use vi_multibody;
pub use vi_rigid;

pub use element::{Element, ElementKind};
pub use elements::Elements;
pub use mass_kind::MassKind;
pub use mesh::{BeamMesh, FrameRule};
pub use model::{Beam, BeamBuilder, BeamElements, BeamModel, StrainRule};
pub use profile::{Material, Profile, Stated, Walls};
pub use rest::Rest;
pub use section::{Centers, Section, SectionError};
