//! Two rods on torsion springs under dead loads that grow: each turns unstable where its load is
//! `k/l`.

use super::{Known, Tables, check};
use vi_testkit::model::{AXES, body_at, head, hinge, part};

/// `k/l` of each, N.
const CRITICAL: [f64; 2] = [10.0, 24.0];
/// Of both loads in the end, N.
const LOAD: f64 = 40.0;

fn text() -> String {
    let mut text = head("rods", "step = 0.0625, end = 1.0, scheme = \"static\"");
    for (k, critical) in CRITICAL.into_iter().enumerate() {
        let (name, x, stiffness) = (format!("rod{k}"), k as f64, 2.0 * critical);
        text += &(body_at([x, 0.0, 1.0], &name, 1.0, [0.4, 0.4, 0.01])
            + &hinge(&format!("hinge{k}"), ["ground", &name], [x, 0.0, 0.0], AXES[1])
            + &format!("spring = {{ stiffness = {stiffness:?} }}\n")
            + &part("load", &format!("load{k}"))
            + &format!(
                "body = \"{name}\"\npoint = [0.0, 0.0, 1.0]\nforce = [0.0, 0.0, -{LOAD:?}]\n"
            ));
    }
    text
}

fn expected(t: &Tables, name: &str) -> Option<Known> {
    let count = |t: &f64| CRITICAL.iter().filter(|critical| LOAD * t > **critical).count() as f64;
    let times = t.column("residuals/t");
    (name == "residuals/unstable").then(|| Known::new(times.iter().map(count).collect(), 1e-9))
}

#[test]
fn columns_of_equilibria() {
    let tables = Tables::of("equilibria", &text());
    let found = tables.column("residuals/unstable");
    println!("{found:?}");
    assert!([0.0, 1.0, 2.0].iter().all(|count| found.contains(count)));
    let unseen = [
        ("trajectory/", "as in a motion"),
        ("residuals/step unknown", "as in a motion"),
        ("residuals/t unknown", "as in a motion"),
        ("residuals/position unknown", "rounding"),
        ("residuals/velocity unknown", "nothing moves"),
        ("residuals/momentum unknown", "nothing moves"),
        ("residuals/newton_iterations unknown", "a count of the method"),
    ];
    check(&tables, &expected, &unseen);
}
