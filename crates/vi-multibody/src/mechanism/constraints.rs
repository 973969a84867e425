//! The constraints of a mechanism: internal ones of the bodies, then joints, bars, scalar
//! constraints.

use super::Mechanism;
use crate::constraint::scalar_constraint::ScalarRow;
use crate::pair::residual::{add_rates, residuals};
use vi_constraints::Constraints;
use vi_constraints::constraints::RowSums;
use vi_constraints::null_space::RANK_TOLERANCE;
use vi_core::discrete_lagrangian::NoStepSlope;
use vi_core::interval::{Interval, StepChange};
use vi_core::newton;
use vi_core::sparse::{Block, Entries};
use vi_core::{Configuration, Motion};
use vi_rigid::directors::{self, FRAME};

impl Mechanism {
    /// `out ← out + scale Σ_i w_i ∂γ_i/∂q`, `γ` of [`Constraints::acceleration_terms`], at fixed
    /// `v`; what is not known is left out.
    pub(crate) fn add_acceleration_slopes(
        &self,
        at: Motion<'_>,
        w: &[f64],
        scale: f64,
        out: &mut [f64],
    ) {
        let first = 6 * self.description.bodies.len();
        for (row, weight) in self.rows.iter().zip(&w[first..]).filter(|(_, weight)| **weight != 0.0)
        {
            row.add_acceleration_slope(at, scale * weight, out);
        }
    }

    /// `out ← out + scale Σ_i w_i D³g_i(q)[x, y]`: products of linear forms have none, threads,
    /// gears and prescribed motions have; those of rolling are left out.
    pub(crate) fn add_weighted_thirds(
        &self,
        q: &[f64],
        w: &[f64],
        along: [&[f64]; 2],
        scale: f64,
        out: &mut [f64],
    ) {
        let first = 6 * self.description.bodies.len();
        for (row, weight) in self.rows.iter().zip(&w[first..]) {
            row.add_third(q, along, scale * weight, out);
        }
    }
}

impl Constraints for Mechanism {
    fn dim(&self) -> usize {
        let d = &self.description;
        12 * d.bodies.len() + d.dimension * d.particles.len()
    }

    fn allowances(&self) -> &[f64] {
        self.nearly_redundant().map_or(&[], |nearly| &nearly.allowances)
    }

    fn rank_tolerance(&self) -> f64 {
        self.nearly_redundant().map_or(RANK_TOLERANCE, |nearly| nearly.rank_tolerance)
    }

    fn reflected(&self, q: &[f64]) -> Option<usize> {
        let mut frames = q[..FRAME * self.description.bodies.len()].chunks_exact(FRAME);
        frames.position(directors::is_reflected).map(|body| FRAME * body)
    }

    fn len(&self) -> usize {
        6 * self.description.bodies.len() + self.rows.len()
    }

    fn value(&self, at: Configuration<'_>, out: &mut [f64]) {
        let (q, bodies) = (at.q, self.description.bodies.len());
        for k in 0..bodies {
            directors::internal_value(&q[12 * k..12 * k + 12], &mut out[6 * k..6 * k + 6]);
        }
        for (row, g) in self.rows.iter().zip(&mut out[6 * bodies..]) {
            *g = row.value(at);
        }
    }

    /// From the vectors of each joint, not row by row.
    fn residual(&self, at: Configuration<'_>, out: &mut [f64]) {
        let first = 6 * self.description.bodies.len();
        residuals(&self.description.joints, &self.joint_rows, &at.q[..2 * first], out);
        for &row in &self.other_rows {
            out[first + row] = self.rows[row].value(at);
        }
    }

    fn raise_floors(&self, q: &[f64], blocks: &mut [newton::UnknownBlock]) {
        self.round_off.raise_floors(q, blocks);
    }

    fn jacobian(&self, _t: f64, q: &[f64], out: &mut dyn Entries) {
        let bodies = self.description.bodies.len();
        for k in 0..bodies {
            directors::internal_jacobian(&q[12 * k..12 * k + 12], 6 * k, 12 * k, out);
        }
        for (i, row) in self.rows.iter().enumerate() {
            row.emit(q, 6 * bodies + i, out);
        }
    }

    fn step_jacobian(&self, s: &Interval, out: &mut dyn Entries) {
        let bodies = self.description.bodies.len();
        for k in 0..bodies {
            directors::internal_jacobian(&s.q1[12 * k..12 * k + 12], 6 * k, 12 * k, out);
        }
        for (i, row) in self.rows.iter().enumerate() {
            row.emit_of_step(s, 6 * bodies + i, out);
        }
    }

    fn velocity_step_jacobian(&self, s: &Interval, out: &mut dyn Entries) {
        self.velocity_rows().for_each(|(i, row)| row.emit_of_step(s, i, out));
    }

    fn add_step_change(
        &self,
        s: &Interval,
        change: StepChange,
        out: &mut [f64],
    ) -> Result<(), NoStepSlope> {
        let refused = |what: &str| Err(NoStepSlope { what: what.into() });
        if self.rows.iter().any(ScalarRow::is_rheonomic) {
            return refused("a prescribed motion");
        }
        for (i, row) in self.velocity_rows() {
            match row.step_change(s, change) {
                Some(own) => out[i] += own,
                None => return refused("a constraint on velocities that reads the time"),
            }
        }
        Ok(())
    }

    fn drift_slope(&self, at: Configuration<'_>, out: &mut dyn Entries) {
        for (i, row) in self.velocity_rows().filter(|(_, row)| row.is_driven()) {
            let (into, column, scale, transposed) = (&mut *out, 0, 1.0, false);
            row.emit_drift_slope(at, &mut Block { into, row: i, column, scale, transposed });
        }
    }

    fn add_rates(&self, _t: f64, q: &[f64], v: &[f64], out: &mut [f64]) {
        let (first, joints) = (6 * self.description.bodies.len(), &self.description.joints);
        add_rates(joints, &self.joint_rows, &q[..2 * first], &v[..2 * first], out);
        for &row in &self.other_rows {
            self.rows[row].add_rate(q, v, &mut out[first + row]);
        }
    }

    fn second_derivative(&self, _t: f64, q: &[f64], v: &[f64], w: &[f64], out: &mut [f64]) {
        let bodies = self.description.bodies.len();
        for k in 0..bodies {
            let own = 12 * k..12 * k + 12;
            let rows = &mut out[6 * k..6 * k + 6];
            directors::internal_second_derivative(&v[own.clone()], &w[own], rows);
        }
        for (row, g) in self.rows.iter().zip(&mut out[6 * bodies..]) {
            *g = row.second(q, v, w);
        }
    }

    fn time_derivative(&self, t: f64, q: &[f64], out: &mut [f64]) {
        let first = 6 * self.description.bodies.len();
        out[..first].fill(0.0);
        for (row, g) in self.rows.iter().zip(&mut out[first..]) {
            *g = row.drift(Configuration::new(t, q));
        }
    }

    fn step_rates(&self, s: &Interval, out: &mut [f64]) {
        out.fill(0.0);
        self.add_rates(s.t_mid(), &s.q_mid, &s.v_mid, out);
        let first = 6 * self.description.bodies.len();
        for &row in &self.step_rows {
            out[first + row] = self.rows[row].change(s) / s.h;
        }
    }

    fn acceleration_terms(&self, t: f64, q: &[f64], v: &[f64], out: &mut [f64]) {
        self.second_derivative(t, q, v, v, out);
        let first = 6 * self.description.bodies.len();
        for (row, g) in self.rows.iter().zip(&mut out[first..]) {
            *g += row.drift_change(Motion::new(t, q, v));
        }
    }

    fn is_rheonomic(&self) -> bool {
        self.rows.iter().any(|row| row.is_rheonomic() || row.is_driven())
    }

    fn constrains_velocities(&self) -> bool {
        self.has_velocity_constraints()
    }

    /// Directors have size 1; points have that of the farthest one that constraints connect them
    /// to, no less than the longest lever arm there.
    fn coordinate_sizes(&self, q: &[f64], out: &mut [f64]) {
        let (bodies, d) = (self.description.bodies.len(), self.description.dimension);
        let sizes = self.point_sizes(q);
        let (frames, points) = out.split_at_mut(12 * bodies);
        for (frame, size) in frames.chunks_mut(12).zip(&sizes) {
            frame[..3].fill(*size);
            frame[3..].fill(1.0);
        }
        for (point, size) in points.chunks_mut(d.max(1)).zip(&sizes[bodies..]) {
            point.fill(*size);
        }
    }

    /// Lever arms are those of the component in the initial configuration.
    fn coordinate_units(&self, out: &mut [f64]) {
        out.fill(1.0);
        for k in 0..self.description.bodies.len() {
            out[FRAME * k..FRAME * k + 3].fill(self.arm_of(k));
        }
    }

    fn row_sizes(&self, at: Configuration<'_>, out: &mut [f64]) {
        let Configuration { t, q, .. } = at;
        let mut sizes = vec![0.0; self.dim()];
        self.coordinate_sizes(q, &mut sizes);
        out.fill(0.0);
        self.jacobian(t, q, &mut RowSums { sizes: &sizes, out });
        let first = 6 * self.description.bodies.len();
        for (row, size) in self.rows.iter().zip(&mut out[first..]) {
            *size += row.target_size(at);
        }
    }

    fn angle_count(&self) -> usize {
        self.angles.len()
    }

    fn unwrap_angles(&self, q: &[f64], angles: &mut [f64]) {
        for (slot, coordinate) in self.angles.iter().enumerate() {
            angles[slot] = coordinate.at(Configuration { t: 0.0, q, angles, internal: &[] });
        }
    }

    fn follow_angles(&self, q: &[f64], u: &[f64], angles: &mut [f64]) {
        for (slot, coordinate) in self.angles.iter().enumerate() {
            let own = self.followed[slot].and_then(|own| Some(own.sign * u.get(own.index)?));
            angles[slot] = match own {
                Some(increment) => angles[slot] + increment,
                None => coordinate.at(Configuration { t: 0.0, q, angles, internal: &[] }),
            };
        }
    }

    fn weighted_hessian(&self, _: f64, q: &[f64], w: &[f64], scale: f64, out: &mut dyn Entries) {
        let bodies = self.description.bodies.len();
        for k in 0..bodies {
            let weights = &w[6 * k..6 * k + 6];
            directors::internal_weighted_hessian(weights, scale, 12 * k, out);
        }
        for (row, weight) in self.rows.iter().zip(&w[6 * bodies..]) {
            row.emit_second(q, scale * weight, out);
        }
    }
}
