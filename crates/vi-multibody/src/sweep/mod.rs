//! The sweeps over the links of a tree, each once for every
//! [`Space`](crate::geometry::space::Space): one tree, many at once, all control points of a step.
//!
//! Twists and wrenches of a link refer to its reference point, the child's anchor of its joint (the
//! centre of a free body), in spatial components. With the balance of a link `b = (f, τ)`, its mass
//! `m`, first moment `s` and Euler tensor `E` about that point at `q_n`, the motion `(Δx, A)` of
//! the step and the impulses `b_0` of `p̄_n` and of constant forces:
//! ```text
//! A² = A¹ exp(ϑ n̂),  Δx² = Δx¹ + (A¹ − 1) ℓ + A¹ u n             root → leaf   [advance]     F_d
//! f  = f_0 − (m Δx + (A − 1) s)/h,   τ = τ_0 − (Σ x × (A − 1) x + s × Δx)/h
//! r  = Sᵀ b,   b_parent += Xᵀ b                                    leaf → root   [pull_back]   Pᵀ[…]
//! −h A_α = [m I, −ŝ'; ŝ, tr(K) I − K],   K = A E,   s' = A s
//! Â_parent += Xᵀ (Â − Â S' D⁻¹ Sᵀ Â) X',   D = Sᵀ Â S'            leaf → root   [eliminate]
//! δτ = D⁻¹ (u − Sᵀ Â X' δt'),   δt' = X' δt'_parent + S' δτ        root → leaf   [substitute]
//! ```
//! where `Σ x × (A − 1) x` is read off `(A − 1) E = Σ ((A − 1) x) xᵀ`. The columns of `S` are
//! `(0, n)`, `(n, 0)` or `(p n, n)`, those of `S'` the same with `n' = A n`, and `X, X'` the levers
//! `ℓ` and `ℓ' = ℓ + Δx² − Δx¹` from one reference point to the next. With a rotation vector `θ`,
//! ```text
//! spherical  A² = exp(θ̂),  Δx² = Δx¹ + (A¹ − 1) ℓ     S = (0, I),  S' = (0, T(θ)),   X = [I −ℓ̂; 0 0]
//! free       A² = exp(θ̂),  Δx² = u                    S = I,  S' = diag(I, T(θ)),    X = 0
//! ```
//! `Â − Â S' D⁻¹ Sᵀ Â = diag(Â_ll − Â_la Â_aa⁻¹ Â_al, 0)` of a spherical joint is without `T`: that
//! enters last, `δθ = T⁻¹ δω`.
//!
//! At the control points of a Galerkin step balances are projected at the end of the motion, and
//! the tree of a linear system stands still there: `S = S'`, matrices are symmetric, and the
//! factors serve several right-hand sides ([`right_side`]).
//!
//! A sweep judges nothing: it returns the largest rotation, and a sum that is not a number where
//! something is not finite. Its caller refuses the step.

pub(crate) mod advance;
pub(crate) mod body_masses;
pub(crate) mod columns;
pub(crate) mod costate;
pub(crate) mod coupled;
pub(crate) mod eliminate;
pub(crate) mod finish;
pub(crate) mod link;
pub(crate) mod moved_joints;
pub(crate) mod open;
pub(crate) mod place;
pub(crate) mod point_costate;
pub(crate) mod pull_back;
pub(crate) mod right_side;
pub(crate) mod solve3;
pub(crate) mod substitute;
pub(crate) mod velocity;
