//! A model as commented text.

use std::fmt::Write;

use holonom_model::{
    Body, BodyNames, Bushing, Coefficients, Constraint, Contact, ContactSide, Formula, Inertia,
    Joint, Law, Limits, Scale, Sensor, Shape, Signal, Spring,
};

use crate::drafter::Draft;
use crate::remark::Remark;

/// The text of a model file: its head says where it comes from and what it lacks.
pub(crate) fn text(draft: &Draft, origin: &str, remarks: &[Remark]) -> String {
    let model = &draft.model;
    let mut out = String::new();
    comment(&mut out, &format!("Imported from {origin}."));
    if remarks.is_empty() {
        comment(&mut out, "Everything was translated.");
    } else {
        comment(&mut out, "Not translated, or in another form:");
        remarks.iter().for_each(|remark| comment(&mut out, &format!("- {remark}")));
    }
    if model.bodies.iter().any(|body| body.mesh_files().next().is_some()) {
        comment(
            &mut out,
            "The files of meshes are named relative to the folder of this file; they are not copied.",
        );
    }
    let mut writer = TomlWriter(out);
    writer.section("[model]");
    writer.pair("name", &quoted(&model.header.name));
    writer.pair("gravity", &list(&model.header.gravity));
    writer.section("[simulation]");
    writer.pair("step", &number(model.settings.step));
    writer.pair("end", &number(model.settings.end));
    if model.settings.project_start {
        writer.pair("project_start", "true");
    }
    for (body, remark) in model.bodies.iter().zip(&draft.on_bodies) {
        writer.commented("[[body]]", remark);
        writer.body(body);
    }
    for (joint, remark) in model.joints.iter().zip(&draft.on_joints) {
        writer.commented("[[joint]]", remark);
        writer.joint(joint);
    }
    writer.sections("[[constraint]]", &model.constraints, TomlWriter::constraint);
    writer.sections("[[spring]]", &model.springs, TomlWriter::spring);
    writer.sections("[[bushing]]", &model.bushings, TomlWriter::bushing);
    writer.sections("[[law]]", &model.laws, TomlWriter::law);
    writer.sections("[[signal]]", &model.signals, TomlWriter::signal);
    writer.sections("[[contact]]", &model.contacts, TomlWriter::contact);
    writer.sections("[[sensor]]", &model.sensors, TomlWriter::sensor);
    writer.0
}

struct TomlWriter(String);

impl TomlWriter {
    /// A section for each part.
    fn sections<T>(&mut self, head: &str, parts: &[T], write: fn(&mut Self, &T)) {
        for part in parts {
            self.section(head);
            write(self, part);
        }
    }

    fn signal(&mut self, signal: &Signal) {
        self.pair("name", &quoted(&signal.name));
        self.formula("value", signal.value.as_ref());
    }

    fn section(&mut self, title: &str) {
        self.0 += &format!("\n{title}\n");
    }

    fn commented(&mut self, title: &str, remark: &str) {
        self.0.push('\n');
        if !remark.trim().is_empty() {
            comment(&mut self.0, remark.trim());
        }
        self.0 += &format!("{title}\n");
    }

    fn pair(&mut self, key: &str, value: &str) {
        self.0 += &format!("{key} = {value}\n");
    }

    fn body(&mut self, body: &Body) {
        self.pair("name", &quoted(&body.name));
        if let Some(mass) = body.mass {
            self.pair("mass", &number(mass));
        }
        match &body.inertia {
            Some(Inertia::Principal(moments)) => self.pair("inertia", &list(moments)),
            Some(Inertia::Tensor(rows)) => {
                self.pair("inertia", &format!("[{}]", rows.map(|row| list(&row)).join(", ")));
            }
            None => {}
        }
        self.pair("position", &list(&body.position));
        if let Some(quaternion) = &body.quaternion {
            self.pair("quaternion", &list(quaternion));
        }
        if let Some(visible) = body.visible {
            self.pair("visible", if visible { "true" } else { "false" });
        }
        if let Some(shape) = &body.shape {
            self.pair("shape", &format!("{{ {} }}", written(shape)));
        }
        for (key, shapes) in [("picture", &body.picture), ("collision", &body.collision)] {
            let part = |shape: &Shape| format!("    {{ {} }},\n", written(shape));
            let parts: String = shapes.iter().map(part).collect();
            if !shapes.is_empty() {
                self.pair(key, &format!("[\n{parts}]"));
            }
        }
    }

    fn joint(&mut self, joint: &Joint) {
        self.pair("name", &quoted(&joint.name));
        self.pair("type", &format!("\"{}\"", format!("{:?}", joint.kind).to_lowercase()));
        self.pair("parent", &quoted(&joint.parent));
        self.pair("child", &quoted(&joint.child));
        if let Some(position) = &joint.position {
            self.pair("position", &list(position));
        }
        for (key, anchor) in
            [("anchor_parent", &joint.anchor_parent), ("anchor_child", &joint.anchor_child)]
        {
            if let Some(anchor) = anchor {
                self.pair(key, &list(anchor));
            }
        }
        if let Some(axis) = &joint.axis {
            self.pair("axis", &list(axis));
        }
        if joint.cut {
            self.pair("cut", "true");
        }
        if let Some(spring) = &joint.spring {
            let (k, rest) = (number(spring.stiffness), number(spring.rest));
            let freedom = freedom(spring.freedom);
            self.pair("spring", &format!("{{ stiffness = {k}, rest = {rest}{freedom} }}"));
        }
        if let Some(damper) = &joint.damper {
            let (c, freedom) = (number(damper.damping), freedom(damper.freedom));
            self.pair("damper", &format!("{{ damping = {c}{freedom} }}"));
        }
        if let Some(motor) = &joint.motor {
            let gains = [motor.proportional, motor.derivative].map(number);
            let [proportional, derivative] = gains;
            let mut keys = format!("proportional = {proportional}, derivative = {derivative}");
            if motor.effort != 0.0 {
                keys += &format!(", effort = {}", number(motor.effort));
            }
            if motor.path.offset != 0.0 {
                keys += &format!(", path = {{ offset = {} }}", number(motor.path.offset));
            }
            self.pair("motor", &format!("{{ {keys} }}"));
        }
        match joint.limits {
            Some(Limits::Both(both)) => self.pair("limits", &list(&both)),
            Some(Limits::Table(limits)) => {
                let ends = [("lower", limits.lower), ("upper", limits.upper)].into_iter();
                let ends = ends.filter_map(|(key, x)| Some(format!("{key} = {}", number(x?))));
                self.pair("limits", &format!("{{ {} }}", ends.collect::<Vec<_>>().join(", ")));
            }
            None => {}
        }
        if let Some(friction) = joint.friction {
            let own = [("torque", friction.torque), ("force", friction.force)].into_iter();
            let own = own.filter_map(|(key, x)| Some(format!("{key} = {}", number(x?))));
            self.pair("friction", &format!("{{ {} }}", own.collect::<Vec<_>>().join(", ")));
        }
    }

    fn spring(&mut self, spring: &Spring) {
        self.pair("name", &quoted(&spring.name));
        self.ends(
            [&spring.from, &spring.to],
            [spring.point_from.as_deref(), spring.point_to.as_deref()],
        );
        self.pair("stiffness", &number(spring.stiffness));
        if let Some(length) = spring.natural_length {
            self.pair("natural_length", &number(length));
        }
        if spring.damping != 0.0 {
            self.pair("damping", &number(spring.damping));
        }
    }

    fn bushing(&mut self, bushing: &Bushing) {
        self.pair("name", &quoted(&bushing.name));
        self.pair("from", &quoted(&bushing.from));
        self.pair("to", &quoted(&bushing.to));
        self.pair("position", &list(&bushing.position));
        if let Some(Coefficients::Diagonal(along)) = &bushing.stiffness {
            let along = along.each_ref().map(|Formula(text)| text.as_str()).join(", ");
            self.pair("stiffness", &format!("[{along}]"));
        }
    }

    fn law(&mut self, law: &Law) {
        self.pair("name", &quoted(&law.name));
        if let Some(joint) = &law.joint {
            self.pair("joint", &quoted(joint));
        }
        if law.freedom != 0 {
            self.pair("freedom", &law.freedom.to_string());
        }
        if let (Some(from), Some(to)) = (&law.from, &law.to) {
            self.ends([from, to], [law.point_from.as_deref(), law.point_to.as_deref()]);
        }
        for (key, name) in [("on", &law.on), ("relative_to", &law.relative_to)] {
            if let Some(name) = name {
                self.pair(key, &quoted(name));
            }
        }
        if let Some(torque) = &law.torque {
            let along = torque.each_ref().map(|Formula(text)| quoted(text)).join(", ");
            self.pair("torque", &format!("[{along}]"));
        }
        self.formula("effort", law.effort.as_ref());
        self.formula("tension", law.tension.as_ref());
    }

    fn ends(&mut self, [from, to]: [&str; 2], points: [Option<&[f64]>; 2]) {
        self.pair("from", &quoted(from));
        self.pair("to", &quoted(to));
        for (key, point) in ["point_from", "point_to"].into_iter().zip(points) {
            if let Some(point) = point {
                self.pair(key, &list(point));
            }
        }
    }

    fn formula(&mut self, key: &str, formula: Option<&Formula>) {
        if let Some(Formula(text)) = formula {
            self.pair(key, &quoted(text));
        }
    }

    fn contact(&mut self, contact: &Contact) {
        self.pair("name", &quoted(&contact.name));
        if let Some(plane) = contact.plane() {
            let (position, normal) = (list(&plane.position), list(&plane.normal));
            let plane = format!("position = {position}, normal = {normal}");
            self.pair("a", &format!("{{ plane = {{ {plane} }} }}"));
        }
        let bodies = |names: &BodyNames| {
            let names: Vec<String> = names.list().iter().map(|name| quoted(name)).collect();
            format!("[{}]", names.join(", "))
        };
        if let ContactSide::Bodies(names) = &contact.a {
            self.pair("a", &bodies(names));
        }
        self.pair("b", &bodies(&contact.b));
        self.pair("friction", &number(contact.friction));
    }

    fn sensor(&mut self, sensor: &Sensor) {
        self.pair("name", &quoted(&sensor.name));
        self.pair("type", &quoted(&words(&format!("{:?}", sensor.kind))));
        if !sensor.of.is_empty() {
            self.pair("of", &quoted(&sensor.of));
        }
        self.formula("value", sensor.value.as_ref());
        if let Some(point) = &sensor.point {
            self.pair("point", &list(point));
        }
        if let Some(to) = &sensor.to {
            self.pair("to", &quoted(to));
        }
        if let Some(point) = &sensor.point_to {
            self.pair("point_to", &list(point));
        }
        if let Some(quaternion) = &sensor.quaternion {
            self.pair("quaternion", &list(quaternion));
        }
    }

    fn constraint(&mut self, constraint: &Constraint) {
        self.pair("name", &quoted(constraint.name()));
        match constraint {
            Constraint::Gear { joints, ratio, freedoms, .. } => {
                self.pair("type", "\"gear\"");
                let joints = joints.each_ref().map(|joint| quoted(joint)).join(", ");
                self.pair("joints", &format!("[{joints}]"));
                if *freedoms != [0, 0] {
                    self.pair("freedoms", &format!("{freedoms:?}"));
                }
                self.pair("ratio", &number(*ratio));
            }
            Constraint::Motion { joint, .. } => {
                self.pair("type", "\"motion\"");
                self.pair("joint", &quoted(joint));
                self.pair("path", "{}");
            }
            _ => {} // an imported model has no others
        }
    }
}

/// The keys of a shape.
fn written(shape: &Shape) -> String {
    let mut out = format!("type = \"{}\"", format!("{:?}", shape.kind).to_lowercase());
    if let Some(file) = &shape.file {
        out += &format!(", file = {}", quoted(file));
    }
    if !shape.dimensions.is_empty() {
        out += &format!(", dimensions = {}", list(&shape.dimensions));
    }
    match &shape.scale {
        Some(Scale::Uniform(factor)) => out += &format!(", scale = {}", number(*factor)),
        Some(Scale::Axes(factors)) => out += &format!(", scale = {}", list(factors)),
        None => {}
    }
    if let Some(position) = &shape.position {
        out += &format!(", position = {}", list(position));
    }
    if let Some(quaternion) = &shape.quaternion {
        out += &format!(", quaternion = {}", list(quaternion));
    }
    out
}

/// `JointRate` as `joint_rate`.
fn words(name: &str) -> String {
    let mut out = String::new();
    for c in name.chars() {
        if c.is_uppercase() && !out.is_empty() {
            out.push('_');
        }
        out.extend(c.to_lowercase());
    }
    out
}

fn freedom(index: usize) -> String {
    if index == 0 { String::new() } else { format!(", freedom = {index}") }
}

/// Comment lines of at most about 110 characters; nothing in them ends a comment.
fn comment(out: &mut String, words: &str) {
    let shown: String = words.chars().map(|c| if c.is_control() { '?' } else { c }).collect();
    let indent = if shown.starts_with("- ") { "  " } else { "" };
    let mut line = String::from("#");
    for word in shown.split(' ').filter(|word| !word.is_empty()) {
        if line.chars().count() + word.chars().count() > 110 {
            let _ = writeln!(out, "{line}");
            line = format!("# {}", indent.trim_end_matches(' '));
            line.truncate(1);
            line += indent;
        }
        line.push(' ');
        line += word;
    }
    let _ = writeln!(out, "{line}");
}

/// A name or a title in quotes.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => out += "\\\"",
            '\\' => out += "\\\\",
            c if c.is_control() => {
                let _ = write!(out, "\\u{:04X}", u32::from(c));
            }
            c => out.push(c),
        }
    }
    out + "\""
}

/// The shortest decimal that reads back as the same number.
fn number(value: f64) -> String {
    format!("{value:?}")
}

fn list(values: &[f64]) -> String {
    format!("[{}]", values.iter().copied().map(number).collect::<Vec<_>>().join(", "))
}
