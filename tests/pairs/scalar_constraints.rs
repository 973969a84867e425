//! Gears, screws, guides, distances and prescribed motion from a model file.

#![allow(clippy::unwrap_used)] // a test

use holonom::{Model, ModelError, Simulation};

const MODEL: &str = r#"
model = { name = "workshop", gravity = [0, 0, -9.81] }
simulation = { step = 0.005, end = 2.0 }

[[body]]
name = "wheel"
mass = 1.0
inertia = [0.1, 0.1, 0.2]
position = [0, 0, 0]
angular_velocity = [0, 0, 3.0]

[[body]]
name = "pinion"
mass = 0.5
inertia = [0.02, 0.02, 0.04]
position = [1, 0, 0]
angular_velocity = [0, 0, -7.5]

[[body]]
name = "nut"
mass = 2.0
inertia = [0.1, 0.1, 0.1]
position = [0, 3, 0]

[[body]]
name = "bead"
mass = 0.3
inertia = [0.01, 0.01, 0.01]
position = [0, -3, 0]

[[body]]
name = "plate"
mass = 0.7
inertia = [0.1, 0.2, 0.3]
position = [1, -3, 0]

[[joint]]
name = "wheel_axle"
type = "revolute"
parent = "ground"
child = "wheel"
position = [0, 0, 0]
axis = [0, 0, 1]

[[joint]]
name = "pinion_axle"
type = "revolute"
parent = "ground"
child = "pinion"
position = [1, 0, 0]
axis = [0, 0, 1]

[[joint]]
name = "spindle"
type = "screw"
pitch = 0.02
parent = "ground"
child = "nut"
position = [0, 3, 0]
axis = [0, 0, 1]

[[constraint]]
type = "gear"
name = "mesh"
joints = ["wheel_axle", "pinion_axle"]
ratio = 0.4

[[constraint]]
type = "motion"
name = "drive"
joint = "wheel_axle"
path = { rate = 3.0, acceleration = 1.5 }

[[constraint]]
type = "point_on_line"
name = "wire"
parent = "ground"
child = "bead"
position = [0, -3, 0.1]
axis = [1, 0, -1]

[[constraint]]
type = "distance"
name = "strut"
from = "bead"
to = "plate"
point_to = [-0.2, 0, 0]

[[constraint]]
type = "point_on_plane"
name = "table"
parent = "ground"
child = "plate"
position = [1, -3, -0.1]
axis = [0, 0, 1]
"#;

#[test]
fn every_kind_holds_in_every_scheme() {
    let mut ends: Vec<Vec<f64>> = Vec::new();
    for scheme in ["nodal", "reduced", "constrained", "dalembert"] {
        let text = MODEL.replace("end = 2.0", &format!("end = 2.0, scheme = \"{scheme}\""));
        let mut simulation = Simulation::new(&Model::from_toml(&text).unwrap()).unwrap();
        let report = simulation.assembly().clone();
        assert_eq!((report.counts.redundant_constraints, report.counts.dof), (0, 9), "{report:?}");
        for _ in 0..400 {
            simulation.integrator().step().unwrap();
        }
        let node = simulation.integrator().observe().unwrap().clone();
        let q = simulation.integrator().state().q.clone();
        // the wheel has turned by 3 t + 0.75 t² = 9 rad, the pinion by −9/0.4
        let angle = |body: usize| q[12 * body + 4].atan2(q[12 * body + 3]);
        let off = |found: f64, turned: f64| {
            let tau = std::f64::consts::TAU;
            ((found - turned) / tau - ((found - turned) / tau).round()).abs() * tau
        };
        let (wheel, pinion) = (off(angle(0), 9.0), off(angle(1), -9.0 / 0.4));
        // m p² + J: a_z = −g m p²/(m p² + J) with p = pitch/2π
        let p = 0.02 / std::f64::consts::TAU;
        let fall = 0.5 * 9.81 * 2.0 * p * p / (2.0 * p * p + 0.1) * 4.0;
        let nut = (q[26] + fall).abs() / fall; // order 2 in h ω, here 2e-3
        println!(
            "{scheme}: |g| ≤ {:.1e}, wheel off by {wheel:.1e}, pinion {pinion:.1e}, nut {nut:.1e} \
             (relative)",
            node.position_residual
        );
        assert!(node.position_residual < 1e-12 && wheel < 1e-12 && pinion < 1e-11);
        assert!(nut < 1e-5, "the nut has fallen by {} of {fall}", -q[26]);
        ends.push(q);
    }
    for end in &ends[1..] {
        let off = end.iter().zip(&ends[0]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("schemes differ by {off:.1e}");
        assert!(off < 1e-9, "{off:e}");
    }
}

#[test]
fn a_start_against_the_drive_is_refused_by_name() {
    let text = MODEL.replace("rate = 3.0", "rate = 2.0");
    let error = Simulation::new(&Model::from_toml(&text).unwrap()).map(|_| ()).unwrap_err();
    let ModelError::InconsistentStart(missed) = error else { panic!("{error}") };
    let keys: Vec<&str> = missed.iter().map(|m| m.key.as_str()).collect();
    println!("{missed:?}");
    assert_eq!(keys, ["constraint.drive"]);
}

#[test]
fn freedoms_that_do_not_exist_are_named() {
    let text = MODEL.replace("joint = \"wheel_axle\"", "joint = \"wheel_axle\"\nfreedom = 1");
    let error = Simulation::new(&Model::from_toml(&text).unwrap()).map(|_| ()).unwrap_err();
    println!("{error}");
    assert!(error.to_string().contains("no coordinate 1"), "{error}");
}

/// A driven wheel with a weight out of its axle, a gear of no simple ratio, a pendulum on the
/// pinion.
const TURNING: &str = r#"
model = { name = "turning", gravity = [0, 0, -9.81] }
simulation = { step = 0.01, end = 1.0, project_start = true }

[[body]]
name = "wheel"
mass = 1.0
inertia = [0.1, 0.2, 0.1]
position = [0.1, 0, 0]

[[body]]
name = "pinion"
mass = 0.5
inertia = [0.02, 0.04, 0.02]
position = [1, 0, 0.05]

[[body]]
name = "weight"
mass = 0.2
inertia = [0.01, 0.01, 0.01]
position = [1, 0.1, -0.3]

[[joint]]
name = "wheel_axle"
type = "revolute"
parent = "ground"
child = "wheel"
position = [0, 0, 0]
axis = [0, 1, 0]

[[joint]]
name = "pinion_axle"
type = "revolute"
parent = "ground"
child = "pinion"
position = [1, 0, 0]
axis = [0, 1, 0]

[[joint]]
name = "ball"
type = "spherical"
parent = "pinion"
child = "weight"
position = [1, 0.1, 0.1]

[[constraint]]
type = "gear"
name = "mesh"
joints = ["wheel_axle", "pinion_axle"]
ratio = 0.37

[[constraint]]
type = "motion"
name = "drive"
joint = "wheel_axle"
path = { rate = 20.0, amplitude = 0.5, frequency = 0.7 }
"#;

/// Revolutions are counted in whole numbers, and a step ends at the very time at which the next one
/// starts: neither the size of the angles nor of the time is left in `g(q_n, t_n)`.
#[test]
fn driven_gears_meet_their_constraints_to_round_off_after_many_turns() {
    driven_gears(600);
}

#[test]
#[ignore = "long: cargo test --release -- --ignored"]
fn driven_gears_meet_their_constraints_to_round_off_after_95_turns() {
    driven_gears(3_000);
}

fn driven_gears(steps: u64) {
    use holonom::certificate::subject::ModelSubject;
    use holonom::verification::measure::long_run;
    use holonom::verification::subject::{Method, Setting};
    use holonom::vi_constraints::SchemeKind;
    use holonom::vi_emscheme::EmForm;
    let subject = ModelSubject::new(Model::from_toml(TURNING).unwrap());
    let variational = SchemeKind::ALL.map(Method::Variational);
    let energy_momentum = EmForm::ALL.map(Method::EnergyMomentum);
    let orders = [2, 4].map(|order| variational.map(|method| (method, order)));
    let methods = orders.as_flattened().iter().copied();
    for (method, order) in methods.chain(energy_momentum.map(|method| (method, 2))) {
        let setting = Setting::new(method, order, 0.01);
        let run = match long_run(&subject, setting, steps) {
            Ok(run) => run,
            Err(why) => panic!("{} {order}: {why}", method.name()),
        };
        let gap = run.residuals().position;
        println!("{} {order}: |g| = {gap:.1e} after {steps} steps", method.name());
        assert!(gap < 1e-14, "{} {order}: {gap:e}", method.name());
    }
}
