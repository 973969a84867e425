//! Steady rotation of a whole system about an axis fixed in space.
//!
//! ```text
//! v = W (q − q_o),   W x = Ω × x for every centre (from o) and director x
//! M q̈ + 2 M W q̇ + M W² (q − q_o) + ∇V(q) − f(t, q, q̇ + v) + Gᵀ μ = 0,   g = 0      in the frame that rotates
//! ```
//! A damper to the ground, `f = −c ẋ` in space, is `−c (ẋ + Ω × x)` in the frame that rotates:
//! beside `c` it adds the circulatory `c Ω̂`, without which every rotor would become unstable above
//! its critical speed.
//!
//! A relative equilibrium is a static equilibrium under the centrifugal force `−M W² (q − q_o)`;
//! small vibrations about it have the stiffness `M W²` and the gyroscopic matrix `2 M W`, which is
//! skew since `M = M̃ ⊗ I` and `W = I ⊗ Ω̂` commute.
//!
//! Source: theory §6.13; J. E. Marsden, Lectures on Mechanics (1992), ch. 4, relative equilibria.
#![allow(non_snake_case)] // W

use crate::field::{
    AxisRotation, Field, Movement, PointPlaces, apart, check_constraints, forces_go_along,
};
use nalgebra::{Matrix3, Vector3};
use vi_constraints::Constraints;
use vi_core::Configuration;
use vi_core::SeparableSystem;
use vi_multibody::mechanism::{Description, Mechanism};
use vi_rigid::rotation::skew;

/// A rotation with a constant angular velocity about an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SteadyRotation {
    /// A point `o` of the axis, m.
    pub point: Vector3<f64>,
    /// `Ω`, rad/s.
    pub velocity: Vector3<f64>,
}

/// Why a system cannot rotate steadily as a whole.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RotationError {
    /// The initial velocities are not those of one rotation.
    #[error(
        "the initial velocities are not those of a steady rotation of the whole system: they differ by {0:.1e} of the \
         largest"
    )]
    NotRigid(f64),
    /// A constraint does not let the system turn.
    #[error("`{0}` does not let the whole system rotate about the axis")]
    Constraint(String),
    /// A force changes its direction in the frame that rotates.
    #[error("the forces do not turn with the system: {0} acts from a direction fixed in space")]
    Force(String),
}

/// Velocities that differ from a rotation by more than this part of the largest are none.
const RIGID: f64 = 1e-8;

impl SteadyRotation {
    /// The rotation that the velocities `v` at the configuration `q` are; `None` at rest.
    ///
    /// # Errors
    /// [`RotationError::NotRigid`].
    pub fn of_velocities(
        mechanism: &Mechanism,
        q: &[f64],
        v: &[f64],
    ) -> Result<Option<Self>, RotationError> {
        if v.iter().all(|v| *v == 0.0) {
            return Ok(None);
        }
        let rotation = Self::nearest(mechanism.description(), q, v);
        let mut own = vec![0.0; q.len()];
        rotation.velocities(mechanism, q, &mut own);
        let relative = apart(&own, v);
        if relative > RIGID {
            return Err(RotationError::NotRigid(relative));
        }
        Ok(Some(rotation))
    }

    /// `Ω` and the axis of least squares: of all differences of blocks, then the point nearest to
    /// the middle.
    fn nearest(description: &Description, q: &[f64], v: &[f64]) -> Self {
        let size = description.dimension.max(2);
        let lift = |x: &[f64]| Vector3::from_fn(|i, _| x.get(i).copied().unwrap_or(0.0));
        let places = PointPlaces::of(description);
        let blocks: Vec<_> = q.chunks(size).zip(v.chunks(size)).enumerate().collect();
        let points = || blocks.iter().filter(|(k, _)| places.is_point(size * k));
        let count = points().count().max(1) as f64;
        let mean = points()
            .fold([Vector3::zeros(); 2], |[x, u], (_, (q, v))| [x + lift(q), u + lift(v)])
            .map(|sum: Vector3<f64>| sum / count);
        // Σ (|x|² I − x xᵀ) Ω = Σ x × v
        let (mut inertia, mut moment) = (Matrix3::zeros(), Vector3::zeros());
        for (k, (q, v)) in &blocks {
            let origin = if places.is_point(size * k) { mean } else { [Vector3::zeros(); 2] };
            let (x, u) = (lift(q) - origin[0], lift(v) - origin[1]);
            inertia -= skew(&x) * skew(&x);
            moment += x.cross(&u);
        }
        let tolerance = 1e-12 * inertia.norm();
        let velocity = inertia
            .pseudo_inverse(tolerance.max(f64::MIN_POSITIVE))
            .map_or_else(|_| Vector3::zeros(), |inverse| inverse * moment);
        let square = velocity.norm_squared();
        let arm = if square > 0.0 { velocity.cross(&mean[1]) / square } else { Vector3::zeros() };
        Self { point: mean[0] + arm, velocity }
    }

    /// `v ← W (q − q_o)`: the velocities of the rotation at the configuration `q`, shape `n`.
    pub fn velocities(&self, mechanism: &Mechanism, q: &[f64], v: &mut [f64]) {
        self.field(mechanism.description()).velocity(q, v);
    }

    /// Its velocities.
    pub(crate) fn field(&self, description: &Description) -> Field {
        let (translation, spins) = (Vector3::zeros(), Vec::new());
        let Self { point, velocity } = *self;
        Field::new(&Movement { point, velocity, translation, spins }, description)
    }

    /// A turn about its axis by an angle, rad.
    pub(crate) fn turn(&self, description: &Description, angle: f64) -> AxisRotation {
        let axis = self.velocity.try_normalize(0.0).unwrap_or_else(Vector3::z);
        AxisRotation::about(axis, self.point, description, angle)
    }

    /// The same axis with another angular velocity, rad/s; the axis of a system at rest is `z`.
    #[must_use]
    pub fn with_speed(&self, speed: f64) -> Self {
        let axis = self.velocity.try_normalize(0.0).unwrap_or_else(Vector3::z);
        Self { point: self.point, velocity: speed * axis }
    }

    /// Whether constraints and forces are those of a system that rotates: after a turn they have
    /// turned with it, constraints at the time when it is made, loads also as they are at `t = 0`.
    ///
    /// # Errors
    /// [`RotationError`].
    pub fn check(
        &self,
        system: &SeparableSystem,
        mechanism: &Mechanism,
        q: &[f64],
    ) -> Result<(), RotationError> {
        const ANGLE: f64 = 0.7; // rad, in no symmetry
        let speed = self.velocity.norm();
        if speed == 0.0 {
            return Ok(());
        }
        let turn = self.turn(mechanism.description(), ANGLE);
        let (t, turned) = (ANGLE / speed, turn.of_configuration(q));
        let start = mechanism.principal_angles(q);
        let mut angles = start.clone();
        mechanism.unwrap_angles(&turned, &mut angles);
        let before = Configuration { t: 0.0, q, angles: &start, internal: &[] };
        let after = Configuration { t, q: &turned, angles: &angles, internal: &[] };
        let field = self.field(mechanism.description());
        check_constraints(mechanism, [before, after], &field, &turn, speed)
            .map_err(RotationError::Constraint)?;
        forces_go_along(system, [before, after], &field, &turn).map_err(RotationError::Force)
    }
}
