//! Natural frequencies and shapes of a model: small vibrations about its initial configuration, an
//! equilibrium, or a steady rotation.
//!
//! ```text
//! K x = ω² M x                        K, M of the degrees of freedom of the system
//! (λ² M + λ C + K) x = 0              with dampers, material damping, gyroscopic forces; λ = −δ ± iω
//! first order                         with rolling, with continuous states of signals
//! ```
//! See [`mod@vi_statics::modes`], [`mod@vi_statics::vibrations`], [`vi_statics::rotation`]. Modes
//! without stiffness (rigid-body motions, spins, idle degrees of freedom) have `ω = 0`. Initial
//! velocities count for [`About::Rotation`] and [`About::Motion`] alone.

mod buckling;
mod campbell;
mod report;
mod rounding;

pub use campbell::{Campbell, Speed};
pub use report::{
    About, BucklingFacts, MemberShape, Mode, ModeKind, MotionReport, Report, RotationReport,
};

use crate::assembly::curved_elements::remarks_at;
use crate::digits::rounded;
use crate::experiment::RunnableModel as _;
use crate::run::outcome::RunFailure;
use crate::sample::{Member, MemberKind};
use crate::statics::{InOwnRotation, Statics, refuse_rolling, refuse_states};
use crate::system::beams::Beams;
use holonom_model::{Model, ModelError};
use nalgebra::{Complex, Vector3};
use rounding::ModeRounding;
use vi_statics::modes::{ModeError, Modes};
use vi_statics::{
    BucklingError, MotionKind, RotationError, StaticLinearization, SteadyMotion, SteadyMotionError,
    SteadyRotation, Vibration,
};

/// Residual force, as a part of the largest one, above which a configuration is no equilibrium.
const BALANCED: f64 = 1e-6;
/// States of signals that change by more than this over the run, or in a second, do not rest.
const RESTS: f64 = 1e-6;
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
    /// The system does not move steadily.
    #[error(transparent)]
    Motion(#[from] SteadyMotionError),
    /// The modes found are not certain to be all.
    #[error(transparent)]
    Uncertain(ModeError),
    /// No mode was found of a system that can move.
    #[error("no mode was found of {0} degrees of freedom")]
    Nothing(usize),
    /// There are no critical loads.
    #[error(transparent)]
    Buckling(#[from] BucklingError),
    /// The work is no longer wanted ([`vi_core::interruption`]).
    #[error("the work was interrupted")]
    Interrupted,
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
    motion: Option<SteadyMotion>,
    restless: f64,           // rate of states of signals that do not rest
    ignored: Option<String>, // what of the model takes no part
}

impl ModalAnalysis {
    /// Assembles a model, and goes to its equilibrium or steady rotation if that is asked for.
    ///
    /// # Errors
    /// [`ModesError`].
    pub fn new(model: &Model, about: About) -> Result<Self, ModesError> {
        let mut motion = None;
        let mut statics = match about {
            About::Static => {
                let mut statics = Statics::along_loads(model)?;
                statics.reach_end().map_err(ModesError::Statics)?;
                statics
            }
            About::Start => {
                let statics = Statics::in_motion(model)?;
                if statics.mechanism().velocity_rows().any(|(_, row)| row.is_driven()) {
                    refuse_rolling(model, "what is driven does not rest: use --at motion")?;
                }
                statics
            }
            About::Motion => {
                let (statics, own) = Statics::in_motion(model)?.in_own_motion()?;
                motion = Some(own);
                statics
            }
            About::Rotation => {
                refuse_steady(model)?;
                let found = Statics::at_start(model)?.in_own_rotation()?;
                let InOwnRotation { statics, rotation } = found;
                return Self::relaxed(model, statics, rotation.ok_or(ModesError::NoRotation)?);
            }
        };
        let restless = match model.signals.iter().any(|signal| signal.has_states()) {
            true => statics.problem().list_states(),
            false => 0.0,
        };
        let (name, ignored) = (model.header.name.clone(), ignored(model, about));
        Ok(Self { statics, about, name, rotation: None, motion, restless, ignored })
    }

    /// At the relative equilibrium of a rotation that the system admits, found from the
    /// configuration `from`.
    fn in_rotation(
        model: &Model,
        rotation: SteadyRotation,
        from: Option<&[f64]>,
    ) -> Result<Self, ModesError> {
        refuse_steady(model)?;
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
        let (about, motion, restless, ignored) = (About::Rotation, None, 0.0, None);
        Ok(Self { statics, about, name, rotation, motion, restless, ignored })
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
        if vi_core::interruption::is_raised() {
            return Err(ModesError::Interrupted);
        }
        let asked = count;
        let first_order = self.motion.is_some()
            || self.statics.mechanism().has_velocity_constraints()
            || self.statics.problem().has_states();
        if first_order {
            return self.modes_of_first_order(count);
        }
        let large = self.statics.assembly().counts.dof > LARGE;
        let problem = self.statics.problem();
        let linear = match large {
            true => StaticLinearization::lowest(problem, count),
            false => StaticLinearization::all(problem),
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
        let place = ShapePoint { members: self.statics.members(), q: &configuration };
        let list = match &complex {
            Some(found) => complex_modes(
                &place,
                |motion| found.count(motion),
                |motion, k| found.get(motion, k),
                count,
            ),
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
        let rounding = ModeRounding::of(&found);
        let coarse = remarks_at(self.statics.beams(), &configuration, &[]);
        Ok(Report {
            model: self.name.clone(),
            about: self.about,
            rotation: self.rotation.as_ref().map(rotation_report),
            motion: None,
            t: self.statics.problem().factor(),
            dof: found.dof,
            unstable,
            zero: count(MotionKind::Rigid, Modes::is_zero),
            round_off: rounding.below,
            modes: list.into_iter().map(|(mode, _)| mode).collect(),
            residual,
            orthogonality: found.orthogonality,
            unstable_by_inertia: by_inertia,
            warnings: self
                .ignored
                .iter()
                .cloned()
                .chain(warnings(found.dof, [found.unbalanced, found.applied, found.round_off]))
                .chain(coarse)
                .chain(rounding.warning(residual))
                .collect(),
            buckling: None,
            configuration,
        })
    }

    /// The same with constraints on velocities, with states of signals, about a steady motion.
    fn modes_of_first_order(&mut self, count: usize) -> Result<Report, ModesError> {
        let linear = StaticLinearization::all(self.statics.problem()).map_err(refusal)?;
        let balance = linear.balance();
        let found = linear.first_order().map_err(refusal)?;
        let configuration = self.statics.problem().configuration().to_vec();
        let place = ShapePoint { members: self.statics.members(), q: &configuration };
        let list = complex_modes(
            &place,
            |motion| found.count(motion),
            |motion, k| found.get(motion, k),
            count,
        );
        if list.is_empty() && found.dof() > 0 && count > 0 {
            return Err(ModesError::Nothing(found.dof()));
        }
        let rests = self.restless * self.statics.end().max(1.0) > RESTS;
        let restless = rests.then(|| {
            format!(
                "the states of signals do not rest here, the largest changes by {} a second: these \
                 are the modes with the states as they are at the start",
                rounded(self.restless, 3)
            )
        });
        let ignored = self.ignored.iter().cloned();
        let moving = self.motion.as_ref();
        let unbalanced = warnings_of_motion(found.dof(), balance, moving.is_some());
        let turns = moving.filter(|motion| motion.velocity != Vector3::zeros());
        let as_rotation =
            |own: &SteadyMotion| SteadyRotation { point: own.point, velocity: own.velocity };
        Ok(Report {
            model: self.name.clone(),
            about: self.about,
            rotation: turns.map(as_rotation).as_ref().map(rotation_report),
            motion: moving.map(|motion| motion_report(motion, self.statics.members())),
            t: self.statics.problem().factor(),
            dof: found.dof(),
            unstable: found.count(MotionKind::Growth),
            zero: found.count(MotionKind::Rigid),
            round_off: 0.0,
            residual: list.iter().map(|(_, residual)| *residual).fold(0.0, f64::max),
            modes: list.into_iter().map(|(mode, _)| mode).collect(),
            orthogonality: 0.0,
            unstable_by_inertia: None,
            warnings: ignored.chain(restless).chain(unbalanced).collect(),
            buckling: None,
            configuration,
        })
    }
}

/// What a steady rotation of all is not.
fn refuse_steady(model: &Model) -> Result<(), ModelError> {
    refuse_rolling(model, "use --at motion, which also takes wheels that roll around a circle")?;
    refuse_states(model, "modes in a steady rotation")
}

fn rotation_report(rotation: &SteadyRotation) -> RotationReport {
    RotationReport {
        speed: rotation.velocity.norm(),
        axis: clean(rotation.velocity.try_normalize(0.0).unwrap_or_else(Vector3::z)),
        point: clean(rotation.point),
    }
}

fn motion_report(motion: &SteadyMotion, members: &[Member]) -> MotionReport {
    let frames = members.iter().filter(|member| member.kind == MemberKind::Frame);
    let spinning = motion.spins.iter().zip(frames).filter(|(spin, _)| spin.norm() > 0.0);
    let spins = spinning.map(|(spin, member)| (member.name.clone(), spin.norm()));
    MotionReport { velocity: clean(motion.translation), spins: spins.collect() }
}

/// Without what is round-off beside 1.
fn clean(x: Vector3<f64>) -> [f64; 3] {
    x.map(|x| if x.abs() < 1e-12 { 0.0 } else { x }).into()
}

/// What of a model takes no part in its modes.
fn ignored(model: &Model, about: About) -> Option<String> {
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
    let moving = (moving && about != About::Motion).then(|| {
        "initial velocities take no part: these are the modes of the system at rest, without centrifugal \
         stiffening and gyroscopic forces; --at rotation takes those of the steady rotation, --at motion \
         those of a steady motion with wheels or rotors"
            .to_owned()
    });
    let nonsmooth = model.is_nonsmooth().then(|| {
        "stops, dry friction and contacts take no part: parts move as if nothing held them"
            .to_owned()
    });
    moving.into_iter().chain(held).chain(nonsmooth).reduce(|all, more| format!("{all}; {more}"))
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
struct ShapePoint<'a> {
    members: &'a [Member],
    q: &'a [f64],
}

/// All unstable modes, all without stiffness, `count` vibrations; with the residual of each.
fn undamped_modes(place: &ShapePoint<'_>, found: &Modes, count: usize) -> Vec<(Mode, f64)> {
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
fn complex_modes(
    place: &ShapePoint<'_>,
    number: impl Fn(MotionKind) -> usize,
    get: impl Fn(MotionKind, usize) -> Option<Vibration>,
    count: usize,
) -> Vec<(Mode, f64)> {
    let get = &get;
    let kinds = [
        (MotionKind::Growth, ModeKind::Unstable, usize::MAX),
        (MotionKind::Rigid, ModeKind::Zero, usize::MAX),
        (MotionKind::Vibration, ModeKind::Vibration, count),
        (MotionKind::Decay, ModeKind::Decay, count),
    ];
    let of_kind = |(motion, kind, most): (MotionKind, ModeKind, usize)| {
        let listed = (0..number(motion).min(most)).filter_map(move |k| get(motion, k));
        listed.map(move |Vibration { value, shape, residual, .. }| {
            (mode(place, kind, value, &shape), residual)
        })
    };
    kinds.into_iter().flat_map(of_kind).collect()
}

/// The mode `x e^{λt}`.
fn mode(place: &ShapePoint<'_>, kind: ModeKind, value: Complex<f64>, v: &[Complex<f64>]) -> Mode {
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

fn warnings(dof: usize, balance: [f64; 3]) -> Vec<String> {
    warnings_of_motion(dof, balance, false)
}

fn warnings_of_motion(
    dof: usize,
    [unbalanced, applied, round_off]: [f64; 3],
    moves: bool,
) -> Vec<String> {
    let mut warnings = Vec::new();
    let residual = rounded(unbalanced, 3);
    if dof == 0 {
        warnings.push("0 degrees of freedom: nothing can move, and there are no modes".to_owned());
    } else if unbalanced > (BALANCED * applied).max(round_off) {
        warnings.push(match moves {
            false => format!(
                "the configuration is no equilibrium, the residual force is {residual} N (N·m): these are \
                 the modes of its stiffness alone; --at static computes the equilibrium"
            ),
            true => format!(
                "the motion is not steady, the residual force is {residual} N (N·m): these are the modes \
                 of the equations linearized about it all the same; change the initial velocities, or the \
                 lean, until nothing accelerates"
            ),
        });
    }
    warnings
}
