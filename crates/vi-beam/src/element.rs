//! The two-node element and the elastic energy of a set of elements.
//!
//! ```text
//! V_e   = ½ ℓ εᵀ C ε
//! ∇V_e  = ℓ Σ_i (C ε)_i ∇ε_i
//! ∇²V_e = ℓ Σ_ij C_ij ∇ε_i ∇ε_jᵀ + ℓ Σ_i (C ε)_i ∇²ε_i
//! M_e   = ℓ [1/3 1/6; 1/6 1/3] ⊗ diag(Aρ, I_1ρ, I_2ρ, I_3ρ) ⊗ I_3         (lumped: ½, ½)
//! ```
//! [`StrainLaw`] says what `ε` and `C` are. Strains of mean directors are quadratic forms, `∇ε_i =
//! 𝔹_i x` and `∇²ε_i = 𝔹_i`; their limit: nodes rotated relative to each other by `θ` carry the
//! moment `EI sin θ cos θ/ℓ` at most, `EI/(2ℓ)` at 45°, and tension `N ℓ² > 4 EI` makes them
//! unstable. Helicoidal strains ([`crate::helicoidal`]) have neither limit.
//!
//! `M_e` is constant and, with `I_3ρ = 0`, singular; `PᵀMP` is not. The quadratic mass, of order 4,
//! belongs to the interpolation `φ = φ̄ + ξ Δφ + ½ (ξ² − ¼) ℓ Δd_3` with lumped directors:
//! ```text
//! T_e = ½ ℓ { Aρ (|φ̄̇|² + |Δφ̇|²/12 − (ℓ/6) φ̄̇·Δḋ_3 + (ℓ²/120) |Δḋ_3|²) + ½ Σ_I I_Iρ (|ḋ_I^a|² + |ḋ_I^b|²) }
//! ```
//!
//! Source: theory §6.
#![allow(non_snake_case)] // M, V

use crate::helicoidal::{self, Helicoidal};
use crate::mass_kind::MassKind;
use crate::products::{add_scalars, by_forms, weighted};
use crate::section::Section;
use crate::strain::{self, ElementCoordinates, SIZE, Strain};
use crate::varying::{MassPoint, SectionPoint, mass_along};
use nalgebra::{Matrix6, SMatrix};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;
use vi_core::Number;
use vi_core::interval::Interval;
use vi_core::potential::Potential;
use vi_core::sparse::Entries;
use vi_core::strain_energy::StrainEnergy;

/// An element that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ElementError {
    /// The length is not positive.
    #[error("element {element} has the length {length} m; it must be a positive finite number")]
    Length {
        /// Which element.
        element: usize,
        /// m.
        length: f64,
    },
    /// Both ends are the same node.
    #[error("both ends of element {element} are node {node}")]
    SameNode {
        /// Which element.
        element: usize,
        /// The node.
        node: usize,
    },
    /// Strains of order 4 cannot condense the stiffness of its section.
    #[error(
        "the stiffness of the section of element {element} is not positive definite together with \
         the bending within the element, or rigid in shear where strains of order 4 alone can be"
    )]
    Stiffness {
        /// Which element.
        element: usize,
    },
    /// The section does not exist.
    #[error("element {element} names section {section}, but there are {count}")]
    NoSection {
        /// Which element.
        element: usize,
        /// The section it names.
        section: usize,
        /// How many there are.
        count: usize,
    },
}

/// What an element measures of its nodes.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum StrainLaw {
    /// Quadratic forms of mean directors ([`crate::strain`]).
    #[default]
    MeanDirectors,
    /// Of a helix between the nodes, with the stiffness that they condense ([`crate::helicoidal`]).
    Helicoidal(Arc<Helicoidal>),
}

impl StrainLaw {
    /// Which strains they are.
    #[must_use]
    pub fn kind(&self) -> ElementKind {
        match self {
            Self::MeanDirectors => ElementKind::MeanDirectors,
            Self::Helicoidal(law) if law.carries_tension_only() => ElementKind::Rope,
            Self::Helicoidal(law) if law.is_of_order_4() => ElementKind::Helicoidal,
            Self::Helicoidal(_) => ElementKind::SecondOrder,
        }
    }
}

/// `C` without the entries of `ε_3`.
pub(crate) fn without_extension<T: Number>(C: &Matrix6<T>) -> Matrix6<T> {
    let mut own = *C;
    own.fill_row(2, T::of(0.0));
    own.fill_column(2, T::of(0.0));
    own
}

/// Two nodes, a reference length, a section, reference strains.
#[derive(Clone, Debug, PartialEq)]
pub struct Element {
    /// Frames `a` and `b`; their coordinates start at 12 times the index.
    pub nodes: [usize; 2],
    /// `ℓ`, reference arc length, m.
    pub length: f64,
    /// Index of the section.
    pub section: usize,
    /// `ε_0`: strains of the stress-free configuration.
    pub reference: Strain,
    /// How its mass is distributed.
    pub mass: MassKind,
    /// What its strains are.
    pub law: StrainLaw,
}

impl Element {
    /// `x`, from the coordinates of all frames.
    #[must_use]
    #[inline]
    pub fn coordinates(&self, q: &[f64]) -> ElementCoordinates {
        let [a, b] = self.starts();
        let (a, b) = (&q[a..a + 12], &q[b..b + 12]);
        let mut x = ElementCoordinates::zeros();
        x.as_mut_slice()[..12].copy_from_slice(a);
        x.as_mut_slice()[12..].copy_from_slice(b);
        x
    }

    /// Whether `φ` is interpolated with `d_3`.
    pub(crate) fn bends_within(&self) -> bool {
        self.mass == MassKind::Quadratic
    }

    /// `(Γ, K)` before those of the stress-free configuration are taken off.
    #[must_use]
    pub fn measures(&self, x: &ElementCoordinates) -> Strain {
        match &self.law {
            StrainLaw::MeanDirectors => strain::forms(x, self.length),
            StrainLaw::Helicoidal(law) => law.helix(&helicoidal::forms(x, self.length)),
        }
    }

    /// `C`, with which stress resultants are `C ε`: that of its section, or condensed.
    pub(crate) fn stiffness<'a>(&'a self, section: &'a Section) -> &'a Matrix6<f64> {
        match &self.law {
            StrainLaw::MeanDirectors => section.stiffness_matrix(),
            StrainLaw::Helicoidal(law) => law.stiffness(),
        }
    }

    /// `C` at the strain `ε` for `C` of an element in tension: without the entries of `ε_3` where
    /// it carries tension only and is slack.
    #[must_use]
    pub fn carrying(&self, C: &Matrix6<f64>, strain: &Strain) -> Matrix6<f64> {
        if self.is_slack(strain) { without_extension(C) } else { *C }
    }

    /// Whether it carries no force along it where its nodes are closer than its stress-free length.
    #[must_use]
    pub fn carries_tension_only(&self) -> bool {
        matches!(&self.law, StrainLaw::Helicoidal(law) if law.carries_tension_only())
    }

    /// Whether it carries tension only and is slack.
    pub(crate) fn is_slack(&self, strain: &Strain) -> bool {
        strain[2] < 0.0 && self.carries_tension_only()
    }

    /// The mean stress resultants of an interval with the strains `ε_n`, `ε_{n+1}` at its ends, as
    /// far as they do the work of the energy, `σ·Δε = ½ Δ(εᵀC ε)`, and their derivative by
    /// `ε_{n+1}`.
    ///
    /// ```text
    /// σ = ½ C (ε_n + ε_{n+1})            tension only: ε_3 ↦ max(0, ε_3),  σ_3 ↦ σ_3 Δmax(0, ε_3)/Δε_3
    /// ```
    #[must_use]
    pub fn mean_stress(
        &self,
        C: &Matrix6<f64>,
        [start, end]: [&Strain; 2],
    ) -> (Strain, Matrix6<f64>) {
        if !(self.is_slack(start) || self.is_slack(end)) {
            return (0.5 * (C * (start + end)), 0.5 * C);
        }
        let carried = |strain: &Strain| {
            let mut own = *strain;
            own[2] = own[2].max(0.0);
            own
        };
        let (from, to) = (carried(start), carried(end));
        let (mut stress, mut slope) = (0.5 * (C * (from + to)), 0.5 * C);
        let taut = if end[2] > 0.0 { 1.0 } else { 0.0 };
        slope.column_mut(2).scale_mut(taut);
        let change = end[2] - start[2];
        let share = if change == 0.0 { 0.0 } else { (to[2] - from[2]) / change };
        slope.row_mut(2).scale_mut(share);
        if change != 0.0 {
            slope[(2, 2)] += stress[2] * (taut - share) / change;
        }
        stress[2] *= share;
        (stress, slope)
    }

    /// `V`, with which damping adds `V ε̇` to the stress resultants.
    pub(crate) fn viscosity(&self, section: &Section) -> Matrix6<f64> {
        match &self.law {
            StrainLaw::MeanDirectors => section.viscosity(),
            StrainLaw::Helicoidal(law) => *law.viscosity(),
        }
    }

    /// `ε(x)`.
    #[must_use]
    pub fn strain(&self, x: &ElementCoordinates) -> Strain {
        match &self.law {
            StrainLaw::MeanDirectors => strain::forms(x, self.length) - self.reference,
            StrainLaw::Helicoidal(law) => {
                law.strain(&helicoidal::forms(x, self.length), &self.reference)
            }
        }
    }

    /// `Σ n_i ∂̄ε_i`: the discrete gradient of the strains in an interval, `∂̄ε_i·Δx = Δε_i`.
    #[must_use]
    pub fn discrete_force(&self, s: &Interval, n: &Strain) -> ElementCoordinates {
        let middle = self.coordinates(&s.q_mid);
        match &self.law {
            StrainLaw::MeanDirectors => strain::gradients(&middle, self.length) * n,
            StrainLaw::Helicoidal(law) => {
                let [from, to] = self.ends(s).map(|x| helicoidal::forms(&x, self.length));
                let c = law.discrete_slopes([&from, &to], &self.reference).tr_mul(n);
                helicoidal::force(&middle, self.length, &c.transpose())
            }
        }
    }

    /// The derivative of [`Element::discrete_force`] by `x_{n+1}` where `n` changes by
    /// `Σ_j c_ij ∇ε_j`.
    #[must_use]
    pub fn discrete_tangent(
        &self,
        s: &Interval,
        c: &Matrix6<f64>,
        n: &Strain,
    ) -> SMatrix<f64, SIZE, SIZE> {
        let (middle, [start, end]) = (self.coordinates(&s.q_mid), self.ends(s));
        match &self.law {
            StrainLaw::MeanDirectors => {
                let gradients = |x: &ElementCoordinates| strain::gradients(x, self.length);
                let mut K = gradients(&middle) * weighted(&gradients(&end), c).transpose();
                add_scalars(&strain::weighted_matrix(&(0.5 * n), self.length), &mut K);
                K
            }
            StrainLaw::Helicoidal(law) => {
                let y = [&start, &end].map(|x| helicoidal::forms(x, self.length));
                let (slopes, bends) = law.discrete_derivatives([&y[0], &y[1]], &self.reference, n);
                let of_end = law.at(&y[1], &self.reference).slopes();
                let A = slopes.tr_mul(&(c * of_end)) + bends;
                by_forms([&middle, &end], self.length, &A, &(0.5 * slopes.tr_mul(n)))
            }
        }
    }

    /// `x` at both ends of a step.
    pub(crate) fn ends(&self, s: &Interval) -> [ElementCoordinates; 2] {
        [self.coordinates(&s.q0), self.coordinates(&s.q1)]
    }

    /// The first coordinates of both nodes among those of all frames.
    pub(crate) fn starts(&self) -> [usize; 2] {
        self.nodes.map(|node| 12 * node)
    }

    /// The coordinate among all frames that the component `row` of `x` is.
    #[must_use]
    pub fn place(&self, row: usize) -> usize {
        12 * self.nodes[row / 12] + row % 12
    }

    /// `out ← out + x` at the places of the element.
    pub fn scatter(&self, x: &ElementCoordinates, out: &mut [f64]) {
        for (k, node) in self.nodes.into_iter().enumerate() {
            let own = &mut out[12 * node..12 * node + 12];
            for (o, x) in own.iter_mut().zip(&x.as_slice()[12 * k..]) {
                *o += x;
            }
        }
    }

    /// Emits a dense 24×24 matrix at the places of the element.
    pub fn emit(&self, K: &SMatrix<f64, SIZE, SIZE>, out: &mut dyn Entries) {
        for j in 0..SIZE {
            let column = self.place(j);
            for i in 0..SIZE {
                out.add(self.place(i), column, K[(i, j)]);
            }
        }
    }
}

/// Which strains the elements of a beam have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ElementKind {
    /// Those of mean directors, of order 2; unstable in tension where `N ℓ² > 4 EI`.
    #[default]
    MeanDirectors,
    /// Helicoidal ones of order 4.
    Helicoidal,
    /// Helicoidal ones of order 2, for large moments of inertia of the section.
    SecondOrder,
    /// Helicoidal ones of ropes, which carry tension only.
    Rope,
}

impl ElementKind {
    /// Its name in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::MeanDirectors => "mean_directors",
            Self::Helicoidal => "helicoidal",
            Self::SecondOrder => "second_order",
            Self::Rope => "rope",
        }
    }

    /// The strains of an element of a length; `None` where a stiffness cannot be condensed.
    fn law(self, length: f64, section: &Section) -> Option<StrainLaw> {
        match self {
            Self::MeanDirectors if section.is_rigid_in_shear() => None,
            Self::MeanDirectors => Some(StrainLaw::MeanDirectors),
            _ => Some(StrainLaw::Helicoidal(Arc::new(self.helicoidal(length, section)?))),
        }
    }

    /// The same of those that are helicoidal, with the stiffness that they condense.
    pub(crate) fn helicoidal<T: Number>(
        self,
        length: f64,
        section: &Section<T>,
    ) -> Option<Helicoidal<T>> {
        let law = match self {
            Self::MeanDirectors => return None,
            Self::SecondOrder if section.is_rigid_in_shear() => return None,
            Self::SecondOrder => Helicoidal::of_order_2(length, *section.stiffness_matrix()),
            Self::Helicoidal | Self::Rope => Helicoidal::of_order_4(length, &section.compliance())?,
        };
        let law = law.with_viscosity(&section.viscosity());
        Some(if self == Self::Rope { law.of_rope() } else { law })
    }
}

/// Elements with their sections: one potential for all of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Elements {
    sections: Vec<Section>,
    elements: Vec<Element>,
    varying: BTreeMap<usize, Vec<MassPoint>>, // elements along which the mass changes
}

impl Elements {
    /// No elements yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a section; returns its index.
    pub fn add_section(&mut self, section: Section) -> usize {
        self.sections.push(section);
        self.sections.len() - 1
    }

    /// Adds an element that is stress-free with the strains `reference`; returns its index.
    ///
    /// # Errors
    /// [`ElementError`].
    pub fn add(&mut self, element: Element) -> Result<usize, ElementError> {
        let (index, count) = (self.elements.len(), self.sections.len());
        let Element { nodes, length, section, .. } = element;
        if !(length.is_finite() && length > 0.0) {
            return Err(ElementError::Length { element: index, length });
        }
        if nodes[0] == nodes[1] {
            return Err(ElementError::SameNode { element: index, node: nodes[0] });
        }
        if section >= count {
            return Err(ElementError::NoSection { element: index, section, count });
        }
        self.elements.push(element);
        Ok(index)
    }

    /// Adds an element that is stress-free in the configuration `q` of all frames.
    ///
    /// # Errors
    /// [`ElementError`].
    pub fn add_stress_free(
        &mut self,
        nodes: [usize; 2],
        length: f64,
        section: usize,
        q: &[f64],
    ) -> Result<usize, ElementError> {
        let (reference, mass) = (Strain::zeros(), MassKind::Consistent);
        let law = StrainLaw::MeanDirectors;
        let index = self.add(Element { nodes, length, section, reference, mass, law })?;
        let x = self.elements[index].coordinates(q);
        self.elements[index].reference = strain::forms(&x, length);
        Ok(index)
    }

    /// Gives some elements, stress-free in the configuration `q`, other strains.
    ///
    /// # Errors
    /// [`ElementError::Stiffness`].
    pub fn set_strains(
        &mut self,
        elements: Range<usize>,
        kind: ElementKind,
        q: &[f64],
    ) -> Result<(), ElementError> {
        for k in elements {
            let law = kind.law(self.elements[k].length, self.section(&self.elements[k]));
            let element = &mut self.elements[k];
            element.law = law.ok_or(ElementError::Stiffness { element: k })?;
            element.reference = element.measures(&element.coordinates(q));
            if kind != ElementKind::MeanDirectors && element.mass == MassKind::Consistent {
                element.mass = MassKind::Quadratic;
            }
        }
        Ok(())
    }

    /// Gives an element, stress-free in the configuration `q`, a section that changes along it: its
    /// compliance is the mean, its mass that of the interpolation. Strains are set afterwards.
    ///
    /// # Panics
    /// When there is no such element, or no point.
    pub fn set_section_along(&mut self, element: usize, points: &[SectionPoint]) {
        let weighted: Vec<(f64, Section)> = points.iter().map(|p| (p.weight, p.section)).collect();
        self.elements[element].section = self.add_section(Section::mean(&weighted));
        if points.iter().any(|point| point.section.mass_matrix() != points[0].section.mass_matrix())
        {
            self.varying.insert(element, points.iter().map(SectionPoint::mass).collect());
        }
    }

    /// States the strains of the stress-free configuration of an element.
    pub(crate) fn set_reference(&mut self, element: usize, reference: Strain) {
        self.elements[element].reference = reference;
    }

    /// Distributes the mass of some elements by another rule.
    pub fn set_mass(&mut self, elements: Range<usize>, kind: MassKind) {
        self.elements[elements].iter_mut().for_each(|element| element.mass = kind);
    }

    /// The elements.
    #[must_use]
    pub fn list(&self) -> &[Element] {
        &self.elements
    }

    /// The section of an element.
    #[must_use]
    pub fn section(&self, element: &Element) -> &Section {
        &self.sections[element.section]
    }

    /// The stress resultants of an element with the strain `ε`.
    #[must_use]
    pub fn stress(&self, element: &Element, strain: &Strain) -> Strain {
        element.carrying(self.stiffness(element), strain) * strain
    }

    /// `C` of an element, with which its stress resultants are `C ε` in tension.
    #[must_use]
    pub fn stiffness<'a>(&'a self, element: &'a Element) -> &'a Matrix6<f64> {
        element.stiffness(self.section(element))
    }

    /// Elements with their stiffness `C`.
    pub fn iter(&self) -> impl Iterator<Item = (&Element, &Matrix6<f64>)> {
        self.elements.iter().map(|element| (element, self.stiffness(element)))
    }

    /// `M` of an element, between `φ, d_1, d_2, d_3` of both nodes.
    pub(crate) fn mass(&self, k: usize) -> SMatrix<f64, 8, 8> {
        let element = &self.elements[k];
        match self.varying.get(&k) {
            None => element.mass.matrix(element.length, &self.section(element).mass_matrix()),
            Some(points) => mass_along(element.mass, element.length, points),
        }
    }

    /// Emits the mass matrix of all elements.
    pub fn emit_mass(&self, out: &mut dyn Entries) {
        for (k, element) in self.elements.iter().enumerate() {
            let M = self.mass(k);
            for (i, j) in (0..8).flat_map(|j| (0..8).map(move |i| (i, j))) {
                let same = i == j || i % 4 == j % 4 && element.mass == MassKind::Consistent;
                if same || M[(i, j)] != 0.0 {
                    for k in 0..3 {
                        out.add(element.place(3 * i + k), element.place(3 * j + k), M[(i, j)]);
                    }
                }
            }
        }
    }
}

impl Potential for Elements {
    fn value(&self, q: &[f64]) -> f64 {
        let energy = |(element, C): (&Element, &Matrix6<f64>)| {
            let eps = element.strain(&element.coordinates(q));
            0.5 * element.length * (element.carrying(C, &eps) * eps).dot(&eps) // [6.6]
        };
        self.iter().map(energy).sum()
    }

    fn add_gradient(&self, q: &[f64], scale: f64, out: &mut [f64]) {
        for (element, C) in self.iter() {
            let at = element.within(q);
            let eps = at.strain();
            at.scatter(&(scale * element.length * (element.carrying(C, &eps) * eps)), out);
        }
    }

    fn add_hessian(&self, q: &[f64], scale: f64, out: &mut dyn Entries) {
        for (element, C) in self.iter() {
            let at = element.within(q);
            let eps = at.strain();
            let c = scale * element.length * element.carrying(C, &eps);
            at.emit_tangent(&c, &(c * eps), out);
        }
    }

    fn strain_energy(&self) -> Option<&dyn StrainEnergy> {
        Some(self)
    }
}

impl StrainEnergy for Elements {
    fn stress_count(&self) -> usize {
        6 * self.elements.len()
    }

    fn stresses(&self, q: &[f64], sigma: &mut [f64]) {
        for ((element, C), own) in self.iter().zip(sigma.chunks_exact_mut(6)) {
            let eps = element.strain(&element.coordinates(q));
            own.copy_from_slice((element.carrying(C, &eps) * eps).as_slice());
        }
    }

    fn stress_rates(&self, q: &[f64], v: &[f64], sigma: &mut [f64]) {
        for ((element, C), own) in self.iter().zip(sigma.chunks_exact_mut(6)) {
            let at = element.within(q);
            let C = element.carrying(C, &at.strain());
            own.copy_from_slice((C * at.rate(&element.coordinates(v))).as_slice());
        }
    }

    fn add_stress_force(&self, q: &[f64], sigma: &[f64], scale: f64, out: &mut [f64]) {
        for (element, own) in self.elements.iter().zip(sigma.chunks_exact(6)) {
            let n = scale * element.length * Strain::from_column_slice(own);
            element.within(q).scatter(&n, out);
        }
    }

    fn add_stressed_hessian(&self, q: &[f64], sigma: &[f64], scale: f64, out: &mut dyn Entries) {
        for ((element, C), own) in self.iter().zip(sigma.chunks_exact(6)) {
            let weight = scale * element.length;
            let n = weight * Strain::from_column_slice(own);
            let at = element.within(q);
            let C = element.carrying(C, &at.strain());
            at.emit_tangent(&(weight * C), &n, out);
        }
    }

    fn add_geometric_stiffness(&self, q: &[f64], sigma: &[f64], scale: f64, out: &mut dyn Entries) {
        for (element, own) in self.elements.iter().zip(sigma.chunks_exact(6)) {
            let n = scale * element.length * Strain::from_column_slice(own);
            element.within(q).emit_tangent(&Matrix6::zeros(), &n, out);
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use nalgebra::DMatrix;
    use vi_testkit::Sample;

    /// Three random nodes joined by two elements of different sections.
    pub(crate) fn random_elements(sample: &mut Sample) -> (Elements, Vec<f64>) {
        let q: Vec<f64> = (0..3).flat_map(|_| sample.frame()).collect();
        let mut elements = Elements::new();
        for k in 0..2 {
            let stiffness = sample.array::<6>().map(|x| 2.0 + x);
            let section = Section::new(stiffness, [1.3, 0.2, 0.4, 0.0]).unwrap();
            let section = elements.add_section(section);
            let reference = sample.array::<6>().into();
            let nodes = [[0, 1], [2, 1]][k];
            let mass = MassKind::Consistent;
            let law = StrainLaw::MeanDirectors;
            elements.add(Element { nodes, length: 0.8, section, reference, mass, law }).unwrap();
        }
        (elements, q)
    }

    #[test]
    fn derivatives_match_central_differences() {
        for kind in [ElementKind::MeanDirectors, ElementKind::Helicoidal, ElementKind::SecondOrder]
        {
            check_derivatives(kind);
        }
    }

    /// The same elements with other strains, stress-free elsewhere.
    pub(crate) fn with_strains(mut elements: Elements, kind: ElementKind, q: &[f64]) -> Elements {
        let own = 0..elements.list().len();
        elements.set_strains(own, kind, q).unwrap();
        elements
    }

    /// Three nodes as those of [`random_elements`] stand in a beam: triads differ little, the
    /// second is before the others.
    pub(crate) fn near_frames(sample: &mut Sample) -> Vec<f64> {
        let first = sample.frame();
        let along = [-0.8, 0.0, -0.7];
        let center = |i: usize| if i % 12 < 3 { along[i / 12] * first[9 + i % 12] } else { 0.0 };
        (0..36).map(|i| first[i % 12] + center(i) + 0.1 * sample.number()).collect()
    }

    fn check_derivatives(kind: ElementKind) {
        let mut sample = Sample::new(11);
        let (elements, mut q) = random_elements(&mut sample);
        let elements = match kind {
            ElementKind::MeanDirectors => elements,
            _ => {
                q = near_frames(&mut sample);
                with_strains(elements, kind, &q)
            }
        };
        let q: Vec<f64> = q.iter().map(|q| q + 0.05 * sample.number()).collect();
        assert!(elements.value(&q).is_finite());
        let gradient = |q: &[f64]| {
            let mut out = vec![0.0; 36];
            elements.add_gradient(q, 1.0, &mut out);
            out
        };
        let mut hessian = DMatrix::zeros(36, 36);
        elements.add_hessian(&q, 1.0, &mut hessian);
        let (e, mut worst) = (1e-5, [0.0_f64; 2]);
        for j in 0..36 {
            let at = |by: f64| {
                let mut q = q.clone();
                q[j] += by;
                q
            };
            let (plus, minus) = (at(e), at(-e));
            let slope = (elements.value(&plus) - elements.value(&minus)) / (2.0 * e);
            worst[0] = worst[0].max((slope - gradient(&q)[j]).abs());
            let (plus, minus) = (gradient(&plus), gradient(&minus));
            for i in 0..36 {
                let bend = (plus[i] - minus[i]) / (2.0 * e);
                worst[1] = worst[1].max((bend - hessian[(i, j)]).abs());
            }
        }
        println!("{kind:?}: gradient off by {:.1e}, Hessian by {:.1e}", worst[0], worst[1]);
        assert!(worst[0] < 1e-7 && worst[1] < 1e-7, "{worst:?}");
        let asymmetry = (&hessian - hessian.transpose()).amax();
        assert!(asymmetry < 1e-14, "{asymmetry:e}");
    }

    /// `∫ f² dξ` of `f = ½(a + b) + ξ (b − a) + ½ (ξ² − ¼) d` by three Gauss points.
    fn quadratic_mean(a: f64, b: f64, d: f64) -> f64 {
        let at = |xi: f64| 0.5 * (a + b) + xi * (b - a) + 0.5 * (xi * xi - 0.25) * d;
        let far = 0.5 * 0.6_f64.sqrt();
        (5.0 * (at(far).powi(2) + at(-far).powi(2)) + 8.0 * at(0.0).powi(2)) / 18.0
    }

    #[test]
    fn the_mass_is_that_of_the_interpolation() {
        let mut sample = Sample::new(12);
        let (mut elements, _) = random_elements(&mut sample);
        let v: Vec<f64> = (0..36).map(|_| sample.number()).collect();
        for kind in [MassKind::Consistent, MassKind::Lumped, MassKind::Quadratic] {
            let mut M = DMatrix::zeros(36, 36);
            elements.set_mass(0..elements.list().len(), kind);
            elements.emit_mass(&mut M);
            let v = nalgebra::DVector::from_column_slice(&v);
            let energy = 0.5 * v.dot(&(&M * &v));
            let mut expected = 0.0;
            for element in elements.list() {
                let [a, b] = element.nodes.map(|k| v.rows(12 * k, 12));
                for row in 0..12 {
                    let m = element.length * elements.section(element).inertia()[row / 3];
                    let (a, b, d) = (a[row], b[row], b[9 + row % 3] - a[9 + row % 3]);
                    expected += 0.5
                        * m
                        * match kind {
                            MassKind::Consistent => (a * a + a * b + b * b) / 3.0,
                            MassKind::Quadratic if row < 3 => quadratic_mean(a, b, 0.8 * d),
                            _ => 0.5 * (a * a + b * b),
                        };
                }
            }
            assert!((energy - expected).abs() < 1e-14, "{kind:?}: {energy} against {expected}");
            let total = M.iter().sum::<f64>();
            let sum: f64 = 2.0 * 0.8 * 3.0 * (1.3 + 0.2 + 0.4);
            assert!((total - sum).abs() < 1e-13, "{total} against {sum}");
        }
    }

    #[test]
    fn impossible_elements_are_refused() {
        let mut elements = Elements::new();
        let q = [0.0; 24];
        let missing = elements.add_stress_free([0, 1], 1.0, 0, &q).unwrap_err().to_string();
        assert_eq!(missing, "element 0 names section 0, but there are 0");
        elements.add_section(Section::new([1.0; 6], [1.0; 4]).unwrap());
        assert!(elements.add_stress_free([1, 1], 1.0, 0, &q).is_err());
        assert!(elements.add_stress_free([0, 1], f64::NAN, 0, &q).is_err());
        elements.add_stress_free([0, 1], 1.0, 0, &q).unwrap();
    }
}
