//! Natural frequencies and shapes of a model: small vibrations about its initial configuration or about an equilibrium.
//!
//! ```text
//! K x = ω² M x       K, M of the degrees of freedom of the system, without damping
//! ```
//! See [`mod@vi_statics::modes`]. Modes without stiffness (rigid-body motions, spins, idle degrees of freedom) have
//! `ω = 0`; `ω² < 0` is an instability that grows as `exp(√−ω² t)`. Initial velocities are not used.

use crate::beams::Beams;
use crate::outcome::RunFailure;
use crate::sample::{Member, MemberKind};
use crate::statics::Statics;
use holonom_model::{Joint, Model, ModelError, Scheme};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::fmt::Write as _;
use vi_rigid::directors;
use vi_statics::modes::{ModeError, Modes};

/// Steps of the loads that lead to the equilibrium of a model of motion.
const STEPS: f64 = 10.0;
/// Residual force, as a part of the largest one, above which a configuration is no equilibrium.
const BALANCED: f64 = 1e-6;

/// About which configuration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum About {
    /// The initial configuration, under the loads at `t = 0`.
    #[default]
    Start,
    /// The equilibrium under the loads at the end, as `scheme = "static"` finds it.
    Static,
}

/// What a mode is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// `ω² < 0`: the configuration is unstable along it.
    Unstable,
    /// `ω = 0` to round-off: nothing resists.
    Zero,
    /// `ω > 0`.
    Vibration,
}

/// How a component moves in a mode.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MemberShape {
    /// Its name.
    pub name: String,
    /// Displacement of its centre (node, point).
    pub translation: [f64; 3],
    /// Rotation vector; zero for point masses.
    pub rotation: [f64; 3],
}

/// A mode.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mode {
    /// What it is.
    pub kind: Kind,
    /// `ω²`, rad²/s².
    pub omega_squared: f64,
    /// `ω`, rad/s; 0 for those without stiffness and for unstable ones.
    pub omega: f64,
    /// `ω/2π`, Hz.
    pub frequency: f64,
    /// `√−ω²` of an unstable mode, 1/s; otherwise 0.
    pub growth: f64,
    /// The shape, scaled so that the largest displacement is 1 m; where nothing is displaced, the
    /// largest rotation is 1 rad.
    pub shape: Vec<MemberShape>,
}

/// Modes about a configuration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Name of the model.
    pub model: String,
    /// About which configuration.
    pub about: About,
    /// Time of the loads there, s.
    pub t: f64,
    /// Degrees of freedom.
    pub dof: usize,
    /// Unstable modes.
    pub unstable: usize,
    /// Modes without stiffness.
    pub zero: usize,
    /// Softest first: all unstable ones, all without stiffness, and vibrations as asked for.
    pub modes: Vec<Mode>,
    /// `max |Kx − ω²Mx|` relative to the size of its terms, the largest of all modes.
    pub residual: f64,
    /// `max |XᵀMX − I|` of all modes.
    pub orthogonality: f64,
    /// Coordinates of the configuration, components one after the other.
    pub configuration: Vec<f64>,
    /// What is worth knowing.
    pub warnings: Vec<String>,
}

/// Why there are no modes.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ModesError {
    /// The model is not valid, or has a degree of freedom without mass.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The equilibrium was not found.
    #[error("the equilibrium was not found: {}", .0.message)]
    Statics(RunFailure),
}

/// A model at a configuration, ready for its modes.
pub struct ModalAnalysis {
    statics: Statics,
    about: About,
    name: String,
    ignored: Option<String>, // what of the model takes no part
}

impl ModalAnalysis {
    /// Assembles a model, and goes to its equilibrium if that is asked for.
    ///
    /// # Errors
    /// [`ModesError`].
    pub fn new(model: &Model, about: About) -> Result<Self, ModesError> {
        let (name, ignored) = (model.header.name.clone(), ignored(model));
        let mut model = model.clone();
        let of_motion = model.settings.scheme != Scheme::Static;
        if of_motion {
            model.settings.scheme = Scheme::Static;
            model.settings.step = model.settings.end / STEPS;
        }
        let statics = match about {
            About::Start if of_motion => Statics::with_loads_as_stated(&model)?,
            About::Start => Statics::new(&model)?,
            About::Static => {
                let mut statics = Statics::new(&model)?;
                statics.reach_end().map_err(ModesError::Statics)?;
                statics
            }
        };
        Ok(Self { statics, about, name, ignored })
    }

    /// The beams.
    #[must_use]
    pub fn beams(&self) -> &Beams {
        self.statics.beams()
    }

    /// The components, in the order of their coordinates.
    #[must_use]
    pub fn members(&self) -> &[Member] {
        self.statics.members()
    }

    /// The modes: the unstable ones, those without stiffness, and the `count` softest vibrations.
    ///
    /// # Errors
    /// [`ModesError::Model`] when a degree of freedom has no mass.
    pub fn modes(&mut self, count: usize) -> Result<Report, ModesError> {
        let found = vi_statics::modes(self.statics.problem()).map_err(refusal)?;
        let kinds: Vec<Kind> = (0..found.squared.len()).map(|k| kind(&found, k)).collect();
        let number = |kind: Kind| kinds.iter().filter(|k| **k == kind).count();
        let (unstable, zero) = (number(Kind::Unstable), number(Kind::Zero));
        let shown = kinds.iter().take(unstable + zero + count).enumerate();
        let configuration = self.statics.problem().configuration().to_vec();
        let modes = shown.map(|(k, kind)| {
            let shape =
                shape(self.statics.members(), &configuration, found.shapes.column(k).as_slice());
            mode(*kind, found.squared[k], shape)
        });
        let modes = modes.collect();
        Ok(Report {
            model: self.name.clone(),
            about: self.about,
            t: self.statics.problem().factor(),
            dof: found.squared.len(),
            unstable,
            zero,
            modes,
            residual: found.residual,
            orthogonality: found.orthogonality,
            warnings: self.ignored.iter().cloned().chain(warnings(&found)).collect(),
            configuration,
        })
    }
}

/// What of a model takes no part in its modes: motion and damping.
fn ignored(model: &Model) -> Option<String> {
    let moves = |v: &[f64]| v.iter().any(|x| *x != 0.0);
    let bodies = model
        .bodies
        .iter()
        .map(|b| moves(&b.velocity) || b.spatial_angular_velocity() != Vector3::zeros());
    let rates = model.joints.iter().map(|j| j.rate.as_ref().is_some_and(|r| moves(r.values())));
    let particles = model.particles.iter().map(|p| moves(&p.velocity));
    let moving = bodies.chain(rates).chain(particles).any(|moves| moves)
        || model.beams.iter().any(|beam| moves(&beam.velocity) || moves(&beam.angular_velocity));
    let motor = |j: &Joint| j.motor.as_ref().is_some_and(|m| m.derivative != 0.0);
    let damped = model.joints.iter().any(|j| j.damper.is_some() || motor(j))
        || model.springs.iter().any(|spring| spring.damping != 0.0)
        || model.beams.iter().any(|beam| beam.section.damping.is_some());
    let what = match (moving, damped) {
        (false, false) => return None,
        (true, false) => "initial velocities take",
        (false, true) => "dampers and material damping take",
        (true, true) => "initial velocities, dampers and material damping take",
    };
    Some(format!(
        "{what} no part: these are the undamped modes of the system at rest, without centrifugal \
         stiffening and gyroscopic forces"
    ))
}

fn refusal(error: ModeError) -> ModesError {
    let member = String::new();
    ModesError::Model(ModelError::SingularMass { member, detail: error.to_string() })
}

fn kind(found: &Modes, k: usize) -> Kind {
    if found.is_unstable(k) {
        Kind::Unstable
    } else if found.is_zero(k) {
        Kind::Zero
    } else {
        Kind::Vibration
    }
}

fn mode(kind: Kind, squared: f64, shape: Vec<MemberShape>) -> Mode {
    let (omega, growth) = match kind {
        Kind::Unstable => (0.0, (-squared).sqrt()),
        Kind::Zero => (0.0, 0.0),
        Kind::Vibration => (squared.sqrt(), 0.0),
    };
    let frequency = omega / std::f64::consts::TAU;
    Mode { kind, omega_squared: squared, omega, frequency, growth, shape }
}

fn warnings(found: &Modes) -> Vec<String> {
    let mut warnings = Vec::new();
    if found.unbalanced > (BALANCED * found.applied).max(found.round_off) {
        warnings.push(format!(
            "the configuration is no equilibrium, the residual force is {:.2e} N (N·m): these are \
             the modes of its stiffness alone; --at static computes the equilibrium",
            found.unbalanced
        ));
    } else if found.asymmetry > 1e-9 {
        warnings.push(format!(
            "the stiffness is not symmetric, by {:.1e} of its size (torques with fixed directions, \
             followers, control): its symmetric part is used",
            found.asymmetry
        ));
    }
    warnings
}

/// The velocity field of a mode as displacements and rotations of components.
fn shape(members: &[Member], q: &[f64], v: &[f64]) -> Vec<MemberShape> {
    let mut at = 0;
    let mut shape: Vec<MemberShape> = Vec::with_capacity(members.len());
    for member in members {
        let size = member.kind.columns().len();
        let own = at..at + size;
        let mut moved =
            MemberShape { name: member.name.clone(), translation: [0.0; 3], rotation: [0.0; 3] };
        moved.translation[..size.min(3)].copy_from_slice(&v[own.start..own.start + size.min(3)]);
        if member.kind == MemberKind::Frame {
            moved.rotation = directors::angular_velocity(&q[own.clone()], &v[own]).into();
        }
        shape.push(moved);
        at += size;
    }
    let largest = |of: fn(&MemberShape) -> &[f64; 3]| {
        shape.iter().map(|m| Vector3::from(*of(m)).norm()).fold(0.0, f64::max)
    };
    let (translation, rotation) = (largest(|m| &m.translation), largest(|m| &m.rotation));
    let scale = if translation > 1e-9 * rotation { translation } else { rotation };
    if scale > 0.0 {
        let first = shape.iter().flat_map(|m| m.translation.iter().chain(&m.rotation));
        let by_size = |a: &&f64, b: &&f64| a.abs().total_cmp(&b.abs());
        let sign = first.max_by(by_size).map_or(1.0, |x| x.signum()); // the largest number is positive
        for moved in &mut shape {
            let numbers = moved.translation.iter_mut().chain(&mut moved.rotation);
            numbers.for_each(|x| *x *= sign / scale);
        }
    }
    shape
}

impl Mode {
    /// The member that moves most, and along which axis.
    #[must_use]
    pub fn moves_most(&self) -> String {
        let axis = |x: &[f64; 3]| {
            let size = |i: &usize| x[*i].abs();
            (0..3).max_by(|i, j| size(i).total_cmp(&size(j))).unwrap_or(0)
        };
        let largest = |of: fn(&MemberShape) -> &[f64; 3]| {
            let size = |m: &&MemberShape| Vector3::from(*of(m)).norm();
            let member = self.shape.iter().max_by(|a, b| size(a).total_cmp(&size(b)))?;
            (size(&member) > 1e-9).then(|| (member.name.clone(), axis(of(member))))
        };
        match (largest(|m| &m.translation), largest(|m| &m.rotation)) {
            (Some((name, i)), _) => format!("{name} along {}", ["x", "y", "z"][i]),
            (None, Some((name, i))) => format!("{name} about {}", ["x", "y", "z"][i]),
            (None, None) => String::new(),
        }
    }
}

impl Report {
    /// `modes.csv`: a row for each mode and member.
    #[must_use]
    pub fn csv(&self) -> String {
        let mut text = String::from("mode,kind,omega_squared,frequency,member,ux,uy,uz,rx,ry,rz\n");
        for (k, mode) in self.modes.iter().enumerate() {
            let kind = match mode.kind {
                Kind::Unstable => "unstable",
                Kind::Zero => "zero",
                Kind::Vibration => "vibration",
            };
            for moved in &mode.shape {
                let numbers = moved.translation.iter().chain(&moved.rotation);
                let numbers: String = numbers.map(|x| format!(",{x}")).collect();
                let (squared, frequency) = (mode.omega_squared, mode.frequency);
                let _ = writeln!(
                    text,
                    "{},{kind},{squared},{frequency},{}{numbers}",
                    k + 1,
                    moved.name
                );
            }
        }
        text
    }
}
