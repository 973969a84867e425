//! What a readable model may still get wrong.

mod beam;
mod bushing;
mod compliant;
pub(crate) mod computed;
mod condition;
mod contact;
mod control;
mod drive;
mod event;
mod identify;
mod joint_contact;
mod law;
mod load;
mod order;
mod rates;
mod rolling;
mod sensor;
mod signal;
mod time;

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;

use super::{
    Bar, Body, Columns, GROUND, Inertia, Joint, MAX_STEPS, Model, Particle, Scheme, Shape,
    ShapeKind, Spring, SpringLaw,
};
use crate::frames::start::{SHORTEST, StartPoints, coincide, is_ground};
use crate::quantity::Quantities;
use crate::text::problem::{MAX_PROBLEMS, Problem, nearest, some};
use crate::text::source::Document;
use crate::types::body::{color_names, rgb};
use crate::types::orientation::quaternion_fault;
use crate::types::settings::{Bifurcation, Strain};

/// All problems of a model that could be read.
pub(super) fn problems(model: &Model, document: &Document<'_>) -> Vec<Problem> {
    let mut checker = Checker {
        model,
        document,
        points: StartPoints::new(model),
        problems: Vec::new(),
        refused: BTreeSet::new(),
        kinds: BTreeMap::new(),
    };
    let known = Quantities::new(model);
    checker.names();
    checker.header();
    checker.settings();
    let each = |i: usize, section: &str| document.label(section, i).to_owned();
    model.bodies.iter().enumerate().for_each(|(i, b)| checker.body(&each(i, "body"), b));
    model.beams.iter().enumerate().for_each(|(i, b)| checker.beam(&each(i, "beam"), b));
    model.particles.iter().enumerate().for_each(|(i, p)| checker.particle(&each(i, "particle"), p));
    model.bars.iter().enumerate().for_each(|(i, b)| checker.bar(&each(i, "bar"), b));
    model.joints.iter().enumerate().for_each(|(i, j)| checker.joint(&each(i, "joint"), j, &known));
    model.springs.iter().enumerate().for_each(|(i, s)| checker.spring(&each(i, "spring"), s));
    model.loads.iter().enumerate().for_each(|(i, l)| checker.load(&each(i, "load"), l, &known));
    model.tables.iter().enumerate().for_each(|(i, t)| checker.table(&each(i, "table"), t));
    let laws = model.laws.iter().enumerate();
    let signals = model.signals.iter().enumerate();
    signals.for_each(|(i, own)| checker.signal(&each(i, "signal"), own, &known));
    checker.signal_loops(&known);
    laws.for_each(|(i, law)| checker.law(&each(i, "law"), law, &known));
    let bushings = model.bushings.iter().enumerate();
    bushings.for_each(|(i, own)| checker.bushing(&each(i, "bushing"), own, &known));
    model.sensors.iter().enumerate().for_each(|(i, s)| checker.sensor(&each(i, "sensor"), s));
    model
        .constraints
        .iter()
        .enumerate()
        .for_each(|(i, c)| checker.constraint(&each(i, "constraint"), c, &known));
    checker.contacts();
    let events = model.events.iter().enumerate();
    events.for_each(|(i, event)| checker.event(&each(i, "event"), event, &known));
    let controls = model.controls.iter().enumerate();
    controls.for_each(|(i, own)| checker.control(&each(i, "control"), own, &known));
    let objectives = model.objectives.iter().enumerate();
    objectives.for_each(|(i, own)| checker.objective(&each(i, "objective"), own));
    let conditions = model.conditions.iter().enumerate();
    conditions.for_each(|(i, own)| checker.condition(&each(i, "condition"), own));
    model.optimize.iter().for_each(|own| checker.optimize(own));
    let measurements = model.measurements.iter().enumerate();
    measurements.for_each(|(i, own)| checker.measurement(&each(i, "measurement"), own));
    model.identify.iter().for_each(|own| checker.identify(own));
    checker.problems
}

pub(super) struct Checker<'a> {
    pub(super) model: &'a Model,
    document: &'a Document<'a>,
    pub(super) points: StartPoints<'a>,
    problems: Vec<Problem>,
    /// Names that cannot be names; what refers to them is not reported again.
    refused: BTreeSet<&'a str>,
    /// The section of every name.
    pub(super) kinds: BTreeMap<&'a str, &'static str>,
}

impl<'a> Checker<'a> {
    pub(super) fn report(
        &mut self,
        key: impl Into<String>,
        message: String,
        help: impl Into<String>,
    ) {
        self.add(Problem::new(key, message).help(help));
    }

    /// A problem with its full key; its place in the text is looked up.
    pub(super) fn add(&mut self, problem: Problem) {
        if self.problems.len() < MAX_PROBLEMS {
            let span = self.document.span(&problem.key);
            self.problems.push(problem.at(span));
        }
    }

    fn names(&mut self) {
        for (section, names) in self.model.names() {
            for (i, name) in names.into_iter().enumerate() {
                let key = format!("{}.name", self.document.label(section, i));
                self.name(section, &key, name);
            }
        }
    }

    fn name(&mut self, section: &'static str, key: &str, name: &'a str) {
        let odd = |c: char| c.is_control() || ".,\"[]=".contains(c);
        // table programs take such a heading for a formula
        let begins = |c: char| "+-@".contains(c);
        if is_ground(name) {
            let help = "choose another name; `ground` is the inertial frame";
            self.report(key, format!("the name `{GROUND}` is reserved"), help);
        } else if name.trim().is_empty()
            || name.trim() != name
            || name.contains(odd)
            || name.starts_with(begins)
            || name.chars().count() > 100
        {
            let help = "use up to 100 characters, such as `upper_arm`: letters, digits, `_`, `-` and blanks within, none of \
                        `. , \" [ ] =`, and neither `+`, `-` nor `@` at the beginning";
            self.report(key, format!("`{}` cannot be a name", name.escape_debug()), help);
            self.refused.insert(name);
        } else if let Some(first) = self.kinds.get(name) {
            let help = "names are unique in the whole model";
            self.report(key, format!("the name `{name}` is taken by a {first}"), help);
        } else {
            self.kinds.insert(name, section);
        }
    }

    fn header(&mut self) {
        let header = &self.model.header;
        if header.dimension != 2 && header.dimension != 3 {
            let message = format!("dimension is {}", header.dimension);
            self.report("model.dimension", message, "write 3, or 2 for point masses in the plane");
            return;
        }
        self.length("model.gravity", &header.gravity, true);
        let beams = !self.model.beams.is_empty();
        if self.model.bodies.is_empty() && self.model.particles.is_empty() && !beams {
            let message = "the model is empty: it has no body, no beam and no particle".to_owned();
            self.report("model", message, "add at least one [[body]], [[beam]] or [[particle]]");
        }
        let fixed = !self.model.bodies.is_empty() && self.model.bodies.iter().all(|b| b.fixed);
        if fixed && self.model.particles.is_empty() && !beams {
            let message = "nothing can move: every body is fixed".to_owned();
            self.report("model", message, "remove `fixed = true` from at least one body");
        }
        if header.dimension == 2 && (beams || !self.model.bodies.is_empty()) {
            let message = "planar models have no bodies and no beams, only particles".to_owned();
            self.report("model.dimension", message, "use dimension = 3 and vectors of 3 numbers");
        }
    }

    /// A vector must have as many numbers as the model has dimensions.
    fn length(&mut self, key: &str, vector: &[f64], may_be_absent: bool) -> bool {
        let dimension = self.model.header.dimension;
        let right = vector.len() == dimension || (may_be_absent && vector.is_empty());
        if !right {
            let message = format!("{} number(s) in a model of dimension {dimension}", vector.len());
            self.report(key, message, format!("write a vector of {dimension} numbers"));
        }
        right
    }

    fn settings(&mut self) {
        let settings = &self.model.settings;
        let positive = [("simulation.step", settings.step), ("simulation.end", settings.end)];
        for (key, value) in positive {
            if value <= 0.0 {
                let message = format!("{value} is not a positive time");
                self.report(key, message, "write a positive number of seconds, such as 0.01");
            }
        }
        let steps = settings.end / settings.step;
        if steps > MAX_STEPS {
            let message = format!("{steps:.3e} steps are more than {MAX_STEPS:e}");
            self.report("simulation.step", message, "choose a larger step or an earlier end");
        }
        self.high_order();
        let statics = settings.scheme == Scheme::Static;
        if settings.arc_length && !statics {
            let message = "a motion has no path of equilibria to follow".to_owned();
            self.report("simulation.arc_length", message, "write scheme = \"static\" with it");
        }
        if settings.bifurcation == Bifurcation::Switch && !statics {
            let message = "a motion has no path of equilibria that bifurcates".to_owned();
            self.report("simulation.bifurcation", message, "write scheme = \"static\" with it");
        }
        if statics && settings.order != 2 {
            let message = "equilibria have no order of accuracy in time".to_owned();
            self.report("simulation.order", message, "remove `order`");
        }
        if statics && settings.momenta {
            let message = "equilibria have no momenta".to_owned();
            self.report("simulation.momenta", message, "remove `momenta`, or take another scheme");
        }
        let both = |a, b| settings.columns.contains(&a) && settings.columns.contains(&b);
        if both(Columns::Coordinates, Columns::Positions) {
            let message = "`coordinates` contain the positions".to_owned();
            self.report("simulation.columns", message, "write one of the two");
        }
        if settings.every == 0 {
            let help = "write 1 to record every step, 10 for every tenth";
            self.report("simulation.every", "no step would be recorded".into(), help);
        }
        let tolerances = [
            ("simulation.start_tolerance", settings.start_tolerance),
            ("simulation.loop_tolerance", settings.loop_tolerance),
            ("simulation.newton_tolerance", settings.newton_tolerance),
        ];
        for (key, value) in tolerances {
            if value < 0.0 {
                self.report(key, format!("the tolerance {value} is negative"), "write 0 or more");
            }
        }
        if settings.newton_max_iterations == 0 {
            let message = "Newton's method needs at least one iteration".to_owned();
            self.report("simulation.newton_max_iterations", message, "write 30");
        }
        if settings.contacts && self.model.contacts.is_empty() {
            let message = "there is no contact to record".to_owned();
            let help = "remove `contacts`, or add a [[contact]]; of stops and dry friction there are rows in events.csv, and sensors";
            self.report("simulation.contacts", message, help);
        }
        self.dissipative_strains();
    }

    /// Dissipative strains are for single steps of the variational schemes.
    fn dissipative_strains(&mut self) {
        let settings = &self.model.settings;
        if settings.strain != Strain::Dissipative {
            return;
        }
        let (order, scheme) = (settings.order, settings.scheme);
        if order > 2 {
            let message = format!(
                "a composition of order {order} steps backwards in time too, where dissipation adds energy"
            );
            self.report("simulation.strain", message, "write order = 2, or strain = \"averaged\"");
        }
        if scheme.is_energy_momentum() {
            let message = format!("the scheme {} has no dissipative strains", scheme.name());
            let help = "write a variational scheme, such as \"nodal\", or remove `strain`";
            self.report("simulation.strain", message, help);
        }
    }

    fn mass(&mut self, key: &str, mass: f64) {
        if mass <= 0.0 {
            let message = format!("the mass {mass} kg is not positive");
            self.report(key, message, "write a positive mass in kg");
        }
    }

    fn body(&mut self, key: &str, body: &Body) {
        if let Some(shape) = &body.shape {
            let key = format!("{key}.shape");
            if shape.kind != ShapeKind::Mesh {
                self.no_place(&key, shape);
            }
            self.shape(&key, shape);
        }
        for (of, shapes) in [("picture", &body.picture), ("collision", &body.collision)] {
            for (k, shape) in shapes.iter().enumerate() {
                let key = format!("{key}.{of}[{k}]");
                self.weighs_nothing(&key, of, shape);
                self.shape(&key, shape);
            }
        }
        if let Some(mass) = body.mass {
            self.mass(&format!("{key}.mass"), mass);
        } else if !body.fixed && body.shape.as_ref().is_none_or(|s| s.density.is_none()) {
            let help = "add `mass = …`, or a shape with a density";
            self.report(key, "the body has no mass".into(), help);
        }
        if let Some(inertia) = &body.inertia {
            self.inertia(&format!("{key}.inertia"), inertia);
        } else if !body.fixed && body.shape.is_none() {
            let help = "add `inertia = [I1, I2, I3]`, or a shape";
            self.report(key, "the body has no inertia".into(), help);
        }
        if let Some(problem) = body.orientation().fault() {
            self.add(problem.below(key));
        }
        self.look(key, body);
        if body.angular_velocity.is_some() && body.body_angular_velocity.is_some() {
            let message = "the angular velocity is stated twice".to_owned();
            let help = "keep angular_velocity (in space) or body_angular_velocity (in the body)";
            self.report(format!("{key}.body_angular_velocity"), message, help);
        }
        let spins = [body.angular_velocity, body.body_angular_velocity].into_iter().flatten();
        let moves = spins.chain([body.velocity]).flatten().any(|v| v != 0.0);
        if body.fixed && moves {
            let help = "remove its velocities, or `fixed = true`";
            self.report(format!("{key}.fixed"), "a fixed body has a velocity".into(), help);
        }
    }

    /// How a body is drawn.
    fn look(&mut self, key: &str, body: &Body) {
        if let Some(color) = body.color.as_deref().filter(|color| rgb(color).is_none()) {
            let message = format!("`{color}` is no colour");
            let help = match nearest(&color.to_lowercase(), color_names()) {
                Some(best) => format!("did you mean `{best}`? Others are \"#rrggbb\", two hexadecimal digits each"),
                None => "write \"#rrggbb\", two hexadecimal digits each for red, green and blue, or a name such as \"red\"".to_owned(),
            };
            self.report(format!("{key}.color"), message, help);
        }
        if let Some(opacity) = body.opacity.filter(|opacity| !(0.0..=1.0).contains(opacity)) {
            let message = format!("the opacity {opacity} is not between 0 and 1");
            self.report(format!("{key}.opacity"), message, "write 0.3 to see what is behind it");
        }
    }

    fn inertia(&mut self, key: &str, inertia: &Inertia) {
        if let Some(fault) = inertia.fault() {
            let help = "moments of inertia about the centre of mass satisfy I1 + I2 >= I3 for \
                        every choice of the axes";
            self.report(key, fault, help);
        }
    }

    fn shape(&mut self, key: &str, shape: &Shape) {
        if let Some(density) = shape.density.filter(|d| *d <= 0.0) {
            let message = format!("the density {density} kg/m³ is not positive");
            self.report(format!("{key}.density"), message, "write a positive density");
        }
        if let Some(problem) = shape.quaternion.and_then(quaternion_fault) {
            self.add(problem.below(key));
        }
        if shape.kind == ShapeKind::Mesh {
            return self.mesh(key, shape);
        }
        self.no_mesh(key, shape);
        let names = shape.kind.dimensions();
        if shape.dimensions.len() != names.len() {
            let message = format!("{} dimension(s) for this shape", shape.dimensions.len());
            let help = format!("write dimensions = [{}], in m", names.join(", "));
            self.report(format!("{key}.dimensions"), message, help);
        } else if let Some(bad) = shape.dimensions.iter().find(|d| **d <= 0.0) {
            let message = format!("the dimension {bad} m is not positive");
            self.report(format!("{key}.dimensions"), message, "write positive lengths in m");
        }
    }

    fn particle(&mut self, key: &str, particle: &Particle) {
        self.mass(&format!("{key}.mass"), particle.mass);
        self.length(&format!("{key}.position"), &particle.position, false);
        self.length(&format!("{key}.velocity"), &particle.velocity, true);
    }

    /// A component must exist and be of one of these sections (or the ground).
    pub(super) fn reference(&mut self, key: String, name: &str, sections: &[&'static str]) {
        self.refers(key, name, sections);
    }

    /// The same; returns whether it does.
    pub(super) fn refers(&mut self, key: String, name: &str, sections: &[&'static str]) -> bool {
        let ground = sections.contains(&GROUND);
        if is_ground(name) && ground {
            return true;
        }
        if self.refused.contains(name) {
            return false;
        }
        let kind = self.kinds.get(name).copied();
        if kind.is_some_and(|k| sections.contains(&k)) {
            return true;
        }
        if sections.contains(&"body") && self.node_reference(&key, name) {
            return true;
        }
        let expected = sections.join(" or ");
        let message = match kind {
            Some(kind) => format!("`{name}` is a {kind}, not a {expected}"),
            None => format!("there is no {expected} named `{name}`"),
        };
        let fitting = self.kinds.iter().filter(|(_, k)| sections.contains(k)).map(|(n, _)| *n);
        let candidates: Vec<&str> = fitting.chain(ground.then_some(GROUND)).collect();
        let help = match nearest(name, candidates.iter().copied()) {
            _ if kind == Some("particle") && sections.contains(&"body") => format!(
                "a particle has no rotation, and springs, bars and distances alone hold it: write `{name}` as a [[body]] \
                 with its `mass` and `inertia = [J, J, J]`, that of a ball of the radius r J = 2/5 m r²"
            ),
            Some(best) => format!("did you mean `{best}`?"),
            None if candidates.is_empty() => format!("add a [[{}]] first", sections[0]),
            None => format!("there are: {}", some(&candidates)),
        };
        self.report(key, message, help);
        false
    }

    /// Whether the name is that of a particle.
    pub(super) fn is_particle(&self, name: &str) -> bool {
        self.kinds.get(name) == Some(&"particle")
    }

    pub(super) fn two_ends(&mut self, key: &str, from: &str, to: &str) {
        // the node of a beam may have two names
        let nodes = from.contains('.') && to.contains('.');
        let one = |model: &Model| model.frame(from).is_some_and(|k| model.frame(to) == Some(k));
        if from == to || nodes && one(self.model) {
            let message = format!("both ends are `{from}`");
            self.report(key, message, "connect two different components");
        }
    }

    fn bar(&mut self, key: &str, bar: &Bar) {
        let from = self.refers(format!("{key}.from"), &bar.from, &["particle", GROUND]);
        let to = self.refers(format!("{key}.to"), &bar.to, &["particle", GROUND]);
        self.two_ends(&format!("{key}.to"), &bar.from, &bar.to);
        let grounded = is_ground(&bar.from) || is_ground(&bar.to);
        if let Some(point) = &bar.point {
            self.length(&format!("{key}.point"), point, false);
            if !grounded {
                let message = "a point is only for a bar that is held by the ground".to_owned();
                self.report(format!("{key}.point"), message, "remove `point`");
            }
        }
        let stated = self.stated_length(&format!("{key}.length"), bar.length);
        if stated && from && to && bar.from != bar.to && coincide(&self.points.bar(bar)) {
            let message = "both ends start at the same point: the bar has no direction".to_owned();
            let help = "move one of them, or write one particle with the mass of both";
            self.report(key, message, help);
        }
    }

    /// A length that is stated must be one that can be squared twice; returns whether it is.
    pub(super) fn stated_length(&mut self, key: &str, length: Option<f64>) -> bool {
        let Some(length) = length.filter(|length| *length < SHORTEST) else { return true };
        let (message, help) = if length <= 0.0 {
            (format!("the length {length} m is not positive"), "write a positive length in m")
        } else {
            let message = format!("the length {length:e} m is too short for computations");
            (
                message,
                "write a length of 1e-50 m or more, or one particle in the place of both ends",
            )
        };
        self.report(key.to_owned(), message, help);
        false
    }

    fn joint(&mut self, key: &str, joint: &Joint, known: &Quantities<'_>) {
        self.reference(format!("{key}.parent"), &joint.parent, &["body", GROUND]);
        self.reference(format!("{key}.child"), &joint.child, &["body", GROUND]);
        self.two_ends(&format!("{key}.child"), &joint.parent, &joint.child);
        let rests = |name: &str| is_ground(name) || self.points.is_fixed(name);
        if joint.parent != joint.child && rests(&joint.parent) && rests(&joint.child) {
            let message = "neither side of the joint can move".to_owned();
            self.report(key, message, "remove the joint");
        }
        match (joint.position, joint.anchor_parent, joint.anchor_child) {
            (Some(_), None, None) | (None, Some(_), Some(_)) => {}
            (Some(_), _, _) => {
                let message = "the place of the joint is stated twice".to_owned();
                let help = "keep `position`, or `anchor_parent` and `anchor_child`";
                self.report(format!("{key}.position"), message, help);
            }
            _ => {
                let message = "the joint has no place".to_owned();
                let help = "add `position = [x, y, z]` (in space, initially), or both \
                            `anchor_parent` and `anchor_child`";
                self.report(key, message, help);
            }
        }
        self.drives(key, joint, known);
        match joint.axis {
            None if joint.kind.has_axis() => {
                let message = "this type of joint needs an axis".to_owned();
                self.report(key, message, "add `axis = [0, 0, 1]` (in space, initially)");
            }
            Some(axis) if axis.iter().all(|a| a.abs() < 1e-100) => {
                let message = "the axis has zero length".to_owned();
                self.report(format!("{key}.axis"), message, "write a direction, such as [0, 0, 1]");
            }
            _ => {}
        }
        self.second_axis(key, joint);
        self.first_axis(key, joint);
    }

    fn first_axis(&mut self, key: &str, joint: &Joint) {
        let at = format!("{key}.first_axis");
        let Some(first) = joint.first_axis.map(Vector3::from) else { return };
        // restated from another frame
        let of_frame = !joint.kind.has_axis() && joint.axis.is_some();
        if !joint.kind.has_first_axis() && !of_frame {
            let message = "this type of joint has no `first_axis`".to_owned();
            let help = match joint.kind.has_second_axis() {
                true => "its first axis is `axis2`: remove `first_axis`",
                false => "remove `first_axis`",
            };
            self.report(at, message, help);
            return;
        }
        if first.amax() < 1e-100 {
            let message = "the axis has zero length".to_owned();
            self.report(at, message, "write a direction, such as [1, 0, 0]");
            return;
        }
        let axis = joint.axis.map(Vector3::from).filter(|axis| axis.amax() >= 1e-100);
        let across = axis.map(|axis| axis.normalize().cross(&first.normalize()).norm());
        if across.is_some_and(|across| across <= 1e-6) {
            let message = "`first_axis` is along `axis`".to_owned();
            self.report(at, message, "choose a direction across `axis`");
        }
    }

    fn second_axis(&mut self, key: &str, joint: &Joint) {
        let at = format!("{key}.axis2");
        let Some(second) = joint.axis2 else {
            if joint.kind.has_second_axis() {
                let message = "this type of joint needs a second axis".to_owned();
                let help = "add `axis2 = [0, 1, 0]` (fixed in the child; in space, initially, \
                            perpendicular to `axis`)";
                self.report(key, message, help);
            }
            return;
        };
        if !joint.kind.has_second_axis() {
            let message = "this type of joint has no second axis".to_owned();
            self.report(at, message, "remove `axis2`, or write type = \"universal\"");
            return;
        }
        let second = Vector3::from(second);
        if second.amax() < 1e-100 {
            let message = "the axis has zero length".to_owned();
            self.report(at, message, "write a direction, such as [0, 1, 0]");
            return;
        }
        let first = joint.axis.map(Vector3::from).filter(|first| first.amax() >= 1e-100);
        let cosine = first.map_or(0.0, |first| first.normalize().dot(&second.normalize()));
        if cosine.abs() > 1e-6 {
            let angle = libm::acos(cosine.clamp(-1.0, 1.0)).to_degrees();
            let message = format!("the axes of the joint are at {angle:.4}° to each other");
            self.report(at, message, "choose `axis2` perpendicular to `axis`");
        }
    }

    fn spring(&mut self, key: &str, spring: &Spring) {
        let sections = ["body", "particle", GROUND];
        let from = self.refers(format!("{key}.from"), &spring.from, &sections);
        let to = self.refers(format!("{key}.to"), &spring.to, &sections);
        self.two_ends(&format!("{key}.to"), &spring.from, &spring.to);
        let ends = [
            ("point_from", &spring.from, &spring.point_from),
            ("point_to", &spring.to, &spring.point_to),
        ];
        for (end, member, point) in ends {
            let Some(point) = point else { continue };
            self.length(&format!("{key}.{end}"), point, false);
            if self.kinds.get(member.as_str()) == Some(&"particle") {
                let message = format!("`{member}` is a particle, it has no other points");
                self.report(format!("{key}.{end}"), message, format!("remove `{end}`"));
            }
        }
        let amounts = [
            ("stiffness", Some(spring.stiffness)),
            ("natural_length", spring.natural_length),
            ("damping", Some(spring.damping)),
        ];
        for (name, value) in amounts {
            if let Some(value) = value.filter(|v| *v < 0.0) {
                let message = format!("{name} = {value} is negative");
                let help = match name {
                    "stiffness" => {
                        "write 0 or a positive number: a spring pulls towards its natural length"
                    }
                    _ => "write 0 or a positive number",
                };
                self.report(format!("{key}.{name}"), message, help);
            }
        }
        self.initial_tension(key, spring);
        let rest = spring.natural_length.filter(|_| spring.law == SpringLaw::Linear);
        let directed = rest.is_some_and(|length| length > 0.0) || spring.damping > 0.0;
        let coincident = || coincide(&self.points.spring(spring));
        if directed && from && to && spring.from != spring.to && coincident() {
            let message =
                "both ends start at the same point: its force has no direction".to_owned();
            let help = "move one of them, or write natural_length = 0 and no damping";
            self.report(key, message, help);
        }
    }
}
