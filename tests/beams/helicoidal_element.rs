//! Strains, energy and derivatives of one element against values of an independent implementation.

#![allow(clippy::unwrap_used, non_snake_case)] // a test; letters of the element

use holonom::vi_beam::helicoidal::{Forms, Helicoidal, forms, gradients, weighted_matrix};
use holonom::vi_beam::strain::{ElementCoordinates, Strain};
use nalgebra::{DMatrix, Matrix6, SMatrix, Vector3};
use serde::Deserialize;

#[derive(Deserialize)]
struct Case {
    strain_rule: String,
    elements: Vec<ReferenceElement>,
    reduced_stiffness: Vec<Vec<f64>>,
    weights: [f64; 6],
    states: Vec<ReferenceState>,
    discrete_derivative: Vec<Vec<f64>>,
    tolerance: f64,
}

#[derive(Deserialize)]
struct ReferenceElement {
    length: f64,
    stiffness: Vec<Vec<f64>>,
    reference: [f64; 6],
}

#[derive(Deserialize)]
struct ReferenceState {
    q: [Vec<f64>; 2],
    forms: [f64; 7],
    helicoidal: [f64; 6],
    strain: [f64; 6],
    energy: f64,
    gradient: Vec<f64>,
    hessian_of_weighted_strains: Vec<Vec<f64>>,
}

const CASES: [&str; 3] = [
    include_str!("../reference/beam-strains/01_element_h4_diagonal.json"),
    include_str!("../reference/beam-strains/02_element_h4_full.json"),
    include_str!("../reference/beam-strains/03_element_h2_full.json"),
];

fn matrix(rows: &[Vec<f64>]) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
}

/// The velocity map of both nodes: twelve columns, `u_φ` and the spatial `θ` of each.
fn node_map(x: &ElementCoordinates) -> SMatrix<f64, 24, 12> {
    let mut P = SMatrix::<f64, 24, 12>::zeros();
    for node in 0..2 {
        for k in 0..3 {
            P[(12 * node + k, 6 * node + k)] = 1.0;
        }
        for first in [3, 6, 9].map(|k| 12 * node + k) {
            let d: Vector3<f64> = x.fixed_rows::<3>(first).into();
            P.fixed_view_mut::<3, 3>(first, 6 * node + 3).copy_from(&-d.cross_matrix());
        }
    }
    P
}

/// `½ (G·θ×(θ×d))` of all directors: what the exponential adds to second derivatives.
fn of_rotation(x: &ElementCoordinates, slope: &ElementCoordinates) -> SMatrix<f64, 12, 12> {
    let mut out = SMatrix::<f64, 12, 12>::zeros();
    for node in 0..2 {
        let mut own = out.fixed_view_mut::<3, 3>(6 * node + 3, 6 * node + 3);
        for first in [3, 6, 9].map(|k| 12 * node + k) {
            let d: Vector3<f64> = x.fixed_rows::<3>(first).into();
            let g: Vector3<f64> = slope.fixed_rows::<3>(first).into();
            let both = d * g.transpose();
            own += 0.5 * (both + both.transpose()) - nalgebra::Matrix3::identity() * d.dot(&g);
        }
    }
    out
}

fn relative(found: &DMatrix<f64>, expected: &DMatrix<f64>) -> f64 {
    (found - expected).amax() / expected.amax()
}

#[test]
fn strains_and_derivatives_are_those_of_the_reference() {
    for case in CASES {
        let case: Case = serde_json::from_str(case).unwrap();
        let element = &case.elements[0];
        let C = Matrix6::from_fn(|i, j| element.stiffness[i][j]);
        let law = match case.strain_rule.as_str() {
            "helicoidal, order 2" => Helicoidal::of_order_2(element.length, C),
            _ => Helicoidal::of_order_4(element.length, &C.try_inverse().unwrap()).unwrap(),
        };
        let reference = Strain::from(element.reference);
        let C_r = law.stiffness();
        let copy = |m: &[f64], rows, columns| DMatrix::from_column_slice(rows, columns, m);
        let mut worst = relative(&copy(C_r.as_slice(), 6, 6), &matrix(&case.reduced_stiffness));
        let mut all: Vec<Forms> = Vec::new();
        for state in &case.states {
            let x = ElementCoordinates::from_iterator(state.q.iter().flatten().copied());
            let y = forms(&x, element.length);
            let at = law.at(&y, &reference);
            let eta = at.strain();
            for (found, expected) in [
                (y.as_slice(), &state.forms[..]),
                (law.helix(&y).as_slice(), &state.helicoidal[..]),
                (eta.as_slice(), &state.strain[..]),
            ] {
                let n = expected.len();
                worst = worst.max(relative(&copy(found, n, 1), &copy(expected, n, 1)));
            }
            let energy = 0.5 * element.length * eta.dot(&(C_r * eta));
            worst = worst.max((energy / state.energy - 1.0).abs());
            let (Q, P) = (gradients(&x, element.length), node_map(&x));
            let stress = element.length * C_r * eta;
            let gradient = P.tr_mul(&(Q * at.slopes().tr_mul(&stress)));
            let expected = copy(&state.gradient, 12, 1);
            worst = worst.max(relative(&copy(gradient.as_slice(), 12, 1), &expected));
            // Σ n_i ∇²η_i = Q (∂²η) Qᵀ + Σ_k c_k 𝔹_k,  c = (∂η/∂y)ᵀ n
            let n = Strain::from(case.weights);
            let c = at.slopes().tr_mul(&n);
            let mut H = Q * at.bends(&n) * Q.transpose();
            let B = weighted_matrix(&c, element.length);
            for (i, j) in (0..8).flat_map(|i| (0..8).map(move |j| (i, j))) {
                (0..3).for_each(|k| H[(3 * i + k, 3 * j + k)] += B[(i, j)]);
            }
            let hessian = P.tr_mul(&(H * P)) + of_rotation(&x, &(Q * c));
            let expected = matrix(&state.hessian_of_weighted_strains);
            worst = worst.max(relative(&copy(hessian.as_slice(), 12, 12), &expected));
            all.push(y);
        }
        let between = law.discrete_slopes([&all[0], &all[1]], &reference);
        let expected = matrix(&case.discrete_derivative);
        worst = worst.max(relative(&copy(between.as_slice(), 6, 7), &expected));
        println!("{}: off by {worst:.1e}", case.strain_rule);
        assert!(worst < case.tolerance, "{worst:e}");
    }
}
