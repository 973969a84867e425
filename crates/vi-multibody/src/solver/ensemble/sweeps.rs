//! The sweeps of a residual; formulas are those of [`crate::solver::tree_step`].

use super::kernel::Kernel;
use super::link::{ColumnWork, Link};
use crate::geometry::lane_spatial::Columns;
use crate::geometry::lane_vectors::{Screw, Vector, three};
use crate::solver::tree_step::columns::{Act, Axis, Motion};
use vi_core::lanes::{Lanes, Register};
use vi_rigid::rotation_lanes::coefficients_of_each;

/// The vector that begins at an entry.
#[inline(always)]
pub(super) fn at<L: Lanes>(x: &[L], first: usize) -> Vector<L> {
    Vector([x[first], x[first + 1], x[first + 2]])
}

/// The directors of a frame.
#[inline(always)]
pub(super) fn directors<L: Lanes>(q: &[L], frame: usize) -> Columns<L> {
    Columns(three(
        #[inline(always)]
        |j| at(q, frame + 3 + 3 * j),
    ))
}

/// The directors and the centre of the parent of a link; of the ground: the inertial base and its
/// origin.
#[inline(always)]
pub(super) fn carrier<T: Register>(
    lanes: T,
    link: &Link<T::Lanes>,
    q: &[T::Lanes],
) -> (Columns<T::Lanes>, Vector<T::Lanes>) {
    match link.parent {
        Some(_) => (directors(q, link.parent_frame), at(q, link.parent_frame)),
        None => (Columns::multiple(lanes, lanes.splat(1.0)), Vector::splat(lanes, &[0.0; 3])),
    }
}

/// The gap of a joint.
#[inline(always)]
pub(super) fn gap<L: Lanes>(
    link: &Link<L>,
    d: &Columns<L>,
    (parent, center): (&Columns<L>, Vector<L>),
    q: &[L],
) -> Vector<L> {
    (at(q, link.frame) + d.mul(link.anchor)) - (center + parent.mul(link.anchor_parent))
}

/// `S_jᵀ b`.
#[inline(always)]
pub(super) fn component<L: Lanes>(link: &Link<L>, act: Act, axis: Vector<L>, b: Screw<L>) -> L {
    match act {
        Act::Turn => axis.dot(b.angular),
        Act::Slide => axis.dot(b.linear),
        Act::Screw => axis.dot(b.angular) + link.pitch * axis.dot(b.linear),
    }
}

impl<T: Register> Kernel<T> {
    /// Everything at `q_n`.
    #[inline(always)]
    pub(super) fn open(&mut self, h: f64) {
        let Self { lanes, links, works, columns, q, p, weight, .. } = self;
        for (link, work) in links.iter().zip(works) {
            let (d, (parent, center)) = (directors(q, link.frame), carrier(*lanes, link, q));
            let anchor = d.mul(link.anchor);
            work.lever = parent.mul(link.lever);
            if !link.closes_gap {
                work.lever = work.lever + gap(link, &d, (&parent, center), q); // the slide
            }
            work.moment = d.mul(link.moment);
            work.euler = d.times(&link.euler).times_transposed(&d); // E = D E_b Dᵀ
            let half = 0.5 * h;
            let force = at(p, link.frame) + at(weight, link.frame) * half;
            let mut spin = Vector::splat(*lanes, &[0.0; 3]);
            for i in 0..3 {
                let own = link.frame + 3 + 3 * i;
                spin = spin + d.0[i].cross(at(p, own) + at(weight, own) * half);
            }
            work.start = Screw { linear: force, angular: spin - anchor.cross(force) };
            match link.motion {
                Motion::Along(_) => columns[link.unknown].axis = parent.mul(link.axes[2]),
                Motion::Several(several) => {
                    for (column, work) in several.iter().zip(&mut columns[link.unknown..]) {
                        work.axis = match column.axis {
                            Axis::Parent(i) => parent.mul(link.axes[i]),
                            Axis::Child(i) => d.mul(link.axes_child[i]),
                        };
                    }
                }
                _ => {}
            }
        }
    }

    /// Root → leaf: the motion of every link for the increments `u` of a step `h`, and the balance
    /// of momenta of each link alone.
    #[inline(always)]
    pub(super) fn advance(&mut self, h: f64) {
        let Self { lanes, links, works, columns, u, .. } = self;
        let rate = 1.0 / h;
        for (k, link) in links.iter().enumerate() {
            let (mut turn, mut shift) = match link.parent {
                Some(parent) => (works[parent].turn, works[parent].shift),
                None => (Columns::zero(*lanes), Vector::splat(*lanes, &[0.0; 3])),
            };
            let work = &mut works[k];
            let mut moved = turn.mul(work.lever); // (A¹ − 1) ℓ
            match link.motion {
                Motion::Fixed => {}
                Motion::Along(act) => {
                    let column = (&mut columns[link.unknown], u[link.unknown]);
                    move_along(*lanes, (link, act), column, &mut turn, &mut moved);
                }
                Motion::Several(several) => {
                    for (unknown, column) in (link.unknown..).zip(several) {
                        let own = (&mut columns[unknown], u[unknown]);
                        move_along(*lanes, (link, column.act), own, &mut turn, &mut moved);
                    }
                }
                Motion::Spherical => turn = rotation_by(*lanes, at(u, link.unknown)),
                Motion::Free => {
                    turn = rotation_by(*lanes, at(u, link.unknown + 3));
                    moved = at(u, link.unknown);
                }
            }
            shift = shift + moved;
            work.lever_next = work.lever + moved;
            (work.turn, work.shift) = (turn, shift);
            // m Δx + (A − 1) s
            let momentum = shift.scaled(link.mass[0][0]) + turn.mul(work.moment);
            let spin = turn.times(&work.euler).moment() + work.moment.cross(shift);
            work.wrench = Screw {
                linear: work.start.linear - momentum * rate,
                angular: work.start.angular - spin * rate,
            };
        }
    }

    /// Leaf → root: `r ← P(q_n)ᵀ` of the balances of all links.
    #[inline(always)]
    pub(super) fn pull_back(&mut self) {
        let Self { lanes, links, works, columns, r, .. } = self;
        for (k, link) in links.iter().enumerate().rev() {
            let mut wrench = works[k].wrench;
            match link.motion {
                Motion::Fixed => {}
                Motion::Along(act) => {
                    let axis = columns[link.unknown].axis;
                    r[link.unknown] = component(link, act, axis, wrench);
                }
                Motion::Several(several) => {
                    for (unknown, column) in (link.unknown..).zip(several) {
                        r[unknown] = component(link, column.act, columns[unknown].axis, wrench);
                    }
                }
                Motion::Spherical => {
                    r[link.unknown..link.unknown + 3].copy_from_slice(&wrench.angular.0);
                    wrench.angular = Vector::splat(*lanes, &[0.0; 3]); // no torque passes
                }
                Motion::Free => {
                    r[link.unknown..link.unknown + 3].copy_from_slice(&wrench.linear.0);
                    r[link.unknown + 3..link.unknown + 6].copy_from_slice(&wrench.angular.0);
                }
            }
            if let Some(parent) = link.parent {
                let transmitted = wrench.at_start_of(works[k].lever);
                works[parent].wrench = works[parent].wrench.plus(transmitted);
            }
        }
    }
}

/// Moves by the increment `u` of one column: `turn` is `A − 1`, `moved` the shift of the reference
/// point against the parent's.
#[inline(always)]
fn move_along<T: Register>(
    lanes: T,
    (link, act): (&Link<T::Lanes>, Act),
    (work, u): (&mut ColumnWork<T::Lanes>, T::Lanes),
    turn: &mut Columns<T::Lanes>,
    moved: &mut Vector<T::Lanes>,
) {
    work.axis_next = work.axis + turn.mul(work.axis); // A n
    match act {
        Act::Slide => *moved = *moved + work.axis_next.scaled(u), // A¹ u n
        Act::Screw => *moved = *moved + work.axis_next.scaled(link.pitch * u),
        Act::Turn => {}
    }
    if act != Act::Slide {
        let square = u * u;
        let [sinc, gap] = coefficients_of_each(lanes, square);
        let relative = Columns::turn_about(lanes, work.axis, (u * sinc, square * gap));
        *turn = turn.plus(&relative).plus(&turn.times(&relative)); // A B − 1
    }
}

/// `exp(θ̂) − 1`.
#[inline(always)]
fn rotation_by<T: Register>(lanes: T, theta: Vector<T::Lanes>) -> Columns<T::Lanes> {
    let [sinc, gap] = coefficients_of_each(lanes, theta.dot(theta));
    Columns::turn_about(lanes, theta, (sinc, gap))
}
