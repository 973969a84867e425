//! What the sensors of the rigid system have to be.

use super::*;

/// What the sensors have to be.
pub(super) fn expected(t: &Tables, column: &str) -> Option<Known> {
    let rows = t.rows();
    let times = t.column("trajectory/t");
    if let Some((kind, name)) = column.split_once('_').filter(|(kind, _)| kind.len() == 1) {
        let (name, part) = name.split_once('.').unwrap();
        let k = "xyz".find(part).unwrap_or(0);
        let stated = if name == "ball" { Rigid { velocity: BALL[1], ..FREE } } else { body(name) };
        let of = |kind: &str| entries(&t.vectors(&format!("sensors/{kind}_{name}")), k);
        return match kind {
            "v" => Some(Known::new(t.integral(stated.velocity[k], &of("a")), 2e-4)),
            "w" => Some(Known::new(t.integral(stated.spin[k], &of("r")), 2e-4)),
            "a" => Some(Known::new(t.difference(&of("v")), 5e-4)),
            "r" => Some(Known::new(t.difference(&of("w")), 5e-4)),
            _ => {
                let quaternion = |d: &Matrix3<f64>| {
                    let q = holonom::nalgebra::UnitQuaternion::from_matrix(d);
                    let q = if q.w < 0.0 { -q.into_inner() } else { q.into_inner() };
                    [q.w, q.i, q.j, q.k]["wxyz".find(part).unwrap()]
                };
                Some(Known::new(t.directors(name).iter().map(quaternion).collect(), 1e-9))
            }
        };
    }
    let joint = |name: &str| t.column(&format!("sensors/{name}")).to_vec();
    let cord_rate = || t.difference(&lengths(t));
    let values = match column {
        "x.x" | "x.y" | "x.z" => {
            let arm = t.directors("free").into_iter().map(|d| d * Vector::from(POINT));
            let x: Vec<Vector> =
                t.vectors("trajectory/free").iter().zip(arm).map(|(x, a)| x + a).collect();
            return Some(Known::new(entries(&x, axis(column)), 1e-12));
        }
        "hinge_coordinate.u" => (t.integral(0.0, &joint("hinge_rate.u")), 1e-5),
        "hinge_coordinate.theta" => (t.integral(0.0, &joint("hinge_rate.theta")), 1e-5),
        "hinge_rate.u" => (t.integral(RATES[0], &joint("hinge_acceleration.u")), 1e-4),
        "hinge_rate.theta" => (t.integral(RATES[1], &joint("hinge_acceleration.theta")), 1e-4),
        "hinge_acceleration.u" => (t.difference(&joint("hinge_rate.u")), 2e-3),
        "hinge_acceleration.theta" => (t.difference(&joint("hinge_rate.theta")), 1e-3),
        "rail_coordinate" => (map(times, |t| path(t)[0]), 1e-9),
        "rail_rate" => (map(times, |t| path(t)[1]), 1e-4),
        "rail_acceleration" => (map(times, |t| path(t)[2]), 1e-3),
        "hinge_effort.spring" => {
            (map(&joint("hinge_coordinate.theta"), |a| -4.0 * (a - 0.3)), 1e-12)
        }
        "hinge_effort.damper" => (map(&joint("hinge_rate.u"), |v| -2.5 * v), 1e-12),
        "hinge_effort.motor" => (map(times, |t| 2.0 * (TAU * 1.3 * t + 0.4).sin()), 1e-12),
        "hinge_power.spring" => {
            (product(&joint("hinge_effort.spring"), &joint("hinge_rate.theta")), 1e-12)
        }
        "hinge_power.damper" => {
            (product(&joint("hinge_effort.damper"), &joint("hinge_rate.u")), 1e-12)
        }
        "hinge_power.motor" => {
            (product(&joint("hinge_effort.motor"), &joint("hinge_rate.theta")), 1e-12)
        }
        "cord_length" => (lengths(t), 1e-12),
        "cord_rate" => (cord_rate(), 1e-3),
        "cord_effort" => {
            let damper = map(&cord_rate(), |rate| 1.3 * rate);
            (sum(&[map(&lengths(t), |l| 8.0 * (l - 2.4)), damper]), 2e-3)
        }
        "cord_power" => (map(&product(&joint("cord_effort"), &joint("cord_rate")), |p| -p), 1e-12),
        "push_power" => {
            let (v, w) = (t.vectors("sensors/v_arm"), t.vectors("sensors/w_arm"));
            let power = t.directors("arm").into_iter().zip(v.iter().zip(&w)).map(|(d, (v, w))| {
                let v = v + w.cross(&(d * Vector::from(POINT)));
                (d * Vector::from(FORCE)).dot(&v) + (d * Vector::from(TORQUE)).dot(w)
            });
            (power.collect(), 1e-11)
        }
        // what the cart gains
        "drive_power" => {
            let (v, w) = (t.vectors("sensors/v_cart"), t.vectors("sensors/w_cart"));
            let (x, l) = (t.vectors("trajectory/cart"), spin(t, "cart"));
            let energy: Vec<f64> = (0..rows)
                .map(|k| {
                    let weight = -CART.mass * Vector::from(GRAVITY).dot(&x[k]);
                    0.5 * CART.mass * v[k].norm_squared() + 0.5 * l[k].dot(&w[k]) + weight
                })
                .collect();
            (t.difference(&energy), 2e-3)
        }
        "drive_effort.effort" => {
            let rate = joint("rail_rate");
            (joint("drive_power").iter().zip(&rate).map(|(p, v)| p / v).collect(), 1e-9)
        }
        "drive_effort.unique" | "reaction.unique" | "held.unique" => (vec![1.0; rows], 1e-6),
        _ => return reaction(t, column),
    };
    Some(Known::new(values.0, values.1))
}

/// Force and moment about the place of its joint that hold a body, by Newton and Euler.
fn held(t: &Tables, name: &str, at: [f64; 3]) -> [Vec<Vector>; 2] {
    let own = body(name);
    let a = t.vectors(&format!("sensors/a_{name}"));
    let spin = spin(t, name);
    let rate: Vec<Vec<f64>> = (0..3).map(|k| t.difference(&entries(&spin, k))).collect();
    let place = own.rotation().transpose() * (Vector::from(at) - Vector::from(own.center));
    let (mut forces, mut moments) = (Vec::new(), Vec::new());
    for (k, d) in t.directors(name).into_iter().enumerate() {
        let (push, turn) = match name {
            "arm" => {
                let push = d * Vector::from(FORCE);
                (push, d * Vector::from(TORQUE) + (d * Vector::from(POINT)).cross(&push))
            }
            // the drive acts about the axis
            _ => {
                let effort = t.column("sensors/drive_effort.effort")[k];
                (Vector::zeros(), effort * Vector::from(SCREW))
            }
        };
        let force = own.mass * (a[k] - Vector::from(GRAVITY)) - push;
        let total = Vector::new(rate[0][k], rate[1][k], rate[2][k]);
        moments.push(total - turn - (d * place).cross(&force));
        forces.push(force);
    }
    [forces, moments]
}

/// `(m_1, m_2, n)` of the ground.
pub(super) fn joint_axes(axis: [f64; 3], first: [f64; 3]) -> [Vector; 3] {
    let (n, m) = (Vector::from(axis), Vector::from(first).normalize());
    [m, n.cross(&m), n]
}

fn reaction(t: &Tables, column: &str) -> Option<Known> {
    let (sensor, part) = column.split_once('.')?;
    let k = axis(part);
    let which = usize::from(part.starts_with('m'));
    let values = match sensor {
        "reaction" => entries(&held(t, "cart", RAIL)[which], k),
        _ if k == 2 => vec![0.0; t.rows()],
        _ => {
            let along = joint_axes(ALONG, FIRST_ACROSS)[k];
            held(t, "arm", HINGE)[which].iter().map(|held| along.dot(held)).collect()
        }
    };
    Some(Known::new(values, 8e-4))
}
