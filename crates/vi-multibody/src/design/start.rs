//! The initial state by joint coordinates, rates and parameters.
//!
//! ```text
//! g(q; θ) = 0,  x(q; θ) = z              G v + g_t = 0,  ∇x v = ż              p̄_0 = M(θ) v
//! [G; ∇x] δq = (−g_θ, δz − x_θ)
//! [G; ∇x] δv = (−D²g[δq, v] − G_θ v − g_tθ, δż − D²x[δq, v] − (∇x)_θ v)        δp̄ = M δv + M_θ v
//! ```
//! `x`: independent joint coordinates, of the tree, or of a closed loop those that are given; the
//! others follow. The same equations on trees and on closed loops. Where constraints are redundant
//! the independent rows are solved and the others checked: one that is left over says that no
//! neighbouring mechanism closes ([`StartDerivativeError::Opens`]).

use super::explicit::Masses;
use super::moved_coordinate::MovedCoordinate;
use super::rows::MovedRows;
use super::{DesignError, MechanismTangent};
use crate::constraint::joint_coordinate::JointCoordinate;
use crate::mechanism::Mechanism;
use crate::pair::DegreeOfFreedom;
use crate::pair::joint::FrameId;
use nalgebra::Vector3;
use vi_constraints::saddle_point::{IndependentRows, JacobianPlace};
use vi_constraints::{Constraints, InitialValues};
use vi_core::Configuration;
use vi_core::linear::{Singular, SparseLu};
use vi_core::sparse::{Entries, SparseMatrix};
use vi_rigid::directors::FRAME;

/// Part of the size of a row that a redundant one may be left with.
const LEFT_OVER: f64 = 1e-8;

/// A coordinate of the start.
#[derive(Clone, Debug)]
pub enum StartCoordinate {
    /// A length or an angle of a joint.
    Joint(Box<JointCoordinate>),
    /// A coordinate `q_i` itself: of the centre of a free body, of a point mass, m.
    Place(usize),
    /// A rotation about an axis of space (0, 1, 2) of a frame, relative to another or to the
    /// ground, rad; zero at the start.
    Turn {
        /// What turns.
        frame: usize,
        /// Relative to what.
        parent: Option<usize>,
        /// About which axis.
        axis: usize,
    },
}

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
    /// By the rates.
    pub rates: Vec<StartTangent>,
    /// By the parameters, at fixed coordinates and rates.
    pub parameters: Vec<StartTangent>,
}

impl StartCoordinate {
    /// Those of the spanning tree of the bodies, with the number of the joint and the freedom; of
    /// free members without a joint the first is `None`.
    #[must_use]
    pub fn of_tree(mechanism: &Mechanism) -> Vec<(Option<usize>, usize, Self)> {
        let joints = &mechanism.description().joints;
        let mut found = Vec::new();
        for link in mechanism.tree().links() {
            let own = |joint: &crate::Joint| *joint == link.joint || joint.reversed() == link.joint;
            let number = joints.iter().position(own);
            let joint = number.map_or(&link.joint, |k| &joints[k]);
            for freedom in 0..joint.kind.dof() {
                let coordinate = match joint.kind.degree_of_freedom(freedom) {
                    Some(DegreeOfFreedom::Position) => Self::Place(FRAME * link.frame + freedom),
                    Some(DegreeOfFreedom::Rotation) => {
                        let index = |frame| match frame {
                            FrameId::Frame(k) => Some(k),
                            FrameId::Ground => None,
                        };
                        let ends = [joint.parent.frame, joint.child.frame].map(index);
                        let other = ends.into_iter().flatten().find(|k| *k != link.frame);
                        let axis = freedom - joint.kind.rotation_vector().unwrap_or(0);
                        Self::Turn { frame: link.frame, parent: other, axis }
                    }
                    _ => match (number, JointCoordinate::principal(joint, freedom)) {
                        (Some(k), Some(own)) => Self::Joint(Box::new(own.placed(k, freedom))),
                        _ => continue,
                    },
                };
                found.push((number, freedom, coordinate));
            }
        }
        let description = mechanism.description();
        for k in 0..description.particles.len() {
            let first = mechanism.particle_offset(k);
            let own = |freedom| (None, freedom, Self::Place(first + freedom));
            found.extend((0..description.dimension).map(own));
        }
        found
    }

    /// The entries of `∇x`.
    fn for_each_slope(&self, q: &[f64], mut visit: impl FnMut(usize, f64)) {
        match self {
            Self::Joint(own) => own.for_each_slope(q, visit),
            Self::Place(i) => visit(*i, 1.0),
            Self::Turn { frame, parent, axis } => {
                let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
                let frames = [(Some(frame), 0.5), (parent.as_ref(), -0.5)];
                for (frame, half) in frames {
                    let Some(frame) = frame else { continue };
                    for d in [3, 6, 9].map(|i| FRAME * frame + i) {
                        visit(d + last, half * q[d + next]);
                        visit(d + next, -half * q[d + last]);
                    }
                }
            }
        }
    }

    /// `D²x[v, w]`.
    fn second(&self, q: &[f64], v: &[f64], w: &[f64]) -> f64 {
        match self {
            Self::Joint(own) => own.second(q, v, w),
            Self::Place(_) => 0.0,
            // the rate ½ Σ d_I × ḋ_I along a change of the directors
            Self::Turn { frame, parent, axis } => {
                let turn = |frame: usize| -> f64 {
                    let of = |x: &[f64], i: usize| {
                        Vector3::from_column_slice(&x[FRAME * frame + i..FRAME * frame + i + 3])
                    };
                    [3, 6, 9].iter().map(|&i| 0.5 * of(v, i).cross(&of(w, i))[*axis]).sum()
                };
                turn(*frame) - parent.map_or(0.0, turn)
            }
        }
    }
}

/// `q`, `v` of a start, the matrix `[G; ∇x]` and what is beside it.
struct Equations<'a> {
    mechanism: &'a Mechanism,
    rows: &'a IndependentRows,
    coordinates: &'a [StartCoordinate],
    matrix: SparseMatrix,
    lu: SparseLu,
}

impl<'a> Equations<'a> {
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
        Ok(Self { mechanism, rows, coordinates, matrix, lu })
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

/// The derivatives of a consistent start by coordinates, rates and parameters; `mass`: `M`, `rows`:
/// independent ones.
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
    let mut equations = Equations::new(mechanism, rows, coordinates, at)?;
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
        closes(mechanism, rows, at, dq, b).map_err(|(row, left)| StartDerivativeError::Opens {
            parameter: k - count,
            row,
            name: mechanism.constraint_name(row).to_owned(),
            left,
        })?;
    }
    // velocities
    let mut columns = Vec::new();
    for (k, dq) in q.iter().enumerate() {
        let mut b = vec![0.0; m];
        mechanism.second_derivative(at.t, at.q, dq, at.v, &mut b);
        let mut z: Vec<f64> =
            equations.coordinates.iter().map(|x| x.second(at.q, dq, at.v)).collect();
        if let Some(k) = k.checked_sub(count) {
            moved[k].add_rates(configuration, at.v, &mut b);
            let moved = |x: &StartCoordinate| moved_by(mechanism, &tangents[k], x, at)[1];
            z.iter_mut().zip(coordinates).for_each(|(z, x)| *z += moved(x));
        }
        b.iter_mut().chain(&mut z).for_each(|x| *x = -*x);
        columns.push((b, z));
    }
    columns.extend((0..count).map(|k| (vec![0.0; m], unit(k))));
    let mut v = equations.solve(&columns)?;
    let rates = v.split_off(q.len());
    let momentum = |dv: &[f64]| {
        let mut p = vec![0.0; dv.len()];
        mass.mul_add(1.0, dv, &mut p);
        p
    };
    let rate = |v: Vec<f64>| StartTangent { q: vec![0.0; v.len()], p: momentum(&v), v };
    let mut found: Vec<StartTangent> =
        q.into_iter().zip(v).map(|(q, v)| StartTangent { p: momentum(&v), q, v }).collect();
    for (tangent, own) in tangents.iter().zip(&mut found[count..]) {
        add_mass_change(mechanism, tangent, at.v, &mut own.p);
    }
    let parameters = found.split_off(count);
    Ok(StartDerivatives {
        coordinates: found,
        rates: rates.into_iter().map(rate).collect(),
        parameters,
    })
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
    let mut equations = Equations::new(mechanism, rows, coordinates, at)?;
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
    moved.add_rates(Configuration::new(at.t, at.q), at.v, &mut b);
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
    if let Some(masses) = Masses::of(mechanism, tangent, Vector3::zeros()) {
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

/// Those of the coordinates whose gradients are independent on the tangent space of the
/// constraints: as many as there are degrees of freedom, the first ones where there is a choice.
///
/// # Errors
/// [`Singular`] where they do not determine the configuration.
pub fn independent(
    mechanism: &Mechanism,
    rows: &IndependentRows,
    at: InitialValues<'_>,
    coordinates: &[StartCoordinate],
) -> Result<Vec<usize>, Singular> {
    let (n, r) = (mechanism.dim(), rows.len());
    let dof = n - r;
    if coordinates.len() == dof {
        return Ok((0..dof).collect());
    }
    // rows of constraints, orthonormal; a coordinate is taken that is not among them
    let mut dense = nalgebra::DMatrix::zeros(mechanism.len(), n);
    mechanism.jacobian(at.t, at.q, &mut dense);
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let mut take = |mut row: Vec<f64>, least: f64| -> bool {
        let size = vi_core::linear::dot(&row, &row).sqrt();
        for _ in 0..2 {
            for own in &basis {
                let along = vi_core::linear::dot(own, &row);
                row.iter_mut().zip(own).for_each(|(x, e)| *x -= along * e);
            }
        }
        let left = vi_core::linear::dot(&row, &row).sqrt();
        let taken = left > least * size;
        if taken {
            basis.push(row.into_iter().map(|x| x / left).collect());
        }
        taken
    };
    for &row in rows.rows() {
        take(dense.row(row).iter().copied().collect(), 0.0);
    }
    let mut found = Vec::new();
    for (k, coordinate) in coordinates.iter().enumerate() {
        let mut row = vec![0.0; n];
        coordinate.for_each_slope(at.q, |i, slope| row[i] += slope);
        if found.len() < dof && take(row, 1e-6) {
            found.push(k);
        }
    }
    if found.len() == dof { Ok(found) } else { Err(Singular) }
}
