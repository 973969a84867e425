//! Sizes by which residuals, forces and increments are measured.

use super::EquilibriumEquations;
use vi_core::MechanicalSystem;
use vi_core::linear::norm_inf;

impl EquilibriumEquations {
    fn points(&self) -> impl Iterator<Item = &[f64]> {
        let description = self.mechanism.description();
        let (bodies, size) = (description.bodies.len(), description.dimension.max(1));
        let (frames, particles) = self.s.q0.split_at(12 * bodies);
        frames.chunks_exact(12).map(|frame| &frame[..3]).chain(particles.chunks_exact(size))
    }

    /// Largest distance of a point from the origin, m: the scale of round-off.
    pub(crate) fn reach(&self) -> f64 {
        self.points().map(norm_inf).fold(0.0, f64::max)
    }

    /// Diagonal of the box that holds all points and joints at the last equilibrium, m; 1 for a
    /// point.
    pub(crate) fn size(&self) -> f64 {
        let joints = &self.mechanism.description().joints;
        let anchors = joints.iter().map(|joint| joint.parent.point().at(&self.s.q0));
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        let mut widen = |point: &[f64]| {
            for (i, x) in point.iter().enumerate() {
                (low[i], high[i]) = (low[i].min(*x), high[i].max(*x));
            }
        };
        self.points().for_each(&mut widen);
        anchors.for_each(|anchor| widen(anchor.as_slice()));
        let sides = low.iter().zip(&high).map(|(low, high)| (high - low).max(0.0));
        let size = sides.map(|side| side * side).sum::<f64>().sqrt();
        if size > 0.0 && size.is_finite() { size } else { 1.0 }
    }

    /// Largest entry of the diagonal of the stiffness last filled, in the metric `S`, N/m.
    pub(super) fn stiffest(&self) -> f64 {
        let diagonal = self.stiffness.diagonal().iter().zip(&self.metric);
        diagonal.map(|(k, s)| (k / s).abs()).fold(0.0, f64::max)
    }

    /// Forces that round-off in the configuration causes, N: what moves the stiffest direction by a
    /// few bits of the size. Premise: the tangent has been filled.
    pub(crate) fn round_off(&self) -> f64 {
        50.0 * f64::EPSILON * self.stiffest() * self.size()
    }

    /// Largest of the forces that balance one another, N.
    pub(crate) fn force_scale(&mut self) -> f64 {
        let (at, n) = (self.here(), self.s.dim());
        let mut out = vec![0.0; n];
        self.system.add_force(at.moving(&self.v), &mut out);
        let applied = norm_inf(&out);
        out.fill(0.0);
        self.system.add_potential_gradient(at, 1.0, &mut out);
        let mut largest = applied.max(norm_inf(&out));
        if let Some(field) = &self.rotation {
            out.fill(0.0);
            field.add_inertia(self.system.mass(), &self.v, &mut out);
            largest = largest.max(norm_inf(&out));
        }
        largest
    }

    /// `Σ S u u'/d` of unknowns `(u, …)`, m².
    pub(crate) fn product(&self, x: &[f64], y: &[f64]) -> f64 {
        let sum: f64 = self.metric.iter().zip(x).zip(y).map(|((s, x), y)| s * x * y).sum();
        sum / self.metric.len().max(1) as f64
    }
}
