//! The two-node element and the elastic energy of a set of elements.
//!
//! ```text
//! V_e   = ½ ℓ Σ C_i ε_i²
//! ∇V_e  = ℓ Σ C_i ε_i 𝔹_i x
//! ∇²V_e = ℓ Σ C_i [ 𝔹_i x (𝔹_i x)ᵀ + ε_i 𝔹_i ]
//! M_e   = ℓ [1/3 1/6; 1/6 1/3] ⊗ diag(Aρ, I_1ρ, I_2ρ, I_3ρ) ⊗ I_3         (lumped: ½, ½)
//! ```
//! One quadrature point, so shear does not lock. `M_e` is constant and, with `I_3ρ = 0`, singular;
//! `PᵀMP` is not. The limit of the element: nodes rotated relative to each other by `θ` carry the
//! moment `EI sin θ cos θ/ℓ` at most, `EI/(2ℓ)` at 45°.
//!
//! Source: theory §6.
#![allow(non_snake_case)] // M, V

use crate::section::Section;
use crate::strain::{self, ElementCoordinates, SIZE, Strain, StrainGradients};
use nalgebra::SMatrix;
use std::ops::Range;
use vi_core::potential::Potential;
use vi_core::sparse::{Entries, OuterProduct};

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
    /// The nodes of a mesh do not fit elements of this order.
    #[error(
        "elements with {order} intervals each cannot be made of {intervals} intervals of the mesh; \
         the order must be 2 or 3 and divide their number"
    )]
    Order {
        /// Intervals of an element.
        order: usize,
        /// Intervals of the mesh.
        intervals: usize,
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

/// Two nodes, a reference length, a section, reference strains.
#[derive(Clone, Copy, Debug, PartialEq)]
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
}

impl Element {
    /// `x`, from the coordinates of all frames.
    #[must_use]
    #[inline]
    pub fn coordinates(&self, q: &[f64]) -> ElementCoordinates {
        let [a, b] = self.nodes.map(|node| 12 * node);
        let (a, b) = (&q[a..a + 12], &q[b..b + 12]);
        ElementCoordinates::from_fn(|i, _| if i < 12 { a[i] } else { b[i - 12] })
    }

    /// `ε(x)`.
    #[must_use]
    pub fn strain(&self, x: &ElementCoordinates) -> Strain {
        strain::forms(x, self.length) - self.reference
    }

    /// Columns `𝔹_i x`.
    #[must_use]
    pub fn gradients(&self, x: &ElementCoordinates) -> StrainGradients {
        strain::gradients(x, self.length)
    }

    /// `Σ n_i 𝔹_i x`.
    #[must_use]
    pub fn force(&self, x: &ElementCoordinates, n: &Strain) -> ElementCoordinates {
        strain::force(x, self.length, n)
    }

    /// `Σ c_i (𝔹_i x)(𝔹_i x)ᵀ + Σ n_i 𝔹_i`: material and geometric part of a tangent.
    #[must_use]
    pub fn tangent(
        &self,
        x: &ElementCoordinates,
        c: &Strain,
        n: &Strain,
    ) -> SMatrix<f64, SIZE, SIZE> {
        self.product(x, x, c, n)
    }

    /// `Σ c_i (𝔹_i x)(𝔹_i y)ᵀ + Σ n_i 𝔹_i`.
    #[must_use]
    pub fn product(
        &self,
        x: &ElementCoordinates,
        y: &ElementCoordinates,
        c: &Strain,
        n: &Strain,
    ) -> SMatrix<f64, SIZE, SIZE> {
        let (columns, mut weighted) = (self.gradients(x), self.gradients(y));
        for i in 0..6 {
            weighted.column_mut(i).scale_mut(c[i]);
        }
        let mut K = columns * weighted.transpose();
        let B = strain::weighted_matrix(n, self.length);
        for (i, j) in (0..8).flat_map(|j| (0..8).map(move |i| (i, j))) {
            (0..3).for_each(|k| K[(3 * i + k, 3 * j + k)] += B[(i, j)]);
        }
        K
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

    /// Emits `Σ c_i (𝔹_i x)(𝔹_i y)ᵀ`.
    pub fn emit_outer(
        &self,
        x: &ElementCoordinates,
        y: &ElementCoordinates,
        c: &Strain,
        out: &mut dyn Entries,
    ) {
        let (mut left, right) = (self.gradients(x), self.gradients(y));
        for i in 0..6 {
            left.column_mut(i).scale_mut(c[i]);
        }
        let (starts, length) = (&self.nodes.map(|node| 12 * node), 12);
        let (left, right) = (left.as_slice(), right.as_slice());
        out.add_outer(&OuterProduct { starts, length, left, right });
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

/// How the mass of an element is distributed to its nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MassKind {
    /// `[1/3 1/6; 1/6 1/3]`: of the linear interpolation.
    #[default]
    Consistent,
    /// `½, ½` on the diagonal.
    Lumped,
}

/// Elements with their sections: one potential for all of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Elements {
    sections: Vec<Section>,
    elements: Vec<Element>,
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
        let index = self.add(Element { nodes, length, section, reference, mass })?;
        let x = self.elements[index].coordinates(q);
        self.elements[index].reference = strain::forms(&x, length);
        Ok(index)
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

    /// `C` of an element.
    #[must_use]
    pub fn stiffness(&self, element: &Element) -> Strain {
        Strain::from(*self.section(element).stiffness())
    }

    /// Elements with their stiffness `C`.
    pub fn iter(&self) -> impl Iterator<Item = (&Element, Strain)> {
        self.elements.iter().map(|element| (element, self.stiffness(element)))
    }

    /// Emits the mass matrix of all elements.
    pub fn emit_mass(&self, out: &mut dyn Entries) {
        for element in &self.elements {
            let (own, coupling) = match element.mass {
                MassKind::Consistent => (1.0 / 3.0, Some(1.0 / 6.0)),
                MassKind::Lumped => (0.5, None),
            };
            for row in 0..12 {
                let per_length = self.section(element).inertia()[row / 3];
                let mass = element.length * per_length;
                let (a, b) = (element.place(row), element.place(12 + row));
                out.add(a, a, own * mass);
                out.add(b, b, own * mass);
                if let Some(coupling) = coupling {
                    out.add(a, b, coupling * mass);
                    out.add(b, a, coupling * mass);
                }
            }
        }
    }
}

impl Potential for Elements {
    fn value(&self, q: &[f64]) -> f64 {
        let energy = |(element, C): (&Element, Strain)| {
            let eps = element.strain(&element.coordinates(q));
            0.5 * element.length * C.component_mul(&eps).dot(&eps) // [6.6]
        };
        self.iter().map(energy).sum()
    }

    fn add_gradient(&self, q: &[f64], scale: f64, out: &mut [f64]) {
        for (element, C) in self.iter() {
            let x = element.coordinates(q);
            let n = scale * element.length * C.component_mul(&element.strain(&x));
            element.scatter(&element.force(&x, &n), out);
        }
    }

    fn add_hessian(&self, q: &[f64], scale: f64, out: &mut dyn Entries) {
        for (element, C) in self.iter() {
            let x = element.coordinates(q);
            let c = scale * element.length * C;
            let n = c.component_mul(&element.strain(&x));
            element.emit(&element.tangent(&x, &c, &n), out);
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
            elements.add(Element { nodes, length: 0.8, section, reference, mass }).unwrap();
        }
        (elements, q)
    }

    #[test]
    fn derivatives_match_central_differences() {
        let mut sample = Sample::new(11);
        let (elements, q) = random_elements(&mut sample);
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
        println!("gradient off by {:.1e}, Hessian by {:.1e}", worst[0], worst[1]);
        assert!(worst[0] < 1e-7 && worst[1] < 1e-7, "{worst:?}");
        let asymmetry = (&hessian - hessian.transpose()).amax();
        assert!(asymmetry < 1e-14, "{asymmetry:e}");
    }

    #[test]
    fn the_mass_is_that_of_the_interpolation() {
        let mut sample = Sample::new(12);
        let (mut elements, _) = random_elements(&mut sample);
        let v: Vec<f64> = (0..36).map(|_| sample.number()).collect();
        for kind in [MassKind::Consistent, MassKind::Lumped] {
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
                    let (a, b) = (a[row], b[row]);
                    expected += 0.5
                        * m
                        * match kind {
                            MassKind::Consistent => (a * a + a * b + b * b) / 3.0,
                            MassKind::Lumped => 0.5 * (a * a + b * b),
                        };
                }
            }
            assert!((energy - expected).abs() < 1e-14, "{kind:?}: {energy} against {expected}");
            let total = M.view((0, 0), (36, 36)).iter().sum::<f64>();
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
