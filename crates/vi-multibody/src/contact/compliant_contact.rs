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
use vi_core::Number;
use vi_core::force::{Force, NoTimeSlope};
use vi_core::num_dual::{Dual64, HyperDual64};
use vi_core::potential::Potential;
use vi_core::sparse::Entries;
use vi_rigid::directors::{FRAME, center, director};
use vi_rigid::gap::{ContactPoint, ContactShape, NoGap, Pair, is_smooth, lasting, smooth_contact};

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

/// Two shapes that touch with a compliance.
#[derive(Clone, Debug)]
pub struct CompliantContact {
    pair: Pair,
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
            true => Ok(Self { pair: Pair::new(a, b)?, frames, law }),
            false => Err(NoGap { a: a.name(), b: b.name() }),
        }
    }

    /// The shapes.
    #[must_use]
    pub fn pair(&self) -> &Pair {
        &self.pair
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

    /// The smallest of its gaps, m; `None` where the shapes have none.
    #[must_use]
    pub fn smallest_gap(&self, q: &[f64]) -> Option<f64> {
        let [a, b] = self.pair.shapes();
        lasting(a, b).map(|feature| self.gap(feature, q)).min_by(f64::total_cmp)
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
        let [a, b] = self.pair.shapes();
        let gaps = lasting(a, b).map(|feature| (feature, self.gap(feature, q)));
        gaps.filter(|(_, gap)| *gap < 0.0)
    }

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

    fn at<T: Number>(&self, feature: u32, frames: [[T; FRAME]; 2]) -> ContactPoint<T> {
        let [a, b] = self.pair.shapes();
        smooth_contact(feature, (a, &frames[0]), (b, &frames[1]))
    }

    /// `∇g` by its own coordinates.
    fn gradient(&self, feature: u32, q: &[f64]) -> [f64; BOTH] {
        std::array::from_fn(|k| {
            self.place(k).map_or(0.0, |_| self.at(feature, self.own(q, along(k))).gap.eps)
        })
    }

    /// The force on B in space of the potential, all other force, and the slip.
    fn force<T: Number>(
        &self,
        feature: u32,
        frames: [[T; FRAME]; 2],
        rates: [[T; FRAME]; 2],
    ) -> (Vector3<T>, Vector3<T>, T) {
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

    /// The overlaps of the features that touch, m.
    pub(super) fn depths<'a>(&'a self, q: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        self.closed(q).map(|(_, gap)| -gap)
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
    #[must_use]
    pub fn total_force_change(&self, by: &CompliantLaw, q: &[f64], v: &[f64]) -> Vector3<f64> {
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
        let [a, b] = self.pair.shapes();
        let gaps = lasting(a, b).map(|feature| (feature, self.gap(feature, q)));
        let Some((feature, _)) = gaps.min_by(|a, b| a.1.total_cmp(&b.1)) else { return };
        let slopes = self.gradient(feature, q);
        self.places().for_each(|(k, place)| out[place] += scale * slopes[k]);
    }

    /// `ϱ` of both bodies.
    fn arms<T: Number>(&self, feature: u32, frames: [[T; FRAME]; 2]) -> [Vector3<T>; 2] {
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
    ) -> Vector3<T> {
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
    ) -> [T; BOTH] {
        let (_, force, _) = self.force(feature, frames, rates);
        self.spread(feature, frames, force)
    }

    /// A force on B in space by its own coordinates.
    fn spread<T: Number>(
        &self,
        feature: u32,
        frames: [[T; FRAME]; 2],
        force: Vector3<T>,
    ) -> [T; BOTH] {
        let arms = self.arms(feature, frames);
        std::array::from_fn(|k| {
            let (side, i) = (k / FRAME, k % FRAME);
            let sign = T::of(if side == 0 { -1.0 } else { 1.0 });
            let arm = if i < 3 { T::of(1.0) } else { arms[side][i / 3 - 1] };
            sign * arm * force[i % 3]
        })
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

    /// Its own coordinates of bodies that move, with their places among all.
    fn places(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        (0..BOTH).filter_map(|k| Some((k, self.place(k)?)))
    }
}

/// The number `k` of those that vary along `j`.
fn along(j: usize) -> impl Fn(usize, f64) -> Dual64 {
    move |k, x| Dual64::new(x, f64::from(u8::from(k == j)))
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
                    let unit = |k: usize, of: usize| f64::from(u8::from(k == of));
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
    fn add(&self, _t: f64, q: &[f64], v: &[f64], scale: f64, out: &mut [f64]) {
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
        _t: f64,
        q: &[f64],
        v: &[f64],
        scale: f64,
        out: &mut dyn Entries,
    ) {
        let rates = self.rates(v, |_, x| Dual64::of(x));
        self.add_slopes(q, |j| [self.own(q, along(j)), rates], scale, out);
    }

    fn add_velocity_derivative(
        &self,
        _t: f64,
        q: &[f64],
        v: &[f64],
        scale: f64,
        out: &mut dyn Entries,
    ) {
        let frames = self.own(q, |_, x| Dual64::of(x));
        self.add_slopes(q, |j| [frames, self.rates(v, along(j))], scale, out);
    }

    fn add_time_derivative(
        &self,
        _t: f64,
        _q: &[f64],
        _v: &[f64],
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
mod tests {
    use super::super::compliant_change::CompliantChange;
    use super::*;
    use nalgebra::{DMatrix, Rotation3};
    use vi_core::force::MidpointForce;
    use vi_core::interval::Interval;
    use vi_testkit::slope_error;

    const LAW: CompliantLaw = CompliantLaw {
        stiffness: 40.0,
        exponent: 1.5,
        dissipation: 0.7,
        friction: Some((
            0.4,
            Stribeck { transition_velocity: 0.2, static_ratio: 1.3, stribeck_velocity: 0.5 },
        )),
    };

    fn body(at: [f64; 3], turned: [f64; 3]) -> Vec<f64> {
        let rotation = Rotation3::new(Vector3::from(turned)).into_inner();
        at.into_iter().chain(rotation.iter().copied()).collect()
    }

    /// Pairs of unlike shapes on two bodies that overlap a little, and on the ground.
    fn contacts() -> Vec<(&'static str, CompliantContact)> {
        let point = Vector3::new(0.1, 0.0, -0.2);
        let plane = ContactShape::Plane { point, normal: Vector3::new(0.0, 0.6, 0.8) };
        let capsule = |x: f64| ContactShape::Capsule {
            ends: [Vector3::new(-0.4 * x, 0.3, -0.5), Vector3::new(0.5, 0.2 * x, 0.4)],
            radius: 0.5,
        };
        let sphere = ContactShape::sphere(Vector3::new(0.05, -0.1, 0.0), 0.9);
        let axes = Rotation3::new(Vector3::new(0.3, 0.1, -0.2)).into_inner();
        let (center, half) = (Vector3::new(0.1, 0.0, 0.1), Vector3::new(0.3, 0.5, 0.4));
        let ellipsoid = ContactShape::Ellipsoid { center, axes, half_axes: 2.0 * half };
        let large = ContactShape::Box { center, axes, half_lengths: 2.0 * half };
        let block = ContactShape::Box { center, axes, half_lengths: half };
        let ends = [Vector3::new(0.0, 0.0, -0.4), Vector3::new(0.1, 0.0, 0.4)];
        let cylinder = ContactShape::Cylinder { ends, radius: 0.3 };
        let (a, b) = (FrameId::Frame(0), FrameId::Frame(1));
        let all = [
            ("plane of a body", [a, b], [plane.clone(), sphere.clone()]),
            ("plane of the ground", [FrameId::Ground, b], [plane.clone(), ellipsoid]),
            ("box on a plane", [a, b], [plane, large]),
            ("capsules", [a, b], [capsule(1.0), capsule(-1.0)]),
            ("sphere on a box", [a, b], [block, sphere.clone()]),
            ("cylinder, named last", [b, a], [sphere, cylinder]),
        ];
        let made = |(name, frames, shapes)| {
            (name, CompliantContact::new(frames, shapes, LAW).expect("a smooth pair"))
        };
        all.into_iter().map(made).collect()
    }

    fn step() -> Interval {
        let q0 =
            [body([0.1, 0.2, -0.3], [0.3, -0.5, 0.2]), body([0.3, 0.35, 0.4], [0.1, 0.2, 0.7])];
        let q1 =
            [body([0.12, 0.2, -0.28], [0.4, -0.5, 0.1]), body([0.3, 0.3, 0.37], [0.2, 0.1, 0.9])];
        Interval::between(0.4, 0.1, &q0.concat(), &q1.concat())
    }

    /// By the numbers of the law, against differences of it.
    #[test]
    fn changes_of_the_law_against_central_differences() {
        let s = step();
        let course =
            Stribeck { transition_velocity: 0.3, static_ratio: -0.2, stribeck_velocity: 0.4 };
        let by = CompliantLaw {
            stiffness: 7.0,
            exponent: 0.3,
            dissipation: -0.4,
            friction: Some((0.6, course)),
        };
        let moved = |e: f64| {
            let (mu, own) = LAW.friction.unwrap();
            let own = Stribeck {
                transition_velocity: own.transition_velocity + e * course.transition_velocity,
                static_ratio: own.static_ratio + e * course.static_ratio,
                stribeck_velocity: own.stribeck_velocity + e * course.stribeck_velocity,
            };
            CompliantLaw {
                stiffness: LAW.stiffness + e * by.stiffness,
                exponent: LAW.exponent + e * by.exponent,
                dissipation: LAW.dissipation + e * by.dissipation,
                friction: Some((mu + e * 0.6, own)),
            }
        };
        let mut worst = 0.0_f64;
        for (name, contact) in contacts() {
            let all = |own: &dyn Fn(&mut [f64]), value: f64| {
                let mut out = vec![0.0; 24];
                own(&mut out);
                out.push(value);
                out
            };
            let of = |e: f64, scale: f64| {
                let own = CompliantContact { law: moved(e), ..contact.clone() };
                let fill = |out: &mut [f64]| {
                    own.add_gradient(&s.q_mid, scale, out);
                    own.add(0.0, &s.q_mid, &s.v_mid, 1.0, out);
                };
                all(&fill, own.value(&s.q_mid))
            };
            let change = CompliantChange { contact: contact.clone(), by };
            for scale in [0.0, -1.0] {
                let fill = |out: &mut [f64]| {
                    change.add_gradient(&s.q_mid, scale, out);
                    change.add(0.0, &s.q_mid, &s.v_mid, 1.0, out);
                };
                let exact = all(&fill, change.value(&s.q_mid));
                let e = 1e-5;
                let (plus, minus) = (of(e, scale), of(-e, scale));
                let size = exact.iter().fold(1.0, |size: f64, x| size.max(x.abs()));
                for (own, (plus, minus)) in exact.iter().zip(plus.iter().zip(&minus)) {
                    let off = ((plus - minus) / (2.0 * e) - own).abs() / size;
                    worst = worst.max(off);
                    assert!(off < 1e-8, "{name}: off by {off:e}");
                }
            }
            let mut hessian = DMatrix::zeros(24, 24);
            change.add_hessian(&s.q_mid, 1.0, &mut hessian);
            let at = |e: f64| {
                let own = CompliantContact { law: moved(e), ..contact.clone() };
                let mut out = DMatrix::zeros(24, 24);
                own.add_hessian(&s.q_mid, 1.0, &mut out);
                out
            };
            let e = 1e-5;
            let other = (at(e) - at(-e)) / (2.0 * e);
            let off = (&other - &hessian).amax() / other.amax();
            assert!(off < 1e-7, "{name}, stiffness: off by {off:e}");
        }
        println!("changes off by {worst:.1e}");
    }

    #[test]
    fn derivatives_against_central_differences() {
        let s = step();
        for (name, contact) in contacts() {
            assert!(contact.closed(&s.q_mid).next().is_some(), "{name} touches");
            let error = slope_error(&MidpointForce(contact.clone()), &s);
            let (mut hessian, e) = (DMatrix::zeros(24, 24), 1e-6);
            contact.add_hessian(&s.q_mid, 1.0, &mut hessian);
            let gradient = |q: &[f64]| {
                let mut out = vec![0.0; 24];
                contact.add_gradient(q, 1.0, &mut out);
                out
            };
            let (mut first, mut second) = (0.0_f64, 0.0_f64);
            for j in 0..24 {
                let moved = |by: f64| {
                    let mut q = s.q_mid.clone();
                    q[j] += by;
                    q
                };
                let (plus, minus) = (moved(e), moved(-e));
                let slope = (contact.value(&plus) - contact.value(&minus)) / (2.0 * e);
                first = first.max((slope - gradient(&s.q_mid)[j]).abs());
                let (plus, minus) = (gradient(&plus), gradient(&minus));
                for i in 0..24 {
                    let bend = (plus[i] - minus[i]) / (2.0 * e);
                    second = second.max((bend - hessian[(i, j)]).abs());
                }
            }
            println!("{name}: force {error:.1e}, gradient {first:.1e}, Hessian {second:.1e}");
            assert!(error < 1e-6 && first < 1e-7 && second < 1e-6);
        }
    }

    /// Forces of a step sum up to nothing, and so do their moments about the origin, however far
    /// the bodies turn in it.
    #[test]
    fn both_bodies_take_opposite_wrenches() {
        let s = step();
        for (name, contact) in contacts().into_iter().filter(|(_, own)| own.place(0).is_some()) {
            let mut of = [vec![0.0; 24], vec![0.0; 24]];
            contact.add_gradient(&s.q_mid, 1.0, &mut of[0]);
            contact.add(0.0, &s.q_mid, &s.v_mid, 1.0, &mut of[1]);
            for f in of {
                let at = |x: &[f64], k: usize| Vector3::new(x[k], x[k + 1], x[k + 2]);
                let force = at(&f, 0) + at(&f, FRAME);
                let triples = (0..24).step_by(3);
                let moment: Vector3<f64> = triples.map(|k| at(&s.q_mid, k).cross(&at(&f, k))).sum();
                let size = f.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
                assert!(size > 1e-3, "{name}");
                assert!(
                    force.norm().max(moment.norm()) < 1e-14 * size.max(1.0),
                    "{name}: {force} {moment}"
                );
            }
        }
    }

    #[test]
    fn what_is_apart_feels_nothing_and_nothing_pulls() {
        let (_, contact) = contacts().swap_remove(0);
        let mut apart = step().q_mid;
        apart[FRAME + 2] += 9.0;
        assert!(
            contact.closed(&apart).next().is_none()
                && contact.value(&apart).to_bits() == 0.0_f64.to_bits()
        );
        let (q, mut v) = (step().q_mid, vec![0.0; 24]);
        v[FRAME + 2] = 50.0; // it leaves faster than 1/c
        let left = contact.forces(&q, &v).map(|own| own.force.norm());
        assert_eq!(left.collect::<Vec<_>>(), [0.0]);
        v[FRAME + 2] = 0.0;
        let pressed = contact.forces(&q, &v).next().unwrap();
        assert!(pressed.force.dot(&pressed.at.normal) > 0.1 && pressed.at.gap < 0.0);
    }

    #[test]
    fn pairs_with_edges_are_refused() {
        let block = |x: f64| ContactShape::Box {
            center: Vector3::repeat(x),
            axes: Matrix3::identity(),
            half_lengths: Vector3::repeat(1.0),
        };
        let ends = [Vector3::zeros(), Vector3::z()];
        let cylinder = ContactShape::Cylinder { ends, radius: 1.0 };
        let plane = ContactShape::Plane { point: Vector3::zeros(), normal: Vector3::z() };
        let corners = ContactShape::Points { points: ends.to_vec(), radius: 0.0 };
        for shapes in [[block(0.0), block(1.0)], [plane, cylinder], [corners, block(2.0)]] {
            let frames = [FrameId::Ground, FrameId::Frame(0)];
            assert!(CompliantContact::new(frames, shapes, LAW).is_err());
        }
    }
}
