//! What a wrench acts on: a frame, at a point of it, or a point mass.

use nalgebra::{Matrix3, SMatrix, Vector3};
use vi_core::sparse::Entries;
use vi_rigid::directors::{FRAME, director};
use vi_rigid::load;

pub(super) type Block12 = SMatrix<f64, FRAME, FRAME>;

/// What a law acts on.
#[derive(Clone, Debug, PartialEq)]
pub enum ActsOn {
    /// The frame at coordinate `offset`, at the point `ϱ_I d_I` from its centre (m); with `axes`,
    /// which takes components of the law to those along the directors, it follows the frame.
    Frame {
        /// First coordinate.
        offset: usize,
        /// `ϱ_I`, m.
        point: Vector3<f64>,
        /// `B`.
        axes: Option<Matrix3<f64>>,
    },
    /// The point mass at coordinate `offset`.
    Particle {
        /// First coordinate.
        offset: usize,
        /// Of the space: 2 or 3.
        dimension: usize,
    },
}

impl ActsOn {
    pub(super) fn size(&self) -> usize {
        match self {
            ActsOn::Frame { .. } => FRAME,
            ActsOn::Particle { dimension, .. } => *dimension,
        }
    }

    pub(super) fn offset(&self) -> usize {
        match self {
            ActsOn::Frame { offset, .. } | ActsOn::Particle { offset, .. } => *offset,
        }
    }

    /// Its coordinates among all, those of a point mass followed by zeros.
    pub(super) fn own(&self, q: &[f64]) -> [f64; FRAME] {
        let mut own = [0.0; FRAME];
        own[..self.size()].copy_from_slice(&q[self.offset()..self.offset() + self.size()]);
        own
    }

    /// `X`, linear in the coordinates.
    pub(super) fn point(&self, own: &[f64; FRAME]) -> Vector3<f64> {
        let center = Vector3::new(own[0], own[1], own[2]);
        match self {
            ActsOn::Frame { point, .. } => {
                center + (0..3).map(|i| point[i] * director(own, i)).sum::<Vector3<f64>>()
            }
            ActsOn::Particle { .. } => center,
        }
    }

    /// Adds `scale ∂X/∂q` to three rows.
    pub(super) fn point_rows<const R: usize>(
        &self,
        scale: f64,
        first: usize,
        rows: &mut SMatrix<f64, R, FRAME>,
    ) {
        for k in 0..3 {
            rows[(first + k, k)] += scale;
            if let ActsOn::Frame { point, .. } = self {
                (0..3).for_each(|i| rows[(first + k, 3 + 3 * i + k)] += scale * point[i]);
            }
        }
    }

    /// `(f, τ)` in space of what the law gives, with the directors of `own`.
    pub(super) fn spatial(&self, wrench: [f64; 6], own: &[f64; FRAME]) -> [Vector3<f64>; 2] {
        let [f, m] = [0, 3].map(|k| Vector3::new(wrench[k], wrench[k + 1], wrench[k + 2]));
        match self {
            ActsOn::Frame { axes: Some(axes), .. } => {
                let turned = |c: Vector3<f64>| -> Vector3<f64> {
                    let c = axes * c;
                    (0..3).map(|i| c[i] * director(own, i)).sum()
                };
                [turned(f), turned(m)]
            }
            _ => [f, m],
        }
    }

    /// `out ← out + scale (f, ϱ_I f + ½ τ×d_I)` with the directors of `own`.
    pub(super) fn add_wrench(
        &self,
        scale: f64,
        [f, m]: [Vector3<f64>; 2],
        own: &[f64; FRAME],
        out: &mut [f64],
    ) {
        let out = &mut out[self.offset()..self.offset() + self.size()];
        (0..self.size().min(3)).for_each(|k| out[k] += scale * f[k]);
        if let ActsOn::Frame { point, .. } = self {
            for i in 0..3 {
                let d = point[i] * f + 0.5 * m.cross(&director(own, i));
                (0..3).for_each(|k| out[3 + 3 * i + k] += scale * d[k]);
            }
        }
    }

    /// `∂(coordinates)/∂(f, τ)` with the directors of `own`.
    pub(super) fn columns(&self, own: &[f64; FRAME]) -> SMatrix<f64, FRAME, 6> {
        let mut columns = SMatrix::<f64, FRAME, 6>::zeros();
        for k in 0..3 {
            columns[(k, k)] = 1.0;
        }
        if let ActsOn::Frame { point, .. } = self {
            for i in 0..3 {
                let by_force = Matrix3::identity() * point[i];
                columns.fixed_view_mut::<3, 3>(3 + 3 * i, 0).copy_from(&by_force);
                let by_torque = -0.5 * director(own, i).cross_matrix();
                columns.fixed_view_mut::<3, 3>(3 + 3 * i, 3).copy_from(&by_torque);
            }
        }
        columns
    }

    /// `∂(f, τ)/∂q` of what the law gives along the axes of the body, where these move by
    /// `share δd_I`.
    pub(super) fn turned_axes(&self, wrench: &[f64; 6], share: f64) -> SMatrix<f64, 6, FRAME> {
        let mut turned = SMatrix::<f64, 6, FRAME>::zeros();
        let ActsOn::Frame { axes: Some(axes), .. } = self else { return turned };
        for k in [0, 3] {
            let c = axes * Vector3::new(wrench[k], wrench[k + 1], wrench[k + 2]);
            for i in 0..3 {
                (0..3).for_each(|l| turned[(k + l, 3 + 3 * i + l)] = share * c[i]);
            }
        }
        turned
    }

    /// Emits `scale ½ τ × δd_I`.
    pub(super) fn turn_levers(&self, scale: f64, torque: &Vector3<f64>, out: &mut dyn Entries) {
        if let ActsOn::Frame { offset, .. } = self {
            load::add_lever_slopes(scale, torque, *offset, out);
        }
    }

    /// Emits `scale` times a block of its coordinates.
    pub(super) fn emit(&self, scale: f64, block: &Block12, out: &mut dyn Entries) {
        self.emit_between(self, scale, block, out);
    }

    /// The same with columns of another member.
    pub(super) fn emit_between(
        &self,
        columns: &Self,
        scale: f64,
        block: &Block12,
        out: &mut dyn Entries,
    ) {
        for i in 0..self.size() {
            for j in 0..columns.size() {
                out.add(self.offset() + i, columns.offset() + j, scale * block[(i, j)]);
            }
        }
    }
}
