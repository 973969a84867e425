//! Laws, a bushing and a spring of a joint by a table: what they store, their works, efforts and
//! powers.

use super::{Known, Tables, Vector, axis, check};
use vi_testkit::model::{FIRST, SECOND, between, head, hinge, part, particle, sensor};

const HINGE: [f64; 3] = [0.1, 0.9, 0.2];
const ALONG: [f64; 3] = [0.48, 0.6, 0.64];
const RATE: f64 = 2.3;
const POINT: [f64; 3] = [0.1, -0.3, 0.2];
const BALL: [[f64; 3]; 2] = [[1.0, 2.0, 2.0], [0.4, -0.2, 0.9]];
const STIFFNESS: [f64; 6] = [9.0, 7.0, 8.0, 0.6, 0.9, 0.7];
const DAMPING: [f64; 6] = [0.5, 0.7, 0.4, 0.05, 0.06, 0.04];

/// What acts, and what it acts on.
const ACTING: [&str; 9] = ["tug", "drag", "far", "band", "rope", "gust", "wind", "mount", "hinge"];

fn text() -> String {
    let measured = |name: &&str| {
        sensor(&format!("{name}_effort"), "effort", name)
            + &sensor(&format!("{name}_power"), "power", name)
            + &sensor(&format!("{name}_work"), "work", name)
    };
    [
        head("laws", "step = 1e-3, end = 0.3"),
        FIRST.text("free"),
        SECOND.still("arm"),
        hinge("hinge", ["ground", "arm"], HINGE, ALONG),
        format!("rate = {RATE}\nspring = {{ stiffness = 1.5, rest = 0.2, table = \"stop\" }}\n"),
        part("table", "stop")
            + "points = [[-2.0, -6.0], [0.1, 0.0], [2.0, 3.8]]\ninterpolation = \"linear\"\n",
        particle("ball", 0.6, BALL[0]) + &format!("velocity = {:?}\n", BALL[1]),
        part("law", "tug") + "joint = \"hinge\"\neffort = \"-3*x - 2*x^3\"\n",
        part("law", "drag") + "joint = \"hinge\"\neffort = \"-0.7*v\"\n",
        part("law", "far") + "joint = \"hinge\"\neffort = \"0.9*ball.x + push\"\n",
        "[[signal]]\nname = \"push\"\nvalue = \"1.3*cos(4*t)\"\n".into(),
        between("law", "band", ["free", "ball"]),
        format!("point_from = {POINT:?}\ntension = \"5*(x - 1.2)^2\"\n"),
        between("law", "rope", ["ground", "ball"]) + "tension = \"2*v + 3\"\n",
        part("law", "gust") + &format!("on = \"free\"\npoint = {POINT:?}\naxes = \"body\"\n"),
        "force = [\"3-2*vx\", \"4 + wz\", \"-2*wy\"]\ntorque = [\"2 + wz\", \"x-3\", \"3*vy\"]\n"
            .into(),
        part("law", "wind") + "on = \"ball\"\nforce = [\"-2*vx\", \"x*z\", \"4-vy\"]\n",
        between("bushing", "mount", ["ground", "free"]) + "position = [0.3, 0.1, -0.2]\n",
        format!("stiffness = {STIFFNESS:?}\ndamping = {DAMPING:?}\n"),
        ACTING.iter().map(measured).collect(),
        sensor("angle", "joint_coordinate", "hinge"),
        sensor("rate", "joint_rate", "hinge"),
        sensor("push_point", "position", "free") + &format!("point = {POINT:?}\n"),
        sensor("push_rate", "velocity", "free") + &format!("point = {POINT:?}\n"),
        sensor("spin", "angular_velocity", "free"),
        sensor("ball_rate", "velocity", "ball"),
    ]
    .concat()
}

/// The numbers of a table at each row.
struct Motion<'a>(&'a Tables);

impl Motion<'_> {
    fn each<T>(&self, f: impl Fn(usize) -> T) -> Vec<T> {
        (0..self.0.rows()).map(f).collect()
    }

    fn column(&self, name: &str) -> &[f64] {
        self.0.column(&format!("sensors/{name}"))
    }

    fn vectors(&self, name: &str) -> Vec<Vector> {
        self.0.vectors(&format!("sensors/{name}"))
    }

    /// Length and rate of a law between points.
    fn line(&self, name: &str) -> Vec<[f64; 2]> {
        let ball = self.0.vectors("trajectory/ball");
        let (v, from) = (self.vectors("ball_rate"), self.vectors("push_point"));
        let own = self.vectors("push_rate");
        let tied = if name == "band" { 1.0 } else { 0.0 };
        self.each(|k| {
            let (line, rate) = (ball[k] - tied * from[k], v[k] - tied * own[k]);
            [line.norm(), line.dot(&rate) / line.norm()]
        })
    }

    /// What a law states, along its axes.
    fn efforts(&self, name: &str) -> Vec<Vec<f64>> {
        let (angle, rate) = (self.column("angle"), self.column("rate"));
        let t = self.0.column("trajectory/t");
        let ball = self.0.vectors("trajectory/ball");
        let (x, v) = (self.vectors("push_point"), self.vectors("push_rate"));
        let (w, fly) = (self.vectors("spin"), self.vectors("ball_rate"));
        match name {
            "tug" => self.each(|k| vec![-3.0 * angle[k] - 2.0 * angle[k].powi(3)]),
            "drag" => self.each(|k| vec![-0.7 * rate[k]]),
            "far" => self.each(|k| vec![0.9 * ball[k].x + 1.3 * (4.0 * t[k]).cos()]),
            "hinge" => self.each(|k| vec![-1.5 * (angle[k] - 0.2) - stop(angle[k] - 0.2)[0]]),
            "band" => {
                self.line("band").iter().map(|[l, _]| vec![5.0 * (l - 1.2).powi(2)]).collect()
            }
            "rope" => self.line("rope").iter().map(|[_, rate]| vec![2.0 * rate + 3.0]).collect(),
            "gust" => self.each(|k| {
                let (v, w) = (v[k], w[k]);
                vec![3.0 - 2.0 * v.x, 4.0 + w.z, -2.0 * w.y, 2.0 + w.z, x[k].x - 3.0, 3.0 * v.y]
            }),
            _ => self.each(|k| vec![-2.0 * fly[k].x, ball[k].x * ball[k].z, 4.0 - fly[k].y]),
        }
    }

    /// What it puts into the system in a second, by its effort in the file.
    fn power(&self, name: &str) -> Vec<f64> {
        let efforts = self.efforts(name);
        let rate = self.column("rate");
        match name {
            "tug" | "drag" | "far" | "hinge" => self.each(|k| efforts[k][0] * rate[k]),
            "band" | "rope" => {
                let line = self.line(name);
                self.each(|k| -efforts[k][0] * line[k][1])
            }
            "gust" => {
                let (v, w) = (self.vectors("push_rate"), self.vectors("spin"));
                let turned = self.0.directors("free");
                let own = |k: usize, e: &[f64]| turned[k] * Vector::new(e[0], e[1], e[2]);
                self.each(|k| own(k, &efforts[k]).dot(&v[k]) + own(k, &efforts[k][3..]).dot(&w[k]))
            }
            _ => {
                let v = self.vectors("ball_rate");
                self.each(|k| (0..3).map(|i| efforts[k][i] * v[k][i]).sum())
            }
        }
    }

    /// What it stores, where it is a potential; that of the start is taken off.
    fn stored(&self, name: &str) -> Option<Vec<f64>> {
        let angle = self.column("angle");
        let values = match name {
            "tug" => self.each(|k| 1.5 * angle[k].powi(2) + 0.5 * angle[k].powi(4)),
            "hinge.spring" => {
                self.each(|k| 0.75 * (angle[k] - 0.2).powi(2) + stop(angle[k] - 0.2)[1])
            }
            "band" => {
                self.line("band").iter().map(|[l, _]| 5.0 / 3.0 * (l - 1.2).powi(3)).collect()
            }
            _ => return None,
        };
        Some(values.iter().map(|value| value - values[0]).collect())
    }
}

/// The table: value, and its integral from the middle point.
fn stop(x: f64) -> [f64; 2] {
    let x = x - 0.1;
    let slope = if x < 0.0 { 6.0 / 2.1 } else { 2.0 };
    [slope * x, 0.5 * slope * x * x]
}

const STORING: [&str; 4] = ["mount", "hinge.spring", "tug", "band"];

fn expected(t: &Tables, name: &str) -> Option<Known> {
    let m = Motion(t);
    let (file, column) = name.split_once('/').unwrap();
    let stored = || STORING.map(|name| t.column(&format!("energy/energy.{name}")).to_vec());
    let kinetic = || t.column("energy/kinetic");
    match (file, column) {
        ("energy", "total") => {
            let stored = stored();
            let sum = |k: usize| kinetic()[k] + stored.iter().map(|own| own[k]).sum::<f64>();
            return Some(Known::new(m.each(sum), 1e-11));
        }
        ("energy", "balance") => {
            let works = ["drag", "far", "rope", "gust", "wind", "mount"]
                .map(|name| t.column(&format!("energy/work.{name}")));
            let total = t.column("energy/total");
            let balance =
                |k: usize| total[k] - total[0] - works.iter().map(|own| own[k]).sum::<f64>();
            return Some(Known::new(m.each(balance), 1e-11));
        }
        ("energy", _) => {
            let (kind, of) = column.split_once('.')?;
            let power = match (kind, of) {
                ("energy", "mount") => return None,
                ("energy", of) => return Some(Known::new(m.stored(of)?, 1e-12)),
                ("work", "mount") => return None,
                (_, of) => m.power(of),
            };
            return Some(Known::new(t.integral(0.0, &power), 5e-5));
        }
        ("sensors", _) => {}
        _ => return None,
    }
    let (of, kind) = column.split_once('_')?;
    let (kind, part) = kind.split_once('.').unwrap_or((kind, ""));
    match (of, kind) {
        ("push" | "ball", _) => None,
        ("mount", "power") => {
            let rate = t.difference(&stored()[0]);
            let work = t.difference(t.column("energy/work.mount"));
            Some(Known::new(rate.iter().zip(work).map(|(e, w)| w - e).collect(), 1e-3))
        }
        ("mount", "work") => {
            let (energy, work) = (&stored()[0], t.column("energy/work.mount"));
            Some(Known::new(m.each(|k| work[k] - energy[k] + energy[0]), 1e-11))
        }
        ("mount", _) => None,
        (of, "effort") => {
            let first = if part.starts_with('m') { 3 } else { 0 };
            let k = if part.is_empty() || part == "spring" { 0 } else { first + axis(part) };
            Some(Known::new(m.efforts(of).iter().map(|own| own[k]).collect(), 1e-11))
        }
        (of, "power") => Some(Known::new(m.power(of), 1e-11)),
        // of what stores to the order of the step: the sum over the steps
        (of, _) => Some(Known::new(t.integral(0.0, &m.power(of)), 5e-5)),
    }
}

#[test]
fn columns_of_laws() {
    let unseen = [
        ("trajectory/", "of the rigid system"),
        ("residuals/", "likewise"),
        ("energy/step", "likewise"),
        ("energy/t ", "likewise"),
        ("energy/kinetic", "likewise"),
        ("energy/energy.mount", "see the keys of bushings"),
        ("energy/work.mount", "likewise"),
        ("sensors/mount_effort", "likewise"),
        ("sensors/step", "of the rigid system"),
        ("sensors/t ", "likewise"),
        ("sensors/push ", "of signals"),
        ("sensors/push_", "of the rigid system"),
        ("sensors/angle", "likewise"),
        ("sensors/rate", "likewise"),
        ("sensors/spin", "likewise"),
        ("sensors/ball_", "likewise"),
    ];
    check(&Tables::of("laws", &text()), &expected, &unseen);
}
