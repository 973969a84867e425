//! Contacts of bodies, as parts of a mechanism.

use super::CORRECT;
use super::contact_origin::{ContactOrigin, ShapeElement, TouchingShapes};
use super::joint_drive::stribeck;
use super::names::Names;
use holonom_model::contact_pairs::{ContactPair, SideOfPair};
use holonom_model::{Body, Contact, ContactModel, GROUND, ModelError, Problem};
use nalgebra::Matrix3;
use std::collections::BTreeMap;
use std::sync::Arc;
use vi_constraints::nonsmooth::{ContactLaw, Unilateral};
use vi_core::Configuration;
use vi_core::interval::Interval;
use vi_multibody::builder::MechanismBuilder;
use vi_multibody::contact::compliant_contact::{CompliantContact, CompliantLaw};
use vi_multibody::contact::shape_contact::ShapeContact;
use vi_multibody::joint::FrameId;
use vi_rigid::gap::{ContactShape, NoGap, Pair};

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
    for pair in names.model.contact_pairs() {
        let (contact, a, b) = (&pair.contact.name, pair.a.name(), &pair.b.name);
        let refused = |error: NoGap| {
            let problem = Problem::new(format!("contact.{contact}"), error.to_string());
            ModelError::Assembly(vec![problem.help(CORRECT)])
        };
        let element =
            |(frames, [on_a, on_b]): ([FrameId; 2], [_; 2])| match compliant_law(pair.contact) {
                Some(law) => {
                    let made = CompliantContact::new(frames, [on_a, on_b], law)?;
                    Ok(ShapeElement::Compliant(Arc::new(made)))
                }
                None => rigid(&pair, frames, Pair::new(on_a, on_b)?),
            };
        let shapes = shapes_of(&pair, names, &mut known).into_iter();
        let elements: Vec<_> = shapes.map(element).collect::<Result<_, _>>().map_err(refused)?;
        let features = elements.iter().map(ShapeElement::features).sum();
        let mut first = 0;
        for element in elements {
            let own = element.features();
            let (contact, a, b) = (contact.clone(), a.to_owned(), b.clone());
            let origins = match &element {
                ShapeElement::Rigid(own) => {
                    builder.contact(own.clone());
                    &mut *origins
                }
                ShapeElement::Compliant(own) => {
                    builder.compliant_contact(&contact, CompliantContact::clone(own));
                    &mut compliant
                }
            };
            let shapes = TouchingShapes { contact, a, b, first, features, element };
            origins.push(ContactOrigin::Shapes(shapes));
            first += own;
        }
    }
    origins.append(&mut compliant);
    Ok(())
}

fn rigid(of: &ContactPair<'_>, frames: [FrameId; 2], pair: Pair) -> Result<ShapeElement, NoGap> {
    Ok(ShapeElement::Rigid(Arc::new(ShapeContact {
        name: format!("{}–{}", of.a.name(), of.b.name),
        source: of.contact.name.clone(),
        size: pair.extent().max(f64::MIN_POSITIVE),
        pair,
        frames,
        law: law(of.contact),
    })))
}

/// The law of a contact with a `model`.
fn compliant_law(contact: &Contact) -> Option<CompliantLaw> {
    let model = contact.model?;
    let ContactModel::HuntCrossley { stiffness, exponent, dissipation, .. } = model;
    let friction = model.course().map(|course| (contact.friction, stribeck(&course)));
    Some(CompliantLaw { stiffness, exponent, dissipation, friction })
}

/// The shapes of bodies that were asked for.
type KnownShapes<'a> = BTreeMap<&'a str, Vec<ContactShape>>;

/// The frames and the shapes of a pair of bodies, every shape with every other one.
fn shapes_of<'a>(
    pair: &ContactPair<'a>,
    names: &Names<'a>,
    known: &mut KnownShapes<'a>,
) -> Vec<([FrameId; 2], [ContactShape; 2])> {
    let axes =
        |name: &str| names.index(name).map_or_else(Matrix3::identity, |k| names.principal[k]);
    let mut of_body = |body: &'a Body| {
        let shapes = || names.model.contact_shapes(body, &axes(&body.name));
        known.entry(&body.name).or_insert_with(shapes).clone()
    };
    let on_a = match pair.a {
        SideOfPair::Plane(plane) => vec![plane.contact_shape(&axes(&plane.on))],
        SideOfPair::Body(body) => of_body(body),
    };
    let on_b = of_body(pair.b);
    let frames = [names.frame(pair.a.name()), names.frame(&pair.b.name)];
    let both = |a: &ContactShape| -> Vec<_> {
        on_b.iter().map(|b| (frames, [a.clone(), b.clone()])).collect()
    };
    on_a.iter().flat_map(both).collect()
}

fn law(contact: &Contact) -> ContactLaw {
    let Contact { friction, restitution, tangential_restitution, .. } = *contact;
    match friction > 0.0 {
        true => ContactLaw::Coulomb { friction, restitution, tangential_restitution },
        false => ContactLaw::Frictionless { restitution },
    }
}

/// Refuses shapes that overlap in a configuration.
///
/// # Errors
/// [`ModelError`] with the deepest overlap of each contact.
pub(crate) fn check_overlap(
    elements: &[Arc<dyn Unilateral>],
    origins: &[ContactOrigin],
    t: f64,
    q: &[f64],
) -> Result<(), ModelError> {
    let mut at = Interval::new(q.len());
    at.open(t, 1.0, q);
    let mut problems: Vec<(f64, Problem)> = Vec::new();
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
        let TouchingShapes { contact, a, b, first, features: count, .. } = shapes;
        let side = if a == GROUND { format!("`{contact}`") } else { format!("`{a}`") };
        let point = match *count > 1 {
            true => format!(" (point {})", first + feature),
            false => String::new(),
        };
        let depth = length(-gap);
        let message = format!("`{b}` and {side} overlap by {depth} at the start{point}");
        let problem = Problem::new(format!("contact.{contact}"), message);
        let problem = problem.help("move the body apart from the other by that, along the normal");
        match problems.iter_mut().find(|(_, own)| own.key == problem.key) {
            Some((deepest, own)) if gap < *deepest => (*deepest, *own) = (gap, problem),
            Some(_) => {}
            None => problems.push((gap, problem)),
        }
    }
    match problems.is_empty() {
        true => Ok(()),
        false => Err(ModelError::Assembly(problems.into_iter().map(|(_, own)| own).collect())),
    }
}

/// A length in a unit in which it reads well.
fn length(x: f64) -> String {
    match x {
        x if x >= 1.0 => format!("{} m", crate::digits::rounded(x, 3)),
        x if x >= 1e-4 => format!("{} mm", crate::digits::rounded(x * 1e3, 3)),
        _ => format!("{x:.1e} m"),
    }
}
