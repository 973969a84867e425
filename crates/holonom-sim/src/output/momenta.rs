//! `momenta.csv`: multipliers, discrete Legendre transforms and the parts of the energies, on the same rows as
//! `trajectory.csv`.
//!
//! ```text
//! step,t,lambda.OWNER.k…,p.MEMBER.x…,p_projected.MEMBER.x…,p_reduced.JOINT.k…,
//! E_d.kinetic,E_d.potential,H_d.kinetic,H_d.potential,H_d_projected.kinetic,H_d_projected.potential
//! ```
//! What is not defined at a node is an empty field: [`Momenta`] has the table.

use std::io::{self, Write};

use super::csv::{HEAD, Rows};
use crate::sample::{Momenta, MomentaNames, Sample};

/// Energies, each in its kinetic and its potential part.
const ENERGIES: [&str; 3] = ["E_d", "H_d", "H_d_projected"];

/// Writes `momenta.csv`, whole rows only.
pub struct MomentaWriter<W: Write> {
    rows: Rows<W>,
    sizes: [usize; 4], // λ_n, p_n, ᵠp_n, ᴾp_n
}

impl<W: Write> MomentaWriter<W> {
    /// Writes the header.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn new(sink: W, names: &MomentaNames) -> io::Result<Self> {
        let MomentaNames { constraints, coordinates, rates } = names;
        let groups = [
            ("lambda", constraints),
            ("p", coordinates),
            ("p_projected", coordinates),
            ("p_reduced", rates),
        ];
        let mut header: Vec<String> = HEAD.map(str::to_owned).into();
        for (group, names) in groups {
            header.extend(names.iter().map(|name| format!("{group}.{name}")));
        }
        for energy in ENERGIES {
            header.extend(["kinetic", "potential"].map(|part| format!("{energy}.{part}")));
        }
        let mut writer =
            Self { rows: Rows::new(sink), sizes: groups.map(|(_, names)| names.len()) };
        writer.rows.push(|row| row.write_record(&header))?;
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
        let vectors = [&found.lambda, &found.p, &found.p_projected, &found.p_reduced];
        let mut fields: Vec<Option<f64>> = Vec::new();
        for (values, size) in vectors.into_iter().zip(self.sizes) {
            fields.extend((0..size).map(|i| values.get(i).copied()));
        }
        for energies in [found.discrete_energy, found.hamiltonian, found.hamiltonian_projected] {
            fields.extend([energies.map(|e| e.kinetic), energies.map(|e| e.potential)]);
        }
        self.rows.push(|row| row.serialize((sample.step, sample.t, fields)))
    }

    /// Ends the file.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn finish(mut self) -> io::Result<()> {
        self.rows.flush()
    }
}
