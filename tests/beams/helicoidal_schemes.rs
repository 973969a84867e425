//! Helicoidal elements by the schemes beside the default one: what each conserves and its order,
//! and section forces at a clamp against those of the load.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark;
use crate::statics::static_models::rows;

use benchmark::{apart, assert_order, model, orders, samples};
use holonom::nalgebra::Vector3;
use holonom::{Sample, Simulation};
use vi_testkit::model::{beam, heavy, section};

/// A free beam, drawn straight although it is bent and twisted without stress: it springs back and
/// turns in space.
fn springing() -> String {
    let soft = section([4e2, 2e2, 3e2, 4.0, 6.0, 5.0], [1.0, 1e-2, 2e-2]);
    [
        heavy("springing", [0.0; 3], "step = 0.01, end = 0.4, strain = \"averaged\""),
        beam("beam", &[[0.0; 3], [1.0, 0.0, 0.0]], 3),
        "normal = [0, 0, 1]\nelement = \"helicoidal\"\ncurvature = [1.1, -0.6, 0.8]\n".to_owned(),
        "velocity = [0.3, -0.2, 0.1]\nangular_velocity = [0.4, 1.0, -0.7]\n".to_owned(),
        soft,
    ]
    .concat()
}

fn run(replaced: &[(&str, &str)]) -> Vec<Sample> {
    samples(&mut Simulation::new(&model(&springing(), replaced)).unwrap())
}

/// Largest changes of the energy, of the linear and of the angular momentum, relative to the energy
/// and to the largest momenta.
fn changes(run: &[Sample]) -> [f64; 3] {
    let first = &run[0];
    let of = |change: &dyn Fn(&Sample) -> f64| run.iter().map(change).fold(0.0, f64::max);
    let distance = |a: [f64; 3], b: [f64; 3]| (Vector3::from(a) - Vector3::from(b)).norm();
    let (p, l) = (first.momentum.linear, first.momentum.angular);
    [
        of(&|s| (s.hamiltonian / first.hamiltonian - 1.0).abs()),
        of(&|s| distance(s.momentum.linear, p)) / Vector3::from(p).norm(),
        of(&|s| distance(s.momentum.angular, l)) / Vector3::from(l).norm(),
    ]
}

#[test]
fn energy_momentum_schemes_keep_energy_and_momenta() {
    for scheme in ["em-nodal", "em-dalembert", "em-constrained"] {
        let found = run(&[("simulation.scheme", scheme)]);
        let moved = apart(&found[0].q, &found.last().unwrap().q);
        let [energy, linear, angular] = changes(&found);
        println!("{scheme}: energy {energy:.1e}, momenta {linear:.1e}, {angular:.1e}");
        assert!(moved > 0.1, "{scheme} has moved by {moved}");
        assert!(energy < 1e-12 && linear < 1e-13 && angular < 1e-12, "{scheme}: {energy:e}");
    }
}

/// The end of the motion against a step of the variational scheme of order 8.
#[test]
fn energy_momentum_schemes_have_order_two() {
    let end = |step: f64, sets: &[(&str, &str)]| {
        let (step, time) = (format!("{step:e}"), ("simulation.end", "0.08"));
        let own = [("simulation.step", step.as_str()), time];
        run(&[&own[..], sets].concat()).last().unwrap().q.clone()
    };
    let exact = end(1e-3, &[("simulation.method", "galerkin"), ("simulation.order", "8")]);
    let steps = [2e-3, 1e-3, 5e-4];
    let errors = steps.map(|h| apart(&end(h, &[("simulation.scheme", "em-nodal")]), &exact));
    assert_order(&orders("em-nodal", &steps, &errors), 2.0, 0.2);
}

/// Momenta to rounding; the error of the energy falls with the order.
#[test]
fn galerkin_schemes_keep_momenta() {
    let steps = [4e-3, 2e-3];
    for (order, scheme) in [(4, "nodal"), (6, "constrained")] {
        let errors = steps.map(|h| {
            let (step, order) = (format!("{h:e}"), order.to_string());
            let found = run(&[
                ("simulation.method", "galerkin"),
                ("simulation.order", &order),
                ("simulation.scheme", scheme),
                ("simulation.step", &step),
                ("simulation.end", "0.08"),
            ]);
            let [energy, linear, angular] = changes(&found);
            println!("{scheme}, {order}: energy {energy:.1e}, momenta {linear:.1e}, {angular:.1e}");
            assert!(linear < 1e-13 && angular < 1e-12, "{scheme}: {linear:e}, {angular:e}");
            energy
        });
        let found = (errors[0] / errors[1]).log2();
        assert!(found > f64::from(order) - 1.0, "energy {errors:?}: order {found:.1}");
    }
}

/// The 45° bend: force and moment at the clamp are those of the load at the place of the exact tip,
/// in equilibrium with it in the deformed configuration.
#[test]
fn section_forces_at_a_clamp_are_those_of_the_load() {
    let text = include_str!("../../examples/models/bend_45.toml");
    let tip = Vector3::new(15.684_800_53, 47.150_438_57, 53.474_858_79);
    let force = Vector3::new(0.0, 0.0, 600.0);
    let moment = tip.cross(&force);
    let sensor =
        "[[sensor]]\nname = \"clamp\"\ntype = \"section_force\"\nof = \"bend\"\nat = 0.0\n";
    let counts = [2, 4, 8];
    let errors = counts.map(|elements| {
        let elements = elements.to_string();
        let own = [("beam.bend.element", "helicoidal"), ("beam.bend.elements", &elements)];
        let last = rows(&model(&format!("{text}\n{sensor}"), &own)).0.pop().unwrap();
        let three = |first: usize| Vector3::from_column_slice(&last.sensors[first..first + 3]);
        // the triad of the clamp: d_1 = e_3 across, d_3 = e_2 along, d_2 = d_3 × d_1 = e_1
        let spatial = |n: Vector3<f64>| Vector3::new(n.y, n.z, n.x);
        let [n, m] = [spatial(three(3)), spatial(three(6))];
        println!("{elements} elements: {n:?}, {m:?} against {moment:?}");
        let off = [(n - force).norm() / force.norm(), (m - moment).norm() / moment.norm()];
        assert!(off[0] < 1e-9, "force off by {:e}", off[0]);
        off[1]
    });
    println!("moment off by {errors:?}");
    assert!(errors[2] < 2e-5, "{errors:?}");
    let lengths = counts.map(|elements| 1.0 / f64::from(elements));
    assert_order(&orders("moment at the clamp", &lengths, &errors), 4.0, 0.6);
}
