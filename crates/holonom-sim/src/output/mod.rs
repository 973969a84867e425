//! The files of a run.
//!
//! | file | content |
//! |---|---|
//! | `trajectory.csv` | coordinates, energies and momentum maps of every recorded node |
//! | `residuals.csv` | constraint residuals and Newton iterations of the same nodes |
//! | `sensors.csv` | what the sensors measure at the same nodes; only when the model has sensors |
//! | `beams.csv` | strains and section forces along beams at the same nodes; only when the model has beams |
//! | `momenta.csv` | multipliers, momenta, parts of the energies at the same nodes; only when the model asks for it |
//! | `summary.json` | [`Summary`] |
//! | `model.toml` | the model, resolved |
//! | `report.html`, `plots/*.svg` | drawn by `holonom-report` |

mod beams;
mod csv;
mod file;
mod folder;
mod frames;
mod momenta;
mod pictures;
mod rows;
mod sensors;
mod summary;

pub use beams::BeamWriter;
pub use csv::{ResidualRow, Trajectory, TrajectoryWriter};
pub use file::{OutputError, atomically};
pub use folder::RunFolder;
pub use frames::{Frames, members};
pub use momenta::MomentaWriter;
pub use sensors::{SensorTable, SensorWriter};
pub use summary::{
    ConstraintSummary, EnergySummary, Maximum, MomentumSummary, NewtonSummary, Status, Summary,
    SummaryBuilder, larger,
};
