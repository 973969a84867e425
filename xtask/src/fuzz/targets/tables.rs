//! The files of a run, one of them changed, as the verbs read them. The first line of an input is the name of the file.

use super::sample_run::{Scratch, run_into};
use super::{Answer, Target, Worker};
use crate::fuzz::mutate;
use crate::soak::draw::Draw;
use holonom::RunFolder;
use holonom::export::{Format, export};
use holonom::report::selected::{Request, selected};
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
/// One of so many inputs is drawn and exported.
const DRAWN: usize = 64;

impl Target for Tables {
    fn name(&self) -> &'static str {
        "tables"
    }

    fn executions(&self) -> u64 {
        200_000
    }

    fn seeds(&self) -> Vec<Vec<u8>> {
        let scratch = Scratch::new("seeds");
        if run_into(scratch.path()).is_err() {
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
        let scratch = Scratch::new("tables");
        let ready = run_into(scratch.path());
        Box::new(Reader { scratch, ready })
    }
}

/// The name and the content.
fn parts(input: &[u8]) -> (&[u8], &[u8]) {
    let line = input.iter().position(|byte| *byte == b'\n').unwrap_or(input.len());
    (&input[..line], input.get(line + 1..).unwrap_or_default())
}

struct Reader {
    scratch: Scratch,
    ready: Result<(), String>,
}

impl Worker for Reader {
    fn execute(&mut self, input: &[u8]) -> Answer {
        if let Err(words) = &self.ready {
            return Answer::Wrong(format!("no run to read: {words}"));
        }
        let (name, content) = parts(input);
        let name = FILES.iter().find(|own| own.as_bytes() == name).unwrap_or(&FILES[0]);
        let path = self.scratch.path().join(name);
        let Ok(before) = fs::read(&path) else { return Answer::Wrong("no file".into()) };
        if fs::write(&path, content).is_err() {
            return Answer::Wrong("the file cannot be written".into());
        }
        let answer = self.read(input.len().is_multiple_of(DRAWN));
        let restored = fs::write(&path, before);
        match (answer, restored) {
            (_, Err(error)) => Answer::Wrong(error.to_string()),
            (Ok(()), _) => Answer::Accepted,
            (Err(words), _) => Answer::Refused(words),
        }
    }
}

impl Reader {
    /// Reads everything that the verbs read; the first error in words.
    fn read(&self, drawn: bool) -> Result<(), String> {
        let opened = RunFolder::open(self.scratch.path());
        let checkpoint = opened.read_checkpoint(&opened.model_text());
        let (folder, _) = opened.readable().map_err(|error| error.to_string())?;
        let say = |error: &dyn std::error::Error| error.to_string();
        let results = [
            checkpoint.map(drop).map_err(|error| say(&error)),
            folder.read_trajectory(4).map(drop).map_err(|error| say(&error)),
            folder.read_sensors().map(drop).map_err(|error| say(&error)),
            folder.read_energies().map(drop).map_err(|error| say(&error)),
            folder.frames(1000, 10).map_err(|error| say(&error)).and_then(|frames| {
                folder.bending_moments(&frames).map(drop).map_err(|error| say(&error))
            }),
        ];
        let refused = self.scratch.path().join("checkpoint.refused");
        if refused.exists() {
            let _ = fs::rename(&refused, self.scratch.path().join("checkpoint")); // as before
        }
        results.into_iter().collect::<Result<Vec<()>, String>>()?;
        if drawn {
            holonom::report::write(&folder).map_err(|error| say(&error))?;
            draw(&folder)?;
            for format in Format::ALL {
                let to = self.scratch.path().join("out").with_extension(format.name());
                export(&folder, format, &to, Some(3)).map_err(|error| say(&error))?;
            }
        }
        Ok(())
    }
}

/// Draws chosen columns of the run in every format.
fn draw(folder: &RunFolder) -> Result<(), String> {
    for what in ["positions,energies", "*.x:E", "beams/*"] {
        let request = Request { what: what.to_owned(), ..Request::default() };
        let found = selected(&[("run".to_owned(), folder.clone())], &request);
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
