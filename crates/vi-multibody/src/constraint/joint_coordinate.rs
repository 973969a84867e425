//! Joint coordinates as functions of the configuration, with their revolutions.
//!
//! ```text
//! length   u = a·r                    a: an axis of the parent, r: the gap
//! angle    θ = atan2(s, c),  s = m_1'·m_2,  c = m_1'·m_1        about n, from m_1 to m_1'
//! ∇θ = (c ∇s − s ∇c)/(s² + c²)
//! ```
//! Where the axes `n` and `n'` coincide, `s = −m_2'·m_1` and `c = m_2'·m_2` as well
//! ([`SharedAxis`]). The gradients of both angles differ by
//! `∇(m_1'·m_2') + cos 2θ ∇(m_1·m_2) + ½ sin 2θ ∇(m_2² − m_1²)`, forces within rigid bodies.
//!
//! `s`, `c`, `u` are products of linear forms, so every derivative is exact. `atan2` gives an angle
//! up to whole revolutions; these follow from the angles of the last node,
//! [`Configuration::angles`], where the mechanism lists the coordinate
//! ([`crate::Mechanism::coordinate`]).

use crate::geometry::form::{BilinearRow, Form};
use crate::pair::joint::{FrameId, Joint};
use crate::pair::{DegreeOfFreedom, Twist};
use std::f64::consts::TAU;
use vi_core::Configuration;
use vi_core::Number;
use vi_core::coordinate_force::{EffortBends, EffortSlopes, SignedUnknown};
use vi_core::interval::{Interval, Slot};
use vi_core::sparse::Entries;

/// A joint coordinate: a length (m) or an angle (rad).
#[derive(Clone, Debug)]
pub struct JointCoordinate {
    value: Value,
    shared: Option<Box<SharedAxis>>, // of an angle about the axis of the pair, n' = n
    slot: usize,                     // among the unwrapped angles
    unknown: Option<SignedUnknown>,  // of a step, where the joint belongs to the tree
    on_ground: bool,                 // whether the joint is one with the ground
    joint: u32,                      // of the mechanism
    freedom: u8,
}

/// An angle as a principal value and whole revolutions; a length and zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unwrapped {
    /// `θ − 2πk` in `[−π, π]`, rad.
    pub principal: f64,
    /// `k`.
    pub revolutions: f64,
}

/// A coordinate over an interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoordinateChange {
    /// Mean of both ends.
    pub mean: f64,
    /// End less start.
    pub difference: f64,
}

/// Of a coordinate that is no joint's of a mechanism.
const NO_JOINT: u32 = u32::MAX;
/// Of an angle that is not listed: its principal value is meant.
const UNLISTED: usize = usize::MAX;

/// What a joint coordinate is a function of: products of linear forms of `q`.
#[derive(Clone, Debug, PartialEq)]
pub enum Value<T = f64> {
    /// `u`.
    Length(BilinearRow<T>),
    /// `θ = atan2(s, c)`.
    Angle {
        /// `s`.
        sine: BilinearRow<T>,
        /// `c`.
        cosine: BilinearRow<T>,
    },
}

impl<T: Number> Value<T> {
    /// Of a degree of freedom that the joint, or a pair with the same axes, has; `None` where it is
    /// no such coordinate.
    #[must_use]
    pub fn of(joint: &Joint<T>, freedom: DegreeOfFreedom) -> Option<Self> {
        // axis of the child times axis of the parent
        let product = |[i, j]: [usize; 2]| {
            BilinearRow::product(joint.child.axis(i), joint.parent.axis(j), T::of(0.0))
        };
        match freedom {
            DegreeOfFreedom::Length(i) => Some(Self::Length(BilinearRow::product(
                joint.parent.axis(i),
                joint.gap(),
                T::of(0.0),
            ))),
            DegreeOfFreedom::Angle { sine, cosine } => {
                Some(Self::Angle { sine: product(sine), cosine: product(cosine) })
            }
            DegreeOfFreedom::Position | DegreeOfFreedom::Rotation => None,
        }
    }

    /// `θ ∈ [−π, π]`, or the length.
    #[must_use]
    pub fn principal(&self, q: &[f64]) -> T {
        match self {
            Self::Length(row) => row.value(q),
            Self::Angle { sine, cosine } => sine.value(q).arctangent(cosine.value(q)),
        }
    }

    /// The rows it is made of, with the factors of their gradients at `q`.
    fn parts(&self, q: &[f64]) -> [(T, Option<&BilinearRow<T>>); 2] {
        match self {
            Self::Length(row) => [(T::of(1.0), Some(row)), (T::of(0.0), None)],
            Self::Angle { sine, cosine } => {
                let (s, c) = (sine.value(q), cosine.value(q));
                let square = s * s + c * c;
                [(c / square, Some(sine)), (-s / square, Some(cosine))]
            }
        }
    }

    /// The entries of the gradient, always in the same order; a coordinate may come several times.
    pub fn for_each_slope(&self, q: &[f64], mut visit: impl FnMut(usize, T)) {
        for (factor, row) in self.parts(q) {
            if let Some(row) = row {
                row.for_each_slope(q, |i, slope| visit(i, factor * slope));
            }
        }
    }
}

/// The rows that a coordinate is made of, its derivatives by them, and the second ones.
type RowChain<'a> = ([Option<&'a BilinearRow>; 2], [f64; 2], [[f64; 2]; 2]);

impl Value {
    /// `θ_k` and `θ_kl` at `q`.
    fn chain(&self, q: &[f64]) -> RowChain<'_> {
        match self {
            Self::Length(row) => ([Some(row), None], [1.0, 0.0], [[0.0; 2]; 2]),
            Self::Angle { sine, cosine } => {
                let (s, c) = (sine.value(q), cosine.value(q));
                let square = s * s + c * c;
                let [same, mixed] = [-2.0 * s * c, s * s - c * c].map(|x| x / (square * square));
                let first = [c / square, -s / square];
                ([Some(sine), Some(cosine)], first, [[same, mixed], [mixed, -same]])
            }
        }
    }
}

/// Products of the axes of two frames with `n' = n`, beside `m_1'·m_2` and `m_1'·m_1`.
#[derive(Clone, Debug)]
pub struct SharedAxis {
    /// `s = −m_2'·m_1`.
    pub sine: BilinearRow,
    /// `c = m_2'·m_2`.
    pub cosine: BilinearRow,
    /// `m_1'·m_2'`, `m_1·m_2`, `½ (m_2² − m_1²)`: zero in rigid bodies.
    pub zero: [BilinearRow; 3],
}

impl SharedAxis {
    /// Of an angle about the axis of a pair that keeps it in common.
    fn of(joint: &Joint, freedom: DegreeOfFreedom) -> Option<Self> {
        let kept =
            freedom == DegreeOfFreedom::ABOUT_AXIS && !joint.kind.properties().motion.swaps_axes();
        let [first, second] = [0, 1].map(|i| joint.parent.axis(i));
        let [own_first, own_second] = [0, 1].map(|i| joint.child.axis(i));
        let product = |scale: f64, a: &Form, b: &Form| BilinearRow {
            scale,
            ..BilinearRow::product(a.clone(), b.clone(), 0.0)
        };
        kept.then(|| Self {
            sine: product(-1.0, &own_second, &first),
            cosine: product(1.0, &own_second, &second),
            zero: [
                product(1.0, &own_first, &own_second),
                product(1.0, &first, &second),
                product(0.5, &second.minus(&first), &second.plus(&first)),
            ],
        })
    }
}

/// Three vectors by the coordinates in which they are not zero.
#[derive(Default)]
struct Gathered(Vec<(usize, [f64; 3])>);

impl Gathered {
    fn add(&mut self, of: usize, i: usize, value: f64) {
        match self.0.iter_mut().find(|(own, _)| *own == i) {
            Some((_, own)) => own[of] += value,
            None => {
                let mut own = [0.0; 3];
                own[of] = value;
                self.0.push((i, own));
            }
        }
    }

    /// Emits `Σ_kl factors_kl x_k y_lᵀ`.
    fn emit(&self, right: &Self, factors: &[[f64; 3]; 3], out: &mut dyn Entries) {
        for (i, x) in &self.0 {
            let row = [0, 1, 2].map(|l| (0..3).map(|k| x[k] * factors[k][l]).sum::<f64>());
            for (j, y) in &right.0 {
                out.add(*i, *j, row[0] * y[0] + row[1] * y[1] + row[2] * y[2]);
            }
        }
    }
}

impl JointCoordinate {
    /// Coordinate `freedom` of a joint, an angle by its principal value, in `[−π, π]`; `None` for
    /// pairs whose degrees of freedom are no such coordinates (spherical, free) and for degrees of
    /// freedom that do not exist.
    #[must_use]
    pub fn principal(joint: &Joint, freedom: usize) -> Option<Self> {
        Self::of(joint, joint.kind.degree_of_freedom(freedom)?)
    }

    /// A length that is no degree of freedom of a joint: a vector of one member along one of
    /// another.
    #[must_use]
    pub fn length(row: BilinearRow) -> Self {
        let value = Value::Length(row);
        Self {
            value,
            shared: None,
            slot: UNLISTED,
            unknown: None,
            on_ground: false,
            joint: NO_JOINT,
            freedom: 0,
        }
    }

    /// The coordinate of a degree of freedom that the joint, or a pair with the same axes, has.
    pub(crate) fn of(joint: &Joint, freedom: DegreeOfFreedom) -> Option<Self> {
        let value = Value::of(joint, freedom)?;
        let on_ground =
            [&joint.parent, &joint.child].iter().any(|end| end.frame == FrameId::Ground);
        let shared = SharedAxis::of(joint, freedom).map(Box::new);
        Some(Self {
            value,
            shared,
            slot: UNLISTED,
            unknown: None,
            on_ground,
            joint: NO_JOINT,
            freedom: 0,
        })
    }

    /// Of which joint of a mechanism it is which freedom.
    pub(crate) fn placed(mut self, joint: usize, freedom: usize) -> Self {
        let joint = u32::try_from(joint).unwrap_or(NO_JOINT);
        let freedom = u8::try_from(freedom).expect("a pair has at most six");
        (self.joint, self.freedom) = (joint, freedom);
        self
    }

    /// Joint and freedom in a mechanism, where it is one.
    #[must_use]
    pub fn place(&self) -> Option<(usize, usize)> {
        let known = self.joint != NO_JOINT;
        known.then_some((self.joint as usize, usize::from(self.freedom)))
    }

    /// Notes the unknown of a step that it is.
    pub(crate) fn note_unknown(&mut self, unknown: Option<SignedUnknown>) {
        self.unknown = unknown;
    }

    /// The unknown of a step that it is, up to its sign: of coordinates of a [`crate::Mechanism`]
    /// on joints of its spanning tree.
    #[must_use]
    pub fn unknown(&self) -> Option<SignedUnknown> {
        self.unknown
    }

    /// Lists the angle, if it is one: appended to `angles`.
    pub(crate) fn list(&mut self, angles: &mut Vec<Self>) {
        if self.is_angle() {
            self.slot = angles.len();
            angles.push(self.clone());
        }
    }

    /// Its own among the angles of a state, rad; `None` where it is not listed.
    pub fn angle_among<'a>(&self, angles: &'a mut [f64]) -> Option<&'a mut f64> {
        angles.get_mut(self.slot)
    }

    /// Its place among the angles that are listed; of others none.
    pub(crate) fn slot(&self) -> usize {
        self.slot
    }

    /// Whether it is a length that is measured from the ground: in a steady rotation its rate
    /// changes with the configuration.
    #[must_use]
    pub fn is_length_from_ground(&self) -> bool {
        self.on_ground && !self.is_angle()
    }

    /// What it is made of.
    #[must_use]
    pub fn value(&self) -> &Value {
        &self.value
    }

    /// More of what an angle about an axis of both frames is made of.
    #[must_use]
    pub fn shared_axis(&self) -> Option<&SharedAxis> {
        self.shared.as_deref()
    }

    /// Whether it is an angle.
    #[must_use]
    pub fn is_angle(&self) -> bool {
        matches!(self.value, Value::Angle { .. })
    }

    /// The coordinate; a listed angle with its revolutions.
    #[must_use]
    pub fn at(&self, at: Configuration<'_>) -> f64 {
        let Unwrapped { principal, revolutions } = self.unwrapped(at);
        principal + TAU * revolutions
    }

    /// The coordinate at a node, where the angles of `at` are those at its `q`.
    #[must_use]
    pub fn at_node(&self, at: Configuration<'_>) -> f64 {
        at.angles.get(self.slot).copied().unwrap_or_else(|| self.at(at))
    }

    /// The coordinate less `value`, accurate also after many revolutions.
    #[must_use]
    pub fn distance_from(&self, value: f64, at: Configuration<'_>) -> f64 {
        let Unwrapped { principal, revolutions } = self.unwrapped(at);
        principal - (value - TAU * revolutions)
    }

    /// `θ − 2πk` in `[−π, π]` and the number `k` of whole revolutions; a length and zero.
    ///
    /// After many revolutions the sum is only accurate to `ε|θ|`; what is compared with `θ`
    /// subtracts the revolutions first.
    #[must_use]
    pub fn unwrapped(&self, at: Configuration<'_>) -> Unwrapped {
        let principal = self.principal_value(at.q);
        let revolutions = if self.is_angle() { at.revolutions(self.slot, principal) } else { 0.0 };
        Unwrapped { principal, revolutions }
    }

    /// Mean of both ends of an interval, and their difference; an angle changes by less than `π`.
    #[must_use]
    pub fn change(&self, s: &Interval) -> CoordinateChange {
        self.change_between(s, [&s.q0, &s.q1].map(|q| self.principal_value(q)))
    }

    /// The same from the principal values at both ends.
    fn change_between(&self, s: &Interval, [start, end]: [f64; 2]) -> CoordinateChange {
        let mut difference = end - start;
        let mut whole = 0.0;
        if self.is_angle() {
            difference -= TAU * (difference / TAU).round();
            whole = TAU * s.start().revolutions(self.slot, start);
        }
        CoordinateChange { mean: start + whole + 0.5 * difference, difference }
    }

    /// The change over an interval, and `∇θ·v` at both its ends.
    #[must_use]
    pub fn change_and_rates(&self, s: &Interval, v: &[f64]) -> (CoordinateChange, [f64; 2]) {
        let [start, end] = [&s.q0, &s.q1].map(|q| self.value_and_rate(q, v));
        (self.change_between(s, [start[0], end[0]]), [start[1], end[1]])
    }

    /// The principal value and `∇θ·v`.
    fn value_and_rate(&self, q: &[f64], v: &[f64]) -> [f64; 2] {
        match &self.value {
            Value::Length(row) => row.value_and_rate(q, v),
            Value::Angle { sine, cosine } => {
                let [s, sine_rate] = sine.value_and_rate(q, v);
                let [c, cosine_rate] = cosine.value_and_rate(q, v);
                let rate = (c * sine_rate - s * cosine_rate) / (s * s + c * c);
                [libm::atan2(s, c), rate]
            }
        }
    }

    fn principal_value(&self, q: &[f64]) -> f64 {
        self.value.principal(q)
    }

    /// `out ← out + scale ∇θ(q)`.
    pub fn add_gradient(&self, q: &[f64], scale: f64, out: &mut [f64]) {
        self.for_each_slope(q, |i, slope| out[i] += scale * slope);
    }

    /// Emits `scale ∇θ(q)` as row `row`.
    pub fn emit(&self, q: &[f64], row: usize, scale: f64, out: &mut dyn Entries) {
        self.for_each_slope(q, |i, slope| out.add(row, i, scale * slope));
    }

    /// Emits `scale ∇θ(q_n) ∇θ(q_{n+1})ᵀ`, or `scale` at its unknown.
    pub fn emit_slope(&self, s: &Interval, scale: f64, out: &mut dyn Entries) {
        if !self.unknown.is_some_and(|unknown| out.add_along(unknown.index, scale)) {
            self.emit_product(&s.q0, &s.q1, scale, out);
        }
    }

    /// Emits `scale ∇θ(q_0) ∇θ(q_1)ᵀ`.
    pub fn emit_product(&self, q0: &[f64], q1: &[f64], scale: f64, out: &mut dyn Entries) {
        self.for_each_slope(q0, |i, left| {
            self.for_each_slope(q1, |j, right| out.add(i, j, scale * left * right));
        });
    }

    /// The entries of `∇θ(q)`, always in the same order; a coordinate may come several times.
    pub fn for_each_slope(&self, q: &[f64], visit: impl FnMut(usize, f64)) {
        self.value.for_each_slope(q, visit);
    }

    /// The gradient as wrenches on the frames.
    pub fn for_each_wrench(&self, q: &[f64], mut visit: impl FnMut(usize, Twist)) {
        for (factor, row) in self.value.parts(q) {
            if let Some(row) = row {
                row.for_each_wrench(q, |frame, w| {
                    visit(frame, Twist::new(factor * w.linear, factor * w.angular));
                });
            }
        }
    }

    /// `∇θ·v`.
    #[must_use]
    pub fn rate(&self, q: &[f64], v: &[f64]) -> f64 {
        self.value_and_rate(q, v)[1]
    }

    /// `D²θ(q)[v, w]`.
    #[must_use]
    pub fn second(&self, q: &[f64], v: &[f64], w: &[f64]) -> f64 {
        match &self.value {
            Value::Length(row) => row.second(v, w),
            Value::Angle { sine, cosine } => {
                let (s, c) = (sine.value(q), cosine.value(q));
                let slope = |row: &BilinearRow, v: &[f64]| {
                    let mut sum = 0.0;
                    row.for_each_slope(q, |i, slope| sum += slope * v[i]);
                    sum
                };
                let (sv, sw, cv, cw) =
                    (slope(sine, v), slope(sine, w), slope(cosine, v), slope(cosine, w));
                let square = s * s + c * c;
                let bend =
                    -2.0 * s * c * (sv * sw - cv * cw) + (s * s - c * c) * (sv * cw + cv * sw);
                bend / (square * square)
                    + (c * sine.second(v, w) - s * cosine.second(v, w)) / square
            }
        }
    }

    /// `out ← out + scale D²θ(q) v`.
    pub fn add_bend(&self, q: &[f64], v: &[f64], scale: f64, out: &mut [f64]) {
        self.for_each_bend(q, v, scale, |i, own| out[i] += own);
    }

    /// The entries of `scale D²θ(q) v`, always in the same order; a coordinate may come several
    /// times.
    pub fn for_each_bend(
        &self,
        q: &[f64],
        v: &[f64],
        scale: f64,
        mut visit: impl FnMut(usize, f64),
    ) {
        let mut add = |row: &BilinearRow, [slope, bend]: [f64; 2]| {
            row.for_each_slope(q, |i, own| visit(i, slope * own));
            row.for_each_bend(v, |i, own| visit(i, bend * own));
        };
        match &self.value {
            Value::Length(row) => row.for_each_bend(v, |i, own| visit(i, scale * own)),
            Value::Angle { sine, cosine } => {
                let [s, sine_rate] = sine.value_and_rate(q, v);
                let [c, cosine_rate] = cosine.value_and_rate(q, v);
                let square = s * s + c * c;
                let [same, mixed] =
                    [-2.0 * s * c, s * s - c * c].map(|x| scale * x / (square * square));
                add(sine, [same * sine_rate + mixed * cosine_rate, scale * c / square]);
                add(cosine, [mixed * sine_rate - same * cosine_rate, -scale * s / square]);
            }
        }
    }

    /// Emits `∇θ (τ_θ ∇θ + τ_θ̇ D²θ v)ᵀ + τ D²θ(q)`, the slope of `τ(θ, ∇θ·v) ∇θ`; always the same
    /// places in the same order. Allocates.
    /// ```text
    /// θ = θ(r_1, r_2) of rows:    ∇θ = Σ θ_k ∇r_k,    D²θ = Σ θ_kl ∇r_k ∇r_lᵀ + Σ θ_k D²r_k
    /// ```
    pub fn emit_effort_slopes(
        &self,
        q: &[f64],
        v: &[f64],
        effort: f64,
        slopes: EffortSlopes,
        out: &mut dyn Entries,
    ) {
        let (rows, first, second) = self.value.chain(q);
        let mut gathered = Gathered::default(); // ∇r_1, ∇r_2, Σ θ_k D²r_k v
        let mut gather = |of: usize, i: usize, value: f64| gathered.add(of, i, value);
        let by_rate = slopes.by_rate;
        let mut rates = [0.0; 2];
        for (k, row) in rows.iter().enumerate() {
            let Some(row) = row else { continue };
            row.for_each_slope(q, |i, slope| gather(k, i, slope));
            if by_rate != 0.0 {
                rates[k] = row.rate(q, v);
                row.for_each_bend(v, |i, bend| gather(2, i, first[k] * bend));
            }
        }
        let of_rows = [0, 1].map(|k| {
            let turned = second[k][0] * rates[0] + second[k][1] * rates[1];
            slopes.by_coordinate * first[k] + by_rate * turned
        });
        for &(j, [a, b, bend]) in &gathered.0 {
            let y = of_rows[0] * a + of_rows[1] * b + by_rate * bend;
            let [left, right] =
                [0, 1].map(|k| first[k] * y + effort * (second[k][0] * a + second[k][1] * b));
            for &(i, [a, b, _]) in &gathered.0 {
                out.add(i, j, left * a + right * b);
            }
        }
        for (row, factor) in rows.iter().zip(first) {
            if let Some(row) = row {
                row.emit_second(effort * factor, out);
            }
        }
    }

    /// Emits `a ∂²/∂q∂q + b ∂²/∂q∂v + c ∂²/∂v∂q + d ∂²/∂v∂v` of `(∇θ·z) τ(θ, ∇θ·v)`, rows of the
    /// first; without `v` of a `τ` of `θ` alone. Allocates.
    /// ```text
    /// g = ∇θ, b = D²θ z, u = D²θ v, α = g·z
    /// ∂_q∂_q   τ D³θ[z] + b (τ_θ g + τ_θ̇ u)ᵀ + (τ_θ g + τ_θ̇ u) bᵀ + α (τ_θ D²θ + τ_θ̇ D³θ[v])            [2.52]
    ///          + α [ τ_θθ g gᵀ + τ_θθ̇ (g uᵀ + u gᵀ) + τ_θ̇θ̇ u uᵀ ]
    /// ∂_q∂_v   τ_θ̇ (b gᵀ + α D²θ) + α (τ_θθ̇ g + τ_θ̇θ̇ u) gᵀ,     ∂_v∂_v   α τ_θ̇θ̇ g gᵀ
    /// ```
    pub fn emit_effort_bends(
        &self,
        [q, v, z]: [&[f64]; 3],
        (effort, slopes, bends): (f64, EffortSlopes, EffortBends),
        [qq, qv, vq, vv]: [f64; 4],
        out: &mut dyn Entries,
    ) {
        let EffortSlopes { by_coordinate: first, by_rate: damp } = slopes;
        let EffortBends { by_coordinate: second, mixed, by_rate } = bends;
        let along = self.rate(q, z); // α
        let mut vectors = Gathered::default(); // g, b, u
        self.for_each_slope(q, |i, own| vectors.add(0, i, own));
        self.for_each_bend(q, z, 1.0, |i, own| vectors.add(1, i, own));
        if !v.is_empty() {
            self.for_each_bend(q, v, 1.0, |i, own| vectors.add(2, i, own));
        }
        let both = qv + vq;
        let factors = [
            [
                along * (qq * second + both * mixed + vv * by_rate),
                qq * first + vq * damp,
                along * (qq * mixed + vq * by_rate),
            ],
            [qq * first + qv * damp, 0.0, qq * damp],
            [along * (qq * mixed + qv * by_rate), qq * damp, along * qq * by_rate],
        ];
        vectors.emit(&vectors, &factors, out);
        self.emit_third(q, z, qq * effort, out);
        if damp != 0.0 {
            self.emit_third(q, v, qq * along * damp, out);
        }
        self.emit_second(q, along * (qq * first + both * damp), out);
    }

    /// Emits `∂²/∂q_i∂q_j` of `φ (∇θ(q_n)·y_0 + ∇θ(q_{n+1})·y_1)` with an effort of a step
    /// `φ(θ(q_n), θ(q_{n+1}))`, its derivatives by the coordinates at the nodes `i` and `j`, and
    /// its second one by both. Allocates.
    pub(crate) fn emit_pair_bends(
        &self,
        s: &Interval,
        y: [&[f64]; 2],
        [i, j]: [Slot; 2],
        (effort, slopes, second): (f64, [f64; 2], f64),
        out: &mut dyn Entries,
    ) {
        let along = self.rate(&s.q0, y[0]) + self.rate(&s.q1, y[1]);
        let of = |node: Slot| match node {
            Slot::First => y[0],
            Slot::Second => y[1],
        };
        let [left, right] = [i, j].map(|node| {
            let mut vectors = Gathered::default(); // g, b
            self.for_each_slope(s.node(node), |i, own| vectors.add(0, i, own));
            self.for_each_bend(s.node(node), of(node), 1.0, |i, own| vectors.add(1, i, own));
            vectors
        });
        let factors = [[along * second, slopes[0], 0.0], [slopes[1], 0.0, 0.0], [0.0; 3]];
        left.emit(&right, &factors, out);
        if i == j {
            self.emit_third(s.node(i), of(i), effort, out);
            self.emit_second(s.node(i), along * slopes[0], out);
        }
    }

    /// Emits `scale D³θ(q)[z]`; always the same places in the same order.
    /// ```text
    /// Σ θ_klm (∇r_k·z) ∇r_l ∇r_mᵀ + Σ θ_kl [ D²r_k z ∇r_lᵀ + ∇r_l (D²r_k z)ᵀ + (∇r_k·z) D²r_l ]
    /// θ_klm = Im 2 iᵃ/(c + i s)³ of an angle, a: how many of k, l, m are s
    /// ```
    pub fn emit_third(&self, q: &[f64], z: &[f64], scale: f64, out: &mut dyn Entries) {
        let Value::Angle { sine, cosine } = &self.value else { return };
        let (_, _, second) = self.value.chain(q);
        let ([s, sine_rate], [c, cosine_rate]) =
            (sine.value_and_rate(q, z), cosine.value_and_rate(q, z));
        let square = s * s + c * c;
        let [real, imaginary] = [c * c * c - 3.0 * c * s * s, s * s * s - 3.0 * c * c * s]
            .map(|x| 2.0 * scale * x / (square * square * square));
        // Σ_k θ_klm ∇r_k·z of l, m: s, s; s, c; c, c
        let [same, mixed, other] = [
            -real * sine_rate - imaginary * cosine_rate,
            -imaginary * sine_rate + real * cosine_rate,
            real * sine_rate + imaginary * cosine_rate,
        ];
        let rows = [sine, cosine];
        for (l, m, factor) in [(0, 0, same), (1, 1, other), (0, 1, mixed), (1, 0, mixed)] {
            let bend = scale * second[l][m];
            rows[m].for_each_slope(q, |j, b| {
                rows[l].for_each_slope(q, |i, a| out.add(i, j, factor * a * b));
                rows[l].for_each_bend(z, |i, a| {
                    out.add(i, j, bend * a * b);
                    out.add(j, i, bend * a * b);
                });
            });
        }
        for l in 0..2 {
            let along = second[l][0] * sine_rate + second[l][1] * cosine_rate;
            rows[l].emit_second(scale * along, out);
        }
    }

    /// Emits `scale D²θ(q)`; always the same places in the same order.
    pub fn emit_second(&self, q: &[f64], scale: f64, out: &mut dyn Entries) {
        match &self.value {
            Value::Length(row) => row.emit_second(scale, out),
            Value::Angle { sine, cosine } => {
                let (_, first, [[same, mixed], _]) = self.value.chain(q);
                let pairs = [
                    (sine, sine, same),
                    (cosine, cosine, -same),
                    (sine, cosine, mixed),
                    (cosine, sine, mixed),
                ];
                for (left, right, factor) in pairs {
                    left.for_each_slope(q, |i, a| {
                        right.for_each_slope(q, |j, b| out.add(i, j, scale * factor * a * b));
                    });
                }
                sine.emit_second(scale * first[0], out);
                cosine.emit_second(scale * first[1], out);
            }
        }
    }
}
