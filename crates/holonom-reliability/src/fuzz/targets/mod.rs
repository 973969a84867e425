//! What is executed with mutated inputs, and what its answers must be.
//!
//! | target | what reads | an answer is right if |
//! |---|---|---|
//! | [`model`] | model files with `--set` | an accepted model has a text that gives it again |
//! | [`expression`] | expressions of `[parameters]` | a value is finite |
//! | [`assembly`] | models that are read: set-up and up to three steps | numbers are finite, errors name a remedy |
//! | [`checkpoint`] | checkpoints | one that was changed is refused |
//! | [`state`] | the state in a checkpoint | it is refused, or the run goes on with finite numbers |
//! | [`tables`] | the files of a run, as `plot`, `view`, `export`, `resume` read them | errors have words |
//! | [`sweep`] | `--vary`, `--shard` | every point has a value for every key |
//! | [`import`] | robots in URDF and MJCF | the text of an accepted model gives it again |
//! | [`mesh`] | meshes in STL and OBJ | a copy gives the same mesh, a solid has a positive volume |
//! | [`measured`] | measured values, as `identify` reads them | values are finite, times increase within the run |
//! | [`arguments`] | the command line of the program | it ends with one of its codes |
//!
//! Everywhere: no panic, an end, bounded memory, an error with words.

pub mod arguments;
pub mod assembly;
pub mod checkpoint;
pub mod expression;
pub mod import;
pub mod measured;
pub mod mesh;
pub mod model;
mod sample_run;
pub mod state;
pub mod sweep;
pub mod tables;

use super::mutate;
use crate::program;
use crate::soak::draw::Draw;
use std::path::PathBuf;

/// The answer to an input.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// It is right.
    Accepted,
    /// It is refused, in words.
    Refused(String),
    /// The answer is wrong, in words.
    Wrong(String),
}

/// What executes inputs, one after the other.
pub trait Worker {
    /// Executes an input and judges the answer.
    fn execute(&mut self, input: &[u8]) -> Answer;

    /// The same with a check left out, where a wrong answer can be made so: a defect that the judge
    /// must find.
    fn execute_unchecked(&mut self, input: &[u8]) -> Answer {
        self.execute(input)
    }
}

/// Something that reads.
pub trait FuzzTarget: Sync {
    /// Its name.
    fn name(&self) -> &'static str;
    /// Executions of a long run.
    fn executions(&self) -> u64;
    /// Inputs to begin with.
    fn seeds(&self) -> Vec<Vec<u8>>;
    /// What executes them, for one thread.
    fn worker(&self) -> Box<dyn Worker>;
    /// A mutated input.
    fn mutate(&self, input: &[u8], other: &[u8], draw: &mut Draw) -> Vec<u8> {
        mutate::bytes(input, other, draw)
    }
    /// Whether it can be executed at all.
    ///
    /// # Errors
    /// What is missing, in words.
    fn ready(&self) -> Result<(), String> {
        Ok(())
    }
}

/// All targets; a new one is a line here.
#[must_use]
pub fn all() -> Vec<Box<dyn FuzzTarget>> {
    vec![
        Box::new(model::ModelFile),
        Box::new(expression::Expression),
        Box::new(assembly::Assembly),
        Box::new(checkpoint::CheckpointFile),
        Box::new(state::StoredState),
        Box::new(tables::Tables),
        Box::new(sweep::SweepPlans),
        Box::new(arguments::Arguments),
        Box::new(import::RobotDescriptions),
        Box::new(mesh::MeshFiles),
        Box::new(measured::MeasuredValues),
    ]
}

/// A folder of the repository.
pub(super) fn repository(folder: &str) -> PathBuf {
    program::repository().join(folder)
}

/// The contents of the files of a folder, by name.
pub(super) fn files(folder: &str, most: u64) -> Vec<Vec<u8>> {
    let entries = std::fs::read_dir(repository(folder)).into_iter().flatten().flatten();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    paths.sort();
    let small =
        |path: &PathBuf| path.metadata().is_ok_and(|data| data.is_file() && data.len() <= most);
    paths.into_iter().filter(small).filter_map(|path| std::fs::read(path).ok()).collect()
}

/// The lines of the files of a folder.
pub(super) fn lines(folder: &str) -> Vec<Vec<u8>> {
    let files = files(folder, 1 << 16);
    let all = files.iter().flat_map(|file| file.split(|byte| *byte == b'\n'));
    all.filter(|line| !line.is_empty()).map(<[u8]>::to_vec).collect()
}
