//! Where the parts of a model are initially, with the derivatives by a parameter.
//!
//! ```text
//! φ = φ_F + R_F x,   R = R_F R_x,   v = v_F + ω_F × (φ − φ_F) + R_F ẋ,   ω = ω_F + R_F ω_x
//! ```
//! The formulas of `relative_to` with dual numbers.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use nalgebra::{Matrix3, Vector3};
use vi_beam::BeamMesh;
use vi_core::Number;
use vi_core::num_dual::Dual64;

use super::start::is_ground;
use crate::text::tangents::ParameterTangent;
use crate::types::orientation::{Orientation, TurningNumber, orthonormal, rotation_of};
use crate::types::reference_frame::MovingFrame;
use crate::{Beam, Bushing, Joint, Model};

/// The derivatives of the numbers of a model by a parameter, each taken by who reads the number.
#[derive(Debug)]
pub struct Slopes<'a> {
    tangent: &'a ParameterTangent,
    taken: RefCell<BTreeSet<String>>,
}

impl<'a> Slopes<'a> {
    /// Those of a parameter.
    #[must_use]
    pub fn new(tangent: &'a ParameterTangent) -> Self {
        Self { tangent, taken: RefCell::default() }
    }

    /// The number at a key path with its derivative.
    #[must_use]
    pub fn number(&self, path: &str, value: f64) -> Dual64 {
        match self.tangent.keys.get(path) {
            Some(slope) => {
                self.taken.borrow_mut().insert(path.to_owned());
                Dual64::new(value, *slope)
            }
            None => Dual64::of(value),
        }
    }

    /// The numbers of a list.
    #[must_use]
    pub fn list<const N: usize>(&self, path: &str, values: [f64; N]) -> [Dual64; N] {
        std::array::from_fn(|i| self.number(&format!("{path}.{i}"), values[i]))
    }

    /// A vector.
    #[must_use]
    pub fn vector(&self, path: &str, values: [f64; 3]) -> Vector3<Dual64> {
        self.list(path, values).into()
    }

    /// Whether a number below a key path changes.
    #[must_use]
    pub fn touches(&self, path: &str) -> bool {
        let below = |key: &String| {
            key.strip_prefix(path).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        self.tangent.keys.keys().any(below)
    }

    /// What nobody has taken.
    #[must_use]
    pub fn left(&self) -> Vec<String> {
        let taken = self.taken.borrow();
        self.tangent.keys.keys().filter(|key| !taken.contains(*key)).cloned().collect()
    }
}

/// The frames of a model with their derivatives.
#[derive(Debug)]
pub struct Placements<'a> {
    stated: &'a Model,
    resolved: &'a Model,
    slopes: &'a Slopes<'a>,
    known: RefCell<BTreeMap<String, MovingFrame<Dual64>>>,
    nodes: RefCell<BTreeMap<String, Rc<Vec<MovingFrame<Dual64>>>>>,
    meshes: RefCell<BTreeMap<String, Rc<Vec<BeamMesh<Dual64>>>>>,
}

/// What is known under a name; found the first time.
fn once<T>(
    known: &RefCell<BTreeMap<String, Rc<T>>>,
    name: &str,
    found: impl FnOnce() -> T,
) -> Rc<T> {
    if let Some(known) = known.borrow().get(name) {
        return Rc::clone(known);
    }
    let found = Rc::new(found());
    known.borrow_mut().insert(name.to_owned(), Rc::clone(&found));
    found
}

/// A value with the derivative of another number.
fn with_slope(value: Dual64, slope: Dual64) -> Dual64 {
    Dual64::new(value.re, slope.eps)
}

/// A frame that does not change.
fn constant(frame: &MovingFrame) -> MovingFrame<Dual64> {
    let of = |x: &Vector3<f64>| x.map(Dual64::of);
    MovingFrame {
        origin: of(&frame.origin),
        rotation: frame.rotation.map(Dual64::of),
        velocity: of(&frame.velocity),
        omega: of(&frame.omega),
    }
}

impl<'a> Placements<'a> {
    /// Of a model as it is stated and as it is resolved.
    #[must_use]
    pub fn new(stated: &'a Model, resolved: &'a Model, slopes: &'a Slopes<'a>) -> Self {
        let (known, nodes, meshes) = Default::default();
        Self { stated, resolved, slopes, known, nodes, meshes }
    }

    /// The frame that a part names in `relative_to`; the inertial one where it names none.
    #[must_use]
    pub fn base(&self, relative_to: Option<&str>) -> MovingFrame<Dual64> {
        match relative_to {
            Some(name) if !is_ground(name) => self.frame(name),
            _ => MovingFrame::inertial(),
        }
    }

    /// The frame of a body, a `[[frame]]`, a joint or a node of a beam. Premise: the model is
    /// valid.
    #[must_use]
    pub fn frame(&self, name: &str) -> MovingFrame<Dual64> {
        if let Some(known) = self.known.borrow().get(name) {
            return *known;
        }
        let found = self.found(name);
        self.known.borrow_mut().insert(name.to_owned(), found);
        found
    }

    fn found(&self, name: &str) -> MovingFrame<Dual64> {
        let slopes = self.slopes;
        if let Some(body) = self.stated.body(name) {
            let base = self.base(body.relative_to.as_deref());
            let key = format!("body.{name}");
            let rotation = self.rotation(&key, &body.orientation());
            let at = slopes.vector(&format!("{key}.position"), body.position);
            let fixed = base.fixed(at, &rotation);
            let velocity = slopes.vector(&format!("{key}.velocity"), body.velocity);
            let own = body.angular_velocity.unwrap_or_default();
            let own = slopes.vector(&format!("{key}.angular_velocity"), own);
            let along = body.body_angular_velocity.map(|along| {
                rotation * slopes.vector(&format!("{key}.body_angular_velocity"), along)
            });
            let velocity = fixed.velocity + base.rotation * velocity;
            let omega = base.omega + base.rotation * along.unwrap_or(own);
            return MovingFrame { velocity, omega, ..fixed };
        }
        if let Some(frame) = self.stated.frames.iter().find(|frame| frame.name == name) {
            let base = self.base(frame.relative_to.as_deref());
            let key = format!("frame.{name}");
            let rotation = self.rotation(&key, &frame.orientation());
            return base
                .fixed(slopes.vector(&format!("{key}.position"), frame.position), &rotation);
        }
        if let Some(joint) = self.stated.joint(name) {
            return self.of_joint(joint);
        }
        self.node(name)
    }

    /// The frame of a joint: at its place, with the axes of the frame in which it is stated, or of
    /// its parent.
    fn of_joint(&self, joint: &Joint) -> MovingFrame<Dual64> {
        let key = format!("joint.{}", joint.name);
        match (joint.position, joint.anchor_parent) {
            (None, Some(anchor)) => {
                let parent = self.base(Some(&joint.parent));
                let at = self.slopes.vector(&format!("{key}.anchor_parent"), anchor);
                let relative = is_ground(&joint.parent).then_some(joint.relative_to.as_deref());
                relative.map_or(parent, |base| self.base(base)).fixed(at, &Matrix3::identity())
            }
            (position, _) => {
                let base = self.base(joint.relative_to.as_deref());
                let at = position.unwrap_or_default();
                let at = self.slopes.vector(&format!("{key}.position"), at);
                base.fixed(at, &Matrix3::identity())
            }
        }
    }

    /// A node of a beam.
    fn node(&self, name: &str) -> MovingFrame<Dual64> {
        let node = || {
            let (beam, place) = name.split_once('.')?;
            let beam = self.stated.beam(beam)?;
            self.nodes(beam).get(beam.node(place)?).copied()
        };
        node().unwrap_or_else(MovingFrame::inertial)
    }

    /// The nodes of a beam, numbered along it: the values are those of the resolved model.
    #[must_use]
    pub fn nodes(&self, beam: &Beam) -> Rc<Vec<MovingFrame<Dual64>>> {
        once(&self.nodes, &beam.name, || self.nodes_of(beam))
    }

    fn nodes_of(&self, beam: &Beam) -> Vec<MovingFrame<Dual64>> {
        let resolved = self.resolved.beam(&beam.name).map(super::posed::nodes).unwrap_or_default();
        let key = format!("beam.{}", beam.name);
        let base = self.base(beam.relative_to.as_deref());
        let meshes = self.meshes(beam);
        let placed = meshes.iter().flat_map(|own| own.centers.iter().zip(&own.triads));
        let first = meshes.first().map_or_else(Vector3::zeros, |own| own.centers[0]);
        let vector = |part: &str, own| self.slopes.vector(&format!("{key}.{part}"), own);
        let velocity = base.rotation * vector("velocity", beam.velocity);
        let velocity = base.velocity_at(&base.point(first)) + velocity;
        let omega = base.omega + base.rotation * vector("angular_velocity", beam.angular_velocity);
        let moving = MovingFrame { origin: base.point(first), velocity, omega, ..base };
        let node =
            |(own, (center, triad)): (&MovingFrame, (&Vector3<Dual64>, &Matrix3<Dual64>))| {
                let origin = base.point(*center);
                let velocity = moving.velocity_at(&origin);
                let own = constant(own);
                let by = |x: &Vector3<Dual64>, own: &Vector3<Dual64>| own.zip_map(x, with_slope);
                MovingFrame {
                    origin: by(&origin, &own.origin),
                    rotation: own.rotation.zip_map(&(base.rotation * triad), with_slope),
                    velocity: by(&velocity, &own.velocity),
                    omega: by(&omega, &own.omega),
                }
            };
        resolved.iter().zip(placed).map(node).collect()
    }

    /// The legs of a beam in the frame in which it is stated.
    #[must_use]
    pub fn meshes(&self, beam: &Beam) -> Rc<Vec<BeamMesh<Dual64>>> {
        let key = format!("beam.{}", beam.name);
        let number = |part: &str, value| self.slopes.number(&format!("{key}.{part}"), value);
        let found = || self.with_stations(beam).meshes_by(&number).unwrap_or_default();
        once(&self.meshes, &beam.name, found)
    }

    /// A beam as it is stated, with the stations of its file where it names one.
    #[must_use]
    pub fn with_stations(&self, beam: &Beam) -> Beam {
        let mut beam = beam.clone();
        if let Some(resolved) = self.resolved.beam(&beam.name) {
            beam.stations.clone_from(&resolved.stations);
        }
        beam
    }

    /// The orientation that is stated below a key.
    fn rotation(&self, key: &str, stated: &Orientation<'_>) -> Matrix3<Dual64> {
        let slopes = self.slopes;
        if let Some(quaternion) = stated.quaternion {
            return rotation_of(slopes.list(&format!("{key}.quaternion"), quaternion));
        }
        if let Some(vector) = stated.rotation_vector {
            return Dual64::turned(&slopes.vector(&format!("{key}.rotation_vector"), vector));
        }
        if let Some(rows) = stated.matrix {
            let rows: [[Dual64; 3]; 3] =
                std::array::from_fn(|i| slopes.list(&format!("{key}.matrix.{i}"), rows[i]));
            return orthonormal(Matrix3::from_fn(|i, j| rows[i][j]));
        }
        let Some(euler) = stated.euler else { return Matrix3::identity() };
        let (part, angles) = match (&euler.degrees, &euler.angles) {
            (Some(degrees), _) => ("degrees", &degrees[..]),
            (None, angles) => ("angles", angles.as_deref().unwrap_or_default()),
        };
        let angle =
            |(i, angle): (usize, &f64)| slopes.number(&format!("{key}.euler.{part}.{i}"), *angle);
        euler.rotation_by(&angles.iter().enumerate().map(angle).collect::<Vec<_>>())
    }

    /// Place (m) and axes (columns) of a bushing at the start, in space.
    #[must_use]
    pub fn bushing(&self, bushing: &Bushing) -> (Vector3<Dual64>, Matrix3<Dual64>) {
        let key = format!("bushing.{}", bushing.name);
        let base = self.base(bushing.relative_to.as_deref());
        let at = self.slopes.vector(&format!("{key}.position"), bushing.position);
        (base.point(at), base.rotation * self.rotation(&key, &bushing.orientation()))
    }

    /// A point, m: of a body or a node by its components, of the ground in the frame of
    /// `relative_to`, or a particle.
    #[must_use]
    pub fn point(
        &self,
        member: &str,
        components: Vector3<Dual64>,
        relative_to: Option<&str>,
    ) -> Vector3<Dual64> {
        if is_ground(member) {
            return self.base(relative_to).point(components);
        }
        match self.stated.particle(member) {
            Some(_) => self.particle(member)[0],
            None => self.frame(member).point(components),
        }
    }

    /// Position (m) and velocity (m/s) of a particle.
    #[must_use]
    pub fn particle(&self, name: &str) -> [Vector3<Dual64>; 2] {
        let Some(particle) = self.stated.particle(name) else {
            return [Vector3::zeros(); 2];
        };
        let key = format!("particle.{name}");
        let read = |part: &str, x: &[f64]| {
            let own = |i: usize| match x.get(i) {
                Some(x) => self.slopes.number(&format!("{key}.{part}.{i}"), *x),
                None => Dual64::of(0.0),
            };
            Vector3::new(own(0), own(1), own(2))
        };
        let base = self.base(particle.relative_to.as_deref());
        let position = base.point(read("position", &particle.position));
        let velocity = base.rotation * read("velocity", &particle.velocity);
        [position, base.velocity_at(&position) + velocity]
    }
}
