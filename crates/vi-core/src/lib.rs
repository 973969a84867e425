//! Discrete mechanics without constraints.
//!
//! Everything that knows a discrete Lagrangian but no constraint and no body: slot derivatives,
//! discrete Legendre transforms, forces, Newton's method, symmetric compositions, the state of a
//! motion.
//!
//! | file | concept |
//! |---|---|
//! | [`configuration`] | `(t, q)` with unwrapped joint angles |
//! | [`interruption`] | work that is no longer wanted: solves are refused |
//! | [`interval`] | the two-point argument `(q_n, q_{n+1})` with its increment |
//! | [`discrete_lagrangian`] | `L_d`, `D_1`, `D_2`, `D_2D_1`, `E_d` |
//! | [`legendre`] | discrete Legendre transforms `p^-`, `p^+`; `E_d` in its parts |
//! | [`potential`] | `V`, `∇V`, `∇²V`; midpoint, trapezoidal and other discrete potentials |
//! | [`force`] | discrete Lagrange–d'Alembert forces |
//! | [`coordinate_force`] | potentials and forces along an unknown of a step |
//! | [`quantity_effort`] | efforts along an unknown by several quantities |
//! | [`number`] | real numbers, and those with a tangent |
//! | [`newton`], [`predictor`] | the nonlinear solver and its initial guesses |
//! | [`linear`], [`sparse`] | linear solvers; matrices refilled in place |
//! | [`sparse_cholesky`] | sparse Cholesky factors |
//! | [`block_lu`] | sparse LU of small dense blocks |
//! | [`dense`] | dense factorizations with equal bits on every processor |
//! | [`lanes`] | four or eight numbers in a register, with equal bits on every processor |
//! | [`eigen`] | `K x = ω² M x`, accurate where it is soft |
//! | [`inertia`] | how many eigenvalues of a constrained stiffness are negative |
//! | [`matrix_eigen`] | `A x = λ x`, eigenvalues of zero apart |
//! | [`quadratic_eigen`] | `(λ² M + λ C + K) x = 0`: damped and gyroscopic vibrations |
//! | [`cone`] | impulses of unilateral contact and dry friction |
//! | [`composition`] | orders 4, 6, 8 |
//! | [`galerkin`] | constants of the schemes of order `2s` with `s` control points per step |
//! | [`interpolation`] | strains interpolated between control points |
//! | [`galerkin_pencil`] | their matrix with stiff forces, diagonal in the control points |
//! | [`compensation`] | rounding errors of a step, given to the next one |
//! | [`bracket`] | roots of a function of one number |
//! | [`state`] | all that the future of a motion depends on |
//! | [`contact_state`] | what contacts remember from node to node |
//! | [`momentum_map`] | discrete Noether quantities |
//!
//! | type | is |
//! |---|---|
//! | [`Interval`] | `(q_n, q_{n+1})` with `Δq` and the midpoint: the argument of every discrete function |
//! | [`Slot`] | one of both arguments; of a discrete force pair, one of both |
//! | [`StepChange`] | how a step changes in length and time |
//! | [`Configuration`] | `(t, q)` with unwrapped joint angles: the argument at a node |
//! | [`Motion`] | `(t, q, v)`: the argument of a force |
//! | [`MechanicalSystem`] | trait: `M`, `V(q)`, `f(t, q, v)` |
//! | [`DiscreteLagrangian`], [`SeparableSystem`] | trait: `L_d`, its slot derivatives, discrete forces; its usual implementation |
//! | [`Entries`], [`SparseMatrix`] | a matrix is emitted entry by entry, multiples of `I_3` and outer products as one; the first emission fixes the pattern |
//! | [`DenseLu`](linear::DenseLu), [`PivotedQr`](dense::PivotedQr) | dense factorizations with equal bits on every processor |
//! | [`BlockLu`](block_lu::BlockLu) | sparse LU of blocks of up to six rows, without fill on chains and trees |
//! | [`Newton`](newton::Newton), [`NewtonProblem`](newton::NewtonProblem) | the one nonlinear solver: exact Jacobian, to the round-off floor |
//! | [`State`], [`Compensation`](compensation::Compensation) | `(step, t, q_n, p̄_n)`, angles, internal variables, rounding errors, history, memory |
//! | [`CoordinateForce`](coordinate_force::CoordinateForce), [`AlongUnknown`](coordinate_force::AlongUnknown) | trait: what acts along an unknown of a step, and which it is |
//! | [`QuantityEffort`](quantity_effort::QuantityEffort), [`StepQuantity`](quantity_effort::StepQuantity) | trait: what acts along an unknown by several quantities, and what each of them is |
//! | [`GaussLobatto`](galerkin::GaussLobatto), [`GalerkinPencil`](galerkin_pencil::GalerkinPencil) | constants of the Galerkin schemes; the matrix of a step, diagonal in the control points |
//! | [`StrainInterpolation`](interpolation::StrainInterpolation) | trait: potentials and forces of strains on the polynomial of a Galerkin step |
//! | [`Lanes`](lanes::Lanes), [`Register`](lanes::Register) | numbers side by side with equal bits on every processor |
//!
//! Source: S. Leyendecker, J. E. Marsden, M. Ortiz, Variational integrators for constrained
//! dynamical systems, ZAMM 88 (2008) 677–708, cited as LMO08 with its equation numbers.
#![cfg_attr(not(test), deny(clippy::disallowed_methods))] // equal bits on every machine
#![forbid(unsafe_code)]
#![deny(missing_debug_implementations, missing_docs)]
#![cfg_attr(test, allow(clippy::float_cmp))] // tests compare exactly representable numbers

pub mod block_lu;
pub mod bracket;
pub mod compensation;
pub mod composition;
pub mod cone;
pub mod configuration;
pub mod contact_state;
pub mod coordinate_force;
pub mod dense;
pub mod discrete_lagrangian;
pub mod eigen;
pub mod force;
pub mod galerkin;
pub mod galerkin_pencil;
pub mod inertia;
pub mod interpolation;
pub mod interruption;
pub mod interval;
pub mod isotropic;
pub mod lanes;
pub mod legendre;
pub mod linear;
pub mod matrix_eigen;
pub mod mechanical_system;
pub mod momentum_map;
pub mod newton;
pub mod number;
pub mod potential;
pub mod predictor;
pub mod quadratic_eigen;
pub mod quantity_effort;
mod shadow_energy;
pub mod signals;
pub mod sparse;
pub mod sparse_cholesky;
pub mod state;
pub mod strain_energy;
mod vectors;

pub use composition::Composition;
pub use configuration::{Configuration, Motion};
pub use discrete_lagrangian::{DiscreteLagrangian, SeparableSystem, Working};
pub use interval::{Interval, Slot, StepChange};
pub use legendre::Energies;
pub use mechanical_system::MechanicalSystem;
pub use newton::{NewtonError, NewtonReport, NewtonSettings};
pub use num_dual;
pub use number::{Embed, Number};
pub use potential::{DiscretePotential, Potential, Quadrature};
pub use shadow_energy::shadow_energy;
pub use sparse::{Entries, SparseMatrix};
pub use state::State;
