//! A mechanism stated otherwise ([`super::restate`]) moves, and its joints pull, as before.
//!
//! ```text
//! turned, moved     x' = R x + s,   forces and moments f' = R f
//! reordered         the same
//! in other units    lengths l, masses m, times t: forces m l/t², moments m l²/t², rates of lengths l/t, of angles 1/t
//! ```
//! Coordinates, rates, efforts and reactions of all joints are compared at every node, relative to
//! the largest of their kind in the run. Reactions are read along axes that turn with the
//! mechanism: in a redundant loop one component may be unique and another not. Those of joints
//! without an axis are vectors in space, which count as not unique where any component is not.

use super::defects::SoakDefect;
use super::fault::{FaultKind, Violation};
use super::invariants::bounds::RESTATED;
use super::invariants::{InvariantErrors, within};
use super::repeat::amplification;
use super::statement::Statement;
use super::trace::{Trace, trace};
use holonom::model::{Constraint, Joint, JointKind, ReactionFrame, Scheme, Sensor, SensorKind};
use holonom::nalgebra::Vector3;
use holonom::sensor::{SensorColumn, columns};
use holonom::vi_multibody::joint::complete_axis;
use holonom::{MemberKind, Model, Sample, Simulation};

/// The model with sensors of all that joints, bars and constraints do; axes that complete a joint
/// frame in space are stated.
#[must_use]
pub fn observed(model: &Model) -> Model {
    let mut new = model.clone();
    for joint in new.joints.iter_mut().filter(|joint| has_frame_in_space(joint)) {
        let axis = Vector3::from(joint.axis.unwrap_or_default()).normalize();
        joint.first_axis = Some(complete_axis(&axis).column(0).into_owned().into());
    }
    new.sensors.clear();
    let mut add = |kind: SensorKind, of: &str, frame: Option<ReactionFrame>| {
        let name = format!("sensor{}", new.sensors.len());
        new.sensors.push(Sensor { frame, ..Sensor::new(name, kind, of.to_owned()) });
    };
    for joint in &model.joints {
        if joint.kind != JointKind::Fixed {
            add(SensorKind::JointCoordinate, &joint.name, None);
            add(SensorKind::JointRate, &joint.name, None);
        }
        if joint.spring.is_some() || joint.damper.is_some() || joint.motor.is_some() {
            add(SensorKind::Effort, &joint.name, None);
        }
        let frame = if joint.kind.has_axis() { None } else { Some(ReactionFrame::Space) };
        add(SensorKind::Reaction, &joint.name, frame);
    }
    model.bars.iter().for_each(|bar| add(SensorKind::Reaction, &bar.name, None));
    for constraint in &model.constraints {
        let effort = match constraint {
            Constraint::Gear { .. } | Constraint::Motion { .. } | Constraint::Distance { .. } => {
                true
            }
            Constraint::Velocity { .. } => true,
            Constraint::PointOnLine { .. } | Constraint::PointOnPlane { .. } => false,
            Constraint::Rolling { .. } | Constraint::Blade { .. } => false,
        };
        if effort {
            add(SensorKind::Effort, constraint.name(), None);
        }
    }
    new
}

/// Whether the frame of a joint with an axis is completed in space; that of a planar pair is, by
/// default, in a body.
fn has_frame_in_space(joint: &Joint) -> bool {
    joint.kind.has_first_axis() && joint.kind != JointKind::Planar && joint.first_axis.is_none()
}

/// Numbers of a node of one kind: places, or a unit.
type NodeNumbers = Vec<(&'static str, f64)>;

/// What is compared at a node: places of all members and numbers of sensors, as the model states
/// them.
struct RestatedReader {
    members: Vec<(String, MemberKind)>,
    columns: Vec<(&'static str, bool)>, // unit; whether it begins a vector in space
    statement: Option<Statement>,
}

impl RestatedReader {
    fn new(simulation: &Simulation, model: &Model, statement: Option<Statement>) -> Self {
        let members = simulation.members().iter().map(|m| (m.name.clone(), m.kind)).collect();
        let columns = columns(model);
        let spatial = |sensor: &str| {
            let own = model.sensors.iter().find(|own| own.name == sensor);
            own.is_some_and(|own| match own.kind {
                SensorKind::Reaction => own.frame.is_some(),
                SensorKind::JointCoordinate | SensorKind::JointRate => {
                    let joint = model.joint(&own.of);
                    joint.is_some_and(|joint| joint.kind == JointKind::Spherical)
                }
                _ => false,
            })
        };
        let begins = |part: &str| ["fx", "mx", "x"].contains(&part);
        let column = |c: &SensorColumn| (c.unit, begins(&c.part) && spatial(&c.sensor));
        Self { members, columns: columns.iter().map(column).collect(), statement }
    }

    /// The numbers of a node, by name of the member and in the order of the sensors, restated as
    /// those of the first model.
    fn read(&self, sample: &Sample) -> NodeNumbers {
        let back = |vector: [f64; 3], is_place: bool| -> [f64; 3] {
            if vector.iter().any(|x| x.is_nan()) {
                return [f64::NAN; 3];
            }
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
        let mut places: Vec<(&String, NodeNumbers)> = Vec::new();
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
        let mut numbers: NodeNumbers = places.into_iter().flat_map(|(_, place)| place).collect();
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

/// A run of a model with its numbers at all nodes, as those of the first model; `None` where it
/// does not reach its end.
fn numbers(
    model: &Model,
    statement: Option<Statement>,
    defect: Option<SoakDefect>,
) -> Result<Option<Vec<NodeNumbers>>, String> {
    let mut simulation = Simulation::new(model).map_err(|error| error.to_string())?;
    let reader = RestatedReader::new(&simulation, model, statement);
    let mut found = trace(&mut simulation);
    if let Some(statement) = statement {
        SoakDefect::restate(defect, statement, &mut found);
    }
    let Trace { samples, failure, .. } = found;
    let believed = samples.iter().all(|sample| sample.notice.is_none());
    let whole = failure.is_none() && believed;
    Ok(whole.then(|| samples.iter().map(|sample| reader.read(sample)).collect()))
}

/// The largest difference of two runs, of each kind relative to the largest number of that kind and
/// no less than `floor`, in words.
fn distance(
    one: &[NodeNumbers],
    other: &[NodeNumbers],
    floor: &dyn Fn(&str) -> f64,
) -> (f64, String) {
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

/// How far a mechanism is from itself when it is stated otherwise.
struct Deviation {
    statement: &'static str,
    apart: f64, // NaN: what is unique in the one is not in the other
    words: String,
}

/// Of all statements with which the run reaches its end; none of a run that does not.
fn differences(model: &Model, defect: Option<SoakDefect>) -> Result<Vec<Deviation>, Violation> {
    let Ok(Some(expected)) = numbers(model, None, None) else { return Ok(Vec::new()) };
    let floor = floor(model);
    let mut all = Vec::new();
    for own in Statement::all() {
        let other = SoakDefect::stated(defect, own.of(model));
        let statement = own.name();
        let found = numbers(&other, Some(own), defect).map_err(|refusal| {
            Violation::new(FaultKind::Restated, format!("{statement}: refused: {refusal}"))
        })?;
        let Some(found) = found else { continue };
        let (apart, words) = distance(&expected, &found, &floor);
        all.push(Deviation { statement, apart, words });
    }
    Ok(all)
}

/// Whether the mechanism does the same however it is stated.
///
/// # Errors
/// [`FaultKind::Restated`].
pub(super) fn restated(
    model: &Model,
    measured: &mut InvariantErrors,
    defect: Option<SoakDefect>,
) -> Result<(), Violation> {
    let model = observed(model);
    let mut amplified = None;
    for Deviation { statement, apart, words } in differences(&model, defect)? {
        let mut bound = RESTATED;
        if apart > bound {
            let by =
                *amplified.get_or_insert_with(|| amplification(&model).unwrap_or(f64::INFINITY));
            // of coordinates, rates over a step
            bound = bound.max(f64::EPSILON * by / model.settings.step);
        }
        if bound <= RESTATED {
            measured.restated = Some(measured.restated.unwrap_or(0.0).max(apart));
        }
        let words = format!("{statement}, {words}: relative difference");
        within(FaultKind::Restated, apart, bound, &words)?;
    }
    Ok(())
}

/// The largest difference that a model shows when it is stated otherwise, however unstable its
/// motion; `None` where its run does not reach the end.
///
/// # Errors
/// [`FaultKind::Restated`] where it is refused.
pub fn largest_difference(model: &Model) -> Result<Option<f64>, Violation> {
    let all = differences(&observed(model), None)?;
    let larger = |a: f64, b: f64| if b <= a { a } else { b }; // NaN stays
    Ok(all.into_iter().map(|difference| difference.apart).reduce(larger))
}

/// The least size of numbers of a unit, of which their rounding is the bound: of forces and moments
/// that of inertia and of elements, with the mass and the size `l` of the mechanism; of rates those
/// of coordinates and of elements; of the rest 1.
/// ```text
/// nodal, trees   momenta are balanced to rounding and differenced once     c ε m l/(h · 0.25 s)
/// others         coordinates are rounded, and differenced twice            c ε m l/h²
/// stiffness      strains are rounded                                       c ε EA, c ε k l
/// rates          of energy–momentum schemes: errors of all N steps add up  c ε l N/h
///                of sections: impulses of rounded strains                  4 ε EA h/ρI
/// ```
/// The factor `c` is that of lever arms and members that follow one another.
fn floor(model: &Model) -> impl Fn(&str) -> f64 + use<> {
    const UNIT: f64 = f64::EPSILON / RESTATED;
    const PARTS: f64 = 256.0 * UNIT; // c ε
    const LENGTH: f64 = 4.0; // m: mechanisms are drawn so
    let settings = &model.settings;
    let h = settings.step;
    let bodies: f64 = model.bodies.iter().map(|body| body.mass()).sum();
    let points: f64 = model.particles.iter().map(|particle| particle.mass).sum();
    let springs = model.springs.iter().map(|spring| spring.stiffness * LENGTH);
    let (mut mass, mut stiffness) = ((bodies + points).max(0.1), springs.fold(0.0, f64::max));
    let mut rate = 1.0_f64;
    for section in model.beams.iter().filter_map(|beam| beam.section.numbers().ok()) {
        let own = section.stiffness().iter().copied().fold(0.0, f64::max);
        let [line, euler @ ..] = section.inertia();
        mass += line * LENGTH;
        stiffness = stiffness.max(own);
        rate = rate.max(4.0 * UNIT * own * h / euler.into_iter().fold(line, f64::min));
    }
    if settings.scheme.is_energy_momentum() {
        let steps = settings.steps() as f64 * settings.composition().gammas().len() as f64;
        rate = rate.max(PARTS * LENGTH * steps / h);
    }
    let closed = model.joints.len() > model.bodies.len()
        || !model.constraints.is_empty()
        || !model.bars.is_empty();
    let inertia = match settings.scheme {
        Scheme::Nodal if !closed => 4.0 * mass * LENGTH / h,
        _ => mass * LENGTH / (h * h),
    };
    let force = PARTS * (inertia + stiffness);
    move |unit: &str| match unit {
        "N" => force,
        "N·m" => force * LENGTH,
        "m/s" | "rad/s" => rate,
        _ => 1.0,
    }
}
