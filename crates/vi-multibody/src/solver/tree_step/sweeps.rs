//! The sweeps of an iteration of [`super::TreeStep`], written for the lanes of wide registers.
#![allow(non_snake_case)] // A, D, E, K, S

use super::link::{Constants, Motion, Sums, Work};
use crate::geometry::lane_matrices::{Columns, Pair, Spatial};
use crate::geometry::lanes::{Held, Lanes, Width, sweep, three};
use vi_core::newton::{BlockKind, Fault};
use vi_rigid::rotation;

/// The coordinates of a frame.
#[inline(always)]
pub(super) fn frame(q: &[f64], first: usize) -> &[f64; 12] {
    q[first..first + 12].try_into().expect("twelve coordinates")
}

/// The directors of the parent of a link; of the ground: the inertial base.
#[inline(always)]
pub(super) fn carrier<W: Width>(w: W, link: &Constants, q: &[f64]) -> Columns<Lanes<W>> {
    match link.parent {
        Some(_) => Columns::directors(w, frame(q, link.parent_frame)),
        None => Columns::multiple(w, 1.0),
    }
}

/// The centre of the parent of a link.
#[inline(always)]
pub(super) fn carrier_center<W: Width>(w: W, link: &Constants, q: &[f64]) -> Lanes<W> {
    match link.parent {
        Some(_) => Lanes::of(w, frame(q, link.parent_frame)),
        None => Lanes::zero(w),
    }
}

sweep! {
    /// Everything at `q_n`; `at`: `q_n`, `p̄_n`, impulse of constant forces in half a step.
    open = sweep_open(links: &'a [Constants], works: &'a mut [Work], at: [&'a [f64]; 3]) -> ()
}

#[inline(always)]
fn sweep_open<W: Width>(
    w: W,
    links: &[Constants],
    works: &mut [Work],
    [q, p, impulse]: [&[f64]; 3],
) {
    for (link, work) in links.iter().zip(works) {
        let (own, parent) = (frame(q, link.frame), carrier(w, link, q));
        let d = Columns::directors(w, own);
        let anchor = d.mul(Lanes::new(w, link.anchor));
        let mut lever = parent.mul(Lanes::new(w, link.lever));
        if link.motion == Motion::Prismatic {
            let start = carrier_center(w, link, q) + parent.mul(Lanes::new(w, link.anchor_parent));
            lever += (Lanes::of(w, own) + anchor) - start; // the slide
        }
        let euler = Columns(three!(j => Lanes::new(w, link.euler[j])));
        work.axis = parent.mul(Lanes::new(w, link.axes[2])).held();
        work.lever = lever.held();
        work.moment = d.mul(Lanes::new(w, link.moment)).held();
        work.euler = d.times(&euler).times_transposed(&d).held(); // E = D E_b Dᵀ
        let (p, impulse) = (frame(p, link.frame), frame(impulse, link.frame));
        let known =
            three!(i => Lanes::of(w, &p[3 + 3 * i..]) + Lanes::of(w, &impulse[3 + 3 * i..]));
        let force = Lanes::of(w, p) + Lanes::of(w, impulse);
        let [spin, second, third] = three!(i => d.0[i].cross(known[i]));
        let spin = (spin + second) + third;
        work.start = Pair { linear: force, angular: spin - anchor.cross(force) }.held();
    }
}

sweep! {
    /// Root → leaf: the motion of every link for the increments `u` of a step `h`, and the balance of momenta of each
    /// link alone.
    advance = sweep_advance(
        links: &'a [Constants], works: &'a mut [Work], u: &'a [f64], h: f64
    ) -> Result<(), Fault>
}

#[inline(always)]
fn sweep_advance<W: Width>(
    w: W,
    links: &[Constants],
    works: &mut [Work],
    u: &[f64],
    h: f64,
) -> Result<(), Fault> {
    let rate = 1.0 / h;
    let (mut turn, mut shift) = (Columns::zero(w), Lanes::zero(w)); // of the link before
    for (k, link) in links.iter().enumerate() {
        match link.parent {
            None => (turn, shift) = (Columns::zero(w), Lanes::zero(w)),
            Some(_) if link.follows_parent => {}
            Some(parent) => {
                turn = works[parent].turn.take(w);
                shift = Lanes::take(w, &works[parent].shift);
            }
        }
        let work = &mut works[k];
        let (axis, lever) = (Lanes::take(w, &work.axis), Lanes::take(w, &work.lever));
        let mut moved = turn.mul(lever); // (A¹ − 1) ℓ
        let axis_next = axis + turn.mul(axis); // A¹ n
        match link.motion {
            Motion::Revolute => {
                let relative = rotation_about(axis, u[link.unknown], link.unknown)?;
                turn = turn.plus(&relative).plus(&turn.times(&relative)); // A¹B − 1
            }
            Motion::Prismatic => {
                let u = u[link.unknown];
                if !u.is_finite() {
                    return Err(Fault::NotFinite);
                }
                moved += axis_next * u; // A¹ u n
            }
            Motion::Fixed => {}
        }
        shift += moved;
        work.axis_next = axis_next.held();
        work.lever_next = (lever + moved).held();
        (work.turn, work.shift) = (turn.held(), shift.held());
        let (moment, start) = (Lanes::take(w, &work.moment), work.start.take(w));
        let momentum = shift * link.mass[0][0] + turn.mul(moment); // m Δx + (A − 1) s
        let spin = turn.times(&work.euler.take(w)).moment() + moment.cross(shift);
        let linear = start.linear - momentum * rate;
        work.wrench = Pair { linear, angular: start.angular - spin * rate }.held();
    }
    Ok(())
}

/// `exp(ϑ n̂) − 1`.
#[inline(always)]
fn rotation_about<W: Width>(
    n: Lanes<W>,
    angle: f64,
    unknown: usize,
) -> Result<Columns<Lanes<W>>, Fault> {
    if !angle.is_finite() {
        return Err(Fault::NotFinite);
    }
    if angle.abs() > rotation::MAX_ROTATION {
        return Err(Fault::OutsideChart { kind: BlockKind::Rotation, unknown, size: angle });
    }
    let square = angle * angle;
    let (sinc, gap) = rotation::coefficients(square);
    Ok(Columns::turn_about(n, angle * sinc, square * gap))
}

sweep! {
    /// Leaf → root: `r ← P(q_n)ᵀ` of the balances of all links.
    pull_back = sweep_pull_back(
        links: &'a [Constants], works: &'a mut [Work], r: &'a mut [f64]
    ) -> ()
}

#[inline(always)]
fn sweep_pull_back<W: Width>(w: W, links: &[Constants], works: &mut [Work], r: &mut [f64]) {
    let mut carried = Pair::zero(w); // by the link before
    for (k, link) in links.iter().enumerate().rev() {
        let work = &works[k];
        let wrench = work.wrench.take(w).plus(carried);
        let axis = Lanes::take(w, &work.axis);
        match link.motion {
            Motion::Revolute => r[link.unknown] = axis.dot(wrench.angular),
            Motion::Prismatic => r[link.unknown] = axis.dot(wrench.linear),
            Motion::Fixed => {}
        }
        carried = Pair::zero(w);
        let Some(parent) = link.parent else { continue };
        let transmitted = wrench.at_start_of(Lanes::take(w, &work.lever));
        if link.follows_parent {
            carried = transmitted;
        } else {
            works[parent].wrench = works[parent].wrench.take(w).plus(transmitted).held();
        }
    }
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
    /// Leaf → root: factorizes, and `x ← u_k`; on entry `x` is `−h` times the right-hand side. `more`: for the sums over
    /// children, and what is added to the blocks.
    eliminate = sweep_eliminate(
        links: &'a [Constants], works: &'a mut [Work], more: (&'a mut [Sums], &'a [Spatial<Held>]),
        x: &'a mut [f64]
    ) -> Result<(), Fault>
}

#[inline(always)]
fn sweep_eliminate<W: Width>(
    w: W,
    links: &[Constants],
    works: &mut [Work],
    (sums, added): (&mut [Sums], &[Spatial<Held>]),
    x: &mut [f64],
) -> Result<(), Fault> {
    let mut last: Option<(Spatial<Lanes<W>>, Pair<Lanes<W>>)> = None; // of the child just after
    for (k, link) in links.iter().enumerate().rev() {
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
        if link.motion != Motion::Fixed {
            let (axis, next) = (Lanes::take(w, &work.axis), Lanes::take(w, &work.axis_next));
            let (AS, SA, D) = columns(link.motion, &A, axis, next);
            let inverse = 1.0 / D;
            if !inverse.is_finite() {
                return Err(Fault::SingularTangent);
            }
            let own = if link.motion == Motion::Revolute { p.angular } else { p.linear };
            x[link.unknown] -= axis.dot(own);
            (work.SA, work.inverse) = (SA.held(), inverse);
            p = p.plus_scaled(inverse * x[link.unknown], AS);
            A = A.minus_outer(AS, inverse, SA); // Â − Â S' D⁻¹ Sᵀ Â
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
    Ok(())
}

/// `Ã S'`, `Sᵀ Ã` and `D = Sᵀ Ã S'` with `S = (0, n)` or `(n, 0)`.
#[inline(always)]
fn columns<W: Width>(
    motion: Motion,
    A: &Spatial<Lanes<W>>,
    axis: Lanes<W>,
    next: Lanes<W>,
) -> (Pair<Lanes<W>>, Pair<Lanes<W>>, f64) {
    if motion == Motion::Revolute {
        let AS = Pair { linear: A.la.mul(next), angular: A.aa.mul(next) };
        let SA = Pair { linear: A.al.tr_mul(axis), angular: A.aa.tr_mul(axis) };
        return (AS, SA, axis.dot(AS.angular));
    }
    let AS = Pair { linear: A.ll.mul(next), angular: A.al.mul(next) };
    let SA = Pair { linear: A.ll.tr_mul(axis), angular: A.la.tr_mul(axis) };
    (AS, SA, axis.dot(AS.linear))
}

sweep! {
    /// Root → leaf: `x ← δτ` from `u_k`.
    substitute = sweep_substitute(
        links: &'a [Constants], works: &'a mut [Work], x: &'a mut [f64]
    ) -> ()
}

#[inline(always)]
fn sweep_substitute<W: Width>(w: W, links: &[Constants], works: &mut [Work], x: &mut [f64]) {
    let mut twist = Pair::zero(w); // of the link before
    for (k, link) in links.iter().enumerate() {
        match link.parent {
            None => twist = Pair::zero(w),
            Some(_) if link.follows_parent => {}
            Some(parent) => twist = works[parent].twist.take(w),
        }
        let work = &mut works[k];
        twist = twist.at_end_of(Lanes::take(w, &work.lever_next)); // X' δt'
        if link.motion != Motion::Fixed {
            let rate = (x[link.unknown] - work.SA.take(w).dot(twist)) * work.inverse;
            x[link.unknown] = rate;
            let moved = Lanes::take(w, &work.axis_next) * rate;
            match link.motion {
                Motion::Prismatic => twist.linear += moved,
                _ => twist.angular += moved,
            }
        }
        work.twist = twist.held();
    }
}
