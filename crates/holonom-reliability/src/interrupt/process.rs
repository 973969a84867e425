//! The program as a process that is disturbed.

use std::ffi::OsStr;
use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A process that lasts is a fault.
const PATIENCE: Duration = Duration::from_secs(120);

/// What is done to a process.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Disturbance {
    /// Nothing.
    None,
    /// A signal after some time: `KILL`, `TERM`, `INT`.
    Signal(&'static str, Duration),
    /// No file may grow beyond so many blocks of 512 bytes, as on a full disk.
    FullDisk(usize),
    /// Nobody reads what it prints.
    NoReader,
}

/// How a process ended.
#[derive(Clone, Debug)]
pub(super) struct ProcessEnd {
    /// Its exit code; `None` after a signal that it does not handle.
    pub code: Option<i32>,
    /// What it said on standard error.
    pub words: String,
}

/// A process.
pub(super) struct Process {
    child: Child,
    signal: Option<(&'static str, Duration)>,
    begin: Instant,
}

impl Process {
    /// Starts the program with `words` in a folder.
    pub(super) fn start(
        program: &Path,
        words: &[impl AsRef<OsStr>],
        folder: &Path,
        disturbance: Disturbance,
    ) -> Result<Self, String> {
        let said = |error: std::io::Error| error.to_string();
        let mut command = Command::new(program);
        if let Disturbance::FullDisk(blocks) = disturbance {
            command = Command::new("sh");
            command.args(["-c", "ulimit -f \"$0\"; trap '' XFSZ; exec \"$@\""]);
            command.arg(blocks.to_string()).arg(program);
        }
        command.args(words).current_dir(folder).stdin(Stdio::null());
        command.stderr(Stdio::piped()); // a file could not grow, either
        let unread = disturbance == Disturbance::NoReader;
        command.stdout(if unread { Stdio::piped() } else { Stdio::null() });
        let mut child = command.spawn().map_err(said)?;
        drop(child.stdout.take());
        let signal = match disturbance {
            Disturbance::Signal(name, after) => Some((name, after)),
            _ => None,
        };
        Ok(Self { child, signal, begin: Instant::now() })
    }

    /// Waits for its end, and sends its signal.
    pub(super) fn end(mut self) -> Result<ProcessEnd, String> {
        let said = |error: std::io::Error| error.to_string();
        loop {
            if let Some(status) = self.child.try_wait().map_err(said)? {
                let mut words = Vec::new();
                if let Some(mut errors) = self.child.stderr.take() {
                    errors.read_to_end(&mut words).map_err(said)?;
                }
                let words = String::from_utf8_lossy(&words).into_owned();
                return Ok(ProcessEnd { code: status.code(), words });
            }
            let elapsed = self.begin.elapsed();
            if let Some((name, _)) = self.signal.take_if(|(_, after)| elapsed >= *after) {
                self.send(name).map_err(said)?;
            }
            if elapsed > PATIENCE {
                self.child.kill().map_err(said)?;
                return Err("the program does not end".into());
            }
            std::thread::sleep(Duration::from_micros(200));
        }
    }

    fn send(&mut self, name: &str) -> std::io::Result<()> {
        if name == "KILL" {
            return self.child.kill();
        }
        let id = self.child.id().to_string();
        let mut kill = Command::new("kill");
        kill.args([&format!("-{name}"), &id]).stderr(Stdio::null());
        kill.status().map(drop) // a process that has ended meanwhile gets none
    }
}
