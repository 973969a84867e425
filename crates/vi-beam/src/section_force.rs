//! Strains, section forces and the centre line along a beam.
//!
//! ```text
//! (N_1, N_2, N_3) = (GA_1Γ_1, GA_2Γ_2, EAΓ_3)       shear forces, normal force
//! (M_1, M_2, M_3) = (EI_1K_1, EI_2K_2, GJK_3)       bending moments, twisting moment
//! n = N_I d̄_I,   m = M_I d̄_I                        spatial
//! ```
//! One value for each two-node element, at its middle, where it is of second order; within a
//! helicoidal element the moment is linear, `m' = −K×m − G×n`; one for each Gauss point of an
//! element of higher order. The centre line of an element is its chord; for pictures,
//! [`center_line`] draws a cubic through the nodes with the mean slope of both neighbours.

#![allow(non_snake_case)] // R, G, K

use crate::element::{ElementKind, StrainLaw};
use crate::helicoidal::{join, split};
use crate::model::{Beam, BeamElements};
pub use crate::section_state::SectionState;
use crate::section_state::Station;
use nalgebra::Vector3;
use vi_rigid::directors::{self, center};
use vi_rigid::rotation;

/// The states along a beam in the configuration `q`.
#[must_use]
pub fn section_states(model: &BeamElements, beam: &Beam, q: &[f64]) -> Vec<SectionState> {
    let mut states = Vec::with_capacity(beam.elements.len() * beam.order);
    for_each_state(model, beam, q, |state| states.push(state));
    states
}

/// The same, one after the other.
pub fn for_each_state(
    model: &BeamElements,
    beam: &Beam,
    q: &[f64],
    mut visit: impl FnMut(SectionState),
) {
    let mut start = 0.0;
    for (k, index) in beam.elements.clone().enumerate() {
        if beam.order > 1 {
            let stations = model.high_order.section_stations(index, q);
            stations.for_each(|station| visit(station.state(k, start)));
            start += model.high_order.length(index);
            continue;
        }
        let length = model.elements.list()[index].length;
        visit(two_node(model, index, q, 0.0).state(k, start));
        start += length;
    }
}

/// The section of a two-node element that is `off` its middle, m; of helicoidal elements with the
/// moment that is linear along them, others are constant.
fn two_node(model: &BeamElements, index: usize, q: &[f64], off: f64) -> Station {
    let element = &model.elements.list()[index];
    let x = element.coordinates(q);
    let strain = element.strain(&x);
    let stress = model.elements.stiffness(element) * strain;
    let [a, b] = element.nodes.map(|node| &q[12 * node..12 * node + 12]);
    let point = 0.5 * (center(a) + center(b));
    let mean = 0.5 * (directors::triad(a) + directors::triad(b));
    let (along, length) = (0.5 * element.length + off, element.length);
    let StrainLaw::Helicoidal(law) = &element.law else {
        let directors = std::array::from_fn(|i| mean.column(i).into());
        return Station { along, length, point, directors, strain, stress };
    };
    let R = law.middle(&x, &mean);
    let (G, K) = split(&element.measures(&x));
    let (n, m) = split(&stress);
    let turn = rotation::exp(&(off * K)); // from the middle to the section
    let here = |v: Vector3<f64>| turn.tr_mul(&v);
    let moved = join(&here(n), &here(m - off * G.cross(&n))); // m' = −K×m − G×n
    let strain = strain + model.elements.section(element).compliance_matrix() * (moved - stress);
    let (point, R) = (point + off * (R * G), R * turn);
    let directors = std::array::from_fn(|i| R.column(i).into());
    Station { along, length, point, directors, strain, stress: moved }
}

/// A place of a beam where strains and section forces are read: weights of the sections next to it.
#[derive(Clone, Debug, PartialEq)]
pub struct SectionPlace {
    part: Beam,
    weights: Vec<f64>, // of the sections of the part
    off: f64,          // m  from the middle of a helicoidal element
}

impl SectionPlace {
    /// In the initial configuration `q` the mean over an element, counted along the beam from 0:
    /// its middle, or its Gauss points by their lengths.
    ///
    /// # Panics
    /// When there is no such element.
    #[must_use]
    pub fn of_element(model: &BeamElements, beam: &Beam, element: usize, q: &[f64]) -> Self {
        let part = part(beam, element..element + 1);
        let states = section_states(model, &part, q);
        let length: f64 = states.iter().map(|state| state.length).sum();
        let weights = states.iter().map(|state| state.length / length).collect();
        Self { part, weights, off: 0.0 }
    }

    /// In the initial configuration `q` at the reference arc length `along` from the start of the
    /// beam, m. Within a helicoidal element with its linear moment; between elements of mean
    /// directors linear through their middles, where a load on a node smears over its two elements;
    /// the polynomial through the Gauss points of an element of higher order. Of order 2 in the
    /// length of two-node elements where section forces are smooth.
    ///
    /// # Panics
    /// When the beam has no elements.
    #[must_use]
    pub fn at(model: &BeamElements, beam: &Beam, along: f64, q: &[f64]) -> Self {
        let count = beam.elements.len();
        let length = |k: usize| model.intervals(beam, beam.elements.start + k).sum::<f64>();
        let (mut element, mut start) = (0, 0.0);
        while element + 1 < count && along > start + length(element) {
            start += length(element);
            element += 1;
        }
        let index = beam.elements.start + element;
        let law = model.elements.list().get(index).map(|element| element.law.kind());
        if beam.order == 1 && law != Some(ElementKind::MeanDirectors) {
            let off = along - start - 0.5 * length(element);
            return Self { part: part(beam, element..element + 1), weights: vec![1.0], off };
        }
        let elements = match (beam.order, count) {
            (1, 2..) => {
                let second = along - start >= 0.5 * length(element);
                let first = if second { element.min(count - 2) } else { element.saturating_sub(1) };
                start -= if first < element { length(first) } else { 0.0 };
                first..first + 2
            }
            _ => element..element + 1,
        };
        let part = part(beam, elements);
        let states = section_states(model, &part, q);
        let s: Vec<f64> = states.iter().map(|state| start + state.arc_length).collect();
        let lagrange = |i: usize| {
            let others = s.iter().enumerate().filter(|(j, _)| *j != i);
            others.map(|(_, other)| (along - other) / (s[i] - other)).product()
        };
        Self { part, weights: (0..s.len()).map(lagrange).collect(), off: 0.0 }
    }

    /// A quantity of a section there, in the configuration `q`.
    #[must_use]
    pub fn read<const N: usize>(
        &self,
        model: &BeamElements,
        q: &[f64],
        quantity: impl Fn(&SectionState) -> [f64; N],
    ) -> [f64; N] {
        if self.off != 0.0 {
            return quantity(&two_node(model, self.part.elements.start, q, self.off).state(0, 0.0));
        }
        let (mut sum, mut weights) = ([0.0; N], self.weights.iter());
        for_each_state(model, &self.part, q, |state| {
            let weight = weights.next().copied().unwrap_or_default();
            sum.iter_mut().zip(quantity(&state)).for_each(|(sum, value)| *sum += weight * value);
        });
        sum
    }
}

/// Some elements of a beam, counted from 0.
fn part(beam: &Beam, elements: std::ops::Range<usize>) -> Beam {
    let node = |element: usize| beam.nodes.start + element * beam.order;
    let nodes = node(elements.start)..node(elements.end) + 1;
    let first = beam.elements.start;
    Beam { nodes, elements: first + elements.start..first + elements.end, order: beam.order }
}

/// Points of the interpolated centre line, `per_interval` between two nodes and the last node.
#[must_use]
pub fn center_line(
    model: &BeamElements,
    beam: &Beam,
    q: &[f64],
    per_interval: usize,
) -> Vec<Vector3<f64>> {
    let lengths: Vec<f64> = beam.elements.clone().flat_map(|e| model.intervals(beam, e)).collect();
    let nodes: Vec<_> = beam.nodes.clone().map(|k| center(&q[12 * k..12 * k + 12])).collect();
    cubic_line(&nodes, &lengths, per_interval)
}

/// Points of a cubic through `nodes` that are `lengths` apart, `per_interval` in each interval and
/// the last node.
#[must_use]
pub fn cubic_line(
    nodes: &[Vector3<f64>],
    lengths: &[f64],
    per_interval: usize,
) -> Vec<Vector3<f64>> {
    let chords: Vec<_> =
        nodes.windows(2).zip(lengths).map(|(pair, length)| (pair[1] - pair[0]) / *length).collect();
    let slope = |k: usize| {
        let (before, after) = (k.checked_sub(1).map(|i| chords[i]), chords.get(k).copied());
        match (before, after) {
            (Some(x), Some(y)) => 0.5 * (x + y),
            (Some(x), None) if k >= 2 => 1.5 * x - 0.5 * chords[k - 2],
            (None, Some(y)) if chords.len() >= 2 => 1.5 * y - 0.5 * chords[1],
            (x, y) => x.or(y).unwrap_or_else(Vector3::zeros),
        }
    };
    let mut points = Vec::with_capacity(lengths.len() * per_interval + 1);
    for (k, length) in lengths.iter().enumerate() {
        let (a, b) = (nodes[k], nodes[k + 1]);
        let (da, db) = (*length * slope(k), *length * slope(k + 1));
        for i in 0..per_interval {
            let t = i as f64 / per_interval as f64;
            let (s, t2) = (1.0 - t, t * t);
            points.push(
                s * s * (1.0 + 2.0 * t) * a + t2 * (3.0 - 2.0 * t) * b + s * s * t * da
                    - t2 * s * db,
            );
        }
    }
    points.extend(nodes.last());
    points
}
