//! What the momenta and multipliers of the rigid system have to be.

use super::sensors::joint_axes;
use super::*;

/// Momenta of a member, in the order of its coordinates.
fn momentum(t: &Tables, name: &str, part: &str) -> Vec<f64> {
    if let Some(k) = "xyz".find(part) {
        let mass = if name == "ball" { 0.6 } else { body(name).mass };
        return map(&entries(&t.vectors(&format!("sensors/v_{name}")), k), |v| mass * v);
    }
    let director = part[1..2].parse::<usize>().unwrap() - 1;
    let weight = euler(&body(name))[director];
    let w = t.vectors(&format!("sensors/w_{name}"));
    let rates = t.directors(name).into_iter().zip(&w);
    rates.map(|(d, w)| weight * w.cross(&Vector::from(d.column(director)))[axis(part)]).collect()
}

/// What the momenta have to be.
pub(super) fn expected(t: &Tables, column: &str) -> Option<Known> {
    let (kind, rest) = column.split_once('.').unwrap_or((column, ""));
    let energy = |kind: &str| t.column(&format!("momenta/{kind}")).to_vec();
    match (kind, rest) {
        ("p", _) => {
            let (name, part) = rest.split_once('.')?;
            Some(Known::new(momentum(t, name, part), if part.len() == 1 { 2e-5 } else { 1e-5 }))
        }
        ("p_projected", _) => {
            let (name, part) = rest.split_once('.')?;
            Some(Known::new(momentum(t, name, part), 1e-10))
        }
        ("p_reduced", _) => reduced(t, rest),
        ("lambda", _) => multiplier(t, rest),
        ("E_d", "kinetic") => Some(Known::new(step_energy(t), 1e-9)),
        // in the middle of the step
        ("E_d", _) | ("H_d" | "H_d_projected", "potential") => {
            let at = sum(&[gravity(t), springs(t)]);
            if kind != "E_d" {
                return Some(Known::new(at, 1e-10));
            }
            let next = at[1..].iter().copied().chain([f64::NAN]);
            Some(Known::new(at.iter().zip(next).map(|(a, b)| 0.5 * (a + b)).collect(), 5e-4))
        }
        ("H_d", "kinetic") => Some(Known::new(energy("H_d_projected.kinetic"), 1e-4)),
        ("H_d_projected", "kinetic") => Some(Known::new(kinetic(t), 1e-10)),
        _ => None,
    }
}

/// `½ Δqᵀ M Δq / h²`.
fn step_energy(t: &Tables) -> Vec<f64> {
    let mut all = Vec::new();
    let one = |vectors: Vec<Vector>, mass: f64| -> Vec<f64> {
        let steps =
            vectors.windows(2).map(|pair| 0.5 * mass * ((pair[1] - pair[0]) / t.h).norm_squared());
        steps.chain([f64::NAN]).collect()
    };
    for (x, _, mass) in members(t) {
        all.push(one(x, mass));
    }
    for name in BODIES {
        for (director, weight) in euler(&body(name)).into_iter().enumerate() {
            let d = t.directors(name).iter().map(|d| d.column(director).into()).collect();
            all.push(one(d, weight));
        }
    }
    sum(&all)
}

/// Momenta of the rates of the spanning tree: along and about the axis of a joint, of a free body
/// its own.
fn reduced(t: &Tables, column: &str) -> Option<Known> {
    let (name, k) = column.split_once('.')?;
    let k: usize = k.parse::<usize>().ok()? - 1;
    let about = |name: &str, at: [f64; 3], axis: [f64; 3]| -> [Vec<f64>; 2] {
        let (x, v) =
            (t.vectors(&format!("trajectory/{name}")), t.vectors(&format!("sensors/v_{name}")));
        let (mass, own, axis) = (body(name).mass, spin(t, name), Vector::from(axis));
        let along = v.iter().map(|v| mass * axis.dot(v)).collect();
        let moment = |(x, v): (&Vector, &Vector)| mass * (x - Vector::from(at)).cross(v);
        let about = x.iter().zip(&v).map(moment).zip(&own).map(|(m, own)| axis.dot(&(m + own)));
        [along, about.collect()]
    };
    let values = match name {
        "hinge" => about("arm", HINGE, ALONG)[k].clone(),
        "rail" => {
            let [along, turn] = about("cart", RAIL, SCREW);
            sum(&[map(&along, |p| PITCH / TAU * p), turn])
        }
        "ball" => {
            entries(&t.vectors("sensors/v_ball").iter().map(|v| 0.6 * v).collect::<Vec<_>>(), k)
        }
        _ if k < 3 => momentum(t, "free", ["x", "y", "z"][k]),
        _ => entries(&spin(t, "free"), k - 3),
    };
    Some(Known::new(values, 1e-9))
}

/// Known but for the first node, whose multipliers are those of (47).
fn later(mut values: Vec<f64>) -> Known {
    values[0] = f64::NAN;
    Known::new(values, 1e-9)
}

/// Multipliers of the free body, `E_I Δ²d_I / h² = −Gᵀ λ`, of the drive and the joints.
fn multiplier(t: &Tables, column: &str) -> Option<Known> {
    let (name, k) = column.split_once('.')?;
    let k: usize = k.parse::<usize>().ok()? - 1;
    let sensor = |name: &str| t.column(&format!("sensors/{name}")).to_vec();
    match (name, k) {
        ("free", _) => {
            let (weights, directors) = (euler(&FREE), t.directors("free"));
            // d_1·d_1, d_2·d_2, d_3·d_3, then the pairs
            let (i, j) = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)][k];
            let acting = |i: usize, j: usize| -> Vec<f64> {
                let inner = directors.windows(3).map(|three| {
                    let second = (three[2].column(i) - 2.0 * three[1].column(i)
                        + three[0].column(i))
                        / (t.h * t.h);
                    -weights[i] * second.dot(&three[1].column(j))
                });
                [f64::NAN].into_iter().chain(inner).chain([f64::NAN]).collect()
            };
            Some(Known::new(acting(i, j), 1e-7))
        }
        ("drive", _) => Some(later(map(&sensor("drive_effort.effort"), |e| -e))),
        ("hinge" | "rail", _) => {
            let (axes, reaction, angle) = match name {
                "hinge" => (None, "held", "hinge_coordinate.theta"),
                _ => (Some(joint_axes(SCREW, ACROSS)), "reaction", "rail_coordinate"),
            };
            let six = ["fx", "fy", "fz", "mx", "my", "mz"]
                .map(|part| sensor(&format!("{reaction}.{part}")));
            let angle = sensor(angle);
            let one = |n: usize| {
                let [f, m] = [0, 3]
                    .map(|first| Vector::new(six[first][n], six[first + 1][n], six[first + 2][n]));
                let [f, m] = [f, m]
                    .map(|x| axes.map_or(x, |axes| Vector::from(axes.map(|axis| axis.dot(&x)))));
                let (sin, cos) = angle[n].sin_cos();
                // moments about the axes m_1', m_2' of the body
                [-f.x, -f.y, cos * m.y - sin * m.x, -cos * m.x - sin * m.y, -f.z][k]
            };
            Some(later((0..t.rows()).map(one).collect()))
        }
        _ => None,
    }
}

/// `|G M⁻¹ p|_∞` of a free body, with `p` of (34).
pub(super) fn off_manifold(t: &Tables) -> Vec<f64> {
    let (d, weights) = (t.directors("free"), euler(&FREE));
    let p = [1, 2, 3].map(|i| t.vectors(&format!("momenta/p.free.d{i}")));
    let v = |i: usize, n: usize| p[i][n] / weights[i];
    let row = |n: usize, i: usize, j: usize| match i == j {
        true => d[n].column(i).dot(&v(i, n)).abs(),
        false => (d[n].column(i).dot(&v(j, n)) + d[n].column(j).dot(&v(i, n))).abs(),
    };
    let pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
    let worst = |n| pairs.iter().map(|(i, j)| row(n, *i, *j)).fold(0.0, f64::max);
    (0..t.rows()).map(worst).collect()
}
