//! Sensors along a run: from `[[sensor]]` to the numbers of a node.
//!
//! ```text
//! position           x = φ + ϱ_I d_I                      velocity   ẋ, with v̂ of ᵠp_n
//! orientation        R = (d_1 d_2 d_3) Aᵀ,  A: principal axes in the body's own frame
//! angular velocity   ω = ½ Σ d_I × ḋ_I                    with v̂
//! joint              coordinates counted on, rates        vi_multibody::coordinates
//! reaction           −Gᵀ λ_n on the child                 vi_multibody::reaction
//! effort             springs, motors, prescribed motions  effort
//! section force      N_I, M_I                             strain   Γ_I, K_I         vi_beam::section_force
//! ```
//! `λ_n` is that of the node (36) at order 2. It is that of the acceleration level with composed steps,
//! at a node from which no step could be taken, and at the start, where (47) is of first order only (it
//! is a one-sided difference). Unwrapped angles of joints and the sign of quaternions are followed at
//! every step, whether it is recorded or not.
//!
//! | file | concept |
//! |---|---|
//! | `columns` | names, quantities and units of the numbers |
//! | `view` | what sensors see of a node |
//! | `effort` | springs, dampers, motors, prescribed motions |

mod columns;
mod effort;
mod view;

pub use columns::{Column, columns};
pub(crate) use view::View;

use effort::Effort;

use crate::beams::Beams;
use crate::names::Names;
use crate::run_state::same_length;
use holonom_model::{ReactionFrame, Sensor, SensorKind, spatial};
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use std::collections::BTreeMap;
use std::sync::Arc;
use vi_beam::section_force::SectionPlace;
use vi_beam::{Beam, BeamModel};
use vi_constraints::integrator::ResumeError;
use vi_constraints::least_norm::LeastNorm;
use vi_constraints::saddle_point::IndependentRows;
use vi_core::Configuration;
use vi_multibody::builder::ForceElements;
use vi_multibody::form::Form;
use vi_multibody::joint::Joint;
use vi_multibody::joint_motion::{JointMotion, joint_rates};
use vi_multibody::mechanism::{Attachment, Mechanism};
use vi_multibody::reaction::{NodeReactions, ReactionObserver};
use vi_rigid::directors;

/// What a sensor needs to know of the mechanism.
#[derive(Clone, Debug)]
enum Gauge {
    Position(Form, usize),
    Velocity(Form, usize),
    Orientation(Attitude),
    AngularVelocity(usize), // first coordinate of the frame
    Coordinate(JointMotion),
    Rate(Joint),
    Reaction(usize, ReactionFrame), // joint of the description
    Tension(usize),                 // bar of the description
    Effort(Effort),
    Section(SectionGauge),
}

/// Section forces or strains at a place of a beam.
#[derive(Clone, Debug)]
struct SectionGauge {
    parts: Arc<BeamModel>,
    place: SectionPlace,
    strains: bool,
}

impl SectionGauge {
    fn read(&self, q: &[f64], out: &mut Vec<f64>) {
        out.extend(self.place.read(&self.parts, q, |state| -> [f64; 6] {
            let [[a, b, c], [d, e, f]] = match self.strains {
                false => [state.force, state.moment],
                true => [state.shear_extension, state.curvature],
            };
            [a, b, c, d, e, f]
        }));
    }
}

/// The orientation of a body with a sign that does not jump.
#[derive(Clone, Debug)]
struct Attitude {
    first: usize,         // first coordinate of the frame
    to_own: Matrix3<f64>, // Aᵀ
    last: Quaternion<f64>,
}

impl Attitude {
    fn follow(&mut self, q: &[f64]) {
        let rotation = directors::triad(&q[self.first..]) * self.to_own;
        let rotation = Rotation3::from_matrix_unchecked(rotation);
        let next = UnitQuaternion::from_rotation_matrix(&rotation).into_inner();
        self.last = if next.dot(&self.last) < 0.0 { -next } else { next };
    }
}

/// The sensors of a model, ready to read.
#[derive(Debug, Default)]
pub struct Sensors {
    columns: Vec<Column>,
    gauges: Vec<Gauge>,
    observer: Option<ReactionObserver>, // where sensors ask for reactions
}

impl Sensors {
    /// For a valid model and its mechanism.
    pub(crate) fn new(
        names: &Names<'_>,
        (mechanism, forces): (&Mechanism, &ForceElements),
        beams: &Beams,
    ) -> Self {
        let model = names.model;
        let joints = mechanism.description().joints.iter();
        let builder = Builder {
            names,
            mechanism,
            forces,
            beams,
            joints: joints.map(|joint| joint.name.as_str()).zip(0..).collect(),
            q: mechanism.initial_configuration(),
        };
        let gauges: Vec<Gauge> = model.sensors.iter().filter_map(|s| builder.gauge(s)).collect();
        let reactions = gauges.iter().any(|gauge| match gauge {
            Gauge::Reaction(..) | Gauge::Tension(_) => true,
            Gauge::Effort(effort) => effort.needs_force(),
            _ => false,
        });
        let observer = reactions.then(|| ReactionObserver::new(mechanism));
        Self { columns: columns(model), gauges, observer }
    }

    /// The columns of `sensors.csv`; empty without sensors.
    #[must_use]
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Whether the constraint force is needed.
    pub(crate) fn need_forces(&self) -> bool {
        self.observer.is_some()
    }

    /// Begins to count at the configuration `q`.
    pub(crate) fn begin(&mut self, q: &[f64]) {
        for gauge in &mut self.gauges {
            match gauge {
                Gauge::Coordinate(tracker) => {
                    *tracker = JointMotion::new(tracker.joint().clone(), q);
                }
                Gauge::Orientation(attitude) => {
                    attitude.last = Quaternion::identity(); // w ≥ 0
                    attitude.follow(q);
                }
                Gauge::Effort(effort) => effort.begin(q),
                _ => {}
            }
        }
    }

    /// Goes on to the next step; allocates nothing.
    pub(crate) fn follow(&mut self, q: &[f64]) {
        for gauge in &mut self.gauges {
            match gauge {
                Gauge::Coordinate(tracker) => tracker.follow(q),
                Gauge::Orientation(attitude) => attitude.follow(q),
                Gauge::Effort(effort) => effort.follow(q),
                _ => {}
            }
        }
    }

    /// What is followed, of each sensor.
    pub(crate) fn state(&self) -> Vec<Vec<f64>> {
        let followed = |gauge: &Gauge| match gauge {
            Gauge::Coordinate(tracker) => tracker.values().to_vec(),
            Gauge::Orientation(attitude) => attitude.last.coords.as_slice().to_vec(),
            Gauge::Effort(effort) => effort.followed().to_vec(),
            _ => Vec::new(),
        };
        self.gauges.iter().map(followed).collect()
    }

    /// Whether what was followed is of these sensors.
    ///
    /// # Errors
    /// [`ResumeError::Shape`].
    pub(crate) fn check(&self, state: &[Vec<f64>]) -> Result<(), ResumeError> {
        let own = self.state();
        same_length("the list of sensors", state.len(), own.len())?;
        for (own, found) in own.iter().zip(state) {
            same_length("a sensor", found.len(), own.len())?;
        }
        Ok(())
    }

    /// Continues from what was followed. Premise: [`Sensors::check`].
    pub(crate) fn resume(&mut self, state: &[Vec<f64>]) {
        for (gauge, values) in self.gauges.iter_mut().zip(state) {
            match gauge {
                Gauge::Coordinate(tracker) => tracker.resume(values),
                Gauge::Orientation(attitude) => {
                    attitude.last.coords.as_mut_slice().copy_from_slice(values);
                }
                Gauge::Effort(effort) => effort.resume(values),
                _ => {}
            }
        }
    }

    /// `values ←` the numbers of all columns at the node last followed to; NaN where a reaction is not unique.
    pub(crate) fn read(
        &mut self,
        mechanism: &Mechanism,
        (rows, least_norm): (&IndependentRows, &mut LeastNorm),
        at: View<'_>,
        values: &mut Vec<f64>,
    ) {
        let node = Configuration::new(at.t, at.q);
        let observer = self.observer.as_mut();
        let reactions =
            observer.map(|all| all.observe(mechanism, node, at.force, (rows, least_norm)));
        values.clear();
        for gauge in &self.gauges {
            gauge.read(&at, reactions.as_ref(), values);
        }
    }
}

impl Gauge {
    fn read(&self, at: &View<'_>, reactions: Option<&NodeReactions<'_>>, out: &mut Vec<f64>) {
        let frame = |first: usize| (&at.q[first..first + 12], &at.v[first..first + 12]);
        match self {
            Self::Position(point, axes) => out.extend(&point.at(at.q).as_slice()[..*axes]),
            Self::Velocity(point, axes) => out.extend(&point.rate(at.v).as_slice()[..*axes]),
            Self::Orientation(Attitude { last, .. }) => {
                out.extend([last.w, last.i, last.j, last.k])
            }
            Self::AngularVelocity(first) => {
                let (q, v) = frame(*first);
                out.extend(&directors::angular_velocity(q, v));
            }
            Self::Coordinate(tracker) => out.extend(tracker.values()),
            Self::Rate(joint) => {
                out.extend(&joint_rates(joint, at.q, at.v)[..joint.kind.dof()]);
            }
            Self::Reaction(joint, frame) => {
                let Some(reactions) = reactions else { return };
                let reaction = match frame {
                    ReactionFrame::Parent => reactions.joint(*joint),
                    ReactionFrame::Child => reactions.joint_along_child(*joint),
                    ReactionFrame::Space => reactions.joint_along(*joint, &Matrix3::identity()),
                };
                out.extend(reaction.components().map(|c| c.unwrap_or(f64::NAN)));
                out.push(f64::from(u8::from(reaction.is_unique())));
            }
            Self::Tension(bar) => {
                let Some(tension) = reactions.map(|all| all.bar(*bar)) else { return };
                out.push(if tension.unique { tension.force } else { f64::NAN });
                out.push(f64::from(u8::from(tension.unique)));
            }
            Self::Effort(effort) => effort.read(at, reactions, out),
            Self::Section(section) => section.read(at.q, out),
        }
    }
}

/// Finds what sensors name.
struct Builder<'a> {
    names: &'a Names<'a>,
    mechanism: &'a Mechanism,
    forces: &'a ForceElements,
    beams: &'a Beams,
    joints: BTreeMap<&'a str, usize>, // of the description, by name
    q: Vec<f64>,                      // initial configuration
}

impl Builder<'_> {
    /// The joint of this name; what holds a fixed body or the end of a beam has the name of that.
    fn joint(&self, name: &str) -> Option<usize> {
        self.joints.get(name).copied()
    }

    /// The point of a position or velocity, and how many components it has.
    fn point(&self, sensor: &Sensor) -> Option<(Form, usize)> {
        if let Some(k) = self.names.index(&sensor.of) {
            let own = Vector3::from(spatial(&sensor.point.unwrap_or_default()));
            let along_directors = self.names.principal[k].tr_mul(&own);
            return Some((self.mechanism.point_of(Attachment::Body(k), &along_directors), 3));
        }
        let k = self.names.particles.get(sensor.of.as_str())?.index();
        let point = self.mechanism.point_of(Attachment::Particle(k), &Vector3::zeros());
        Some((point, self.names.model.header.dimension))
    }

    fn section(&self, sensor: &Sensor) -> Option<SectionGauge> {
        let beam = self.beams.list.iter().find(|beam| beam.name == sensor.of)?;
        let parts = &self.beams.parts;
        let place = match (sensor.element, sensor.at) {
            (Some(mut element), _) => {
                let leg = beam.legs.iter().find(|leg| {
                    let inside = element < leg.elements.len();
                    element -= if inside { 0 } else { leg.elements.len() };
                    inside
                })?;
                SectionPlace::of_element(parts, leg, element)
            }
            (None, Some(mut along)) => {
                let length = |leg: &Beam| -> f64 {
                    leg.elements.clone().flat_map(|e| parts.intervals(leg, e)).sum()
                };
                let (last, legs) = beam.legs.split_last()?;
                let leg = legs.iter().find(|leg| {
                    let (own, inside) = (length(leg), along <= length(leg));
                    along -= if inside { 0.0 } else { own };
                    inside
                });
                SectionPlace::at(parts, leg.unwrap_or(last), along)
            }
            (None, None) => return None,
        };
        let strains = sensor.kind == SensorKind::Strain;
        Some(SectionGauge { parts: Arc::clone(parts), place, strains })
    }

    /// `None` only when the model is not valid.
    fn gauge(&self, sensor: &Sensor) -> Option<Gauge> {
        let of = sensor.of.as_str();
        let joint = || self.joint(of).map(|k| self.mechanism.description().joints[k].clone());
        Some(match sensor.kind {
            SensorKind::Position => self.point(sensor).map(|(p, axes)| Gauge::Position(p, axes))?,
            SensorKind::Velocity => self.point(sensor).map(|(p, axes)| Gauge::Velocity(p, axes))?,
            SensorKind::Orientation => {
                let k = self.names.index(of)?;
                let to_own = self.names.principal[k].transpose();
                Gauge::Orientation(Attitude { first: 12 * k, to_own, last: Quaternion::identity() })
            }
            SensorKind::AngularVelocity => Gauge::AngularVelocity(12 * self.names.index(of)?),
            SensorKind::JointCoordinate => Gauge::Coordinate(JointMotion::new(joint()?, &self.q)),
            SensorKind::JointRate => Gauge::Rate(joint()?),
            SensorKind::SectionForce | SensorKind::Strain => Gauge::Section(self.section(sensor)?),
            SensorKind::Reaction => match self.names.model.bars.iter().position(|b| b.name == of) {
                Some(bar) => Gauge::Tension(bar),
                None => Gauge::Reaction(self.joint(of)?, sensor.frame.unwrap_or_default()),
            },
            SensorKind::Effort => Gauge::Effort(Effort::of(of, self)?),
        })
    }
}
