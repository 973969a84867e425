//! Cases as model files: the same motion through keys, meshes, sensors and files of the program.

use super::{ContactCase, GAP, JointCase, NonsmoothCase, RATES, RESIDUAL, spin};
use crate::harness::case::{Deviation, raise};
use holonom::experiment::RunnableModel;
use holonom::model::ModelText;
use holonom::{Sample, Simulation};
use std::fmt::Write as _;
use std::path::Path;
use vi_testkit::model::{part, sensor};

impl NonsmoothCase {
    /// The text of the model, with the meshes of its points written to a folder.
    fn text(&self, folder: &Path) -> String {
        let Self { name, gravity, simulation, .. } = self;
        let end = simulation.step * simulation.steps as f64;
        let method = format!("{:?}", simulation.method).to_lowercase();
        let mut text = format!(
            "model = {{ name = \"{name}\", gravity = {gravity:?} }}\n\
             simulation = {{ step = {:?}, end = {end:?}, contact = \"{method}\" }}\n",
            simulation.step
        );
        for body in &self.bodies {
            let super::BodyCase { name, mass, inertia, position, matrix, .. } = body;
            let (velocity, omega) = (body.velocity, body.angular_velocity);
            text += &part("body", name);
            let _ =
                writeln!(text, "mass = {mass:?}\ninertia = {inertia:?}\nposition = {position:?}");
            let _ = writeln!(text, "matrix = {matrix:?}\nvelocity = {velocity:?}");
            let _ = writeln!(text, "angular_velocity = {omega:?}");
            let mut unique: Vec<String> = Vec::new();
            for shape in self.contacts.iter().filter_map(|own| own.shape(name, folder)) {
                if !unique.contains(&shape) {
                    unique.push(shape);
                }
            }
            if !unique.is_empty() {
                let _ = writeln!(text, "collision = [{}]", unique.join(", "));
            }
        }
        self.joints.iter().for_each(|joint| text += &joint.text());
        for (k, contact) in self.rules() {
            text += &contact.text(&rule(k));
            text += &sensor(&format!("gap of {}", rule(k)), "gap", &rule(k));
        }
        for body in &self.bodies {
            text += &sensor(&format!("v of {}", body.name), "velocity", &body.name);
            text += &sensor(&format!("omega of {}", body.name), "angular_velocity", &body.name);
        }
        text
    }

    /// The contacts that are sections of their own: two of the same bodies are points of one.
    fn rules(&self) -> impl Iterator<Item = (usize, &ContactCase)> {
        let new = |(k, own): &(usize, &ContactCase)| {
            !self.contacts[..*k].iter().any(|other| other.a == own.a && other.b == own.b)
        };
        self.contacts.iter().enumerate().filter(new)
    }

    /// Deviations of the run of the model file.
    pub fn run_model_file(&self, folder: &Path) -> Result<Deviation, String> {
        let path = folder.join(format!("{}.toml", self.name));
        std::fs::write(&path, self.text(folder)).map_err(|e| e.to_string())?;
        let model = ModelText::read(&path).model(&[]).map_err(|e| e.to_string())?;
        let mut simulation = Simulation::new(&model).map_err(|e| e.to_string())?;
        let columns: Vec<String> =
            simulation.sensors().columns().iter().map(|column| column.name()).collect();
        let samples: Result<Vec<Sample>, _> = simulation.samples().collect();
        let samples = samples.map_err(|failure| failure.message)?;
        let of = |sample: &Sample, name: &str| -> Result<f64, String> {
            let place = columns.iter().position(|own| own == name);
            place.map(|k| sample.sensors[k]).ok_or_else(|| format!("no column {name}"))
        };
        let mut deviation = Deviation::default();
        let tolerance = self.discrete.tolerance;
        // velocities before the impulses of a node: of its momentum, as no sensor reads them
        let rubs = self.joints.iter().any(|joint| joint.friction.is_some());
        let mut arriving = Simulation::new(&model).map_err(|e| e.to_string())?;
        for node in &self.discrete.nodes {
            let sample = samples.get(node.step).ok_or("too few nodes")?;
            while arriving.integrator().state().step < node.step as u64 {
                arriving.step_on().map_err(|failure| failure.message)?;
            }
            let is_free = !rubs && node.gaps.iter().all(|gap| *gap > 0.01);
            let v = arriving.integrator().observe_state().map_err(|e| e.to_string())?.v.clone();
            for (k, body) in self.bodies.iter().enumerate() {
                let q = &sample.q[12 * k..12 * (k + 1)];
                let places = node.position[k].iter().chain(node.directors[k].iter().flatten());
                for (found, wanted) in q.iter().zip(places) {
                    raise(&mut deviation.q, (found - wanted).abs() / tolerance);
                }
                let v = &v[12 * k..12 * (k + 1)];
                let omega = spin(q, v);
                let found = v[..3].iter().chain(omega.as_slice());
                let wanted = node.velocity[k].iter().chain(&node.angular_velocity[k]);
                for (found, wanted) in found.zip(wanted) {
                    raise(&mut deviation.p, (found - wanted).abs() / (RATES * tolerance));
                }
                // sensors read the same where the impulses up to the node change nothing
                for (what, before) in [("v", &v[..3]), ("omega", omega.as_slice())] {
                    for (axis, before) in ["x", "y", "z"].iter().zip(before) {
                        let found = of(sample, &format!("{what} of {}.{axis}", body.name))?;
                        if is_free {
                            raise(&mut deviation.p, (found - before).abs() / (RATES * tolerance));
                        }
                    }
                }
            }
            raise(&mut deviation.momentum, sample.residuals.position / RESIDUAL);
            self.compare_gaps(node, &|name| of(sample, name), &mut deviation)?;
        }
        let counts = simulation.contact_counts().ok_or("no contacts")?;
        if counts.guarded != self.properties.guard {
            return Err(format!("{} impacts are guarded", counts.guarded));
        }
        let smallest = counts.smallest_gap.unwrap_or(0.0);
        raise(&mut deviation.momentum, -smallest / GAP);
        let lost = (counts.dissipated - self.properties.dissipated).abs();
        raise(&mut deviation.energy, lost / (RATES * tolerance));
        Ok(deviation)
    }

    /// The smallest gap of each section.
    fn compare_gaps(
        &self,
        node: &super::NodeCase,
        of: &dyn Fn(&str) -> Result<f64, String>,
        deviation: &mut Deviation,
    ) -> Result<(), String> {
        let mut wanted = vec![f64::INFINITY; self.contacts.len()];
        let mut gaps = node.gaps.iter();
        for (k, contact) in self.contacts.iter().enumerate() {
            let of_rule = self.rules().find(|(_, own)| own.a == contact.a && own.b == contact.b);
            let own = of_rule.map_or(k, |(rule, _)| rule);
            for gap in gaps.by_ref().take(contact.points.len().max(1)) {
                wanted[own] = wanted[own].min(*gap);
            }
        }
        for (k, _) in self.rules().filter(|(k, _)| wanted[*k].is_finite()) {
            let found = of(&format!("gap of {}", rule(k)))?;
            raise(&mut deviation.q, (found - wanted[k]).abs() / self.discrete.tolerance);
        }
        Ok(())
    }
}

/// The name of a section.
fn rule(k: usize) -> String {
    format!("rule {k}")
}

impl ContactCase {
    /// The shape with which a body takes part, if it does.
    fn shape(&self, body: &str, folder: &Path) -> Option<String> {
        let ball = |radius: f64| {
            format!(
                "{{ type = \"sphere\", dimensions = [{radius:?}], position = {:?} }}",
                self.center
            )
        };
        match self.kind.as_str() {
            "sphere-sphere" if self.a == body => Some(ball(self.radius_a)),
            "sphere-sphere" if self.b == body => Some(ball(self.radius_b)),
            "sphere-plane" if self.b == body => Some(ball(self.radius)),
            "points-plane" if self.b == body => Some(self.mesh(body, folder)),
            _ => None,
        }
    }

    /// The points as the corners of triangles, with corners behind them where there are too few.
    fn mesh(&self, body: &str, folder: &Path) -> String {
        let mut corners = self.points.clone();
        let [x, y, z] = corners[0];
        while corners.len() < 3 {
            corners.push([-x, y, z + 0.01 * corners.len() as f64]);
        }
        let mut text: String =
            corners.iter().map(|[x, y, z]| format!("v {x:?} {y:?} {z:?}\n")).collect();
        for k in 2..corners.len() {
            let _ = writeln!(text, "f {} {} {}", k - 1, k, k + 1);
        }
        let file = format!("{body}.obj");
        std::fs::write(folder.join(&file), text).expect("a folder for tests");
        format!("{{ type = \"mesh\", file = \"{file}\" }}")
    }

    fn text(&self, name: &str) -> String {
        let Self { a, b, point, normal, friction, restitution, tangential_restitution, .. } = self;
        let mut text = part("contact", name);
        if self.kind == "sphere-sphere" {
            let _ = writeln!(text, "a = \"{a}\"");
        } else {
            let plane = format!("position = {point:?}, normal = {normal:?}, on = \"{a}\"");
            let _ = writeln!(text, "a = {{ plane = {{ {plane} }} }}");
        }
        let _ =
            writeln!(text, "b = \"{b}\"\nfriction = {friction:?}\nrestitution = {restitution:?}");
        if *tangential_restitution > 0.0 {
            let _ = writeln!(text, "tangential_restitution = {tangential_restitution:?}");
        }
        text
    }
}

impl JointCase {
    fn text(&self) -> String {
        let Self { name, kind, parent, child, position, axis, spring, friction, limits } = self;
        let mut text = part("joint", name);
        let _ = writeln!(text, "type = \"{kind}\"\nparent = \"{parent}\"\nchild = \"{child}\"");
        let _ = writeln!(text, "position = {position:?}");
        if let Some(axis) = axis {
            let _ = writeln!(text, "axis = {axis:?}");
        }
        if let Some([stiffness, rest]) = spring {
            let _ = writeln!(text, "spring = {{ stiffness = {stiffness:?}, rest = {rest:?} }}");
        }
        if let Some(limits) = limits {
            let end = |name: &str, limit: Option<f64>| {
                limit.map_or_else(String::new, |limit| format!("{name} = {limit:?}, "))
            };
            let ends = end("lower", limits.lower) + &end("upper", limits.upper);
            let _ = writeln!(text, "limits = {{ {ends}restitution = {:?} }}", limits.restitution);
        }
        if let Some(friction) = friction {
            let number = |key: &str| friction.get(key).copied();
            let _ = match (number("torque"), number("mu"), number("radius")) {
                (Some(effort), ..) if kind == "prismatic" => {
                    writeln!(text, "friction = {{ force = {effort:?} }}")
                }
                (Some(effort), ..) => writeln!(text, "friction = {{ torque = {effort:?} }}"),
                (None, mu, radius) => {
                    let (mu, radius) = (mu.unwrap_or(0.0), radius.unwrap_or(0.0));
                    writeln!(text, "friction = {{ coefficient = {mu:?}, radius = {radius:?} }}")
                }
            };
        }
        text
    }
}
