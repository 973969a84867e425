//! The facade: from a model file to a trajectory and a report.
//!
//! ```text
//! model.toml → Model → Simulation → Sample, Sample, … → RunFolder: trajectory.csv, summary.json, …
//! ```
//!
//! | module | crate | concept |
//! |---|---|---|
//! | [`model`] | `holonom-model` | the model file: types, checks, errors with places |
//! | [`system`], [`dynamics`] | `holonom-sim` | from a model to numbers |
//! | [`simulation`], [`sample`], [`sensor`] | `holonom-sim` | the system of a model, its run, what is recorded |
//! | [`statics`], [`modes`] | `holonom-sim` | equilibria along the loads; small vibrations |
//! | [`output`] | `holonom-sim` | the files of a run |
//! | [`report`] | `holonom-report` | plots and the report page |
//! | [`export`] | `holonom-export` | results for other programs |
//! | [`import`](mod@import) | `holonom-import` | model files from URDF and MJCF |
//! | [`verification`] | `vi-verify` | orders, invariants, growth of errors, measured and judged |
//! | [`compare`](mod@compare), [`certificate`], [`bench`](mod@bench) | `holonom-study` | schemes side by side; verified properties on a model; what a step costs |
//! | [`run`] | | all of it in one call |
//!
//! This crate reads and writes files; it knows no terminal. A run in memory:
//!
//! ```
//! use holonom::{Model, Simulation};
//!
//! let text = r#"
//!     model = { name = "pendulum", dimension = 2, gravity = [0.0, -9.81] }
//!     particle = [{ name = "bob", mass = 1.0, position = [1.0, 0.0] }]
//!     bar = [{ name = "rod", from = "ground", to = "bob" }]
//!     simulation = { step = 0.01, end = 1.0 }
//! "#;
//! let model = Model::from_toml(text)?;
//! let mut simulation = Simulation::new(&model)?;
//! let mut heights = Vec::new();
//! let mut observe = |sample: &holonom::Sample| -> Result<(), std::convert::Infallible> {
//!     heights.push(sample.q[1]);
//!     Ok(())
//! };
//! simulation.run(&mut observe, &mut |_, _| {})?;
//! assert_eq!(heights.len(), 101);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Your own system
//!
//! A mass matrix, a potential and constraints are enough; here a bead on a parabola under gravity,
//! its potential written once for any number type, so that gradient and Hessian are exact.
//!
//! ```
//! use holonom::vi_constraints::{ConstraintFn, InitialValues, Integrator, Options, SchemeKind};
//! use holonom::vi_core::potential::{DualPotential, ScalarField};
//! use holonom::vi_core::{SeparableSystem, num_dual::DualNum};
//!
//! struct Gravity;
//! impl ScalarField<2> for Gravity {
//!     fn value<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D; 2]) -> D { q[1] * 9.81 }
//! }
//!
//! let system = SeparableSystem::with_diagonal_mass(&[1.0, 1.0]).potential(DualPotential(Gravity));
//! let parabola = ConstraintFn::new(2, 1,
//!     |q, g| g[0] = q[1] - q[0] * q[0],
//!     |q, G| { G[(0, 0)] = -2.0 * q[0]; G[(0, 1)] = 1.0; });
//! let options = Options::new(SchemeKind::Constrained, 0.01); // or any other of the four
//! let at = InitialValues::new(0.0, &[1.0, 1.0], &[0.0, 0.0]);
//! let mut run = Integrator::new(system, parabola, options, at)?;
//! for _ in 0..1000 {
//!     run.step()?;
//! }
//! let node = run.observe()?;
//! assert!(node.position_residual < 1e-14);
//! assert!((node.hamiltonian_projected.total() - 9.81).abs() < 1e-2); // bounded for ever
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Schemes 3 and 4 have as many unknowns as there are degrees of freedom. Without more they step in
//! the tangent space and project; a null space matrix `P(q)` and a map `F_d(u, q_n)` that stays on
//! the constraints spare them that:
//!
//! ```
//! use holonom::nalgebra::DMatrix;
//! use holonom::vi_constraints::{
//!     ConstraintFn, InitialValues, Integrator, Options, Reparametrization, SchemeKind,
//! };
//! use holonom::vi_core::newton::{UnknownBlock, BlockKind, Fault};
//! use holonom::vi_core::potential::LinearPotential;
//! use holonom::vi_core::{Interval, SeparableSystem};
//!
//! /// `F_d(u, q_n) = (x + u, (x + u)²)`.
//! struct Parabola;
//! impl Reparametrization for Parabola {
//!     fn dof(&self) -> usize { 1 }
//!     fn blocks(&self) -> Vec<UnknownBlock> {
//!         vec![UnknownBlock { kind: BlockKind::Position, range: 0..1, floor: 1e-10 }]
//!     }
//!     fn null_space(&self, q: &[f64], P: &mut DMatrix<f64>) {
//!         (P[(0, 0)], P[(1, 0)]) = (1.0, 2.0 * q[0]);
//!     }
//!     fn reparametrize(&self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
//!         (s.dq[0], s.dq[1]) = (u[0], u[0] * (2.0 * s.q0[0] + u[0]));
//!         (s.q1[0], s.q1[1]) = (s.q0[0] + s.dq[0], s.q0[1] + s.dq[1]);
//!         Ok(())
//!     }
//!     fn tangent(&self, _u: &[f64], s: &Interval, dF: &mut DMatrix<f64>) {
//!         (dF[(0, 0)], dF[(1, 0)]) = (1.0, 2.0 * s.q1[0]);
//!     }
//! }
//!
//! let system = SeparableSystem::with_diagonal_mass(&[1.0, 1.0])
//!     .potential(LinearPotential { force: vec![0.0, -9.81] });
//! let parabola = ConstraintFn::new(2, 1,
//!     |q, g| g[0] = q[1] - q[0] * q[0],
//!     |q, G| { G[(0, 0)] = -2.0 * q[0]; G[(0, 1)] = 1.0; });
//! let options = Options::new(SchemeKind::Nodal, 0.01);
//! let start = InitialValues::new(0.0, &[1.0, 1.0], &[0.0, 0.0]);
//! let mut run = Integrator::with_reparametrization(system, parabola, Parabola, options, start)?;
//! for _ in 0..1000 {
//!     run.step()?;
//! }
//! assert!(run.observe()?.position_residual < 1e-14);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod run;
pub mod sweep;

pub use holonom_export as export;
pub use holonom_import as import;
pub use holonom_model as model;
pub use holonom_report as report;
pub use holonom_sim::{
    design, dynamics, experiment, gradient, identification, modes, optimize, output, response,
    sample, sensor, simulation, statics, system,
};
pub use holonom_study::{bench, certificate, compare};
pub use vi_verify as verification;

pub use nalgebra;
pub use vi_beam;
pub use vi_constraints;
pub use vi_control;
pub use vi_core;
pub use vi_emscheme;
pub use vi_multibody;
pub use vi_rigid;
pub use vi_statics;

pub use holonom_model::{Model, ModelError, Override};
pub use holonom_sim::output::{RunFolder, Summary};
pub use holonom_sim::sample::{
    Member, MemberKind, Momenta, MomentaNames, ResidualsAtLevels, Sample,
};
pub use holonom_sim::simulation::control::{Controller, NextMidpoint, Reading};
pub use holonom_sim::simulation::members::Members;
pub use holonom_sim::simulation::{AssemblyReport, RunFailure, RunOutcome, Simulation};
pub use holonom_sim::statics::{StaticFacts, Statics};
pub use holonom_sim::system::held::{Input, InputPlace};
pub use holonom_sim::system::outside::{ExternalActions, JointStart, OutsideLaw, OutsideMotion};
pub use holonom_sim::{BeamParts, Beams, Counts, EventRecord, NoState, RunState, Stiffness};
