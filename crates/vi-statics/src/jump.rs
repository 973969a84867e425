//! Jumps to another equilibrium: a step that changes more than its bounds, or against its
//! prediction.

use crate::limit::{angle_between, rotation_angle};
use crate::problem::StaticProblem;
use crate::step_bounds::{StepBounds, StepFailure};
use vi_rigid::directors;

impl StaticProblem {
    /// Refuses increments much larger than the tangent at the last equilibrium predicts, or against
    /// it.
    pub(crate) fn compare(&self, prediction: &[f64]) -> Result<(), StepFailure> {
        let norm = |x: &[f64]| self.work.product(x, x).sqrt();
        let (found, predicted) = (norm(&self.x), norm(prediction));
        if found <= 1e-6 * self.work.size() || self.bounds.prediction.is_infinite() {
            return Ok(());
        }
        if found > self.bounds.prediction * predicted {
            let times = found / predicted;
            let what = format!(
                "the increment is {times:.1} times that predicted by the tangent stiffness"
            );
            return Err(StepFailure::Jump(what));
        }
        if self.work.product(&self.x, prediction) < 0.0 {
            let what =
                "the increment is opposite to that predicted by the tangent stiffness".into();
            return Err(StepFailure::Jump(what));
        }
        Ok(())
    }

    /// Refuses a configuration last evaluated that is too far from the last equilibrium.
    pub(crate) fn refuse_jump(&self, bounds: &StepBounds) -> Result<(), StepFailure> {
        let s = &self.work.s;
        for (element, (nodes, _)) in self.neighbours.iter().enumerate() {
            let change = angle_between(*nodes, &s.q1) - angle_between(*nodes, &s.q0);
            if change.abs() > bounds.bending {
                let what = format!("element {element} bends by {change:.3} rad in one step");
                return Err(StepFailure::Jump(what));
            }
        }
        let description = self.work.mechanism.description();
        let farthest = bounds.displacement * self.work.size();
        for (k, body) in description.bodies.iter().enumerate() {
            let (before, after) = (&s.q0[12 * k..12 * k + 12], &s.q1[12 * k..12 * k + 12]);
            let displacement = (directors::center(after) - directors::center(before)).norm();
            let angle = rotation_angle(after, before);
            if displacement > farthest || (!self.elastic[k] && angle > bounds.rotation) {
                let name = &body.name;
                let what =
                    format!("`{name}` moves by {displacement:.3} m and {angle:.3} rad in one step");
                return Err(StepFailure::Jump(what));
            }
        }
        for (k, particle) in description.particles.iter().enumerate() {
            let at = self.work.mechanism.particle_offset(k);
            let own = at..at + description.dimension;
            let displacement = own.map(|j| (s.q1[j] - s.q0[j]).powi(2)).sum::<f64>().sqrt();
            if displacement > farthest {
                let name = &particle.name;
                let what = format!("`{name}` moves by {displacement:.3} m in one step");
                return Err(StepFailure::Jump(what));
            }
        }
        Ok(())
    }
}
