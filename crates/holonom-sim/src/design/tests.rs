//! How the numbers of a mechanism change with the parameters of its file, against differences of
//! mechanisms that are assembled with other values.

use super::{ModelTangent, tangents};
use crate::system::{System, build};
use holonom_model::{ModelError, ModelText, Override};
use nalgebra::{DMatrix, DVector};
use std::path::Path;
use vi_constraints::Constraints;
use vi_constraints::design::{Design, Place};
use vi_core::{DiscreteLagrangian, Interval};
use vi_multibody::design::MechanismDesign;
use vi_testkit::Sample;

const MODEL: &str = include_str!("tests.toml");

fn text(text: &str) -> ModelText {
    ModelText::from_text(Path::new("model.toml"), text)
}

fn system(text: &ModelText, name: &str, value: f64) -> System {
    let set = [Override::new(format!("parameters.{name}"), format!("{value:?}"))];
    build(&text.model(&set).unwrap()).unwrap()
}

/// The equations of a step, `g` at its end, `q_0` and `v_0`, one after the other.
fn equations(system: &System, s: &Interval, impulse: &[f64]) -> Vec<f64> {
    let (mechanism, discrete) = (&system.mechanism, system.dynamics.variational(&system.mechanism));
    let (n, m) = (mechanism.dim(), mechanism.len());
    let (mut minus, mut plus, mut g) = (vec![0.0; n], vec![0.0; n], vec![0.0; m]);
    discrete.forced_d1(s, &mut minus);
    discrete.forced_d2(s, &mut plus);
    mechanism.value(s.end(), &mut g);
    let mut jacobian = DMatrix::zeros(m, n);
    mechanism.jacobian(s.t, &s.q0, &mut jacobian);
    let reaction = jacobian.tr_mul(&DVector::from_column_slice(impulse));
    minus.iter_mut().zip(reaction.iter()).for_each(|(f, r)| *f -= r);
    [minus, plus, g, mechanism.initial_configuration()].concat()
}

/// Central differences, extrapolated twice.
fn difference(of: impl Fn(f64) -> Vec<f64>, size: f64) -> DVector<f64> {
    let central = |e: f64| (DVector::from_vec(of(e)) - DVector::from_vec(of(-e))) / (2.0 * e);
    let [a, b, c] = [4e-3, 2e-3, 1e-3].map(|e| central(e * size));
    let [ab, bc] = [(&b * 4.0 - a) / 3.0, (c * 4.0 - &b) / 3.0];
    (bc * 16.0 - ab) / 15.0
}

fn found(text: &ModelText) -> Result<(System, Vec<ModelTangent>), ModelError> {
    let model = text.model(&[])?;
    let system = build(&model)?;
    let found = tangents(text, &[], &model, &system)?;
    Ok((system, found))
}

#[test]
fn every_number_of_a_model_changes_as_it_is_assembled() {
    let text = text(MODEL);
    let (own, all) = found(&text).unwrap();
    assert_eq!(all.len(), 17, "parameters that are numbers");
    let (n, m) = (own.mechanism.dim(), own.mechanism.len());
    let mut random = Sample::new(3);
    let q = own.mechanism.initial_configuration();
    let mut near = || -> Vec<f64> { q.iter().map(|x| x + 0.05 * random.number()).collect() };
    let s = Interval::between(0.3, 0.1, &near(), &near());
    let impulse: Vec<f64> = (0..m).map(|_| random.number()).collect();
    let mass = own.dynamics.parts.mass_matrix(&own.mechanism);
    let numbers: Vec<_> = all.iter().map(|own| own.numbers.clone()).collect();
    let forces = &own.dynamics.forces;
    let quadrature = own.dynamics.quadrature;
    let design = MechanismDesign::new(&own.mechanism, forces, &mass, quadrature, &numbers).unwrap();
    for (k, tangent) in all.iter().enumerate() {
        let (mut minus, mut plus, mut rows) = (vec![0.0; n], vec![0.0; n], vec![0.0; m]);
        design.add_tangent(k, Place::Step(&s), &impulse, &mut minus, &mut plus, &mut rows);
        let exact = DVector::from_vec([minus, plus, rows, tangent.q.clone()].concat());
        let of = |e: f64| equations(&system(&text, &tangent.name, tangent.value + e), &s, &impulse);
        let differences = difference(of, tangent.value.abs());
        let error = (&exact - &differences).amax();
        let size = exact.amax().max(1.0);
        let at = (&exact - &differences).iamax();
        assert!(
            error < 2e-7 * size,
            "{}: {error:.1e} of {size:.1e}, entry {at} of {n}, {m}: {} not {}",
            tangent.name,
            exact[at],
            differences[at]
        );
    }
    let rate = all.iter().find(|own| own.name == "rate").unwrap();
    assert_eq!(rate.rates, [(0, 0, 1.0), (1, 1, -1.0), (3, 2, 1.0)]);
}

#[test]
fn numbers_without_a_derivative_are_refused_by_their_keys() {
    let refused = |from: &str, to: &str| {
        let changed = MODEL.replace(from, to);
        assert_ne!(changed, MODEL, "{from}");
        found(&text(&changed)).err().map(|error| error.to_string()).unwrap_or_default()
    };
    let wheel = "mass = 0.9\n";
    let cases = [
        (
            "quaternion = [0.8, 0.0, 0.6, 0.0]\n",
            "color = \"red\"\nopacity = \"= 0.5*turn\"\n",
            "opacity",
        ),
        ("step = 0.01", "step = \"= 0.05*place - 0.0075\"", "simulation.step"),
        (
            "\"= force\", 0.1, 0.2]\ntorque",
            "\"= floor(force)\", 0.1, 0.2]\ntorque",
            "`floor(force)` jumps",
        ),
        ("damping = \"= damping\" }", "damping = \"= abs(damping - 0.4) + 0.1\" }", "kink"),
        ("frame = \"body\"", "frame = \"body\"\nhistory = \"floor(gain*t)\"", "load.push.history"),
    ];
    for (from, to, what) in cases {
        let message = refused(from, to);
        assert!(message.contains(what), "{what}: {message}");
    }
    let table = "frequency = 2.0, table = { times = [0.0, \"= gain\"], values = [0.0, 1.0] }";
    assert_eq!(refused("frequency = 2.0", table), "");
    assert_eq!(refused(wheel, "mass = \"= 0.5 + 2*rest + arm/2.5\"\n"), "");
}
