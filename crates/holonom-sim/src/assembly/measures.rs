//! Size, masses and stiffnesses of a model at a glance, and what in them looks like a slip of
//! units.

use std::collections::BTreeMap;

use crate::digits::rounded;
use holonom_model::{Body, Constraint, Frame, Model, spatial};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use vi_core::SparseMatrix;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::pair::joint::FrameId;

/// Ratio of masses from which on one of them is probably wrong.
const MASSES: f64 = 1e6;
/// A joint is farther from the centre of mass than so many sizes of the shape.
const FAR: f64 = 20.0;
/// Edge or radius of a shape that is probably stated in millimetres, m.
const HUGE: f64 = 1e3;

/// A model in a few numbers; each range is the smallest and the largest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Measures {
    /// Mass of all that can move, kg.
    pub mass: f64,
    /// Diagonal of the box around centres of mass, joints, nodes and point masses, m.
    pub extent: f64,
    /// Masses of bodies and point masses that can move, kg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub masses: Option<[f64; 2]>,
    /// Principal moments of inertia of these bodies, kg·m².
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inertias: Option<[f64; 2]>,
    /// Stiffnesses of springs between points and along joints, N/m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffnesses: Option<[f64; 2]>,
    /// Stiffnesses of springs about joints, N·m/rad.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angular_stiffnesses: Option<[f64; 2]>,
    /// Bending stiffnesses of beams, N·m².
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bending_stiffnesses: Option<[f64; 2]>,
    /// Extensional stiffnesses of beams, N.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub extensional_stiffnesses: Option<[f64; 2]>,
}

/// The smallest and the largest of numbers; `None` of none.
fn range(numbers: impl Iterator<Item = f64> + Clone) -> Option<[f64; 2]> {
    Some([numbers.clone().reduce(f64::min)?, numbers.reduce(f64::max)?])
}

fn moving(model: &Model) -> impl Iterator<Item = &Body> + Clone {
    model.bodies.iter().filter(|body| !body.fixed)
}

impl Measures {
    /// Of an assembled model at its initial configuration; `matrix`: its mass matrix.
    pub(crate) fn of(model: &Model, mechanism: &Mechanism, matrix: &SparseMatrix) -> Self {
        let masses = moving(model).map(Body::mass).chain(model.particles.iter().map(|p| p.mass));
        let moments = |body: &Body| {
            let moments: [f64; 3] = body.inertia_tensor().symmetric_eigenvalues().into();
            moments
        };
        let springs = model.springs.iter().map(|spring| spring.stiffness);
        let of_joints = |angular: bool| {
            let joints = model
                .joints
                .iter()
                .filter_map(|joint| Some((joint.pair(), joint.spring.as_ref()?)));
            let own = joints.filter(move |(pair, spring)| pair.is_angle(spring.freedom) == angular);
            own.map(|(_, spring)| spring.stiffness)
        };
        let sections = || model.beams.iter().map(|beam| &beam.section);
        let bending = sections().flat_map(|section| [section.ei1, section.ei2]).flatten();
        Self {
            mass: mass(model, mechanism, matrix),
            extent: extent(model, mechanism),
            masses: range(masses),
            inertias: range(moving(model).flat_map(moments)),
            stiffnesses: range(springs.chain(of_joints(false))),
            angular_stiffnesses: range(of_joints(true)),
            bending_stiffnesses: range(bending),
            extensional_stiffnesses: range(sections().filter_map(|section| section.ea)),
        }
    }
}

/// `½ v̇ᵀ M v̇` of a translation with 1 m/s, twice; without the bodies that are fixed.
fn mass(model: &Model, mechanism: &Mechanism, matrix: &SparseMatrix) -> f64 {
    let description = mechanism.description();
    let frames = 12 * description.bodies.len();
    let starts = (0..frames).step_by(12);
    let n = mechanism.initial_configuration().len();
    let mut v = vec![0.0; n];
    starts.chain((frames..n).step_by(description.dimension)).for_each(|i| v[i] = 1.0);
    let mut p = vec![0.0; n];
    matrix.mul_add(1.0, &v, &mut p);
    let fixed: f64 = model.bodies.iter().filter(|body| body.fixed).map(Body::mass).sum();
    p.iter().zip(&v).map(|(p, v)| p * v).sum::<f64>() - fixed
}

/// Diagonal of the box around all places of the mechanism, m.
fn extent(model: &Model, mechanism: &Mechanism) -> f64 {
    let (description, q) = (mechanism.description(), mechanism.initial_configuration());
    let (frames, particles) = q.split_at(12 * description.bodies.len());
    let centers = frames.chunks_exact(12).map(|frame| Vector3::from_column_slice(&frame[..3]));
    let supports = model.bars.iter().filter_map(|bar| bar.point.as_deref());
    let points = particles.chunks_exact(description.dimension).chain(supports).map(|x| {
        let at = |i: usize| x.get(i).copied().unwrap_or_default();
        Vector3::new(at(0), at(1), at(2))
    });
    let joints = description.joints.iter().map(|joint| joint.child.point().at(&q));
    let places: Vec<Vector3<f64>> = centers.chain(points).chain(joints).collect();
    let side = |i: usize| range(places.iter().map(|x| x[i])).map_or(0.0, |[a, b]| b - a);
    Vector3::new(side(0), side(1), side(2)).norm()
}

/// What looks like a slip, with what to look at.
pub(crate) fn slips(model: &Model, mechanism: &Mechanism, measures: &Measures) -> Vec<String> {
    let mut found = Vec::new();
    if let Some([least, most]) = measures.masses.filter(|[least, most]| *most > MASSES * least) {
        found.push(format!("masses from {least:.1e} kg to {most:.1e} kg: check their units"));
    }
    found.extend(model.remarks.iter().cloned());
    // of a mesh the whole surface is measured: once
    let sizes: Vec<Option<f64>> = model.bodies.iter().map(|body| model.shape_size(body)).collect();
    for (body, size) in model.bodies.iter().zip(&sizes) {
        if let Some(size) = size.filter(|size| *size >= HUGE) {
            let (name, size) = (&body.name, rounded(size, 4));
            found.push(format!(
                "the shape of body `{name}` measures {size} m: dimensions are in metres"
            ));
        }
    }
    let far = |body: usize, distance: f64, what: &str| {
        let (size, name) = (sizes[body]?, &model.bodies[body].name);
        (distance > FAR * size).then(|| {
            let size = rounded(size, 4);
            format!(
                "{what} is {distance:.3} m from the centre of mass of body `{name}`, whose shape measures {size} m"
            )
        })
    };
    found.extend(far_joints(model, mechanism, &far));
    found.extend(far_points(model, &far));
    found.extend(undirected(model));
    let weight = model.gravity().iter().any(|g| *g != 0.0);
    if weight && !is_held(model, mechanism) {
        found.push("nothing is joined to the ground: the whole system falls".to_owned());
    }
    found
}

/// What is said about a point at some distance from the centre of mass of a body, if it is far.
type Far<'a> = dyn Fn(usize, f64, &str) -> Option<String> + 'a;

/// Joints far from the shape of a body.
fn far_joints(model: &Model, mechanism: &Mechanism, far: &Far<'_>) -> Vec<String> {
    let mut found = Vec::new();
    for joint in &mechanism.description().joints {
        for side in [&joint.parent, &joint.child] {
            let FrameId::Frame(k) = side.frame else { continue };
            if k < model.bodies.len() {
                found.extend(far(k, side.anchor.norm(), &format!("joint `{}`", joint.name)));
            }
        }
    }
    found
}

/// Points of springs, distances, loads and sensors far from the shape of their body.
fn far_points(model: &Model, far: &Far<'_>) -> Vec<String> {
    let mut found = Vec::new();
    let bodies: BTreeMap<&str, usize> =
        model.bodies.iter().map(|body| body.name.as_str()).zip(0..).collect();
    let mut check = |section: &str, name: &str, of: &str, point: Option<&[f64]>| {
        let size = |x: &[f64]| Vector3::from(spatial(x)).norm();
        let (Some(&body), Some(point)) = (bodies.get(of), point) else { return };
        found.extend(far(body, size(point), &format!("a point of {section} `{name}`")));
    };
    for spring in &model.springs {
        check("spring", &spring.name, &spring.from, spring.point_from.as_deref());
        check("spring", &spring.name, &spring.to, spring.point_to.as_deref());
    }
    for constraint in &model.constraints {
        if let Constraint::Distance { name, from, to, point_from, point_to, .. } = constraint {
            check("constraint", name, from, Some(point_from));
            check("constraint", name, to, Some(point_to));
        }
    }
    for load in &model.loads {
        let body = load.body.as_deref().unwrap_or_default();
        check("load", &load.name, body, load.point.as_ref().map(<[f64; 3]>::as_slice));
    }
    for sensor in &model.sensors {
        let point = sensor.point.as_ref().map(<[f64; 3]>::as_slice);
        check("sensor", &sensor.name, &sensor.of, point);
    }
    found
}

/// Loads that follow axes of a beam across its centre line which the model does not state.
fn undirected(model: &Model) -> impl Iterator<Item = String> {
    model.loads.iter().filter_map(|load| {
        let node = load.body.as_deref().and_then(|name| name.split_once('.'));
        let beam = model.beam(load.beam.as_deref().or(node.map(|(beam, _)| beam))?)?;
        let across = [load.force, load.torque].iter().any(|c| c[0] != 0.0 || c[1] != 0.0);
        (load.frame == Frame::Body && across && beam.normal.is_none()).then(|| {
            let (load, beam) = (&load.name, &beam.name);
            format!("load `{load}` follows d_1 and d_2 of beam `{beam}`, which are not stated: write its `normal`")
        })
    })
}

/// Whether something ties the system to the ground.
fn is_held(model: &Model, mechanism: &Mechanism) -> bool {
    let ground = |name: &String| name == "ground";
    mechanism
        .description()
        .joints
        .iter()
        .any(|joint| [joint.parent.frame, joint.child.frame].contains(&FrameId::Ground))
        || model.bars.iter().any(|bar| ground(&bar.from) || ground(&bar.to))
        || model.springs.iter().any(|spring| ground(&spring.from) || ground(&spring.to))
        || model.bushings.iter().any(|own| ground(&own.from) || ground(&own.to))
        || model
            .laws
            .iter()
            .any(|law| law.on.is_some() || [&law.from, &law.to].into_iter().flatten().any(ground))
        || !mechanism.description().scalars.is_empty()
        || model.contacts.iter().any(|own| own.plane().is_some_and(|plane| plane.on == "ground"))
}
