//! Checks of contacts between bodies.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};
use vi_rigid::gap::{ContactShape, has_gap, is_smooth};

use crate::checks::Checker;
use crate::contact_pairs::{ContactPair, SideOfPair};
use crate::frames::start::is_ground;
use crate::types::contact::{BodyNames, Contact, ContactPlane, ContactSide};
use crate::{Body, GROUND, Impact, Overlap, Shape};

/// Most pairs of bodies of a model.
const MAX_PAIRS: usize = 100_000;

/// Shapes between which there is contact, in words.
pub(super) const AVAILABLE: &str = "all shapes but cones stand on planes; spheres, capsules, boxes and cylinders touch one another and corners of meshes: state such shapes as `collision`";

/// What a beam may touch, in words.
const BESIDE: &str = "name it in `b`, and a plane or bodies in `a`; beams do not touch one another";

/// Shapes between which there is compliant contact, in words.
const COMPLIANT: &str = "with a `model` spheres, capsules, ellipsoids, boxes and meshes stand on planes; spheres and capsules touch one another, spheres touch boxes and cylinders: state such shapes as `collision`";

impl Checker<'_> {
    /// The contacts of a model.
    pub(super) fn contacts(&mut self) {
        let model = self.model;
        let mut known: BTreeMap<[String; 2], &str> = BTreeMap::new();
        let mut left = MAX_PAIRS;
        for (i, contact) in model.contacts.iter().enumerate() {
            let key = self.document.label("contact", i).to_owned();
            self.contact(&key, contact);
            let (a, b) = model.sides_of(contact);
            let Some(rest) = left.checked_sub(a.len().saturating_mul(b.len())) else {
                let message = format!("more than {MAX_PAIRS} pairs of bodies may touch");
                return self.report(key, message, "name fewer bodies in `a` or in `b`");
            };
            left = rest;
            let mut joined = 0;
            let pairs = model.pairs_of(contact, &mut |_| joined += 1);
            if pairs.is_empty() && joined == 0 && !a.is_empty() && !b.is_empty() {
                let message = format!("nothing touches in contact `{}`", contact.name);
                let help = "name two bodies that are not the same, and of which one moves";
                self.report(key.clone(), message, help);
            }
            self.shapes_of(&key, &pairs);
            for pair in &pairs {
                let SideOfPair::Body(a) = pair.a else { continue };
                let names = [a.name.as_str().min(&pair.b.name), a.name.as_str().max(&pair.b.name)];
                let first = *known.entry(names.map(str::to_owned)).or_insert(&contact.name);
                if first != contact.name {
                    let message = format!(
                        "`{}` and `{}` touch in contact `{first}` already",
                        names[0], names[1]
                    );
                    self.report(key.clone(), message, "a pair of bodies has one contact");
                    break;
                }
            }
        }
    }

    fn contact(&mut self, key: &str, contact: &Contact) {
        match contact.is_rigid() {
            true => self.nonsmooth(key, "contacts", Some("give the contact a `model`")),
            false => self.contact_model(key, contact),
        }
        match &contact.a {
            ContactSide::Plane(side) => self.contact_plane(key, contact, &side.plane),
            ContactSide::Bodies(names) => {
                self.body_names(&format!("{key}.a"), names, false);
                if contact.relative_to.is_some() {
                    let message = "bodies have frames of their own".to_owned();
                    self.report(format!("{key}.relative_to"), message, "remove `relative_to`");
                }
            }
        }
        self.body_names(&format!("{key}.b"), &contact.b, true);
        if contact.friction < 0.0 {
            let message =
                format!("friction of `{}` is {}: it is negative", contact.name, contact.friction);
            self.report(format!("{key}.friction"), message, "write 0 or more");
        }
        let parts = [
            ("restitution", contact.restitution),
            ("tangential_restitution", contact.tangential_restitution),
        ];
        for (name, value) in parts.into_iter().filter(|(_, value)| !(0.0..=1.0).contains(value)) {
            let message = format!("{name} of `{}` is {value}: between 0 and 1", contact.name);
            let help = "0 for an impact that takes the velocity away, 1 for one that gives it back";
            self.report(format!("{key}.{name}"), message, help);
        }
        if let Some(own) = contact.static_friction {
            self.static_friction(key, contact, own);
        }
        if contact.overlap == Overlap::Separate && !contact.is_rigid() {
            let message = "a contact with a `model` may overlap: its force parts what does";
            self.report(format!("{key}.overlap"), message.to_owned(), "remove `overlap`");
        }
        let moreau = self.model.settings.impact == Impact::Moreau;
        if contact.tangential_restitution > 0.0 && moreau && contact.is_rigid() {
            let message = "after Moreau the tangential restitution is that of the normal";
            let help =
                "remove `tangential_restitution`, or write impact = \"newton\" under [simulation]";
            self.report(format!("{key}.tangential_restitution"), message.to_owned(), help);
        }
        if contact.tangential_restitution > 0.0 && contact.friction == 0.0 {
            let message = "without friction nothing acts across the normal".to_owned();
            let help = "write `friction`, or remove `tangential_restitution`";
            self.report(format!("{key}.tangential_restitution"), message, help);
        }
    }

    fn static_friction(&mut self, key: &str, contact: &Contact, own: f64) {
        let (at, name) = (format!("{key}.static_friction"), &contact.name);
        if !contact.is_rigid() {
            let message = "a contact with a `model` never sticks".to_owned();
            let help = "write `static_ratio` and `stribeck_velocity` of the `model`";
            self.report(at, message, help);
        } else if contact.friction == 0.0 {
            let message = "without friction nothing sticks".to_owned();
            self.report(at, message, "write `friction`, or remove `static_friction`");
        } else if own.is_nan() || own < contact.friction {
            let message = format!(
                "static friction of `{name}` is {own}, below that of sliding, {}",
                contact.friction
            );
            self.report(at, message, "write the larger of both");
        }
    }

    fn contact_plane(&mut self, key: &str, contact: &Contact, plane: &ContactPlane) {
        let at = format!("{key}.a.plane");
        if Vector3::from(plane.normal).amax() < 1e-100 {
            let message = "the normal has zero length".to_owned();
            let help = "write a direction, such as [0, 0, 1]";
            self.report(format!("{at}.normal"), message, help);
        }
        let on = plane.on.as_str();
        let known = self.refers(format!("{at}.on"), on, &["body", GROUND]);
        if known && !is_ground(on) && self.model.body(on).is_none() {
            let message = format!("`{on}` is a node of a beam: planes are on bodies");
            self.report(format!("{at}.on"), message, "write the name of a body, or \"ground\"");
        }
        if contact.relative_to.is_some() {
            let message = "the plane is stated in the axes of the body that carries it".to_owned();
            let help = "remove `relative_to`, or `on`";
            self.report(format!("{key}.relative_to"), message, help);
        }
    }

    /// Names of bodies, and where they `may_be_nodes` of beams and of nodes; one with `*` is that
    /// of one at least.
    fn body_names(&mut self, key: &str, names: &BodyNames, may_be_nodes: bool) {
        if names.list().is_empty() {
            let help = "write the name of a body, or \"*\" for all";
            self.report(key, "no body is named".to_owned(), help);
        }
        for name in names.list() {
            if is_ground(name) {
                let help = "write a = { plane = { position = [x, y, z], normal = [x, y, z] } }, or the name of a body with fixed = true";
                self.report(key, format!("`{GROUND}` has no shape"), help);
            } else if may_be_nodes && self.model.beams.iter().any(|beam| beam.is_any(name)) {
                // a beam, one of its nodes, or some of them
            } else if name.contains('*') {
                let own = BodyNames::One(name.clone());
                if !self.model.bodies.iter().any(|body| own.contain(&body.name)) {
                    let message = format!("no body has a name like `{name}`");
                    let help = "`*` stands for any characters: \"*\" for all bodies, \"rope.*\" for all nodes of the beam `rope`";
                    self.report(key, message, help);
                }
            } else if self.kinds.get(name.as_str()) == Some(&"particle") {
                let message = format!("`{name}` is a particle: bodies touch");
                self.report(key, message, "write a [[body]] with a shape in its place");
            } else if self.kinds.get(name.as_str()) == Some(&"beam") {
                if !may_be_nodes {
                    let message = format!("`{name}` is a beam: its nodes touch as `b`");
                    self.report(key, message, BESIDE);
                }
            } else if self.refers(key.to_owned(), name, &["body"])
                && self.model.body(name).is_none()
                && !may_be_nodes
            {
                let message = format!("`{name}` is a node of a beam: nodes touch as `b`");
                self.report(key, message, BESIDE);
            }
        }
    }

    /// There is contact between the shapes of all pairs; each kind of fault is reported once.
    fn shapes_of(&mut self, key: &str, pairs: &[ContactPair<'_>]) {
        let mut said = Vec::new();
        for pair in pairs {
            let bodies = match pair.a {
                SideOfPair::Plane(_) => vec![pair.b.as_ref()],
                SideOfPair::Body(a) => vec![a, pair.b.as_ref()],
            };
            let bare = bodies.iter().find(|body| body.contact_shapes().is_empty());
            let (message, help) = if let Some(beam) = bare.and_then(|own| own.name.split_once('.'))
            {
                let help = "add `radius`, m, to the beam: that of the spheres with which its nodes touch; sections of shape circle and tube without stations have theirs";
                (format!("the beam `{}` has no radius", beam.0), help.to_owned())
            } else if let Some(body) = bare {
                let help = "add a `shape`, or `collision = [ … ]`";
                (format!("`{}` has no shape", body.name), help.to_owned())
            } else if let Some([a, b]) = unavailable(pair) {
                let names = [pair.a.name(), pair.b.name.as_str()];
                let message = format!(
                    "the contact of a {a} (`{}`) with a {b} (`{}`) is not available",
                    names[0], names[1]
                );
                let rigid = pair.contact.is_rigid();
                (message, if rigid { AVAILABLE } else { COMPLIANT }.to_owned())
            } else {
                continue;
            };
            if !said.contains(&message) {
                self.report(key, message.clone(), help);
                said.push(message);
            }
        }
    }
}

/// Shapes with their words; `None` where one touches nothing.
type Shapes = Vec<(String, Option<ContactShape>)>;

fn shapes_with_words(shapes: &[Shape]) -> Shapes {
    let word = |shape: &Shape| format!("{:?}", shape.kind).to_lowercase();
    let form = |own: &Shape| own.contact_shape(&Matrix3::identity(), Vec::new());
    shapes.iter().map(|own| (word(own), form(own))).collect()
}

/// The first shapes of two sides that have no contact.
fn first_apart(
    [a, b]: [&Shapes; 2],
    touch: fn(&ContactShape, &ContactShape) -> bool,
) -> Option<[String; 2]> {
    let pairs = a.iter().flat_map(|a| b.iter().map(move |b| (a, b)));
    let mut apart = pairs
        .filter(|((_, a), (_, b))| !a.as_ref().zip(b.as_ref()).is_some_and(|(a, b)| touch(a, b)));
    apart.next().map(|((a, _), (b, _))| [a.clone(), b.clone()])
}

/// Shapes of a pair between which there is no contact.
fn unavailable(pair: &ContactPair<'_>) -> Option<[String; 2]> {
    let a = match pair.a {
        SideOfPair::Plane(plane) => {
            vec![("plane".into(), Some(plane.contact_shape(&Matrix3::identity())))]
        }
        SideOfPair::Body(body) => shapes_with_words(body.contact_shapes()),
    };
    let b = shapes_with_words(pair.b.contact_shapes());
    first_apart([&a, &b], if pair.contact.is_rigid() { has_gap } else { is_smooth })
}

/// Shapes of two bodies between which there is no gap.
pub(super) fn without_gap(a: &Body, b: &Body) -> Option<[String; 2]> {
    let [a, b] = [a, b].map(|body| shapes_with_words(body.contact_shapes()));
    first_apart([&a, &b], has_gap)
}
