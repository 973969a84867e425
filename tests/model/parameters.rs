//! Parameters of a model file: one value changes a mechanism consistently; what is wrong is named
//! at its place.

#![allow(clippy::unwrap_used, clippy::float_cmp)] // a test of exact numbers

use crate::harness::models::overrides;
use holonom::{Model, ModelError, Simulation};

const ARM: &str = include_str!("../models/parameters.toml");

fn with(text: &str, set: &[(&str, &str)]) -> Result<Model, ModelError> {
    Model::from_toml_with(text, &overrides(set))
}

#[test]
fn one_parameter_changes_the_mechanism_consistently() {
    let arm = Model::from_toml(ARM).unwrap();
    assert_eq!(arm.header.gravity, [0.0, 0.0, -9.81]);
    assert_eq!(arm.bodies[1].position, [1.2000000000000002, 0.0, 0.0]);
    assert_eq!((arm.settings.step, arm.bodies[0].position[0]), (1.0 / 128.0, 0.4));
    assert_eq!(arm.header.description.as_deref(), Some("= no expression"));
    let short = with(ARM, &[("parameters.length", "0.5")]).unwrap();
    assert_eq!(short.bodies[1].position, [0.75, 0.0, 0.0]);
    Simulation::new(&short).unwrap(); // the elbow closes
    let other = with(ARM, &[("body.lower.position.0", "= reach - 0.4"), ("parameters.g", "= 4/2")]);
    let other = other.unwrap();
    assert_eq!(other.bodies[1].position[0], 1.2000000000000002);
    // the resolved model has numbers and reads back as the same
    let text = short.to_toml();
    assert!(!text.contains("length/2") && !text.contains("[parameters]"), "{text}");
    assert_eq!(Model::from_toml(&text).unwrap().to_toml(), text);
}

#[test]
fn what_is_wrong_is_named_at_its_place() {
    let problem = |from: &str, to: &str| {
        assert!(ARM.contains(from), "{from}");
        let text = ARM.replace(from, to);
        let Err(ModelError::Invalid(problems)) = Model::from_toml(&text) else {
            panic!("{to} is refused");
        };
        let first = &problems[0];
        let place = first.span.clone().map(|span| text[span].to_owned()).unwrap_or_default();
        println!("{to}: {} | {:?} | at {place}", first.message, first.help);
        (first.message.clone(), first.help.clone().unwrap_or_default(), place)
    };
    let (message, help, place) = problem("\"= length/2\"", "\"= lenght/2\"");
    assert!(message.contains("no parameter `lenght`") && help.contains("`length`"));
    assert_eq!(place, "\"= lenght/2\"");
    let (message, help, place) = problem("length = 0.8", "length = \"= reach/2\"");
    assert!(message.contains("depends on") && help.contains("circle"), "{message} {help}");
    assert!(place == "\"= reach/2\"" || place == "\"= 2*length\"", "{place}");
    let (message, _, place) = problem("length = 0.8", "length = \"= 1 +\"");
    assert!(message.contains("`length` has no value: it ends where"), "{message}");
    assert_eq!(place, "\"= 1 +\"");
    let (message, ..) = problem("elements = 4", "sin = 4");
    assert!(message.contains("constant or a function"), "{message}");
    let (message, ..) = problem("elements = 4", "elements = true");
    assert!(message.contains("is no finite number"), "{message}");
    let (message, ..) = problem("elements = 4", "elements = inf");
    assert!(message.contains("is no finite number"), "{message}");
    let (message, ..) = problem("\"= 3*length\"", "\"= 1/(length - 0.8)\"");
    assert!(message.contains("`1/(length - 0.8)` is not finite"), "{message}");
    let (message, ..) = problem("\"= 3*length\"", "\"= -length\"");
    assert!(message.contains("density"), "a value is checked like any other: {message}");
    let unknown = with(ARM, &[("parameters.length", "= 2*with")]);
    let Err(ModelError::Invalid(problems)) = unknown else { panic!("refused") };
    assert!(problems[0].message.contains("no parameter `with`") && problems[0].span.is_none());
}

/// Each of many parameters depends on the one that stands after it.
#[test]
fn parameters_of_a_long_chain_are_found() {
    let count = 20_000;
    let mut text = String::from(
        "[model]\nname = \"m\"\n[simulation]\nstep = 0.1\nend = 1.0\n[[body]]\nname = \"b\"\nmass = \"= p0\"\nshape = { type = \"sphere\", dimensions = [0.1] }\n[parameters]\n",
    );
    for k in 0..count {
        text += &format!("p{k} = \"= p{} + 1\"\n", k + 1);
    }
    let closed = format!("{text}p{count} = 1\n");
    let model = Model::from_toml(&closed).unwrap();
    assert!((model.bodies[0].mass() - 20_001.0).abs() < 1e-9, "{}", model.bodies[0].mass());
    let circle = Model::from_toml(&format!("{text}p{count} = \"= p0\"\n")).unwrap_err().to_string();
    assert!(circle.contains("depends on"), "{circle}");
    let typo = Model::from_toml(&format!("{text}p{count} = \"= q0\"\n")).unwrap_err().to_string();
    assert!(typo.contains("q0"), "{typo}");
}

/// A value that would change nothing is refused, whoever reads the model.
#[test]
fn a_parameter_without_effect_is_not_replaced() {
    let refused = |text: &str, set: &[(&str, &str)]| {
        let Err(ModelError::Invalid(problems)) = with(text, set) else {
            panic!("{set:?} is refused");
        };
        let first = &problems[0];
        println!("{set:?}: {} | {:?}", first.message, first.help);
        (first.message.clone(), first.help.clone().unwrap_or_default())
    };
    let (message, help) = refused(ARM, &[("parameters.lenght", "2")]);
    assert!(message.contains("no parameter `lenght`") && help.contains("`parameters.length`"));
    let (message, help) = refused(ARM, &[("parameters.zebra", "2")]);
    assert!(
        message.contains("no parameter `zebra`")
            && help.contains("expressions use `g`, `length`, `reach`")
    );
    let (message, _) = refused(ARM, &[("parameters.elements", "8")]);
    assert!(message.contains("no expression uses the parameter `elements`"), "{message}");
    // used by a parameter alone that nothing uses
    let chain = ARM.replace("elements = 4", "elements = 4\nunused = \"= 2*elements\"");
    refused(&chain, &[("parameters.elements", "8")]);
    // the expressions that used it are replaced, too
    let both = [("parameters.g", "1.6"), ("model.gravity.2", "-1.6")];
    assert!(refused(ARM, &both).0.contains("no expression uses the parameter `g`"));
    // a resolved model has none
    let resolved = Model::from_toml(ARM).unwrap().to_toml();
    let (_, help) = refused(&resolved, &[("parameters.length", "2")]);
    assert!(help.contains("body.NAME.mass"), "{help}");
    refused(include_str!("../hostile/parameter_typo.toml"), &[("parameters.lenght", "2")]);
    with(include_str!("../hostile/parameter_typo.toml"), &[("parameters.length", "2")]).unwrap();
    // through another parameter; a new one that the same call uses
    with(ARM, &[("parameters.length", "0.7")]).unwrap();
    let new = [("parameters.ratio", "2"), ("body.upper.shape.density", "= 1000*ratio")];
    assert_eq!(with(ARM, &new).unwrap().bodies[0].shape.as_ref().unwrap().density, Some(2000.0));
    // a problem names the part, not its number
    let wrong = ARM.replace("density = \"= 3*length\"", "density = \"= sin(t)\"");
    let Err(ModelError::Invalid(problems)) = Model::from_toml(&wrong) else { panic!("refused") };
    assert_eq!(problems[0].key, "body.upper.shape.density");
    assert!(problems[0].help.as_ref().is_some_and(|help| help.contains("history")));
}

#[test]
fn undefined_values_do_not_disappear() {
    let refused = Model::from_toml(include_str!("../hostile/expression_min_nan.toml"));
    let Err(ModelError::Invalid(problems)) = refused else { panic!("refused") };
    println!("{} | {:?}", problems[0].message, problems[0].help);
    assert!(problems[0].message.contains("`0/0` is not defined") && problems[0].help.is_some());
}
