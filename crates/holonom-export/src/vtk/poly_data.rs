//! A file of VTK poly data (`.vtp`): points, lines, triangles and what belongs to them.
//!
//! XML with the arrays in it as base64 of `length (u64), values`, little endian, not compressed.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::io::{self, Write};

/// The name of the array with the normals of points, by which surfaces are shaded.
const NORMALS: &str = "Normals";

/// Values of an array.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum ArrayValues {
    Float64(Vec<f64>),
    Float32(Vec<f32>),
    Int32(Vec<i32>),
    Int64(Vec<i64>),
    UInt8(Vec<u8>),
    Text(Vec<String>),
}

impl ArrayValues {
    fn kind(&self) -> &'static str {
        match self {
            Self::Float64(_) => "Float64",
            Self::Float32(_) => "Float32",
            Self::Int32(_) => "Int32",
            Self::Int64(_) => "Int64",
            Self::UInt8(_) => "UInt8",
            Self::Text(_) => "String",
        }
    }

    fn len(&self) -> usize {
        match self {
            Self::Float64(values) => values.len(),
            Self::Float32(values) => values.len(),
            Self::Int32(values) => values.len(),
            Self::Int64(values) => values.len(),
            Self::UInt8(values) => values.len(),
            Self::Text(values) => values.len(),
        }
    }

    fn bytes(&self) -> Vec<u8> {
        match self {
            Self::Float64(values) => values.iter().flat_map(|v| v.to_le_bytes()).collect(),
            Self::Float32(values) => values.iter().flat_map(|v| v.to_le_bytes()).collect(),
            Self::Int32(values) => values.iter().flat_map(|v| v.to_le_bytes()).collect(),
            Self::Int64(values) => values.iter().flat_map(|v| v.to_le_bytes()).collect(),
            Self::UInt8(values) => values.clone(),
            // each ends with a zero byte
            Self::Text(values) => {
                values.iter().flat_map(|v| [v.as_bytes(), &[0]].concat()).collect()
            }
        }
    }
}

/// A named array.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Array {
    pub(super) name: &'static str,
    pub(super) components: usize,
    pub(super) values: ArrayValues,
}

impl Array {
    /// One number for each entry.
    pub(super) fn scalars(name: &'static str, values: ArrayValues) -> Self {
        Self { name, components: 1, values }
    }

    /// Three numbers for each entry.
    pub(super) fn vectors(name: &'static str, values: &[[f64; 3]]) -> Self {
        Self { name, components: 3, values: ArrayValues::Float64(values.concat()) }
    }

    /// Three components for each point.
    pub(super) fn normals(values: Vec<f32>) -> Self {
        Self { name: NORMALS, components: 3, values: ArrayValues::Float32(values) }
    }

    /// Red, green, blue for each cell.
    pub(super) fn colors(values: Vec<u8>) -> Self {
        Self { name: "color", components: 3, values: ArrayValues::UInt8(values) }
    }

    fn write(&self, out: &mut impl Write) -> io::Result<()> {
        let data = self.values.bytes();
        let bytes = [&(data.len() as u64).to_le_bytes()[..], &data].concat();
        writeln!(
            out,
            "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" NumberOfTuples=\"{}\" \
             format=\"binary\">{}</DataArray>",
            self.values.kind(),
            self.name,
            self.components,
            self.values.len() / self.components,
            STANDARD.encode(bytes)
        )
    }
}

/// Points and cells, which are counted in this order: points, lines of two points, strips of
/// triangles, triangles.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct PolyData {
    pub(super) points: Vec<[f64; 3]>,
    /// Whether each point is a cell.
    pub(super) vertices: bool,
    pub(super) lines: Vec<[u32; 2]>,
    pub(super) strips: Vec<Vec<u32>>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) point_data: Vec<Array>,
    pub(super) cell_data: Vec<Array>,
    pub(super) field_data: Vec<Array>,
}

impl PolyData {
    /// Writes the file.
    pub(super) fn write(&self, out: &mut impl Write) -> io::Result<()> {
        let vertices: Vec<[u32; 1]> = match self.vertices {
            true => (0..self.points.len() as u32).map(|k| [k]).collect(),
            false => Vec::new(),
        };
        writeln!(out, "<?xml version=\"1.0\"?>")?;
        writeln!(
            out,
            "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" \
             header_type=\"UInt64\">\n<PolyData>"
        )?;
        section(out, "FieldData", &self.field_data)?;
        writeln!(
            out,
            "<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"{}\" NumberOfLines=\"{}\" \
             NumberOfStrips=\"{}\" NumberOfPolys=\"{}\">",
            self.points.len(),
            vertices.len(),
            self.lines.len(),
            self.strips.len(),
            self.triangles.len()
        )?;
        section(out, "PointData", &self.point_data)?;
        section(out, "CellData", &self.cell_data)?;
        section(out, "Points", &[Array::vectors("Points", &self.points)])?;
        cells(out, "Verts", &vertices)?;
        cells(out, "Lines", &self.lines)?;
        cells(out, "Strips", &self.strips)?;
        cells(out, "Polys", &self.triangles)?;
        writeln!(out, "</Piece>\n</PolyData>\n</VTKFile>")
    }
}

fn section(out: &mut impl Write, name: &str, arrays: &[Array]) -> io::Result<()> {
    let normals = arrays.iter().any(|array| array.name == NORMALS);
    let active = if normals { format!(" Normals=\"{NORMALS}\"") } else { String::new() };
    writeln!(out, "<{name}{active}>")?;
    arrays.iter().try_for_each(|array| array.write(out))?;
    writeln!(out, "</{name}>")
}

fn cells<C: AsRef<[u32]>>(out: &mut impl Write, name: &str, cells: &[C]) -> io::Result<()> {
    let corners = cells.iter().flat_map(|cell| cell.as_ref()).map(|k| *k as i32).collect();
    let mut end = 0;
    let end = |cell: &C| {
        end += cell.as_ref().len() as i32;
        end
    };
    let ends = cells.iter().map(end).collect();
    let arrays = [
        Array::scalars("connectivity", ArrayValues::Int32(corners)),
        Array::scalars("offsets", ArrayValues::Int32(ends)),
    ];
    section(out, name, &arrays)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_holds_its_numbers_bit_for_bit() {
        let data = PolyData {
            points: vec![[0.1, -0.0, 1e-300], [1.0, 2.0, 3.0]],
            vertices: true,
            lines: vec![[0, 1]],
            point_data: vec![Array::scalars(
                "name",
                ArrayValues::Text(vec!["a".into(), "é".into()]),
            )],
            ..PolyData::default()
        };
        let mut file = Vec::new();
        data.write(&mut file).unwrap();
        let text = String::from_utf8(file).unwrap();
        let array = |name: &str| {
            let line =
                text.lines().find(|line| line.contains(&format!("Name=\"{name}\""))).unwrap();
            let code = line.split(['>', '<']).nth(2).unwrap();
            STANDARD.decode(code).unwrap()
        };
        let points = array("Points");
        assert_eq!(points[..8], 48u64.to_le_bytes());
        let numbers: Vec<u64> = points[8..]
            .chunks(8)
            .map(|eight| u64::from_le_bytes(eight.try_into().unwrap()))
            .collect();
        let expected = [0.1, -0.0, 1e-300, 1.0, 2.0, 3.0].map(f64::to_bits);
        assert_eq!(numbers, expected);
        assert_eq!(array("name")[8..], *b"a\0\xc3\xa9\0");
        insta::assert_snapshot!(text);
    }
}
