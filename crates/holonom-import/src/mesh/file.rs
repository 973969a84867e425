//! Files of meshes: STL (binary, text) and OBJ.

use std::collections::HashMap;
use std::io::Read;
use std::path::Path;

use nalgebra::Vector3;

use super::Mesh;

/// Bytes of a file at most.
const LARGEST: u64 = 128 * 1024 * 1024;

/// The mesh of a file, or why there is none.
pub(super) fn read(path: &Path) -> Result<Mesh, &'static str> {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    let parse = match extension.to_str() {
        Some("stl") => stl,
        Some("obj") => obj,
        _ => return Err("of another format than STL and OBJ"),
    };
    let file = std::fs::File::open(path).map_err(|_| "not readable")?;
    let mut bytes = Vec::new();
    file.take(LARGEST + 1).read_to_end(&mut bytes).map_err(|_| "not readable")?;
    if bytes.len() as u64 > LARGEST {
        return Err("larger than 128 MB");
    }
    let mesh = parse(&bytes).ok_or("damaged")?;
    let sound = |corner: &Vector3<f64>| corner.iter().all(|x| x.abs() <= 1e15);
    let used = !mesh.triangles.is_empty() && mesh.corners.iter().all(sound);
    if used { Ok(mesh) } else { Err("damaged") }
}

/// Triangles from corner to corner; corners of the same coordinates are one.
#[derive(Default)]
struct Builder {
    mesh: Mesh,
    known: HashMap<[u64; 3], usize>,
}

impl Builder {
    fn corner(&mut self, x: [f64; 3]) -> usize {
        let next = self.mesh.corners.len();
        let key = x.map(|x| (x + 0.0).to_bits()); // one zero
        let at = *self.known.entry(key).or_insert(next);
        if at == next {
            self.mesh.corners.push(Vector3::from(x));
        }
        at
    }

    fn triangle(&mut self, triangle: [usize; 3]) {
        let [a, b, c] = triangle;
        if a != b && b != c && c != a {
            self.mesh.triangles.push(triangle);
        }
    }
}

/// 80 bytes, the number of triangles, for each a normal, three corners and two bytes; or text.
fn stl(bytes: &[u8]) -> Option<Mesh> {
    let count = bytes.get(80..84).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as u64);
    if count.is_none_or(|count| 84 + 50 * count != bytes.len() as u64) {
        return text_stl(std::str::from_utf8(bytes).ok()?);
    }
    let mut builder = Builder::default();
    for record in bytes[84..].chunks_exact(50) {
        let number = |at: usize| {
            f64::from(f32::from_le_bytes([
                record[at],
                record[at + 1],
                record[at + 2],
                record[at + 3],
            ]))
        };
        let corner = |k: usize| [0, 1, 2].map(|i| number(12 + 12 * k + 4 * i));
        let triangle = [0, 1, 2].map(|k| builder.corner(corner(k)));
        builder.triangle(triangle);
    }
    Some(builder.mesh)
}

fn text_stl(text: &str) -> Option<Mesh> {
    let mut builder = Builder::default();
    let mut corners = Vec::new();
    for line in text.lines() {
        let mut words = line.split_whitespace();
        if words.next() == Some("vertex") {
            corners.push(builder.corner(numbers(words)?));
        }
    }
    for triangle in corners.chunks_exact(3) {
        builder.triangle([triangle[0], triangle[1], triangle[2]]);
    }
    (corners.len() % 3 == 0).then_some(builder.mesh)
}

/// Lines `v x y z` and `f a b c …`: corners counted from 1, or backwards from the last one by negative numbers.
fn obj(bytes: &[u8]) -> Option<Mesh> {
    let text = String::from_utf8_lossy(bytes);
    let mut builder = Builder::default();
    let mut listed = Vec::new();
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => listed.push(builder.corner(numbers(words)?)),
            Some("f") => {
                let corner = |word: &str| {
                    let number: i64 = word.split('/').next()?.parse().ok()?;
                    let count = i64::try_from(listed.len()).ok()?;
                    let at = if number < 0 { count + number } else { number - 1 };
                    listed.get(usize::try_from(at).ok()?).copied()
                };
                let face: Vec<usize> = words.map(corner).collect::<Option<_>>()?;
                for pair in face.get(1..)?.windows(2) {
                    builder.triangle([face[0], pair[0], pair[1]]);
                }
            }
            _ => {}
        }
    }
    Some(builder.mesh)
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
        assert_eq!(stl(&TEXT.as_bytes()[..70]), None, "half a triangle");
        assert_eq!(stl(b"\xff\xfe"), None);
        assert_eq!(obj(b"v 0 0\n"), None);
        assert_eq!(obj(b"v 0 0 0\nf 1 2 3\n"), None, "corners that are not there");
        assert_eq!(obj(b"f\n"), None);
    }
}
