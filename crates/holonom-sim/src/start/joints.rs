//! A run that begins at other coordinates and rates of joints than its model states.
//!
//! ```text
//! q ← F_d(Δu, q)                 along the spanning tree, Δu of what is given
//! g(q) = 0,  x(q) = z            where loops stay open, or a spherical joint turns its child
//! v = P(q) ν                     ν of the model's own start, with the rates that are given
//! G v + ∂g/∂t = 0,  ∇x v = ż     where loops do not move so, or a spherical joint turns otherwise
//! ```
//! `x`: independent coordinates, those that are given first; the others keep the values and rates
//! that they have at the model's own start, which is projected where the model says so. The way is
//! taken in parts of at most [`PART`], so that closed loops stay on their branch. An angle counts
//! modulo a revolution, unless the angles of a state are given as well.
//!
//! Where coordinates do not determine the start, the closest configuration and velocity with what
//! is given are taken (`Π`, `Π_M`).

use super::others::{CLOSED, IndependentCoordinates};
use super::{How, StartValues};
use crate::assembly::{self, closure};
use crate::system::coordinate::check_coordinate;
use crate::system::input::nothing;
use crate::system::outside::{ExternalActions, OutsideMotion};
use crate::system::{self, System};
use holonom_model::{Constraint, Model, ModelError, MotionPath, Problem};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;
use std::sync::Arc;
use vi_constraints::initialization::start;
use vi_constraints::{Constraints, InitialValues, Reparametrization};
use vi_core::coordinate_force::SignedUnknown;
use vi_core::{Configuration, Interval};
use vi_multibody::held_effort::HeldEffort;
use vi_multibody::joint_coordinate::JointCoordinate;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::run::IndependentLoops;
use vi_multibody::tree_map::TreeMap;

/// The longest part of a way, m or rad.
const PART: f64 = 0.2;
/// By how much a coordinate or a rate may miss what is given, relative to its size and 1.
const TOLERANCE: f64 = 1e-9;

/// A coordinate of a joint with what is given for it.
struct Given<'a> {
    joint: &'a str,
    place: (usize, usize), // of the model, and which of its coordinates
    freedom: usize,
    coordinate: JointCoordinate,
    unknown: Option<SignedUnknown>,
    value: f64,
}

impl<'a> Given<'a> {
    fn all(
        list: &'a [(String, usize, f64)],
        key: &str,
        model: &Model,
        mechanism: &Mechanism,
    ) -> Result<Vec<Self>, ModelError> {
        let joints = &mechanism.description().joints;
        let one = |(name, freedom, value): &'a (String, usize, f64)| {
            let Some(joint) = model.joint(name) else {
                let known = model.joints.iter().map(|joint| joint.name.as_str());
                return Err(nothing(key, name, "joint", known));
            };
            check_coordinate(joint, *freedom, key.to_owned())?;
            if !value.is_finite() {
                let message = format!("{name}: {value} is not finite");
                return Err(ModelError::Assembly(vec![Problem::new(key, message)]));
            }
            let own = joints.iter().find(|own| own.name == *name);
            let found = own.and_then(|own| {
                let coordinate = JointCoordinate::principal(own, *freedom)?;
                Some((coordinate, mechanism.tree().unknown_of(own, *freedom)))
            });
            let Some((coordinate, unknown)) = found else {
                let message = format!("`{name}` has no coordinate that could be given");
                return Err(ModelError::Assembly(vec![Problem::new(key, message)]));
            };
            let of_model = model.joints.iter().position(|own| own.name == *name);
            let place = (of_model.unwrap_or_default(), *freedom); // it has one
            Ok(Self { joint: name, place, freedom: *freedom, coordinate, unknown, value: *value })
        };
        list.iter().map(one).collect()
    }

    fn at(&self, q: &[f64]) -> f64 {
        self.coordinate.at(Configuration::new(0.0, q))
    }

    /// A value with the revolutions that the coordinate has at `q` by its principal value.
    fn next_to(&self, q: &[f64], value: f64) -> f64 {
        match self.coordinate.is_angle() {
            true => value - revolutions(self.at(q), value),
            false => value,
        }
    }

    fn name(&self) -> String {
        match self.freedom {
            0 => self.joint.to_owned(),
            freedom => format!("{}.{freedom}", self.joint),
        }
    }
}

/// The start with the coordinates and rates of joints that are given.
pub(super) fn begun(
    model: &Model,
    mechanism: &Mechanism,
    outside: &ExternalActions,
    from: StartValues,
) -> Result<StartValues, ModelError> {
    let given = &outside.start;
    let places = Given::all(&given.coordinates, "joints", model, mechanism)?;
    let rates = Given::all(&given.rates, "rates", model, mechanism)?;
    let tree = TreeMap::new(mechanism);
    let given = places.iter().chain(&rates).map(|given| given.place);
    let mut others =
        IndependentCoordinates::new(model, mechanism, given, [from.q.clone(), from.v.clone()]);
    let mut nu = rates_of_tree(&tree, &from.q, &from.v);
    let q = placed(model, (mechanism, &tree), outside, (&places, &mut others), from.q)?;
    for rate in &rates {
        if let Some(SignedUnknown { index, sign }) = rate.unknown {
            nu[index] = sign * rate.value;
        }
    }
    let v = velocities_of_tree(&tree, &q, nu);
    let v = moving(model, mechanism, outside, (&rates, &mut others), (&q, v))?;
    let angles = revolved(mechanism, &outside.angles, &places, &q);
    Ok(StartValues { q, v, angles, kept: others.chosen, ..from })
}

/// `from` on the constraints, where the model projects it.
pub(super) fn projected(model: &Model, from: StartValues) -> Result<StartValues, ModelError> {
    if !model.settings.project_start || from.how != How::Stated {
        return Ok(from);
    }
    let found =
        Driven::new(model, &ExternalActions::default(), &[])?.project(&from.q, &from.v, &[]);
    let (q, v) = found.map_err(|why| {
        let message = format!("the start cannot be projected: {why}");
        ModelError::Assembly(vec![Problem::new("simulation.project_start", message)])
    })?;
    Ok(StartValues { q, v, ..from })
}

/// The angles at the start with the revolutions of a state, where it is given: those of the joints
/// that are given, and of the others.
fn revolved(mechanism: &Mechanism, of_state: &[f64], places: &[Given<'_>], q: &[f64]) -> Vec<f64> {
    let mut angles = of_state.to_vec();
    if angles.len() != mechanism.angle_count() {
        return Vec::new();
    }
    let joints = &mechanism.description().joints;
    for place in places {
        let joint = joints.iter().position(|own| own.name == place.joint);
        let own = joint.and_then(|joint| mechanism.known_coordinate(joint, place.freedom));
        if let Some(angle) = own.as_ref().and_then(|own| own.angle_among(&mut angles)) {
            *angle = place.value;
        }
    }
    mechanism.unwrap_angles(q, &mut angles);
    angles
}

/// `v = P(q) ν` with the rates `ν` that velocities `v_old` have at `q_old`.
pub(super) fn carried(mechanism: &Mechanism, q_old: &[f64], v_old: &[f64], q: &[f64]) -> Vec<f64> {
    let tree = TreeMap::new(mechanism);
    velocities_of_tree(&tree, q, rates_of_tree(&tree, q_old, v_old))
}

fn velocities_of_tree(tree: &TreeMap, q: &[f64], nu: DVector<f64>) -> Vec<f64> {
    let mut map = DMatrix::zeros(q.len(), tree.dof());
    tree.null_space(q, &mut map);
    (map * nu).iter().copied().collect()
}

/// `ν` of velocities that a tree has: `argmin |P ν − v|`.
fn rates_of_tree(tree: &TreeMap, q: &[f64], v: &[f64]) -> DVector<f64> {
    let dof = tree.dof();
    if v.iter().all(|v| *v == 0.0) {
        return DVector::zeros(dof);
    }
    let mut map = DMatrix::zeros(q.len(), dof);
    tree.null_space(q, &mut map);
    let right = map.tr_mul(&DVector::from_column_slice(v));
    let gram = map.tr_mul(&map);
    gram.cholesky().map_or_else(|| DVector::zeros(dof), |gram| gram.solve(&right))
}

/// The configuration in which joints have the coordinates given.
fn placed(
    model: &Model,
    (mechanism, tree): (&Mechanism, &TreeMap),
    outside: &ExternalActions,
    (places, others): (&[Given<'_>], &mut IndependentCoordinates<'_>),
    mut q: Vec<f64>,
) -> Result<Vec<f64>, ModelError> {
    if places.is_empty() {
        return Ok(q);
    }
    let names: Vec<String> = places.iter().map(|place| format!("`{}`", place.name())).collect();
    let refused = |why: String| {
        let message = format!("{} cannot be brought to what is given: {why}", names.join(", "));
        let help = "give fewer joints: those of a closed loop and of prescribed motions follow from the others; or values that can be reached";
        ModelError::Assembly(vec![Problem::new("joints", message).help(help)])
    };
    let from: Vec<f64> = places.iter().map(|place| place.at(&q)).collect();
    // whole revolutions lead back
    let whole = |place: &Given<'_>, way: f64| match place.coordinate.is_angle() {
        true => TAU * (way / TAU).trunc(),
        false => 0.0,
    };
    let ways = || {
        let all = places.iter().zip(&from).map(|(place, from)| (place, place.value - from));
        all.map(|(place, way)| way - whole(place, way))
    };
    let parts = (ways().fold(0.0_f64, |most, way| most.max(way.abs())) / PART).ceil().max(1.0);
    let mut driven = None;
    let mut u = vec![0.0; tree.dof()];
    let mut s = Interval::new(q.len());
    for part in 1..=parts as u64 {
        u.fill(0.0);
        for (place, way) in places.iter().zip(ways()) {
            if let Some(SignedUnknown { index, sign }) = place.unknown {
                u[index] = sign * way / parts;
            }
        }
        s.open(0.0, 1.0, &q);
        tree.reparametrize(&u, &mut s).map_err(|fault| refused(format!("{fault:?}")))?;
        q.copy_from_slice(&s.q1);
        tree.clean(0.0, &mut q);
        let share = part as f64 / parts;
        let reached: Vec<f64> =
            from.iter().zip(ways()).map(|(from, way)| from + share * way).collect();
        let on_way = |q: &[f64], tolerance: f64| {
            let near = |(place, value): (&Given<'_>, &f64)| is_near(place.at(q), *value);
            let open = closure(mechanism, q, &vec![0.0; q.len()]).position;
            open <= tolerance && places.iter().zip(&reached).all(near)
        };
        let tolerance = model.settings.start_tolerance;
        if on_way(&q, tolerance.min(CLOSED)) && others.turn_along(&q) {
            continue;
        }
        let given = places.iter().map(|given| given.place);
        let values: Vec<_> = given.zip(reached.iter().copied()).collect();
        if let Some(found) = others.place(&q, &values) {
            q = found.map_err(&refused)?;
            if !on_way(&q, tolerance) {
                return Err(refused("loops stay open".into()));
            }
            continue;
        }
        let driven = match &mut driven {
            Some(driven) => driven,
            none => none.insert(Driven::new(model, outside, places)?),
        };
        let next = |(place, value): (&Given<'_>, &f64)| [place.next_to(&q, *value), 0.0];
        let at: Vec<[f64; 2]> = places.iter().zip(&reached).map(next).collect();
        let still = vec![0.0; q.len()];
        q = driven.project(&q, &still, &at).map_err(&refused)?.0;
        if !on_way(&q, tolerance) {
            return Err(refused("loops stay open".into()));
        }
    }
    Ok(q)
}

/// The whole revolutions from one angle to next to another, rad.
fn revolutions(from: f64, to: f64) -> f64 {
    TAU * ((to - from) / TAU).round()
}

/// Whether a coordinate has a value, an angle up to whole revolutions.
fn is_near(found: f64, value: f64) -> bool {
    let apart = (found + revolutions(found, value) - value).abs();
    apart.min((found - value).abs()) <= TOLERANCE * value.abs().max(1.0)
}

/// The velocities in which joints have the rates given; `v` where nothing contradicts.
fn moving(
    model: &Model,
    mechanism: &Mechanism,
    outside: &ExternalActions,
    (rates, others): (&[Given<'_>], &mut IndependentCoordinates<'_>),
    (q, v): (&[f64], Vec<f64>),
) -> Result<Vec<f64>, ModelError> {
    let tolerance = model.settings.start_tolerance;
    let kept = |v: &[f64], tolerance: f64| {
        let near = |rate: &Given<'_>| {
            (rate.coordinate.rate(q, v) - rate.value).abs() <= TOLERANCE * rate.value.abs().max(1.0)
        };
        assembly::velocity_inconsistencies(mechanism, q, v, tolerance).is_empty()
            && rates.iter().all(near)
    };
    if kept(&v, tolerance.min(CLOSED)) && others.spin_along(q, &v) {
        return Ok(v);
    }
    let given: Vec<_> = rates.iter().map(|rate| (rate.place, rate.value)).collect();
    let found = match others.velocity(q, &given) {
        Some(found) => found,
        None => {
            let at: Vec<[f64; 2]> = rates.iter().map(|rate| [rate.at(q), rate.value]).collect();
            Driven::new(model, outside, rates)?.project(q, &v, &at).map(|found| found.1)
        }
    };
    match found {
        Ok(v) if kept(&v, tolerance) => Ok(v),
        found => {
            let names: Vec<String> =
                rates.iter().map(|rate| format!("`{}`", rate.name())).collect();
            let why = found.err().map_or_else(String::new, |why| format!(": {why}"));
            let message =
                format!("no initial velocities have the rates given for {}{why}", names.join(", "));
            let help = "give fewer rates: the others follow from the constraints";
            Err(ModelError::Assembly(vec![Problem::new("rates", message).help(help)]))
        }
    }
}

/// A mechanism that is otherwise the same, with prescribed motions of some joint coordinates.
struct Driven {
    system: System,
    held: Vec<[HeldEffort; 2]>, // value and rate of each
}

impl Driven {
    fn new(
        model: &Model,
        outside: &ExternalActions,
        given: &[Given<'_>],
    ) -> Result<Self, ModelError> {
        let (mut model, mut outside) = (model.clone(), outside.clone());
        let held: Vec<[HeldEffort; 2]> = given.iter().map(|_| Default::default()).collect();
        for (given, held) in given.iter().zip(&held) {
            let (name, held) = (format!("start of {}", given.name()), held.clone());
            let (joint, freedom) = (given.joint.to_owned(), given.freedom);
            let path = MotionPath::default();
            let motion = Constraint::Motion { name: name.clone(), joint, freedom, path };
            model.constraints.push(motion);
            let path = Arc::new(move |t| {
                let [value, rate] = held.each_ref().map(HeldEffort::get);
                [value + rate * t, rate, 0.0]
            });
            outside.motions.push(OutsideMotion { constraint: name, path });
        }
        Ok(Self { system: system::build_with(&model, &outside)?, held })
    }

    /// The projection of `(q, v)` with values and rates of the coordinates.
    fn project(
        &mut self,
        q: &[f64],
        v: &[f64],
        at: &[[f64; 2]],
    ) -> Result<(Vec<f64>, Vec<f64>), String> {
        for (held, at) in self.held.iter().zip(at) {
            held.iter().zip(at).for_each(|(held, at)| held.set(*at));
        }
        let System { mechanism, dynamics, .. } = &self.system;
        let system = dynamics.variational(mechanism);
        let loops = IndependentLoops::find(mechanism, 0.0, q).map_err(|error| error.to_string())?;
        let mechanism = mechanism.clone().accepting(loops.nearly_redundant());
        let rows = loops.rows_at_start.unwrap_or(loops.rows);
        let found = start(&system, &mechanism, &rows, InitialValues::new(0.0, q, v));
        let found = found.map_err(|error| error.to_string())?;
        Ok((found.state.q, found.v))
    }
}
