//! Small vibrations of two bodies on damped torsion springs about axes of their own:
//! `I λ² + c λ + k = 0`.

use super::{Known, Tables, Vector, axis, check};
use holonom::Model;
use holonom::modes::{About, Campbell, ModalAnalysis};
use std::f64::consts::TAU;
use vi_testkit::model::{body_at, head, hinge};

/// Place, axis, stiffness, damping; the bodies are turned by nothing, 2 kg, with these moments.
const HINGES: [([f64; 3], [f64; 3], f64, f64); 2] = [
    ([0.1, 0.2, -0.3], [0.48, 0.6, 0.64], 30.0, 0.9),
    ([1.2, -0.4, 0.5], [0.64, 0.48, 0.6], 90.0, 0.4),
];
const CENTERS: [[f64; 3]; 2] = [[0.9, 0.5, 0.4], [2.0, 0.1, -0.6]];
const MOMENTS: [f64; 3] = [0.3, 0.5, 0.6];

fn text() -> String {
    let mut text = head("modes", "step = 1e-3, end = 1.0");
    for (k, (at, along, stiffness, damping)) in HINGES.into_iter().enumerate() {
        let (name, center) = (format!("b{k}"), CENTERS[k]);
        text += &(body_at(center, &name, 2.0, MOMENTS)
            + &hinge(&format!("j{k}"), ["ground", &name], at, along)
            + &format!(
                "spring = {{ stiffness = {stiffness:?} }}\ndamper = {{ damping = {damping:?} }}\n"
            ));
    }
    text
}

/// Decay, `ω²`, and the velocity of the centre for a rate of 1 rad/s, of a body.
fn mode(k: usize) -> (f64, f64, Vector) {
    let (at, along, stiffness, damping) = HINGES[k];
    let n = Vector::from(along);
    let moved = n.cross(&(Vector::from(CENTERS[k]) - Vector::from(at)));
    let own: f64 = (0..3).map(|i| MOMENTS[i] * n[i] * n[i]).sum();
    let inertia = own + 2.0 * moved.norm_squared();
    let decay = 0.5 * damping / inertia;
    (decay, stiffness / inertia - decay * decay, moved)
}

fn expected(t: &Tables, name: &str) -> Option<Known> {
    let column = name.strip_prefix("modes/")?;
    // the slower one first; a row for each mode and body
    let order = if mode(0).1 < mode(1).1 { [0, 1] } else { [1, 0] };
    let row = |row: usize| (order[row / 2], row % 2);
    let of = |value: &dyn Fn(f64, f64) -> f64| -> Vec<f64> {
        (0..4)
            .map(|n| {
                let (decay, squared, _) = mode(row(n).0);
                value(decay, squared)
            })
            .collect()
    };
    let values = match column {
        "mode" => vec![1.0, 1.0, 2.0, 2.0],
        "omega_squared" => of(&|_, squared| squared),
        "frequency" => of(&|_, squared| squared.sqrt() / TAU),
        "decay" => of(&|decay, _| decay),
        "damping_ratio" => of(&|decay, squared| decay / (squared + decay * decay).sqrt()),
        "ux_before" | "uy_before" | "uz_before" | "rx_before" | "ry_before" | "rz_before" => {
            vec![0.0; 4]
        }
        _ if column.len() == 2 => {
            let k = axis(column);
            // a mode has no sign: that of another rotation
            let other = t.column(if column == "ry" { "modes/rx" } else { "modes/ry" });
            let entry = |n: usize| {
                let (mode_of, body) = row(n);
                let moved = mode(mode_of).2;
                let size = other[n].signum() / moved.norm();
                let own =
                    if column.starts_with('u') { moved } else { Vector::from(HINGES[mode_of].1) };
                if mode_of == body { size * own[k] } else { 0.0 }
            };
            (0..4).map(entry).collect()
        }
        _ => return None,
    };
    Some(Known::new(values, 1e-9))
}

#[test]
fn columns_of_modes() {
    let model = Model::from_toml(&text()).unwrap();
    let report = ModalAnalysis::new(&model, About::Start).unwrap().modes(2).unwrap();
    let unseen = [
        ("modes/kind unknown", "a word"),
        ("modes/member unknown", "a name"),
        ("modes/ux_before", "bodies that are not coupled have no phase"),
        ("modes/uy_before", "likewise"),
        ("modes/uz_before", "likewise"),
        ("modes/rx_before", "likewise"),
        ("modes/ry_before", "likewise"),
        ("modes/rz_before", "likewise"),
    ];
    println!("{}", report.csv());
    check(&Tables::alone("modes", &report.csv()), &expected, &unseen);
}

const DISK: &str = include_str!("../../models/damped_disk.toml");
const SPEEDS: [f64; 3] = [2.0, 4.0, 6.0];

fn whirls(_: &Tables, name: &str) -> Option<Known> {
    let decay = 3.0 / (2.0 * 2.0);
    let own = (200.0 / 2.0_f64 - decay * decay).sqrt();
    let rows =
        SPEEDS.into_iter().flat_map(|speed| [(speed, 1, own - speed), (speed, 2, own + speed)]);
    let value = |(speed, mode, omega): (f64, u32, f64)| match name {
        "campbell/speed" => Some(speed),
        "campbell/mode" => Some(f64::from(mode)),
        "campbell/omega" => Some(omega),
        "campbell/frequency" => Some(omega / TAU),
        "campbell/decay" => Some(decay),
        "campbell/damping_ratio" => Some(decay / omega.hypot(decay)),
        _ => None,
    };
    Some(Known::new(rows.map(value).collect::<Option<Vec<f64>>>()?, 1e-7))
}

#[test]
fn columns_of_whirls_over_the_speed() {
    let model = Model::from_toml(DISK).unwrap();
    let text = Campbell::new(&model, &SPEEDS, 2).unwrap().csv();
    println!("{text}");
    let unseen = [("campbell/decay late", "both whirls decay alike, at all speeds")];
    check(&Tables::alone("campbell", &text), &whirls, &unseen);
}
