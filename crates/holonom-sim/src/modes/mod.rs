//! Natural frequencies and shapes of a model: small vibrations about its initial configuration, an
//! equilibrium, or a steady rotation.
//!
//! ```text
//! K x = ω² M x                        K, M of the degrees of freedom of the system
//! (λ² M + λ C + K) x = 0              with dampers, material damping, gyroscopic forces; λ = −δ ± iω
//! ```
//! See [`mod@vi_statics::modes`], [`mod@vi_statics::vibrations`], [`vi_statics::rotation`]. Modes
//! without stiffness (rigid-body motions, spins, idle degrees of freedom) have `ω = 0`. Initial
//! velocities count for [`About::Rotation`] alone.

mod buckling;
mod campbell;
mod report;

pub use campbell::{Campbell, Speed};
pub use report::{About, BucklingFacts, MemberShape, Mode, ModeKind, Report, RotationReport};

use crate::digits::rounded;
use crate::experiment::Experiment as _;
use crate::run::outcome::RunFailure;
use crate::sample::Member;
use crate::statics::{InOwnRotation, Statics, refuse_states};
use crate::system::beams::Beams;
use holonom_model::{Model, ModelError};
use nalgebra::{Complex, Vector3};
use vi_statics::modes::{ModeError, Modes};
use vi_statics::{
    BucklingError, Linearization, MotionKind, RotationError, SteadyRotation, Vibration, Vibrations,
};

/// Residual force, as a part of the largest one, above which a configuration is no equilibrium.
const BALANCED: f64 = 1e-6;
/// Degrees of freedom beyond which only the lowest modes are computed.
const LARGE: usize = 300;

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
    /// The system cannot rotate steadily as a whole.
    #[error(transparent)]
    Rotation(#[from] RotationError),
    /// The modes found are not certain to be all.
    #[error(transparent)]
    Uncertain(ModeError),
    /// No mode was found of a system that can move.
    #[error("no mode was found of {0} degrees of freedom")]
    Nothing(usize),
    /// There are no critical loads.
    #[error(transparent)]
    Buckling(#[from] BucklingError),
    /// No axis is known.
    #[error("the initial velocities are zero: there is no rotation to take modes about")]
    NoRotation,
}

/// A model at a configuration, ready for its modes.
#[derive(Debug)]
pub struct ModalAnalysis {
    statics: Statics,
    about: About,
    name: String,
    rotation: Option<SteadyRotation>,
    ignored: Option<String>, // what of the model takes no part
}

impl ModalAnalysis {
    /// Assembles a model, and goes to its equilibrium or steady rotation if that is asked for.
    ///
    /// # Errors
    /// [`ModesError`].
    pub fn new(model: &Model, about: About) -> Result<Self, ModesError> {
        refuse_states(model)?;
        let statics = match about {
            About::Static => {
                let mut statics = Statics::along_loads(model)?;
                statics.reach_end().map_err(ModesError::Statics)?;
                statics
            }
            About::Start => Statics::at_start(model)?,
            About::Rotation => {
                let found = Statics::at_start(model)?.in_own_rotation()?;
                let InOwnRotation { statics, rotation } = found;
                return Self::relaxed(model, statics, rotation.ok_or(ModesError::NoRotation)?);
            }
        };
        let (name, ignored) = (model.header.name.clone(), ignored(model));
        Ok(Self { statics, about, name, rotation: None, ignored })
    }

    /// At the relative equilibrium of a rotation that the system admits, found from the
    /// configuration `from`.
    fn in_rotation(
        model: &Model,
        rotation: SteadyRotation,
        from: Option<&[f64]>,
    ) -> Result<Self, ModesError> {
        refuse_states(model)?;
        let statics = Statics::at_start(model)?.in_rotation(&rotation, from);
        Self::relaxed(model, statics, rotation)
    }

    fn relaxed(
        model: &Model,
        mut statics: Statics,
        rotation: SteadyRotation,
    ) -> Result<Self, ModesError> {
        statics.relax().map_err(ModesError::Statics)?;
        let (name, rotation) = (model.header.name.clone(), Some(rotation));
        Ok(Self { statics, about: About::Rotation, name, rotation, ignored: None })
    }

    /// The state.
    pub(crate) fn statics(&mut self) -> &mut Statics {
        &mut self.statics
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

    /// The modes: the unstable ones, those without stiffness, and the `count` softest vibrations
    /// and slowest decays.
    ///
    /// # Errors
    /// [`ModesError::Model`] when a degree of freedom has no mass.
    pub fn modes(&mut self, count: usize) -> Result<Report, ModesError> {
        let asked = count;
        let large = self.statics.assembly().counts.dof > LARGE;
        let problem = self.statics.problem();
        let linear = match large {
            true => Linearization::lowest(problem, count),
            false => Linearization::all(problem),
        };
        let linear = linear.map_err(refusal)?;
        let (found, complex) =
            if linear.is_undamped() && !linear.is_circulatory().map_err(refusal)? {
                (linear.modes().map_err(refusal)?, None)
            } else {
                let vibrations = linear.vibrations().map_err(refusal)?;
                (vibrations.undamped(), Some(vibrations))
            };
        let configuration = self.statics.problem().configuration().to_vec();
        let place = Place { members: self.statics.members(), q: &configuration };
        let list = match &complex {
            Some(vibrations) => complex_modes(&place, vibrations, count),
            None => undamped_modes(&place, &found, count),
        };
        let count = |motion, kind: fn(&Modes, usize) -> bool| match &complex {
            Some(vibrations) => vibrations.count(motion),
            None => (0..found.squared.len()).filter(|&k| kind(&found, k)).count(),
        };
        let unstable = count(MotionKind::Growth, Modes::is_unstable);
        let by_inertia = found.negative.filter(|_| complex.is_none());
        if list.is_empty() && found.dof > 0 && asked > 0 {
            return Err(ModesError::Nothing(found.dof));
        }
        let residual = list.iter().map(|(_, residual)| *residual).fold(found.residual, f64::max);
        Ok(Report {
            model: self.name.clone(),
            about: self.about,
            rotation: self.rotation.map(|r| RotationReport {
                speed: r.velocity.norm(),
                axis: clean(r.velocity.try_normalize(0.0).unwrap_or_else(Vector3::z)),
                point: clean(r.point),
            }),
            t: self.statics.problem().factor(),
            dof: found.dof,
            unstable,
            zero: count(MotionKind::Rigid, Modes::is_zero),
            modes: list.into_iter().map(|(mode, _)| mode).collect(),
            residual,
            orthogonality: found.orthogonality,
            unstable_by_inertia: by_inertia,
            warnings: self.ignored.iter().cloned().chain(warnings(&found)).collect(),
            buckling: None,
            configuration,
        })
    }
}

/// Without what is round-off beside 1.
fn clean(x: Vector3<f64>) -> [f64; 3] {
    x.map(|x| if x.abs() < 1e-12 { 0.0 } else { x }).into()
}

/// What of a model takes no part in its modes at rest.
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
    let held = model.signals.iter().any(|signal| signal.every.is_some() || signal.delay.is_some());
    let held =
        held.then(|| "signals that are sampled or delayed are held at their start".to_owned());
    let moving = moving.then(|| {
        "initial velocities take no part: these are the modes of the system at rest, without centrifugal \
         stiffening and gyroscopic forces; --at rotation takes those of the steady rotation"
            .to_owned()
    });
    moving.into_iter().chain(held).reduce(|all, more| format!("{all}; {more}"))
}

fn refusal(error: ModeError) -> ModesError {
    let uncertain = matches!(
        error,
        ModeError::Unconfirmed { .. } | ModeError::Uncounted | ModeError::NotSettled { .. }
    );
    if uncertain {
        return ModesError::Uncertain(error);
    }
    let member = String::new();
    ModesError::Model(ModelError::SingularMass { member, detail: error.to_string() })
}

/// Where shapes are taken.
struct Place<'a> {
    members: &'a [Member],
    q: &'a [f64],
}

/// All unstable modes, all without stiffness, `count` vibrations; with the residual of each.
fn undamped_modes(place: &Place<'_>, found: &Modes, count: usize) -> Vec<(Mode, f64)> {
    let kind = |k: usize| match (found.is_unstable(k), found.is_zero(k)) {
        (true, _) => ModeKind::Unstable,
        (_, true) => ModeKind::Zero,
        _ => ModeKind::Vibration,
    };
    let kinds: Vec<ModeKind> = (0..found.squared.len()).map(kind).collect();
    let listed = kinds.iter().filter(|kind| **kind != ModeKind::Vibration).count() + count;
    let mode = |(k, kind): (usize, &ModeKind)| {
        let v: Vec<_> = found.shapes.column(k).iter().map(|v| Complex::new(*v, 0.0)).collect();
        let square = found.squared[k];
        let value = match kind {
            ModeKind::Unstable => Complex::new((-square).sqrt(), 0.0),
            ModeKind::Vibration => Complex::new(0.0, square.sqrt()),
            _ => Complex::default(),
        };
        let mode = Mode { omega_squared: square, ..mode(place, *kind, value, &v) };
        (mode, found.residual)
    };
    kinds.iter().take(listed).enumerate().map(mode).collect()
}

/// The same with damping, gyroscopic and circulatory forces, and `count` decays.
fn complex_modes(place: &Place<'_>, found: &Vibrations, count: usize) -> Vec<(Mode, f64)> {
    let kinds = [
        (MotionKind::Growth, ModeKind::Unstable, usize::MAX),
        (MotionKind::Rigid, ModeKind::Zero, usize::MAX),
        (MotionKind::Vibration, ModeKind::Vibration, count),
        (MotionKind::Decay, ModeKind::Decay, count),
    ];
    let of_kind = |(motion, kind, most): (MotionKind, ModeKind, usize)| {
        let listed = (0..found.count(motion).min(most)).filter_map(move |k| found.get(motion, k));
        listed.map(move |Vibration { value, shape, residual, .. }| {
            (mode(place, kind, value, &shape), residual)
        })
    };
    kinds.into_iter().flat_map(of_kind).collect()
}

/// The mode `x e^{λt}`.
fn mode(place: &Place<'_>, kind: ModeKind, value: Complex<f64>, v: &[Complex<f64>]) -> Mode {
    let size = value.norm();
    Mode {
        kind,
        omega_squared: if value.im == 0.0 { -size * size } else { value.im * value.im },
        omega: value.im,
        frequency: value.im / std::f64::consts::TAU,
        growth: value.re.max(0.0),
        decay: (-value.re).max(0.0),
        damping_ratio: if size > 0.0 { (-value.re).max(0.0) / size } else { 0.0 },
        load_factor: None,
        shape: report::shape(place.members, place.q, v),
    }
}

fn warnings(found: &Modes) -> Vec<String> {
    let mut warnings = Vec::new();
    if found.dof == 0 {
        warnings.push("0 degrees of freedom: nothing can move, and there are no modes".to_owned());
    } else if found.unbalanced > (BALANCED * found.applied).max(found.round_off) {
        warnings.push(format!(
            "the configuration is no equilibrium, the residual force is {} N (N·m): these are \
             the modes of its stiffness alone; --at static computes the equilibrium",
            rounded(found.unbalanced, 3)
        ));
    }
    warnings
}
