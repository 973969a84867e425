//! Measurements and unknown numbers: masses that slide under constant forces, whose places are
//! linear functions of force, place and speed at the start, so that estimates and their standard
//! errors are those of linear regression.

use super::{Case, Checks, Run};
use holonom::identification::{IdentificationWatch, Identified, data, identify};
use holonom::model::ModelText;
use nalgebra::{DMatrix, DVector};
use std::path::Path;
use vi_testkit::model::{body, head, part, sensor};

const MASS: [f64; 3] = [2.0, 1.5, 1.2];
const TIMES: [f64; 6] = [0.13, 0.4, 0.55, 0.77, 0.9, 1.1];
/// Standard deviations of places and speed, m and m/s.
const SIGMA: [f64; 4] = [0.1, 0.2, 0.15, 0.05];
/// What is known of the first force: its value and standard deviation, N.
const PRIOR: [f64; 2] = [1.1, 0.3];

/// Values as they are measured: of the places of all, and of the speed of the first.
fn measured(column: usize, t: f64) -> f64 {
    let scatter = 0.04 * (7.3 * t + 1.9 * column as f64).sin();
    let place = |x: f64, v: f64, force: f64, k: usize| x + v * t + 0.5 * force / MASS[k] * t * t;
    scatter
        + match column {
            0 => place(0.3, -0.2, 0.9, 0),
            1 => -0.2 + 0.9 / MASS[0] * t,
            2 => place(0.0, 0.3, 2.1, 1),
            _ => place(0.0, -0.1, 0.2, 2),
        }
}

fn data_file() -> String {
    let row = |t: &f64| {
        let values: Vec<String> = (0..4).map(|k| format!("{:?}", measured(k, *t))).collect();
        format!("{t:?},{}\n", values.join(","))
    };
    "t,far,fast,b_place,third\n".to_owned() + &TIMES.iter().map(row).collect::<String>()
}

/// Force, place and speed of the first by linear regression, with standard errors.
fn regression() -> [[f64; 2]; 3] {
    let mut rows: Vec<[f64; 4]> = Vec::new();
    for t in TIMES {
        let [x, v] = [0, 1].map(|k| measured(k, t) / SIGMA[k]);
        let a = 1.0 / MASS[0];
        rows.push([0.5 * a * t * t / SIGMA[0], 1.0 / SIGMA[0], t / SIGMA[0], x]);
        rows.push([a * t / SIGMA[1], 0.0, 1.0 / SIGMA[1], v]);
    }
    rows.push([1.0 / PRIOR[1], 0.0, 0.0, PRIOR[0] / PRIOR[1]]);
    let of = DMatrix::from_fn(rows.len(), 3, |i, j| rows[i][j]);
    let y = DVector::from_fn(rows.len(), |i, _| rows[i][3]);
    let inverse = (of.transpose() * &of).try_inverse().unwrap();
    let found = &inverse * of.transpose() * y;
    [0, 1, 2].map(|k| [found[k], inverse[(k, k)].sqrt()])
}

fn found(document: &str) -> Option<Identified> {
    let text = ModelText::from_text(Path::new("model.toml"), document);
    let model = text.model(&[]).ok()?;
    let columns = data::read("data.csv", &data_file(), &model).ok()?;
    let mut watch = IdentificationWatch { run: &mut |_| {}, interrupted: &mut || false };
    identify(&text, &[], &model, &columns, &mut watch).ok().map(|found| found.estimate)
}

pub(super) fn cases() -> Vec<Case> {
    let slider = |name: &str, mass: f64, keys: &str| {
        body(name, mass, [0.1, 0.2, 0.3])
            + &part("joint", &format!("{name}_rail"))
            + &format!("type = \"prismatic\"\nparent = \"ground\"\nchild = \"{name}\"\n")
            + &format!("position = [0.0, 0.0, 0.0]\naxis = [1.0, 0.0, 0.0]\n{keys}")
            + &sensor(&format!("{name}_place"), "joint_coordinate", &format!("{name}_rail"))
    };
    let load = |name: &str, body: &str, force: &str| {
        part("load", name) + &format!("body = \"{body}\"\nforce = [\"= {force}\", 0.0, 0.0]\n")
    };
    let measurement = |sensor: &str, column: &str, sigma: f64| {
        let column =
            if column.is_empty() { String::new() } else { format!("column = \"{column}\"\n") };
        format!("[[measurement]]\nsensor = \"{sensor}\"\n{column}sigma = {sigma:?}\n")
    };
    let [value, sigma] = PRIOR;
    let text = |more: &str| {
        [
            head("identify", "step = 0.1, end = 1.2"),
            "[parameters]\npush = 1.0\npull = 1.2\nlift = 0.6\n".to_owned(),
            slider("a", MASS[0], ""),
            slider("b", MASS[1], "rate = 0.3\n"),
            slider("c", MASS[2], "rate = -0.1\n"),
            sensor("a_speed", "joint_rate", "a_rail"),
            load("pushed", "a", "push"),
            load("pulled", "b", "pull"),
            load("lifted", "c", "lift"),
            measurement("a_place", "far", SIGMA[0]),
            measurement("a_speed", "fast", SIGMA[1]),
            measurement("b_place", "", SIGMA[2]),
            measurement("c_place", "third", SIGMA[3]),
            "[identify]\ninitial = [\"a_rail\"]\n".to_owned(),
            more.to_owned(),
            "[identify.parameters]\npull = { max = 1.5 }\nlift = { min = 0.5 }\n".to_owned(),
            format!(
                "push = {{ start = 1.7, prior = {{ value = {value:?}, sigma = {sigma:?} }} }}\n"
            ),
        ]
        .concat()
    };
    let short = Case::new("one iteration", text("max_iterations = 1\n"), |run| {
        let mut checks = Checks::default();
        let found = found(&run.document.to_string()).map_or(f64::NAN, |own| own.iterations as f64);
        checks.near("iterations", found, 1.0, 1e-3);
        checks
    });
    let parts = Case::new("segments", text("segments = 3\n"), |run| {
        let mut checks = judged(run);
        let found = found(&run.document.to_string()).map_or(f64::NAN, |own| own.segments as f64);
        checks.near("segments", found, 3.0, 1e-3);
        checks
    });
    let all = Case::new("identify", text(""), judged);
    let measured = Case::new("measurements", text(""), judged).only("measurement");
    let (short, parts) = (short.only("identify.max_iterations"), parts.only("identify.segments"));
    vec![measured, all.only("identify"), short, parts]
}

fn judged(run: &Run) -> Checks {
    let mut checks = Checks::default();
    let Some(found) = found(&run.document.to_string()) else {
        checks.near("there is an estimate", 0.0, 1.0, 1e-3);
        return checks;
    };
    let own = |name: &str| found.parameters.iter().find(|own| own.name == name);
    let names = ["push", "a_rail.coordinate", "a_rail.rate"];
    for (name, [value, error]) in names.into_iter().zip(regression()) {
        let own = own(name);
        checks.near(name, own.map_or(f64::INFINITY, |own| own.value), value, 1e-9);
        let found = own.and_then(|own| own.standard_error).unwrap_or(f64::INFINITY);
        checks.near(&format!("error of {name}"), found, error, 1e-9);
    }
    let start = own("push").map_or(f64::INFINITY, |own| own.start);
    checks.near("start of push", start, 1.7, 1e-12);
    for (name, bound) in [("pull", 1.5), ("lift", 0.5)] {
        let own = own(name);
        checks.near(name, own.map_or(f64::INFINITY, |own| own.value), bound, 1e-12);
        let held = own.is_some_and(|own| own.at_bound && own.standard_error.is_none());
        checks.near(&format!("{name} at its bound"), f64::from(u8::from(held)), 1.0, 1e-3);
    }
    // residuals of a force at a bound, over the standard deviation
    for (column, k, [v, force]) in [("b_place", 2, [0.3, 1.5]), ("third", 3, [-0.1, 0.5])] {
        let mass = MASS[k - 1];
        let square = |t: f64| (v * t + 0.5 * force / mass * t * t - measured(k, t)).powi(2);
        let wanted = (TIMES.map(square).iter().sum::<f64>() / TIMES.len() as f64).sqrt();
        let own = found.columns.iter().find(|own| own.column == column);
        checks.near(column, own.map_or(f64::INFINITY, |own| own.rms), wanted, 1e-9);
        let sigma = own.map_or(f64::INFINITY, |own| own.sigma);
        checks.near(&format!("sigma of {column}"), sigma, SIGMA[k], 1e-12);
    }
    checks
}
