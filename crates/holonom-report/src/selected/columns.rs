//! The columns of the files of a run, with quantities and units.

use holonom_sim::output::{OutputError, RunFolder};
use holonom_sim::sensor;

use super::nodes::names_of;

/// Files with one column for each quantity, and `beams.csv`.
pub(super) const FILES: [&str; 6] =
    ["trajectory", "residuals", "energy", "sensors", "beams", "momenta"];

/// A column of a file of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Its file without extension; empty for the time.
    pub file: &'static str,
    /// Its name there; of a beam `BEAM.k.N1` with the k-th row of the beam at a node, counted
    /// from 0.
    pub name: String,
    /// What it is.
    pub quantity: String,
    /// Its unit; empty when it has none.
    pub unit: &'static str,
    /// Whether its powers of ten matter.
    pub logarithmic: bool,
}

impl Column {
    pub(super) fn time(quantity: &str, unit: &'static str) -> Self {
        let [name, quantity] = ["t", quantity].map(str::to_owned);
        Self { file: "", name, quantity, unit, logarithmic: false }
    }

    /// Its name with that of its file: `residuals/position`.
    #[must_use]
    pub fn qualified(&self) -> String {
        format!("{}/{}", self.file, self.name)
    }

    /// What follows the last dot of its name.
    pub(super) fn part(&self) -> &str {
        self.name.rsplit_once('.').map_or("", |(_, part)| part)
    }
}

/// The columns of all files of a run, but for `step` and `t`.
///
/// # Errors
/// [`OutputError::Io`].
pub fn columns(folder: &RunFolder) -> Result<Vec<Column>, OutputError> {
    let model = folder.model().ok();
    let sensors = model.as_ref().map(sensor::columns).unwrap_or_default();
    let mut all = Vec::new();
    for file in FILES {
        for name in names_of(folder, file)? {
            let sensor = sensors.iter().find(|s| file == "sensors" && s.name() == name);
            let (quantity, unit) = match sensor {
                Some(sensor) => (sensor.quantity, sensor.unit),
                None => described(file, &name),
            };
            let logarithmic = file == "residuals" && name != "newton_iterations";
            let quantity = quantity.to_owned();
            all.push(Column { file, name, quantity, unit, logarithmic });
        }
    }
    Ok(all)
}

/// Quantity and unit of a column that no sensor describes, as docs/file-formats.md states them.
fn described(file: &str, name: &str) -> (&'static str, &'static str) {
    let (owner, part) = name.rsplit_once('.').unwrap_or(("", name));
    match (file, part) {
        ("trajectory", "E" | "H") if owner.is_empty() => ("energy", "J"),
        ("trajectory", "Lx" | "Ly" | "Lz") if owner.is_empty() => ("angular momentum", "kg·m²/s"),
        ("trajectory", "Px" | "Py" | "Pz") if owner.is_empty() => ("linear momentum", "kg·m/s"),
        ("trajectory", "x" | "y" | "z") => ("position", "m"),
        ("trajectory", _) => ("director", ""),
        ("residuals", "newton_iterations") => ("Newton iterations", ""),
        ("residuals", _) => ("largest residual", "SI"),
        ("energy", _) if name.starts_with("work") => ("work", "J"),
        ("energy", _) => ("energy", "J"),
        ("beams", "Gamma1" | "Gamma2" | "Gamma3") => ("strain", ""),
        ("beams", "K1" | "K2" | "K3") => ("curvature", "1/m"),
        ("beams", "N1" | "N2" | "N3") => ("section force", "N"),
        ("beams", _) => ("section moment", "N·m"),
        ("momenta", "kinetic" | "potential") => ("energy", "J"),
        ("momenta", _) if name.starts_with("lambda.") => ("multiplier", "N"),
        ("momenta", _) if name.starts_with("p_reduced.") => ("reduced momentum", ""),
        ("momenta", "x" | "y" | "z") => ("momentum", "kg·m/s"),
        ("momenta", _) => ("momentum of directors", "kg·m²/s"),
        _ => ("value", ""),
    }
}
