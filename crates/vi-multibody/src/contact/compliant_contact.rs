//! Contact of two shapes by a force that grows with their overlap.
//!
//! ```text
//! δ = −g(q) > 0,   F_N = k δ^p max(0, 1 + c δ̇)
//! potential   V = k δ^{p+1}/(p + 1)
//! force       f = F_D n + F_T,   F_D = k δ^p max(−1, c δ̇),   F_T = −μ F_N χ(|v_T|) v_T/|v_T|
//! on B        (f, ϱ_I f),   on A the opposite,   ϱ = D⁻¹ (x_c − φ)
//! ```
//! Letters: `g` gap, `n` normal from A to B, `x_c` the middle of the closest points, `v` the
//! velocity of B there relative to A, `v_T` its part across the normal, `δ̇ = −n·v`, `D` the
//! directors in columns, `χ` of [`Stribeck`]. At a midpoint `D` is averaged and not orthonormal;
//! `ϱ_I d_I = x_c − φ` holds all the same, so that both bodies take opposite wrenches at one point
//! and momentum maps are exact. `V` is a function of the gap, whose derivatives follow from the
//! formulas of the gap in dual numbers; so do those of the force.
//!
//! Steps are to resolve the contact: a twentieth of its time or less. A body of mass `m` that hits
//! with the velocity `v` leaves with `e v`, whatever `k` and `p` are:
//! ```text
//! c v − ln(1 + c v) = −c e v − ln(1 − c e v),   e ≈ 1 − ⅔ c v
//! ```
//!
//! Source: K. H. Hunt, F. R. E. Crossley, J. Appl. Mech. 42 (1975) 440.

use super::shape_contact::frame;
use crate::force::stribeck::{Stribeck, lifted};
use crate::pair::joint::FrameId;
use nalgebra::{Matrix3, Vector3};
use vi_core::force::{Force, NoTimeSlope};
use vi_core::num_dual::{Dual64, HyperDual64, HyperHyperDual64};
use vi_core::potential::Potential;
use vi_core::sparse::Entries;
use vi_core::{Embed, Motion, Number};
use vi_rigid::directors::{FRAME, center, director};
use vi_rigid::gap::{
    ContactPoint, ContactShape, NoGap, ShapePair, is_smooth, lasting, smooth_contact,
};

const BOTH: usize = 2 * FRAME;

/// The law of a compliant contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CompliantLaw {
    /// `k`, N/m^p.
    pub stiffness: f64,
    /// `p`, 1 or more; 1.5 of two spheres after Hertz.
    pub exponent: f64,
    /// `c`, s/m.
    pub dissipation: f64,
    /// `μ` with the course of friction; none without friction.
    pub friction: Option<(f64, Stribeck)>,
}

impl CompliantLaw {
    /// `k δ^p` and its slope of an overlap.
    fn elastic(&self, depth: f64) -> [f64; 2] {
        let Self { stiffness, exponent: p, .. } = *self;
        [stiffness * libm::pow(depth, p), stiffness * p * libm::pow(depth, p - 1.0)]
    }

    /// The same as the numbers of the law change by those of `by`.
    /// ```text
    /// (k δ^p)_θ = (k_θ + k ln δ p_θ) δ^p
    /// ```
    pub(super) fn elastic_change(&self, by: &Self, depth: f64) -> [f64; 2] {
        let Self { stiffness: k, exponent: p, .. } = *self;
        let factor = by.stiffness + k * libm::log(depth) * by.exponent;
        let (power, less) = (libm::pow(depth, p), libm::pow(depth, p - 1.0));
        [factor * power, (factor * p + k * by.exponent) * less]
    }

    /// `V_θ`.
    pub(super) fn energy_change(&self, by: &Self, depth: f64) -> f64 {
        let (k, p) = (self.stiffness, self.exponent + 1.0);
        let factor = by.stiffness + k * by.exponent * (libm::log(depth) - 1.0 / p);
        factor * libm::pow(depth, p) / p
    }
}

/// Two shapes that touch with a compliance; with dual numbers they have their derivatives by a
/// parameter beside them.
#[derive(Clone, Debug)]
pub struct CompliantContact<S = f64> {
    pair: ShapePair<S>,
    frames: [FrameId; 2],
    law: CompliantLaw,
}

/// What a contact does at a feature that touches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CompliantForce {
    /// The feature.
    pub feature: u32,
    /// Where it acts.
    pub at: ContactPoint,
    /// The force on B in space, N.
    pub force: Vector3<f64>,
    /// `|v_T|`, m/s.
    pub slip: f64,
}

impl CompliantContact {
    /// Of a shape on the first frame with one on the second; no part of a shape is an edge that
    /// could meet an edge.
    ///
    /// # Errors
    /// [`NoGap`] of boxes, cylinders and capsules with edges that meet edges, of corners with
    /// boxes, of cylinders on planes, and where there is no formula.
    pub fn new(
        frames: [FrameId; 2],
        [a, b]: [ContactShape; 2],
        law: CompliantLaw,
    ) -> Result<Self, NoGap> {
        match is_smooth(&a, &b) {
            true => Ok(Self { pair: ShapePair::new(a, b)?, frames, law }),
            false => Err(NoGap { a: a.name(), b: b.name() }),
        }
    }

    /// The shapes.
    #[must_use]
    pub fn pair(&self) -> &ShapePair {
        &self.pair
    }

    /// The same with derivatives of the shapes; `None` of shapes of another kind.
    #[must_use]
    pub fn with_tangent(
        &self,
        shapes: [ContactShape<Dual64>; 2],
    ) -> Option<CompliantContact<Dual64>> {
        let Self { pair, frames, law } = self;
        Some(CompliantContact { pair: ShapePair::alike(pair, shapes)?, frames: *frames, law: *law })
    }

    /// Its law.
    #[must_use]
    pub fn law(&self) -> &CompliantLaw {
        &self.law
    }

    /// `g` of a feature, m.
    #[must_use]
    pub fn gap(&self, feature: u32, q: &[f64]) -> f64 {
        self.at(feature, self.own(q, |_, x| x)).gap
    }

    /// The change of the smallest of its gaps with the shapes; 0 where they have none.
    pub(super) fn smallest_gap_change(&self, by: &CompliantContact<Dual64>, q: &[f64]) -> f64 {
        self.nearest(q).map_or(0.0, |(feature, _)| by.gap_by_shape(feature, q))
    }

    /// The smallest of its gaps, m; `None` where the shapes have none.
    #[must_use]
    pub fn smallest_gap(&self, q: &[f64]) -> Option<f64> {
        self.nearest(q).map(|(_, gap)| gap)
    }

    /// The features that touch.
    pub fn touching<'a>(&'a self, q: &'a [f64]) -> impl Iterator<Item = u32> + 'a {
        self.closed(q).map(|(feature, _)| feature)
    }

    /// What the features that touch do.
    pub fn forces<'a>(
        &'a self,
        q: &'a [f64],
        v: &'a [f64],
    ) -> impl Iterator<Item = CompliantForce> + 'a {
        self.closed(q).map(move |(feature, _)| {
            let frames = self.own(q, |_, x| x);
            let at = self.at(feature, frames);
            let (elastic, other, slip) = self.force(feature, frames, self.rates(v, |_, x| x));
            CompliantForce { feature, at, force: elastic + other, slip }
        })
    }

    /// Whether it dissipates energy.
    #[must_use]
    pub fn is_dissipative(&self) -> bool {
        self.law.dissipation > 0.0 || self.law.friction.is_some_and(|(mu, _)| mu > 0.0)
    }

    /// The features that touch, with their gaps.
    fn closed<'a>(&'a self, q: &'a [f64]) -> impl Iterator<Item = (u32, f64)> + 'a {
        self.gaps(q).filter(|(_, gap)| *gap < 0.0)
    }

    /// All features with their gaps.
    fn gaps<'a>(&'a self, q: &'a [f64]) -> impl Iterator<Item = (u32, f64)> + 'a {
        let [a, b] = self.pair.shapes();
        lasting(a, b).map(|feature| (feature, self.gap(feature, q)))
    }

    /// The feature with the smallest gap.
    fn nearest(&self, q: &[f64]) -> Option<(u32, f64)> {
        self.gaps(q).min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// `∇g` by its own coordinates.
    fn gradient(&self, feature: u32, q: &[f64]) -> [f64; BOTH] {
        std::array::from_fn(|k| {
            self.place(k).map_or(0.0, |_| self.at(feature, self.own(q, along(k))).gap.eps)
        })
    }

    /// The overlaps of the features that touch, m, with the features.
    pub(super) fn depths<'a>(&'a self, q: &'a [f64]) -> impl Iterator<Item = (u32, f64)> + 'a {
        self.closed(q).map(|(feature, gap)| (feature, -gap))
    }

    /// `out ← out + scale f_θ`, the change of the force without the potential with the numbers of
    /// the law.
    pub(super) fn add_force_change(
        &self,
        by: &CompliantLaw,
        [q, v]: [&[f64]; 2],
        scale: f64,
        out: &mut [f64],
    ) {
        let frames = self.own(q, |_, x| x);
        for (feature, gap) in self.closed(q) {
            let [_, force] = self.changed(by, (feature, gap), [q, v]);
            for (k, own) in self.spread(feature, frames, force).into_iter().enumerate() {
                if let Some(place) = self.place(k) {
                    out[place] += scale * own;
                }
            }
        }
    }

    /// The changes of the force of the potential and of all other force on B in space.
    fn changed(
        &self,
        by: &CompliantLaw,
        (feature, gap): (u32, f64),
        [q, v]: [&[f64]; 2],
    ) -> [Vector3<f64>; 2] {
        let CompliantLaw { dissipation, friction, .. } = self.law;
        let (frames, rates) = (self.own(q, |_, x| x), self.rates(v, |_, x| x));
        let normal = self.at(feature, frames).normal;
        let elastic = self.law.elastic(-gap)[0];
        let changed = self.law.elastic_change(by, -gap)[0];
        let v = self.relative(feature, frames, rates);
        let approach = -normal.dot(&v);
        let damped = (approach * dissipation).max(-1.0);
        let faster = if damped > -1.0 { approach * by.dissipation } else { 0.0 };
        let damping = changed * damped + elastic * faster; // F_D,θ
        let mut force = normal * damping;
        if let (Some((mu, course)), Some((by_mu, by_course))) = (friction, by.friction) {
            let across = v - normal * (normal.dot(&v) / normal.norm_squared());
            let slip = across.norm();
            let pressed = elastic + elastic * damped; // F_N
            let limit = by_mu * pressed + mu * (changed + damping);
            let turned = course.change_over_velocity(&by_course, slip);
            force -= across * (limit * course.over_velocity(slip) + mu * pressed * turned);
        }
        [normal * changed, force]
    }

    /// The force on B in space, N.
    #[must_use]
    pub fn total_force(&self, q: &[f64], v: &[f64]) -> Vector3<f64> {
        self.forces(q, v).map(|own| own.force).sum()
    }

    /// Its change with the numbers of the law.
    pub(super) fn total_force_change(
        &self,
        by: &CompliantLaw,
        q: &[f64],
        v: &[f64],
    ) -> Vector3<f64> {
        self.closed(q).map(|own| self.changed(by, own, [q, v]).iter().sum::<Vector3<f64>>()).sum()
    }

    /// Adds `∂/∂q` and `∂/∂v` of the component of [`CompliantContact::total_force`] along a vector,
    /// shape `n` each.
    pub fn add_force_slopes(
        &self,
        [q, v]: [&[f64]; 2],
        direction: &Vector3<f64>,
        [by_q, by_v]: [&mut [f64]; 2],
    ) {
        let still = (self.own(q, |_, x| Dual64::of(x)), self.rates(v, |_, x| Dual64::of(x)));
        for (feature, _) in self.closed(q) {
            let component = |frames, rates| {
                let (elastic, other, _) = self.force(feature, frames, rates);
                (elastic + other).map(|own: Dual64| own.eps).dot(direction)
            };
            for (k, place) in self.places() {
                by_q[place] += component(self.own(q, along(k)), still.1);
                by_v[place] += component(still.0, self.rates(v, along(k)));
            }
        }
    }

    /// `out ← out + scale` times the gradient of [`CompliantContact::smallest_gap`], that of the
    /// feature that has it.
    pub fn add_gap_slope(&self, q: &[f64], scale: f64, out: &mut [f64]) {
        let Some((feature, _)) = self.nearest(q) else { return };
        let slopes = self.gradient(feature, q);
        self.places().for_each(|(k, place)| out[place] += scale * slopes[k]);
    }

    /// Emits the sum over the features that touch of blocks of its own coordinates, column by
    /// column.
    fn add_blocks(
        &self,
        q: &[f64],
        add: impl Fn(u32, f64, &mut [[f64; BOTH]; BOTH]),
        scale: f64,
        out: &mut dyn Entries,
    ) {
        let mut block = [[0.0; BOTH]; BOTH];
        self.closed(q).for_each(|(feature, gap)| add(feature, gap, &mut block));
        for (j, column) in self.places() {
            for (i, row) in self.places() {
                out.add(row, column, scale * block[j][i]);
            }
        }
    }

    /// The same of the derivatives of its forces by what `seeds` makes of the number of a column.
    fn add_slopes(
        &self,
        q: &[f64],
        seeds: impl Fn(usize) -> [[[Dual64; FRAME]; 2]; 2],
        scale: f64,
        out: &mut dyn Entries,
    ) {
        let add = |feature: u32, _: f64, block: &mut [[f64; BOTH]; BOTH]| {
            for (j, _) in self.places() {
                let [frames, rates] = seeds(j);
                let own = self.generalized(feature, frames, rates);
                block[j].iter_mut().zip(own).for_each(|(sum, own)| *sum += own.eps);
            }
        };
        self.add_blocks(q, add, scale, out);
    }
}

/// What shapes of any numbers do.
impl<S: Number> CompliantContact<S> {
    /// Where its own coordinate `k` stands among all; the second frame follows the first one.
    fn place(&self, k: usize) -> Option<usize> {
        match self.frames[k / FRAME] {
            FrameId::Ground => None,
            FrameId::Frame(body) => Some(FRAME * body + k % FRAME),
        }
    }

    /// Both frames, each number of a body that moves by `number`, which is told its place.
    fn own<T: Number>(&self, q: &[f64], number: impl Fn(usize, f64) -> T) -> [[T; FRAME]; 2] {
        [0, 1].map(|side| {
            let own = frame(self.frames[side], q);
            std::array::from_fn(|i| match self.frames[side] {
                FrameId::Ground => T::of(own[i]),
                FrameId::Frame(_) => number(FRAME * side + i, own[i]),
            })
        })
    }

    /// The same of velocities; the ground rests.
    fn rates<T: Number>(&self, v: &[f64], number: impl Fn(usize, f64) -> T) -> [[T; FRAME]; 2] {
        [0, 1].map(|side| match self.frames[side] {
            FrameId::Ground => [T::of(0.0); FRAME],
            FrameId::Frame(body) => {
                std::array::from_fn(|i| number(FRAME * side + i, v[FRAME * body + i]))
            }
        })
    }

    fn at<T: Number>(&self, feature: u32, frames: [[T; FRAME]; 2]) -> ContactPoint<T>
    where
        S: Embed<T>,
    {
        let [a, b] = self.pair.shapes();
        smooth_contact(feature, a, &frames[0], b, &frames[1])
    }

    /// The force on B in space of the potential, all other force, and the slip.
    fn force<T: Number>(
        &self,
        feature: u32,
        frames: [[T; FRAME]; 2],
        rates: [[T; FRAME]; 2],
    ) -> (Vector3<T>, Vector3<T>, T)
    where
        S: Embed<T>,
    {
        let CompliantLaw { dissipation, friction, .. } = self.law;
        let ContactPoint { gap, normal, .. } = self.at(feature, frames);
        let [value, slope] = self.law.elastic(-Number::real(gap));
        let elastic = lifted(gap, value, -slope);
        let v = self.relative(feature, frames, rates);
        let approach = -normal.dot(&v);
        let damping = elastic * (approach * T::of(dissipation)).max(T::of(-1.0)); // F_D
        let across = v - normal * (normal.dot(&v) / normal.norm_squared());
        let square = across.norm_squared();
        let slip = if Number::real(square) > 0.0 { square.sqrt() } else { T::of(0.0) };
        let mut force = normal * damping;
        if let Some((mu, course)) = friction {
            let pressed = elastic + damping; // F_N
            force -= across * (pressed * T::of(mu) * course.over_velocity(slip)); // F_T
        }
        (normal * elastic, force, slip)
    }

    /// `ϱ` of both bodies.
    fn arms<T: Number>(&self, feature: u32, frames: [[T; FRAME]; 2]) -> [Vector3<T>; 2]
    where
        S: Embed<T>,
    {
        let point = self.at(feature, frames).point;
        frames.map(|own| {
            let directors = Matrix3::from_columns(&[0, 1, 2].map(|i| director(&own, i)));
            let arm = point - center(&own);
            directors.try_inverse().map_or_else(|| directors.tr_mul(&arm), |inverse| inverse * arm)
        })
    }

    /// `v`.
    fn relative<T: Number>(
        &self,
        feature: u32,
        frames: [[T; FRAME]; 2],
        rates: [[T; FRAME]; 2],
    ) -> Vector3<T>
    where
        S: Embed<T>,
    {
        let arms = self.arms(feature, frames);
        let [a, b] = [0, 1].map(|side| {
            let turn = |i: usize| director(&rates[side], i) * arms[side][i];
            center(&rates[side]) + turn(0) + turn(1) + turn(2)
        });
        b - a
    }

    /// The force without the potential by its own coordinates.
    fn generalized<T: Number>(
        &self,
        feature: u32,
        frames: [[T; FRAME]; 2],
        rates: [[T; FRAME]; 2],
    ) -> [T; BOTH]
    where
        S: Embed<T>,
    {
        let (_, force, _) = self.force(feature, frames, rates);
        self.spread(feature, frames, force)
    }

    /// A force on B in space by its own coordinates.
    fn spread<T: Number>(
        &self,
        feature: u32,
        frames: [[T; FRAME]; 2],
        force: Vector3<T>,
    ) -> [T; BOTH]
    where
        S: Embed<T>,
    {
        let arms = self.arms(feature, frames);
        std::array::from_fn(|k| {
            let (side, i) = (k / FRAME, k % FRAME);
            let sign = T::of(if side == 0 { -1.0 } else { 1.0 });
            let arm = if i < 3 { T::of(1.0) } else { arms[side][i / 3 - 1] };
            sign * arm * force[i % 3]
        })
    }

    /// Its own coordinates of bodies that move, with their places among all.
    fn places(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        (0..BOTH).filter_map(|k| Some((k, self.place(k)?)))
    }

    /// `V` of a gap.
    fn energy<T: Number>(&self, gap: T) -> T {
        let CompliantLaw { stiffness, exponent, .. } = self.law;
        let power = exponent + 1.0;
        (-gap).powf(T::of(power)) * T::of(stiffness / power)
    }
}

/// What changes with the shapes, at features that touch.
impl CompliantContact<Dual64> {
    /// `g_θ` of a feature.
    pub(super) fn gap_by_shape(&self, feature: u32, q: &[f64]) -> f64 {
        self.at(feature, self.own(q, |_, x| Dual64::of(x))).gap.eps
    }

    /// `V_θ` of a feature.
    pub(super) fn energy_by_shape(&self, feature: u32, q: &[f64]) -> f64 {
        self.energy(self.at(feature, self.own(q, |_, x| Dual64::of(x))).gap).eps
    }

    /// `out ← out + scale (∇V)_θ` of a feature.
    pub(super) fn add_gradient_by_shape(
        &self,
        feature: u32,
        q: &[f64],
        scale: f64,
        out: &mut [f64],
    ) {
        for (k, place) in self.places() {
            let seed = |i, x| HyperDual64::new(x, unit(i, k), 0.0, 0.0);
            out[place] += scale * self.energy(self.at(feature, self.own(q, seed)).gap).eps1eps2;
        }
    }

    /// Emits `scale (∇²V)_θ` of a feature.
    pub(super) fn add_hessian_by_shape(
        &self,
        feature: u32,
        q: &[f64],
        scale: f64,
        out: &mut dyn Entries,
    ) {
        for (j, column) in self.places() {
            for (i, row) in self.places() {
                let seed = |k, x| {
                    let zero = 0.0;
                    HyperHyperDual64::new(x, unit(k, i), unit(k, j), zero, zero, zero, zero, zero)
                };
                let energy = self.energy(self.at(feature, self.own(q, seed)).gap);
                out.add(row, column, scale * energy.eps1eps2eps3);
            }
        }
    }

    /// `out ← out + scale f_θ` of the force without the potential.
    pub(super) fn add_force_by_shape(
        &self,
        feature: u32,
        [q, v]: [&[f64]; 2],
        scale: f64,
        out: &mut [f64],
    ) {
        let frames = self.own(q, |_, x| Dual64::of(x));
        let own = self.generalized(feature, frames, self.rates(v, |_, x| Dual64::of(x)));
        for (k, place) in self.places() {
            out[place] += scale * own[k].eps;
        }
    }

    /// `F_θ` on B in space of a feature.
    pub(super) fn total_force_by_shape(&self, feature: u32, q: &[f64], v: &[f64]) -> Vector3<f64> {
        let frames = self.own(q, |_, x| Dual64::of(x));
        let rates = self.rates(v, |_, x| Dual64::of(x));
        let (elastic, other, _) = self.force(feature, frames, rates);
        (elastic + other).map(|own: Dual64| own.eps)
    }
}

/// The number `k` of those that vary along `j`.
fn along(j: usize) -> impl Fn(usize, f64) -> Dual64 {
    move |k, x| Dual64::new(x, unit(k, j))
}

/// 1 of the same number, else 0.
fn unit(k: usize, of: usize) -> f64 {
    f64::from(u8::from(k == of))
}

impl Potential for CompliantContact {
    fn value(&self, q: &[f64]) -> f64 {
        let CompliantLaw { stiffness, exponent, .. } = self.law;
        let energy = |gap: f64| stiffness * libm::pow(-gap, exponent + 1.0) / (exponent + 1.0);
        self.closed(q).fold(0.0, |sum, (_, gap)| sum + energy(gap))
    }

    fn add_gradient(&self, q: &[f64], scale: f64, out: &mut [f64]) {
        self.add_gradient_by(q, |depth| self.law.elastic(depth)[0], scale, out);
    }

    fn add_hessian(&self, q: &[f64], scale: f64, out: &mut dyn Entries) {
        self.add_hessian_by(q, |depth| self.law.elastic(depth), scale, out);
    }
}

impl CompliantContact {
    /// `out ← out + scale ∇V` by the force of an overlap.
    pub(super) fn add_gradient_by(
        &self,
        q: &[f64],
        force: impl Fn(f64) -> f64,
        scale: f64,
        out: &mut [f64],
    ) {
        for (feature, gap) in self.closed(q) {
            let force = scale * force(-gap);
            for (k, slope) in self.gradient(feature, q).into_iter().enumerate() {
                if let Some(place) = self.place(k) {
                    out[place] -= force * slope;
                }
            }
        }
    }

    /// Emits `scale ∇²V` by the force of an overlap and its slope.
    pub(super) fn add_hessian_by(
        &self,
        q: &[f64],
        elastic: impl Fn(f64) -> [f64; 2],
        scale: f64,
        out: &mut dyn Entries,
    ) {
        let add = |feature: u32, gap: f64, block: &mut [[f64; BOTH]; BOTH]| {
            let [force, slope] = elastic(-gap);
            let first = self.gradient(feature, q);
            for (j, _) in self.places() {
                for (i, _) in self.places().take_while(|(i, _)| *i <= j) {
                    let seed = |k, x| HyperDual64::new(x, unit(k, i), unit(k, j), 0.0);
                    let bend = self.at(feature, self.own(q, seed)).gap.eps1eps2;
                    block[j][i] += slope * first[i] * first[j] - force * bend;
                    block[i][j] = block[j][i];
                }
            }
        };
        self.add_blocks(q, add, scale, out);
    }
}

/// What takes energy out: the damping and the friction.
impl Force for CompliantContact {
    fn add(&self, Motion { q, v, .. }: Motion<'_>, scale: f64, out: &mut [f64]) {
        for (feature, _) in self.closed(q) {
            let own = self.generalized(feature, self.own(q, |_, x| x), self.rates(v, |_, x| x));
            for (k, force) in own.into_iter().enumerate() {
                if let Some(place) = self.place(k) {
                    out[place] += scale * force;
                }
            }
        }
    }

    fn add_position_derivative(
        &self,
        Motion { q, v, .. }: Motion<'_>,
        scale: f64,
        out: &mut dyn Entries,
    ) {
        let rates = self.rates(v, |_, x| Dual64::of(x));
        self.add_slopes(q, |j| [self.own(q, along(j)), rates], scale, out);
    }

    fn add_velocity_derivative(
        &self,
        Motion { q, v, .. }: Motion<'_>,
        scale: f64,
        out: &mut dyn Entries,
    ) {
        let frames = self.own(q, |_, x| Dual64::of(x));
        self.add_slopes(q, |j| [frames, self.rates(v, along(j))], scale, out);
    }

    fn add_time_derivative(
        &self,
        _at: Motion<'_>,
        _scale: f64,
        _out: &mut [f64],
    ) -> Result<(), NoTimeSlope> {
        Ok(())
    }

    fn acts_from_ground(&self) -> bool {
        self.frames.contains(&FrameId::Ground)
    }

    fn is_dissipative(&self) -> bool {
        self.is_dissipative()
    }
}

#[cfg(test)]
mod tests;
