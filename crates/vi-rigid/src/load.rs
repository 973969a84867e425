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
//! Letters: `f` force (N), `τ` torque (N·m), both spatial, `ϱ = ϱ_I d_I` the point of the body
//! where `f` acts, from the centre (m), `c` time history, `d̄_I` the (unnormalized) directors of
//! `q_{n+1/2}`. Averaged directors in place of those of the ends would lose a part `sin²(ϑ/2)` of
//! the torque. A dead load adds nothing to the Newton matrix `D_2 f_d^-`; a follower depends on
//! `q_{n+1}` through `d̄_I`. A dead force has the potential `−c f·(φ + ϱ)`, whose midpoint rule is
//! the pair above; a dead torque has none.
//!
//! Source: LMO08 §4 for the director form; Marsden & West 2001, part 3, for the discrete forces.

use crate::directors::{FRAME, director};
use crate::time_history::{HistoryError, TimeHistory};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use vi_core::Motion;
use vi_core::force::{DiscreteForce, LengthBends, NoTimeSlope};
use vi_core::interval::{Interval, Slot, StepChange};
use vi_core::sparse::{Block, Entries, Product};

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
///
/// ```
/// use nalgebra::Vector3;
/// use vi_rigid::{Load, LoadKind, TimeHistory};
///
/// // 5 N along d_1 of the first body
/// let (force, torque) = (5.0 * Vector3::x(), Vector3::zeros());
/// let load = Load::new(0, LoadKind::Follower, force, torque, TimeHistory::default())?;
/// let frame = [0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0]; // d_1 = e_2
/// assert_eq!(load.wrench(0.0, &frame).force, 5.0 * Vector3::y());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Load {
    offset: usize,
    kind: LoadKind,
    point: Vector3<f64>, // ϱ_I
    force: Vector3<f64>,
    torque: Vector3<f64>,
    history: TimeHistory,
}

/// How force, torque and point of a load change with a parameter.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoadChange {
    /// N.
    pub force: Vector3<f64>,
    /// N·m.
    pub torque: Vector3<f64>,
    /// m.
    pub point: Vector3<f64>,
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

    /// The same load with a force and a torque that are `factor` times as large.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let (force, torque) = (factor * self.force, factor * self.torque);
        Self { force, torque, history: self.history.clone(), ..*self }
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

    /// The force `f` at its point and the torque `τ` at time `t`, for the frame's coordinates
    /// `frame`, both in spatial components.
    #[must_use]
    pub fn wrench(&self, t: f64, frame: &[f64]) -> Wrench {
        self.directed(self.history.value(t), frame)
    }

    /// The same at the value `c` of the history.
    fn directed(&self, c: f64, frame: &[f64]) -> Wrench {
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

    /// `f·(φ̇ + ϱ_I ḋ_I) + τ·ω` at time `t`, for the coordinates `q` and velocities `v` of all
    /// frames, W.
    #[must_use]
    pub fn power(&self, t: f64, q: &[f64], v: &[f64]) -> f64 {
        let frame = self.of_frame(q);
        let mut force = [0.0; FRAME];
        self.add(1.0, self.wrench(t, frame), frame, &mut force);
        force.iter().zip(self.of_frame(v)).map(|(f, v)| f * v).sum()
    }

    /// The derivative of half the impulse of a step with the directors of the end `q`, where force,
    /// torque and point change by those of `change` (N, N·m, m): on `(φ, d_1, d_2, d_3)` of the
    /// frame, `(h/2) (δf, δϱ_I f + ϱ_I δf + ½ δτ×d_I)`.
    #[must_use]
    pub fn half_impulse_by(&self, change: &LoadChange, s: &Interval, q: &[f64]) -> [f64; FRAME] {
        let mut out = [0.0; FRAME];
        let (force, torque) = (change.force, change.torque);
        let changed = Self { force, torque, history: self.history.clone(), ..*self };
        let (t, middle, scale) = (s.t_mid(), self.of_frame(&s.q_mid), 0.5 * s.h);
        changed.add(scale, changed.wrench(t, middle), self.of_frame(q), &mut out);
        let force = self.wrench(t, middle).force;
        for i in 0..3 {
            for k in 0..3 {
                out[3 + 3 * i + k] += scale * change.point[i] * force[k];
            }
        }
        out
    }

    /// The part of its frame in a vector of all coordinates.
    #[must_use]
    pub fn of_frame<'a>(&self, x: &'a [f64]) -> &'a [f64] {
        &x[self.offset..self.offset + FRAME]
    }

    /// The impulse of half a step with the directors of the end `q`, on `(φ, d_1, d_2, d_3)` of the
    /// frame, N·s and N·m·s [4.6].
    #[must_use]
    pub fn half_impulse(&self, s: &Interval, q: &[f64]) -> [f64; FRAME] {
        let mut out = [0.0; FRAME];
        self.add_half(s, q, &mut out);
        out
    }

    /// Adds it to the coordinates of the frame.
    fn add_half(&self, s: &Interval, q: &[f64], out: &mut [f64]) {
        let wrench = self.wrench(s.t_mid(), self.of_frame(&s.q_mid));
        self.add(0.5 * s.h, wrench, self.of_frame(q), out);
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

impl Load {
    /// Emits the second derivatives of `½ scale Σ_I Y_I·(τ × d_I)`, `τ = τ_J d̄_J`, by directors of
    /// two ends, rows those of the first, `y` those of each; nothing of torques that keep their
    /// direction.
    fn add_torque_bends(&self, scale: f64, y: [&[f64]; 2], out: &mut dyn Entries) {
        if self.kind == LoadKind::Dead {
            return;
        }
        // Y·(a × b) = −aᵀ Ŷ b
        for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
            let [row, column] = [i, j].map(|k| self.offset + 3 + 3 * k);
            let [of_row, of_column] =
                [(y[0], i), (y[1], j)].map(|(y, k)| director(self.of_frame(y), k));
            let by_torque = -0.5 * scale * self.torque[i] * of_column; // d̄_i in rows
            let by_arm = 0.5 * scale * self.torque[j] * of_row; // d_i in rows
            cross(out, row, column, &(by_torque + by_arm));
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

/// Emits the derivative of [`add_wrench`] by the directors of the frame at coordinate `offset`:
/// `scale ½ τ × δd_I`.
pub fn add_lever_slopes(scale: f64, torque: &Vector3<f64>, offset: usize, out: &mut dyn Entries) {
    for first in [3, 6, 9].map(|i| offset + i) {
        cross(out, first, first, &(0.5 * scale * torque));
    }
}

/// Emits the matrix of `x ↦ a × x`.
fn cross(out: &mut dyn Entries, row: usize, column: usize, a: &Vector3<f64>) {
    for k in 0..3 {
        let (next, last) = ((k + 1) % 3, (k + 2) % 3);
        out.add(row + next, column + last, -a[k]);
        out.add(row + last, column + next, a[k]);
    }
}

/// Its impulse goes with the length.
impl LengthBends for Load {
    fn add_slope_by_length(&self, s: &Interval, y: [&[f64]; 2], by: Slot, out: &mut [f64]) {
        for (of, y) in Slot::BOTH.into_iter().zip(y) {
            let into = &mut Product { v: y, out: &mut *out };
            let scale = 1.0 / s.h;
            let out = &mut Block { into, row: 0, column: 0, scale, transposed: true };
            self.add_slope(s, of, by, out);
        }
    }

    fn second_by_length(&self, _s: &Interval, _y: [&[f64]; 2]) -> f64 {
        0.0
    }
}

impl DiscreteForce for Load {
    fn add_minus(&self, s: &Interval, out: &mut [f64]) {
        self.add_half(s, &s.q0, &mut out[self.offset..]);
    }

    fn add_plus(&self, s: &Interval, out: &mut [f64]) {
        self.add_half(s, &s.q1, &mut out[self.offset..]);
    }

    fn add_slope(&self, s: &Interval, of: Slot, by: Slot, out: &mut dyn Entries) {
        if of == by {
            let torque = self.wrench(s.t_mid(), self.of_frame(&s.q_mid)).torque;
            add_lever_slopes(0.5 * s.h, &torque, self.offset, out);
        }
        if self.kind == LoadKind::Dead {
            return;
        }
        // (h/2) c, and ∂d̄_J/∂d_J = ½ I
        let scale = 0.25 * s.h * self.history.value(s.t_mid());
        let frame = self.of_frame(s.node(of));
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
                cross(out, row, column, &(-factor * director(frame, i)));
            }
        }
    }

    fn add_bend(&self, s: &Interval, y: [&[f64]; 2], slots: [Slot; 2], out: &mut dyn Entries) {
        let y = slots.map(|slot| if slot == Slot::First { y[0] } else { y[1] });
        let scale = 0.25 * s.h * self.history.value(s.t_mid()); // (h/2) c, and ∂d̄_J/∂d_J = ½ I
        self.add_torque_bends(scale, y, out);
    }

    fn length_bends(&self) -> Option<&dyn LengthBends> {
        Some(self)
    }

    fn add_gauss_bend(&self, at: Motion<'_>, z: &[f64], by: [f64; 4], out: &mut dyn Entries) {
        self.add_torque_bends(by[0] * self.history.value(at.t), [z; 2], out);
    }

    fn add_step_slope(
        &self,
        s: &Interval,
        of: Slot,
        change: StepChange,
        out: &mut [f64],
    ) -> Result<(), NoTimeSlope> {
        let t = s.t_mid();
        // of (h/2) c(t) (f_0, τ_0)
        let by_history = 0.5 * s.h * change.middle * self.history.slope(t).ok_or(NoTimeSlope)?;
        let scale = 0.5 * change.length * self.history.value(t) + by_history;
        let unit = self.directed(1.0, self.of_frame(&s.q_mid));
        self.add(scale, unit, self.of_frame(s.node(of)), &mut out[self.offset..]);
        Ok(())
    }

    fn add_time_slope(
        &self,
        at: Motion<'_>,
        scale: f64,
        out: &mut [f64],
    ) -> Result<(), NoTimeSlope> {
        let (unit, slope) = (self.of_frame(at.q), self.history.slope(at.t).ok_or(NoTimeSlope)?);
        self.add(scale * slope, self.directed(1.0, unit), unit, &mut out[self.offset..]);
        Ok(())
    }

    fn work(&self, s: &Interval, _scratch: &mut [f64]) -> f64 {
        let wrench = self.wrench(s.t_mid(), self.of_frame(&s.q_mid));
        let mut impulse = [0.0; FRAME];
        self.add(0.5 * s.h, wrench, self.of_frame(&s.q0), &mut impulse);
        self.add(0.5 * s.h, wrench, self.of_frame(&s.q1), &mut impulse);
        impulse.iter().zip(self.of_frame(&s.v_mid)).map(|(f, v)| f * v).sum()
    }

    fn add_continuous(&self, at: Motion<'_>, out: &mut [f64]) {
        let frame = self.of_frame(at.q);
        self.add(1.0, self.wrench(at.t, frame), frame, &mut out[self.offset..]);
    }

    fn add_stiffness(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries) {
        let Motion { t, q, .. } = at;
        let frame = self.of_frame(q);
        let torque = self.wrench(t, frame).torque;
        let follows = self.kind == LoadKind::Follower;
        let c = if follows { scale * self.history.value(t) } else { 0.0 };
        for j in 0..3 {
            let (row, column) = (self.offset + 3 + 3 * j, self.offset + 3 + 3 * j);
            cross(out, row, column, &(0.5 * scale * torque)); // ½ τ×d_J
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
                cross(out, row, column, &d);
            }
        }
    }

    fn add_position_slope(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries) {
        self.add_stiffness(at, scale, out);
    }

    fn add_damping(&self, _: Motion<'_>, _: f64, _: &mut dyn Entries) {}

    fn is_dissipative(&self) -> bool {
        false
    }
}

#[cfg(test)]
mod tests;
