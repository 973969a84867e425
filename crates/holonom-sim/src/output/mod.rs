//! The files of a run.
//!
//! | file | content |
//! |---|---|
//! | `trajectory.csv` | coordinates, energies and momentum maps of every recorded node |
//! | `residuals.csv` | constraint residuals and Newton iterations of the same nodes |
//! | `sensors.csv` | what the sensors measure at the same nodes; only when the model has sensors |
//! | `beams.csv` | strains and section forces along beams at the same nodes; only when the model has beams |
//! | `energy.csv` | parts of the energy and the work done at the same nodes; not in statics |
//! | `contacts.csv` | contacts of bodies at the same nodes; only when the model asks for it |
//! | `events.csv` | what events and contacts did; only when the model has some |
//! | `momenta.csv` | multipliers, momenta, parts of the energies at the same nodes; only when the model asks for it |
//! | `summary.json` | [`Summary`] |
//! | `model.toml` | the model, resolved |
//! | `meshes/*` | copies of the meshes of its bodies, named by the hash of their content |
//! | `checkpoint`, `checkpoint.previous` | [`Checkpoint`]: the newest and the one before; only when asked for, or interrupted |
//! | `report.html`, `plots/*.svg` | drawn by `holonom-report` |
//!
//! The columns of all files of rows stand in [`columns`].

mod beams;
mod checkpoint;
pub mod columns;
mod contacts;
mod csv;
mod energy;
mod events;
mod file;
mod folder;
mod folder_checkpoints;
mod folder_model;
mod frames;
mod lock;
mod meshes;
mod momenta;
mod pictures;
mod readable;
mod recorder;
mod row_file;
mod rows;
mod sensors;
mod size;
mod summary;
mod time_series;
mod written;

pub use beams::BeamWriter;
pub use checkpoint::{CHECKPOINTS, Checkpoint, CheckpointError};
pub use columns::RowTable;
pub use contacts::{ContactRow, ContactWriter};
pub use csv::{ResidualRow, Trajectory, TrajectoryWriter};
pub use energy::EnergyWriter;
pub use events::EventWriter;
pub use file::{OutputError, atomically, beside};
pub use folder::{Readable, RunFolder};
pub use folder_checkpoints::FoundCheckpoint;
pub use frames::{FrameReader, Frames, MemberColumns, Snapshot, coordinates, members};
pub use lock::Lock;
pub use momenta::{MomentaWriter, momenta_columns, momenta_values};
pub use readable::{LeftOut, Lines, RowReader};
pub use recorder::Recorder;
pub use row_file::RowFile;
pub use sensors::SensorWriter;
pub use size::OutputSize;
pub use summary::{
    ConstraintSummary, Ended, EnergySummary, Maximum, MomentumSummary, NewtonSummary,
    RunInterruption, Status, Summary, SummaryBuilder, larger,
};
pub use time_series::TimeSeries;
pub use vi_core::contact_state::ContactCounts;
pub use written::Written;
