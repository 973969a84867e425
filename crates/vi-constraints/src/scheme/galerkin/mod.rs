//! Galerkin schemes of order `2s` on the discrete null space.
//!
//! On each step a polynomial of degree `s` goes through `s + 1` control points at the Lobatto
//! nodes, all of which satisfy the constraints; the action is integrated at `s` Gauss nodes
//! ([`vi_core::galerkin`]):
//! ```text
//! w_i := δ_i0 p̄_n + ∂_i L_d + f_i
//!      = δ_i0 p̄_n + (1/h) M Σ_j K_ij Δ_j + h Σ_k b_k E_ki [f − ∇V](Q_k, V_k),    Δ_j = q_j − q_n       [2.26]
//! constrained   w_i = h b̃_i G(q_i)ᵀ λ_i (i = 0 … s−1),     g(q_j) = 0 (j = 1 … s)                     [2.27]
//! nodal         P(q_i)ᵀ w_i = 0 (i = 0 … s−1),             q_j = F_d(u_j, q_n),  u_1 … u_s ∈ R^d       [2.28]
//! p̄_{n+1}     = ∂_s L_d + f_s                                                                          [2.29]
//! ```
//! Continuous states of signals follow by collocation at the Gauss nodes, `f` reads them there:
//! ```text
//! z_k = z_n + h Σ_j A_kj φ(t_j, Q_j, V_j, z_j),   z_{n+1} = z_n + h Σ_k b_k φ(t_k, Q_k, V_k, z_k)       [2.36]
//! ```
//! Both have the same roots. The order is `2s` in `q_n` and in the projected momentum `ᵠp_n`, with
//! dissipative forces, too: there are no backward sub-steps. The map is symplectic and
//! self-adjoint, momentum maps and constraints are exact. `s = 1` is the scheme of order 2. Only
//! increments enter, since the rows of `K` sum to zero.
//!
//! | file | concept |
//! |---|---|
//! | [`control_points`] | `w_i` from the configurations of the control points |
//! | [`nodal`], [`constrained`] | the two schemes |
//! | [`sweeps`] | what the nodal one asks for: all control points at once |
//! | [`operators`] | the same from operators of single control points |
//! | [`linearization`] | a step linearized: tangents forward, costates backward |
//! | [`gauss_slopes`] | what acts in a step, differentiated |
//! | [`parts`] | its Gauss nodes and the intervals of its constraints, with their costates |
//! | [`tangent`] | the tangent map of steps without forces |
//!
//! Sources: Jay, SIAM J. Numer. Anal. 45 (2007) 1814 and 33 (1996) 368; Wenger, Ober-Blöbaum &
//! Leyendecker, Adv. Comput. Math. 43 (2017) 1163.

mod blocks;
pub mod constrained;
pub mod control_points;
pub mod gauss_slopes;
pub mod linearization;
pub mod nodal;
pub mod operators;
pub mod parts;
pub mod sweeps;
pub mod tangent;

pub use constrained::GalerkinConstrained;
pub use gauss_slopes::GaussSlopes;
pub use linearization::GalerkinLinearization;
pub use nodal::GalerkinNodal;
pub use operators::{ControlPointOperators, DenseControlPoints};
pub use parts::Parts;
pub use sweeps::{Pointwise, Sweeps};
pub use tangent::GalerkinTangent;
pub use vi_core::galerkin::GaussPoint;
