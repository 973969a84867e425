//! The independent coordinates of a start of which some joints are given.

use super::independent::{TreeCoordinate, independent};
use holonom_model::Model;
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::{Constraints, InitialValues};
use vi_multibody::design::start::{self as equations, StartCoordinate};
use vi_multibody::mechanism::Mechanism;
use vi_multibody::run::IndependentLoops;

/// How far loops may be open where they count as closed, m, and their rates, m/s.
pub(super) const CLOSED: f64 = 1e-12;

/// A joint of the model, and which of its coordinates.
pub(super) type JointAndCoordinate = (usize, usize);

/// What is given of a coordinate.
fn given(own: &TreeCoordinate, values: &[(JointAndCoordinate, f64)]) -> Option<f64> {
    let is_own =
        |(place, _): &&(JointAndCoordinate, f64)| (own.0, own.1) == (Some(place.0), place.1);
    values.iter().find(is_own).map(|(_, value)| *value)
}

/// The independent coordinates of a closed mechanism, and what they are at the model's own start.
pub(super) struct IndependentCoordinates<'a> {
    model: &'a Model,
    mechanism: &'a Mechanism,
    first: Vec<(usize, usize)>, // those that are given: joint, freedom
    pub(super) chosen: Vec<TreeCoordinate>, // none before they are needed, or if none do
    own: [Vec<f64>; 2],         // q, v of the model's own start
    carried: Vec<StartCoordinate>, // rotations that the tree does not carry along
}

impl<'a> IndependentCoordinates<'a> {
    pub(super) fn new(
        model: &'a Model,
        mechanism: &'a Mechanism,
        given: impl Iterator<Item = JointAndCoordinate>,
        own: [Vec<f64>; 2],
    ) -> Self {
        let mut first: Vec<_> = given.collect();
        first.sort_unstable();
        first.dedup();
        let all = StartCoordinate::of_tree(mechanism).into_iter().map(|own| own.2);
        let carried = all.filter(StartCoordinate::is_carried).collect();
        Self { model, mechanism, first, chosen: Vec::new(), own, carried }
    }

    /// Whether rotations of bodies relative to those that carry them are what they were.
    pub(super) fn turn_along(&self, q: &[f64]) -> bool {
        self.carried.iter().all(|own| own.turned_from(&self.own[0], q) <= CLOSED)
    }

    /// The same of their rates.
    pub(super) fn spin_along(&self, q: &[f64], v: &[f64]) -> bool {
        let [own_q, own_v] = &self.own;
        let keeps = |own: &StartCoordinate| {
            let was = own.rate(own_q, own_v);
            (own.rate(q, v) - was).abs() <= CLOSED * was.abs().max(1.0)
        };
        self.carried.iter().all(keeps)
    }

    /// Chooses coordinates at `q`, unless there are as many as are needed.
    fn choose(&mut self, rows: &IndependentRows, q: &[f64]) -> Option<Vec<StartCoordinate>> {
        let Self { model, mechanism, first, chosen, .. } = self;
        let of_positions = equations::of_positions(mechanism, rows).len();
        if chosen.len() + of_positions != mechanism.dim() {
            let at = InitialValues::new(0.0, q, q);
            *chosen = independent(model, mechanism, rows, at, first).ok()?;
        }
        Some(chosen.iter().map(|own| own.2.clone()).collect())
    }

    /// The configuration next to `q` with what is given; `None` where coordinates do not determine
    /// it.
    pub(super) fn place(
        &mut self,
        q: &[f64],
        values: &[(JointAndCoordinate, f64)],
    ) -> Option<Result<Vec<f64>, String>> {
        let rows = rows_at(self.mechanism, q)?;
        let chosen = self.choose(&rows, q)?;
        let value =
            |own: &TreeCoordinate| given(own, values).unwrap_or_else(|| own.2.at(&self.own[0]));
        let values: Vec<f64> = self.chosen.iter().map(value).collect();
        let at = InitialValues::new(0.0, q, &self.own[1]);
        let found =
            equations::configuration(self.mechanism, &rows, at, &chosen, (&values, &self.own[0]));
        Some(found.map_err(|error| error.to_string()))
    }

    /// The velocity at `q` with what is given; `None` where coordinates do not determine it.
    pub(super) fn velocity(
        &mut self,
        q: &[f64],
        rates: &[(JointAndCoordinate, f64)],
    ) -> Option<Result<Vec<f64>, String>> {
        let rows = rows_at(self.mechanism, q)?;
        let chosen = self.choose(&rows, q)?;
        let [own_q, own_v] = &self.own;
        let rate =
            |own: &TreeCoordinate| given(own, rates).unwrap_or_else(|| own.2.rate(own_q, own_v));
        let rates: Vec<f64> = self.chosen.iter().map(rate).collect();
        let at = InitialValues::new(0.0, q, own_v);
        let found = equations::velocities(self.mechanism, &rows, at, &chosen, &rates);
        Some(found.map_err(|error| error.to_string()))
    }
}

/// Independent rows of a configuration.
fn rows_at(mechanism: &Mechanism, q: &[f64]) -> Option<IndependentRows> {
    let loops = IndependentLoops::find(mechanism, 0.0, q).ok()?;
    Some(loops.rows_at_start.unwrap_or(loops.rows))
}
