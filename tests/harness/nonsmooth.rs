//! Cases of joint stops and dry friction: nodes of the same scheme, the exact solution.

mod model_file;

use super::case::{Deviation, Runs, raise};
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;
use vi_constraints::nonsmooth::{
    ContactLaw, ContactRecord, ContactStatus, Method, NonsmoothOptions,
};
use vi_constraints::{InitialValues, Options, SchemeKind};
use vi_core::Quadrature;
use vi_multibody::builder::{
    CoordinateId, DryFriction, Inertia, JointId, JointLimits, MechanismBuilder,
};
use vi_multibody::joint_coordinate::JointCoordinate;
use vi_multibody::run::{MechanismIntegrator, Solver, integrator, with_contacts};
use vi_multibody::{FrameId, PairKind};
use vi_rigid::gap::ContactShape;

/// Velocities and impulses may be off by this many tolerances of positions.
const RATES: f64 = 100.0;
/// Gaps are closed up to this, m or rad.
const GAP: f64 = 1e-12;
/// Largest residual of the joints.
const RESIDUAL: f64 = 1e-13;

/// A case.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NonsmoothCase {
    pub name: String,
    #[serde(rename = "units")]
    _units: String,
    gravity: [f64; 3],
    bodies: Vec<BodyCase>,
    #[serde(default)]
    joints: Vec<JointCase>,
    #[serde(default)]
    contacts: Vec<ContactCase>,
    pub simulation: SimulationCase,
    discrete: Discrete,
    pub exact: BTreeMap<String, Value>,
    properties: Properties,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct BodyCase {
    name: String,
    mass: f64,
    inertia: [f64; 3],
    position: [f64; 3],
    #[serde(default = "identity")]
    matrix: [[f64; 3]; 3],
    #[serde(default)]
    velocity: [f64; 3],
    #[serde(default)]
    angular_velocity: [f64; 3],
}

fn identity() -> [[f64; 3]; 3] {
    Matrix3::identity().into()
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct JointCase {
    name: String,
    #[serde(rename = "type")]
    kind: String,
    parent: String,
    child: String,
    position: [f64; 3],
    axis: Option<[f64; 3]>,
    spring: Option<[f64; 2]>,
    friction: Option<BTreeMap<String, f64>>,
    limits: Option<LimitsCase>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct LimitsCase {
    lower: Option<f64>,
    upper: Option<f64>,
    restitution: f64,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ContactCase {
    #[serde(rename = "type")]
    kind: String,
    #[serde(default = "ground")]
    a: String,
    b: String,
    #[serde(default)]
    point: [f64; 3],
    #[serde(default)]
    normal: [f64; 3],
    #[serde(default)]
    center: [f64; 3],
    #[serde(default)]
    points: Vec<[f64; 3]>,
    #[serde(default)]
    radius: f64,
    #[serde(default)]
    radius_a: f64,
    #[serde(default)]
    radius_b: f64,
    #[serde(default)]
    friction: f64,
    #[serde(default)]
    restitution: f64,
    #[serde(default)]
    tangential_restitution: f64,
}

fn ground() -> String {
    "ground".to_owned()
}

impl ContactCase {
    fn shapes(&self) -> Result<[ContactShape; 2], String> {
        let plane = ContactShape::Plane {
            point: self.point.into(),
            normal: Vector3::from(self.normal).normalize(),
        };
        let ball = |radius| ContactShape::sphere(self.center.into(), radius);
        match self.kind.as_str() {
            "sphere-plane" => Ok([plane, ball(self.radius)]),
            "points-plane" => {
                let points = self.points.iter().map(|x| Vector3::from(*x)).collect();
                Ok([plane, ContactShape::Points { points, radius: 0.0 }])
            }
            "sphere-sphere" => Ok([ball(self.radius_a), ball(self.radius_b)]),
            kind => Err(format!("unknown contact `{kind}`")),
        }
    }

    fn law(&self) -> ContactLaw {
        let Self { friction, restitution, tangential_restitution, .. } = *self;
        match friction > 0.0 {
            true => ContactLaw::Coulomb {
                friction,
                static_friction: friction,
                restitution,
                tangential_restitution,
            },
            false => ContactLaw::Frictionless { restitution },
        }
    }
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SimulationCase {
    pub step: f64,
    pub steps: usize,
    pub method: Method,
    output_steps: Vec<usize>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Discrete {
    tolerance: f64,
    nodes: Vec<NodeCase>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct NodeCase {
    step: usize,
    t: f64,
    position: Vec<[f64; 3]>,
    directors: Vec<[[f64; 3]; 3]>,
    velocity: Vec<[f64; 3]>,
    angular_velocity: Vec<[f64; 3]>,
    #[serde(default)]
    joint_coordinates: Vec<f64>,
    #[serde(default)]
    gaps: Vec<f64>,
    #[serde(default)]
    impulses_of_the_step_before: BTreeMap<String, Vec<f64>>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Properties {
    max_nodal_work: f64,
    dissipated: f64,
    #[serde(rename = "min_gap")]
    _min_gap: Option<f64>,
    #[serde(rename = "joint_residual")]
    _joint_residual: f64,
    #[serde(rename = "impacts")]
    _impacts: u64,
    guard: u64,
    #[serde(rename = "events")]
    _events: u64,
    #[serde(rename = "momentum_drift")]
    _momentum_drift: Option<[f64; 2]>,
}

/// A run of a case, with what is read along it.
#[derive(Debug)]
pub struct NonsmoothRun {
    run: MechanismIntegrator,
    coordinates: Vec<JointCoordinate>,
    /// Time, velocity before and impulse of each impact.
    pub impacts: Vec<(f64, f64, f64)>,
    impulses: BTreeMap<String, Vector3<f64>>, // of the last step; points whose sum alone is unique
    firsts: Vec<(usize, bool)>, // first contact of each element; whether all are unique
    smallest_gap: f64,
    residual: f64,
    work: f64, // largest of a node
}

impl NonsmoothCase {
    fn frame(&self, name: &str, ids: &[vi_multibody::builder::BodyId]) -> Result<FrameId, String> {
        if name == "ground" {
            return Ok(FrameId::Ground);
        }
        let k = self.bodies.iter().position(|body| body.name == name);
        k.map(|k| ids[k].into()).ok_or_else(|| format!("unknown body `{name}`"))
    }

    /// The number of the first contact of each element, and whether the impulses of all its points
    /// are unique; of what has no place 0.
    fn firsts(&self) -> Vec<(usize, bool)> {
        let limits = self.joints.iter().filter(|joint| joint.limits.is_some()).count();
        let frictions = self.joints.iter().filter(|joint| joint.friction.is_some()).count();
        let mut firsts = vec![(usize::MAX, true); limits + frictions];
        let mut next = 0;
        for contact in &self.contacts {
            firsts.push((next, contact.points.len() <= 3));
            next += contact.points.len().max(1);
        }
        firsts
    }

    /// A run of so many steps in the place of one.
    pub fn begin(&self, finer: usize) -> Result<NonsmoothRun, String> {
        let mut builder = MechanismBuilder::new().gravity(self.gravity);
        let mut ids = Vec::new();
        for body in &self.bodies {
            let attitude = Matrix3::from_fn(|i, j| body.matrix[i][j]);
            let inertia = Inertia::principal(body.mass, body.inertia);
            let entry = builder.body(&body.name, inertia).at(body.position).attitude(attitude);
            let entry = entry.velocity(body.velocity).angular_velocity(body.angular_velocity);
            ids.push(entry.id());
        }
        let mut joints: Vec<(JointId, bool)> = Vec::new();
        for joint in &self.joints {
            let kind = PairKind::ALL.iter().find(|kind| kind.name() == joint.kind);
            let kind = *kind.ok_or_else(|| format!("unknown joint `{}`", joint.kind))?;
            let frames = (self.frame(&joint.parent, &ids)?, self.frame(&joint.child, &ids)?);
            let entry = builder.joint(&joint.name, kind, frames.0, frames.1).at(joint.position);
            let entry = match joint.axis {
                Some(axis) => entry.axis(axis),
                None => entry,
            };
            joints.push((entry.id(), kind.coordinate_count() == 1));
        }
        let coordinate = |k: usize| CoordinateId { joint: joints[k].0, freedom: 0 };
        for (k, joint) in self.joints.iter().enumerate() {
            if let Some([stiffness, rest]) = joint.spring {
                builder.joint_spring(coordinate(k), stiffness, rest);
            }
            if let Some(limits) = joint.limits {
                let LimitsCase { lower, upper, restitution } = limits;
                let limits = JointLimits { lower, upper, restitution };
                builder.joint_limits(coordinate(k), limits);
            }
            if let Some(friction) = &joint.friction {
                let number = |key: &str| friction.get(key).copied();
                let law = match (number("torque"), number("mu"), number("radius")) {
                    (Some(torque), None, None) => DryFriction::Effort(torque),
                    (None, Some(coefficient), Some(radius)) => {
                        DryFriction::Coefficient { coefficient, radius }
                    }
                    _ => return Err(format!("unknown friction of `{}`", joint.name)),
                };
                builder.joint_friction(coordinate(k), law);
            }
        }
        for contact in &self.contacts {
            let [a, b] = contact.shapes()?;
            let (on_a, on_b) = (self.frame(&contact.a, &ids)?, self.frame(&contact.b, &ids)?);
            let name = format!("contact {} {}", contact.a, contact.b);
            let added = builder.shape_contact(&name, (on_a, a), (on_b, b), contact.law());
            added.map_err(|e| e.to_string())?;
        }
        let mut built = builder.build().map_err(|e| e.to_string())?;
        let all = joints.iter().enumerate().filter(|(_, (_, has_one))| *has_one);
        let coordinates = all.filter_map(|(k, _)| built.coordinate(coordinate(k))).collect();
        let step = self.simulation.step / finer as f64;
        let options = Options::new(SchemeKind::Nodal, step);
        let (q, v) = (built.mechanism.initial_configuration(), built.mechanism.initial_velocity());
        let (at, system) = (InitialValues::new(0.0, &q, &v), built.system(Quadrature::Midpoint));
        let run = integrator(built.mechanism, system, options, Solver::Auto, at);
        let contacts =
            NonsmoothOptions { method: self.simulation.method, ..NonsmoothOptions::default() };
        let run = with_contacts(
            run.map_err(|e| e.to_string())?,
            options.scheme,
            built.forces.contacts,
            contacts,
        );
        Ok(NonsmoothRun {
            run: run.map_err(|e| e.to_string())?,
            coordinates,
            impacts: Vec::new(),
            impulses: BTreeMap::new(),
            firsts: self.firsts(),
            smallest_gap: f64::INFINITY,
            residual: 0.0,
            work: f64::NEG_INFINITY,
        })
    }

    /// Deviations of a run.
    pub fn run(&self) -> Result<Runs, String> {
        let mut run = self.begin(1)?;
        let mut deviation = Deviation::default();
        let tolerance = self.discrete.tolerance;
        let wanted: Vec<usize> = self.discrete.nodes.iter().map(|node| node.step).collect();
        if wanted != self.simulation.output_steps {
            return Err("the nodes are not those of `output_steps`".into());
        }
        let mut nodes = self.discrete.nodes.iter().peekable();
        for step in 0..=self.simulation.steps {
            if step > 0 {
                run.step()?;
            }
            if nodes.peek().is_some_and(|node| node.step == step) {
                let node = nodes.next().expect("it was seen");
                run.compare(self, node, tolerance, &mut deviation)?;
            }
        }
        let counts = run.run.state().contacts.counts;
        if counts.guarded != self.properties.guard {
            return Err(format!("{} impacts are guarded of {:?}", counts.guarded, self.properties));
        }
        let rates = RATES * tolerance;
        let energy = (run.work - self.properties.max_nodal_work).abs();
        raise(&mut deviation.energy, energy / rates);
        let lost = (counts.dissipated - self.properties.dissipated).abs();
        raise(&mut deviation.energy, lost / rates);
        raise(&mut deviation.momentum, -run.smallest_gap / GAP);
        raise(&mut deviation.momentum, run.residual / RESIDUAL);
        self.check_exact(&run)?;
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("nonsmooth").join(&self.name);
        std::fs::create_dir_all(&folder).map_err(|e| e.to_string())?;
        Ok(vec![("nodal", deviation), ("model file", self.run_model_file(&folder)?)])
    }

    /// Compares with the exact solution where a tolerance is stated.
    fn check_exact(&self, run: &NonsmoothRun) -> Result<(), String> {
        let list = |key: &str| -> Option<Vec<f64>> {
            self.exact.get(key)?.as_array()?.iter().map(Value::as_f64).collect()
        };
        let number = |key: &str| self.exact.get(key).and_then(Value::as_f64);
        if let (Some(times), Some(rates)) = (list("impact_times"), list("rates_before")) {
            let (of_times, of_rates) = (number("tolerance_times"), number("tolerance_rates"));
            let (Some(of_times), Some(of_rates)) = (of_times, of_rates) else { return Ok(()) };
            if run.impacts.len() != times.len() {
                return Err(format!("{} impacts of {}", run.impacts.len(), times.len()));
            }
            for ((found, t), rate) in run.impacts.iter().zip(times).zip(rates) {
                let off = (found.0 - t, found.1.abs() - rate);
                if !(off.0.abs() <= of_times && off.1.abs() <= of_rates) {
                    return Err(format!("impact at {t}: off by {:e} s, {:e} rad/s", off.0, off.1));
                }
            }
        }
        let tolerance = number("tolerance").unwrap_or(1e-9);
        let q = &run.run.state().q;
        if let Some(displacement) = number("displacement") {
            let start = self.bodies.iter().flat_map(|body| body.position);
            let now = q.chunks(12).flat_map(|q| q[..3].to_vec());
            let off = start.zip(now).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            let miss = (off - displacement).abs();
            if miss.is_nan() || miss > tolerance {
                return Err(format!("moved by {off:e}, not {displacement:e}"));
            }
        }
        if let Some(distance) = number("stop_distance") {
            let start = Vector3::from(self.bodies[0].position);
            let off = (Vector3::from_column_slice(&q[..3]) - start).norm() - distance;
            if off.is_nan() || off.abs() > tolerance {
                return Err(format!("it stops {off:e} m away"));
            }
        }
        Ok(())
    }
}

impl NonsmoothRun {
    /// Takes a step.
    pub fn step(&mut self) -> Result<(), String> {
        self.run.step().map_err(|e| e.to_string())?;
        let Self { run, impacts, impulses, firsts, .. } = self;
        let one = |contact: &ContactRecord| Vector3::new(contact.impulse[0], 0.0, 0.0);
        impulses.clear();
        let contacts = run.nonsmooth().expect("it has contacts");
        for (node, found) in contacts.nodes() {
            let mut work = 0.0;
            for contact in found {
                let element = &contacts.elements()[contact.id.element as usize];
                let feature = contact.id.feature;
                let (key, impulse) = match (contact.place, element.law().restitution(), feature) {
                    (Some(place), ..) => {
                        let (first, is_unique) = firsts[contact.id.element as usize];
                        let of = first + if is_unique { feature as usize } else { 0 };
                        let axes = place.axes.map(Vector3::from);
                        let along = axes.iter().zip(contact.impulse).map(|(axis, x)| axis * x);
                        (format!("contact:{of}"), along.sum())
                    }
                    (None, None, _) => (format!("friction:{}", element.name()), one(contact)),
                    (None, _, 0) => (format!("stop:{}.lower", element.name()), one(contact)),
                    (None, ..) => (format!("stop:{}.upper", element.name()), one(contact)),
                };
                *impulses.entry(key).or_default() += impulse;
                if contact.status == ContactStatus::Impact {
                    impacts.push((node.t, contact.before[0], contact.impulse[0]));
                }
                work += contact.work;
            }
            self.work = self.work.max(work);
        }
        if let Some(gap) = run.state().contacts.counts.smallest_gap {
            self.smallest_gap = gap;
        }
        let residual = run.observe_state().map_err(|e| e.to_string())?.position_residual;
        self.residual = self.residual.max(residual);
        Ok(())
    }

    /// The joint coordinates.
    pub fn coordinates(&self) -> Vec<f64> {
        let at = self.run.state().configuration();
        self.coordinates.iter().map(|coordinate| coordinate.at(at)).collect()
    }

    /// Their rates.
    pub fn rates(&mut self) -> Vec<f64> {
        let v = self.run.observe_state().expect("full rank").v.clone();
        let q = &self.run.state().q;
        self.coordinates.iter().map(|coordinate| coordinate.rate(q, &v)).collect()
    }

    /// The integrator.
    pub fn integrator(&mut self) -> &mut MechanismIntegrator {
        &mut self.run
    }

    fn compare(
        &mut self,
        case: &NonsmoothCase,
        node: &NodeCase,
        tolerance: f64,
        deviation: &mut Deviation,
    ) -> Result<(), String> {
        let v = self.run.observe_state().map_err(|e| e.to_string())?.v.clone();
        let state = self.run.state();
        let rates = RATES * tolerance;
        if (state.t - node.t).abs() > 1e-9 * case.simulation.step {
            return Err(format!("node {} is at t = {}", node.step, state.t));
        }
        let apart = |a: &[f64], b: &[f64; 3]| {
            a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        for k in 0..case.bodies.len() {
            let (q, v) = (&state.q[12 * k..12 * k + 12], &v[12 * k..12 * k + 12]);
            raise(&mut deviation.q, apart(&q[..3], &node.position[k]) / tolerance);
            for (i, director) in node.directors[k].iter().enumerate() {
                raise(&mut deviation.q, apart(&q[3 + 3 * i..6 + 3 * i], director) / tolerance);
            }
            let omega = spin(q, v);
            raise(&mut deviation.p, apart(&v[..3], &node.velocity[k]) / rates);
            raise(&mut deviation.p, apart(omega.as_slice(), &node.angular_velocity[k]) / rates);
        }
        for (found, expected) in self.coordinates().iter().zip(&node.joint_coordinates) {
            raise(&mut deviation.q, (found - expected).abs() / tolerance);
        }
        let contacts = self.run.nonsmooth().expect("it has contacts");
        let at = state.configuration();
        let mut gaps = node.gaps.iter();
        for element in contacts.elements().iter().filter(|own| own.law().restitution().is_some()) {
            let mut features = Vec::new();
            element.near(self.run.interval(), at, &mut features);
            for (_, gap) in features {
                let expected = gaps.next().ok_or("there are more gaps than in the reference")?;
                let off = (gap - expected).abs();
                raise(&mut deviation.q, off / tolerance);
            }
        }
        if node.step == 0 {
            return Ok(());
        }
        let reference = &node.impulses_of_the_step_before;
        let mut expected: BTreeMap<String, Vector3<f64>> = BTreeMap::new();
        for (name, impulse) in reference {
            let number = name.strip_prefix("contact:").map(str::parse::<usize>);
            let name = match number {
                Some(number) => {
                    let number = number.map_err(|e| format!("`{name}`: {e}"))?;
                    let of = self.firsts.iter().filter(|(first, _)| *first <= number);
                    let of = of.max_by_key(|(first, _)| *first).ok_or("no such contact")?;
                    format!("contact:{}", if of.1 { number } else { of.0 })
                }
                None => name.clone(),
            };
            let mut three = Vector3::zeros();
            three.iter_mut().zip(impulse).for_each(|(to, from)| *to = *from);
            *expected.entry(name).or_default() += three;
        }
        for name in self.impulses.keys().chain(expected.keys()) {
            let [found, wanted] = [&self.impulses, &expected]
                .map(|of| of.get(name).copied().unwrap_or_else(Vector3::zeros));
            raise(&mut deviation.force, apart(found.as_slice(), &wanted.into()) / rates);
        }
        Ok(())
    }
}

/// The angular velocity of a frame.
fn spin(q: &[f64], v: &[f64]) -> Vector3<f64> {
    let director = |x: &[f64], i: usize| Vector3::from_column_slice(&x[3 + 3 * i..6 + 3 * i]);
    (0..3).map(|i| 0.5 * director(q, i).cross(&director(v, i))).sum()
}
