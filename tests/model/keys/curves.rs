//! Curved centre lines: nodes on circles, screw lines and through points; the rotation of sections
//! about them.

use super::{Case, Checks, Run};
use holonom::nalgebra::{Rotation3, Unit, Vector3};
use vi_testkit::model::{head, part, soft_section};

type Vector = Vector3<f64>;

const FROM: [f64; 3] = [1.0, 0.2, 0.3];
const CENTER: [f64; 3] = [0.1, -0.3, 0.2];
const AXIS: [f64; 3] = [0.0, 0.6, 0.8];

fn text(curve: &str, elements: usize, more: &str) -> String {
    [
        head("curve", "step = 1e-5, end = 1e-5"),
        part("beam", "bow"),
        format!("curve = {{ {curve} }}\nelements = {elements}\nnormal = [0.3, 0.7, 1.0]\n{more}\n"),
        soft_section(),
    ]
    .concat()
}

/// Nodes on a screw line, and `d_1` in the plane of the tangent and `normal`.
fn screw(name: &str, pitch: f64, angle: f64, keys: &str) -> Case {
    const ELEMENTS: usize = 6;
    let own = format!(
        "type = \"{name}\", from = {FROM:?}, center = {CENTER:?}, axis = {AXIS:?}, angle = {angle:?}{keys}"
    );
    Case::new(format!("{name} of a beam"), text(&own, ELEMENTS, ""), move |run| {
        let mut checks = Checks::default();
        let (axis, from, center) = (Vector::from(AXIS), Vector::from(FROM), Vector::from(CENTER));
        let arm = from - center;
        let along = arm.dot(&axis) * axis;
        for k in 0..=ELEMENTS {
            let turned = angle * k as f64 / ELEMENTS as f64;
            let about = Rotation3::from_axis_angle(&Unit::new_normalize(axis), turned);
            let x = center
                + along
                + about * (arm - along)
                + pitch * turned / std::f64::consts::TAU * axis;
            let node = format!("bow.{k}");
            checks.vector("node", run.place(&node, 0), x, 1e-12);
            let d = run.directors(&node, 0);
            let tangent = (axis.cross(&(about * (arm - along)))
                + pitch / std::f64::consts::TAU * axis)
                .normalize();
            checks.vector("tangent", d.column(2).into(), tangent, 1e-12);
            let aside = tangent.cross(&Vector::new(0.3, 0.7, 1.0)).normalize();
            checks.vector("second director", d.column(1).into(), aside, 1e-12);
        }
        checks.near("nodes", run.frames() as f64, (ELEMENTS + 1) as f64, 0.1);
        checks
    })
    .only("beam.curve")
}

fn spline() -> Case {
    let points =
        "points = [[0.0, 0.1, 0.2], [0.6, 0.1, 0.2], [1.08, 0.46, 0.2], [1.56, 0.46, 0.56]]";
    let own = format!("type = \"spline\", {points}");
    Case::new("spline of a beam", text(&own, 6, ""), |run| {
        let mut checks = Checks::default();
        let through = [[0.0, 0.1, 0.2], [0.6, 0.1, 0.2], [1.08, 0.46, 0.2], [1.56, 0.46, 0.56]];
        for (k, x) in through.into_iter().enumerate() {
            checks.vector("point", run.place(&format!("bow.{}", 2 * k), 0), x.into(), 1e-9);
        }
        checks.near("nodes", run.frames() as f64, 7.0, 0.1);
        checks
    })
    .only("beam.curve")
}

/// Sections that do not turn about the tangent of a screw line.
fn minimal() -> Case {
    const ELEMENTS: usize = 60;
    let own = format!(
        "type = \"helix\", from = {FROM:?}, center = {CENTER:?}, axis = {AXIS:?}, angle = 5.0, pitch = 1.7"
    );
    Case::new("minimal twist", text(&own, ELEMENTS, "twist = \"minimal\""), |run: &Run| {
        let mut checks = Checks::default();
        let first = run.directors("bow.0", 0);
        let normal = Vector::new(0.3, 0.7, 1.0);
        let aside = first.column(2).cross(&normal).normalize();
        checks.vector("first", first.column(1).into(), aside, 1e-12);
        for k in 1..=ELEMENTS {
            let [a, b] = [k - 1, k].map(|k| run.directors(&format!("bow.{k}"), 0));
            let turned = Rotation3::from_matrix_unchecked(b * a.transpose()).scaled_axis();
            let tangent = (a.column(2) + b.column(2)).normalize();
            checks.near("rotation about the tangent", turned.dot(&tangent), 0.0, 1e-4);
        }
        checks
    })
    .only("beam.twist")
}

pub(crate) fn cases() -> Vec<Case> {
    vec![screw("arc", 0.0, 2.5, ""), screw("helix", 1.7, 5.0, ", pitch = 1.7"), spline(), minimal()]
}
