//! Strains and section forces of `beams.csv`, for the intervals between the nodes of beams.

use holonom_sim::output::RowTable;
use holonom_sim::output::columns::{BEAM, SECTION};

use crate::ExportError;
use crate::rows::{StepRows, number};
use crate::run::ShownRun;

/// The rows of `beams.csv`.
pub(super) struct Sections {
    file: Option<(StepRows, [usize; 2])>, // with the columns of the name and of the first strain
    beams: Vec<(String, usize)>,          // name, intervals between nodes
}

impl Sections {
    /// Those of a run.
    pub(super) fn open(run: &ShownRun<'_>) -> Result<Self, ExportError> {
        let file = StepRows::open(run.folder, RowTable::Beams)?.and_then(|rows| {
            let columns = [rows.column(BEAM.name)?, rows.column(SECTION[0].name)?];
            Some((rows, columns))
        });
        let intervals = |legs: &[usize]| legs.iter().map(|nodes| nodes - 1).sum();
        let beams = run.look.beams.iter();
        let beams = beams.map(|b| (b.name.clone(), intervals(&b.beam.legs))).collect();
        Ok(Self { file, beams })
    }

    /// Of each beam the rows at a step: `Γ, K, N, M`. There is one for each interval between nodes,
    /// since an element has as many Gauss points as intervals; none where a row or a number is
    /// missing.
    pub(super) fn at(&mut self, step: u64) -> Result<Vec<Vec<[f64; SECTION.len()]>>, ExportError> {
        let mut found = vec![Vec::new(); self.beams.len()];
        let Some((file, [name, first])) = &mut self.file else { return Ok(found) };
        for row in file.at(step)? {
            let beam = self.beams.iter().position(|(own, _)| row.get(*name) == Some(own));
            let Some(beam) = beam else { continue };
            let mut numbers = [0.0; SECTION.len()];
            let all = numbers.iter_mut().enumerate().all(|(k, value)| {
                let read = number(&row, *first + k);
                *value = read.unwrap_or_default();
                read.is_some()
            });
            if all {
                found[beam].push(numbers);
            }
        }
        for (rows, (_, intervals)) in found.iter_mut().zip(&self.beams) {
            if rows.len() != *intervals {
                rows.clear();
            }
        }
        Ok(found)
    }
}
