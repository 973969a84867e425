//! Laws of the model file: what they are beside springs, what they keep, what is refused, where
//! they have no value.

#![allow(clippy::unwrap_used)] // a test

use crate::harness::case::distance;
use crate::harness::models::orders;
use holonom::run::prepare;
use holonom::{Model, RunOutcome, Sample};
use vi_testkit::model::{body, head, heavy, part, two_links};

pub(super) fn run(text: &str) -> Result<Vec<Sample>, String> {
    let model = Model::from_toml(text).map_err(|error| format!("{error:?}"))?;
    let mut run = prepare(&model).map_err(|error| format!("{error:?}"))?;
    let mut nodes = Vec::new();
    let mut observe = |sample: &Sample| {
        nodes.push(sample.clone());
        Ok(())
    };
    match run.run(&mut observe, &mut |_, _| {}).unwrap() {
        RunOutcome::Done => Ok(nodes),
        RunOutcome::Failed(failure) => Err(format!("{}; {}", failure.message, failure.remedy)),
    }
}

/// The largest difference of coordinates over all nodes.
pub(super) fn apart(a: &[Sample], b: &[Sample]) -> f64 {
    assert_eq!(a.len(), b.len());
    let all = |nodes: &[Sample]| nodes.iter().flat_map(|node| node.q.clone()).collect::<Vec<f64>>();
    distance(&all(a), &all(b))
}

/// Two links under gravity with what acts on them.
pub(super) fn links(settings: &str, acting: &str) -> String {
    heavy("links", [0.0, 0.0, -9.81], &format!("step = 5e-3, end = 0.25, {settings}"))
        + &two_links(
            [2.0, 1.0],
            [[0.01, 0.2, 0.2], [0.01, 0.1, 0.1]],
            ["rate = 0.3\n", "rate = -2.0\n"],
        )
        + acting
}

const SCHEMES: [&str; 7] = [
    "scheme = \"nodal\"",
    "scheme = \"constrained\"",
    "scheme = \"dalembert\"",
    "scheme = \"reduced\"",
    "scheme = \"em-nodal\"",
    "scheme = \"em-constrained\"",
    "method = \"galerkin\", order = 4",
];

/// Expressions of a spring and a damper give their motion, along joints and between points, where
/// springs are evaluated at the same places.
#[test]
fn a_law_that_is_a_spring_with_a_damper_moves_as_they_do() {
    let spring = "[[spring]]\nname = \"cord\"\nfrom = \"ground\"\nto = \"lower\"\n\
                  point_from = [0.5, 0.2, 0.7]\nstiffness = 60.0\nnatural_length = 0.8\ndamping = 1.5\n";
    let law = "[[law]]\nname = \"cord\"\nfrom = \"ground\"\nto = \"lower\"\n\
               point_from = [0.5, 0.2, 0.7]\ntension = \"60*(x - 0.8) + 1.5*v\"\n";
    for scheme in &SCHEMES[..4] {
        let [a, b] = [spring, law].map(|acting| run(&links(scheme, acting)).unwrap());
        let distance = apart(&a, &b);
        println!("{scheme}, between points: {distance:.1e}");
        assert!(distance < 1e-11, "{scheme}: {distance:e}");
    }
    for scheme in SCHEMES {
        let text = links(scheme, "");
        let own = text.replacen(
            "rate = -2.0\n",
            "rate = -2.0\nspring = { stiffness = 30.0, rest = 0.2 }\ndamper = { damping = 0.7 }\n",
            1,
        );
        assert_ne!(own, text);
        let law =
            "[[law]]\nname = \"both\"\njoint = \"elbow\"\neffort = \"-30*(x - 0.2) - 0.7*v\"\n";
        let [a, b] = [own, links(scheme, law)].map(|text| run(&text).unwrap());
        let distance = apart(&a, &b);
        println!("{scheme}, along a joint: {distance:.1e}");
        // energy–momentum schemes and Galerkin's discretize potentials otherwise than forces
        let bound =
            if scheme.contains("em-") || scheme.contains("galerkin") { 1e-4 } else { 1e-11 };
        assert!(distance < bound, "{scheme}: {distance:e}");
    }
}

/// Free bodies: whatever a law reads, momentum maps are constant; its work is what the energy
/// changes by, to order 2.
#[test]
fn laws_between_bodies_keep_momenta_and_account_for_the_energy() {
    let text = |step: f64| {
        [
            head("free", &format!("step = {step:?}, end = 0.8")),
            body("a", 2.0, [0.1, 0.2, 0.25]) + "angular_velocity = [0.5, -1.0, 2.0]\n",
            body("b", 1.0, [0.03, 0.02, 0.04]) + "position = [1.0, 0.3, 0.2]\nvelocity = [0.0, 1.0, 0.4]\n",
            part("table", "f") + "points = [[0.0, -2.0], [1.0, 3.0], [3.0, 4.0]]\n",
            part("law", "odd")
                + "from = \"a\"\nto = \"b\"\npoint_from = [0.2, 0.1, 0.0]\npoint_to = [0.0, -0.2, 0.1]\n\
                   tension = \"f(x)*(1 + 0.3*sin(5*t)) + 0.8*tanh(3*v) + max(x - 1, 0)^2\"\n",
        ]
        .concat()
    };
    let mut balances = Vec::new();
    for step in [0.01, 0.005, 0.0025] {
        let nodes = run(&text(step)).unwrap();
        let (first, last) = (&nodes[0], &nodes[nodes.len() - 1]);
        let drift = |of: fn(&Sample) -> [f64; 3]| {
            (0..3).map(|i| (of(last)[i] - of(first)[i]).abs()).fold(0.0, f64::max)
        };
        let linear = drift(|node| node.momentum.linear);
        let angular = drift(|node| node.momentum.angular);
        println!("step {step}: linear momentum {linear:.1e}, angular {angular:.1e}");
        assert!(linear < 1e-13 && angular < 1e-12);
        balances.push(last.energies.last().unwrap().abs());
    }
    let orders = orders(&balances);
    println!("balance {balances:?}: orders {orders:?}");
    assert!(orders.iter().all(|order| (1.8..2.3).contains(order)), "{orders:?}");
}

/// A closed loop starts at rest.
fn at_rest(more: &str, text: String) -> String {
    match more.is_empty() {
        true => text,
        false => text.replace("rate = 0.3\n", "").replace("rate = -2.0\n", ""),
    }
}

/// A law that is a load moves as the load, in space and in the body, on trees and in loops of a
/// body that is held.
#[test]
fn a_law_that_is_a_load_moves_as_the_load() {
    let load = |frame: &str| {
        format!(
            "[[load]]\nname = \"push\"\nbody = \"lower\"\npoint = [0.2, 0.1, 0.0]\nforce = [4.0, 1.0, -2.0]\n\
                 torque = [0.1, 0.7, -0.3]\nframe = \"{frame}\"\nhistory = {{ type = \"linear\", end = 0.5 }}\n"
        )
    };
    let law = |axes: &str| {
        format!(
            "[[law]]\nname = \"push\"\non = \"lower\"\npoint = [0.2, 0.1, 0.0]\naxes = \"{axes}\"\n\
                 force = [\"8*t\", \"2*t\", \"-4*t\"]\ntorque = [\"0.2*t\", \"1.4*t\", \"-0.6*t\"]\n"
        )
    };
    let held = "[[constraint]]\nname = \"rod\"\ntype = \"distance\"\nfrom = \"ground\"\nto = \"lower\"\n\
                point_from = [0.3, 0.0, 1.9]\n";
    for scheme in &SCHEMES[..4] {
        for axes in ["space", "body"] {
            for more in ["", held] {
                let [a, b] = [load(axes), law(axes)].map(|own| {
                    run(&at_rest(more, links(scheme, &(own + more))))
                        .unwrap_or_else(|e| panic!("{more}: {e}"))
                });
                let distance = apart(&a, &b);
                println!("{scheme}, {axes}, {}: {distance:.1e}", more.len());
                assert!(distance < 1e-11, "{scheme}, {axes}: {distance:e}");
                let mean = |run: &[Sample]| {
                    run.iter().map(|node| node.newton_iterations).sum::<f64>() / run.len() as f64
                };
                let iterations = [mean(&a), mean(&b)];
                println!("iterations {iterations:.2?}");
                // the last iterations are at the round-off floor
                assert!(iterations[1] <= iterations[0] + 0.5, "{scheme}: {iterations:?}");
            }
        }
    }
    let error = run(&links("scheme = \"em-nodal\"", &law("space"))).unwrap_err();
    assert!(error.contains("has no laws on bodies"), "{error}");
}

/// Drag by the velocity of a point and the rotation of the step: order 2, and its work is what the
/// energy changes by.
#[test]
fn drag_on_a_spinning_body_keeps_order_two() {
    let end = |step: f64| {
        let text = [
            heavy("drag", [0.0, 0.0, -9.81], &format!("step = {step:?}, end = 0.64")),
            body("top", 2.0, [0.1, 0.2, 0.25]) + "angular_velocity = [0.5, -3.0, 2.0]\nvelocity = [2.0, 0.0, 3.0]\n",
            part("law", "drag")
                + "on = \"top\"\npoint = [0.3, 0.1, -0.2]\n\
                   force = [\"-0.9*vx*hypot(vx, vy)\", \"-0.9*vy*hypot(vx, vy)\", \"-2*vz - 5*x\"]\n\
                   torque = [\"-0.2*wx\", \"-0.1*wy*abs(wy)\", \"-0.3*wz + 0.5*sin(3*t)\"]\n",
        ]
        .concat();
        let nodes = run(&text).unwrap();
        let last = nodes.last().unwrap();
        (last.q.clone(), last.energies.last().unwrap().abs())
    };
    let runs = [0.04, 0.02, 0.01, 0.005].map(end);
    let apart = |k: usize| distance(&runs[k].0, &runs[k + 1].0);
    let order = (apart(1) / apart(2)).log2();
    let balance = (runs[2].1 / runs[3].1).log2();
    println!("order of the end {order:.2}, of the balance {balance:.2} ({:.1e} J)", runs[3].1);
    assert!((1.9..2.1).contains(&order) && (1.8..2.3).contains(&balance));
}

#[test]
fn what_is_no_law_is_refused_at_its_place() {
    let joint = |keys: &str| format!("[[law]]\nname = \"motor\"\n{keys}");
    let table = |keys: &str| {
        joint("joint = \"elbow\"\neffort = \"f(t)\"\n") + "[[table]]\nname = \"f\"\n" + keys
    };
    for (acting, key, why) in [
        (joint("joint = \"elbow\"\neffort = \"3*y\"\n"), "law.motor.effort", "`y` is not known"),
        (joint("joint = \"elbow\"\neffort = \"3*(x\"\n"), "law.motor.effort", "closing bracket"),
        (joint("joint = \"elbow\"\neffort = \"= 3*x\"\n"), "law.motor.effort", "no parameter `x`"),
        (joint("joint = \"elbow\"\neffort = \"= 3*x\"\n"), "law.motor.effort", "has no `=`: write"),
        (joint("joint = \"elbow\"\neffort = \"g(x)\"\n"), "law.motor.effort", "`g` is no function"),
        (joint("joint = \"elbow\"\n"), "law.motor", "no expression"),
        (joint("joint = \"wrist\"\neffort = \"1\"\n"), "law.motor.joint", "wrist"),
        (
            joint("joint = \"elbow\"\nfreedom = 1\neffort = \"1\"\n"),
            "law.motor.freedom",
            "no coordinate 1",
        ),
        (joint("effort = \"1\"\n"), "law.motor", "acts on nothing"),
        (
            joint("joint = \"elbow\"\nto = \"lower\"\neffort = \"1\"\n"),
            "law.motor.joint",
            "and between points",
        ),
        (joint("joint = \"elbow\"\ntension = \"1\"\n"), "law.motor.tension", "a law of points"),
        (joint("from = \"ground\"\ntension = \"1\"\n"), "law.motor", "no `to`"),
        (joint("from = \"lower\"\nto = \"lower\"\ntension = \"1\"\n"), "law.motor.to", "lower"),
        (
            joint("from = \"ground\"\nto = \"upper\"\npoint_from = [0.5, 0, 0]\ntension = \"1\"\n"),
            "law.motor",
            "no direction",
        ),
        (
            joint("joint = \"elbow\"\nconservative = true\neffort = \"x\"\n"),
            "law.motor.conservative",
            "anyway",
        ),
        (joint("on = \"lower\"\neffort = \"1\"\nforce = [\"1\", \"0\", \"0\"]\n"), "law.motor.effort", "points or a joint"),
        (joint("on = \"lower\"\n"), "law.motor", "no expression"),
        (joint("on = \"lower\"\nforce = [\"1\", \"v\", \"0\"]\n"), "law.motor.force[1]", "`v` is not known"),
        (joint("joint = \"elbow\"\neffort = \"1\"\npoint = [0.0, 0.0, 1.0]\n"), "law.motor.point", "a law of a body"),
        ("[[spring]]\nname = \"motor\"\nfrom = \"ground\"\nto = \"lower\"\nstiffness = 10.0\ntension = 50.0\n".into(), "spring.motor.tension", "natural length would be"),
        ("[[spring]]\nname = \"motor\"\nfrom = \"ground\"\nto = \"lower\"\nstiffness = 0.0\ntension = 5.0\n".into(), "spring.motor.tension", "cannot have a tension"),
        (table("points = [[0, 1]]\n"), "table.f.points", "at least two"),
        (table("points = [[0, 1], [0, 2]]\n"), "table.f.points", "0 in row 1 is followed by 0"),
        (table("file = \"none.csv\"\n"), "table.f.file", "no folder"),
        (
            table("points = [[0, 1], [1, 2]]\ncolumns = [\"a\", \"b\"]\n"),
            "table.f.columns",
            "only a file",
        ),
        (
            joint("joint = \"elbow\"\neffort = \"sin(t)\"\n")
                + "[[table]]\nname = \"sin\"\npoints = [[0, 1], [1, 2]]\n",
            "table.sin.name",
            "cannot call",
        ),
        (
            "[parameters]\nx = 2.0\n".to_owned() + &joint("joint = \"elbow\"\neffort = \"3*x\"\n"),
            "law.motor.effort",
            "a variable of the law and a parameter",
        ),
    ] {
        let error = run(&links("", &acting)).unwrap_err();
        assert!(error.contains(why) && error.contains(&format!("\"{key}\"")), "{acting}\n{error}");
    }
    let damped = joint("joint = \"elbow\"\neffort = \"-v\"\n");
    let error = run(&links("order = 4", &damped)).unwrap_err();
    assert!(error.contains("dissip"), "{error}");
    assert!(run(&links("order = 4", &(damped + "conservative = true\n"))).is_ok());
}

/// The run ends with the name of the law and its arguments; a law without a value at the start is
/// an error before.
#[test]
fn a_law_without_a_value_is_named() {
    let law = |effort: &str| {
        format!("[[law]]\nname = \"motor\"\njoint = \"elbow\"\neffort = \"{effort}\"\n")
    };
    let error = run(&links("", &law("sqrt(x + 0.1)"))).unwrap_err();
    println!("{error}");
    assert!(error.contains("law `motor`: `sqrt(x + 0.1)` is not defined, x = -0.1"), "{error}");
    assert!(error.contains(" at t = 0."), "{error}");
    let table = "[[table]]\nname = \"f\"\npoints = [[-0.1, 1], [1, 2]]\noutside = \"error\"\n";
    let error = run(&links("", &(law("f(x)") + table))).unwrap_err();
    assert!(
        error.contains("law `motor`: `f`: -0.1") && error.contains("outside of -0.1 … 1"),
        "{error}"
    );
    let error = run(&links("", &law("1/(t - t)"))).unwrap_err();
    println!("{error}");
    assert!(error.contains("law `motor`: `1/(t - t)` is not finite"), "{error}");
}

/// Parameters stand in a law after overrides, and the resolved text gives the same model.
#[test]
fn a_law_is_data() {
    let text = links(
        "",
        "[parameters]\nk = -3.5\n[[law]]\nname = \"motor\"\njoint = \"elbow\"\neffort = \"k*x - k^2*v\"\n",
    );
    let model = Model::from_toml(&text).unwrap();
    assert_eq!(model.laws[0].effort.as_ref().unwrap().0, "(-3.5)*x - (-3.5)^2*v");
    assert_eq!(Model::from_toml(&model.to_toml()).unwrap(), model);
    let set = [holonom::model::Override::new("parameters.k", "2")];
    let model = Model::from_toml_with(&text, &set).unwrap();
    assert_eq!(model.laws[0].effort.as_ref().unwrap().0, "2.0*x - 2.0^2*v");
    let set = [holonom::model::Override::new("law.motor.effort", "-7*x")];
    let model = Model::from_toml_with(&text, &set).unwrap();
    assert_eq!(model.laws[0].effort.as_ref().unwrap().0, "-7*x");
}

/// Two bodies and a ball that fly freely, with laws along the axes of one of them.
fn flying(settings: &str, laws: &str) -> String {
    [
        head("flying", &format!("step = 0.01, end = 0.5, {settings}")),
        body("carrier", 2.0, [0.1, 0.2, 0.25])
            + "euler = { sequence = \"zx\", degrees = [40.0, 20.0] }\nangular_velocity = [0.5, -1.0, 2.0]\n",
        body("probe", 1.0, [0.03, 0.02, 0.04])
            + "position = [1.0, 0.3, 0.2]\nvelocity = [0.0, 1.0, 0.4]\nangular_velocity = [1.0, 0.3, -2.0]\n",
        part("particle", "ball") + "mass = 0.4\nposition = [0.2, -0.7, 0.5]\nvelocity = [0.3, 0.1, 0.0]\n",
        laws.to_owned(),
    ]
    .concat()
}

const RELATIVE: &str = "[[law]]\nname = \"arm\"\non = \"probe\"\npoint = [0.1, 0.2, -0.1]\nrelative_to = \"carrier\"\n\
    force = [\"-0.6*(x - 0.8) - 0.3*vx\", \"-0.5*y + 0.03*wz\", \"0.2*x*vz - 0.4*z\"]\ntorque = [\"-0.02*wx\", \"0.03*x - 0.02*wy\", \"0.04*sin(z)\"]\n\
    [[law]]\nname = \"own\"\non = \"probe\"\nrelative_to = \"carrier\"\naxes = \"body\"\nforce = [\"0.1*y\", \"-0.1*vx\", \"0.1\"]\ntorque = [\"0.02\", \"-0.01*wx\", \"0\"]\n\
    [[law]]\nname = \"tether\"\non = \"ball\"\nrelative_to = \"carrier\"\nforce = [\"-0.5*x\", \"-0.5*(y + 0.5) - 0.2*vy\", \"-0.3*z\"]\n";

/// What a law relative to a body takes from one it gives to the other, whatever it reads; it keeps
/// the order, its slopes are exact, and it does not see a motion of the whole.
#[test]
fn laws_relative_to_a_body_keep_momenta_and_the_order() {
    let nodes = run(&flying("", RELATIVE)).unwrap();
    let (first, last) = (&nodes[0], nodes.last().unwrap());
    for of in [|node: &Sample| node.momentum.linear, |node: &Sample| node.momentum.angular] {
        let drift = (0..3).map(|i| (of(last)[i] - of(first)[i]).abs()).fold(0.0, f64::max);
        println!("momentum changes by {drift:.1e}");
        assert!(drift < 1e-12, "{drift:e}");
    }
    let count = nodes.iter().map(|node| node.newton_iterations).sum::<f64>() / nodes.len() as f64;
    println!("{count:.2} iterations");
    assert!(count < 4.0, "{count}");
    for scheme in ["constrained", "dalembert", "reduced"] {
        let other = run(&flying(&format!("scheme = \"{scheme}\""), RELATIVE)).unwrap();
        let distance = apart(&nodes, &other);
        println!("{scheme}: {distance:.1e}");
        assert!(distance < 1e-9, "{scheme}: {distance:e}");
    }
    for (method, order) in [("", 2.0), ("method = \"galerkin\", order = 4", 4.0)] {
        let ends = [1u32, 2, 4].map(|parts| {
            let step = format!("step = {:?}", 0.02 / f64::from(parts));
            let nodes = run(&flying(method, RELATIVE).replace("step = 0.01", &step)).unwrap();
            nodes.last().unwrap().q.clone()
        });
        let apart = |k: usize| distance(&ends[k], &ends[k + 1]);
        let found = (apart(0) / apart(1)).log2();
        println!("{method}: order {found:.2}");
        assert!((order - 0.3..order + 0.4).contains(&found), "{method}: {found}");
    }
}

/// Relative to a body that hardly moves, a law is one in space, seen along the axes of that body.
#[test]
fn a_law_relative_to_what_stands_still_is_one_in_space() {
    let heavy = |laws: &str| {
        flying("", laws)
            .replace("mass = 2.0", "mass = 1e12")
            .replace("angular_velocity = [0.5, -1.0, 2.0]", "angular_velocity = [0.0, 0.0, 0.0]")
    };
    let straight = |text: String| text.replace("degrees = [40.0, 20.0]", "degrees = [90.0, 0.0]");
    let text = straight(heavy(
        "[[law]]\nname = \"a\"\non = \"probe\"\nrelative_to = \"carrier\"\n\
         force = [\"-7*x\", \"-3*y - vx\", \"wz\"]\ntorque = [\"0.1*y\", \"-0.2*wx\", \"0\"]\n",
    ));
    // axes x, y of the carrier are y, -x of space
    let space = straight(heavy(
        "[[law]]\nname = \"a\"\non = \"probe\"\n\
         force = [\"-(-3*(-x) - vy)\", \"-7*y\", \"wz\"]\ntorque = [\"-(-0.2*wy)\", \"0.1*(-x)\", \"0\"]\n",
    ));
    let text = text.replace("inertia = [0.1, 0.2, 0.25]", "inertia = [1e12, 1e12, 1e12]");
    let space = space.replace("inertia = [0.1, 0.2, 0.25]", "inertia = [1e12, 1e12, 1e12]");
    let ends = [&text, &space].map(|text| run(text).unwrap().last().unwrap().q.clone());
    let off = distance(&ends[0][12..24], &ends[1][12..24]);
    println!("apart by {off:.1e}");
    assert!(off < 1e-9, "{off:e}");
}

#[test]
fn what_is_no_base_of_a_law_is_refused() {
    for (base, why) in [
        ("ground", "relative to the ground by themselves"),
        ("probe", "does not move relative to itself"),
        ("ball", "ball"),
        ("nothing", "nothing"),
    ] {
        let text = flying("", &RELATIVE.replace("\"carrier\"", &format!("\"{base}\"")));
        let error = run(&text).unwrap_err();
        assert!(error.contains(why) && error.contains("relative_to"), "{base}: {error}");
    }
}

/// A law that has no value in an equilibrium says so, with its arguments.
#[test]
fn a_law_without_a_value_is_named_in_statics() {
    let law = "[[law]]\nname = \"lift\"\njoint = \"elbow\"\neffort = \"2*sqrt(select(0.55 - t, 1, -1)) - 9*x\"\n";
    let text = links("scheme = \"static\"", law)
        .replace("end = 0.25", "end = 1.0")
        .replace("step = 5e-3", "step = 0.1");
    let text = text.replace("rate = 0.3\n", "").replace("rate = -2.0\n", "");
    let error = run(&text).unwrap_err();
    println!("{error}");
    assert!(
        error.contains("law `lift`") && error.contains("sqrt") && error.contains("x = "),
        "{error}"
    );
}
