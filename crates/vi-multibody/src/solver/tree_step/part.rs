//! The linear systems of [`super::TreeStep`], some links at a time: closed loops are solved in between.

use super::TreeStep;
use super::link::{Constants, Sums, Work};
use super::workspace::Workspace;
use crate::geometry::lane_matrices::Pair;
use crate::geometry::lanes::{Held, Lanes, Narrow};
use crate::pair::Twist;
use nalgebra::Vector3;
use std::ops::Range;
use vi_core::SeparableSystem;
use vi_core::newton::Fault;
use vi_rigid::directors;

/// The links during a step.
#[derive(Clone, Copy)]
pub(in crate::solver) struct Links<'a> {
    pub(in crate::solver) constants: &'a [Constants],
    pub(in crate::solver) works: &'a [Work],
    pub(in crate::solver) forces: &'a [Pair<Held>], // Ã S'
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

fn lanes(t: &Twist) -> Pair<Lanes<Narrow>> {
    let vector = |v: &Vector3<f64>| Lanes::new(Narrow, (*v).into());
    Pair { linear: vector(&t.linear), angular: vector(&t.angular) }
}

impl TreeStep {
    /// Prepares for closed loops that hang on the links `apexes`.
    pub(in crate::solver) fn carry_loops(&mut self, apexes: impl Iterator<Item = usize>) {
        let Workspace { links, sums, part, .. } = &mut self.at;
        part.forces = vec![Pair::default(); links.len()];
        for apex in apexes {
            if links[apex].slot.is_none() {
                links[apex].slot = Some(sums.len());
                part.unwritten.push(sums.len());
                sums.push(Sums::default());
            }
        }
    }

    /// The links as the last sweeps have left them.
    pub(in crate::solver) fn at_links(&self) -> Links<'_> {
        let Workspace { links, works, part, .. } = &self.at;
        Links { constants: links, works, forces: &part.forces }
    }

    /// Writes `q_{n+1}` and `Δq` of the last residual, where it has not needed them.
    pub(in crate::solver) fn close_interval(&mut self) {
        if self.variable.is_none() {
            self.close();
        }
    }

    /// Before the sweeps of a linear system: blocks of what depends on coordinates, and nothing on any link.
    pub(in crate::solver) fn assemble(&mut self, system: &SeparableSystem) {
        let Self { at, tree, efforts, variable, s, .. } = self;
        if let Some(variable) = variable {
            variable.assemble((system, &*tree), s, &at.links);
        }
        let Workspace { links, works, columns, sums, part, .. } = at;
        efforts.assemble(system, s, (links, works, columns));
        part.unwritten.iter().for_each(|&slot| sums[slot] = Sums::default());
    }

    /// Leaf → root, links of a range: `x ← u_k`.
    ///
    /// # Errors
    /// [`Fault::SingularTangent`].
    pub(in crate::solver) fn eliminate(
        &mut self,
        range: Range<usize>,
        x: &mut [f64],
    ) -> Result<(), Fault> {
        let added = self.variable.as_ref().map_or(&[][..], |variable| &variable.blocks[..]);
        self.at.eliminate(range, added, x)
    }

    /// Root → leaf, links of a range: `x ← δτ` at the increments `u`; returns the largest rotation of a link, rad.
    pub(in crate::solver) fn substitute(
        &mut self,
        range: Range<usize>,
        u: &[f64],
        x: &mut [f64],
    ) -> f64 {
        self.at.substitute(range, u, x)
    }

    /// `Â_k ← Â_k − x yᵀ`, `p_k ← p_k + z x`: what hangs on link `k` beside its children.
    pub(in crate::solver) fn relieve(&mut self, k: usize, (x, y, z): (&Twist, Twist, f64)) {
        let Some(slot) = self.at.links[k].slot else { return };
        let (sums, x, y) = (&mut self.at.sums[slot], lanes(x), lanes(&y));
        sums.matrix = sums.matrix.take(Narrow).minus_outer(x, 1.0, y).held();
        sums.wrench = sums.wrench.take(Narrow).plus_scaled(z, x).held();
    }

    /// `δt'` of link `k` after the substitution.
    pub(in crate::solver) fn twist(&self, k: usize) -> Twist {
        let twist = &self.at.works[k].twist;
        Twist::new(twist.linear.xyz().into(), twist.angular.xyz().into())
    }
}
