//! `relative_to`: a part stated in the frame of another one is the part that its coordinates in
//! space state.

#![allow(clippy::unwrap_used)] // a test

use crate::harness::models::{all_shipped, overrides, read};
use holonom::model::{Constraint, Frame, Law, ReferenceFrame, Scheme};
use holonom::{Model, Override, Simulation};
use nalgebra::{Matrix3, Rotation3, Vector3};

type Vector = Vector3<f64>;

const CHAIN: &str = include_str!("../models/relative_robot.toml");

/// The same model with the base at another time of its rigid motion.
fn at(t: f64) -> Model {
    let omega = Vector::new(0.3, 0.7, -1.1);
    let turned = Rotation3::from_scaled_axis(t * omega)
        * Rotation3::from_scaled_axis(Vector::new(0.2, -0.4, 0.9));
    let place = Vector::new(1.0, 2.0, 3.0) + t * Vector::new(0.5, -0.2, 0.1);
    let v = turned.scaled_axis();
    let set = [
        ("body.base.position", format!("[{:?}, {:?}, {:?}]", place.x, place.y, place.z)),
        ("body.base.rotation_vector", format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z)),
    ];
    Model::from_toml_with(CHAIN, &overrides(&set)).unwrap()
}

fn body<'m>(model: &'m Model, name: &str) -> &'m holonom::model::Body {
    model.body(name).unwrap()
}

#[test]
fn positions_are_those_of_the_chain() {
    let model = at(0.0);
    let base = Rotation3::from_scaled_axis(Vector::new(0.2, -0.4, 0.9));
    let arm = base
        * nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(0.6, 0.0, 0.8, 0.0))
            .to_rotation_matrix();
    let arm_at = Vector::new(1.0, 2.0, 3.0) + base * Vector::new(0.2, 0.1, 0.3);
    let tip = arm_at + arm * Vector::new(0.15, 0.0, 0.05); // of the frame `fingers`
    let fingers = arm
        * Rotation3::from_axis_angle(&Vector::z_axis(), 90_f64.to_radians())
        * Rotation3::from_axis_angle(&Vector::x_axis(), 30_f64.to_radians());
    let along = fingers * Vector::y();
    let expected = [
        ("arm", arm_at),
        ("shank", arm_at + arm * Vector::new(0.3, 0.0, 0.0)),
        ("bob", arm_at + arm * Vector::new(0.0, 0.1, 0.0)),
    ];
    for (name, expected) in expected {
        let found = model.particle(name).map_or_else(
            || Vector::from(body(&model, name).position),
            |p| Vector::from_row_slice(&p.position),
        );
        let error = (found - expected).norm();
        assert!(error < 1e-15, "{name}: {error:e} m");
    }
    let points = &model.beam("grip").unwrap().points;
    let error = (Vector::from(points[0]) - tip).norm()
        + (Vector::from(points[1]) - tip - 0.1 * along).norm();
    println!("end points of the beam: {error:e} m");
    assert!(error < 2e-15);
    assert!(model.frames.is_empty() && !model.to_toml().contains("relative_to"));
    let again = Model::from_toml(&model.to_toml()).unwrap();
    assert_eq!(again, model, "the resolved model is read back as the same");
}

/// Velocities of parts at rest in their frames are the derivatives of their positions when the base
/// moves as a rigid body; velocities of their own are added in the axes of the frame.
#[test]
fn velocities_are_those_of_rigid_motion() {
    let (model, dt) = (at(0.0), 1e-5);
    let (before, after) = (at(-dt), at(dt));
    for name in ["arm", "shank"] {
        let [x0, x1] = [&before, &after].map(|m| Vector::from(body(m, name).position));
        let error = ((x1 - x0) / (2.0 * dt) - Vector::from(body(&model, name).velocity)).norm();
        let [r0, r1] = [&before, &after].map(|m| body(m, name).rotation());
        let spin = (r1 - r0) / (2.0 * dt) * body(&model, name).rotation().transpose();
        let omega = body(&model, name).spatial_angular_velocity();
        let turning = (spin - omega.cross_matrix()).amax();
        println!("{name}: velocity {error:e} m/s, angular velocity {turning:e} rad/s");
        assert!(error < 1e-9 && turning < 1e-9, "{name}: {error:e} {turning:e}");
    }
    let particle = |m: &Model| Vector::from_row_slice(&m.particle("bob").unwrap().position);
    let own = body(&model, "arm").rotation() * Vector::new(0.0, 0.3, 0.0);
    let rigid = (particle(&after) - particle(&before)) / (2.0 * dt);
    let found = Vector::from_row_slice(&model.particle("bob").unwrap().velocity);
    assert!((found - rigid - own).norm() < 1e-9, "{:e}", (found - rigid - own).norm());
    // the hand: at the node of a beam that moves with the arm
    let beam = model.beam("grip").unwrap();
    let points = |m: &Model| Vector::from(m.beam("grip").unwrap().points[1]);
    let end = Vector::from(beam.velocity)
        + Vector::from(beam.angular_velocity)
            .cross(&(Vector::from(beam.points[1]) - Vector::from(beam.points[0])));
    let error = ((points(&after) - points(&before)) / (2.0 * dt) - end).norm();
    assert!(error < 1e-9, "end of the beam: {error:e}");
    let hand = body(&model, "hand");
    let spin = hand.spatial_angular_velocity() - Vector::from(beam.angular_velocity);
    let error = (spin - hand.rotation() * Vector::new(0.0, 2.0, 0.5)).norm();
    assert!(error < 1e-14, "angular velocity of its own: {error:e} rad/s");
}

#[test]
fn the_order_of_the_file_does_not_matter() {
    let mut tables: Vec<&str> = CHAIN.split("\n[[").collect();
    let head = tables.remove(0);
    tables.reverse();
    let reversed: String = tables.iter().map(|table| format!("\n[[{table}\n")).collect();
    let reversed = Model::from_toml(&(head.to_owned() + &reversed)).unwrap();
    let model = Model::from_toml(CHAIN).unwrap();
    for name in ["hand", "arm", "shank", "base"] {
        let bits = |m: &[f64]| m.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        let [one, other] = [&reversed, &model].map(|model| body(model, name));
        assert_eq!(bits(&one.position), bits(&other.position));
        assert_eq!(bits(one.rotation().as_slice()), bits(other.rotation().as_slice()));
    }
}

/// A chain as long as that is resolved without recursion.
#[test]
fn long_chains_are_resolved() {
    let mut text = "model = { name = \"c\" }\nsimulation = { step = 0.1, end = 1.0 }\n".to_owned();
    let count = 20_000;
    for k in (0..count).rev() {
        let base = if k == 0 { "ground".to_owned() } else { format!("f{}", k - 1) };
        text += &format!(
            "[[frame]]\nname = \"f{k}\"\nrelative_to = \"{base}\"\nposition = [1, 0, 0]\n"
        );
    }
    text += &format!(
        "[[body]]\nname = \"b\"\nmass = 1.0\ninertia = [1, 1, 1]\nrelative_to = \"f{}\"\n",
        count - 1
    );
    let model = Model::from_toml(&text).unwrap();
    assert_eq!(model.bodies[0].position.map(|x| x as i64), [count, 0, 0]);
}

/// Everything in a model stated relative to one frame moves as the model itself, seen from that
/// frame.
#[test]
fn a_whole_model_moves_alike_in_another_frame() {
    let turned = Rotation3::from_scaled_axis(Vector::new(0.7, -1.2, 0.4));
    let place = Vector::new(3.0, -2.0, 5.0);
    let mut compared = 0;
    for (name, path) in all_shipped() {
        let mut model = read(&path, &[]);
        // components of laws in space are expressions: they do not turn
        let in_space = |law: &Law| law.on.is_some() && law.axes == Frame::Space;
        if model.header.dimension == 2
            || model.settings.scheme == Scheme::Static
            || model.laws.iter().any(in_space)
        {
            continue;
        }
        model.settings.end = 10.0 * model.settings.step;
        let other = elsewhere(&model, &turned.into_inner(), place);
        let [mut plain, mut moved] = [&model, &other].map(|m| Simulation::new(m).unwrap());
        let frames =
            12 * (model.bodies.len() + model.beams.iter().map(|b| b.node_count()).sum::<usize>());
        let normals = model.beams.iter().all(|beam| beam.normal.is_some());
        let mut worst = 0.0_f64;
        for _ in 0..=10 {
            let (q, p) = (plain.configuration(), moved.configuration());
            for (k, (x, y)) in q.chunks_exact(3).zip(p.chunks_exact(3)).enumerate() {
                let point = 3 * k >= frames || k % 4 == 0;
                if !point && k >= 4 * model.bodies.len() && !normals {
                    continue; // the directors of a beam without a normal are chosen in space
                }
                let origin = if point { place } else { Vector::zeros() };
                let expected = origin + turned * Vector::from_column_slice(x);
                worst = worst.max((Vector::from_column_slice(y) - expected).amax());
            }
            if plain.step().is_err() {
                break;
            }
            moved.step().unwrap();
        }
        println!("{name}: {worst:.1e}");
        assert!(worst < 1e-7, "{name}: {worst:e}");
        compared += 1;
    }
    assert!(compared > 20, "{compared} models");
}

/// The model with all its parts relative to a frame, gravity turned with them.
fn elsewhere(model: &Model, turned: &Matrix3<f64>, place: Vector) -> Model {
    let mut other = model.clone();
    let gravity: [f64; 3] = (turned * Vector::from(model.gravity())).into();
    other.header.gravity = gravity.to_vec();
    let matrix = std::array::from_fn(|i| std::array::from_fn(|j| turned[(i, j)]));
    other.frames.push(ReferenceFrame {
        name: "elsewhere".to_owned(),
        position: place.into(),
        matrix: Some(matrix),
        ..ReferenceFrame::default()
    });
    let relative = || Some("elsewhere".to_owned());
    other.bodies.iter_mut().for_each(|part| part.relative_to = relative());
    other.beams.iter_mut().for_each(|part| part.relative_to = relative());
    other.particles.iter_mut().for_each(|part| part.relative_to = relative());
    other.bars.iter_mut().for_each(|part| part.relative_to = relative());
    other.joints.iter_mut().for_each(|part| part.relative_to = relative());
    other.springs.iter_mut().for_each(|part| part.relative_to = relative());
    let between = other.laws.iter_mut().filter(|law| law.from.is_some());
    between.for_each(|part| part.relative_to = relative());
    other.bushings.iter_mut().for_each(|part| part.relative_to = relative());
    let dead = other.loads.iter_mut().filter(|load| load.frame == Frame::Space);
    dead.for_each(|part| part.relative_to = relative());
    let planes = other.contacts.iter_mut().filter(|own| own.plane().is_some());
    planes.for_each(|part| part.relative_to = relative());
    for constraint in &mut other.constraints {
        if let Constraint::Distance { relative_to, .. }
        | Constraint::Rolling { relative_to, .. }
        | Constraint::Blade { relative_to, .. }
        | Constraint::PointOnLine { relative_to, .. }
        | Constraint::PointOnPlane { relative_to, .. } = constraint
        {
            *relative_to = relative();
        }
    }
    Model::from_toml_in(&other.to_toml(), &[], model.meshes.clone()).unwrap()
}

/// One parameter moves everything that is stated relative to each other, so that joints close.
#[test]
fn a_parameter_changes_the_mechanism_consistently() {
    let text = CHAIN.replace("body_angular_velocity = [0.0, 2.0, 0.5]\n", "");
    for length in [0.1, 0.3, 0.7, 1.9] {
        let set = Override::new("parameters.length", length.to_string());
        let model = Model::from_toml_with(&text, &[set]).unwrap();
        let simulation = Simulation::new(&model).unwrap();
        let closure = simulation.assembly().closure;
        println!("length {length}: joints open by {:e} m", closure.position);
        assert!(closure.position < 1e-14 && closure.velocity < 1e-13, "{closure:?}");
    }
}
