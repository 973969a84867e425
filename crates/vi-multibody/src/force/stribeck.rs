//! Friction as a smooth function of the velocity of sliding.
//!
//! ```text
//! χ(v) = [1 + (r − 1) exp(−(v/v_s)²)] tanh(v/v_t)          force −F_C χ(v), F_C that of sliding
//! ```
//! Letters: `v_t` velocity of transition, `r` static over sliding friction, `v_s` Stribeck's
//! velocity. Nothing sticks: under the load `F < r F_C` a body creeps with about `v_t F/(r F_C)`.
//!
//! Source: B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083, for the
//! curve of Stribeck.

use crate::joint_force::JointLaw;
use vi_core::Number;
use vi_core::coordinate_force::{EffortBends, EffortSlopes};

/// The course of friction over the velocity, m/s or rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stribeck {
    /// `v_t`.
    pub transition_velocity: f64,
    /// `r`, 1 or more.
    pub static_ratio: f64,
    /// `v_s`.
    pub stribeck_velocity: f64,
}

impl Stribeck {
    /// `χ` and its derivative.
    fn at(&self, v: f64) -> [f64; 2] {
        let Self { transition_velocity: v_t, static_ratio: r, stribeck_velocity: v_s } = *self;
        let (x, y) = (v / v_t, v / v_s);
        let rise = libm::tanh(x);
        let peak = (r - 1.0) * libm::exp(-y * y);
        let slope = (1.0 + peak) * (1.0 - rise * rise) / v_t - 2.0 * y / v_s * peak * rise;
        [(1.0 + peak) * rise, slope]
    }

    /// `χ`.
    #[must_use]
    pub fn value(&self, v: f64) -> f64 {
        self.at(v)[0]
    }

    /// `χ''`.
    fn bend(&self, v: f64) -> f64 {
        let Self { transition_velocity: v_t, static_ratio: r, stribeck_velocity: v_s } = *self;
        let (rise, y) = (libm::tanh(v / v_t), v / v_s);
        let peak = (r - 1.0) * libm::exp(-y * y);
        let steep = (1.0 - rise * rise) / v_t;
        (4.0 * y * y - 2.0) / (v_s * v_s) * peak * rise
            - 4.0 * y / v_s * peak * steep
            - 2.0 * (1.0 + peak) * rise * steep / v_t
    }

    /// `χ_θ` where its numbers change by those of `by`.
    /// ```text
    /// χ_r = exp(−y²) tanh x,   χ_{v_t} = −[1 + (r − 1) exp(−y²)] (1 − tanh² x) x/v_t,
    /// χ_{v_s} = (r − 1) exp(−y²) 2y²/v_s tanh x                          x = v/v_t, y = v/v_s
    /// ```
    #[must_use]
    pub fn change(&self, by: &Self, v: f64) -> f64 {
        let Self { transition_velocity: v_t, static_ratio: r, stribeck_velocity: v_s } = *self;
        let (x, y) = (v / v_t, v / v_s);
        let (rise, bell) = (libm::tanh(x), libm::exp(-y * y));
        let by_ratio = bell * rise;
        let by_transition = -(1.0 + (r - 1.0) * bell) * (1.0 - rise * rise) * x / v_t;
        let by_peak = (r - 1.0) * bell * 2.0 * y * y / v_s * rise;
        by.static_ratio * by_ratio
            + by.transition_velocity * by_transition
            + by.stribeck_velocity * by_peak
    }

    /// `χ_θ(v)/v` of a velocity that is not negative.
    pub(crate) fn change_over_velocity(&self, by: &Self, v: f64) -> f64 {
        let Self { transition_velocity: v_t, static_ratio: r, .. } = *self;
        match v > 0.0 {
            true => self.change(by, v) / v,
            false => by.static_ratio / v_t - by.transition_velocity * r / (v_t * v_t),
        }
    }

    /// `χ(v)/v` of a velocity that is not negative.
    pub(crate) fn over_velocity<T: Number>(&self, v: T) -> T {
        let x = Number::real(v);
        let [value, slope] = self.at(x);
        if x > 0.0 { lifted(v, value / x, (slope - value / x) / x) } else { T::of(slope) }
    }
}

/// `f(x)` of a number with a tangent, by `f` and `f'`.
pub(crate) fn lifted<T: Number>(x: T, value: f64, slope: f64) -> T {
    T::of(value) + (x - T::of(Number::real(x))) * T::of(slope)
}

/// Friction of a joint coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StribeckFriction {
    /// `F_C`, N or N·m.
    pub effort: f64,
    /// Its course.
    pub course: Stribeck,
}

impl JointLaw for StribeckFriction {
    fn effort(&self, _t: f64, _coordinate: f64, rate: f64) -> f64 {
        -self.effort * self.course.at(rate)[0]
    }
    fn slopes(&self, _t: f64, _coordinate: f64, rate: f64) -> EffortSlopes {
        let slope = self.course.at(rate)[1];
        EffortSlopes { by_coordinate: 0.0, by_rate: -self.effort * slope }
    }
    fn bends(&self, _t: f64, _coordinate: f64, rate: f64) -> EffortBends {
        EffortBends { by_rate: -self.effort * self.course.bend(rate), ..EffortBends::default() }
    }
    fn is_dissipative(&self) -> bool {
        self.effort != 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vi_core::num_dual::Dual64;

    const COURSE: Stribeck =
        Stribeck { transition_velocity: 1e-2, static_ratio: 1.5, stribeck_velocity: 0.1 };

    #[test]
    fn it_rises_to_static_friction_and_falls_to_that_of_sliding() {
        assert_eq!(COURSE.at(0.0)[0], 0.0);
        assert!((COURSE.at(0.04)[0] - 1.425_115).abs() < 1e-5, "{}", COURSE.at(0.04)[0]);
        assert_eq!(COURSE.at(2.0)[0], 1.0);
        assert_eq!(COURSE.at(-2.0)[0], -1.0);
        let friction = StribeckFriction { effort: 3.0, course: COURSE };
        assert_eq!([2.0, -2.0].map(|rate| friction.effort(0.0, 0.7, rate)), [-3.0, 3.0]);
    }

    #[test]
    fn changes_are_the_differences_by_its_numbers() {
        let by = Stribeck { transition_velocity: 0.7, static_ratio: -0.4, stribeck_velocity: 1.9 };
        let moved = |e: f64| Stribeck {
            transition_velocity: COURSE.transition_velocity + e * by.transition_velocity,
            static_ratio: COURSE.static_ratio + e * by.static_ratio,
            stribeck_velocity: COURSE.stribeck_velocity + e * by.stribeck_velocity,
        };
        for v in [0.0, 3e-3, -0.02, 0.05, 0.3] {
            let e = 1e-6;
            let slope = (moved(e).at(v)[0] - moved(-e).at(v)[0]) / (2.0 * e);
            let off = (slope - COURSE.change(&by, v)).abs();
            assert!(off < 1e-6 * slope.abs().max(1.0), "{v}: off by {off:e}");
            let over = |own: Stribeck| own.over_velocity(v.abs());
            let slope = (over(moved(e)) - over(moved(-e))) / (2.0 * e);
            let off = (slope - COURSE.change_over_velocity(&by, v.abs())).abs();
            assert!(off < 1e-6 * slope.abs().max(1.0), "{v}, over v: off by {off:e}");
        }
    }

    #[test]
    fn slopes_are_the_differences_of_the_effort() {
        let friction = StribeckFriction { effort: 3.0, course: COURSE };
        for rate in [0.0, 3e-3, -0.02, 0.05, 0.3, -2.0] {
            let e = 1e-7;
            let [plus, minus] = [rate + e, rate - e].map(|rate| friction.effort(0.0, 0.0, rate));
            let error = (plus - minus) / (2.0 * e) - friction.slopes(0.0, 0.0, rate).by_rate;
            assert!(error.abs() < 1e-5, "{rate}: {error:e}");
            let [plus, minus] =
                [rate + e, rate - e].map(|rate| friction.slopes(0.0, 0.0, rate).by_rate);
            let bend = friction.bends(0.0, 0.0, rate).by_rate;
            let error = (plus - minus) / (2.0 * e) - bend;
            assert!(error.abs() < 1e-5 * (1.0 + bend.abs()), "{rate}: {error:e} of {bend:e}");
            let v = rate.abs();
            let over = COURSE.over_velocity(Dual64::new(v, 1.0));
            if v > 0.0 {
                let own = |v: f64| COURSE.at(v)[0] / v;
                let slope = (own(v + e) - own(v - e)) / (2.0 * e);
                assert!((over.re - own(v)).abs() < 1e-12 && (over.eps - slope).abs() < 1e-3);
            } else {
                assert_eq!(over.re, 150.0);
            }
        }
    }
}
