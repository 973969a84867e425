//! The command line of the program in a folder of its own: most within this process, some as a
//! process. Arguments of an input are divided by `|`.

use super::sample_run::{run_into, small_model};
use super::{Answer, FuzzTarget, Worker, lines};
use crate::fuzz::mutate;
use crate::program;
use crate::scratch::ScratchFolder;
use crate::soak::draw::Draw;
use holonom_cli::{Call, Called};
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Command lines.
#[derive(Clone, Copy, Debug)]
pub struct Arguments;

/// A process that lasts is ended then.
const PATIENCE: Duration = Duration::from_secs(10);
/// Steps after which a run within this process is interrupted.
const STEPS: u64 = 500;
/// One of so many inputs is given to a process: its streams and its exit code are seen.
const PROCESSES: u64 = 1000;
/// Executions after which the folder is made anew.
const RENEWED: u64 = 200;
/// The code of a program that SIGTERM interrupts.
const INTERRUPTED: u8 = 143;
/// The current folder belongs to the process: it is that of one worker at a time.
static CURRENT_FOLDER: Mutex<()> = Mutex::new(());

const MODEL: &str = "\
[model]
name = \"pendulum\"
dimension = 2
gravity = [0.0, -9.81]
[simulation]
step = 0.01
end = 0.1
[[particle]]
name = \"bob\"
mass = 1.0
position = [1.0, 0.0]
[[bar]]
name = \"rod\"
from = \"ground\"
to = \"bob\"
";

impl FuzzTarget for Arguments {
    fn name(&self) -> &'static str {
        "arguments"
    }

    fn executions(&self) -> u64 {
        20_000
    }

    fn seeds(&self) -> Vec<Vec<u8>> {
        lines("tests/corpus/arguments")
    }

    fn mutate(&self, input: &[u8], other: &[u8], draw: &mut Draw) -> Vec<u8> {
        let split = |bytes: &[u8]| -> Vec<Vec<u8>> {
            bytes.split(|byte| *byte == b'|').map(<[u8]>::to_vec).collect()
        };
        let (mut words, others) = (split(input), split(other));
        let at = draw.index(words.len());
        match draw.index(5) {
            0 => drop(words.remove(at)),
            1 => words.insert(at, others[draw.index(others.len())].clone()),
            2 => words.truncate(at + 1),
            _ => words[at] = mutate::bytes(&words[at], &others[draw.index(others.len())], draw),
        }
        words.join(&b'|')
    }

    fn worker(&self) -> Box<dyn Worker> {
        Box::new(Caller { program: program::beside(), run: Vec::new(), scratch: None, calls: 0 })
    }

    fn ready(&self) -> Result<(), String> {
        program::beside().map(drop).ok_or_else(|| program::HELP.to_owned())
    }
}

/// What executes command lines.
struct Caller {
    program: Option<PathBuf>,
    /// The files of a run, with their names.
    run: Vec<(OsString, Vec<u8>)>,
    scratch: Option<ScratchFolder>,
    calls: u64,
}

impl Worker for Caller {
    fn execute(&mut self, input: &[u8]) -> Answer {
        if self.calls.is_multiple_of(RENEWED) {
            match self.renewed() {
                Ok(scratch) => self.scratch = Some(scratch),
                Err(words) => return Answer::Wrong(format!("the folder cannot be made: {words}")),
            }
        }
        let sampled = self.calls.is_multiple_of(PROCESSES);
        self.calls += 1;
        let (Some(scratch), Some(program)) = (&self.scratch, &self.program) else {
            return Answer::Wrong("no program".into());
        };
        let words = arguments(input);
        let answer = match if sampled { None } else { called(&words, scratch.path()) } {
            Some(called) => answer(called),
            None => process(program, &words, scratch.path()),
        };
        match answer {
            Answer::Refused(message) => Answer::Refused(without(message, &words)),
            other => other,
        }
    }
}

impl Caller {
    /// A folder with a model and a run of another.
    fn renewed(&mut self) -> Result<ScratchFolder, String> {
        let words = |error: std::io::Error| error.to_string();
        let scratch = ScratchFolder::new("arguments");
        fs::write(scratch.path().join("pendulum.toml"), MODEL).map_err(words)?;
        let out = scratch.path().join("out");
        if self.run.is_empty() {
            run_into(&out, &small_model()?)?;
            self.run = contents(&out).map_err(words)?;
            return Ok(scratch);
        }
        fs::create_dir_all(&out).map_err(words)?;
        let write = |(name, bytes): &(OsString, Vec<u8>)| fs::write(out.join(name), bytes);
        self.run.iter().try_for_each(write).map_err(words)?;
        Ok(scratch)
    }
}

/// The files of a folder.
fn contents(folder: &Path) -> std::io::Result<Vec<(OsString, Vec<u8>)>> {
    let entries = fs::read_dir(folder)?.flatten().filter(|entry| entry.path().is_file());
    entries.map(|entry| Ok((entry.file_name(), fs::read(entry.path())?))).collect()
}

/// The answer of the program within this process; `None` where it cannot be interrupted.
fn called(words: &[String], folder: &Path) -> Option<Called> {
    let name = std::iter::once("holonom".to_owned());
    let call = match Call::new(name.chain(words.iter().cloned()).map(OsString::from)) {
        Ok(call) if call.is_interruptible() => call,
        Ok(_) => return None,
        Err(called) => return Some(called),
    };
    let one = CURRENT_FOLDER.lock().unwrap_or_else(PoisonError::into_inner);
    let before = std::env::current_dir();
    let called = match std::env::set_current_dir(folder) {
        Ok(()) => call.answer(STEPS),
        Err(error) => {
            Called { code: 1, error: error.to_string().into_bytes(), ..Called::default() }
        }
    };
    drop(before.and_then(std::env::set_current_dir)); // of no importance for what follows
    drop(one);
    Some(called)
}

/// The answer of the program as a process.
fn process(program: &Path, words: &[String], folder: &Path) -> Answer {
    let mut command = Command::new(program);
    command.args(words).current_dir(folder);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
    match command.spawn() {
        Ok(child) => ended(child),
        Err(error) => Answer::Refused(error.to_string()), // a zero byte in a word
    }
}

/// The words of an input that stay within the folder and open no browser.
fn arguments(input: &[u8]) -> Vec<String> {
    let text = String::from_utf8_lossy(input);
    let inside = |word: &&str| !word.contains('/') && !word.contains("..");
    let mut words: Vec<String> = text.split('|').filter(inside).map(str::to_owned).collect();
    if words.iter().any(|word| word == "view") {
        words.push("--print".to_owned());
    }
    words
}

/// The answer of a process.
fn ended(mut child: Child) -> Answer {
    let begin = Instant::now();
    while begin.elapsed() < PATIENCE {
        match child.try_wait() {
            Ok(Some(_)) => return code(child),
            Ok(None) => std::thread::sleep(Duration::from_micros(300)),
            Err(error) => return Answer::Wrong(error.to_string()),
        }
    }
    let _ = child.kill(); // a long run that was asked for
    let _ = child.wait();
    Answer::Refused("a run that lasts".into())
}

fn code(child: Child) -> Answer {
    let output = match child.wait_with_output() {
        Ok(output) => output,
        Err(error) => return Answer::Wrong(error.to_string()),
    };
    match output.status.code().map(u8::try_from) {
        Some(Ok(code)) => answer(Called { code, error: output.stderr, output: output.stdout }),
        _ => Answer::Wrong(format!("the program ends with {}", output.status)),
    }
}

/// A message without the words of its command line, so that messages of one kind have one shape.
fn without(message: String, words: &[String]) -> String {
    let parts = words.iter().flat_map(|word| word.split(['=', ',', ':']).chain([word.as_str()]));
    let mut parts: Vec<&str> = parts.filter(|part| !part.is_empty()).collect();
    parts.sort_by_key(|part| std::cmp::Reverse(part.len()));
    parts.iter().fold(message, |message, part| match part.chars().count() {
        1 => message.replace(&format!("'{part}'"), "'…'"),
        _ => message.replace(part, "…"),
    })
}

/// An exit code is one of the program, with words.
fn answer(Called { code, error, .. }: Called) -> Answer {
    let said = String::from_utf8_lossy(&error);
    match code {
        0 => Answer::Accepted,
        INTERRUPTED => Answer::Refused("a run that lasts".into()),
        1..=3 if said.trim().is_empty() => Answer::Wrong("an error without words".into()),
        1..=3 if said.contains("panicked") => Answer::Wrong(format!("a panic: {said}")),
        1..=3 => Answer::Refused(said.lines().next().unwrap_or_default().to_owned()),
        code => Answer::Wrong(format!("the program ends with {code}: {said}")),
    }
}
