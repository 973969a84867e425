//! Contacts of bodies, as parts of a mechanism.

use super::CORRECT;
use super::contact_gaps::{KnownShapes, axes, rigid, shapes_of_body};
use super::contact_origin::{
    ContactOrigin, FeatureSides, ShapeElement, TouchingBodies, TouchingShapes,
};
use super::joint_drive::stribeck;
use super::names::Names;
use holonom_model::contact_pairs::{ContactPair, SideOfPair};
use holonom_model::{Body, Contact, ContactModel, GROUND, ModelError, Problem};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use vi_constraints::nonsmooth::{ContactLaw, Unilateral};
use vi_core::Configuration;
use vi_core::interval::Interval;
use vi_multibody::builder::MechanismBuilder;
use vi_multibody::contact::compliant_contact::{CompliantContact, CompliantLaw};
use vi_multibody::contact::shape_group::ShapeGroup;
use vi_rigid::gap::{ContactShape, NoGap, ShapePair, features};

/// Shapes that overlap by more than this part of their size are refused at the start.
const OVERLAP: f64 = 1e-9;

/// Adds all pairs of shapes of all contacts.
///
/// # Errors
/// [`ModelError`] of shapes between which there is no contact.
pub(crate) fn add_contacts(
    builder: &mut MechanismBuilder,
    names: &Names<'_>,
    origins: &mut Vec<ContactOrigin>,
) -> Result<(), ModelError> {
    let mut known = BTreeMap::new();
    let mut compliant = Vec::new(); // after those with impulses
    let pairs = names.model.contact_pairs();
    for own in pairs.chunk_by(|a, b| a.contact.name == b.contact.name) {
        if let Some(group) = group_of(own, names, &mut known) {
            if let ShapeElement::Group(element) = &group.element {
                builder.contact(element.clone());
            }
            origins.push(ContactOrigin::Shapes(group));
            continue;
        }
        for pair in own {
            add_pair(builder, pair, names, &mut known, [origins, &mut compliant])?;
        }
    }
    origins.append(&mut compliant);
    Ok(())
}

/// Adds all pairs of shapes of two bodies, by impulses or compliant.
fn add_pair(
    builder: &mut MechanismBuilder,
    pair: &ContactPair<'_>,
    names: &Names<'_>,
    known: &mut KnownShapes,
    [by_impulses, compliant]: [&mut Vec<ContactOrigin>; 2],
) -> Result<(), ModelError> {
    let (contact, a, b) = (&pair.contact.name, pair.a.name(), &pair.b.name);
    let refused = |error: NoGap| {
        let problem = Problem::new(format!("contact.{contact}"), error.to_string());
        ModelError::Assembly(vec![problem.help(CORRECT)])
    };
    let frames = [names.frame(a), names.frame(b)];
    let [on_a, on_b] = shapes_of(pair, names, known);
    let both = on_a.iter().flat_map(|a| on_b.iter().map(move |b| [a.clone(), b.clone()]));
    let both: Vec<_> = both.collect();
    let counts: Vec<u32> = both.iter().map(|[a, b]| features(a, b)).collect();
    let (mut first, features) = (0, counts.iter().sum());
    for (k, (shapes, count)) in both.into_iter().zip(counts).enumerate() {
        let which = [k / on_b.len(), k % on_b.len()];
        let (element, origins) = match compliant_law(pair.contact) {
            Some(law) => {
                let own = CompliantContact::new(frames, shapes, law).map_err(refused)?;
                builder.compliant_contact(contact, own.clone());
                (ShapeElement::Compliant(Arc::new(own)), &mut *compliant)
            }
            None => {
                let [on_a, on_b] = shapes;
                let (shapes, law) =
                    (ShapePair::new(on_a, on_b).map_err(refused)?, law(pair.contact));
                let own = Arc::new(rigid([a, b.as_str()], frames, shapes, contact, law));
                builder.contact(own.clone());
                (ShapeElement::Rigid(own), &mut *by_impulses)
            }
        };
        let (a, b) = (a.to_owned(), b.clone());
        let bodies = TouchingBodies::Pair { a, b, first, features, shapes: which };
        let contact = contact.clone();
        origins.push(ContactOrigin::Shapes(TouchingShapes { contact, bodies, element }));
        first += count;
    }
    Ok(())
}

/// Pairs of one contact from which on its shapes are a group, with a broad phase.
const MANY: usize = 64;

/// The group of the pairs of a contact by impulses, where they are many, and most of those of its
/// bodies.
fn group_of<'a>(
    pairs: &'a [ContactPair<'a>],
    names: &Names<'_>,
    known: &mut KnownShapes,
) -> Option<TouchingShapes> {
    let contact = pairs.first().filter(|own| own.contact.is_rigid())?.contact;
    if pairs.len() < MANY {
        return None;
    }
    let mut bodies: Vec<&'a Body> = Vec::new();
    let mut places: BTreeMap<&'a str, usize> = BTreeMap::new();
    let mut add = |body: &'a Body| {
        places.entry(&body.name).or_insert_with(|| {
            bodies.push(body);
            bodies.len() - 1
        });
    };
    for pair in pairs {
        let SideOfPair::Body(a) = pair.a else { return None };
        add(a);
    }
    pairs.iter().for_each(|pair| add(&pair.b));
    let ends = pairs.iter().map(|pair| (places[pair.a.name()], places[pair.b.name.as_str()]));
    let touching: BTreeSet<(usize, usize)> = ends.collect();
    let all = bodies.len() * (bodies.len() - 1) / 2;
    if touching.iter().any(|(a, b)| a >= b) || all > 2 * touching.len() {
        return None; // sides in another order, or too many exclusions
    }
    let (mut shapes, mut owners) = (Vec::new(), Vec::new());
    for (k, body) in bodies.iter().enumerate() {
        for shape in shapes_of_body(body, names, known) {
            shapes.push((names.frame(&body.name), shape));
            owners.push(k);
        }
    }
    let apart = |(i, j): &(usize, usize)| {
        owners[*i] != owners[*j] && !touching.contains(&(owners[*i], owners[*j]))
    };
    let count = shapes.len();
    let excluded: Vec<(usize, usize)> = match all > touching.len() {
        true => {
            (0..count).flat_map(|i| (i + 1..count).map(move |j| (i, j))).filter(apart).collect()
        }
        false => Vec::new(),
    };
    let group = ShapeGroup::new(&contact.name, shapes, &excluded, law(contact)).ok()?;
    let bodies = owners.iter().map(|k| bodies[*k].name.clone()).collect();
    let element = ShapeElement::Group(Arc::new(group));
    let (contact, bodies) = (contact.name.clone(), TouchingBodies::Group(bodies));
    Some(TouchingShapes { contact, bodies, element })
}

/// The law of a contact with a `model`.
fn compliant_law(contact: &Contact) -> Option<CompliantLaw> {
    let model = contact.model?;
    let ContactModel::HuntCrossley { stiffness, exponent, dissipation, .. } = model;
    let friction = model.course().map(|course| (contact.friction, stribeck(&course)));
    Some(CompliantLaw { stiffness, exponent, dissipation, friction })
}

/// The shapes of both sides of a pair.
fn shapes_of(
    pair: &ContactPair<'_>,
    names: &Names<'_>,
    known: &mut KnownShapes,
) -> [Vec<ContactShape>; 2] {
    let on_a = match pair.a {
        SideOfPair::Plane(plane) => vec![plane.contact_shape(&axes(names, &plane.on))],
        SideOfPair::Body(body) => shapes_of_body(body, names, known),
    };
    [on_a, shapes_of_body(&pair.b, names, known)]
}

fn law(contact: &Contact) -> ContactLaw {
    let Contact { friction, restitution, tangential_restitution, .. } = *contact;
    let static_friction = contact.static_friction.unwrap_or(friction);
    match friction > 0.0 {
        true => {
            ContactLaw::Coulomb { friction, static_friction, restitution, tangential_restitution }
        }
        false => ContactLaw::Frictionless { restitution },
    }
}

/// Shapes that overlap in a configuration: the deepest overlap of each contact by its name, said.
pub(crate) fn overlaps(
    elements: &[Arc<dyn Unilateral>],
    origins: &[ContactOrigin],
    t: f64,
    q: &[f64],
) -> Vec<(String, Problem)> {
    let mut at = Interval::new(q.len());
    at.open(t, 1.0, q);
    let mut problems: Vec<(f64, String, Problem)> = Vec::new();
    let mut features = Vec::new();
    for (element, origin) in elements.iter().zip(origins) {
        let Some(shapes) = origin.shapes() else { continue };
        features.clear();
        element.near(&at, Configuration::new(t, q), &mut features);
        let gaps = features.iter().copied();
        let Some((feature, gap)) = gaps.min_by(|a, b| a.1.total_cmp(&b.1)) else { continue };
        if gap >= -OVERLAP * element.size() {
            continue; // what is not a number is refused
        }
        let (contact, FeatureSides { a, b, number, of }) = (&shapes.contact, shapes.sides(feature));
        let side = if a == GROUND { format!("`{contact}`") } else { format!("`{a}`") };
        let point = if of > 1 { format!(" (point {number})") } else { String::new() };
        let depth = length(-gap);
        let message = format!("`{b}` and {side} overlap by {depth} at the start{point}");
        let problem = Problem::new(format!("contact.{contact}"), message);
        let help = "move the body apart from the other by that, along the normal, or write overlap = \"separate\"";
        let problem = problem.help(help);
        match problems.iter_mut().find(|(_, name, _)| name == contact) {
            Some((deepest, _, own)) if gap < *deepest => (*deepest, *own) = (gap, problem),
            Some(_) => {}
            None => problems.push((gap, contact.clone(), problem)),
        }
    }
    problems.into_iter().map(|(_, contact, problem)| (contact, problem)).collect()
}

/// A length in a unit in which it reads well.
fn length(x: f64) -> String {
    match x {
        x if x >= 1.0 => format!("{} m", crate::digits::rounded(x, 3)),
        x if x >= 1e-4 => format!("{} mm", crate::digits::rounded(x * 1e3, 3)),
        _ => format!("{x:.1e} m"),
    }
}
