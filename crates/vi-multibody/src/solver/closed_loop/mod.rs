//! Closed loops on top of a tree: null space, redundancy, singular configurations.
//!
//! Loops are cut at joints; `g_c` are the cut joints' constraints.
//! ```text
//! J_n = G_c(q_n) P_tree(q_n),      U: row echelon form of J_n, pivots in the columns B
//! b    = P_treeᵀ (p̄_n + D_1 L_d + f_d^-),     g = g_c(F_d(u, q_n)) (independent rows),   u ∈ R^{d_tree}
//! r(u) = (b − Uᵀλ, λ: zero in B; g/h in its place) = 0    balance along Z = null J_n, closure
//! [ A  −Uᵀ ] [δ]   [b − Uᵀλ]
//! [ J'  0  ] [μ] = [   g   ],     A = P_treeᵀ D_2(D_1 L_d + f_d^-) ∂F_d/∂u
//! ```
//! The joints of the tree split into dependent ones, `B`, and independent ones, in which the
//! balance stands: `Z = null J_n` is never formed. `A` is solved by the sweeps of the tree. A row
//! lives on the links of its own loop, from its two sides to their lowest common carrier, the
//! apex; rows that share links form a cluster, which is eliminated at its apex by a small
//! complement and never felt above.
//!
//! **Cost.** `O(N)` for loops that share no links, anywhere in the tree. Within a cluster of `c`
//! loops on `n_c` links the sweeps cost the sum of their paths to the apex, rank and complement as
//! much as their sparse elimination: `O(n_c)` where every loop meets few others (windows side by
//! side), `O(n_c c² + c³)` at most. Where the potential couples bodies `A` is a sparse or dense
//! matrix and each row one more right-hand side: for `c` loops `c + 1` solves with its factors and
//! a dense complement, `O(c³)`.
//!
//! **Rank.** Permanent redundancy (overconstrained loops) shows as a clear gap between the pivots;
//! the rows without a pivot follow from the others. The *generic* rank, the largest met, is
//! retained when a configuration loses rank momentarily (a flat four-bar): the rows of `U` that are
//! missing are then those of the last node that do not depend on the new ones, so the branch of the
//! motion is the one its velocity points along, and the rows enforced are chosen at `q_{n+1}`; far
//! from such configurations they are those of `q_n`. An initial configuration in such a
//! configuration is compared with configurations nearby
//! ([`crate::solver::closed_loop::loop_rank`]): with a velocity, `Z` initially is the limit of the
//! generic null space along it; at rest it is refused, since nothing says which branch the motion
//! takes.
//!
//! **Round-off.** `g_c` is a difference of stored coordinates, so the increments of a loop are
//! known to `ε |q|/σ` and not to `ε` of themselves, with `σ` the smallest pivot, `~ δ` at an angle
//! `δ` from a flat position: floors and noise of Newton's method are higher than those of a tree. A
//! row sees only the links of its own loop: what both of its ends share would cancel but for
//! round-off, which `1/σ` would turn into a drift of the momentum maps. A small pivot waits for all
//! large ones, so it does not spoil them (`echelon`).
//!
//! Source: LMO08 §5.4, §5.5; the splitting of coordinates after R. A. Wehage, E. J. Haug, J. Mech.
//! Des. 104 (1982).

mod closure_forces;
mod closure_rows;
pub(crate) mod cluster;
pub(super) mod cluster_link;
mod complement;
mod complement_matrix;
pub mod control_points;
mod echelon;
mod enforced_rows;
pub(super) mod four_rows;
mod large_matrix;
mod loop_nodal;
pub mod loop_rank;
pub(crate) mod loops;
mod nearly;
pub(super) mod path;
mod pending;
mod random;
mod relief;
mod row_columns;
pub(super) mod row_sweeps;
mod square_system;
pub mod step;
pub mod survey;
mod sweep;
pub(super) mod velocity;

pub(crate) use closure_forces::ClosureForces;
pub use loop_nodal::{LoopNodal, TreeSolver};
pub use loops::with_floors;

crate::opaque_debug!(TreeSolver, LoopNodal, ClosureForces);
