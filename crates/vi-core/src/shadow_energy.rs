//! The shadow energy: what a variational scheme keeps in the place of the energy.
//!
//! A scheme of order `p` follows, beyond all orders, the flow of `H̃ = H + h^p H_p + O(h^{p+2})`
//! (Hairer, Lubich & Wanner, Geometric Numerical Integration, ch. IX), and `L_d = ∫ (p·q̇ − H̃) dt`
//! is the action over its step. `h` enters there as the length of the path and in `H̃`; the path
//! itself is stationary. So
//! ```text
//! E_d = −∂L_d/∂h = H̃ + h ⟨∂H̃/∂h⟩ = H̃ + p h^p ⟨H_p⟩      ⟨ ⟩ the mean over the step
//! H_d(q_n)                        = H̃ −   h^p H_p(q_n)
//! H̃ ≈ (p H_d + E_d)/(p + 1)
//! ```
//! The two energies of a step lie on both sides of what is kept, at distances `1 : p`. Means over
//! many steps of the last line are constant to `O(h^{p+2})`. In a composition `L_d` is the sum over
//! the sub-steps, stationary in the nodes between, and `E_d = Σ γ_i E_{d,i}`. Constraints change
//! nothing: they hold at all nodes for all `h`.
//!
//! The error `H_d − H̃` is a function of the state. When motion passes to faster vibrations it
//! changes, slowly and for good, without anything that adds up; the shadow energy tells the one
//! from the other.

/// `(p H_d + E_d)/(p + 1)`: the energy `H̃` that a scheme of order `p` keeps, to `O(h^{p+2})` in
/// the mean.
#[must_use]
pub fn shadow_energy(order: u32, hamiltonian: f64, discrete_energy: f64) -> f64 {
    // as a correction: H_d and E_d agree in all but their last digits
    hamiltonian + (discrete_energy - hamiltonian) / f64::from(order + 1)
}
