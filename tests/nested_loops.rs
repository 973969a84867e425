//! Loops within loops, loops side by side and loops on one link: every scheme and every solver gives the
//! same motion, in as few iterations as on a tree.
//!
//! A chain of four links with rectangles of bars on three of them; a strut ties its end to the second
//! link, another one to the ground.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark;

use benchmark::Run;

/// `base`: the first joint. `struts`: which of the two there are.
fn mechanism(base: &str, struts: &[&str]) -> String {
    let mut text = String::from(
        "[model]\nname = \"nested\"\ngravity = [0.5, -2, -9.81]\n[simulation]\nstep = 0.01\nend = 1.0\n",
    );
    let mut body = |name: String, mass: f64, at: [f64; 3], shape: [f64; 3]| {
        text += &format!(
            "[[body]]\nname = \"{name}\"\nmass = {mass:?}\nshape = {{ type = \"box\", dimensions = \
             {shape:?} }}\nposition = {at:?}\n"
        );
    };
    let mut joints = String::new();
    let mut joint = |kind: &str, parent: String, child: String, at: [f64; 3], axis: [f64; 3]| {
        let axis = if kind == "spherical" { String::new() } else { format!("axis = {axis:?}\n") };
        joints += &format!(
            "[[joint]]\nname = \"{parent}_{child}\"\ntype = \"{kind}\"\nparent = \"{parent}\"\nchild = \
             \"{child}\"\nposition = {at:?}\n{axis}"
        );
    };
    for i in 0..4 {
        let x = i as f64;
        body(format!("b{i}"), 1.0, [x + 0.5, 0.0, 0.0], [1.0, 0.1, 0.1]);
        let axis = if i % 2 == 0 { [0.0, 1.0, 0.0] } else { [0.0, 0.0, 1.0] };
        if i > 0 {
            joint("revolute", format!("b{}", i - 1), format!("b{i}"), [x, 0.0, 0.0], axis);
        } else if base != "free" {
            joint(base, "ground".into(), "b0".into(), [0.0; 3], axis);
        }
        if i == 2 {
            continue;
        }
        let (left, right, top) = (format!("left{i}"), format!("right{i}"), format!("top{i}"));
        body(left.clone(), 0.2, [x + 0.3, 0.15, 0.0], [0.05, 0.3, 0.04]);
        body(right.clone(), 0.3, [x + 0.7, 0.15, 0.0], [0.05, 0.3, 0.04]);
        body(top.clone(), 0.25, [x + 0.5, 0.3, 0.0], [0.4, 0.05, 0.04]);
        let z = [0.0, 0.0, 1.0];
        joint("revolute", format!("b{i}"), left.clone(), [x + 0.3, 0.0, 0.0], z);
        joint("revolute", format!("b{i}"), right.clone(), [x + 0.7, 0.0, 0.0], z);
        joint("revolute", left, top.clone(), [x + 0.3, 0.3, 0.0], z);
        joint("revolute", right, top, [x + 0.7, 0.3, 0.0], z);
    }
    text += &joints;
    for (name, ends) in [
        (
            "inner",
            "from = \"b3\"\npoint_from = [0.1, 0.2, 0.4]\nto = \"b1\"\npoint_to = [0, -0.3, 0.2]",
        ),
        (
            "outer",
            "from = \"top3\"\npoint_from = [0, 0, 0.3]\nto = \"ground\"\npoint_to = [2, 1, 1]",
        ),
    ] {
        if struts.contains(&name) {
            text += &format!("[[constraint]]\ntype = \"distance\"\nname = \"{name}\"\n{ends}\n");
        }
    }
    text
}

/// A spring that couples two bodies and pulls with nothing worth mentioning.
const COUPLING: &str = "[[spring]]\nname = \"coupling\"\nfrom = \"b0\"\nto = \"top1\"\nstiffness = 1e-20\n\
                        natural_length = 1.0\n";

#[test]
fn every_scheme_and_solver_gives_the_same_motion() {
    for base in ["revolute", "spherical", "free"] {
        for struts in [&[][..], &["inner"], &["outer"], &["inner", "outer"]] {
            let text = mechanism(base, struts);
            let coupled = text.clone() + COUPLING;
            let mut reference: Option<(Vec<f64>, usize)> = None;
            for (text, scheme, solver) in [
                (&text, "nodal", "auto"),
                (&text, "reduced", "auto"),
                (&coupled, "nodal", "dense"),
                (&coupled, "nodal", "sparse"),
                (&text, "constrained", "auto"),
            ] {
                let overrides = [("simulation.scheme", scheme), ("simulation.solver", solver)];
                let mut run = Run::with(text, 0.01, 2, &overrides);
                run.steps(40);
                let closed = run.residual();
                let iterations = run.iterations;
                let q = run.q();
                let (expected, most) =
                    reference.get_or_insert_with(|| (q.to_vec(), iterations + 20));
                let apart =
                    q.iter().zip(&*expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                println!(
                    "{base} {struts:?}, {scheme} {solver}: {apart:.1e} apart, |g| {closed:.1e}, \
                     {iterations} iterations"
                );
                assert!(apart < 1e-12 && closed < 1e-14, "{apart:e} {closed:e}");
                // matrices that couple bodies verify each solution by one more iteration
                let most = *most + if solver == "auto" { 0 } else { 40 };
                assert!(scheme == "constrained" || iterations <= most, "{iterations} > {most}");
            }
        }
    }
}
