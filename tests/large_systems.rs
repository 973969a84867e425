//! Memory of a set-up with its first steps is linear in the size of the system: four times as many members, about four
//! times the peak. What would need too large a dense matrix is refused.

#![allow(clippy::unwrap_used)] // a test

use std::fmt::Write as _;

use holonom::{Model, Simulation};
use vi_testkit::allocator::{begin_peak, peak};

const STEEL: &str = "EA = 1e3, GA1 = 1e3, GA2 = 1e3, EI1 = 10.0, EI2 = 10.0, GJ = 10.0";

fn header() -> String {
    "model = { name = \"large\", gravity = [0.0, 0.0, -9.81] }\n\
     simulation = { step = 0.001, end = 0.01 }\n"
        .to_owned()
}

fn particle(text: &mut String, name: &str, [x, y, z]: [f64; 3]) {
    let place = format!("position = [{x:?}, {y:?}, {z:?}]");
    writeln!(text, "[[particle]]\nname = \"{name}\"\nmass = 1.0\n{place}").unwrap();
}

fn bar(text: &mut String, from: &str, to: &str) {
    writeln!(text, "[[bar]]\nname = \"{from}-{to}\"\nfrom = \"{from}\"\nto = \"{to}\"").unwrap();
}

fn body(text: &mut String, name: &str, [x, y]: [f64; 2]) {
    let shape = "shape = { type = \"box\", dimensions = [1.0, 0.1, 0.1] }";
    writeln!(
        text,
        "[[body]]\nname = \"{name}\"\nmass = 1.0\n{shape}\nposition = [{x:?}, {y:?}, 0.0]"
    )
    .unwrap();
}

fn hinge(text: &mut String, [parent, child]: [&str; 2], [x, y]: [f64; 2], axis: [f64; 3]) {
    writeln!(
        text,
        "[[joint]]\nname = \"{parent}-{child}\"\ntype = \"revolute\"\nparent = \"{parent}\"\nchild = \"{child}\"\n\
         position = [{x:?}, {y:?}, 0.0]\naxis = {axis:?}"
    )
    .unwrap();
}

fn spring(text: &mut String, from: &str, to: &str) {
    writeln!(
        text,
        "[[spring]]\nname = \"{from}_{to}\"\nfrom = \"{from}\"\nto = \"{to}\"\nstiffness = 50.0\n\
         natural_length = 0.9"
    )
    .unwrap();
}

fn particles(n: usize) -> String {
    let mut text = header();
    (0..n).for_each(|i| particle(&mut text, &format!("p{i}"), [i as f64, 0.0, 0.0]));
    text
}

fn chain_of_bars(n: usize) -> String {
    let mut text = particles(n);
    writeln!(
        text,
        "[[bar]]\nname = \"hold\"\nfrom = \"ground\"\npoint = [-1.0, 0.0, 0.0]\nto = \"p0\""
    )
    .unwrap();
    (1..n).for_each(|i| bar(&mut text, &format!("p{}", i - 1), &format!("p{i}")));
    text
}

fn hub_of_bars(n: usize) -> String {
    let mut text = header();
    particle(&mut text, "hub", [0.0; 3]);
    for i in 0..n {
        let angle = 6.0 * i as f64 / n as f64;
        particle(&mut text, &format!("p{i}"), [angle.cos(), angle.sin(), 0.0]);
        bar(&mut text, "hub", &format!("p{i}"));
    }
    text
}

fn springs_between_particles(n: usize) -> String {
    let mut text = particles(n);
    (1..n).for_each(|i| spring(&mut text, &format!("p{}", i - 1), &format!("p{i}")));
    text
}

fn links(n: usize, parent: impl Fn(usize) -> Option<usize>) -> String {
    let (mut text, mut ends) = (header(), Vec::new());
    for i in 0..n {
        let carrier = parent(i);
        let x = carrier.map_or(0.0, |p| ends[p]);
        body(&mut text, &format!("b{i}"), [x + 0.5, 0.0]);
        let name = carrier.map_or("ground".to_owned(), |p| format!("b{p}"));
        let axis = if i.is_multiple_of(2) { [0.0, 1.0, 0.0] } else { [0.0, 0.0, 1.0] };
        hinge(&mut text, [&name, &format!("b{i}")], [x, 0.0], axis);
        ends.push(x + 1.0);
    }
    text
}

fn chain(n: usize) -> String {
    links(n, |i| i.checked_sub(1))
}

fn energy_momentum_chain(n: usize) -> String {
    chain(n).replace("end", "scheme = \"em-constrained\", end")
}

fn tree(n: usize) -> String {
    links(n, |i| i.checked_sub(1).map(|k| k / 2))
}

fn hub(n: usize) -> String {
    links(n, |i| (i > 0).then_some(0))
}

fn chain_with_springs(n: usize) -> String {
    let mut text = chain(n);
    (1..n).for_each(|i| spring(&mut text, &format!("b{}", i - 1), &format!("b{i}")));
    text
}

fn bodies_on_springs(n: usize) -> String {
    let mut text = header();
    (0..n).for_each(|i| body(&mut text, &format!("b{i}"), [2.0 * i as f64, 0.0]));
    (1..n).for_each(|i| spring(&mut text, &format!("b{}", i - 1), &format!("b{i}")));
    text
}

fn beam(n: usize) -> String {
    let length = 0.1 * n as f64;
    header()
        + &format!(
            "[[beam]]\nname = \"beam\"\npoints = [[0.0, 0.0, 0.0], [{length:?}, 0.0, 0.0]]\nelements = {n}\n\
             section = {{ {STEEL}, rhoA = 1.0, rhoI1 = 0.1, rhoI2 = 0.1 }}\n"
        )
}

/// Four-bar linkages side by side, of cranks and couplers.
fn windows(n: usize) -> String {
    let (mut text, z) = (header(), [0.0, 0.0, 1.0]);
    let part = |text: &mut String, name: &str, [x, y]: [f64; 2], inertia: &str| {
        writeln!(
            text,
            "[[body]]\nname = \"{name}\"\nmass = 1.0\ninertia = {inertia}\nposition = [{x:?}, {y:?}, 0.0]"
        )
        .unwrap();
    };
    for i in 0..=n {
        part(&mut text, &format!("c{i}"), [i as f64, 0.5], "[0.1, 0.01, 0.1]");
        hinge(&mut text, ["ground", &format!("c{i}")], [i as f64, 0.0], z);
    }
    for i in 0..n {
        part(&mut text, &format!("k{i}"), [i as f64 + 0.5, 1.0], "[0.01, 0.1, 0.1]");
        hinge(&mut text, [&format!("c{i}"), &format!("k{i}")], [i as f64, 1.0], z);
        hinge(&mut text, [&format!("k{i}"), &format!("c{}", i + 1)], [i as f64 + 1.0, 1.0], z);
    }
    text
}

/// The largest memory in use while a model is set up and takes a few steps, bytes.
fn memory(text: &str) -> f64 {
    begin_peak();
    let mut simulation = Simulation::new(&Model::from_toml(text).unwrap()).unwrap();
    (0..3).for_each(|_| _ = simulation.step().unwrap());
    peak() as f64
}

#[test]
fn memory_grows_with_the_number_of_members() {
    let families: [(&str, fn(usize) -> String, usize); 11] = [
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
    for (name, text, n) in families {
        let (one, four) = (memory(&text(n)), memory(&text(4 * n)));
        let ratio = four / one;
        println!("{name}: {:.1} kB for {n}, {ratio:.2} times that for {}", 1e-3 * one, 4 * n);
        assert!(ratio < 4.4, "{name}: {ratio:.2}");
    }
}

/// The general sparse factorization has some fill.
#[test]
fn memory_of_an_energy_momentum_chain_grows_little_faster() {
    let [one, four] = [250, 1000].map(|n| memory(&energy_momentum_chain(n)));
    let exponent = (four / one).log(4.0);
    println!("em-constrained, chain: {:.1} kB for 250, exponent {exponent:.2}", 1e-3 * one);
    assert!(exponent < 1.2, "{exponent:.2}");
}

#[test]
fn bars_of_many_triangles_are_independent_of_each_other() {
    let triangles = |n: usize| {
        let mut text = header().replace("end", "scheme = \"constrained\", end");
        for i in 0..n {
            let [a, b, c] = ["a", "b", "c"].map(|letter| format!("{letter}{i}"));
            particle(&mut text, &a, [0.0, i as f64, 0.0]);
            particle(&mut text, &b, [1.0, i as f64, 0.0]);
            particle(&mut text, &c, [0.4, i as f64, 0.8]);
            [[&a, &b], [&b, &c], [&c, &a]].iter().for_each(|[from, to]| bar(&mut text, from, to));
        }
        text
    };
    let ratio = memory(&triangles(400)) / memory(&triangles(100));
    println!("triangles of bars: {ratio:.2} times the memory for four times as many");
    assert!(ratio < 4.4, "{ratio:.2}");
}

#[test]
fn dense_matrices_that_are_too_large_are_refused() {
    let mut text = particles(900);
    particle(&mut text, "q", [0.0, 1.0, 0.0]);
    [["p0", "p1"], ["p1", "q"], ["q", "p0"]].iter().for_each(|[from, to]| bar(&mut text, from, to));
    let [dalembert, em_dalembert, em_nodal] = ["dalembert", "em-dalembert", "em-nodal"]
        .map(|scheme| chain(210).replace("end", &format!("scheme = \"{scheme}\", end")));
    let mut refused = String::new();
    for text in [text, dalembert, em_dalembert, em_nodal] {
        let error = Simulation::new(&Model::from_toml(&text).unwrap()).err().unwrap();
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
