//! Words of other programs, and slips of the pen, are answered with what a model file has instead.

use holonom::model::Problem;
use holonom::{Model, ModelError};

const ARM: &str = include_str!("../models/arm.toml");

fn problems(text: &str) -> Vec<Problem> {
    match Model::from_toml(text) {
        Err(ModelError::Invalid(problems)) => problems,
        other => panic!("{text} is refused: {other:?}"),
    }
}

/// The remedy for the first problem.
fn help(text: &str) -> String {
    let first = problems(text).swap_remove(0);
    println!("{}: {} | {:?}", first.key, first.message, first.help);
    first.help.unwrap_or_default()
}

#[test]
fn what_is_not_modelled_is_answered_as_section_as_key_and_as_type() {
    for (word, answer) in [
        ("bounce", "in a [[contact]]"),
        ("obstacles", "in a [[contact]]"),
        ("mu_s", "`static_friction` of a rigid [[contact]]"),
        ("solref", "a [[contact]] is rigid"),
        ("coulomb", "`damper = { damping = … }`"),
        ("Limit", "`limits = [lower, upper]`"),
        ("range", "`limits = [lower, upper]`"),
        ("mount", "[[bushing]]"),
        ("nonholonomic", "of type \"rolling\""),
        ("release", "an [[event]] releases"),
        ("armature", "[[constraint]] of type \"gear\""),
        ("mimic", "[[constraint]] of type \"gear\""),
        ("tire", "a tire by its slip"),
        ("tyres", "a tire by its slip"),
        ("adaptive", "the step is constant"),
        ("controller", "a [[signal]] with `pid`"),
        ("trigger", "an [[event]] acts"),
        ("cable", "`element = \"rope\"`"),
        ("dry-friction", "`friction = { torque = … }`"),
        ("plate", "[[beam]]"),
        ("backlash", "a [[law]] that is zero in the middle"),
        ("wind", "[[law]] on a body"),
    ] {
        for text in [
            format!("{ARM}\n[[{word}]]\nname = \"x\"\n"),
            format!("{ARM}\n[{word}]\n"),
            format!("{ARM}{word} = 0.5\n"),
            format!("{ARM}{word} = {{ a = 1 }}\n"),
            ARM.replace("\"revolute\"", &format!("\"{word}\"")),
            format!("{ARM}[[constraint]]\nname = \"c\"\ntype = \"{word}\"\n"),
            format!("{ARM}[[sensor]]\nname = \"c\"\nof = \"arm\"\ntype = \"{word}\"\n"),
            ARM.replace("end = 0.1", &format!("end = 0.1, {word} = true")),
            ARM.replace("mass = 1.0", &format!("mass = 1.0, {word} = [1, 2]")),
        ] {
            let help = help(&text);
            assert!(help.contains(answer), "{word}: {help}");
        }
    }
    assert!(
        help(include_str!("../hostile/asks_for_friction.toml"))
            .contains("`friction = { torque = … }`")
    );
    assert!(
        help(include_str!("../hostile/asks_for_limits.toml")).contains("`limits = [lower, upper]`")
    );
    assert!(help(&ARM.replace("end = 0.1", "end = 0.1, scheme = \"rk4\"")).contains("nodal"));
    // words that are ours, or nearly, are answered as before
    assert!(help(&ARM.replace("\"revolute\"", "\"hinge\"")).contains("did you mean `revolute`"));
    assert!(help(&ARM.replace("parent", "parrent")).contains("did you mean `parent`"));
}

#[test]
fn numbers_are_written_as_numbers() {
    for (from, to, answer) in [
        ("step = 0.001", "step = \"10 ms\"", "in SI units: 0.01"),
        ("step = 0.001", "step = \"0,01\"", "with a decimal point: 0.01"),
        ("mass = 1.0", "mass = \"500 g\"", "in SI units: 0.5"),
        ("mass = 1.0", "mass = \"1.0\"", "without quotes: 1.0"),
        ("position = [0.5, 0.0, 0.0]", "position = [0,5, 0.0, 0.0]", "decimal comma"),
    ] {
        let help = help(&ARM.replacen(from, to, 1));
        assert!(help.contains(answer) && !help.contains("= 10 ms"), "{to}: {help}");
    }
}

#[test]
fn a_name_that_is_refused_is_reported_once() {
    let dotted = ARM
        .replace("\"arm\", mass", "\"lower.arm\", mass")
        .replace("child = \"arm\"", "child = \"lower.arm\"");
    let found = problems(&dotted);
    println!("{found:?}");
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].message.contains("`lower.arm` cannot be a name"));
    for name in ["+1", "-x", "@sum", "a=b"] {
        let found = problems(&ARM.replace("\"arm\", mass", &format!("\"{name}\", mass")));
        assert!(found[0].message.contains("cannot be a name"), "{found:?}");
    }
    Model::from_toml(&ARM.replace("\"hinge\"", "\"Gelenk ü-1\"")).unwrap();
}

#[test]
fn negative_stiffness_does_not_feed_energy_in() {
    let with = |part: &str| problems(&format!("{ARM}{part}\n")).swap_remove(0).message;
    assert!(with("spring = { stiffness = -1.0 }").contains("away from its place of rest"));
    assert!(with("motor = { proportional = -1.0 }").contains("away from its place of rest"));
    assert!(with("damper = { damping = -1.0 }").contains("would feed energy in"));
}

#[test]
fn a_gear_in_one_joint_is_a_screw() {
    let text = format!(
        "{ARM}[[constraint]]\nname = \"g\"\ntype = \"gear\"\njoints = [\"hinge\", \"hinge\"]\nratio = 2.0\n"
    );
    assert!(help(&text).contains("type = \"screw\""));
}

/// Words of users who have not read the reference: the key or the type that is meant, of several
/// the one that is possible there.
#[test]
fn words_of_other_keys_are_answered_with_the_key_that_is_meant() {
    for (section, line, meant) in [
        ("sensor", "body = \"arm\"", "did you mean `of`?"),
        ("sensor", "joint = \"hinge\"", "did you mean `of`?"),
        ("sensor", "constraint = \"drive\"", "did you mean `of`?"),
        ("sensor", "type = \"force\"", "did you mean `effort`?"),
        ("sensor", "type = \"coordinate\"", "did you mean `joint_coordinate`?"),
        ("load", "follower = true", "did you mean `frame`?"),
        ("joint", "velocity = 1.0", "did you mean `rate`?"),
        ("spring", "k = 1.0", "did you mean `stiffness`?"),
        ("spring", "length = 1.0", "did you mean `natural_length`?"),
        ("spring", "body1 = \"arm\"", "did you mean `from`?"),
        ("joint", "body1 = \"arm\"", "did you mean `parent`?"),
    ] {
        let found = help(&format!("{ARM}\n[[{section}]]\nname = \"x\"\n{line}\n"));
        assert!(found.starts_with(meant), "{section}, {line}: {found}");
    }
    for (line, meant) in [
        ("orientation = [0, 0, 1]", "did you mean `euler`?"),
        ("colour = \"red\"", "did you mean `color`?"),
    ] {
        let found = help(&ARM.replace("mass = 1.0,", &format!("mass = 1.0, {line},")));
        assert!(found.starts_with(meant), "body, {line}: {found}");
    }
    let spring =
        "[[spring]]\nname = \"s\"\nstiffness = 1.0\nfrom = { body = \"arm\" }\nto = \"ground\"\n";
    assert!(help(&format!("{ARM}\n{spring}")).contains("write a name in quotes"));
}
