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

use nalgebra::{Matrix3, Vector3};
use vi_constraints::Constraints;
use vi_core::Configuration;
use vi_core::SeparableSystem;
use vi_core::linear::norm_inf;
use vi_core::sparse::{Entries, SparseMatrix};
use vi_multibody::mechanism::{Description, Mechanism};
use vi_multibody::sparse_nodal::VelocityLayout;
use vi_rigid::rotation::{exp, skew};

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
    #[error(
        "the forces do not turn with the system: the weight, a load, a spring or a damper acts from a direction fixed in \
         space"
    )]
    Force,
}

/// Velocities that differ from a rotation by more than this part of the largest are none.
const RIGID: f64 = 1e-8;
/// Forces and constraints that differ by more than this part after a turn are not those of a
/// rotating system.
const EQUAL: f64 = 1e-8;

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
        let places = Places::of(description);
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
        Field::new(self, mechanism.description()).velocity(q, v);
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
        let turn = AxisRotation::new(self, mechanism.description(), ANGLE);
        let (t, turned) = (ANGLE / speed, turn.of_configuration(q));
        let start = mechanism.principal_angles(q);
        let mut angles = start.clone();
        mechanism.unwrap_angles(&turned, &mut angles);
        let before = Configuration { t: 0.0, q, angles: &start, internal: &[] };
        let after = Configuration { t, q: &turned, angles: &angles, internal: &[] };
        self.check_constraints(mechanism, [before, after], &turn)?;
        let field = Field::new(self, mechanism.description());
        let net = |at: Configuration<'_>| {
            let (mut v, mut out) = (vec![0.0; q.len()], vec![0.0; q.len()]);
            field.velocity(at.q, &mut v);
            system.net_force(at, &v, &mut out);
            out
        };
        // beside the configuration, where it may be free of forces: their gradients have to turn as
        // well
        const ASIDE: f64 = 1e-3;
        let near: Vec<f64> = q.iter().enumerate().map(|(k, q)| q + ASIDE * scatter(k)).collect();
        let here = net(Configuration { q: &near, ..before });
        let (here, near) = (turn.of_vectors(&here), turn.of_configuration(&near));
        // loads count as they are at t = 0; what follows a reference is judged at the time of the
        // turn
        let turns = |t: f64| apart(&here, &net(Configuration { t, q: &near, ..after })) <= EQUAL;
        if !turns(0.0) && !turns(t) {
            return Err(RotationError::Force);
        }
        Ok(())
    }

    /// `g = 0`, `G v + ∂g/∂t = 0` and the same null space of `G` after the turn.
    fn check_constraints(
        &self,
        mechanism: &Mechanism,
        [before, after]: [Configuration<'_>; 2],
        turn: &AxisRotation,
    ) -> Result<(), RotationError> {
        let (m, n) = (mechanism.len(), before.q.len());
        let (mut value, mut sizes) = (vec![0.0; m], vec![0.0; m]);
        mechanism.row_sizes(after, &mut sizes);
        mechanism.value(after, &mut value);
        let (mut v, mut rates) = (vec![0.0; n], vec![0.0; m]);
        Field::new(self, mechanism.description()).velocity(after.q, &mut v);
        mechanism.time_derivative(after.t, after.q, &mut rates);
        mechanism.add_rates(after.t, after.q, &v, &mut rates);
        // velocities that the joints of the tree let through: those of a joint mix its rows, no
        // more
        let mut layout = VelocityLayout::new(mechanism);
        let mut columns = layout.columns();
        layout.null_space(before.q, &mut columns);
        let nu: Vec<f64> = (0..layout.dof()).map(scatter).collect();
        layout.velocity(&columns, &nu, &mut v);
        let (mut here, mut there) = (vec![0.0; m], vec![0.0; m]);
        mechanism.add_rates(before.t, before.q, &v, &mut here);
        mechanism.add_rates(after.t, after.q, &turn.of_vectors(&v), &mut there);
        let (speed, size) = (self.velocity.norm(), norm_inf(&v).max(f64::MIN_POSITIVE));
        let mut first = 0;
        while first < m {
            let name = mechanism.constraint_name(first);
            let rows =
                first..(first..m).find(|&i| mechanism.constraint_name(i) != name).unwrap_or(m);
            let norm = |x: &[f64]| x[rows.clone()].iter().map(|x| x * x).sum::<f64>().sqrt();
            let own = norm(&sizes);
            let change = (norm(&there) - norm(&here)).abs() / size;
            let all = (norm(&value) + norm(&rates) / speed) / own + change;
            if all.is_nan() || all > EQUAL {
                return Err(RotationError::Constraint(name.into()));
            }
            first = rows.end;
        }
        Ok(())
    }
}

/// `|a − b|` as a part of the larger of both.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    let difference: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    let relative = norm_inf(&difference) / norm_inf(a).max(norm_inf(b)).max(f64::MIN_POSITIVE);
    if relative.is_nan() { f64::INFINITY } else { relative }
}

/// A number of the size of 1 for each index, in no symmetry.
fn scatter(k: usize) -> f64 {
    (1.0 + k as f64).sqrt().fract() - 0.5
}

/// Which coordinates are those of points.
#[derive(Clone, Copy, Debug)]
struct Places {
    frames: usize, // coordinates of frames
    size: usize,   // of a block: 3, in the plane 2
}

impl Places {
    fn of(description: &Description) -> Self {
        Self { frames: 12 * description.bodies.len(), size: description.dimension.max(2) }
    }

    fn is_point(self, first: usize) -> bool {
        first >= self.frames || first.is_multiple_of(12)
    }
}

/// A finite rotation about the axis.
pub(crate) struct AxisRotation {
    pub(crate) angle: f64, // rad
    rotation: Matrix3<f64>,
    point: Vector3<f64>,
    places: Places,
}

impl AxisRotation {
    pub(crate) fn new(rotation: &SteadyRotation, description: &Description, angle: f64) -> Self {
        let axis = rotation.velocity.normalize();
        let places = Places::of(description);
        Self { angle, rotation: exp(&(angle * axis)), point: rotation.point, places }
    }

    pub(crate) fn of_vectors(&self, x: &[f64]) -> Vec<f64> {
        self.blocks(x, |_| Vector3::zeros())
    }

    pub(crate) fn of_configuration(&self, q: &[f64]) -> Vec<f64> {
        let origin =
            |first| if self.places.is_point(first) { self.point } else { Vector3::zeros() };
        self.blocks(q, origin)
    }

    fn blocks(&self, x: &[f64], origin: impl Fn(usize) -> Vector3<f64>) -> Vec<f64> {
        let size = self.places.size;
        let block = |(k, x): (usize, &[f64])| {
            let o = origin(size * k);
            let x = Vector3::from_fn(|i, _| if i < size { x[i] } else { 0.0 }) - o;
            let turned = o + self.rotation * x;
            (0..size).map(move |i| turned[i])
        };
        x.chunks_exact(size).enumerate().flat_map(block).collect()
    }
}

/// The velocities of a steady rotation, and the matrices that multiply them.
pub(crate) struct Field {
    W: Matrix3<f64>,
    point: Vector3<f64>,
    places: Places,
}

impl Field {
    pub(crate) fn new(rotation: &SteadyRotation, description: &Description) -> Self {
        let places = Places::of(description);
        Self { W: skew(&rotation.velocity), point: rotation.point, places }
    }

    /// `v = W (q − q_o)`.
    pub(crate) fn velocity(&self, q: &[f64], v: &mut [f64]) {
        let size = self.places.size;
        for (k, (v, q)) in v.chunks_exact_mut(size).zip(q.chunks_exact(size)).enumerate() {
            let point = self.places.is_point(size * k);
            for (i, v) in v.iter_mut().enumerate() {
                let from = |j: usize| if point { q[j] - self.point[j] } else { q[j] };
                *v = (0..size).map(|j| self.W[(i, j)] * from(j)).sum();
            }
        }
    }

    /// `out ← out + M W v`: with `v` of the rotation the force of inertia `M W² (q − q_o)`.
    pub(crate) fn add_inertia(&self, mass: &SparseMatrix, v: &[f64], out: &mut [f64]) {
        let size = self.places.size;
        let turned = |x: &[f64]| {
            let x: Vec<f64> = x.to_vec();
            let row = move |i: usize| (0..size).map(|j| self.W[(i, j)] * x[j]).sum::<f64>();
            (0..size).map(row)
        };
        let Wv: Vec<f64> = v.chunks_exact(size).flat_map(turned).collect();
        mass.mul_add(1.0, &Wv, out);
    }

    /// Emits `M W²`.
    pub(crate) fn emit_stiffness(&self, mass: &SparseMatrix, out: &mut dyn Entries) {
        let size = self.places.size;
        mass.emit(&mut TimesBlocks { into: out, block: self.W * self.W, size, scale: 1.0 });
    }

    /// Emits `C W` with the matrix `C = −∂f/∂v` of dampers to the ground: what stands still in
    /// space sees the velocity `W δq` of a point that stands still in the frame that rotates.
    pub(crate) fn emit_circulation(
        &self,
        dampers: &dyn Fn(&mut dyn Entries),
        out: &mut dyn Entries,
    ) {
        dampers(&mut TimesBlocks { into: out, block: self.W, size: self.places.size, scale: 1.0 });
    }

    /// Emits `2 M W`.
    pub(crate) fn emit_gyroscopic(&self, mass: &SparseMatrix, out: &mut dyn Entries) {
        let size = self.places.size;
        mass.emit(&mut TimesBlocks { into: out, block: self.W, size, scale: 2.0 });
    }
}

/// Multiplies a matrix from the right by `I ⊗ B`.
struct TimesBlocks<'a> {
    into: &'a mut dyn Entries,
    block: Matrix3<f64>,
    size: usize,
    scale: f64,
}

impl Entries for TimesBlocks<'_> {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        let (j, first) = (column % self.size, column - column % self.size);
        for k in 0..self.size {
            self.into.add(row, first + k, self.scale * value * self.block[(j, k)]);
        }
    }
}
