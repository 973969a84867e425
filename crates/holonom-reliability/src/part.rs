//! Which part of its experiments a harness carries out, and where its numbers go: options of all
//! harnesses.

use crate::stored::Stored;
use holonom::sweep::Shard;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::PathBuf;

/// A part of the experiments of a seed.
#[derive(Clone, Debug)]
pub struct PartOfSeed {
    /// Their seed.
    pub seed: u64,
    /// Which of them.
    pub shard: Shard,
    /// Threads.
    pub jobs: usize,
    /// Where the numbers are written.
    pub json: Option<PathBuf>,
}

impl Default for PartOfSeed {
    fn default() -> Self {
        let jobs = std::thread::available_parallelism().map_or(1, usize::from);
        Self { seed: 1, shard: Shard::WHOLE, jobs, json: None }
    }
}

impl PartOfSeed {
    /// Takes an option that a harness has not of its own.
    ///
    /// # Errors
    /// What cannot be understood, in words.
    pub fn take(&mut self, option: &str, value: &str) -> Result<(), String> {
        match option {
            "--seed" => self.seed = number(option, value)?,
            "--shard" => self.shard = value.parse()?,
            "--jobs" => self.jobs = number(option, value)?.clamp(1, 1024) as usize,
            "--json" => self.json = Some(PathBuf::from(value)),
            _ => return Err(format!("unknown option `{option}`")),
        }
        Ok(())
    }

    /// Writes the numbers, where they are wanted.
    ///
    /// # Errors
    /// What cannot be written, in words.
    pub fn store<T: Serialize + DeserializeOwned>(&self, found: T) -> Result<(), String> {
        match &self.json {
            Some(path) => Stored { seed: self.seed, found }.write(path),
            None => Ok(()),
        }
    }
}

/// The value of an option that is a number.
///
/// # Errors
/// That it is none, in words.
pub fn number(option: &str, value: &str) -> Result<u64, String> {
    value.parse().map_err(|_| format!("{option} {value}: no number"))
}
