//! A force and a torque on a member along the axes of a frame, which takes the opposite.
//!
//! ```text
//! F = Σ f_i ā_i,  T = Σ τ_i ā_i          ā_i at q_{n+1/2}: axes of the frame a, or of the member b itself
//! on b      (h/2) (F, T)                 at its point Y(q_n | q_{n+1})
//! on a      (h/2) (−F, −T − ρ×F)         at its centre,  ρ = Y − φ_a at the same end
//! ```
//! Both ends of a step have the same `F` and `T`, and each has the levers of its own node: momentum
//! maps are exact whatever the law reads.
//!
//! Source: Marsden & West 2001, §3.2, for momentum maps with forces.
#![allow(non_snake_case)] // F, T, Y

use super::place::EffortAxes;
use crate::force::acts_on::ActsOn;
use nalgebra::{Matrix3, SMatrix, Vector3};
use vi_core::sparse::Entries;
use vi_rigid::directors::FRAME;

/// What such a law acts on. Axes are stated for the one of both along whose axes the components
/// are.
#[derive(Clone, Debug, PartialEq)]
pub struct RelativeWrench {
    /// The member `b`.
    pub on: ActsOn,
    /// The frame `a`, at its centre.
    pub base: ActsOn,
}

/// `∂(coordinates)/∂(F, T)`.
type WrenchColumns = SMatrix<f64, FRAME, 6>;

impl RelativeWrench {
    /// Along whose axes the components are.
    pub(super) fn carrier(&self) -> &ActsOn {
        match &self.base {
            ActsOn::Frame { axes: Some(_), .. } => &self.base,
            _ => &self.on,
        }
    }

    /// `F` and `T`.
    fn spatial(&self, at: EffortAxes<'_>, wrench: [f64; 6]) -> [Vector3<f64>; 2] {
        let carrier = self.carrier();
        carrier.spatial(wrench, &carrier.own(at.mid))
    }

    /// `ρ`.
    fn lever(&self, at: EffortAxes<'_>) -> Vector3<f64> {
        self.on.point(&self.on.own(at.own)) - self.base.point(&self.base.own(at.own))
    }

    /// Of both members.
    fn columns(&self, at: EffortAxes<'_>) -> [WrenchColumns; 2] {
        let rho = self.lever(at).cross_matrix();
        let of_base = self.base.columns(&self.base.own(at.own));
        let mut opposite = -of_base;
        let mut by_force = opposite.fixed_columns_mut::<3>(0);
        by_force -= of_base.fixed_columns::<3>(3) * rho;
        [self.on.columns(&self.on.own(at.own)), opposite]
    }

    /// `out ← out + scale Σ_k effort_k direction_k`.
    pub(super) fn add(&self, at: EffortAxes<'_>, scale: f64, wrench: [f64; 6], out: &mut [f64]) {
        let [F, T] = self.spatial(at, wrench);
        self.on.add_wrench(scale, [F, T], &self.on.own(at.own), out);
        let opposite = [-F, -(T + self.lever(at).cross(&F))];
        self.base.add_wrench(scale, opposite, &self.base.own(at.own), out);
    }

    /// The entries of the direction of the effort `k`.
    pub(super) fn for_each_direction(
        &self,
        at: EffortAxes<'_>,
        k: usize,
        visit: &mut dyn FnMut(usize, f64),
    ) {
        let mut unit = [0.0; 6];
        unit[k] = 1.0;
        let [F, T] = self.spatial(at, unit);
        let wrench = SMatrix::<f64, 6, 1>::from([F.x, F.y, F.z, T.x, T.y, T.z]);
        for (member, columns) in [&self.on, &self.base].into_iter().zip(self.columns(at)) {
            let own = columns * wrench;
            (0..member.size()).for_each(|i| visit(member.offset() + i, own[i]));
        }
    }

    /// Emits `scale Σ_k effort_k ∂direction_k/∂q`, as [`super::Target::emit_turning`].
    pub(super) fn emit_turning(
        &self,
        at: EffortAxes<'_>,
        share: f64,
        follows: bool,
        scale: f64,
        wrench: [f64; 6],
        out: &mut dyn Entries,
    ) {
        let Self { on, base } = self;
        let carrier = self.carrier();
        let turned = carrier.turned_axes(&wrench, share);
        for (member, columns) in [on, base].into_iter().zip(self.columns(at)) {
            member.emit_between(carrier, scale, &(columns * turned), out);
        }
        if !follows {
            return;
        }
        let [F, T] = self.spatial(at, wrench);
        on.turn_levers(scale, &T, out);
        // the couple −ρ×F on the frame moves with both ends of ρ
        let couple = base.columns(&base.own(at.own)).fixed_columns::<3>(3) * F.cross_matrix();
        let rows = |member: &ActsOn| {
            let mut rows = SMatrix::<f64, 3, FRAME>::zeros();
            rows.fixed_columns_mut::<3>(0).copy_from(&Matrix3::identity());
            if let ActsOn::Frame { point, .. } = member {
                for i in 0..3 {
                    let own = Matrix3::identity() * point[i];
                    rows.fixed_columns_mut::<3>(3 + 3 * i).copy_from(&own);
                }
            }
            rows
        };
        base.emit_between(on, scale, &(couple * rows(on)), out);
        base.emit(scale, &-(couple * rows(base)), out);
        base.turn_levers(scale, &-(T + self.lever(at).cross(&F)), out);
    }
}
