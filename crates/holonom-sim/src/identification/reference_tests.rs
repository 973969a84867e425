//! Stored estimates of an independent implementation, from model files: joints begin where the
//! cases say, loops close anew for each length.

use super::{MeasuredColumn, PreparedFit};
use holonom_model::ModelText;
use serde_json::Value;
use std::path::Path;
use vi_control::least_squares::{Estimate, FitOutcome, LeastSquares};

fn case(name: &str) -> Value {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/reference/control");
    serde_json::from_str(&std::fs::read_to_string(folder.join(name)).unwrap()).unwrap()
}

fn list<'a>(value: &'a Value, key: &str) -> &'a [Value] {
    value.get(key).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

/// The case with expressions in the place of what its parameters set.
fn with_expressions(mut case: Value) -> Value {
    for parameter in list(&case.clone(), "parameters") {
        for set in list(parameter, "sets") {
            let name = parameter["name"].as_str().unwrap();
            let factor = set.get("factor").map_or(1.0, |x| x.as_f64().unwrap());
            let place = format!("/{}", set["path"].as_str().unwrap().replace('.', "/"));
            *case.pointer_mut(&place).unwrap() = format!("= {factor:?}*{name}").into();
        }
    }
    case
}

/// The model file of a case.
fn model_file(case: &Value) -> String {
    let of = |body: &Value| match body.as_u64() {
        Some(k) => list(case, "bodies")[k as usize]["name"].as_str().unwrap().to_owned(),
        None => "ground".to_owned(),
    };
    let at = |list_of: &str, joint: usize| {
        let own = |own: &&Value| own["joint"].as_u64() == Some(joint as u64);
        list(case, list_of).iter().find(own).cloned()
    };
    let (h, steps) = (case["h"].as_f64().unwrap(), case["steps"].as_u64().unwrap());
    let mut text = format!(
        "model = {{ name = \"case\", gravity = {} }}\nsimulation = {{ step = {h:?}, end = {:?}, project_start = true }}\n[parameters]\n",
        case["gravity"],
        h * steps as f64
    );
    for own in list(case, "parameters") {
        text += &format!("{} = {}\n", own["name"].as_str().unwrap(), own["start"]);
    }
    for body in list(case, "bodies") {
        let d = &body["directors"];
        let row = |i: usize| d[i].to_string();
        text += &format!(
            "[[body]]\nname = {}\nmass = {}\ninertia = {}\nposition = {}\nmatrix = [{}, {}, {}]\n",
            body["name"],
            body["mass"],
            body["principal_inertia"],
            body["position"],
            row(0),
            row(1),
            row(2)
        );
    }
    for (k, joint) in list(case, "joints").iter().enumerate() {
        text += &format!(
            "[[joint]]\nname = {}\ntype = \"revolute\"\nparent = \"{}\"\nchild = \"{}\"\nanchor_parent = {}\nanchor_child = {}\naxis = {}\n",
            joint["name"],
            of(&joint["parent"]),
            of(&joint["child"]),
            joint["anchor_parent"],
            joint["anchor_child"],
            joint["axis"]
        );
        if list(case, "cut_joints").iter().any(|cut| cut.as_u64() == Some(k as u64)) {
            text += "cut = true\n";
        }
        if let Some(own) = at("joint_springs", k) {
            text += &format!(
                "spring = {{ stiffness = {}, rest = {} }}\n",
                own["stiffness"], own["rest"]
            );
        }
        if let Some(own) = at("joint_dampers", k) {
            text += &format!("damper = {{ damping = {} }}\n", own["damping"]);
        }
        if at("efforts", k).is_some() {
            // straight lines through the values in the middles of steps
            let rows = list(case, "controls");
            let times: Vec<f64> = (0..rows.len()).map(|n| (n as f64 + 0.5) * h).collect();
            let values: Vec<f64> = rows.iter().map(|row| row[0].as_f64().unwrap()).collect();
            let history = format!("{{ type = \"table\", times = {times:?}, values = {values:?} }}");
            text += &format!("motor = {{ effort = 1.0, history = {history} }}\n");
        }
    }
    for (k, own) in list(case, "measurements").iter().enumerate() {
        let joint = &list(case, "joints")[own["joint"].as_u64().unwrap() as usize]["name"];
        text += &format!(
            "[[sensor]]\nname = \"s{k}\"\ntype = \"joint_coordinate\"\nof = {joint}\n[[measurement]]\nsensor = \"s{k}\"\nsigma = {}\n",
            own["sigma"]
        );
    }
    text +=
        &format!("[identify]\ninitial = [{}]\n[identify.parameters]\n", case["joints"][0]["name"]);
    for own in list(case, "parameters") {
        text += &format!("{} = {{}}\n", own["name"].as_str().unwrap());
    }
    text
}

/// The estimate of a case whose first joint begins where it says.
fn estimate(case: &Value, start: Option<&[f64]>, max_iterations: usize) -> Estimate {
    let text = model_file(&with_expressions(case.clone()));
    let text = ModelText::from_text(Path::new("model.toml"), text);
    let model = text.model(&[]).unwrap();
    let h = case["h"].as_f64().unwrap();
    let column = |own: &Value| MeasuredColumn {
        times: numbers(&own["steps"]).iter().map(|n| n * h).collect(),
        values: numbers(&own["values"]),
    };
    let data: Vec<_> = list(case, "measurements").iter().map(column).collect();
    let PreparedFit { mut parameters, mut residuals, .. } =
        PreparedFit::new(&text, &[], &model, &data).unwrap();
    let count = parameters.len() - 2;
    for (own, key) in parameters[count..].iter_mut().zip(["coordinates", "rates"]) {
        let value = numbers(&case["initial"][key])[0];
        (own.start, own.bounds) = (value, [value; 2]); // known
    }
    for (own, value) in parameters.iter_mut().zip(start.into_iter().flatten()) {
        (own.start, own.scale) = (*value, *value);
    }
    // the file has them by name, the case in its own order
    LeastSquares { max_iterations }.fit(&mut residuals, &parameters).unwrap()
}

/// Where each parameter of a case stands among those of the file, which are sorted by name.
fn places(case: &Value) -> Vec<usize> {
    let names: Vec<&str> =
        list(case, "parameters").iter().map(|own| own["name"].as_str().unwrap()).collect();
    let mut sorted = names.clone();
    sorted.sort_unstable();
    names.iter().map(|name| sorted.iter().position(|own| own == name).unwrap()).collect()
}

#[test]
fn stored_estimates_are_met_from_model_files() {
    for name in ["id01_pendulum.json", "id02_four_bar.json"] {
        let case = case(name);
        let fit = estimate(&case, None, 100);
        assert_eq!(fit.outcome, FitOutcome::Converged, "{name}");
        let errors = fit.standard_errors().unwrap();
        let (results, tolerance) = (&case["results"], &case["tolerance"]);
        for (k, place) in places(&case).into_iter().enumerate() {
            for (found, key) in [(&fit.parameters, "estimate"), (&errors, "standard_error")] {
                let wanted = numbers(&results[key])[k];
                let allowed = tolerance[format!("{key}_relative")].as_f64().unwrap();
                let off = (found[place] / wanted - 1.0).abs() / allowed;
                println!("{name} {key}: {} off {off:.2e} of the tolerance", found[place]);
                assert!(off < 1.0, "{name} {key}: {} for {wanted}", found[place]);
            }
        }
        let sum = fit.half_sum_of_squares - results["half_sum_of_squares"].as_f64().unwrap();
        assert!(sum.abs() < tolerance["half_sum_of_squares"].as_f64().unwrap(), "{name}: {sum:e}");
    }
}

#[test]
fn the_stored_combination_is_not_seen_from_a_model_file() {
    let case = case("id04_not_identifiable.json");
    let (places, at) = (places(&case), numbers(&case["results"]["at"]));
    let mut start = vec![0.0; at.len()];
    places.iter().zip(&at).for_each(|(place, at)| start[*place] = *at);
    let fit = estimate(&case, Some(&start), 0);
    assert_eq!(fit.unseen.len(), 1);
    let wanted = numbers(&case["results"]["null_direction_relative"]);
    let direction = &fit.unseen[0].direction;
    let sign = (direction[places[0]] * wanted[0]).signum();
    for (place, wanted) in places.iter().zip(wanted) {
        println!("{} for {}", direction[*place], sign * wanted);
        assert!((direction[*place] - sign * wanted).abs() < 1e-4);
    }
}
