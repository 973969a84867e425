//! The discrete Lagrangian and its slot derivatives.
//!
//! ```text
//! L_d(q_n, q_{n+1}) = (1/2h) Δqᵀ M Δq − h Σ U_d(q_n, q_{n+1})            LMO08 (18) for U_d = V(q_{n+1/2})
//! D_1 L_d           = −(1/h) M Δq − h D_1 U_d
//! D_2 L_d           = +(1/h) M Δq − h D_2 U_d
//! D_2 D_1 L_d       = −(1/h) M    − h D_2 D_1 U_d
//! D_1 D_1 L_d       = +(1/h) M    − h D_1 D_1 U_d,    D_2 D_2 L_d likewise
//! E_d               = ½ (Δq/h)ᵀ M (Δq/h) + U_d                            LMO08 (52)
//! ```
//! A discrete potential with an added mass contributes `h K_d − h U_d` to `L_d` and `K_d + U_d` to
//! `E_d`.
//!
//! Forces enter in the sense of the discrete Lagrange–d'Alembert principle (Marsden & West 2001,
//! part 3): `f_d^-(q_n, q_{n+1})` stands beside `D_1 L_d`, `f_d^+(q_n, q_{n+1})` beside `D_2 L_d`.
//!
//! Letters: `M` mass matrix (constant, symmetric, positive semi-definite), `U_d` discrete
//! potential, `f_d^∓` discrete forces (N·s).

mod separable_system;
mod slot_derivatives;

pub use separable_system::{SeparableSystem, Working};
pub use slot_derivatives::{DiscreteLagrangian, NoStepSlope};
