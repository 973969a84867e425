//! Meshes in a scene: each once, simplified where the page would become too large.

use super::encoded;
use super::parts::SceneBody;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use holonom_model::{BodySurface, Model};
use nalgebra::Vector3;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// Triangles of all meshes of a page at most; they then take about 1 MB of it.
const TRIANGLES: usize = 40_000;
/// Cells along the longest edge of the box around a mesh, at most, where its corners are merged.
const FINEST: f64 = 1024.0;
/// Grids that are tried at most.
const ATTEMPTS: usize = 8;

/// A mesh along the axes of a body from its centre.
#[derive(Debug, Serialize)]
pub(super) struct SceneSurface {
    /// Coordinates of corners, single precision.
    corners: String,
    /// Indices of corners, 32 bits.
    triangles: String,
}

/// Meshes of a scene.
#[derive(Debug, Default)]
pub(super) struct Surfaces {
    pub(super) list: Vec<SceneSurface>,
    /// What is said of those that are simplified.
    pub(super) note: Option<String>,
}

impl Surfaces {
    /// The meshes of a model, whose bodies then know theirs.
    pub(super) fn new(model: &Model, bodies: &mut [SceneBody]) -> Self {
        let mut known: BTreeMap<String, Option<usize>> = BTreeMap::new();
        let (mut surfaces, mut missing) = (Vec::new(), 0);
        for (body, shown) in model.bodies.iter().zip(bodies) {
            missing += body.mesh_files().filter(|file| model.meshes.get(file).is_none()).count();
            let key = format!("{:?} {:?}", body.shape, body.picture);
            shown.mesh = *known.entry(key).or_insert_with(|| {
                surfaces.push(model.surface(body)?);
                Some(surfaces.len() - 1)
            });
        }
        let counts: Vec<usize> = surfaces.iter().map(|surface| surface.triangles.len()).collect();
        let (mut list, mut drawn) = (Vec::new(), 0);
        for (surface, most) in surfaces.iter().zip(shares(&counts, TRIANGLES)) {
            let surface = simplified(surface, most);
            drawn += surface.triangles.len();
            list.push(SceneSurface::of(&surface));
        }
        Self { list, note: note(drawn, counts.iter().sum(), missing) }
    }
}

/// What is said of meshes that are not shown as they are.
fn note(drawn: usize, of: usize, missing: usize) -> Option<String> {
    let mut note = String::new();
    if drawn < of {
        note += &format!("Meshes are simplified here: {drawn} of {of} triangles are drawn. ");
    }
    if missing > 0 {
        note += &format!(
            "Meshes that cannot be read in the folder of the run: {missing}; bodies without any are drawn as ellipsoids of inertia."
        );
    }
    (!note.is_empty()).then_some(note)
}

impl SceneSurface {
    fn of(surface: &BodySurface) -> Self {
        let indices = surface.triangles.iter().flatten().flat_map(|k| k.to_le_bytes());
        Self {
            corners: encoded(surface.corners.iter().flat_map(|x| [x.x, x.y, x.z])),
            triangles: STANDARD.encode(indices.collect::<Vec<u8>>()),
        }
    }
}

/// How many of `most` triangles each mesh may have: small ones all of theirs, the others equally
/// many.
fn shares(counts: &[usize], most: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..counts.len()).collect();
    order.sort_by_key(|k| counts[*k]);
    let (mut out, mut left) = (vec![0; counts.len()], most);
    for (done, k) in order.into_iter().enumerate() {
        out[k] = counts[k].min(left / (counts.len() - done));
        left -= out[k];
    }
    out
}

/// A surface of at most so many triangles: corners in a cell of a grid become one, their mean. The
/// box around the surface where no grid is found.
fn simplified(surface: &BodySurface, most: usize) -> BodySurface {
    if surface.triangles.len() <= most {
        return surface.clone();
    }
    let wanted = 0.9 * most as f64;
    let (mut cells, mut best) = ((0.25 * wanted).sqrt().clamp(1.0, FINEST), None);
    for _ in 0..ATTEMPTS {
        let found = merged(surface, cells);
        let count = found.triangles.len();
        if count > 0 && count <= most {
            best = Some(found);
            if count as f64 > 0.8 * wanted {
                break;
            }
        }
        // the number of triangles grows with the square of that of the cells
        let factor = (wanted / count.max(1) as f64).sqrt().clamp(0.25, 4.0);
        cells = (cells * factor).clamp(1.0, FINEST);
    }
    best.unwrap_or_else(|| BodySurface::cuboid(surface.ends()))
}

/// With corners merged in a grid of so many cells along the longest edge.
fn merged(surface: &BodySurface, cells: f64) -> BodySurface {
    let [low, high] = surface.ends();
    let size = ((high - low).amax() / cells).max(f64::MIN_POSITIVE);
    let mut known: BTreeMap<[u32; 3], usize> = BTreeMap::new();
    let mut sums: Vec<(Vector3<f64>, f64)> = Vec::new();
    let corner = |x: &Vector3<f64>| {
        let cell = ((x - low) / size).map(|c| c as u32).into();
        let at = *known.entry(cell).or_insert(sums.len());
        if at == sums.len() {
            sums.push((Vector3::zeros(), 0.0));
        }
        sums[at].0 += x;
        sums[at].1 += 1.0;
        at as u32
    };
    let at: Vec<u32> = surface.corners.iter().map(corner).collect();
    let image = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|k| at[k as usize]);
        let least = a.min(b).min(c);
        let turned = if a == least {
            [a, b, c]
        } else if b == least {
            [b, c, a]
        } else {
            [c, a, b]
        };
        (a != b && b != c && c != a).then_some(turned)
    };
    let triangles: BTreeSet<[u32; 3]> = surface.triangles.iter().filter_map(image).collect();
    BodySurface {
        corners: sums.into_iter().map(|(sum, count)| sum / count).collect(),
        triangles: triangles.into_iter().collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of `n × n` cells, bent upwards.
    fn sheet(n: u32) -> BodySurface {
        let at = |i: u32, j: u32| {
            let [x, y] = [i, j].map(|k| f64::from(k) / f64::from(n));
            Vector3::new(x, y, x * y)
        };
        let index = |i: u32, j: u32| i * (n + 1) + j;
        let cell = |i: u32, j: u32| {
            let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
            [[a, b, c], [a, c, d]]
        };
        BodySurface {
            corners: (0..=n).flat_map(|i| (0..=n).map(move |j| at(i, j))).collect(),
            triangles: (0..n).flat_map(|i| (0..n).flat_map(move |j| cell(i, j))).collect(),
        }
    }

    fn area(surface: &BodySurface) -> f64 {
        let of = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|k| surface.corners[k as usize]);
            0.5 * (b - a).cross(&(c - a)).z // of the projection, with the sign of the side
        };
        surface.triangles.iter().map(of).sum()
    }

    #[test]
    fn a_simplified_surface_keeps_to_the_limit_and_covers_the_same_area() {
        let whole = sheet(100);
        for most in [10_000, 1000, 100] {
            let found = simplified(&whole, most);
            let count = found.triangles.len();
            assert!(count <= most && count > most / 4, "{count} triangles of {most}");
            let error = area(&whole) - area(&found);
            // corners at the rim move inwards by half a cell
            assert!(error.abs() < 4.0 / f64::sqrt(most as f64), "{most}: area {error}");
        }
        assert_eq!(simplified(&whole, 20_000), whole, "small enough as it is");
        assert_eq!(simplified(&whole, 0).triangles.len(), 12, "the box around it");
    }

    #[test]
    fn small_meshes_keep_all_their_triangles() {
        assert_eq!(shares(&[500, 10, 900], 600), [295, 10, 295]);
        assert_eq!(shares(&[5, 6], 600), [5, 6]);
        assert_eq!(shares(&[], 600), [0; 0]);
    }
}
