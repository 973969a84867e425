//! What a gradient costs, in runs: by one sweep backward, whatever the number of derivatives.
//!
//! Chains of hinges (`benches/chain.rs`) with motors and in Galerkin steps, a four-bar linkage, the
//! six-hinge linkage on the edges of a cube; by the masses or by the lengths of links as
//! parameters, by values of controls. A run and a gradient are taken in turn, each 25 times; the
//! least times count, and their ratio. A gradient is shorter than a time slice: on a loaded machine
//! longer ones are all interrupted. At the end chains of 32 to 512 links: how the time of a
//! gradient grows with them. `verb`: the whole of `holonom gradient`, from the model on, with two
//! terms and the growth of a change. Names among the arguments choose cases.
#![allow(clippy::unwrap_used)] // a bench

use holonom::Simulation;
use holonom::gradient::{Wanted, gradient as of_model};
use holonom::model::ModelText;
use holonom::nalgebra::{Matrix3, Vector3};
use holonom::vi_constraints::{Constraints, Options, SchemeKind};
use holonom::vi_control::objective::{Effort, Last, PointComponent};
use holonom::vi_control::{
    Checkpoints, ControlForce, Controls, Gradient, JointControl, Objective, Task,
};
use holonom::vi_core::galerkin::Stages;
use holonom::vi_core::{MechanicalSystem, Quadrature};
use holonom::vi_multibody::builder::{Inertia, MechanismBuilder};
use holonom::vi_multibody::design::{BodyTangent, JointTangent, MechanismDesign, MechanismTangent};
use holonom::vi_multibody::form::Form;
use holonom::vi_multibody::held_effort::HeldEffort;
use holonom::vi_multibody::joint_force::Viscous;
use holonom::vi_multibody::run::MechanismIntegrator;
use holonom::vi_multibody::{ForceElements, FrameId, PairKind};
use holonom::vi_rigid::Shape;
use std::path::Path;
use std::time::Instant;

/// How many steps of a run are taken, and what controls it.
struct Case {
    name: String,
    steps: usize,
    controls: Controls,
}

/// What acts along the hinges of a chain.
#[derive(Clone, Copy)]
enum Along {
    Nothing,
    /// Motors on the first eight of them, each with so many values.
    Motors(usize),
    /// A spring and a damper on each.
    Springs,
}

/// A chain of so many hinges.
fn chain(
    n: usize,
    (step, steps): (f64, usize),
    along: Along,
    stages: Option<Stages>,
) -> (Case, MechanismIntegrator) {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let bar = Inertia::shape_of_mass(Shape::Box { lengths: [1.0, 0.1, 0.1] }, 1.0);
    let rate = 0.1_f64.min(6.4 / n as f64); // the last link of a long chain turns with all of them
    let (mut parent, mut driven) = (FrameId::Ground, Vec::new());
    let (motors, values) = match along {
        Along::Motors(values) => (8, values.min(steps)),
        _ => (0, 1),
    };
    for i in 0..n {
        let link = builder.body(&format!("b{i}"), bar).at([i as f64 + 0.5, 0.0, 0.0]).id();
        let axis = if i.is_multiple_of(2) { [0.0, 1.0, 0.0] } else { [0.0, 0.0, 1.0] };
        let hinge = builder.joint(&format!("j{i}"), PairKind::Revolute, parent, link);
        let hinge = hinge.at([i as f64, 0.0, 0.0]).axis(axis).rate(rate).id().coordinate(0);
        if i < motors {
            let effort = HeldEffort::default();
            builder.joint_force(hinge, effort.clone());
            driven.push((hinge, effort));
        }
        if let Along::Springs = along {
            builder.joint_spring(hinge, 5.0, 0.1);
            builder.joint_force(hinge, Viscous(0.1));
        }
        parent = link.into();
    }
    let mut built = builder.build().unwrap();
    let force = |(hinge, effort)| {
        let coordinate = built.coordinate(hinge).unwrap();
        Box::new(JointControl { effort, coordinate }) as Box<dyn ControlForce>
    };
    let forces: Vec<_> = driven.into_iter().map(force).collect();
    let controls = Controls::new(forces, vec![vec![0.01; motors]; values], steps / values);
    let (options, how) = match stages {
        Some(stages) => {
            let how = format!(", Galerkin steps of order {}", stages.order());
            (Options::new(SchemeKind::Nodal, step).galerkin(stages), how)
        }
        None => (Options::new(SchemeKind::Nodal, step), String::new()),
    };
    let run = built.integrator(options).unwrap();
    let with = if let Along::Springs = along { " with springs" } else { "" };
    (Case { name: format!("chain of {n}{with}, h = {step} s{how}"), steps, controls }, run)
}

const LOOPS: [(&str, fn(Option<Stages>) -> MechanismIntegrator); 2] =
    [("four-bar linkage", four_bar), ("six-hinge linkage", six_hinges)];

/// Steps of 1 ms.
fn fine(stages: Option<Stages>) -> Options {
    let options = Options::new(SchemeKind::Nodal, 1e-3);
    match stages {
        Some(stages) => options.galerkin(stages),
        None => options,
    }
}

fn four_bar(stages: Option<Stages>) -> MechanismIntegrator {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let bar = |mass| Inertia::principal(mass, [0.02, 0.05, 0.04]);
    let crank = builder.body("crank", bar(0.8)).at([0.0, 0.0, 0.15]).id();
    let coupler = builder.body("coupler", bar(1.6)).at([0.45, 0.0, 0.4]).id();
    let rocker = builder.body("rocker", bar(1.1)).at([0.85, 0.0, 0.25]).id();
    for (parent, child, x, z) in [
        (FrameId::Ground, crank, 0.0, 0.0),
        (crank.into(), coupler, 0.0, 0.3),
        (FrameId::Ground, rocker, 0.8, 0.0),
        (coupler.into(), rocker, 0.9, 0.5),
    ] {
        let hinge = builder.joint("hinge", PairKind::Revolute, parent, child);
        hinge.at([x, 0.0, z]).axis([0.0, 1.0, 0.0]);
    }
    builder.build().unwrap().integrator(fine(stages)).unwrap()
}

/// The shipped model `six_hinge_cube`, falling.
fn six_hinges(stages: Option<Stages>) -> MechanismIntegrator {
    let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
    let (i, o) = (1.0, 0.0);
    let corners = [[o, o, o], [i, o, o], [i, -i, o], [i, -i, i], [o, -i, i], [o, o, i]];
    let axes = [[o, -i, o], [o, o, -i], [-i, o, o]];
    let links = (0..6).map(|k| {
        let ends = [corners[k], corners[(k + 1) % 6]].map(Vector3::from);
        let mut lengths = [0.1; 3];
        lengths[k % 3] = 1.0;
        let bar = Inertia::shape_of_mass(Shape::Box { lengths }, 1.0);
        builder.body(&format!("link {k}"), bar).at((ends[0] + ends[1]) * 0.5).id()
    });
    let links: Vec<_> = links.collect();
    for k in 0..6 {
        let hinge = builder.joint("hinge", PairKind::Revolute, links[(k + 5) % 6], links[k]);
        hinge.at(corners[k]).axis(axes[k % 3]);
    }
    builder.build().unwrap().integrator(fine(stages)).unwrap()
}

/// What a parameter is.
#[derive(Clone, Copy, Debug)]
enum By {
    Masses,
    Lengths,
}

/// So many parameters, each of one link or of one joint; of a linkage that closes with other
/// lengths only if all change in proportion, of all joints.
fn tangents(run: &MechanismIntegrator, by: By, count: usize) -> Vec<MechanismTangent> {
    let description = run.constraints().description();
    let tangent = |k: usize| {
        let mut tangent = MechanismTangent::default();
        match by {
            By::Masses => {
                let inertia = Matrix3::from_diagonal(&Vector3::new(1e-3, 1e-2, 1e-2));
                let change = BodyTangent::of_inertia(1.0 + k as f64, &inertia);
                tangent.bodies.insert(k % description.bodies.len(), change);
            }
            By::Lengths if run.constraints().has_loops() => {
                for (j, joint) in description.joints.iter().enumerate() {
                    let mut change = JointTangent::default();
                    change.parent.anchor = joint.parent.anchor * (1.0 + k as f64);
                    change.child.anchor = joint.child.anchor * (1.0 + k as f64);
                    tangent.joints.insert(j, change);
                }
            }
            By::Lengths => {
                let mut change = JointTangent::default();
                change.parent.anchor.x = 1.0 + k as f64;
                tangent.joints.insert(k % description.joints.len(), change);
            }
        }
        tangent
    };
    (0..count).map(tangent).collect()
}

/// Seconds of the run and of its gradient by so many parameters.
fn measure(
    run: &mut MechanismIntegrator,
    case: &Case,
    (by, count): (By, usize),
    rounds: usize,
) -> [f64; 2] {
    let Case { steps, ref controls, .. } = *case;
    let n = run.constraints().dim();
    let height = PointComponent { point: Form::particle(n - 12, 3), axis: 2 };
    let objective = Objective::new().with(1.0, Last(height)).with(1.0, Effort { of: vec![] });
    let (tangents, mass) = (tangents(run, by, count), run.system().mass());
    let (quadrature, forces) = (Quadrature::Midpoint, ForceElements::default());
    let design = MechanismDesign::new(run.constraints(), &forces, mass, quadrature, &tangents);
    let design = design.unwrap();
    let task = Task {
        steps,
        objective: &objective,
        controls,
        design: (count > 0).then_some(&design as _),
        by_step: false,
        checkpoints: Checkpoints::default(),
    };
    let (start, mut least) = (run.state().clone(), [f64::INFINITY; 2]);
    for _ in 0..rounds {
        run.place_at(&start);
        let begin = Instant::now();
        for step in 0..steps {
            controls.set(step);
            run.step().unwrap();
        }
        least[0] = least[0].min(begin.elapsed().as_secs_f64());
        run.place_at(&start);
        let begin = Instant::now();
        let found = Gradient::of(run, &task).unwrap();
        least[1] = least[1].min(begin.elapsed().as_secs_f64());
        assert!(found.value.is_finite() && found.parameters.len() == count);
    }
    run.place_at(&start);
    least
}

/// All parameters of one case.
fn report(run: &mut MechanismIntegrator, case: &Case, rounds: usize) {
    let count = case.controls.values().len() * case.controls.count();
    for by in [
        (By::Masses, 0),
        (By::Masses, 1),
        (By::Masses, 10),
        (By::Masses, 1000),
        (By::Lengths, 1),
        (By::Lengths, 10),
        (By::Lengths, 1000),
    ] {
        let [alone, gradient] = measure(run, case, by, rounds);
        println!(
            "{}, {count} controls, {} {:?}: a step {:.2} µs, a gradient {:.2} runs",
            case.name,
            by.1,
            by.0,
            1e6 * alone / case.steps as f64,
            gradient / alone
        );
    }
}

fn main() {
    // what is freed stays at hand afterwards: memory that the system gives costs more than a sweep
    drop(vec![0_u8; 31 << 20]);
    let quick = std::env::args().any(|a| a == "--test");
    let named: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let chosen = |name: &str| named.is_empty() || named.iter().any(|own| name.contains(own));
    let rounds = if quick { 1 } else { 25 };
    let acting = [Along::Nothing, Along::Motors(1), Along::Motors(100), Along::Springs];
    let all = [(1, 1e-3, 1000), (8, 1e-3, 200), (8, 1e-2, 200), (64, 1e-3, 30), (64, 1e-2, 30)];
    let all = all.into_iter().chain([(512, 1e-3, 20)]);
    for (n, h, steps) in all.take(if quick { 1 } else { 6 }) {
        for along in acting.into_iter().take(if n < 8 { 1 } else { 4 }) {
            let (case, mut run) = chain(n, (h, steps), along, None);
            if chosen(&case.name) {
                report(&mut run, &case, rounds);
            }
        }
    }
    let of_order = |stages: usize| Stages::new(stages).unwrap();
    let sizes = [1, 8, 64, 512].into_iter().flat_map(|n| (1..=3).map(move |s| (n, s)));
    for (n, stages) in sizes {
        let acting = [Along::Nothing, Along::Motors(1), Along::Springs];
        for along in acting.into_iter().take(if n == 8 { 3 } else { 1 }) {
            let h = if n < 512 { 1e-2 } else { 1e-3 };
            let steps = (h, 8 + 100 / n);
            let (case, mut run) = chain(n, steps, along, Some(of_order(stages)));
            if chosen(&case.name) && !quick {
                report(&mut run, &case, rounds);
            }
        }
    }
    for stages in [None, Some(of_order(2))] {
        let how = if stages.is_some() { ", Galerkin steps of order 4" } else { "" };
        for (name, run) in LOOPS {
            let name = format!("{name}{how}");
            if chosen(&name) && (stages.is_none() || !quick) {
                let case = Case { name, steps: 100, controls: Controls::default() };
                report(&mut run(stages), &case, rounds);
            }
        }
    }
    if chosen("verb") {
        for (n, steps) in [(1, 20000), (8, 4000), (64, 1000), (512, 300)] {
            for springs in [false, true] {
                verb(n, if quick { 10 } else { steps }, springs, rounds);
            }
        }
    }
    if chosen("growth") {
        let links: &[usize] = if quick { &[32, 64] } else { &[32, 64, 128, 256, 512] };
        growth(links, None, rounds);
        if !quick {
            growth(links, Some(of_order(2)), rounds);
        }
    }
}

/// A model file of a chain of so many hinges, with its mass and its length as parameters.
fn model_text(n: usize, steps: usize, springs: bool) -> String {
    let (rate, end) = (0.1_f64.min(6.4 / n as f64), 1e-3 * steps as f64);
    let mut text = format!(
        "model = {{ name = \"chain\", gravity = [0.0, 0.0, -9.81] }}\n\
         simulation = {{ step = 1e-3, end = {end} }}\nparameters = {{ mass = 1.0, length = 1.0 }}\n"
    );
    for i in 0..n {
        let parent = i.checked_sub(1).map_or("ground".to_owned(), |k| format!("b{k}"));
        let axis = ["[0.0, 1.0, 0.0]", "[0.0, 0.0, 1.0]"][i % 2];
        let at = i as f64 + 0.5;
        let elements = match springs {
            true => "spring = { stiffness = 5.0, rest = 0.1 }\ndamper = { damping = 0.1 }\n",
            false => "",
        };
        text += &format!(
            "[[body]]\nname = \"b{i}\"\nposition = [\"= {at}*length\", 0.0, 0.0]\nmass = \"= mass\"\n\
             inertia = [1e-3, 0.08, 0.08]\n[[joint]]\nname = \"j{i}\"\ntype = \"revolute\"\n\
             parent = \"{parent}\"\nchild = \"b{i}\"\nposition = [\"= {i}*length\", 0.0, 0.0]\n\
             axis = {axis}\nrate = {rate}\n{elements}"
        );
    }
    text += &format!("[[sensor]]\nname = \"tip\"\ntype = \"position\"\nof = \"b{}\"\n", n - 1);
    for (name, part) in [("height", "z"), ("reach", "x")] {
        text += &format!(
            "[[objective]]\nname = \"{name}\"\ntype = \"sensor\"\nsensor = \"tip.{part}\"\ntarget = 0.3\n"
        );
    }
    text
}

/// CPU time of this thread, s.
#[cfg(unix)]
fn cpu() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Time that passes, s, where the system has no other.
#[cfg(not(unix))]
fn cpu() -> f64 {
    let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    since.unwrap().as_secs_f64()
}

/// What `holonom gradient` computes, in runs without outputs, CPU time; what one step takes as
/// well, as the assembly of the model and derivatives of its start, stands apart.
fn verb(n: usize, steps: usize, springs: bool, rounds: usize) {
    let text = |steps| {
        let text = ModelText::from_text(Path::new("chain.toml"), model_text(n, steps, springs));
        let model = text.model(&[]).unwrap();
        (text, model)
    };
    let models = [text(1), text(steps)];
    let wanted = |parameters: bool, only: &[&str], initial: bool| Wanted {
        parameters,
        only: only.iter().map(|&own| own.to_owned()).collect(),
        initial,
        ..Wanted::everything()
    };
    let all = [
        ("a mass", wanted(true, &["mass"], false)),
        ("a length", wanted(true, &["length"], false)),
        ("initial values", wanted(false, &[], true)),
        ("all of these", wanted(true, &[], true)),
    ];
    let mut least = [[f64::INFINITY; 2]; 5];
    for _ in 0..rounds {
        for (k, (text, model)) in models.iter().enumerate() {
            let begin = cpu();
            let mut simulation = Simulation::new(model).unwrap();
            for _ in 0..model.settings.steps() {
                simulation.step().unwrap();
            }
            least[0][k] = least[0][k].min(cpu() - begin);
            for ((_, wanted), least) in all.iter().zip(&mut least[1..]) {
                let begin = cpu();
                let found = of_model(text, &[], model, wanted).unwrap();
                least[k] = least[k].min(cpu() - begin);
                assert!(found.value.is_finite() && found.terms.len() == 2);
            }
        }
    }
    let of_steps = |own: [f64; 2]| own[1] - own[0];
    let run = of_steps(least[0]);
    let with = if springs { " with springs" } else { "" };
    print!("verb, chain of {n}{with}, {steps} steps in {:.0} ms:", 1e3 * run);
    for ((name, _), own) in all.iter().zip(&least[1..]) {
        print!(" by {name} {:.2} runs and {:.0} ms;", of_steps(*own) / run, 1e3 * own[0]);
    }
    println!();
}

/// The exponent with which the time of a gradient grows between chains of so many links.
fn growth(links: &[usize], stages: Option<Stages>, rounds: usize) {
    let how = if stages.is_some() { " of Galerkin steps of order 4" } else { "" };
    for (by, count) in [(By::Masses, 1000), (By::Lengths, 10), (By::Lengths, 1000)] {
        let mut points = Vec::new();
        for &n in links {
            let (case, mut run) = chain(n, (1e-3, 8), Along::Nothing, stages);
            let seconds = measure(&mut run, &case, (by, count), rounds);
            points.push(seconds.map(|seconds| [(n as f64).ln(), seconds.ln()]));
        }
        let [of_run, of_gradient] = [0, 1].map(|i| slope(points.iter().map(|own| own[i])));
        println!(
            "growth{how}, {count} {by:?}: with the power {of_run:.2} of the links a run, {of_gradient:.2} a gradient"
        );
    }
}

/// Of the line of least squares through points `(x, y)`.
fn slope(points: impl Iterator<Item = [f64; 2]> + Clone) -> f64 {
    let mean =
        |i: usize| points.clone().map(|own| own[i]).sum::<f64>() / points.clone().count() as f64;
    let [x, y] = [0, 1].map(mean);
    let over = |f: fn(f64, f64) -> f64| -> f64 {
        points.clone().map(|own| f(own[0] - x, own[1] - y)).sum()
    };
    over(|x, y| x * y) / over(|x, _| x * x)
}
