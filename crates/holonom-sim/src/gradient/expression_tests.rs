//! Gradients by parameters that expressions of laws, bushings, signals, histories and paths read,
//! against central differences of whole runs.

use super::{GradientFailure, ModelGradient, Wanted, gradient};
use holonom_model::ModelText;
use std::path::Path;

/// Two links; the sections of a case come behind.
pub(super) const BODIES: &str = r#"
[model]
name = "reacting"
gravity = [0.0, 0.0, -9.81]
[simulation]
step = 0.01
end = 0.3
[parameters]
k = 6.0
c = 0.4
w = 3.0
both = "= 2*k + c"
[[body]]
name = "upper"
position = [0.4, 0.0, 0.0]
shape = { type = "box", dimensions = [0.8, 0.05, 0.04], density = 780.0 }
[[body]]
name = "lower"
position = [1.1, 0.0, 0.0]
shape = { type = "box", dimensions = [0.6, 0.05, 0.03], density = 780.0 }
[[joint]]
name = "shoulder"
type = "revolute"
parent = "ground"
child = "upper"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
rate = -3.0
[[joint]]
name = "elbow"
type = "revolute"
parent = "upper"
child = "lower"
position = [0.8, 0.0, 0.0]
axis = [0.1, 1.0, 0.2]
[[table]]
name = "grows"
points = [[-9.0, -4.0], [0.0, 0.0], [9.0, 7.0]]
[[sensor]]
name = "tip"
type = "position"
of = "lower"
point = [0.3, 0.0, 0.1]
[[objective]]
name = "height"
type = "sensor"
sensor = "tip.z"
target = 1.5
"#;

/// A box and a ball that are free.
pub(super) const FREE: &str = r#"
[[body]]
name = "box"
position = [0.0, 1.0, 0.2]
velocity = [0.4, -0.3, 0.2]
angular_velocity = [0.5, -0.3, 0.8]
shape = { type = "box", dimensions = [0.3, 0.2, 0.1], density = 300.0 }
[[particle]]
name = "ball"
mass = 0.7
position = [0.0, 2.0, 0.0]
velocity = [0.3, -0.2, 0.4]
[[sensor]]
name = "corner"
type = "position"
of = "box"
point = [0.1, 0.1, 0.0]
[[sensor]]
name = "place"
type = "position"
of = "ball"
[[objective]]
name = "side"
type = "sensor"
sensor = "corner.x"
target = 0.4
at = "path"
[[objective]]
name = "across"
type = "sensor"
sensor = "place.y"
target = -0.4
"#;

fn found(more: &str) -> Result<ModelGradient, GradientFailure> {
    of(&format!("{BODIES}{more}"))
}

pub(super) fn of(text: &str) -> Result<ModelGradient, GradientFailure> {
    let text = ModelText::from_text(Path::new("model.toml"), text);
    let model = text.model(&[])?;
    let wanted = Wanted { initial: false, controls: false, ..Wanted::everything() };
    let mut found = gradient(&text, &[], &model, &wanted)?;
    found.check(&text, &[], &model, &wanted)?;
    Ok(found)
}

/// What acts, with which numbers of `k`, `c`, `w` it changes.
pub(super) const CASES: [(&str, &str, &[&str]); 14] = [
    (
        "a law of its joint",
        "[[law]]\nname = 'l'\njoint = 'elbow'\neffort = '-k*x - both*x^3 - c*abs(v)*v + sin(w*t)'",
        &["c", "k", "w"],
    ),
    (
        "a law with a table",
        "[[law]]\nname = 'l'\njoint = 'elbow'\neffort = 'k*grows(x) - select(v, c, 2*c)*v'",
        &["c", "k"],
    ),
    (
        "a law that reads another joint",
        "[[law]]\nname = 'l'\njoint = 'elbow'\neffort = '-k*sin(shoulder) - c*shoulder.rate + w*x'",
        &["c", "k", "w"],
    ),
    (
        "a tension",
        "[[law]]\nname = 'l'\nfrom = 'ground'\nto = 'lower'\npoint_from = [0.3, 0.0, 1.0]\n\
         point_to = [0.1, 0.0, 0.0]\ntension = 'k*max(x - 0.5, 0)^2 + c*v*exp(-w*x)'",
        &["c", "k", "w"],
    ),
    (
        "a force on a body",
        "[[law]]\nname = 'l'\non = 'box'\npoint = [0.1, 0.0, 0.0]\nforce = ['-c*vx', '2', 'k*sin(w*t)']\n\
         torque = ['0', '-c*wy', '-k*wz*x']",
        &["c", "k", "w"],
    ),
    (
        "a force along the axes of another body",
        "[[law]]\nname = 'l'\non = 'lower'\nrelative_to = 'upper'\nforce = ['-c*vx', '0', '-k*z']\n\
         axes = 'body'\n",
        &["c", "k"],
    ),
    (
        "a force on a particle",
        "[[law]]\nname = 'l'\non = 'ball'\nforce = ['-k*x', 'w - c*vy*hypot(vx, vy) - k*x', '0']",
        &["c", "k", "w"],
    ),
    (
        "signals that are values",
        "[[signal]]\nname = 'wanted'\nvalue = '0.3*sin(w*t) + k/20'\n\
         [[signal]]\nname = 'error'\nvalue = 'wanted - elbow'\n\
         [[law]]\nname = 'l'\njoint = 'elbow'\neffort = 'k*error + c*error^3'",
        &["c", "k", "w"],
    ),
    (
        "a bushing by numbers",
        "[[bushing]]\nname = 'b'\nfrom = 'ground'\nto = 'box'\nposition = [0.0, 1.0, 0.2]\n\
         stiffness = ['= 100*k', 900.0, 800.0, 5.0, '= k', '= w']\ndamping = [3.0, '= 9*c', 2.0, 0.1, 0.1, '= c']\n\
         preload = ['= w', 0.0, 1.0, 0.0, 0.0, '= 0.1*k']",
        &["c", "k", "w"],
    ),
    (
        "a bushing by expressions",
        "[[bushing]]\nname = 'b'\nfrom = 'ground'\nto = 'box'\nposition = [0.0, 1.0, 0.2]\n\
         stiffness = ['100*k*(1 + w*x1^2) - 9*c*x2', 900.0, '80*elbow + 500', 5.0, '= k', 7.0]\n\
         damping = [3.0, '9*c*(1 + v2^2)', 2.0, 0.1, 0.1, 0.2]",
        &["c", "k", "w"],
    ),
    (
        "a full matrix",
        "[[bushing]]\nname = 'b'\nfrom = 'ground'\nto = 'box'\nposition = [0.0, 1.0, 0.2]\n\
         stiffness = [[900.0, '= k', 0, 0, 0, 0], ['= k', 800.0, 0, 0, 0, 0], [0, 0, 700.0, 0, 0, '= w'],\n\
         [0, 0, 0, 5.0, 0, 0], [0, 0, 0, 0, 6.0, 0], [0, 0, '= w', 0, 0, '= 20*c']]",
        &["c", "k", "w"],
    ),
    (
        "six efforts of a bushing",
        "[[bushing]]\nname = 'b'\nfrom = 'ground'\nto = 'box'\nposition = [0.0, 1.0, 0.2]\n\
         force = ['-100*k*x1 - c*v2', '-90*x2', '-90*x3', '0', '-w*x5', '-w*x6']",
        &["c", "k", "w"],
    ),
    (
        "histories of loads",
        "[[load]]\nname = 'on_box'\nbody = 'box'\nforce = ['= k', 0.0, 1.0]\nhistory = 'sin(w*t)'\n\
         [[load]]\nname = 'on_ball'\nbody = 'ball'\nforce = [0.0, 2.0, 0.0]\nhistory = 'exp(-c*t)'",
        &["c", "k", "w"],
    ),
    (
        "what is delayed",
        "[[signal]]\nname = 's'\ndelay = { of = 'k*elbow + c*elbow.rate', time = 0.1 }\n\
         [[law]]\nname = 'l'\njoint = 'elbow'\neffort = '-s'",
        &["c", "k"],
    ),
];

#[test]
fn gradients_by_parameters_of_expressions_agree_with_differences() {
    for (what, more, names) in CASES {
        let more = more.replace('\'', "\"");
        let found =
            found(&format!("{FREE}{more}")).unwrap_or_else(|error| panic!("{what}: {error}"));
        println!("{what}: {:.1e}, {:?}", found.worst(), found.parameters);
        let own: Vec<&str> = found.parameters.iter().map(|own| own.name.as_str()).collect();
        assert_eq!(own, names, "{what}");
        assert!(found.parameters.iter().all(|own| own.derivative != 0.0), "{what}");
        assert!(found.worst() < 1e-8, "{what}: {:?}", found.checks);
    }
}

#[test]
fn motors_by_expressions_have_derivatives() {
    let motor = "motor = { effort = 2.0, history = \"cos(w*t)\", proportional = 30.0, \
                 derivative = 2.0, path = \"0.1*k*t + c*t^2\" }";
    let text =
        BODIES.replace("axis = [0.1, 1.0, 0.2]", &format!("axis = [0.1, 1.0, 0.2]\n{motor}"));
    let found = of(&text).unwrap();
    println!("a motor: {:.1e}, {:?}", found.worst(), found.parameters);
    assert!(found.parameters.iter().all(|own| own.derivative != 0.0));
    assert!(found.worst() < 1e-8, "{:?}", found.checks);
    assert_eq!(found.parameters.len(), 3);
}

#[test]
fn prescribed_motions_by_expressions_have_derivatives() {
    let more = "[[constraint]]\nname = \"m\"\ntype = \"motion\"\njoint = \"elbow\"\npath = \"0.1*k*(1 - cos(w*t)) + c*t^3\"";
    let found = found(more).unwrap();
    println!("a prescribed motion: {:.1e}, {:?}", found.worst(), found.parameters);
    assert!(found.worst() < 1e-8, "{:?}", found.checks);
    assert_eq!(found.parameters.len(), 3);
}

#[test]
fn expressions_without_a_derivative_are_refused_by_their_key() {
    for (more, words) in [
        (
            "[[law]]\nname = 'l'\njoint = 'elbow'\neffort = '-grows(k*x)'",
            ["law.l.effort", "`grows(k*x)`"],
        ),
        (
            "[[law]]\nname = 'l'\njoint = 'elbow'\neffort = 'select(x - k, 1, 2)'",
            ["law.l.effort", "no slope"],
        ),
        (
            // the slope of the root is infinite
            "[[law]]\nname = 'l'\njoint = 'shoulder'\neffort = '-sqrt(k - 6)*x'",
            ["the derivative by `k`", "is not finite"],
        ),
    ] {
        let error = found(&more.replace('\'', "\"")).unwrap_err().to_string();
        println!("{error}");
        assert!(words.iter().all(|word| error.contains(word)), "{error}");
    }
}

/// A particle has coordinates of its own at the start: the derivative by its position is that by a
/// parameter which states it.
#[test]
fn derivatives_by_the_start_of_a_particle_are_those_by_its_position() {
    let free = FREE.replace("position = [0.0, 2.0, 0.0]", "position = [0.0, \"= 2*k - 10\", 0.0]");
    let free = free.replace("velocity = [0.3, -0.2", "velocity = [0.3, \"= 0.5*c - 0.4\"");
    let law = "[[law]]\nname = \"l\"\non = \"ball\"\nforce = [\"-2*x\", \"-y^2\", \"0\"]\n";
    let text = ModelText::from_text(Path::new("model.toml"), format!("{BODIES}{free}{law}"));
    let model = text.model(&[]).unwrap();
    let found = gradient(&text, &[], &model, &Wanted::everything()).unwrap();
    let of = |name: &str| found.parameters.iter().find(|own| own.name == name).unwrap().derivative;
    let ball = found.initial.iter().find(|own| own.name == "ball" && own.freedom == 1).unwrap();
    println!("{ball:?}, {:?}", found.parameters);
    assert!((of("k") - 2.0 * ball.coordinate).abs() < 1e-13 * of("k").abs());
    assert!((of("c") - 0.5 * ball.rate.unwrap()).abs() < 1e-13 * of("c").abs());
    assert!(ball.coordinate != 0.0 && ball.rate != Some(0.0));
}
