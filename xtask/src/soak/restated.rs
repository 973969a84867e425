//! A mechanism stated otherwise ([`super::restate`]) moves, and its joints pull, as before.
//!
//! ```text
//! turned, moved     x' = R x + s,   forces and moments f' = R f
//! reordered         the same
//! in other units    lengths l, masses m, times t: forces m l/t², moments m l²/t², rates of lengths l/t, of angles 1/t
//! ```
//! Coordinates, rates, efforts and reactions of all joints are compared at every node, relative to the largest of their kind in the run.

use super::defects::Defect;
use super::fault::{Fault, FaultKind};
use super::invariants::bounds::RESTATED;
use super::invariants::{Measured, within};
use super::repeat::amplification;
use super::restate::{Displacement, Units, displaced, in_units, reordered};
use super::trace::{Trace, trace};
use holonom::model::{Constraint, JointKind, ReactionFrame, Sensor, SensorKind};
use holonom::nalgebra::{Matrix3, Vector3};
use holonom::sensor::{Column, columns};
use holonom::{MemberKind, Model, Sample, Simulation};

/// How a mechanism is stated otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Statement {
    /// Turned and moved as a whole.
    Displaced(Displacement),
    /// With its parts in the opposite order.
    Reordered,
    /// In other units.
    Units(Units),
}

impl Statement {
    /// All that are tried.
    #[must_use]
    pub fn all() -> [Self; 6] {
        // a rotation of rational numbers: (7, 4, −4, 1)/9 and a permutation of axes
        let rotation = Matrix3::new(7.0, -4.0, 4.0, 4.0, -1.0, -8.0, 4.0, 8.0, 1.0) / 9.0;
        let units = |length: i32, mass: i32, time: i32| {
            let [length, mass, time] = [length, mass, time].map(|k| 2.0_f64.powi(k));
            Self::Units(Units { length, mass, time })
        };
        [
            Self::Displaced(Displacement { rotation, shift: Vector3::zeros() }),
            Self::Displaced(Displacement {
                rotation: Matrix3::identity(),
                shift: Vector3::new(1.5, -2.0, 0.75),
            }),
            Self::Reordered,
            units(10, 0, -6),
            units(-10, -20, 0),
            units(0, 20, 10),
        ]
    }

    /// In a word.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Displaced(by) if by.shift == Vector3::zeros() => "turned",
            Self::Displaced(_) => "moved",
            Self::Reordered => "reordered",
            Self::Units(_) => "in other units",
        }
    }

    fn of(self, model: &Model) -> Model {
        match self {
            Self::Displaced(by) => displaced(model, &by),
            Self::Reordered => reordered(model),
            Self::Units(units) => in_units(model, units),
        }
    }
}

/// The model with sensors of all that joints, bars and constraints do.
#[must_use]
pub fn observed(model: &Model) -> Model {
    let mut new = model.clone();
    new.sensors.clear();
    let mut add = |kind: SensorKind, of: &str, frame: Option<ReactionFrame>| {
        let name = format!("sensor{}", new.sensors.len());
        let of = of.to_owned();
        new.sensors.push(Sensor {
            name,
            kind,
            of,
            point: None,
            seen_from: None,
            to: None,
            point_to: None,
            element: None,
            at: None,
            frame,
        });
    };
    for joint in &model.joints {
        if joint.kind != JointKind::Fixed {
            add(SensorKind::JointCoordinate, &joint.name, None);
            add(SensorKind::JointRate, &joint.name, None);
        }
        if joint.spring.is_some() || joint.damper.is_some() || joint.motor.is_some() {
            add(SensorKind::Effort, &joint.name, None);
        }
        add(SensorKind::Reaction, &joint.name, Some(ReactionFrame::Space));
    }
    model.bars.iter().for_each(|bar| add(SensorKind::Reaction, &bar.name, None));
    for constraint in &model.constraints {
        let effort = match constraint {
            Constraint::Gear { .. } | Constraint::Motion { .. } | Constraint::Distance { .. } => {
                true
            }
            Constraint::PointOnLine { .. } | Constraint::PointOnPlane { .. } => false,
        };
        if effort {
            add(SensorKind::Effort, constraint.name(), None);
        }
    }
    new
}

/// Numbers of a node of one kind: places, or a unit.
type Numbers = Vec<(&'static str, f64)>;

/// What is compared at a node: places of all members and numbers of sensors, as the model states them.
struct Reader {
    members: Vec<(String, MemberKind)>,
    columns: Vec<(&'static str, bool)>, // unit; whether it begins a vector in space
    statement: Option<Statement>,
}

impl Reader {
    fn new(simulation: &Simulation, model: &Model, statement: Option<Statement>) -> Self {
        let members = simulation.members().iter().map(|m| (m.name.clone(), m.kind)).collect();
        let columns = columns(model);
        let spatial = |sensor: &str| {
            let own = model.sensors.iter().find(|own| own.name == sensor);
            own.is_some_and(|own| match own.kind {
                SensorKind::Reaction => own.frame.is_some(),
                SensorKind::JointCoordinate | SensorKind::JointRate => {
                    let joint = model.joints.iter().find(|joint| joint.name == own.of);
                    joint.is_some_and(|joint| joint.kind == JointKind::Spherical)
                }
                _ => false,
            })
        };
        let begins = |part: &str| ["fx", "mx", "x"].contains(&part);
        let column = |c: &Column| (c.unit, begins(&c.part) && spatial(&c.sensor));
        Self { members, columns: columns.iter().map(column).collect(), statement }
    }

    /// The numbers of a node, by name of the member and in the order of the sensors, restated as those of the first model.
    fn read(&self, sample: &Sample) -> Numbers {
        let back = |vector: [f64; 3], is_place: bool| -> [f64; 3] {
            match self.statement {
                Some(Statement::Displaced(by)) => {
                    let shift = if is_place { by.shift } else { Vector3::zeros() };
                    by.rotation.tr_mul(&(Vector3::from(vector) - shift)).into()
                }
                _ => vector,
            }
        };
        let factor = |unit: &str| match self.statement {
            Some(Statement::Units(units)) => 1.0 / units.of_unit(unit),
            _ => 1.0,
        };
        let mut places: Vec<(&String, Numbers)> = Vec::new();
        let mut at = 0;
        for (name, kind) in &self.members {
            let (coordinates, dimension) = match kind {
                MemberKind::Frame => (12, 3),
                MemberKind::Particle3 => (3, 3),
                MemberKind::Particle2 => (2, 2),
            };
            let mut place = [0.0; 3];
            place[..dimension].copy_from_slice(&sample.q[at..at + dimension]);
            let place = if dimension == 3 { back(place, true) } else { place };
            places.push((name, place.map(|x| ("place", x * factor("m"))).to_vec()));
            at += coordinates;
        }
        places.sort_by_key(|(name, _)| *name);
        let mut numbers: Numbers = places.into_iter().flat_map(|(_, place)| place).collect();
        let mut k = 0;
        while k < self.columns.len() {
            let (unit, begins) = self.columns[k];
            if begins {
                let vector = back(std::array::from_fn(|i| sample.sensors[k + i]), false);
                numbers.extend(vector.map(|x| (unit, x * factor(unit))));
                k += 3;
            } else {
                numbers.push((unit, sample.sensors[k] * factor(unit)));
                k += 1;
            }
        }
        numbers
    }
}

/// A run of a model with its numbers at all nodes, as those of the first model; `None` where it does not reach its end.
fn numbers(
    model: &Model,
    statement: Option<Statement>,
    defect: Option<Defect>,
) -> Result<Option<Vec<Numbers>>, String> {
    let mut simulation = Simulation::new(model).map_err(|error| error.to_string())?;
    let reader = Reader::new(&simulation, model, statement);
    let mut found = trace(&mut simulation);
    if let Some(statement) = statement {
        Defect::restate(defect, statement, &mut found);
    }
    let Trace { samples, failure } = found;
    let believed = samples.iter().all(|sample| sample.notice.is_none());
    let whole = failure.is_none() && believed;
    Ok(whole.then(|| samples.iter().map(|sample| reader.read(sample)).collect()))
}

/// The largest difference of two runs, of each kind relative to the largest number of that kind and no less than `floor`, in
/// words.
fn distance(one: &[Numbers], other: &[Numbers], floor: &dyn Fn(&str) -> f64) -> (f64, String) {
    let mut worst = (0.0_f64, String::new());
    let mut sizes = std::collections::BTreeMap::<&str, f64>::new();
    for (unit, x) in one.iter().flatten().filter(|(_, x)| x.is_finite()) {
        let size = sizes.entry(unit).or_insert_with(|| floor(unit));
        *size = size.max(x.abs());
    }
    for (step, (a, b)) in one.iter().zip(other).enumerate() {
        for (k, ((unit, a), (_, b))) in a.iter().zip(b).enumerate() {
            let both = a.is_nan() && b.is_nan(); // not unique
            let size = sizes.get(unit).copied().unwrap_or(1.0);
            let apart = if both { 0.0 } else { (a - b).abs() / size };
            if apart.is_nan() || apart > worst.0 {
                worst =
                    (apart, format!("at step {step}, number {k} ({unit}): {b:e} instead of {a:e}"));
            }
        }
    }
    worst
}

/// Whether the mechanism does the same however it is stated.
///
/// # Errors
/// [`FaultKind::Restated`].
pub(super) fn restated(
    model: &Model,
    measured: &mut Measured,
    defect: Option<Defect>,
) -> Result<(), Fault> {
    let model = observed(model);
    let Ok(Some(expected)) = numbers(&model, None, None) else { return Ok(()) };
    let floor = floor(&model);
    let mut amplified = None;
    for statement in Statement::all() {
        let other = Defect::stated(defect, statement.of(&model));
        let name = statement.name();
        let wrong = |words: String| Fault::new(FaultKind::Restated, format!("{name}: {words}"));
        let found = match numbers(&other, Some(statement), defect) {
            Ok(Some(found)) => found,
            Ok(None) => continue,
            Err(refusal) => return Err(wrong(format!("refused: {refusal}"))),
        };
        let (apart, words) = distance(&expected, &found, &floor);
        let mut bound = RESTATED;
        if apart.is_nan() || apart > bound {
            let by =
                *amplified.get_or_insert_with(|| amplification(&model).unwrap_or(f64::INFINITY));
            bound = bound.max(f64::EPSILON * by);
        }
        if bound <= RESTATED {
            measured.restated = Some(measured.restated.unwrap_or(0.0).max(apart));
        }
        within(
            FaultKind::Restated,
            apart,
            bound,
            &format!("{name}, {words}: relative difference"),
        )?;
    }
    Ok(())
}

/// The largest difference that a model shows when it is stated otherwise.
///
/// # Errors
/// [`FaultKind::Restated`] beyond the bound.
pub fn largest_difference(model: &Model) -> Result<Option<f64>, Fault> {
    let mut measured = Measured::default();
    restated(model, &mut measured, None)?;
    Ok(measured.restated)
}

/// The least size of numbers of a unit: of forces and moments `m l/(h · 1 s)` and `m l²/(h · 1 s)` with the mass and size of the mechanism,
/// of which momenta that are differenced once keep `ε`, in parts of the bound; of the rest 1.
fn floor(model: &Model) -> impl Fn(&str) -> f64 + use<> {
    const ROUNDING: f64 = 1e3 * f64::EPSILON / RESTATED;
    let bodies = model.bodies.iter().map(|body| body.mass());
    let mass: f64 = bodies.chain(model.particles.iter().map(|particle| particle.mass)).sum();
    let length = 4.0; // m: mechanisms are drawn so
    let force = ROUNDING * mass.max(0.1) * length / model.settings.step;
    move |unit: &str| match unit {
        "N" => force,
        "N·m" => force * length,
        _ => 1.0,
    }
}
