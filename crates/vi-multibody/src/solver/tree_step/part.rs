//! The linear systems of [`super::TreeStep`], some links at a time: closed loops are solved in
//! between.

use super::space::SPACE;
use super::workspace::Workspace;
use crate::geometry::matrix::Screw;
use crate::geometry::one_tree::{HeldVector, Narrow, One, Xyz};
use crate::geometry::space::Space;
use crate::pair::Twist;
use crate::sweep::eliminate::EliminatedRotation;
use crate::sweep::link::{ColumnWork, Gain, Link, Sums, Work};
use nalgebra::Vector3;
use vi_rigid::directors;

/// The links during a step.
#[derive(Clone, Copy)]
pub(in crate::solver) struct Links<'a> {
    pub(in crate::solver) constants: &'a [Link<One>],
    pub(in crate::solver) works: &'a [Work<One>],
    pub(in crate::solver) columns: &'a [ColumnWork<One>], // d  of joints of several columns
    pub(in crate::solver) forces: &'a [Screw<HeldVector>], // d  Ã S'
    pub(in crate::solver) gains: &'a [Gain<One>],         // of the links  G of rotation vectors
    pub(in crate::solver) rotations: &'a [EliminatedRotation<One>], // of links
}

impl Links<'_> {
    /// A wrench on a link at its centre, about its reference point.
    #[inline]
    pub(in crate::solver) fn about_reference(&self, k: usize, q: &[f64], wrench: &Twist) -> Twist {
        let link = &self.constants[k];
        let own = &q[link.frame..link.frame + 12];
        let lever = -(directors::triad(own) * Vector3::from(link.anchor)); // to the centre
        Twist::new(wrench.linear, wrench.angular + lever.cross(&wrench.linear))
    }
}

fn screw(t: &Twist) -> Screw<Xyz<Narrow>> {
    let vector = |v: &Vector3<f64>| SPACE.vector((*v).into());
    Screw { linear: vector(&t.linear), angular: vector(&t.angular) }
}

impl Sums<One> {
    /// `Â ← Â − x yᵀ`, `p ← p + z x`: what hangs on a link beside its children.
    pub(in crate::solver) fn relieve(&mut self, (x, y, z): (&Twist, Twist, f64)) {
        let (x, y) = (screw(x), screw(&y));
        self.matrix = self.matrix.take(SPACE).minus_outer(x, 1.0, y).held();
        self.wrench = self.wrench.take(SPACE).plus(x.times(z)).held();
    }
}

impl Workspace {
    /// Prepares for closed loops that hang on the links `apexes`; `turns`: whether they pass
    /// through a rotation vector.
    pub(in crate::solver) fn carry_loops(
        &mut self,
        apexes: impl Iterator<Item = usize>,
        turns: bool,
    ) {
        let Self { links, sums, part, turns: unknowns, .. } = self;
        part.forces = vec![Screw::default(); unknowns.len()];
        part.rotations = vec![EliminatedRotation::zero(SPACE); if turns { links.len() } else { 0 }];
        part.carry(SPACE, links, sums, apexes);
    }

    /// The links as the last sweeps have left them.
    pub(in crate::solver) fn at_links(&self) -> Links<'_> {
        let Self { links, works, columns, gains, part, .. } = self;
        let (forces, rotations) = (&part.forces[..], &part.rotations[..]);
        Links { constants: links, works, columns, forces, gains, rotations }
    }

    /// Before the sweeps of a linear system: nothing hangs on any link.
    pub(in crate::solver) fn release_links(&mut self) {
        let Self { sums, part, .. } = self;
        part.release(SPACE, sums);
    }

    /// The sums of link `k` over what hangs on it.
    pub(in crate::solver) fn sums_mut(&mut self, k: usize) -> Option<&mut Sums<One>> {
        self.links[k].slot.map(|slot| &mut self.sums[slot])
    }

    /// `δt'` of link `k` after the substitution.
    pub(in crate::solver) fn twist(&self, k: usize) -> Twist {
        let twist = &self.works[k].twist;
        Twist::new(twist.linear.xyz().into(), twist.angular.xyz().into())
    }
}
