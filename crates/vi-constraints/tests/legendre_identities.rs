//! The discrete Legendre transforms at any configuration: identities, what an equation reads,
//! refusals.
#![allow(clippy::unwrap_used, non_snake_case)] // a test; G, M, P, Q

use crate::common;
use crate::legendre::{Bowl, SQUARE, difference, mass};

use common::{Bars, frame};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use vi_constraints::legendre::LegendreError;
use vi_constraints::{ConstraintFn, Constraints, LegendreTransforms, Unconstrained};
use vi_core::linear::norm_inf;
use vi_core::potential::{DualPotential, Potential};
use vi_core::{Configuration, Entries, Interval, SeparableSystem};

fn jacobian(constraints: &impl Constraints, q: &[f64]) -> DMatrix<f64> {
    let mut G = DMatrix::zeros(constraints.len(), constraints.dim());
    constraints.jacobian(0.0, q, &mut G);
    G
}

proptest! {
    /// Identities of `Q` and `R_d` at any configuration, on the constraint manifold or not.
    #[test]
    fn projections_are_what_they_are_called(
        shift in prop::collection::vec(-0.3_f64..0.3, 8),
        masses in prop::collection::vec(0.2_f64..3.0, 4),
        massless in prop::option::of(0_usize..4),
        w in prop::collection::vec(-1.0_f64..1.0, 8),
        h in 0.01_f64..1.0,
    ) {
        let q: Vec<f64> = SQUARE.iter().zip(&shift).map(|(q, s)| q + s).collect();
        let of_point = |k: usize| if massless == Some(k) { 0.0 } else { masses[k] };
        let diagonal: Vec<f64> = (0..8).map(|i| of_point(i / 2)).collect();
        let system = SeparableSystem::with_diagonal_mass(&diagonal);
        let all = frame(2, &SQUARE, false);
        let mut independent = all.clone();
        independent.bars.pop();
        let G = jacobian(&all, &q);
        prop_assume!(jacobian(&independent, &q).singular_values().min() > 0.05);
        let P = { LegendreTransforms::new(&system, &all, Configuration::new(0.0, &q)).unwrap().null_space(Configuration::new(0.0, &q)).unwrap() };
        prop_assert_eq!(P.shape(), (8, 3));
        prop_assert!((&G * &P).amax() < 1e-13 * G.amax());

        let M = mass(&system);
        for constraints in [&all, &independent] {
            let mut of = LegendreTransforms::new(&system, constraints, Configuration::new(0.0, &q)).unwrap();
            let Q = of.projection(Configuration::new(0.0, &q)).unwrap();
            let scale = 1e-11 * (1.0 + Q.amax().powi(2));
            prop_assert!((&Q * &Q - &Q).amax() < scale, "Q² − Q = {:e}", (&Q * &Q - &Q).amax());
            prop_assert!((&Q * G.transpose()).amax() < scale, "Q Gᵀ = {:e}", (&Q * G.transpose()).amax());
            let inverse = P.tr_mul(&(&M * &P)).cholesky().expect("definite").inverse();
            let second = &M * &P * inverse * P.transpose();
            prop_assert!((&Q - &second).amax() < scale, "Q − MP(PᵀMP)⁻¹Pᵀ = {:e}", (&Q - &second).amax());
            let applied = of.project(Configuration::new(0.0, &q), &w).unwrap();
            let expected = &Q * DVector::from_column_slice(&w);
            prop_assert!(difference(&applied, expected.as_slice()) < scale);

            // R_dᵀ = (G_dᵀ)⁺: least squares and minimum norm
            let g = jacobian(constraints, &q) * h;
            let pseudo = g.transpose().pseudo_inverse(1e-9).unwrap();
            let expected = pseudo * DVector::from_column_slice(&w);
            let found = of.r_d_transposed(Configuration::new(0.0, &q), h, &w).unwrap();
            let size = 1e-10 * (1.0 + expected.amax());
            prop_assert!(difference(&found, expected.as_slice()) < size);
        }
        if massless.is_none() {
            let g = jacobian(&independent, &q);
            let inverse = M.clone().try_inverse().unwrap();
            let gram = (&g * &inverse * g.transpose()).try_inverse().unwrap();
            let first = DMatrix::identity(8, 8) - g.transpose() * gram * &g * &inverse; // (16)
            let Q = LegendreTransforms::new(&system, &independent, Configuration::new(0.0, &q)).unwrap();
            let Q = { let mut of = Q; of.projection(Configuration::new(0.0, &q)).unwrap() };
            prop_assert!((&Q - first).amax() < 1e-10 * (1.0 + Q.amax().powi(2)));
        }
    }

    /// The reduced momentum is `Pᵀ` of the projected one, and the energies of a momentum differ by
    /// that of its normal part, at any two configurations.
    #[test]
    fn reduced_and_projected_momenta_belong_together(
        q0 in prop::collection::vec(-1.0_f64..1.0, 8),
        q1 in prop::collection::vec(-1.0_f64..1.0, 8),
        h in 0.05_f64..0.5,
    ) {
        let masses = [1.0, 1.0, 2.0, 2.0, 0.5, 0.5, 3.0, 3.0];
        let system = SeparableSystem::with_diagonal_mass(&masses).potential(DualPotential(Bowl));
        let mut bars = frame(2, &SQUARE, false);
        bars.bars.pop();
        prop_assume!(jacobian(&bars, &q0).singular_values().min() > 0.1);
        let after = Interval::between(0.0, h, &q0, &q1);
        let mut of = LegendreTransforms::new(&system, &bars, Configuration::new(0.0, &q0)).unwrap();
        let P = of.null_space(Configuration::new(0.0, &q0)).unwrap();
        let projected = of.projected_momentum_minus(&after).unwrap();
        let reduced = of.reduced_momentum_minus(&after, &P).unwrap();
        let pulled = P.tr_mul(&DVector::from_column_slice(&projected));
        let size = 1.0 + norm_inf(&projected);
        prop_assert!(difference(&reduced, pulled.as_slice()) < 1e-11 * size);
        let p = of.momentum_minus(&after, &[0.0; 5]).unwrap();
        let normal: Vec<f64> = p.iter().zip(&projected).map(|(p, t)| p - t).collect();
        let [whole, part] = [&p, &normal].map(|p| of.hamiltonian(Configuration::new(0.0, &q0), p).unwrap().unwrap());
        let tangential = of.projected_hamiltonian(Configuration::new(0.0, &q0), &p).unwrap();
        let sum = tangential.kinetic + part.kinetic; // orthogonal in the norm of M⁻¹
        prop_assert!((whole.kinetic - sum).abs() < 1e-10 * (1.0 + whole.kinetic));
        prop_assert_eq!(whole.potential.to_bits(), tangential.potential.to_bits());
    }
}

/// Gradient of a spring, but a potential that is no number.
struct Unknown;
impl Potential for Unknown {
    fn value(&self, _q: &[f64]) -> f64 {
        f64::NAN
    }
    fn add_gradient(&self, q: &[f64], scale: f64, out: &mut [f64]) {
        out.iter_mut().zip(q).for_each(|(o, q)| *o += scale * q);
    }
    fn add_hessian(&self, q: &[f64], scale: f64, out: &mut dyn Entries) {
        (0..q.len()).for_each(|i| out.add(i, i, scale));
    }
}

#[test]
fn nothing_is_read_that_an_equation_does_not_name() {
    let (q0, q1, q2) = ([1.0, 0.0], [0.8, 0.6], [0.28, 0.96]);
    let (before, after) =
        (Interval::between(0.0, 0.1, &q0, &q1), Interval::between(0.1, 0.1, &q1, &q2));
    let at = Configuration::new(0.1, &q1);
    let P = DMatrix::from_column_slice(2, 1, &[-0.6, 0.8]);
    // g itself enters nothing, nor does V enter a momentum
    let system = SeparableSystem::with_diagonal_mass(&[1.0, 2.0]).potential(Unknown);
    let jacobian = |q: &[f64], G: &mut DMatrix<f64>| (G[(0, 0)], G[(0, 1)]) = (q[0], q[1]);
    let rod = ConstraintFn::new(2, 1, |_: &[f64], g: &mut [f64]| g[0] = f64::NAN, jacobian);
    let mut of = LegendreTransforms::new(&system, &rod, at).unwrap();
    let lambda = of.multiplier(&before, &after).unwrap();
    of.start_multiplier(&[0.0, 1.0], &after).unwrap();
    of.momentum_minus(&after, &lambda).unwrap();
    of.momentum_plus(&before, &lambda).unwrap();
    of.projected_momentum_minus(&after).unwrap();
    of.projected_momentum_plus(&before).unwrap();
    of.projection(at).unwrap();
    let energy = of.hamiltonian(at, &[0.0, 1.0]);
    assert_eq!(energy, Err(LegendreError::NotFinite("the energy")), "V is named by (53)");
    // R_d does not know the mass
    let unknown = SeparableSystem::with_diagonal_mass(&[f64::NAN, 2.0]);
    let mut of = LegendreTransforms::new(&unknown, &rod, at).unwrap();
    let found = of.r_d_transposed(at, 0.1, &[0.8, 0.6]).unwrap();
    assert!((found[0] - 10.0).abs() < 1e-13, "{found:?}");
    // with P of one's own, and for energies, no constraint is read
    let system = SeparableSystem::with_diagonal_mass(&[1.0, 2.0]);
    let blind = ConstraintFn::new(
        2,
        1,
        |_: &[f64], g: &mut [f64]| g[0] = f64::NAN,
        |_: &[f64], G: &mut DMatrix<f64>| G.fill(f64::NAN),
    );
    let rows = vi_constraints::saddle_point::IndependentRows::all(1);
    let mut of = LegendreTransforms::with_rows(&system, &blind, &rows).unwrap();
    let minus = of.reduced_momentum_minus(&after, &P).unwrap();
    let plus = of.reduced_momentum_plus(&before, &P).unwrap();
    assert!(minus[0].is_finite() && plus[0].is_finite());
    of.discrete_energy(&after).unwrap();
    of.hamiltonian(at, &[0.0, 1.0]).unwrap();
    assert_eq!(
        of.project(at, &[0.0, 1.0]).unwrap_err(),
        LegendreError::Singular(vi_core::linear::Singular)
    );
}

#[test]
fn what_has_no_value_is_refused_with_a_reason() {
    let system = SeparableSystem::with_diagonal_mass(&[1.0, 1.0]);
    let rod = Bars { dim: 2, points: 1, bars: vec![(None, 0, 1.0)] };
    let (q0, q1, q2) = ([1.0, 0.0], [0.8, 0.6], [0.28, 0.96]);
    let (before, after) =
        (Interval::between(0.0, 0.1, &q0, &q1), Interval::between(0.1, 0.1, &q1, &q2));
    let mut of = LegendreTransforms::new(&system, &rod, Configuration::new(0.1, &q1)).unwrap();
    let words = |e: LegendreError| e.to_string();

    let apart = of.multiplier(&after, &before).unwrap_err();
    assert_eq!(apart, LegendreError::Apart { coordinate: 0, end: 0.28, start: 1.0 });
    assert!(words(apart).contains("coordinate 0 is 0.28 at the end of the first and 1"));
    let still = Interval::between(0.0, 0.0, &q0, &q1);
    assert_eq!(of.projected_momentum_plus(&still).unwrap_err(), LegendreError::Step(0.0));
    let back = Interval::between(0.2, -0.1, &q0, &q1);
    assert_eq!(of.multiplier(&back, &after).unwrap_err(), LegendreError::Step(0.0));
    let lost = Interval::between(0.1, 0.1, &q1, &[f64::NAN, 0.0]);
    assert!(matches!(of.multiplier(&before, &lost), Err(LegendreError::NotFinite(_))));
    assert!(matches!(of.momentum_minus(&lost, &[1.0]), Err(LegendreError::NotFinite(_))));
    assert!(matches!(of.discrete_energy(&lost), Err(LegendreError::NotFinite(_))));
    assert!(matches!(
        of.project(Configuration::new(0.0, &q0), &[f64::INFINITY, 0.0]),
        Err(LegendreError::NotFinite(_))
    ));

    let shape = of.momentum_minus(&after, &[1.0, 2.0]).unwrap_err();
    assert_eq!(words(shape), "λ has 2 entries where 1 are needed");
    let short = Interval::between(0.0, 0.1, &[1.0], &[1.0]);
    assert!(matches!(of.multiplier(&before, &short), Err(LegendreError::Shape { .. })));
    assert!(matches!(of.discrete_energy(&short), Err(LegendreError::Shape { .. })));
    let wide = DMatrix::zeros(2, 2);
    assert!(matches!(of.reduced_momentum_minus(&after, &wide), Err(LegendreError::Shape { .. })));
    assert!(matches!(
        LegendreTransforms::new(&system, &Unconstrained(3), Configuration::new(0.0, &q0)),
        Err(LegendreError::Shape { .. })
    ));
    assert!(matches!(
        LegendreTransforms::new(&system, &rod, Configuration::new(0.0, &[f64::NAN, 0.0])),
        Err(LegendreError::NotFinite(_))
    ));

    // a direction that is free and has no mass
    let massless = SeparableSystem::with_diagonal_mass(&[1.0, 0.0]);
    let mut of = LegendreTransforms::new(&massless, &rod, Configuration::new(0.0, &q0)).unwrap();
    let singular = of.projection(Configuration::new(0.0, &q0)).unwrap_err();
    assert!(words(singular).contains("carries no mass"));
    assert_eq!(of.hamiltonian(Configuration::new(0.0, &q0), &[0.0, 0.0]), Ok(None));
}

#[test]
fn without_constraints_everything_is_tangential() {
    let system = SeparableSystem::with_diagonal_mass(&[1.0, 2.0]);
    let (q0, q1) = ([1.0, 0.0], [0.8, 0.6]);
    let s = Interval::between(0.0, 0.1, &q0, &q1);
    let mut of =
        LegendreTransforms::new(&system, &Unconstrained(2), Configuration::new(0.0, &q0)).unwrap();
    assert!(of.start_multiplier(&[0.0, 1.0], &s).unwrap().is_empty());
    let p = of.momentum_minus(&s, &[]).unwrap();
    assert!(difference(&p, &of.projected_momentum_minus(&s).unwrap()) < 1e-14);
    let P = of.null_space(Configuration::new(0.0, &q0)).unwrap();
    assert!(difference(&p, &of.reduced_momentum_minus(&s, &P).unwrap()) < 1e-14);
    let (whole, projected) = (
        of.hamiltonian(Configuration::new(0.0, &q0), &p).unwrap().unwrap(),
        of.projected_hamiltonian(Configuration::new(0.0, &q0), &p).unwrap(),
    );
    assert!((whole.total() - projected.total()).abs() < 1e-13);
}
