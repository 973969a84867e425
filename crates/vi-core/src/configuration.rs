//! A configuration at a time, at rest or in motion.

/// `(t, q)` with the joint angles that tell how many revolutions `q` leaves open, and the internal
/// variables.
///
/// ```
/// use vi_core::Configuration;
///
/// let q = [1.0, 0.0];
/// let at = Configuration::new(0.5, &q); // principal angles
/// assert_eq!(at.revolutions(0, -3.0), 0.0); // −3 is next to 0
/// let turned = Configuration { angles: &[6.3], ..at };
/// assert_eq!(turned.revolutions(0, -3.0), 1.0); // −3 + 2π is next to 6.3
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Configuration<'a> {
    /// Time, s.
    pub t: f64,
    /// `q`, shape `n`.
    pub q: &'a [f64],
    /// Unwrapped joint angles of a configuration nearby, rad: of all values of an angle at `q` the
    /// one next to these is meant. An angle that is not listed has its principal value, in
    /// `[−π, π]`.
    pub angles: &'a [f64],
    /// Internal variables at `q` ([`crate::State::internal`]); those that are not listed are zero.
    pub internal: &'a [f64],
}

impl<'a> Configuration<'a> {
    /// `(t, q)` with principal angles.
    #[must_use]
    pub fn new(t: f64, q: &'a [f64]) -> Self {
        Self { t, q, angles: &[], internal: &[] }
    }

    /// `(t, q)` with the velocity `v`.
    #[must_use]
    pub fn moving(&self, v: &'a [f64]) -> Motion<'a> {
        let Self { t, q, angles, internal } = *self;
        Motion { t, q, v, angles, internal }
    }

    /// The number `k` of whole revolutions with which `θ + 2πk` of angle `slot` is next to its
    /// value nearby; `principal`: `θ ∈ [−π, π]`, rad.
    ///
    /// After many revolutions the sum is only accurate to `ε|θ|`; what is compared with `θ`
    /// subtracts the revolutions first.
    #[must_use]
    pub fn revolutions(&self, slot: usize, principal: f64) -> f64 {
        let nearby = self.angles.get(slot).copied().unwrap_or(0.0);
        ((nearby - principal) / std::f64::consts::TAU).round()
    }
}

/// `(t, q, v)`: a configuration with its velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion<'a> {
    /// Time, s.
    pub t: f64,
    /// `q`, shape `n`.
    pub q: &'a [f64],
    /// `v`, shape `n`.
    pub v: &'a [f64],
    /// As [`Configuration::angles`].
    pub angles: &'a [f64],
    /// As [`Configuration::internal`].
    pub internal: &'a [f64],
}

impl<'a> Motion<'a> {
    /// `(t, q, v)` with principal angles.
    #[must_use]
    pub fn new(t: f64, q: &'a [f64], v: &'a [f64]) -> Self {
        Configuration::new(t, q).moving(v)
    }

    /// `(t, q)`.
    #[must_use]
    pub fn configuration(&self) -> Configuration<'a> {
        let Self { t, q, angles, internal, .. } = *self;
        Configuration { t, q, angles, internal }
    }
}
