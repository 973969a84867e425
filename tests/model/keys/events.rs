//! Events: sliders that move uniformly until an event changes that, so that their places tell when
//! it acted and on what.

use super::{Case, Checks};
use vi_testkit::model::{body, head, part, sensor};

const STEP: f64 = 0.02;
/// An event ends the run here, s.
const END: f64 = 0.853;

/// A slider along x of the mass 2 kg with this speed, m/s, and its place.
fn slider(name: &str, speed: f64) -> String {
    body(name, 2.0, [0.1, 0.2, 0.3])
        + &part("joint", &format!("{name}_rail"))
        + &format!("type = \"prismatic\"\nparent = \"ground\"\nchild = \"{name}\"\n")
        + &format!("position = [0.0, 0.0, 0.0]\naxis = [1.0, 0.0, 0.0]\nrate = {speed:?}\n")
        + &sensor(&format!("{name}_place"), "position", name)
}

fn event(name: &str, keys: &str) -> String {
    part("event", name) + keys
}

/// `x` at the end of what is pushed by 1 m/s² in these intervals.
fn pushed(intervals: &[[f64; 2]]) -> f64 {
    let part = |[a, b]: &[f64; 2]| 0.5 * (b - a) * (b - a) + (b - a) * (END - b);
    intervals.iter().map(part).sum()
}

pub(super) fn cases() -> Vec<Case> {
    let law = |name: &str, rail: &str| {
        part("law", name) + &format!("joint = \"{rail}\"\neffort = \"2\"\n")
    };
    let text = [
        head("events", &format!("step = {STEP}, end = 1.0")),
        slider("a", 2.0),
        slider("b", 1.5),
        slider("c", 0.0),
        slider("d", 0.7),
        slider("e", 0.0),
        slider("f", 1.1),
        slider("g", 0.0),
        part("signal", "power") + "start = 1.0\n",
        part("law", "drive") + "joint = \"g_rail\"\neffort = \"2*power\"\n",
        law("push", "c_rail"),
        law("pull", "e_rail"),
        part("load", "lift") + "body = \"d\"\nforce = [0.0, 0.0, 4.0]\n",
        event("stop", "when = \"t>0.413\"\nlock = [\"a_rail\"]\n"),
        event("hold", "at = 0.307\nlock = [\"b_rail\"]\n"),
        event("off", "at = 0.211\ndisable = [\"push\"]\n"),
        event("on", "at = 0.517\nenable = [\"push\"]\n"),
        event("free", "at = 0.263\nrelease = [\"d_rail\"]\n"),
        event("high", "when = \"sin(12*t) > 0.5\"\ndisable = [\"pull\"]\nonce = false\n"),
        event("low", "when = \"sin(12*t) < 0.1\"\nenable = [\"pull\"]\nonce = false\n"),
        event("late", "when = \"f_rail > 0.363\"\nlock = [\"f_rail\"]\nlocate = \"step\"\n"),
        event("weaken", "at = 0.607\nset = { power = -0.5 }\n"),
        event("last", &format!("at = {END:?}\nend = true\ndisable = [\"drive\"]\n")),
    ]
    .concat();
    let case = Case::new("events", text, |run| {
        let mut checks = Checks::default();
        let last = run.last();
        let x = |name: &str| run.sensor(&format!("{name}_place.x"), last);
        checks.near("end", run.t(last), END, 1e-12);
        checks.near("stopped", x("a"), 2.0 * 0.413, 1e-10);
        checks.near("held", x("b"), 1.5 * 0.307, 1e-10);
        // jumps of a force within a step: of the places where it is evaluated, of second order
        checks.near("pushed", x("c"), pushed(&[[0.0, 0.211], [0.517, END]]), 1e-9);
        let z = run.sensor("d_place.z", last);
        checks.near("lifted", z, 0.5 * 2.0 * (END - 0.263) * (END - 0.263), 1e-9);
        checks.near("freed", x("d"), 0.7 * END, 1e-9);
        let (rise, fall) = (0.5_f64.asin() / 12.0, (std::f64::consts::PI - 0.1_f64.asin()) / 12.0);
        let turn = std::f64::consts::TAU / 12.0;
        let pulls = [[0.0, rise], [fall, rise + turn], [fall + turn, END]];
        checks.near("pulled", x("e"), pushed(&pulls), 1e-9);
        let driven = pushed(&[[0.0, 0.607]]) - 0.5 * pushed(&[[0.607, END]]);
        checks.near("driven", x("g"), driven, 1e-9);
        let late = (0.363 / 1.1 / STEP).ceil() * STEP;
        checks.near("late", x("f"), 1.1 * late, 1e-10);
        let mut acted: Vec<String> =
            run.nodes.iter().flat_map(|node| &node.events).map(|e| e.event.clone()).collect();
        acted.dedup(); // one name for all that an event does
        let expected = [
            "high", "off", "low", "free", "hold", "late", "stop", "on", "high", "weaken", "low",
            "last",
        ];
        let at_last = run.nodes[last].events.iter().chain(&run.nodes[last - 1].events);
        checks.holds("at last", at_last.into_iter().any(|e| e.action == "disable drive"));
        checks.near("names", f64::from(u8::from(acted == expected)), 1.0, 0.5);
        checks
    });
    vec![case.only("event")]
}
