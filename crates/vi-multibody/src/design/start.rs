//! The initial state by joint coordinates, rates and parameters.
//!
//! ```text
//! g(q; θ) = 0,  x(q; θ) = z              G v + g_t = 0,  ∇x v = ż              p̄_0 = M(θ) v
//! [G; ∇x] δq = (−g_θ, δz − x_θ)
//! [G; ∇x] δv = (−D²g[δq, v] − G_θ v − g_tθ, δż − D²x[δq, v] − (∇x)_θ v)        δp̄ = M δv + M_θ v
//! ```
//! Constraints on velocities `A v = b` stand in the second pair alone, on the right
//! `−D A[δq] v + b_q δq − A_θ v + b_θ`, beside as many rates fewer: the first ones that are
//! independent with them.
//! `x`: independent joint coordinates, of the tree, or of a closed loop those that are given; the
//! others follow. The same equations on trees and on closed loops. Where constraints are redundant
//! the independent rows are solved and the others checked: one that is left over says that no
//! neighbouring mechanism closes ([`StartDerivativeError::Opens`]).

pub use super::coordinate::{StartCoordinate, independent};

use super::explicit::Masses;
use super::moved_coordinate::MovedCoordinate;
use super::rows::MovedRows;
use super::{DesignError, MechanismTangent};
use crate::mechanism::Mechanism;
use vi_constraints::saddle_point::{IndependentRows, JacobianPlace};
use vi_constraints::{Constraints, InitialValues};
use vi_core::linear::{Singular, SparseLu, norm_inf};
use vi_core::sparse::{Entries, Product, SparseMatrix};
use vi_core::{Configuration, Motion};

/// Part of the size of a row that a redundant one may be left with.
const LEFT_OVER: f64 = 1e-8;

/// Iterations of Newton's method for a configuration.
const ITERATIONS: usize = 30;
/// A change after which the next one is below rounding, relative to the configuration.
const LAST_CHANGE: f64 = 1e-10;

/// Why the start has no derivative.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StartDerivativeError {
    /// Coordinates and constraints do not determine the configuration.
    #[error("{given} coordinates were given for {dof} degrees of freedom")]
    Count {
        /// Coordinates.
        given: usize,
        /// Degrees of freedom.
        dof: usize,
    },
    /// The coordinates do not determine the others.
    #[error("the initial coordinates do not determine the others: {0}")]
    Singular(#[from] Singular),
    /// No configuration has the values of the coordinates.
    #[error("no configuration near by has these coordinates")]
    Unreached,
    /// A parameter opens a redundant loop.
    #[error(
        "no neighbouring mechanism closes: constraint {row} of `{name}`, which follows from the \
         others, is left with {left:.1e}"
    )]
    Opens {
        /// The parameter.
        parameter: usize,
        /// The constraint.
        row: usize,
        /// What it belongs to.
        name: String,
        /// By how much it changes with the parameter.
        left: f64,
    },
    /// A tangent is not available.
    #[error(transparent)]
    Design(#[from] DesignError),
}

/// How the start changes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StartTangent {
    /// `δq_0`, shape `n`.
    pub q: Vec<f64>,
    /// `δv_0`, shape `n`.
    pub v: Vec<f64>,
    /// `δp̄_0`, shape `n`.
    pub p: Vec<f64>,
}

impl StartTangent {
    /// Zero, of `n` coordinates.
    #[must_use]
    pub fn zero(n: usize) -> Self {
        Self { q: vec![0.0; n], v: vec![0.0; n], p: vec![0.0; n] }
    }

    /// `δ += scale` times another.
    pub fn add(&mut self, scale: f64, other: &Self) {
        let own = self.q.iter_mut().chain(&mut self.v).chain(&mut self.p);
        let other = other.q.iter().chain(&other.v).chain(&other.p);
        own.zip(other).for_each(|(x, by)| *x += scale * by);
    }
}

/// The derivatives of the start.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StartDerivatives {
    /// By the coordinates, at fixed rates.
    pub coordinates: Vec<StartTangent>,
    /// By the rates, zero of those that follow from others.
    pub rates: Vec<StartTangent>,
    /// Whether each rate is free, and does not follow from others by constraints on velocities.
    pub is_free: Vec<bool>,
    /// By the parameters, at fixed coordinates and rates.
    pub parameters: Vec<StartTangent>,
}

/// The rows without constraints on velocities: those that a configuration meets.
#[must_use]
pub fn of_positions(mechanism: &Mechanism, rows: &IndependentRows) -> IndependentRows {
    if !mechanism.has_velocity_constraints() {
        return rows.clone();
    }
    let is_of_velocities = |row: usize| mechanism.velocity_rows().any(|(own, _)| own == row);
    let chosen: Vec<usize> =
        rows.rows().iter().copied().filter(|row| !is_of_velocities(*row)).collect();
    IndependentRows::choose(mechanism.len(), &chosen)
}

/// The rows of a spanning tree: internal ones of the bodies and those of its joints.
#[must_use]
pub fn of_tree(mechanism: &Mechanism) -> IndependentRows {
    let in_tree = super::rows_in_tree(mechanism);
    let internal = mechanism.len() - mechanism.rows().len();
    let chosen: Vec<usize> =
        (0..mechanism.len()).filter(|&row| row < internal || in_tree[row]).collect();
    IndependentRows::choose(mechanism.len(), &chosen)
}

/// Which of coordinates that determine a configuration determine the velocities: the first ones,
/// as many as constraints on velocities leave.
///
/// # Errors
/// [`Singular`] where they do not.
pub fn free_rates(
    mechanism: &Mechanism,
    rows: &IndependentRows,
    at: InitialValues<'_>,
    coordinates: &[StartCoordinate],
) -> Result<Vec<usize>, Singular> {
    match mechanism.has_velocity_constraints() {
        true => independent(mechanism, rows, at, coordinates),
        false => Ok((0..coordinates.len()).collect()),
    }
}

/// Some of coordinates.
fn chosen_of(coordinates: &[StartCoordinate], places: &[usize]) -> Vec<StartCoordinate> {
    places.iter().map(|&k| coordinates[k].clone()).collect()
}

/// `q`, `v` of a start, the matrix `[G; ∇x]` and what is beside it.
struct StartEquations<'a> {
    mechanism: &'a Mechanism,
    rows: &'a IndependentRows,
    matrix: SparseMatrix,
    lu: SparseLu,
}

impl<'a> StartEquations<'a> {
    fn new(
        mechanism: &'a Mechanism,
        rows: &'a IndependentRows,
        coordinates: &'a [StartCoordinate],
        at: InitialValues<'a>,
    ) -> Result<Self, StartDerivativeError> {
        let (n, r) = (mechanism.dim(), rows.len());
        if r + coordinates.len() != n {
            let (given, dof) = (coordinates.len(), n - r);
            return Err(StartDerivativeError::Count { given, dof });
        }
        let matrix = SparseMatrix::assemble(n, n, |out| {
            let place = JacobianPlace { row: 0, column: 0, scale: 1.0, transposed: false };
            let emit = |out: &mut dyn Entries| mechanism.jacobian(at.t, at.q, out);
            rows.emit_selected(&emit, place, out);
            for (k, coordinate) in coordinates.iter().enumerate() {
                coordinate.for_each_slope(at.q, |i, slope| out.add(r + k, i, slope));
            }
        });
        let lu = SparseLu::new(&matrix)?;
        Ok(Self { mechanism, rows, matrix, lu })
    }

    /// Solves for columns `(b, z)`, `b` over all constraints.
    fn solve(&mut self, columns: &[(Vec<f64>, Vec<f64>)]) -> Result<Vec<Vec<f64>>, Singular> {
        let (n, r) = (self.mechanism.dim(), self.rows.len());
        if columns.is_empty() {
            return Ok(Vec::new());
        }
        let mut x = vec![0.0; n * columns.len()];
        for ((b, z), own) in columns.iter().zip(x.chunks_exact_mut(n)) {
            self.rows.gather(b, &mut own[..r]);
            own[r..].copy_from_slice(z);
        }
        self.lu.solve(&self.matrix, &mut x)?;
        Ok(x.chunks_exact(n).map(<[f64]>::to_vec).collect())
    }
}

/// `q` with `g(q) = 0`, `x(q) = z`, next to that of `at`, by Newton's method with `[G; ∇x]`; shape
/// `n`. `values`: `z`, m or rad, angles modulo a revolution; rotations are those of `own`, shape
/// `n`.
///
/// # Errors
/// [`StartDerivativeError`] where there is none near by.
pub fn configuration(
    mechanism: &Mechanism,
    rows: &IndependentRows,
    at: InitialValues<'_>,
    coordinates: &[StartCoordinate],
    (values, own): (&[f64], &[f64]),
) -> Result<Vec<f64>, StartDerivativeError> {
    let rows = &of_positions(mechanism, rows);
    let (mut q, mut g) = (at.q.to_vec(), vec![0.0; mechanism.len()]);
    for _ in 0..ITERATIONS {
        let at = InitialValues::new(at.t, &q, at.v);
        let mut equations = StartEquations::new(mechanism, rows, coordinates, at)?;
        mechanism.value(Configuration::new(at.t, &q), &mut g);
        let open = g.iter().map(|g| -g).collect();
        let left = coordinates.iter().zip(values).map(|(x, value)| x.left_to(*value, &q, own));
        let left = left.collect();
        let change = equations.solve(&[(open, left)])?.swap_remove(0);
        q.iter_mut().zip(&change).for_each(|(q, by)| *q += by);
        let size = norm_inf(&change);
        if size <= LAST_CHANGE * norm_inf(&q).max(1.0) {
            return Ok(q);
        }
        if !size.is_finite() {
            break;
        }
    }
    Err(StartDerivativeError::Unreached)
}

/// `v` with `G v + g_t = 0`, `∇x v = ż`, shape `n`; `rates`: `ż`, m/s or rad/s, of which those that
/// follow from others by constraints on velocities do not count.
///
/// # Errors
/// [`StartDerivativeError`] where the coordinates do not determine it.
pub fn velocities(
    mechanism: &Mechanism,
    rows: &IndependentRows,
    at: InitialValues<'_>,
    coordinates: &[StartCoordinate],
    rates: &[f64],
) -> Result<Vec<f64>, StartDerivativeError> {
    let places = free_rates(mechanism, rows, at, coordinates)?;
    let free = chosen_of(coordinates, &places);
    let mut equations = StartEquations::new(mechanism, rows, &free, at)?;
    let mut b = vec![0.0; mechanism.len()];
    mechanism.time_derivative(at.t, at.q, &mut b);
    b.iter_mut().for_each(|b| *b = -*b);
    let rates = places.iter().map(|&k| rates[k]).collect();
    Ok(equations.solve(&[(b, rates)])?.swap_remove(0))
}

/// The derivatives of a consistent start by coordinates, rates and parameters; `mass`: `M`, `rows`:
/// independent ones, `coordinates`: as many as determine a configuration.
///
/// # Errors
/// [`StartDerivativeError`].
pub fn derivatives(
    mechanism: &Mechanism,
    mass: &SparseMatrix,
    rows: &IndependentRows,
    at: InitialValues<'_>,
    coordinates: &[StartCoordinate],
    tangents: &[MechanismTangent],
) -> Result<StartDerivatives, StartDerivativeError> {
    let of_positions = of_positions(mechanism, rows);
    let mut equations = StartEquations::new(mechanism, &of_positions, coordinates, at)?;
    let moved: Vec<MovedRows> =
        tangents.iter().map(|own| MovedRows::of(mechanism, own)).collect::<Result<_, _>>()?;
    let (m, count) = (mechanism.len(), coordinates.len());
    let unit = |k: usize| -> Vec<f64> { (0..count).map(|j| f64::from(u8::from(j == k))).collect() };
    let configuration = Configuration::new(at.t, at.q);
    // positions
    let mut columns: Vec<_> = (0..count).map(|k| (vec![0.0; m], unit(k))).collect();
    for (tangent, moved) in tangents.iter().zip(&moved) {
        let mut b = vec![0.0; m];
        moved.add_values(configuration, &mut b);
        b.iter_mut().for_each(|b| *b = -*b);
        let slope = |coordinate: &StartCoordinate| -moved_by(mechanism, tangent, coordinate, at)[0];
        columns.push((b, coordinates.iter().map(slope).collect()));
    }
    let q = equations.solve(&columns)?;
    for (k, (dq, (b, _))) in q.iter().zip(&columns).enumerate().skip(count) {
        closes(mechanism, &of_positions, at, dq, b).map_err(|(row, left)| {
            StartDerivativeError::Opens {
                parameter: k - count,
                row,
                name: mechanism.constraint_name(row).to_owned(),
                left,
            }
        })?;
    }
    // velocities
    let places = free_rates(mechanism, rows, at, coordinates)?;
    let free = chosen_of(coordinates, &places);
    let mut of_velocities = match free.len() == count {
        true => equations,
        false => StartEquations::new(mechanism, rows, &free, at)?,
    };
    let mut columns = Vec::new();
    for (k, dq) in q.iter().enumerate() {
        let mut b = vec![0.0; m];
        mechanism.second_derivative(at.t, at.q, dq, at.v, &mut b);
        mechanism.drift_slope(configuration, &mut Product { v: dq, out: &mut b });
        let mut z: Vec<f64> = free.iter().map(|x| x.second(at.q, dq, at.v)).collect();
        if let Some(k) = k.checked_sub(count) {
            moved[k].add_rates(configuration.moving(at.v), &mut b);
            let moved = |x: &StartCoordinate| moved_by(mechanism, &tangents[k], x, at)[1];
            z.iter_mut().zip(&free).for_each(|(z, x)| *z += moved(x));
        }
        b.iter_mut().chain(&mut z).for_each(|x| *x = -*x);
        columns.push((b, z));
    }
    columns.extend((0..free.len()).map(|k| (vec![0.0; m], unit(k)[..free.len()].to_vec())));
    let mut v = of_velocities.solve(&columns)?;
    let of_rates = v.split_off(q.len());
    let momentum = |dv: &[f64]| {
        let mut p = vec![0.0; dv.len()];
        mass.mul_add(1.0, dv, &mut p);
        p
    };
    let mut rates = vec![StartTangent::zero(mechanism.dim()); count];
    for (&k, v) in places.iter().zip(of_rates) {
        rates[k] = StartTangent { q: vec![0.0; v.len()], p: momentum(&v), v };
    }
    let mut found: Vec<StartTangent> =
        q.into_iter().zip(v).map(|(q, v)| StartTangent { p: momentum(&v), q, v }).collect();
    for (tangent, own) in tangents.iter().zip(&mut found[count..]) {
        add_mass_change(mechanism, tangent, at.v, &mut own.p);
    }
    let parameters = found.split_off(count);
    let is_free = (0..count).map(|k| places.contains(&k)).collect();
    Ok(StartDerivatives { coordinates: found, rates, is_free, parameters })
}

/// `δv` of a start whose configuration changes by `dq` and whose rates change by `rates`, one for
/// each coordinate.
///
/// # Errors
/// [`StartDerivativeError`].
pub fn velocity(
    mechanism: &Mechanism,
    rows: &IndependentRows,
    at: InitialValues<'_>,
    coordinates: &[StartCoordinate],
    (tangent, dq): (&MechanismTangent, &[f64]),
    rates: &[f64],
) -> Result<Vec<f64>, StartDerivativeError> {
    let mut equations = StartEquations::new(mechanism, rows, coordinates, at)?;
    let b = velocity_change(mechanism, &MovedRows::of(mechanism, tangent)?, at, dq);
    let z = coordinates
        .iter()
        .zip(rates)
        .map(|(x, rate)| rate - x.second(at.q, dq, at.v) - moved_by(mechanism, tangent, x, at)[1]);
    let b = b.into_iter().map(|b| -b).collect();
    Ok(equations.solve(&[(b, z.collect())])?.swap_remove(0))
}

/// `D²g[δq, v] + G_θ v + g_tθ`.
fn velocity_change(
    mechanism: &Mechanism,
    moved: &MovedRows,
    at: InitialValues<'_>,
    dq: &[f64],
) -> Vec<f64> {
    let mut b = vec![0.0; mechanism.len()];
    mechanism.second_derivative(at.t, at.q, dq, at.v, &mut b);
    let configuration = Configuration::new(at.t, at.q);
    mechanism.drift_slope(configuration, &mut Product { v: dq, out: &mut b });
    moved.add_rates(Motion::new(at.t, at.q, at.v), &mut b);
    b
}

/// By how much a coordinate and its rate change with a parameter where a start is stated by
/// positions and velocities that change by `dq` and `dv`.
#[must_use]
pub fn stated_change(
    mechanism: &Mechanism,
    tangent: &MechanismTangent,
    coordinate: &StartCoordinate,
    at: InitialValues<'_>,
    [dq, dv]: [&[f64]; 2],
) -> [f64; 2] {
    let [mut value, mut rate] = moved_by(mechanism, tangent, coordinate, at);
    coordinate.for_each_slope(at.q, |i, slope| {
        value += slope * dq[i];
        rate += slope * dv[i];
    });
    [value, rate + coordinate.second(at.q, dq, at.v)]
}

/// By how much constraints and their rates open where a start changes by `dq` and `dv`, relative to
/// the largest change of a row.
///
/// # Errors
/// [`StartDerivativeError`].
pub fn opened(
    mechanism: &Mechanism,
    at: InitialValues<'_>,
    tangent: &MechanismTangent,
    [dq, dv]: [&[f64]; 2],
) -> Result<[Vec<f64>; 2], StartDerivativeError> {
    let moved = MovedRows::of(mechanism, tangent)?;
    let (m, configuration) = (mechanism.len(), Configuration::new(at.t, at.q));
    let mut positions = vec![0.0; m];
    moved.add_values(configuration, &mut positions);
    mechanism.add_rates(at.t, at.q, dq, &mut positions);
    mechanism.velocity_rows().for_each(|(row, _)| positions[row] = 0.0);
    let mut rates = velocity_change(mechanism, &moved, at, dq);
    mechanism.add_rates(at.t, at.q, dv, &mut rates);
    Ok([positions, rates])
}

/// `p += M_θ v`.
pub fn add_mass_change(
    mechanism: &Mechanism,
    tangent: &MechanismTangent,
    v: &[f64],
    p: &mut [f64],
) {
    if let Some(masses) = Masses::of(mechanism, tangent, nalgebra::Vector3::zeros()) {
        masses.for_each_momentum(v, |i, momentum| p[i] += momentum);
    }
}

/// Whether a parameter that enters `g` leaves a redundant constraint open: the first that it does,
/// with what is left; `dq` solves the independent ones.
fn closes(
    mechanism: &Mechanism,
    rows: &IndependentRows,
    at: InitialValues<'_>,
    dq: &[f64],
    b: &[f64],
) -> Result<(), (usize, f64)> {
    let mut change = vec![0.0; mechanism.len()];
    mechanism.add_rates(at.t, at.q, dq, &mut change);
    mechanism.velocity_rows().for_each(|(row, _)| change[row] = 0.0);
    let size = |row: usize| change[row].abs().max(b[row].abs());
    let largest = (0..mechanism.len()).map(size).fold(0.0, f64::max);
    let left = |row: usize| (row, (change[row] - b[row]).abs());
    match rows.redundant().map(left).find(|(_, left)| *left > LEFT_OVER * largest) {
        Some(open) => Err(open),
        None => Ok(()),
    }
}

/// `x_θ` and `(∇x)_θ v` of a coordinate whose joint changes.
fn moved_by(
    mechanism: &Mechanism,
    tangent: &MechanismTangent,
    coordinate: &StartCoordinate,
    at: InitialValues<'_>,
) -> [f64; 2] {
    let StartCoordinate::Joint(own) = coordinate else { return [0.0; 2] };
    let moved = MovedCoordinate::of(mechanism, tangent, own);
    moved.map_or([0.0; 2], |own| [own.by(at.q), own.rate_by(at.q, at.v)])
}
