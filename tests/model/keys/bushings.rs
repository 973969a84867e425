//! Bushings: accelerations of two bodies by the relative motion of the frames that they hold.

use super::{Case, Checks, Run};
use holonom::nalgebra::{Matrix3, Matrix6, Rotation3, UnitQuaternion, Vector3, Vector6};
use vi_testkit::model::{FIRST, Rigid, SECOND, between, frame, head, part, sensor};

type Vector = Vector3<f64>;
type Efforts = fn(&Vector6<f64>, &Vector6<f64>, f64) -> Vector6<f64>;

const TILTED: [f64; 3] = [0.3, 0.5, -0.8];
const STEP: f64 = 2e-4;

/// A body, or the ground, at a node.
#[derive(Clone, Copy)]
struct Pose {
    center: Vector,
    turned: Matrix3<f64>,
    velocity: Vector,
    spin: Vector,
}

impl Pose {
    fn of(run: &Run, name: &str, node: usize) -> Self {
        let vector = |what: &str| run.vector(&format!("{what} {name}"), node);
        let turned = run.rotation(&format!("turn {name}"), node);
        Self { center: vector("place"), turned, velocity: vector("rate"), spin: vector("spin") }
    }

    fn ground() -> Self {
        let turned = Matrix3::identity();
        Self { center: Vector::zeros(), turned, velocity: Vector::zeros(), spin: Vector::zeros() }
    }

    /// A point and axes that were these initially, when the body was in the pose `start`.
    fn carried(&self, start: &Self, point: &Vector, axes: &Matrix3<f64>) -> (Vector, Matrix3<f64>) {
        let turn = self.turned * start.turned.transpose();
        (self.center + turn * (point - start.center), turn * axes)
    }

    fn rate_at(&self, point: &Vector) -> Vector {
        self.velocity + self.spin.cross(&(point - self.center))
    }
}

/// A bushing between two of the poses, number 2 is the ground.
struct Bushing {
    ends: [usize; 2],
    point: Vector,
    axes: Matrix3<f64>,
    tilt: bool,
    efforts: Efforts,
}

impl Bushing {
    /// Rotation vector, or tilt, of `b` seen from `a`.
    fn rotation(&self, a: &Matrix3<f64>, b: &Matrix3<f64>) -> Vector {
        let relative = a.transpose() * b;
        if !self.tilt {
            return Rotation3::from_matrix_unchecked(relative).scaled_axis();
        }
        let third = relative.column(2).into_owned();
        let across = Vector::z().cross(&third);
        across * (across.norm().atan2(third.z) / across.norm().max(1e-300))
    }

    /// The point, force and torque on the second body, in space; coordinates and power.
    fn wrench(&self, start: &[Pose; 3], at: &[Pose; 3], t: f64) -> Acting {
        let [i, j] = self.ends;
        let (x, a) = at[i].carried(&start[i], &self.point, &self.axes);
        let (y, b) = at[j].carried(&start[j], &self.point, &self.axes);
        let spin = at[j].spin - at[i].spin;
        let rate = at[j].rate_at(&y) - at[i].rate_at(&x) - at[i].spin.cross(&(y - x));
        let e = 1e-6;
        let slope = |axis: Vector| {
            let turned = |by: f64| self.rotation(&a, &(Rotation3::new(by * axis).into_inner() * b));
            (turned(e) - turned(-e)) / (2.0 * e)
        };
        let jacobian = Matrix3::from_columns(&[Vector::x(), Vector::y(), Vector::z()].map(slope));
        let (along, turn) = (a.transpose() * (y - x), self.rotation(&a, &b));
        let (v, w) = (a.transpose() * rate, jacobian * spin);
        let stack = |a: Vector, b: Vector| Vector6::new(a.x, a.y, a.z, b.x, b.y, b.z);
        let (x, v) = (stack(along, turn), stack(v, w));
        let efforts = (self.efforts)(&x, &v, t);
        let (f, m) =
            (efforts.fixed_rows::<3>(0).into_owned(), efforts.fixed_rows::<3>(3).into_owned());
        let torque = jacobian.transpose() * m;
        Acting { point: y, force: a * f, torque, coordinates: x, power: efforts.dot(&v) }
    }
}

/// What a bushing does.
struct Acting {
    point: Vector,
    force: Vector,
    torque: Vector,
    coordinates: Vector6<f64>,
    power: f64,
}

const NAMES: [&str; 5] = ["rubber", "mount", "bearing", "spring", "pad"];
const SOFT: Vector6<f64> = Vector6::new(21.0, 22.0, 23.0, 4.0, 5.0, 6.0);
const PUSH: Vector6<f64> = Vector6::new(0.3, 0.2, -0.4, 0.1, 0.25, -0.15);

fn soft(x: &Vector6<f64>, _v: &Vector6<f64>, _t: f64) -> Vector6<f64> {
    PUSH - SOFT.component_mul(x)
}

fn damped(_x: &Vector6<f64>, v: &Vector6<f64>, _t: f64) -> Vector6<f64> {
    -Vector6::new(1.1, 0.7, 1.9, 0.21, 0.12, 0.33).component_mul(v)
}

fn stiffness() -> Matrix6<f64> {
    Matrix6::from_fn(|i, j| {
        if i == j {
            45.0 + 3.0 * i as f64
        } else {
            (13.0 + 29.0 * i as f64 + 17.0 * j as f64) % 13.0
        }
    })
}

fn rows(matrix: &Matrix6<f64>) -> String {
    let row = |i: usize| format!("{:?}", (0..6).map(|j| matrix[(i, j)]).collect::<Vec<_>>());
    format!("[{}]", (0..6).map(row).collect::<Vec<_>>().join(", "))
}

fn full(x: &Vector6<f64>, v: &Vector6<f64>, _t: f64) -> Vector6<f64> {
    let preload = Vector6::new(0.4, -0.3, 0.5, 0.2, -0.1, 0.3);
    preload - stiffness() * x - Vector6::new(2.0, 3.0, 4.0, 0.5, 0.6, 0.7).component_mul(v)
}

fn progressive(x: &Vector6<f64>, v: &Vector6<f64>, _t: f64) -> Vector6<f64> {
    let k = Vector6::new(40.0 + 3e2 * x[1], 35.0, 30.0, 9.0, 8.0, 7.0 + 5.0 * v[3]);
    -k.component_mul(x) - Vector6::new(1.0, 2.0, 1.5 + 30.0 * x[3], 0.1, 0.3, 0.2).component_mul(v)
}

fn tilting(x: &Vector6<f64>, v: &Vector6<f64>, t: f64) -> Vector6<f64> {
    Vector6::new(-50.0 * x[0] + 2.0, -3.0 * v[1], 40.0 * t, -30.0 * x[3], -20.0 * x[4] - v[4], 0.0)
}

/// About one axis after the other, degrees.
fn about(turns: [(Vector, f64); 2]) -> Matrix3<f64> {
    let [first, second] = turns.map(|(axis, angle)| Rotation3::new(axis * angle.to_radians()));
    (first * second).into_inner()
}

fn bushings() -> Case {
    let axes = Rotation3::new(Vector::new(0.2, -0.4, 0.3)).into_inner();
    let base = Rotation3::new(Vector::from(TILTED)).into_inner();
    let points = [[0.2, 0.1, -0.4], [-0.3, 0.6, 0.2], [0.1, 0.5, 0.1]];
    let quaternion = UnitQuaternion::from_scaled_axis(Vector::new(0.2, -0.4, 0.3)).into_inner();
    let quaternion = [quaternion.w, quaternion.i, quaternion.j, quaternion.k];
    let motion = |name: &str| {
        [
            ("place", "position"),
            ("turn", "orientation"),
            ("rate", "velocity"),
            ("spin", "angular_velocity"),
            ("a", "acceleration"),
            ("r", "angular_acceleration"),
        ]
        .map(|(short, kind)| sensor(&format!("{short} {name}"), kind, name))
        .concat()
    };
    let text = [
        head("bushings", &format!("step = {STEP}, end = {}", 200.0 * STEP)),
        frame("tilted", TILTED, [0.0, 0.0, 3.0]),
        FIRST.text("first"),
        SECOND.text("second"),
        between("bushing", "rubber", ["ground", "first"]),
        format!(
            "position = {:?}\nrelative_to = \"tilted\"\nquaternion = {quaternion:?}\n",
            points[0]
        ),
        format!("stiffness = {}\npreload = [0.4, -0.3, 0.5, 0.2, -0.1, 0.3]\n", rows(&stiffness())),
        "damping = [2.0, 3.0, 4.0, 0.5, 0.6, 0.7]\n".into(),
        between("bushing", "mount", ["first", "second"]),
        format!("position = {:?}\neuler = {{ sequence = \"yz\", angles = [0.4, 0.7] }}\n", points[1]),
        "stiffness = [\"40 + 3e2*x2\", 35.0, 30.0, 9.0, 8.0, \"7 + 5*v4\"]\n".into(),
        "damping = [1.0, 2.0, \"1.5 + 30*x4\", 0.1, 0.3, 0.2]\n".into(),
        between("bushing", "bearing", ["ground", "second"]),
        format!("position = {:?}\nrotation = \"tilt\"\neuler = {{ sequence = \"zx\", degrees = [30.0, 20.0] }}\n", points[2]),
        "force = [\"2 - 50*x1\", \"-3*v2\", \"40*t\", \"-30*x4\", \"-20*x5 - v5\", 0.0]\n".into(),
        between("bushing", "spring", ["first", "ground"]),
        "position = [0.7, -0.2, 0.3]\n".into(),
        "matrix = [[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]]\n".into(),
        "stiffness = [21.0, 22.0, 23.0, 4.0, 5.0, 6.0]\n".into(),
        "preload = [0.3, 0.2, -0.4, 0.1, 0.25, -0.15]\n".into(),
        between("bushing", "pad", ["first", "second"]),
        "position = [-0.1, 0.4, 0.3]\nrotation_vector = [0.5, 0.1, -0.3]\n".into(),
        "damping = [1.1, 0.7, 1.9, 0.21, 0.12, 0.33]\n".into(),
        part("frame", "other") + "position = [0.0, 1.0, 3.0]\n",
        motion("first"),
        motion("second"),
    ]
    .concat();
    Case::new("bushings", text, move |run| {
        let mut checks = Checks::default();
        let all = [
            Bushing {
                ends: [2, 0],
                point: Vector::new(0.0, 0.0, 3.0) + base * Vector::from(points[0]),
                axes: base * axes,
                tilt: false,
                efforts: full,
            },
            Bushing {
                ends: [0, 1],
                point: points[1].into(),
                axes: (Rotation3::new(Vector::y() * 0.4) * Rotation3::new(Vector::z() * 0.7))
                    .into_inner(),
                tilt: false,
                efforts: progressive,
            },
            Bushing {
                ends: [2, 1],
                point: points[2].into(),
                axes: about([(Vector::z(), 30.0), (Vector::x(), 20.0)]),
                tilt: true,
                efforts: tilting,
            },
            Bushing {
                ends: [0, 2],
                point: Vector::new(0.7, -0.2, 0.3),
                axes: Matrix3::new(0.6, -0.8, 0.0, 0.8, 0.6, 0.0, 0.0, 0.0, 1.0),
                tilt: false,
                efforts: soft,
            },
            Bushing {
                ends: [0, 1],
                point: Vector::new(-0.1, 0.4, 0.3),
                axes: Rotation3::new(Vector::new(0.5, 0.1, -0.3)).into_inner(),
                tilt: false,
                efforts: damped,
            },
        ];
        let poses =
            |node| [Pose::of(run, "first", node), Pose::of(run, "second", node), Pose::ground()];
        for node in [0, run.last() - 20] {
            let (start, at, t) = (poses(0), poses(node), run.t(node));
            let (mut forces, mut torques) = ([Vector::zeros(); 3], [Vector::zeros(); 3]);
            for (name, bushing) in NAMES.into_iter().zip(&all) {
                let acting = bushing.wrench(&start, &at, t);
                let Acting { point, force, torque, coordinates, power } = acting;
                for (body, sign) in [(bushing.ends[0], -1.0), (bushing.ends[1], 1.0)] {
                    forces[body] += sign * force;
                    torques[body] += sign * (torque + (point - at[body].center).cross(&force));
                }
                if name == "spring" {
                    let square = coordinates.component_mul(&coordinates);
                    let energy = 0.5 * SOFT.dot(&square) - PUSH.dot(&coordinates);
                    checks.near("energy", run.energy("energy.spring")[node], energy, 1e-7);
                } else if node > 0 {
                    let work = run.energy(&format!("work.{name}"));
                    let found = (work[node + 1] - work[node - 1]) / (2.0 * STEP);
                    checks.near("power", found, power, 1e-4);
                }
            }
            for (k, (name, body)) in [("first", FIRST), ("second", SECOND)].into_iter().enumerate()
            {
                let Rigid { mass, moments, .. } = body;
                let turned = at[k].turned;
                let inertia = turned * Matrix3::from_diagonal(&moments.into()) * turned.transpose();
                let moment = torques[k] - at[k].spin.cross(&(inertia * at[k].spin));
                let turning = inertia.lu().solve(&moment).unwrap_or_default();
                let (a, r) = (
                    run.vector(&format!("a {name}"), node),
                    run.vector(&format!("r {name}"), node),
                );
                checks.vector("acceleration", a, forces[k] / mass, 2e-4);
                checks.vector("angular acceleration", r, turning, 2e-3);
            }
        }
        checks
    })
    .only("bushing")
}

pub(crate) fn cases() -> Vec<Case> {
    vec![bushings()]
}
