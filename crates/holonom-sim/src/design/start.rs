//! How the start of a run changes with a parameter.
//!
//! ```text
//! δq* of stated positions, δv* of stated velocities or of stated rates
//! δq = δq* − W⁻¹ Gᵀ μ,   G δq = −g_θ                              a projected start, at a closed one
//! δv = v̂ of the momentum M v* as it changes by M δv* + M_θ v*       where the velocity is projected
//! δp̄ = M δv + M_θ v
//! ```

use super::followed_rates::FollowedRates;
use super::{LEAVE_OUT, ModelTangent, refused};
use crate::start::How;
use crate::start::independent::{TreeCoordinate, independent};
use holonom_model::{Model, ModelError};
use vi_constraints::saddle_point::{IndependentRows, SaddlePoint};
use vi_constraints::{Constraints, InitialValues};
use vi_core::linear::norm_inf;
use vi_core::sparse::Entries;
use vi_core::{Configuration, SparseMatrix, State};
use vi_multibody::design::start::{self, StartCoordinate, StartDerivativeError, StartTangent};
use vi_multibody::design::velocity::{DifferentiatedVelocity, NodeMass};
use vi_multibody::mechanism::Mechanism;

/// Part of the change of a row from which on a constraint counts as open.
const OPEN: f64 = 1e-8;

/// By how much stated positions may differ from the start, for them to be closed, m.
const CLOSED: f64 = 1e-6;

/// Change of a rate from one pass to the next, in parts of the largest one, that is rounding.
const SETTLED: f64 = 1e-13;

/// What is given of a joint at the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GivenJoint {
    pub(crate) joint: usize,
    pub(crate) freedom: usize,
    pub(crate) coordinate: bool,
    pub(crate) rate: bool,
}

/// How a start changes at which coordinates and rates of joints are given.
pub(crate) struct GivenStart {
    /// By parameters.
    pub(crate) parameters: Vec<StartTangent>,
    /// By each coordinate and its rate.
    pub(crate) given: Vec<[StartTangent; 2]>,
}

/// What a start is of.
pub(crate) struct StartOf<'a> {
    pub(crate) model: &'a Model,
    pub(crate) mechanism: &'a Mechanism,
    pub(crate) mass: &'a SparseMatrix,
    pub(crate) rows: &'a IndependentRows,
    pub(crate) at: InitialValues<'a>,
    /// `v*`, as it is before it is projected.
    pub(crate) stated_v: &'a [f64],
    pub(crate) how: How,
    /// The coordinates that are given or kept where joints are given; none on trees.
    pub(crate) kept: &'a [TreeCoordinate],
}

impl StartOf<'_> {
    /// The coordinates that determine the start, with joint and freedom.
    ///
    /// # Errors
    /// [`ModelError`] where the tree has none that do.
    pub(crate) fn coordinates(&self) -> Result<Vec<TreeCoordinate>, ModelError> {
        self.coordinates_with(&[])
    }

    /// The same with coordinates of joints before all others.
    ///
    /// # Errors
    /// As of [`StartOf::coordinates`].
    pub(crate) fn coordinates_with(
        &self,
        first: &[GivenJoint],
    ) -> Result<Vec<TreeCoordinate>, ModelError> {
        if !self.kept.is_empty() {
            return Ok(self.kept.to_vec());
        }
        let first: Vec<_> = first.iter().map(|own| (own.joint, own.freedom)).collect();
        let first = &first[..];
        let chosen = independent(self.model, self.mechanism, self.rows, self.at, first);
        chosen.map_err(|_| {
            let what = "derivatives by initial values of what has no joint coordinates";
            refused("model", what, "leave `initial` out of --by")
        })
    }

    /// How the start changes with a parameter.
    ///
    /// # Errors
    /// [`ModelError`] where it does not stay on the constraints, or a projection is not known.
    pub(crate) fn change(&self, own: &ModelTangent) -> Result<StartTangent, ModelError> {
        let Self { model, mechanism, mass, at, .. } = *self;
        if self.how == How::WithRates {
            return self.kept_rates(own);
        }
        let mut q = own.q.clone();
        let none = vec![0.0; q.len()];
        let [open, _] = self.opened(own, [&q, &none])?;
        if let Some(row) = self.largest(&open, &q) {
            self.must_project(row, &own.name, "positions")?;
            let stated = mechanism.initial_configuration();
            let moved = stated.iter().zip(at.q).any(|(a, b)| (a - b).abs() > CLOSED);
            if moved
                || (0..q.len()).any(|i| !mass.column(i).any(|(row, mass)| row == i && mass > 0.0))
            {
                let what = format!("the derivative of a projected start by `{}`", own.name);
                let help = "state positions that are closed, by expressions of the parameter";
                return Err(refused("simulation.project_start", what, help));
            }
            self.correct(&open, &mut q, &own.name)?;
        }
        self.stays_mobile(own, &q)?;
        let by_rates = model.joints.iter().any(|joint| joint.rate.is_some());
        let mut v = if by_rates { self.by_rates(own, &q)? } else { own.v.clone() };
        let [_, open] = self.opened(own, [&q, &v])?;
        let opens = self.largest(&open, &v);
        if let Some(row) = opens {
            self.must_project(row, &own.name, "velocities")?;
        }
        if opens.is_some() || self.stated_v != at.v {
            v = self.projected_velocity(own, [&q, &v])?;
        }
        let mut p = vec![0.0; q.len()];
        mass.mul_add(1.0, &v, &mut p);
        start::add_mass_change(mechanism, &own.numbers, at.v, &mut p);
        Ok(StartTangent { q, v, p })
    }

    /// `δq` and `δv` of a start that is closed and moves as stated.
    ///
    /// # Errors
    /// [`ModelError`] where it does not stay so.
    pub(super) fn stated_change(&self, own: &ModelTangent) -> Result<[Vec<f64>; 2], ModelError> {
        let (q, none) = (own.q.clone(), vec![0.0; own.q.len()]);
        let refuse = |key: &str| {
            let what = format!(
                "the derivative by `{}`, which the initial velocities or positions do not follow",
                own.name
            );
            let help = format!("state them by expressions of `{}`", own.name);
            Err(refused(key, what, help))
        };
        let [open, _] = self.opened(own, [&q, &none])?;
        if let Some(row) = self.largest(&open, &q) {
            return refuse(&self.key(self.mechanism.constraint_name(row)));
        }
        let stated = |joint: &holonom_model::Joint| joint.rate.is_some();
        if !self.model.joints.iter().any(stated) {
            return Ok([q, own.v.clone()]);
        }
        let v = self.by_rates_of(own, &q, self.rows, &self.coordinates()?)?;
        for (k, joint) in self.model.joints.iter().enumerate().filter(|(_, own)| stated(own)) {
            for freedom in 0..joint.pair().dof() {
                let Some(coordinate) = self.mechanism.known_coordinate(k, freedom) else {
                    continue;
                };
                let coordinate = StartCoordinate::Joint(Box::new(coordinate));
                let numbers = &own.numbers;
                let [_, rate] =
                    start::stated_change(self.mechanism, numbers, &coordinate, self.at, [&q, &v]);
                let slope = own.rates.iter().find(|own| (own.0, own.1) == (k, freedom));
                let slope = slope.map_or(0.0, |own| own.2);
                if (rate - slope).abs() > OPEN * norm_inf(&v).max(1.0) {
                    return refuse(&format!("joint.{}.rate", joint.name));
                }
            }
        }
        Ok([q, v])
    }

    /// How a start changes at which coordinates and rates of some joints are given, by parameters
    /// and by these. What is not given is that of the start of the model, `own`.
    ///
    /// # Errors
    /// [`ModelError`] where the given ones do not determine the start with others, or a parameter
    /// opens a redundant loop.
    pub(crate) fn given(
        &self,
        own: &StartOf<'_>,
        tangents: &[ModelTangent],
        first: &[GivenJoint],
    ) -> Result<GivenStart, ModelError> {
        let chosen = self.coordinates_with(first)?;
        let of = |given: &GivenJoint| {
            let is_own =
                |own: &TreeCoordinate| (own.0, own.1) == (Some(given.joint), given.freedom);
            chosen.iter().position(is_own)
        };
        let mut places = Vec::new();
        for given in first {
            let Some(place) = of(given) else {
                let name = &self.model.joints[given.joint].name;
                let what = format!("the start of `{name}`, which follows from that of others");
                let help =
                    "name as many joints as there are degrees of freedom, none that closes a loop";
                return Err(refused("identify.initial", what, help));
            };
            places.push(place);
        }
        if first.iter().any(|own| own.coordinate) {
            self.refuse_free_rotations(&chosen)?;
        }
        let plain: Vec<StartCoordinate> = chosen.iter().map(|x| x.2.clone()).collect();
        let numbers: Vec<_> = tangents.iter().map(|own| own.numbers.clone()).collect();
        let Self { mechanism, mass, rows, at, .. } = *self;
        let none = ModelTangent::default();
        let found = start::derivatives(mechanism, mass, rows, at, &plain, &numbers);
        let found = found.map_err(|error| {
            let own = match &error {
                StartDerivativeError::Opens { parameter, .. } => &tangents[*parameter],
                _ => tangents.first().unwrap_or(&none),
            };
            self.refusal(&error, own)
        })?;
        let is_given = |k: usize| {
            let own = places.iter().position(|place| *place == k).map(|k| first[k]);
            own.map_or([false; 2], |own| [own.coordinate, own.rate])
        };
        let mut parameters = found.parameters;
        for (tangent, change) in tangents.iter().zip(&mut parameters) {
            self.stays_mobile(tangent, &change.q)?;
            if (0..chosen.len()).all(|k| is_given(k) == [true; 2]) {
                continue;
            }
            let by = own.change_of(tangent)?;
            for (k, coordinate) in plain.iter().enumerate() {
                let [value, rate] = start::stated_change(
                    mechanism,
                    &tangent.numbers,
                    coordinate,
                    own.at,
                    [&by.q, &by.v],
                );
                let [coordinate, of_rate] = is_given(k);
                change.add(if coordinate { 0.0 } else { value }, &found.coordinates[k]);
                change.add(if of_rate { 0.0 } else { rate }, &found.rates[k]);
            }
        }
        let of = |k: &usize| [found.coordinates[*k].clone(), found.rates[*k].clone()];
        Ok(GivenStart { parameters, given: places.iter().map(of).collect() })
    }

    /// How the start of the model itself changes, for what is not given.
    fn change_of(&self, own: &ModelTangent) -> Result<StartTangent, ModelError> {
        match self.how {
            How::Relaxed { .. } => {
                let what = format!(
                    "the derivative by `{}` of a relaxed start at which joints are given",
                    own.name
                );
                Err(refused("simulation.start", what, "write start = \"stated\""))
            }
            _ => self.change(own),
        }
    }

    /// Refuses rotations in loops that are free about some axes alone: where they lead depends on
    /// the way.
    fn refuse_free_rotations(&self, chosen: &[TreeCoordinate]) -> Result<(), ModelError> {
        let turn = |own: &TreeCoordinate| match &own.2 {
            StartCoordinate::Turn { frame, parent, .. } => Some((*frame, *parent)),
            _ => None,
        };
        for own in chosen {
            let Some(frames) = turn(own) else { continue };
            if chosen.iter().filter(|other| turn(other) == Some(frames)).count() < 3 {
                let body = &self.mechanism.description().bodies[frames.0].name;
                let what = format!("the start of joints of a loop in which `{body}` turns freely");
                let help = "let a universal joint take the place of a spherical one there";
                return Err(refused("identify.initial", what, help));
            }
        }
        Ok(())
    }

    /// A start that is closed and keeps the stated rates of joints: their coordinates are kept as
    /// well, and are as many as the degrees of freedom.
    fn kept_rates(&self, own: &ModelTangent) -> Result<StartTangent, ModelError> {
        let chosen = self.rated(own)?;
        let plain: Vec<StartCoordinate> = chosen.iter().map(|x| x.2.clone()).collect();
        let numbers = std::slice::from_ref(&own.numbers);
        let Self { mechanism, mass, rows, at, .. } = *self;
        let found = start::derivatives(mechanism, mass, rows, at, &plain, numbers);
        let found = found.map_err(|error| self.refusal(&error, own))?;
        let mut change = found.parameters.into_iter().next().unwrap_or_default();
        self.stays_mobile(own, &change.q)?;
        for ((joint, freedom, _), by) in chosen.iter().zip(&found.rates) {
            let stated = own.rates.iter().find(|(k, f, _)| (Some(*k), *f) == (*joint, *freedom));
            let slope = stated.map_or(0.0, |own| own.2);
            change.add(slope, by);
        }
        Ok(change)
    }

    /// The independent coordinates where the rates of all of them are stated.
    fn rated(&self, own: &ModelTangent) -> Result<Vec<TreeCoordinate>, ModelError> {
        let chosen = self.coordinates()?;
        let stated = |joint: &Option<usize>| {
            let joint = joint.and_then(|k| self.model.joints.get(k));
            joint.is_some_and(|joint| joint.rate.is_some())
        };
        let plain: Vec<StartCoordinate> = chosen.iter().map(|x| x.2.clone()).collect();
        let free = start::free_rates(self.mechanism, self.rows, self.at, &plain);
        let free = free.map_err(|error| self.refusal(&error.into(), own))?;
        if free.iter().all(|&k| stated(&chosen[k].0)) {
            return Ok(chosen);
        }
        let what =
            format!("the derivative by `{}` of velocities that are projected freely", own.name);
        let help = "state the rates of as many joints as there are degrees of freedom";
        Err(refused("simulation.project_start", what, help))
    }

    /// Refuses a parameter by which constraints that are redundant do not stay so: along velocities
    /// that the mechanism has, their rates open.
    pub(super) fn stays_mobile(&self, own: &ModelTangent, dq: &[f64]) -> Result<(), ModelError> {
        let moves = !(own.numbers.joints.is_empty() && own.numbers.scalars.is_empty());
        if self.rows.redundant().next().is_none() || !moves {
            return Ok(());
        }
        let plain: Vec<StartCoordinate> = self.coordinates()?.into_iter().map(|x| x.2).collect();
        let ways = start::derivatives(self.mechanism, self.mass, self.rows, self.at, &plain, &[])
            .map_err(|error| self.refusal(&error, own))?;
        let mut v = self.at.v.to_vec();
        for (k, way) in ways.rates.iter().enumerate() {
            let scale = 1.0 / (1.0 + k as f64);
            v.iter_mut().zip(&way.v).for_each(|(v, way)| *v += scale * way);
        }
        let at = InitialValues::new(self.at.t, self.at.q, &v);
        let still = vec![0.0; dq.len()];
        let [_, open] = start::opened(self.mechanism, at, &own.numbers, [dq, &still])
            .map_err(|error| self.refusal(&error, own))?;
        let mut change = still.clone();
        self.correct(&open, &mut change, &own.name)
    }

    pub(super) fn opened(
        &self,
        own: &ModelTangent,
        change: [&[f64]; 2],
    ) -> Result<[Vec<f64>; 2], ModelError> {
        let found = start::opened(self.mechanism, self.at, &own.numbers, change);
        found.map_err(|error| self.refusal(&error, own))
    }

    /// The row that opens most, if any does.
    pub(super) fn largest(&self, open: &[f64], change: &[f64]) -> Option<usize> {
        let allowed = OPEN * norm_inf(change).max(norm_inf(self.at.v)).max(1.0);
        let worst = (0..open.len()).max_by(|&a, &b| open[a].abs().total_cmp(&open[b].abs()))?;
        (open[worst].abs() > allowed).then_some(worst)
    }

    /// Refuses a start that leaves the constraints where it may not be projected.
    fn must_project(&self, row: usize, parameter: &str, what: &str) -> Result<(), ModelError> {
        if self.model.settings.project_start {
            return Ok(());
        }
        let name = self.mechanism.constraint_name(row);
        let message = format!(
            "the derivative by `{parameter}`: the initial {what} do not follow it, `{name}` opens"
        );
        let help = format!(
            "state the initial {what} by expressions of `{parameter}`, or write project_start = true"
        );
        Err(refused(&self.key(name), message, help))
    }

    /// `δv` of the projected velocity where the start changes by `dq`, the stated velocity by `dv`.
    fn projected_velocity(
        &self,
        own: &ModelTangent,
        [dq, dv]: [&[f64]; 2],
    ) -> Result<Vec<f64>, ModelError> {
        let Self { mechanism, mass, rows, at, .. } = *self;
        let [mut p, mut dp] = [vec![0.0; dq.len()], vec![0.0; dq.len()]];
        mass.mul_add(1.0, self.stated_v, &mut p);
        mass.mul_add(1.0, dv, &mut dp);
        start::add_mass_change(mechanism, &own.numbers, self.stated_v, &mut dp);
        let numbers = std::slice::from_ref(&own.numbers);
        let velocity = DifferentiatedVelocity::new(mechanism, rows, numbers)
            .map_err(StartDerivativeError::from);
        let mut velocity = velocity.map_err(|error| self.refusal(&error, own))?;
        let state = State::new(at.t, at.q.to_vec(), p);
        let configuration = Configuration::new(at.t, at.q);
        let singular = |error| self.refusal(&StartDerivativeError::from(error), own);
        velocity.find(mechanism, NodeMass::Constant(mass), &state).map_err(singular)?;
        let found = velocity.change(mechanism, configuration, Some(0), [dq, &dp, &[]]);
        let found = found.map_err(singular)?.to_vec();
        let [_, left] = self.opened(own, [dq, &found])?;
        match self.largest(&left, &found) {
            Some(row) => Err(self.opens(mechanism.constraint_name(row), &own.name)),
            None => Ok(found),
        }
    }

    /// `x ← x − W⁻¹ Gᵀ μ` with `G δx` = what is open.
    fn correct(&self, open: &[f64], x: &mut [f64], parameter: &str) -> Result<(), ModelError> {
        let n = x.len();
        let mut solver = SaddlePoint::new(n, self.rows.clone());
        let emit = |out: &mut dyn Entries| self.mass.emit(out);
        let at = Configuration::new(self.at.t, self.at.q);
        let mut found = vec![0.0; n + self.rows.len()];
        let solved = solver.solve_at(self.mechanism, &emit, at, &vec![0.0; n], open, &mut found);
        solved.map_err(|error| {
            let what = format!("the derivative of the start by `{parameter}`: {error}");
            refused("simulation.project_start", what, "state closed positions")
        })?;
        x.iter_mut().zip(&found[..n]).for_each(|(x, by)| *x -= by);
        let mut left = open.to_vec();
        left.iter_mut().for_each(|x| *x = -*x);
        self.mechanism.add_rates(self.at.t, self.at.q, &found[..n], &mut left);
        let size = norm_inf(open);
        match self.largest(&left, &found[..n]).filter(|&row| left[row].abs() > OPEN * size) {
            Some(row) => Err(self.opens(self.mechanism.constraint_name(row), parameter)),
            None => Ok(()),
        }
    }

    /// A parameter that opens a redundant loop.
    pub(super) fn opens(&self, name: &str, parameter: &str) -> ModelError {
        let loops: Vec<String> = self
            .mechanism
            .cut_joints()
            .iter()
            .map(|&k| format!("`{}`", self.mechanism.description().joints[k].name))
            .collect();
        let what = format!(
            "the derivative by `{parameter}`: no neighbouring mechanism closes, its redundant \
             constraints open at `{name}`"
        );
        let help = format!(
            "change the axes or places of all joints of the loop through {} together, by expressions \
             of `{parameter}`",
            loops.join(", ")
        );
        refused(&self.key(name), what, help)
    }

    /// The key of what has this name.
    fn key(&self, name: &str) -> String {
        match self.model.joint(name) {
            Some(_) => format!("joint.{name}"),
            None => format!("constraint.{name}"),
        }
    }

    pub(crate) fn refusal(&self, error: &StartDerivativeError, own: &ModelTangent) -> ModelError {
        match error {
            StartDerivativeError::Opens { name, .. } => self.opens(name, &own.name),
            _ => {
                let what = format!("the derivative by `{}`: {error}", own.name);
                refused("model", what, LEAVE_OUT)
            }
        }
    }

    /// `δv` where joints state rates. What moves with other parts takes their `δv`, pass by pass.
    /// Beside constraints on velocities those of all joints of the tree, as the model states them.
    fn by_rates(&self, own: &ModelTangent, dq: &[f64]) -> Result<Vec<f64>, ModelError> {
        if self.mechanism.has_velocity_constraints() {
            let all = StartCoordinate::of_tree(self.mechanism);
            return self.by_rates_of(own, dq, &start::of_tree(self.mechanism), &all);
        }
        let closed = self.mechanism.has_loops();
        let chosen = if closed { self.rated(own)? } else { self.coordinates()? };
        self.by_rates_of(own, dq, self.rows, &chosen)
    }

    /// The same of these independent coordinates with their rows.
    fn by_rates_of(
        &self,
        own: &ModelTangent,
        dq: &[f64],
        rows: &IndependentRows,
        chosen: &[TreeCoordinate],
    ) -> Result<Vec<f64>, ModelError> {
        let coordinates: Vec<StartCoordinate> = chosen.iter().map(|own| own.2.clone()).collect();
        let Self { model, mechanism, at, .. } = *self;
        let follow = FollowedRates { model, mechanism, at, own, dq };
        let mut rates = follow.of_all(chosen, &own.v);
        // as many passes as there are parts that move with others
        for _ in 0..=coordinates.len() {
            let numbers = (&own.numbers, dq);
            let found =
                start::velocity(self.mechanism, rows, self.at, &coordinates, numbers, &rates);
            let found = found.map_err(|error| self.refusal(&error, own))?;
            let next = follow.of_all(chosen, &found);
            let change = rates.iter().zip(&next).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            if change <= SETTLED * norm_inf(&next) {
                return Ok(found);
            }
            rates = next;
        }
        let what =
            format!("the derivative by `{}` of velocities that depend on each other", own.name);
        Err(refused("joint", what, "state the rates of joints alone"))
    }
}
