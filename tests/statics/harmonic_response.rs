//! The program's harmonic response against closed forms and a long run in time.
#![allow(clippy::unwrap_used, non_snake_case)] // a test; M, K, A

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::fs;
use std::path::{Path, PathBuf};

use crate::program::command::{holonom, pendulum_folder, words};
use holonom::nalgebra::{Complex, Matrix2, Vector2};
use serde_json::Value;

type C = Complex<f64>;

fn folder(case: &str) -> PathBuf {
    pendulum_folder("harmonic_response", case)
}

/// Two masses on a line, `M = diag(2, 1)`, between springs and dampers.
const CHAIN: &str = r#"
[model]
name = "chain"

[simulation]
step = 0.002
end = 30.0

[[body]]
name = "a"
mass = 2.0
inertia = [1.0, 1.0, 1.0]

[[body]]
name = "b"
mass = 1.0
inertia = [1.0, 1.0, 1.0]
position = [1.0, 0.0, 0.0]

[[joint]]
name = "j1"
type = "prismatic"
parent = "ground"
child = "a"
position = [0.0, 0.0, 0.0]
axis = [1.0, 0.0, 0.0]
spring = { stiffness = 200.0 }
damper = { damping = 4.0 }

[[joint]]
name = "j2"
type = "prismatic"
parent = "a"
child = "b"
position = [0.0, 0.0, 0.0]
axis = [1.0, 0.0, 0.0]
spring = { stiffness = 100.0 }
damper = { damping = 1.0 }

[[load]]
name = "push"
body = "b"
force = [3.0, 0.0, 0.0]

[[sensor]]
name = "xa"
type = "position"
of = "a"

[[sensor]]
name = "vb"
type = "velocity"
of = "b"

[[sensor]]
name = "ab"
type = "acceleration"
of = "b"

[[sensor]]
name = "q2"
type = "joint_coordinate"
of = "j2"

[[sensor]]
name = "e1"
type = "effort"
of = "j1"

[[sensor]]
name = "held"
type = "reaction"
of = "j1"
"#;

/// Amplitudes by frequency and name.
fn response(folder: &Path, model: &str, arguments: &[&str]) -> Vec<(f64, BTreeMap<String, C>)> {
    fs::write(folder.join("model.toml"), model).unwrap();
    let call = [&["response", "model.toml", "-o", "out", "--force"][..], arguments].concat();
    let output = holonom(folder, &call);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    let csv = fs::read_to_string(folder.join("out/response.csv")).unwrap();
    let mut lines = csv.lines();
    let head: Vec<&str> = lines.next().unwrap().split(',').collect();
    let row = |line: &str| {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        assert!((cells[1] / (TAU * cells[0]) - 1.0).abs() < 1e-14);
        let pairs = (2..head.len()).step_by(2);
        let of = pairs.map(|k| {
            let name = head[k].strip_suffix(".amplitude").unwrap().to_owned();
            assert_eq!(head[k + 1], format!("{name}.phase"));
            (name, Complex::from_polar(cells[k], cells[k + 1].to_radians()))
        });
        (cells[1], of.collect())
    };
    lines.map(row).collect()
}

/// Of the chain with a matrix of damping under the force `f`, the ground moving by `base`.
fn check_chain(
    rows: &[(f64, BTreeMap<String, C>)],
    damping: Matrix2<f64>,
    force: impl Fn(f64) -> Vector2<C>,
    base: f64,
) -> f64 {
    let mut worst = 0.0_f64;
    for (omega, found) in rows {
        let iw = C::new(0.0, *omega);
        let (M, K) = (mass(), stiffness());
        let A = K.map(C::from) + damping.map(C::from) * iw + M.map(C::from) * (iw * iw);
        let x = A.lu().solve(&force(*omega)).unwrap();
        let b = x[1] + base;
        let expected = [
            ("xa.x", x[0] + base),
            ("vb.x", iw * b),
            ("ab.x", iw * iw * b),
            ("q2", x[1] - x[0]),
            ("e1.spring", -200.0 * x[0]),
            ("e1.damper", -4.0 * iw * x[0]),
        ];
        for (name, expected) in expected {
            worst = worst.max((found[name] - expected).norm() / expected.norm());
        }
    }
    worst
}

fn mass() -> Matrix2<f64> {
    Matrix2::new(2.0, 0.0, 0.0, 1.0)
}

fn stiffness() -> Matrix2<f64> {
    Matrix2::new(300.0, -100.0, -100.0, 100.0)
}

fn dampers() -> Matrix2<f64> {
    Matrix2::new(5.0, -1.0, -1.0, 1.0)
}

/// `Σ 2 ζ_k ω_k (M x_k)(M x_k)ᵀ`.
fn modal(ratios: [f64; 2]) -> Matrix2<f64> {
    let squares = [(500.0 - 300.0) / 4.0, (500.0 + 300.0) / 4.0_f64]; // 2ω⁴ − 500ω² + 20000 = 0
    let mut sum = Matrix2::zeros();
    for (square, ratio) in squares.into_iter().zip(ratios) {
        let x = Vector2::new(100.0, 300.0 - 2.0 * square);
        let x = mass() * x / (x.dot(&(mass() * x))).sqrt();
        sum += 2.0 * ratio * square.sqrt() * x * x.transpose();
    }
    sum
}

#[test]
fn two_masses_answer_as_their_complex_stiffness_says() {
    let folder = folder("chain");
    let band = ["--band", "0.2:5:25"];
    let push = |_: f64| Vector2::new(C::default(), C::from(3.0));
    let cases = [
        (&["--input", "load.push"][..], Matrix2::zeros()),
        (&["--input", "load.push", "--rayleigh", "0.3:1e-3"], 0.3 * mass() + 1e-3 * stiffness()),
        (&["--input", "load.push", "--damping-ratio", "0.02,0.05"], modal([0.02, 0.05])),
        (&["--input", "load.push", "--damping-ratio", "0.03"], modal([0.03, 0.03])),
    ];
    for (arguments, added) in cases {
        let rows = response(&folder, CHAIN, &[arguments, &band].concat());
        let off = check_chain(&rows, dampers() + added, push, 0.0);
        println!("{arguments:?}: {} frequencies, off by {off:.1e}", rows.len());
        assert!(off < 1e-9 && rows.len() > 25, "{arguments:?}: {off:e}");
    }
    let rows = response(&folder, CHAIN, &[&["--input", "base.x=0.01"][..], &band].concat());
    let inertia = |w: f64| (0.01 * w * w * mass() * Vector2::new(1.0, 1.0)).map(C::from);
    let off = check_chain(&rows, dampers(), inertia, 0.01);
    println!("base motion: off by {off:.1e}");
    assert!(off < 1e-9, "{off:e}");
    // about z: cos ωt along x; about y: along x the sine
    for (input, phase) in [("unbalance.a.z=0.05", 0.0), ("unbalance.a.y=0.05", -0.5)] {
        let rows = response(&folder, CHAIN, &[&["--input", input][..], &band].concat());
        let turning = C::from_polar(0.05, phase * std::f64::consts::PI);
        let off =
            check_chain(&rows, dampers(), |w| Vector2::new(turning * w * w, C::default()), 0.0);
        println!("{input}: off by {off:.1e}");
        assert!(off < 1e-8, "{input}: {off:e}");
    }
    let page = fs::read_to_string(folder.join("out/response.html")).unwrap();
    assert!(page.contains("harmonic response") && page.contains("Resonances"));
    assert!(folder.join("out/response/position_amplitude.svg").exists());
    let json = fs::read_to_string(folder.join("out/response.json")).unwrap();
    let json: Value = serde_json::from_str(&json).unwrap();
    let first = json["resonances"][0]["frequency"].as_f64().unwrap();
    assert!((TAU * first / 50.0_f64.sqrt() - 1.0).abs() < 1e-2, "{first}");
    assert!(json["warnings"][0].as_str().unwrap().contains("`held`"), "{}", json["warnings"]);
}

#[test]
fn a_long_run_in_time_has_the_same_amplitude_and_phase() {
    let folder = folder("time");
    let frequency = 1.25;
    let rows = response(&folder, CHAIN, &["--input", "load.push", "--band", "1.25:2:2"]);
    let expected = rows[0].1["xa.x"];
    // a cosine: a sine with the phase of a quarter
    let history = "force = [3.0, 0.0, 0.0]\nhistory = { type = \"harmonic\", frequency = 1.25, phase = 1.5707963267948966 }";
    let model = CHAIN.replace("force = [3.0, 0.0, 0.0]", history);
    fs::write(folder.join("motion.toml"), model).unwrap();
    let output = holonom(&folder, &["run", "motion.toml"]);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    let csv = fs::read_to_string(folder.join("motion-out/sensors.csv")).unwrap();
    let head: Vec<&str> = csv.lines().next().unwrap().split(',').collect();
    let place = head.iter().position(|name| *name == "xa.x").unwrap();
    let (mut sum, mut count) = (C::default(), 0.0);
    for line in csv.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let (t, x): (f64, f64) = (cells[1].parse().unwrap(), cells[place].parse().unwrap());
        if t > 22.0 + 1e-6 {
            sum += x * Complex::from_polar(1.0, -TAU * frequency * t); // ten whole periods
            count += 1.0;
        }
    }
    let found = 2.0 * sum / count;
    let off = (found - expected).norm() / expected.norm();
    println!(
        "in time {found:.6}, by its frequency {expected:.6}: off by {off:.1e} of {count} steps"
    );
    assert!((count - 4000.0).abs() < 0.5, "{count}");
    assert!(off < 2e-4, "{off:e}");
}

/// A cantilever of `EI = 1`, `ρA = 1`, `L = 1` under a force at its tip.
const CANTILEVER: &str = r#"
[model]
name = "cantilever"

[simulation]
step = 0.01
end = 1.0

[[beam]]
name = "rod"
points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
elements = 32
normal = [0.0, 0.0, 1.0]
section = { EA = 1e6, GA1 = 1e6, GA2 = 1e6, EI1 = 1.0, EI2 = 1.0, GJ = 1.0, rhoA = 1.0, rhoI1 = 1e-6, rhoI2 = 1e-6 }
start = "clamped"

[[load]]
name = "push"
body = "rod.end"
force = [0.0, 0.0, 1.0]

[[sensor]]
name = "tip"
type = "position"
of = "rod.end"
"#;

#[test]
fn a_damped_cantilever_answers_as_the_bar_of_bernoulli() {
    let folder = folder("cantilever");
    let rows = response(
        &folder,
        CANTILEVER,
        &["--input", "load.push", "--band", "0.1:5:30", "--rayleigh", "0:0.004"],
    );
    let mut worst = 0.0_f64;
    let largest = rows.iter().map(|(_, row)| row["tip.z"].norm()).fold(0.0, f64::max);
    for (omega, row) in &rows {
        let ei = C::new(1.0, 0.004 * omega);
        let k = (C::from(omega * omega) / ei).powf(0.25);
        let exact = (k.sin() * k.cosh() - k.cos() * k.sinh())
            / (1.0 + k.cos() * k.cosh())
            / (ei * k * k * k);
        worst = worst.max((row["tip.z"] - exact).norm() / largest);
    }
    println!(
        "cantilever: {} frequencies to 5 Hz, off by {worst:.1e} of the peak {largest:.4}",
        rows.len()
    );
    assert!(worst < 0.03 && largest > 3.0, "{worst:e}, {largest}");
}

#[test]
fn what_has_no_response_says_why() {
    let folder = folder("refusals");
    let refused = |model: &str, arguments: &[&str], code: i32, expected: [&str; 2]| {
        fs::write(folder.join("model.toml"), model).unwrap();
        let output = holonom(&folder, &[&["response", "model.toml"][..], arguments].concat());
        let text = words(&output);
        assert_eq!(output.status.code(), Some(code), "{text}");
        expected.iter().for_each(|word| assert!(text.contains(word), "{text}"));
    };
    let band = |input: &'static str| ["--input", input, "--band", "0:2:3"];
    refused(CHAIN, &band("load.none"), 2, ["no load `none`; there are: `push`", "load.NAME"]);
    refused(
        CHAIN,
        &band("unbalance.c.z=1"),
        2,
        ["node of a beam `c`; there are: `a`, `b`", "unbalance.BODY.z=U"],
    );
    refused(CHAIN, &band("bse.x"), 2, ["write load.NAME", "base.x"]);
    refused(CHAIN, &["--input", "base.x", "--band", "3:2:5"], 2, ["ends higher", "band"]);
    refused(
        CHAIN,
        &[&band("base.x")[..], &["--damping-ratio=-0.1"]].concat(),
        2,
        ["damping ratio", "0.02"],
    );
    refused(
        CHAIN,
        &[&band("base.x")[..], &["--at", "rotation"]].concat(),
        2,
        ["frame that rotates", "Floquet"],
    );
    let free = CHAIN.replace("spring = { stiffness = 200.0 }\n", "");
    refused(&free, &band("load.push"), 1, ["at 0 Hz the response is unbounded", "above 0 Hz"]);
    let blind = &CHAIN[..CHAIN.find("[[sensor]]").unwrap()];
    refused(blind, &band("load.push"), 2, ["nothing to tell", "[[sensor]]"]);
    let press = "[[load]]\nname = \"press\"\nbody = \"rod.end\"\nforce = [-5.0, 0.0, 0.0]\n";
    let pressed = format!("{CANTILEVER}\n{press}");
    let about = [&band("load.push")[..], &["--at", "static"]].concat();
    refused(&pressed, &about, 1, ["the state is unstable, in 2 modes", "smaller loads"]);
}
