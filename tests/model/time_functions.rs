//! Histories and paths by expressions: what they are beside those by keys, what is refused, where
//! they have no value.

#![allow(clippy::unwrap_used)] // a test

use super::laws::{apart, links, run};
use holonom::Model;
use vi_testkit::model::{head, part};

const SCHEMES: [&str; 4] = [
    "scheme = \"nodal\"",
    "scheme = \"constrained\"",
    "scheme = \"em-nodal\"",
    "method = \"galerkin\", order = 4",
];

/// A history by keys and the same by an expression.
const HISTORIES: [[&str; 2]; 4] = [
    ["{ type = \"harmonic\", frequency = 3.0, phase = 0.4 }", "\"sin(2*pi*3*t + 0.4)\""],
    ["{ type = \"ramp\", start = 0.05, end = 0.2 }", "\"clamp((t - 0.05)/0.15, 0, 1)\""],
    ["{ type = \"linear\", end = 0.1 }", "\"t/0.1\""],
    ["{ type = \"constant\" }", "1"],
];

const PATH: [&str; 2] = [
    "{ offset = 0.1, rate = -3.0, acceleration = 1.5, amplitude = 0.2, frequency = 0.8, phase = 0.4, \
       moves = [{ start = 0.02, end = 0.2, by = 0.7 }] }",
    "\"0.1 - 3*t + 0.75*t^2 + 0.2*(sin(1.6*pi*t + 0.4) - sin(0.4)) + 0.7*smooth(t, 0.02, 0.2)\"",
];

#[test]
fn histories_by_expressions_move_as_those_by_keys() {
    for [keys, expression] in HISTORIES {
        let of = |history: &str| {
            let load = "body = \"lower\"\nforce = [3.0, 0.0, 40.0]\n";
            let motor = format!("motor = {{ effort = 4.0, history = {history} }}\n");
            let text = format!("{}{load}history = {history}\n", part("load", "push"));
            links("", &text).replacen("rate = -2.0\n", &format!("rate = -2.0\n{motor}"), 1)
        };
        for scheme in SCHEMES {
            let [a, b] = [keys, expression].map(|history| {
                run(&of(history).replacen("end = 0.25,", &format!("end = 0.25, {scheme}"), 1))
                    .unwrap()
            });
            let distance = apart(&a, &b);
            println!("{scheme}, {expression}: {distance:.1e}");
            assert!(distance < 1e-12 && a.last().unwrap().q != a[0].q, "{scheme}: {distance:e}");
        }
    }
}

/// Along a beam and on a point mass, where loads are made from others.
#[test]
fn beams_and_particles_take_expressions() {
    let beam = part("beam", "cane")
        + "points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]\nelements = 3\nstart = \"clamped\"\n\
           section = { shape = { type = \"circle\", dimensions = [0.02] }, material = { E = 1e8, nu = 0.3, density = 1000.0 } }\n";
    let ball = part("particle", "ball") + "mass = 0.3\nposition = [0.0, 0.0, 1.0]\n";
    for [keys, expression] in HISTORIES {
        let [a, b] = [keys, expression].map(|history| {
            let loads = [
                "beam = \"cane\"\nforce = [0.0, 0.0, 3.0]\n",
                "beam = \"cane\"\nat = 0.4\nforce = [0.0, 2.0, 0.0]\n",
                "body = \"ball\"\nforce = [1.0, 0.0, 0.0]\n",
            ];
            let loads = loads.iter().enumerate().map(|(k, load)| {
                format!("{}{load}history = {history}\n", part("load", &format!("push{k}")))
            });
            let text = head("cane", "step = 2e-3, end = 0.1") + &beam + &ball;
            run(&(text + &loads.collect::<String>())).unwrap()
        });
        let distance = apart(&a, &b);
        println!("{expression}: {distance:.1e}");
        assert!(distance < 1e-12 && a.last().unwrap().q != a[0].q, "{distance:e}");
    }
}

/// A prescribed motion takes value, rate and acceleration; the control of a motor value and rate.
/// Energies and reactions need all three.
#[test]
fn paths_by_expressions_move_as_those_by_keys() {
    let motion = |path: &str| {
        let text = part("constraint", "lead");
        text + &format!("type = \"motion\"\njoint = \"elbow\"\npath = {path}\n")
    };
    let force = part("sensor", "effort") + "type = \"effort\"\nof = \"lead\"\n";
    for scheme in SCHEMES {
        let [a, b] = PATH.map(|path| {
            let start = "project_start = true";
            let text = links(&format!("{start}, {scheme}"), &(motion(path) + &force));
            run(&text.replacen("rate = -2.0\n", "", 1)).unwrap()
        });
        let efforts = a.iter().zip(&b).map(|(a, b)| (a.sensors[0] - b.sensors[0]).abs());
        let (distance, effort) = (apart(&a, &b), efforts.fold(0.0, f64::max));
        println!("{scheme}: coordinates {distance:.1e}, effort {effort:.1e} N·m");
        assert!(distance < 1e-12 && effort < 1e-8, "{scheme}");
        let [a, b] = PATH.map(|path| {
            let motor =
                format!("motor = {{ proportional = 200.0, derivative = 3.0, path = {path} }}\n");
            run(&links(scheme, "").replacen("rate = -2.0\n", &motor, 1)).unwrap()
        });
        let distance = apart(&a, &b);
        println!("{scheme}, control: {distance:.1e}");
        assert!(distance < 1e-11, "{scheme}: {distance:e}");
    }
}

/// A table of the model file in a path: what it has between its points, with its derivatives.
#[test]
fn a_path_calls_a_table() {
    let table = part("table", "lift")
        + "points = [[0, 0], [0.1, 0.3], [0.25, 0.2]]\ninterpolation = \"spline\"\n";
    let lead = part("constraint", "lead")
        + "type = \"motion\"\njoint = \"elbow\"\npath = \"0.5*lift(t)\"\n";
    let nodes =
        run(&links("project_start = true", &(lead + &table)).replacen("rate = -2.0\n", "", 1))
            .unwrap();
    // the angle of the elbow from the directors of both links
    let turn = |q: &[f64]| -> f64 {
        let x = |k: usize| [q[12 * k + 3], q[12 * k + 5]];
        let ([a, b], [c, d]) = (x(0), x(1));
        (c * b - a * d).atan2(a * c + b * d)
    };
    let at = |t: f64| nodes.iter().find(|node| (node.t - t).abs() < 1e-12).unwrap();
    let (first, last) = (turn(&at(0.1).q), turn(&at(0.25).q));
    println!("{first:.15} {last:.15}");
    assert!((first.abs() - 0.15).abs() < 1e-12 && (last.abs() - 0.1).abs() < 1e-12);
}

#[test]
fn what_is_no_function_of_time_is_refused_at_its_place() {
    let load = |history: &str| {
        format!(
            "{}body = \"lower\"\nforce = [1.0, 0.0, 0.0]\nhistory = {history}\n",
            part("load", "push")
        )
    };
    let lead = |path: &str| {
        format!(
            "{}type = \"motion\"\njoint = \"elbow\"\npath = {path}\n",
            part("constraint", "lead")
        )
    };
    for (acting, key, why) in [
        (load("\"sin(tt)\""), "load.push.history", "`tt` is not known"),
        (load("\"elbow\""), "load.push.history", "a function of time does not read `elbow`"),
        (load("\"lower.vx\""), "load.push.history", "write a [[law]]"),
        (load("\"x\""), "load.push.history", "`x` is not known"),
        (load("\"1/t\""), "load.push.history", "`1/t` is not finite"),
        (load("\"2*(t\""), "load.push.history", "closing bracket"),
        (load("\"= 2*t\""), "load.push.history", "no parameter `t`"),
        (
            load("[1.0]"),
            "load.push.history",
            "expected a history: a table with a `type`, or a text",
        ),
        (load("{ type = \"step\" }"), "load.push.history", "step"),
        (lead("\"elbow.rate\""), "constraint.lead.path", "does not read `elbow.rate`"),
        (
            lead("\"sqrt(t)\""),
            "constraint.lead.path",
            "the first derivative of `sqrt(t)` is not finite",
        ),
        (
            lead("\"t^1.5\""),
            "constraint.lead.path",
            "the second derivative of `t^1.5` is not finite",
        ),
        (lead("{ ofset = 0.1 }"), "constraint.lead.path", "ofset"),
        (lead("true"), "constraint.lead", "expected a path: a table, or a text"),
    ] {
        let error = run(&links("", &acting)).unwrap_err();
        assert!(error.contains(why) && error.contains(&format!("\"{key}")), "{acting}\n{error}");
    }
    for (key, why) in
        [("history = \"lower.x\"", "lower.x"), ("path = \"sin(u)\"", "`u` is not known")]
    {
        let motor = format!("motor = {{ effort = 1.0, {key} }}\n");
        let error = run(&links("", "").replacen("rate = -2.0\n", &motor, 1)).unwrap_err();
        let place = format!("joint.elbow.motor.{}", &key[..4]);
        assert!(error.contains(why) && error.contains(&place), "{error}");
    }
}

/// The run ends with the name of the load, the motor or the motion and the expression.
#[test]
fn a_function_of_time_without_a_value_is_named() {
    let load = part("load", "push")
        + "body = \"lower\"\nforce = [1.0, 0.0, 0.0]\nhistory = \"sqrt(0.101 - t)\"\n";
    let lead = part("constraint", "lead")
        + "type = \"motion\"\njoint = \"elbow\"\npath = \"sqrt(0.101 - t)\"\n";
    let motor = "motor = { effort = 1.0, history = \"sqrt(0.101 - t)\" }\n";
    let control = "motor = { proportional = 5.0, path = \"sqrt(0.101 - t)\" }\n";
    let of_joint = |motor: &str| links("", "").replacen("rate = -2.0\n", motor, 1);
    for (text, owner) in [
        (links("", &load), "the history of `push`"),
        (
            links("project_start = true", &lead).replacen("rate = -2.0\n", "", 1),
            "the path of `lead`",
        ),
        (of_joint(motor), "the history of the motor of `elbow`"),
        (of_joint(control), "the path of the motor of `elbow`"),
    ] {
        let error = run(&text).unwrap_err();
        println!("{error}");
        assert!(error.contains(&format!("{owner}: `sqrt(0.101 - t)` is not defined")), "{error}");
        assert!(error.contains(" at t = 0.1"), "{error}");
    }
}

/// Parameters stand in them after overrides; the resolved text gives the same model.
#[test]
fn a_function_of_time_is_data() {
    let text = links(
        "project_start = true",
        "[parameters]\na = 0.2\n[[load]]\nname = \"push\"\nbody = \"lower\"\nforce = [1.0, 0.0, 0.0]\nhistory = \"a*t\"\n\
         [[constraint]]\nname = \"lead\"\ntype = \"motion\"\njoint = \"elbow\"\npath = \"a*t^2\"\n",
    )
    .replacen("rate = -2.0\n", "motor = { effort = 1.0, history = \"a\", path = \"-a*t\" }\n", 1);
    let set = [holonom::model::Override::new("parameters.a", "-3")];
    let model = Model::from_toml_with(&text, &set).unwrap();
    let resolved = model.to_toml();
    for expected in [
        "history = \"(-3.0)*t\"",
        "path = \"(-3.0)*t^2\"",
        "history = \"(-3.0)\"",
        "path = \"-(-3.0)*t\"",
    ] {
        assert!(resolved.contains(expected), "{expected} is not in\n{resolved}");
    }
    assert_eq!(Model::from_toml(&resolved).unwrap(), model);
}

/// Statics takes a history at its time; loads without one grow.
#[test]
fn statics_takes_expressions_at_their_time() {
    let of = |history: &str| {
        let text = head("held", "scheme = \"static\", step = 0.5, end = 1.0")
            + &vi_testkit::model::body("arm", 1.0, [0.1; 3])
            + &vi_testkit::model::hinge("pin", ["ground", "arm"], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0])
            + "spring = { stiffness = 10.0 }\n"
            + &part("load", "turn")
            + "body = \"arm\"\ntorque = [0.0, 3.0, 0.0]\n"
            + history;
        let nodes = run(&text).unwrap();
        let angles: Vec<f64> =
            nodes.iter().skip(1).map(|node| node.q[3].atan2(node.q[5])).collect();
        angles
    };
    let [a, b] = ["", "history = \"t\"\n"].map(of);
    println!("{a:?}\n{b:?}");
    assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-12) && a.len() == 2);
    let squares = of("history = \"t^2\"\n");
    assert!((squares[0] - a[0]).abs() > 1e-2 && (squares[1] - a[1]).abs() < 1e-12, "{squares:?}");
}
