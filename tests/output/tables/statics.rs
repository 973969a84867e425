//! Two rods on torsion springs under dead loads that grow: each turns unstable where its load is
//! `k/l`.

use super::{Known, Tables, check};

/// `k/l` of each, N.
const CRITICAL: [f64; 2] = [10.0, 24.0];
/// Of both loads in the end, N.
const LOAD: f64 = 40.0;

fn text() -> String {
    let mut text =
        "model = { name = \"rods\" }\nsimulation = { step = 0.0625, end = 1.0, scheme = \"static\" }\n".to_owned();
    for (k, critical) in CRITICAL.into_iter().enumerate() {
        let (x, stiffness) = (k as f64, 2.0 * critical);
        text += &format!(
            r#"
[[body]]
name = "rod{k}"
mass = 1.0
inertia = [0.4, 0.4, 0.01]
position = [{x:?}, 0.0, 1.0]
[[joint]]
name = "hinge{k}"
type = "revolute"
parent = "ground"
child = "rod{k}"
position = [{x:?}, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
spring = {{ stiffness = {stiffness:?} }}
[[load]]
name = "load{k}"
body = "rod{k}"
point = [0.0, 0.0, 1.0]
force = [0.0, 0.0, -{LOAD:?}]
"#
        );
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
