//! Steady motion of a system: it moves along and turns as a whole, while frames that are alike
//! about an axis spin about it.
//!
//! ```text
//! φ̇ = V + Ω × (φ − o),   ω = Ω + Σ_I w_I d_I           w: spin, along the directors of the frame
//! ```
//! Wheels that roll straight ahead or around a circle, and rotors in bearings, move so. In the
//! frame that moves along and spins with each of them nothing changes: small motions about it have
//! constant coefficients ([`crate::first_order`]). Of all splits of the velocities into `Ω` and
//! spins the simplest that the system admits is taken: spins alone, then a translation, then a
//! rotation about the normal of the planes that wheels roll on, then about any axis. Nodes of beams
//! may spin about their `d_3`: a round shaft in bearings that are not alike in all directions, or
//! under its weight, spins in space, one of another section turns as a whole.
//!
//! Source: J. E. Marsden, Lectures on Mechanics (1992), ch. 4, relative equilibria.

use crate::field::{
    AxisRotation, EQUAL, Field, Movement, apart, check_constraints, forces_go_along, scatter,
};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use vi_constraints::Constraints;
use vi_core::linear::norm_inf;
use vi_core::{Configuration, MechanicalSystem, SeparableSystem};
use vi_multibody::mechanism::{Description, Mechanism};
use vi_multibody::rolling::Rolling;
use vi_multibody::scalar_constraint::ScalarRow;
use vi_rigid::directors::{self, FRAME};

/// Velocities that differ from a steady motion by more than this part of the largest are none.
const STEADY: f64 = 1e-8;
/// Euler moments that differ by less than this part are equal.
const ALIKE: f64 = 1e-9;

/// A steady motion.
#[derive(Clone, Debug, PartialEq)]
pub struct SteadyMotion {
    /// `o`, a point of the axis, m.
    pub point: Vector3<f64>,
    /// `Ω`, rad/s.
    pub velocity: Vector3<f64>,
    /// `V`, m/s; along `Ω` where that is not zero.
    pub translation: Vector3<f64>,
    /// `w` of each frame along its directors, rad/s.
    pub spins: Vec<Vector3<f64>>,
}

/// Why a motion is not steady.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SteadyMotionError {
    /// The initial velocities are not those of a steady motion.
    #[error(
        "the initial velocities are not those of a steady motion, in which all moves along and \
         turns as a whole while bodies that are alike about an axis spin about it: they differ by \
         {0:.1e} of the largest"
    )]
    NotSteady(f64),
    /// A constraint does not let the system move so.
    #[error("`{0}` does not let the whole system move steadily: it changes with the motion")]
    Constraint(String),
    /// A force changes in the frame that moves.
    #[error("the forces do not move with the system: {0} changes with the motion")]
    Force(String),
}

/// Axes about which a frame may spin.
#[derive(Clone, Copy)]
enum SpinAxes {
    None,
    One(Vector3<f64>), // along the directors
    All,
}

impl SteadyMotion {
    /// The steady motion that the velocities `v` at the configuration `q` are, and that the system
    /// admits.
    ///
    /// # Errors
    /// [`SteadyMotionError`].
    pub fn of_velocities(
        system: &SeparableSystem,
        mechanism: &Mechanism,
        q: &[f64],
        v: &[f64],
    ) -> Result<Self, SteadyMotionError> {
        let description = mechanism.description();
        let rolling = wheels(description);
        let normal = rolling.first().map_or_else(Vector3::z, |wheel| wheel.plane.normal());
        let all = [Vector3::x(), Vector3::y(), Vector3::z()];
        let splits: [(bool, &[Vector3<f64>]); 4] =
            [(false, &[]), (true, &[]), (true, &[normal]), (true, &all)];
        let (mut least, mut refused) = (f64::INFINITY, None);
        for of_nodes in [SpinAxes::One(Vector3::z()), SpinAxes::None] {
            let axes: Vec<SpinAxes> = axes(description, &rolling, of_nodes);
            let mut first = None;
            for (moves, turns) in splits {
                let motion = Self::nearest(description, &axes, q, v, moves, turns);
                let mut own = vec![0.0; q.len()];
                motion.field(description).velocity(q, &mut own);
                let rest = v.iter().all(|v| *v == 0.0);
                let relative = if rest { 0.0 } else { apart(&own, v) };
                if relative <= STEADY {
                    match motion.check(system, mechanism, q) {
                        Ok(()) => return Ok(motion),
                        Err(error) => first = first.or(Some(error)),
                    }
                }
                least = least.min(relative);
            }
            refused = first.or(refused);
        }
        Err(refused.unwrap_or(SteadyMotionError::NotSteady(least)))
    }

    /// The motion of least squares, with spins that fit best.
    fn nearest(
        description: &Description,
        axes: &[SpinAxes],
        q: &[f64],
        v: &[f64],
        moves: bool,
        turns: &[Vector3<f64>],
    ) -> Self {
        let first = if moves { 3 } else { 0 };
        let unknowns = first + turns.len();
        let mut rows: Vec<(Vec<f64>, f64)> = Vec::new();
        let mut point = |x: Vector3<f64>, u: Vector3<f64>, dimension: usize| {
            for k in 0..dimension {
                let mut row = vec![0.0; unknowns];
                if moves {
                    row[k] = 1.0;
                }
                for (j, turn) in turns.iter().enumerate() {
                    row[first + j] = turn.cross(&x)[k];
                }
                rows.push((row, u[k]));
            }
        };
        let frames = || q.chunks_exact(FRAME).zip(v.chunks_exact(FRAME)).zip(axes);
        for ((own, rate), _) in frames() {
            point(directors::center(own), directors::center(rate), 3);
        }
        let (dimension, points) = (description.dimension.max(2), FRAME * axes.len());
        for (x, u) in q[points..].chunks(dimension).zip(v[points..].chunks(dimension)) {
            let lift = |x: &[f64]| Vector3::from_fn(|i, _| x.get(i).copied().unwrap_or(0.0));
            point(lift(x), lift(u), dimension);
        }
        for ((own, rate), axes) in frames() {
            let omega = directors::angular_velocity(own, rate);
            let across = match axes {
                SpinAxes::All => continue,
                SpinAxes::None => Matrix3::identity(),
                SpinAxes::One(axis) => {
                    let axis = directors::triad(own) * axis;
                    Matrix3::identity() - axis * axis.transpose()
                }
            };
            for k in 0..3 {
                let mut row = vec![0.0; unknowns];
                for (j, turn) in turns.iter().enumerate() {
                    row[first + j] = (across * turn)[k];
                }
                rows.push((row, (across * omega)[k]));
            }
        }
        let matrix = DMatrix::from_fn(rows.len(), unknowns, |i, j| rows[i].0[j]);
        let right = DVector::from_iterator(rows.len(), rows.iter().map(|row| row.1));
        let solution = match unknowns {
            0 => DVector::zeros(0),
            _ => {
                let floor = 1e-12 * matrix.amax();
                let solved = matrix.svd(true, true).solve(&right, floor);
                solved.unwrap_or_else(|_| DVector::zeros(unknowns))
            }
        };
        let shift = if moves { solution.fixed_rows::<3>(0).into() } else { Vector3::zeros() };
        let velocity: Vector3<f64> =
            turns.iter().enumerate().map(|(j, turn)| solution[first + j] * turn).sum();
        let spins = frames().map(|((own, rate), axes)| {
            let triad = directors::triad(own);
            let rest = triad.transpose() * (directors::angular_velocity(own, rate) - velocity);
            match axes {
                SpinAxes::None => Vector3::zeros(),
                SpinAxes::One(axis) => axis.dot(&rest) * axis,
                SpinAxes::All => rest,
            }
        });
        let spins: Vec<Vector3<f64>> = spins.collect();
        let square = velocity.norm_squared();
        let (point, translation) = match square > 0.0 {
            true => (velocity.cross(&shift) / square, velocity * (velocity.dot(&shift) / square)),
            false => (Vector3::zeros(), shift),
        };
        Self { point, velocity, translation, spins }
    }

    /// Whether nothing moves.
    #[must_use]
    pub fn is_rest(&self) -> bool {
        let zero = Vector3::zeros();
        self.velocity == zero && self.translation == zero && self.spins.iter().all(|w| *w == zero)
    }

    fn movement(&self) -> Movement {
        let Self { point, velocity, translation, .. } = *self;
        let spinning = self.spins.iter().any(|spin| *spin != Vector3::zeros());
        let spins = if spinning { self.spins.clone() } else { Vec::new() };
        Movement { point, velocity, translation, spins }
    }

    /// `v ←` the velocities of the motion at the configuration `q`, shape `n`.
    pub fn velocities(&self, mechanism: &Mechanism, q: &[f64], v: &mut [f64]) {
        self.field(mechanism.description()).velocity(q, v);
    }

    /// Its velocities.
    pub(crate) fn field(&self, description: &Description) -> Field {
        Field::new(&self.movement(), description)
    }

    /// Whether masses, constraints and forces are the same in the frame that moves: after a while
    /// they have moved with the system, constraints at that time, loads also as they are at
    /// `t = 0`.
    ///
    /// # Errors
    /// [`SteadyMotionError`].
    pub fn check(
        &self,
        system: &SeparableSystem,
        mechanism: &Mechanism,
        q: &[f64],
    ) -> Result<(), SteadyMotionError> {
        const ANGLE: f64 = 0.7; // rad, in no symmetry
        if self.is_rest() {
            return Ok(());
        }
        let description = mechanism.description();
        let turning = self.spins.iter().map(Vector3::norm).fold(self.velocity.norm(), f64::max);
        let reach = q.iter().fold(1e-3, |reach: f64, q| reach.max(q.abs()));
        let speed = if turning > 0.0 { turning } else { self.translation.norm() / reach };
        let time = ANGLE / speed;
        let displaced = AxisRotation::of(&self.movement(), description, time);
        let moved = displaced.of_configuration(q);
        let start = mechanism.principal_angles(q);
        let mut angles = start.clone();
        mechanism.unwrap_angles(&moved, &mut angles);
        let before = Configuration { t: 0.0, q, angles: &start, internal: &[] };
        let after = Configuration { t: time, q: &moved, angles: &angles, internal: &[] };
        let field = self.field(description);
        check_constraints(mechanism, [before, after], &field, &displaced, speed)
            .map_err(SteadyMotionError::Constraint)?;
        forces_go_along(system, [before, after], &field, &displaced)
            .map_err(SteadyMotionError::Force)?;
        let random: Vec<f64> = (0..q.len()).map(scatter).collect();
        let inertia = |x: &[f64]| {
            let mut out = vec![0.0; x.len()];
            system.mass().mul_add(1.0, x, &mut out);
            out
        };
        let (a, b) =
            (inertia(&displaced.of_vectors(&random)), displaced.of_vectors(&inertia(&random)));
        if apart(&a, &b) > EQUAL {
            return Err(SteadyMotionError::NotSteady(apart(&a, &b)));
        }
        Ok(())
    }
}

/// The wheels and spheres that roll.
fn wheels(description: &Description) -> Vec<&Rolling> {
    let rows = description.scalars.iter().flat_map(|own| &own.rows);
    let rolling = rows.filter_map(|row| match row {
        ScalarRow::Height(rolling) => Some(&**rolling),
        _ => None,
    });
    rolling.collect()
}

/// Axes of symmetry of all frames; of a wheel its own, of nodes of beams `of_nodes`.
fn axes(description: &Description, rolling: &[&Rolling], of_nodes: SpinAxes) -> Vec<SpinAxes> {
    let of_body = |(k, body): (usize, &vi_multibody::mechanism::BodySpec)| {
        let Some(rigid) = &body.body else { return of_nodes };
        let euler = rigid.euler();
        let largest = norm_inf(&euler);
        let alike = |i: usize, j: usize| (euler[i] - euler[j]).abs() <= ALIKE * largest;
        let pair = (0..3).find(|i| alike((i + 1) % 3, (i + 2) % 3));
        if alike(0, 1) && alike(1, 2) {
            let own = rolling.iter().find(|wheel| wheel.frame == k);
            return own.and_then(|wheel| wheel.axis).map_or(SpinAxes::All, SpinAxes::One);
        }
        pair.map_or(SpinAxes::None, |i| SpinAxes::One(Vector3::ith(i, 1.0)))
    };
    description.bodies.iter().enumerate().map(of_body).collect()
}
