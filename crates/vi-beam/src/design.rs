//! Elements by the numbers of their sections.
//!
//! ```text
//! b_θ = (−h D_1(U_d − K_d) + f_d^-)_θ = Σ_e ℓ (Σ_i n_i ∇ε_i(x_n))_θ        at fixed q_n, q_{n+1}, z_n
//! n = −h [C (½ ε̄ + μ Δε) + T Δε] − (½ + θ) V Δε − ½ h C φ(Δε, z)
//! M_θ    of the interpolation, linear in the masses of sections
//! μ_θ = −(1/ω²)_θ/h²,   (ω²)_θ = xᵀ(K_θ − ω² M_θ) x                         x: of the highest vibration, xᵀMx = 1
//! ```
//! Strains of order 4 condense the stiffness, so `ε` and `∇ε` change with it as well: the formulas
//! of the step are evaluated with dual numbers. Lengths and nodes do not change.
#![allow(non_snake_case)] // C, V, M, K, S, N

use crate::averaged::{
    AveragedStrains, MASS_SCALING, mean_and_change, resultants, scaling, tension_mass,
};
use crate::damping;
use crate::dissipation::StrainDissipation;
use crate::element::{Element, ElementKind, without_extension};
use crate::following::{Followed, begin_change};
use crate::frequency::{Frequencies, Highest};
use crate::helicoidal::{self, Helicoidal};
use crate::interpolated::row;
use crate::model::{BeamElements, StrainRule};
use crate::rest::Rest;
use crate::section::Section;
use crate::small::times;
use crate::strain::{self, ElementCoordinates, SIZE, Strain};
use crate::varying::{MassPoint, SectionPoint, mass_along};
use nalgebra::{Matrix4, Matrix6, SMatrix, Vector6};
use std::collections::BTreeMap;
use vi_core::interpolation::StepPolynomial;
use vi_core::interval::{Interval, Slot};
use vi_core::num_dual::Dual64;
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
    law: Option<Helicoidal<Dual64>>, // None: mean directors
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
    dissipation: Option<StrainDissipation>,
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

impl Changed {
    fn new(model: &BeamElements, change: &ElementChange, q: &[f64]) -> Option<Self> {
        let index = change.element;
        let element = model.elements.list()[index].clone();
        let weighted: Vec<_> =
            change.sections.iter().map(|own| (own.weight, own.section)).collect();
        let section = Section::mean(&weighted);
        let (law, stiffness, viscosity) = match element.law.kind() {
            ElementKind::MeanDirectors => (None, *section.stiffness_matrix(), section.viscosity()),
            kind => {
                let law = kind.helicoidal(element.length, &section)?;
                let (stiffness, viscosity) = (*law.stiffness(), *law.viscosity());
                (Some(law), stiffness, viscosity)
            }
        };
        let reference = element.reference.map(Dual64::from_re);
        let (mass, compliance) = (section.mass_matrix(), section.compliance());
        let (slowness, bound) = (Dual64::from_re(0.0), change.bound);
        let mut own = Self {
            index,
            element,
            law,
            stiffness,
            viscosity,
            reference,
            mass,
            compliance,
            slowness,
            bound,
        };
        if let Some(rest) = &change.rest {
            let x = own.element.coordinates(q);
            let stretch = own.reference;
            own.reference = rest.change(&stretch, &own.stiffness, |own_reference| {
                own.strain_from(&x, own_reference)
            });
        }
        Some(own)
    }

    /// `ε(x)` of an element that is free of stress with the strains `reference`.
    fn strain_from(&self, x: &ElementCoordinates, reference: &Vector6<Dual64>) -> Vector6<Dual64> {
        match &self.law {
            None => strain::forms(x, self.element.length).map(Dual64::from_re) - reference,
            Some(law) => law.strain(&helicoidal::forms(x, self.element.length), reference),
        }
    }

    /// `ε(x)`.
    pub(crate) fn strain(&self, q: &[f64]) -> Vector6<Dual64> {
        self.strain_from(&self.element.coordinates(q), &self.reference)
    }

    /// `σ` of a strain.
    fn stress(&self, strain: &Vector6<Dual64>) -> Vector6<Dual64> {
        stress(&self.element, &self.stiffness, strain)
    }

    /// `∇ε·v`.
    fn rate(&self, q: &[f64], v: &[f64]) -> Vector6<Dual64> {
        let [x, v] = [q, v].map(|all| self.element.coordinates(all));
        self.rate_from(&x, &v, &self.reference)
    }

    /// `out ← out + (Σ n_i ∇ε_i)_θ`.
    fn add(&self, q: &[f64], n: &Vector6<Dual64>, out: &mut [f64]) {
        let force = self.force_change(&self.element.coordinates(q), n);
        self.element.scatter(&force, out);
    }

    /// `(Σ n_i ∇ε_i)_θ`.
    pub(crate) fn force_change(
        &self,
        x: &ElementCoordinates,
        n: &Vector6<Dual64>,
    ) -> ElementCoordinates {
        let length = self.element.length;
        match &self.law {
            None => strain::force(x, length, &slopes(n)),
            Some(law) => {
                let at = law.at(&helicoidal::forms(x, length), &self.reference);
                let by_forms = at.by_helix(&slopes(&at.on_helix(n)));
                helicoidal::force(x, length, &by_forms.transpose())
            }
        }
    }

    /// `∇ε_i·v` of an element that is free of stress at `x`.
    fn free_rate(&self, x: &ElementCoordinates, v: &ElementCoordinates) -> Vector6<Dual64> {
        let Some(law) = &self.law else { return self.rate_from(x, v, &self.reference) };
        let y = helicoidal::forms(x, self.element.length);
        self.rate_from(x, v, &law.helix(&y).map(Dual64::from_re))
    }

    /// `∇ε_i(x)·v` of an element that is free of stress with the strains `reference`.
    fn rate_from(
        &self,
        x: &ElementCoordinates,
        v: &ElementCoordinates,
        reference: &Vector6<Dual64>,
    ) -> Vector6<Dual64> {
        let length = self.element.length;
        let Some(law) = &self.law else {
            return strain::gradients(x, length).tr_mul(v).map(Dual64::from_re);
        };
        let y = helicoidal::forms(x, length);
        let at = law.at(&y, reference);
        let rate = at.helix_rate(&helicoidal::gradients(x, length).tr_mul(v)).map(Dual64::from_re);
        Vector6::from_fn(|i, _| {
            let unit = Vector6::from_fn(|k, _| Dual64::from_re(f64::from(u8::from(i == k))));
            at.on_helix(&unit).dot(&rate)
        })
    }

    /// `1/ω²` with its derivative, of an element with a constant mean section; `None` where it has
    /// a kink. `x`: where it is free of stress.
    fn slowness(&self, highest: &Highest, x: &ElementCoordinates) -> Option<Dual64> {
        let M = self.element.mass.matrix(self.element.length, &self.mass.map(|own| own.eps));
        let modes = highest.together(TOGETHER);
        let rates: Vec<_> = modes.iter().map(|mode| self.free_rate(x, mode)).collect();
        let of_mass = |a: &ElementCoordinates, b: &ElementCoordinates| -> f64 {
            let pairs = (0..8).flat_map(|i| (0..8).map(move |j| (i, j)));
            let product =
                |i: usize, j: usize| (0..3).map(|k| a[3 * i + k] * b[3 * j + k]).sum::<f64>();
            pairs.map(|(i, j)| M[(i, j)] * product(i, j)).sum()
        };
        let geometric = self.geometric_change(x);
        let change = |i: usize, j: usize| {
            let of_stiffness = rates[i].dot(&(self.stiffness * rates[j])).eps;
            let of_stress = modes[i].dot(&(geometric * modes[j]));
            self.element.length * of_stiffness + of_stress
                - highest.square * of_mass(&modes[i], &modes[j])
        };
        let slope = change(0, 0);
        let pairs = (0..modes.len()).flat_map(|i| (0..modes.len()).map(move |j| (i, j)));
        let size = self.size_of_change(&rates[0], highest.square, M.amax());
        let mut apart = pairs.map(|(i, j)| change(i, j) - if i == j { slope } else { 0.0 });
        let alike = apart.all(|by| by.abs() <= TOGETHER * size);
        let square = highest.square;
        alike.then(|| Dual64::new(square.recip(), -slope / (square * square)))
    }

    /// How the geometric stiffness at `x` changes: of a rope whose nodes are not along its arc,
    /// which has tension where it is drawn.
    fn geometric_change(&self, x: &ElementCoordinates) -> SMatrix<f64, SIZE, SIZE> {
        let reference = self.element.measures(x);
        let strain = self.strain_from(x, &reference.map(Dual64::from_re));
        let n = self.element.length * slopes(&(self.stiffness * strain));
        let free = Element { reference, ..self.element.clone() };
        free.at(*x).tangent(&Matrix6::zeros(), &n)
    }

    /// What a change of `ω²` is small against.
    fn size_of_change(&self, rate: &Vector6<Dual64>, square: f64, mass: f64) -> f64 {
        let stiffness: Strain = slopes(&(self.stiffness * rate));
        let of_stiffness = self.element.length * stiffness.abs().dot(&rate.map(|own| own.re.abs()));
        of_stiffness + if mass > 0.0 { square } else { 0.0 }
    }
}

/// The derivatives of a vector.
fn slopes(n: &Vector6<Dual64>) -> Strain {
    n.map(|own| own.eps)
}

impl ElementsTangent {
    /// Of elements that are free of stress, or strained as stated, in the configuration `q`.
    ///
    /// # Errors
    /// [`ElementDesignError`].
    pub fn new(
        model: &BeamElements,
        rule: StepRule,
        q: &[f64],
        changes: &[ElementChange],
    ) -> Result<Self, ElementDesignError> {
        let scaled = matches!(rule.strains, StrainRule::MassScaled | StrainRule::Dissipative);
        let resolved = |highest: &Highest| {
            let slowness = Dual64::from_re(highest.square.recip());
            scaling(MASS_SCALING, slowness, rule.longest).re <= 0.0 // μ = 0 in all steps
        };
        let mut frequencies = Frequencies::new(model);
        let (mut elements, mut masses) = (Vec::new(), BTreeMap::new());
        for change in changes {
            let element = change.element;
            let own = Changed::new(model, change, q);
            let mut own = own.ok_or(ElementDesignError::Stiffness { element })?;
            if scaled {
                own.slowness = match frequencies.highest(element, q) {
                    None => Dual64::from_re(0.0), // a motion carries no mass
                    Some((highest, _)) if resolved(&highest) => Dual64::from_re(f64::INFINITY),
                    Some((highest, x)) => {
                        let slowness = own.slowness(&highest, &x);
                        slowness.ok_or(ElementDesignError::Kink { element })?
                    }
                };
            }
            let M = mass(&own.element, &change.sections);
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
        Ok(Self { elements, masses, rule, averaged, dissipation })
    }

    /// How an element changes at the coordinates `q` that its nodes keep; `None` where it does not.
    pub(crate) fn changed(&self, element: usize) -> Option<&Changed> {
        self.elements.iter().find(|own| own.index == element)
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
        let lengths = [own.element.length, self.averaged.reach];
        let tension = bound
            .map(|bound| tension_mass(Dual64::new(bound, own.bound), lengths, h, own.mass[(0, 0)]));
        (mu, tension)
    }

    /// `n` of the energy of an element in a step, `ε̄` and `Δε`.
    fn of_energy(
        &self,
        own: &Changed,
        s: &Interval,
        (mean, change): (&Vector6<Dual64>, &Vector6<Dual64>),
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
                n += self.of_energy(own, s, (&mean, &change), of);
            }
            if let Some(dissipation) = &self.dissipation {
                n += own.stiffness * times(-0.5 * s.h, &dissipation.stress(s, own.index, &change));
            }
            own.add(s.node(of), &times(own.element.length, &n), out);
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
        own.add(q, &times(-0.5 * s.h * own.element.length, &stress), out);
    }
}

/// `M_θ` of an element.
fn mass(element: &Element, sections: &[SectionPoint<Dual64>]) -> SMatrix<f64, 8, 8> {
    let point = |own: &SectionPoint<Dual64>| {
        let mass = own.section.mass_matrix().map(|own| own.eps);
        MassPoint { place: own.place, weight: own.weight, mass }
    };
    match sections {
        [one] => element.mass.matrix(element.length, &point(one).mass),
        _ => {
            let points: Vec<MassPoint> = sections.iter().map(point).collect();
            mass_along(element.mass, element.length, &points)
        }
    }
}

impl StepTangent for ElementsTangent {
    fn add(&self, s: &Interval, of: Slot, out: &mut [f64]) {
        self.add_slot(s, of, out);
    }

    /// `−ℓ Σ_i (C ε + V ε̇)_i ∇ε_i`, differentiated.
    fn add_at_node(&self, q: &[f64], v: &[f64], out: &mut [f64]) {
        for own in &self.elements {
            let n = own.stress(&own.strain(q)) + own.viscosity * own.rate(q, v);
            own.add(q, &times(-own.element.length, &n), out);
        }
    }

    /// Strains of the midpoint rule alone.
    fn add_at_gauss(&self, q: &[f64], _v: &[f64], out: &mut [f64]) {
        for own in self.elements.iter().filter(|_| self.rule.strains == StrainRule::Midpoint) {
            let n = own.stress(&own.strain(q));
            own.add(q, &times(-own.element.length, &n), out);
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
            own.add(step.q(j), &times(-own.element.length, &n), out);
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
            own.add(at.q, &times(h * h * own.element.length, &n), out);
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
            if let Some((first, Followed { variable, raised_by })) = first.zip(followed) {
                let tension = own.stiffness.row(2).tr_dot(&mean).eps;
                self.averaged.add_tension((first + variable, raised_by), tension, out);
            }
        }
    }

    fn add_begin(&self, q: &[f64], out: &mut [f64]) {
        let Some(first) = out.len().checked_sub(self.averaged.variable_count()) else { return };
        for own in &self.elements {
            if let Some(variable) = self.averaged.variable(own.index) {
                let tension = own.stiffness.row(2).tr_dot(&own.strain(q));
                let C = own.stiffness.map(|own| own.re);
                begin_change((first + variable, &C), tension.re, tension.eps, out);
            }
        }
    }

    fn is_finite(&self) -> bool {
        let numbers = |own: &Changed| {
            let all = own.stiffness.iter().chain(own.viscosity.iter()).chain(own.reference.iter());
            let all = all.chain(own.mass.iter()).chain([&own.slowness]);
            all.into_iter().all(|own| own.eps.is_finite())
        };
        self.elements.iter().all(numbers)
            && self.masses.values().all(|own| own.iter().all(|own| own.is_finite()))
    }
}

#[cfg(test)]
mod tests;
