//! A force on a point mass, with fixed spatial components and a history in time.
//!
//! ```text
//! f(t) = c(t) F        on the position of the point mass
//! ```

use nalgebra::Vector3;
use vi_core::Motion;
use vi_core::force::{Force, NoTimeSlope};
use vi_core::sparse::Entries;
use vi_rigid::time_history::TimeHistory;

/// `c(t) F`, N.
#[derive(Clone, Debug, PartialEq)]
pub struct ParticleLoad {
    /// First coordinate of the point mass.
    pub offset: usize,
    /// Number of its coordinates, 2 or 3.
    pub dimension: usize,
    /// `F`, N.
    pub force: Vector3<f64>,
    /// `c`.
    pub history: TimeHistory,
}

impl Force for ParticleLoad {
    fn add(&self, Motion { t, .. }: Motion<'_>, scale: f64, out: &mut [f64]) {
        let scale = scale * self.history.value(t);
        let own = &mut out[self.offset..self.offset + self.dimension];
        own.iter_mut().zip(&self.force).for_each(|(out, f)| *out += scale * f);
    }
    fn add_position_derivative(&self, _at: Motion<'_>, _scale: f64, _out: &mut dyn Entries) {}
    fn add_velocity_derivative(&self, _at: Motion<'_>, _scale: f64, _out: &mut dyn Entries) {}
    fn add_time_derivative(
        &self,
        Motion { t, .. }: Motion<'_>,
        scale: f64,
        out: &mut [f64],
    ) -> Result<(), NoTimeSlope> {
        let scale = scale * self.history.slope(t).ok_or(NoTimeSlope)?;
        let own = &mut out[self.offset..self.offset + self.dimension];
        own.iter_mut().zip(&self.force).for_each(|(out, f)| *out += scale * f);
        Ok(())
    }
    fn is_dissipative(&self) -> bool {
        false
    }
}
