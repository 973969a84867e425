//! A free beam with material damping under a load at its end: nodes, strains, section forces,
//! energies.

use super::{Known, Tables, Vector, axis, check};
use holonom::nalgebra::{Matrix3, Rotation3};
use vi_testkit::model::{beam, damped_section, heavy, load, sensor};

const LENGTHS: [f64; 2] = [0.6, 0.5]; // of the legs, one element each
const STIFFNESS: [f64; 6] = [25.0, 40.0, 60.0, 0.4, 0.7, 0.3];
const TIMES: [f64; 6] = [1e-3, 2e-3, 3e-3, 5e-3, 4e-3, 6e-3];
const FORCE: [f64; 3] = [0.6, 0.9, -1.2];
const TORQUE: [f64; 3] = [0.05, -0.08, 0.06];
const VELOCITY: [f64; 3] = [0.4, -0.2, 0.9];
const SPIN: [f64; 3] = [0.7, 1.3, -0.5];
const CORNERS: [[f64; 3]; 3] = [[0.1, 0.2, 0.3], [0.7, 0.2, 0.3], [0.7, 0.6, 0.6]];
const NODES: [&str; 4] = ["beam.0", "beam.1", "beam.2", "beam.3"];
const RHO: [f64; 4] = [0.1, 1e-3, 2e-3, 3e-3];

fn text(settings: &str) -> String {
    let nodes = NODES.map(|node| {
        let name = node.replace('.', "_");
        sensor(&format!("v_{name}"), "velocity", node)
            + &sensor(&format!("w_{name}"), "angular_velocity", node)
    });
    let element = |kind: &str| sensor(kind, kind, "beam") + "element = 1\n";
    [
        heavy("beam", [0.3, -0.4, -0.9], &format!("step = 2.5e-4, end = 0.15, {settings}")),
        beam("beam", &CORNERS, 1) + "normal = [0.3, 0.2, 1.0]\nelement = \"mean_directors\"\n",
        format!("velocity = {VELOCITY:?}\nangular_velocity = {SPIN:?}\n"),
        damped_section(),
        load("pull", "beam.end", [FORCE, TORQUE]),
        nodes.concat(),
        element("strain"),
        element("section_force"),
        sensor("power", "power", "pull"),
    ]
    .concat()
}

/// `Γ` and `K` of an element between two nodes.
fn strain(t: &Tables, element: usize) -> Vec<[f64; 6]> {
    let [a, b] = [2 * element, 2 * element + 1].map(|k| NODES[k]);
    let places = [a, b].map(|node| t.vectors(&format!("trajectory/{node}")));
    let directors = [a, b].map(|node| t.directors(node));
    let length = LENGTHS[element];
    let own = |row: usize| -> [f64; 6] {
        let slope = (places[1][row] - places[0][row]) / length;
        let mean = 0.5 * (directors[0][row] + directors[1][row]);
        let change: Matrix3<f64> = (directors[1][row] - directors[0][row]) / length;
        let gamma = mean.transpose() * slope - Vector::z();
        // ½ ε_ijk d_k · d_j′
        let product = mean.transpose() * change;
        let half = |k: usize, j: usize| 0.5 * (product[(k, j)] - product[(j, k)]);
        [gamma.x, gamma.y, gamma.z, half(2, 1), half(0, 2), half(1, 0)]
    };
    let all: Vec<[f64; 6]> = (0..t.rows()).map(own).collect();
    // free of stress initially
    let first = all[0];
    all.iter().map(|e| std::array::from_fn(|i| e[i] - first[i])).collect()
}

fn elastic(t: &Tables) -> Vec<f64> {
    let strains = [0, 1].map(|element| strain(t, element));
    let energy = |row: usize| -> f64 {
        let one = |e: usize| {
            LENGTHS[e]
                * (0..6).map(|i| 0.5 * STIFFNESS[i] * strains[e][row][i].powi(2)).sum::<f64>()
        };
        one(0) + one(1)
    };
    (0..t.rows()).map(energy).collect()
}

fn member(node: &str) -> String {
    node.replace('.', "_")
}

/// Centre of the legs: consistent masses of straight lines.
fn kinetic_and_momenta(t: &Tables) -> (Vec<f64>, Vec<Vector>, Vec<Vector>, Vec<f64>) {
    let x = NODES.map(|node| t.vectors(&format!("trajectory/{node}")));
    let d = NODES.map(|node| t.directors(node));
    let v = NODES.map(|node| t.vectors(&format!("sensors/v_{}", member(node))));
    let w = NODES.map(|node| t.vectors(&format!("sensors/w_{}", member(node))));
    let [rho, i1, i2, i3] = RHO;
    let euler = [0.5 * (i2 + i3 - i1), 0.5 * (i1 + i3 - i2), 0.5 * (i1 + i2 - i3)];
    let gravity = Vector::new(0.3, -0.4, -0.9);
    let (mut kinetic, mut linear, mut angular, mut weight) = (vec![], vec![], vec![], vec![]);
    for n in 0..t.rows() {
        let (mut e, mut p, mut l, mut g) = (0.0, Vector::zeros(), Vector::zeros(), 0.0);
        for leg in 0..2 {
            let (a, b) = (2 * leg, 2 * leg + 1);
            // ∫ N_a N_b of linear functions: 1/3 and 1/6 of the length
            for (i, j, share) in
                [(a, a, 1.0 / 3.0), (b, b, 1.0 / 3.0), (a, b, 1.0 / 6.0), (b, a, 1.0 / 6.0)]
            {
                let m = LENGTHS[leg] * share;
                e += 0.5 * rho * m * v[i][n].dot(&v[j][n]);
                p += rho * m * v[j][n];
                l += rho * m * x[i][n].cross(&v[j][n]);
                g -= rho * m * gravity.dot(&x[j][n]);
                for (k, euler) in euler.iter().enumerate() {
                    let column = |node: usize| Vector::from(d[node][n].column(k));
                    let rate = |node: usize| w[node][n].cross(&column(node));
                    e += 0.5 * euler * m * rate(i).dot(&rate(j));
                    l += *euler * m * column(i).cross(&rate(j));
                }
            }
        }
        kinetic.push(e);
        linear.push(p);
        angular.push(l);
        weight.push(g);
    }
    (kinetic, linear, angular, weight)
}

fn entries(vectors: &[Vector], k: usize) -> Vec<f64> {
    vectors.iter().map(|vector| vector[k]).collect()
}

fn trajectory(t: &Tables, column: &str) -> Option<Known> {
    let (kinetic, linear, angular, weight) = kinetic_and_momenta(t);
    let total = || kinetic.iter().zip(&weight).zip(elastic(t)).map(|((a, b), c)| a + b + c);
    match column {
        "step" => return Some(Known::new((0..t.rows()).map(|k| k as f64).collect(), 1e-9)),
        "t" => return Some(Known::new((0..t.rows()).map(|k| k as f64 * t.h).collect(), 1e-14)),
        "H" => return Some(Known::new(total().collect(), 1e-9)),
        // of the step that begins at the node: to second order the mean of its ends
        "E" => {
            let own: Vec<f64> = total().collect();
            let next = own[1..].iter().copied().chain([f64::NAN]);
            return Some(Known::new(
                own.iter().zip(next).map(|(a, b)| 0.5 * (a + b)).collect(),
                2e-5,
            ));
        }
        _ => {}
    }
    let k = axis(column);
    let Some((node, part)) = column.rsplit_once('.') else {
        let of = if column.starts_with('P') { linear } else { angular };
        return Some(Known::new(entries(&of, k), 1e-9));
    };
    let number = NODES.iter().position(|name| *name == node)?;
    let corner = Vector::from(CORNERS[number.div_ceil(2)]);
    if part.len() == 1 {
        let rate = t.vectors(&format!("sensors/v_{}", member(node)));
        return Some(Known::new(t.integral(corner[k], &entries(&rate, k)), 5e-5));
    }
    let leg = number / 2;
    let tangent = (Vector::from(CORNERS[leg + 1]) - Vector::from(CORNERS[leg])).normalize();
    let normal = Vector::new(0.3, 0.2, 1.0);
    let d1 = (normal - normal.dot(&tangent) * tangent).normalize();
    let first = Matrix3::from_columns(&[d1, tangent.cross(&d1), tangent]);
    let turned = t.rotations(first, &t.vectors(&format!("sensors/w_{}", member(node))));
    let director = part[1..2].parse::<usize>().unwrap() - 1;
    Some(Known::new(turned.iter().map(|r| r[(k, director)]).collect(), 3e-5))
}

const STRAINS: [&str; 6] = ["Gamma1", "Gamma2", "Gamma3", "K1", "K2", "K3"];
const FORCES: [&str; 6] = ["N1", "N2", "N3", "M1", "M2", "M3"];

/// Index and whether it is a force.
fn component(part: &str) -> Option<(usize, bool)> {
    let strain = STRAINS.iter().position(|name| *name == part);
    strain
        .map(|i| (i, false))
        .or_else(|| Some((FORCES.iter().position(|name| *name == part)?, true)))
}

/// Alternately of both elements.
fn beams(t: &Tables, column: &str) -> Option<Known> {
    let rows = 2 * t.rows();
    let element = |row: usize| row % 2;
    let values: Vec<f64> = match column {
        "step" => (0..rows).map(|row| (row / 2) as f64).collect(),
        "t" => (0..rows).map(|row| (row / 2) as f64 * t.h).collect(),
        "element" => (0..rows).map(|row| element(row) as f64).collect(),
        "s" => (0..rows).map(|row| [0.3, 0.85][element(row)]).collect(),
        _ => {
            let (i, force) = component(column)?;
            let strains = [0, 1].map(|element| strain(t, element));
            let factor = if force { STIFFNESS[i] } else { 1.0 };
            (0..rows).map(|row| factor * strains[element(row)][row / 2][i]).collect()
        }
    };
    Some(Known::new(values, 1e-11))
}

fn sensors(t: &Tables, column: &str) -> Option<Known> {
    let (name, part) = column.split_once('.').unwrap_or((column, ""));
    if name == "power" {
        let (v, w) = (t.vectors("sensors/v_beam_3"), t.vectors("sensors/w_beam_3"));
        let power =
            v.iter().zip(&w).map(|(v, w)| Vector::from(FORCE).dot(v) + Vector::from(TORQUE).dot(w));
        return Some(Known::new(power.collect(), 1e-12));
    }
    if let Some((i, force)) = component(part) {
        let factor = if force { STIFFNESS[i] } else { 1.0 };
        return Some(Known::new(strain(t, 1).iter().map(|e| factor * e[i]).collect(), 1e-11));
    }
    let (kind, node) = name.split_once('_')?;
    let node = node.replace('_', ".");
    let k = axis(part);
    // differences of the coordinates
    let values = if kind == "v" {
        t.difference(&entries(&t.vectors(&format!("trajectory/{node}")), k))
    } else {
        let d = t.directors(&node);
        let inner = d.windows(3).map(|three| {
            let turn = Rotation3::from_matrix_eps(
                &(three[2] * three[0].transpose()),
                1e-14,
                100,
                Rotation3::identity(),
            );
            turn.scaled_axis()[k] / (2.0 * t.h)
        });
        [f64::NAN].into_iter().chain(inner).chain([f64::NAN]).collect()
    };
    let tolerance = if kind == "v" { 2e-4 } else { 1.5e-3 };
    Some(Known::new(values, tolerance))
}

fn energies(t: &Tables, column: &str) -> Option<Known> {
    let column_of = |name: &str| t.find(&format!("energy/{name}")).map(<[f64]>::to_vec);
    let works = ["work_of_material_damping", "work_of_algorithmic_dissipation", "work.pull"];
    let (kinetic, _, _, weight) = kinetic_and_momenta(t);
    let (values, tolerance) = match column {
        "kinetic" => (kinetic, 1e-10),
        "gravity" => (weight, 1e-10),
        "elastic" => (elastic(t), 1e-10),
        "total" => {
            let parts = ["kinetic", "gravity", "elastic"].map(|part| column_of(part).unwrap());
            ((0..t.rows()).map(|n| parts.iter().map(|part| part[n]).sum()).collect(), 1e-12)
        }
        "work.pull" => (t.integral(0.0, t.column("sensors/power")), 5e-6),
        "work_of_material_damping" => {
            let strains = [0, 1].map(|element| strain(t, element));
            let mut sum = 0.0;
            let step = |n: usize| {
                for (e, length) in LENGTHS.iter().enumerate() {
                    for i in 0..6 {
                        let rate = (strains[e][n][i] - strains[e][n - 1][i]) / t.h;
                        sum -= t.h * length * TIMES[i] * STIFFNESS[i] * rate * rate;
                    }
                }
                sum
            };
            ([0.0].into_iter().chain((1..t.rows()).map(step)).collect(), 1e-6)
        }
        "balance" => {
            let total = column_of("total").unwrap();
            let works: Vec<Vec<f64>> = works.iter().filter_map(|work| column_of(work)).collect();
            let left =
                |n: usize| total[n] - total[0] - works.iter().map(|work| work[n]).sum::<f64>();
            ((0..t.rows()).map(left).collect(), 1e-12)
        }
        _ => return None,
    };
    Some(Known::new(values, tolerance))
}

fn expected(t: &Tables, name: &str) -> Option<Known> {
    let (file, column) = name.split_once('/').unwrap();
    match file {
        "beams" => beams(t, column),
        "sensors" if !["step", "t"].contains(&column) => sensors(t, column),
        "energy" if !["step", "t"].contains(&column) => energies(t, column),
        "residuals" if column == "newton_iterations" => {
            let found = t.column("residuals/newton_iterations");
            let whole = |(k, x): (usize, &f64)| if k == 0 { 0.0 } else { x.round().max(1.0) };
            Some(Known::new(found.iter().enumerate().map(whole).collect(), 1e-4))
        }
        "residuals" if !["step", "t"].contains(&column) => {
            Some(Known::new(vec![0.0; t.rows()], 1e-4))
        }
        _ => trajectory(t, column),
    }
}

#[test]
fn columns_of_a_flexible_system() {
    let unseen = [
        ("beams/beam unknown", "a name"),
        ("residuals/position", "round-off"),
        ("residuals/velocity", "round-off"),
        ("residuals/momentum", "see the free body"),
    ];
    check(&Tables::of("flexible", &text("strain = \"averaged\"")), &expected, &unseen);
}

/// `−Σ ℓ C_i φ_i Δε_i` with a filter `(π_1, e_2, π_3)` of each strain by the midpoint rule in units
/// of the step: `Δe_2 = Δε − π̄_1/m_1`, `Δπ_3 = r (Δe_2 − π̄_3/m_3)`, `Δπ_1 = φ = ē_2/c_2 + Δπ_3`.
fn algorithmic_dissipation(t: &Tables) -> Vec<f64> {
    let [m1, c2, m3, r] = [3.0 / 40.0, 17.0 / 10.0, 1.0 / 5.0, 11.0 / 40.0];
    // rows: the three equations; columns: the new π_1, e_2, π_3
    let matrix = Matrix3::new(
        0.5 / m1,
        1.0,
        0.0, //
        0.0,
        -r,
        1.0 + 0.5 * r / m3, //
        1.0,
        -0.5 / c2,
        -1.0,
    );
    let solve = matrix.try_inverse().unwrap();
    let strains = [0, 1].map(|element| strain(t, element));
    let mut filters = [[Vector::zeros(); 6]; 2];
    let mut sum = 0.0;
    let step = |n: usize| {
        for (e, length) in LENGTHS.iter().enumerate() {
            for i in 0..6 {
                let change = strains[e][n][i] - strains[e][n - 1][i];
                let old = filters[e][i];
                let right = Vector::new(
                    change - 0.5 * old.x / m1 + old.y,
                    -r * old.y + (1.0 - 0.5 * r / m3) * old.z,
                    old.x + 0.5 * old.y / c2 - old.z,
                );
                let new = solve * right;
                sum -= length * STIFFNESS[i] * (new.x - old.x) * change;
                filters[e][i] = new;
            }
        }
        sum
    };
    [0.0].into_iter().chain((1..t.rows()).map(step)).collect()
}

#[test]
fn the_column_of_algorithmic_dissipation() {
    let tables = Tables::of("dissipative", &text("strain = \"dissipative\""));
    let found = tables.column("energy/work_of_algorithmic_dissipation");
    let values = algorithmic_dissipation(&tables);
    let last = values[values.len() - 1];
    println!("lost by the filters: {last:e} J");
    assert!(last < 0.0);
    let rows: Vec<String> = found.iter().map(f64::to_string).collect();
    let alone =
        Tables::alone("energy", &format!("work_of_algorithmic_dissipation\n{}", rows.join("\n")));
    check(&alone, &|_, _| Some(Known::new(values.clone(), 1e-6 * last.abs())), &[]);
}
