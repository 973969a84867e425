//! What a mechanism is made of: bodies, point masses, joints, bars, scalar constraints.

use crate::constraint::scalar_constraint::ScalarConstraint;
use crate::geometry::form::Form;
use crate::pair::joint::{FrameId, GROUND, Joint, Side};
use crate::pair::{PairKind, thread};
use nalgebra::{Matrix3, Vector3};
use std::ops::Range;
use vi_rigid::body::RigidBody;
use vi_rigid::directors;

/// A frame with its initial values: a rigid body, or a frame whose mass comes from elsewhere (beam
/// nodes).
#[derive(Clone, Debug, PartialEq)]
pub struct BodySpec {
    /// Its name.
    pub name: String,
    /// Mass and Euler moments; `None`: no mass of its own.
    pub body: Option<RigidBody>,
    /// `φ(0)`, m.
    pub center: Vector3<f64>,
    /// Columns `d_1, d_2, d_3` initially, principal axes of inertia.
    pub triad: Matrix3<f64>,
    /// `φ̇(0)`, m/s.
    pub velocity: Vector3<f64>,
    /// `ω(0)`, spatial, rad/s.
    pub omega: Vector3<f64>,
}

impl BodySpec {
    /// `(φ, d_1, d_2, d_3)` in the initial configuration.
    #[must_use]
    pub fn frame(&self) -> [f64; 12] {
        let mut q = [0.0; 12];
        directors::set_frame(&mut q, &self.center, &self.triad);
        q
    }

    /// Whether both initial velocities are zero.
    #[must_use]
    pub fn is_still(&self) -> bool {
        self.velocity == Vector3::zeros() && self.omega == Vector3::zeros()
    }
}

/// A joint between two frames, the parent at the first point and the child at the second, with the
/// axes `m_1, m_2, n` (columns): all in space, in the initial configuration of `bodies`.
#[must_use]
pub fn joint_at(
    name: &str,
    kind: PairKind,
    [parent, child]: [FrameId; 2],
    points: [Vector3<f64>; 2],
    axes: &Matrix3<f64>,
    bodies: &[BodySpec],
) -> Joint {
    let side = |frame, point| match frame {
        FrameId::Ground => Side::at(frame, &GROUND, point, axes),
        FrameId::Frame(k) => Side::at(frame, &bodies[k].frame(), point, axes),
    };
    let (parent, child) = (side(parent, &points[0]), side(child, &points[1]));
    Joint { name: name.to_owned(), kind, parent, child }
}

/// A point mass with its initial values; in the plane the third components are not read.
#[derive(Clone, Debug, PartialEq)]
pub struct ParticleSpec {
    /// Its name.
    pub name: String,
    /// Mass, kg.
    pub mass: f64,
    /// `x(0)`, m.
    pub position: Vector3<f64>,
    /// `ẋ(0)`, m/s.
    pub velocity: Vector3<f64>,
}

/// An end of a bar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BarEnd {
    /// A point of the ground.
    Ground(Vector3<f64>),
    /// A point mass.
    Particle(usize),
}

/// A massless rigid bar.
#[derive(Clone, Debug, PartialEq)]
pub struct Bar {
    /// Its name.
    pub name: String,
    /// One end.
    pub from: BarEnd,
    /// The point mass at the other end.
    pub to: usize,
    /// Its length, m.
    pub length: f64,
}

/// Everything that makes a mechanism, before springs and loads.
#[derive(Clone, Debug, Default)]
pub struct Description {
    /// 3, or 2 for planar point masses.
    pub dimension: usize,
    /// Acceleration of gravity, m/s².
    pub gravity: Vector3<f64>,
    /// Rigid bodies.
    pub bodies: Vec<BodySpec>,
    /// Point masses.
    pub particles: Vec<ParticleSpec>,
    /// Joints between bodies, and to the ground.
    pub joints: Vec<Joint>,
    /// Bars between point masses, and to the ground.
    pub bars: Vec<Bar>,
    /// Distances, guides, couplings, prescribed motion.
    pub scalars: Vec<ScalarConstraint>,
    /// Joints that the spanning tree leaves out: the user's choice of cuts.
    pub cuts: Vec<usize>,
    /// Frames that begin with the motion of another one, in the order in which they take it.
    pub carried: Vec<Carried>,
}

/// Frames that begin as one rigid body with another frame: the nodes of a beam that a joint moves.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Carried {
    /// The frames.
    pub frames: Range<usize>,
    /// The frame whose motion they take; it may be one of them.
    pub with: usize,
}

/// Where a spring or a sensor is attached.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Attachment {
    /// A point of the ground.
    Ground,
    /// A point of a body.
    Body(usize),
    /// A point mass.
    Particle(usize),
}

impl Description {
    /// Screws hold in the initial configuration, wherever their anchors sit along the axis.
    pub(crate) fn fit_threads(&mut self) {
        let q = self.configuration();
        for joint in &mut self.joints {
            if joint.kind.pitch().is_some() {
                thread::fit_thread(joint, &q);
            }
        }
    }

    /// `q(0)`: the frames of all bodies, then the point masses.
    #[must_use]
    pub fn configuration(&self) -> Vec<f64> {
        let mut q = vec![0.0; self.particle_offset(self.particles.len())];
        for (body, own) in self.bodies.iter().zip(q.chunks_exact_mut(12)) {
            own.copy_from_slice(&body.frame());
        }
        for (k, particle) in self.particles.iter().enumerate() {
            let at = self.particle_offset(k);
            (0..self.dimension).for_each(|i| q[at + i] = particle.position[i]);
        }
        q
    }

    /// Offset of the coordinates of a point mass.
    pub(crate) fn particle_offset(&self, k: usize) -> usize {
        12 * self.bodies.len() + self.dimension * k
    }

    /// From one end of a bar to the other.
    pub(crate) fn bar_form(&self, bar: &Bar) -> Form {
        let dimension = self.dimension;
        let particle = |k| Form::particle(self.particle_offset(k), dimension);
        let from = match bar.from {
            BarEnd::Ground(point) => Form::constant(point),
            BarEnd::Particle(k) => particle(k),
        };
        particle(bar.to).minus(&from)
    }
}
