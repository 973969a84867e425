//! Strains, section forces and the centre line along a beam.
//!
//! ```text
//! (N_1, N_2, N_3) = (GA_1Γ_1, GA_2Γ_2, EAΓ_3)       shear forces, normal force
//! (M_1, M_2, M_3) = (EI_1K_1, EI_2K_2, GJK_3)       bending moments, twisting moment
//! n = N_I d̄_I,   m = M_I d̄_I                        spatial
//! ```
//! One value for each element, at its middle, where it is of second order (the ends are first order).
//! The centre line of an element is its chord; for pictures, [`center_line`] draws a cubic through the
//! nodes with the mean slope of both neighbours.

use crate::element::Elements;
use crate::model::Beam;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use vi_rigid::directors::{center, director};

/// What an element carries at its middle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SectionState {
    /// Which element.
    pub element: usize,
    /// Reference arc length from the start of the beam, m.
    pub arc_length: f64,
    /// Midpoint of the chord, m.
    pub point: [f64; 3],
    /// `Γ_1, Γ_2, Γ_3`.
    pub shear_extension: [f64; 3],
    /// `K_1, K_2, K_3`, 1/m.
    pub curvature: [f64; 3],
    /// `N_1, N_2, N_3`, N.
    pub force: [f64; 3],
    /// `M_1, M_2, M_3`, N·m.
    pub moment: [f64; 3],
    /// `n`, N, on the side of the first node, by the side of the second.
    pub spatial_force: [f64; 3],
    /// `m`, N·m.
    pub spatial_moment: [f64; 3],
}

/// The states of all elements of a beam in the placement `q`.
#[must_use]
pub fn section_states(elements: &Elements, beam: &Beam, q: &[f64]) -> Vec<SectionState> {
    let mut start = 0.0;
    let mut states = Vec::with_capacity(beam.elements.len());
    for index in beam.elements.clone() {
        let element = &elements.list()[index];
        let strain = element.strain(&element.coordinates(q));
        let stress = elements.stiffness(element).component_mul(&strain);
        let [a, b] = element.nodes.map(|node| &q[12 * node..12 * node + 12]);
        let mean = |i: usize| 0.5 * (director(a, i) + director(b, i));
        let spatial =
            |at: usize| -> Vector3<f64> { (0..3).map(|i| stress[at + i] * mean(i)).sum() };
        let three = |v: &[f64]| [v[0], v[1], v[2]];
        states.push(SectionState {
            element: index,
            arc_length: start + 0.5 * element.length,
            point: (0.5 * (center(a) + center(b))).into(),
            shear_extension: three(&strain.as_slice()[..3]),
            curvature: three(&strain.as_slice()[3..]),
            force: three(&stress.as_slice()[..3]),
            moment: three(&stress.as_slice()[3..]),
            spatial_force: spatial(0).into(),
            spatial_moment: spatial(3).into(),
        });
        start += element.length;
    }
    states
}

/// Points of the interpolated centre line, `per_element` for each element and the last node.
#[must_use]
pub fn center_line(
    elements: &Elements,
    beam: &Beam,
    q: &[f64],
    per_element: usize,
) -> Vec<Vector3<f64>> {
    let node = |k: usize| center(&q[12 * k..12 * k + 12]);
    let list = &elements.list()[beam.elements.clone()];
    let chords: Vec<_> =
        list.iter().map(|e| (node(e.nodes[1]) - node(e.nodes[0])) / e.length).collect();
    let slope = |k: usize| {
        let (before, after) = (k.checked_sub(1).map(|i| chords[i]), chords.get(k).copied());
        match (before, after) {
            (Some(x), Some(y)) => 0.5 * (x + y),
            (Some(x), None) if k >= 2 => 1.5 * x - 0.5 * chords[k - 2],
            (None, Some(y)) if chords.len() >= 2 => 1.5 * y - 0.5 * chords[1],
            (x, y) => x.or(y).unwrap_or_else(Vector3::zeros),
        }
    };
    let mut points = Vec::with_capacity(list.len() * per_element + 1);
    for (k, element) in list.iter().enumerate() {
        let (a, b) = (node(element.nodes[0]), node(element.nodes[1]));
        let (da, db) = (element.length * slope(k), element.length * slope(k + 1));
        for i in 0..per_element {
            let t = i as f64 / per_element as f64;
            let (s, t2) = (1.0 - t, t * t);
            points.push(
                s * s * (1.0 + 2.0 * t) * a + t2 * (3.0 - 2.0 * t) * b + s * s * t * da
                    - t2 * s * db,
            );
        }
    }
    if let Some(last) = list.last() {
        points.push(node(last.nodes[1]));
    }
    points
}
