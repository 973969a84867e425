//! The table of a sweep: a point mass on a spring without length under a constant force, by the
//! closed form of its steps.

use super::{Known, Tables, check};
use holonom::model::Meshes;
use holonom::sweep::{Plan, Shard, Sweep, SweepDescription, collect, run_point};
use vi_testkit::model::{between, head, part, particle, sensor};

const STIFFNESS: f64 = 50.0;
const FORCE: f64 = 12.0;
const START: [f64; 2] = [0.7, -0.4];
const STEP: f64 = 0.02;
const MASSES: [f64; 3] = [1.0, 2.5, 4.0];
const ENDS: [f64; 2] = [0.9, 1.3];

fn text() -> String {
    [
        head("sweep", &format!("step = {STEP:?}, end = 1.0")),
        particle("ball", 1.0, [START[0], START[1], 0.0]),
        between("spring", "cord", ["ground", "ball"]),
        format!("stiffness = {STIFFNESS:?}\nnatural_length = 0.0\n"),
        part("load", "pull") + &format!("body = \"ball\"\nforce = [{FORCE:?}, 0.0, 0.0]\n"),
        sensor("place", "position", "ball"),
    ]
    .concat()
}

/// Place, linear and angular momentum at all nodes of a point: rotations by `2 atan(h ω/2)` about
/// the equilibrium.
fn motion(mass: f64, end: f64) -> Vec<[f64; 5]> {
    let angle = 2.0 * (0.5 * STEP * (STIFFNESS / mass).sqrt()).atan();
    let still = FORCE / STIFFNESS;
    let (a, b, size) = (START[0] - still, START[1], (mass * STIFFNESS).sqrt());
    let node = |n: usize| {
        let (sin, cos) = (angle * n as f64).sin_cos();
        let (x, y, p, q) = (still + a * cos, b * cos, -size * a * sin, -size * b * sin);
        [x, y, p, q, x * q - y * p]
    };
    (0..=(end / STEP).round() as usize).map(node).collect()
}

fn expected(_: &Tables, name: &str) -> Option<Known> {
    let column = name.strip_prefix("sweep/")?;
    let points: Vec<(f64, f64)> =
        MASSES.iter().flat_map(|mass| ENDS.map(|end| (*mass, end))).collect();
    let of = |value: &dyn Fn(&[[f64; 5]]) -> f64| -> Vec<f64> {
        points.iter().map(|(mass, end)| value(&motion(*mass, *end))).collect()
    };
    let extreme = |k: usize, f: fn(f64, f64) -> f64| {
        of(&|nodes| nodes.iter().map(|node| node[k]).reduce(f).unwrap())
    };
    let energy = 0.5 * STIFFNESS * (START[0] * START[0] + START[1] * START[1]);
    let work = |nodes: &[[f64; 5]]| FORCE * (nodes[nodes.len() - 1][0] - START[0]);
    let values = match column {
        "point" => (0..6).map(f64::from).collect(),
        "particle.ball.mass" => points.iter().map(|point| point.0).collect(),
        "simulation.end" => points.iter().map(|point| point.1).collect(),
        "steps" => of(&|nodes| (nodes.len() - 1) as f64),
        "energy.initial" => vec![energy; 6],
        "energy.final" => of(&|nodes| energy + work(nodes)),
        "energy.work" => of(&work),
        "energy.max_abs_error" => of(&|nodes| {
            nodes.iter().map(|node| (FORCE * (node[0] - START[0])).abs()).fold(0.0, f64::max)
        }),
        "momentum.linear.max_abs_drift" => of(&|nodes| {
            nodes.iter().map(|node| node[2].abs().max(node[3].abs())).fold(0.0, f64::max)
        }),
        "momentum.angular.max_abs_drift" => {
            of(&|nodes| nodes.iter().map(|node| node[4].abs()).fold(0.0, f64::max))
        }
        "energy.balance_error" | "constraint_residual.position.max" => vec![0.0; 6],
        "place.x.min" => extreme(0, f64::min),
        "place.x.max" => extreme(0, f64::max),
        "place.x.last" => of(&|nodes| nodes[nodes.len() - 1][0]),
        "place.y.min" => extreme(1, f64::min),
        "place.y.max" => extreme(1, f64::max),
        "place.y.last" => of(&|nodes| nodes[nodes.len() - 1][1]),
        "place.z.min" | "place.z.max" | "place.z.last" => vec![0.0; 6],
        _ => return None,
    };
    Some(Known::new(values, 1e-9))
}

#[test]
fn columns_of_a_sweep() {
    let list = |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
    let vary = [
        format!("particle.ball.mass={}", list(&MASSES)),
        format!("simulation.end={}", list(&ENDS)),
    ];
    let plan = Plan::grid(vary.iter().map(|vary| vary.parse().unwrap()).collect()).unwrap();
    let description = SweepDescription { model: text(), meshes: vec![], set: vec![], plan };
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("tables").join("sweep");
    let sweep = Sweep::new(description, &folder, Shard::WHOLE, true).unwrap();
    let work = |point: &holonom::sweep::SweepPoint<'_>| {
        run_point(&text(), &Meshes::default(), point, &mut || false)
    };
    sweep.run(&work, &mut |_| {}).unwrap();
    collect(&folder).unwrap();
    let table = std::fs::read_to_string(folder.join("sweep.csv")).unwrap();
    println!("{table}");
    let unseen = [
        ("sweep/status unknown", "a word"),
        ("sweep/newton_iterations.mean unknown", "see the files of a run"),
        ("sweep/energy.initial late", "that of the start, whatever the mass"),
        ("sweep/energy.balance_error", "round-off of a linear system"),
        ("sweep/constraint_residual.position.max", "no constraints"),
        ("sweep/place.x.max late", "that of the start, whatever the mass"),
        ("sweep/place.y.min late", "that of the start, whatever the mass"),
        ("sweep/place.z", "in a plane"),
    ];
    check(&Tables::alone("sweep", &table), &expected, &unseen);
}
