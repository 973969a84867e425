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

use crate::npy::Archive;
use crate::table::{ColumnTable, RunFiles};
use holonom_sim::output::columns::{
    ANGULAR_MOMENTUM, ARC_LENGTH, DISCRETE_ENERGY, HAMILTONIAN, HEAD, LINEAR_MOMENTUM,
    OutputColumn, STEP, STRAINS, STRESSES, TAIL, TIME,
};
use holonom_sim::output::{MemberColumns, members};
use holonom_sim::sample::MemberKind;
use std::io;
use std::path::Path;

/// Writes all results.
pub(crate) fn write(results: &RunFiles, to: &Path) -> io::Result<()> {
    let mut archive = Archive::create(to)?;
    motion(&mut archive, &results.trajectory)?;
    for (group, table) in &results.groups {
        for (name, column) in table.names.iter().zip(&table.columns).skip(HEAD.len()) {
            list(&mut archive, &format!("{group}/{name}"), column)?;
        }
    }
    if let Some(table) = &results.beams {
        beams(&mut archive, table)?;
    }
    archive.finish()
}

fn list(archive: &mut Archive, name: &str, values: &[f64]) -> io::Result<()> {
    archive.reals(name, &[values.len()], values.iter().copied())
}

fn motion(archive: &mut Archive, table: &ColumnTable) -> io::Result<()> {
    let rows = table.rows();
    let n = table.columns.len().saturating_sub(HEAD.len() + TAIL.len());
    let steps: Vec<i64> = table.columns[0].iter().map(|step| *step as i64).collect();
    archive.wholes(STEP.name, &steps)?;
    list(archive, TIME.name, table.column(TIME.name).unwrap_or_default())?;
    let columns = |first: usize, count: usize| {
        let row = move |row: usize| (first..first + count).map(move |k| table.columns[k][row]);
        (0..rows).flat_map(row)
    };
    archive.reals("q", &[rows, n], columns(HEAD.len(), n))?;
    for OutputColumn { name, .. } in [DISCRETE_ENERGY, HAMILTONIAN] {
        list(archive, name, table.column(name).unwrap_or_default())?;
    }
    for (name, [first, ..]) in [("L", ANGULAR_MOMENTUM), ("P", LINEAR_MOMENTUM)] {
        let first = HEAD.len() + n + TAIL.iter().take_while(|column| **column != first).count();
        archive.reals(name, &[rows, 3], columns(first, 3))?;
    }
    for MemberColumns { member, first } in members(&table.names) {
        let name = member.name;
        let axes = if member.kind == MemberKind::Particle2 { 2 } else { 3 };
        archive.reals(&format!("position/{name}"), &[rows, axes], columns(first, axes))?;
        if member.kind == MemberKind::Frame {
            let entry = |row: usize, n: usize| table.columns[first + 3 + 3 * (n % 3) + n / 3][row];
            let directors = (0..rows).flat_map(|row| (0..9).map(move |n| entry(row, n)));
            archive.reals(&format!("directors/{name}"), &[rows, 3, 3], directors)?;
        }
    }
    Ok(())
}

/// One row of the file is one element of one beam at one step.
fn beams(archive: &mut Archive, table: &ColumnTable) -> io::Result<()> {
    let mut names: Vec<&String> = table.words.iter().collect();
    names.sort();
    names.dedup();
    let step = table.column(STEP.name).unwrap_or_default();
    for name in names {
        let own: Vec<usize> =
            (0..table.words.len()).filter(|&row| table.words[row] == **name).collect();
        let elements = own.iter().take_while(|&&row| step[row] <= step[own[0]]).count();
        let rows = own.len() / elements.max(1);
        let arc = table.column(ARC_LENGTH.name).unwrap_or_default();
        let arc = own[..elements].iter().map(|&row| arc[row]);
        archive.reals(&format!("beams/{name}/s"), &[elements], arc)?;
        for (group, parts) in [("strain", STRAINS), ("force", STRESSES)] {
            let Some(first) = table.names.iter().position(|n| n == parts[0]) else { continue };
            let at_elements = own[..rows * elements].iter();
            let values = at_elements
                .flat_map(|&row| (first..first + parts.len()).map(move |k| table.columns[k][row]));
            archive.reals(
                &format!("beams/{name}/{group}"),
                &[rows, elements, parts.len()],
                values,
            )?;
        }
    }
    Ok(())
}
