//! Reference frames, included files and parameters: what is stated in a frame is where the composed
//! rotations put it.

use super::{Case, Checks};
use holonom::nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use std::f64::consts::PI;
use vi_testkit::model::{Rigid, body, body_at, frame, head, part, particle, sensor};

type Vector = Vector3<f64>;

/// The keys of an orientation in its five forms, and the rotation.
fn orientations() -> Vec<(&'static str, String, Matrix3<f64>)> {
    let about = |axis: Vector, angle: f64| Rotation3::new(axis * angle);
    let (x, y, z) = (Vector::x(), Vector::y(), Vector::z());
    let turned = Rotation3::new(Vector::new(0.5, 0.8, -0.3)).into_inner();
    let row =
        |i: usize| format!("[{:?}, {:?}, {:?}]", turned[(i, 0)], turned[(i, 1)], turned[(i, 2)]);
    let quaternion = UnitQuaternion::from_quaternion(Quaternion::new(0.8, 0.2, -0.4, 0.4));
    let euler = about(z, 0.3) * about(x, -0.5) * about(y, 0.9);
    let degrees = about(x, 40.0 * PI / 180.0) * about(z, -70.0 * PI / 180.0);
    vec![
        (
            "quaternion",
            "quaternion = [0.8, 0.2, -0.4, 0.4]".into(),
            quaternion.to_rotation_matrix().into_inner(),
        ),
        (
            "rotation vector",
            "rotation_vector = [0.4, -0.3, 0.7]".into(),
            Rotation3::new(Vector::new(0.4, -0.3, 0.7)).into_inner(),
        ),
        ("matrix", format!("matrix = [{}, {}, {}]", row(0), row(1), row(2)), turned),
        (
            "euler angles",
            "euler = { sequence = \"zxy\", angles = [0.3, -0.5, 0.9] }".into(),
            euler.into_inner(),
        ),
        (
            "euler degrees",
            "euler = { sequence = \"xz\", degrees = [40.0, -70.0] }".into(),
            degrees.into_inner(),
        ),
    ]
}

/// A body and a beam in a frame within a frame.
fn nested((name, keys, rotation): (&'static str, String, Matrix3<f64>)) -> Case {
    let stone = Rigid {
        mass: 2.0,
        moments: [1.0, 1.1, 1.2],
        center: [0.1, 0.2, 0.4],
        turned: [0.2, -0.6, 0.3],
        velocity: [0.6, -0.2, 0.3],
        spin: [0.7, -0.4, 1.1],
    };
    let text = [
        head("nested", "step = 1e-3, end = 1e-3"),
        part("frame", "outer") + "position = [1.0, 2.0, 3.0]\n" + &keys + "\n",
        part("frame", "inner") + "relative_to = \"outer\"\nposition = [0.3, -0.2, 0.5]\n",
        part("frame", "aside") + "position = [0.0, 1.0, 0.0]\n",
        stone.text("stone") + "relative_to = \"inner\"\n",
        body_at([0.5, 0.1, -0.2], "rider", 2.0, [1.0, 1.1, 1.2]) + "relative_to = \"stone\"\n",
        particle("ball", 1.0, [-0.4, 0.3, 0.8]),
        "relative_to = \"outer\"\nvelocity = [0.2, 0.5, -0.1]\n".into(),
        particle("other", 1.0, [-3.0, 0.3, 0.8]),
        sensor("q", "orientation", "stone"),
        sensor("v", "velocity", "stone"),
        sensor("w", "angular_velocity", "stone"),
        sensor("carried", "velocity", "rider"),
        sensor("thrown", "velocity", "ball"),
    ]
    .concat();
    Case::new(format!("frame, {name}"), text, move |run| {
        let mut checks = Checks::default();
        let origin = Vector::new(1.0, 2.0, 3.0);
        let inner = origin + rotation * Vector::new(0.3, -0.2, 0.5);
        let x = inner + rotation * Vector::new(0.1, 0.2, 0.4);
        let own = rotation * Rotation3::new(Vector::new(0.2, -0.6, 0.3)).into_inner();
        let (v, w) =
            (rotation * Vector::new(0.6, -0.2, 0.3), rotation * Vector::new(0.7, -0.4, 1.1));
        let arm = own * Vector::new(0.5, 0.1, -0.2);
        checks.vector("place", run.place("stone", 0), x, 1e-12);
        checks.matrix("orientation", run.rotation("q", 0), own, 1e-12);
        checks.vector("velocity", run.vector("v", 0), v, 1e-12);
        checks.vector("rotation", run.vector("w", 0), w, 1e-12);
        checks.vector("rider", run.place("rider", 0), x + arm, 1e-12);
        checks.vector("carried", run.vector("carried", 0), v + w.cross(&arm), 1e-12);
        let ball = origin + rotation * Vector::new(-0.4, 0.3, 0.8);
        checks.vector("ball", run.place("ball", 0), ball, 1e-12);
        checks.vector(
            "thrown",
            run.vector("thrown", 0),
            rotation * Vector::new(0.2, 0.5, -0.1),
            1e-12,
        );
        checks
    })
    .blind("body.mass", "places and velocities do not depend on it")
    .blind("body.inertia", "places and velocities do not depend on it")
    .blind("particle.mass", "places and velocities do not depend on it")
    .blind("particle.position", "of the other one")
    .blind("frame.position", "of the one aside")
    .blind("sensor.of", "the rider turns as the stone")
}

/// A file with a parameter, placed in a frame.
fn included((name, keys, rotation): (&'static str, String, Matrix3<f64>)) -> Case {
    let file = include_str!("../../models/part_in_a_frame.toml");
    let text = [
        format!(
            "include = [{{ file = \"part.toml\", prefix = \"left_\", relative_to = \"outer\", position = [0.3, -0.2, 0.5], parameters = {{ length = \"= 2*size\" }}, {keys} }}]\n"
        ),
        head("included", "step = 1e-3, end = 1e-3"),
        "parameters = { size = 0.35 }\n".into(),
        frame("outer", [0.1, 0.2, 0.3], [1.0, 2.0, 3.0]),
        part("frame", "aside") + "position = [0.0, 1.0, 0.0]\n",
        body("base", 2.0, [1.0, 1.1, 1.2]),
    ]
    .concat();
    Case::new(format!("include, {name}"), text, move |run| {
        let mut checks = Checks::default();
        let outer = Rotation3::new(Vector::new(0.1, 0.2, 0.3)).into_inner();
        let inner = Vector::new(0.3, -0.2, 0.5) + rotation * Vector::new(0.7, 1.4, 0.4);
        let x = Vector::new(1.0, 2.0, 3.0) + outer * inner;
        checks.vector("place", run.place("left_stone", 0), x, 1e-12);
        checks.near("members", run.members() as f64, 3.0, 0.1);
        checks
    })
    .file("part.toml", file)
    .file("other.toml", file.replace("0.4", "0.6"))
    .blind("body", "of the file itself")
    .blind("frame.position", "of the one aside")
}

pub(crate) fn cases() -> Vec<Case> {
    // what depends on the orientation alone is planted with each of them, the rest with the first
    let first = |only: &'static str| {
        move |(k, case): (usize, Case)| if k == 0 { case } else { case.only(only) }
    };
    let nested = orientations().into_iter().map(nested).enumerate().map(first("frame"));
    let included = orientations().into_iter().map(included).enumerate().map(first("include"));
    nested.chain(included).collect()
}
