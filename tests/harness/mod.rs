//! Shared by the tests of this folder; each test uses a part of it.
#![allow(dead_code, unreachable_pub)] // every test file compiles its own copy and uses a part

pub mod beam;
pub mod case;
pub mod control;
pub mod control_case;
pub mod em;
pub mod galerkin;
pub mod helicoidal;
pub mod hostile;
pub mod identification;
pub mod identification_case;
pub mod laws;
pub mod legendre;
pub mod models;
pub mod motions;
pub mod nonsmooth;
pub mod optimal_control;
pub mod pendulum;
pub mod rigid;
