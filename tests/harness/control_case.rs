//! Reference cases of optimal control: mechanisms, problems, guesses.
#![allow(clippy::unwrap_used)] // helpers of tests

use nalgebra::{DMatrix, Matrix3, Vector3};
use serde_json::Value;
use std::sync::Arc;
use vi_constraints::{InitialValues, Options, OrderMethod, Reparametrization, SchemeKind};
use vi_control::objective::NumberCost;
use vi_control::transcription::problem::{
    Acts, Condition, Control, ControlProblem, Cost, CostKind, FinalTime, MAX_INCREMENT, NodeNumber,
    RestAtEnd, When,
};
use vi_control::transcription::{Guess, GuessPath, Transcription};
use vi_core::interval::Interval;
use vi_core::{Quadrature, SeparableSystem};
use vi_multibody::builder::{BuiltMechanism, MechanismBuilder, PointOn};
use vi_multibody::form::{BilinearRow, Form};
use vi_multibody::held_effort::HeldEffort;
use vi_multibody::joint::{Joint, Side, complete_axis};
use vi_multibody::joint_force::Viscous;
use vi_multibody::mechanism::BodySpec;
use vi_multibody::run::{MechanismIntegrator, Solver, integrator};
use vi_multibody::tree_map::TreeMap;
use vi_multibody::{FrameId, Mechanism, PairKind};
use vi_rigid::body::RigidBody;
use vi_rigid::directors;
use vi_rigid::inertia::PrincipalInertia;

/// A case with its mechanism, once with the efforts of its controls as held efforts.
pub(crate) struct Case {
    pub(crate) value: Value,
    pub(crate) mechanism: Mechanism,
    pub(crate) efforts: Vec<HeldEffort>,
    pub(crate) q: Vec<f64>,
    pub(crate) v: Vec<f64>,
    builder: MechanismBuilder,
}

pub(crate) fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

pub(crate) fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(number).collect()
}

pub(crate) fn list<'a>(value: &'a Value, key: &str) -> &'a [Value] {
    value.get(key).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

fn index(value: &Value) -> usize {
    usize::try_from(value.as_u64().unwrap()).unwrap()
}

fn freedom(value: &Value) -> usize {
    value.get("freedom").map_or(0, index)
}

fn vector(value: &Value) -> Vector3<f64> {
    Vector3::from_vec(numbers(value))
}

/// Rows are rows of the file; its columns are the directors.
fn matrix(value: &Value) -> Matrix3<f64> {
    let rows: Vec<Vec<f64>> = value.as_array().unwrap().iter().map(numbers).collect();
    Matrix3::from_fn(|i, j| rows[i][j])
}

fn frame(value: &Value) -> FrameId {
    usize::try_from(value.as_i64().unwrap()).map_or(FrameId::Ground, FrameId::Frame)
}

impl Case {
    /// The text of a case of `tests/reference/control`.
    pub(crate) fn text(name: &str) -> Value {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let file = root.join("../../tests/reference/control").join(format!("{name}.json"));
        serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap()
    }

    /// A case of `tests/reference/control`.
    pub(crate) fn read(name: &str) -> Self {
        Self::of(Self::text(name))
    }

    pub(crate) fn of(value: Value) -> Self {
        Self::try_of(value).unwrap()
    }

    /// The case, or why its numbers are no mechanism.
    pub(crate) fn try_of(value: Value) -> Result<Self, String> {
        let words = |e: &dyn std::fmt::Display| e.to_string();
        let mut builder = MechanismBuilder::new().gravity(vector(&value["gravity"]));
        let bodies = list(&value, "bodies");
        for body in bodies {
            let moments: [f64; 3] = numbers(&body["principal_inertia"]).try_into().unwrap();
            let inertia = PrincipalInertia::new(moments).map_err(|e| words(&e))?;
            let rigid = RigidBody::from_inertia(number(&body["mass"]), &inertia);
            let rigid = rigid.map_err(|e| words(&e))?;
            builder.frame(BodySpec {
                name: body["name"].as_str().unwrap().to_owned(),
                body: Some(rigid),
                center: vector(&body["position"]),
                triad: matrix(&body["directors"]),
                velocity: Vector3::zeros(),
                omega: Vector3::zeros(),
            });
        }
        let triad = |id: FrameId| match id {
            FrameId::Ground => Matrix3::identity(),
            FrameId::Frame(k) => matrix(&bodies[k]["directors"]),
        };
        let cut: Vec<usize> = list(&value, "cut_joints").iter().map(index).collect();
        let mut joints = Vec::new(); // of the builder; free joints are none
        for (k, joint) in list(&value, "joints").iter().enumerate() {
            let kind = match joint["type"].as_str().unwrap() {
                "R" => PairKind::Revolute,
                "P" => PairKind::Prismatic,
                "C" => PairKind::Cylindrical,
                _ => {
                    joints.push(None);
                    continue;
                }
            };
            let (parent, child) = (frame(&joint["parent"]), frame(&joint["child"]));
            let axes = complete_axis(&vector(&joint["axis"]).normalize());
            let child_axes = triad(child).transpose() * (triad(parent) * axes);
            let anchor = |key: &str| vector(&joint[key]);
            let sides = Joint {
                name: format!("joint {k}"),
                kind,
                parent: Side { frame: parent, anchor: anchor("anchor_parent"), axes },
                child: Side { frame: child, anchor: anchor("anchor_child"), axes: child_axes },
            };
            let entry = builder.joint_of_sides(sides);
            joints.push(Some(if cut.contains(&k) { entry.cut().id() } else { entry.id() }));
        }
        let coordinate =
            |part: &Value| joints[index(&part["joint"])].unwrap().coordinate(freedom(part));
        let ids: Vec<_> = builder.frames().collect();
        for spring in list(&value, "springs") {
            let end = |body: &str, point: &str| -> PointOn {
                match frame(&spring[body]) {
                    FrameId::Ground => <[f64; 3]>::from(vector(&spring[point])).into(),
                    FrameId::Frame(k) => ids[k].point(vector(&spring[point])),
                }
            };
            let ends = [end("body_a", "point_a"), end("body_b", "point_b")];
            let entry = builder.spring(ends[0], ends[1], number(&spring["stiffness"]));
            entry.natural_length(number(&spring["rest_length"]));
        }
        for spring in list(&value, "joint_springs") {
            let (k, rest) = (number(&spring["stiffness"]), number(&spring["rest"]));
            builder.joint_spring(coordinate(spring), k, rest);
        }
        for damper in list(&value, "joint_dampers") {
            builder.joint_force(coordinate(damper), Viscous(number(&damper["damping"])));
        }
        let efforts: Vec<HeldEffort> = list(&value, "efforts")
            .iter()
            .map(|effort| {
                let held = HeldEffort::default();
                builder.joint_force(coordinate(effort), held.clone());
                held
            })
            .collect();
        let mechanism = builder.build().map_err(|e| words(&e))?.mechanism;
        let mut case = Self { value, mechanism, efforts, q: Vec::new(), v: Vec::new(), builder };
        case.start()?;
        Ok(case)
    }

    pub(crate) fn built(&self) -> BuiltMechanism {
        self.builder.build().unwrap()
    }

    /// The joint of the mechanism that a joint of the case is; free joints are none.
    fn joint(&self, of_case: usize) -> Option<usize> {
        let joints = list(&self.value, "joints");
        let is_free = |k: usize| joints[k]["type"].as_str() == Some("F");
        (!is_free(of_case)).then(|| (0..of_case).filter(|k| !is_free(*k)).count())
    }

    /// The unknown of a coordinate, with its sign.
    pub(crate) fn unknown(&self, of_case: usize, freedom: usize) -> (usize, f64) {
        let tree = self.mechanism.tree();
        match self.joint(of_case) {
            Some(k) => {
                let joint = &self.mechanism.description().joints[k];
                let unknown = tree.unknown_of(joint, freedom).unwrap();
                (unknown.index, unknown.sign)
            }
            None => {
                let child = frame(&self.value["joints"][of_case]["child"]);
                let FrameId::Frame(child) = child else { panic!("a body") };
                (tree.links()[tree.link_of()[child]].offset + freedom, 1.0)
            }
        }
    }

    /// The unknowns in the order of the coordinates of the case.
    fn unknowns(&self) -> Vec<(usize, f64)> {
        let cut: Vec<usize> = list(&self.value, "cut_joints").iter().map(index).collect();
        let freedoms = |kind: &str| match kind {
            "C" => 2,
            "F" => 6,
            _ => 1,
        };
        let joints = list(&self.value, "joints").iter().enumerate();
        let tree = joints.filter(|(k, _)| !cut.contains(k));
        tree.flat_map(|(k, joint)| {
            (0..freedoms(joint["type"].as_str().unwrap())).map(move |f| (k, f))
        })
        .map(|(k, f)| self.unknown(k, f))
        .collect()
    }

    fn start(&mut self) -> Result<(), String> {
        let d = self.mechanism.tree().dof();
        let initial = self.value["initial"].clone();
        let closed = initial.get("consistent_coordinates").unwrap_or(&initial["coordinates"]);
        let mut u = vec![0.0; d];
        let all: Vec<usize> = (0..self.unknowns().len()).collect();
        let given: Vec<usize> = initial
            .get("independent")
            .map_or(all.clone(), |own| own.as_array().unwrap().iter().map(index).collect());
        let is_closed = initial.get("consistent_coordinates").is_some();
        for (which, x) in if is_closed { &all } else { &given }.iter().zip(numbers(closed)) {
            let (j, sign) = self.unknowns()[*which];
            u[j] = sign * x;
        }
        let q = self.mechanism.initial_configuration();
        let map = TreeMap::new(&self.mechanism);
        let mut s = Interval::new(q.len());
        let follows: Vec<usize> =
            all.iter().filter(|k| !given.contains(k)).map(|&k| self.unknowns()[k].0).collect();
        for round in 0.. {
            s.open(0.0, 1.0, &q);
            map.reparametrize(&u, &mut s).map_err(|e| e.to_string())?;
            let rows = self.mechanism.loop_constraints();
            let gap: Vec<f64> = rows.iter().map(|row| row.value(s.end())).collect();
            let size = vi_core::linear::norm_inf(&gap);
            // rounding leaves a few last bits of lengths of a metre
            if is_closed || follows.is_empty() || size < 1e-15 || round > 12 && size < 1e-14 {
                break;
            }
            if round > 30 {
                return Err(format!("the loop does not close: {size:.1e}"));
            }
            let (mut columns, mut slopes) =
                (DMatrix::zeros(q.len(), d), DMatrix::zeros(rows.len(), q.len()));
            map.null_space(&s.q1, &mut columns);
            rows.iter().enumerate().for_each(|(k, row)| row.emit(&s.q1, k, &mut slopes));
            let slopes = (slopes * columns).select_columns(&follows);
            let gap = DMatrix::from_vec(rows.len(), 1, gap);
            let step = slopes.svd(true, true).solve(&gap, 1e-10).unwrap();
            follows.iter().zip(step.iter()).for_each(|(&j, step)| u[j] -= step);
        }
        self.q = s.q1.clone();
        // rates: those given, the others by the closures
        let mut columns = DMatrix::zeros(q.len(), d);
        map.null_space(&self.q, &mut columns);
        let rows = self.mechanism.loop_constraints();
        let mut system = DMatrix::zeros(given.len() + rows.len(), d);
        let mut right = DMatrix::zeros(given.len() + rows.len(), 1);
        for (k, (which, rate)) in given.iter().zip(numbers(&initial["rates"])).enumerate() {
            let (j, sign) = self.unknowns()[*which];
            system[(k, j)] = sign;
            right[(k, 0)] = rate;
        }
        let mut slopes = DMatrix::zeros(rows.len(), q.len());
        rows.iter().enumerate().for_each(|(k, row)| row.emit(&self.q, k, &mut slopes));
        system.rows_mut(given.len(), rows.len()).copy_from(&(slopes * &columns));
        let rates = system.svd(true, true).solve(&right, 1e-10).unwrap();
        self.v = (columns * rates).column(0).iter().copied().collect();
        Ok(())
    }

    pub(crate) fn initial(&self) -> InitialValues<'_> {
        InitialValues::new(0.0, &self.q, &self.v)
    }

    /// The integrator at the start, with a scheme and a step.
    pub(crate) fn run(&self, scheme: SchemeKind, h: f64) -> MechanismIntegrator {
        self.run_by(Options::new(scheme, h))
    }

    /// The integrator at the start.
    pub(crate) fn run_by(&self, options: Options) -> MechanismIntegrator {
        let built = self.built();
        let system = built.system(Quadrature::Midpoint);
        integrator(built.mechanism, system, options, Solver::Auto, self.initial()).unwrap()
    }

    pub(crate) fn system(&self) -> SeparableSystem {
        self.built().system(Quadrature::Midpoint)
    }

    fn controls(&self) -> Vec<Control> {
        let bound = |k: usize| {
            let own = list(&self.value, "control_bounds").iter();
            let mut own = own.filter(|b| index(&b["control"]) == k);
            own.next().map_or([f64::NEG_INFINITY, f64::INFINITY], |b| {
                [number(&b["min"]), number(&b["max"])]
            })
        };
        let efforts = list(&self.value, "efforts").iter().enumerate();
        let control = |(k, effort): (usize, &Value)| {
            let (index, sign) = self.unknown(index(&effort["joint"]), freedom(effort));
            let along = vi_core::coordinate_force::SignedUnknown { index, sign };
            Control {
                name: format!("control {k}"),
                acts: Acts::Along(along),
                bounds: bound(k),
                hold: 1,
                linear: false,
            }
        };
        efforts.map(control).collect()
    }

    fn quantity(&self, joint: usize, freedom: usize) -> NodeNumber {
        let own = self.joint(joint).unwrap();
        NodeNumber::joint(&self.mechanism, own, freedom, &self.q, 0).unwrap()
    }

    /// The components of a point of a body, m.
    fn point(&self, part: &Value) -> [NodeNumber; 3] {
        let point = Form::point(12 * index(&part["body"]), &vector(&part["point"]));
        std::array::from_fn(|i| {
            let along = Form::constant(Vector3::ith(i, 1.0));
            NodeNumber::of(BilinearRow::product(point.clone(), along, 0.0))
        })
    }

    fn objective(&self) -> Vec<Cost> {
        let all: Vec<usize> = (0..self.efforts.len()).collect();
        let mut costs = Vec::new();
        for term in list(&self.value, "objective") {
            let weight = term.get("weight").map_or(1.0, number);
            let of = term.get("controls").map_or_else(
                || all.clone(),
                |own| own.as_array().unwrap().iter().map(index).collect(),
            );
            let name = term["type"].as_str().unwrap();
            let when = if name.starts_with("running") { When::Path } else { When::End };
            match name {
                "effort" => costs.push(Cost { weight, kind: CostKind::Effort(of) }),
                "time" => costs.push(Cost { weight, kind: CostKind::Time }),
                "terminal_coordinate" | "running_coordinate" => {
                    let quantity = self.quantity(index(&term["joint"]), freedom(term));
                    let target = number(&term["target"]);
                    costs.push(Cost {
                        weight,
                        kind: CostKind::Number {
                            quantity,
                            judged: NumberCost::Deviation(target),
                            when,
                        },
                    });
                }
                "terminal_point" | "running_point" => {
                    let targets = numbers(&term["target"]);
                    for (quantity, target) in self.point(term).into_iter().zip(targets) {
                        let kind = CostKind::Number {
                            quantity,
                            judged: NumberCost::Deviation(target),
                            when,
                        };
                        costs.push(Cost { weight, kind });
                    }
                }
                other => panic!("the term `{other}` is not one of optimal control"),
            }
        }
        costs
    }

    /// Conditions at the end, and what the guess changes coordinates by, shape `d`.
    fn ends(&self) -> (Vec<Condition>, Vec<f64>) {
        let mut conditions = Vec::new();
        let mut change = vec![0.0; self.mechanism.tree().dof()];
        let mut turn = None;
        for end in list(&self.value["terminal"], "coordinates") {
            let (joint, freedom, value) =
                (index(&end["joint"]), freedom(end), number(&end["value"]));
            let (j, sign) = self.unknown(joint, freedom);
            if self.joint(joint).is_none() {
                assert!(freedom >= 3, "a displacement of a free joint at the end");
                turn.get_or_insert(Vector3::zeros())[freedom - 3] = value;
                change[j] = value;
                continue;
            }
            let quantity = self.quantity(joint, freedom);
            let NodeNumber::Joint { start, .. } = quantity else { unreachable!() };
            change[j] = sign * (value - start);
            let (name, when) = (format!("joint {joint}"), When::End);
            conditions.push(Condition { name, quantity, when, bounds: [value; 2] });
        }
        for end in list(&self.value["terminal"], "points") {
            let targets = end.get("target").or(end.get("value")).map(numbers).unwrap();
            for (quantity, value) in self.point(end).into_iter().zip(targets) {
                let name = "point".to_owned();
                conditions.push(Condition { name, quantity, when: When::End, bounds: [value; 2] });
            }
        }
        if let Some(turn) = turn {
            // d_2·d_1* = d_3·d_2* = d_1·d_3* = 0, and no other roots: d_1·d_1*, d_2·d_2* > ½
            let target = vi_rigid::rotation::exp(&turn) * directors::triad(&self.q[..12]);
            let mut product = |i: usize, own: usize, bounds: [f64; 2]| {
                let own = Form::vector(0, &Vector3::ith(own % 3, 1.0));
                let fixed = Form::constant(target.column(i).into());
                let quantity = NodeNumber::of(BilinearRow::product(own, fixed, 0.0));
                let name = format!("attitude {i}");
                conditions.push(Condition { name, quantity, when: When::End, bounds });
            };
            (0..3).for_each(|i| product(i, i + 1, [0.0; 2]));
            (0..2).for_each(|i| product(i, i, [0.5, f64::INFINITY]));
        }
        for bound in list(&self.value, "coordinate_bounds") {
            let quantity = self.quantity(index(&bound["joint"]), freedom(bound));
            let bounds = [number(&bound["min"]), number(&bound["max"])];
            let name = "coordinate".to_owned();
            conditions.push(Condition { name, quantity, when: When::Path, bounds });
        }
        (conditions, change)
    }

    pub(crate) fn problem(&self, steps: usize) -> (ControlProblem, Guess) {
        let (conditions, change) = self.ends();
        let rest = match &self.value["terminal"]["rest"] {
            Value::String(_) => RestAtEnd::All,
            Value::Array(some) => RestAtEnd::Unknowns(
                some.iter().map(|own| self.unknown(index(&own["joint"]), freedom(own)).0).collect(),
            ),
            _ => RestAtEnd::Free,
        };
        let own_steps = index(&self.value["steps"]);
        let time = match self.value.get("free_time") {
            Some(free) => FinalTime::Free {
                min: number(&free["min"]),
                max: number(&free["max"]),
                guess: number(&free["guess"]),
            },
            None => FinalTime::Fixed(number(&self.value["h"]) * own_steps as f64),
        };
        let problem = ControlProblem {
            steps,
            time,
            method: OrderMethod::default(),
            controls: self.controls(),
            costs: self.objective(),
            conditions,
            rest,
            max_increment: self.value.get("max_increment").map_or(MAX_INCREMENT, number),
        };
        let mut guess = Guess::line(steps, &change);
        let nodes: Vec<Vec<f64>> =
            list(&self.value, "guess_coordinates").iter().map(numbers).collect();
        if !nodes.is_empty() {
            // linear between the nodes of the case
            let at = |n: usize, k: usize| {
                let place = (n * own_steps) as f64 / steps as f64;
                let low = (place.floor() as usize).min(own_steps - 1);
                let part = place - low as f64;
                (1.0 - part) * nodes[low][k] + part * nodes[low + 1][k]
            };
            let mut increments = vec![vec![0.0; change.len()]; steps];
            for (n, own) in increments.iter_mut().enumerate() {
                for (k, (j, sign)) in self.unknowns().into_iter().enumerate() {
                    own[j] = sign * (at(n + 1, k) - at(n, k));
                }
            }
            guess.path = GuessPath::Increments(increments);
        }
        (problem, guess)
    }

    pub(crate) fn transcription(&self, steps: usize) -> Transcription {
        let (problem, guess) = self.problem(steps);
        let system = Arc::new(self.system());
        Transcription::new(&self.mechanism, system, self.initial(), problem, &guess).unwrap()
    }
}

/// A case with a spring from the ground to a point of its first body, and one on its second joint.
pub(crate) fn with_springs(name: &str, rest_length: f64) -> Case {
    let mut value = Case::read(name).value;
    value["springs"] = serde_json::json!([{
        "body_a": -1,
        "body_b": 0,
        "point_a": [0.3, 0.1, 0.9],
        "point_b": [0.1, 0.0, 0.05],
        "stiffness": 20.0,
        "rest_length": rest_length,
    }]);
    value["joint_springs"] =
        serde_json::json!([{ "joint": 1, "freedom": 0, "stiffness": 3.0, "rest": 0.2 }]);
    Case::of(value)
}
