//! Costates of a Galerkin step on a tree: all its control points are eliminated together.
//!
//! ```text
//! Σ_i P_jᵀ (h H_ij)ᵀ P_i μ_i + h (Σ_c Λ_jc D²g_c on tangents) μ_j = P_jᵀ h c_j     j = 1 … s, i = 0 … s−1   [2.50]
//! y_k = X y_parent + S μ_k,   t_k = X' t_parent + S' u_k        twists of μ at q_i, variations at q_j
//! D = S'ᵀ Â S,   V = S'ᵀ Â X,   U = X'ᵀ Â S                     leaf → root
//! Â_parent += X'ᵀ Â X − U D⁻¹ V,   p_parent += X'ᵀ p − U D⁻¹ S'ᵀ p
//! μ_k = −D⁻¹ (V y_parent + S'ᵀ p)                               root → leaf
//! ```
//! `Â_k` has `s × s` blocks of a link with all that it carries, `(j, i)`; the rows of `D` are the
//! unknowns of a joint at the control points `1 … s`, its columns those at `0 … s − 1`. Masses
//! enter by `K_ij P_jᵀ M P_i`. On a tree the derivative of `P` stands in the place of the
//! curvature of the constraints, at `0 < i = j < s`, with the wrench `F = (f, τ)` of `h w_i` on a
//! link and all that it carries and `a_I = h (w_I − ϱ_I f)` of a link alone (see
//! [`super::costate`]):
//! ```text
//! frame    θ·Σ_I [a_I (d_I·ω) − ω (d_I·a_I)]          θ, ω of its twists t, y
//! lever    θ·[f (ℓ·ω) − ω (ℓ·f)],   u n·(f × ω)        of the parent; slides by u
//! axis     μ θ·(n × F_n)                               of what it is fixed in; F_n: f, τ or τ + p f
//! ```
//! `O(N)` for each step, `O(s³)`.
#![allow(non_snake_case)] // A, C, D, F, K, S, U, V

use super::columns::{Act, Axis, Motion};
use super::costate::by_axis;
use super::coupled::Couplings;
use super::link::Link;
use super::place::{LinkPlace, balance, momenta};
use crate::geometry::matrix::{Columns, Screw, Spatial};
use crate::geometry::one_tree::{HeldVector, One, OneTree, Width, Xyz, sweep, three};
use crate::geometry::space::{Space, Vector};
use nalgebra::DMatrix;

/// A link at a control point.
#[derive(Clone, Copy, Debug, Default)]
struct LinkAtPoint {
    d: Columns<HeldVector>,
    arm: HeldVector,           // from the centre to the reference point
    lever: HeldVector,         // ℓ
    bent: Columns<HeldVector>, // of the frame and of the levers of what it carries
    wrench: Screw<HeldVector>, // F
    twist: Screw<HeldVector>,  // y
}

/// The tree at all control points of a step, and what the elimination leaves.
#[derive(Debug)]
pub(crate) struct PointTree {
    s: usize,
    K: DMatrix<f64>,                      // (s + 1) × (s + 1)
    stands: Vec<LinkAtPoint>,             // link by link, s + 1 each
    axes: Vec<HeldVector>,                // of unknowns along axes, s + 1 each
    loads: Vec<Screw<HeldVector>>,        // link by link, s each  p
    own: [Vec<Spatial<HeldVector>>; 2],   // s × s  Â of the present link, and for its parent
    carried: [Vec<Screw<HeldVector>>; 2], // s  p of both
    sums: Vec<Spatial<HeldVector>>,       // of slots, s × s each
    sum_loads: Vec<Screw<HeldVector>>,    // s each
    columns: [Vec<Screw<HeldVector>>; 2], // Â S, U; (joint column, i) by j
    rows: Vec<f64>,                       // [D, V, S'ᵀ p], then D⁻¹ [V, S'ᵀ p], joint by joint
    first: Vec<usize>,                    // where those of a link begin
    m: Vec<f64>,                          // μ along unknowns, s each
}

/// What else acts in a step, transposed: `h H_ij` without inertia and curvature; for each `(j, i)`
/// in the order of columns `i` in rows `j`, of all links.
#[derive(Debug)]
pub(crate) struct ActingTransposed {
    /// On the links.
    pub(crate) blocks: Vec<Vec<Spatial<HeldVector>>>,
    /// Between links and their parents; empty where none are coupled.
    pub(crate) couplings: Vec<Couplings<One>>,
}

/// Numbers in a row of a joint before those of `V`.
fn unknowns(link: &Link<One>, s: usize) -> usize {
    link.motion.dof() * s
}

/// Length of a row of a joint.
fn length(link: &Link<One>, s: usize) -> usize {
    unknowns(link, s) + 6 * s + 1
}

impl PointTree {
    /// Of links with so many slots and unknowns.
    pub(crate) fn new(links: &[Link<One>], slots: usize, d: usize, K: &DMatrix<f64>) -> Self {
        let s = K.nrows() - 1;
        let block = || vec![Spatial::default(); s * s];
        let screws = |count: usize| vec![Screw::default(); count];
        let (mut first, mut end) = (Vec::new(), 0);
        for link in links {
            first.push(end);
            end += unknowns(link, s) * length(link, s);
        }
        Self {
            s,
            K: K.clone(),
            stands: vec![LinkAtPoint::default(); links.len() * (s + 1)],
            axes: vec![HeldVector::default(); d * (s + 1)],
            loads: screws(links.len() * s),
            own: [block(), block()],
            carried: [screws(s), screws(s)],
            sums: vec![Spatial::default(); slots * s * s],
            sum_loads: screws(slots * s),
            columns: [screws(6 * s * s), screws(6 * s * s)],
            rows: vec![0.0; end],
            first,
            m: vec![0.0; d * s],
        }
    }

    /// Stands at the control point `l`, `q_l`.
    pub(crate) fn stand(&mut self, links: &[Link<One>], l: usize, q: &[f64]) {
        stand_links(self, links, l, q);
    }

    /// Takes the wrenches of `h w_l`, `0 < l < s`.
    pub(crate) fn bend(&mut self, links: &[Link<One>], l: usize, h: f64, w: &[f64]) {
        bend_links(self, links, l, h, w);
    }

    /// Takes `h c_l` from `K_sl M b'` and what else there is of it.
    pub(crate) fn load(
        &mut self,
        links: &[Link<One>],
        l: usize,
        b: &[f64],
        scale: f64,
        more: &[f64],
    ) {
        load_links(self, links, l, b, scale, more);
    }

    /// Solves for the twists of `μ_i`; whether all pivots are numbers.
    pub(crate) fn solve(&mut self, links: &[Link<One>], acting: Option<&ActingTransposed>) -> bool {
        let solvable = eliminate_links(self, links, acting);
        substitute_links(self, links);
        solvable
    }

    /// `μ_i`, shape `n`.
    pub(crate) fn write(&self, links: &[Link<One>], i: usize, mu: &mut [f64]) {
        write_links(self, links, i, mu);
    }

    /// `v ← P(q_l) m`, shape `n`, of rates along unknowns, as [`super::pull_back`] has them.
    pub(crate) fn push_forward(&mut self, links: &[Link<One>], l: usize, m: &[f64], v: &mut [f64]) {
        push_links(self, links, l, m);
        self.write(links, l, v);
    }

    /// The twist of `μ_i` of a link.
    pub(crate) fn twist(&self, link: usize, i: usize) -> Screw<HeldVector> {
        self.stands[link * (self.s + 1) + i].twist
    }

    /// `μ_i` along an unknown.
    pub(crate) fn rate(&self, unknown: usize, i: usize) -> f64 {
        self.m[unknown * self.s + i]
    }
}

sweep! {
    stand_links = sweep_stand(at: &'a mut PointTree, links: &'a [Link<One>], l: usize, q: &'a [f64]) -> ()
}

#[inline(always)]
fn sweep_stand<W: Width>(
    s: OneTree<W>,
    at: &mut PointTree,
    links: &[Link<One>],
    l: usize,
    q: &[f64],
) {
    let points = at.s + 1;
    for (k, link) in links.iter().enumerate() {
        let (own, parent) = (LinkPlace::of(s, q, link.frame), LinkPlace::of_parent(s, link, q));
        let mut lever = parent.d.mul(s.constant(&link.lever));
        if !link.closes_gap {
            lever = lever + own.gap(s, link, &parent);
        }
        let to = &mut at.stands[k * points + l];
        to.d = own.d.held();
        to.arm = own.d.mul(s.constant(&link.anchor)).held();
        to.lever = lever.held();
        to.bent = Columns::zero(s).held();
        for (c, column) in link.motion.columns().iter().enumerate() {
            let axis = match column.axis {
                Axis::Parent(i) => parent.d.mul(s.constant(&link.axes[i])),
                Axis::Child(i) => own.d.mul(s.constant(&link.axes_child[i])),
            };
            at.axes[(link.unknown + c) * points + l] = axis.held();
        }
    }
}

sweep! {
    bend_links = sweep_bend(
        at: &'a mut PointTree, links: &'a [Link<One>], l: usize, h: f64, w: &'a [f64]
    ) -> ()
}

/// `x yᵀ − (x·y) I`.
#[inline(always)]
fn bending<V: Vector<Number = f64>>(s: impl Space<Vector = V>, x: V, y: V) -> Columns<V> {
    let components = y.components();
    let outer = Columns(three!(j => x.scaled(components[j])));
    outer.minus(&Columns::multiple(s, x.dot(y)))
}

#[inline(always)]
fn sweep_bend<W: Width>(
    s: OneTree<W>,
    at: &mut PointTree,
    links: &[Link<One>],
    l: usize,
    h: f64,
    w: &[f64],
) {
    let points = at.s + 1;
    for (k, link) in links.iter().enumerate() {
        let to = &mut at.stands[k * points + l];
        let w = s.read_frame(w, link.frame).map(|w| w * h);
        let (d, mut bent) = (to.d.take(s), Columns::zero(s));
        for i in 0..3 {
            let a = w[i + 1] - w[0] * link.anchor[i];
            bent = bent.plus(&bending(s, a, d.0[i]));
        }
        to.bent = bent.held();
        to.wrench = balance(&d, s.take(&to.arm), w).held();
    }
    for (k, link) in links.iter().enumerate().rev() {
        let own = at.stands[k * points + l];
        let (F, lever) = (own.wrench.take(s), s.take(&own.lever));
        let Some(parent) = link.parent else { continue };
        let to = &mut at.stands[parent * points + l];
        to.wrench = to.wrench.take(s).plus(F.at_start_of(lever)).held();
        to.bent = to.bent.take(s).plus(&bending(s, F.linear, lever)).held();
    }
}

sweep! {
    load_links = sweep_load(
        at: &'a mut PointTree, links: &'a [Link<One>], l: usize, b: &'a [f64], scale: f64,
        more: &'a [f64]
    ) -> ()
}

#[inline(always)]
fn sweep_load<W: Width>(
    s: OneTree<W>,
    at: &mut PointTree,
    links: &[Link<One>],
    l: usize,
    b: &[f64],
    scale: f64,
    more: &[f64],
) {
    let rate = -at.K[(at.s, l)];
    for (k, link) in links.iter().enumerate() {
        let stand = &at.stands[k * (at.s + 1) + l];
        let mut c = momenta(s, link, s.read_frame(b, link.frame), rate);
        if !more.is_empty() {
            let more = s.read_frame(more, link.frame);
            for i in 0..4 {
                c[i] = c[i] - more[i] * scale;
            }
        }
        at.loads[k * at.s + l - 1] = balance(&stand.d.take(s), s.take(&stand.arm), c).held();
    }
}

/// A column of a joint: what a unit does, along which vector, and in what that is fixed.
#[inline(always)]
fn column<W: Width>(
    s: OneTree<W>,
    axes: &[HeldVector],
    link: &Link<One>,
    c: usize,
    l: usize,
    points: usize,
) -> (Act, Xyz<W>, Option<Axis>) {
    match link.motion {
        Motion::Spherical | Motion::Free => {
            let act = if c + 3 < link.motion.dof() { Act::Slide } else { Act::Turn };
            let mut unit = [0.0; 3];
            unit[c % 3] = 1.0;
            (act, s.vector(unit), None)
        }
        motion => {
            let own = motion.columns()[c];
            (own.act, s.take(&axes[(link.unknown + c) * points + l]), Some(own.axis))
        }
    }
}

/// `S_j`.
#[inline(always)]
fn motion<W: Width>(s: OneTree<W>, link: &Link<One>, act: Act, axis: Xyz<W>) -> Screw<Xyz<W>> {
    match act {
        Act::Turn => Screw { linear: s.zero(), angular: axis },
        Act::Slide => Screw { linear: axis, angular: s.zero() },
        Act::Screw => Screw { linear: axis.scaled(link.pitch), angular: axis },
    }
}

/// `A y` of a twist.
#[inline(always)]
fn image<V: Vector>(A: &Spatial<V>, y: Screw<V>) -> Screw<V> {
    Screw {
        linear: A.ll.mul(y.linear) + A.la.mul(y.angular),
        angular: A.al.mul(y.linear) + A.aa.mul(y.angular),
    }
}

/// `tᵀ A`.
#[inline(always)]
fn image_transposed<V: Vector>(A: &Spatial<V>, t: Screw<V>) -> Screw<V> {
    Screw {
        linear: A.ll.tr_mul(t.linear) + A.al.tr_mul(t.angular),
        angular: A.la.tr_mul(t.linear) + A.aa.tr_mul(t.angular),
    }
}

#[inline(always)]
fn read<W: Width>(s: OneTree<W>, x: &[f64], first: usize) -> Screw<Xyz<W>> {
    Screw { linear: s.read(x, first), angular: s.read(x, first + 3) }
}

#[inline(always)]
fn write<W: Width>(s: OneTree<W>, v: Screw<Xyz<W>>, x: &mut [f64], first: usize) {
    s.write(v.linear, x, first);
    s.write(v.angular, x, first + 3);
}

sweep! {
    eliminate_links = sweep_eliminate(
        at: &'a mut PointTree, links: &'a [Link<One>], acting: Option<&'a ActingTransposed>
    ) -> bool
}

#[inline(always)]
fn sweep_eliminate<W: Width>(
    s: OneTree<W>,
    at: &mut PointTree,
    links: &[Link<One>],
    acting: Option<&ActingTransposed>,
) -> bool {
    let (n, points) = (at.s, at.s + 1);
    let mut solvable = true;
    for (k, link) in links.iter().enumerate().rev() {
        let follows = links.get(k + 1).is_some_and(|next| next.follows_parent);
        own_blocks(s, at, k, link, follows, acting);
        let d = link.motion.dof();
        let (size, row) = (unknowns(link, n), length(link, n));
        let [ends, pushed] = &mut at.columns;
        let [A, passed] = &mut at.own;
        let [p, passed_p] = &mut at.carried;
        let coupled = acting.filter(|acting| !acting.couplings.is_empty());
        let stands = &at.stands[k * points..(k + 1) * points];
        let rows = &mut at.rows[at.first[k]..at.first[k] + size * row];
        for c in 0..d {
            for i in 0..n {
                let (act, axis, fixed) = column(s, &at.axes, link, c, i, points);
                let S = motion(s, link, act, axis);
                for j in 0..n {
                    let mut end = image(&A[j * n + i].take(s), S);
                    let mut turned = s.zero();
                    if j + 1 == i && fixed.is_some() {
                        turned = axis.cross(by_axis(s, link, act, stands[i].wrench.take(s)));
                        if let Some(Axis::Child(_)) = fixed {
                            end.angular = end.angular + turned;
                        }
                    }
                    let mut U = end.at_start_of(s.take(&stands[j + 1].lever));
                    if let Some(Axis::Parent(_)) = fixed {
                        U.angular = U.angular + turned;
                    }
                    if let Some(acting) = coupled {
                        let C = acting.couplings[j * n + i].links[k].of_parent.take(s);
                        U = U.plus(image(&C, S));
                    }
                    ends[(c * n + i) * n + j] = end.held();
                    pushed[(c * n + i) * n + j] = U.held();
                }
            }
        }
        for c in 0..d {
            for j in 0..n {
                let (act, axis, _) = column(s, &at.axes, link, c, j + 1, points);
                let S = motion(s, link, act, axis);
                let own = &mut rows[(c * n + j) * row..(c * n + j + 1) * row];
                for (column, end) in own[..size].iter_mut().zip(ends[j..].iter().step_by(n)) {
                    *column = S.dot(end.take(s));
                }
                for i in 0..n {
                    let SA = image_transposed(&A[j * n + i].take(s), S);
                    let mut V = SA.at_start_of(s.take(&stands[i].lever));
                    if j + 1 == i && !link.closes_gap && act != Act::Turn {
                        let slide = S.linear.cross(s.take(&stands[i].wrench.linear));
                        V.angular = V.angular + slide;
                    }
                    if let Some(acting) = coupled {
                        let B = acting.couplings[j * n + i].links[k].of_link.take(s);
                        V = V.plus(image_transposed(&B, S));
                    }
                    write(s, V, own, size + 6 * i);
                }
                own[row - 1] = S.dot(p[j].take(s));
            }
        }
        solvable &= reduce(rows, row, size);
        let Some(parent) = link.parent else { continue };
        for j in 0..n {
            let next = s.take(&stands[j + 1].lever);
            let mut load = p[j].take(s).at_start_of(next);
            for r in 0..size {
                let U = pushed[r * n + j].take(s);
                load = load.plus(U.times(-rows[r * row + row - 1]));
            }
            passed_p[j] = load.held();
            for i in 0..n {
                let lever = s.take(&stands[i].lever);
                let mut out = A[j * n + i].take(s).between(next, lever);
                if let Some(acting) = coupled {
                    let coupling = &acting.couplings[j * n + i].links[k];
                    let zero = s.zero();
                    out = out.plus(&coupling.of_link.take(s).between(next, zero));
                    out = out.plus(&coupling.of_parent.take(s).between(zero, lever));
                }
                for r in 0..size {
                    let V = read(s, rows, r * row + size + 6 * i);
                    out = out.minus_outer(pushed[r * n + j].take(s), 1.0, V);
                }
                passed[j * n + i] = out.held();
            }
        }
        if let (false, Some(slot)) = (link.follows_parent, links[parent].slot) {
            let sums = &mut at.sums[slot * n * n..(slot + 1) * n * n];
            let loads = &mut at.sum_loads[slot * n..(slot + 1) * n];
            if link.writes_first {
                sums.copy_from_slice(passed);
                loads.copy_from_slice(passed_p);
            } else {
                for (sum, own) in sums.iter_mut().zip(&*passed) {
                    *sum = sum.take(s).plus(&own.take(s)).held();
                }
                for (sum, own) in loads.iter_mut().zip(&*passed_p) {
                    *sum = sum.take(s).plus(own.take(s)).held();
                }
            }
        }
    }
    solvable
}

/// `Â` and `p` of a link with what its children pass; `follows`: the next link hangs on it.
#[inline(always)]
fn own_blocks<W: Width>(
    s: OneTree<W>,
    at: &mut PointTree,
    k: usize,
    link: &Link<One>,
    follows: bool,
    acting: Option<&ActingTransposed>,
) {
    let (n, points) = (at.s, at.s + 1);
    let [A, carried] = &mut at.own; // the latter by the next link
    let [p, carried_p] = &mut at.carried;
    let stands = &at.stands[k * points..(k + 1) * points];
    let (first, euler) =
        (s.constant(&link.moment), Columns(three!(j => s.constant(&link.euler[j]))));
    for i in 0..n {
        let d = stands[i].d.take(s);
        let (moment, turned) = (d.mul(first), d.times(&euler));
        for j in 0..n {
            let to = stands[j + 1].d.take(s);
            let K = at.K[(i, j + 1)];
            let row_moment = to.mul(first);
            let E = turned.times_transposed(&to); // Σ x_i x_jᵀ
            let mut own = Spatial {
                ll: Columns::multiple(s, K * link.mass[0][0]),
                la: Columns::skew(moment * -K),
                al: Columns::skew(row_moment * K),
                aa: E.trace_less().scaled(K),
            };
            if j + 1 == i {
                own.aa = own.aa.plus(&stands[i].bent.take(s));
            }
            if let Some(acting) = acting {
                own = own.plus(&acting.blocks[j * n + i][k].take(s));
            }
            if follows {
                own = own.plus(&carried[j * n + i].take(s));
            }
            if let Some(slot) = link.slot {
                own = own.plus(&at.sums[(slot * n + j) * n + i].take(s));
            }
            A[j * n + i] = own.held();
        }
    }
    for j in 0..n {
        let mut load = at.loads[k * n + j].take(s);
        if follows {
            load = load.plus(carried_p[j].take(s));
        }
        if let Some(slot) = link.slot {
            load = load.plus(at.sum_loads[slot * n + j].take(s));
        }
        p[j] = load.held();
    }
}

/// `[D, V, …] ← [I, D⁻¹ V, …]` by rows, with pivots in columns; whether all pivots are numbers
/// other than zero.
#[inline(always)]
fn reduce(rows: &mut [f64], row: usize, size: usize) -> bool {
    let mut solvable = true;
    for c in 0..size {
        let mut best = c;
        for r in c + 1..size {
            if rows[r * row + c].abs() > rows[best * row + c].abs() {
                best = r;
            }
        }
        if best != c {
            let (upper, lower) = rows.split_at_mut(best * row);
            upper[c * row..(c + 1) * row].swap_with_slice(&mut lower[..row]);
        }
        let inverse = 1.0 / rows[c * row + c];
        solvable &= inverse.is_finite();
        let (upper, rest) = rows.split_at_mut(c * row);
        let (pivot, lower) = rest.split_at_mut(row);
        pivot[c..].iter_mut().for_each(|x| *x *= inverse);
        for other in upper.chunks_exact_mut(row).chain(lower.chunks_exact_mut(row)) {
            let factor = other[c];
            if factor != 0.0 {
                other[c..].iter_mut().zip(&pivot[c..]).for_each(|(x, p)| *x -= factor * p);
            }
        }
    }
    solvable
}

sweep! {
    substitute_links = sweep_substitute(at: &'a mut PointTree, links: &'a [Link<One>]) -> ()
}

#[inline(always)]
fn sweep_substitute<W: Width>(s: OneTree<W>, at: &mut PointTree, links: &[Link<One>]) {
    let (n, points) = (at.s, at.s + 1);
    for (k, link) in links.iter().enumerate() {
        let (size, row) = (unknowns(link, n), length(link, n));
        let rows = &at.rows[at.first[k]..at.first[k] + size * row];
        let m = &mut at.m[link.unknown * n..link.unknown * n + size];
        for (m, row) in m.iter_mut().zip(rows.chunks_exact(row)) {
            *m = -row[row.len() - 1];
        }
        if let Some(parent) = link.parent {
            for i in 0..n {
                let y = at.stands[parent * points + i].twist.take(s);
                for (m, row) in m.iter_mut().zip(rows.chunks_exact(row)) {
                    *m -= read(s, row, size + 6 * i).dot(y);
                }
                let lever = s.take(&at.stands[k * points + i].lever);
                at.stands[k * points + i].twist = y.at_end_of(lever).held();
            }
        } else {
            for i in 0..n {
                at.stands[k * points + i].twist = Screw::zero(s).held();
            }
        }
        for (c, own) in m.chunks_exact(n).enumerate() {
            for (i, m) in own.iter().enumerate() {
                let (act, axis, _) = column(s, &at.axes, link, c, i, points);
                let twist = &mut at.stands[k * points + i].twist;
                *twist = twist.take(s).plus(motion(s, link, act, axis).times(*m)).held();
            }
        }
    }
}

sweep! {
    push_links = sweep_push(
        at: &'a mut PointTree, links: &'a [Link<One>], l: usize, m: &'a [f64]
    ) -> ()
}

#[inline(always)]
fn sweep_push<W: Width>(
    s: OneTree<W>,
    at: &mut PointTree,
    links: &[Link<One>],
    l: usize,
    m: &[f64],
) {
    let points = at.s + 1;
    for (k, link) in links.iter().enumerate() {
        let mut twist = match link.parent {
            Some(parent) => {
                let lever = s.take(&at.stands[k * points + l].lever);
                at.stands[parent * points + l].twist.take(s).at_end_of(lever)
            }
            None => Screw::zero(s),
        };
        if let Motion::Spherical = link.motion {
            twist.angular = s.zero(); // its unknowns are the spin in space, as in `pull_back`
        }
        for c in 0..link.motion.dof() {
            let (act, axis, _) = column(s, &at.axes, link, c, l, points);
            twist = twist.plus(motion(s, link, act, axis).times(m[link.unknown + c]));
        }
        at.stands[k * points + l].twist = twist.held();
    }
}

sweep! {
    write_links = sweep_write(
        at: &'a PointTree, links: &'a [Link<One>], i: usize, mu: &'a mut [f64]
    ) -> ()
}

#[inline(always)]
fn sweep_write<W: Width>(
    s: OneTree<W>,
    at: &PointTree,
    links: &[Link<One>],
    i: usize,
    mu: &mut [f64],
) {
    for (k, link) in links.iter().enumerate() {
        let stand = &at.stands[k * (at.s + 1) + i];
        let (twist, [x, y, z]) = (stand.twist.take(s), stand.d.take(s).0);
        let spin = twist.angular;
        let center = twist.linear - spin.cross(s.take(&stand.arm));
        s.write_frame([center, spin.cross(x), spin.cross(y), spin.cross(z)], mu, link.frame);
    }
}
