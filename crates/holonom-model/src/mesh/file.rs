//! Files of meshes: STL (binary, text) and OBJ.

use std::collections::HashMap;
use std::io::Read;
use std::path::Path;

use nalgebra::Vector3;

/// The greatest size of the file of a mesh, bytes.
pub const MAX_MESH_BYTES: u64 = 64 * 1024 * 1024;
/// The greatest number of triangles of a mesh.
pub const MAX_TRIANGLES: usize = 1_000_000;
/// Coordinates of a mesh at most, in its own unit.
const LARGEST: f64 = 1e15;

/// Why a file gives no mesh.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// The file does not exist.
    #[error("not found")]
    NotFound,
    /// A folder, a pipe or a device.
    #[error("not a regular file")]
    NotAFile,
    /// The operating system does not let it be read.
    #[error("not readable: {reason}")]
    Unreadable {
        /// What the operating system says.
        reason: String,
    },
    /// The extension of the file is another one.
    #[error("of another format than STL and OBJ")]
    Format,
    /// The file is larger than [`MAX_MESH_BYTES`].
    #[error("larger than {} MB", MAX_MESH_BYTES / (1024 * 1024))]
    TooLarge,
    /// With it, the meshes of the model are larger than [`super::MAX_MESHES_BYTES`].
    #[error("too large: all meshes of the model together are larger than {} MB", super::MAX_MESHES_BYTES / (1024 * 1024))]
    TooLargeTogether,
    /// With it, the bodies of the model have more than [`super::MAX_MODEL_TRIANGLES`] triangles.
    #[error(
        "too large: all bodies together have more than {} triangles",
        super::MAX_MODEL_TRIANGLES
    )]
    TooManyTogether,
    /// The mesh has too many triangles.
    #[error("too large: there are more than {most} triangles")]
    TooManyTriangles {
        /// How many are allowed.
        most: usize,
    },
    /// The content is not that of the format.
    #[error("damaged")]
    Damaged,
    /// A line of a text file cannot be read.
    #[error("damaged in line {line}")]
    DamagedLine {
        /// Its number, from 1.
        line: usize,
    },
    /// No triangle has three different corners.
    #[error("empty: it has no triangle with three different corners")]
    Empty,
    /// A file in the folder of a run has not the content from which its name comes.
    #[error("not the file that the run had: its content was changed")]
    Changed,
    /// The model comes from a text: a relative path has no folder to start from.
    #[error("not found: the model has no folder to look in")]
    NoFolder,
}

/// Corners and triangles of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Triangulation {
    pub(super) corners: Vec<Vector3<f64>>,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// Reads a file; never more than [`MAX_MESH_BYTES`] and a little.
pub(super) fn read(path: &Path) -> Result<(Triangulation, Vec<u8>), MeshError> {
    let parse = parser(path)?;
    let refused = |error: std::io::Error| match error.kind() {
        std::io::ErrorKind::NotFound => MeshError::NotFound,
        _ => MeshError::Unreadable { reason: error.to_string() },
    };
    // before it is opened: a pipe that nobody writes to would block
    let metadata = path.metadata().map_err(refused)?;
    if !metadata.is_file() {
        return Err(MeshError::NotAFile);
    }
    if metadata.len() > MAX_MESH_BYTES {
        return Err(MeshError::TooLarge);
    }
    let file = std::fs::File::open(path).map_err(refused)?;
    let mut bytes = Vec::new();
    file.take(MAX_MESH_BYTES + 1).read_to_end(&mut bytes).map_err(refused)?;
    if bytes.len() as u64 > MAX_MESH_BYTES {
        return Err(MeshError::TooLarge);
    }
    Ok((parse(&bytes)?, bytes))
}

/// What reads a file of this name.
pub(super) fn parser(
    path: &Path,
) -> Result<fn(&[u8]) -> Result<Triangulation, MeshError>, MeshError> {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    match extension.to_str() {
        Some("stl") => Ok(stl),
        Some("obj") => Ok(obj),
        _ => Err(MeshError::Format),
    }
}

/// Triangles from corner to corner; corners of the same coordinates are one.
#[derive(Default)]
struct VertexWelder {
    surface: Triangulation,
    known: HashMap<[u64; 3], u32>,
}

impl VertexWelder {
    /// The index of a corner; `None` for one that is not finite, or too far away.
    fn corner(&mut self, x: [f64; 3]) -> Option<u32> {
        if !x.iter().all(|x| x.abs() <= LARGEST) {
            return None;
        }
        let next = u32::try_from(self.surface.corners.len()).ok()?;
        let key = x.map(|x| (x + 0.0).to_bits()); // one zero
        let at = *self.known.entry(key).or_insert(next);
        if at == next {
            self.surface.corners.push(Vector3::from(x));
        }
        Some(at)
    }

    fn triangle(&mut self, triangle: [u32; 3]) -> Result<(), MeshError> {
        let [a, b, c] = triangle;
        if a != b && b != c && c != a {
            self.surface.triangles.push(triangle);
        }
        bounded(self.surface.triangles.len())
    }

    fn finish(self) -> Result<Triangulation, MeshError> {
        if self.surface.triangles.is_empty() { Err(MeshError::Empty) } else { Ok(self.surface) }
    }
}

fn bounded(triangles: usize) -> Result<(), MeshError> {
    let most = MAX_TRIANGLES;
    if triangles > most { Err(MeshError::TooManyTriangles { most }) } else { Ok(()) }
}

/// 80 bytes, the number of triangles, for each a normal, three corners and two bytes; or text.
fn stl(bytes: &[u8]) -> Result<Triangulation, MeshError> {
    let count = bytes.get(80..84).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as u64);
    if count.is_none_or(|count| 84 + 50 * count != bytes.len() as u64) {
        return text_stl(std::str::from_utf8(bytes).map_err(|_| MeshError::Damaged)?);
    }
    let mut builder = VertexWelder::default();
    for record in bytes[84..].chunks_exact(50) {
        let number = |at: usize| {
            let bytes = [record[at], record[at + 1], record[at + 2], record[at + 3]];
            f64::from(f32::from_le_bytes(bytes))
        };
        let mut triangle = [0; 3];
        for (k, at) in triangle.iter_mut().enumerate() {
            let x = [0, 1, 2].map(|i| number(12 + 12 * k + 4 * i));
            *at = builder.corner(x).ok_or(MeshError::Damaged)?;
        }
        builder.triangle(triangle)?;
    }
    builder.finish()
}

fn text_stl(text: &str) -> Result<Triangulation, MeshError> {
    let mut builder = VertexWelder::default();
    let mut corners = Vec::new();
    for (line, words) in (1..).zip(text.lines()) {
        let mut words = words.split_whitespace();
        if words.next() == Some("vertex") {
            let corner = numbers(words).and_then(|x| builder.corner(x));
            corners.push(corner.ok_or(MeshError::DamagedLine { line })?);
            if let [a, b, c] = corners[..] {
                builder.triangle([a, b, c])?;
                corners.clear();
            }
        }
    }
    if corners.is_empty() { builder.finish() } else { Err(MeshError::Damaged) }
}

/// Lines `v x y z` and `f a b c …`: corners counted from 1, or backwards from the last one by
/// negative numbers.
fn obj(bytes: &[u8]) -> Result<Triangulation, MeshError> {
    let text = String::from_utf8_lossy(bytes);
    let mut builder = VertexWelder::default();
    let mut listed = Vec::new();
    for (line, words) in (1..).zip(text.lines()) {
        let damaged = || MeshError::DamagedLine { line };
        let mut words = words.split_whitespace();
        match words.next() {
            Some("v") => {
                let corner = numbers(words).and_then(|x| builder.corner(x));
                listed.push(corner.ok_or_else(damaged)?);
                bounded(listed.len() / 3)?; // as many corners as triangles that share none
            }
            Some("f") => face(&mut builder, &listed, words).ok_or_else(damaged)??,
            _ => {}
        }
    }
    builder.finish()
}

/// A polygon as triangles; `None` where it names no corners.
fn face<'a>(
    builder: &mut VertexWelder,
    listed: &[u32],
    mut words: impl Iterator<Item = &'a str>,
) -> Option<Result<(), MeshError>> {
    let mut corner = || {
        let Some(word) = words.next() else { return Some(None) };
        let number: i64 = word.split('/').next()?.parse().ok()?;
        let count = i64::try_from(listed.len()).ok()?;
        let at = if number < 0 { count.checked_add(number)? } else { number - 1 };
        Some(Some(*listed.get(usize::try_from(at).ok()?)?))
    };
    let (first, mut second) = (corner()??, corner()??);
    while let Some(third) = corner()? {
        if let Err(error) = builder.triangle([first, second, third]) {
            return Some(Err(error));
        }
        second = third;
    }
    Some(Ok(()))
}

/// The first three words as numbers.
fn numbers<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<[f64; 3]> {
    let mut number = || words.next()?.parse::<f64>().ok();
    Some([number()?, number()?, number()?])
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "solid t\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n\
                        vertex 0 1 0\nendloop\nendfacet\nendsolid t\n";

    #[test]
    fn all_formats_give_the_same_mesh() {
        let text = stl(TEXT.as_bytes()).unwrap();
        let mut binary = vec![0; 84 + 50];
        binary[80] = 1;
        binary[84 + 24..84 + 28].copy_from_slice(&1.0_f32.to_le_bytes());
        binary[84 + 40..84 + 44].copy_from_slice(&1.0_f32.to_le_bytes());
        assert_eq!(stl(&binary).unwrap(), text);
        let object = "# a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1/1/1 2//1 -1\n";
        assert_eq!(obj(object.as_bytes()).unwrap(), text);
        assert_eq!((text.corners.len(), text.triangles.len()), (3, 1));
    }

    #[test]
    fn damaged_files_give_no_mesh() {
        let line = |line| Err(MeshError::DamagedLine { line });
        let half = TEXT.split("vertex 0 1 0").next().unwrap();
        assert_eq!(stl(half.as_bytes()), Err(MeshError::Damaged), "half a triangle");
        assert_eq!(stl(&TEXT.as_bytes()[..70]), line(6), "half a corner");
        assert_eq!(stl(b"\xff\xfe"), Err(MeshError::Damaged));
        assert_eq!(stl(b"vertex 0 0 1e16\n"), line(1));
        assert_eq!(obj(b"v 0 0\n"), line(1));
        assert_eq!(obj(b"v 0 0 nan\n"), line(1));
        assert_eq!(obj(b"v 0 0 0\nf 1 2 3\n"), line(2), "corners that are not there");
        assert_eq!(obj(b"f\n"), line(1));
        assert_eq!(obj(b"f 1 -9223372036854775808\n"), line(1));
        assert_eq!(obj(b"v 0 0 0\nf 1 1 1\n"), Err(MeshError::Empty));
        assert_eq!(obj(b""), Err(MeshError::Empty));
        assert_eq!(stl(b"solid nothing\n"), Err(MeshError::Empty));
    }

    #[test]
    fn a_polygon_with_too_many_corners_is_refused() {
        let mut text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1".to_owned();
        text += &" 2 3".repeat(MAX_TRIANGLES / 2 + 2);
        assert_eq!(obj(text.as_bytes()), Err(MeshError::TooManyTriangles { most: MAX_TRIANGLES }));
    }
}
