//! `momenta.csv`: multipliers, discrete Legendre transforms and the parts of the energies, on the
//! same rows as `trajectory.csv`.
//!
//! ```text
//! step,t,lambda.OWNER.k…,p.MEMBER.x…,p_projected.MEMBER.x…,p_reduced.JOINT.k…,
//! E_d.kinetic,E_d.potential,H_d.kinetic,H_d.potential,H_d_projected.kinetic,H_d_projected.potential
//! ```
//! What is not defined at a node is an empty field: [`Momenta`] has the table.

use std::io::{self, Write};

use super::columns::{
    MOMENTUM, MULTIPLIERS, NODE_ENERGIES, NODE_PARTS, OutputColumn, PROJECTED, REDUCED,
};
use super::csv::HEAD;
use super::rows::{RowBlocks, RowField};
use crate::sample::{Momenta, MomentaNames, Sample};
use vi_core::Energies;

/// Names of the columns after `step` and `t`.
#[must_use]
pub fn momenta_columns(names: &MomentaNames) -> Vec<String> {
    let of = |(group, names): (OutputColumn, &Vec<String>)| {
        names.iter().map(|name| format!("{}.{name}", group.name)).collect::<Vec<_>>()
    };
    let parts = |energy: &str| NODE_PARTS.map(|part| format!("{energy}.{}", part.name));
    let energies = NODE_ENERGIES.into_iter().flat_map(parts);
    groups(names).into_iter().flat_map(of).chain(energies).collect()
}

/// The numbers of these columns at a node; `None` where they are not defined.
pub fn momenta_values(found: &Momenta, names: &MomentaNames) -> impl Iterator<Item = Option<f64>> {
    values(found, sizes(names))
}

fn groups(names: &MomentaNames) -> [(OutputColumn, &Vec<String>); 4] {
    let MomentaNames { constraints, coordinates, rates } = names;
    let momenta = [(MOMENTUM, coordinates), (PROJECTED, coordinates)];
    [(MULTIPLIERS, constraints), momenta[0], momenta[1], (REDUCED, rates)]
}

fn sizes(names: &MomentaNames) -> [usize; 4] {
    groups(names).map(|(_, names)| names.len())
}

fn values(found: &Momenta, sizes: [usize; 4]) -> impl Iterator<Item = Option<f64>> {
    let vectors = [&found.lambda, &found.p, &found.p_projected, &found.p_reduced];
    let energies = [found.discrete_energy, found.hamiltonian, found.hamiltonian_projected];
    let vectors = vectors.into_iter().zip(sizes);
    let vectors = vectors.flat_map(|(values, size)| (0..size).map(|i| values.get(i).copied()));
    let parts = |e: Option<Energies>| [e.map(|e| e.kinetic), e.map(|e| e.potential)];
    vectors.chain(energies.into_iter().flat_map(parts))
}

/// Writes `momenta.csv`, whole rows only.
#[derive(Debug)]
pub struct MomentaWriter<W: Write> {
    rows: RowBlocks<W>,
    sizes: [usize; 4], // λ_n, p_n, ᵠp_n, ᴾp_n
}

impl<W: Write> MomentaWriter<W> {
    /// Writes the header.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn new(sink: W, names: &MomentaNames) -> io::Result<Self> {
        let header = HEAD.map(str::to_owned).into_iter().chain(momenta_columns(names));
        let mut writer = Self { rows: RowBlocks::new(sink), sizes: sizes(names) };
        writer.rows.push(|row| row.write_record(header.collect::<Vec<_>>()))?;
        writer.rows.flush()?; // a run that fails at once leaves a file with a header
        Ok(writer)
    }

    /// Writes one node; a sample without momenta leaves all fields but the first two empty.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn record(&mut self, sample: &Sample) -> io::Result<()> {
        let none = Momenta::default();
        let found = sample.momenta.as_deref().unwrap_or(&none);
        let field = |value: Option<f64>| value.map_or(RowField::Empty, RowField::Number);
        let fields = values(found, self.sizes).map(field);
        self.rows.fields(sample.step, std::iter::once(RowField::Number(sample.t)).chain(fields))
    }

    /// Hands all rows to the file.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn flush(&mut self) -> io::Result<()> {
        self.rows.flush()
    }

    /// Ends the file.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn finish(mut self) -> io::Result<()> {
        self.flush()
    }
}
