//! Leaf → root: elimination of the joints.
#![allow(non_snake_case)] // A, D, G, K, S

use super::columns::{Act, Motion};
use super::link::{ColumnWork, Gain, Link, Sums, Work};
use super::pull_back::{component, lever};
use super::solve3;
use crate::geometry::matrix::{Columns, Screw, Spatial};
use crate::geometry::one_tree::three;
use crate::geometry::space::{Held, Number, Space, Store, Vector};
use std::ops::Range;
use vi_core::lanes::Lanes;

/// What closed loops between the sweeps of a tree need: the links up to the next apex at a time,
/// and what is eliminated.
#[derive(Debug)]
pub(crate) struct UpToApex<M: Store> {
    pub(crate) links: Range<usize>,
    pub(crate) forces: Vec<Screw<M::Held>>, // d  Ã S' of joints of columns, none on trees
    pub(crate) rotations: Vec<EliminatedRotation<M>>, // of links, where loops pass
    unwritten: Vec<usize>,                  // slots of sums that no child writes
    carried: Sums<M>,                       // by the link before, of its one child
}

/// What the elimination of a rotation vector leaves, and of the translation of a free body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EliminatedRotation<M: Store> {
    pub(crate) inverse: Columns<M::Held>,     // Ã_aa⁻¹
    pub(crate) coupling: Columns<M::Held>,    // Ã_la Ã_aa⁻¹
    pub(crate) translation: Columns<M::Held>, // (Ã_ll − Ã_la G)⁻¹ of a free body
}

impl<M: Store> UpToApex<M> {
    pub(crate) fn new<S: Space<Store = M>>(s: S) -> Self {
        let (forces, rotations, unwritten) = (Vec::new(), Vec::new(), Vec::new());
        Self { links: 0..0, forces, rotations, unwritten, carried: Sums::zero(s) }
    }

    /// Gives the links `apexes`, on which closed loops hang, a place for what these add.
    pub(crate) fn carry<S: Space<Store = M>>(
        &mut self,
        s: S,
        links: &mut [Link<M>],
        sums: &mut Vec<Sums<M>>,
        apexes: impl Iterator<Item = usize>,
    ) {
        for apex in apexes {
            if links[apex].slot.is_none() {
                links[apex].slot = Some(sums.len());
                self.unwritten.push(sums.len());
                sums.push(Sums::zero(s));
            }
        }
    }

    /// Before the sweeps of a linear system: nothing hangs on any link.
    pub(crate) fn release<S: Space<Store = M>>(&self, s: S, sums: &mut [Sums<M>]) {
        self.unwritten.iter().for_each(|&slot| sums[slot] = Sums::zero(s));
    }
}

impl<M: Store> EliminatedRotation<M> {
    pub(crate) fn zero<S: Space<Store = M>>(s: S) -> Self {
        let zero = Columns::zero(s).held();
        Self { inverse: zero, coupling: zero, translation: zero }
    }
}

/// `−h A_α` of a link alone, about its reference point; where matrices are symmetric, `M` where its
/// moment and its Euler tensor are of.
#[inline(always)]
pub(super) fn block<S: Space>(
    s: S,
    link: &Link<S::Store>,
    work: &Work<S::Store>,
) -> Spatial<S::Vector> {
    let (moment, euler) = (s.take(&work.moment), work.euler.take(s));
    let (mut moment_next, mut K) = (moment, euler);
    if !S::SYMMETRIC {
        let turn = work.turn.take(s);
        moment_next = moment + turn.mul(moment); // s'
        K = euler.plus(&turn.times(&euler)); // Σ x' xᵀ
    }
    Spatial {
        ll: Columns::multiple(s, s.factor(link.mass[0][0])),
        la: Columns::skew(moment_next * -1.0),
        al: Columns::skew(moment),
        aa: K.trace_less(),
    }
}

/// Factorizes, and `x ← u_k`; on entry `x` is `−h` times the right-hand side. `more`: for the sums
/// over children, what is added to the blocks, and the links in question. Returns zero, or what is
/// not a number where a pivot vanishes.
#[inline(always)]
pub(crate) fn eliminate<S: Space>(
    s: S,
    links: &[Link<S::Store>],
    works: &mut [Work<S::Store>],
    (columns, gains): (&mut [ColumnWork<S::Store>], &mut [Gain<S::Store>]),
    (sums, added, part): (&mut [Sums<S::Store>], &[Spatial<Held<S>>], &mut UpToApex<S::Store>),
    x: &mut [Number<S>],
) -> Number<S> {
    let Range { start, end } = part.links;
    let follows = links.get(end).is_some_and(|link| link.follows_parent);
    // of the child just after
    let mut last = match follows {
        true => Some((part.carried.matrix.take(s), part.carried.wrench.take(s))),
        false => None,
    };
    let mut finite = s.number(0.0);
    for (k, link) in links[..end].iter().enumerate().skip(start).rev() {
        let work = &mut works[k];
        let (mut A, mut p) = (block(s, link, work), Screw::zero(s));
        if let Some(added) = added.get(k) {
            A = A.plus(&added.take(s));
        }
        if let Some(slot) = link.slot {
            (A, p) = (A.plus(&sums[slot].matrix.take(s)), sums[slot].wrench.take(s));
        }
        if let Some((matrix, wrench)) = last.take() {
            (A, p) = (A.plus(&matrix), p.plus(wrench));
        }
        match link.motion {
            Motion::Fixed => {}
            Motion::Along(act) => {
                let (work, u) = (&mut work.column, &mut x[link.unknown]);
                let AS = eliminate_along(s, (link, act), (work, u), (&mut A, &mut p));
                finite = finite + work.inverse * 0.0;
                if let Some(force) = part.forces.get_mut(link.unknown) {
                    *force = AS.held();
                }
            }
            Motion::Several(several) => {
                for (j, column) in several.iter().enumerate().rev() {
                    let unknown = link.unknown + j;
                    let (work, u) = (&mut columns[unknown], &mut x[unknown]);
                    let AS = eliminate_along(s, (link, column.act), (work, u), (&mut A, &mut p));
                    finite = finite + work.inverse * 0.0;
                    if let Some(force) = part.forces.get_mut(unknown) {
                        *force = AS.held();
                    }
                }
            }
            Motion::Spherical => {
                let (own, kept) = (&mut x[link.unknown..], part.rotations.get_mut(k));
                let pivots = eliminate_rotation(s, &mut A, &mut p, &mut gains[k], kept, own);
                finite = finite + pivots;
            }
            Motion::Free => {
                let (velocity, spin) = x[link.unknown..].split_at_mut(3);
                let kept = part.rotations.get_mut(k);
                let pivots = eliminate_rotation(s, &mut A, &mut p, &mut gains[k], kept, spin);
                if let Some(kept) = part.rotations.get_mut(k) {
                    kept.translation = solve3::inverse(s, &A.ll).0.held();
                }
                finite = finite + pivots + solve_translation(s, &A.ll, p.linear, velocity);
            }
        }
        let Some(parent) = link.parent else { continue };
        let (lever, next) = (lever(s, work), s.take(&work.lever_next));
        let (matrix, wrench) = (A.between(lever, next), p.at_start_of(lever));
        match links[parent].slot {
            _ if link.follows_parent => last = Some((matrix, wrench)),
            Some(slot) if link.writes_first => {
                sums[slot] = Sums { matrix: matrix.held(), wrench: wrench.held() };
            }
            Some(slot) => {
                sums[slot].matrix = sums[slot].matrix.take(s).plus(&matrix).held();
                sums[slot].wrench = sums[slot].wrench.take(s).plus(wrench).held();
            }
            None => {}
        }
    }
    if let Some((matrix, wrench)) = last {
        part.carried = Sums { matrix: matrix.held(), wrench: wrench.held() };
    }
    finite
}

/// `A ← Ã − Ã S' D⁻¹ Sᵀ Ã` and `p ← p + Ã S' D⁻¹ u`, `u ← u − Sᵀ p`, of one column; returns `Ã S'`.
#[inline(always)]
fn eliminate_along<S: Space>(
    s: S,
    (link, act): (&Link<S::Store>, Act),
    (work, u): (&mut ColumnWork<S::Store>, &mut Number<S>),
    (A, p): (&mut Spatial<S::Vector>, &mut Screw<S::Vector>),
) -> Screw<S::Vector> {
    let (AS, SA) = both(s, link, act, A, [s.take(&work.axis), s.take(&work.axis_next)]);
    let D = component(s, link, act, work, AS) + work.slope; // D = Sᵀ Ã S' + …
    let inverse = s.number(1.0).over(D);
    *u = *u - component(s, link, act, work, *p);
    (work.SA, work.inverse) = (SA.held(), inverse);
    *p = p.plus(AS.times(inverse * *u));
    *A = A.minus_outer(AS, inverse, SA);
    AS
}

/// `Ã S'` and `Sᵀ Ã` of one column along the axes `n, n'`.
#[inline(always)]
pub(super) fn both<S: Space>(
    s: S,
    link: &Link<S::Store>,
    act: Act,
    A: &Spatial<S::Vector>,
    [n, next]: [S::Vector; 2],
) -> (Screw<S::Vector>, Screw<S::Vector>) {
    let (AS, SA) = match act {
        Act::Turn => turning(A, n, next),
        Act::Slide => sliding(A, n, next),
        Act::Screw => {
            let (turn, slide, pitch) =
                (turning(A, n, next), sliding(A, n, next), s.factor(link.pitch));
            (turn.0.plus(slide.0.times(pitch)), turn.1.plus(slide.1.times(pitch)))
        }
    };
    (AS, if S::SYMMETRIC { AS } else { SA })
}

/// `Ã (0, n')` and `(0, n)ᵀ Ã`.
#[inline(always)]
fn turning<V: Vector>(A: &Spatial<V>, n: V, next: V) -> (Screw<V>, Screw<V>) {
    let AS = Screw { linear: A.la.mul(next), angular: A.aa.mul(next) };
    (AS, Screw { linear: A.al.tr_mul(n), angular: A.aa.tr_mul(n) })
}

/// `Ã (n', 0)` and `(n, 0)ᵀ Ã`.
#[inline(always)]
fn sliding<V: Vector>(A: &Spatial<V>, n: V, next: V) -> (Screw<V>, Screw<V>) {
    let AS = Screw { linear: A.ll.mul(next), angular: A.al.mul(next) };
    (AS, Screw { linear: A.ll.tr_mul(n), angular: A.la.tr_mul(n) })
}

/// Of `S = (0, I)`, `S' = (0, T)`: `A ← Ã_ll − Ã_la G` with the gain `G = Ã_aa⁻¹ Ã_al`, and
/// `p ← p + Ã_la x` with `x ← Ã_aa⁻¹ (x − p)`; `T` has no part in them.
#[inline(always)]
fn eliminate_rotation<S: Space>(
    s: S,
    A: &mut Spatial<S::Vector>,
    p: &mut Screw<S::Vector>,
    gain: &mut Gain<S::Store>,
    kept: Option<&mut EliminatedRotation<S::Store>>,
    x: &mut [Number<S>],
) -> Number<S> {
    let (aa, al) = (A.aa.rows(), A.al.rows());
    let u = (s.read(x, 0) - p.angular).components();
    let mut sides = three!(i => [al[i][0], al[i][1], al[i][2], u[i]]);
    let finite = solve3::solve(s, aa, &mut sides);
    let v = s.zero();
    let G = Columns(three!(j => v.of(three!(i => sides[i][j]))));
    let omega = v.of(three!(i => sides[i][3]));
    s.write(omega, x, 0);
    *gain = G.held();
    if let Some(kept) = kept {
        let inverse = solve3::inverse(s, &A.aa).0;
        (kept.inverse, kept.coupling) = (inverse.held(), A.la.times(&inverse).held());
    }
    let ll = A.ll.minus(&A.la.times(&G));
    let linear = p.linear + A.la.mul(omega);
    let zero = Columns::zero(s);
    *A = Spatial { ll, la: zero, al: zero, aa: zero };
    *p = Screw { linear, angular: s.zero() };
    finite
}

/// `x ← Ã_ll⁻¹ (x − p)`, the velocity of a free body whose rotation is eliminated.
#[inline(always)]
pub(super) fn solve_translation<S: Space>(
    s: S,
    ll: &Columns<S::Vector>,
    p: S::Vector,
    x: &mut [Number<S>],
) -> Number<S> {
    let force = (s.read(x, 0) - p).components();
    let mut sides = three!(i => [force[i]]);
    let finite = solve3::solve(s, ll.rows(), &mut sides);
    x[..3].copy_from_slice(sides.as_flattened());
    finite
}
