//! Memory of a set-up with its first steps is linear in the size of the system: four times as many
//! members, about four times the peak. What would need too large a dense matrix is refused.

#![allow(clippy::unwrap_used)] // a test

use std::fmt::Write as _;

use holonom::model::{
    Bar, Beam, BeamMass, Body, Count, End, GROUND, Header, Inertia, Joint, JointKind, Particle,
    Scheme, Section, Settings, Shape, ShapeKind, Spring, SpringLaw, Twist,
};
use holonom::{Model, ModelError, Simulation};
use vi_testkit::allocator::{begin_peak, peak};
use vi_testkit::model::{self, AXES, between};

const Z: [f64; 3] = [0.0, 0.0, 1.0];

fn empty() -> Model {
    let (name, gravity) = ("large".to_owned(), vec![0.0, 0.0, -9.81]);
    let header = Header { name, description: None, dimension: 3, gravity };
    Model::without_parts(header, Settings::new(0.001, 0.01))
}

fn with_scheme(mut model: Model, scheme: Scheme) -> Model {
    model.settings.scheme = scheme;
    model
}

fn particle(model: &mut Model, name: String, position: [f64; 3]) {
    let position = position.to_vec();
    model.particles.push(Particle { name, mass: 1.0, position, ..Particle::default() });
}

fn bar(model: &mut Model, from: &str, to: &str) {
    let (name, from, to) = (format!("{from}-{to}"), from.to_owned(), to.to_owned());
    model.bars.push(Bar { name, from, to, point: None, relative_to: None, length: None });
}

/// A box of 1 m along x.
fn body(model: &mut Model, name: String, [x, y]: [f64; 2]) {
    let shape = Some(Shape::new(ShapeKind::Box, vec![1.0, 0.1, 0.1]));
    let position = [x, y, 0.0];
    model.bodies.push(Body { name, mass: Some(1.0), shape, position, ..Body::default() });
}

fn hinge(model: &mut Model, [parent, child]: [&str; 2], [x, y]: [f64; 2], axis: [f64; 3]) {
    model.joints.push(Joint {
        name: format!("{parent}-{child}"),
        kind: JointKind::Revolute,
        parent: parent.to_owned(),
        child: child.to_owned(),
        position: Some([x, y, 0.0]),
        anchor_parent: None,
        anchor_child: None,
        axis: Some(axis),
        axis2: None,
        first_axis: None,
        relative_to: None,
        rate: None,
        cut: false,
        pitch: None,
        spring: None,
        damper: None,
        motor: None,
        limits: None,
        bumper: None,
        friction: None,
    });
}

fn spring(model: &mut Model, from: String, to: String) {
    model.springs.push(Spring {
        tension: None,
        name: format!("{from}_{to}"),
        from,
        to,
        point_from: None,
        point_to: None,
        relative_to: None,
        stiffness: 50.0,
        natural_length: Some(0.9),
        law: SpringLaw::Linear,
        damping: 0.0,
    });
}

fn particles(n: usize) -> Model {
    let mut model = empty();
    (0..n).for_each(|i| particle(&mut model, format!("p{i}"), [i as f64, 0.0, 0.0]));
    model
}

fn chain_of_bars(n: usize) -> Model {
    let mut model = particles(n);
    bar(&mut model, GROUND, "p0");
    model.bars[0].point = Some(vec![-1.0, 0.0, 0.0]);
    (1..n).for_each(|i| bar(&mut model, &format!("p{}", i - 1), &format!("p{i}")));
    model
}

fn hub_of_bars(n: usize) -> Model {
    let mut model = empty();
    particle(&mut model, "hub".to_owned(), [0.0; 3]);
    for i in 0..n {
        let (sin, cos) = (6.0 * i as f64 / n as f64).sin_cos();
        particle(&mut model, format!("p{i}"), [cos, sin, 0.0]);
        bar(&mut model, "hub", &format!("p{i}"));
    }
    model
}

fn springs_between_particles(n: usize) -> Model {
    let mut model = particles(n);
    (1..n).for_each(|i| spring(&mut model, format!("p{}", i - 1), format!("p{i}")));
    model
}

fn links(n: usize, parent: impl Fn(usize) -> Option<usize>) -> Model {
    let (mut model, mut ends) = (empty(), Vec::new());
    for i in 0..n {
        let carrier = parent(i);
        let x = carrier.map_or(0.0, |p| ends[p]);
        body(&mut model, format!("b{i}"), [x + 0.5, 0.0]);
        let name = carrier.map_or(GROUND.to_owned(), |p| format!("b{p}"));
        let axis = if i.is_multiple_of(2) { [0.0, 1.0, 0.0] } else { Z };
        hinge(&mut model, [&name, &format!("b{i}")], [x, 0.0], axis);
        ends.push(x + 1.0);
    }
    model
}

fn chain(n: usize) -> Model {
    links(n, |i| i.checked_sub(1))
}

fn tree(n: usize) -> Model {
    links(n, |i| i.checked_sub(1).map(|k| k / 2))
}

fn hub(n: usize) -> Model {
    links(n, |i| (i > 0).then_some(0))
}

fn chain_with_springs(n: usize) -> Model {
    let mut model = chain(n);
    (1..n).for_each(|i| spring(&mut model, format!("b{}", i - 1), format!("b{i}")));
    model
}

fn bodies_on_springs(n: usize) -> Model {
    let mut model = empty();
    (0..n).for_each(|i| body(&mut model, format!("b{i}"), [2.0 * i as f64, 0.0]));
    (1..n).for_each(|i| spring(&mut model, format!("b{}", i - 1), format!("b{i}")));
    model
}

fn beam(n: usize) -> Model {
    let section = Section {
        ea: Some(1e3),
        ga1: Some(1e3),
        ga2: Some(1e3),
        ei1: Some(10.0),
        ei2: Some(10.0),
        gj: Some(10.0),
        rho_a: Some(1.0),
        rho_i1: Some(0.1),
        rho_i2: Some(0.1),
        ..Section::default()
    };
    let mut model = empty();
    model.beams.push(Beam {
        name: "beam".to_owned(),
        points: vec![[0.0; 3], [0.1 * n as f64, 0.0, 0.0]],
        curve: None,
        elements: Count::Each(n),
        element: None,
        order: 1,
        normal: None,
        twist: Twist::Normal,
        section,
        stations: None,
        length: None,
        curvature: None,
        prestress: None,
        radius: None,
        mass: BeamMass::Consistent,
        tension: None,
        start: End::Free,
        end: End::Free,
        relative_to: None,
        velocity: [0.0; 3],
        angular_velocity: [0.0; 3],
    });
    model
}

/// Four-bar linkages side by side, of cranks and couplers.
fn windows(n: usize) -> Model {
    let mut model = empty();
    let part = |model: &mut Model, name: String, [x, y]: [f64; 2], moments| {
        let (mass, inertia) = (Some(1.0), Some(Inertia::Principal(moments)));
        model.bodies.push(Body { name, mass, inertia, position: [x, y, 0.0], ..Body::default() });
    };
    for i in 0..=n {
        part(&mut model, format!("c{i}"), [i as f64, 0.5], [0.1, 0.01, 0.1]);
        hinge(&mut model, [GROUND, &format!("c{i}")], [i as f64, 0.0], Z);
    }
    for i in 0..n {
        part(&mut model, format!("k{i}"), [i as f64 + 0.5, 1.0], [0.01, 0.1, 0.1]);
        hinge(&mut model, [&format!("c{i}"), &format!("k{i}")], [i as f64, 1.0], Z);
        hinge(&mut model, [&format!("k{i}"), &format!("c{}", i + 1)], [i as f64 + 1.0, 1.0], Z);
    }
    model
}

/// What the program assembles from the text of a model file.
fn assembled(text: &str) -> Result<Simulation, ModelError> {
    Simulation::new(&Model::from_toml(text)?)
}

/// The largest memory in use while a model is read, set up and takes a few steps, bytes.
fn memory(model: &Model) -> f64 {
    let text = model.to_toml();
    begin_peak();
    let mut simulation = assembled(&text).unwrap();
    (0..3).for_each(|_| _ = simulation.step().unwrap());
    peak() as f64
}

#[test]
fn memory_grows_with_the_number_of_members() {
    let families: [(&str, fn(usize) -> Model, usize); 11] = [
        ("free particles", particles, 250),
        ("particles on a chain of bars", chain_of_bars, 250),
        ("particles on bars to a hub", hub_of_bars, 250),
        ("springs between particles", springs_between_particles, 250),
        ("bodies on a hub", hub, 250),
        ("chain", chain, 250),
        ("binary tree", tree, 250),
        ("chain with springs between neighbours", chain_with_springs, 125),
        ("bodies on springs", bodies_on_springs, 125),
        ("beam", beam, 250),
        ("windows", windows, 60),
    ];
    for (name, model, n) in families {
        let (one, four) = (memory(&model(n)), memory(&model(4 * n)));
        let ratio = four / one;
        println!("{name}: {:.1} kB for {n}, {ratio:.2} times that for {}", 1e-3 * one, 4 * n);
        assert!(ratio < 4.4, "{name}: {ratio:.2}");
    }
}

/// The general sparse factorization has some fill.
#[test]
fn memory_of_an_energy_momentum_chain_grows_little_faster() {
    let [one, four] = [250, 1000].map(|n| memory(&with_scheme(chain(n), Scheme::EmConstrained)));
    let exponent = (four / one).log(4.0);
    println!("em-constrained, chain: {:.1} kB for 250, exponent {exponent:.2}", 1e-3 * one);
    assert!(exponent < 1.2, "{exponent:.2}");
}

#[test]
fn bars_of_many_triangles_are_independent_of_each_other() {
    let triangles = |n: usize| {
        let mut model = with_scheme(empty(), Scheme::Constrained);
        for i in 0..n {
            let [a, b, c] = ["a", "b", "c"].map(|letter| format!("{letter}{i}"));
            [[&a, &b], [&b, &c], [&c, &a]].iter().for_each(|[from, to]| bar(&mut model, from, to));
            particle(&mut model, a, [0.0, i as f64, 0.0]);
            particle(&mut model, b, [1.0, i as f64, 0.0]);
            particle(&mut model, c, [0.4, i as f64, 0.8]);
        }
        model
    };
    let ratio = memory(&triangles(400)) / memory(&triangles(100));
    println!("triangles of bars: {ratio:.2} times the memory for four times as many");
    assert!(ratio < 4.4, "{ratio:.2}");
}

#[test]
fn dense_matrices_that_are_too_large_are_refused() {
    let mut triangle = particles(900);
    particle(&mut triangle, "q".to_owned(), [0.0, 1.0, 0.0]);
    [["p0", "p1"], ["p1", "q"], ["q", "p0"]].iter().for_each(|[a, b]| bar(&mut triangle, a, b));
    let [dalembert, em_dalembert, em_nodal] =
        [Scheme::Dalembert, Scheme::EmDalembert, Scheme::EmNodal]
            .map(|s| with_scheme(chain(210), s));
    let mut refused = String::new();
    for model in [triangle, dalembert, em_dalembert, em_nodal] {
        let error = assembled(&model.to_toml()).err().unwrap();
        for problem in error.problems("") {
            writeln!(
                refused,
                "{}: {}\n  help: {}",
                problem.key,
                problem.message,
                problem.help.unwrap_or_default()
            )
            .unwrap();
        }
    }
    insta::assert_snapshot!(refused);
}

/// Many linkages side by side, with springs between their bodies, to a point mass, and on a body
/// that flies: one sparse matrix in the place of the complement gives the motion of the scheme with
/// multipliers.
#[test]
fn many_loops_with_springs_move_as_with_multipliers() {
    let hinge = |name: &str, parent: &str, child: &str, at: [f64; 3]| {
        model::hinge(name, [parent, child], at, AXES[1])
    };
    let body = |name: &str, at: [f64; 3]| model::body_at(at, name, 1.0, [0.02, 0.03, 0.02]);
    let spring = |name: &str, from: &str, to: &str| {
        between("spring", name, [from, to]) + "stiffness = 40.0\nnatural_length = 1.0\n"
    };
    const COUNT: usize = 56;
    for (base, gravity) in [("ground", -9.81), ("base", 0.0)] {
        let mut text = format!(
            "[model]\nname = \"linkages\"\ngravity = [0.3, 0.0, {gravity:?}]\n[simulation]\nstep = 0.005\nend = 0.1\n"
        );
        if base != "ground" {
            text += &body(base, [COUNT as f64 / 2.0, 0.0, -0.5]);
        }
        for k in 0..=COUNT {
            let x = k as f64;
            text += &body(&format!("crank{k}"), [x, 0.0, 0.5]);
            text += &hinge(&format!("foot{k}"), base, &format!("crank{k}"), [x, 0.0, 0.0]);
            if k > 0 {
                text += &body(&format!("bar{k}"), [x - 0.5, 0.0, 1.0]);
                for j in [k - 1, k] {
                    let name = format!("top{k}_{j}");
                    let at = [j as f64, 0.0, 1.0];
                    text += &hinge(&name, &format!("crank{j}"), &format!("bar{k}"), at);
                }
            }
        }
        text += "[[particle]]\nname = \"point\"\nmass = 0.5\nposition = [1.0, 1.0, 2.0]\n";
        text += &(spring("across", "crank0", &format!("bar{COUNT}"))
            + &spring("to_point", "bar1", "point"));
        let end = |scheme: &str| {
            let own = [holonom::Override::new("simulation.scheme", scheme)];
            let model = Model::from_toml_with(&text, &own).unwrap();
            let mut run = Simulation::new(&model).unwrap();
            let mut last = Vec::new();
            let mut observe = |sample: &holonom::Sample| {
                last.clone_from(&sample.q);
                Ok::<(), ()>(())
            };
            let outcome = run.run(&mut observe, &mut |_, _| {}).unwrap();
            assert_eq!(outcome, holonom::RunOutcome::Done, "{base}, {scheme}");
            last
        };
        let (nodal, constrained) = (end("nodal"), end("constrained"));
        let apart = nodal.iter().zip(&constrained).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("{COUNT} linkages on the {base}: {apart:.1e} apart");
        assert!(apart < 1e-10, "{base}: {apart:e}");
    }
}
