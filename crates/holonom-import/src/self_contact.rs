//! Contact of the bodies of a robot with one another.
//!
//! Two bodies touch where geometry of one and of the other may, but not those that a link and the
//! link before it are part of. MJCF names further pairs of geometry, and bodies that do not touch.
//! What overlaps as drawn, or has shapes between which there is no contact, is left out.

use std::collections::{BTreeMap, BTreeSet};

use holonom_model::{Body, BodyNames, Contact, ContactSide};
use nalgebra::{Matrix3, Vector3};
use vi_rigid::directors::set_frame;
use vi_rigid::gap::{ContactShape, ShapePair, has_gap};

use crate::drafter::Drafter;
use crate::massless::some;
use crate::remark::Remarks;
use crate::robot::Robot;
use crate::surface::{BodyPairs, Exclusion, GeomPair, TouchingSolid};
use crate::tree::BodyTree;

/// Shapes that overlap by more than this part of their size are left out.
const OVERLAP: f64 = 1e-9;

/// Of a robot.
pub(crate) fn body_pairs(robot: &Robot, tree: &BodyTree, remarks: &mut Remarks) -> BodyPairs {
    let body_of = |link: usize| tree.body_of[link];
    let mut apart: BTreeSet<[usize; 2]> = BTreeSet::new(); // that do not touch
    for (k, link) in robot.links.iter().enumerate() {
        let ends = body_of(k).zip(link.parent.and_then(body_of));
        apart.extend(ends.map(|(a, b)| ordered(a, b)));
    }
    let link = |name: &str| robot.links.iter().position(|link| link.name == name);
    for Exclusion(names) in &robot.exclusions {
        let [a, b] = names.each_ref().map(|name| link(name).and_then(body_of));
        apart.extend(a.zip(b).map(|(a, b)| ordered(a, b)));
    }
    let nodes = tree.nodes.iter().enumerate().filter(|(_, node)| !node.absent);
    let nodes: Vec<_> = nodes.collect();
    let mut pairs = BodyPairs::new();
    for (k, (i, a)) in nodes.iter().enumerate() {
        for (j, b) in nodes[k + 1..].iter().filter(|(j, _)| !apart.contains(&ordered(*i, *j))) {
            let shown = |own: &&TouchingSolid| own.placed.is_shown();
            let all = a.touching.iter().filter(shown).flat_map(|own| {
                let others = b.touching.iter().filter(shown);
                others.map(move |other| (own, other))
            });
            let touching = all.filter(|(own, other)| own.surface.touches(&other.surface));
            let friction =
                touching.map(|(own, other)| own.surface.friction.max(other.surface.friction));
            if let Some(friction) = friction.max_by(f64::total_cmp) {
                pairs.insert(ordered(*i, *j), friction);
            }
        }
    }
    let mut unknown = Vec::new();
    for GeomPair { geoms, friction } in &robot.geom_pairs {
        let of = |name: &str| {
            let has = |own: &&TouchingSolid| own.name.as_deref() == Some(name);
            nodes.iter().find_map(|(k, node)| Some((*k, node.touching.iter().find(has)?)))
        };
        let Some(((i, a), (j, b))) = of(&geoms[0]).zip(of(&geoms[1])) else {
            unknown.push(format!("{} and {}", geoms[0], geoms[1]));
            continue;
        };
        if i != j {
            let larger = a.surface.friction.max(b.surface.friction);
            pairs.insert(ordered(i, j), friction.unwrap_or(larger));
        }
    }
    if !unknown.is_empty() {
        let names = some(&unknown);
        remarks.of_all(format!(
            "pairs of contact that are not of two bodies: not translated: {names}"
        ));
    }
    pairs
}

impl Drafter<'_> {
    /// The contacts of bodies with one another: one for the same partners and friction.
    pub(crate) fn self_contacts(&mut self, remarks: &mut Remarks) {
        let (mut unavailable, mut overlapping) = (Vec::new(), Vec::new());
        let mut by_friction: BTreeMap<u64, BTreeSet<[usize; 2]>> = BTreeMap::new();
        for (&[i, j], friction) in &self.body_pairs {
            let model = &self.draft.model;
            let [a, b] = [i, j].map(|k| model.body(&self.bodies[k]));
            let Some((a, b)) = a.zip(b) else { continue };
            let shapes = [a, b].map(|own| model.contact_shapes(own, &Matrix3::identity()));
            let both = || shapes[0].iter().flat_map(|a| shapes[1].iter().map(move |b| (a, b)));
            let names = || format!("{} and {}", a.name, b.name);
            let all =
                [a, b].iter().zip(&shapes).all(|(a, own)| own.len() == a.contact_shapes().len());
            if !all || !both().all(|(a, b)| has_gap(a, b)) {
                unavailable.push(names());
            } else if both().any(|(of_a, of_b)| overlap(a, of_a, b, of_b)) {
                overlapping.push(names());
            } else {
                by_friction.entry(friction.to_bits()).or_default().insert([i, j]);
            }
        }
        if !unavailable.is_empty() {
            let names = some(&unavailable);
            remarks.of_all(format!(
                "contact between shapes for which there is none, left out: {names}"
            ));
        }
        if !overlapping.is_empty() {
            let names = some(&overlapping);
            remarks.of_all(format!("contact of bodies that overlap as drawn, left out: {names}"));
        }
        for (friction, pairs) in by_friction {
            for (a, b) in rules(pairs) {
                let names = |nodes: &[usize]| {
                    BodyNames::Several(nodes.iter().map(|k| self.bodies[*k].clone()).collect())
                };
                let (a, b) = (ContactSide::Bodies(names(&a)), names(&b));
                let name = self.names.unique("bodies", "contact");
                let friction = f64::from_bits(friction);
                self.draft.model.contacts.push(Contact { friction, ..Contact::new(name, a, b) });
            }
        }
    }
}

fn ordered(a: usize, b: usize) -> [usize; 2] {
    [a.min(b), a.max(b)]
}

/// Both sides of few contacts that have these pairs: of bodies that all touch one another, then of
/// one with its partners.
fn rules(mut pairs: BTreeSet<[usize; 2]>) -> Vec<(Vec<usize>, Vec<usize>)> {
    let mut found = Vec::new();
    while let Some(&[first, second]) = pairs.first() {
        let partners: Vec<usize> =
            pairs.range([first, 0]..[first + 1, 0]).map(|pair| pair[1]).collect();
        let mut all = vec![first, second];
        for k in partners.iter().copied().filter(|k| *k != second) {
            let touches = |own: &usize| pairs.contains(&ordered(*own, k));
            if all.iter().all(touches) {
                all.push(k);
            }
        }
        let (a, b) = match all.len() > 2 {
            true => (all.clone(), all),
            false => (vec![first], partners),
        };
        for i in &a {
            b.iter().for_each(|j| _ = pairs.remove(&ordered(*i, *j)));
        }
        found.push((a, b));
    }
    found
}

/// Whether shapes of two bodies overlap where these are drawn.
fn overlap(a: &Body, of_a: &ContactShape, b: &Body, of_b: &ContactShape) -> bool {
    let frame = |body: &Body| {
        let mut frame = [0.0; 12];
        set_frame(&mut frame, &Vector3::from(body.position), &body.rotation());
        frame
    };
    let Ok(pair) = ShapePair::new(of_a.clone(), of_b.clone()) else { return true };
    let mut found = Vec::new();
    pair.active(&frame(a), &frame(b), f64::MAX, &mut found);
    let smallest = found.iter().map(|(_, gap)| *gap).min_by(f64::total_cmp);
    smallest.is_some_and(|gap| gap < -OVERLAP * pair.extent())
}
