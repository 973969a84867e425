//! What rolls and what slides on a blade: heights and slip of every step, by the geometry of the
//! coordinates; what holds them.

use super::{Case, Checks, Run};
use holonom::nalgebra::{Matrix3, Rotation3, Vector3};
use vi_testkit::model::{FIRST, Rigid, SECOND, frame, heavy, part, sensor};

type Vector = Vector3<f64>;

const TILTED: [f64; 3] = [0.1, 0.2, -0.3];
const ORIGIN: [f64; 3] = [0.1, 0.3, 0.2];
const STEP: f64 = 2e-3;

fn tilt() -> Matrix3<f64> {
    Rotation3::new(Vector::from(TILTED)).into_inner()
}

/// The height and the slip of a step by the formulas of rolling.
struct Rolls {
    axis: Option<Vector>, // along the axes of the body
    radius: f64,
    tube: f64,
    origin: Vector,
    normal: Vector,
    spin: f64,
}

impl Rolls {
    fn arm(&self, axis: Option<Vector>) -> Vector {
        let n = self.normal;
        axis.map_or(-self.radius * n, |a| {
            let across = n - n.dot(&a) * a;
            -(self.radius - self.tube) * across.normalize() - self.tube * n
        })
    }

    fn check(&self, checks: &mut Checks, run: &Run, [body, attitude]: [&str; 2]) {
        let axis = |node: usize| self.axis.map(|a| run.rotation(attitude, node) * a);
        for node in 0..run.steps() {
            let x = run.place(body, node);
            let low = x + self.arm(axis(node)) - self.origin;
            checks.near("height", low.dot(&self.normal), 0.0, 1e-9);
            if node == 0 {
                continue;
            }
            let [a, b] = [node - 1, node].map(|k| run.rotation(attitude, k));
            let theta = Rotation3::from_matrix(&(b * a.transpose())).scaled_axis();
            let mean = axis(node).zip(axis(node - 1)).map(|(a, b)| (a + b).normalize());
            let (arm, last) = (self.arm(mean), run.place(body, node - 1));
            let carried = self.normal.cross(&(0.5 * (x + last) + arm - self.origin));
            let slip = (x - last + theta.cross(&arm)) / STEP - self.spin * carried;
            let along = slip - slip.dot(&self.normal) * self.normal;
            checks.vector("slip", along, Vector::zeros(), 1e-7);
        }
    }
}

/// A tyre and a ball on planes that turn, a blade.
fn rolling() -> Case {
    let third = Rigid { center: [2.0, 2.0, 2.0], ..SECOND };
    let (axis, blade, place) = ([0.6, 0.8, 0.1], [0.3, 0.9, 0.2], [2.2, 1.9, 2.1]);
    let (normals, origins) =
        ([[0.1, 0.2, 1.0], [-0.2, 0.1, 1.1]], [[0.1, 0.2, -0.4], [-0.3, 0.2, 0.1]]);
    let plane = |k: usize, spin: f64| {
        let (normal, origin) = (normals[k], origins[k]);
        format!(
            "plane = {{ normal = {normal:?}, position = {origin:?}, spin = {spin:?}, \
             on = \"table\" }}\n"
        )
    };
    let rolls = |name: &str, body: &str| {
        format!("{}type = \"rolling\"\nbody = \"{body}\"\n", part("constraint", name))
    };
    let relative = "relative_to = \"tilted\"\n";
    let text = [
        heavy(
            "rolling",
            [1.0, -2.0, -6.0],
            &format!("step = {STEP:?}, end = 0.04, momenta = true, project_start = true"),
        ),
        frame("tilted", TILTED, ORIGIN),
        part("frame", "other") + "position = [0.0, 1.0, 3.0]\n",
        part("body", "table") + "mass = 1.0\ninertia = [1.0, 1.0, 1.0]\nfixed = true\n",
        FIRST.text("first"),
        SECOND.text("second"),
        third.text("third"),
        rolls("tyre", "first") + &format!("axis = {axis:?}\nradius = 0.4\ntube = 0.07\n"),
        plane(0, 1.5) + relative,
        rolls("ball", "second") + "radius = 0.3\n" + &plane(1, -2.0) + relative,
        part("constraint", "runner") + "type = \"blade\"\nbody = \"third\"\n",
        format!("position = {place:?}\naxis = {blade:?}\n") + relative,
        sensor("q1", "orientation", "first"),
        sensor("q2", "orientation", "second"),
        sensor("q3", "orientation", "third"),
    ]
    .concat();
    Case::new("rolling", text, move |run| {
        let mut checks = Checks::default();
        let in_space = |x: [f64; 3]| Vector::from(ORIGIN) + tilt() * Vector::from(x);
        let along = |d: [f64; 3]| (tilt() * Vector::from(d)).normalize();
        let of = |k: usize, axis, radius, tube, spin| Rolls {
            axis,
            radius,
            tube,
            origin: in_space(origins[k]),
            normal: along(normals[k]),
            spin,
        };
        let own = FIRST.rotation().transpose() * along(axis);
        of(0, Some(own), 0.4, 0.07, 1.5).check(&mut checks, run, ["first", "q1"]);
        of(1, None, 0.3, 0.0, -2.0).check(&mut checks, run, ["second", "q2"]);
        let back = third.rotation().transpose();
        let (edge, point) =
            (back * along(blade), back * (in_space(place) - Vector::from(third.center)));
        for node in 1..run.steps() {
            let [a, b] = [node - 1, node].map(|k| run.rotation("q3", k));
            let x = |k: usize, turn: Matrix3<f64>| run.place("third", k) + turn * point;
            let slip = (x(node, b) - x(node - 1, a)) / STEP;
            checks.near("blade", slip.dot(&(0.5 * (a + b) * edge)), 0.0, 1e-8);
        }
        let owner = |name: &str| name.split('.').next().unwrap().to_owned();
        let mut owners: Vec<String> =
            run.facts.constraints.iter().flatten().map(|row| owner(row)).collect();
        owners.retain(|name| ["tyre", "ball", "runner"].contains(&name.as_str()));
        let expected = ["tyre", "tyre", "tyre", "ball", "ball", "ball", "runner"];
        checks.holds("rows", owners == expected);
        checks
    })
    .only("constraint")
    .blind("constraint[rolling].axis", "a direction of any length; its entries are judged")
    .blind("constraint[rolling].plane.on", "a fixed body is one with the ground")
    .blind("constraint[blade].axis", "a direction of any length; its entries are judged")
}

/// The weight of two balls that roll on, and their slip.
fn carried() -> Case {
    let ball = |name: &str, mass: f64, y: f64| {
        let inertia = 0.4 * mass * 0.01;
        format!(
            "{}mass = {mass:?}\ninertia = [{inertia:?}, {inertia:?}, {inertia:?}]\n\
             position = [0.0, {y:?}, 0.1]\nvelocity = [1.0, 0.0, 0.0]\n\
             angular_velocity = [0.0, 10.0, 0.0]\n{}type = \"rolling\"\nbody = \"{name}\"\n\
             radius = 0.1\n",
            part("body", name),
            part("constraint", &format!("under_{name}"))
        )
    };
    let text = [
        heavy("carried", [0.0, 0.0, -10.0], "step = 1e-3, end = 4e-3"),
        ball("light", 1.0, 0.0),
        ball("grave", 3.0, 1.0),
        sensor("first", "reaction", "under_light"),
        sensor("second", "reaction", "under_grave"),
        sensor("slips", "slip", "under_grave"),
    ]
    .concat();
    Case::new("carried", text, |run| {
        let mut checks = Checks::default();
        for (name, weight) in [("first", 10.0), ("second", 30.0)] {
            let of = |axis: &str| run.sensor(&format!("{name}.f{axis}"), 1);
            checks.near("weight", of("z"), weight, 1e-8);
            checks.near("pull", of("x").hypot(of("y")), 0.0, 1e-8);
        }
        checks.vector("slip", run.vector("slips", 2), Vector::zeros(), 1e-12);
        checks
    })
    .only("sensor")
    .blind("sensor.of", "both balls roll")
}

/// Sums of rates of two joints, of points in space and in the body, each over a step.
fn weighed() -> Case {
    let (point, along, across) = ([0.2, -0.1, 0.3], [0.3, 0.9, -0.4], [0.5, -0.2, 0.7]);
    let second = Rigid { center: [1.0, 2.0, 0.5], ..SECOND };
    let slide = "[[joint]]\nname = \"slide\"\ntype = \"cylindrical\"\nparent = \"ground\"\n\
                 child = \"first\"\nposition = [0.0, 0.0, 0.0]\naxis = [0.3, 0.2, 1.0]\n";
    let text = [
        heavy(
            "weighed",
            [1.0, -2.0, -6.0],
            &format!("step = {STEP:?}, end = 0.04, momenta = true, project_start = true"),
        ),
        FIRST.text("first"),
        second.text("second"),
        slide.to_owned(),
        Rigid { center: [-1.0, 0.5, 2.0], ..FIRST }.still("third"),
        "[[joint]]\nname = \"rail\"\ntype = \"prismatic\"\nparent = \"ground\"\n\
         child = \"third\"\nposition = [0.0, 0.0, 0.0]\naxis = [0.1, 0.9, 0.3]\n"
            .to_owned(),
        part("constraint", "tie") + "type = \"velocity\"\nvalue = \"0.3*sin(40*t) + 0.2*second.y\"\n",
        "terms = [{ joint = \"slide\", factor = \"2 + cos(slide.1)\" }, \
         { joint = \"slide\", freedom = 1, factor = \"slide - 0.7\" }, "
            .to_owned(),
        format!(
            "{{ joint = \"rail\", factor = 0.6 }}, {{ of = \"second\", point = {point:?}, direction = {along:?}, axes = \"body\", \
             factor = \"1.5 + second.x\" }}, {{ of = \"first\", direction = {across:?}, factor = -0.8 }}]\n"
        ),
        part("constraint", "other") + "type = \"velocity\"\nvalue = 0.3\n",
        "terms = [{ joint = \"rail\", factor = 1.3 }, { joint = \"slide\", factor = 0.4 }]\n"
            .to_owned(),
        sensor("at", "joint_coordinate", "slide"),
        sensor("on", "joint_coordinate", "rail"),
        sensor("q2", "orientation", "second"),
    ]
    .concat();
    Case::new("weighed", text, move |run| {
        let mut checks = Checks::default();
        for node in 1..run.steps() {
            let ends = [node - 1, node];
            let [u, theta] =
                ["u", "theta"].map(|part| ends.map(|k| run.sensor(&format!("at.{part}"), k)));
            let mean = |x: [f64; 2]| 0.5 * (x[0] + x[1]);
            let change = |x: [f64; 2]| x[1] - x[0];
            let [a, b] = ends.map(|k| run.rotation("q2", k));
            let place = |name: &str| ends.map(|k| run.place(name, k));
            let [before, after] = place("second");
            let own = Vector::from(point);
            let moved = (after + b * own) - (before + a * own);
            let middle = 0.5 * (before + after);
            let of_second = (0.5 * (a + b) * Vector::from(along)).dot(&moved);
            let [from, to] = place("first");
            let of_first = Vector::from(across).dot(&(to - from));
            let rail = ends.map(|k| run.sensor("on", k));
            let sum = 0.6 * change(rail)
                + (2.0 + mean(theta).cos()) * change(u)
                + (mean(u) - 0.7) * change(theta)
                + (1.5 + middle.x) * of_second
                - 0.8 * of_first;
            let t = STEP * (node as f64 - 0.5);
            let value = 0.3 * (40.0 * t).sin() + 0.2 * middle.y;
            checks.near("sum", sum / STEP, value, 1e-8);
            let other = 1.3 * change(rail) + 0.4 * change(u);
            checks.near("other sum", other / STEP, 0.3, 1e-8);
        }
        let owner = |name: &str| name.split('.').next().unwrap().to_owned();
        let mut owners: Vec<String> =
            run.facts.constraints.iter().flatten().map(|row| owner(row)).collect();
        owners.retain(|name| ["tie", "other"].contains(&name.as_str()));
        checks.holds("rows", owners == ["tie", "other"]);
        checks
    })
    .only("constraint")
}

pub(super) fn cases() -> Vec<Case> {
    vec![rolling(), carried(), weighed()]
}
