//! A configuration at a time.

/// `(t, q)` with the joint angles that tell how many revolutions `q` leaves open.
///
/// ```
/// use vi_core::Configuration;
///
/// let q = [1.0, 0.0];
/// let at = Configuration::new(0.5, &q); // principal angles
/// assert_eq!(at.angle_near(0, -3.0), -3.0); // next to 0
/// let turned = Configuration { angles: &[6.3], ..at };
/// assert!((turned.angle_near(0, -3.0) - (-3.0 + std::f64::consts::TAU)).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Configuration<'a> {
    /// Time, s.
    pub t: f64,
    /// `q`, shape `n`.
    pub q: &'a [f64],
    /// Unwrapped joint angles of a configuration nearby, rad: of all values of an angle at `q` the one next
    /// to these is meant. An angle that is not listed has its principal value, in `[−π, π]`.
    pub angles: &'a [f64],
}

impl<'a> Configuration<'a> {
    /// `(t, q)` with principal angles.
    #[must_use]
    pub fn new(t: f64, q: &'a [f64]) -> Self {
        Self { t, q, angles: &[] }
    }

    /// `θ + 2πk` of angle `slot` next to its value nearby; `principal`: `θ ∈ [−π, π]`, rad.
    #[must_use]
    pub fn angle_near(&self, slot: usize, principal: f64) -> f64 {
        principal + std::f64::consts::TAU * self.revolutions(slot, principal)
    }

    /// The number `k` of whole revolutions in [`Configuration::angle_near`].
    ///
    /// After many revolutions the sum is only accurate to `ε|θ|`; what is compared with `θ` subtracts the
    /// revolutions first.
    #[must_use]
    pub fn revolutions(&self, slot: usize, principal: f64) -> f64 {
        let nearby = self.angles.get(slot).copied().unwrap_or(0.0);
        ((nearby - principal) / std::f64::consts::TAU).round()
    }
}
