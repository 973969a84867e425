//! Reference cases: reading, dispatch by kind, deviations over tolerances.

use super::{
    beam, control, galerkin, helicoidal, identification, laws, motions, nonsmooth, optimal_control,
    pendulum, rigid,
};
use nalgebra::Matrix3;
use serde::Deserialize;
use std::path::Path;
use vi_multibody::mechanism::BodySpec;
use vi_rigid::body::RigidBody;
use vi_rigid::inertia::PrincipalInertia;

/// Vouched absolute tolerances.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tolerance {
    pub q: f64,
    pub p: f64,
    pub constraint_force: f64,
    pub energy: f64,
    pub momentum: f64,
}

/// Worst deviation over tolerance, by quantity; NaN stays NaN.
#[derive(Clone, Copy, Debug, Default)]
pub struct Deviation {
    pub q: f64,
    pub p: f64,
    pub force: f64,
    pub energy: f64,
    pub momentum: f64,
}

pub fn raise(worst: &mut f64, value: f64) {
    if value > *worst || value.is_nan() {
        *worst = value;
    }
}

impl Deviation {
    pub fn header() -> &'static str {
        "      q       p   force  energy  moment   (deviation / tolerance)"
    }

    pub fn worst(&self) -> f64 {
        let mut worst = 0.0;
        for value in [self.q, self.p, self.force, self.energy, self.momentum] {
            raise(&mut worst, value);
            if worst.is_nan() {
                break;
            }
        }
        worst
    }

    pub fn q(&mut self, found: &[f64], reference: &[f64], tolerance: &Tolerance) {
        raise(&mut self.q, distance(found, reference) / tolerance.q);
    }
    pub fn p(&mut self, found: &[f64], reference: &[f64], tolerance: &Tolerance) {
        raise(&mut self.p, distance(found, reference) / tolerance.p);
    }
    pub fn force(&mut self, found: &[f64], reference: &[f64], tolerance: &Tolerance) {
        raise(&mut self.force, distance(found, reference) / tolerance.constraint_force);
    }
    pub fn energy(&mut self, found: f64, reference: f64, tolerance: &Tolerance) {
        raise(&mut self.energy, distance(&[found], &[reference]) / tolerance.energy);
    }
    pub fn momentum(&mut self, found: &[f64], reference: &[f64], tolerance: &Tolerance) {
        raise(&mut self.momentum, distance(found, reference) / tolerance.momentum);
    }
}

impl std::fmt::Display for Deviation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { q, p, force, energy, momentum } = self;
        write!(f, "{q:>7.4} {p:>7.4} {force:>7.4} {energy:>7.4} {momentum:>7.4}")
    }
}

/// Largest absolute difference; NaN when the shapes differ or a number is NaN.
pub fn distance(a: &[f64], b: &[f64]) -> f64 {
    if a.len() != b.len() {
        return f64::NAN;
    }
    let difference: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    vi_core::linear::norm_inf(&difference)
}

/// A rigid body of a case.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodyCase {
    name: String,
    mass: f64,
    principal_inertia: [f64; 3],
    position: [f64; 3],
    directors: [[f64; 3]; 3], // rows; the columns are the directors
    velocity: [f64; 3],
    omega: [f64; 3],
}

impl BodyCase {
    pub fn spec(&self) -> Result<BodySpec, String> {
        let inertia = PrincipalInertia::new(self.principal_inertia).map_err(|e| e.to_string())?;
        let rigid = RigidBody::from_inertia(self.mass, &inertia).map_err(|e| e.to_string())?;
        Ok(BodySpec {
            name: self.name.clone(),
            body: Some(rigid),
            center: self.position.into(),
            triad: Matrix3::from_fn(|i, j| self.directors[i][j]),
            velocity: self.velocity.into(),
            omega: self.omega.into(),
        })
    }
}

/// A composition given by its coefficients.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CompositionCase {
    #[serde(rename = "name")]
    pub _name: String,
    #[serde(rename = "order")]
    pub _order: u32,
    pub gammas: Vec<f64>,
}

/// A case of any kind.
pub enum Case {
    Pendulum(Box<pendulum::PendulumCase>),
    Rigid(Box<rigid::RigidCase>),
    Beam(Box<beam::BeamCase>),
    Galerkin(Box<galerkin::GalerkinCase>),
    Helicoidal(Box<helicoidal::HelicoidalCase>),
    Coefficients(galerkin::Coefficients),
    Laws(Box<laws::LawCase>),
    Motions(Box<motions::MotionCase>),
    Nonsmooth(Box<nonsmooth::NonsmoothCase>),
    Gradient(Box<control::GradientCase>),
    OptimalControl(Box<optimal_control::OptimalControlCase>),
    Identification(Box<identification::IdentificationCase>),
}

/// Deviation of each scheme that applies.
pub type Runs = Vec<(&'static str, Deviation)>;

impl Case {
    pub fn read(file: &Path) -> Result<Self, String> {
        let text = std::fs::read_to_string(file).map_err(|e| format!("cannot be read: {e}"))?;
        let value: serde_json::Value =
            serde_json::from_str(&text).map_err(|e| format!("is no JSON: {e}"))?;
        let kind = value.get("kind").and_then(|kind| kind.as_str()).unwrap_or("(none)").to_owned();
        let unreadable = |e: serde_json::Error| format!("does not fit its kind `{kind}`: {e}");
        if value.get("stages").is_some() {
            return Ok(Self::Galerkin(Box::new(galerkin::GalerkinCase::read(&value)?)));
        }
        let method = value.get("simulation").and_then(|simulation| simulation.get("method"));
        if method.is_some() {
            return Ok(Self::Nonsmooth(serde_json::from_str(&text).map_err(unreadable)?));
        }
        match value.get("id").and_then(|id| id.as_str()) {
            Some(_) if value.get("speeds").or(value.get("threshold")).is_some() => {
                return Ok(Self::Motions(Box::new(motions::MotionCase::read(file, value)?)));
            }
            Some(_) => return Ok(Self::Laws(Box::new(laws::LawCase::read(file, value)?))),
            None => {}
        }
        if value.get("coefficients").is_some() {
            return Ok(Self::Coefficients(serde_json::from_str(&text).map_err(unreadable)?));
        }
        match kind.as_str() {
            "pendulum2d" => Ok(Self::Pendulum(serde_json::from_str(&text).map_err(unreadable)?)),
            "rigid" => Ok(Self::Rigid(serde_json::from_str(&text).map_err(unreadable)?)),
            "element" | "static" | "modes" | "dynamic" if value.get("strain_rule").is_some() => {
                Ok(Self::Helicoidal(serde_json::from_str(&text).map_err(unreadable)?))
            }
            "optimal_control" => {
                let case = optimal_control::OptimalControlCase::read(value)?;
                Ok(Self::OptimalControl(Box::new(case)))
            }
            "gradient" | "gradient_growth" => {
                Ok(Self::Gradient(serde_json::from_str(&text).map_err(unreadable)?))
            }
            "identification" => {
                let case = identification::IdentificationCase::read(value)?;
                Ok(Self::Identification(Box::new(case)))
            }
            "beam" => Ok(Self::Beam(serde_json::from_str(&text).map_err(unreadable)?)),
            _ => Err(format!("unknown kind `{kind}`")),
        }
    }

    /// Of the discrete Legendre transforms at the first nodes; `None` where the case does not hold
    /// momenta of a variational scheme without composition.
    pub fn legendre(&self) -> Option<Result<Deviation, String>> {
        match self {
            Self::Pendulum(case) => case.legendre(),
            Self::Rigid(case) => case.legendre(),
            Self::Beam(_)
            | Self::Galerkin(_)
            | Self::Helicoidal(_)
            | Self::Coefficients(_)
            | Self::Laws(_)
            | Self::Motions(_)
            | Self::Gradient(_)
            | Self::Nonsmooth(_)
            | Self::OptimalControl(_)
            | Self::Identification(_) => None,
        }
    }

    /// What the case needs and the program does not have: it is then not taken.
    pub fn missing(&self) -> Option<String> {
        match self {
            Self::Laws(case) => case.missing(),
            _ => None,
        }
    }

    pub fn run(&self) -> Result<Runs, String> {
        match self {
            Self::Pendulum(case) => case.run(),
            Self::Rigid(case) => case.run(),
            Self::Beam(case) => case.run(),
            Self::Galerkin(case) => case.run(),
            Self::Helicoidal(case) => case.run(),
            Self::Coefficients(table) => table.run(),
            Self::Laws(case) => case.run(),
            Self::Motions(case) => case.run(),
            Self::Nonsmooth(case) => case.run(),
            Self::Gradient(case) => case.run(),
            Self::OptimalControl(case) => case.run(),
            Self::Identification(case) => case.run(),
        }
    }
}
