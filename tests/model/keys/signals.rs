//! Signals: each by its recurrence, written out.

use super::{Case, Checks};
use holonom::nalgebra::{Matrix2, Vector2};
use vi_testkit::model::{head, part, slider};

const H: f64 = 1e-3;

/// Kinds with states: `u' = φ(t, u)` with `φ` of first degree in `u`, by the midpoint rule.
fn states() -> Case {
    let text = [
        head("signals", "step = 1e-3, end = 0.02"),
        slider("slider", "rail", 2.0),
        part("signal", "lag") + "start = 0.7\nfilter = { of = \"3+200*t\", time_constant = 0.01 }\n",
        part("signal", "slow") + "filter = { of = \"5-lag\", time_constant = 0.03 }\n",
        part("signal", "sum") + "start = 0.3\nrate = \"400*t-1\"\n",
        part("signal", "leak") + "rate = \"7-leak*60\"\n",
        part("signal", "shape")
            + "transfer = { of = \"2+50*t\", numerator = [3.0, 500.0], denominator = [0.02, 3.0, 700.0] }\n",
        part("signal", "direct")
            + "transfer = { of = \"sum\", numerator = [0.4, 30.0], denominator = [0.5, 60.0] }\n",
        part("signal", "plain") + "value = \"4-70*t\"\n",
        part("signal", "number") + "start = 0.9\n",
        part("law", "push") + "joint = \"rail\"\neffort = \"lag-9*plain+number\"\n",
    ]
    .concat();
    Case::new("signals with states", text, |run| {
        let mut checks = Checks::default();
        let (mut lag, mut slow, mut sum, mut leak) = (0.7, 0.0, 0.3, 0.0);
        let (mut x, mut y) = (Vector2::zeros(), 0.0);
        let mut impulse = 0.0;
        for node in 0..run.steps() {
            let t = run.t(node);
            let mut near = |name: &str, value: f64| {
                checks.near(name, run.sensor(name, node), value, 1e-11);
            };
            near("lag", lag);
            near("slow", slow);
            near("sum", sum);
            near("leak", leak);
            near("shape", 150.0 * x[0] + 25_000.0 * x[1]);
            // b_0 = 0.8, a_1 = 120, b_1 = 60
            near("direct", (60.0 - 96.0) * y + 0.8 * sum);
            near("plain", 4.0 - 70.0 * t);
            near("number", 0.9);
            checks.near("impulse", run.linear_momentum(node).x, impulse, 1e-11);
            let mid = t + 0.5 * H;
            let step =
                |z: f64, rate: f64, decay: f64| (z + 0.5 * H * rate) / (1.0 + 0.5 * H * decay);
            let mean = step(lag, (3.0 + 200.0 * mid) / 0.01, 1.0 / 0.01);
            impulse += H * (mean - 9.0 * (4.0 - 70.0 * mid) + 0.9);
            slow = 2.0 * step(slow, (5.0 - mean) / 0.03, 1.0 / 0.03) - slow;
            lag = 2.0 * mean - lag;
            let mean = sum + 0.5 * H * (400.0 * mid - 1.0);
            y = 2.0 * step(y, mean, 120.0) - y;
            sum = 2.0 * mean - sum;
            leak = 2.0 * step(leak, 7.0, 60.0) - leak;
            let of = Vector2::new(2.0 + 50.0 * mid, 0.0);
            let a = Matrix2::new(-150.0, -35_000.0, 1.0, 0.0);
            let mean =
                (Matrix2::identity() - 0.5 * H * a).try_inverse().unwrap() * (x + 0.5 * H * of);
            x = 2.0 * mean - x;
        }
        checks
    })
    .only("signal")
}

/// A controller that reaches both limits, and one whose integral is led back in `k_p/k_i`.
fn controllers() -> Case {
    let text = [
        head("controllers", "step = 1e-3, end = 0.02"),
        slider("slider", "rail", 2.0),
        part("signal", "control")
            + "pid = { of = \"1-120*t\", proportional = 3.0, integral = 50.0, derivative = 0.06, filter = 0.004, \
               limits = [-1.5, 2.5], tracking = 0.02, feedforward = \"0.2+9*t\" }\n",
        part("signal", "usual")
            + "pid = { of = \"0.5-60*t-rail\", proportional = 2.0, integral = 40.0, limits = [-0.4, 0.6] }\n",
        part("signal", "free") + "pid = { of = \"0.3-8*t\", proportional = 5.0, integral = 70.0 }\n",
        part("law", "push") + "joint = \"rail\"\neffort = \"control*0\"\n",
    ]
    .concat();
    Case::new("controllers", text, |run| {
        let mut checks = Checks::default();
        let clamp = |w: f64, a: f64, b: f64| w.max(a).min(b);
        let (mut i, mut d, mut usual, mut free) = (0.0, 1.0, 0.0, 0.0);
        for node in 0..run.steps() {
            let t = run.t(node);
            let w = |t: f64, i: f64, d: f64| {
                let e = 1.0 - 120.0 * t;
                3.0 * e + 50.0 * i + 0.06 * (e - d) / 0.004 + 0.2 + 9.0 * t
            };
            let mut near = |name: &str, value: f64| {
                checks.near(name, run.sensor(name, node), value, 1e-11);
            };
            near("control.e", 1.0 - 120.0 * t);
            near("control.u", w(t, i, d));
            near("control", clamp(w(t, i, d), -1.5, 2.5));
            near("control.i", i);
            near("control.d", d);
            let of = |t: f64, i: f64| 2.0 * (0.5 - 60.0 * t) + 40.0 * i;
            near("usual.i", usual);
            near("usual", clamp(of(t, usual), -0.4, 0.6));
            near("free", 5.0 * (0.3 - 8.0 * t) + 70.0 * free);
            let mid = t + 0.5 * H;
            let e = 1.0 - 120.0 * mid;
            let mean = (d + 0.5 * H * e / 0.004) / (1.0 + 0.5 * H / 0.004);
            d = 2.0 * mean - d;
            let (mut sum, mut own) = (i, usual);
            for _ in 0..60 {
                let w = w(mid, sum, mean);
                sum = i + 0.5 * H * (e + (clamp(w, -1.5, 2.5) - w) / (50.0 * 0.02));
                let w = of(mid, own);
                own = usual
                    + 0.5 * H * (0.5 - 60.0 * mid + (clamp(w, -0.4, 0.6) - w) / (40.0 * 0.05));
            }
            (i, usual) = (2.0 * sum - i, 2.0 * own - usual);
            free += H * (0.3 - 8.0 * mid);
        }
        checks
    })
    .only("signal")
}

/// What is sampled and held, and what is kept.
fn sampled() -> Case {
    let text = [
        head("sampled", "step = 1e-3, end = 0.02"),
        slider("slider", "rail", 2.0),
        part("signal", "held") + "every = 4e-3\nstart = 0.2\nvalue = \"last*0.5+100*t\"\n",
        part("signal", "fresh") + "every = 2e-3\nvalue = \"last+1\"\n",
        part("signal", "digital")
            + "every = 2e-3\npid = { of = \"0.4-60*t\", proportional = 3.0, integral = 50.0, derivative = 0.06, \
               filter = 0.004, limits = [-0.5, 1.1], tracking = 0.02, feedforward = \"held\" }\n",
        part("signal", "past") + "delay = { of = \"50*t*t+1\", time = 3.25e-3 }\n",
        part("law", "push") + "joint = \"rail\"\neffort = \"digital+held\"\n",
    ]
    .concat();
    Case::new("sampled signals", text, |run| {
        let mut checks = Checks::default();
        let (mut held, mut u, mut i, mut d, mut impulse) = (0.2, 0.0, 0.0, 0.4, 0.0);
        for node in 0..run.steps() {
            let t = run.t(node);
            if node % 4 == 0 {
                held = 0.5 * held + 100.0 * t;
            }
            if node % 2 == 0 {
                let e = 0.4 - 60.0 * t;
                let slope = (e - d) / (0.004 + 0.002);
                d += 0.002 * slope;
                let w: f64 = 3.0 * e + 50.0 * i + 0.06 * slope + held;
                u = w.clamp(-0.5, 1.1);
                i += 0.002 * (e + (u - w) / (50.0 * 0.02));
            }
            let mut near = |name: &str, value: f64| {
                checks.near(name, run.sensor(name, node), value, 1e-11);
            };
            near("held", held);
            near("fresh", (node / 2 + 1) as f64);
            near("digital", u);
            near("digital.e", 0.4 - 60.0 * t);
            near("digital.i", i);
            near("digital.d", d);
            let kept = |k: i32| {
                let t = f64::from((node as i32 - k).max(0)) * H;
                50.0 * t * t + 1.0
            };
            near("past", 0.75 * kept(3) + 0.25 * kept(4));
            checks.near("impulse", run.linear_momentum(node).x, impulse, 1e-11);
            impulse += H * (u + held);
        }
        checks
    })
    .only("signal")
}

pub(crate) fn cases() -> Vec<Case> {
    vec![states(), controllers(), sampled()]
}
