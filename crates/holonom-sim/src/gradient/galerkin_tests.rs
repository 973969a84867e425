//! Gradients of runs by Galerkin steps against central differences of whole runs, by all that a
//! parameter may change.

use super::expression_tests::{BODIES, CASES, FREE, of};
use super::tests::{ARM, CONTROLLED, FLYING, LINKAGE, TURNED, WRENCHES, found};

/// The same model by Galerkin steps of an order.
fn by(text: &str, order: u32, scheme: &str) -> String {
    let text = text.replace("order = 4\n", "");
    let own = format!("method = \"galerkin\"\nscheme = \"{scheme}\"\norder = {order}");
    let inline = own.replace('\n', ", ");
    let text = text.replace("[simulation]\n", &format!("[simulation]\n{own}\n"));
    text.replace("simulation = { ", &format!("simulation = {{ {inline}, "))
}

#[test]
fn gradients_agree_with_differences_of_runs() {
    let pushed = FLYING.to_owned() + WRENCHES;
    for (text, scheme) in [
        (pushed.as_str(), "constrained"),
        (ARM, "nodal"),
        (ARM, "constrained"),
        (LINKAGE, "nodal"),
        (LINKAGE, "constrained"),
        (FLYING, "constrained"),
        (CONTROLLED, "nodal"),
        (TURNED, "nodal"),
    ] {
        for order in [4, 6] {
            let found = found(&by(text, order, scheme), true).unwrap();
            println!("{}, {scheme}, order {order}: {:.1e}", found.model, found.worst());
            assert!(found.worst() < 1e-8, "{}: {:?}", found.model, found.checks);
            assert!(found.checks.len() >= 3 && found.warning().is_none());
            assert!(found.parameters.iter().all(|own| own.derivative != 0.0));
        }
    }
}

#[test]
fn gradients_by_parameters_of_expressions_agree_with_differences() {
    let motor = "motor = { effort = 2.0, history = \"cos(w*t)\", proportional = 30.0, \
                 derivative = 2.0, path = \"0.1*k*t + c*t^2\" }";
    let driven =
        BODIES.replace("axis = [0.1, 1.0, 0.2]", &format!("axis = [0.1, 1.0, 0.2]\n{motor}"));
    let path = "[[constraint]]\nname = \"m\"\ntype = \"motion\"\njoint = \"elbow\"\npath = \"0.1*k*(1 - cos(w*t)) + c*t^3\"";
    let mut all = vec![("a motor", driven), ("a motion", format!("{BODIES}{path}"))];
    // these steps refuse delays
    for (what, more, _) in CASES.into_iter().filter(|own| !own.1.contains("delay")) {
        all.push((what, format!("{BODIES}{FREE}{}", more.replace('\'', "\""))));
    }
    for (what, text) in all {
        let found = of(&by(&text, 4, "constrained"));
        let found = found.unwrap_or_else(|error| panic!("{what}: {error}"));
        println!("{what}: {:.1e}, {} parameters", found.worst(), found.parameters.len());
        assert!(!found.parameters.is_empty());
        assert!(found.worst() < 1e-8, "{what}: {:?}", found.checks);
    }
}
