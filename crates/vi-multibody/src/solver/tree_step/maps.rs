//! What closed loops ask of the links of [`super::TreeStep`]: velocity maps and blocks, about the reference points.

use super::TreeStep;
use super::link::{Constants, Motion, Work};
use super::sweeps::{self, frame};
use crate::geometry::lane_matrices::{Columns, Pair};
use crate::geometry::lanes::{Held, Lanes, Narrow, Width, sweep, three};
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
    out.s[0] = match link.motion == Motion::Prismatic {
        true => Twist::new(axis, zero),
        false => Twist::new(zero, axis),
    };
}

sweep! {
    /// The balance of each link with the momenta of the end of the step; `of`: `q_n`, `Δq`, `p̄_n` and the impulse of
    /// constant forces in half a step.
    balance = sweep_balance(
        links: &'a [Constants], works: &'a mut [Work], of: [&'a [f64]; 4], h: f64
    ) -> ()
}

/// Coordinate by coordinate: what differs is then small before it is pulled back, and so is its rounding.
#[inline(always)]
fn sweep_balance<W: Width>(
    w: W,
    links: &[Constants],
    works: &mut [Work],
    [q0, dq, p, impulse]: [&[f64]; 4],
    h: f64,
) {
    let rate = 1.0 / h;
    for (link, work) in links.iter().zip(works) {
        let [dq, p, impulse] = [dq, p, impulse].map(|x| frame(x, link.frame));
        let mut rest = [Lanes::zero(w); 4]; // p̄_n + D_1 L_d
        for (i, row) in link.mass.iter().enumerate() {
            let mut momentum = Lanes::zero(w); // M Δq/h, as momenta have it
            if link.is_diagonal {
                momentum = Lanes::of(w, &dq[3 * i..]) * (rate * row[i]);
            } else {
                for (j, m) in row.iter().enumerate() {
                    momentum += Lanes::of(w, &dq[3 * j..]) * (rate * m);
                }
            }
            rest[i] = (Lanes::of(w, &p[3 * i..]) - momentum) + Lanes::of(w, &impulse[3 * i..]);
        }
        let [force, known @ ..] = rest;
        let d = Columns::directors(w, frame(q0, link.frame));
        let [first, second, third] = three!(i => d.0[i].cross(known[i]));
        let anchor = d.mul(Lanes::new(w, link.anchor));
        let angular = ((first + second) + third) - anchor.cross(force);
        work.wrench = Pair { linear: force, angular }.held();
    }
}

impl TreeStep {
    /// Balance of the last step with the momenta of its end, in the basis of `q_n`, and what was handed on to it; `p`:
    /// `p̄_n`. After [`TreeStep::close_interval`].
    pub(in crate::solver) fn write_balance(
        &mut self,
        system: &vi_core::SeparableSystem,
        p: &[f64],
        out: &mut [f64],
    ) {
        let Self { links, works, impulse, variable, s, compensation, .. } = self;
        match variable {
            Some(variable) => variable.write_balance((system, p), s, works, links),
            None => balance(links, works, [&s.q0, &s.dq, p, impulse], s.h),
        }
        sweeps::pull_back(links, works, out);
        out.iter_mut().zip(compensation).for_each(|(out, error)| *out += *error);
    }

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
        links.for_each(|((link, work), out)| map(link, &work.axis, &work.lever, out));
    }

    /// `X', S'` of each link at the last `q_{n+1}`.
    pub(in crate::solver) fn write_tangents<'a>(
        &self,
        out: impl Iterator<Item = &'a mut VelocityMap>,
    ) {
        let links = self.links.iter().zip(&self.works).zip(out);
        links.for_each(|((link, work), out)| map(link, &work.axis_next, &work.lever_next, out));
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
            let mut block = sweeps::block(Narrow, link, work);
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
