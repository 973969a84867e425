//! The continuous states of signals follow their differential equations: against formulas, to the
//! second order of the step, beside a body that does nothing.

use super::laws::run;
use vi_testkit::model::{body, head, part};

/// The largest error of each signal over a second.
fn errors(step: f64, scheme: &str) -> [f64; 4] {
    let signal = |name: &str, keys: &str| part("signal", name) + keys + "\n";
    let text = head("states", &format!("step = {step:?}, end = 1.0, {scheme}"))
        + &body("body", 1.0, [0.1; 3])
        + &signal("way", "rate = \"cos(4*t)\"\nstart = 0.5")
        + &signal("lag", "filter = { of = \"t\", time_constant = 0.2 }")
        + &signal(
            "swing",
            "transfer = { of = \"1\", numerator = [1.0], denominator = [0.04, 0.0, 1.0] }",
        )
        + &signal("sum", "pid = { of = \"sin(3*t)\", proportional = 0.0, integral = 2.0 }");
    let exact = |t: f64| {
        let decay = (-t / 0.2).exp();
        let way = 0.5 + 0.25 * (4.0 * t).sin();
        [way, t - 0.2 + 0.2 * decay, 1.0 - (5.0 * t).cos(), 2.0 / 3.0 * (1.0 - (3.0 * t).cos())]
    };
    let mut worst = [0.0_f64; 4];
    for node in run(&text).unwrap() {
        let exact = exact(node.t);
        (0..4).for_each(|k| worst[k] = worst[k].max((node.sensors[k] - exact[k]).abs()));
    }
    worst
}

#[test]
fn states_follow_their_equations_to_second_order() {
    for scheme in ["scheme = \"nodal\"", "scheme = \"constrained\"", "scheme = \"reduced\""] {
        let [coarse, fine] = [0.01, 0.005].map(|step| errors(step, scheme));
        println!("{scheme}: {coarse:?}, {fine:?}");
        for k in 0..4 {
            let order = (coarse[k] / fine[k]).log2();
            assert!(coarse[k] < 2e-3, "{scheme}, {k}: {coarse:?}");
            assert!((1.9..2.1).contains(&order), "{scheme}, {k}: {coarse:?} {fine:?}");
        }
    }
}
