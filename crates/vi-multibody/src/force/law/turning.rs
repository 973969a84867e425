//! Second derivatives of the directions of a wrench on a member, along a vector.
//!
//! ```text
//! y·a = κ·T + c·F − γ·(ρ×F)           κ = ½ Σ d_I×y_I of b less that of a,   γ = ½ Σ d_I×y_I of a
//! ∂_r∂_c (y·a) =  f_r s_c κ_r·T_c + f_c s_r κ_c·T_r − f_r f_c [γ_r·(ρ_c×F) + γ_c·(ρ_r×F)]
//!               − f_r s_c [γ_r·(ρ×F_c) + γ·(ρ_r×F_c)] − f_c s_r [γ_c·(ρ×F_r) + γ·(ρ_c×F_r)]
//! ```
//! `b`: the member, `a`: the frame that takes the opposite, if one does ([`super::relative`]); `F`
//! and `T` are linear in the directors at the middle, `κ`, `γ` and `ρ` in the coordinates of the
//! end, `c` is constant. Subscripts are derivatives by a coordinate, which moves what is of the end
//! by `f`, 0 or 1, and what is at the middle by `s`.
#![allow(non_snake_case)] // F, T

use super::place::EffortAxes;
use crate::force::acts_on::ActsOn;
use crate::force::bends::Between;
use nalgebra::{SMatrix, Vector3};
use vi_core::interval::Slot;
use vi_core::sparse::Entries;
use vi_rigid::directors::FRAME;

/// By the coordinates of a member, columns.
struct MemberSlopes<'a> {
    member: &'a ActsOn,
    kappa: SMatrix<f64, 3, FRAME>,
    gamma: SMatrix<f64, 3, FRAME>,
    rho: SMatrix<f64, 3, FRAME>,
    wrench: SMatrix<f64, 6, FRAME>, // F, T
}

/// `∂(½ Σ d_I×y_I)/∂q`.
fn levers(member: &ActsOn, y: &[f64; FRAME]) -> SMatrix<f64, 3, FRAME> {
    let mut levers = SMatrix::<f64, 3, FRAME>::zeros();
    if let ActsOn::Frame { .. } = member {
        for i in 0..3 {
            let own = Vector3::from_column_slice(&y[3 + 3 * i..6 + 3 * i]);
            let by = -0.5 * own.cross_matrix(); // e_l×y_I
            levers.fixed_columns_mut::<3>(3 + 3 * i).copy_from(&by);
        }
    }
    levers
}

/// The ends whose directions belong to `y`, each with whether a group of coordinates moves it, and
/// by how much it moves what is at the middle.
pub(super) fn ends<'a>(
    at: Between<'a>,
    y: [&'a [f64]; 2],
    group: usize,
) -> Vec<(EffortAxes<'a>, &'a [f64], (f64, bool))> {
    match at {
        Between::Ends(s) => Slot::BOTH
            .into_iter()
            .enumerate()
            .map(|(end, slot)| (EffortAxes::end_of(s, slot), y[end], (0.5, end == group)))
            .collect(),
        Between::Node { q, .. } if group == 0 => vec![(EffortAxes::node(q), y[0], (1.0, true))],
        Between::Node { .. } => Vec::new(),
    }
}

/// Of a wrench `efforts` on `on`, of which `base` takes the opposite, along the axes of `carrier`.
pub(super) struct Turning<'a> {
    /// The member.
    pub on: &'a ActsOn,
    /// The frame that takes the opposite.
    pub base: Option<&'a ActsOn>,
    /// Along whose axes the components are, where these follow a frame.
    pub carrier: &'a ActsOn,
    /// Components.
    pub efforts: [f64; 6],
}

impl Turning<'_> {
    fn slopes<'a>(&self, member: &'a ActsOn, y: &[f64], is_base: bool) -> MemberSlopes<'a> {
        let levers = levers(member, &member.own(y));
        let mut rho = SMatrix::zeros();
        member.point_rows(if is_base { -1.0 } else { 1.0 }, 0, &mut rho);
        let (kappa, gamma) = if is_base { (-levers, levers) } else { (levers, SMatrix::zeros()) };
        let carries = member.offset() == self.carrier.offset();
        let wrench = match carries {
            true => self.carrier.turned_axes(&self.efforts, 1.0),
            false => SMatrix::zeros(),
        };
        MemberSlopes { member, kappa, gamma, rho, wrench }
    }

    /// Emits `scale ∂_i∂_j (y·a)` of two groups of coordinates.
    pub(super) fn emit(
        &self,
        at: Between<'_>,
        y: [&[f64]; 2],
        scale: f64,
        [i, j]: [usize; 2],
        out: &mut dyn Entries,
    ) {
        let is_node = matches!(at, Between::Node { .. });
        if is_node && i + j > 0 {
            return;
        }
        for (end, (place, y, (share, follows))) in ends(at, y, i).into_iter().enumerate() {
            let of_row = (f64::from(u8::from(follows)), share);
            let of_column = (f64::from(u8::from(is_node || end == j)), at.parts(j)[0]);
            self.emit_at(place, y, scale, [of_row, of_column], out);
        }
    }

    /// Emits `scale ∂_r∂_c (y·a)` of an end; `moved`: `(f, s)` of rows and columns.
    fn emit_at(
        &self,
        at: EffortAxes<'_>,
        y: &[f64],
        scale: f64,
        moved: [(f64, f64); 2],
        out: &mut dyn Entries,
    ) {
        let [F, _] = self.carrier.spatial(self.efforts, &self.carrier.own(at.mid));
        let (mut gamma, mut rho) = (Vector3::zeros(), Vector3::zeros());
        if let Some(base) = self.base {
            let own = base.own(at.own);
            gamma = levers(base, &base.own(y)) * SMatrix::<f64, FRAME, 1>::from(own);
            rho = self.on.point(&self.on.own(at.own)) - base.point(&own);
        }
        let of_base = self.base.map(|base| self.slopes(base, y, true));
        let all: Vec<MemberSlopes<'_>> =
            [self.slopes(self.on, y, false)].into_iter().chain(of_base).collect();
        let is_relative = self.base.is_some();
        // κ_r·T_c − γ_r·(ρ×F_c) − γ·(ρ_r×F_c), and −γ_r·(ρ_c×F)
        let mixed = |(r, i): (&MemberSlopes<'_>, usize), (c, j): (&MemberSlopes<'_>, usize)| {
            let turned = c.wrench.column(j);
            let [F_c, T_c] = [0, 3].map(|k| turned.fixed_rows::<3>(k).into_owned());
            let own = r.kappa.column(i).dot(&T_c);
            if !is_relative {
                return own;
            }
            own - r.gamma.column(i).dot(&rho.cross(&F_c)) - gamma.dot(&r.rho.column(i).cross(&F_c))
        };
        let both = |(r, i): (&MemberSlopes<'_>, usize), (c, j): (&MemberSlopes<'_>, usize)| {
            if is_relative { -r.gamma.column(i).dot(&c.rho.column(j).cross(&F)) } else { 0.0 }
        };
        let [(f_r, s_r), (f_c, s_c)] = moved;
        for (r, c) in all.iter().flat_map(|r| all.iter().map(move |c| (r, c))) {
            for i in 0..r.member.size() {
                for j in 0..c.member.size() {
                    let (row, column) = ((r, i), (c, j));
                    let value = f_r * s_c * mixed(row, column)
                        + f_c * s_r * mixed(column, row)
                        + f_r * f_c * (both(row, column) + both(column, row));
                    if value != 0.0 {
                        let places = [r.member.offset() + i, c.member.offset() + j];
                        out.add(places[0], places[1], scale * value);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::relative::RelativeWrench;
    use super::super::target::Target;
    use super::*;
    use crate::force::bends::Pushes;
    use nalgebra::{DMatrix, Matrix3};
    use vi_core::SparseMatrix;
    use vi_core::interval::{Interval, Slot};
    use vi_core::sparse::{Block, Product};
    use vi_testkit::Sample;

    const N: usize = 2 * FRAME;
    const EFFORTS: [f64; 6] = [0.3, -0.7, 1.1, 0.4, 0.9, -0.6];

    /// The first derivative is a polynomial of degree 2, of which half the difference from one side
    /// to the other is the derivative.
    fn by_sides(target: &Target, s: &Interval, y: [&[f64]; 2], groups: [usize; 2]) -> DMatrix<f64> {
        let [i, j] = groups;
        let mut all = DMatrix::zeros(N, N);
        for column in 0..N {
            let mut row = vec![0.0; N];
            for by in [1.0, -1.0] {
                let mut moved = s.clone();
                let q = if j == 0 { &mut moved.q0 } else { &mut moved.q1 };
                q[column] += by;
                moved.q_mid[column] += 0.5 * by;
                for (end, slot) in Slot::BOTH.into_iter().enumerate() {
                    let place = EffortAxes::end_of(&moved, slot);
                    let into = &mut Product { v: y[end], out: &mut row };
                    let scale = 0.5 * by;
                    let mut along = Block { into, row: 0, column: 0, scale, transposed: true };
                    target.emit_turning(place, (0.5, end == i), 1.0, &EFFORTS, &mut along);
                }
            }
            all.column_mut(column).copy_from_slice(&row);
        }
        all
    }

    #[test]
    fn it_is_the_derivative_of_the_first_one() {
        let mut sample = Sample::new(77);
        let mut numbers = |count: usize| (0..count).map(|_| sample.number()).collect::<Vec<f64>>();
        let point = |x: &[f64]| Vector3::new(x[0], x[1], x[2]);
        let [a, b] = [numbers(3), numbers(3)];
        let axes = Matrix3::from_row_slice(&numbers(9));
        let frame = |offset, x: &[f64], axes| ActsOn::Frame { offset, point: point(x), axes };
        let (on, base) = (frame(0, &a, None), frame(FRAME, &b, Some(axes)));
        let free = frame(FRAME, &a, Some(axes));
        let own = RelativeWrench { on: frame(0, &a, Some(axes)), base: frame(FRAME, &b, None) };
        for target in [
            Target::Member(on.clone()),
            Target::Member(free),
            Target::Relative(Box::new(RelativeWrench { on, base })),
            Target::Relative(Box::new(own)),
        ] {
            let s = Interval::between(0.0, 0.2, &numbers(N), &numbers(N));
            let y = [numbers(N), numbers(N)];
            let y = [&y[0][..], &y[1]];
            for groups in [[0, 0], [0, 1], [1, 0], [1, 1]] {
                let exact = SparseMatrix::assemble(N, N, |out| {
                    target.emit_second(Between::Ends(&s), y, (&EFFORTS, 1.0), groups, out);
                });
                let other = by_sides(&target, &s, y, groups);
                let off = (exact.to_dense() - &other).amax() / other.amax().max(1.0);
                println!("{groups:?}: off by {off:.1e} of {:.1e}", other.amax());
                assert!(off < 1e-14, "{target:?} {groups:?}: {off:e}");
            }
        }
    }
}
