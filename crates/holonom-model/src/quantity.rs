//! What the names of other members stand for in the expressions of a model.
//!
//! ```text
//! knee, knee.1                 coordinates of a joint: the first, the one of freedom 1
//! knee.rate, knee.1.rate       their rates
//! speed                        a signal
//! arm.x  arm.vx  arm.wx        centre of a body, a node of a beam, a particle; velocities; in space
//! tip.x  rope                  numbers of sensors
//! ```

use crate::Model;
use crate::expression::{ExpressionError, ExpressionProgram, KnownName, renamed_parts};
use crate::formula::Curves;
use crate::text::problem::nearest;
use crate::types::bushing::Coefficients;
use crate::types::law::Formula;
use crate::types::sensor::{Sensor, SensorKind};

/// A quantity of a mechanism that expressions read by its name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// A coordinate of a joint, m or rad, revolutions counted.
    Coordinate {
        /// The joint.
        joint: String,
        /// Which of its coordinates.
        freedom: usize,
    },
    /// Its rate, m/s or rad/s.
    Rate {
        /// The joint.
        joint: String,
        /// Which of its coordinates.
        freedom: usize,
    },
    /// A signal.
    Signal(String),
    /// A component of the centre of a body, a node or a particle, m, in space.
    Position {
        /// The member.
        of: String,
        /// 0 to 2.
        axis: usize,
    },
    /// A component of its velocity, m/s.
    Velocity {
        /// The member.
        of: String,
        /// 0 to 2.
        axis: usize,
    },
    /// A component of the angular velocity of a body or a node, rad/s, in space.
    AngularVelocity {
        /// The member.
        of: String,
        /// 0 to 2.
        axis: usize,
    },
    /// A number of a sensor.
    Sensor {
        /// The sensor.
        sensor: String,
        /// The heading of its column after that name.
        part: String,
        /// Whether it is a rate or a velocity.
        is_rate: bool,
        /// Whether it follows from configuration and velocity as the other quantities do; what
        /// is sampled at nodes or delayed reads it else as it was at the node before.
        at_once: bool,
    },
}

impl Quantity {
    /// Its name in expressions.
    #[must_use]
    pub fn name(&self) -> String {
        let numbered = |joint: &str, freedom: usize| match freedom {
            0 => joint.to_owned(),
            _ => format!("{joint}.{freedom}"),
        };
        match self {
            Self::Coordinate { joint, freedom } => numbered(joint, *freedom),
            Self::Rate { joint, freedom } => numbered(joint, *freedom) + ".rate",
            Self::Signal(name) => name.clone(),
            Self::Position { of, axis } => format!("{of}.{}", ENDS[*axis]),
            Self::Velocity { of, axis } => format!("{of}.{}", ENDS[3 + axis]),
            Self::AngularVelocity { of, axis } => format!("{of}.{}", ENDS[6 + axis]),
            Self::Sensor { sensor, part, .. } if part.is_empty() => sensor.clone(),
            Self::Sensor { sensor, part, .. } => format!("{sensor}.{part}"),
        }
    }

    /// Whether it is a rate or a velocity.
    #[must_use]
    pub fn is_rate(&self) -> bool {
        match self {
            Self::Rate { .. } | Self::Velocity { .. } | Self::AngularVelocity { .. } => true,
            Self::Sensor { is_rate, .. } => *is_rate,
            Self::Coordinate { .. } | Self::Signal(_) | Self::Position { .. } => false,
        }
    }

    /// Whether it depends on the step that follows its node.
    pub(crate) fn is_of_step(&self) -> bool {
        matches!(self, Self::Sensor { at_once: false, .. })
    }
}

impl Model {
    /// Whether a law, a bushing or a signal reads a sensor.
    #[must_use]
    pub fn reads_sensor(&self, sensor: &str) -> bool {
        let coefficients = |own: &Coefficients| -> Vec<Formula> {
            own.entries().into_iter().map(|(_, _, entry)| entry.clone()).collect()
        };
        let bushings = self.bushings.iter().flat_map(|own| {
            let matrices = own.stiffness.iter().chain(&own.damping).flat_map(coefficients);
            matrices.chain(own.force.iter().flatten().cloned()).collect::<Vec<Formula>>()
        });
        let laws = self.laws.iter().flat_map(|law| law.formulas().cloned());
        let signals = self.signals.iter().flat_map(|own| own.formulas().map(|(_, of)| of.clone()));
        let mut found = false;
        for Formula(text) in laws.chain(signals).chain(bushings) {
            renamed_parts(&text, &mut |part| {
                found |= part == sensor;
                part.to_owned()
            });
        }
        found
    }
}

/// Ends of names of members: what they are of, and along which axis.
const ENDS: [&str; 9] = ["x", "y", "z", "vx", "vy", "vz", "wx", "wy", "wz"];

/// What expressions of a model may name.
#[derive(Debug)]
pub struct Quantities<'a> {
    model: &'a Model,
    curves: Curves<'a>,
}

impl<'a> Quantities<'a> {
    /// Those of a model.
    #[must_use]
    pub fn new(model: &'a Model) -> Self {
        Self { model, curves: Curves::new(model) }
    }

    /// The tables.
    #[must_use]
    pub fn curves(&self) -> &Curves<'a> {
        &self.curves
    }

    /// What a name stands for.
    #[must_use]
    pub fn quantity(&self, name: &str) -> Option<Quantity> {
        let (of, is_rate) = match name.strip_suffix(".rate") {
            Some(of) => (of, true),
            None => (name, false),
        };
        let numbered = || {
            let (of, freedom) = of.rsplit_once('.')?;
            Some((self.model.joint(of)?, freedom.parse().ok()?))
        };
        if let Some((joint, freedom)) =
            self.model.joint(of).map(|joint| (joint, 0)).or_else(numbered)
        {
            let (count, joint) = (joint.pair().coordinate_count(), joint.name.clone());
            return (freedom < count).then_some(match is_rate {
                true => Quantity::Rate { joint, freedom },
                false => Quantity::Coordinate { joint, freedom },
            });
        }
        if self.model.signals.iter().any(|signal| signal.name == name) {
            return Some(Quantity::Signal(name.to_owned()));
        }
        self.member(name).or_else(|| self.sensor(name))
    }

    /// A number of a body, a node or a particle.
    fn member(&self, name: &str) -> Option<Quantity> {
        let (of, end) = name.rsplit_once('.')?;
        let place = ENDS.iter().position(|own| *own == end)?;
        let (axis, of) = (place % 3, of.to_owned());
        let (particle, frame) = (self.model.particle(&of), self.model.frame(&of));
        match (place / 3, particle.is_some(), frame.is_some()) {
            (0, true, _) | (0, _, true) => Some(Quantity::Position { of, axis }),
            (1, true, _) | (1, _, true) => Some(Quantity::Velocity { of, axis }),
            (2, false, true) => Some(Quantity::AngularVelocity { of, axis }),
            _ => None,
        }
    }

    /// A number of a sensor, which may turn out to have none of this name.
    fn sensor(&self, name: &str) -> Option<Quantity> {
        let (of, part) = name.split_once('.').unwrap_or((name, ""));
        let own = self.model.sensors.iter().find(|sensor| sensor.name == of)?;
        let (is_rate, at_once) = (own.kind.is_rate(), self.is_at_once(own));
        let (sensor, part) = (of.to_owned(), part.to_owned());
        Some(Quantity::Sensor { sensor, part, is_rate, at_once })
    }

    /// Whether what a sensor measures is a quantity of configuration and velocity with slopes.
    pub(crate) fn is_at_once(&self, sensor: &Sensor) -> bool {
        match sensor.kind {
            SensorKind::Position
            | SensorKind::Velocity
            | SensorKind::AngularVelocity
            | SensorKind::Distance
            | SensorKind::DistanceRate => true,
            SensorKind::JointCoordinate | SensorKind::JointRate => {
                let joint = self.model.joint(&sensor.of);
                joint.is_some_and(|own| own.pair().coordinate_count() == own.pair().dof())
            }
            _ => false,
        }
    }

    /// Compiles an expression whose inputs are its own ones, then `reads`, to which what it names
    /// beside is added.
    ///
    /// # Errors
    /// [`ExpressionError`].
    pub fn compile(
        &self,
        formula: &Formula,
        own: &[&str],
        reads: &mut Vec<Quantity>,
    ) -> Result<ExpressionProgram, ExpressionError> {
        let mut known = |name: &str| {
            let input = own.iter().position(|own| *own == name).map(KnownName::Input);
            input.or_else(|| self.curves.known(name)).or_else(|| {
                let quantity = self.quantity(name)?;
                let at = reads.iter().position(|own| *own == quantity).unwrap_or_else(|| {
                    reads.push(quantity);
                    reads.len() - 1
                });
                Some(KnownName::Input(own.len() + at))
            })
        };
        let program = ExpressionProgram::parse(&formula.0, &mut known);
        program.map_err(|error| self.explained(error, own))
    }

    /// The names that there are: of tables, signals, joint coordinates, members.
    pub(crate) fn names(&self) -> Vec<String> {
        let model = self.model;
        let mut all: Vec<String> = self.curves.names().map(str::to_owned).collect();
        all.extend(model.signals.iter().map(|own| own.name.clone()));
        let joints = model.joints.iter().filter(|own| own.pair().coordinate_count() > 0);
        all.extend(joints.flat_map(|own| [own.name.clone(), format!("{}.rate", own.name)]));
        let members = model.bodies.iter().map(|own| &own.name);
        let members = members.chain(model.particles.iter().map(|own| &own.name));
        all.extend(members.flat_map(|of| ENDS.map(|end| format!("{of}.{end}"))));
        all
    }

    fn explained(&self, error: ExpressionError, own: &[&str]) -> ExpressionError {
        let Some(name) = error.unknown.clone() else { return error };
        let message = format!("`{name}` is not known");
        if let Some(help) = self.beside(&name) {
            return ExpressionError { message, help, ..error };
        }
        let mut all: Vec<String> = own.iter().map(|own| (*own).to_owned()).collect();
        all.extend(self.names());
        let help = match nearest(&name, all.iter().map(String::as_str).filter(|own| own.len() > 1))
        {
            Some(best) => format!("did you mean `{best}`?"),
            None => format!(
                "there are {}, [parameters], tables, signals, joint coordinates (`knee`, `knee.rate`), \
                 members (`arm.x`, `arm.vx`, `arm.wx`), sensors (`tip.x`)",
                own.join(" ")
            ),
        };
        ExpressionError { message, help, ..error }
    }

    /// What to write in the place of a name that is nearly one.
    fn beside(&self, name: &str) -> Option<String> {
        let model = self.model;
        let first = name.split('.').next()?;
        if let Some(joint) = model.joint(first) {
            let kind = joint.pair();
            return Some(match kind.coordinate_count() {
                0 => format!(
                    "a {} joint has no coordinates: read the bodies, `NAME.x` or `NAME.wx`",
                    kind.name()
                ),
                1 => format!("`{first}` has one coordinate: `{first}` and `{first}.rate`"),
                count => format!(
                    "`{first}` has the coordinates `{first}` and `{first}.1` to `{first}.{}`, each with `.rate`",
                    count - 1
                ),
            });
        }
        let of = name.rsplit_once('.').map_or(name, |(of, _)| of);
        let particle = model.particle(of).is_some();
        (particle || model.frame(of).is_some()).then(|| {
            let ends = &ENDS[..if particle { 6 } else { 9 }];
            let list: Vec<String> = ends.iter().map(|end| format!("{of}.{end}")).collect();
            format!("`{of}` has {}", list.join(" "))
        })
    }
}
