//! Sizes that no mechanism has: what a slip of units, a wrong sign or a mistyped place makes of a
//! model that is valid.
//!
//! ```text
//! k = √(I_3/m)                       radius of gyration, I_3 the largest principal moment
//! a_i² = 5 (I_j + I_k − I_i)/(2 m)   semi-axes of the homogeneous ellipsoid with these moments
//! r² = 5 k²/2                        radius of the ball with the moment I_3 about every axis: none with I_3 is denser
//! ```

use std::f64::consts::{PI, TAU};

use holonom_model::{Body, Constraint, Family, Joint, Model, MotionPath, Shape, ShapeKind};
use nalgebra::Vector3;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::pair::joint::FrameId;

use super::measures::Measures;
use crate::digits::rounded;

/// No material is denser, kg/m³ (osmium has 22,600).
const DENSEST: f64 = 3e4;
/// Nothing that is built is thinner on average, kg/m³ (air has 1.2).
const THINNEST: f64 = 1e-3;
/// The moments of a body that is meant as a point mass may be small, but not as small as this makes
/// them, kg/m³.
const POINT: f64 = 1e9;
/// Edge of the box around a mesh that is probably stated in millimetres, m.
const LARGE_MESH: f64 = 10.0;
/// Gravity from which on its unit is probably mm/s², m/s².
const STRONG: f64 = 900.0;

/// What looks like a slip, with what to write instead.
pub(crate) fn remarks(model: &Model, mechanism: &Mechanism, measures: &Measures) -> Vec<String> {
    let mut found = Vec::new();
    for body in model.bodies.iter().filter(|body| !body.fixed) {
        let size = model.shape_size(body);
        found.extend(bulk(body, size, measures.extent));
        found.extend(large_mesh(body, size, measures.extent));
    }
    found.extend(dense(model));
    found.extend(joints_off(model, mechanism));
    found.extend(degrees(model));
    found.extend(gravity(model));
    found.extend(narrow_limits(model, mechanism));
    found.extend(time(model, measures));
    found
}

/// A body whose moments of inertia do not fit its mass and its size (m, of its shape and of the
/// mechanism).
fn bulk(body: &Body, size: Option<f64>, extent: f64) -> Option<String> {
    let (name, mass) = (&body.name, body.mass());
    let mut moments: [f64; 3] = body.inertia_tensor().symmetric_eigenvalues().into();
    moments.sort_by(f64::total_cmp);
    if !(mass > 0.0 && moments[2] > 0.0) {
        return None;
    }
    let gyration = (moments[2] / mass).sqrt();
    let sum: f64 = moments.iter().sum();
    let axes = moments.map(|moment| (2.5 * (sum - 2.0 * moment) / mass).max(0.0).sqrt());
    let density = mass / (4.0 / 3.0 * PI * axes.iter().product::<f64>());
    let ball = mass / (4.0 / 3.0 * PI * (2.5_f64.sqrt() * gyration).powi(3));
    let reach = size.unwrap_or(0.0).max(extent);
    let thin = density < THINNEST && gyration > 2.0 * reach;
    let wide = size.is_some_and(|size| gyration > 3.0 * size);
    let k = rounded(gyration, 3);
    if thin || wide {
        let against = match size {
            Some(size) => format!("its shape measures {} m", rounded(size, 3)),
            None if extent > 0.0 => format!("the mechanism measures {} m", rounded(extent, 3)),
            None => format!("its mass is {} kg", rounded(mass, 3)),
        };
        return Some(format!(
            "the radius of gyration of body `{name}` is {k} m, and {against}: check the unit of its inertia, kg·m² \
             (1 g·mm² is 1e-9 kg·m², 1 kg·mm² is 1e-6 kg·m²)"
        ));
    }
    (ball > POINT).then(|| {
        format!(
            "the radius of gyration of body `{name}` is {k} m at a mass of {} kg: no material is so dense; check the \
             units of its inertia, kg·m², and of its mass, kg",
            rounded(mass, 3)
        )
    })
}

/// A mesh without a scale that is far larger than the mechanism.
fn large_mesh(body: &Body, size: Option<f64>, extent: f64) -> Option<String> {
    let mesh = |shape: &&Shape| shape.kind == ShapeKind::Mesh && shape.scale.is_none();
    let shape = body.shape.iter().chain(&body.picture).find(mesh)?;
    let size = size.filter(|size| *size >= LARGE_MESH && *size > 20.0 * extent)?;
    let (name, file) = (&body.name, shape.file.as_deref().unwrap_or_default());
    Some(format!(
        "the mesh `{file}` of body `{name}` measures {} m: if its file is in millimetres, write scale = 0.001",
        rounded(size, 4)
    ))
}

/// Densities of no material.
fn dense(model: &Model) -> Vec<String> {
    let of_body =
        |body: &Body| Some((format!("body `{}`", body.name), body.shape.as_ref()?.density?));
    let bodies = model.bodies.iter().filter_map(of_body);
    let beams = model.beams.iter().filter_map(|beam| {
        let material = beam.section.material.as_ref()?;
        Some((format!("beam `{}`", beam.name), material.density))
    });
    let wrong = bodies.chain(beams).filter(|(_, density)| *density > DENSEST);
    let said = wrong.map(|(what, density)| {
        format!(
            "the density {} kg/m³ of {what} is that of no material: write kg/m³ (steel 7850, lead 11,300, gold 19,300)",
            rounded(density, 4)
        )
    });
    said.collect()
}

/// Joints that miss the shapes of their bodies, where the shapes show where joints are.
fn joints_off(model: &Model, mechanism: &Mechanism) -> Vec<String> {
    let shapes: Vec<Vec<[Vector3<f64>; 2]>> =
        model.bodies.iter().map(|b| boxes(model, b)).collect();
    let (mut met, mut missed) = (0, Vec::new());
    for joint in &mechanism.description().joints {
        let sides = [&joint.parent, &joint.child].map(|side| match side.frame {
            FrameId::Frame(k) if k < model.bodies.len() => Some((k, side.anchor)),
            _ => None,
        });
        let on_beam = [&joint.parent, &joint.child]
            .iter()
            .any(|side| matches!(side.frame, FrameId::Frame(k) if k >= model.bodies.len()));
        let sides: Vec<(usize, Vector3<f64>)> = sides.into_iter().flatten().collect();
        if on_beam || sides.is_empty() || sides.iter().any(|(k, _)| shapes[*k].is_empty()) {
            continue;
        }
        let away = |(k, anchor): &(usize, Vector3<f64>)| {
            let size = shapes[*k].iter().map(|[low, high]| (high - low).amax()).fold(0.0, f64::max);
            let distance = shapes[*k].iter().map(|ends| outside(*ends, anchor));
            // a shape that the mass follows from is the body; another one may be a symbol of it
            let solid =
                model.bodies[*k].shape.as_ref().is_some_and(|shape| shape.density.is_some());
            let nearest = distance.fold(f64::INFINITY, f64::min);
            (nearest, size, nearest > if solid { 0.02 } else { 0.25 } * size)
        };
        let away: Vec<(f64, f64, bool)> = sides.iter().map(away).collect();
        match away.iter().all(|(.., misses)| *misses) {
            true => missed.push((joint.name.as_str(), sides, away)),
            false => met += 1,
        }
    }
    if missed.len() > met {
        return Vec::new(); // the shapes are symbols
    }
    let said =
        missed.into_iter().filter(|(_, _, away)| away.iter().all(|(d, size, _)| *d < 20.0 * size));
    let said = said.map(|(joint, sides, away)| {
        let places = sides.iter().zip(&away).map(|((k, _), (distance, ..))| {
            format!("{} m outside the shape of `{}`", rounded(*distance, 3), model.bodies[*k].name)
        });
        let places = places.collect::<Vec<_>>().join(" and ");
        format!("joint `{joint}` lies {places}: check its position")
    });
    said.collect()
}

/// Boxes around the shapes of a body, by components along its axes from the centre of mass, m.
fn boxes(model: &Model, body: &Body) -> Vec<[Vector3<f64>; 2]> {
    let surfaces = model.surfaces(body);
    if !surfaces.is_empty() {
        return surfaces.iter().map(holonom_model::BodySurface::ends).collect();
    }
    let Some(Shape { kind, dimensions, .. }) = &body.shape else { return Vec::new() };
    let at = |i: usize| dimensions.get(i).copied().unwrap_or_default();
    let about = |x: f64, y: f64, z: f64| [-Vector3::new(x, y, z), Vector3::new(x, y, z)];
    vec![match kind {
        ShapeKind::Box => about(0.5 * at(0), 0.5 * at(1), 0.5 * at(2)),
        ShapeKind::Cylinder => about(at(0), at(0), 0.5 * at(1)),
        ShapeKind::Sphere => about(at(0), at(0), at(0)),
        ShapeKind::Rod => about(at(1), at(1), 0.5 * at(0)),
        ShapeKind::Cone => {
            let [low, high] = about(at(0), at(0), at(1));
            [Vector3::new(low.x, low.y, 0.75 * low.z), Vector3::new(high.x, high.y, 0.25 * high.z)]
        }
        // by their triangles, above
        ShapeKind::Mesh | ShapeKind::Capsule | ShapeKind::Ellipsoid => return Vec::new(),
    }]
}

/// Distance of a point from a box, m.
fn outside([low, high]: [Vector3<f64>; 2], point: &Vector3<f64>) -> f64 {
    (low - point).sup(&(point - high)).sup(&Vector3::zeros()).norm()
}

/// Angles and rates that read as degrees.
fn degrees(model: &Model) -> Vec<String> {
    let mut found = Vec::new();
    let mut say = |what: String, value: f64, unit: &str| {
        let turns = if unit == "rad" { "turns" } else { "turns per second" };
        found.push(format!(
            "{what} is {value} {unit}, {} {turns}: for degrees write \"= {value}*deg\"",
            rounded(value / TAU, 3)
        ));
    };
    for joint in &model.joints {
        let (pair, rates) = (joint.pair(), joint.rate.as_ref().map_or(&[][..], |r| r.values()));
        for (freedom, rate) in rates.iter().enumerate() {
            if pair.is_angle(freedom) && reads_as_degrees(*rate) {
                say(format!("`rate` of joint `{}`", joint.name), *rate, "rad/s");
            }
        }
        let limits = joint.limits.map(|limits| limits.table());
        let limits = limits.filter(|limits| pair.is_angle(limits.freedom));
        let bounds = limits.into_iter().flat_map(|limits| [limits.lower, limits.upper]);
        for bound in bounds.flatten().filter(|bound| stops_at_degrees(*bound)) {
            say(format!("a limit of joint `{}`", joint.name), bound, "rad");
        }
        let spring = joint.spring.as_ref().filter(|spring| pair.is_angle(spring.freedom));
        if let Some(rest) = spring.map(|spring| spring.rest).filter(|rest| reads_as_degrees(*rest))
        {
            say(format!("`rest` of the spring of joint `{}`", joint.name), rest, "rad");
        }
        if let Some(motor) = joint.motor.as_ref().filter(|motor| pair.is_angle(motor.freedom)) {
            path(&format!("motor of joint `{}`", joint.name), &motor.path, &mut say);
        }
    }
    for constraint in &model.constraints {
        let Constraint::Motion { name, joint, freedom, path: own, .. } = constraint else {
            continue;
        };
        let joint = model.joints.iter().find(|other| other.name == *joint);
        if joint.is_some_and(|joint| joint.pair().is_angle(*freedom)) {
            path(&format!("constraint `{name}`"), own, &mut say);
        }
    }
    for body in &model.bodies {
        let rates = [body.angular_velocity, body.body_angular_velocity].into_iter().flatten();
        for rate in rates.flatten().filter(|rate| reads_as_degrees(*rate)) {
            say(format!("the angular velocity of body `{}`", body.name), rate, "rad/s");
        }
    }
    found
}

/// The angles and rates of a path.
fn path(of: &str, path: &MotionPath, say: &mut dyn FnMut(String, f64, &str)) {
    let moves = path.moves.iter().map(|part| ("by", part.by, "rad"));
    let own = [
        ("offset", path.offset, "rad"),
        ("rate", path.rate, "rad/s"),
        ("amplitude", path.amplitude, "rad"),
        ("phase", path.phase, "rad"),
    ];
    for (key, value, unit) in own.into_iter().chain(moves) {
        if reads_as_degrees(value) {
            say(format!("`{key}` in the path of {of}"), value, unit);
        }
    }
}

/// Whether a number is a multiple of a quarter turn in degrees: nobody counts radians by 90.
fn reads_as_degrees(value: f64) -> bool {
    (90.0..=720.0).contains(&value.abs()) && value % 90.0 == 0.0
}

/// Whether a stop reads as an angle in degrees: none is built after five turns or more.
fn stops_at_degrees(value: f64) -> bool {
    (30.0..=720.0).contains(&value.abs()) && value % 15.0 == 0.0
}

fn gravity(model: &Model) -> Option<String> {
    let g = Vector3::from(model.gravity());
    if g.norm() > STRONG {
        return Some(format!("gravity is {} m/s²: write m/s², not mm/s²", rounded(g.norm(), 4)));
    }
    let upwards = |axis: usize| g[axis] > 0.0 && (0..3).all(|i| i == axis || g[i] == 0.0);
    let axis = if model.header.dimension == 2 { 1 } else { 2 };
    upwards(axis).then(|| {
        let letter = ["x", "y", "z"][axis];
        format!("gravity points along +{letter}: where {letter} points upwards, write -{}", g[axis])
    })
}

/// Limits of a joint that are nearer together than the way of its coordinate in the first step.
fn narrow_limits(model: &Model, mechanism: &Mechanism) -> Vec<String> {
    let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
    let joints = &mechanism.description().joints;
    let narrow = |joint: &Joint| {
        let limits = joint.stops()?;
        let width = limits.upper? - limits.lower?;
        let place = joints.iter().position(|own| own.name == joint.name)?;
        let coordinate = mechanism.known_coordinate(place, limits.freedom)?;
        let way = model.settings.step * coordinate.rate(&q, &v).abs();
        let unit = if joint.pair().is_angle(limits.freedom) { "rad" } else { "m" };
        (way > width).then(|| {
            format!(
                "joint `{}` moves by {} {unit} in a step, {} times the {} {unit} between its limits: it lies at one of them after a step, without a bounce; write a step below {} s",
                joint.name,
                rounded(way, 3),
                rounded(way / width, 2),
                rounded(width, 3),
                rounded(0.25 * model.settings.step * width / way, 2)
            )
        })
    };
    model.joints.iter().filter_map(narrow).collect()
}

/// An end before the first step has ended, and a step in which bodies fall farther than the
/// mechanism is large.
fn time(model: &Model, measures: &Measures) -> Vec<String> {
    let settings = &model.settings;
    let mut found = Vec::new();
    if settings.scheme.family() == Family::Static {
        return found;
    }
    let (step, end) = (settings.step, settings.end);
    if end < step * (1.0 - 1e-9) {
        found.push(format!(
            "`end` = {end} s is less than a step: one step is taken, to t = {step} s; write a smaller `step` or a later `end`"
        ));
    }
    let g = Vector3::from(model.gravity()).norm();
    let fall = 0.5 * g * step * step;
    if fall > measures.extent && measures.extent > 0.0 {
        found.push(format!(
            "within a step of {step} s a body falls by {} m, and the mechanism measures {} m: write a step below {} s",
            rounded(fall, 3),
            rounded(measures.extent, 3),
            rounded(0.1 * (2.0 * measures.extent / g).sqrt(), 2)
        ));
    }
    found
}
