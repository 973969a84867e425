//! Sensors: points, observers, distances, axes of reactions, places on beams; against the motion
//! that the other files state.

use super::{Case, Checks, Run};
use holonom::nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use vi_testkit::model::{FIRST, Rigid, SECOND, heavy, hinge, sensor};

type Vector = Vector3<f64>;

const POINT: [f64; 3] = [0.1, -0.3, 0.2];
const OTHER: [f64; 3] = [-0.2, 0.1, 0.4];

/// Of a free body, as it is and as another one sees it.
fn observed() -> Case {
    let third = Rigid {
        center: [2.0, -1.0, 0.5],
        turned: [0.9, 0.1, 0.2],
        spin: [0.2, 0.2, 0.9],
        ..SECOND
    };
    let at = format!("point = {POINT:?}\n");
    let seen = "seen_from = \"second\"\n";
    let far = format!("to = \"second\"\npoint = {POINT:?}\npoint_to = {OTHER:?}\n");
    let one = |name: &str, kind: &str, more: &str| sensor(name, kind, "first") + more;
    let text = format!(
        "model = {{ name = \"observed\", gravity = [1.0, -2.0, -5.0] }}\nsimulation = {{ step = 1e-3, end = 2e-3 }}\n{}{}{}{}",
        FIRST.text("first"),
        SECOND.text("second"),
        third.text("third"),
        [
            one("x", "position", &at),
            one("v", "velocity", &at),
            one("a", "acceleration", &at),
            one("q", "orientation", ""),
            one("w", "angular_velocity", ""),
            one("r", "angular_acceleration", ""),
            one("seen_x", "position", &(at.clone() + seen)),
            one("seen_v", "velocity", &(at.clone() + seen)),
            one("seen_q", "orientation", seen),
            one("seen_w", "angular_velocity", seen),
            one("d", "distance", &far),
            one("dd", "distance_rate", &far),
            one("unit", "imu", &at),
            one("by_quaternion", "imu", "quaternion = [0.5, -0.5, 0.5, 0.5]\n"),
            one("by_vector", "imu", "rotation_vector = [0.3, -0.5, 0.9]\n"),
            one(
                "by_matrix",
                "imu",
                "matrix = [[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]]\n"
            ),
            one("by_angles", "imu", "euler = { sequence = \"zx\", angles = [0.4, -1.1] }\n"),
            one("by_degrees", "imu", "euler = { sequence = \"yz\", degrees = [40.0, -65.0] }\n"),
            "[[sensor]]\nname = \"mixed\"\ntype = \"expression\"\n\
             value = \"2*a.x - 3*d*first.wy + second.vz + 0.7*t\"\n\
             [[sensor]]\nname = \"number\"\ntype = \"expression\"\nvalue = 1.25\n"
                .to_owned(),
        ]
        .concat()
    );
    Case::new("observed body", text, |run| {
        let mut checks = Checks::default();
        let (w1, w2) = (Vector::from(FIRST.spin), Vector::from(SECOND.spin));
        let (x, v) = (FIRST.place(POINT), FIRST.rate(POINT));
        let [_, r] = FIRST.accelerations(POINT, Vector::zeros(), Vector::zeros());
        let arm = FIRST.arm(POINT);
        let a = Vector::new(1.0, -2.0, -5.0) + r.cross(&arm) + w1.cross(&w1.cross(&arm));
        checks.vector("position", run.vector("x", 0), x, 1e-12);
        checks.vector("velocity", run.vector("v", 0), v, 1e-12);
        checks.vector("acceleration", run.vector("a", 0), a, 1e-9);
        checks.matrix("orientation", run.rotation("q", 0), FIRST.rotation(), 1e-12);
        checks.vector("angular velocity", run.vector("w", 0), w1, 1e-12);
        checks.vector("angular acceleration", run.vector("r", 0), r, 1e-9);
        let (back, center) = (SECOND.rotation().transpose(), Vector::from(SECOND.center));
        checks.vector("seen position", run.vector("seen_x", 0), back * (x - center), 1e-12);
        let relative = v - Vector::from(SECOND.velocity) - w2.cross(&(x - center));
        checks.vector("seen velocity", run.vector("seen_v", 0), back * relative, 1e-12);
        checks.matrix(
            "seen orientation",
            run.rotation("seen_q", 0),
            back * FIRST.rotation(),
            1e-12,
        );
        checks.vector("seen rotation", run.vector("seen_w", 0), back * (w1 - w2), 1e-12);
        let line = SECOND.place(OTHER) - x;
        checks.near("distance", run.sensor("d", 0), line.norm(), 1e-12);
        let rate = line.normalize().dot(&(SECOND.rate(OTHER) - v));
        checks.near("its rate", run.sensor("dd", 0), rate, 1e-12);
        let unit = |parts: [&str; 3]| {
            Vector::from(parts.map(|part| run.sensor(&format!("unit.{part}"), 0)))
        };
        let own = FIRST.rotation().transpose();
        let felt = own * (a - Vector::new(1.0, -2.0, -5.0));
        checks.vector("felt acceleration", unit(["ax", "ay", "az"]), felt, 1e-9);
        checks.vector("felt rotation", unit(["gx", "gy", "gz"]), own * w1, 1e-12);
        let about = |axis: Vector, angle: f64| Rotation3::new(angle * axis).into_inner();
        let (x, y, z) = (Vector::x(), Vector::y(), Vector::z());
        // the first takes x to −z, y to −x, z to y
        let axes = [
            ("by_quaternion", Matrix3::from_columns(&[-z, -x, y])),
            ("by_vector", Rotation3::new(Vector::new(0.3, -0.5, 0.9)).into_inner()),
            ("by_matrix", Matrix3::new(0.6, -0.8, 0.0, 0.8, 0.6, 0.0, 0.0, 0.0, 1.0)),
            ("by_angles", about(z, 0.4) * about(x, -1.1)),
            ("by_degrees", about(y, 40.0_f64.to_radians()) * about(z, -65.0_f64.to_radians())),
        ];
        for (name, axes) in axes {
            let seen = ["gx", "gy", "gz"].map(|c| run.sensor(&format!("{name}.{c}"), 0));
            let spin = axes.transpose() * own * w1;
            checks.vector(name, Vector::from(seen), spin, 1e-12);
            // nothing is felt at the centre of a body that falls
            let felt = ["ax", "ay", "az"].map(|c| run.sensor(&format!("{name}.{c}"), 0));
            checks.vector(name, Vector::from(felt), Vector::zeros(), 1e-9);
        }
        let mixed = 2.0 * a.x - 3.0 * line.norm() * w1.y + SECOND.velocity[2];
        checks.near("number", run.sensor("number", 1), 1.25, 1e-12);
        checks.near("mixed", run.sensor("mixed", 0), mixed, 1e-8);
        let later = 2.0 * run.sensor("a.x", 1) - 3.0 * run.sensor("d", 1) * run.sensor("w.y", 1);
        let own = later - 2.0 * a.x + 3.0 * line.norm() * w1.y + 0.7 * run.t(1);
        checks.near("mixed later", run.sensor("mixed", 1) - run.sensor("mixed", 0), own, 0.02);
        checks
    })
    .only("sensor")
}

/// A body on a hinge of a free one: the reaction along three pairs of axes, the joint coordinate
/// and its rates.
fn reactions() -> Case {
    let (at, axis, across) = ([0.1, 0.5, 0.2], [0.0, 0.6, 0.8], [1.0, 0.0, 0.0]);
    let base = Rigid { spin: [0.5, 0.9, -2.6], ..FIRST };
    let axes = |frame: &str| sensor(frame, "reaction", "hinge") + &format!("frame = \"{frame}\"\n");
    let text = [
        heavy("reactions", [1.0, -2.0, -5.0], "step = 1e-3, end = 0.15"),
        base.text("base"),
        SECOND.still("arm"),
        hinge("hinge", ["base", "arm"], at, axis),
        format!("first_axis = {across:?}\nrate = 4.0\n"),
        ["parent", "child", "space"].map(axes).concat(),
        sensor("q1", "orientation", "base"),
        sensor("q2", "orientation", "arm"),
        sensor("a", "acceleration", "arm"),
        sensor("angle", "joint_coordinate", "hinge"),
        sensor("rate", "joint_rate", "hinge"),
        sensor("acceleration", "joint_acceleration", "hinge"),
    ]
    .concat();
    Case::new("axes of reactions", text, move |run| {
        let mut checks = Checks::default();
        let (n, m) = (Vector::from(axis), Vector::from(across));
        let joint = Matrix3::from_columns(&[m, n.cross(&m), n]);
        for node in [0, 50, run.last() - 1] {
            let force = SECOND.mass * (run.vector("a", node) - Vector::new(1.0, -2.0, -5.0));
            let [parent, child] = [("q1", FIRST.rotation()), ("q2", SECOND.rotation())]
                .map(|(q, initial)| run.rotation(q, node) * initial.transpose() * joint);
            let found = |name: &str| {
                Vector::from(["fx", "fy", "fz"].map(|c| run.sensor(&format!("{name}.{c}"), node)))
            };
            let tolerance = 1e-3 * force.norm();
            checks.vector("parent", found("parent"), parent.transpose() * force, tolerance);
            checks.vector("child", found("child"), child.transpose() * force, tolerance);
            checks.vector("space", found("space"), force, tolerance);
        }
        let (angle, rate) = (run.column("angle"), run.column("rate"));
        let acceleration = run.column("acceleration");
        for node in 1..run.last() {
            let h2 = run.t(node + 1) - run.t(node - 1);
            checks.near("rate", rate[node], (angle[node + 1] - angle[node - 1]) / h2, 1e-3);
            checks.near(
                "acceleration",
                acceleration[node],
                (rate[node + 1] - rate[node - 1]) / h2,
                0.05,
            );
        }
        let turned = run.rotation("q1", run.last()).transpose() * run.rotation("q2", run.last());
        let initial = FIRST.rotation().transpose() * SECOND.rotation();
        let own = Rotation3::from_matrix_unchecked(turned * initial.transpose());
        let expected = UnitQuaternion::from_rotation_matrix(&own).angle();
        checks.near("angle", angle[run.last()], expected, 1e-9);
        checks
    })
    .only("sensor")
    .blind("sensor.frame dropped", "of one along the axes of the parent, the default")
}

/// Strains and section forces at an arc length of a beam with two legs, between the middles of its
/// elements.
fn places() -> Case {
    let beam = |name: &str, y: f64| {
        format!(
            "[[beam]]\nname = \"{name}\"\npoints = [[0.0, {y:?}, 0.0], [0.6, {y:?}, 0.0], [0.6, {:?}, 0.3]]\nelements = 4\nelement = \"mean_directors\"\nnormal = [0.0, 0.0, 1.0]\nstart = \"clamped\"\nsection = {{ EA = 60.0, GA1 = 25.0, GA2 = 40.0, EI1 = 0.4, EI2 = 0.7, GJ = 0.3, rhoA = {:?}, rhoI1 = 1e-3, rhoI2 = 2e-3 }}\n",
            y + 0.4,
            0.1 + 0.01 * y,
        )
    };
    let element = |kind: &str, k: usize| {
        sensor(&format!("{kind}{k}"), kind, "beam") + &format!("element = {k}\n")
    };
    let at = |kind: &str, name: &str, s: f64| {
        sensor(&format!("{kind}_{name}"), kind, "beam") + &format!("at = {s:?}\n")
    };
    let both = |kind: &str| {
        (0..8).map(|k| element(kind, k)).collect::<String>()
            + &at(kind, "early", 0.1)
            + &at(kind, "late", 1.0)
    };
    let text = format!(
        "model = {{ name = \"legs\", gravity = [6.0, 9.0, -12.0] }}\nsimulation = {{ step = 1e-3, end = 0.03 }}\n{}{}{}{}{}",
        beam("beam", 0.0),
        beam("other", 3.0),
        both("strain"),
        both("section_force"),
        sensor("tip", "position", "beam.end"),
    );
    Case::new("places on a beam", text, |run: &Run| {
        let mut checks = Checks::default();
        let last = run.last();
        let stiffness = [25.0, 40.0, 60.0, 0.4, 0.7, 0.3];
        let six = |name: &str, parts: [&str; 6]| {
            parts.map(|part| run.sensor(&format!("{name}.{part}"), last))
        };
        let strain = |name: &str| six(name, ["Gamma1", "Gamma2", "Gamma3", "K1", "K2", "K3"]);
        let force = |name: &str| six(name, ["N1", "N2", "N3", "M1", "M2", "M3"]);
        // the strain of an element from its nodes: (26) of beams
        let lengths = [0.15, 0.125];
        for k in 0..8 {
            let own = strain(&format!("strain{k}"));
            let (l, first) = (lengths[k / 4], k + k / 4);
            let [a, b] = [first, first + 1].map(|n| format!("beam.{n}"));
            let slope = (run.place(&b, last) - run.place(&a, last)) / l;
            let mean = 0.5 * (run.directors(&a, last) + run.directors(&b, last));
            let gamma = mean.transpose() * slope - Vector::z();
            checks.all("Gamma", &own[..3], gamma.as_slice(), 1e-12);
            let product: Vec<f64> = own.iter().zip(stiffness).map(|(e, c)| e * c).collect();
            checks.all("forces", &force(&format!("section_force{k}")), &product, 1e-12);
        }
        let between = |a: [f64; 6], b: [f64; 6], share: f64| -> Vec<f64> {
            a.iter().zip(b).map(|(a, b)| a + share * (b - a)).collect()
        };
        // of the middles at 0.075 and 0.225 m, and of those 0.3125 and 0.4375 m along the second
        // leg
        for (kind, of) in
            [("strain", &strain as &dyn Fn(&str) -> [f64; 6]), ("section_force", &force)]
        {
            let at = |k: usize| of(&format!("{kind}{k}"));
            let [early, late] = ["early", "late"].map(|place| of(&format!("{kind}_{place}")));
            checks.all("early", &early, &between(at(0), at(1), 1.0 / 6.0), 1e-12);
            checks.all("late", &late, &between(at(6), at(7), 0.7), 1e-12);
        }
        checks.vector("tip", run.vector("tip", last), run.place("beam.9", last), 1e-14);
        checks
    })
    .only("sensor")
}

pub(crate) fn cases() -> Vec<Case> {
    vec![observed(), reactions(), places()]
}
