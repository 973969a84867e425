//! Nodes of beams that touch: each as a body with a sphere about the centre line.
//!
//! The sphere has the radius of the beam, or that of its round section. Of the two nodes of a
//! corner, which are held together, the first one touches.

use std::borrow::Cow;

use nalgebra::Vector3;
use vi_beam::ElementKind;

use crate::types::beam::{Beam, End};
use crate::types::contact::{BodyNames, Contact, matches};
use crate::types::outline::OutlineKind;
use crate::types::shape::{Shape, ShapeKind};
use crate::{Body, GROUND, Model};

impl Beam {
    /// Radius of the spheres with which its nodes touch, m: as stated, or that of a round section
    /// without stations.
    #[must_use]
    pub fn touching_radius(&self) -> Option<f64> {
        let shape = self.section.shape.as_ref().filter(|_| self.stations.is_none());
        let of_section = || {
            let round = |kind| matches!(kind, OutlineKind::Circle | OutlineKind::Tube);
            shape.filter(|own| round(own.kind))?.dimensions.first().copied()
        };
        self.radius.or_else(of_section)
    }

    /// The node that touches for a node: at a corner the first of both.
    fn touching_node(&self, node: usize) -> usize {
        let mut first = 0;
        for leg in 0..self.legs() {
            if leg > 0 && node == first {
                return node - 1;
            }
            first += self.nodes_of(leg);
        }
        node
    }

    fn touching_nodes(&self) -> impl Iterator<Item = usize> {
        (0..self.node_count()).filter(|k| self.touching_node(*k) == *k)
    }

    fn node_name(&self, node: usize) -> String {
        format!("{}.{node}", self.name)
    }

    /// Whether a name of a `[[contact]]` stands for any of its nodes.
    pub(crate) fn is_any(&self, name: &str) -> bool {
        self.touching_nodes().any(|node| self.is_named(node, name))
    }

    /// Whether a name of a `[[contact]]` stands for one of its nodes: that of the beam, of the
    /// node, or one with a point and `*`.
    fn is_named(&self, node: usize, name: &str) -> bool {
        match name.split_once('.') {
            None => name == self.name,
            Some(_) if name.contains('*') => matches(name, &self.node_name(node)),
            Some((beam, place)) => {
                let own = self.node(place).filter(|_| beam == self.name);
                own.is_some_and(|own| self.touching_node(own) == node)
            }
        }
    }
}

impl Model {
    /// The nodes of beams that these names stand for, as bodies.
    pub(crate) fn touching_nodes(&self, names: &BodyNames) -> Vec<Body> {
        let mut found = Vec::new();
        for beam in &self.beams {
            let is_named = |k: &usize| names.list().iter().any(|name| beam.is_named(*k, name));
            let nodes: Vec<usize> = beam.touching_nodes().filter(is_named).collect();
            if !nodes.is_empty() {
                self.add_node_bodies(beam, &nodes, &mut found);
            }
        }
        found
    }

    fn add_node_bodies(&self, beam: &Beam, nodes: &[usize], found: &mut Vec<Body>) {
        let Ok(meshes) = beam.meshes() else { return }; // refused by itself
        let density = beam.mean_section().map_or(0.0, |section| section.inertia()[0]);
        let length: f64 = meshes.iter().flat_map(|mesh| &mesh.lengths).sum();
        let mass = density * length / beam.element_count() as f64;
        let centers: Vec<Vector3<f64>> =
            meshes.iter().flat_map(|own| own.centers.clone()).collect();
        let spin = Vector3::from(beam.angular_velocity);
        let sphere = beam.touching_radius().map(|r| Shape::new(ShapeKind::Sphere, vec![r]));
        found.extend(nodes.iter().filter_map(|&k| {
            let center = centers.get(k)?;
            let velocity = Vector3::from(beam.velocity) + spin.cross(&(center - centers[0]));
            Some(Body {
                name: beam.node_name(k),
                mass: Some(mass),
                position: (*center).into(),
                velocity: velocity.into(),
                fixed: self.holds_node(beam, k),
                collision: sphere.iter().cloned().collect(),
                ..Body::default()
            })
        }));
    }

    /// Whether the ground holds the centre of a node.
    fn holds_node(&self, beam: &Beam, node: usize) -> bool {
        let is_held = |(at, end): (usize, End)| at == node && end != End::Free;
        [(0, beam.start), (beam.node_count() - 1, beam.end)].into_iter().any(is_held)
    }

    /// A rope that touches by impulses and states no bound of its tension: the first one.
    pub(crate) fn unbounded(&self, contact: &Contact) -> Option<String> {
        let touches = |beam: &&Beam| contact.b.list().iter().any(|name| beam.is_any(name));
        let is_open = |beam: &&Beam| {
            beam.tension.is_none() && beam.element_kind(&self.settings) == ElementKind::Rope
        };
        let mut ropes = self.beams.iter().filter(|_| contact.is_rigid());
        let rope = ropes.find(|beam| is_open(beam) && touches(beam))?;
        Some(format!(
            "contact `{}`: an impact pulls the rope `{}` taut within a step, and the bound of its tension follows one step behind: state `tension` of the beam, N, the largest one to come",
            contact.name, rope.name
        ))
    }

    /// The beam and the node of a name.
    fn node_of(&self, name: &str) -> Option<(&Beam, usize)> {
        let (beam, place) = name.split_once('.')?;
        let beam = self.beam(beam)?;
        Some((beam, beam.node(place)?))
    }

    /// The names of what touches and shares a joint where one holds this member: a body itself; of
    /// a node the one that touches for it, and those next to it.
    pub(crate) fn touching_names<'a>(&'a self, name: &'a str) -> Vec<Cow<'a, str>> {
        let Some((beam, node)) = self.node_of(name) else { return vec![name.into()] };
        let all: Vec<usize> = beam.touching_nodes().collect();
        let at = all.partition_point(|own| *own < beam.touching_node(node));
        let around = all.iter().skip(at.saturating_sub(1)).take(if at == 0 { 2 } else { 3 });
        around.map(|k| beam.node_name(*k).into()).collect()
    }

    /// The name of a node as it stands in lists of members, such as `rope.8` for `rope.end`; other
    /// names as they are.
    #[must_use]
    pub fn member_name(&self, name: &str) -> String {
        let node = self.node_of(name).filter(|_| name != GROUND);
        node.map_or_else(
            || name.to_owned(),
            |(beam, node)| beam.node_name(beam.touching_node(node)),
        )
    }
}
