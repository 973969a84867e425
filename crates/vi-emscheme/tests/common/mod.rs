//! The models of these tests.
#![allow(clippy::unwrap_used)] // a helper of tests
#![allow(dead_code, unreachable_pub)] // each test uses its share

use nalgebra::{Matrix3, Vector3};
use vi_constraints::Constraints;
use vi_emscheme::gonzalez::Gonzalez;
use vi_emscheme::load::AtMidpoint;
use vi_emscheme::{EmForm, EmIntegrator, EmOptions, EmSystem};
use vi_multibody::joint::{self, FrameId, Joint, Side, complete_axis};
use vi_multibody::joint_coordinate::JointCoordinate;
use vi_multibody::joint_force::{JointForce, JointSpring, PdControl, Setpoint, Viscous};
use vi_multibody::mechanism::{
    Attachment, Bar, BarEnd, BodySpec, Description, Mechanism, ParticleSpec,
};
use vi_multibody::pair::columns::{Act, Axis};
use vi_multibody::scalar_constraint::ScalarConstraint;
use vi_multibody::spring::{Damper, Spring, SpringLaw};
use vi_multibody::{PairKind, mechanism};
use vi_rigid::body::RigidBody;
use vi_rigid::inertia::EulerMoments;
use vi_rigid::load::{Load, LoadKind};
use vi_rigid::{TimeHistory, directors, rotation};

/// A mechanism with its springs: everything a run needs.
#[derive(Clone)]
pub struct Model {
    pub mechanism: Mechanism,
    pub springs: Vec<Spring>,
    /// Of the first joint.
    pub coordinates: Vec<Option<JointCoordinate>>,
    pub h: f64,
}

impl Model {
    pub fn system(&self) -> EmSystem {
        let system = EmSystem::of_mechanism(&self.mechanism);
        self.springs.iter().cloned().fold(system, EmSystem::spring)
    }

    pub fn run(&self, form: EmForm, h: f64) -> EmIntegrator<Mechanism> {
        self.run_by(form, 2, h)
    }

    pub fn run_by(&self, form: EmForm, order: u32, h: f64) -> EmIntegrator<Mechanism> {
        let composition = vi_core::Composition::of_order(order).unwrap();
        let options = EmOptions::new(form, h).composition(composition);
        vi_emscheme::run::integrator(self.system(), self.mechanism.clone(), options).unwrap()
    }

    pub fn spring(
        mut self,
        (a, point_a): (Attachment, [f64; 3]),
        (b, point_b): (Attachment, [f64; 3]),
        (stiffness, natural_length, law): (f64, f64, SpringLaw),
    ) -> Self {
        let end = |member, point: [f64; 3]| self.mechanism.point_of(member, &point.into());
        let between = end(b, point_b).minus(&end(a, point_a));
        self.springs.push(Spring { between, stiffness, natural_length, law });
        self
    }
}

fn model(description: Description, h: f64) -> Model {
    let mut mechanism = Mechanism::new(description);
    let freedoms = mechanism.description().joints.first().map_or(0, |joint| joint.kind.dof());
    let coordinates = (0..freedoms).map(|freedom| mechanism.coordinate(0, freedom)).collect();
    Model { mechanism, springs: Vec::new(), coordinates, h }
}

/// The pendulum of theory §3, started with a push.
pub fn pendulum() -> Model {
    pendulum_with(-0.7)
}

/// The same, released at rest.
pub fn pendulum_from_rest() -> Model {
    pendulum_with(0.0)
}

fn pendulum_with(speed: f64) -> Model {
    let bob = ParticleSpec {
        name: "bob".into(),
        mass: 1.0,
        position: Vector3::new(1.0, 0.0, 0.0),
        velocity: Vector3::new(0.0, speed, 0.0),
    };
    let from = BarEnd::Ground(Vector3::zeros());
    let rod = Bar { name: "rod".into(), from, to: 0, length: 1.0 };
    let description = Description {
        dimension: 2,
        gravity: Vector3::new(0.0, -9.81, 0.0),
        particles: vec![bob],
        bars: vec![rod],
        ..Description::default()
    };
    model(description, 0.02)
}

fn body(name: &str, k: usize) -> BodySpec {
    let turn = rotation::exp(&Vector3::new(0.3 + 0.5 * k as f64, -0.4, 0.7));
    BodySpec {
        name: name.into(),
        body: Some(RigidBody::new(1.5 - 0.6 * k as f64, EulerMoments([0.04, 0.09, 0.02])).unwrap()),
        center: Vector3::new(0.7 * k as f64, 0.4 * k as f64, -0.2),
        triad: turn,
        velocity: Vector3::new(0.3, -0.5, 0.4 + 0.5 * k as f64),
        omega: Vector3::new(1.5, -0.8 + k as f64, 2.1),
    }
}

fn frame(body: &BodySpec) -> [f64; 12] {
    let mut q = [0.0; 12];
    directors::set_frame(&mut q, &body.center, &body.triad);
    q
}

/// A heavy top: one body on a spherical joint to the ground.
pub fn heavy_top() -> Model {
    let mut top = body("top", 0);
    top.omega = top.triad * Vector3::new(0.3, 0.2, 25.0);
    let anchor = Vector3::new(0.0, 0.0, -0.5);
    top.center = -(top.triad * anchor);
    let side = |frame, anchor| Side { frame, anchor, axes: Matrix3::identity() };
    let joint = Joint {
        name: "tip".into(),
        kind: PairKind::Spherical,
        parent: side(FrameId::Ground, Vector3::zeros()),
        child: side(FrameId::Frame(0), anchor),
    };
    let description = Description {
        dimension: 3,
        gravity: Vector3::new(0.0, 0.0, -9.81),
        bodies: vec![top],
        joints: vec![joint],
        ..Description::default()
    };
    model(description, 0.005)
}

/// The same with a lamina: `E_3 = 0`, a singular mass matrix.
pub fn lamina() -> Model {
    let mut description = heavy_top().mechanism.description().clone();
    let top = &mut description.bodies[0];
    top.body = Some(RigidBody::new(1.5, EulerMoments([0.04, 0.09, 0.0])).unwrap());
    model(description, 0.005)
}

/// Two free-floating bodies in a kinematic pair with springs of both laws between them; `reversed`:
/// the joint is stated from body 1 to body 0, against the order of the tree.
pub fn pair(kind: PairKind, reversed: bool) -> Model {
    let bodies = vec![body("first", 0), body("second", 1)];
    let axes = complete_axis(&Vector3::new(1.0, 2.0, -2.0).normalize());
    let at = Vector3::new(0.3, 0.35, 0.1);
    // a start with a gap along the degrees of freedom
    let slides = kind.properties().motion.columns().iter();
    let gap: Vector3<f64> = slides
        .filter_map(|column| match (column.act, column.axis) {
            (Act::Slide, Axis::Parent(i)) => Some([0.2, -0.1, 0.3][i] * axes.column(i)),
            _ => None,
        })
        .sum();
    let side = |k: usize, point| Side::at(FrameId::Frame(k), &frame(&bodies[k]), point, &axes);
    let (p, c) = if reversed { (1, 0) } else { (0, 1) };
    let (parent, child) = (side(p, &at), side(c, &(at + gap)));
    let joint = Joint { name: kind.name().into(), kind, parent, child };
    let description =
        Description { dimension: 3, bodies, joints: vec![joint], ..Description::default() };
    use mechanism::Attachment::Body;
    model(description, 0.01)
        .spring(
            (Body(0), [0.4, 0.1, 0.0]),
            (Body(1), [0.1, -0.3, 0.2]),
            (40.0, 0.5, SpringLaw::Linear),
        )
        .spring(
            (Body(0), [-0.2, 0.3, 0.1]),
            (Body(1), [0.0, 0.4, -0.2]),
            (15.0, 0.7, SpringLaw::QuadraticStretch),
        )
}

/// Four particles, two bars, two springs (Gonzalez 1999), with `½ K (l² − l_0²)²` or
/// `½ K (l − l_0)²`.
pub fn four_particles(law: SpringLaw) -> Model {
    let particle = |k: usize, mass: f64, x: f64, y: f64| ParticleSpec {
        name: format!("particle {k}"),
        mass,
        position: Vector3::new(x, y, 0.0),
        velocity: Vector3::new(0.0, 0.0, if k == 3 { 2.0 / 1.7 } else { 0.0 }),
    };
    let bar = |a: usize, b: usize| Bar {
        name: format!("bar {a}-{b}"),
        from: BarEnd::Particle(a),
        to: b,
        length: 1.0,
    };
    let description = Description {
        dimension: 3,
        particles: vec![
            particle(0, 1.0, 0.0, 0.0),
            particle(1, 3.0, 1.0, 0.0),
            particle(2, 2.3, 0.0, 1.0),
            particle(3, 1.7, 1.0, 1.0),
        ],
        bars: vec![bar(0, 1), bar(2, 3)],
        ..Description::default()
    };
    use mechanism::Attachment::Particle;
    let none = [0.0; 3];
    model(description, 0.01)
        .spring((Particle(0), none), (Particle(2), none), (50.0, 1.0, law))
        .spring((Particle(1), none), (Particle(3), none), (500.0, 1.0, law))
}

/// The free-floating six-body linkage of the reference case 13.
pub fn linkage() -> Model {
    reference_case("13_sixr_cube", 0.01)
}

/// The four-bar loop of the reference case 12, with three redundant constraints.
pub fn four_bar() -> Model {
    reference_case("12_fourbar", 0.005)
}

/// Bodies and revolute joints of a reference case.
fn reference_case(name: &str, h: f64) -> Model {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/reference/rigid");
    let text = std::fs::read_to_string(format!("{folder}/{name}.json")).unwrap();
    let case: serde_json::Value = serde_json::from_str(&text).unwrap();
    let numbers = |value: &serde_json::Value| -> Vector3<f64> {
        Vector3::from_fn(|i, _| value[i].as_f64().unwrap())
    };
    let body = |b: &serde_json::Value| {
        let moments = numbers(&b["principal_inertia"]);
        let inertia = vi_rigid::inertia::PrincipalInertia::new(moments.into()).unwrap();
        let rigid = RigidBody::from_inertia(b["mass"].as_f64().unwrap(), &inertia).unwrap();
        BodySpec {
            name: b["name"].as_str().unwrap().into(),
            body: Some(rigid),
            center: numbers(&b["position"]),
            triad: Matrix3::from_fn(|i, j| b["directors"][i][j].as_f64().unwrap()),
            velocity: numbers(&b["velocity"]),
            omega: numbers(&b["omega"]),
        }
    };
    let bodies: Vec<BodySpec> = case["bodies"].as_array().unwrap().iter().map(body).collect();
    let joint = |j: &serde_json::Value| {
        let member = |key: &str| {
            usize::try_from(j[key].as_i64().unwrap()).map_or(FrameId::Ground, FrameId::Frame)
        };
        let triad = |id| match id {
            FrameId::Ground => Matrix3::identity(),
            FrameId::Frame(k) => bodies[k].triad,
        };
        let (p, c) = (member("parent"), member("child"));
        let axes = complete_axis(&numbers(&j["axis"]).normalize());
        let child_axes = triad(c).transpose() * triad(p) * axes;
        let side = |frame, key: &str, axes| Side { frame, anchor: numbers(&j[key]), axes };
        Joint {
            name: format!("joint {p:?}-{c:?}"),
            kind: PairKind::Revolute,
            parent: side(p, "anchor_parent", axes),
            child: side(c, "anchor_child", child_axes),
        }
    };
    let joints = case["joints"].as_array().unwrap().iter().map(joint).collect();
    let gravity = numbers(&case["gravity"]);
    model(Description { dimension: 3, gravity, bodies, joints, ..Description::default() }, h)
}

/// A system with one of everything: gravity-free pair with both springs, a spring by Gonzalez's
/// formula, a damper, a dead and a follower load; a spring, a damper and a control on every
/// coordinate of the joint.
pub fn loaded(model: &Model) -> EmSystem {
    let [first, second] = [0, 1].map(|k| model.springs[k].clone());
    let n = model.mechanism.dim();
    let damper = Damper { between: second.between.clone(), damping: 2.0 };
    let load = |offset, kind| {
        let (force, torque) = (Vector3::new(0.7, -1.1, 0.4), Vector3::new(-0.3, 0.5, 0.8));
        Load::new(offset, kind, force, torque, TimeHistory::default()).unwrap()
    };
    let mut system = model
        .system()
        .gradient(Gonzalez::new(first, n))
        .load(AtMidpoint(damper))
        .load(load(0, LoadKind::Dead))
        .load(load(12, LoadKind::Follower));
    for (freedom, coordinate) in model.coordinates.iter().enumerate() {
        let Some(coordinate) = coordinate.clone() else { continue };
        let damper = JointForce { coordinate: coordinate.clone(), law: Viscous(0.7) };
        let reference = std::sync::Arc::new(|t: f64| Setpoint {
            value: (3.0 * t).sin(),
            rate: 3.0 * (3.0 * t).cos(),
        });
        let law = PdControl { proportional: 4.0, derivative: 0.3, reference };
        let spring = joint_spring(model, freedom).unwrap();
        let control = JointForce { coordinate, law };
        system = system.gradient(spring).load(damper).load(control);
    }
    system
}

/// A spring on a coordinate of the first joint.
pub fn joint_spring(model: &Model, freedom: usize) -> Option<JointSpring> {
    let coordinate = model.coordinates.get(freedom)?.clone()?;
    Some(JointSpring { coordinate, stiffness: 6.0, rest: 0.4 })
}

/// A screw between two free-floating bodies: a row that is not quadratic.
pub fn screw() -> Model {
    pair(PairKind::Screw(0.15.into()), false)
}

/// Two bodies under gravity: a hinge to the ground whose angle is prescribed, and a free hinge
/// between them.
pub fn driven() -> Model {
    let mut bodies = vec![body("first", 0), body("second", 1)];
    let (base, axes) =
        (Vector3::new(0.0, 0.35, 0.1), complete_axis(&Vector3::new(1.0, 2.0, -2.0).normalize()));
    let rate: Vector3<f64> = 2.0 * axes.column(2); // both turn with the first hinge
    for body in &mut bodies {
        (body.omega, body.velocity) = (rate, rate.cross(&(body.center - base)));
    }
    let hinge =
        |name: &str, [parent, child]: [FrameId; 2], at: Vector3<f64>, axes: &Matrix3<f64>| {
            let side = |id| match id {
                FrameId::Ground => Side::at(id, &joint::GROUND, &at, axes),
                FrameId::Frame(k) => Side::at(id, &frame(&bodies[k]), &at, axes),
            };
            let (parent, child) = (side(parent), side(child));
            Joint { name: name.into(), kind: PairKind::Revolute, parent, child }
        };
    let ground = [FrameId::Ground, FrameId::Frame(0)];
    let between = [FrameId::Frame(0), FrameId::Frame(1)];
    let joints = vec![
        hinge("base", ground, base, &axes),
        hinge("elbow", between, Vector3::new(0.6, 0.3, 0.2), &complete_axis(&Vector3::x())),
    ];
    let angle = JointCoordinate::principal(&joints[0], 0).unwrap();
    let path = |t: f64| [(2.0 * t).sin(), 2.0 * (2.0 * t).cos(), -4.0 * (2.0 * t).sin()];
    let scalars = vec![ScalarConstraint::motion("drive", angle, std::sync::Arc::new(path))];
    let gravity = Vector3::new(0.0, 0.0, -9.81);
    model(
        Description { dimension: 3, gravity, bodies, joints, scalars, ..Description::default() },
        0.01,
    )
}

/// A chain of three free-floating bodies with two revolute joints that a gear couples.
pub fn geared() -> Model {
    let bodies: Vec<BodySpec> = (0..3).map(|k| body(&format!("body {k}"), k % 2)).collect();
    let joint = |k: usize, axis: Vector3<f64>| {
        let axes = complete_axis(&axis.normalize());
        let at = Vector3::new(0.3 * k as f64, 0.35, 0.1);
        let side = |k: usize| Side::at(FrameId::Frame(k), &frame(&bodies[k]), &at, &axes);
        let (parent, child) = (side(k), side(k + 1));
        Joint { name: format!("hinge {k}"), kind: PairKind::Revolute, parent, child }
    };
    let joints =
        vec![joint(0, Vector3::new(1.0, 2.0, -2.0)), joint(1, Vector3::new(0.2, -1.0, 1.0))];
    let q: Vec<f64> = bodies.iter().flat_map(frame).collect();
    let coordinate = |k: usize| JointCoordinate::principal(&joints[k], 0).unwrap();
    let gear = ScalarConstraint::gear("gear", coordinate(0), coordinate(1), -1.7, &q);
    let scalars = vec![gear];
    model(Description { dimension: 3, bodies, joints, scalars, ..Description::default() }, 0.01)
}

/// Everything above, by name.
pub fn all() -> Vec<(String, Model)> {
    let mut models = vec![
        ("pendulum".to_owned(), pendulum()),
        ("heavy top".to_owned(), heavy_top()),
        ("lamina".to_owned(), lamina()),
        ("linkage 6R".to_owned(), linkage()),
        ("four-bar".to_owned(), four_bar()),
        ("screw".to_owned(), screw()),
        ("gear".to_owned(), geared()),
        ("4 particles, linear".to_owned(), four_particles(SpringLaw::Linear)),
        ("4 particles, quadratic".to_owned(), four_particles(SpringLaw::QuadraticStretch)),
    ];
    for kind in PAIRS {
        for reversed in [false, true] {
            let way = if reversed { " reversed" } else { "" };
            models.push((format!("{}{way}", kind.name()), pair(kind, reversed)));
        }
    }
    models
}

/// The pairs of the paper, and the universal joint.
pub const PAIRS: [PairKind; 6] = [
    PairKind::Spherical,
    PairKind::Revolute,
    PairKind::Cylindrical,
    PairKind::Prismatic,
    PairKind::Planar,
    PairKind::Universal,
];

/// Largest absolute difference.
pub fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |worst: f64, (a, b)| worst.max((a - b).abs()))
}
