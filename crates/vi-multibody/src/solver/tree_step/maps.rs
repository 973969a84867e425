//! What closed loops ask of the links of [`super::TreeStep`]: velocity maps and blocks, about the reference points.

use super::columns::{Act, Motion};
use super::link::Constants;
use super::{TreeStep, solve};
use crate::geometry::lane_matrices::Columns;
use crate::geometry::lanes::{Held, Lanes, Narrow};
use crate::geometry::spatial::SpatialMatrix;
use crate::geometry::twist::{Transfer, Twist};
use crate::pair::VelocityMap;
use nalgebra::{Matrix3, Vector3};
use vi_rigid::directors;

fn vector(v: &Held) -> Vector3<f64> {
    Lanes::take(Narrow, v).xyz().into()
}

fn map(link: &Constants, axis: &Held, lever: &Held, out: &mut VelocityMap) {
    let (axis, zero) = (vector(axis), Vector3::zeros());
    out.transfer = Transfer::Rigid(vector(lever));
    out.dof = usize::from(link.motion != Motion::Fixed);
    out.s[0] = match link.motion == Motion::Along(Act::Slide) {
        true => Twist::new(axis, zero),
        false => Twist::new(zero, axis),
    };
}

impl TreeStep {
    /// From the reference point of each link to its centre, at `q`.
    pub(in crate::solver) fn write_centers<'a>(
        &self,
        q: &[f64],
        out: impl Iterator<Item = &'a mut Vector3<f64>>,
    ) {
        for (link, out) in self.links.iter().zip(out) {
            let own = &q[link.frame..link.frame + 12];
            *out = -(directors::triad(own) * Vector3::from(link.anchor));
        }
    }

    /// Writes `q_{n+1}` and `Δq` of the last residual, where it has not needed them.
    pub(in crate::solver) fn close_interval(&mut self) {
        if self.variable.is_none() {
            self.close();
        }
    }

    /// `X, S` of each link at `q_n`.
    pub(in crate::solver) fn write_maps<'a>(&self, out: impl Iterator<Item = &'a mut VelocityMap>) {
        let links = self.links.iter().zip(&self.works).zip(out);
        links.for_each(|((link, work), out)| map(link, &work.column.axis, &work.lever, out));
    }

    /// `X', S'` of each link at the last `q_{n+1}`.
    pub(in crate::solver) fn write_tangents<'a>(
        &self,
        out: impl Iterator<Item = &'a mut VelocityMap>,
    ) {
        let links = self.links.iter().zip(&self.works).zip(out);
        links.for_each(|((link, work), out)| {
            map(link, &work.column.axis_next, &work.lever_next, out)
        });
    }

    /// `−h A_α` of each link; `added` is what depends on coordinates otherwise.
    pub(in crate::solver) fn write_blocks<'a>(
        &mut self,
        system: &vi_core::SeparableSystem,
        out: impl Iterator<Item = &'a mut SpatialMatrix>,
    ) {
        let Self { links, works, variable, s, .. } = self;
        if let Some(variable) = variable {
            variable.assemble(system, s, links);
        }
        for (k, ((link, work), out)) in links.iter().zip(works).zip(out).enumerate() {
            let mut block = solve::block(Narrow, link, work);
            if let Some(variable) = variable {
                block = block.plus(&variable.blocks[k].take(Narrow));
            }
            let matrix = |m: Columns<Lanes<Narrow>>| {
                Matrix3::from_columns(&m.0.map(|column| Vector3::from(column.xyz())))
            };
            *out = SpatialMatrix::of([block.ll, block.la, block.al, block.aa].map(matrix));
        }
    }
}
