//! Events of the model file: where they act, what they change, what is kept across them, what is
//! refused.

#![allow(clippy::unwrap_used)] // a test

use crate::harness::case::distance;
use crate::harness::models::orders;
use holonom::run::prepare;
use holonom::{EventRecord, Model, RunState, Sample, Simulation};
use vi_testkit::model::{AXES, along, between, body, changed, head, heavy, part, sensor};

/// The nodes of a run that does not fail.
fn run(text: &str) -> Vec<Sample> {
    let model = Model::from_toml(text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    let mut simulation = Simulation::new(&model).unwrap_or_else(|error| panic!("{error}"));
    simulation.samples().map(|sample| sample.unwrap_or_else(|f| panic!("{}", f.message))).collect()
}

fn events(nodes: &[Sample]) -> Vec<EventRecord> {
    nodes.iter().flat_map(|node| node.events.iter().cloned()).collect()
}

/// A rod on a hinge, with what happens to it.
fn rod(settings: &str, event: &str) -> String {
    heavy("rod", [0.0, 0.0, -9.81], &format!("step = 0.01, end = 0.9, {settings}"))
        + &body("rod", 1.2, [0.002, 0.05, 0.05])
        + "position = [0.4, 0.0, 0.0]\n"
        + &part("joint", "pin")
        + "type = \"revolute\"\nparent = \"ground\"\nchild = \"rod\"\nposition = [0.0, 0.0, 0.0]\n\
           axis = [0.0, 1.0, 0.0]\nrate = 0.7\n"
        + &part("sensor", "angle")
        + "type = \"joint_coordinate\"\nof = \"pin\"\n"
        + &part("sensor", "hold")
        + "type = \"reaction\"\nof = \"pin\"\n"
        + &part("sensor", "speed")
        + "type = \"velocity\"\nof = \"rod\"\n"
        + event
}

/// The same text with other actions for the same event.
fn ending(text: &str, action: &str) -> String {
    let changed = text.replace(action, "end = true\n");
    assert_ne!(changed, text);
    changed
}

/// What is let go flies in the parabola of its place and velocity there, through the rest of the
/// step and all that follow; its joint has a coordinate and no reaction.
#[test]
fn a_released_body_flies_in_a_parabola() {
    let release = "release = [\"pin\"]\n";
    for scheme in ["nodal", "reduced", "constrained", "dalembert", "em-nodal"] {
        let event = part("event", "throw") + "when = \"rod.x < 0.1 and pin.rate > 0\"\n" + release;
        let text = rod(&format!("scheme = \"{scheme}\""), &event);
        let (nodes, stopped) = (run(&text), run(&ending(&text, release)));
        let (acted, last) = (events(&nodes), stopped.last().unwrap());
        assert_eq!(acted.len(), 1, "{acted:?}");
        assert_eq!((nodes.len(), last.t.to_bits()), (91, acted[0].t.to_bits()));
        assert!((last.q[0] - 0.1).abs() < 1e-13, "x = {}", last.q[0]);
        let velocity = &last.sensors[8..11];
        let mut worst = 0.0_f64;
        for node in nodes.iter().filter(|node| node.t > acted[0].t) {
            let s = node.t - acted[0].t;
            let z = last.q[2] + velocity[2] * s - 0.5 * 9.81 * s * s;
            worst = worst.max((node.q[0] - last.q[0] - velocity[0] * s).abs());
            worst = worst.max((node.q[2] - z).abs());
            assert!(node.sensors[1..7].iter().all(|r| *r == 0.0), "{:?}", node.sensors);
            assert!(node.sensors[0] > last.sensors[0], "the angle goes on");
        }
        let balance = nodes.last().unwrap().energies.last().unwrap().abs();
        println!("{scheme}: at {}, apart {worst:.1e} m, balance {balance:.1e} J", acted[0].t);
        assert!(worst < 1e-12, "{scheme}: {worst:e}");
        // velocities of energy–momentum schemes may miss the constraints by `O(h²)`
        let lost = acted[0].energy_lost;
        println!("{scheme}: lost {lost:.1e} J");
        assert!(if scheme.starts_with("em-") { lost.abs() < 1e-3 } else { lost == 0.0 });
        assert!(acted[0].impulse.is_none());
    }
}

/// Two discs on one axis after many revolutions: both turn with the same momentum, and what is lost
/// is that of a plastic impact.
#[test]
fn a_lock_is_a_plastic_impact() {
    let (a, b, speed): (f64, f64, f64) = (0.3, 0.2, 30.0);
    for scheme in ["nodal", "constrained", "em-nodal", "em-constrained"] {
        let text = head("clutch", &format!("step = 0.01, end = 0.6, scheme = \"{scheme}\""))
            + &body("a", 2.0, [0.2, 0.2, a])
            + &body("b", 1.0, [0.1, 0.1, b])
            + &part("joint", "shaft")
            + "type = \"revolute\"\nparent = \"ground\"\nchild = \"a\"\nposition = [0.0, 0.0, 0.0]\n\
               axis = [0.0, 0.0, 1.0]\n"
            + &part("joint", "clutch")
            + "type = \"revolute\"\nparent = \"a\"\nchild = \"b\"\nposition = [0.0, 0.0, 0.0]\n\
               axis = [0.0, 0.0, 1.0]\nrate = 30.0\n"
            + &part("sensor", "slip")
            + "type = \"joint_coordinate\"\nof = \"clutch\"\n"
            + &part("sensor", "rate")
            + "type = \"joint_rate\"\nof = \"shaft\"\n"
            + &part("event", "engage")
            + "when = \"clutch > 8.0\"\nlock = [\"clutch\"]\n";
        let nodes = run(&text);
        let acted = events(&nodes);
        let last = nodes.last().unwrap();
        let common = b * speed / (a + b);
        let reduced = a * b / (a + b);
        let loss = 0.5 * reduced * speed * speed;
        println!("{scheme}: {acted:?}, rate {}, slip {}", last.sensors[1], last.sensors[0]);
        // a step turns by Δθ with sin Δθ = h ω
        assert!((acted[0].t - 8.0 / speed).abs() < 0.02 * acted[0].t);
        assert!((acted[0].energy_lost - loss).abs() < 1e-10 * loss);
        assert!((acted[0].impulse.unwrap() + reduced * speed).abs() < 1e-11);
        assert!((last.sensors[1] - common).abs() < 1e-10, "{}", last.sensors[1] - common);
        assert!((last.sensors[0] - 8.0).abs() < 1e-11, "{}", last.sensors[0] - 8.0);
        let drift = (last.momentum.angular[2] - nodes[0].momentum.angular[2]).abs();
        assert!(drift < 1e-12 && last.energies.last().unwrap().abs() < 1e-9, "{drift:e}");
        assert!((last.work + loss).abs() < 1e-10 * loss, "work {}", last.work);
    }
}

/// A hoist that parts of its drive leave above and join below: each acts again after its condition
/// was false. The times are those of exponentials, to order 2.
#[test]
fn hysteresis_is_two_events() {
    let exact = [0.6905977984144821, 2.357154564903995];
    let text = |step: f64, more: &str| {
        heavy("hoist", [0.0, 0.0, -9.81], &format!("step = {step:?}, end = 3.0"))
            + &body("load", 1.0, [0.01; 3])
            + &part("joint", "height")
            + "type = \"prismatic\"\nparent = \"ground\"\nchild = \"load\"\nposition = [0.0, 0.0, 0.0]\n\
               axis = [0.0, 0.0, 1.0]\n"
            + &part("law", "weight")
            + "joint = \"height\"\neffort = \"8.81 - 0.8*v\"\n"
            + &part("law", "hoist")
            + "joint = \"height\"\neffort = \"2.5\"\n"
            + &part("event", "off")
            + "when = \"height > 0.3\"\ndisable = [\"hoist\"]\nonce = false\n"
            + more
            + &part("event", "on")
            + "when = \"height < 0.1\"\nenable = [\"hoist\"]\nonce = false\n"
            + more
    };
    let mut errors = Vec::new();
    for step in [0.02, 0.01, 0.005] {
        let acted = events(&run(&text(step, "")));
        let names: Vec<&str> = acted.iter().map(|event| event.event.as_str()).collect();
        assert_eq!(names, ["off", "on"]);
        let pairs = acted.iter().zip(exact);
        errors.push(pairs.fold(0.0, |worst: f64, (own, t)| worst.max((own.t - t).abs())));
    }
    let orders = orders(&errors);
    println!("errors {errors:?}: orders {orders:?}");
    assert!(orders.iter().all(|order| (1.9..2.1).contains(order)) && errors[1] < 2.2e-5);
    // at the ends of steps: of first order
    let acted = events(&run(&text(0.01, "locate = \"step\"\n")));
    let steps: Vec<f64> = acted.iter().map(|event| event.t / 0.01).collect();
    println!("located at the ends of steps {steps:?}");
    assert!(steps.iter().all(|step| (step - step.round()).abs() < 1e-9));
    assert!(acted[0].t > exact[0] && acted[0].t < exact[0] + 0.0101);
}

/// The order of a composition holds through a release.
#[test]
fn the_order_of_a_composition_holds_through_a_release() {
    let place = |step: f64| {
        let event =
            part("event", "throw") + "when = \"pin > 1.3 or pin < -4\"\nrelease = [\"pin\"]\n";
        let text = rod("order = 4", &event).replace("step = 0.01", &format!("step = {step:?}"));
        run(&text).last().unwrap().q.clone()
    };
    let exact = place(0.005);
    let errors = [0.1, 0.05, 0.025].map(|step| distance(&place(step), &exact));
    let orders = orders(&errors);
    println!("errors {errors:?}: orders {orders:?}");
    assert!(orders[1] > 3.7, "{orders:?}");
}

/// Times are met exactly, at nodes and between them, in their order; the run ends where it is told.
#[test]
fn times_are_met() {
    let event = part("event", "late")
        + "at = 0.4321\nend = true\n"
        + &part("event", "early")
        + "at = 0.2\nlock = [\"pin\"]\n"
        + &part("event", "first")
        + "at = 0.0\ndisable = [\"push\"]\n"
        + &part("load", "push")
        + "body = \"rod\"\nforce = [0.0, 3.0, 9.0]\n";
    let nodes = run(&rod("order = 2", &event));
    let acted = events(&nodes);
    let found: Vec<(&str, f64)> = acted.iter().map(|e| (e.action.as_str(), e.t)).collect();
    println!("{found:?}");
    assert_eq!(found, [("disable push", 0.0), ("lock pin", 0.2), ("end", 0.4321)]);
    let last = nodes.last().unwrap();
    assert_eq!((last.t, last.step, nodes.len()), (0.4321, 44, 45));
    assert!(last.hamiltonian.is_finite() && (last.sensors[0] - nodes[20].sensors[0]).abs() < 1e-13);
    assert!(last.work + acted[1].energy_lost < 1e-9, "the load does nothing: {}", last.work);
    assert!(acted[1].energy_lost > 0.1);
}

/// A swinging chain that is let go, locked and switched: continued from any node, in data, it takes
/// the steps that it would have taken.
#[test]
fn a_run_with_events_continues_bit_for_bit() {
    let text = heavy("chain", [0.0, 0.0, -9.81], "step = 0.01, end = 1.0")
        + &body("upper", 1.0, [0.001, 0.0208, 0.0208])
        + "position = [0.25, 0.0, 0.0]\n"
        + &body("lower", 0.8, [0.001, 0.0107, 0.0107])
        + "position = [0.5, 0.0, 0.2]\n"
        + &part("joint", "shoulder")
        + "type = \"revolute\"\nparent = \"ground\"\nchild = \"upper\"\nposition = [0.0, 0.0, 0.0]\n\
           axis = [0.0, 1.0, 0.0]\nmotor = { proportional = 3.0, derivative = 0.1 }\n"
        + &part("joint", "elbow")
        + "type = \"revolute\"\nparent = \"upper\"\nchild = \"lower\"\nposition = [0.5, 0.0, 0.0]\n\
           axis = [0.0, 1.0, 0.0]\n"
        + &part("sensor", "angles")
        + "type = \"joint_coordinate\"\nof = \"elbow\"\n"
        + &part("sensor", "shakes")
        + "type = \"acceleration\"\nof = \"lower\"\n"
        + &part("event", "idle")
        + "when = \"upper.vz < -0.5\"\ndisable = [\"shoulder\"]\nonce = false\n"
        + &part("event", "drive")
        + "when = \"shoulder > 0.9\"\nenable = [\"shoulder\"]\nonce = false\n"
        + &part("event", "latch")
        + "when = \"abs(elbow) > 0.7\"\nlock = [\"elbow\"]\n"
        + &part("event", "drop")
        + "at = 0.613\nrelease = [\"shoulder\"]\n";
    let model = Model::from_toml(&text).unwrap();
    let mut simulation = Simulation::new(&model).unwrap();
    let mut states = vec![simulation.state()];
    let mut whole = Vec::new();
    let mut observe = |sample: &Sample| {
        whole.push(sample.clone());
        Ok::<(), ()>(())
    };
    // paused at each node
    while simulation
        .run_while(&mut observe, &mut |step, _| step < states.len() as u64)
        .unwrap()
        .is_none()
    {
        states.push(simulation.state());
    }
    let acted = events(&whole);
    let names: Vec<&str> = acted.iter().map(|event| event.action.as_str()).collect();
    println!("{names:?}");
    for action in ["disable shoulder", "lock elbow", "release shoulder"] {
        assert!(names.contains(&action), "{action}: {names:?}");
    }
    let expected = run(&text);
    assert_eq!(whole, expected, "pauses change nothing");
    for state in states.iter().step_by(9) {
        let data = serde_json::to_string(state).unwrap();
        let state: RunState = serde_json::from_str(&data).unwrap();
        let mut other = Simulation::new(&model).unwrap();
        let first = state.step() as usize;
        other.resume(state).unwrap();
        let rest: Vec<Sample> = other.samples().map(|sample| sample.unwrap()).collect();
        assert_eq!(rest, expected[first..], "from node {first}");
        // and back again, with the mechanism of the start
        other.resume(states[0].clone()).unwrap();
        let again = other.samples().next().unwrap().unwrap();
        assert_eq!(again, expected[0], "from the start, after node {first}");
    }
}

/// Two conditions that become true at one place act together, in the order of the file, and one
/// that the first makes true acts there, too.
#[test]
fn events_at_one_place_act_together() {
    let event = part("event", "both")
        + "when = \"rod.x < 0.2\"\nlock = [\"pin\"]\n"
        + &part("event", "other")
        + "when = \"0.2 > rod.x\"\ndisable = [\"push\"]\n"
        + &part("event", "stopped")
        + "when = \"abs(pin.rate) < 0.01\"\nend = true\n"
        + &part("load", "push")
        + "body = \"rod\"\nforce = [0.0, 3.0, 0.0]\n";
    let nodes = run(&rod("order = 2", &event));
    let acted = events(&nodes);
    let found: Vec<&str> = acted.iter().map(|event| event.action.as_str()).collect();
    assert_eq!(found, ["lock pin", "disable push", "end"]);
    assert!(acted.iter().all(|event| event.t.to_bits() == acted[0].t.to_bits()));
    assert_eq!(nodes.last().unwrap().t.to_bits(), acted[0].t.to_bits());
}

/// Each refusal names the place and what to write.
#[test]
fn events_that_make_no_sense_are_refused() {
    let lock = "lock = [\"pin\"]\n";
    let cases = [
        ("when = \"pin > 1\"\n".to_owned(), "the event does nothing"),
        (lock.to_owned(), "does not say when it acts"),
        (format!("at = 0.1\nwhen = \"pin > 1\"\n{lock}"), "a condition and a time"),
        (format!("at = -0.1\n{lock}"), "before the start"),
        (format!("when = \"pin\"\n{lock}"), "compares two numbers"),
        (format!("when = \"pim > 1\"\n{lock}"), "`pim` is not known: did you mean `pin`?"),
        (format!("when = \"rod.q > 1\"\n{lock}"), "`rod.q` is not known"),
        (format!("when = \"= pin > 1\"\n{lock}"), "there is no parameter `pin`"),
        (format!("when = \"2 > 1\"\n{lock}"), "never changes"),
        (format!("when = \"hold.fx > 1\"\n{lock}"), "depends on the step that follows"),
        (format!("when = \"speed.q > 1\"\n{lock}"), "has no number of this name"),
        ("at = 0.1\nrelease = [\"pit\"]\n".to_owned(), "named `pit`: did you mean `pin`?"),
        ("at = 0.1\nrelease = [\"pin\", \"pin\"]\n".to_owned(), "stands twice"),
        ("at = 0.1\nrelease = [\"rod\"]\n".to_owned(), "`rod` is a body"),
        ("at = 0.1\ndisable = [\"pin\"]\n".to_owned(), "has no motor"),
        ("at = 0.1\nlock = [\"pin.1\"]\n".to_owned(), "no coordinate 1"),
        ("at = 0.1\nset = { power = 1.0 }\n".to_owned(), "named `power`"),
        (format!("when = \"pin > 1\"\nonce = false\n{lock}"), "is done once"),
        (
            format!("at = 0.1\n{lock}") + &part("event", "again") + "at = 0.2\n" + lock,
            "locked by `odd`, too",
        ),
        (format!("at = 0.1\nlocate = \"node\"\n{lock}"), "unknown value"),
    ];
    for (event, expected) in cases {
        let text = rod("order = 2", &(part("event", "odd") + &event));
        let refused = Model::from_toml(&text).and_then(|model| prepare(&model).map(|_| ()));
        let message = refused.err().map_or_else(|| "accepted".to_owned(), |e| format!("{e:?}"));
        println!("{message}");
        let found = expected.split(": ").all(|part| message.contains(part));
        assert!(found && message.contains("event."), "{event}\n{message}");
    }
}

/// A condition without a value ends the run with the name of the event.
#[test]
fn a_condition_without_a_value_ends_the_run() {
    let event = part("event", "odd") + "when = \"sqrt(rod.x) > 7\"\nend = true\n";
    let model = Model::from_toml(&rod("order = 2", &event)).unwrap();
    let mut simulation = Simulation::new(&model).unwrap();
    let failure = simulation.samples().find_map(Result::err).unwrap();
    println!("{} {}", failure.message, failure.remedy);
    assert!(failure.message.contains("event `odd`: `sqrt(rod.x)` is not defined at t = "));
}

/// A run that is interrupted before and after a release, and goes on from its checkpoint, leaves
/// the files of the run that was not, also where wheels roll on after an event.
#[test]
fn files_of_runs_with_events_do_not_depend_on_interruptions() {
    let trebuchet = include_str!("../../examples/models/trebuchet.toml").to_owned();
    let disc = include_str!("../../examples/models/rolling_disc.toml").to_owned()
        + &part("particle", "load")
        + "mass = 0.1\nposition = [0.0, 0.0, 1.0]\n"
        + &part("spring", "cord")
        + "from = \"disc\"\nto = \"load\"\nstiffness = 20.0\n"
        + &part("event", "cut")
        + "when = \"disc.x > 0.15\"\nrelease = [\"cord\"]\n";
    let cases = [("trebuchet", trebuchet, 1.2), ("disc", disc, 0.6)];
    for (name, text, end) in cases {
        let set = [
            holonom::Override::new("simulation.end", format!("{end:?}")),
            holonom::Override::new("simulation.every", "3"),
        ];
        let model = Model::from_toml_with(&text, &set).unwrap();
        let folder = |case: &str| {
            let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("events");
            let path = path.join(format!("{name}_{case}"));
            let _ = std::fs::remove_dir_all(&path);
            path
        };
        let whole = folder("whole");
        write_until(&model, &whole, u64::MAX);
        let events = std::fs::read_to_string(whole.join("events.csv")).unwrap();
        assert_eq!(events.lines().count(), 2, "{events}");
        for stop in [7, 40, 100] {
            let parted = folder(&format!("parted_{stop}"));
            write_until(&model, &parted, stop);
            go_on(&parted);
            for file in ["trajectory.csv", "events.csv", "energy.csv", "residuals.csv"] {
                let [found, expected] = [&parted, &whole].map(|path| path.join(file));
                let [found, expected] =
                    [found, expected].map(|path| std::fs::read_to_string(path).unwrap_or_default());
                assert!(found == expected, "{name}: {file} differs after a pause at {stop}");
            }
        }
    }
}

/// What a run asks, interrupted before a step.
fn controlled<'a>(
    interrupted: &'a mut dyn FnMut() -> bool,
    progress: &'a mut dyn FnMut(u64, u64),
) -> holonom::run::RunControl<'a> {
    let notice = Box::leak(Box::new(|_: &str| {})); // has no size
    let (checkpoint_every, report, command) = (None, false, None);
    holonom::run::RunControl { progress, notice, interrupted, checkpoint_every, report, command }
}

fn write_until(model: &Model, path: &std::path::Path, stop: u64) {
    let mut simulation = holonom::run::prepare(model).unwrap();
    let folder = holonom::RunFolder::create(path, true).unwrap();
    let mut step = 0;
    let mut interrupted = || {
        step += 1;
        step > stop
    };
    let mut progress = |_, _| {};
    let control = controlled(&mut interrupted, &mut progress);
    holonom::run::run_with(model, &mut *simulation, &folder, control).unwrap();
}

fn go_on(path: &std::path::Path) {
    let folder = holonom::RunFolder::reopen(path).unwrap();
    let text = folder.model_text();
    let model = Model::from_toml(&text).unwrap();
    let mut simulation = holonom::run::prepare(&model).unwrap();
    let found = folder.read_checkpoint(&text).unwrap();
    let mut interrupted = || false;
    let mut progress = |_, _| {};
    let control = controlled(&mut interrupted, &mut progress);
    holonom::run::resume(&model, &mut *simulation, &folder, found.checkpoint, control).unwrap();
}

/// A condition that is true at the start is told: it acts when it becomes true again.
#[test]
fn a_condition_that_is_true_at_the_start_is_told() {
    let event = part("event", "stop") + "when = \"rod.x < 5\"\nend = true\n";
    let simulation =
        Simulation::new(&Model::from_toml(&rod("order = 2", &event)).unwrap()).unwrap();
    let warnings = simulation.warnings();
    println!("{warnings:?}");
    assert!(
        warnings
            .iter()
            .any(|w| w.contains("event `stop` is true at the start: it acts when it becomes true")),
        "{warnings:?}"
    );
    let later = part("event", "stop") + "when = \"rod.x > 500\"\nend = true\n";
    let simulation =
        Simulation::new(&Model::from_toml(&rod("order = 2", &later)).unwrap()).unwrap();
    assert!(!simulation.warnings().iter().any(|w| w.contains("at the start")));
}

/// A cart on springs of all kinds, which are let go: what they stored is lost, what they did stays.
#[test]
fn what_is_let_go_stores_nothing_and_has_done_its_work() {
    let names = ["tug", "mount", "coil", "rail"];
    let text = |step: f64| {
        let works: String =
            names.iter().map(|name| sensor(&format!("by_{name}"), "work", name)).collect();
        head("let_go", &format!("step = {step:?}, end = 0.6"))
            + &body("cart", 2.0, [0.1, 0.1, 0.1])
            + &along(AXES[0], "prismatic", "rail", ["ground", "cart"], [0.0; 3])
            + "rate = 1.5\nspring = { stiffness = 7.0, rest = 0.1 }\n"
            + &part("law", "tug")
            + "joint = \"rail\"\neffort = \"-30*x - 40*x^3\"\n"
            + &between("bushing", "mount", ["ground", "cart"])
            + "position = [0.0, 0.0, 0.0]\nstiffness = [12.0, 0.0, 0.0, 0.0, 0.0, 0.0]\n"
            + &between("spring", "coil", ["ground", "cart"])
            + "point_from = [-1.0, 0.0, 0.0]\nstiffness = 5.0\nnatural_length = 0.8\n"
            + &works
            + &part("event", "go")
            + "at = 0.203\nrelease = [\"tug\", \"mount\", \"coil\"]\n"
    };
    let stored = |x: f64| {
        let coil = 2.5 * ((x + 0.2).powi(2) - 0.04);
        [15.0 * x * x + 10.0 * x.powi(4), 6.0 * x * x, coil, 3.5 * ((x - 0.1).powi(2) - 0.01)]
    };
    let balances = [0.01, 0.005].map(|step| {
        let text = text(step);
        let model = Model::from_toml(&text).unwrap();
        let columns = Simulation::new(&model).unwrap().energy_columns().to_vec();
        let column = |name: &str| columns.iter().position(|own| own == name).unwrap();
        let nodes = run(&text);
        let acted = events(&nodes);
        let lost: f64 = acted.iter().map(|event| event.energy_lost).sum();
        let mut worst = 0.0_f64;
        for node in &nodes {
            let e = &node.energies;
            let parts = ["kinetic", "springs", "energy.tug", "energy.mount"];
            let sum: f64 = parts.iter().map(|name| e[column(name)]).sum();
            assert!((sum - e[column("total")]).abs() < 1e-12, "parts at t = {}", node.t);
            let gone = node.t > 0.203;
            for name in ["energy.tug", "energy.mount"] {
                assert_eq!(e[column(name)] == 0.0, gone || node.step == 0, "{name}, {}", node.t);
            }
            let taken = if gone { -lost } else { 0.0 };
            assert!((e[column("work_of_events")] - taken).abs() < 1e-12);
            worst = worst.max(e[column("balance")].abs());
            // the work of what stores is what it stores
            let rail = stored(node.q[0])[3];
            assert!((node.sensors[3] + rail).abs() < 1e-12, "rail at t = {}", node.t);
            if !gone {
                let all = stored(node.q[0]);
                assert!((node.sensors[1] + all[1]).abs() < 1e-12, "mount at t = {}", node.t);
                assert!((node.sensors[2] + all[2]).abs() < 1e-12, "coil at t = {}", node.t);
                assert!((node.sensors[0] + all[0]).abs() < 0.2 * step, "tug at t = {}", node.t);
            }
        }
        let after: Vec<&Sample> = nodes.iter().filter(|node| node.t > 0.203).collect();
        let [first, last] = [after[0], after[after.len() - 1]];
        assert_eq!(first.sensors[..3], last.sensors[..3], "what was done stays");
        let done: f64 = first.sensors[..3].iter().sum();
        println!("h = {step}: lost {lost:.6} J, done {done:.6} J, balance {worst:.1e} J");
        let coil = 2.5 * 0.04; // stored at the start
        assert!((lost - coil + done).abs() < 0.3 * step, "{lost} J, {done} J");
        // to the bit from any node
        let mut simulation = Simulation::new(&model).unwrap();
        let mut part = Vec::new();
        let mut observe = |sample: &Sample| {
            part.push(sample.clone());
            Ok::<(), ()>(())
        };
        let _ = simulation.run_while(&mut observe, &mut |step, _| step < 30).unwrap();
        let state = serde_json::to_string(&simulation.state()).unwrap();
        let mut other = Simulation::new(&model).unwrap();
        other.resume(serde_json::from_str(&state).unwrap()).unwrap();
        let rest: Vec<Sample> = other.samples().map(|sample| sample.unwrap()).collect();
        assert_eq!(rest, nodes[30..]);
        worst
    });
    let order = (balances[0] / balances[1]).log2();
    assert!(order > 1.7, "balances {balances:?} J, order {order}");
}

/// What contacts remember goes on through an event that is none of theirs: impulses, the length of
/// the step before, the rates in it, revolutions. Without friction by what the pin transmits the
/// motion is the same to rounding errors; with it, to the second order of the step.
#[test]
fn contacts_go_on_through_an_event_that_changes_nothing_of_them() {
    let idle = part("load", "nothing")
        + "body = \"rod\"\nforce = [0.0, 0.0, 0.0]\n"
        + &part("event", "word")
        + "at = 0.3\ndisable = [\"nothing\"]\n";
    let end = |keys: &str, event: &str, h: f64| {
        let text = changed(&rod("", event), "rate = 0.7\n", &format!("rate = 0.7\n{keys}\n"));
        let text = changed(&text, "step = 0.01", &format!("step = {h}"));
        run(&text).last().unwrap().clone()
    };
    for keys in [
        "friction = { torque = 0.8 }", // slides
        "friction = { torque = 9.0 }", // stops and stays
        "limits = { upper = 0.25, restitution = 0.6 }",
        "limits = { upper = 0.1, restitution = 0.0 }\nfriction = { torque = 0.3 }",
    ] {
        let [plain, with] = ["", &idle].map(|event| end(keys, event, 0.01));
        let off = distance(&plain.q, &with.q);
        println!("{keys}: {off:.1e}");
        assert!(off < 1e-13, "{keys}: off by {off:e}");
    }
    let keys = "friction = { coefficient = 0.4, radius = 0.1 }";
    let off = [0.02, 0.01, 0.005].map(|h| {
        let [plain, with] = ["", &idle].map(|event| end(keys, event, h));
        distance(&plain.q, &with.q)
    });
    println!("by what the pin transmits: {off:?}");
    assert!(orders(&off).iter().all(|order| *order > 1.7) && off[2] > 0.0, "{off:?}");
}

/// A stop far from the principal value of its angle is not taken for an overlap by the next phase.
#[test]
fn revolutions_at_a_stop_are_kept_in_the_next_phase() {
    let keys = "limits = { lower = -1.0, upper = 200.0, restitution = 0.5 }";
    let event = part("load", "nothing")
        + "body = \"rod\"\nforce = [0.0, 0.0, 0.0]\n"
        + &part("event", "word")
        + "at = 0.5\ndisable = [\"nothing\"]\n";
    let text = changed(&rod("", &event), "rate = 0.7\n", &format!("rate = 20.0\n{keys}\n"));
    let last = run(&text).last().unwrap().clone();
    let angle = last.sensors[0];
    println!("angle {angle} at t = {}", last.t);
    assert!((10.0..40.0).contains(&angle) && last.t > 0.89, "{angle}");
}
