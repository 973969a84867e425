//! Arrays for NumPy.
//!
//! | array | shape | is |
//! |---|---|---|
//! | `step`, `t` | `rows` | steps (int64) and times of the recorded nodes |
//! | `q` | `rows × n` | all coordinates, in the order of `trajectory.csv` |
//! | `position/NAME` | `rows × 3` (in the plane 2) | of a body, node or particle, m |
//! | `directors/NAME` | `rows × 3 × 3` | of a body or node: `[k, :, I]` is `d_I` in space |
//! | `E`, `H` | `rows` | energies, J |
//! | `L`, `P` | `rows × 3` | angular and linear momentum |
//! | `residuals/…`, `sensors/…`, `momenta/…`, `energy/…` | `rows` | a column of that file |
//! | `beams/NAME/s` | `elements` | arc length, m |
//! | `beams/NAME/strain`, `beams/NAME/force` | `rows × elements × 6` | `Γ, K`; `N, M` |

use crate::table::{Results, Table};
use holonom_sim::output::members;
use holonom_sim::sample::MemberKind;
use ndarray::{Array1, Array2, Array3, ArrayBase, Data, Dimension};
use ndarray_npy::{NpzWriter, WritableElement};
use std::fs::File;
use std::io;
use std::path::Path;

/// Columns of `trajectory.csv` after those of the members.
const TAIL: usize = 8;

struct Writer(NpzWriter<File>);

impl Writer {
    fn add<S, D>(&mut self, name: &str, array: &ArrayBase<S, D>) -> io::Result<()>
    where
        S: Data,
        S::Elem: WritableElement,
        D: Dimension,
    {
        self.0.add_array(name, array).map_err(io::Error::other)
    }

    fn column(&mut self, name: &str, values: &[f64]) -> io::Result<()> {
        self.add(name, &ndarray::aview1(values))
    }
}

/// Writes all results.
pub(crate) fn write(results: &Results, to: &Path) -> io::Result<()> {
    let mut writer = Writer(NpzWriter::new(File::create(to)?));
    motion(&mut writer, &results.trajectory)?;
    for (group, table) in &results.groups {
        for (name, column) in table.names.iter().zip(&table.columns).skip(2) {
            writer.column(&format!("{group}/{name}"), column)?;
        }
    }
    if let Some(table) = &results.beams {
        beams(&mut writer, table)?;
    }
    writer.0.finish().map(drop).map_err(io::Error::other)
}

fn motion(writer: &mut Writer, table: &Table) -> io::Result<()> {
    let rows = table.rows();
    let n = table.columns.len().saturating_sub(2 + TAIL);
    let value = |row: usize, column: usize| table.columns[column][row];
    writer.add("step", &Array1::from_shape_fn(rows, |k| value(k, 0) as i64))?;
    writer.column("t", table.column("t").unwrap_or_default())?;
    writer.add("q", &Array2::from_shape_fn((rows, n), |(k, i)| value(k, 2 + i)))?;
    for name in ["E", "H"] {
        writer.column(name, table.column(name).unwrap_or_default())?;
    }
    let after = 2 + n + 2; // E, H before the momentum maps
    for (name, first) in [("L", after), ("P", after + 3)] {
        writer.add(name, &Array2::from_shape_fn((rows, 3), |(k, i)| value(k, first + i)))?;
    }
    for (k, member) in members(&table.names) {
        let name = member.name;
        let axes = if member.kind == MemberKind::Particle2 { 2 } else { 3 };
        let position = Array2::from_shape_fn((rows, axes), |(row, i)| value(row, k + i));
        writer.add(&format!("position/{name}"), &position)?;
        if member.kind == MemberKind::Frame {
            let director = |(row, i, j): (usize, usize, usize)| value(row, k + 3 + 3 * j + i);
            let directors = Array3::from_shape_fn((rows, 3, 3), director);
            writer.add(&format!("directors/{name}"), &directors)?;
        }
    }
    Ok(())
}

/// One row of the file is one element of one beam at one step.
fn beams(writer: &mut Writer, table: &Table) -> io::Result<()> {
    let mut names: Vec<&String> = table.words.iter().collect();
    names.sort();
    names.dedup();
    let step = table.column("step").unwrap_or_default();
    for name in names {
        let own: Vec<usize> =
            (0..table.words.len()).filter(|&row| table.words[row] == **name).collect();
        let elements = own.iter().take_while(|&&row| step[row] <= step[own[0]]).count();
        let rows = own.len() / elements.max(1);
        let arc = table.column("s").unwrap_or_default();
        let arc = Array1::from_shape_fn(elements, |i| arc[own[i]]);
        writer.add(&format!("beams/{name}/s"), &arc)?;
        for (group, first) in [("strain", "Gamma1"), ("force", "N1")] {
            let Some(first) = table.names.iter().position(|n| n == first) else { continue };
            let value = |(row, element, i): (usize, usize, usize)| {
                table.columns[first + i][own[row * elements + element]]
            };
            let array = Array3::from_shape_fn((rows, elements, 6), value);
            writer.add(&format!("beams/{name}/{group}"), &array)?;
        }
    }
    Ok(())
}
