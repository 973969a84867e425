//! Elements with three or four nodes and reduced quadrature.
//!
//! ```text
//! V   = Σ_g ½ w_g Σ_i C_i ε_i²                        one Gauss point less than nodes
//! Γ_I = d̄_I·φ' − (·)_0,      d̄_I = Σ_j N_j d_I^j,   φ' = Σ_j N'_j φ^j
//! K_1 = ½ Σ_{j<k} (N_jN'_k − N_kN'_j)(d_3^j·d_2^k − d_2^j·d_3^k) − (·)_0,   cyclic
//! M   = ∫ N_j N_k ds ⊗ diag(Aρ, I_1ρ, I_2ρ, I_3ρ) ⊗ I_3
//! ```
//! The strains are quadratic forms as those of the two-node element and invariant for the same
//! reason; both discrete potentials exist. The nodes of an element are equally spaced in arc
//! length. Displacements of the nodes converge with order 4, measured, for three nodes and for
//! four: interpolated directors miss their unit length between the nodes, which limits the order;
//! four nodes have the smaller error.
//!
//! Letters: `N_j(s)` Lagrange polynomials, `w_g` weight (m) of a Gauss point.
#![allow(non_snake_case)] // N, C, M, K

mod averaged;

pub use averaged::AveragedHighOrder;

use crate::section::Section;
use crate::section_state::Station;
use crate::strain::Strain;
use crate::strained::Strained;
use nalgebra::{Matrix6, Vector3};
use std::ops::Range;
use vi_core::potential::Potential;
use vi_core::sparse::{Entries, OuterProduct};
use vi_core::strain_energy::StrainEnergy;

const MOST: usize = 4; // nodes of an element
/// Gauss points and weights on `[−1, 1]`.
const GAUSS: [&[(f64, f64)]; 3] = [
    &[(-0.577_350_269_189_625_8, 1.0), (0.577_350_269_189_625_8, 1.0)],
    &[
        (-0.774_596_669_241_483_4, 5.0 / 9.0),
        (0.0, 8.0 / 9.0),
        (0.774_596_669_241_483_4, 5.0 / 9.0),
    ],
    &[
        (-0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
        (-0.339_981_043_584_856_26, 0.652_145_154_862_546_2),
        (0.339_981_043_584_856_26, 0.652_145_154_862_546_2),
        (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
    ],
];

/// A Gauss point.
#[derive(Clone, Copy, Debug, PartialEq)]
struct IntegrationPoint {
    nodes: [usize; MOST],
    count: usize,
    shape: [f64; MOST], // N_j
    slope: [f64; MOST], // N'_j, 1/m
    weight: f64,        // m
    section: Section,
    reference: Strain,
}

/// An element as a list of Gauss points.
#[derive(Clone, Debug, PartialEq)]
struct Member {
    stations: Range<usize>,
    length: f64, // m
}

/// `𝔹_i x` at one Gauss point, one vector for each node and slot `φ, d_1, d_2, d_3`.
type PointGradients = [[[Vector3<f64>; 4]; MOST]; 6];

fn vector(q: &[f64], node: usize, slot: usize) -> Vector3<f64> {
    let at = 12 * node + 3 * slot;
    Vector3::new(q[at], q[at + 1], q[at + 2])
}

impl IntegrationPoint {
    fn members(&self) -> impl Iterator<Item = (usize, usize)> {
        self.nodes.into_iter().take(self.count).enumerate()
    }

    fn sum(&self, q: &[f64], factors: &[f64; MOST], slot: usize) -> Vector3<f64> {
        self.members().map(|(j, node)| factors[j] * vector(q, node, slot)).sum()
    }

    /// `N_jN'_k − N_kN'_j`.
    fn wedge(&self, j: usize, k: usize) -> f64 {
        self.shape[j] * self.slope[k] - self.shape[k] * self.slope[j]
    }

    fn strain(&self, q: &[f64]) -> Strain {
        let slope = self.sum(q, &self.slope, 0);
        let mut out = -self.reference;
        for i in 0..3 {
            let (second, third) = (1 + (i + 1) % 3, 1 + (i + 2) % 3);
            out[i] += self.sum(q, &self.shape, 1 + i).dot(&slope);
            for (j, a) in self.members() {
                for (k, b) in self.members().skip(j + 1) {
                    let product = vector(q, a, third).dot(&vector(q, b, second))
                        - vector(q, a, second).dot(&vector(q, b, third));
                    out[3 + i] += 0.5 * self.wedge(j, k) * product;
                }
            }
        }
        out
    }

    fn gradients(&self, q: &[f64]) -> PointGradients {
        let mut out = [[[Vector3::zeros(); 4]; MOST]; 6];
        let slope = self.sum(q, &self.slope, 0);
        for i in 0..3 {
            let (second, third) = (1 + (i + 1) % 3, 1 + (i + 2) % 3);
            let mean = self.sum(q, &self.shape, 1 + i);
            for (j, _) in self.members() {
                out[i][j][0] = self.slope[j] * mean;
                out[i][j][1 + i] = self.shape[j] * slope;
                for (k, b) in self.members() {
                    let factor = 0.5 * self.wedge(j, k);
                    out[3 + i][j][third] += factor * vector(q, b, second);
                    out[3 + i][j][second] -= factor * vector(q, b, third);
                }
            }
        }
        out
    }

    /// `∇ε·v`.
    fn strain_rates(&self, q: &[f64], v: &[f64]) -> Strain {
        let gradients = self.gradients(q);
        let mut rates = Strain::zeros();
        for ((j, node), slot) in self.members().flat_map(|at| (0..4).map(move |slot| (at, slot))) {
            let own = vector(v, node, slot);
            rates.iter_mut().zip(&gradients).for_each(|(rate, g)| *rate += g[j][slot].dot(&own));
        }
        rates
    }

    fn stiffness(&self) -> Matrix6<f64> {
        self.section.stiffness_matrix()
    }

    /// `out ← out + Σ n_i 𝔹_i x`.
    fn add(&self, q: &[f64], n: &Strain, out: &mut [f64]) {
        let gradients = self.gradients(q);
        for (j, node) in self.members() {
            for slot in 0..4 {
                let sum: Vector3<f64> = (0..6).map(|i| n[i] * gradients[i][j][slot]).sum();
                (0..3).for_each(|k| out[12 * node + 3 * slot + k] += sum[k]);
            }
        }
    }

    /// Emits `Σ c_ij (𝔹_i x)(𝔹_j y)ᵀ + Σ n_i 𝔹_i`.
    fn emit(
        &self,
        [left, right]: [&PointGradients; 2],
        c: &Matrix6<f64>,
        n: &Strain,
        out: &mut dyn Entries,
    ) {
        let left = weighted(left, c);
        for ((j, a), (k, b)) in self.members().flat_map(|x| self.members().map(move |y| (x, y))) {
            for (r, s) in (0..4).flat_map(|r| (0..4).map(move |s| (r, s))) {
                let diagonal = self.geometric(j, r, k, s, n);
                for (x, y) in (0..3).flat_map(|x| (0..3).map(move |y| (x, y))) {
                    let product: f64 = (0..6).map(|i| left[i][j][r][x] * right[i][k][s][y]).sum();
                    let value = product + if x == y { diagonal } else { 0.0 };
                    out.add(12 * a + 3 * r + x, 12 * b + 3 * s + y, value);
                }
            }
        }
    }

    /// Emits `Σ c_ij (𝔹_i x)(𝔹_j y)ᵀ`.
    fn emit_outer(
        &self,
        [left, right]: [&PointGradients; 2],
        c: &Matrix6<f64>,
        out: &mut dyn Entries,
    ) {
        let left = weighted(left, c);
        let (mut a, mut b) = ([0.0; 12 * 6 * MOST], [0.0; 12 * 6 * MOST]);
        let size = 12 * self.count;
        for i in 0..6 {
            for (j, slot) in (0..self.count).flat_map(|j| (0..4).map(move |slot| (j, slot))) {
                let at = size * i + 12 * j + 3 * slot;
                a[at..at + 3].copy_from_slice(left[i][j][slot].as_slice());
                b[at..at + 3].copy_from_slice(right[i][j][slot].as_slice());
            }
        }
        let starts = self.nodes.map(|node| 12 * node);
        let (starts, length) = (&starts[..self.count], 12);
        let (left, right) = (&a[..6 * size], &b[..6 * size]);
        out.add_outer(&OuterProduct { starts, length, left, right });
    }

    /// Entry of `Σ n_i B_i` between the vectors `(node, slot)`.
    fn geometric(&self, j: usize, r: usize, k: usize, s: usize, n: &Strain) -> f64 {
        match (r, s) {
            (0, 0) => 0.0,
            (0, s) => n[s - 1] * self.slope[j] * self.shape[k],
            (r, 0) => n[r - 1] * self.shape[j] * self.slope[k],
            (r, s) if r == s => 0.0,
            (r, s) => {
                // K_i pairs third·second with the sign +, second·third with −
                let i = 6 - r - s; // the director that is neither
                let third = 1 + (i + 1) % 3; // i counts from 1
                let sign = if r == third { 1.0 } else { -1.0 };
                sign * 0.5 * n[2 + i] * self.wedge(j, k)
            }
        }
    }
}

/// Gradient `j` of the result is the sum of `c_ij` times gradient `i`.
fn weighted(gradients: &PointGradients, c: &Matrix6<f64>) -> PointGradients {
    let mut out = [[[Vector3::zeros(); 4]; MOST]; 6];
    for (i, j) in (0..6).flat_map(|i| (0..6).map(move |j| (i, j))).filter(|at| c[*at] != 0.0) {
        for (out, own) in out[j].as_flattened_mut().iter_mut().zip(gradients[i].as_flattened()) {
            *out += c[(i, j)] * own;
        }
    }
    out
}

impl Strained for IntegrationPoint {
    fn stiffness(&self) -> Matrix6<f64> {
        self.weight * IntegrationPoint::stiffness(self)
    }

    fn is_damped(&self) -> bool {
        self.section.is_damped()
    }

    fn viscosity(&self) -> Matrix6<f64> {
        self.weight * self.section.viscosity()
    }

    fn strain(&self, q: &[f64]) -> Strain {
        IntegrationPoint::strain(self, q)
    }

    fn strain_rate(&self, q: &[f64], v: &[f64]) -> Strain {
        let gradients = self.gradients(q);
        let along = |i: usize, j: usize, node: usize| -> f64 {
            (0..4).map(|slot| gradients[i][j][slot].dot(&vector(v, node, slot))).sum()
        };
        Strain::from_fn(|i, _| self.members().map(|(j, node)| along(i, j, node)).sum())
    }

    fn add(&self, q: &[f64], n: &Strain, out: &mut [f64]) {
        IntegrationPoint::add(self, q, n, out);
    }

    fn emit(&self, q: &[f64], c: &Matrix6<f64>, n: &Strain, out: &mut dyn Entries) {
        let gradients = self.gradients(q);
        IntegrationPoint::emit(self, [&gradients; 2], c, n, out);
    }

    fn emit_rates(&self, [q, v]: [&[f64]; 2], c: &Matrix6<f64>, n: &Strain, out: &mut dyn Entries) {
        // 𝔹 v is the gradient of (𝔹 q)·v
        IntegrationPoint::emit(self, [&self.gradients(q), &self.gradients(v)], c, n, out);
    }

    fn emit_outer(&self, a: &[f64], b: &[f64], c: &Matrix6<f64>, out: &mut dyn Entries) {
        IntegrationPoint::emit_outer(self, [&self.gradients(a), &self.gradients(b)], c, out);
    }
}

/// Elements with three or four nodes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HighOrderElements {
    elements: Vec<Member>,
    stations: Vec<IntegrationPoint>,
    pairs: Vec<[usize; 2]>,                  // neighbouring nodes
    mass: Vec<(usize, usize, f64, Section)>, // node, node, ∫N_jN_k ds, section
}

/// `N_j` and `dN_j/dξ` of equally spaced nodes on `[−1, 1]`.
fn lagrange(count: usize, xi: f64) -> ([f64; MOST], [f64; MOST]) {
    let node = |j: usize| 2.0 * j as f64 / (count - 1) as f64 - 1.0;
    let (mut shape, mut slope) = ([0.0; MOST], [0.0; MOST]);
    for j in 0..count {
        let others = || (0..count).filter(move |&k| k != j);
        shape[j] = others().map(|k| (xi - node(k)) / (node(j) - node(k))).product();
        slope[j] = others()
            .map(|l| {
                let rest = others().filter(|&k| k != l);
                let product: f64 = rest.map(|k| (xi - node(k)) / (node(j) - node(k))).product();
                product / (node(j) - node(l))
            })
            .sum();
    }
    (shape, slope)
}

impl HighOrderElements {
    /// The nodes of an element.
    pub(crate) fn nodes(&self, element: usize) -> &[usize] {
        let station = &self.stations[self.elements[element].stations.start];
        &station.nodes[..station.count]
    }

    /// Adds an element of arc length `length` (m) through three or four nodes, stress-free in the
    /// configuration `q`.
    ///
    /// # Panics
    /// When there are not three or four nodes.
    pub fn add_stress_free(&mut self, nodes: &[usize], length: f64, section: &Section, q: &[f64]) {
        let count = nodes.len();
        assert!((3..=MOST).contains(&count), "three or four nodes, not {count}");
        let first = self.stations.len();
        let mut own = [0; MOST];
        own[..count].copy_from_slice(nodes);
        for &(xi, weight) in GAUSS[count - 3] {
            let (shape, slope) = lagrange(count, xi);
            let mut station = IntegrationPoint {
                nodes: own,
                count,
                shape,
                slope: slope.map(|s| 2.0 * s / length),
                weight: 0.5 * length * weight,
                section: *section,
                reference: Strain::zeros(),
            };
            station.reference = station.strain(q);
            self.stations.push(station);
        }
        self.elements.push(Member { stations: first..self.stations.len(), length });
        self.pairs.extend(nodes.windows(2).map(|pair| [pair[0], pair[1]]));
        for j in 0..count {
            for k in 0..count {
                let term = |&(xi, w): &(f64, f64)| {
                    let (shape, _) = lagrange(count, xi);
                    0.5 * length * w * shape[j] * shape[k]
                };
                let integral = GAUSS[2].iter().map(term).sum();
                self.mass.push((nodes[j], nodes[k], integral, *section));
            }
        }
    }

    /// Number of elements.
    #[must_use]
    pub fn count(&self) -> usize {
        self.elements.len()
    }

    /// Arc length of an element, m.
    #[must_use]
    pub fn length(&self, element: usize) -> f64 {
        self.elements[element].length
    }

    pub(crate) fn section(&self, element: usize) -> &Section {
        &self.stations[self.elements[element].stations.start].section
    }

    /// The Gauss points of all elements, each with the index of its element.
    pub(crate) fn each(&self, visit: &mut dyn FnMut(usize, &dyn Strained)) {
        for (index, element) in self.elements.iter().enumerate() {
            let stations = &self.stations[element.stations.clone()];
            stations.iter().for_each(|station| visit(index, station));
        }
    }

    /// Number of Gauss points.
    pub(crate) fn gauss_points(&self) -> usize {
        self.stations.len()
    }

    /// What is deformed at the Gauss points of an element in the configuration `q`.
    pub(crate) fn section_stations<'a>(
        &'a self,
        element: usize,
        q: &'a [f64],
    ) -> impl Iterator<Item = Station> + 'a {
        let Member { stations, length } = &self.elements[element];
        self.stations[stations.clone()].iter().map(move |station| {
            let fraction = |j: usize| j as f64 / (station.count - 1) as f64;
            let along = (0..station.count).map(|j| station.shape[j] * fraction(j)).sum::<f64>();
            let strain = station.strain(q);
            Station {
                along: along * length,
                length: station.weight,
                point: station.sum(q, &station.shape, 0),
                directors: std::array::from_fn(|i| station.sum(q, &station.shape, 1 + i)),
                strain,
                stress: station.stiffness() * strain,
            }
        })
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.stations.is_empty()
    }

    /// Neighbouring nodes of all elements.
    #[must_use]
    pub fn pairs(&self) -> &[[usize; 2]] {
        &self.pairs
    }

    /// Emits the consistent mass matrix.
    pub fn emit_mass(&self, out: &mut dyn Entries) {
        for (a, b, integral, section) in &self.mass {
            for row in 0..12 {
                out.add(12 * a + row, 12 * b + row, integral * section.inertia()[row / 3]);
            }
        }
    }
}

impl Potential for HighOrderElements {
    fn value(&self, q: &[f64]) -> f64 {
        let energy = |station: &IntegrationPoint| {
            let eps = station.strain(q);
            0.5 * station.weight * (station.stiffness() * eps).dot(&eps)
        };
        self.stations.iter().map(energy).sum()
    }

    fn add_gradient(&self, q: &[f64], scale: f64, out: &mut [f64]) {
        for station in &self.stations {
            let n = station.stiffness() * station.strain(q);
            station.add(q, &(scale * station.weight * n), out);
        }
    }

    fn add_hessian(&self, q: &[f64], scale: f64, out: &mut dyn Entries) {
        for station in &self.stations {
            let c = scale * station.weight * station.stiffness();
            let gradients = station.gradients(q);
            let n = c * station.strain(q);
            station.emit([&gradients; 2], &c, &n, out);
        }
    }

    fn strain_energy(&self) -> Option<&dyn StrainEnergy> {
        Some(self)
    }
}

impl StrainEnergy for HighOrderElements {
    fn stress_count(&self) -> usize {
        6 * self.stations.len()
    }

    fn stresses(&self, q: &[f64], sigma: &mut [f64]) {
        for (station, own) in self.stations.iter().zip(sigma.chunks_exact_mut(6)) {
            own.copy_from_slice((station.stiffness() * station.strain(q)).as_slice());
        }
    }

    fn stress_rates(&self, q: &[f64], v: &[f64], sigma: &mut [f64]) {
        for (station, own) in self.stations.iter().zip(sigma.chunks_exact_mut(6)) {
            own.copy_from_slice((station.stiffness() * station.strain_rates(q, v)).as_slice());
        }
    }

    fn add_stress_force(&self, q: &[f64], sigma: &[f64], scale: f64, out: &mut [f64]) {
        for (station, own) in self.stations.iter().zip(sigma.chunks_exact(6)) {
            station.add(q, &(scale * station.weight * Strain::from_column_slice(own)), out);
        }
    }

    fn add_stressed_hessian(&self, q: &[f64], sigma: &[f64], scale: f64, out: &mut dyn Entries) {
        for (station, own) in self.stations.iter().zip(sigma.chunks_exact(6)) {
            let (weight, gradients) = (scale * station.weight, station.gradients(q));
            let n = weight * Strain::from_column_slice(own);
            station.emit([&gradients; 2], &(weight * station.stiffness()), &n, out);
        }
    }

    fn add_geometric_stiffness(&self, q: &[f64], sigma: &[f64], scale: f64, out: &mut dyn Entries) {
        for (station, own) in self.stations.iter().zip(sigma.chunks_exact(6)) {
            let n = scale * station.weight * Strain::from_column_slice(own);
            station.emit([&station.gradients(q); 2], &Matrix6::zeros(), &n, out);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;
    use vi_testkit::Sample;

    #[test]
    fn derivatives_match_central_differences() {
        let mut sample = Sample::new(51);
        let (e, mut worst) = (1e-5, 0.0_f64);
        for count in [3, 4] {
            let n = 12 * count;
            let rest: Vec<f64> = (0..count).flat_map(|_| sample.frame()).collect();
            let q: Vec<f64> = (0..count).flat_map(|_| sample.frame()).collect();
            let stiffness = sample.array::<6>().map(|x| 2.0 + x);
            let section = Section::new(stiffness, [1.0, 0.1, 0.2, 0.0]).unwrap();
            let mut elements = HighOrderElements::default();
            let nodes: Vec<usize> = (0..count).rev().collect();
            elements.add_stress_free(&nodes, 1.7, &section, &rest);
            assert!(elements.value(&rest) < 1e-25 && elements.value(&q) > 0.0);
            let gradient = |q: &[f64]| {
                let mut out = vec![0.0; n];
                elements.add_gradient(q, 1.0, &mut out);
                out
            };
            let mut hessian = DMatrix::zeros(n, n);
            elements.add_hessian(&q, 1.0, &mut hessian);
            let (size, at) = (hessian.amax(), gradient(&q));
            for j in 0..n {
                let (mut plus, mut minus) = (q.clone(), q.clone());
                (plus[j], minus[j]) = (plus[j] + e, minus[j] - e);
                let slope = (elements.value(&plus) - elements.value(&minus)) / (2.0 * e);
                worst = worst.max((slope - at[j]).abs() / size);
                let (plus, minus) = (gradient(&plus), gradient(&minus));
                for i in 0..n {
                    let bend = (plus[i] - minus[i]) / (2.0 * e);
                    worst = worst.max((bend - hessian[(i, j)]).abs() / size);
                }
            }
            let mut mass = DMatrix::zeros(n, n);
            elements.emit_mass(&mut mass);
            assert!((mass.sum() - 1.7 * 3.0 * 1.3).abs() < 1e-13, "{}", mass.sum());
        }
        println!("gradient and Hessian off by {worst:.1e}");
        assert!(worst < 1e-8, "{worst:e}");
    }
}
