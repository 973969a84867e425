//! Nothing is allocated per step in the nodal, reduced and d'Alembert schemes; the constrained one
//! allocates a few times in a run, when pivoting enlarges the fill of its sparse factors. Beams, in
//! trees and in loops, are no exception.

#![allow(clippy::unwrap_used)] // a test

use crate::harness;

use harness::models::{overrides, shipped, simulation};
use holonom::model::Columns;
use holonom::output::{BeamWriter, EnergyWriter, MomentaWriter, SensorWriter, TrajectoryWriter};
use holonom::vi_constraints::{Options, SchemeKind};
use holonom::vi_core::Composition;
use holonom::vi_multibody::builder::{DryFriction, Inertia, JointLimits, MechanismBuilder};
use holonom::vi_multibody::ensemble::Ensemble;
use holonom::vi_multibody::joint_force::Viscous;
use holonom::vi_multibody::{FrameId, PairKind};
use holonom::vi_rigid::TimeHistory;
use holonom::{Model, Override, Sample, Simulation};
use std::fmt::Write;
use vi_testkit::CountingAllocator;
use vi_testkit::allocator::allocations;
use vi_testkit::model::{heavy, two_links};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

const TRIANGLE: &str = include_str!("../models/triangle_of_bars.toml");

const PID_ARM: &str = include_str!("../reference/laws/p01_pid_arm.toml");
const SAMPLED_PID: &str = include_str!("../reference/laws/p02_sampled_pid.toml");

/// What belongs to a step, sampled.
const SENSED: &str = r#"
[[sensor]]
name = "hold"
type = "reaction"
of = "shoulder"
[[sensor]]
name = "shakes"
type = "imu"
of = "arm"
[[signal]]
name = "felt"
every = 0.02
value = "hold.fx + 0.1*shakes.az"
[[signal]]
name = "later"
delay = { of = "shakes.ax", time = 0.03 }
[[law]]
name = "answer"
joint = "shoulder"
effort = "1e-3*felt + 1e-3*later"
"#;

const SPRUNG: &str = include_str!("../models/sprung_chain.toml");

#[test]
fn no_step_allocates() {
    no_step_of(200);
}

#[test]
#[ignore = "long: cargo test --release -- --ignored"]
fn none_of_many_steps_allocates() {
    no_step_of(1000);
}

/// `steps` steps of loops, 1000 of the other systems.
fn no_step_of(steps: u32) {
    let names =
        ["triangle", "sprung", "pendulum", "free_body", "heavy_top_steady", "four_particles"];
    let loops = ["four_bar_windows", "six_hinge_cube", "bricard", "andrews_squeezer"];
    for name in names.into_iter().chain(loops) {
        for scheme in ["nodal", "reduced", "constrained", "dalembert"] {
            if loops.contains(&name) && scheme == "constrained" {
                continue; // large sparse factors
            }
            let steps = if loops.contains(&name) { steps } else { 1000 };
            for order in [2, 4] {
                let set = [
                    ("simulation.scheme", scheme.to_owned()),
                    ("simulation.order", order.to_string()),
                ];
                let mut simulation = match name {
                    "triangle" | "sprung" => {
                        let text = if name == "sprung" { SPRUNG } else { TRIANGLE };
                        let model = Model::from_toml_with(text, &overrides(&set)).unwrap();
                        Simulation::new(&model).unwrap()
                    }
                    _ => simulation(name, &set),
                };
                let run = simulation.integrator();
                for _ in 0..10 {
                    run.step().unwrap(); // warm-up: patterns, symbolic factorizations
                }
                let before = allocations();
                for _ in 0..steps {
                    run.step().unwrap();
                }
                let allocations = allocations() - before;
                println!("{name}, {scheme}, order {order}: {allocations} in {steps} steps");
                // partial pivoting changes the fill of the sparse LU: its buffers may grow a few
                // times
                let allowed = if scheme == "constrained" { 16 } else { 0 };
                assert!(allocations <= allowed, "{name}, {scheme}, order {order}: {allocations}");
            }
        }
    }
}

/// Joint stops and dry friction, at rest, sliding, and where they are hit.
#[test]
fn no_step_with_contacts_allocates() {
    for friction in [DryFriction::Effort(0.1), pin_friction()] {
        let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
        let inertia = Inertia::principal(1.0, [1e-3, 0.08, 0.08]);
        let rod = builder.body("rod", inertia).at([0.5, 0.0, 0.0]).id();
        let hinge = builder.joint("hinge", PairKind::Revolute, FrameId::Ground, rod);
        let angle = hinge.at([0.0; 3]).axis([0.0, 1.0, 0.0]).id().coordinate(0);
        let limits = JointLimits { lower: Some(-0.5), upper: Some(2.0), restitution: 0.7 };
        builder.joint_limits(angle, limits);
        builder.joint_friction(angle, friction);
        let mut run = builder.build().unwrap().integrator(Options::new(SchemeKind::Nodal, 0.01));
        let run = run.as_mut().unwrap();
        for _ in 0..300 {
            run.step().unwrap(); // with impacts, and until it sticks
        }
        assert!(run.state().contacts.counts.impacts > 0);
        let before = allocations();
        for _ in 0..300 {
            run.step().unwrap();
        }
        let allocations = allocations() - before;
        println!("{friction:?}: {allocations}, {:?}", run.state().contacts.counts);
        assert_eq!(allocations, 0, "{friction:?}");
    }
}

fn pin_friction() -> DryFriction {
    DryFriction::Coefficient { coefficient: 0.2, radius: 0.05 }
}

/// Wheels that roll, blades and sums of rates with expressions, in trees and in loops.
#[test]
fn no_step_of_what_rolls_allocates() {
    let rates = shipped("bicycle")
        + "[[constraint]]\nname = \"tie\"\ntype = \"velocity\"\n\
           terms = [{ joint = \"steering\", factor = \"1 + 0.1*cos(steering)\" }]\n\
           value = \"0.01*sin(t) + 0*frame.y\"\n";
    let sleigh = include_str!("../reference/laws/p12_sleigh.toml").to_owned();
    let wheels = include_str!("../reference/laws/p16_two_wheels.toml").to_owned();
    let all = [
        ("bicycle", shipped("bicycle")),
        ("sum of rates", rates),
        ("sleigh", sleigh),
        ("two wheels", wheels),
    ];
    for (name, text) in all {
        // compositions refuse the dampers of the cart
        for order in [2, 4].into_iter().filter(|order| *order == 2 || name != "two wheels") {
            let set = [
                ("simulation.order", order.to_string()),
                ("simulation.project_start", "true".to_owned()),
            ];
            let model = Model::from_toml_with(&text, &overrides(&set)).unwrap();
            let mut simulation = Simulation::new(&model).unwrap();
            let run = simulation.integrator();
            for _ in 0..10 {
                run.step().unwrap();
            }
            let before = allocations();
            for _ in 0..60 {
                run.step().unwrap();
            }
            let allocated = allocations() - before;
            println!("{name}, order {order}: {allocated} in 60 steps");
            assert_eq!(allocated, 0, "{name}, order {order}");
        }
    }
}

#[test]
fn no_node_allocates() {
    for name in ["pendulum", "chain8", "bricard", "four_bar_windows", "andrews_squeezer"] {
        for multipliers in [false, true] {
            let mut simulation = simulation(name, &[]);
            let run = simulation.integrator();
            run.record_multipliers(multipliers);
            let mut allocated = 0;
            for step in 0..200 {
                run.step().unwrap();
                let before = allocations();
                run.node_before().unwrap();
                if step >= 10 {
                    allocated += allocations() - before;
                }
            }
            println!("{name}, multipliers {multipliers}: {allocated} in 190 nodes");
            assert_eq!(allocated, 0, "{name}, multipliers {multipliers}");
        }
    }
}

/// All quantities of recorded nodes, sensors of all joint reactions, multipliers and momenta, and
/// the rows of the tables, from the tenth node on.
#[test]
fn no_recorded_node_allocates() {
    let names = "pendulum chain8 heavy_top bricard four_bar_windows andrews_squeezer four_particles \
                 flying_beam satellite soft_arm";
    for name in names.split_whitespace() {
        for method in [("composition", 2), ("composition", 4), ("galerkin", 4)] {
            if (name, method) == ("soft_arm", ("composition", 4)) {
                continue; // refused: dampers
            }
            for all in [false, true] {
                let allocated = while_recording(&recorded(name, method, all));
                println!("{name}, {method:?}, all {all}: {allocated} in 49 nodes");
                assert_eq!(allocated, 0, "{name}, {method:?}, all {all}");
            }
        }
    }
}

/// A shipped model with 60 steps by a method of some order; `all`: with multipliers, momenta and a
/// sensor for each joint.
fn recorded(name: &str, (method, order): (&str, u32), all: bool) -> Model {
    let mut text = shipped(name);
    let model = Model::from_toml(&text).unwrap();
    for joint in model.joints.iter().filter(|_| all) {
        let of = &joint.name;
        let sensor = format!("name = \"R{of}\"\nof = \"{of}\"\ntype = \"reaction\"\n");
        write!(text, "\n[[sensor]]\n{sensor}").unwrap();
    }
    let end = (60.0 * model.settings.step).to_string();
    let overrides = [
        ("method", format!("\"{method}\"")),
        ("order", order.to_string()),
        ("every", "1".into()),
        ("momenta", all.to_string()),
        ("end", end),
    ];
    let overrides = overrides.map(|(key, value)| Override::new(format!("simulation.{key}"), value));
    Model::from_toml(&text).unwrap().with_overrides(&overrides).unwrap()
}

/// Allocations from the tenth node to the last but one; the last one takes a step on a copy of the
/// state.
fn while_recording(model: &Model) -> usize {
    let mut simulation = Simulation::new(model).unwrap();
    let [a, b, c, d, e] = std::array::from_fn(|_| std::io::sink());
    let (columns, sensors) = (Columns::usual(), simulation.sensors().columns());
    let mut rows = TrajectoryWriter::new([a, b], simulation.members(), &columns, false).unwrap();
    let mut beams = BeamWriter::new(c, simulation.beams()).unwrap();
    let mut sensors = SensorWriter::new(d, sensors).unwrap();
    let mut energies = EnergyWriter::new(e, simulation.energy_columns()).unwrap();
    let names = simulation.momenta_names().unwrap_or_default();
    let mut momenta = MomentaWriter::new(std::io::sink(), &names).unwrap();
    let mut counts = Vec::with_capacity(64);
    let mut observe = |sample: &Sample| {
        counts.push(allocations());
        rows.record(sample)?;
        beams.record(sample)?;
        sensors.record(sample)?;
        momenta.record(sample)?;
        energies.record(sample)
    };
    simulation.run(&mut observe, &mut |_, _| {}).unwrap();
    assert_eq!(counts.len(), 61);
    counts[59] - counts[10]
}

/// Steps of members in lanes allocate nothing, however many they are: with nothing but gravity,
/// with springs and dampers of joints, with springs, dampers and loads on bodies; recorded or not,
/// of order 2 or composed.
#[test]
fn no_step_of_an_ensemble_allocates() {
    let swing = |k: u32, acting: &str| {
        let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
        let bar = Inertia::principal(1.0 + 0.1 * f64::from(k), [0.01, 0.1, 0.1]);
        let mut parent = FrameId::Ground;
        for i in 0..4 {
            let link = builder.body("link", bar).at([f64::from(i) + 0.5, 0.0, 0.0]).id();
            let hinge = builder.joint("hinge", PairKind::Revolute, parent, link);
            let hinge = hinge.at([f64::from(i), 0.0, 0.0]).axis([0.0, 1.0, 0.0]).id();
            if acting == "joints" {
                builder.joint_spring(hinge.coordinate(0), 3.0, 0.1);
                builder.joint_force(hinge.coordinate(0), Viscous(0.2));
            }
            if acting == "bodies" {
                builder.spring([1.0, 0.0, 2.0], link.point([0.1; 3]), 5.0).natural_length(0.2);
                let ramp = TimeHistory::Ramp { start: 0.01, end: 0.2, amplitude: 1.0 };
                builder.load(link).force([0.3, 0.0, 0.1]).follower().history(ramp);
            }
            parent = link.into();
        }
        builder.build().unwrap()
    };
    let cases = [("gravity", 2), ("joints", 2), ("bodies", 2), ("gravity", 4), ("bodies", 4)];
    for ((acting, order), recorded) in cases.into_iter().flat_map(|c| [(c, false), (c, true)]) {
        let composition = Composition::of_order(order).unwrap();
        let options = Options::new(SchemeKind::Nodal, 1e-4).composition(composition);
        let mut ensemble = Ensemble::new((0..8).map(|k| swing(k, acting)), options).unwrap();
        assert_eq!(ensemble.in_lanes(), 8);
        let mut rows: Vec<Option<Vec<f64>>> =
            (0..8).map(|_| recorded.then(|| Vec::with_capacity(2000))).collect();
        let mut count = |steps: u64| {
            let before = allocations();
            ensemble.record(steps, &mut rows, |rows, mut member| {
                rows.push(member.transition().after.q[0]);
                rows.push(member.node_before().unwrap().hamiltonian_projected.total());
            });
            allocations() - before
        };
        let [_, few, many] = [10, 10, 800].map(&mut count);
        let (alone, read) =
            (ensemble.steps_alone(), rows.iter().flatten().map(Vec::len).sum::<usize>());
        println!("{acting}, order {order}, {read} numbers: {few} and {many}, {alone} steps alone");
        assert_eq!((few, alone), (many, 8), "{acting}, order {order}, recorded {recorded}");
        assert_eq!(read, if recorded { 8 * 2 * 820 } else { 0 });
    }
}

/// A law of signals of every kind, of another joint and of its own coordinate.
#[test]
fn no_step_with_laws_and_signals_allocates() {
    let sensed = format!("{SAMPLED_PID}\n{SENSED}");
    for (name, text) in [("continuous", PID_ARM), ("sampled", SAMPLED_PID), ("sensed", &sensed)] {
        let more = "[[signal]]\nname = \"past\"\ndelay = { of = \"shoulder\", time = 0.0125 }\n\
                    [[law]]\nname = \"own\"\njoint = \"shoulder\"\neffort = \"-0.1*abs(v)*v\"\n\
                    [[law]]\nname = \"wind\"\non = \"arm\"\nforce = [\"past - shoulder.rate\", \"0\", \"-vz\"]\n\
                    [[load]]\nname = \"push\"\nbody = \"arm\"\nforce = [1.0, 0.0, 0.0]\nhistory = \"sin(t)\"\n";
        for scheme in ["nodal", "reduced", "dalembert"] {
            let set = [("simulation.scheme", scheme.to_owned())];
            let text = format!("{text}\n{more}");
            let model = Model::from_toml_with(&text, &overrides(&set)).unwrap();
            let mut simulation = Simulation::new(&model).unwrap();
            for _ in 0..10 {
                simulation.step().unwrap();
            }
            let before = allocations();
            for _ in 0..150 {
                simulation.step().unwrap();
            }
            let allocated = allocations() - before;
            println!("{name}, {scheme}: {allocated} in 150 steps");
            assert_eq!(allocated, 0, "{name}, {scheme}");
            let set = [
                ("simulation.scheme", scheme.to_owned()),
                ("simulation.every", "1".to_owned()),
                ("simulation.end", "0.3".to_owned()),
            ];
            let model = Model::from_toml_with(&text, &overrides(&set)).unwrap();
            let allocated = while_recording(&model);
            println!("{name}, {scheme}: {allocated} in 49 nodes");
            assert_eq!(allocated, 0, "{name}, {scheme}");
        }
    }
}

/// Laws between links that read other joints, other bodies and states, in steps by sweeps and in
/// Galerkin steps; and along the axes of another body.
#[test]
fn no_step_with_laws_that_read_others_allocates() {
    let laws = "[[signal]]\nname = \"lag\"\nfilter = { of = \"elbow + upper.wy\", time_constant = 0.1 }\n\
                [[law]]\nname = \"first\"\njoint = \"shoulder\"\neffort = \"-5*sin(elbow) - x + 2*lower.x\"\n\
                [[law]]\nname = \"second\"\njoint = \"elbow\"\neffort = \"-3*(x - lag) - v + 0.2*shoulder.rate\"\n";
    let relative = "[[law]]\nname = \"pull\"\non = \"lower\"\nrelative_to = \"upper\"\n\
                    force = [\"-x\", \"-vy\", \"wz\"]\ntorque = [\"-wx\", \"0\", \"0\"]\n";
    for (name, settings, laws) in [
        ("sweeps", "", laws.to_owned()),
        ("galerkin", "method = \"galerkin\", order = 4", laws.to_owned()),
        ("relative", "", laws.to_owned() + relative),
    ] {
        let text =
            heavy("links", [0.0, 0.0, -9.81], &format!("step = 5e-3, end = 2.0, {settings}"))
                + &two_links(
                    [2.0, 1.0],
                    [[0.01, 0.2, 0.2], [0.01, 0.1, 0.1]],
                    ["rate = 0.3\n", "rate = -2.0\n"],
                )
                + &laws;
        let mut simulation = Simulation::new(&Model::from_toml(&text).unwrap()).unwrap();
        for _ in 0..20 {
            simulation.step().unwrap();
        }
        let before = allocations();
        for _ in 0..150 {
            simulation.step().unwrap();
        }
        let allocated = allocations() - before;
        println!("{name}: {allocated} in 150 steps");
        assert_eq!(allocated, 0, "{name}");
    }
}

#[test]
fn no_step_of_beams_allocates() {
    for name in ["flexible_multibody", "elastic_ring", "flexible_four_bar"] {
        for scheme in ["nodal", "reduced"] {
            let mut simulation = simulation(name, &[("simulation.scheme", scheme.to_owned())]);
            for _ in 0..10 {
                simulation.step().unwrap(); // warm-up: patterns, symbolic factorizations
            }
            let before = allocations();
            for _ in 0..100 {
                simulation.step().unwrap();
            }
            let allocations = allocations() - before;
            println!("{name}, {scheme}: {allocations} in 100 steps");
            assert_eq!(allocations, 0, "{name}, {scheme}");
        }
    }
}
