//! Beams: places and directors of their nodes, momenta of consistent and lumped masses, held ends.

use super::{Case, Checks, Run};
use holonom::nalgebra::{Matrix3, Rotation3, Vector3};
use vi_testkit::model::{along, beam, frame, head, heavy, load, part, soft_section};

type Vector = Vector3<f64>;

/// The directors of a section whose tangent and `normal` are given.
fn directors(tangent: Vector, normal: Vector) -> Matrix3<f64> {
    let d3 = tangent.normalize();
    let d1 = (normal - normal.dot(&d3) * d3).normalize();
    Matrix3::from_columns(&[d1, d3.cross(&d1), d3])
}

/// Nodes between two points, the first of which has the number `first`.
fn leg(
    run: &Run,
    checks: &mut Checks,
    beam: &str,
    first: usize,
    ends: [Vector; 2],
    count: usize,
    normal: Vector,
) {
    for k in 0..=count {
        let name = format!("{beam}.{}", first + k);
        let x = ends[0] + (ends[1] - ends[0]) * (k as f64 / count as f64);
        checks.vector("node", run.place(&name, 0), x, 1e-12);
        checks.matrix(
            "directors",
            run.directors(&name, 0),
            directors(ends[1] - ends[0], normal),
            1e-12,
        );
    }
}

/// Two legs of different elements with a normal for each, of order 2, in a frame, and a straight
/// one.
fn legs() -> Case {
    let text = [
        head("legs", "step = 1e-5, end = 1e-5"),
        frame("tilted", [0.3, 0.5, -0.8], [0.1, 0.3, 0.2]),
        part("frame", "other") + "position = [0.0, 1.0, 3.0]\n",
        part("beam", "bent") + "relative_to = \"tilted\"\n",
        "points = [[0.0, 0.1, 0.2], [0.6, 0.0, 0.1], [0.6, 0.4, 0.3]]\n".into(),
        "elements = [2, 3]\norder = 2\nnormal = [[0.1, 0.0, 1.0], [1.0, 0.2, 0.0]]\n".into(),
        soft_section(),
        beam("straight", &[[2.0, 0.0, 0.0], [2.0, 0.5, 0.7]], 4) + "normal = [0.0, -0.3, 1.0]\n",
        soft_section(),
    ]
    .concat();
    Case::new("legs of beams", text, |run| {
        let mut checks = Checks::default();
        let tilt = Rotation3::new(Vector::new(0.3, 0.5, -0.8));
        let at = |x: f64, y: f64, z: f64| Vector::new(0.1, 0.3, 0.2) + tilt * Vector::new(x, y, z);
        let corners = [at(0.0, 0.1, 0.2), at(0.6, 0.0, 0.1), at(0.6, 0.4, 0.3)];
        leg(
            run,
            &mut checks,
            "bent",
            0,
            [corners[0], corners[1]],
            4,
            tilt * Vector::new(0.1, 0.0, 1.0),
        );
        leg(
            run,
            &mut checks,
            "bent",
            5,
            [corners[1], corners[2]],
            6,
            tilt * Vector::new(1.0, 0.2, 0.0),
        );
        let ends = [Vector::new(2.0, 0.0, 0.0), Vector::new(2.0, 0.5, 0.7)];
        leg(run, &mut checks, "straight", 0, ends, 4, Vector::new(0.0, -0.3, 1.0));
        checks.near("nodes", run.frames() as f64, 5.0 + 7.0 + 5.0, 0.1);
        checks
    })
    .blind("beam.section", "nodes alone are judged")
    .blind("beam.normal", "a direction of any length, but for its entries across the tangent")
    .blind("frame.position", "of the other one")
}

/// Consistent and lumped masses in a rigid motion.
fn masses() -> Case {
    let text = [
        head("masses", "step = 1e-5, end = 1e-5"),
        beam("lumped", &[[0.2, 0.0, 0.0], [1.7, 0.0, 0.0]], 3),
        "normal = [0.0, 0.0, 1.0]\nmass = \"lumped\"\n".into(),
        "velocity = [0.4, -0.2, 0.9]\nangular_velocity = [0.7, 1.3, -0.5]\n".into(),
        soft_section(),
        beam("consistent", &[[0.0, 3.0, 0.0], [0.0, 3.0, 0.8]], 2),
        "normal = [1.0, 0.0, 0.0]\n".into(),
        soft_section(),
    ]
    .concat();
    Case::new("masses of beams", text, |run| {
        let mut checks = Checks::default();
        let (v, w, length) = (Vector::new(0.4, -0.2, 0.9), Vector::new(0.7, 1.3, -0.5), 1.5);
        let (mut linear, mut angular) = (Vector::zeros(), Vector::zeros());
        for k in 0..4 {
            let share = if k == 0 || k == 3 { 0.5 } else { 1.0 };
            let arm = Vector::new(0.5 * f64::from(k), 0.0, 0.0);
            let p = 0.1 * 0.5 * share * (v + w.cross(&arm));
            linear += p;
            angular += (Vector::new(0.2, 0.0, 0.0) + arm).cross(&p);
        }
        // d_1 = z, d_2 = −y, d_3 = x
        angular += length * Vector::new(3e-3 * w.x, 2e-3 * w.y, 1e-3 * w.z);
        checks.vector("momentum", run.linear_momentum(0), linear, 1e-12);
        checks.vector("angular momentum", run.angular_momentum(0), angular, 1e-12);
        checks
    })
    .blind("beam.name", "nothing names them")
    .blind("beam.points", "of the one at rest")
    .blind("beam.elements", "of the one at rest")
    .blind("beam.normal", "of the one at rest; a direction of any length")
    .blind("beam.section", "its stiffness does not count in a rigid motion: see the sections")
}

/// Ends that are clamped or pinned, under gravity.
fn ends() -> Case {
    let text = [
        heavy("ends", [3.0, -5.0, -8.0], "step = 2e-3, end = 0.1"),
        beam("both", &[[0.2, 0.0, 0.0], [1.7, 0.0, 0.0]], 3),
        "normal = [0.0, 0.0, 1.0]\nstart = \"clamped\"\nend = \"pinned\"\n".into(),
        soft_section(),
        beam("other", &[[0.0, 3.0, 0.0], [0.0, 3.0, 0.8]], 2),
        "normal = [1.0, 0.0, 0.0]\nstart = \"pinned\"\nend = \"clamped\"\n".into(),
        soft_section(),
    ]
    .concat();
    Case::new("held ends of beams", text, |run| {
        let mut checks = Checks::default();
        let last = run.last();
        let held = [
            ("both.0", Vector::new(0.2, 0.0, 0.0), true),
            ("both.3", Vector::new(1.7, 0.0, 0.0), false),
            ("other.0", Vector::new(0.0, 3.0, 0.0), false),
            ("other.2", Vector::new(0.0, 3.0, 0.8), true),
        ];
        for (name, x, clamped) in held {
            checks.vector("place", run.place(name, last), x, 1e-12);
            let turned = (run.directors(name, last) - run.directors(name, 0)).amax();
            if clamped {
                checks.near("clamped directors", turned, 0.0, 1e-12);
            } else {
                checks.near("pinned directors", turned, 0.5, 0.4999);
            }
        }
        checks
    })
    .blind("beam.section", "held ends alone are judged")
    .blind("beam.points", "as they are drawn")
    .blind("beam.elements", "held ends alone are judged")
    .blind("beam.normal", "held ends alone are judged")
    .blind("model.gravity", "that it moves is enough")
}

/// One element whose end slides across it under a force, `w_n = (1 − cos nϑ) f/k`, `cos ϑ = 1 −
/// ½h²k/m` with the mass `m = ρAℓ/3 + h²(¼k + N̂/ℓ)` and the stiffness `k = GA_1/ℓ`, of order 4
/// that of the shear and the bending in a row.
fn tension() -> Case {
    const LENGTH: f64 = 0.5;
    let slider = |name: &str, y: f64, element: &str, bound: f64| {
        let end = format!("{name}.end");
        [
            beam(name, &[[0.0, y, 0.0], [LENGTH, y, 0.0]], 1),
            format!("element = \"{element}\"\ntension = {bound:?}\n"),
            "normal = [0.0, 1.0, 0.0]\nstart = \"clamped\"\n".into(),
            soft_section(),
            along(
                [0.0, 1.0, 0.0],
                "prismatic",
                &format!("{name}_slide"),
                ["ground", &end],
                [LENGTH, y, 0.0],
            ),
            load(&format!("{name}_push"), &end, [[0.0, 1e-3, 0.0], [0.0; 3]]),
        ]
        .concat()
    };
    let text = [
        head("tension", "step = 1e-3, end = 0.02"),
        slider("shears", 0.0, "second_order", 2e4),
        slider("stiff", 1.0, "helicoidal", 5e4),
    ]
    .concat();
    Case::new("tension mass", text, |run| {
        let mut checks = Checks::default();
        let (h, last) = (1e-3, run.last());
        let condensed = 1.0 / (1.0 / 25.0 + LENGTH * LENGTH / (12.0 * 0.7));
        for (name, y, shear, bound) in [("shears", 0.0, 25.0, 2e4), ("stiff", 1.0, condensed, 5e4)]
        {
            let (stiffness, inertia) = (shear / LENGTH, 0.1 * LENGTH / 3.0);
            let mass = inertia + h * h * (0.25 * stiffness + bound / LENGTH);
            let angle = (1.0 - 0.5 * h * h * stiffness / mass).acos();
            let expected = 1e-3 / stiffness * (1.0 - (20.0 * angle).cos());
            let place = run.place(&format!("{name}.1"), last).y - y;
            checks.near(name, place / expected, 1.0, 1e-8);
        }
        checks
    })
    .blind("beam.element dropped", "it is the default")
    .blind("beam.element `helicoidal` → `rope`", "a rope has the same stiffness")
    .blind("beam.points", "a beam that is drawn backwards slides as well")
    .blind("beam.section", "shear, and bending across it, alone count")
    .blind("joint.name", "the slides are alike")
    .blind("joint.position", "a slide has no place")
    .blind("joint.type", "it does not turn")
    .blind("load.force", "across the slide nothing moves")
    .blind("load.name", "the loads are alike")
    .blind("load.torque", "it does not turn")
    .blind("beam.normal", "a direction of any length")
    .blind("joint.axis", "a direction of any length")
}

/// Section forces of beams whose stress-free shape or stress is stated, clamped as drawn; a slack
/// rope that moves.
fn rests() -> Case {
    let held = "start = \"clamped\"\nend = \"clamped\"\nnormal = [0.0, 0.0, 1.0]\n";
    let forces = |name: &str| {
        part("sensor", &format!("{name}_forces"))
            + &format!("type = \"section_force\"\nof = \"{name}\"\nelement = 1\n")
    };
    let own = |name: &str, y: f64, stated: &str| {
        [
            beam(name, &[[0.0, y, 0.0], [1.5, y, 0.0]], 3) + held + stated,
            soft_section(),
            forces(name),
        ]
        .concat()
    };
    let text = [
        head("rests", "step = 1e-5, end = 1e-5"),
        own("stretched", 0.0, "length = 1.2\n"),
        beam("rope", &[[0.0, 1.0, 0.0], [1.5, 1.0, 0.0]], 3),
        "element = \"rope\"\nlength = 1.8\nvelocity = [1.0, 0.0, 0.0]\n".into(),
        "normal = [0.0, 0.0, 1.0]\n".into(),
        soft_section(),
        forces("rope"),
        own("bent", 2.0, "curvature = [0.2, -0.3, 0.5]\n"),
        own("pulled", 3.0, "prestress = 7.0\n"),
    ]
    .concat();
    Case::new("stress as drawn", text, |run| {
        let mut checks = Checks::default();
        let expected = [
            ("stretched", [0.0, 0.0, 90.0 * (1.5 / 1.2 - 1.0), 0.0, 0.0, 0.0]),
            ("rope", [0.0; 6]),
            ("bent", [0.0, 0.0, 0.0, -0.4 * 0.2, 0.7 * 0.3, -0.3 * 0.5]),
            ("pulled", [0.0, 0.0, 7.0, 0.0, 0.0, 0.0]),
        ];
        for (name, expected) in expected {
            let columns = run.columns_of(&format!("{name}_forces"));
            let found: Vec<f64> = columns.iter().map(|column| column[0]).collect();
            checks.all(name, &found, &expected, 1e-10);
        }
        let momentum = Vector::new(0.1 * 1.8, 0.0, 0.0);
        checks.vector("momentum", run.linear_momentum(0), momentum, 1e-12);
        checks
    })
    .blind("beam.name", "the names of sensors alone count")
    .blind("beam.points", "straight from clamp to clamp")
    .blind("beam.elements", "all have the same forces")
    .blind("beam.normal", "a direction of any length")
    .blind("beam.start", "nothing has moved yet")
    .blind("beam.end", "nothing has moved yet")
    .blind("beam.section", "inertia and the stiffness of what has no strain do not count")
    .blind("sensor.element", "all have the same forces")
}

pub(crate) fn cases() -> Vec<Case> {
    vec![legs(), masses(), ends(), tension(), rests()]
}
