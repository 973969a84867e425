//! Bodies and point masses: momenta and energy of the initial values, free fall, the ground.

use super::{Case, Checks, Run};
use holonom::nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use std::f64::consts::PI;
use vi_testkit::model::{body, head, part, sensor};

const GRAVITY: [f64; 3] = [1.0, -2.0, -5.0];
const MASS: f64 = 1.7;
const CENTER: [f64; 3] = [0.4, -0.3, 0.9];
const VELOCITY: [f64; 3] = [0.6, -0.2, 0.3];
const SPIN: [f64; 3] = [0.7, -0.4, 1.1];
const MOMENTS: [f64; 3] = [0.3, 0.5, 0.6];
const TENSOR: [[f64; 3]; 3] = [[0.3, 0.02, -0.03], [0.02, 0.5, 0.05], [-0.03, 0.05, 0.6]];

/// Inertia in the frame of the body and rotation, as they are stated.
type Stated = (Matrix3<f64>, Rotation3<f64>);

fn tensor() -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| TENSOR[i][j])
}

fn moments() -> Matrix3<f64> {
    Matrix3::from_diagonal(&MOMENTS.into())
}

/// `R_x`, `R_y` or `R_z`.
fn about(axis: char, angle: f64) -> Rotation3<f64> {
    let axis = Vector3::from_fn(|i, _| f64::from(u8::from("xyz".find(axis) == Some(i))));
    Rotation3::new(axis * angle)
}

/// A free body of the stated inertia and orientation and one at rest beside it.
fn free(name: &str, stated: &str, (inertia, rotation): Stated, in_body: bool) -> Case {
    let keys = ["angular_velocity", "body_angular_velocity"];
    let [key, other] = if in_body { [keys[1], keys[0]] } else { keys };
    let text = [
        format!(
            "model = {{ name = \"free\", description = \"two free bodies\", gravity = {GRAVITY:?} }}\n"
        ),
        "simulation = { step = 1e-3, end = 0.004 }\n".into(),
        part("body", "first") + &format!("mass = {MASS}\n{stated}\nposition = {CENTER:?}\n"),
        format!("velocity = {VELOCITY:?}\n{key} = {SPIN:?}\n"),
        body("second", 2.5, [1.0, 1.1, 1.2]) + &format!("{other} = [0.2, 0.5, -0.3]\n"),
        sensor("orientation", "orientation", "first"),
    ]
    .concat();
    Case::new(name, text, move |run| {
        let mut checks = Checks::default();
        let rotation = rotation.into_inner();
        let world = rotation * inertia * rotation.transpose();
        let spin = if in_body { rotation * Vector3::from(SPIN) } else { SPIN.into() };
        let (x, v, g) = (Vector3::from(CENTER), Vector3::from(VELOCITY), Vector3::from(GRAVITY));
        checks.matrix("orientation", run.rotation("orientation", 0), rotation, 1e-12);
        checks.vector("centre", run.place("first", 0), x, 1e-14);
        checks.vector("linear momentum", run.linear_momentum(0), MASS * v, 1e-13);
        let other = Vector3::new(0.2, 0.55, -0.36); // J ω of the second body
        let angular = MASS * x.cross(&v) + world * spin + other;
        checks.vector("angular momentum", run.angular_momentum(0), angular, 1e-12);
        let turning = spin.dot(&(world * spin)) + other.dot(&Vector3::new(0.2, 0.5, -0.3));
        let energy = 0.5 * MASS * v.dot(&v) + 0.5 * turning - MASS * g.dot(&x);
        checks.near("energy", run.nodes[0].hamiltonian, energy, 1e-12);
        for node in 0..run.steps() {
            let t = run.t(node);
            checks.vector("fall", run.place("first", node), x + v * t + 0.5 * t * t * g, 1e-12);
            let total = MASS * v + (MASS + 2.5) * t * g;
            checks.vector("momentum of both", run.linear_momentum(node), total, 1e-12);
        }
        checks.holds("title", run.model.header.name == "free");
        let said = run.model.header.description.as_deref();
        checks.holds("description", said == Some("two free bodies"));
        checks
    })
}

fn orientations() -> Vec<Case> {
    let tensor_text = format!("inertia = {TENSOR:?}");
    let moments_text = format!("inertia = {MOMENTS:?}");
    let q: [f64; 4] = [0.8, 0.2, -0.4, 0.4];
    let quaternion = UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3]));
    let vector = [0.4, -0.3, 0.7];
    let turned = Rotation3::new(Vector3::new(0.5, 0.8, -0.3));
    let rows: Vec<String> = (0..3)
        .map(|i| format!("[{:?}, {:?}, {:?}]", turned[(i, 0)], turned[(i, 1)], turned[(i, 2)]))
        .collect();
    let angles = [0.3, -0.5, 0.9];
    let euler = about('z', 0.3) * about('x', -0.5) * about('y', 0.9);
    let degrees = about('x', 40.0 * PI / 180.0) * about('z', -70.0 * PI / 180.0);
    vec![
        free(
            "quaternion",
            &format!("{tensor_text}\nquaternion = {q:?}"),
            (tensor(), quaternion.to_rotation_matrix()),
            false,
        ),
        free(
            "rotation vector",
            &format!("{moments_text}\nrotation_vector = {vector:?}"),
            (moments(), Rotation3::new(vector.into())),
            true,
        ),
        free(
            "matrix",
            &format!("{moments_text}\nmatrix = [{}]", rows.join(", ")),
            (moments(), turned),
            false,
        ),
        free(
            "euler angles",
            &format!("{tensor_text}\neuler = {{ sequence = \"zxy\", angles = {angles:?} }}"),
            (tensor(), euler),
            true,
        ),
        free(
            "euler degrees",
            &format!("{moments_text}\neuler = {{ sequence = \"xz\", degrees = [40.0, -70.0] }}"),
            (moments(), degrees),
            false,
        ),
    ]
}

/// A solid of 2 m/s with its mass and its moments.
fn solid(kind: &str, dimensions: &[f64], volume: f64, moments: [f64; 3]) -> Case {
    const DENSITY: f64 = 700.0;
    let text = [
        head("solid", "step = 1e-3, end = 1e-3"),
        part("body", "solid"),
        format!(
            "shape = {{ type = \"{kind}\", dimensions = {dimensions:?}, density = {DENSITY:?} }}\n"
        ),
        "position = [1.0, 2.0, 3.0]\n".into(),
        format!("velocity = {VELOCITY:?}\nangular_velocity = {SPIN:?}\n"),
    ]
    .concat();
    Case::new(kind, text, move |run| {
        let mut checks = Checks::default();
        let (mass, v) = (DENSITY * volume, Vector3::from(VELOCITY));
        checks.vector("linear momentum", run.linear_momentum(0), mass * v, 1e-12 * mass);
        let own = Vector3::from(moments).component_mul(&Vector3::from(SPIN)) * mass;
        let expected = mass * Vector3::new(1.0, 2.0, 3.0).cross(&v) + own;
        checks.vector("angular momentum", run.angular_momentum(0), expected, 1e-12 * mass);
        checks
    })
}

fn solids() -> Vec<Case> {
    let (r, h) = (0.2_f64, 0.7_f64);
    let round = |across: f64, along: f64| [across, across, along];
    let cylinder = round((3.0 * r * r + h * h) / 12.0, r * r / 2.0);
    let cone = round(3.0 / 80.0 * (4.0 * r * r + h * h), 0.3 * r * r);
    // masses of the cylinder and of both half balls
    let (a, b) = (h / (h + 4.0 / 3.0 * r), 4.0 / 3.0 * r / (h + 4.0 / 3.0 * r));
    let capsule = round(
        a * (h * h / 12.0 + r * r / 4.0) + b * (0.4 * r * r + h * h / 4.0 + 3.0 / 8.0 * h * r),
        a * r * r / 2.0 + b * 0.4 * r * r,
    );
    let ellipsoid = [0.34 / 5.0, 0.29 / 5.0, 0.13 / 5.0];
    vec![
        solid("capsule", &[r, h], PI * r * r * (h + 4.0 / 3.0 * r), capsule),
        solid("ellipsoid", &[0.2, 0.3, 0.5], 4.0 / 3.0 * PI * 0.03, ellipsoid),
        solid("box", &[0.2, 0.3, 0.5], 0.03, [0.34 / 12.0, 0.29 / 12.0, 0.13 / 12.0]),
        solid("cylinder", &[r, h], PI * r * r * h, cylinder),
        solid("rod", &[h, r], PI * r * r * h, cylinder),
        solid("cone", &[r, h], PI * r * r * h / 3.0, cone),
        solid("sphere", &[r], 4.0 / 3.0 * PI * r.powi(3), [0.4 * r * r; 3]),
    ]
}

/// A body that does not move beside one that falls.
fn fixed() -> Case {
    let text = include_str!("../../models/fixed_body.toml");
    Case::new("fixed body", text, |run| {
        let mut checks = Checks::default();
        for node in 0..run.steps() {
            let fall = Vector3::new(4.0, 5.0, 6.0 - 5.0 * run.t(node).powi(2));
            checks.vector("frame", run.place("frame", node), Vector3::new(1.0, 2.0, 3.0), 1e-14);
            checks.vector("stone", run.place("stone", node), fall, 1e-12);
        }
        checks
    })
    .blind(
        "body.mass",
        "of a fixed body, and a free fall does not depend on it: see the free bodies",
    )
    .blind("body.inertia", "of a fixed body and of one that does not turn")
}

/// Two point masses in the plane, one thrown.
fn particles() -> Case {
    let text = include_str!("../../models/thrown_points.toml");
    Case::new("thrown particles", text, |run: &Run| {
        let mut checks = Checks::default();
        for node in 0..run.steps() {
            let t = run.t(node);
            let fall = |x: f64, y: f64| [x + 0.25 * t * t, y - 5.0 * t * t];
            let ball = fall(1.0 + 3.0 * t, 2.0 + 4.0 * t);
            checks.all("ball", run.coordinates("ball", node), &ball, 1e-12);
            checks.all("stone", run.coordinates("stone", node), &fall(-2.0, 0.5), 1e-12);
            let p = [2.1 + t, 2.8 - 20.0 * t];
            checks.all("momentum", &run.nodes[node].momentum.linear[..2], &p, 1e-12);
        }
        checks
    })
}

/// As members of space.
fn particles_in_space() -> Case {
    let text = r#"
model = { name = "throw", dimension = 3, gravity = [0.5, -10.0, 2.0] }
simulation = { step = 0.01, end = 0.05 }
particle = [{ name = "ball", mass = 0.7, position = [1.0, 2.0, 3.0], velocity = [3.0, 4.0, 5.0] }]
"#;
    Case::new("particle in space", text, |run: &Run| {
        let mut checks = Checks::default();
        for node in 0..run.steps() {
            let t = run.t(node);
            let x = Vector3::new(1.0 + 3.0 * t, 2.0 + 4.0 * t, 3.0 + 5.0 * t);
            let fall = Vector3::new(0.25, -5.0, 1.0) * t * t;
            checks.vector("ball", run.place("ball", node), x + fall, 1e-12);
        }
        checks.vector("momentum", run.linear_momentum(0), Vector3::new(2.1, 2.8, 3.5), 1e-13);
        checks
    })
    .blind("model.dimension", "its default")
}

pub(crate) fn cases() -> Vec<Case> {
    let mut cases = orientations();
    cases.extend(solids());
    cases.extend([fixed(), particles(), particles_in_space()]);
    cases
}
