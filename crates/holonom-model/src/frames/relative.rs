//! `relative_to`: parts stated in the frame of a body, a node, a joint or a `[[frame]]`, resolved
//! into the inertial frame.
//!
//! | frame of | origin | axes | moves |
//! |---|---|---|---|
//! | body, node of a beam | its centre | its own | with it, at the initial velocities that it states |
//! | `[[frame]]` | its position | its own | with the frame in which it is stated |
//! | joint with `position` | the joint point | those of the frame in which the joint is stated | with that frame |
//! | joint with anchors | the anchor on the parent | those of the parent | with the parent |
//!
//! A part needs the frame of one other part, which may need that of another, in any order of the
//! file: chains are followed without recursion, and one that returns to itself is an error.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Matrix3;

use super::posed;
use super::start::is_ground;
use crate::text::problem::{MAX_PROBLEMS, Problem, nearest, some};
use crate::text::source::Document;
use crate::types::reference_frame::MovingFrame;
use crate::{Constraint, GROUND, Joint, Model};

/// A part of the model: its section and its number there.
type SectionEntry = (&'static str, usize);

/// Where the frame of a name comes from.
#[derive(Clone, Copy)]
enum FrameSource {
    Inertial,
    /// A part, and the node if it is a beam.
    Of(SectionEntry, usize),
}

/// How far a part is.
#[derive(Clone, Copy, PartialEq)]
enum PartProgress {
    Waiting,
    Known,
}

/// Resolves all `relative_to` of a model; what is wrong with them.
pub(crate) fn resolve(model: &mut Model, document: &Document<'_>) -> Vec<Problem> {
    let stated: Vec<SectionEntry> =
        parts(model).filter(|part| target(model, *part).is_some()).collect();
    if stated.is_empty() && model.frames.is_empty() {
        return Vec::new();
    }
    if model.header.dimension == 2 {
        let help = "write all positions in the inertial frame";
        let planar = |(section, index): SectionEntry| {
            let key = format!("{}.relative_to", document.label(section, index));
            let span = document.span(&key);
            Problem::new(key, "planar models have no reference frames").help(help).at(span)
        };
        let frames = (0..model.frames.len()).map(|index| ("frame", index));
        return stated.into_iter().chain(frames).take(MAX_PROBLEMS).map(planar).collect();
    }
    let mut resolver = Resolver {
        names: names(model),
        rates: model.joints.iter().any(|joint| joint.rate.is_some()),
        jointed: model
            .joints
            .iter()
            .flat_map(|j| [&j.parent, &j.child])
            .map(|n| owner(n))
            .collect(),
        bases: BTreeMap::new(),
        nodes: BTreeMap::new(),
        states: BTreeMap::new(),
        problems: Vec::new(),
        model,
        document,
    };
    for part in stated {
        resolver.follow(part);
    }
    let problems = resolver.problems;
    if problems.is_empty() { frame_faults(model, document) } else { problems }
}

/// What is wrong with the orientations of the frames.
fn frame_faults(model: &Model, document: &Document<'_>) -> Vec<Problem> {
    let fault = |(k, frame): (usize, &crate::ReferenceFrame)| {
        let problem = frame.orientation().fault()?.below(document.label("frame", k));
        let span = document.span(&problem.key);
        Some(problem.at(span))
    };
    model.frames.iter().enumerate().filter_map(fault).take(MAX_PROBLEMS).collect()
}

/// All parts that may state a frame.
fn parts(model: &Model) -> impl Iterator<Item = SectionEntry> + use<> {
    let counts = [
        ("frame", model.frames.len()),
        ("body", model.bodies.len()),
        ("beam", model.beams.len()),
        ("particle", model.particles.len()),
        ("bar", model.bars.len()),
        ("joint", model.joints.len()),
        ("constraint", model.constraints.len()),
        ("contact", model.contacts.len()),
        ("spring", model.springs.len()),
        ("bushing", model.bushings.len()),
        ("load", model.loads.len()),
        ("law", model.laws.len()),
        ("control", model.controls.len()),
    ];
    counts.into_iter().flat_map(|(section, count)| (0..count).map(move |index| (section, index)))
}

/// The frame that a part states.
fn target(model: &Model, (section, index): SectionEntry) -> Option<&str> {
    let named = match section {
        "frame" => &model.frames[index].relative_to,
        "body" => &model.bodies[index].relative_to,
        "beam" => &model.beams[index].relative_to,
        "particle" => &model.particles[index].relative_to,
        "bar" => &model.bars[index].relative_to,
        "joint" => &model.joints[index].relative_to,
        "contact" => &model.contacts[index].relative_to,
        "spring" => &model.springs[index].relative_to,
        "bushing" => &model.bushings[index].relative_to,
        "load" => &model.loads[index].relative_to,
        "law" => &model.laws[index].relative_to,
        "control" => &model.controls[index].relative_to,
        _ => match &model.constraints[index] {
            Constraint::Distance { relative_to, .. }
            | Constraint::PointOnLine { relative_to, .. }
            | Constraint::PointOnPlane { relative_to, .. }
            | Constraint::Rolling { relative_to, .. }
            | Constraint::Blade { relative_to, .. } => relative_to,
            Constraint::Gear { .. } | Constraint::Motion { .. } | Constraint::Velocity { .. } => {
                &None
            }
        },
    };
    named.as_deref()
}

/// The part of each name; of two parts of one name the first counts.
fn names(model: &Model) -> BTreeMap<String, SectionEntry> {
    let name = |(section, index): SectionEntry| {
        match section {
            "frame" => &model.frames[index].name,
            "body" => &model.bodies[index].name,
            "beam" => &model.beams[index].name,
            "particle" => &model.particles[index].name,
            "bar" => &model.bars[index].name,
            "joint" => &model.joints[index].name,
            "contact" => &model.contacts[index].name,
            "spring" => &model.springs[index].name,
            "bushing" => &model.bushings[index].name,
            "load" => &model.loads[index].name,
            "law" => &model.laws[index].name,
            "control" => &model.controls[index].name,
            _ => return model.constraints[index].name().to_owned(),
        }
        .clone()
    };
    let mut names = BTreeMap::new();
    for part in parts(model) {
        names.entry(name(part)).or_insert(part);
    }
    for (index, sensor) in model.sensors.iter().enumerate() {
        names.entry(sensor.name.clone()).or_insert(("sensor", index));
    }
    names
}

struct Resolver<'a> {
    model: &'a mut Model,
    document: &'a Document<'a>,
    names: BTreeMap<String, SectionEntry>,
    /// Whether a joint states a rate: the velocities of joined bodies then follow from the joints.
    rates: bool,
    jointed: BTreeSet<String>,
    /// The frames in which joints and frames are stated.
    bases: BTreeMap<SectionEntry, MovingFrame>,
    /// The frames of the nodes of beams.
    nodes: BTreeMap<usize, Vec<MovingFrame>>,
    states: BTreeMap<SectionEntry, PartProgress>,
    problems: Vec<Problem>,
}

impl Resolver<'_> {
    /// Resolves a part after all those that it depends on.
    fn follow(&mut self, first: SectionEntry) {
        let mut chain = vec![first];
        while let Some(&part) = chain.last() {
            if self.states.get(&part) == Some(&PartProgress::Known) {
                chain.pop();
                continue;
            }
            self.states.insert(part, PartProgress::Waiting);
            let origin = self.origin(part);
            if let Some(needed) = origin.and_then(|origin| self.needed(origin)) {
                match self.states.get(&needed) {
                    Some(PartProgress::Known) => {}
                    Some(PartProgress::Waiting) => {
                        self.circle(&chain, needed);
                        chain
                            .iter()
                            .for_each(|part| _ = self.states.insert(*part, PartProgress::Known));
                        return;
                    }
                    None => {
                        chain.push(needed);
                        continue;
                    }
                }
            }
            if let Some(frame) = origin.and_then(|origin| self.frame(origin)) {
                self.pose(part, &frame);
            }
            self.states.insert(part, PartProgress::Known);
            chain.pop();
        }
    }

    /// Where the frame that a part states comes from; `None` where it states none, or names nothing
    /// that has one.
    fn origin(&mut self, part: SectionEntry) -> Option<FrameSource> {
        let name = target(self.model, part)?.to_owned();
        if is_ground(&name) {
            return Some(FrameSource::Inertial);
        }
        if let Some((beam, place)) = name.split_once('.')
            && let Some(&(section @ "beam", index)) = self.names.get(beam)
        {
            let node = self.model.beams[index].node(place);
            let origin = node.map(|node| FrameSource::Of((section, index), node));
            return origin.or_else(|| self.refuse(part, &name));
        }
        match self.names.get(&name) {
            Some(found @ ("body" | "joint" | "frame", _)) => Some(FrameSource::Of(*found, 0)),
            _ => self.refuse(part, &name),
        }
    }

    /// The part that has to be known before this frame is.
    fn needed(&mut self, origin: FrameSource) -> Option<SectionEntry> {
        let FrameSource::Of(part, _) = origin else { return None };
        match part {
            ("joint", index) => match self.carrier(index) {
                Some(FrameSource::Of(carrier, _)) => Some(carrier),
                Some(FrameSource::Inertial) | None => Some(part),
            },
            _ => Some(part),
        }
    }

    /// What carries the anchor of a joint: a body or a node; `None` for a joint that is stated in
    /// space.
    fn carrier(&self, joint: usize) -> Option<FrameSource> {
        let Joint { parent, anchor_parent: Some(_), position: None, .. } =
            &self.model.joints[joint]
        else {
            return None;
        };
        match *self.names.get(&owner(parent))? {
            part @ ("body", _) => Some(FrameSource::Of(part, 0)),
            part @ ("beam", index) => {
                let (_, place) = parent.split_once('.')?;
                Some(FrameSource::Of(part, self.model.beams[index].node(place)?))
            }
            _ => None,
        }
    }

    /// A frame whose part is known.
    fn frame(&mut self, origin: FrameSource) -> Option<MovingFrame> {
        let inertial = MovingFrame::inertial();
        let FrameSource::Of((section, index), node) = origin else { return Some(inertial) };
        match section {
            "body" => Some(MovingFrame::of(&self.model.bodies[index])),
            "beam" => self.node(index, node),
            "joint" => self.joint(index),
            _ => {
                let frame = &self.model.frames[index];
                let base = self.bases.get(&("frame", index)).copied().unwrap_or(inertial);
                Some(base.fixed(frame.position.into(), &frame.orientation().rotation()))
            }
        }
    }

    /// The frame of a joint, whose values are stated in the inertial frame.
    fn joint(&mut self, index: usize) -> Option<MovingFrame> {
        let carrier = self.carrier(index);
        let joint = &self.model.joints[index];
        let (position, anchor) = (joint.position, joint.anchor_parent);
        if let Some(carrier) = carrier {
            let frame = self.frame(carrier)?;
            return Some(frame.fixed(anchor?.into(), &Matrix3::identity()));
        }
        let base = self.bases.get(&("joint", index)).copied();
        let mut frame = base.unwrap_or_else(MovingFrame::inertial);
        let origin = position.or(anchor)?.into();
        frame.velocity = frame.velocity_at(&origin);
        frame.origin = origin;
        Some(frame)
    }

    /// The frame of a node of a beam whose values are stated in the inertial frame.
    fn node(&mut self, index: usize, node: usize) -> Option<MovingFrame> {
        let beam = &self.model.beams[index];
        let nodes = self.nodes.entry(index).or_insert_with(|| posed::nodes(beam));
        nodes.get(node).copied()
    }

    /// Restates a part in the inertial frame.
    fn pose(&mut self, part: SectionEntry, frame: &MovingFrame) {
        let (section, index) = part;
        let by_joints = |name: &str| self.rates && self.jointed.contains(name);
        match section {
            "body" => {
                let body = &mut self.model.bodies[index];
                if body.fixed && frame.moves() {
                    let name = body.relative_to.take().unwrap_or_default();
                    let message = format!("the body is fixed, and the frame of `{name}` moves");
                    let help = "state it relative to a frame at rest, or remove `fixed = true`";
                    return self.report(part, message, help.to_owned());
                }
                posed::body(body, frame, by_joints(&body.name));
            }
            "beam" => {
                let beam = &mut self.model.beams[index];
                posed::beam(beam, frame, by_joints(&beam.name));
            }
            "particle" => posed::particle(&mut self.model.particles[index], frame),
            "bar" => posed::bar(&mut self.model.bars[index], frame),
            "joint" => posed::joint(&mut self.model.joints[index], frame),
            "contact" => posed::contact(&mut self.model.contacts[index], frame),
            "spring" => posed::spring(&mut self.model.springs[index], frame),
            "bushing" => posed::bushing(&mut self.model.bushings[index], frame),
            "load" => posed::load(&mut self.model.loads[index], frame),
            "law" => posed::law(&mut self.model.laws[index], frame),
            "control" => posed::control(&mut self.model.controls[index], frame),
            "constraint" => posed::constraint(&mut self.model.constraints[index], frame),
            _ => {}
        }
        if ["joint", "frame"].contains(&section) {
            self.bases.insert(part, *frame);
        }
    }

    /// Reports a name that has no frame.
    fn refuse(&mut self, part: SectionEntry, name: &str) -> Option<FrameSource> {
        let message = match self.names.get(name) {
            Some(("beam", _)) => format!("`{name}` is a beam: its nodes have frames"),
            Some((section, _)) => format!("`{name}` is a {section}: it has no frame"),
            None => format!("there is no body, joint or frame named `{name}`"),
        };
        let framed =
            |(_, part): &(&String, &SectionEntry)| ["body", "joint", "frame"].contains(&part.0);
        let known = self.names.iter().filter(framed).map(|(name, _)| name.as_str());
        let known: Vec<&str> = known.chain([GROUND]).collect();
        let help = match (self.names.get(name), nearest(name, known.iter().copied())) {
            (Some(("beam", _)), _) => format!("write `{name}.start`, `{name}.end` or `{name}.0`"),
            (None, Some(best)) => format!("did you mean `{best}`?"),
            _ => format!("there are: {}", some(&known)),
        };
        self.report(part, message, help);
        None
    }

    /// Reports parts that are stated relative to each other.
    fn circle(&mut self, chain: &[SectionEntry], again: SectionEntry) {
        let start = chain.iter().position(|part| *part == again).unwrap_or(0);
        let named = |part: &SectionEntry| {
            self.names.iter().find(|(_, p)| *p == part).map(|(n, _)| n.as_str())
        };
        let mut names: Vec<&str> = chain[start..].iter().filter_map(named).take(8).collect();
        if chain.len() - start > names.len() {
            names.push("…");
        }
        names.extend(named(&again));
        let message = match names.as_slice() {
            [name, _] => format!("`{name}` is stated relative to itself"),
            names => format!("parts are stated relative to each other: {}", names.join(" → ")),
        };
        let help = match names.len() {
            2 => "name another frame, or leave `relative_to` out",
            _ => "state one of them relative to something else, or in the inertial frame",
        };
        self.report(again, message, help.to_owned());
    }

    fn report(&mut self, (section, index): SectionEntry, message: String, help: String) {
        if self.problems.len() < MAX_PROBLEMS {
            let key = format!("{}.relative_to", self.document.label(section, index));
            let span = self.document.span(&key);
            self.problems.push(Problem::new(key, message).help(help).at(span));
        }
    }
}

/// The body or beam of a name such as `arm` or `rod.end`.
fn owner(name: &str) -> String {
    name.split_once('.').map_or(name, |(beam, _)| beam).to_owned()
}
