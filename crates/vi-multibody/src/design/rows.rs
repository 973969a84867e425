//! Constraint rows that change with a parameter: `g_θ`, `(Gᵀ λ)_θ`.

use super::explicit::{Sink, moved_value};
use super::moved_coordinate::MovedCoordinate;
use super::{DesignError, MechanismTangent, ReferenceTangent, ScalarTangent};
use crate::constraint::joint_coordinate::{JointCoordinate, Value};
use crate::constraint::rolling::Rolling;
use crate::constraint::scalar_constraint::ScalarRow;
use crate::constraint::velocity_constraint::{VelocityConstraint, along_change, emit_wrench};
use crate::geometry::form::{BilinearRow, Form};
use crate::mechanism::Mechanism;
use crate::mechanism::description::BarEnd;
use crate::pair::DegreeOfFreedom;
use crate::pair::Twist;
use crate::pair::constraints::PairConstraint;
use nalgebra::Vector3;
use std::sync::Arc;
use vi_core::num_dual::Dual64;
use vi_core::sparse::Entries;
use vi_core::{Configuration, Interval, Motion};

/// A row with its derivative.
enum MovedRow {
    Product(Box<BilinearRow<Dual64>>),
    /// `θ_a + ρ θ_b − c`.
    Gear {
        a: Option<Box<Value<Dual64>>>,
        b: Option<Box<Value<Dual64>>>,
        own: Box<JointCoordinate>, // θ_b
        ratio: Dual64,
        target: f64,
    },
    /// `θ − θ_ref(t)`.
    Motion {
        value: Option<Box<Value<Dual64>>>,
        reference: Option<ReferenceTangent>,
    },
    /// `n·(φ − o) − b − R_c c(a)`.
    Height(Arc<Rolling<Dual64>>),
    /// Of what rolls, along `e_i`.
    Slip(Arc<Rolling<Dual64>>, usize),
    /// Of a blade.
    Blade(Box<[Form<Dual64>; 2]>),
    /// The change of a constraint on velocities is one by itself.
    Velocity(Arc<dyn VelocityConstraint>),
}

/// The rows that change with a parameter, as numbered among all constraints.
#[derive(Default)]
pub(super) struct MovedRows(Vec<(usize, MovedRow)>);

impl MovedRow {
    /// `g_θ`.
    fn value(&self, at: Configuration<'_>) -> f64 {
        let moved = |value: &Option<Box<Value<Dual64>>>| {
            value.as_ref().map_or(0.0, |value| value.principal(at.q).eps)
        };
        match self {
            Self::Product(row) => row.value(at.q).eps,
            Self::Gear { a, b, own, ratio, target } => {
                let turned = if ratio.eps == 0.0 { 0.0 } else { ratio.eps * own.at(at) };
                moved(a) + turned + ratio.re * moved(b) - target
            }
            Self::Motion { value, reference } => {
                moved(value) - reference.as_ref().map_or(0.0, |reference| reference(at.t)[0])
            }
            Self::Height(rolling) => rolling.height(at.q).eps,
            Self::Slip(..) | Self::Blade(_) | Self::Velocity(_) => 0.0,
        }
    }

    /// How what a step closes changes: `g_θ(q_{n+1})`, of constraints on velocities `(h A_d)_θ`.
    fn gap(&self, s: &Interval) -> f64 {
        match self {
            Self::Slip(rolling, i) => rolling.slip_of_step(s, *i).eps,
            Self::Blade(forms) => along_change(forms.each_ref(), s).eps,
            Self::Velocity(row) => row.residual(s),
            _ => self.value(s.end()),
        }
    }

    /// `γ_θ`.
    fn acceleration(&self, at: Motion<'_>) -> f64 {
        let Motion { q, v, .. } = at;
        match self {
            Self::Product(own) => own.second(v, v).eps,
            Self::Height(rolling) => rolling.acceleration_at(0, [q, v]).eps,
            Self::Slip(rolling, i) => rolling.acceleration_at(i + 1, [q, v]).eps,
            Self::Blade(forms) => {
                let [direction, point] = &**forms;
                direction.rate(v).dot(&point.rate(v)).eps
            }
            Self::Velocity(row) => row.second(q, v, v) - row.rate_change(at),
            Self::Gear { .. } | Self::Motion { .. } => 0.0,
        }
    }

    /// `∂²g/∂t∂θ`; of constraints on velocities `−b_θ`.
    fn drift(&self, at: Configuration<'_>) -> f64 {
        match self {
            Self::Motion { reference: Some(reference), .. } => -reference(at.t)[1],
            Self::Slip(rolling, i) => -rolling.rate_of_slip(at.q, *i).eps,
            Self::Velocity(row) => -row.rate(at),
            _ => 0.0,
        }
    }

    /// The entries of `G_θ`.
    fn for_each_slope(&self, q: &[f64], mut visit: impl FnMut(usize, f64)) {
        match self {
            Self::Product(row) => row.for_each_slope(q, |i, slope| visit(i, slope.eps)),
            Self::Gear { a, b, own, ratio, .. } => {
                if let Some(a) = a {
                    a.for_each_slope(q, |i, slope| visit(i, slope.eps));
                }
                match b {
                    Some(b) => b.for_each_slope(q, |i, slope| visit(i, (*ratio * slope).eps)),
                    None => own.for_each_slope(q, |i, slope| visit(i, ratio.eps * slope)),
                }
            }
            Self::Motion { value: Some(value), .. } => {
                value.for_each_slope(q, |i, slope| visit(i, slope.eps));
            }
            Self::Motion { value: None, .. } => {}
            Self::Height(rolling) => {
                rolling.for_each_slope_of_height(q, |i, slope| visit(i, slope.eps));
            }
            Self::Slip(rolling, k) => {
                let [force, torque] = rolling.row_of_slip(q, *k).map(|own| own.map(|x| x.eps));
                let wrench = Twist::new(force, torque);
                emit_wrench(q, rolling.frame, 0, 1.0, &wrench, &mut Visited(&mut visit));
            }
            Self::Blade(forms) => {
                let [direction, point] = &**forms;
                point.for_each_slope(&direction.at(q), |i, slope| visit(i, slope.eps));
            }
            Self::Velocity(row) => row.emit(q, 0, 1.0, &mut Visited(&mut visit)),
        }
    }
}

/// Visits the entries of one row.
struct Visited<'a>(&'a mut dyn FnMut(usize, f64));

impl Entries for Visited<'_> {
    fn add(&mut self, _row: usize, column: usize, value: f64) {
        (self.0)(column, value);
    }
}

impl MovedRows {
    /// Those of a mechanism that change with a parameter.
    pub(super) fn of(
        mechanism: &Mechanism,
        tangent: &MechanismTangent,
    ) -> Result<Self, DesignError> {
        let mut rows = Self::default();
        let description = mechanism.description();
        for (&k, change) in &tangent.joints {
            let (joint, first) = (&description.joints[k], mechanism.joint_rows(k).start);
            let dual = change.dual(joint);
            let products = joint.kind.rows(&dual);
            let count = products.len();
            rows.push(first, products);
            if let Some(pitch) = joint.kind.pitch() {
                let own = JointCoordinate::of(joint, DegreeOfFreedom::ABOUT_AXIS);
                let thread = own.map(|own| MovedRow::Gear {
                    a: Value::of(&dual, DegreeOfFreedom::Length(2)).map(Box::new),
                    b: Value::of(&dual, DegreeOfFreedom::ABOUT_AXIS).map(Box::new),
                    own: Box::new(own),
                    ratio: Dual64::new(-pitch, -change.pitch),
                    target: 0.0,
                });
                rows.0.extend(thread.map(|thread| (first + count, thread)));
            }
        }
        for (&k, change) in &tangent.bars {
            let bar = &description.bars[k];
            let held = match bar.from {
                BarEnd::Ground(_) => -change.ground,
                BarEnd::Particle(_) => Vector3::zeros(),
            };
            let between = description.bar_form(bar).with_tangent(&Form::constant(held));
            let length = Dual64::new(bar.length, change.length);
            rows.push(mechanism.bar_rows(k).start, vec![BilinearRow::distance(&between, length)]);
        }
        for k in 0..description.scalars.len() {
            rows.scalar(mechanism, tangent, k)?;
        }
        Ok(rows)
    }

    fn push(&mut self, first: usize, rows: Vec<BilinearRow<Dual64>>) {
        let rows = rows.into_iter().enumerate();
        self.0.extend(rows.map(|(i, row)| (first + i, MovedRow::Product(Box::new(row)))));
    }

    /// The rows of a scalar constraint that changes itself or by its joints.
    fn scalar(
        &mut self,
        mechanism: &Mechanism,
        tangent: &MechanismTangent,
        k: usize,
    ) -> Result<(), DesignError> {
        let constraint = &mechanism.description().scalars[k];
        let (first, change) = (mechanism.scalar_rows(k).start, tangent.scalars.get(&k));
        let refused = || DesignError::Kind(constraint.name.clone());
        let moved = |coordinate: &JointCoordinate| {
            moved_value(mechanism, tangent, coordinate).map(Box::new)
        };
        if let ScalarRow::Velocity(row) = &constraint.rows[0] {
            let meant = |own: &JointCoordinate| MovedCoordinate::moves(mechanism, tangent, own);
            if row.reads(&meant) {
                return Err(DesignError::Rates(constraint.name.clone()));
            }
        }
        match (&constraint.rows[0], change) {
            (ScalarRow::Product(row), Some(ScalarTangent::Distance { between, length })) => {
                let own = row.b.with_tangent(between);
                let length = Dual64::new(row.target.sqrt(), *length);
                self.push(first, vec![BilinearRow::distance(&own, length)]);
            }
            (ScalarRow::Product(_), Some(ScalarTangent::Guide { joint, change })) => {
                let dual = change.dual(joint);
                let group = match constraint.rows.len() {
                    1 => PairConstraint::GapAcrossAxis,
                    _ => PairConstraint::GapAlongAxis,
                };
                self.push(first, group.rows(&dual));
            }
            (ScalarRow::Gear { a, b, ratio, .. }, change) => {
                let (by_ratio, target) = match change {
                    Some(ScalarTangent::Gear { ratio, target }) => (*ratio, *target),
                    None => (0.0, 0.0),
                    _ => return Err(refused()),
                };
                let [moved_a, moved_b] = [moved(a), moved(b)];
                if change.is_some() || moved_a.is_some() || moved_b.is_some() {
                    let (own, ratio) = (b.clone(), Dual64::new(*ratio, by_ratio));
                    let row = MovedRow::Gear { a: moved_a, b: moved_b, own, ratio, target };
                    self.0.push((first, row));
                }
            }
            (ScalarRow::Motion { coordinate, .. }, change) => {
                let reference = match change {
                    Some(ScalarTangent::Motion(reference)) => Some(reference.clone()),
                    None => None,
                    _ => return Err(refused()),
                };
                let value = moved(coordinate);
                if value.is_some() || reference.is_some() {
                    self.0.push((first, MovedRow::Motion { value, reference }));
                }
            }
            (_, None) => {}
            (ScalarRow::Height(_), Some(ScalarTangent::Rolling(dual))) => {
                let slips = (0..2).map(|i| MovedRow::Slip(dual.clone(), i));
                let all = [MovedRow::Height(dual.clone())].into_iter().chain(slips);
                self.0.extend((first..).zip(all));
            }
            (ScalarRow::Velocity(_), Some(ScalarTangent::Blade(forms))) => {
                self.0.push((first, MovedRow::Blade(forms.clone())));
            }
            (ScalarRow::Velocity(_), Some(ScalarTangent::Velocity(row))) => {
                self.0.push((first, MovedRow::Velocity(row.clone())));
            }
            _ => return Err(refused()),
        }
        Ok(())
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The rows that are products of forms, and the others.
    pub(super) fn split(self) -> [Self; 2] {
        let is_product = |own: &(usize, MovedRow)| matches!(own.1, MovedRow::Product(_));
        let (products, others) = self.0.into_iter().partition(is_product);
        [Self(products), Self(others)]
    }

    /// The rows that are products of forms.
    pub(super) fn products(&self) -> impl Iterator<Item = (usize, &BilinearRow<Dual64>)> + Clone {
        self.0.iter().filter_map(|(row, moved)| match moved {
            MovedRow::Product(product) => Some((*row, &**product)),
            _ => None,
        })
    }

    /// Emits `g_θ(q_{n+1})`, of constraints on velocities `(h A_d)_θ`, and `−(Gᵀ)_θ h λ` at `q_n`.
    pub(super) fn emit(&self, s: &Interval, impulse: &[f64], out: &mut dyn Sink) {
        self.0.iter().for_each(|(row, moved)| out.row(*row, moved.gap(s)));
        self.for_each_force(&s.q0, impulse, |i, force| out.minus(i, -force));
    }

    /// The entries of `(Gᵀ)_θ μ`.
    pub(super) fn for_each_force(&self, q: &[f64], mu: &[f64], mut visit: impl FnMut(usize, f64)) {
        for (row, moved) in self.0.iter().filter(|(row, _)| mu[*row] != 0.0) {
            moved.for_each_slope(q, |i, slope| visit(i, mu[*row] * slope));
        }
    }

    /// `rows += g_θ`.
    pub(super) fn add_values(&self, at: Configuration<'_>, rows: &mut [f64]) {
        self.0.iter().for_each(|(row, moved)| rows[*row] += moved.value(at));
    }

    /// `rows += G_θ a + γ_θ`, `γ` of [`vi_constraints::Constraints::acceleration_terms`]; those
    /// along angles have none.
    pub(super) fn add_accelerations(
        &self,
        at: Configuration<'_>,
        [v, a]: [&[f64]; 2],
        rows: &mut [f64],
    ) {
        for (row, moved) in &self.0 {
            moved.for_each_slope(at.q, |i, slope| rows[*row] += slope * a[i]);
            rows[*row] += moved.acceleration(at.moving(v));
        }
    }

    /// `rows += G_θ v + g_tθ`.
    pub(super) fn add_rates(&self, at: Motion<'_>, rows: &mut [f64]) {
        for (row, moved) in &self.0 {
            rows[*row] += moved.drift(at.configuration());
            moved.for_each_slope(at.q, |i, slope| rows[*row] += slope * at.v[i]);
        }
    }
}
