//! The sweeps of a residual of [`super::TreeStep`], written for the lanes of wide registers.

use super::columns::{Act, Axis, ColumnWork, Motion};
use super::link::{Constants, Work};
use super::place::{Place, balance, frame};
use crate::geometry::lane_matrices::{Columns, Pair};
use crate::geometry::lanes::{Lanes, Width, sweep, three};
use vi_core::newton::{BlockKind, Fault};
use vi_rigid::rotation;

sweep! {
    /// Everything at `q_n`; `at`: `q_n`, `p̄_n`, impulse of constant forces in half a step.
    open = sweep_open(
        links: &'a [Constants], works: &'a mut [Work], columns: &'a mut [ColumnWork],
        at: [&'a [f64]; 3]
    ) -> ()
}

#[inline(always)]
fn sweep_open<W: Width>(
    w: W,
    links: &[Constants],
    works: &mut [Work],
    columns: &mut [ColumnWork],
    [q, p, impulse]: [&[f64]; 3],
) {
    for (link, work) in links.iter().zip(works) {
        let (own, at) = (Place::of(w, q, link.frame), Place::of_parent(w, link, q));
        let (d, parent) = (own.d, at.d);
        let anchor = d.mul(Lanes::new(w, link.anchor));
        let mut lever = parent.mul(Lanes::new(w, link.lever));
        if !link.closes_gap {
            lever += own.gap(link, &at); // the slide
        }
        let euler = Columns(three!(j => Lanes::new(w, link.euler[j])));
        work.column.axis = parent.mul(Lanes::new(w, link.axes[2])).held();
        work.lever = lever.held();
        work.moment = d.mul(Lanes::new(w, link.moment)).held();
        work.euler = d.times(&euler).times_transposed(&d).held(); // E = D E_b Dᵀ
        let (p, impulse) = (frame(p, link.frame), frame(impulse, link.frame));
        let (p, impulse) = (Lanes::vectors(w, p), Lanes::vectors(w, impulse));
        let known = [p[0] + impulse[0], p[1] + impulse[1], p[2] + impulse[2], p[3] + impulse[3]];
        work.start = balance(&d, anchor, known).held();
    }
    if !columns.is_empty() {
        open_columns(w, links, columns, q);
    }
}

/// The axes of joints of several columns.
#[inline(always)]
fn open_columns<W: Width>(w: W, links: &[Constants], columns: &mut [ColumnWork], q: &[f64]) {
    for link in links {
        let Motion::Several(several) = link.motion else {
            continue;
        };
        let (own, parent) = (Place::of(w, q, link.frame), Place::of_parent(w, link, q));
        for (column, work) in several.iter().zip(&mut columns[link.unknown..]) {
            let axis = match column.axis {
                Axis::Parent(i) => parent.d.mul(Lanes::new(w, link.axes[i])),
                Axis::Child(i) => own.d.mul(Lanes::new(w, link.axes_child[i])),
            };
            work.axis = axis.held();
        }
    }
}

/// The angle of a column and what a rotation by it needs.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Turn {
    angle: f64,
    sine: f64,
    versine: f64, // 1 − cos
}

impl Turn {
    #[inline(always)]
    fn by(angle: f64) -> Self {
        let square = angle * angle;
        let [sinc, gap] = rotation::coefficients(square);
        Self { angle, sine: angle * sinc, versine: square * gap }
    }
}

sweep! {
    /// Root → leaf: the motion of every link for the increments `u`, and, where the step `h` is
    /// given, the balance of momenta of each link alone.
    advance = sweep_advance(
        links: &'a [Constants], works: &'a mut [Work],
        joints: (&'a mut [ColumnWork], &'a mut [Turn]), u: &'a [f64], h: Option<f64>
    ) -> Result<(), Fault>
}

#[inline(always)]
fn sweep_advance<W: Width>(
    w: W,
    links: &[Constants],
    works: &mut [Work],
    (columns, turns): (&mut [ColumnWork], &mut [Turn]),
    u: &[f64],
    h: Option<f64>,
) -> Result<(), Fault> {
    // apart: none waits for another
    turns.iter_mut().zip(u).for_each(|(turn, u)| *turn = Turn::by(*u));
    let rate = h.map(f64::recip);
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
        let lever = Lanes::take(w, &work.lever);
        let mut moved = turn.mul(lever); // (A¹ − 1) ℓ
        match link.motion {
            Motion::Fixed => {}
            Motion::Along(act) => {
                let by = (&turns[link.unknown], link.unknown);
                move_along((link, act), by, &mut work.column, &mut turn, &mut moved)?;
            }
            Motion::Several(several) => {
                for (unknown, column) in (link.unknown..).zip(several) {
                    let (by, work) = ((&turns[unknown], unknown), &mut columns[unknown]);
                    move_along((link, column.act), by, work, &mut turn, &mut moved)?;
                }
            }
            Motion::Spherical => turn = rotation_by(w, u, link.unknown)?,
            Motion::Free => {
                turn = rotation_by(w, u, link.unknown + 3)?;
                moved = increment(w, u, link.unknown)?;
            }
        }
        shift += moved;
        work.lever_next = (lever + moved).held();
        (work.turn, work.shift) = (turn.held(), shift.held());
        let Some(rate) = rate else { continue };
        let (moment, start) = (Lanes::take(w, &work.moment), work.start.take(w));
        let momentum = shift * link.mass[0][0] + turn.mul(moment); // m Δx + (A − 1) s
        let spin = turn.times(&work.euler.take(w)).moment() + moment.cross(shift);
        let linear = start.linear - momentum * rate;
        work.wrench = Pair { linear, angular: start.angular - spin * rate }.held();
    }
    Ok(())
}

/// Moves by the increment `u` of one column: `turn` is `A − 1`, `moved` the shift of the reference
/// point against the parent's.
#[inline(always)]
fn move_along<W: Width>(
    (link, act): (&Constants, Act),
    (by, unknown): (&Turn, usize),
    work: &mut ColumnWork,
    turn: &mut Columns<Lanes<W>>,
    moved: &mut Lanes<W>,
) -> Result<(), Fault> {
    let u = by.angle;
    if !u.is_finite() {
        return Err(Fault::NotFinite);
    }
    let axis = Lanes::take(moved.width(), &work.axis);
    let axis_next = axis + turn.mul(axis); // A n
    work.axis_next = axis_next.held();
    match act {
        Act::Slide => *moved += axis_next * u, // A¹ u n
        Act::Screw => *moved += axis_next * (link.pitch * u),
        Act::Turn => {}
    }
    if act != Act::Slide {
        if u.abs() > rotation::MAX_ROTATION {
            return Err(Fault::OutsideChart { kind: BlockKind::Rotation, unknown, size: u });
        }
        let relative = Columns::turn_about(axis, by.sine, by.versine); // exp(ϑ n̂) − 1
        *turn = turn.plus(&relative).plus(&turn.times(&relative)); // A B − 1
    }
    Ok(())
}

/// Three finite increments.
#[inline(always)]
fn increment<W: Width>(w: W, u: &[f64], first: usize) -> Result<Lanes<W>, Fault> {
    let own = &u[first..first + 3];
    if own.iter().all(|u| u.is_finite()) { Ok(Lanes::of(w, own)) } else { Err(Fault::NotFinite) }
}

/// `exp(θ̂) − 1` of the rotation vector that begins there.
#[inline(always)]
fn rotation_by<W: Width>(w: W, u: &[f64], unknown: usize) -> Result<Columns<Lanes<W>>, Fault> {
    let theta = increment(w, u, unknown)?;
    let square = theta.dot(theta);
    let size = square.sqrt();
    if size > rotation::MAX_ROTATION {
        return Err(Fault::OutsideChart { kind: BlockKind::Rotation, unknown, size });
    }
    let [sinc, gap] = rotation::coefficients(square);
    Ok(Columns::turn_about(theta, sinc, gap))
}

sweep! {
    /// Leaf → root: `r ← P(q_n)ᵀ` of the balances of all links.
    pull_back = sweep_pull_back(
        links: &'a [Constants], works: &'a mut [Work], columns: &'a [ColumnWork], r: &'a mut [f64]
    ) -> ()
}

#[inline(always)]
fn sweep_pull_back<W: Width>(
    w: W,
    links: &[Constants],
    works: &mut [Work],
    columns: &[ColumnWork],
    r: &mut [f64],
) {
    let mut carried = Pair::zero(w); // by the link before
    for (k, link) in links.iter().enumerate().rev() {
        let work = &works[k];
        let mut wrench = work.wrench.take(w).plus(carried);
        carried = Pair::zero(w);
        match link.motion {
            Motion::Fixed => {}
            Motion::Along(act) => {
                r[link.unknown] = component((link, act), &work.column, wrench);
            }
            Motion::Several(several) => {
                for (unknown, column) in (link.unknown..).zip(several) {
                    r[unknown] = component((link, column.act), &columns[unknown], wrench);
                }
            }
            Motion::Spherical => {
                wrench.angular.write(&mut r[link.unknown..]);
                wrench.angular = Lanes::zero(w); // no torque passes
            }
            Motion::Free => {
                wrench.linear.write(&mut r[link.unknown..]);
                wrench.angular.write(&mut r[link.unknown + 3..]);
            }
        }
        let Some(parent) = link.parent else { continue };
        let transmitted = wrench.at_start_of(Lanes::take(w, &work.lever));
        if link.follows_parent {
            carried = transmitted;
        } else {
            works[parent].wrench = works[parent].wrench.take(w).plus(transmitted).held();
        }
    }
}

/// `S_jᵀ b`.
#[inline(always)]
pub(super) fn component<W: Width>(
    (link, act): (&Constants, Act),
    work: &ColumnWork,
    b: Pair<Lanes<W>>,
) -> f64 {
    let axis = Lanes::take(b.linear.width(), &work.axis);
    match act {
        Act::Turn => axis.dot(b.angular),
        Act::Slide => axis.dot(b.linear),
        Act::Screw => axis.dot(b.angular) + link.pitch * axis.dot(b.linear),
    }
}
