//! Root → leaf: the motion of every link, `q_{n+1} = F_d(u, q_n)`.

use super::columns::{Act, Motion};
use super::link::{ColumnWork, Link, Work};
use crate::geometry::matrix::{Columns, Screw};
use crate::geometry::space::{Number, Space, Vector};
use vi_core::lanes::Lanes;
use vi_core::newton::{BlockKind, Fault};
use vi_rigid::rotation::MAX_ROTATION;

/// The angle of a column and what a rotation by it needs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Turn<N> {
    angle: N,
    sine: N,
    versine: N, // 1 − cos
}

impl<N: Lanes> Turn<N> {
    #[inline(always)]
    pub(crate) fn by<S: Space>(s: S, angle: N) -> Self
    where
        S::Store: crate::geometry::space::Store<Number = N>,
    {
        let square = angle * angle;
        let [sinc, gap] = s.rotation(square);
        Self { angle, sine: angle * sinc, versine: square * gap }
    }
}

/// What is to be judged of the increments.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen<N> {
    /// Square of the largest rotation.
    pub(crate) rotation: N,
    /// Zero; not a number where an increment is not finite.
    pub(crate) finite: N,
}

/// Refuses a rotation of more than half a revolution among the increments `u(0), u(1), …` of a
/// joint whose first unknown is `first`.
pub(crate) fn check_rotations(
    motion: Motion,
    first: usize,
    u: impl Fn(usize) -> f64,
) -> Result<(), Fault> {
    let check = |k: usize, size: f64| match size.abs() > MAX_ROTATION {
        true => {
            let (kind, unknown) = (BlockKind::Rotation, first + k);
            Err(Fault::OutsideChart { kind, unknown, size })
        }
        false => Ok(()),
    };
    if let Some(k) = motion.rotation_vector() {
        return check(k, (k..k + 3).map(|k| u(k) * u(k)).sum::<f64>().sqrt());
    }
    (0..motion.dof()).filter(|&k| motion.is_angle(k)).try_for_each(|k| check(k, u(k)))
}

/// Root → leaf: the motion of every link for the increments `u`, and, where the step `h` is given,
/// the balance of momenta of each link alone.
#[inline(always)]
pub(crate) fn advance<S: Space>(
    s: S,
    links: &[Link<S::Store>],
    works: &mut [Work<S::Store>],
    (columns, turns): (&mut [ColumnWork<S::Store>], &mut [Turn<Number<S>>]),
    u: &[Number<S>],
    h: Option<f64>,
) -> Seen<Number<S>> {
    let mut seen = Seen { rotation: s.number(0.0), finite: s.number(0.0) };
    // apart: none waits for another
    for (turn, u) in turns.iter_mut().zip(u) {
        *turn = Turn::by(s, *u);
        seen.finite = seen.finite + *u * 0.0;
    }
    let rate = h.map(f64::recip);
    let (mut turn, mut shift) = (Columns::zero(s), s.zero()); // of the link before
    for (k, link) in links.iter().enumerate() {
        match link.parent {
            None => (turn, shift) = (Columns::zero(s), s.zero()),
            Some(_) if link.follows_parent => {}
            Some(parent) => {
                turn = works[parent].turn.take(s);
                shift = s.take(&works[parent].shift);
            }
        }
        let work = &mut works[k];
        let lever = s.take(&work.lever);
        let mut moved = turn.mul(lever); // (A¹ − 1) ℓ
        match link.motion {
            Motion::Fixed => {}
            Motion::Along(act) => {
                let (by, column) = (&turns[link.unknown], &mut work.column);
                move_along(s, (link, act), (by, column), (&mut turn, &mut moved), &mut seen);
            }
            Motion::Several(several) => {
                for (unknown, column) in (link.unknown..).zip(several) {
                    let own = (&turns[unknown], &mut columns[unknown]);
                    move_along(s, (link, column.act), own, (&mut turn, &mut moved), &mut seen);
                }
            }
            // (84)
            Motion::Spherical => turn = rotation_by(s, s.read(u, link.unknown), &mut seen),
            Motion::Free => {
                turn = rotation_by(s, s.read(u, link.unknown + 3), &mut seen);
                moved = s.read(u, link.unknown); // (61)
            }
        }
        shift = shift + moved; // (76)
        work.lever_next = (lever + moved).held();
        (work.turn, work.shift) = (turn.held(), shift.held());
        let Some(rate) = rate else { continue };
        let (moment, start) = (s.take(&work.moment), work.start.take(s));
        // m Δx + (A − 1) s
        let momentum = shift.scaled(s.factor(link.mass[0][0])) + turn.mul(moment);
        let spin = turn.times(&work.euler.take(s)).moment() + moment.cross(shift);
        let linear = start.linear - momentum * rate;
        work.wrench = Screw { linear, angular: start.angular - spin * rate }.held();
    }
    seen
}

/// Moves by the increment of one column: `turn` is `A − 1`, `moved` the shift of the reference
/// point against the parent's.
#[inline(always)]
fn move_along<S: Space>(
    s: S,
    (link, act): (&Link<S::Store>, Act),
    (by, work): (&Turn<Number<S>>, &mut ColumnWork<S::Store>),
    (turn, moved): (&mut Columns<S::Vector>, &mut S::Vector),
    seen: &mut Seen<Number<S>>,
) {
    let u = by.angle;
    let axis = s.take(&work.axis);
    let axis_next = axis + turn.mul(axis); // A n
    work.axis_next = axis_next.held();
    match act {
        Act::Slide => *moved = *moved + axis_next.scaled(u), // A¹ u n
        Act::Screw => *moved = *moved + axis_next.scaled(s.factor(link.pitch) * u),
        Act::Turn => {}
    }
    if act != Act::Slide {
        seen.rotation = seen.rotation.larger(u * u);
        let relative = Columns::turn_about(axis, by.sine, by.versine); // exp(ϑ n̂) − 1
        *turn = turn.plus(&relative).plus(&turn.times(&relative)); // A B − 1
    }
}

/// `exp(θ̂) − 1`.
#[inline(always)]
fn rotation_by<S: Space>(s: S, theta: S::Vector, seen: &mut Seen<Number<S>>) -> Columns<S::Vector> {
    let square = theta.dot(theta);
    seen.rotation = seen.rotation.larger(square);
    let [sinc, gap] = s.rotation(square);
    Columns::turn_about(theta, sinc, gap)
}
