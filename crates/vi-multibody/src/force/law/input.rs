//! What a law reads: values and slopes over a step, and at a node.
//!
//! ```text
//!            in a step at t_{n+1/2}                    ∂/∂q_{n+1};  ∂/∂q_n: 1/h → −1/h, w → −w exchanged
//! x          ½ (θ(q_n) + θ(q_{n+1}))                   ½ ∇θ(q_{n+1})
//! v          Δθ/h                                      (1/h) ∇θ(q_{n+1})
//! X, Ẋ       X(q_{n+1/2}), X(Δq)/h                     ½ ∂X, (1/h) ∂X
//! l, l̇       |D|, D̂·Ḋ  of D(q_{n+1/2}), D(Δq)/h        ½ D̂, (1/h) D̂ + ½ (Ḋ − l̇ D̂)/l
//! w          θ/h, θ the rotation vector of the step    (1/h) ∂θ/∂d_I
//! w_r        ā·(w_b − w_a), ā = a(q_{n+1/2})           ā·∂(w_b − w_a) + ½ ∂a·(w_b − w_a)
//! ```
//! At a node the same of `q` and `v`, with `w = ½ Σ d_I × ḋ_I`.

use crate::constraint::joint_coordinate::JointCoordinate;
use crate::force::bends::{Between, Reads};
use crate::geometry::form::Form;
use crate::geometry::rotation_vector::RotationVector;
use nalgebra::{Matrix3, Vector3};
use vi_core::Motion;
use vi_core::interval::{Interval, Slot};
use vi_core::sparse::{Entries, Product};
use vi_rigid::directors::{self, FRAME, director};

/// A quantity that a law reads.
#[derive(Clone, Debug)]
pub enum Input {
    /// `t`, s.
    Time,
    /// A joint coordinate, m or rad, with its revolutions.
    Coordinate(JointCoordinate),
    /// Its rate, m/s or rad/s.
    Rate(JointCoordinate),
    /// A component of a point, m, in space.
    Point(Form, usize),
    /// A component of its velocity, m/s.
    PointRate(Form, usize),
    /// The length of a form, m: the distance of two points.
    Length(Form),
    /// Its rate, m/s.
    LengthRate(Form),
    /// A component in space of the angular velocity, rad/s, of the frame at this coordinate.
    Spin(usize, usize),
    /// The angular velocity of one frame less that of another, rad/s, along a vector of the other.
    RelativeSpin {
        /// First coordinate of the one.
        of: usize,
        /// First coordinate of the other.
        base: usize,
        /// The vector.
        along: Form,
    },
    /// A value that is held over a step, among the internal variables of signals.
    Held(usize),
    /// A value of the past.
    Past(Past),
    /// One of the coordinates of the bushing that reads it (0 to 5), or of their rates (6 to 11):
    /// [`ReadingLaw::of_bushing`](super::ReadingLaw::of_bushing) has them all at once.
    Six(usize),
}

/// A number as it was `delay` ago, linear between nodes; before the first node that one's.
///
/// ```text
/// internal variables from `first` on:   t_n, x_n, x_{n−1}, …, x_{n−count+1}
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Past {
    /// Where the time of the last node stands among the internal variables of signals.
    pub first: usize,
    /// How many nodes are kept.
    pub count: usize,
    /// The time between them, s.
    pub step: f64,
    /// How long ago, s.
    pub delay: f64,
}

impl Past {
    /// The number at `t − delay`.
    #[must_use]
    pub fn at(&self, t: f64, internal: &[f64]) -> f64 {
        let Some(own) = internal.get(self.first..=self.first + self.count) else { return 0.0 };
        let (whole, part) = self.place(t, own[0]);
        own[1 + whole] + part * (own[2 + whole] - own[1 + whole])
    }

    /// Visits the internal variables that it depends on at `t`, with its slopes by them.
    pub fn for_each_slope(&self, t: f64, internal: &[f64], visit: &mut dyn FnMut(usize, f64)) {
        let Some(own) = internal.get(self.first..=self.first + self.count) else { return };
        let (whole, part) = self.place(t, own[0]);
        visit(self.first + 1 + whole, 1.0 - part);
        visit(self.first + 2 + whole, part);
    }

    /// Between which nodes before the last one `t − delay` is, and where between them.
    fn place(&self, t: f64, last: f64) -> (usize, f64) {
        let back = ((last - (t - self.delay)) / self.step).clamp(0.0, (self.count - 1) as f64);
        let whole = (back.floor() as usize).min(self.count - 2);
        (whole, back - whole as f64)
    }

    /// Adds the number of a node at the time `t`, in the place of the oldest.
    pub fn push(&self, t: f64, value: f64, internal: &mut [f64]) {
        let own = &mut internal[self.first..=self.first + self.count];
        own[0] = t;
        own.copy_within(1..self.count, 2);
        own[1] = value;
    }
}

/// The direction of a length, its rate and the rate of the direction.
struct LengthLine {
    along: Vector3<f64>,
    rate: f64,
    turning: Vector3<f64>,
}

impl LengthLine {
    fn of(form: &Form, q: &[f64], v: &[f64]) -> Self {
        let (d, velocity) = (form.at(q), form.rate(v));
        let length = d.norm();
        let along = d / length;
        let rate = along.dot(&velocity);
        Self { along, rate, turning: (velocity - rate * along) / length }
    }
}

/// Visits a row by three vectors of a frame: `Σ a_I·d_I`.
fn for_each_of_frame(offset: usize, rows: [Vector3<f64>; 3], visit: &mut dyn FnMut(usize, f64)) {
    for (i, row) in rows.iter().enumerate() {
        for k in 0..3 {
            visit(offset + 3 + 3 * i + k, row[k]);
        }
    }
}

/// Angular velocity in a step, of the frame at `offset`.
fn spin_in_step(s: &Interval, offset: usize) -> Vector3<f64> {
    let own = offset..offset + FRAME;
    RotationVector::of_step(&s.q0[own.clone()], &s.q1[own]).theta / s.h
}

/// The same at a node.
fn spin_at_node(q: &[f64], v: &[f64], offset: usize) -> Vector3<f64> {
    let [own, rate] = [q, v].map(|x| &x[offset..offset + FRAME]);
    directors::angular_velocity(own, rate)
}

/// Visits the entries of `a·∂w` by an end of a step.
fn for_each_spin_slope(
    s: &Interval,
    node: Slot,
    offset: usize,
    a: &Vector3<f64>,
    visit: &mut dyn FnMut(usize, f64),
) {
    let own = offset..offset + FRAME;
    let by = RotationVector::by_node(node, &s.q0[own.clone()], &s.q1[own]);
    for_each_of_frame(offset, by.map(|by| by.tr_mul(a) / s.h), visit);
}

/// The same by the position at a node: `−½ (ḋ × δd)·a = −½ δd·(a × ḋ)`.
fn for_each_spin_slope_by_position(
    v: &[f64],
    offset: usize,
    a: &Vector3<f64>,
    visit: &mut dyn FnMut(usize, f64),
) {
    let (rate, a) = (&v[offset..offset + FRAME], -0.5 * a);
    for_each_of_frame(offset, [0, 1, 2].map(|i| a.cross(&director(rate, i))), visit);
}

/// The same by the velocity: `½ (d × δḋ)·a = ½ δḋ·(a × d)`.
fn for_each_spin_slope_by_velocity(
    q: &[f64],
    offset: usize,
    a: &Vector3<f64>,
    visit: &mut dyn FnMut(usize, f64),
) {
    let (own, a) = (&q[offset..offset + FRAME], 0.5 * a);
    for_each_of_frame(offset, [0, 1, 2].map(|i| a.cross(&director(own, i))), visit);
}

/// `∂_i w` by the directors of a frame.
fn spin_slopes(at: Between<'_>, group: usize, offset: usize) -> [Matrix3<f64>; 3] {
    let own = offset..offset + FRAME;
    match (at, group) {
        (Between::Ends(s), _) => {
            let node = Slot::BOTH[group];
            RotationVector::by_node(node, &s.q0[own.clone()], &s.q1[own]).map(|by| by / s.h)
        }
        (Between::Node { v, .. }, 0) => {
            [0, 1, 2].map(|i| -0.5 * director(&v[own.clone()], i).cross_matrix())
        }
        (Between::Node { q, .. }, _) => {
            [0, 1, 2].map(|i| 0.5 * director(&q[own.clone()], i).cross_matrix())
        }
    }
}

/// Emits `∂_i∂_j(a·w)` of a frame.
fn emit_spin_second(
    at: Between<'_>,
    [i, j]: [usize; 2],
    offset: usize,
    a: &Vector3<f64>,
    out: &mut dyn Entries,
) {
    match at {
        Between::Ends(s) => {
            let own = offset..offset + FRAME;
            let ends = [&s.q0[own.clone()], &s.q1[own]];
            let slots = [i, j].map(|group| Slot::BOTH[group]);
            RotationVector::emit_step_second(ends, &(a / s.h), slots, offset, out);
        }
        Between::Node { .. } if i != j => {
            // ½ a·(δd × δḋ) = −½ δdᵀ â δḋ
            let sign = if i == 0 { -0.5 } else { 0.5 };
            for k in [3, 6, 9].map(|k| offset + k) {
                out.add_block(k, k, &(sign * a.cross_matrix()));
            }
        }
        Between::Node { .. } => {}
    }
}

fn unit(axis: usize, scale: f64) -> Vector3<f64> {
    Vector3::ith(axis, scale)
}

impl Reads for [Input] {
    fn count(&self) -> usize {
        self.len()
    }
    fn slope(&self, at: Between<'_>, l: usize, group: usize) -> Vec<(usize, f64)> {
        let mut slope = Vec::new();
        self[l].for_each_slope_between(at, group, &mut |i, own| slope.push((i, own)));
        slope
    }
    fn is_rate(&self, l: usize) -> bool {
        self[l].is_rate()
    }
    fn emit_second(&self, at: Between<'_>, w: &[f64], groups: [usize; 2], out: &mut dyn Entries) {
        for (input, w) in self.iter().zip(w).filter(|(_, w)| **w != 0.0) {
            input.emit_second(at, groups, *w, out);
        }
    }
}

impl Input {
    /// Whether it is a velocity or a rate.
    #[must_use]
    pub fn is_rate(&self) -> bool {
        match self {
            Self::Rate(_)
            | Self::PointRate(..)
            | Self::LengthRate(_)
            | Self::Spin(..)
            | Self::RelativeSpin { .. } => true,
            Self::Six(part) => *part >= 6,
            _ => false,
        }
    }

    /// Visits the internal variables of signals that it depends on at `t`, with its slopes by them.
    pub fn for_each_held(&self, t: f64, held: &[f64], visit: &mut dyn FnMut(usize, f64)) {
        match self {
            Self::Held(place) => visit(*place, 1.0),
            Self::Past(past) => past.for_each_slope(t, held, visit),
            _ => {}
        }
    }

    /// Whether its rate in a steady rotation changes with the configuration:
    /// [`vi_core::force::DiscreteForce::acts_from_ground`].
    #[must_use]
    pub fn is_seen_from_ground(&self) -> bool {
        match self {
            Self::Time
            | Self::Held(_)
            | Self::Past(_)
            | Self::Six(_)
            | Self::RelativeSpin { .. } => false,
            Self::Coordinate(own) | Self::Rate(own) => own.is_length_from_ground(),
            Self::Point(..) | Self::PointRate(..) | Self::Spin(..) => true,
            Self::Length(form) | Self::LengthRate(form) => form.is_seen_from_ground(),
        }
    }

    /// The direction of a length, and `(I − D̂ D̂ᵀ)/l`, at `q`.
    pub(super) fn direction(form: &Form, q: &[f64]) -> (Vector3<f64>, Matrix3<f64>) {
        let d = form.at(q);
        let length = d.norm();
        let along = d / length;
        (along, (Matrix3::identity() - along * along.transpose()) / length)
    }

    /// Its value in a step; `held`: internal variables of signals.
    #[must_use]
    pub fn in_step(&self, s: &Interval, held: &[f64]) -> f64 {
        match self {
            Self::Time => s.t_mid(),
            Self::Coordinate(own) => own.change(s).mean,
            Self::Rate(own) => own.change(s).difference / s.h,
            Self::Point(form, axis) => form.at(&s.q_mid)[*axis],
            Self::PointRate(form, axis) => form.rate(&s.v_mid)[*axis],
            Self::Length(form) => form.at(&s.q_mid).norm(),
            Self::LengthRate(form) => LengthLine::of(form, &s.q_mid, &s.v_mid).rate,
            Self::Spin(offset, axis) => spin_in_step(s, *offset)[*axis],
            Self::RelativeSpin { of, base, along } => {
                along.at(&s.q_mid).dot(&(spin_in_step(s, *of) - spin_in_step(s, *base)))
            }
            Self::Held(place) => held.get(*place).copied().unwrap_or(0.0),
            Self::Past(past) => past.at(s.t_mid(), held),
            Self::Six(_) => f64::NAN, // of no bushing
        }
    }

    /// The entries of its derivative by an end of a step, always in the same order; a coordinate
    /// may come several times.
    pub fn for_each_slope(&self, s: &Interval, node: Slot, visit: &mut dyn FnMut(usize, f64)) {
        let by_rate = node.sign() / s.h;
        match self {
            Self::Time | Self::Held(_) | Self::Past(_) | Self::Six(_) => {}
            Self::Coordinate(own) => own.for_each_slope(s.node(node), |i, a| visit(i, 0.5 * a)),
            Self::Rate(own) => own.for_each_slope(s.node(node), |i, a| visit(i, by_rate * a)),
            Self::Point(form, axis) => form.for_each_slope(&unit(*axis, 0.5), visit),
            Self::PointRate(form, axis) => form.for_each_slope(&unit(*axis, by_rate), visit),
            Self::Length(form) => {
                let along = LengthLine::of(form, &s.q_mid, &s.v_mid).along;
                form.for_each_slope(&(0.5 * along), visit);
            }
            Self::LengthRate(form) => {
                let LengthLine { along, turning, .. } = LengthLine::of(form, &s.q_mid, &s.v_mid);
                form.for_each_slope(&(by_rate * along + 0.5 * turning), visit);
            }
            Self::Spin(offset, axis) => {
                for_each_spin_slope(s, node, *offset, &unit(*axis, 1.0), visit)
            }
            Self::RelativeSpin { of, base, along } => {
                let a = along.at(&s.q_mid);
                for_each_spin_slope(s, node, *of, &a, visit);
                for_each_spin_slope(s, node, *base, &-a, visit);
                let w = spin_in_step(s, *of) - spin_in_step(s, *base);
                along.for_each_slope(&(0.5 * w), visit);
            }
        }
    }

    /// Its value at a node with the velocity `v`; `held`: internal variables of signals.
    #[must_use]
    pub fn at_node(&self, at: Motion<'_>, held: &[f64]) -> f64 {
        match self {
            Self::Time => at.t,
            Self::Coordinate(own) => own.at(at.configuration()),
            Self::Rate(own) => own.rate(at.q, at.v),
            Self::Point(form, axis) => form.at(at.q)[*axis],
            Self::PointRate(form, axis) => form.rate(at.v)[*axis],
            Self::Length(form) => form.at(at.q).norm(),
            Self::LengthRate(form) => LengthLine::of(form, at.q, at.v).rate,
            Self::Spin(offset, axis) => spin_at_node(at.q, at.v, *offset)[*axis],
            Self::RelativeSpin { of, base, along } => {
                let w = spin_at_node(at.q, at.v, *of) - spin_at_node(at.q, at.v, *base);
                along.at(at.q).dot(&w)
            }
            Self::Held(place) => held.get(*place).copied().unwrap_or(0.0),
            Self::Past(past) => past.at(at.t, held),
            Self::Six(_) => f64::NAN,
        }
    }

    /// The entries of its derivative by `q` at a node with the velocity `v`.
    pub fn for_each_slope_by_position(
        &self,
        q: &[f64],
        v: &[f64],
        visit: &mut dyn FnMut(usize, f64),
    ) {
        match self {
            Self::Time | Self::Held(_) | Self::Past(_) | Self::Six(_) | Self::PointRate(..) => {}
            Self::Coordinate(own) => own.for_each_slope(q, visit),
            Self::Rate(own) => own.for_each_bend(q, v, 1.0, visit),
            Self::Point(form, axis) => form.for_each_slope(&unit(*axis, 1.0), visit),
            Self::Length(form) => form.for_each_slope(&LengthLine::of(form, q, v).along, visit),
            Self::LengthRate(form) => {
                form.for_each_slope(&LengthLine::of(form, q, v).turning, visit);
            }
            Self::Spin(offset, axis) => {
                for_each_spin_slope_by_position(v, *offset, &unit(*axis, 1.0), visit);
            }
            Self::RelativeSpin { of, base, along } => {
                let a = along.at(q);
                for_each_spin_slope_by_position(v, *of, &a, visit);
                for_each_spin_slope_by_position(v, *base, &-a, visit);
                let w = spin_at_node(q, v, *of) - spin_at_node(q, v, *base);
                along.for_each_slope(&w, visit);
            }
        }
    }

    /// `of_q ← of_q + scale ∂²y/∂q∂(q, v) (δq, δv)`, `of_v ← of_v + scale ∂²y/∂v∂(q, v) (δq, δv)`
    /// at a node with the velocity `v`.
    pub fn add_bends_at_node(
        &self,
        [q, v]: [&[f64]; 2],
        changes: [&[f64]; 2],
        scale: f64,
        of: [&mut [f64]; 2],
    ) {
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let out = &mut Product { v: changes[j], out: &mut *of[i] };
            self.emit_second(Between::Node { q, v }, [i, j], scale, out);
        }
    }

    /// The entries of `∂_i y`.
    pub(in crate::force) fn for_each_slope_between(
        &self,
        at: Between<'_>,
        group: usize,
        visit: &mut dyn FnMut(usize, f64),
    ) {
        match (at, group) {
            (Between::Ends(s), _) => self.for_each_slope(s, Slot::BOTH[group], visit),
            (Between::Node { q, v }, 0) => self.for_each_slope_by_position(q, v, visit),
            (Between::Node { q, v }, _) => self.for_each_slope_by_velocity(q, v, visit),
        }
    }

    /// Emits `weight ∂_i∂_j y`.
    pub(in crate::force) fn emit_second(
        &self,
        at: Between<'_>,
        groups: [usize; 2],
        weight: f64,
        out: &mut dyn Entries,
    ) {
        let ([q, v], [qq, qv, vq, _]) = (at.middle(), at.factors(groups));
        match self {
            Self::Time
            | Self::Held(_)
            | Self::Past(_)
            | Self::Six(_)
            | Self::Point(..)
            | Self::PointRate(..) => {}
            Self::Coordinate(own) | Self::Rate(own) => {
                let is_rate = matches!(self, Self::Rate(_));
                match at {
                    Between::Ends(s) if groups[0] == groups[1] => {
                        let part = at.parts(groups[0])[usize::from(is_rate)];
                        let node = s.node(Slot::BOTH[groups[0]]);
                        own.emit_second(node, weight * part, out);
                    }
                    Between::Ends(_) => {}
                    Between::Node { .. } if is_rate => {
                        if qq != 0.0 {
                            own.emit_third(q, v, weight * qq, out);
                        }
                        if qv + vq != 0.0 {
                            own.emit_second(q, weight * (qv + vq), out);
                        }
                    }
                    Between::Node { .. } if qq != 0.0 => own.emit_second(q, weight * qq, out),
                    Between::Node { .. } => {}
                }
            }
            Self::Length(form) => {
                form.emit_congruence(&(weight * qq * Self::direction(form, q).1), out);
            }
            Self::LengthRate(form) => {
                let second = qq * form.length_third(q, v) + (qv + vq) * Self::direction(form, q).1;
                form.emit_congruence(&(weight * second), out);
            }
            Self::Spin(offset, axis) => {
                emit_spin_second(at, groups, *offset, &unit(*axis, weight), out);
            }
            Self::RelativeSpin { of, base, along } => {
                let a = weight * along.at(q);
                for (frame, sign) in [(*of, 1.0), (*base, -1.0)] {
                    emit_spin_second(at, groups, frame, &(sign * a), out);
                    // of the vector at the midpoint with the angular velocities
                    let [left, right] = groups.map(|group| at.parts(group)[0]);
                    let [rows, columns] = groups.map(|group| spin_slopes(at, group, frame));
                    for (k, (row, column)) in rows.iter().zip(&columns).enumerate() {
                        let at = frame + 3 + 3 * k;
                        for term in along.terms() {
                            let part = sign * weight * term.coefficient;
                            out.add_block(term.offset, at, &(left * part * column));
                            out.add_block(at, term.offset, &(right * part * row.transpose()));
                        }
                    }
                }
            }
        }
    }

    /// The entries of its derivative by `v` at a node.
    pub fn for_each_slope_by_velocity(
        &self,
        q: &[f64],
        v: &[f64],
        visit: &mut dyn FnMut(usize, f64),
    ) {
        match self {
            Self::Rate(own) => own.for_each_slope(q, visit),
            Self::PointRate(form, axis) => form.for_each_slope(&unit(*axis, 1.0), visit),
            Self::LengthRate(form) => form.for_each_slope(&LengthLine::of(form, q, v).along, visit),
            Self::Spin(offset, axis) => {
                for_each_spin_slope_by_velocity(q, *offset, &unit(*axis, 1.0), visit);
            }
            Self::RelativeSpin { of, base, along } => {
                let a = along.at(q);
                for_each_spin_slope_by_velocity(q, *of, &a, visit);
                for_each_spin_slope_by_velocity(q, *base, &-a, visit);
            }
            Self::Time
            | Self::Held(_)
            | Self::Past(_)
            | Self::Six(_)
            | Self::Coordinate(_)
            | Self::Point(..)
            | Self::Length(_) => {}
        }
    }
}
