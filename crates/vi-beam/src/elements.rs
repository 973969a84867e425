//! The elastic energy and the mass of a set of elements, [`crate::element`].
#![allow(non_snake_case)] // M

use crate::element::{Element, ElementError, ElementKind, StrainLaw};
use crate::mass_kind::MassKind;
use crate::section::Section;
use crate::strain::{self, Strain};
use crate::varying::{MassPoint, SectionPoint, mass_along};
use nalgebra::{Matrix6, SMatrix};
use std::collections::BTreeMap;
use std::ops::Range;
use vi_core::potential::Potential;
use vi_core::sparse::Entries;
use vi_core::strain_energy::StrainEnergy;

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
