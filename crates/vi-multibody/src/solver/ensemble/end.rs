//! The end of a step: coordinates, momenta, round-off; formulas are those of
//! [`crate::solver::tree_step`].

use super::kernel::Kernel;
use super::link::Link;
use super::sweeps::{at, carrier, directors, gap};
use crate::geometry::lane_spatial::Columns;
use crate::geometry::lane_vectors::{Screw, Vector, three};
use crate::pair::PairKind;
use crate::tree::{SLACK, Tree};
use vi_core::lanes::{Lanes, Register};

impl<T: Register> Kernel<T> {
    /// `q_{n+1}` and `Δq` of the last [`Kernel::advance`].
    #[inline(always)]
    pub(super) fn close(&mut self) {
        let Self { lanes, links, works, q, compensation, q1, dq, .. } = self;
        for (link, work) in links.iter().zip(works) {
            let (parent, center) = carrier(*lanes, link, q1);
            let arm = parent.mul(link.anchor_parent); // ϱ¹
            let d = directors(q, link.frame);
            let moved = work.shift - work.turn.mul(d.mul(link.anchor)); // Δx − (A − 1) ϱ²
            let turned = work.turn.times(&d); // (A − 1) d
            let next = Columns(three(
                #[inline(always)]
                |i| d.0[i] + (turned.0[i] + at(compensation, link.frame + 3 + 3 * i)),
            ));
            let center = match link.closes_gap {
                true => center + (arm - next.mul(link.anchor)), // no gap: φ² = φ¹ + ϱ¹ − ϱ²
                false => at(q, link.frame) + (moved + at(compensation, link.frame)),
            };
            let [a, b, c] = turned.0;
            let [x, y, z] = next.0;
            let own = link.frame..link.frame + 12;
            q1[own.clone()].copy_from_slice([center.0, x.0, y.0, z.0].as_flattened());
            dq[own].copy_from_slice([moved.0, a.0, b.0, c.0].as_flattened());
        }
    }

    /// `p̄_{n+1} = M Δq/h` and the impulse of constant forces in half a step, and the balance of
    /// each link with these very momenta.
    #[inline(always)]
    pub(super) fn write_momenta(&mut self, h: f64) {
        let Self { lanes, links, works, q, dq, p, weight, .. } = self;
        let rate = 1.0 / h;
        for (link, work) in links.iter().zip(works) {
            let mut rest = [Vector::splat(*lanes, &[0.0; 3]); 4];
            for i in 0..4 {
                let own = link.frame + 3 * i;
                let mut momentum = at(dq, own).scaled(link.mass[i][i] * rate); // M Δq/h
                for j in (0..4).filter(|&j| j != i && !link.is_diagonal) {
                    momentum = momentum + at(dq, link.frame + 3 * j).scaled(link.mass[i][j] * rate);
                }
                let impulse = at(weight, own) * (0.5 * h);
                rest[i] = (at(p, own) + impulse) - momentum;
                p[own..own + 3].copy_from_slice(&(momentum + impulse).0);
            }
            let d = directors(q, link.frame);
            let spin = d.0[0].cross(rest[1]) + d.0[1].cross(rest[2]) + d.0[2].cross(rest[3]);
            let anchor = d.mul(link.anchor);
            work.wrench = Screw { linear: rest[0], angular: spin - anchor.cross(rest[0]) };
        }
    }

    /// Marks the lanes in which a link is off its place at `q_{n+1}`: its directors, its axes, its
    /// gap.
    #[inline(always)]
    pub(super) fn glance(&mut self) {
        let Self { lanes, links, q1, marked, .. } = self;
        for (link, marked) in links.iter().zip(marked) {
            let off = off_place(*lanes, link, q1);
            *marked = 0;
            for lane in 0..T::Lanes::COUNT {
                *marked |= u8::from(off.at(lane) > SLACK) << lane;
            }
        }
    }

    /// Removes round-off from `q_{n+1}` where a glance shows some, as [`Tree::clean`] does; marked
    /// are then the lanes whose link has moved.
    pub(super) fn clean(&mut self, trees: &[Tree]) {
        let Self { lanes, links, q1, marked, scratch, .. } = self;
        for (k, link) in links.iter().enumerate() {
            marked[k] |= link.parent.map_or(0, |parent| marked[parent]);
            let own = marked[k];
            for lane in (0..T::Lanes::COUNT).filter(|&lane| own & (1 << lane) != 0) {
                let frames = [link.frame, link.parent_frame];
                for i in frames.into_iter().flat_map(|first| first..first + 12) {
                    scratch[i] = q1[i].at(lane);
                }
                let Some(tree) = trees.get(lane) else { continue };
                if !tree.clean_link(&tree.links()[k], scratch) {
                    marked[k] &= !(1 << lane);
                    continue;
                }
                for i in link.frame..link.frame + 12 {
                    let x = q1[i];
                    q1[i] =
                        lanes.gather(|other| if other == lane { scratch[i] } else { x.at(other) });
                }
            }
        }
    }

    /// Moves to `q_{n+1}`, with its rounding error; `end` is `q_{n+1}` before round-off was
    /// removed.
    pub(super) fn move_to_end(&mut self) {
        let Self { lanes, q, q1, dq, end, compensation, .. } = self;
        for i in 0..q.len() {
            let (from, to, next, step, error) = (q[i], end[i], q1[i], dq[i], compensation[i]);
            compensation[i] = rounding_error(*lanes, [from, to], step + error, next);
            q[i] = next;
        }
    }
}

/// [`vi_core::interval::rounding_error`].
#[inline(always)]
fn rounding_error<T: Register>(
    lanes: T,
    [from, to]: [T::Lanes; 2],
    change: T::Lanes,
    next: T::Lanes,
) -> T::Lanes {
    let (zero, error) = (lanes.splat(0.0), (from - to) + change);
    let size = from.larger(zero - from).larger(to).larger(zero - to);
    let last_bits = size * (2.0 * f64::EPSILON);
    let error = error.larger(zero - error).if_at_most(last_bits, error, zero);
    let moved = to - next;
    moved.larger(zero - moved).if_at_most(zero, error, zero)
}

/// The largest of three components.
#[inline(always)]
fn largest<T: Register>(lanes: T, v: Vector<T::Lanes>) -> T::Lanes {
    let (zero, [x, y, z]) = (lanes.splat(0.0), v.0);
    x.larger(zero - x).larger(y).larger(zero - y).larger(z).larger(zero - z)
}

/// By how much the directors of a link, its axes and its gap are off; the gap of a pair that closes
/// it was removed with the parent where that is. The thread of a screw is not seen at a glance.
#[inline(always)]
fn off_place<T: Register>(lanes: T, link: &Link<T::Lanes>, q: &[T::Lanes]) -> T::Lanes {
    let (d, (parent, center)) = (directors(q, link.frame), carrier(lanes, link, q));
    let ([a, b, c], one) = (d.0, lanes.splat(1.0));
    let lengths = Vector([a.dot(a) - one, b.dot(b) - one, c.dot(c) - one]);
    let angles = Vector([a.dot(b), a.dot(c), b.dot(c)]);
    let rigid = largest(lanes, lengths).larger(largest(lanes, angles));
    let at = At { lanes, link, d, parent };
    match link.kind {
        PairKind::Spherical | PairKind::Free => rigid,
        PairKind::Revolute => rigid.larger(largest(lanes, at.off_axis(2))),
        PairKind::Universal => {
            let across = at.axis(2).dot(d.mul(link.axes_child[0]));
            rigid.larger(across).larger(lanes.splat(0.0) - across)
        }
        PairKind::Fixed => rigid.larger(at.off_attitude()),
        PairKind::Prismatic => {
            let gap = gap(link, &d, (&parent, center), q);
            rigid.larger(at.off_attitude()).larger(largest(lanes, gap - at.along_axis(gap)))
        }
        PairKind::Cylindrical => {
            let gap = gap(link, &d, (&parent, center), q);
            let across = largest(lanes, gap - at.along_axis(gap));
            rigid.larger(largest(lanes, at.off_axis(2))).larger(across)
        }
        PairKind::Planar => {
            let gap = gap(link, &d, (&parent, center), q);
            let along = largest(lanes, at.along_axis(gap));
            rigid.larger(largest(lanes, at.off_axis(2))).larger(along)
        }
        PairKind::Screw(_) => one,
    }
}

/// A link with its directors and those of its parent.
struct At<'a, T: Register> {
    lanes: T,
    link: &'a Link<T::Lanes>,
    d: Columns<T::Lanes>,
    parent: Columns<T::Lanes>,
}

impl<T: Register> At<'_, T> {
    /// `m_1`, `m_2` or `n`.
    #[inline(always)]
    fn axis(&self, i: usize) -> Vector<T::Lanes> {
        self.parent.mul(self.link.axes[i])
    }

    /// Small rotation that brings axis `i` of a link onto that of its parent.
    #[inline(always)]
    fn off_axis(&self, i: usize) -> Vector<T::Lanes> {
        self.d.mul(self.link.axes_child[i]).cross(self.axis(i))
    }

    /// The largest component of that which brings all axes onto those of the parent.
    #[inline(always)]
    fn off_attitude(&self) -> T::Lanes {
        let turn = (self.off_axis(0) + self.off_axis(1) + self.off_axis(2)) * 0.5;
        largest(self.lanes, turn)
    }

    /// The part of a vector along the axis.
    #[inline(always)]
    fn along_axis(&self, v: Vector<T::Lanes>) -> Vector<T::Lanes> {
        let n = self.axis(2);
        n.scaled(n.dot(v))
    }
}
