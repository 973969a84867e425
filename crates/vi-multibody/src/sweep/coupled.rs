//! Elimination and substitution on trees whose bodies are coupled with their parents, as by springs
//! and dampers between points of both.
//!
//! Beside the blocks `Â_k` of the links there are `B_k`, rows of a link and columns of its parent,
//! and `C_k`, rows of the parent and columns of the link. With `E = 0`, `e = 0` to begin with, each
//! column of a joint takes out
//! ```text
//! Â − Â S' D⁻¹ Sᵀ Â,   B − Â S' D⁻¹ Sᵀ B,   C − C S' D⁻¹ Sᵀ Â,   E − C S' D⁻¹ Sᵀ B      leaf → root
//! p + Â S' D⁻¹ u,      e + C S' D⁻¹ u
//! Â_parent += Xᵀ Â X' + Xᵀ B + C X' + E,   p_parent += Xᵀ p + e
//! δτ = D⁻¹ (u − Sᵀ Â X' δt'_parent − Sᵀ B δt'_parent)                                     root → leaf   [5.31]
//! ```
#![allow(non_snake_case)] // A, B, C, E, G, H, S

use super::columns::{Act, Motion};
use super::eliminate::{block, both, solve_translation};
use super::link::{ColumnWork, Gain, Link, Sums, Work, column_mut};
use super::pull_back::component;
use super::solve3;
use super::substitute::substitute;
use crate::geometry::matrix::{Columns, Screw, Spatial};
use crate::geometry::one_tree::three;
use crate::geometry::space::{Held, Number, Space, Store, Vector};
use vi_core::lanes::Lanes;

/// What couples a link with its parent.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coupling<M: Store> {
    pub(crate) of_link: Spatial<M::Held>,   // B
    pub(crate) of_parent: Spatial<M::Held>, // C
    gain: [Gain<M>; 2],                     // H: what the parent's twist takes from δω
    sums: Sums<M>,                          // over the children of the link
}

/// All couplings of a tree; nothing where its bodies are coupled with none.
#[derive(Debug)]
pub(crate) struct Couplings<M: Store> {
    pub(crate) links: Vec<Coupling<M>>,
    rows: Vec<Screw<M::Held>>, // d  Sᵀ B
}

impl<M: Store> Couplings<M> {
    pub(crate) fn new<S: Space<Store = M>>(s: S, links: usize, unknowns: usize) -> Self {
        let zero = Columns::zero(s).held();
        let (of_link, of_parent) = (Spatial::zero(s).held(), Spatial::zero(s).held());
        let none = Coupling { of_link, of_parent, gain: [zero; 2], sums: Sums::zero(s) };
        Self { links: vec![none; links], rows: vec![Screw::zero(s).held(); unknowns] }
    }
}

/// What is left of a link while its columns are eliminated.
struct LinkRemainder<V: Vector> {
    A: Spatial<V>,
    B: Spatial<V>,
    C: Spatial<V>,
    E: Spatial<V>,
    p: Screw<V>,
    e: Screw<V>,
}

/// [`eliminate`](super::eliminate::eliminate) of all links with what is `added` to their blocks.
#[inline(always)]
pub(crate) fn eliminate<S: Space>(
    s: S,
    links: &[Link<S::Store>],
    works: &mut [Work<S::Store>],
    (columns, gains): (&mut [ColumnWork<S::Store>], &mut [Gain<S::Store>]),
    (couplings, added): (&mut Couplings<S::Store>, &[Spatial<Held<S>>]),
    x: &mut [Number<S>],
) -> Number<S> {
    let Couplings { links: couplings, rows } = couplings;
    couplings.iter_mut().for_each(|coupling| coupling.sums = Sums::zero(s));
    let mut finite = s.number(0.0);
    for (k, link) in links.iter().enumerate().rev() {
        let (work, coupling) = (&mut works[k], &mut couplings[k]);
        let mut A = block(s, link, work).plus(&coupling.sums.matrix.take(s));
        if let Some(added) = added.get(k) {
            A = A.plus(&added.take(s));
        }
        let mut rest = LinkRemainder {
            A,
            B: coupling.of_link.take(s),
            C: coupling.of_parent.take(s),
            E: Spatial::zero(s),
            p: coupling.sums.wrench.take(s),
            e: Screw::zero(s),
        };
        let first = link.unknown;
        for (j, column) in link.motion.columns().iter().enumerate().rev() {
            let work = column_mut(link, work, columns, first + j);
            let own = (&mut *work, &mut x[first + j]);
            rows[first + j] = eliminate_along(s, (link, column.act), own, &mut rest);
            finite = finite + work.inverse * 0.0;
        }
        if let Some(angle) = link.motion.rotation_vector() {
            let (velocity, spin) = x[first..].split_at_mut(angle);
            let gains = (&mut gains[k], &mut coupling.gain);
            finite = finite + eliminate_rotation(s, &mut rest, gains, spin);
            if link.motion == Motion::Free {
                let force = rest.p.linear;
                finite = finite + solve_translation(s, &rest.A.ll, force, velocity);
            }
        }
        let Some(parent) = link.parent else { continue };
        let (lever, next) = (s.take(&work.lever), s.take(&work.lever_next));
        let LinkRemainder { A, B, C, E, p, e } = rest;
        let matrix = A.between(lever, next).plus(&E);
        let matrix = matrix.plus(&B.between(lever, s.zero())).plus(&C.between(s.zero(), next));
        let sums = &mut couplings[parent].sums;
        sums.matrix = sums.matrix.take(s).plus(&matrix).held();
        sums.wrench = sums.wrench.take(s).plus(p.at_start_of(lever).plus(e)).held();
    }
    finite
}

/// One column; returns `Sᵀ B`.
#[inline(always)]
fn eliminate_along<S: Space>(
    s: S,
    (link, act): (&Link<S::Store>, Act),
    (work, u): (&mut ColumnWork<S::Store>, &mut Number<S>),
    LinkRemainder { A, B, C, E, p, e }: &mut LinkRemainder<S::Vector>,
) -> Screw<Held<S>> {
    let axes = [s.take(&work.axis), s.take(&work.axis_next)];
    let ((AS, SA), (_, SB), (CS, _)) =
        (both(s, link, act, A, axes), both(s, link, act, B, axes), both(s, link, act, C, axes));
    let inverse = s.number(1.0).over(component(s, link, act, work, AS) + work.slope);
    *u = *u - component(s, link, act, work, *p);
    (work.SA, work.inverse) = (SA.held(), inverse);
    (*p, *e) = (p.plus(AS.times(inverse * *u)), e.plus(CS.times(inverse * *u)));
    *E = E.minus_outer(CS, inverse, SB);
    *C = C.minus_outer(CS, inverse, SA);
    *B = B.minus_outer(AS, inverse, SB);
    *A = A.minus_outer(AS, inverse, SA);
    SB.held()
}

/// A rotation vector: `δω = Ã_aa⁻¹ (u − p_a) − G δt_l − H δt'_parent`.
#[inline(always)]
fn eliminate_rotation<S: Space>(
    s: S,
    rest: &mut LinkRemainder<S::Vector>,
    (gain, of_parent): (&mut Gain<S::Store>, &mut [Gain<S::Store>; 2]),
    x: &mut [Number<S>],
) -> Number<S> {
    let LinkRemainder { A, B, C, E, p, e } = rest;
    let (al, bl, ba) = (A.al.rows(), B.al.rows(), B.aa.rows());
    let u = (s.read(x, 0) - p.angular).components();
    let mut sides = three!(i => {
        let ([a, b, c], [d, e, f], [g, h, j]) = (al[i], bl[i], ba[i]);
        [a, b, c, d, e, f, g, h, j, u[i]]
    });
    let finite = solve3::solve(s, A.aa.rows(), &mut sides);
    let v = s.zero();
    let column = |j: usize| v.of(three!(i => sides[i][j]));
    let [G, H, K] = [0, 3, 6].map(|first| Columns(three!(j => column(first + j))));
    let omega = column(9);
    s.write(omega, x, 0);
    (*gain, *of_parent) = (G.held(), [H.held(), K.held()]);
    let zero = Columns::zero(s);
    *e = e.plus(Screw { linear: C.la.mul(omega), angular: C.aa.mul(omega) });
    *p = Screw { linear: p.linear + A.la.mul(omega), angular: s.zero() };
    *E = Spatial {
        ll: E.ll.minus(&C.la.times(&H)),
        la: E.la.minus(&C.la.times(&K)),
        al: E.al.minus(&C.aa.times(&H)),
        aa: E.aa.minus(&C.aa.times(&K)),
    };
    let (ll, la) = (B.ll.minus(&A.la.times(&H)), B.la.minus(&A.la.times(&K)));
    *B = Spatial { ll, la, al: zero, aa: zero };
    let (ll, al) = (C.ll.minus(&C.la.times(&G)), C.al.minus(&C.aa.times(&G)));
    *C = Spatial { ll, la: zero, al, aa: zero };
    *A = Spatial { ll: A.ll.minus(&A.la.times(&G)), la: zero, al: zero, aa: zero };
    finite
}

/// [`substitute`] of all links.
#[inline(always)]
pub(crate) fn follow<S: Space>(
    s: S,
    links: &[Link<S::Store>],
    works: &mut [Work<S::Store>],
    (columns, gains): (&[ColumnWork<S::Store>], &[Gain<S::Store>]),
    couplings: &Couplings<S::Store>,
    u: &[Number<S>],
    x: &mut [Number<S>],
) {
    for (k, link) in links.iter().enumerate() {
        if let Some(parent) = link.parent {
            let (twist, first) = (works[parent].twist.take(s), link.unknown);
            for unknown in first..first + link.motion.columns().len() {
                x[unknown] = x[unknown] - couplings.rows[unknown].take(s).dot(twist);
            }
            if let Some(angle) = link.motion.rotation_vector() {
                let [H, K] = couplings.links[k].gain.map(|gain| gain.take(s));
                let taken = H.mul(twist.linear) + K.mul(twist.angular);
                s.write(s.read(x, first + angle) - taken, x, first + angle);
            }
        }
        let _ = substitute(s, (links, k..k + 1), works, (columns, gains), u, x);
    }
}
