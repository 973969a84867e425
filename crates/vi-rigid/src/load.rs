//! Wrenches on a frame, dead or following.
//!
//! ```text
//! P_in(q_n)ᵀ     f_d^- = (h/2) (f, τ + ϱ_n × f)                   half the impulse of a step
//! P_in(q_{n+1})ᵀ f_d^+ = (h/2) (f, τ + ϱ_{n+1} × f)
//! f_d^-  = (h/2) (f, ϱ_I f + ½ τ×d_I)                            with the directors of q_n
//! f_d^+  = the same                                            with the directors of q_{n+1}
//! dead       (f, τ) = c(t_{n+1/2}) (f_0, τ_0)                   spatial components
//! follower   (f, τ) = c(t_{n+1/2}) (f_I d̄_I, τ_I d̄_I)            body components
//! ```
//! Letters: `f` force (N), `τ` torque (N·m), both spatial, `ϱ = ϱ_I d_I` the point of the body where
//! `f` acts, from the centre (m), `c` time history, `d̄_I` the (unnormalized) directors of `q_{n+1/2}`.
//! Averaged directors in place of those of the ends would lose a part `sin²(ϑ/2)` of the torque. A
//! dead load adds nothing to the Newton matrix `D_2 f_d^-`; a follower depends on `q_{n+1}` through
//! `d̄_I`. A dead force has the potential `−c f·(φ + ϱ)`, whose midpoint rule is the pair above; a dead
//! torque has none.
//!
//! Source: LMO08 §4 for the director form; Marsden & West 2001, part 3, for the discrete forces.

use crate::directors::{FRAME, director};
use crate::time_history::{HistoryError, TimeHistory};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use vi_core::Configuration;
use vi_core::force::DiscreteForce;
use vi_core::interval::Interval;
use vi_core::sparse::Entries;

/// Which components of a load stay fixed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LoadKind {
    /// The spatial components. A dead torque has no potential.
    #[default]
    Dead,
    /// The components along the directors of the frame.
    Follower,
}

/// A load that cannot be applied.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// A component is NaN or infinite.
    #[error("a component of the {what} is {value}; it must be a finite number")]
    NotFinite {
        /// Force, torque or point.
        what: &'static str,
        /// The component.
        value: f64,
    },
    /// The time history is refused.
    #[error(transparent)]
    History(#[from] HistoryError),
}

/// A wrench on the frame whose coordinates begin at `offset`, times a time history.
#[derive(Clone, Debug, PartialEq)]
pub struct Load {
    offset: usize,
    kind: LoadKind,
    point: Vector3<f64>, // ϱ_I
    force: Vector3<f64>,
    torque: Vector3<f64>,
    history: TimeHistory,
}

/// A force at a point and a torque, spatial components.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wrench {
    /// N.
    pub force: Vector3<f64>,
    /// N·m.
    pub torque: Vector3<f64>,
}

impl Load {
    /// Force at the centre (N) and torque (N·m) on the frame at coordinate `offset`, in spatial
    /// components (dead) or in components along the directors (follower).
    ///
    /// # Errors
    /// [`LoadError`].
    pub fn new(
        offset: usize,
        kind: LoadKind,
        force: Vector3<f64>,
        torque: Vector3<f64>,
        history: TimeHistory,
    ) -> Result<Self, LoadError> {
        for (what, vector) in [("force", force), ("torque", torque)] {
            if let Some(&value) = vector.iter().find(|value| !value.is_finite()) {
                return Err(LoadError::NotFinite { what, value });
            }
        }
        history.validate()?;
        Ok(Self { offset, kind, point: Vector3::zeros(), force, torque, history })
    }

    /// The same with the force at the point `φ + ϱ_I d_I` of the body, `ϱ_I` in m.
    ///
    /// # Errors
    /// [`LoadError::NotFinite`].
    pub fn at(self, point: Vector3<f64>) -> Result<Self, LoadError> {
        match point.iter().find(|value| !value.is_finite()) {
            Some(&value) => Err(LoadError::NotFinite { what: "point", value }),
            None => Ok(Self { point, ..self }),
        }
    }

    /// The same load with another history.
    ///
    /// # Errors
    /// [`LoadError::History`].
    pub fn with_history(self, history: TimeHistory) -> Result<Self, LoadError> {
        history.validate()?;
        Ok(Self { history, ..self })
    }

    /// The factor in time.
    #[must_use]
    pub fn history(&self) -> &TimeHistory {
        &self.history
    }

    /// First coordinate of the frame.
    #[must_use]
    pub fn offset(&self) -> usize {
        self.offset
    }

    /// Which components stay fixed.
    #[must_use]
    pub fn kind(&self) -> LoadKind {
        self.kind
    }

    /// `ϱ_I`: where the force acts, from the centre, m.
    #[must_use]
    pub fn point(&self) -> &Vector3<f64> {
        &self.point
    }

    /// The force `f` at its point and the torque `τ` at time `t`, for the frame's coordinates `frame`,
    /// both in spatial components.
    #[must_use]
    pub fn wrench(&self, t: f64, frame: &[f64]) -> Wrench {
        let c = self.history.value(t);
        match self.kind {
            LoadKind::Dead => Wrench { force: c * self.force, torque: c * self.torque },
            LoadKind::Follower => {
                let spatial = |body: &Vector3<f64>| -> Vector3<f64> {
                    (0..3).map(|i| body[i] * director(frame, i)).sum()
                };
                Wrench { force: c * spatial(&self.force), torque: c * spatial(&self.torque) }
            }
        }
    }

    fn frame<'a>(&self, q: &'a [f64]) -> &'a [f64] {
        &q[self.offset..self.offset + FRAME]
    }

    /// The impulse of half a step with the directors of the end `q`.
    fn add_half(&self, s: &Interval, q: &[f64], out: &mut [f64]) {
        let wrench = self.wrench(s.t_mid(), self.frame(&s.q_mid));
        self.add(0.5 * s.h, wrench, self.frame(q), &mut out[self.offset..]);
    }

    /// `out ← out + scale (f, ϱ_I f + ½ τ×d_I)` with the directors of `frame`.
    fn add(&self, scale: f64, wrench: Wrench, frame: &[f64], out: &mut [f64]) {
        add_wrench(scale, wrench, frame, out);
        for i in 0..3 {
            for k in 0..3 {
                out[3 + 3 * i + k] += scale * self.point[i] * wrench.force[k];
            }
        }
    }
}

/// `out ← out + scale (f, ½ τ×d_1, ½ τ×d_2, ½ τ×d_3)` with the directors of `frame`.
pub fn add_wrench(scale: f64, Wrench { force, torque }: Wrench, frame: &[f64], out: &mut [f64]) {
    for k in 0..3 {
        out[k] += scale * force[k];
    }
    for i in 0..3 {
        let w = torque.cross(&director(frame, i));
        for k in 0..3 {
            out[3 + 3 * i + k] += 0.5 * scale * w[k];
        }
    }
}

/// Emits the matrix of `x ↦ a × x`.
fn cross(out: &mut dyn Entries, (row, column): (usize, usize), a: &Vector3<f64>) {
    for k in 0..3 {
        let (next, last) = ((k + 1) % 3, (k + 2) % 3);
        out.add(row + next, column + last, -a[k]);
        out.add(row + last, column + next, a[k]);
    }
}

impl DiscreteForce for Load {
    fn add_minus(&self, s: &Interval, out: &mut [f64]) {
        self.add_half(s, &s.q0, out);
    }

    fn add_plus(&self, s: &Interval, out: &mut [f64]) {
        self.add_half(s, &s.q1, out);
    }

    fn add_minus_d2(&self, s: &Interval, out: &mut dyn Entries) {
        if self.kind == LoadKind::Dead {
            return;
        }
        // (h/2) c, and ∂d̄_J/∂d_J = ½ I
        let scale = 0.25 * s.h * self.history.value(s.t_mid());
        let frame = self.frame(&s.q0);
        for j in 0..3 {
            let column = self.offset + 3 + 3 * j;
            for k in 0..3 {
                out.add(self.offset + k, column + k, scale * self.force[j]);
            }
            for i in (0..3).filter(|&i| self.point[i] != 0.0) {
                let row = self.offset + 3 + 3 * i;
                let lever = scale * self.force[j] * self.point[i]; // ∂(ϱ_I f)/∂d_J
                (0..3).for_each(|k| out.add(row + k, column + k, lever));
            }
            // ∂(½ τ×d_I)/∂d_J = −½ τ_J d̂_I ∂d̄_J/∂d_J
            let factor = 0.5 * scale * self.torque[j];
            for i in 0..3 {
                let row = self.offset + 3 + 3 * i;
                cross(out, (row, column), &(-factor * director(frame, i)));
            }
        }
    }

    fn add_continuous(&self, at: Configuration<'_>, _v: &[f64], out: &mut [f64]) {
        let frame = self.frame(at.q);
        self.add(1.0, self.wrench(at.t, frame), frame, &mut out[self.offset..]);
    }

    fn add_rest_derivative(&self, at: Configuration<'_>, scale: f64, out: &mut dyn Entries) {
        let Configuration { t, q, .. } = at;
        let frame = self.frame(q);
        let torque = self.wrench(t, frame).torque;
        let follows = self.kind == LoadKind::Follower;
        let c = if follows { scale * self.history.value(t) } else { 0.0 };
        for j in 0..3 {
            let (row, column) = (self.offset + 3 + 3 * j, self.offset + 3 + 3 * j);
            cross(out, (row, column), &(0.5 * scale * torque)); // ½ τ×d_J
            if !follows {
                continue;
            }
            for k in 0..3 {
                out.add(self.offset + k, column + k, c * self.force[j]); // f = f_J d_J
            }
            for i in 0..3 {
                let row = self.offset + 3 + 3 * i;
                let lever = c * self.point[i] * self.force[j]; // ϱ_I f
                (0..3).for_each(|k| out.add(row + k, column + k, lever));
                let d = -0.5 * c * self.torque[j] * director(frame, i); // ½ τ×d_I, τ = τ_J d_J
                cross(out, (row, column), &d);
            }
        }
    }

    fn is_dissipative(&self) -> bool {
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::directors;
    use crate::null_space::pull_back;
    use nalgebra::DMatrix;
    use vi_core::linear::norm_inf;
    use vi_core::momentum_map::Momentum;
    use vi_testkit::Sample;

    const OFFSET: usize = 12;

    fn load(sample: &mut Sample, kind: LoadKind) -> Load {
        let history = TimeHistory::Ramp { start: 0.0, end: 1.0, amplitude: 2.0 };
        let load = Load::new(OFFSET, kind, sample.vector(), sample.vector(), history).unwrap();
        load.at(sample.vector()).unwrap()
    }

    /// `ϱ = ϱ_I d_I`.
    fn arm(load: &Load, q: &[f64]) -> Vector3<f64> {
        directors::triad(q) * load.point()
    }

    /// A step of the second of two frames; the first must not be read.
    fn interval(q0: &[f64; 12], q1: &[f64; 12]) -> Interval {
        let mut s = Interval::new(24);
        let other = [f64::NAN; 12];
        s.open(0.3, 0.1, &[other, *q0].concat());
        s.q1.copy_from_slice(&[other, *q1].concat());
        s.close_from_end();
        s
    }

    #[test]
    fn the_impulse_of_a_step_is_that_of_the_wrench_and_its_lever() {
        let mut sample = Sample::new(71);
        for kind in [LoadKind::Dead, LoadKind::Follower] {
            for _ in 0..100 {
                let (q0, q1) = (sample.frame(), sample.frame());
                let load = load(&mut sample, kind);
                let s = interval(&q0, &q1);
                let Wrench { force: f, torque: tau } = load.wrench(s.t_mid(), &s.q_mid[12..]);
                let (mut minus, mut plus) = (vec![0.0; 24], vec![0.0; 24]);
                load.add_minus(&s, &mut minus);
                load.add_plus(&s, &mut plus);
                for (q, half) in [(&q0, &minus), (&q1, &plus)] {
                    assert!(half[..12].iter().all(|x| *x == 0.0), "the other frame is free");
                    let pulled = pull_back(q, &half[12..]);
                    let moment = tau + arm(&load, q).cross(&f);
                    for k in 0..3 {
                        let error = (pulled[k] - 0.05 * f[k]).abs();
                        let error = error.max((pulled[3 + k] - 0.05 * moment[k]).abs());
                        assert!(error < 1e-15, "{kind:?}: impulse off by {error:e}");
                    }
                    // the momentum map gets the moment about the origin
                    let mut gain = Momentum::default();
                    directors::add_momentum(q, &half[12..], &mut gain);
                    let expected = 0.05 * (moment + directors::center(q).cross(&f));
                    let error = (Vector3::from(gain.angular) - expected).amax();
                    assert!(error < 1e-15, "{kind:?}: angular momentum off by {error:e}");
                }
                if kind == LoadKind::Dead {
                    let expected = 0.7 * load.torque; // ramp to 2, t_{n+1/2} = 0.35
                    assert!((tau - expected).norm() < 1e-15, "{tau} against {expected}");
                }
            }
        }
    }

    #[test]
    fn a_follower_has_fixed_body_components() {
        let mut sample = Sample::new(72);
        let load = load(&mut sample, LoadKind::Follower);
        let q = sample.frame();
        let Wrench { force: f, torque: tau } = load.wrench(0.5, &q);
        for i in 0..3 {
            let d = director(&q, i);
            assert!((f.dot(&d) - load.force[i]).abs() < 2e-15);
            assert!((tau.dot(&d) - load.torque[i]).abs() < 2e-15);
        }
        let mut continuous = vec![0.0; 24];
        let both = [q, q].concat();
        load.add_continuous(Configuration::new(0.5, &both), &[], &mut continuous);
        let pulled = pull_back(&q, &continuous[12..]);
        let moment = tau + arm(&load, &q).cross(&f);
        let error = norm_inf((pulled.fixed_rows::<3>(3) - moment).as_slice());
        assert!(error < 2e-15, "continuous torque off by {error:e}");
    }

    #[test]
    fn a_dead_force_at_a_point_is_its_potential_by_the_midpoint_rule() {
        let mut sample = Sample::new(74);
        let (f, point) = (sample.vector(), sample.vector());
        let history = TimeHistory::default();
        let load = Load::new(OFFSET, LoadKind::Dead, f, Vector3::zeros(), history).unwrap();
        let load = load.at(point).unwrap();
        let s = interval(&sample.frame(), &sample.frame());
        let (mut minus, mut plus) = (vec![0.0; 24], vec![0.0; 24]);
        load.add_minus(&s, &mut minus);
        load.add_plus(&s, &mut plus);
        assert_eq!(minus, plus, "no directors enter");
        for k in 0..3 {
            for (at, coefficient) in [(0, 1.0), (3, point[0]), (6, point[1]), (9, point[2])] {
                let error = minus[OFFSET + at + k] - 0.5 * s.h * coefficient * f[k];
                assert!(error.abs() < 1e-16, "−(h/2) ∇V off by {error:e}");
            }
        }
    }

    #[test]
    fn the_derivative_matches_central_differences() {
        let mut sample = Sample::new(73);
        for kind in [LoadKind::Dead, LoadKind::Follower] {
            let (q0, q1) = (sample.frame(), sample.frame());
            let load = load(&mut sample, kind);
            let mut exact = DMatrix::zeros(24, 24);
            load.add_minus_d2(&interval(&q0, &q1), &mut exact);
            assert_eq!(exact.amax() > 0.0, kind == LoadKind::Follower);
            let e = 1e-3; // linear in q_{n+1}
            for j in 0..12 {
                let at = |by: f64| {
                    let mut q1 = q1;
                    q1[j] += by;
                    let mut out = vec![0.0; 24];
                    load.add_minus(&interval(&q0, &q1), &mut out);
                    out
                };
                let (plus, minus) = (at(e), at(-e));
                for i in 0..24 {
                    let fd = (plus[i] - minus[i]) / (2.0 * e);
                    let error = (fd - exact[(i, 12 + j)]).abs();
                    assert!(error < 1e-13, "{kind:?} [{i}, {j}]: off by {error:e}");
                }
            }
        }
    }

    #[test]
    fn the_stiffness_at_rest_matches_central_differences() {
        let mut sample = Sample::new(75);
        for kind in [LoadKind::Dead, LoadKind::Follower] {
            let (load, q) = (load(&mut sample, kind), sample.frame());
            let force = |q: &[f64]| {
                let mut out = vec![0.0; 24];
                load.add_continuous(Configuration::new(0.7, q), &[0.0; 24], &mut out);
                out
            };
            let q = [q, q].concat();
            let mut exact = DMatrix::zeros(24, 24);
            load.add_rest_derivative(Configuration::new(0.7, &q), 1.0, &mut exact);
            for j in 0..24 {
                let (mut plus, mut minus) = (q.clone(), q.clone());
                (plus[j], minus[j]) = (q[j] + 1e-3, q[j] - 1e-3); // quadratic in q
                let (plus, minus) = (force(&plus), force(&minus));
                for i in 0..24 {
                    let error = ((plus[i] - minus[i]) / 2e-3 - exact[(i, j)]).abs();
                    assert!(error < 1e-12, "{kind:?} [{i}, {j}]: off by {error:e}");
                }
            }
        }
    }

    #[test]
    fn impossible_loads_are_refused() {
        let zero = Vector3::zeros();
        let broken = Vector3::new(0.0, f64::NAN, 0.0);
        let new = |force, history| Load::new(0, LoadKind::Dead, force, zero, history);
        let message = new(broken, TimeHistory::default()).unwrap_err().to_string();
        assert_eq!(message, "a component of the force is NaN; it must be a finite number");
        let history = TimeHistory::Table { points: vec![] };
        let message = new(zero, history).unwrap_err().to_string();
        assert_eq!(message, "the table of the time history has no points");
        let load = new(zero, TimeHistory::default()).unwrap();
        let message = load.at(broken).unwrap_err().to_string();
        assert_eq!(message, "a component of the point is NaN; it must be a finite number");
    }
}
