//! A ball that bounces on a spring with damping: its one coordinate tells the energies.

use super::{Known, Tables, check};
use vi_testkit::model::{body_at, head, part, sensor};

const STEPS: usize = 400;
const H: f64 = 2e-4;
const MASS: f64 = 2.0;
const RADIUS: f64 = 0.2;
/// `k`, `p`, `c`.
const LAW: [f64; 3] = [2e4, 1.25, 0.2];

fn text() -> String {
    let [k, p, c] = LAW;
    let model = format!(
        "model = {{ type = \"hunt_crossley\", stiffness = {k:?}, exponent = {p:?}, dissipation = {c:?} }}\n"
    );
    head("compliant", &format!("step = {H:?}, end = {:?}, contacts = true", H * STEPS as f64))
        + &body_at([0.0, 0.0, 0.19], "ball", MASS, [0.1; 3])
        + "velocity = [0.3, 0.0, -2.0]\n"
        + &format!("shape = {{ type = \"sphere\", dimensions = [{RADIUS:?}] }}\n")
        + &part("contact", "floor")
        + "a = { plane = {} }\nb = \"ball\"\n"
        + &model
        + &sensor("force", "contact_force", "floor")
        + &sensor("gap", "gap", "floor")
        + &sensor("slip", "slip", "floor")
        + &sensor("v", "velocity", "ball")
}

fn expected(tables: &Tables, name: &str, z: &[f64]) -> Option<Known> {
    let (file, column) = name.split_once('/')?;
    let known = |values: Vec<f64>, tolerance| Some(Known::new(values, tolerance));
    let v = tables.column("sensors/v.z");
    let [k, p, c] = LAW;
    let depth = |n: usize| (RADIUS - z[n]).max(0.0);
    let force = |n: usize| k * depth(n).powf(p) * (1.0 - c * v[n]).max(0.0);
    let stored = |n: usize| k * depth(n).powf(p + 1.0) / (p + 1.0);
    let kinetic = |n: usize| 0.5 * MASS * (0.09 + v[n] * v[n]);
    let all = |of: &dyn Fn(usize) -> f64| (0..=STEPS).map(of).collect::<Vec<f64>>();
    let touching = |of: &dyn Fn(usize) -> f64| -> Vec<f64> {
        (0..=STEPS).filter(|n| depth(*n) > 0.0).map(of).collect()
    };
    let lost = || {
        let power: Vec<f64> = all(&|n| v[n] * (force(n) - k * depth(n).powf(p)));
        tables.integral(0.0, &power)
    };
    match (file, column) {
        ("energy" | "sensors", "step") => known(all(&|n| n as f64), 1e-9),
        ("energy" | "sensors", "t") => known(all(&|n| n as f64 * H), 1e-12),
        ("energy", "kinetic") => known(all(&kinetic), 1e-9),
        ("energy", "contacts") => known(all(&stored), 1e-9),
        ("energy", "total") => known(all(&|n| kinetic(n) + stored(n)), 1e-9),
        ("energy", "work.floor") => known(lost(), 1e-4),
        ("energy", "balance") => known(all(&|_| 0.0), 1e-3),
        ("sensors", "gap") => known(all(&|n| z[n] - RADIUS), 1e-12),
        ("sensors", "slip") => known(all(&|n| if depth(n) > 0.0 { 0.3 } else { 0.0 }), 1e-9),
        ("sensors", "force.fz") => known(all(&force), 1e-6),
        ("sensors", "v.x") => known(all(&|_| 0.3), 1e-9),
        ("sensors", "v.z") => known(tables.difference(z), 5e-4),
        ("sensors", _) => known(all(&|_| 0.0), 1e-9),
        ("contacts", "step") => known(touching(&|n| n as f64), 1e-9),
        ("contacts", "t") => known(touching(&|n| n as f64 * H), 1e-12),
        ("contacts", "feature" | "nx" | "ny" | "y" | "tx" | "ty" | "tz") => {
            known(touching(&|_| 0.0), 1e-9)
        }
        ("contacts", "nz") => known(touching(&|_| 1.0), 1e-12),
        ("contacts", "x") => known(touching(&|n| 0.3 * n as f64 * H), 1e-9),
        ("contacts", "z") => known(touching(&|n| 0.5 * (z[n] - RADIUS)), 1e-9),
        ("contacts", "gap") => known(touching(&|n| z[n] - RADIUS), 1e-12),
        ("contacts", "normal") => known(touching(&force), 1e-6),
        ("contacts", "slip") => known(touching(&|_| 0.3), 1e-9),
        _ => None,
    }
}

#[test]
fn columns_of_a_compliant_contact() {
    let mut tables = Tables::of("compliant", &text());
    let still = "nothing moves or acts along it";
    let z = tables.column("trajectory/ball.z").to_vec();
    tables.keep(&["contacts", "energy", "sensors"]);
    let known = |tables: &Tables, name: &str| expected(tables, name, &z);
    check(
        &tables,
        &known,
        &[
            ("contacts/contact unknown", "a name"),
            ("contacts/a unknown", "a name"),
            ("contacts/b unknown", "a name"),
            ("contacts/state unknown", "a name"),
            ("contacts/unique unknown", "a name"),
            ("contacts/feature", "the same at all rows"),
            ("contacts/nx", still),
            ("contacts/ny", still),
            ("contacts/y", still),
            ("contacts/tx", still),
            ("contacts/ty", still),
            ("contacts/tz", still),
            ("contacts/nz late", "the same at all rows"),
            ("contacts/slip late", "the same at all rows"),
            ("energy/balance", "zero to the order of the step"),
            ("sensors/force.fx", still),
            ("sensors/force.fy", still),
            ("sensors/v.x late", "the same at all rows"),
            ("sensors/v.y", still),
        ],
    );
}
