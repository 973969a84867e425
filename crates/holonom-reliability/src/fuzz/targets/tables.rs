//! The files of a run, one of them changed, as the verbs read them. The first line of an input is
//! the name of the file. What reads other files alone is called for some inputs only.

use super::sample_run::{model, run_into};
use super::{Answer, FuzzTarget, Worker};
use crate::fuzz::mutate;
use crate::scratch::ScratchFolder;
use crate::soak::draw::Draw;
use holonom::RunFolder;
use holonom::export::{Format, export};
use holonom::output::OutputError;
use holonom::report::selected::{ChartRequest, NamedRun, selected};
use holonom::report::{Style, Typeface};
use std::fs;

/// Files of a run.
#[derive(Clone, Copy, Debug)]
pub struct Tables;

const FILES: [&str; 8] = [
    "trajectory.csv",
    "residuals.csv",
    "sensors.csv",
    "energy.csv",
    "beams.csv",
    "summary.json",
    "model.toml",
    "checkpoint",
];
/// One of so many inputs that are accepted is drawn and exported.
const DRAWN: u64 = 64;
/// For one of so many inputs everything is read.
const WHOLE: u64 = 64;

/// Reads something of a run; the error in words.
type RunReader = fn(&RunFolder) -> Result<(), String>;

/// What reads tables, with the files that it reads beside those that all read.
const READERS: [(&[&str], RunReader); 4] = [
    (&["trajectory.csv", "residuals.csv"], |folder| said(folder.read_trajectory(4))),
    (&["sensors.csv"], |folder| said(folder.read_sensors())),
    (&["energy.csv"], |folder| said(folder.read_energies())),
    (&["trajectory.csv", "beams.csv"], |folder| {
        let frames = folder.frames(1000, 10);
        said(frames.and_then(|frames| folder.bending_moments(&frames)))
    }),
];

/// The error of a result in words.
fn said<T>(result: Result<T, OutputError>) -> Result<(), String> {
    result.map(drop).map_err(|error| error.to_string())
}

impl FuzzTarget for Tables {
    fn name(&self) -> &'static str {
        "tables"
    }

    fn executions(&self) -> u64 {
        200_000
    }

    fn seeds(&self) -> Vec<Vec<u8>> {
        let scratch = ScratchFolder::new("seeds");
        if ran(&scratch).is_err() {
            return Vec::new();
        }
        let named = |name: &&str| {
            let content = fs::read(scratch.path().join(name)).unwrap_or_default();
            [name.as_bytes(), b"\n", &content].concat()
        };
        FILES.iter().map(named).collect()
    }

    fn mutate(&self, input: &[u8], other: &[u8], draw: &mut Draw) -> Vec<u8> {
        let (name, content) = parts(input);
        let mutated = mutate::bytes(content, parts(other).1, draw);
        [name, b"\n", &mutated].concat()
    }

    fn worker(&self) -> Box<dyn Worker> {
        let scratch = ScratchFolder::new("tables");
        let ready = ran(&scratch);
        let content = |name: &str| fs::read(scratch.path().join(name)).unwrap_or_default();
        let files = FILES.map(content);
        Box::new(TableReader { scratch, ready, files, calls: 0, accepted: 0 })
    }
}

/// Runs the model of all sections into a folder.
fn ran(scratch: &ScratchFolder) -> Result<(), String> {
    run_into(scratch.path(), &model()?)
}

/// The name and the content.
fn parts(input: &[u8]) -> (&[u8], &[u8]) {
    let line = input.iter().position(|byte| *byte == b'\n').unwrap_or(input.len());
    (&input[..line], input.get(line + 1..).unwrap_or_default())
}

struct TableReader {
    scratch: ScratchFolder,
    ready: Result<(), String>,
    /// The files of the run as they were written.
    files: [Vec<u8>; FILES.len()],
    calls: u64,
    accepted: u64,
}

impl Worker for TableReader {
    fn execute(&mut self, input: &[u8]) -> Answer {
        if let Err(words) = &self.ready {
            return Answer::Wrong(format!("no run to read: {words}"));
        }
        let (name, content) = parts(input);
        let k = FILES.iter().position(|own| own.as_bytes() == name).unwrap_or(0);
        let path = self.scratch.path().join(FILES[k]);
        if let Err(error) = fs::write(&path, content) {
            return Answer::Wrong(format!("the file cannot be written: {error}"));
        }
        self.calls += 1;
        let answer = self.read(FILES[k]);
        match (answer, self.restored(k)) {
            (_, Err(words)) => Answer::Wrong(words),
            (Ok(()), _) => Answer::Accepted,
            (Err(words), _) => Answer::Refused(words),
        }
    }
}

impl TableReader {
    /// Reads what the verbs read of the changed file, or everything; the first error in words.
    fn read(&mut self, changed: &str) -> Result<(), String> {
        let whole = self.calls.is_multiple_of(WHOLE) || changed == "model.toml";
        let opened = RunFolder::open(self.scratch.path());
        let checkpoint = match whole || changed == "checkpoint" {
            true => opened.read_checkpoint(&opened.model_text()).map(drop),
            false => Ok(()),
        };
        let checkpoint = checkpoint.map_err(|error| error.to_string());
        if !whole && changed == "checkpoint" {
            return checkpoint;
        }
        let folder = opened.readable().map_err(|error| error.to_string())?.folder;
        let concerned = READERS.iter().filter(|(files, _)| whole || files.contains(&changed));
        let results: Vec<_> = concerned.map(|(_, read)| read(&folder)).collect();
        std::iter::once(checkpoint).chain(results).collect::<Result<(), String>>()?;
        self.accepted += 1;
        if self.accepted.is_multiple_of(DRAWN) {
            holonom::report::write(&folder).map_err(|error| error.to_string())?;
            draw(&folder)?;
            for format in Format::ALL {
                let to = self.scratch.path().join("out").with_extension(format.name());
                export(&folder, format, &to, Some(3)).map_err(|error| error.to_string())?;
            }
        }
        Ok(())
    }

    /// Writes the changed file as it was, and a checkpoint that was set aside.
    fn restored(&self, changed: usize) -> Result<(), String> {
        let write = |k: usize| fs::write(self.scratch.path().join(FILES[k]), &self.files[k]);
        let again = || -> std::io::Result<()> {
            let refused = self.scratch.path().join("checkpoint.refused");
            if refused.exists() {
                fs::remove_file(refused)?;
                let checkpoint = FILES.iter().position(|name| *name == "checkpoint");
                checkpoint.map_or(Ok(()), write)?;
            }
            write(changed)
        };
        again().map_err(|error| error.to_string())
    }
}

/// Draws chosen columns of the run in every format.
fn draw(folder: &RunFolder) -> Result<(), String> {
    for what in ["positions,energies", "*.x:E", "beams/*"] {
        let request = ChartRequest { what: what.to_owned(), ..ChartRequest::default() };
        let found =
            selected(&[NamedRun { name: "run".to_owned(), folder: folder.clone() }], &request);
        let drawing = match found {
            Ok(found) => found.drawing(&Style::paper(Typeface::Serif)),
            Err(error) => return Err(error.to_string()),
        };
        drawing.pdf()?;
        drawing.png(0.5)?;
        if drawing.svg().contains("NaN") {
            return Err("a place that is no number".into());
        }
    }
    Ok(())
}
