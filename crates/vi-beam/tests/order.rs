//! Temporal order of the averaged-strain schemes, with and without selective mass scaling or
//! dissipation, and of the midpoint scheme on a soft beam, alone (2) and composed (4), for `q` and
//! the projected momentum; `h ω_max` is not much above 1.

#![allow(clippy::unwrap_used)] // a test

use crate::common;

use common::{distance, straight, vector};
use nalgebra::Vector3;
use vi_beam::Section;
use vi_beam::averaged::{AveragedStrains, MASS_SCALING};
use vi_beam::model::{BeamModel, StrainRule};
use vi_constraints::{InitialValues, Options, SchemeKind};
use vi_core::{Composition, Quadrature};
use vi_multibody::pair::PairKind;
use vi_multibody::run::{Solver, integrator};

fn model() -> BeamModel {
    let section = Section::new([40.0, 40.0, 60.0, 8.0, 6.0, 5.0], [1.0, 0.4, 0.5, 0.0]).unwrap();
    let mut model = BeamModel::new(vector(0.0, 0.0, -2.0));
    let beam = model.add_beam("beam", &straight(2.0, 4), section).unwrap();
    model.join(PairKind::Spherical, None, 0, &Vector3::zeros(), &Vector3::z());
    let omega = vector(0.6, 0.5, -0.8);
    for k in beam.nodes {
        let body = &mut model.description.bodies[k];
        (body.omega, body.velocity) = (omega, omega.cross(&body.center));
    }
    model
}

/// `q` and `ᵠp` at the end.
fn end(rule: StrainRule, composition: Option<Composition>, h: f64) -> (Vec<f64>, Vec<f64>) {
    let model = model();
    let mechanism = model.mechanism();
    let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
    let mut options = Options::new(SchemeKind::Nodal, h);
    if let Some(composition) = composition {
        options = options.composition(composition);
    }
    let system = match rule {
        // with the largest added mass at every step; the rule itself has none here, where h ω ≤ √8
        StrainRule::MassScaled => {
            let count = model.elements.list().len();
            let strains = AveragedStrains::mass_scaled(
                model.elements.clone(),
                MASS_SCALING,
                vec![0.0; count],
            );
            mechanism
                .system_with_mass(model.mass_matrix(&mechanism), Quadrature::Midpoint)
                .discrete_potential(Box::new(strains))
        }
        rule => model.system(&mechanism, rule),
    };
    let mut run =
        integrator(mechanism, system, options, Solver::Auto, InitialValues::new(0.0, &q, &v))
            .unwrap();
    for _ in 0..(1.0 / h).round() as usize {
        run.step().unwrap();
    }
    let p = run.observe().unwrap().p_projected.clone();
    (run.state().q.clone(), p)
}

#[test]
fn orders_two_and_four() {
    let fine = end(StrainRule::Averaged, Some(Composition::Suzuki5), 0.005);
    for (rule, composition, expected, steps) in [
        (StrainRule::Midpoint, None, 2.0, [0.02, 0.01, 0.005, 0.0025]),
        (StrainRule::Averaged, None, 2.0, [0.02, 0.01, 0.005, 0.0025]),
        (StrainRule::MassScaled, None, 2.0, [0.02, 0.01, 0.005, 0.0025]),
        (StrainRule::Dissipative, None, 2.0, [0.02, 0.01, 0.005, 0.0025]),
        (StrainRule::Averaged, Some(Composition::Suzuki5), 4.0, [0.1, 0.05, 0.025, 0.0125]),
    ] {
        let error = |h| {
            let (q, p) = end(rule, composition, h);
            [distance(&q, &fine.0), distance(&p, &fine.1)]
        };
        let errors: Vec<[f64; 2]> = steps.into_iter().map(error).collect();
        for (k, name) in ["q", "p"].into_iter().enumerate() {
            let orders: Vec<f64> = errors.windows(2).map(|e| (e[0][k] / e[1][k]).log2()).collect();
            println!(
                "{rule:?}, order {expected}: {name} errors {:.1e} … {:.1e}, orders {orders:.2?}",
                errors[0][k], errors[3][k]
            );
            assert!((orders[2] - expected).abs() < 0.2, "{orders:?}");
        }
    }
}
