//! Elements by the numbers of their sections, their lengths and the places of their nodes.
//!
//! ```text
//! b_θ = (−h D_1(U_d − K_d) + f_d^-)_θ = Σ_e (ℓ Σ_i n_i ∇ε_i(x_n))_θ        at fixed q_n, q_{n+1}, z_n
//! n = −h [C (½ ε̄ + μ Δε) + T Δε] − (½ + θ) V Δε − ½ h C φ(Δε, z)
//! ε_0θ   of the strains as drawn, with ℓ_θ and with the nodes as drawn, x_θ
//! M_θ    of the interpolation
//! μ_θ = −(1/ω²)_θ/h²,   (ω²)_θ = d/dθ xᵀ(K − ω² M) x                       x: of the highest vibration, xᵀMx = 1
//! ```
//! Strains of order 4 condense the stiffness, so `ε` and `∇ε` change with it as well: the formulas
//! of the step are evaluated with dual numbers, also in `ℓ`. Vibrations are those of nodes that
//! turn as they are drawn: `x = P(q_θ) ν` at fixed `ν`. `xᵀKx` is twice the energy of the element
//! along `x`, differentiated with three derivatives at once [2.64].
#![allow(non_snake_case)] // C, V, M, K, S, N

use crate::averaged::{
    AveragedStrains, MASS_SCALING, mean_and_change, resultants, scaling, tension_mass,
};
use crate::damping;
use crate::dissipation::StrainDissipation;
use crate::element::{Element, ElementKind, measures, strain_at, without_extension};
use crate::following::{FollowedBound, begin_change};
use crate::frequency::{Frequencies, Highest};
use crate::helicoidal::{self, Helicoidal};
use crate::interpolated::row;
use crate::model::{BeamElements, StrainRule};
use crate::rest::Rest;
use crate::section::Section;
use crate::small::times;
use crate::strain::{self, ElementCoordinates, Strain};
use crate::varying::{MassPoint, SectionPoint, mass_along};
use nalgebra::{Matrix3, Matrix4, Matrix6, SMatrix, Vector3, Vector6};
use std::collections::BTreeMap;
use vi_core::interpolation::StepPolynomial;
use vi_core::interval::{Interval, Slot};
use vi_core::num_dual::{Dual64, HyperHyperDual64};
use vi_core::potential::DiscretePotential;
use vi_core::{Configuration, Quadrature};
use vi_multibody::design::StepTangent;

/// Part of `ω²` by which vibrations are the highest together, and of its change by which they
/// change alike.
const TOGETHER: f64 = 1e-7;

/// How the numbers of an element change.
#[derive(Clone, Debug)]
pub struct ElementChange {
    /// Which element.
    pub element: usize,
    /// Sections along it with their derivatives; where it does not change along the element, one.
    pub sections: Vec<SectionPoint<Dual64>>,
    /// Where it is free of stress, and how that changes.
    pub rest: Option<Rest<Dual64>>,
    /// Of a stated bound of its tension, N.
    pub bound: f64,
    /// Of its stress-free length, m.
    pub length: f64,
}

/// A derivative that is not available.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ElementDesignError {
    /// Several vibrations are the highest of an element, and change differently.
    #[error(
        "two vibrations of element {element} have the same highest frequency and change \
         differently: the mass that selective mass scaling adds has a kink"
    )]
    Kink {
        /// Which element.
        element: usize,
    },
    /// The nodes of an element are not one frame and the next.
    #[error("the nodes of element {element} are not neighbours")]
    Apart {
        /// Which element.
        element: usize,
    },
    /// The stiffness of an element cannot be condensed.
    #[error("the stiffness of element {element} cannot be condensed")]
    Stiffness {
        /// Which element.
        element: usize,
    },
}

/// An element with the derivatives of its numbers.
#[derive(Clone, Debug)]
pub(crate) struct Changed {
    index: usize,
    element: Element,
    pub(crate) length: Dual64,
    pub(crate) law: Option<Helicoidal<Dual64>>, // None: mean directors
    pub(crate) stiffness: Matrix6<Dual64>,
    viscosity: Matrix6<Dual64>,
    reference: Vector6<Dual64>,
    pub(crate) mass: Matrix4<Dual64>,       // m, of a mean section
    pub(crate) compliance: Matrix6<Dual64>, // C⁻¹ of it
    slowness: Dual64,                       // 1/ω²
    bound: f64,
}

/// How a step takes strains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepRule {
    /// Of strains over a step.
    pub strains: StrainRule,
    /// Of [`StrainRule::Midpoint`].
    pub quadrature: Quadrature,
    /// The longest step, s.
    pub longest: f64,
}

/// How the equations of a step change with the numbers of elements.
#[derive(Clone, Debug)]
pub struct ElementsTangent {
    elements: Vec<Changed>,
    masses: BTreeMap<usize, SMatrix<f64, 8, 8>>,
    rule: StepRule,
    averaged: AveragedStrains,
    reach: Dual64, // L
    dissipation: Option<StrainDissipation>,
}

/// The configuration as drawn, and how it changes.
#[derive(Clone, Copy, Debug)]
pub struct Drawn<'a> {
    /// `q`.
    pub q: &'a [f64],
    /// `q_θ`.
    pub change: &'a [f64],
}

impl Drawn<'_> {
    /// Of the nodes of an element.
    fn of(&self, element: &Element) -> ElementCoordinates<Dual64> {
        element.coordinates(self.q).zip_map(&element.coordinates(self.change), Dual64::new)
    }
}

/// `σ` of a strain, of an element with the stiffness `C`.
pub(crate) fn stress(
    element: &Element,
    C: &Matrix6<Dual64>,
    strain: &Vector6<Dual64>,
) -> Vector6<Dual64> {
    let slack = element.is_slack(&strain.map(|own| own.re));
    if slack { without_extension(C) * strain } else { *C * strain }
}

/// With no derivatives.
fn constant(x: &ElementCoordinates) -> ElementCoordinates<Dual64> {
    x.map(Dual64::from_re)
}

impl Changed {
    fn new(model: &BeamElements, change: &ElementChange, drawn: Drawn<'_>) -> Option<Self> {
        let index = change.element;
        let element = model.elements.list()[index].clone();
        let length = Dual64::new(element.length, change.length);
        let weighted: Vec<_> =
            change.sections.iter().map(|own| (own.weight, own.section)).collect();
        let section = Section::mean(&weighted);
        let (law, stiffness, viscosity) = match element.law.kind() {
            ElementKind::MeanDirectors => (None, *section.stiffness_matrix(), section.viscosity()),
            kind => {
                let law = kind.helicoidal(length, &section)?;
                let (stiffness, viscosity) = (*law.stiffness(), *law.viscosity());
                (Some(law), stiffness, viscosity)
            }
        };
        let x = drawn.of(&element);
        let measured = measures(law.as_ref(), length, &x);
        let held = element.reference.map(Dual64::from_re);
        let reference = match &change.rest {
            None => measured,
            Some(rest) => rest.change([&held, &measured], &stiffness, |own| {
                strain_at(law.as_ref(), length, &x, own)
            }),
        };
        let reference = held.zip_map(&reference, |own, by| Dual64::new(own.re, by.eps));
        let (mass, compliance) = (section.mass_matrix(), section.compliance());
        let (slowness, bound) = (Dual64::from_re(0.0), change.bound);
        Some(Self {
            index,
            element,
            length,
            law,
            stiffness,
            viscosity,
            reference,
            mass,
            compliance,
            slowness,
            bound,
        })
    }

    /// `ε(x)`.
    pub(crate) fn strain(&self, q: &[f64]) -> Vector6<Dual64> {
        let x = constant(&self.element.coordinates(q));
        strain_at(self.law.as_ref(), self.length, &x, &self.reference)
    }

    /// `σ` of a strain.
    fn stress(&self, strain: &Vector6<Dual64>) -> Vector6<Dual64> {
        stress(&self.element, &self.stiffness, strain)
    }

    /// `∇ε·v`.
    fn rate(&self, q: &[f64], v: &[f64]) -> Vector6<Dual64> {
        let [x, v] = [q, v].map(|all| constant(&self.element.coordinates(all)));
        let Some(law) = &self.law else {
            return strain::gradients(&x, self.length).tr_mul(&v);
        };
        let y = helicoidal::forms(&x, self.length);
        let at = law.at(&y, &self.reference);
        let rate = at.helix_rate(&helicoidal::gradients(&x, self.length).tr_mul(&v));
        Vector6::from_fn(|i, _| {
            let unit = Vector6::from_fn(|k, _| Dual64::from_re(f64::from(u8::from(i == k))));
            at.on_helix(&unit).dot(&rate)
        })
    }

    /// `out ← out + (ℓ Σ n_i ∇ε_i)_θ`.
    fn add(&self, q: &[f64], n: &Vector6<Dual64>, out: &mut [f64]) {
        let force = self.force_change(&self.element.coordinates(q), &(n * self.length));
        self.element.scatter(&force, out);
    }

    /// `(Σ n_i ∇ε_i)_θ`.
    pub(crate) fn force_change(
        &self,
        x: &ElementCoordinates,
        n: &Vector6<Dual64>,
    ) -> ElementCoordinates {
        let (x, length) = (constant(x), self.length);
        let force = match &self.law {
            None => strain::force(&x, length, n),
            Some(law) => {
                let at = law.at(&helicoidal::forms(&x, length), &self.reference);
                helicoidal::force(&x.data.0[0], length, &at.pull_back(n).transpose())
            }
        };
        force.map(|own| own.eps)
    }

    /// `1/ω²` with its derivative, of an element with a constant mean section; `None` where it has
    /// a kink. `x`: where it is free of stress.
    fn slowness(&self, highest: &Highest, x: &ElementCoordinates<Dual64>) -> Option<Dual64> {
        let square = highest.square;
        let modes = highest.together(TOGETHER);
        let modes: Vec<_> = modes.iter().map(|mode| turned(x, mode)).collect();
        let M = self.element.mass.matrix(self.length, &self.mass);
        let change = |i: usize, j: usize| {
            let of_mass = mass_of(&M, [&modes[i], &modes[j]]).eps;
            self.stiffness_change(x, [&modes[i], &modes[j]]) - square * of_mass
        };
        let slope = change(0, 0);
        let pairs = (0..modes.len()).flat_map(|i| (0..modes.len()).map(move |j| (i, j)));
        let mut apart = pairs.map(|(i, j)| change(i, j) - if i == j { slope } else { 0.0 });
        let size = square * self.relative_change(x);
        let alike = apart.all(|by| by.abs() <= TOGETHER * size);
        alike.then(|| Dual64::new(square.recip(), -slope / (square * square)))
    }

    /// `(aᵀK b)_θ` of an element that is free of stress at `x`, with `a` and `b` as they change.
    fn stiffness_change(
        &self,
        x: &ElementCoordinates<Dual64>,
        [a, b]: [&ElementCoordinates<Dual64>; 2],
    ) -> f64 {
        let lifted = |own: Dual64| HyperHyperDual64 { eps3: own.eps, ..own.re.into() };
        let along = ElementCoordinates::from_fn(|i, _| HyperHyperDual64 {
            eps1: a[i].re,
            eps2: b[i].re,
            eps1eps3: a[i].eps,
            eps2eps3: b[i].eps,
            ..lifted(x[i])
        });
        let law = self.law.as_ref().map(|own| own.map(lifted));
        let (C, length) = (self.stiffness.map(lifted), lifted(self.length));
        let reference = measures(law.as_ref(), length, &x.map(lifted));
        let strain = strain_at(law.as_ref(), length, &along, &reference);
        (strain.dot(&(C * strain)) * length * 0.5).eps1eps2eps3
    }

    /// By which part its numbers change, per unit of the parameter.
    fn relative_change(&self, x: &ElementCoordinates<Dual64>) -> f64 {
        let length = self.length.re;
        let of_place = x.iter().map(|own| own.eps.abs() / length);
        let of_stiffness = relative(&self.stiffness);
        let sizes = of_place.chain([self.length.eps.abs() / length, of_stiffness]);
        sizes.fold(relative(&self.mass), f64::max)
    }
}

/// The largest change of a definite matrix against its diagonal.
fn relative<const N: usize>(m: &SMatrix<Dual64, N, N>) -> f64 {
    let part = |(i, j): (usize, usize)| {
        let size = (m[(i, i)].re * m[(j, j)].re).sqrt();
        if size > 0.0 { m[(i, j)].eps.abs() / size } else { 0.0 }
    };
    (0..N).flat_map(|i| (0..N).map(move |j| (i, j))).map(part).fold(0.0, f64::max)
}

/// `aᵀ(M ⊗ I_3) b`.
fn mass_of(M: &SMatrix<Dual64, 8, 8>, [a, b]: [&ElementCoordinates<Dual64>; 2]) -> Dual64 {
    let pairs = (0..8).flat_map(|i| (0..8).map(move |j| (i, j)));
    let product = |i: usize, j: usize| a.fixed_rows::<3>(3 * i).dot(&b.fixed_rows::<3>(3 * j));
    pairs.map(|(i, j)| M[(i, j)] * product(i, j)).fold(Dual64::from_re(0.0), |sum, own| sum + own)
}

/// A motion of nodes at `x` that turn as rigid bodies, as these change: `δd_I = ω × d_I`.
fn turned(x: &ElementCoordinates<Dual64>, mode: &ElementCoordinates) -> ElementCoordinates<Dual64> {
    let mut out = constant(mode);
    for node in 0..2 {
        let slot = |i: usize| 12 * node + 3 + 3 * i;
        let director = |i: usize| -> Vector3<Dual64> { x.fixed_rows::<3>(slot(i)).into() };
        let own = |i: usize| -> Vector3<f64> { mode.fixed_rows::<3>(slot(i)).into() };
        let held = [0, 1, 2].map(|i| director(i).map(|own| own.re));
        let turns: Vector3<f64> = (0..3).map(|i| held[i].cross(&own(i))).sum();
        let part = |d: &Vector3<f64>| d.norm_squared() * Matrix3::identity() - d * d.transpose();
        let inertia: Matrix3<f64> = held.iter().map(part).sum();
        let omega = inertia.try_inverse().map_or_else(Vector3::zeros, |own| own * turns);
        for i in 0..3 {
            let change = omega.cross(&director(i).map(|own| own.eps));
            (0..3).for_each(|k| out[slot(i) + k].eps = change[k]);
        }
    }
    out
}

/// The derivatives of a vector.
fn slopes(n: &Vector6<Dual64>) -> Strain {
    n.map(|own| own.eps)
}

impl ElementsTangent {
    /// Of elements that are free of stress, or strained as stated, as they are drawn. Where a
    /// length changes and tensions add mass, all elements are among the changes.
    ///
    /// # Errors
    /// [`ElementDesignError`].
    pub fn new(
        model: &BeamElements,
        rule: StepRule,
        drawn: Drawn<'_>,
        changes: &[ElementChange],
    ) -> Result<Self, ElementDesignError> {
        let q = drawn.q;
        let length = |element: usize| {
            changes.iter().find(|own| own.element == element).map_or(0.0, |own| own.length)
        };
        let scaled = matches!(rule.strains, StrainRule::MassScaled | StrainRule::Dissipative);
        let resolved = |highest: &Highest| {
            let slowness = Dual64::from_re(highest.square.recip());
            scaling(MASS_SCALING, slowness, rule.longest).re <= 0.0 // μ = 0 in all steps
        };
        let mut frequencies = Frequencies::new(model);
        let (mut elements, mut masses) = (Vec::new(), BTreeMap::new());
        for change in changes {
            let element = change.element;
            let own = Changed::new(model, change, drawn);
            let mut own = own.ok_or(ElementDesignError::Stiffness { element })?;
            if scaled {
                let known = frequencies.highest(element, q);
                let apart =
                    known.as_ref().is_some_and(|(_, of)| length(*of) - change.length != 0.0);
                let own_one = || Frequencies::new(model).highest(element, q);
                own.slowness = match if apart { own_one() } else { known } {
                    None => Dual64::from_re(0.0), // a motion carries no mass
                    Some((highest, _)) if resolved(&highest) => Dual64::from_re(f64::INFINITY),
                    Some((highest, of)) => {
                        let x = drawn.of(&model.elements.list()[of]);
                        let slowness = own.slowness(&highest, &x);
                        slowness.ok_or(ElementDesignError::Kink { element })?
                    }
                };
            }
            let M = mass(&own, &change.sections);
            if own.element.nodes[1] != own.element.nodes[0] + 1 {
                return Err(ElementDesignError::Apart { element });
            }
            if M.amax() > 0.0 {
                masses.insert(own.element.nodes[0], M);
            }
            elements.push(own);
        }
        let dissipates = rule.strains == StrainRule::Dissipative;
        let dissipation = dissipates.then(|| StrainDissipation::new(model));
        let averaged = model.averaged(rule.strains, q);
        let longer: f64 = changes.iter().map(|own| own.length).sum();
        let reach = Dual64::new(averaged.reach, longer);
        Ok(Self { elements, masses, rule, averaged, reach, dissipation })
    }

    /// How an element changes at the coordinates `q` that its nodes keep; `None` where it does not.
    pub(crate) fn changed(&self, element: usize) -> Option<&Changed> {
        self.elements.iter().find(|own| own.index == element)
    }

    /// `ℓ_θ` of an element, m.
    #[must_use]
    pub fn longer(&self, element: usize) -> f64 {
        self.changed(element).map_or(0.0, |own| own.length.eps)
    }

    /// `M_θ` of elements between `φ, d_1, d_2, d_3` of both nodes, by the first one of them.
    #[must_use]
    pub fn masses(&self) -> &BTreeMap<usize, SMatrix<f64, 8, 8>> {
        &self.masses
    }

    /// `μ` and `T` of an element in a step `h`.
    fn scaling(
        &self,
        own: &Changed,
        internal: &[f64],
        h: f64,
    ) -> (Dual64, Option<Vector6<Dual64>>) {
        let scaled = self.rule.strains == StrainRule::MassScaled;
        let slowness = if scaled { own.slowness } else { Dual64::from_re(0.0) };
        let mu = scaling(self.averaged.most, slowness, h);
        let bound = self.averaged.bound(own.index, internal);
        let lengths = [own.length, self.reach];
        let tension = bound
            .map(|bound| tension_mass(Dual64::new(bound, own.bound), lengths, h, own.mass[(0, 0)]));
        (mu, tension)
    }

    /// `n` of the energy of an element in a step, `ε̄` and `Δε`.
    fn of_energy(
        &self,
        own: &Changed,
        s: &Interval,
        mean: &Vector6<Dual64>,
        change: &Vector6<Dual64>,
        of: Slot,
    ) -> Vector6<Dual64> {
        let (mu, tension) = self.scaling(own, &s.internal, s.h);
        let slack = own.element.is_slack(&mean.map(|own| own.re));
        let n = resultants(&own.stiffness, (mean, change), (mu, tension), slack, -of.sign());
        times(-s.h, &n)
    }

    fn add_slot(&self, s: &Interval, of: Slot, out: &mut [f64]) {
        for own in &self.elements {
            let (mean, change) = mean_and_change([own.strain(&s.q0), own.strain(&s.q1)]);
            let mut n = damping::resultants(&own.viscosity, &change, self.lag(own, s.h), of);
            if self.rule.strains == StrainRule::Midpoint {
                self.add_at_points(own, s, of, out);
            } else {
                n += self.of_energy(own, s, &mean, &change, of);
            }
            if let Some(dissipation) = &self.dissipation {
                n += own.stiffness * times(-0.5 * s.h, &dissipation.stress(s, own.index, &change));
            }
            own.add(s.node(of), &n, out);
        }
    }

    /// `θ` of damping.
    fn lag(&self, own: &Changed, h: f64) -> Dual64 {
        match self.rule.strains {
            StrainRule::MassScaled | StrainRule::Dissipative => damping::lag(own.slowness, h),
            StrainRule::Averaged | StrainRule::Midpoint => Dual64::from_re(0.0),
        }
    }

    /// `−h D_of U_d` of `V` at the points of a quadrature.
    fn add_at_points(&self, own: &Changed, s: &Interval, of: Slot, out: &mut [f64]) {
        let q = match self.rule.quadrature {
            Quadrature::Midpoint => &s.q_mid,
            Quadrature::Trapezoidal => s.node(of),
        };
        let stress = own.stress(&own.strain(q));
        own.add(q, &times(-0.5 * s.h, &stress), out);
    }
}

/// `M_θ` of an element.
fn mass(own: &Changed, sections: &[SectionPoint<Dual64>]) -> SMatrix<f64, 8, 8> {
    let kind = own.element.mass;
    let M = match sections {
        [one] => kind.matrix(own.length, &one.section.mass_matrix()),
        _ => {
            let points: Vec<MassPoint<Dual64>> = sections.iter().map(SectionPoint::mass).collect();
            mass_along(kind, own.length, &points)
        }
    };
    M.map(|own| own.eps)
}

impl StepTangent for ElementsTangent {
    fn add(&self, s: &Interval, of: Slot, out: &mut [f64]) {
        self.add_slot(s, of, out);
    }

    /// `−ℓ Σ_i (C ε + V ε̇)_i ∇ε_i`, differentiated.
    fn add_at_node(&self, q: &[f64], v: &[f64], out: &mut [f64]) {
        for own in &self.elements {
            let n = own.stress(&own.strain(q)) + own.viscosity * own.rate(q, v);
            own.add(q, &-n, out);
        }
    }

    /// Strains of the midpoint rule alone.
    fn add_at_gauss(&self, q: &[f64], _v: &[f64], out: &mut [f64]) {
        for own in self.elements.iter().filter(|_| self.rule.strains == StrainRule::Midpoint) {
            let n = own.stress(&own.strain(q));
            own.add(q, &-n, out);
        }
    }

    /// `−ℓ Σ_i [h C Σ_l S_jl ε(q_l) + V Σ_l N_jl ε(q_l)]_i ∇ε_i(q_j)`, differentiated.
    fn add_at_point(&self, step: &StepPolynomial<'_>, j: usize, out: &mut [f64]) {
        let (S, N) = (&step.constants.S, &step.constants.N);
        for own in &self.elements {
            let strains: Vec<_> = (0..=step.stages()).map(|l| own.strain(step.q(l))).collect();
            let mut n = own.viscosity * row(N, j, &strains);
            if self.rule.strains != StrainRule::Midpoint {
                n += own.stiffness * times(step.h(), &row(S, j, &strains));
            }
            own.add(step.q(j), &-n, out);
        }
    }

    /// `h² ℓ Σ_i ((μ C + T) ε̇)_i ∇ε_i`, differentiated.
    fn add_added_momentum(&self, at: Configuration<'_>, h: f64, v: &[f64], out: &mut [f64]) {
        for own in self.elements.iter().filter(|_| self.averaged.adds_mass()) {
            let (rate, (mu, tension)) = (own.rate(at.q, v), self.scaling(own, at.internal, h));
            let mut n = own.stiffness * rate * mu;
            if let Some(tension) = tension {
                n += tension.component_mul(&rate);
            }
            own.add(at.q, &times(h * h, &n), out);
        }
    }

    fn add_internal(&self, s: &Interval, out: &mut [f64]) {
        let first = out.len().checked_sub(self.averaged.variable_count());
        for own in &self.elements {
            let (mean, change) = mean_and_change([own.strain(&s.q0), own.strain(&s.q1)]);
            if let Some(dissipation) = &self.dissipation {
                dissipation.add_driven(own.index, &slopes(&change), out);
            }
            let followed = self.averaged.followed(s, own.index);
            if let Some((first, FollowedBound { variable, raised_by })) = first.zip(followed) {
                let tension = own.stiffness.row(2).tr_dot(&mean).eps;
                self.averaged.add_tension(first + variable, raised_by, tension, out);
            }
        }
    }

    fn add_begin(&self, q: &[f64], out: &mut [f64]) {
        let Some(first) = out.len().checked_sub(self.averaged.variable_count()) else { return };
        for own in &self.elements {
            if let Some(variable) = self.averaged.variable(own.index) {
                let tension = own.stiffness.row(2).tr_dot(&own.strain(q));
                let C = own.stiffness.map(|own| own.re);
                begin_change(first + variable, &C, tension.re, tension.eps, out);
            }
        }
    }

    fn is_finite(&self) -> bool {
        let numbers = |own: &Changed| {
            let all = own.stiffness.iter().chain(own.viscosity.iter()).chain(own.reference.iter());
            let all = all.chain(own.mass.iter()).chain([&own.slowness, &own.length]);
            all.into_iter().all(|own| own.eps.is_finite())
        };
        self.elements.iter().all(numbers)
            && self.masses.values().all(|own| own.iter().all(|own| own.is_finite()))
    }
}

#[cfg(test)]
mod tests;
