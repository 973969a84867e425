//! The command line of the program, as a process in a folder of its own. Arguments of an input are divided by `|`.

use super::sample_run::{Scratch, run_into};
use super::{Answer, Target, Worker, lines};
use crate::fuzz::mutate;
use crate::soak::draw::Draw;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Command lines.
#[derive(Clone, Copy, Debug)]
pub struct Arguments;

/// A run that is asked for may last; it is ended then.
const PATIENCE: Duration = Duration::from_secs(10);
/// Executions after which the folder is made anew.
const RENEWED: u64 = 200;

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

/// The program beside this one.
fn program() -> Option<PathBuf> {
    let own = std::env::current_exe().ok()?;
    let name = format!("holonom{}", std::env::consts::EXE_SUFFIX);
    own.ancestors().skip(1).take(2).map(|folder| folder.join(&name)).find(|path| path.is_file())
}

impl Target for Arguments {
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
        Box::new(Caller { program: program(), scratch: None, calls: 0 })
    }

    fn ready(&self) -> Result<(), String> {
        let help = "no program beside this one: cargo build --release -p holonom-cli";
        program().map(drop).ok_or_else(|| help.to_owned())
    }
}

struct Caller {
    program: Option<PathBuf>,
    scratch: Option<Scratch>,
    calls: u64,
}

impl Worker for Caller {
    fn execute(&mut self, input: &[u8]) -> Answer {
        let Some(program) = self.program.clone() else { return Answer::Wrong("no program".into()) };
        if self.calls.is_multiple_of(RENEWED) {
            let scratch = Scratch::new("arguments");
            let ready = std::fs::write(scratch.path().join("pendulum.toml"), MODEL);
            if ready.is_err() || run_into(&scratch.path().join("out")).is_err() {
                return Answer::Wrong("the folder cannot be made".into());
            }
            self.scratch = Some(scratch);
        }
        self.calls += 1;
        let Some(scratch) = &self.scratch else { return Answer::Wrong("no folder".into()) };
        let words = arguments(input);
        let mut command = Command::new(program);
        command.args(&words).current_dir(scratch.path());
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        match command.spawn() {
            Ok(child) => ended(child),
            Err(error) => Answer::Refused(error.to_string()), // a zero byte in a word
        }
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
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    match output.status.code() {
        Some(0) => Answer::Accepted,
        Some(1..=3) if said.trim().is_empty() => Answer::Wrong("an error without words".into()),
        Some(1..=3) if said.contains("panicked") => Answer::Wrong(format!("a panic: {said}")),
        Some(1..=3) => Answer::Refused(said.lines().next().unwrap_or_default().to_owned()),
        code => Answer::Wrong(format!("the program ends with {code:?}: {said}")),
    }
}
