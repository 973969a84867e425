//! Estimates of unlike models: a tree, a closed loop, free members; derivatives of their residuals
//! against differences, exact data, data with noise.

use super::{
    IdentificationWatch, IdentifiedModel, IdentifyError, MeasuredColumn, PreparedFit, identify,
};
use crate::simulation::Simulation;
use crate::system::outside::{ExternalActions, JointStart};
use holonom_model::{Model, ModelText, Override};
use nalgebra::DMatrix;
use std::path::Path;
use vi_control::least_squares::Residuals;
use vi_testkit::Sample;

/// A double pendulum whose sizes, dampers and release are unknown; angles, a rate, a height.
const ARM: &str = r#"
[model]
name = "arm"
gravity = [0.0, 0.0, -9.81]
[simulation]
step = 0.01
end = 1.0
[parameters]
length = 0.8
mass = 1.3
damping = 0.2
spin = 0.4
[[body]]
name = "upper"
position = ["= length/2", 0.0, 0.0]
shape = { type = "box", dimensions = ["= length", 0.04, 0.04], density = 700.0 }
[[body]]
name = "lower"
position = ["= 1.5*length", 0.0, 0.0]
mass = "= mass"
inertia = [0.001, "= mass*length^2/12", "= mass*length^2/12"]
[[joint]]
name = "shoulder"
type = "revolute"
parent = "ground"
child = "upper"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
damper = { damping = "= damping" }
[[joint]]
name = "elbow"
type = "revolute"
parent = "upper"
child = "lower"
position = ["= length", 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
rate = "= spin"
damper = { damping = 0.05 }
[[sensor]]
name = "angle"
type = "joint_coordinate"
of = "shoulder"
[[sensor]]
name = "turning"
type = "joint_rate"
of = "elbow"
[[sensor]]
name = "tip"
type = "velocity"
of = "lower"
point = [0.3, 0.0, 0.1]
[[sensor]]
name = "reach"
type = "distance"
of = "lower"
to = "ground"
point = [0.1, 0.0, 0.2]
point_to = [0.3, 0.1, 0.5]
[[measurement]]
sensor = "angle"
sigma = 0.01
[[measurement]]
sensor = "turning"
sigma = 0.05
[[measurement]]
sensor = "tip.z"
column = "fall"
sigma = 0.03
[[measurement]]
sensor = "reach"
sigma = 0.004
[identify]
parameters = { length = { start = 0.75 }, mass = { start = 1.1 }, damping = { start = 0.3, min = 0.0 }, spin = {} }
initial = ["shoulder"]
"#;

/// A four-bar linkage with redundant rows; its crank is released anyhow.
pub(super) const LINKAGE: &str = r#"
[model]
name = "linkage"
gravity = [0.0, 0.0, -9.81]
[simulation]
step = 0.01
end = 0.6
project_start = true
[parameters]
mass = 1.6
stiffness = 5.0
friction = 0.05
[[body]]
name = "crank"
position = [0.075, 0.0, 0.12990381056766578]
rotation_vector = [0.0, -1.0471975511965976, 0.0]
mass = 0.8
inertia = [0.0002, 0.0061, 0.00615]
[[body]]
name = "coupler"
position = [0.546556821879383, 0.0, 0.47251090512719507]
rotation_vector = [0.0, -0.4923447, 0.0]
mass = "= mass"
inertia = [0.0004, 0.108, 0.1083]
[[body]]
name = "rocker"
position = [0.871556821879383, 0.0, 0.3426070945595293]
rotation_vector = [0.0, -1.3648990, 0.0]
mass = 1.2
inertia = [0.0003, 0.049, 0.0492]
[[joint]]
name = "shaft"
type = "revolute"
parent = "ground"
child = "crank"
anchor_parent = [0.0, 0.0, 0.0]
anchor_child = [-0.15, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
rate = 3.0
[[joint]]
name = "pin"
type = "revolute"
parent = "crank"
child = "coupler"
anchor_parent = [0.15, 0.0, 0.0]
anchor_child = [-0.45, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
damper = { damping = "= friction" }
[[joint]]
name = "pivot"
type = "revolute"
parent = "ground"
child = "rocker"
anchor_parent = [0.8, 0.0, 0.0]
anchor_child = [-0.35, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
spring = { stiffness = "= stiffness", rest = 0.1 }
[[joint]]
name = "cut"
type = "revolute"
parent = "coupler"
child = "rocker"
anchor_parent = [0.45, 0.0, 0.0]
anchor_child = [0.35, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
cut = true
[[sensor]]
name = "angle"
type = "joint_coordinate"
of = "pivot"
[[sensor]]
name = "point"
type = "position"
of = "coupler"
point = [0.1, 0.0, 0.2]
[[sensor]]
name = "speed"
type = "joint_rate"
of = "shaft"
[[measurement]]
sensor = "angle"
sigma = 0.01
[[measurement]]
sensor = "point.z"
sigma = 0.002
[[measurement]]
sensor = "speed"
sigma = 0.1
[identify]
parameters = { mass = { start = 1.4 }, stiffness = { start = 5.5 }, friction = { start = 0.07, min = 0.0 } }
initial = ["shaft"]
"#;

/// A free body and a particle on a bar, tied by a spring, by a composition of order 4.
const FLYING: &str = r#"
[model]
name = "flying"
gravity = [0.0, 0.0, "= -g"]
[simulation]
step = 0.02
end = 0.6
order = 4
[parameters]
stiffness = 12.0
length = 0.7
g = 9.81
throw = 2.0
[[body]]
name = "box"
position = [0.1, 0.2, 0.4]
velocity = [0.3, 0.0, "= throw"]
body_angular_velocity = [2.0, 0.5, -1.0]
mass = 1.3
inertia = [0.3, 0.2, 0.4]
[[particle]]
name = "bob"
mass = 0.4
position = [0.0, 0.0, "= -length"]
velocity = [0.4, 0.0, 0.0]
[[bar]]
name = "string"
from = "ground"
to = "bob"
point = [0.0, 0.0, 0.0]
length = "= length"
[[spring]]
name = "tie"
from = "box"
to = "bob"
point_from = [0.1, 0.2, 0.0]
stiffness = "= stiffness"
natural_length = 0.5
[[sensor]]
name = "apart"
type = "distance"
of = "box"
to = "bob"
[[sensor]]
name = "closing"
type = "distance_rate"
of = "box"
to = "bob"
[[sensor]]
name = "place"
type = "position"
of = "bob"
[[measurement]]
sensor = "apart"
sigma = 0.01
[[measurement]]
sensor = "closing"
sigma = 0.1
[[measurement]]
sensor = "place.x"
sigma = 0.002
[[measurement]]
sensor = "place.z"
sigma = 0.002
[identify]
parameters = { stiffness = { start = 14.0 }, length = { start = 0.72 }, g = { start = 9.5 }, throw = { start = 1.7 } }
"#;

/// A wheel on a tilted plane that turns; its velocities are projected.
const WHEEL: &str = r#"
[model]
name = "wheel"
gravity = [0.0, 0.0, -9.81]
[simulation]
step = 0.01
end = 0.6
project_start = true
[parameters]
tilt = 0.1
turns = 0.8
radius = 0.3
fast = 4.0
side = "= cos(tilt)*sin(0.2)"
high = "= radius*sqrt(1 - side^2)"
[[body]]
name = "wheel"
mass = 1.3
inertia = [0.03, 0.055, 0.035]
position = ["= high*sin(tilt)", 0.4, "= high*cos(tilt)"]
velocity = ["= radius*fast", 0.1, 0.0]
angular_velocity = [0.2, "= fast", 0.3]
[[constraint]]
name = "table"
type = "rolling"
body = "wheel"
axis = [0.0, "= cos(0.2)", "= sin(0.2)"]
radius = "= radius"
plane = { normal = ["= sin(tilt)", 0.0, "= cos(tilt)"], spin = "= turns" }
[[sensor]]
name = "place"
type = "position"
of = "wheel"
point = [0.1, 0.0, 0.05]
[[sensor]]
name = "turn"
type = "angular_velocity"
of = "wheel"
[[sensor]]
name = "carried"
type = "reaction"
of = "table"
[[measurement]]
sensor = "place.x"
sigma = 0.002
[[measurement]]
sensor = "place.z"
sigma = 0.002
[[measurement]]
sensor = "turn.y"
sigma = 0.05
[[measurement]]
sensor = "carried.fy"
sigma = 0.1
[identify]
parameters = { tilt = { start = 0.12 }, turns = { start = 0.7 }, radius = { start = 0.31 }, fast = { start = 3.8 } }
"#;

/// The same with rate gyros on the box, and the tension of the spring as an expression.
fn with_gyros() -> String {
    let measured =
        |part: &str| format!("[[measurement]]\nsensor = \"turn.{part}\"\nsigma = 0.05\n");
    let sensor = "[[sensor]]\nname = \"turn\"\ntype = \"angular_velocity\"\nof = \"box\"\n";
    let tension = "[[sensor]]\nname = \"tension\"\ntype = \"expression\"\nvalue = \"stiffness*(apart - 0.5)\"\n\
                   [[measurement]]\nsensor = \"tension\"\nsigma = 0.3\n";
    let text = format!("{sensor}{tension}{}{}[identify]", measured("x"), measured("y"));
    FLYING.replace("[identify]", &text)
}

/// The arm with a digital controller of its shoulder, whose gain is unknown as well, and whose
/// output comes late.
fn with_controller() -> String {
    let controller = "[[signal]]\nname = \"digital\"\nevery = 0.02\n\
                      pid = { of = \"0.4 - shoulder\", proportional = \"= gain\", integral = 3.0, derivative = \"= 0.1*gain\", filter = 0.03, limits = [-3.0, 9.0] }\n\
                      [[signal]]\nname = \"late\"\ndelay = { of = \"digital\", time = 0.013 }\n\
                      [[law]]\nname = \"motor\"\njoint = \"shoulder\"\neffort = \"late - 0.1*v\"\n\
                      [[sensor]]\nname = \"current\"\ntype = \"expression\"\nvalue = \"0.3*late\"\n\
                      [[measurement]]\nsensor = \"current\"\nsigma = 0.1\n[identify]";
    let text = ARM.replace("[parameters]\n", "[parameters]\ngain = 12.0\n");
    let text = text.replace("parameters = {", "parameters = { gain = { start = 10.0 },");
    text.replace("[identify]", controller)
}

/// The same where the effort of the spring is measured, and the orientation of the box.
fn with_efforts() -> String {
    let sensors = "[[sensor]]\nname = \"pull\"\ntype = \"effort\"\nof = \"tie\"\n\
                   [[sensor]]\nname = \"attitude\"\ntype = \"orientation\"\nof = \"box\"\n\
                   [[measurement]]\nsensor = \"pull\"\nsigma = 0.3\n\
                   [[sensor]]\nname = \"done\"\ntype = \"work\"\nof = \"tie\"\n\
                   [[measurement]]\nsensor = \"done\"\nsigma = 0.05\n\
                   [[measurement]]\nsensor = \"attitude.w\"\nsigma = 0.01\n[identify]";
    let start = FLYING.find("[[measurement]]\nsensor = \"apart\"").unwrap();
    let end = FLYING.find("[[measurement]]\nsensor = \"place.x\"").unwrap();
    format!("{}{}", &FLYING[..start], &FLYING[end..]).replace("[identify]", sensors)
}

/// The linkage where what two of its joints carry is measured, beside a rate.
fn with_reactions() -> String {
    let sensors = "[[sensor]]\nname = \"held\"\ntype = \"reaction\"\nof = \"cut\"\n\
                   [[sensor]]\nname = \"carried\"\ntype = \"reaction\"\nof = \"shaft\"\nframe = \"space\"\n\
                   [[measurement]]\nsensor = \"held.fx\"\nsigma = 0.3\n\
                   [[measurement]]\nsensor = \"carried.fz\"\nsigma = 0.3\n";
    let start = LINKAGE.find("[[measurement]]\nsensor = \"angle\"").unwrap();
    let end = LINKAGE.find("[[measurement]]\nsensor = \"speed\"").unwrap();
    format!("{}{sensors}{}", &LINKAGE[..start], &LINKAGE[end..])
}

/// The linkage where accelerations of a point and of a joint are measured, beside a rate.
fn with_accelerations() -> String {
    let sensors = "[[sensor]]\nname = \"felt\"\ntype = \"imu\"\nof = \"coupler\"\npoint = [0.1, 0.0, 0.2]\n\
                   [[sensor]]\nname = \"bent\"\ntype = \"joint_acceleration\"\nof = \"pin\"\n\
                   [[measurement]]\nsensor = \"felt.ax\"\nsigma = 0.3\n\
                   [[measurement]]\nsensor = \"bent\"\nsigma = 0.3\n";
    let start = LINKAGE.find("[[measurement]]\nsensor = \"angle\"").unwrap();
    let end = LINKAGE.find("[[measurement]]\nsensor = \"speed\"").unwrap();
    format!("{}{sensors}{}", &LINKAGE[..start], &LINKAGE[end..])
}

/// What is added to coordinate and rate of the joint whose start is unknown.
const RELEASE: [f64; 2] = [0.2, 0.7];

pub(super) fn read(text: &str) -> (ModelText, Model) {
    let text = ModelText::from_text(Path::new("model.toml"), text);
    let model = text.model(&[]).unwrap();
    (text, model)
}

/// How the model really moves: as its file says, but for the start of a joint.
fn truth(model: &Model) -> ExternalActions {
    let mut start = JointStart::default();
    for name in model.identify.iter().flat_map(|own| &own.initial) {
        let rate = model.joint(name).unwrap().rate.as_ref().map_or(0.0, |own| own.values()[0]);
        start.coordinates.push((name.clone(), 0, RELEASE[0]));
        start.rates.push((name.clone(), 0, rate + RELEASE[1]));
    }
    ExternalActions { start, ..ExternalActions::default() }
}

/// The values of all measurements at every node but the first.
pub(super) fn exact(model: &Model) -> Vec<MeasuredColumn> {
    let mut run = Simulation::with_outside(model, &truth(model)).unwrap();
    let columns = crate::sensor::columns(model);
    let place = |sensor: &str| columns.iter().position(|own| own.name() == sensor).unwrap();
    let places: Vec<usize> = model.measurements.iter().map(|own| place(&own.sensor)).collect();
    let mut all = vec![MeasuredColumn::default(); places.len()];
    for (step, sample) in run.samples().enumerate().skip(1) {
        let sensors = &sample.unwrap().sensors;
        for (column, place) in all.iter_mut().zip(&places) {
            column.times.push(step as f64 * model.settings.step);
            column.values.push(sensors[*place]);
        }
    }
    all
}

pub(super) fn found(text: &str, data: &[MeasuredColumn]) -> Result<IdentifiedModel, IdentifyError> {
    let (text, model) = read(text);
    let mut watch = IdentificationWatch { run: &mut |_| {}, interrupted: &mut || false };
    identify(&text, &[], &model, data, &mut watch)
}

/// The true values of the unknown numbers.
pub(super) fn true_values(model: &Model, text: &ModelText) -> Vec<f64> {
    let known = text.parameter_tangents(&[]).unwrap();
    let wanted = model.identify.as_ref().unwrap();
    let value = |name: &String| known.iter().find(|own| own.name == *name).unwrap().value;
    let start = truth(model).start;
    let joints = start.coordinates.iter().zip(&start.rates).flat_map(|(x, v)| [x.2, v.2]);
    wanted.parameters.keys().map(value).chain(joints).collect()
}

/// The same model by Galerkin steps of order 4.
fn by_galerkin(text: &str) -> String {
    text.replace("[simulation]\n", "[simulation]\nmethod = \"galerkin\"\norder = 4\n")
}

#[test]
fn exact_data_give_the_numbers_that_they_were_made_with() {
    let [arm, linkage] = [ARM, LINKAGE].map(by_galerkin);
    let others =
        [with_gyros(), with_efforts(), with_reactions(), with_accelerations(), with_controller()];
    let others = others.iter().map(String::as_str);
    for text in [ARM, LINKAGE, FLYING, WHEEL, &arm, &linkage].into_iter().chain(others) {
        let (source, model) = read(text);
        let IdentifiedModel { estimate, rows, .. } = found(text, &exact(&model)).unwrap();
        assert_eq!(estimate.outcome, "converged", "{estimate:?}");
        for (own, wanted) in estimate.parameters.iter().zip(true_values(&model, &source)) {
            let off = (own.value - wanted).abs() / wanted.abs().max(0.1);
            println!("{} {}: {} for {wanted}, {off:.1e}", estimate.model, own.name, own.value);
            assert!(off < 1e-7, "{}: {} for {wanted}", own.name, own.value);
            assert!((own.start - wanted).abs() > 1e-3 || own.name == "spin", "{own:?}");
        }
        assert!(rows.iter().all(|row| row.residual.abs() < 1e-5));
        assert!(estimate.is_sound() && estimate.parameters.len() >= 4);
    }
}

/// All measurements between nodes, at other unknown numbers than the true ones.
#[test]
fn residuals_of_models_have_their_derivatives() {
    let [arm, linkage] = [ARM, LINKAGE].map(by_galerkin);
    let others =
        [with_gyros(), with_efforts(), with_reactions(), with_accelerations(), with_controller()];
    let others = others.iter().map(String::as_str);
    for text in [ARM, LINKAGE, FLYING, WHEEL, &arm, &linkage].into_iter().chain(others) {
        let (source, model) = read(text);
        let mut data = exact(&model);
        for (k, column) in data.iter_mut().enumerate() {
            let later = [0.0, 0.37, 0.81][k % 3];
            column.times.iter_mut().for_each(|t| *t += (later - 1.0) * model.settings.step);
        }
        let PreparedFit { parameters, mut residuals, .. } =
            PreparedFit::new(&source, &[], &model, &data).unwrap();
        let mut theta: Vec<f64> = parameters.iter().map(|own| own.start).collect();
        theta.iter_mut().for_each(|x| *x += 0.01);
        let count = residuals.len();
        let mut jacobian = DMatrix::zeros(count, theta.len());
        let mut out = vec![0.0; count];
        residuals.evaluate(&theta, &mut out, Some(&mut jacobian)).unwrap();
        for (k, own) in parameters.iter().enumerate() {
            let mut central = |e: f64| {
                let [plus, minus] = [e, -e].map(|e| {
                    let (mut theta, mut out) = (theta.clone(), vec![0.0; count]);
                    theta[k] += e;
                    residuals.evaluate(&theta, &mut out, None).unwrap();
                    nalgebra::DVector::from_vec(out)
                });
                (plus - minus) / (2.0 * e)
            };
            let (long, short) = (central(2e-4), central(1e-4));
            let wanted = (&short * 4.0 - &long) / 3.0;
            let off = (jacobian.column(k) - &wanted).amax() / wanted.amax();
            println!("{} {}: {off:.1e} of {:.1e}", model.header.name, own.name, wanted.amax());
            assert!(wanted.amax() > 1e-3, "{} changes nothing", own.name);
            assert!(off < 1e-7, "{} {}: {off:e}", model.header.name, own.name);
        }
    }
}

/// Data with noise of the deviations that the model states.
pub(super) fn noisy(
    model: &Model,
    mut data: Vec<MeasuredColumn>,
    random: &mut Sample,
) -> Vec<MeasuredColumn> {
    for (column, own) in data.iter_mut().zip(&model.measurements) {
        for value in &mut column.values {
            let even: f64 = (0..12).map(|_| random.number()).sum();
            *value += own.sigma * even / 2.0; // the variance of [-1, 1) is 1/3
        }
    }
    data
}

/// Sixty sets of noise: errors in standard errors have the size one.
#[test]
fn standard_errors_are_those_of_noise() {
    let short = ARM.replace("initial = [\"shoulder\"]", "").replace(", spin = {}", "");
    let (source, model) = read(&short);
    let data = exact(&model);
    let wanted = true_values(&model, &source);
    let mut random = Sample::new(4);
    let (mut squares, mut count) = (0.0, 0.0);
    for _ in 0..60 {
        let noisy = noisy(&model, data.clone(), &mut random);
        let estimate = found(&short, &noisy).unwrap().estimate;
        assert!(estimate.is_sound());
        assert!((estimate.chi_square_per_freedom - 1.0).abs() < 0.35, "{estimate:?}");
        for (own, wanted) in estimate.parameters.iter().zip(&wanted) {
            squares += ((own.value - wanted) / own.standard_error.unwrap()).powi(2);
            count += 1.0;
        }
    }
    let mean: f64 = squares / count;
    println!("mean square of errors in standard errors {mean}");
    assert!((mean - 1.0).abs() < 3.0 * (2.0_f64 / count).sqrt(), "{mean}");
}

#[test]
fn what_cannot_be_found_is_refused_by_its_key() {
    let (_, arm) = read(ARM);
    let data = exact(&arm);
    let refused = |from: &str, to: &str, text: &str| {
        let changed = text.replace(from, to);
        assert_ne!(changed, text, "{from}");
        match found(&changed, &data) {
            Ok(own) => panic!("{to}: {:?}", own.estimate),
            Err(error) => error.to_string(),
        }
    };
    let cases = [
        ("length = { start", "lenght = { start", "no number under [parameters]"),
        ("spin = 0.4\n", "spin = \"= damping\"\n", "`spin`, which is no number"),
        ("rate = \"= spin\"", "rate = 0.4", "`spin`, on which nothing depends"),
        ("spin = {}", "spin = { min = 1.0 }", "the start 0.4 of `spin`"),
        ("sensor = \"tip.z\"", "sensor = \"tip\"", "several numbers"),
        ("step = 0.01", "step = 0.01\nscheme = \"em-nodal\"", "simulation.scheme"),
    ];
    for (from, to, what) in cases {
        let message = refused(from, to, ARM);
        assert!(message.contains(what), "{what}: {message}");
    }
    // the mass of what is not coupled to what is measured
    let alone = ARM.replace(
        "[[sensor]]\nname = \"angle\"",
        "[[body]]\nname = \"other\"\nmass = \"= spin\"\ninertia = [1.0, 1.0, 1.0]\n[[sensor]]\nname = \"angle\"",
    );
    let message = refused("rate = \"= spin\"", "rate = 0.4", &alone);
    assert!(message.contains("nothing that is measured depends on it"), "{message}");
    // three values for six numbers
    let few: Vec<MeasuredColumn> = data
        .iter()
        .map(|own| MeasuredColumn {
            times: own.times[..1].to_vec(),
            values: own.values[..1].to_vec(),
        })
        .collect();
    let message = found(ARM, &few).expect_err("too few").to_string();
    assert!(message.contains("4 measured values for 6 unknown numbers"), "{message}");
    // the start of a joint that follows from others
    let (_, linkage) = read(LINKAGE);
    let both = LINKAGE.replace("initial = [\"shaft\"]", "initial = [\"shaft\", \"pivot\"]");
    let message = found(&both, &exact(&linkage)).expect_err("one degree of freedom").to_string();
    assert!(message.contains("`pivot`"), "{message}");
    let opens = LINKAGE
        .replace("friction = 0.05\n", "friction = 0.05\ntilt = 0.0\n")
        .replace("axis = [0.0, 1.0, 0.0]\ndamper", "axis = [\"= tilt\", 1.0, 0.0]\ndamper")
        .replace("friction = { start", "tilt = {}, friction = { start");
    let message = found(&opens, &exact(&linkage)).expect_err("it opens").to_string();
    assert!(message.contains("no neighbouring mechanism closes"), "{message}");
}

#[test]
fn combinations_that_are_not_seen_are_named_until_a_prior_decides() {
    // damping and mass of a pendulum without gravity: their ratio alone is seen
    let text = ARM
        .replace("-9.81", "0.0")
        .replace("density = 700.0", "density = \"= 700*mass/1.3\"")
        .replace("damping = 0.05", "damping = \"= damping/4\"")
        .replace("length = { start = 0.75 }, ", "")
        .replace(", spin = {}", "");
    let (_, model) = read(&text);
    let data = exact(&model);
    let own = found(&text, &data).unwrap();
    assert!(!own.estimate.is_sound() && own.estimate.covariance.is_none());
    let warnings = own.estimate.warnings().concat();
    assert!(warnings.contains("0.707 `damping` + 0.707 `mass`"), "{warnings}");
    let prior = "mass = { start = 1.1, prior = { value = 1.3, sigma = 0.01 } }";
    let known = text.replace("mass = { start = 1.1 }", prior);
    let own = found(&known, &data).unwrap().estimate;
    assert!(own.is_sound());
    assert!((own.parameters[0].value - 0.2).abs() < 1e-7, "{:?}", own.parameters);
    let error = own.parameters[1].standard_error.unwrap();
    assert!((error - 0.01).abs() < 1e-9, "{error}");
}

#[test]
fn an_interruption_keeps_the_last_iterate() {
    let (text, model) = read(ARM);
    let data = exact(&model);
    let mut runs = 0;
    let mut watch = IdentificationWatch {
        run: &mut |_| {},
        interrupted: &mut || {
            runs += 1;
            runs > 3
        },
    };
    let found = identify(&text, &[], &model, &data, &mut watch).unwrap();
    assert!(found.interrupted && found.estimate.outcome == "interrupted");
    assert_eq!(found.estimate.runs, 3);
    assert!(found.estimate.parameters.iter().any(|own| own.value.to_bits() != own.start.to_bits()));
    let mut watch = IdentificationWatch { run: &mut |_| {}, interrupted: &mut || true };
    let none = identify(&text, &[], &model, &data, &mut watch).map(|own| own.estimate);
    assert_eq!(none.unwrap_err(), IdentifyError::Interrupted);
    let set = [Override::new("identify.max_iterations", "2")];
    let limited = text.model(&set).unwrap();
    let mut watch = IdentificationWatch { run: &mut |_| {}, interrupted: &mut || false };
    let found = identify(&text, &set, &limited, &data, &mut watch).unwrap().estimate;
    assert_eq!((found.outcome, found.iterations), ("exhausted", 2));
}
