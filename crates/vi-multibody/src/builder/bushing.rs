//! Bushings between two frames.

use super::error::finite;
use super::force::{ElementForce, NamedSixSpring};
use super::law::Read;
use super::{BuildError, ForceElements, MechanismBuilder};
use crate::force::bushing::{LinearSix, SixForce, SixSpring};
use crate::force::law::{Law, ReadingLaw};
use crate::geometry::six_coordinates::{AttachedFrame, Matrix6, Rotation, SixCoordinates, Vector6};
use crate::mechanism::Mechanism;
use crate::pair::joint::FrameId;
use nalgebra::{Matrix3, Vector3};
use std::sync::Arc;
use vi_rigid::directors::{FRAME, director};

/// A bushing as it was described.
#[derive(Clone)]
pub(super) struct BushingPart {
    name: String,
    frames: [FrameId; 2],
    position: Vector3<f64>,
    axes: Matrix3<f64>,
    rotation: Rotation,
    efforts: BushingEfforts,
}

#[derive(Clone)]
enum BushingEfforts {
    Linear(Box<LinearSix>),
    Law { reads: Vec<Read>, states: Vec<usize>, law: Arc<dyn Law> },
}

impl BushingPart {
    pub(super) fn new(from: FrameId, to: FrameId) -> Self {
        Self {
            name: String::new(),
            frames: [from, to],
            position: Vector3::zeros(),
            axes: Matrix3::identity(),
            rotation: Rotation::Vector,
            efforts: BushingEfforts::Linear(Box::default()),
        }
    }
}

/// A bushing that was added: at the origin along the axes of space, without any effort, until said
/// otherwise.
pub struct BushingEntry<'a> {
    part: &'a mut BushingPart,
}

impl std::fmt::Debug for BushingEntry<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("BushingEntry").field("name", &self.part.name).finish_non_exhaustive()
    }
}

impl<'a> BushingEntry<'a> {
    pub(super) fn new(part: &'a mut BushingPart) -> Self {
        Self { part }
    }

    fn linear(&mut self) -> &mut LinearSix {
        if let BushingEfforts::Law { .. } = self.part.efforts {
            self.part.efforts = BushingEfforts::Linear(Box::default());
        }
        match &mut self.part.efforts {
            BushingEfforts::Linear(linear) => linear,
            BushingEfforts::Law { .. } => unreachable!("it was replaced"),
        }
    }

    /// Its name, under which its energy and its work are listed.
    pub fn named(self, name: &str) -> Self {
        name.clone_into(&mut self.part.name);
        self
    }

    /// Where both frames are in the initial configuration, m, in space.
    pub fn at(self, position: impl Into<Vector3<f64>>) -> Self {
        self.part.position = position.into();
        self
    }

    /// The axes of both frames in the initial configuration: columns, in space.
    pub fn attitude(self, axes: Matrix3<f64>) -> Self {
        self.part.axes = axes;
        self
    }

    /// How its rotation is measured.
    pub fn rotation(self, rotation: Rotation) -> Self {
        self.part.rotation = rotation;
        self
    }

    /// `K`: N/m, N/rad, N, N·m/rad; a potential where it is symmetric.
    pub fn stiffness(mut self, stiffness: Matrix6) -> Self {
        self.linear().stiffness = stiffness;
        self
    }

    /// `C`: N·s/m, N·s/rad, N·s, N·m·s/rad.
    pub fn damping(mut self, damping: Matrix6) -> Self {
        self.linear().damping = damping;
        self
    }

    /// Efforts in the initial configuration, N and N·m, on the second frame.
    pub fn preload(mut self, preload: Vector6) -> Self {
        self.linear().preload = preload;
        self
    }

    /// Any efforts, instead of those of constant coefficients, of what the law `reads`, of its
    /// coordinates and their rates as [`Read::Six`], and of states of signals.
    pub fn law(self, reads: Vec<Read>, states: Vec<usize>, law: Arc<dyn Law>) -> Self {
        self.part.efforts = BushingEfforts::Law { reads, states, law };
        self
    }
}

impl MechanismBuilder {
    /// Adds bushings to the force elements, for a mechanism of this description.
    pub(super) fn add_bushings(
        &self,
        mechanism: &mut Mechanism,
        forces: &mut ForceElements,
    ) -> Result<(), BuildError> {
        let q = &mechanism.initial_configuration();
        for (k, part) in self.bushings.iter().enumerate() {
            let BushingPart { name, frames, position, axes, rotation, efforts } = part;
            let element = || match name.as_str() {
                "" => format!("bushing {k}"),
                name => format!("bushing `{name}`"),
            };
            self.check_frames(element, *frames)?;
            finite(element, "position", position.as_slice())?;
            finite(element, "axes", axes.as_slice())?;
            let [from, to] = frames.map(|frame| attached(frame, q, position, axes));
            let coordinates = SixCoordinates::new(from, to, *rotation);
            match efforts {
                BushingEfforts::Law { reads, states, law } => {
                    let inputs = self.inputs(name, reads, mechanism)?;
                    let mut reading = ReadingLaw::new(law.clone(), inputs, states.clone());
                    reading.start = self.start_of_signals();
                    let force = SixForce::new(coordinates, reading);
                    forces.add(name, ElementForce::Six(force));
                }
                BushingEfforts::Linear(linear) => {
                    finite(element, "stiffness", linear.stiffness.as_slice())?;
                    finite(element, "damping", linear.damping.as_slice())?;
                    finite(element, "preload", linear.preload.as_slice())?;
                    let LinearSix { preload, stiffness, .. } = **linear;
                    let mut rest = **linear;
                    if stiffness == stiffness.transpose() {
                        rest = LinearSix { damping: linear.damping, ..LinearSix::default() };
                        let spring =
                            SixSpring { coordinates: coordinates.clone(), stiffness, preload };
                        forces.bushings.push(NamedSixSpring { name: name.clone(), spring });
                    }
                    if rest != LinearSix::default() {
                        let inputs = LinearSix::inputs();
                        let reading = ReadingLaw::new(Arc::new(rest), inputs, Vec::new());
                        let force = SixForce::new(coordinates, reading);
                        forces.add(name, ElementForce::Six(force));
                    }
                }
            }
        }
        Ok(())
    }
}

/// The frame of a body, or of the ground, that has this place in the configuration `q`.
fn attached(
    frame: FrameId,
    q: &[f64],
    position: &Vector3<f64>,
    axes: &Matrix3<f64>,
) -> AttachedFrame {
    let FrameId::Frame(k) = frame else { return AttachedFrame::on_ground(position, axes) };
    let offset = FRAME * k;
    let own = &q[offset..offset + FRAME];
    let directors = Matrix3::from_columns(&[0, 1, 2].map(|i| director(own, i)));
    let center = Vector3::new(own[0], own[1], own[2]);
    let point = directors.transpose() * (position - center);
    AttachedFrame::in_body(offset, &point, &(directors.transpose() * axes))
}
