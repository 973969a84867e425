//! Constraints on velocities whose factors and rate follow from a law of the configuration.
//!
//! ```text
//! h A_d = Σ_k c_k(ȳ) Δx_k − h b(t_{n+1/2}, ȳ),     A = Σ_k c_k(y) ∇x_k
//! y of [`Input`]: coordinates and points, in a step at its middle
//! ```
//! The step is symmetric, as its inputs are. An angle among the inputs has its principal value:
//! factors and rate are to have its period.
//!
//! Source: J. Cortés, S. Martínez, Nonlinearity 14 (2001) 1365.

use super::evaluation::ReadingLaw;
use super::input::Input;
use crate::constraint::joint_coordinate::JointCoordinate;
use crate::constraint::velocity_constraint::{Pace, VelocityConstraint, WrenchVisitor};
use crate::pair::Twist;
use nalgebra::Vector3;
use vi_core::interval::{Interval, StepChange};
use vi_core::sparse::Entries;
use vi_core::{Configuration, Motion};

/// `Σ_k c_k(y) ẋ_k = b(t, y)`.
#[derive(Clone, Debug)]
pub struct LawOfRates {
    /// The quantities whose rates are weighed.
    pub paces: Vec<Pace>,
    /// Its efforts are `c_k`, then `b`; its inputs are the time, coordinates and points.
    pub reading: ReadingLaw,
    /// Whether `b` may be other than zero.
    pub is_driven: bool,
}

impl LawOfRates {
    /// `Σ_j g_j ∂y_j/∂q`, entry by entry.
    fn for_each_slope(
        &self,
        q: &[f64],
        slope: impl Fn(usize) -> f64,
        mut visit: impl FnMut(usize, f64),
    ) {
        for (j, input) in self.reading.inputs.iter().enumerate() {
            let own = slope(j);
            input.for_each_slope_by_position(q, q, &mut |i, part| visit(i, own * part));
        }
    }

    /// `∂b/∂y_j`'s place among the efforts.
    fn rate_row(&self) -> usize {
        self.paces.len()
    }
}

/// The entries of a row that are summed with a vector.
struct RowTimesVector<'a> {
    v: &'a [f64],
    sum: f64,
}

impl RowTimesVector<'_> {
    fn add(&mut self, i: usize, slope: f64) {
        self.sum += slope * self.v[i];
    }
}

impl VelocityConstraint for LawOfRates {
    /// With a wrench of zero on the frames of inputs, too: a step feels them.
    fn for_each_wrench(&self, q: &[f64], visit: &mut WrenchVisitor<'_>) {
        for input in &self.reading.inputs {
            match input {
                Input::Coordinate(own) => {
                    own.for_each_wrench(q, |frame, _| visit(frame, Twist::zero()));
                }
                Input::Point(form, _) => form.for_each_wrench(q, &Vector3::zeros(), &mut *visit),
                _ => {}
            }
        }
        self.reading.with_values_at_node(Motion::new(0.0, q, q), |work| {
            for (pace, factor) in self.paces.iter().zip(work.efforts()) {
                pace.for_each_wrench(q, &mut |frame, w| visit(frame, scaled(*factor, &w)));
            }
        });
    }

    fn emit(&self, q: &[f64], row: usize, scale: f64, out: &mut dyn Entries) {
        self.reading.with_values_at_node(Motion::new(0.0, q, q), |work| {
            for (pace, factor) in self.paces.iter().zip(work.efforts()) {
                pace.for_each_slope(q, |i, slope| out.add(row, i, scale * factor * slope));
            }
        });
    }

    fn second(&self, q: &[f64], v: &[f64], w: &[f64]) -> f64 {
        self.reading.with_slopes_at_node(Motion::new(0.0, q, q), |work| {
            let term = |(k, pace): (usize, &Pace)| {
                let mut along = RowTimesVector { v, sum: 0.0 };
                self.for_each_slope(q, |j| work.slope(k, j), |i, slope| along.add(i, slope));
                work.efforts()[k] * pace.second(q, v, w) + along.sum * pace.rate(q, w)
            };
            self.paces.iter().enumerate().map(term).sum()
        })
    }

    fn emit_second(&self, q: &[f64], scale: f64, out: &mut dyn Entries) {
        self.reading.with_slopes_at_node(Motion::new(0.0, q, q), |work| {
            for (k, pace) in self.paces.iter().enumerate() {
                pace.emit_second(q, scale * work.efforts()[k], out);
                pace.for_each_slope(q, |row, own| {
                    self.for_each_slope(
                        q,
                        |j| work.slope(k, j),
                        |column, slope| out.add(row, column, scale * own * slope),
                    );
                });
            }
        });
    }

    fn rate(&self, at: Configuration<'_>) -> f64 {
        let row = self.rate_row();
        self.reading.with_values_at_node(at.moving(at.q), |work| work.efforts()[row])
    }

    fn rate_change(&self, at: Motion<'_>) -> f64 {
        let row = self.rate_row();
        self.reading.with_slopes_at_node(at, |work| {
            let mut along = RowTimesVector { v: at.v, sum: 0.0 };
            self.for_each_slope(at.q, |j| work.slope(row, j), |i, slope| along.add(i, slope));
            let inputs = self.reading.inputs.iter().enumerate();
            let times = inputs.filter(|(_, input)| matches!(input, Input::Time));
            along.sum + times.map(|(j, _)| work.slope(row, j)).sum::<f64>()
        })
    }

    fn emit_rate_slope(
        &self,
        at: Configuration<'_>,
        row: usize,
        scale: f64,
        out: &mut dyn Entries,
    ) {
        let own = self.rate_row();
        self.reading.with_slopes_at_node(at.moving(at.q), |work| {
            self.for_each_slope(
                at.q,
                |j| work.slope(own, j),
                |i, slope| out.add(row, i, scale * slope),
            );
        });
    }

    fn is_driven(&self) -> bool {
        self.is_driven
    }

    fn residual(&self, s: &Interval) -> f64 {
        self.reading.with_values_in_step(s, |work| {
            let efforts = work.efforts();
            let changes = self.paces.iter().zip(efforts);
            let sum: f64 = changes.map(|(pace, factor)| factor * pace.change(s)).sum();
            sum - s.h * efforts[self.rate_row()]
        })
    }

    fn reads(&self, meant: &dyn Fn(&JointCoordinate) -> bool) -> bool {
        let pace = |own: &Pace| matches!(own, Pace::Joint(own) if meant(own));
        let input = |own: &Input| matches!(own, Input::Coordinate(own) if meant(own));
        self.paces.iter().any(pace) || self.reading.inputs.iter().any(input)
    }

    /// A value that reads the time would change the velocities of the nodes as well.
    fn step_change(&self, s: &Interval, change: StepChange) -> Option<f64> {
        let row = self.rate_row();
        self.reading.with_slopes_in_step(s, |work| {
            let inputs = self.reading.inputs.iter().enumerate();
            let mut times = inputs.filter(|(_, input)| matches!(input, Input::Time));
            let reads = times.any(|(j, _)| (0..=row).any(|k| work.slope(k, j) != 0.0));
            (!reads).then(|| -change.length * work.efforts()[row])
        })
    }

    fn for_each_wrench_of_step(&self, s: &Interval, visit: &mut WrenchVisitor<'_>) {
        self.reading.with_slopes_in_step(s, |work| {
            for (pace, factor) in self.paces.iter().zip(work.efforts()) {
                pace.for_each_wrench_of_step(s, &mut |frame, w| visit(frame, scaled(*factor, &w)));
            }
            for (j, input) in self.reading.inputs.iter().enumerate() {
                let of_factor = |(k, pace): (usize, &Pace)| work.slope(k, j) * pace.change(s);
                let by_factors: f64 = self.paces.iter().enumerate().map(of_factor).sum();
                // inputs are means of both ends
                let half = 0.5 * (by_factors - s.h * work.slope(self.rate_row(), j));
                match input {
                    Input::Coordinate(own) => {
                        own.for_each_wrench(&s.q1, |frame, w| visit(frame, scaled(half, &w)));
                    }
                    Input::Point(form, axis) => {
                        let along = half * Vector3::ith(*axis, 1.0);
                        form.for_each_wrench(&s.q1, &along, &mut *visit);
                    }
                    _ => {}
                }
            }
        });
    }
}

fn scaled(factor: f64, w: &Twist) -> Twist {
    Twist::new(factor * w.linear, factor * w.angular)
}
