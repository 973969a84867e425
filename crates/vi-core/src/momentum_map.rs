//! Discrete Noether: momentum maps of translations and rotations acting on vectors of `R³`.
//!
//! Coordinates that are grouped in vectors `x_a ∈ R³` (points, directors) carry
//! ```text
//! angular momentum   J = Σ_a x_a × p_a            rotations act on every vector
//! linear momentum    L = Σ_{a ∈ points} p_a       translations act on points only
//! ```
//! Both are conserved to round-off along a discrete motion whenever `U_d` and `g` are invariant.

use serde::{Deserialize, Serialize};

/// Linear and angular momentum about the origin of the inertial frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Momentum {
    /// `L`, kg·m/s.
    pub linear: [f64; 3],
    /// `J`, kg·m²/s.
    pub angular: [f64; 3],
}

impl Momentum {
    /// Adds the contribution of a vector `x` with momentum `p`; `point`: translations move it.
    pub fn add(&mut self, x: [f64; 3], p: [f64; 3], point: bool) {
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            self.angular[i] += x[j] * p[k] - x[k] * p[j];
            if point {
                self.linear[i] += p[i];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_and_a_director() {
        let mut momentum = Momentum::default();
        momentum.add([1.0, 0.0, 0.0], [0.0, 2.0, 0.0], true);
        momentum.add([0.0, 1.0, 0.0], [0.0, 0.0, 3.0], false);
        assert_eq!(momentum.linear, [0.0, 2.0, 0.0]);
        assert_eq!(momentum.angular, [3.0, 0.0, 2.0]);
    }
}
