//! What is drawn, and meshes: colours and corners in the data of the scene, mass and inertia of a
//! mesh.

use super::{Case, Checks, Run};
use holonom::nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use holonom::report::scene::Scene;
use serde_json::Value;
use vi_testkit::model::{body, body_at, head, part};

/// A box with two corners at the origin and `(0.2, 0.3, 0.5)` as the file of a mesh.
fn brick() -> String {
    let corner = |k: usize| {
        [0.2, 0.3, 0.5]
            .map(|x| x * 1.0)
            .into_iter()
            .enumerate()
            .map(move |(i, x)| if k >> i & 1 == 1 { x } else { 0.0 })
    };
    let vertices = (0..8).map(|k| {
        let [x, y, z]: [f64; 3] = corner(k).collect::<Vec<_>>().try_into().unwrap();
        format!("v {x} {y} {z}\n")
    });
    let faces = ["1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"];
    vertices.chain(faces.iter().map(|face| format!("f {face}\n"))).collect()
}

/// Another box of the same file format.
fn cube() -> String {
    brick().replace("0.2", "0.4").replace("0.3", "0.4").replace("0.5", "0.4")
}

const TURN: [f64; 4] = [0.8, 0.0, 0.36, 0.48];

fn turn() -> Matrix3<f64> {
    let [w, x, y, z] = TURN;
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).to_rotation_matrix().into_inner()
}

/// Mass and inertia of a mesh with three scales, turned against its body.
fn heavy_mesh() -> Case {
    let text = [
        head("mesh", "step = 1e-3, end = 1e-3"),
        part("body", "brick"),
        format!(
            "shape = {{ type = \"mesh\", file = \"brick.obj\", scale = [0.5, 2.0, 1.5], quaternion = {TURN:?}, density = 900.0 }}\n"
        ),
        "velocity = [1.0, 2.0, 3.0]\nangular_velocity = [0.7, -0.4, 1.1]\n".into(),
    ]
    .concat();
    Case::new("mass of a mesh", text, |run| {
        let mut checks = Checks::default();
        let size = Vector3::new(0.1_f64, 0.6, 0.75);
        let mass = 900.0 * size.product();
        let square = size.component_mul(&size);
        let moments = Vector3::new(square.y + square.z, square.x + square.z, square.x + square.y);
        let inertia =
            turn() * Matrix3::from_diagonal(&(moments * mass / 12.0)) * turn().transpose();
        let v = Vector3::new(1.0, 2.0, 3.0);
        checks.vector("linear momentum", run.linear_momentum(0), mass * v, 1e-9);
        let expected = inertia * Vector3::new(0.7, -0.4, 1.1);
        checks.vector("angular momentum", run.angular_momentum(0), expected, 1e-9);
        checks
    })
    .file("brick.obj", brick())
    .file("cube.obj", cube())
    .blind("body.shape.scale reversed", "a brick is its own reflection")
}

/// Ends of the box around all corners of a brick that is scaled, turned and moved.
fn ends(scale: f64, turn: Matrix3<f64>, position: [f64; 3]) -> [Vector3<f64>; 2] {
    let corners = (0..8).map(|k: usize| {
        let own = Vector3::from_fn(|i, _| if k >> i & 1 == 1 { [0.2, 0.3, 0.5][i] } else { 0.0 });
        turn * own * scale + Vector3::from(position)
    });
    let (mut low, mut high) = (Vector3::repeat(f64::MAX), Vector3::repeat(f64::MIN));
    corners.for_each(|x| (low, high) = (low.inf(&x), high.sup(&x)));
    [low, high]
}

fn surface(run: &Run, body: &str, part: usize) -> [Vector3<f64>; 2] {
    let body = run.model.bodies.iter().find(|own| own.name == body);
    let surfaces = body.map(|body| run.model.surfaces(body)).unwrap_or_default();
    surfaces.get(part).map_or([Vector3::repeat(f64::NAN); 2], holonom::model::BodySurface::ends)
}

/// A mesh as the picture of a body whose mass is stated, with its colours.
fn drawn_mesh() -> Case {
    let position = [0.1, -0.2, 0.3];
    let text = [
        head("mesh", "step = 1e-3, end = 1e-3"),
        body("brick", 2.0, [1.0, 1.1, 1.2]),
        format!(
            "shape = {{ type = \"mesh\", file = \"brick.obj\", scale = 0.5, quaternion = {TURN:?}, position = {position:?} }}\n"
        ),
        "color = \"#0a141e\"\nopacity = 0.25\n".into(),
        body_at([2.0, 0.0, 0.0], "hidden", 2.0, [1.0, 1.1, 1.2]),
        "shape = { type = \"box\", dimensions = [0.1, 0.2, 0.3] }\nvisible = false\n".into(),
    ]
    .concat();
    Case::new("picture of a mesh", text, move |run| {
        let mut checks = Checks::default();
        let [low, high] = surface(run, "brick", 0);
        let expected = ends(0.5, turn(), position);
        checks.vector("low", low, expected[0], 1e-12);
        checks.vector("high", high, expected[1], 1e-12);
        let scene = Scene::initial(&run.model).unwrap();
        let scene = serde_json::to_value(scene.unwrap()).unwrap();
        let of = |name: &str, key: &str| {
            let bodies = scene["bodies"].as_array().unwrap();
            bodies.iter().find(|body| body["name"] == name).map_or(Value::Null, |b| b[key].clone())
        };
        checks.holds("colour", of("brick", "color") == serde_json::json!([10, 20, 30]));
        checks.holds("opacity", of("brick", "opacity") == 0.25);
        checks.holds("visible", of("brick", "visible") == true);
        checks.holds("hidden", of("hidden", "visible") == false);
        checks.holds("shape", of("hidden", "shape") == "box");
        checks.holds("size", of("hidden", "dimensions") == serde_json::json!([0.1, 0.2, 0.3]));
        checks.holds("colour of the other", of("hidden", "color").is_null());
        checks.holds("opacity of the other", of("hidden", "opacity") == 1.0);
        checks
    })
    .file("brick.obj", brick())
    .file("cube.obj", cube())
    .blind("body.mass", "pictures weigh nothing")
    .blind("body.inertia", "pictures weigh nothing")
    .blind("body.position", "of the body, not of its picture")
}

/// Shapes in the place of a shape.
fn picture() -> Case {
    let round = |kind: &str, dimensions: &str, x: f64| {
        format!(
            "{{ type = \"{kind}\", dimensions = {dimensions}, position = [{x:?}, 0.0, 0.0] }},\n"
        )
    };
    let text = [
        head("picture", "step = 1e-3, end = 1e-3"),
        body("hammer", 2.0, [1.0, 1.1, 1.2]) + "picture = [\n",
        format!(
            "{{ type = \"box\", dimensions = [0.2, 0.3, 0.5], position = [1.0, 2.0, 3.0], quaternion = {TURN:?} }},\n"
        ),
        format!(
            "{{ type = \"mesh\", file = \"brick.obj\", scale = [2.0, 2.0, 2.0], position = [0.1, 0.2, 0.3], quaternion = {TURN:?} }},\n"
        ),
        round("sphere", "[0.2]", 1.0),
        round("cylinder", "[0.2, 0.5]", 2.0),
        round("rod", "[0.6, 0.1]", 3.0),
        round("cone", "[0.2, 0.8]", 4.0),
        round("capsule", "[0.2, 0.5]", 5.0),
        round("ellipsoid", "[0.2, 0.2, 0.4]", 6.0) + "]\n",
    ]
    .concat();
    Case::new("picture", text, |run| {
        let mut checks = Checks::default();
        let half = turn() * Vector3::new(0.1, 0.15, 0.25);
        let center: [f64; 3] = (Vector3::new(1.0, 2.0, 3.0) - half).into();
        for (part, expected) in
            [ends(1.0, turn(), center), ends(2.0, turn(), [0.1, 0.2, 0.3])].into_iter().enumerate()
        {
            let [low, high] = surface(run, "hammer", part);
            checks.vector("low", low, expected[0], 1e-12);
            checks.vector("high", high, expected[1], 1e-12);
        }
        // radius, least and largest height; circles are polygons
        let round = [
            (0.2, -0.2, 0.2),
            (0.2, -0.25, 0.25),
            (0.1, -0.3, 0.3),
            (0.2, -0.6, 0.2),
            (0.2, -0.45, 0.45),
            (0.2, -0.4, 0.4),
        ];
        for (k, (radius, low, high)) in round.into_iter().enumerate() {
            let ends = surface(run, "hammer", 2 + k);
            for (found, sign, height) in [(ends[0], -1.0, low), (ends[1], 1.0, high)] {
                let across = [1.0 + k as f64 + sign * radius, sign * radius];
                checks.all("radius", &found.as_slice()[..2], &across, 0.06 * radius);
                checks.near("height", found.z, height, 1e-12);
            }
        }
        checks
    })
    .file("brick.obj", brick())
    .file("cube.obj", cube())
    .blind("body.mass", "pictures weigh nothing")
    .blind("body.inertia", "pictures weigh nothing")
}

pub(crate) fn cases() -> Vec<Case> {
    vec![heavy_mesh(), drawn_mesh(), picture()]
}
