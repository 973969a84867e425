//! Single constraints beside the joints: distances, guides, couplings, prescribed motion.
//!
//! ```text
//! distance        ½ (|D|² − l²) = 0                       D: from a point to a point
//! point on line   m_1·r = m_2·r = 0                       line through the parent's anchor along n
//! point on plane  n·r = 0                                  plane through the parent's anchor
//! gear            θ_a + ρ θ_b − c = 0                      gears, racks, screws of two coordinates
//! motion          θ − θ_ref(t) = 0                         rheonomic
//! height          n·(φ − o) − b − R_c c(a) = 0             of a wheel ([`super::rolling`])
//! velocity        A(q) v = b(t, q)                         no value ([`super::velocity_constraint`])
//! ```
//! They act on top of the spanning tree like the joints that close loops.

use crate::constraint::joint_coordinate::{JointCoordinate, Unwrapped};
use crate::constraint::rolling::{Rolling, Slip};
use crate::constraint::velocity_constraint::{Pace, VelocityConstraint, emit_wrench};
use crate::geometry::form::{BilinearRow, Form};
use crate::pair::constraints::PairConstraint;
use crate::pair::joint::Joint;
use crate::pair::{DegreeOfFreedom, Twist};
use std::f64::consts::TAU;
use std::sync::Arc;
use vi_core::interval::{Interval, StepChange};
use vi_core::sparse::{Block, Entries, Product};
use vi_core::{Configuration, Motion};

/// `θ_ref`, `θ̇_ref` and `θ̈_ref` at time `t`.
pub type Reference = Arc<dyn Fn(f64) -> [f64; 3] + Send + Sync>;

/// One scalar constraint row of any kind.
#[derive(Clone)]
pub enum ScalarRow {
    /// A product of forms.
    Product(BilinearRow),
    /// `θ_a + ρ θ_b − c`.
    Gear {
        /// `θ_a`.
        a: Box<JointCoordinate>,
        /// `θ_b`.
        b: Box<JointCoordinate>,
        /// `ρ`.
        ratio: f64,
        /// `c`.
        target: f64,
    },
    /// `θ − θ_ref(t)`.
    Motion {
        /// `θ`.
        coordinate: Box<JointCoordinate>,
        /// `θ_ref` with its derivatives.
        reference: Reference,
    },
    /// `n·(φ − o) − b − R_c c(a)`.
    Height(Arc<Rolling>),
    /// `A(q) v = b(t, q)`: the value is zero at every configuration.
    Velocity(Arc<dyn VelocityConstraint>),
}

impl std::fmt::Debug for ScalarRow {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Product(_) => "product",
            Self::Gear { .. } => "gear",
            Self::Motion { .. } => "motion",
            Self::Height(_) => "height",
            Self::Velocity(_) => "velocity",
        })
    }
}

impl ScalarRow {
    /// The thread of a screw: `n·r − p θ = 0` with the advance `p` per radian. Premise: the anchors
    /// fit, see [`crate::pair::thread::fit_thread`].
    pub(crate) fn thread(joint: &Joint, pitch: f64) -> Option<Self> {
        let of = |freedom| Some(Box::new(JointCoordinate::of(joint, freedom)?));
        let (a, b) = (of(DegreeOfFreedom::Length(2))?, of(DegreeOfFreedom::ABOUT_AXIS)?);
        Some(Self::Gear { a, b, ratio: -pitch, target: 0.0 })
    }

    /// `g(q, t)`.
    #[must_use]
    pub fn value(&self, at: Configuration<'_>) -> f64 {
        match self {
            Self::Product(row) => row.value(at.q),
            Self::Gear { a, b, ratio, target } => {
                let (a, b) = (a.unwrapped(at), b.unwrapped(at));
                let revolutions = ratio.mul_add(b.revolutions, a.revolutions);
                a.principal + ratio * b.principal + TAU.mul_add(revolutions, -target)
            }
            Self::Motion { coordinate, reference } => {
                let Unwrapped { principal, revolutions } = coordinate.unwrapped(at);
                principal + TAU.mul_add(revolutions, -reference(at.t)[0])
            }
            Self::Height(rolling) => rolling.height(at.q),
            Self::Velocity(_) => 0.0,
        }
    }

    /// What a step has to close: `g(q_{n+1}, t_{n+1})`; of a velocity constraint `h A_d`.
    #[must_use]
    pub fn gap(&self, s: &Interval) -> f64 {
        match self {
            Self::Velocity(row) => row.residual(s),
            _ => self.value(s.end()),
        }
    }

    /// What a step changes: `g(q_{n+1}) − g(q_n)`; of a velocity constraint `h A_d`.
    #[must_use]
    pub fn change(&self, s: &Interval) -> f64 {
        match self {
            Self::Velocity(row) => row.residual(s),
            _ => self.value(s.end()) - self.value(s.start()),
        }
    }

    /// Whether what a step does to it is no matter of the midpoint: of rolling, of velocities.
    #[must_use]
    pub fn is_of_a_step(&self) -> bool {
        matches!(self, Self::Velocity(_) | Self::Height(_))
    }

    /// The derivative of the gap by the end of a step, as wrenches on the frames.
    pub fn for_each_wrench_of_step(&self, s: &Interval, mut visit: impl FnMut(usize, Twist)) {
        match self {
            Self::Velocity(row) => row.for_each_wrench_of_step(s, &mut visit),
            _ => self.for_each_wrench(&s.q1, visit),
        }
    }

    /// Emits the derivative of the gap by the end of a step, of a velocity constraint along motions
    /// that keep bodies rigid; always the same places in the same order.
    pub fn emit_of_step(&self, s: &Interval, row: usize, out: &mut dyn Entries) {
        match self {
            Self::Velocity(velocity) => {
                velocity.for_each_wrench_of_step(s, &mut |frame, wrench| {
                    emit_wrench(&s.q1, frame, row, 1.0, &wrench, out);
                })
            }
            _ => self.emit(&s.q1, row, out),
        }
    }

    /// How the gap of a velocity constraint changes with the length and the time of a step between
    /// the same ends; `None` where it is not known.
    #[must_use]
    pub fn step_change(&self, s: &Interval, change: StepChange) -> Option<f64> {
        match self {
            Self::Velocity(row) => row.step_change(s, change),
            _ => Some(0.0),
        }
    }

    /// Whether it constrains velocities, not configurations.
    #[must_use]
    pub fn is_of_velocities(&self) -> bool {
        matches!(self, Self::Velocity(_))
    }

    /// Whether a velocity constraint is driven: `b` may be other than zero.
    #[must_use]
    pub fn is_driven(&self) -> bool {
        matches!(self, Self::Velocity(row) if row.is_driven())
    }

    /// Emits its row of `G`.
    pub fn emit(&self, q: &[f64], row: usize, out: &mut dyn Entries) {
        match self {
            Self::Product(product) => product.emit(q, row, out),
            Self::Gear { a, b, ratio, .. } => {
                a.emit(q, row, 1.0, out);
                b.emit(q, row, *ratio, out);
            }
            Self::Motion { coordinate, .. } => coordinate.emit(q, row, 1.0, out),
            Self::Height(rolling) => rolling.emit_height(q, row, out),
            Self::Velocity(velocity) => velocity.emit(q, row, 1.0, out),
        }
    }

    /// `g ← g + G(q) v`.
    pub fn add_rate(&self, q: &[f64], v: &[f64], g: &mut f64) {
        match self {
            Self::Product(row) => *g += row.rate(q, v),
            _ => self.emit(q, 0, &mut Product { v, out: std::slice::from_mut(g) }),
        }
    }

    /// `out ← out + scale ∇g(q)`, shape `n`.
    pub(crate) fn add_gradient(&self, q: &[f64], scale: f64, out: &mut [f64]) {
        match self {
            Self::Product(row) => row.for_each_slope(q, |i, slope| out[i] += scale * slope),
            _ => {
                let into = &mut Product { v: &[1.0], out };
                self.emit(q, 0, &mut Block { into, row: 0, column: 0, scale, transposed: true });
            }
        }
    }

    /// `out ← out + scale D²g(q) v`, shape `n`.
    pub(crate) fn add_bend(&self, q: &[f64], v: &[f64], scale: f64, out: &mut [f64]) {
        match self {
            Self::Product(row) => row.for_each_bend(v, |i, bend| out[i] += scale * bend),
            Self::Gear { a, b, ratio, .. } => {
                a.add_bend(q, v, scale, out);
                b.add_bend(q, v, ratio * scale, out);
            }
            Self::Motion { coordinate, .. } => coordinate.add_bend(q, v, scale, out),
            Self::Height(_) | Self::Velocity(_) => {
                self.emit_second(q, scale, &mut Product { v, out });
            }
        }
    }

    /// `out ← out + scale D³g(q)[v, w]`, shape `n`; that of rolling is left out.
    pub(crate) fn add_third(&self, q: &[f64], [v, w]: [&[f64]; 2], scale: f64, out: &mut [f64]) {
        let out = &mut Product { v: w, out };
        match self {
            Self::Product(_) | Self::Height(_) | Self::Velocity(_) => {}
            Self::Gear { a, b, ratio, .. } => {
                a.emit_third(q, v, scale, out);
                b.emit_third(q, v, ratio * scale, out);
            }
            Self::Motion { coordinate, .. } => coordinate.emit_third(q, v, scale, out),
        }
    }

    /// `out ← out + scale ∂/∂q` of `D²g[v, v]`, of a velocity constraint of `DA[v] v − ḃ`, at fixed
    /// `v`, shape `n`; `false` where it is not known.
    pub(crate) fn add_acceleration_slope(
        &self,
        at: Motion<'_>,
        scale: f64,
        out: &mut [f64],
    ) -> bool {
        match self {
            Self::Product(_) => true,
            Self::Height(rolling) => {
                rolling.add_acceleration_slope(0, [at.q, at.v], scale, out);
                true
            }
            Self::Velocity(row) => row.add_acceleration_slope(at, scale, out),
            Self::Gear { .. } | Self::Motion { .. } => false,
        }
    }

    /// Its gradient as wrenches on the frames.
    pub fn for_each_wrench(&self, q: &[f64], mut visit: impl FnMut(usize, Twist)) {
        match self {
            Self::Product(row) => row.for_each_wrench(q, visit),
            Self::Gear { a, b, ratio, .. } => {
                a.for_each_wrench(q, &mut visit);
                b.for_each_wrench(q, |frame, w| {
                    visit(frame, Twist::new(*ratio * w.linear, *ratio * w.angular));
                });
            }
            Self::Motion { coordinate, .. } => coordinate.for_each_wrench(q, visit),
            Self::Height(rolling) => rolling.for_each_wrench_of_height(q, visit),
            Self::Velocity(row) => row.for_each_wrench(q, &mut visit),
        }
    }

    /// The largest force and the largest moment of the gradient on a frame: what a residual is to
    /// be divided by for a length or an angle.
    #[must_use]
    pub fn largest_wrench(&self, q: &[f64]) -> (f64, f64) {
        let mut sums: Vec<(usize, Twist)> = Vec::new(); // a form may visit a frame more than once
        self.for_each_wrench(q, |frame, w| match sums.iter_mut().find(|sum| sum.0 == frame) {
            Some((_, sum)) => {
                *sum = Twist::new(sum.linear + w.linear, sum.angular + w.angular);
            }
            None => sums.push((frame, w)),
        });
        sums.iter().fold((0.0, 0.0), |(force, moment): (f64, f64), (_, w)| {
            (force.max(w.linear.norm()), moment.max(w.angular.norm()))
        })
    }

    /// `D²g[v, w]`; `DA[v] w` of a velocity constraint.
    #[must_use]
    pub fn second(&self, q: &[f64], v: &[f64], w: &[f64]) -> f64 {
        match self {
            Self::Product(row) => row.second(v, w),
            Self::Gear { a, b, ratio, .. } => a.second(q, v, w) + ratio * b.second(q, v, w),
            Self::Motion { coordinate, .. } => coordinate.second(q, v, w),
            Self::Height(rolling) => rolling.second_of_height(q, v, w),
            Self::Velocity(row) => row.second(q, v, w),
        }
    }

    /// Emits `scale D²g(q)`; always the same places in the same order.
    pub fn emit_second(&self, q: &[f64], scale: f64, out: &mut dyn Entries) {
        match self {
            Self::Product(row) => row.emit_second(scale, out),
            Self::Gear { a, b, ratio, .. } => {
                a.emit_second(q, scale, out);
                b.emit_second(q, ratio * scale, out);
            }
            Self::Motion { coordinate, .. } => coordinate.emit_second(q, scale, out),
            Self::Height(rolling) => rolling.emit_second_of_height(q, scale, out),
            Self::Velocity(row) => row.emit_second(q, scale, out),
        }
    }

    /// `[∂g/∂t, ∂²g/∂t²]`; mixed derivatives vanish.
    #[must_use]
    pub fn time_derivatives(&self, t: f64) -> [f64; 2] {
        match self {
            Self::Motion { reference, .. } => {
                let [_, rate, acceleration] = reference(t);
                [-rate, -acceleration]
            }
            _ => [0.0; 2],
        }
    }

    /// `∂g/∂t`, `−b` of a velocity constraint: the velocities allowed satisfy `G v = −∂g/∂t`.
    #[must_use]
    pub fn drift(&self, at: Configuration<'_>) -> f64 {
        match self {
            Self::Velocity(row) if row.is_driven() => -row.rate(at),
            _ => self.time_derivatives(at.t)[0],
        }
    }

    /// Emits the derivative of [`ScalarRow::drift`] by `q`, of a velocity constraint.
    pub fn emit_drift_slope(&self, at: Configuration<'_>, out: &mut dyn Entries) {
        if let Self::Velocity(row) = self {
            row.emit_rate_slope(at, 0, -1.0, out);
        }
    }

    /// The part of the second derivative of `g` in time that is explicit in time, along `v`.
    #[must_use]
    pub fn drift_change(&self, at: Motion<'_>) -> f64 {
        match self {
            Self::Velocity(row) if row.is_driven() => -row.rate_change(at),
            _ => self.time_derivatives(at.t)[1],
        }
    }

    /// The size of what the coordinates are compared with beside their own: whole revolutions,
    /// which are known to `ε` of their number, and the reference at `t`.
    #[must_use]
    pub fn target_size(&self, at: Configuration<'_>) -> f64 {
        let rotated = |c: &JointCoordinate| TAU * c.unwrapped(at).revolutions.abs();
        match self {
            Self::Product(_) | Self::Velocity(_) => 0.0,
            Self::Height(rolling) => rolling.circle + rolling.section,
            Self::Gear { a, b, ratio, target } => {
                rotated(a) + ratio.abs() * rotated(b) + target.abs()
            }
            Self::Motion { coordinate, reference } => {
                rotated(coordinate) + reference(at.t)[0].abs()
            }
        }
    }

    /// Whether it is a motion prescribed in time.
    #[must_use]
    pub fn is_rheonomic(&self) -> bool {
        matches!(self, Self::Motion { .. })
    }

    /// Lists its angles.
    pub(crate) fn list_angles(&mut self, angles: &mut Vec<JointCoordinate>) {
        match self {
            Self::Product(_) | Self::Height(_) | Self::Velocity(_) => {}
            Self::Gear { a, b, .. } => {
                a.list(angles);
                b.list(angles);
            }
            Self::Motion { coordinate, .. } => coordinate.list(angles),
        }
    }
}

/// A named scalar constraint: one or two rows.
#[derive(Clone, Debug)]
pub struct ScalarConstraint {
    /// Its name.
    pub name: String,
    /// Its rows.
    pub rows: Vec<ScalarRow>,
}

impl ScalarConstraint {
    fn new(name: &str, rows: Vec<ScalarRow>) -> Self {
        Self { name: name.to_owned(), rows }
    }

    /// A point keeps its distance `length` (m) from another; `between` is the form `D`.
    #[must_use]
    pub fn distance(name: &str, between: &Form, length: f64) -> Self {
        Self::new(name, vec![ScalarRow::Product(BilinearRow::distance(between, length))])
    }

    /// The child's anchor stays on the line through the parent's anchor along its axis `n`.
    #[must_use]
    pub fn point_on_line(joint: &Joint) -> Self {
        let rows = PairConstraint::GapAlongAxis.rows(joint);
        Self::new(&joint.name, rows.into_iter().map(ScalarRow::Product).collect())
    }

    /// The child's anchor stays on the plane through the parent's anchor with normal `n`.
    #[must_use]
    pub fn point_on_plane(joint: &Joint) -> Self {
        let rows = PairConstraint::GapAcrossAxis.rows(joint);
        Self::new(&joint.name, rows.into_iter().map(ScalarRow::Product).collect())
    }

    /// `θ_a + ρ θ_b` has the value that it has at `q`, with principal angles: gears (`ρ` = teeth of
    /// b over teeth of a), racks, and with the two coordinates of a cylindrical joint
    /// (`ρ = −pitch/2π`) screws.
    #[must_use]
    pub fn gear(name: &str, a: JointCoordinate, b: JointCoordinate, ratio: f64, q: &[f64]) -> Self {
        let at = Configuration::new(0.0, q);
        let target = a.at(at) + ratio * b.at(at);
        let (a, b) = (Box::new(a), Box::new(b));
        Self::new(name, vec![ScalarRow::Gear { a, b, ratio, target }])
    }

    /// The coordinate keeps the value `target`, revolutions counted: a gear without a second one.
    #[must_use]
    pub fn held(name: &str, coordinate: JointCoordinate, target: f64) -> Self {
        let a = Box::new(coordinate);
        let row = ScalarRow::Gear { b: a.clone(), a, ratio: 0.0, target };
        Self::new(name, vec![row])
    }

    /// The coordinate follows `θ_ref(t)`.
    #[must_use]
    pub fn motion(name: &str, coordinate: JointCoordinate, reference: Reference) -> Self {
        let coordinate = Box::new(coordinate);
        Self::new(name, vec![ScalarRow::Motion { coordinate, reference }])
    }

    /// A wheel or a sphere rolls: its height, its slip along two directions.
    #[must_use]
    pub fn rolling(name: &str, rolling: Rolling) -> Self {
        let rolling = Arc::new(rolling);
        let slip = |direction| -> Arc<dyn VelocityConstraint> {
            Arc::new(Slip { rolling: rolling.clone(), direction })
        };
        let [first, second] = [0, 1].map(slip).map(ScalarRow::Velocity);
        Self::new(name, vec![ScalarRow::Height(rolling), first, second])
    }

    /// A point fixed in a body has no velocity along a direction fixed in it.
    #[must_use]
    pub fn blade(name: &str, direction: Form, point: Form) -> Self {
        Self::velocity(name, Pace::Along { direction, point })
    }

    /// A constraint on velocities.
    #[must_use]
    pub fn velocity(name: &str, row: impl VelocityConstraint + 'static) -> Self {
        Self::new(name, vec![ScalarRow::Velocity(Arc::new(row))])
    }
}
