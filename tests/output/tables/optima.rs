//! The tables of an optimum: masses that slide, whose motion is a sum of their speeds and efforts.

use super::{Known, Tables, check};
use holonom::model::ModelText;
use holonom::optimize::{FoundOptimum, SearchProgress, SearchWatch, optimize_by_own_method};
use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;
use vi_testkit::model::{head, part, sensor, slider};

const STEP: f64 = 0.05;
const STEPS: usize = 24;
/// Ways of both masses under least efforts, m.
#[cfg(feature = "pounce")]
const WAYS: [f64; 2] = [0.5, -0.8];
const END: f64 = STEP * STEPS as f64;

fn optimum(text: &str) -> FoundOptimum {
    let watch: SearchWatch = Rc::new(RefCell::new(|_: &SearchProgress| true));
    let text = ModelText::from_text(Path::new("model.toml"), text);
    let found =
        optimize_by_own_method(&text, &[], &text.model(&[]).unwrap(), None, &watch).unwrap();
    println!("{}", found.iterations());
    found
}

/// A mass of 2 kg on a slide, with a sensor of its coordinate; the key of its start.
fn mass(name: &str, keys: &str) -> String {
    let slide = format!("{name}_slide");
    slider(&format!("{name}_mass"), &slide, 2.0)
        + keys
        + &sensor(&format!("{name}_at"), "joint_coordinate", &slide)
}

#[test]
fn columns_of_a_design() {
    let text = [
        "parameters = { meet = 0.9, aim = 0.2 }\n".to_owned(),
        head("design", &format!("step = {STEP}, end = {END:?}")),
        mass("a", "rate = \"= meet\"\n"),
        mass("b", "rate = \"= aim\"\n"),
        part("condition", "there") + "sensor = \"a_at\"\nequals = 0.5\n",
        part("objective", "near")
            + "type = \"sensor\"\nsensor = \"b_at\"\ntarget = 0.7\nweight = 3.0\n",
        "[optimize]\nstarts = 3\n".to_owned(),
        "parameters.meet = { min = 0.1, max = 2.0 }\n".to_owned(),
        "parameters.aim = { min = -2.0, max = 2.0 }\n".to_owned(),
    ]
    .concat();
    let found = optimum(&text);
    let unseen = [("iterations/steps late", "all motions have as many")];
    check(&Tables::alone("iterations", &found.iterations()), &designs, &unseen);
}

/// One search after another; places at the end are speeds times `END`.
fn designs(t: &Tables, name: &str) -> Option<Known> {
    let column = |name: &str| t.column(&format!("iterations/{name}")).to_vec();
    let counts = column("iteration");
    let first = |k: usize| counts[..=k].iter().rposition(|count| *count == 0.0).unwrap_or(k);
    let rows = |value: &dyn Fn(usize) -> f64| (0..counts.len()).map(value).collect();
    let values: Vec<f64> = match name.strip_prefix("iterations/")? {
        "start" => rows(&|k| counts[..=k].iter().filter(|count| **count == 0.0).count() as f64),
        "steps" => rows(&|_| STEPS as f64),
        "iteration" => {
            let starts = column("start");
            rows(&|k| {
                starts[..k].iter().filter(|own| (**own - starts[k]).abs() < 0.5).count() as f64
            })
        }
        "cost" => column("aim").iter().map(|v| 1.5 * (v * END - 0.7).powi(2)).collect(),
        "infeasibility" => column("meet").iter().map(|v| (v * END - 0.5).abs()).collect(),
        "aim" => column("cost").iter().map(|cost| (0.7 - (cost / 1.5).sqrt()) / END).collect(),
        "meet" => {
            let (found, beyond) = (column("meet"), column("infeasibility"));
            rows(&|k| (0.5 + beyond[k].copysign(found[first(k)] * END - 0.5)) / END)
        }
        _ => return None,
    };
    Some(Known::new(values, 1e-12))
}

#[cfg(feature = "pounce")]
#[test]
fn columns_of_least_efforts() {
    let control = |name: &str| {
        part("control", name)
            + &format!("joint = \"{name}_slide\"\n")
            + &part("condition", &format!("{name}_there"))
    };
    let text = [
        head("efforts", &format!("step = {STEP}, end = {END:?}")),
        mass("a", ""),
        mass("b", ""),
        control("a") + "sensor = \"a_at\"\nequals = 0.5\n",
        control("b") + "sensor = \"b_at\"\nequals = -0.8\n",
        part("condition", "still") + "type = \"rest\"\n",
        part("objective", "cheap") + "type = \"effort\"\n",
        "[optimize]\nrefine = 1\n".to_owned(),
    ]
    .concat();
    let found = optimum(&text);
    let of_the_method = [
        ("iterations/start late", "there is one search"),
        ("iterations/stationarity unknown", "zero at the beginning and at the optimum"),
        ("iterations/barrier unknown", "the method's own"),
        ("iterations/shift unknown", "zero: the cost is convex"),
    ];
    check(&Tables::alone("iterations", &found.iterations()), &efforts, &of_the_method);
    check(&Tables::alone("controls", &found.controls()), &efforts, &[]);
    check(&Tables::alone("costates", &found.costates()), &efforts, &[]);
}

/// What bounds cost, of a force that is bounded and of a way that is: the force would go on along
/// its line, `z_n = h (line_n − max)`, and the multipliers `m` of the balances bend at the bound of
/// the way, by `(M/h)(2 m_n − m_{n−1} − m_{n+1})`.
#[cfg(feature = "pounce")]
#[test]
fn columns_of_prices() {
    const MOST: f64 = 3.0;
    let text = [
        head("prices", &format!("step = {STEP}, end = {END:?}")),
        mass("a", ""),
        mass("b", "rate = -1.0\n"),
        part("control", "a") + &format!("joint = \"a_slide\"\nmax = {MOST:?}\n"),
        part("control", "b") + "joint = \"b_slide\"\n",
        part("condition", "there") + "sensor = \"a_at\"\nequals = 0.5\n",
        part("condition", "back") + "sensor = \"b_at\"\nequals = 0.0\n",
        part("condition", "low") + "sensor = \"b_at\"\nat = \"path\"\nmin = -0.1\n",
        part("condition", "still") + "type = \"rest\"\n",
        part("objective", "cheap") + "type = \"effort\"\n",
        "[optimize]\nrefine = 0\n".to_owned(),
    ]
    .concat();
    let found = optimum(&text);
    println!("{}", found.prices());
    let (u, m) = (|n: usize| found.controls[n][0], |n: usize| found.costates[n][1]);
    let known = |_: &Tables, name: &str| {
        let values = match name.strip_prefix("prices/")? {
            "t" => (0..=STEPS).map(|n| STEP * n as f64).collect(),
            "control.a" => {
                let (middle, slope) = (u(12), u(13) - u(12));
                let line = |n: usize| middle + slope * (n as f64 - 12.0);
                let price = |n: usize| -STEP * (line(n) - MOST).max(0.0);
                (0..STEPS).map(price).chain([f64::NAN]).collect()
            }
            "condition.low" => {
                let bend = |n: usize| 2.0 / STEP * (2.0 * m(n) - m(n - 1) - m(n + 1));
                let inner = (1..STEPS - 1).map(bend);
                let ends = [f64::NAN; 2];
                std::iter::once(f64::NAN).chain(inner).chain(ends).collect()
            }
            _ => return None,
        };
        Some(Known::new(values, 1e-7))
    };
    let tables = Tables::alone("prices", &found.prices());
    for name in ["control.a", "condition.low"] {
        let largest = tables
            .column(&format!("prices/{name}"))
            .iter()
            .fold(0.0_f64, |most, own| most.max(own.abs()));
        assert!(largest > 1e-2, "{name}");
    }
    check(&tables, &known, &[]);
    let low = found.report.conditions.iter().find(|own| own.name == "low").unwrap();
    let sum: f64 = tables.column("prices/condition.low").iter().filter(|own| !own.is_nan()).sum();
    assert!((low.price - sum).abs() < 1e-12 * sum.abs(), "{} for {sum}", low.price);
}

/// Of the least `½ Σ h u²` from rest to rest over `d`, of `N` steps: the effort decreases by `c`
/// in each, `u_n = c ((N − 1)/2 − n)` with `h² c Σ (u_n/c)² = 2 d`, and the multiplier of
/// the balance at the node `n` is `−c (N/2 − n)`.
#[cfg(feature = "pounce")]
fn efforts(_: &Tables, name: &str) -> Option<Known> {
    let slope = |way: f64, steps: f64| {
        let h = END / steps;
        2.0 * way / (h * h * steps * (steps * steps - 1.0) / 12.0)
    };
    let cost = |steps: f64| {
        let own = |way: f64| {
            0.5 * END / steps * slope(way, steps) * 2.0 * way * steps * steps / (END * END)
        };
        own(WAYS[0]) + own(WAYS[1])
    };
    let (file, column) = name.split_once('/')?;
    let last = STEPS as f64;
    let line = |way: f64, middle: f64| -> Vec<f64> {
        (0..STEPS).map(|n| slope(way, last) * (middle - n as f64)).collect()
    };
    let times = |from: f64| -> Vec<f64> { (0..STEPS).map(|n| STEP * (n as f64 + from)).collect() };
    let values = match (file, column) {
        ("controls", "t_mid") => times(0.5),
        ("controls", "a") => line(WAYS[0], 0.5 * (last - 1.0)),
        ("controls", "b") => line(WAYS[1], 0.5 * (last - 1.0)),
        ("costates", "t") => times(0.0),
        ("costates", "m0") => line(-WAYS[0], 0.5 * last),
        ("costates", "m1") => line(-WAYS[1], 0.5 * last),
        _ => {
            // two refinements of a step of Newton's method each: the second begins with the first
            let value = |k: usize| {
                let coarse = 0.5 * last;
                let moved = k % 2 == 1;
                let beginning = 2.0 * WAYS[1].abs() / END; // momentum of a mass at rest
                Some(match column {
                    "start" => 1.0,
                    "steps" => [coarse, last][k / 2],
                    "iteration" | "step_length" => f64::from(moved),
                    "cost" => [0.0, cost(coarse), cost(coarse), cost(last)][k],
                    "infeasibility" => [beginning, 0.0, f64::NAN, 0.0][k],
                    _ => return None,
                })
            };
            (0..4).map(value).collect::<Option<_>>()?
        }
    };
    Some(Known::new(values, 1e-11))
}
