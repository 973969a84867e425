//! Geometrically exact beams in director coordinates.
#![forbid(unsafe_code)]
#![deny(missing_docs)]
#![cfg_attr(test, allow(clippy::float_cmp))] // tests compare exactly representable numbers

pub mod averaged;
pub mod element;
mod equilibrium;
pub mod limit;
pub mod mesh;
pub mod model;
pub mod section;
pub mod static_path;
pub mod statics;
pub mod strain;

#[cfg(test)]
mod sample;
