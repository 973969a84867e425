//! Derivatives of the equations of a step, and of the start, by every number of random mechanisms,
//! against differences of mechanisms whose numbers are changed.

#![allow(non_snake_case, clippy::float_cmp)] // G, M; numbers that are exact

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use std::sync::Arc;
use vi_constraints::design::{Costates, Design, Place};
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::{Constraints, InitialValues};
use vi_core::force::MidpointForce;
use vi_core::linear::{dot, norm_inf};
use vi_core::num_dual::Dual64;
use vi_core::{Configuration, DiscreteLagrangian, Interval, Quadrature, State};
use vi_multibody::builder::{ElementForce, Inertia, MechanismBuilder};
use vi_multibody::design::start::{self, StartCoordinate, StartDerivativeError};
use vi_multibody::design::velocity::{DifferentiatedVelocity, NodeMass};
use vi_multibody::design::{
    BarTangent, BodyTangent, EffortChange, JointTangent, MechanismDesign, MechanismTangent,
    ScalarTangent, SpringTangent, WholeForce,
};
use vi_multibody::form::Form;
use vi_multibody::joint_coordinate::JointCoordinate;
use vi_multibody::joint_force::{JointForce, Motor, Viscous};
use vi_multibody::mechanism::BarEnd;
use vi_multibody::particle_load::ParticleLoad;
use vi_multibody::scalar_constraint::{ScalarConstraint, ScalarRow};
use vi_multibody::spring::Damper;
use vi_multibody::{ForceElements, FrameId, Mechanism, PairKind};
use vi_rigid::body::RigidBody;
use vi_rigid::inertia::EulerMoments;
use vi_rigid::load::{Load, LoadChange};
use vi_rigid::time_history::TimeHistory;
use vi_testkit::Sample;

/// Bodies on joints of all pairs but screws, coupled by everything that has numbers.
fn mechanism(seed: u64) -> (Mechanism, ForceElements) {
    let mut random = Sample::new(seed);
    let mut builder = MechanismBuilder::new().gravity([0.3, -1.0, -9.0]);
    let kinds = [
        PairKind::Revolute,
        PairKind::Prismatic,
        PairKind::Cylindrical,
        PairKind::Planar,
        PairKind::Universal,
        PairKind::Spherical,
        PairKind::Fixed,
    ];
    let (mut frames, mut ids) = (vec![FrameId::Ground], Vec::new());
    let mut coordinates = Vec::new();
    for (k, kind) in kinds.into_iter().enumerate() {
        let inertia = Inertia::principal(2.0 + random.number(), [1.0, 1.2, 1.5]);
        let body = builder.body(&format!("body {k}"), inertia).at(2.0 * random.vector());
        let body = body.rotation_vector(random.vector()).id();
        let mut sides = [frames[random.index(k + 1)], body.into()];
        if random.index(2) == 0 {
            sides.reverse();
        }
        let joint = builder.joint(&format!("joint {k}"), kind, sides[0], sides[1]);
        let joint = joint.at(random.vector()).axis(random.vector()).id();
        for freedom in 0..kind.coordinate_count() {
            let at = joint.coordinate(freedom);
            coordinates.push(at);
            builder.joint_spring(at, 5.0, 0.2);
            builder.joint_force(at, Viscous(0.7)).named("damper");
        }
        frames.push(body.into());
        ids.push(body);
    }
    builder.gear("gear", coordinates[0], coordinates[1], 0.7);
    builder.motion("path", coordinates[2], |t| [0.1 + 0.3 * t, 0.3, 0.0]);
    builder.distance_of_length(
        "rod",
        ids[0].point([0.1, 0.2, 0.3]),
        ids[3].point([0.3, 0.1, 0.0]),
        1.3,
    );
    builder
        .spring(ids[1].point([0.1, 0.0, 0.2]), ids[4].point([0.0, 0.3, 0.1]), 7.0)
        .natural_length(0.4);
    builder
        .damper(ids[2].point([0.1, 0.1, 0.2]), ids[5].point([0.0, 0.3, 0.4]), 0.9)
        .named("between");
    builder
        .load(ids[2])
        .force([1.0, 2.0, 0.5])
        .torque([0.3, 0.1, -0.4])
        .follower()
        .point([0.1, 0.2, 0.3]);
    builder.load(ids[3]).force([1.0, 2.0, 0.5]).torque([0.3, 0.1, -0.4]).point([0.1, 0.2, 0.3]);
    let a = builder.particle("a", 0.7, [0.4, 0.2, 0.1], [0.0; 3]);
    let b = builder.particle("b", 0.9, [1.0, 0.3, 0.2], [0.0; 3]);
    builder.bar("to ground", BarEnd::Ground(Vector3::new(0.0, 0.1, 0.0)), a);
    builder.bar("between", a, b);
    builder.particle_load(b, [0.2, 0.5, 0.1], TimeHistory::default());
    let built = builder.build().unwrap();
    (built.mechanism, built.forces)
}

/// A force element whose numbers change.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Element {
    Spring(usize),
    Force(usize),
}

/// The mechanism whose numbers are changed by `e` times a tangent.
fn changed(
    mechanism: &Mechanism,
    forces: &ForceElements,
    (tangent, element): (&MechanismTangent, Option<Element>),
    e: f64,
) -> (Mechanism, ForceElements) {
    let mut description = mechanism.description().clone();
    description.gravity += e * tangent.gravity;
    for (&k, change) in &tangent.bodies {
        let body = description.bodies[k].body.as_mut().unwrap();
        let euler = std::array::from_fn(|i| body.euler()[i] + e * change.euler[(i, i)]);
        *body = RigidBody::new(body.mass() + e * change.mass, EulerMoments(euler)).unwrap();
    }
    for (&k, change) in &tangent.particles {
        description.particles[k].mass += e * change;
    }
    for (&k, change) in &tangent.joints {
        let joint = &mut description.joints[k];
        for (side, change) in [(&mut joint.parent, change.parent), (&mut joint.child, change.child)]
        {
            side.anchor += e * change.anchor;
            side.axes += e * change.axes;
        }
    }
    for (&k, change) in &tangent.bars {
        let bar = &mut description.bars[k];
        bar.length += e * change.length;
        if let BarEnd::Ground(point) = &mut bar.from {
            *point += e * change.ground;
        }
    }
    let joints = description.joints.clone();
    let again = |own: &JointCoordinate| {
        let (joint, freedom) = own.place().unwrap();
        JointCoordinate::principal(&joints[joint], freedom).unwrap()
    };
    for (k, scalar) in description.scalars.iter_mut().enumerate() {
        let name = scalar.name.clone();
        let (row, change) = (scalar.rows[0].clone(), tangent.scalars.get(&k));
        match row {
            ScalarRow::Product(mut row) => {
                if let Some(ScalarTangent::Distance { between, length }) = change {
                    row.b = row.b.plus(&scaled(between, e));
                    row.a = row.b.clone();
                    row.target = (row.target.sqrt() + e * length).powi(2);
                }
                scalar.rows[0] = ScalarRow::Product(row);
            }
            ScalarRow::Gear { a, b, ratio, target } => {
                let (by_ratio, by_target) = match change {
                    Some(ScalarTangent::Gear { ratio, target }) => (*ratio, *target),
                    _ => (0.0, 0.0),
                };
                let (a, b) = (Box::new(again(&a)), Box::new(again(&b)));
                let (ratio, target) = (ratio + e * by_ratio, target + e * by_target);
                scalar.rows[0] = ScalarRow::Gear { a, b, ratio, target };
            }
            ScalarRow::Motion { coordinate, reference } => {
                let coordinate = again(&coordinate);
                let change = change.cloned();
                let reference = Arc::new(move |t: f64| {
                    let (mut own, by) = (
                        reference(t),
                        match &change {
                            Some(ScalarTangent::Motion(by)) => by(t),
                            _ => [0.0; 3],
                        },
                    );
                    own.iter_mut().zip(by).for_each(|(own, by)| *own += e * by);
                    own
                });
                *scalar = ScalarConstraint::motion(&name, coordinate, reference);
            }
            _ => {}
        }
    }
    let mut mechanism = Mechanism::new(description);
    let mut forces = forces.clone();
    for (&k, change) in &tangent.springs {
        let spring = &mut forces.springs[k];
        spring.between = spring.between.plus(&scaled(&change.between, e));
        spring.stiffness += e * change.stiffness;
        spring.natural_length += e * change.natural_length;
    }
    for (k, spring) in forces.joint_springs.iter_mut().enumerate() {
        let (joint, freedom) = spring.coordinate.place().unwrap();
        spring.coordinate = mechanism.coordinate(joint, freedom).unwrap();
        if element == Some(Element::Spring(k)) {
            spring.stiffness += e * 1.0;
            spring.rest += e * 0.4;
        }
    }
    for (k, own) in forces.forces.iter_mut().enumerate() {
        let changes = element == Some(Element::Force(k));
        match &mut own.force {
            ElementForce::Joint(JointForce { coordinate, law }) => {
                let (joint, freedom) = coordinate.place().unwrap();
                *coordinate = mechanism.coordinate(joint, freedom).unwrap();
                if changes {
                    *law = Arc::new(Viscous(0.7 + e));
                }
            }
            ElementForce::Body(load) => {
                if let Some(by) = tangent.loads.get(&k) {
                    let own = load_numbers();
                    let (force, torque) = (own.force + e * by.force, own.torque + e * by.torque);
                    let history = load.history().clone();
                    let made = Load::new(load.offset(), load.kind(), force, torque, history);
                    *load = made.unwrap().at(own.point + e * by.point).unwrap();
                }
            }
            ElementForce::Coordinates(force) if changes => match tangent.dampers.first() {
                Some((_, damper)) => {
                    let between = evaluated(&damper.between, e);
                    let damping = damper.damping.re + e * damper.damping.eps;
                    *force = Arc::new(Damper { between, damping });
                }
                None => {
                    let moved = Vector3::new(0.2, 0.5 + e, 0.1);
                    *force = Arc::new(particle_load(&mechanism, moved));
                }
            },
            _ => {}
        }
    }
    (mechanism, forces)
}

fn load_numbers() -> LoadChange {
    LoadChange {
        force: Vector3::new(1.0, 2.0, 0.5),
        torque: Vector3::new(0.3, 0.1, -0.4),
        point: Vector3::new(0.1, 0.2, 0.3),
    }
}

fn particle_load(mechanism: &Mechanism, force: Vector3<f64>) -> ParticleLoad {
    let offset = mechanism.particle_offset(1);
    ParticleLoad { offset, dimension: 3, force, history: TimeHistory::default() }
}

/// A form times a factor.
fn scaled(form: &Form, by: f64) -> Form {
    evaluated(&Form::constant(Vector3::zeros()).with_tangent(form), by)
}

/// `f + e f_θ`, entry by entry.
fn evaluated(form: &Form<Dual64>, e: f64) -> Form {
    let mut sum = Form::constant(form.constant_part().map(|x| x.re + e * x.eps));
    for term in form.terms() {
        let mut unit = Form::particle(term.offset, term.dimension);
        let c = term.coefficient.re + e * term.coefficient.eps;
        unit = if c == 0.0 { Form::constant(Vector3::zeros()) } else { times(unit, c) };
        sum = sum.plus(&unit);
    }
    sum
}

/// A form of one vector times a number, by the directors of a frame: their terms have any factor.
fn times(unit: Form, c: f64) -> Form {
    let term = unit.terms()[0];
    if term.offset % 12 == 0 || c == 1.0 {
        assert!(c.abs() == 1.0, "points have the factor one");
        return if c > 0.0 { unit } else { Form::constant(Vector3::zeros()).minus(&unit) };
    }
    let (frame, axis) = (term.offset / 12, (term.offset % 12 - 3) / 3);
    Form::vector(12 * frame, &Vector3::ith(axis, c))
}

/// A tangent of one number, with what it is.
fn tangents(
    mechanism: &Mechanism,
    forces: &ForceElements,
) -> Vec<(String, MechanismTangent, Option<Element>)> {
    let mut random = Sample::new(77);
    let mut list: Vec<(String, MechanismTangent, Option<Element>)> = Vec::new();
    let mut one = |name: String, change: &mut dyn FnMut(&mut MechanismTangent)| {
        let mut tangent = MechanismTangent::default();
        change(&mut tangent);
        list.push((name, tangent, None));
    };
    one("gravity".into(), &mut |t| t.gravity = Vector3::new(0.3, 0.1, 1.0));
    let description = mechanism.description();
    for k in 0..description.bodies.len() {
        let euler = Matrix3::from_diagonal(&Vector3::new(0.3, -0.1, 0.2));
        one(format!("mass {k}"), &mut |t| {
            let change = BodyTangent { mass: 1.0, moment: Vector3::zeros(), euler };
            t.bodies.insert(k, change);
        });
    }
    one("particle".into(), &mut |t| {
        t.particles.insert(1, 1.0);
    });
    for k in 0..description.joints.len() {
        one(format!("joint {k}"), &mut |t| {
            let mut side = || vi_multibody::design::SideTangent {
                anchor: random.vector(),
                axes: Matrix3::from_fn(|_, _| random.number()),
            };
            let change = JointTangent { parent: side(), child: side(), pitch: 0.0 };
            t.joints.insert(k, change);
        });
    }
    one("bar to the ground".into(), &mut |t| {
        let ground = Vector3::new(0.3, 0.2, 0.9);
        t.bars.insert(0, BarTangent { length: 0.4, ground });
    });
    one("bar".into(), &mut |t| {
        t.bars.insert(1, BarTangent { length: 1.0, ground: Vector3::zeros() });
    });
    for (k, scalar) in description.scalars.iter().enumerate() {
        let change = match &scalar.rows[0] {
            ScalarRow::Product(_) => {
                let between = Form::vector(12, &Vector3::new(0.3, 0.1, 0.2));
                ScalarTangent::Distance { between, length: 0.7 }
            }
            ScalarRow::Gear { .. } => ScalarTangent::Gear { ratio: 0.4, target: 0.3 },
            _ => ScalarTangent::Motion(Arc::new(|t: f64| [1.0 + t * t, 2.0 * t, 2.0])),
        };
        one(scalar.name.clone(), &mut |t| {
            t.scalars.insert(k, change.clone());
        });
    }
    one("spring".into(), &mut |t| {
        let between = Form::vector(24, &Vector3::new(0.1, 0.4, -0.2));
        let (stiffness, natural_length, damping) = (1.3, 0.6, 0.0);
        t.springs.insert(0, SpringTangent { between, stiffness, natural_length, damping });
    });
    let mut of_element = |element, name: String, tangent| list.push((name, tangent, Some(element)));
    for (k, spring) in forces.joint_springs.iter().enumerate() {
        let place = spring.coordinate.place().unwrap();
        let change =
            EffortChange::of_spring("", place, [spring.stiffness, spring.rest], [1.0, 0.4]);
        let tangent = MechanismTangent { efforts: vec![change], ..MechanismTangent::default() };
        of_element(Element::Spring(k), format!("joint spring {k}"), tangent);
    }
    for (k, own) in forces.forces.iter().enumerate() {
        let mut tangent = MechanismTangent::default();
        match &own.force {
            ElementForce::Joint(force) => {
                let (joint, freedom) = force.coordinate.place().unwrap();
                let by = Arc::new(|_, _, rate: f64| -rate);
                tangent.efforts.push(EffortChange { force: String::new(), joint, freedom, by });
            }
            ElementForce::Body(_) => {
                let change = LoadChange {
                    force: Vector3::new(0.1, 0.5, 0.2),
                    torque: Vector3::new(0.7, 0.1, 0.3),
                    point: Vector3::new(0.2, 0.4, 0.9),
                };
                tangent.loads.insert(k, change);
            }
            _ if own.name == "between" => {
                let from = Form::point(24, &Vector3::new(0.1, 0.1, 0.2));
                let to = Form::point(60, &Vector3::new(0.0, 0.3, 0.4));
                let by = Form::vector(60, &Vector3::new(0.3, 0.0, 0.2));
                let between = to.minus(&from).with_tangent(&by);
                tangent
                    .dampers
                    .push((String::new(), Damper { between, damping: Dual64::new(0.9, 0.5) }));
            }
            _ => {
                let load = particle_load(mechanism, Vector3::y());
                let whole = WholeForce(Box::new(MidpointForce(load)));
                tangent.forces.push((String::new(), Arc::new(whole)));
            }
        }
        of_element(Element::Force(k), format!("force {k} `{}`", own.name), tangent);
    }
    list
}

/// `D_1 L_d + f_d^- − Gᵀ hλ`, `D_2 L_d + f_d^+`, `g(q_{n+1})`, one after the other.
fn equations(
    (mechanism, forces): &(Mechanism, ForceElements),
    quadrature: Quadrature,
    s: &Interval,
    impulse: &[f64],
) -> Vec<f64> {
    let system = forces.add_to(mechanism.system(quadrature));
    let (n, m) = (mechanism.dim(), mechanism.len());
    let (mut minus, mut plus, mut g) = (vec![0.0; n], vec![0.0; n], vec![0.0; m]);
    system.forced_d1(s, &mut minus);
    system.forced_d2(s, &mut plus);
    mechanism.value(s.end(), &mut g);
    let mut G = DMatrix::zeros(m, n);
    mechanism.jacobian(s.t, &s.q0, &mut G);
    let reaction = G.tr_mul(&DVector::from_column_slice(impulse));
    minus.iter_mut().zip(reaction.iter()).for_each(|(f, r)| *f -= r);
    [minus, plus, g].concat()
}

/// Central differences, extrapolated twice.
fn difference(of: impl Fn(f64) -> Vec<f64>) -> DVector<f64> {
    let central = |e: f64| (DVector::from_vec(of(e)) - DVector::from_vec(of(-e))) / (2.0 * e);
    let [a, b, c] = [4e-3, 2e-3, 1e-3].map(central);
    let [ab, bc] = [(&b * 4.0 - a) / 3.0, (c * 4.0 - &b) / 3.0];
    (bc * 16.0 - ab) / 15.0
}

#[test]
fn numbers_of_random_mechanisms_have_their_derivatives() {
    for seed in 1..=3 {
        let built = mechanism(seed);
        let (n, m) = (built.0.dim(), built.0.len());
        let mut random = Sample::new(seed + 10);
        let q = built.0.initial_configuration();
        let near = |random: &mut Sample| -> Vec<f64> {
            q.iter().map(|x| x + 0.05 * random.number()).collect()
        };
        let (q0, q1) = (near(&mut random), near(&mut random));
        let s = Interval::between(0.3, 0.1, &q0, &q1);
        let impulse: Vec<f64> = (0..m).map(|_| random.number()).collect();
        let [mu, momentum] =
            [(); 2].map(|()| (0..n).map(|_| random.number()).collect::<Vec<f64>>());
        let sigma: Vec<f64> = (0..m).map(|_| random.number()).collect();
        let costates = Costates::of_rows(&mu, &momentum, &sigma);
        let list = tangents(&built.0, &built.1);
        let all: Vec<_> = list.iter().map(|own| own.1.clone()).collect();
        for quadrature in [Quadrature::Midpoint, Quadrature::Trapezoidal] {
            let mass = built.0.mass(|_| {});
            let design = MechanismDesign::new(&built.0, &built.1, &mass, quadrature, &all).unwrap();
            let (mut sums, mut adjoint) = (vec![0.0; design.sums()], vec![0.0; list.len()]);
            design.add_adjoint(Place::Step(&s), &impulse, costates, &mut sums);
            design.add_gradient(&sums, &mut adjoint);
            for (k, (name, tangent, element)) in list.iter().enumerate() {
                let (mut minus, mut plus, mut rows) = (vec![0.0; n], vec![0.0; n], vec![0.0; m]);
                design.add_tangent(k, Place::Step(&s), &impulse, &mut minus, &mut plus, &mut rows);
                let weighed = dot(&plus, &momentum) - dot(&minus, &mu) - dot(&rows, &sigma);
                assert!((weighed - adjoint[k]).abs() < 1e-11 * weighed.abs().max(1.0), "{name}");
                let exact = DVector::from_vec([minus, plus, rows].concat());
                let differences = difference(|e| {
                    let moved = changed(&built.0, &built.1, (tangent, *element), e);
                    equations(&moved, quadrature, &s, &impulse)
                });
                let (error, size) = ((&exact - differences).amax(), exact.amax());
                assert!(size > 1e-4, "{name}: it changes nothing");
                assert!(
                    error < 1e-8 * size.max(1.0),
                    "seed {seed}, {name}: {error:.1e} of {size:.1e}"
                );
            }
        }
    }
}

/// Velocities of nodes: with configuration, momentum and the numbers changed at once, each of them
/// alone, and against `v` of a momentum `M v` that the constraints allow.
#[test]
fn velocities_of_nodes_have_their_derivatives() {
    for seed in 1..=3 {
        let built = mechanism(seed);
        let n = built.0.dim();
        let mut random = Sample::new(seed + 30);
        let q: Vec<f64> =
            built.0.initial_configuration().iter().map(|x| x + 0.01 * random.number()).collect();
        let mut vector = || -> Vec<f64> { (0..n).map(|_| random.number()).collect() };
        let (p, dq, dp, along_v) = (vector(), vector(), vector(), vector());
        let mass = |mechanism: &Mechanism| mechanism.mass(|_| {});
        let rows = IndependentRows::find(&built.0, 0.3, &q);
        let list = tangents(&built.0, &built.1);
        let all: Vec<_> = list.iter().map(|own| own.1.clone()).collect();
        let state = |q: &[f64], p: &[f64]| State::new(0.3, q.to_vec(), p.to_vec());
        let mut node = DifferentiatedVelocity::new(&built.0, &rows, &all).unwrap();
        let none = vec![0.0; n];
        let nothing = MechanismTangent::default();
        let alone = [(None, &dq, &none), (None, &none, &dp)];
        let along = (0..list.len()).map(|k| (Some(k), &dq, &dp));
        for (parameter, dq, dp) in alone.into_iter().chain(along) {
            let (name, tangent, element) = match parameter {
                Some(k) => (list[k].0.as_str(), &list[k].1, list[k].2),
                None => ("none", &nothing, None),
            };
            node.find(&built.0, NodeMass::Constant(&mass(&built.0)), &state(&q, &p)).unwrap();
            let at = Configuration::new(0.3, &q);
            let exact = node.change(&built.0, at, parameter, [dq, dp, &[]]).unwrap();
            let exact = DVector::from_column_slice(exact);
            let differences = difference(|e| {
                let (moved, _) = changed(&built.0, &built.1, (tangent, element), e);
                let add = |x: &[f64], by: &[f64]| -> Vec<f64> {
                    x.iter().zip(by).map(|(x, by)| x + e * by).collect()
                };
                let mut node = DifferentiatedVelocity::new(&moved, &rows, &[]).unwrap();
                let v = node.find(
                    &moved,
                    NodeMass::Constant(&mass(&moved)),
                    &state(&add(&q, dq), &add(&p, dp)),
                );
                v.unwrap().to_vec()
            });
            // the transpose: c·δv̂ = q·δq + p·δp̄ + of the parameter
            let [mut by_q, mut by_p] = [(); 2].map(|()| vec![0.0; n]);
            node.pull(&built.0, at, &along_v, [&mut by_q, &mut by_p]).unwrap();
            let moved = parameter.map_or(0.0, |k| node.pulled_by_parameter(at, k));
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let pulled = dot(&by_q, dq) + dot(&by_p, dp) + moved;
            let pushed = dot(&along_v, exact.as_slice());
            let scale = exact.amax().max(1.0) * n as f64;
            assert!((pulled - pushed).abs() < 1e-12 * scale, "{name}: {pulled} for {pushed}");
            let (error, size) = ((&exact - differences).amax(), exact.amax());
            assert!(size > 1e-3, "{name}: it changes nothing");
            assert!(error < 2e-7 * size.max(1.0), "seed {seed}, {name}: {error:.1e} of {size:.1e}");
        }
    }
}

/// A mass point at `X` in the frame: `p = ∂/∂v ½ |v_φ + X_I v_I|²`.
#[test]
fn a_body_changes_by_any_distribution_of_mass() {
    let built = mechanism(2);
    let X = Vector3::new(0.3, -0.2, 0.5);
    let change = BodyTangent { mass: 1.0, moment: X, euler: X * X.transpose() };
    let mut tangent = MechanismTangent::default();
    tangent.bodies.insert(1, change);
    let mut random = Sample::new(5);
    let v: Vec<f64> = (0..built.0.dim()).map(|_| random.number()).collect();
    let mut p = vec![0.0; v.len()];
    start::add_mass_change(&built.0, &tangent, &v, &mut p);
    let of = |i: usize| Vector3::from_column_slice(&v[12 + 3 * i..15 + 3 * i]);
    let rate = of(0) + of(1) * X[0] + of(2) * X[1] + of(3) * X[2];
    for (i, factor) in [1.0, X[0], X[1], X[2]].into_iter().enumerate() {
        let own = Vector3::from_column_slice(&p[12 + 3 * i..15 + 3 * i]);
        assert!((own - rate * factor).norm() < 1e-15);
    }
    let J = Matrix3::new(2.0, 0.1, 0.3, 0.1, 3.0, 0.2, 0.3, 0.2, 4.0);
    let E = BodyTangent::of_inertia(1.0, &J).euler;
    let back = Matrix3::identity() * E.trace() - E;
    assert!((back - J).amax() < 1e-15);
}

/// A four-bar linkage of lengths `l`, its axes out of the plane: three rows are redundant.
fn four_bar() -> (MechanismBuilder, [vi_multibody::builder::JointId; 4]) {
    let mut builder = MechanismBuilder::new();
    let rod = || Inertia::principal(1.0, [0.01, 0.1, 0.1]);
    let crank =
        builder.body("crank", rod()).at([0.0, 0.0, 0.2]).rotation_vector([0.0, -1.0, 0.0]).id();
    let coupler = builder.body("coupler", rod()).at([0.5, 0.0, 0.5]).id();
    let rocker =
        builder.body("rocker", rod()).at([1.0, 0.0, 0.3]).rotation_vector([0.0, 0.7, 0.0]).id();
    let y = [0.0, 1.0, 0.0];
    let shaft = builder
        .joint("shaft", PairKind::Revolute, FrameId::Ground, crank)
        .at([0.0; 3])
        .axis(y)
        .rate(1.3)
        .id();
    let pin =
        builder.joint("pin", PairKind::Revolute, crank, coupler).at([0.0, 0.0, 0.4]).axis(y).id();
    let pivot = builder
        .joint("pivot", PairKind::Revolute, FrameId::Ground, rocker)
        .at([1.0, 0.0, 0.0])
        .axis(y)
        .id();
    let cut = builder
        .joint("cut", PairKind::Revolute, coupler, rocker)
        .at([1.0, 0.0, 0.6])
        .axis(y)
        .cut()
        .id();
    (builder, [shaft, pin, pivot, cut])
}

/// A closed start at the given coordinates and rates of an independent joint, by Newton's method.
fn closed(
    mechanism: &Mechanism,
    coordinates: &[StartCoordinate],
    q: &[f64],
    [value, rate]: [f64; 2],
) -> (Vec<f64>, Vec<f64>) {
    let (mut q, m) = (q.to_vec(), mechanism.len());
    let StartCoordinate::Joint(x) = &coordinates[0] else { unreachable!() };
    let matrix = |q: &[f64]| {
        let mut G = DMatrix::zeros(m + 1, q.len());
        mechanism.jacobian(0.0, q, &mut G);
        x.for_each_slope(q, |i, slope| G[(m, i)] += slope);
        G.svd(true, true)
    };
    for _ in 0..20 {
        let mut g = vec![0.0; m + 1];
        mechanism.value(Configuration::new(0.0, &q), &mut g[..m]);
        g[m] = x.at(Configuration::new(0.0, &q)) - value;
        let step = matrix(&q).solve(&DVector::from_vec(g), 1e-9).unwrap();
        q.iter_mut().zip(step.iter()).for_each(|(q, dq)| *q -= dq);
    }
    let mut b = DVector::zeros(m + 1);
    b[m] = rate;
    let v = matrix(&q).solve(&b, 1e-9).unwrap();
    (q, v.as_slice().to_vec())
}

#[test]
fn a_closed_start_changes_with_coordinates_rates_and_lengths() {
    let (builder, joints) = four_bar();
    let built = builder.build().unwrap();
    let mechanism = &built.mechanism;
    let all = StartCoordinate::of_tree(mechanism);
    let coordinates: Vec<_> =
        all.into_iter().filter(|own| own.0 == Some(0)).map(|own| own.2).collect();
    let q = mechanism.initial_configuration();
    let (q, v) = closed(mechanism, &coordinates, &q, [0.0, 1.3]);
    let at = InitialValues::new(0.0, &q, &v);
    let rows = IndependentRows::find(mechanism, 0.0, &q);
    assert_eq!(mechanism.len() - rows.len(), 3, "redundant");
    let mut longer = MechanismTangent::default();
    let mut change = JointTangent::default();
    change.parent.anchor.x = 1.0;
    longer.joints.insert(3, change);
    let mut heavier = MechanismTangent::default();
    heavier.bodies.insert(1, BodyTangent::of_inertia(1.0, &Matrix3::identity()));
    let mass = mechanism.mass(|_| {});
    let tangents = [longer.clone(), heavier];
    let found = start::derivatives(mechanism, &mass, &rows, at, &coordinates, &tangents).unwrap();
    let check =
        |what: &str, own: &start::StartTangent, of: &dyn Fn(f64) -> (Vec<f64>, Vec<f64>)| {
            let differences = difference(|e| {
                let (q, v) = of(e);
                [q, v].concat()
            });
            let exact = DVector::from_vec([own.q.clone(), own.v.clone()].concat());
            let error = (&exact - differences).amax();
            assert!(error < 1e-8 && exact.amax() > 0.1, "{what}: {error:.1e}");
        };
    check("coordinate", &found.coordinates[0], &|e| closed(mechanism, &coordinates, &q, [e, 1.3]));
    check("rate", &found.rates[0], &|e| closed(mechanism, &coordinates, &q, [0.0, 1.3 + e]));
    check("length", &found.parameters[0], &|e| {
        let (moved, _) = changed(mechanism, &built.forces, (&longer, None), e);
        closed(&moved, &coordinates, &q, [0.0, 1.3])
    });
    assert_eq!(norm_inf(&found.parameters[1].q), 0.0, "a mass moves nothing");
    let mut p = vec![0.0; q.len()];
    start::add_mass_change(mechanism, &tangents[1], &v, &mut p);
    assert_eq!(found.parameters[1].p, p);
    // one axis out of the plane opens the loop, and all axes together do not
    let tilt = |joint: usize| {
        let mut tangent = MechanismTangent::default();
        let body = mechanism.description().joints[joint].clone();
        let turn = |axes: Matrix3<f64>, triad: Matrix3<f64>| {
            let omega = triad.tr_mul(&Vector3::x());
            Matrix3::from_columns(&[0, 1, 2].map(|i| omega.cross(&axes.column(i))))
        };
        let triad = |frame| match frame {
            FrameId::Frame(k) => vi_rigid::directors::triad(&q[12 * k..12 * k + 12]),
            FrameId::Ground => Matrix3::identity(),
        };
        let mut change = JointTangent::default();
        change.parent.axes = turn(body.parent.axes, triad(body.parent.frame));
        change.child.axes = turn(body.child.axes, triad(body.child.frame));
        tangent.joints.insert(joint, change);
        tangent
    };
    let refused = start::derivatives(mechanism, &mass, &rows, at, &coordinates, &[tilt(1)]);
    assert!(
        matches!(refused, Err(StartDerivativeError::Opens { parameter: 0, .. })),
        "{refused:?}"
    );
    let _ = joints;
}

#[test]
fn coordinates_of_a_loop_are_chosen_that_determine_it() {
    let built = four_bar().0.build().unwrap();
    let q = built.mechanism.initial_configuration();
    let at = InitialValues::new(0.0, &q, &q);
    let rows = IndependentRows::find(&built.mechanism, 0.0, &q);
    let all: Vec<_> =
        StartCoordinate::of_tree(&built.mechanism).into_iter().map(|own| own.2).collect();
    assert_eq!(all.len(), 3);
    assert_eq!(start::independent(&built.mechanism, &rows, at, &all), Ok(vec![0]));
}

/// A motor does not change, but its moment arm does.
#[test]
fn an_effort_along_a_slider_changes_with_its_anchors() {
    let mut builder = MechanismBuilder::new();
    let body = builder.body("slider", Inertia::principal(1.0, [0.1; 3])).at([0.3, 0.1, 0.2]).id();
    let joint = builder.joint("slide", PairKind::Prismatic, FrameId::Ground, body);
    let joint = joint.at([0.0; 3]).axis([0.0, 0.0, 1.0]).id();
    builder.joint_force(joint.coordinate(0), Motor(Arc::new(|_| 3.0)));
    let built = builder.build().unwrap();
    let mut tangent = MechanismTangent::default();
    let mut change = JointTangent::default();
    change.child.anchor.x = 1.0;
    tangent.joints.insert(0, change);
    let q = built.mechanism.initial_configuration();
    let s = Interval::between(0.0, 0.1, &q, &q);
    let mass = built.mechanism.mass(|_| {});
    let design = MechanismDesign::new(
        &built.mechanism,
        &built.forces,
        &mass,
        Quadrature::Midpoint,
        &[tangent],
    )
    .unwrap();
    let (mut minus, mut plus, mut rows) =
        (vec![0.0; 12], vec![0.0; 12], vec![0.0; built.mechanism.len()]);
    design.add_tangent(
        0,
        Place::Step(&s),
        &vec![0.0; built.mechanism.len()],
        &mut minus,
        &mut plus,
        &mut rows,
    );
    assert!((minus[5] - 0.5 * 0.1 * 3.0).abs() < 1e-15, "{minus:?}"); // d_1 along z
    assert!(design.moves_constraints());
}
