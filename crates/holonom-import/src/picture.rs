//! Pictures of bodies: their shapes and meshes.

use std::collections::BTreeMap;

use holonom_model::mesh::MAX_MODEL_TRIANGLES;
use holonom_model::{Scale, Shape, ShapeKind};
use nalgebra::{Isometry3, Vector3};

use crate::numbers::{NOISE, quaternion, vector};
use crate::remark::Remarks;
use crate::solid::{ImportedSolid, PlacedSolid};
use crate::tree::BodyTree;

/// A solid is about the centre of mass where their distance is below this part of its size.
const CENTRED: f64 = 1e-9;

/// The most triangles of a mesh that is drawn, so that all together are no more than a model may
/// have.
pub(crate) fn finest(tree: &BodyTree, remarks: &mut Remarks) -> usize {
    let nodes = tree.nodes.iter().filter(|node| !node.absent);
    let meshes = nodes.flat_map(|node| node.solids.iter().map(move |solid| (node, solid)));
    let meshes = meshes.filter_map(|(node, solid)| Some((node, solid.mesh.as_ref()?.count)));
    let mut counts = BTreeMap::new();
    meshes.clone().for_each(|(_, count)| *counts.entry(count).or_insert(0) += count);
    let (mut finest, mut sum) = (0, 0);
    for (count, all) in counts {
        sum += all;
        if sum > MAX_MODEL_TRIANGLES {
            break;
        }
        finest = count;
    }
    for (node, _) in meshes.filter(|(_, count)| *count > finest) {
        let message = format!(
            "meshes of more than {finest} triangles are drawn as boxes: a model has {MAX_MODEL_TRIANGLES} at most"
        );
        remarks.mention(message, format!("link \"{}\"", node.name), &node.place);
    }
    finest
}

/// Whether a solid has its centre where that of the mass is.
pub(crate) fn is_about(placed: &PlacedSolid, center: &Vector3<f64>) -> bool {
    let apart = (placed.pose.translation.vector - center).norm();
    apart <= CENTRED * placed.solid.volume().cbrt()
}

/// The shape of a body; `to_body`: from the axes of the link to those of the body.
pub(crate) fn shape(placed: &PlacedSolid, to_body: &Isometry3<f64>) -> Shape {
    match &placed.mesh {
        None => placed.solid.shape(),
        Some(_) => part(placed, to_body),
    }
}

/// A shape of the picture of a body, at its place.
pub(crate) fn part(placed: &PlacedSolid, to_body: &Isometry3<f64>) -> Shape {
    let pose = to_body * placed.mesh.as_ref().map_or(&placed.pose, |mesh| &mesh.pose);
    let rounded = NOISE * placed.solid.volume().cbrt();
    let position = pose.translation.vector.map(|x| if x.abs() <= rounded { 0.0 } else { x });
    let position = vector(&position);
    let quaternion = quaternion(&pose.rotation);
    let is_ball = placed.mesh.is_none() && matches!(placed.solid, ImportedSolid::Sphere(_));
    let turned = !is_ball && quaternion[1..].iter().any(|c| *c != 0.0);
    let own = match &placed.mesh {
        None => placed.solid.shape(),
        Some(mesh) => Shape {
            kind: ShapeKind::Mesh,
            file: Some(mesh.file.clone()),
            scale: scale(&mesh.scale),
            ..Shape::default()
        },
    };
    Shape {
        position: position.iter().any(|x| *x != 0.0).then_some(position),
        quaternion: turned.then_some(quaternion),
        ..own
    }
}

fn scale(factors: &Vector3<f64>) -> Option<Scale> {
    match <[f64; 3]>::from(*factors) {
        [1.0, 1.0, 1.0] => None,
        [x, y, z] if [y, z].iter().all(|s| s.to_bits() == x.to_bits()) => Some(Scale::Uniform(x)),
        factors => Some(Scale::Axes(factors)),
    }
}
