//! The solution of the linear systems of [`super::TreeStep`]: elimination leaf → root, substitution
//! root → leaf.
#![allow(non_snake_case)] // A, D, G, K, S

use super::columns::{Act, ColumnWork, Motion};
use super::link::{Constants, Sums, Work};
use super::sweeps::component;
use crate::geometry::lane_matrices::{Columns, Pair, Spatial};
use crate::geometry::lanes::{Held, Lanes, Width, sweep, three};
use std::ops::Range;
use vi_core::newton::Fault;
use vi_rigid::rotation;

/// `G` of a rotation vector: what a translation of the reference point takes from `δω`.
pub(in crate::solver) type Gain = Columns<Held>;

/// What closed loops between the sweeps of a tree need: the links up to the next apex at a time,
/// and what is eliminated.
#[derive(Debug, Default)]
pub(in crate::solver) struct Part {
    pub(in crate::solver) links: Range<usize>,
    pub(in crate::solver) forces: Vec<Pair<Held>>, // d  Ã S' of joints of columns, none on trees
    // of the links, none where no loop passes through a rotation vector
    pub(in crate::solver) rotations: Vec<Rotation>,
    pub(in crate::solver) unwritten: Vec<usize>, // slots of sums that no child writes
    carried: Sums,                               // by the link before, of its one child
}

/// What the elimination of a rotation vector leaves, and of the translation of a free body.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::solver) struct Rotation {
    pub(in crate::solver) inverse: Columns<Held>,  // Ã_aa⁻¹
    pub(in crate::solver) coupling: Columns<Held>, // Ã_la Ã_aa⁻¹
    pub(in crate::solver) translation: Columns<Held>, // (Ã_ll − Ã_la G)⁻¹ of a free body
}

/// `−h A_α` of a link alone, about its reference point.
#[inline(always)]
pub(super) fn block<W: Width>(w: W, link: &Constants, work: &Work) -> Spatial<Lanes<W>> {
    let (turn, moment, euler) =
        (work.turn.take(w), Lanes::take(w, &work.moment), work.euler.take(w));
    let moment_next = moment + turn.mul(moment); // s'
    let K = euler.plus(&turn.times(&euler)); // Σ x' xᵀ
    Spatial {
        ll: Columns::multiple(w, link.mass[0][0]),
        la: Columns::skew(moment_next * -1.0),
        al: Columns::skew(moment),
        aa: K.trace_less(),
    }
}

sweep! {
    /// Leaf → root: factorizes, and `x ← u_k`; on entry `x` is `−h` times the right-hand side.
    /// `more`: for the sums over children, what is added to the blocks, and the links in question.
    eliminate = sweep_eliminate(
        links: &'a [Constants], works: &'a mut [Work], joints: (&'a mut [ColumnWork], &'a mut [Gain]),
        more: (&'a mut [Sums], &'a [Spatial<Held>], &'a mut Part), x: &'a mut [f64]
    ) -> Result<(), Fault>
}

#[inline(always)]
fn sweep_eliminate<W: Width>(
    w: W,
    links: &[Constants],
    works: &mut [Work],
    (columns, gains): (&mut [ColumnWork], &mut [Gain]),
    (sums, added, part): (&mut [Sums], &[Spatial<Held>], &mut Part),
    x: &mut [f64],
) -> Result<(), Fault> {
    let Range { start, end } = part.links;
    let follows = links.get(end).is_some_and(|link| link.follows_parent);
    let carried = || (part.carried.matrix.take(w), part.carried.wrench.take(w));
    let mut last = follows.then(carried); // of the child just after
    for (k, link) in links[..end].iter().enumerate().skip(start).rev() {
        let work = &mut works[k];
        let (mut A, mut p) = (block(w, link, work), Pair::zero(w));
        if let Some(added) = added.get(k) {
            A = A.plus(&added.take(w));
        }
        if let Some(slot) = link.slot {
            (A, p) = (A.plus(&sums[slot].matrix.take(w)), sums[slot].wrench.take(w));
        }
        if let Some((matrix, wrench)) = last.take() {
            (A, p) = (A.plus(&matrix), p.plus(wrench));
        }
        match link.motion {
            Motion::Fixed => {}
            Motion::Along(act) => {
                let (work, u) = (&mut work.column, &mut x[link.unknown]);
                let AS = eliminate_along((link, act), work, u, &mut A, &mut p)?;
                if let Some(force) = part.forces.get_mut(link.unknown) {
                    *force = AS.held();
                }
            }
            Motion::Several(several) => {
                for (j, column) in several.iter().enumerate().rev() {
                    let unknown = link.unknown + j;
                    let (work, u) = (&mut columns[unknown], &mut x[unknown]);
                    let AS = eliminate_along((link, column.act), work, u, &mut A, &mut p)?;
                    if let Some(force) = part.forces.get_mut(unknown) {
                        *force = AS.held();
                    }
                }
            }
            Motion::Spherical => {
                let (own, kept) = (&mut x[link.unknown..], part.rotations.get_mut(k));
                (A, p) = eliminate_rotation((A, p), (&mut gains[k], kept), own)?;
            }
            Motion::Free => {
                let (velocity, spin) = x[link.unknown..].split_at_mut(3);
                let kept = part.rotations.get_mut(k);
                (A, p) = eliminate_rotation((A, p), (&mut gains[k], kept), spin)?;
                if let Some(kept) = part.rotations.get_mut(k) {
                    kept.translation = inverse(&A.ll)?.held();
                }
                solve_translation(&A.ll, p.linear, velocity)?;
            }
        }
        let Some(parent) = link.parent else { continue };
        let (lever, next) = (Lanes::take(w, &work.lever), Lanes::take(w, &work.lever_next));
        let (matrix, wrench) = (A.between(lever, next), p.at_start_of(lever));
        match links[parent].slot {
            _ if link.follows_parent => last = Some((matrix, wrench)),
            Some(slot) if link.writes_first => {
                sums[slot] = Sums { matrix: matrix.held(), wrench: wrench.held() };
            }
            Some(slot) => {
                sums[slot].matrix = sums[slot].matrix.take(w).plus(&matrix).held();
                sums[slot].wrench = sums[slot].wrench.take(w).plus(wrench).held();
            }
            None => {}
        }
    }
    if let Some((matrix, wrench)) = last {
        part.carried = Sums { matrix: matrix.held(), wrench: wrench.held() };
    }
    Ok(())
}

/// `A ← Ã − Ã S' D⁻¹ Sᵀ Ã` and `p ← p + Ã S' D⁻¹ u`, `u ← u − Sᵀ p`, of one column; returns `Ã S'`.
#[inline(always)]
fn eliminate_along<W: Width>(
    (link, act): (&Constants, Act),
    work: &mut ColumnWork,
    u: &mut f64,
    A: &mut Spatial<Lanes<W>>,
    p: &mut Pair<Lanes<W>>,
) -> Result<Pair<Lanes<W>>, Fault> {
    let w = p.linear.width();
    let (n, next) = (Lanes::take(w, &work.axis), Lanes::take(w, &work.axis_next));
    let (AS, SA) = match act {
        Act::Turn => turning(A, n, next),
        Act::Slide => sliding(A, n, next),
        Act::Screw => {
            let (turn, slide) = (turning(A, n, next), sliding(A, n, next));
            (turn.0.plus_scaled(link.pitch, slide.0), turn.1.plus_scaled(link.pitch, slide.1))
        }
    };
    let inverse = 1.0 / (component((link, act), work, AS) + work.slope); // D = Sᵀ Ã S' + …
    if !inverse.is_finite() {
        return Err(Fault::SingularTangent);
    }
    *u -= component((link, act), work, *p);
    (work.SA, work.inverse) = (SA.held(), inverse);
    *p = p.plus_scaled(inverse * *u, AS);
    *A = A.minus_outer(AS, inverse, SA);
    Ok(AS)
}

/// `Ã (0, n')` and `(0, n)ᵀ Ã`.
#[inline(always)]
fn turning<W: Width>(
    A: &Spatial<Lanes<W>>,
    n: Lanes<W>,
    next: Lanes<W>,
) -> (Pair<Lanes<W>>, Pair<Lanes<W>>) {
    let AS = Pair { linear: A.la.mul(next), angular: A.aa.mul(next) };
    (AS, Pair { linear: A.al.tr_mul(n), angular: A.aa.tr_mul(n) })
}

/// `Ã (n', 0)` and `(n, 0)ᵀ Ã`.
#[inline(always)]
fn sliding<W: Width>(
    A: &Spatial<Lanes<W>>,
    n: Lanes<W>,
    next: Lanes<W>,
) -> (Pair<Lanes<W>>, Pair<Lanes<W>>) {
    let AS = Pair { linear: A.ll.mul(next), angular: A.al.mul(next) };
    (AS, Pair { linear: A.ll.tr_mul(n), angular: A.la.tr_mul(n) })
}

/// Of `S = (0, I)`, `S' = (0, T)`: `Ã_ll − Ã_la G` with the gain `G = Ã_aa⁻¹ Ã_al`, and
/// `p + Ã_la x` with `x ← Ã_aa⁻¹ (x − p)`; `T` has no part in them.
#[inline(always)]
fn eliminate_rotation<W: Width>(
    (A, p): (Spatial<Lanes<W>>, Pair<Lanes<W>>),
    (gain, kept): (&mut Gain, Option<&mut Rotation>),
    x: &mut [f64],
) -> Result<(Spatial<Lanes<W>>, Pair<Lanes<W>>), Fault> {
    let w = p.linear.width();
    let (aa, al) = (rows(&A.aa), rows(&A.al));
    let u = (Lanes::of(w, x) - p.angular).xyz();
    let mut sides = three!(i => [al[i][0], al[i][1], al[i][2], u[i]]);
    solve_block(aa, &mut sides)?;
    let G = Columns(three!(j => Lanes::new(w, three!(i => sides[i][j]))));
    let omega = Lanes::new(w, three!(i => sides[i][3]));
    omega.write(x);
    *gain = G.held();
    if let Some(kept) = kept {
        let inverse = inverse(&A.aa)?;
        (kept.inverse, kept.coupling) = (inverse.held(), A.la.times(&inverse).held());
    }
    let ll = A.ll.minus(&A.la.times(&G));
    let linear = p.linear + A.la.mul(omega);
    let (zero, none) = (Columns::zero(w), Lanes::zero(w));
    Ok((Spatial { ll, la: zero, al: zero, aa: zero }, Pair { linear, angular: none }))
}

/// `x ← Ã_ll⁻¹ (x − p)`, the velocity of a free body whose rotation is eliminated.
#[inline(always)]
fn solve_translation<W: Width>(
    ll: &Columns<Lanes<W>>,
    p: Lanes<W>,
    x: &mut [f64],
) -> Result<(), Fault> {
    let w = p.width();
    let force = (Lanes::of(w, x) - p).xyz();
    let mut sides = three!(i => [force[i]]);
    solve_block(rows(ll), &mut sides)?;
    x[..3].copy_from_slice(sides.as_flattened());
    Ok(())
}

/// `D⁻¹`.
#[inline(always)]
fn inverse<W: Width>(D: &Columns<Lanes<W>>) -> Result<Columns<Lanes<W>>, Fault> {
    let w = D.0[0].width();
    let mut sides = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    solve_block(rows(D), &mut sides)?;
    Ok(Columns(three!(j => Lanes::new(w, three!(i => sides[i][j])))))
}

/// The rows of a matrix.
#[inline(always)]
fn rows<W: Width>(m: &Columns<Lanes<W>>) -> [[f64; 3]; 3] {
    let [a, b, c] = three!(j => m.0[j].xyz());
    three!(i => [a[i], b[i], c[i]])
}

/// `sides ← D⁻¹ sides` by Gaussian elimination with row pivoting.
#[inline(always)]
fn solve_block<const R: usize>(
    mut D: [[f64; 3]; 3],
    sides: &mut [[f64; R]; 3],
) -> Result<(), Fault> {
    let mut inverse = [0.0; 3];
    for k in 0..3 {
        let mut pivot = k;
        for i in k + 1..3 {
            pivot = if D[i][k].abs() > D[pivot][k].abs() { i } else { pivot };
        }
        D.swap(k, pivot);
        sides.swap(k, pivot);
        inverse[k] = 1.0 / D[k][k];
        if !inverse[k].is_finite() {
            return Err(Fault::SingularTangent);
        }
        for i in k + 1..3 {
            let factor = D[i][k] * inverse[k];
            for j in k + 1..3 {
                D[i][j] -= factor * D[k][j];
            }
            for r in 0..R {
                sides[i][r] -= factor * sides[k][r];
            }
        }
    }
    for k in (0..3).rev() {
        for r in 0..R {
            for i in k + 1..3 {
                sides[k][r] -= D[k][i] * sides[i][r];
            }
            sides[k][r] *= inverse[k];
        }
    }
    Ok(())
}

sweep! {
    /// Root → leaf: `x ← δτ` from `u_k`, at the increments `u`, of some links; returns their
    /// largest rotation, rad.
    substitute = sweep_substitute(
        links: (&'a [Constants], Range<usize>), works: &'a mut [Work],
        joints: (&'a [ColumnWork], &'a [Gain]), u: &'a [f64], x: &'a mut [f64]
    ) -> f64
}

#[inline(always)]
fn sweep_substitute<W: Width>(
    w: W,
    (links, range): (&[Constants], Range<usize>),
    works: &mut [Work],
    (columns, gains): (&[ColumnWork], &[Gain]),
    u: &[f64],
    x: &mut [f64],
) -> f64 {
    let mut largest = 0.0_f64; // square of a rotation
    let before = range.start.checked_sub(1);
    let mut twist = before.map_or(Pair::zero(w), |k| works[k].twist.take(w)); // of the link before
    for (k, link) in links[..range.end].iter().enumerate().skip(range.start) {
        match link.parent {
            None => twist = Pair::zero(w),
            Some(_) if link.follows_parent => {}
            Some(parent) => twist = works[parent].twist.take(w),
        }
        let (work, first) = (&mut works[k], link.unknown);
        twist = twist.at_end_of(Lanes::take(w, &work.lever_next)); // X' δt'
        match link.motion {
            Motion::Fixed => {}
            Motion::Along(act) => {
                follow((link, act), &work.column, &mut x[first], &mut twist);
            }
            Motion::Several(several) => {
                for (unknown, column) in (first..).zip(several) {
                    follow((link, column.act), &columns[unknown], &mut x[unknown], &mut twist);
                }
            }
            Motion::Spherical => {
                twist.angular = Lanes::of(w, &x[first..]) - gains[k].take(w).mul(twist.linear);
                rate_of(w, &u[first..], twist.angular).write(&mut x[first..]);
            }
            Motion::Free => {
                let linear = Lanes::of(w, &x[first..]);
                let angular = Lanes::of(w, &x[first + 3..]) - gains[k].take(w).mul(linear);
                twist = Pair { linear, angular };
                rate_of(w, &u[first + 3..], angular).write(&mut x[first + 3..]);
            }
        }
        work.twist = twist.held();
        let square = twist.angular.dot(twist.angular);
        largest = if square <= largest { largest } else { square };
    }
    largest.sqrt()
}

/// `x ← δτ_j = D⁻¹ (u − Sᵀ Ã δt')` and `δt' ← δt' + S'_j δτ_j` of one column.
#[inline(always)]
fn follow<W: Width>(
    (link, act): (&Constants, Act),
    work: &ColumnWork,
    x: &mut f64,
    twist: &mut Pair<Lanes<W>>,
) {
    let w = twist.linear.width();
    *x = (*x - work.SA.take(w).dot(*twist)) * work.inverse;
    let moved = Lanes::take(w, &work.axis_next) * *x;
    match act {
        Act::Turn => twist.angular += moved,
        Act::Slide => twist.linear += moved,
        Act::Screw => {
            twist.angular += moved;
            twist.linear += moved * link.pitch;
        }
    }
}

/// `δθ = T(θ)⁻¹ δω` of the rotation vector `θ`.
#[inline(always)]
fn rate_of<W: Width>(w: W, theta: &[f64], omega: Lanes<W>) -> Lanes<W> {
    let theta = Lanes::of(w, theta);
    let first = theta.cross(omega);
    omega + theta.cross(first * rotation::kappa(theta.dot(theta)) - omega * 0.5)
}
