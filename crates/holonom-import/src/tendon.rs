//! Forces along lengths in the model: springs, laws, and the signals that they read.

use holonom_model::{
    Bushing, Coefficients, Formula, GROUND, Law, Sensor, SensorKind, Signal, Spring, is_readable,
};

use crate::drafter::Drafter;
use crate::numbers::{plain, vector};
use crate::remark::Remarks;
use crate::robot::{LengthPath, NamedFrame, Servo, ServoElasticity, Tendon};

const NO_FORCE: &str = "tendons that neither pull nor are read: not translated";
const OF_OTHERS: &str =
    "tendons of joints that are no joint of one coordinate in the model: not translated";

impl ServoElasticity {
    pub(crate) fn is_nothing(&self) -> bool {
        [self.stiffness, self.damping] == [[0.0; 3]; 2]
    }

    /// Whether it is no linear function of elongation and rate.
    pub(crate) fn is_bent(&self) -> bool {
        [&self.stiffness[1..], &self.damping[1..]].concat().iter().any(|own| *own != 0.0)
    }

    /// Whether a spring with a damper has this force.
    fn is_spring(&self) -> bool {
        let one_rest = self.rest[0].to_bits() == self.rest[1].to_bits();
        !self.is_bent() && one_rest && self.stiffness[0] > 0.0
    }

    /// `−k_0 e − k_1 e² − k_2 e³` of the expression `length`.
    fn pull(&self, length: &str) -> String {
        let [lower, upper] = self.rest.map(plain);
        let elongation = match lower.to_bits() == upper.to_bits() {
            true => minus(length, lower),
            false => {
                format!("(max({}, 0) + min({}, 0))", minus(length, upper), minus(length, lower))
            }
        };
        polynomial(self.stiffness, ["", "^2", "^3"].map(|power| format!("*{elongation}{power}")))
    }

    /// `−c_0 l̇ − c_1 l̇ |l̇| − c_2 l̇³` of the expression `rate`.
    fn drag(&self, rate: &str) -> String {
        let of = ["", &format!("*abs({rate})"), "^3"].map(|more| format!("*{rate}{more}"));
        polynomial(self.damping, of)
    }
}

impl Servo {
    fn force(&self, length: &str, rate: &str) -> String {
        let of = [length, rate].map(|own| format!("*{own}"));
        let [of_length, of_rate] = of;
        let factors = [-self.effort, self.proportional, self.derivative];
        polynomial(factors, [String::new(), of_length, of_rate])
    }
}

/// `− k_0 a − k_1 b − k_2 c` without the terms that are zero; `a`, `b`, `c` begin with `*`.
fn polynomial(factors: [f64; 3], of: [String; 3]) -> String {
    let terms = factors.into_iter().zip(of).filter(|(factor, _)| *factor != 0.0);
    let sign = |factor: f64| if factor > 0.0 { '-' } else { '+' };
    terms.map(|(factor, of)| format!(" {} {:?}{of}", sign(factor), factor.abs())).collect()
}

/// `(text − number)`.
fn minus(text: &str, number: f64) -> String {
    match number {
        0.0 => text.to_owned(),
        below if below < 0.0 => format!("({text} + {:?})", -below),
        above => format!("({text} - {above:?})"),
    }
}

fn is_one(factor: f64) -> bool {
    factor.to_bits() == 1.0_f64.to_bits()
}

/// A name with a factor.
fn times(factor: f64, name: &str) -> String {
    if is_one(factor) { name.to_owned() } else { format!("{factor:?}*{name}") }
}

/// The sum of expressions with factors and a number.
fn sum(terms: &[(String, f64)], number: f64) -> String {
    let text: String = terms
        .iter()
        .map(|(name, factor)| {
            let sign = if *factor < 0.0 { '-' } else { '+' };
            format!(" {sign} {}", times(factor.abs(), name))
        })
        .collect();
    let number = if number == 0.0 { String::new() } else { format!("{number:?}") };
    tidy(&(number + &text))
}

/// An expression without a blank or a plus before it; 0 for none.
fn tidy(text: &str) -> String {
    match text.trim_start().trim_start_matches("+ ") {
        "" => "0".to_owned(),
        negative if negative.starts_with("- ") => format!("-{}", &negative[2..]),
        other => other.to_owned(),
    }
}

/// Two points whose distance a law or a sensor reads.
struct TendonSegment {
    ends: [(String, [f64; 3]); 2],
    factor: f64,
}

impl Drafter<'_> {
    /// What a joint has beside its spring and damper: a law for each.
    pub(crate) fn beyond_linear(&mut self, joint: &str, freedom: usize, elastic: &ServoElasticity) {
        let [_, k1, k2] = elastic.stiffness;
        let [_, c1, c2] = elastic.damping;
        let own = ServoElasticity {
            stiffness: [0.0, k1, k2],
            damping: [0.0, c1, c2],
            rest: elastic.rest,
        };
        for (suffix, effort) in [("stiffening", own.pull("x")), ("drag", own.drag("v"))] {
            if effort.is_empty() {
                continue;
            }
            let name = self.names.unique(&format!("{joint}_{suffix}"), "law");
            let (joint, effort) = (Some(joint.to_owned()), Some(Formula(tidy(&effort))));
            self.draft.model.laws.push(Law { joint, freedom, effort, name, ..Law::default() });
        }
    }

    /// Spring and damper of a ball joint: a torque against the rotation vector, and one against the
    /// relative angular velocity.
    pub(crate) fn around_ball(&mut self, joint: &str, elastic: &ServoElasticity) {
        let ([stiffness, ..], [damping, ..]) = (elastic.stiffness, elastic.damping);
        let Some(own) = self.draft.model.joint(joint).cloned() else { return };
        if stiffness != 0.0 {
            let along = [0.0, 0.0, 0.0, stiffness, stiffness, stiffness];
            let along = along.map(|own| Formula(format!("{own:?}")));
            self.draft.model.bushings.push(Bushing {
                name: self.names.unique(&format!("{joint}_spring"), "bushing"),
                from: own.parent.clone(),
                to: own.child.clone(),
                position: own.position.unwrap_or_default(),
                stiffness: Some(Coefficients::Diagonal(Box::new(along))),
                ..Bushing::default()
            });
        }
        if damping != 0.0 {
            let name = self.names.unique(&format!("{joint}_damper"), "law");
            let torque = ["wx", "wy", "wz"].map(|rate| Formula(format!("-{damping:?}*{rate}")));
            let relative_to = Some(own.parent).filter(|parent| parent != GROUND);
            let (on, torque) = (Some(own.child), Some(torque));
            self.draft.model.laws.push(Law { on, relative_to, torque, name, ..Law::default() });
        }
    }

    /// A tendon that pulls or is read.
    pub(crate) fn tendon(&mut self, tendon: &Tendon, remarks: &mut Remarks) {
        let pulls = !tendon.elastic.is_nothing() || tendon.servo != Servo::default();
        if !pulls && !tendon.is_read {
            remarks.mention(NO_FORCE, tendon.label.clone(), &tendon.place);
            return;
        }
        match &tendon.path {
            LengthPath::Joints(terms) => {
                if self.along_joints(tendon, terms, pulls).is_none() {
                    remarks.mention(OF_OTHERS, tendon.label.clone(), &tendon.place);
                }
            }
            LengthPath::Points(parts) => self.along_points(tendon, parts, pulls),
            LengthPath::Other => {} // the remark is there
        }
    }

    /// `None` where a joint has no counterpart.
    fn along_joints(
        &mut self,
        tendon: &Tendon,
        terms: &[(String, f64)],
        pulls: bool,
    ) -> Option<()> {
        let mut own = Vec::new();
        for (joint, factor) in terms {
            let name = self.single(joint)?.to_owned();
            own.push((name, *factor, factor * self.starts.get(joint)?));
        }
        let start: f64 = own.iter().map(|(.., start)| start).sum();
        let [mut lengths, mut rates] = [Vec::new(), Vec::new()];
        for (name, factor, _) in &own {
            let [coordinate, rate] = self.readings(name);
            lengths.push((coordinate, *factor));
            rates.push((rate, *factor));
        }
        let force = self.signals(tendon, [sum(&lengths, plain(start)), sum(&rates, 0.0)], pulls);
        for (joint, factor, _) in own.into_iter().filter(|_| pulls) {
            let name = self.names.unique(&format!("{}_{joint}", tendon.name), "law");
            let effort = Some(Formula(times(factor, &force)));
            self.draft.model.laws.push(Law { joint: Some(joint), effort, name, ..Law::default() });
        }
        Some(())
    }

    /// Names by which expressions read the coordinate of a joint and its rate: those of the joint,
    /// or of sensors where no expression can read that.
    fn readings(&mut self, joint: &str) -> [String; 2] {
        if is_readable(joint) {
            return [joint.to_owned(), format!("{joint}.rate")];
        }
        let kinds = [SensorKind::JointCoordinate, SensorKind::JointRate];
        let sensors = kinds.map(|kind| Sensor::new(String::new(), kind, joint.to_owned()));
        self.measured(&format!("{joint}_coordinate"), sensors)
    }

    /// Adds a sensor of a value and one of its rate; their names.
    fn measured(&mut self, wanted: &str, [value, rate]: [Sensor; 2]) -> [String; 2] {
        [("", value), ("_rate", rate)].map(|(suffix, sensor)| {
            let name = self.readable(&format!("{wanted}{suffix}"), "sensor");
            self.draft.model.sensors.push(Sensor { name: name.clone(), ..sensor });
            name
        })
    }

    /// A name that expressions read.
    fn readable(&mut self, wanted: &str, suffix: &str) -> String {
        let plain = |c: char| if c.is_alphanumeric() { c } else { '_' };
        let mut name: String = wanted.chars().map(plain).collect();
        if !name.starts_with(char::is_alphabetic) {
            name.insert(0, 'n');
        }
        self.names.unique(&name, suffix)
    }

    /// Signals of the length, its rate and the force along it; the name of the force.
    fn signals(&mut self, tendon: &Tendon, [length, rate]: [String; 2], pulls: bool) -> String {
        let names = ["length", "rate", "force"]
            .map(|of| self.readable(&format!("{}_{of}", tendon.name), "signal"));
        let [of_length, of_rate, of_force] = &names;
        let elastic = &tendon.elastic;
        let force = elastic.pull(of_length)
            + &elastic.drag(of_rate)
            + &tendon.servo.force(of_length, of_rate);
        let values = [length, rate, tidy(&force)];
        for (name, value) in names.iter().zip(values).take(if pulls { 3 } else { 2 }) {
            let (name, value) = (name.clone(), Some(Formula(value)));
            self.draft.model.signals.push(Signal { name, value, ..Signal::default() });
        }
        self.lengths.insert(tendon.name.clone(), [of_length.clone(), of_rate.clone()]);
        of_force.clone()
    }

    fn along_points(&mut self, tendon: &Tendon, parts: &[([NamedFrame; 2], f64)], pulls: bool) {
        let mut fixed = 0.0;
        let mut segments = Vec::new();
        for (frames, factor) in parts {
            let [from, to] = [&frames[0], &frames[1]].map(|frame| self.in_body(frame));
            if from.0 == to.0 {
                let apart = to.1.translation.vector - from.1.translation.vector;
                fixed += factor * apart.norm();
                continue;
            }
            let ends = [from, to].map(|(node, pose)| {
                let name = node.map_or_else(|| GROUND.to_owned(), |k| self.bodies[k].clone());
                (name, vector(&pose.translation.vector))
            });
            segments.push(TendonSegment { ends, factor: *factor });
        }
        match &segments[..] {
            [only] if fixed == 0.0 && is_one(only.factor) && !tendon.is_read => {
                self.direct(tendon, only);
            }
            _ => self.through_signals(tendon, &segments, fixed, pulls),
        }
    }

    /// A force between two points alone.
    fn direct(&mut self, tendon: &Tendon, segment: &TendonSegment) {
        let name = self.names.unique(&tendon.name, "tendon");
        let elastic = &tendon.elastic;
        if elastic.is_spring() && tendon.servo == Servo::default() {
            let [(from, point_from), (to, point_to)] = segment.ends.clone();
            self.draft.model.springs.push(Spring {
                name,
                from,
                to,
                point_from: Some(point_from.to_vec()),
                point_to: Some(point_to.to_vec()),
                relative_to: None,
                stiffness: elastic.stiffness[0],
                natural_length: Some(plain(elastic.rest[0])),
                tension: None,
                law: holonom_model::SpringLaw::default(),
                damping: elastic.damping[0],
            });
            return;
        }
        let force = elastic.pull("x") + &elastic.drag("v") + &tendon.servo.force("x", "v");
        self.pull(name, segment, format!("-({})", tidy(&force)));
    }

    /// A tension between two points.
    fn pull(&mut self, name: String, segment: &TendonSegment, tension: String) {
        let [(from, point_from), (to, point_to)] = segment.ends.clone();
        self.draft.model.laws.push(Law {
            name,
            from: Some(from),
            to: Some(to),
            point_from: Some(point_from.to_vec()),
            point_to: Some(point_to.to_vec()),
            tension: Some(Formula(tension)),
            ..Law::default()
        });
    }

    /// A force along the sum of distances.
    fn through_signals(
        &mut self,
        tendon: &Tendon,
        segments: &[TendonSegment],
        fixed: f64,
        pulls: bool,
    ) {
        let [mut lengths, mut rates] = [Vec::new(), Vec::new()];
        for (k, segment) in segments.iter().enumerate() {
            let [a, b] = &segment.ends;
            // a sensor is of a body
            let [(of, point), (to, point_to)] = if a.0 == GROUND { [b, a] } else { [a, b] };
            let sensor = |kind| Sensor {
                point: Some(*point),
                to: Some(to.clone()),
                point_to: Some(*point_to),
                ..Sensor::new(String::new(), kind, of.clone())
            };
            let sensors = [SensorKind::Distance, SensorKind::DistanceRate].map(sensor);
            let [distance, rate] = self.measured(&format!("{}_{}", tendon.name, k + 1), sensors);
            lengths.push((distance, segment.factor));
            rates.push((rate, segment.factor));
        }
        let force = self.signals(tendon, [sum(&lengths, plain(fixed)), sum(&rates, 0.0)], pulls);
        for (k, segment) in segments.iter().enumerate().filter(|_| pulls) {
            let name = self.names.unique(&format!("{}_pull{}", tendon.name, k + 1), "law");
            self.pull(name, segment, format!("-{}", times(segment.factor, &force)));
        }
    }
}
