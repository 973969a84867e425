//! A copy of the workspace in which defects are planted.

use super::list::{Edit, Test};
use crate::program::cargo;
use holonom_reliability::text_file;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, Instant};

/// What is built again for each defect is built fast; without any optimization tests take twenty
/// times as long.
const FAST: [&str; 2] = ["opt-level=1", "codegen-units=64"];

/// A test with a defect may never end.
const LONGEST: Duration = Duration::from_secs(900);

/// What a test makes of the sources.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    Passes,
    Fails,
    /// It was ended.
    Endless,
    DoesNotCompile,
    /// No test has this name.
    Missing,
}

/// The sources of the present work tree with an own folder of what is built.
pub(super) struct Copy {
    tree: PathBuf,
    target: PathBuf,
    profile: Vec<String>, // settings of Cargo
    commit: String,
}

impl Copy {
    /// Below `target/mutants`, with all that git knows of, committed or not; what is there already
    /// and has not changed keeps its time, so that it is not built again.
    ///
    /// # Errors
    /// Where git fails.
    pub(super) fn new(root: &Path) -> Result<Self, String> {
        let folder = root.join("target/mutants");
        let crates = std::fs::read_dir(root.join("crates")).map_err(|e| format!("crates: {e}"))?;
        let names = crates.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned());
        let profile =
            names.flat_map(|name| FAST.map(|fast| format!("profile.dev.package.{name}.{fast}")));
        let profile = profile.collect();
        let tree = folder.join("tree");
        std::fs::create_dir_all(&tree).map_err(|error| format!("{}: {error}", tree.display()))?;
        let git = |arguments: &[&str]| {
            let mut git = Command::new("git");
            git.current_dir(root).env("GIT_WORK_TREE", root).args(arguments);
            git
        };
        let head = said(git(&["rev-parse", "--short=8", "HEAD"]).output(), "git rev-parse")?;
        let changed = said(git(&["stash", "create"]).output(), "git stash create")?;
        let commit = if changed.is_empty() { &head } else { &changed };
        for arguments in
            [&["read-tree", "--reset", "-u", commit.as_str()][..], &["checkout-index", "-f", "-a"]]
        {
            let mut git = git(arguments);
            git.current_dir(&tree).env("GIT_WORK_TREE", &tree);
            git.env("GIT_DIR", said_path(root)?).env("GIT_INDEX_FILE", folder.join("index"));
            said(git.output(), "git")?;
        }
        let sources = ["diff", "--name-only", "HEAD", "--", "crates", "tests", "xtask"];
        let after = match said(git(&sources).output(), "git diff")?.is_empty() {
            true => "",
            false => " and what follows",
        };
        Ok(Self { tree, target: folder.join("target"), profile, commit: format!("{head}{after}") })
    }

    /// Of which commit it is.
    pub(super) fn commit(&self) -> &str {
        &self.commit
    }

    /// Plants a defect; the texts as they were.
    ///
    /// # Errors
    /// Where a text does not stand in its file once.
    pub(super) fn plant(&self, edits: &[Edit]) -> Result<Vec<(PathBuf, String)>, String> {
        let mut before: Vec<(PathBuf, String)> = Vec::new();
        for edit in edits {
            let path = self.tree.join(&edit.file);
            let planted = text_file::read(&path).and_then(|text| {
                let planted = edit.planted(&text)?;
                before.push((path.clone(), text));
                text_file::write(&path, &planted)
            });
            if let Err(error) = planted {
                self.restore(&before)?;
                return Err(error);
            }
        }
        Ok(before)
    }

    /// Puts texts back, the last one first.
    ///
    /// # Errors
    /// Where a file cannot be written.
    pub(super) fn restore(&self, before: &[(PathBuf, String)]) -> Result<(), String> {
        before.iter().rev().try_for_each(|(path, text)| text_file::write(path, text))
    }

    /// Runs a test of the copy.
    ///
    /// # Errors
    /// Where Cargo cannot be run.
    pub(super) fn run(&self, test: &Test) -> Result<Outcome, String> {
        let failed = |error| format!("cargo test: {error}");
        let built = self.cargo(test).arg("--no-run").output().map_err(failed)?;
        if !built.status.success() {
            return Ok(Outcome::DoesNotCompile);
        }
        let mut command = self.cargo(test);
        command.args(["--", "--exact", &test.name]);
        let (stdout, ended) = watched(command).map_err(failed)?;
        if ended {
            return Ok(Outcome::Endless);
        }
        Ok(outcome(&stdout))
    }

    fn cargo(&self, test: &Test) -> Command {
        let mut cargo = cargo();
        cargo.current_dir(&self.tree).args(["test", "--quiet"]).args(test.choice());
        self.profile.iter().for_each(|setting| {
            cargo.args(["--config", setting]);
        });
        cargo.env("CARGO_TARGET_DIR", &self.target).env("CARGO_INCREMENTAL", "1");
        cargo.env("INSTA_UPDATE", "no");
        cargo
    }
}

/// What the harness of tests says at its end.
fn outcome(text: &str) -> Outcome {
    let said = |what: &str| text.contains(&format!("test result: {what}"));
    match () {
        () if said("FAILED") => Outcome::Fails,
        () if said("ok. 1 passed") => Outcome::Passes,
        () if said("ok. 0 passed") => Outcome::Missing,
        () => Outcome::Fails, // the process was killed
    }
}

/// The output of a command that may be ended, and whether it was.
fn watched(mut command: Command) -> std::io::Result<(String, bool)> {
    use std::io::Read;
    use std::process::Stdio;
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn()?;
    let mut stdout = child.stdout.take().expect("piped");
    let reader = std::thread::spawn(move || {
        let mut text = String::new();
        stdout.read_to_string(&mut text).map(|_| text)
    });
    let begin = Instant::now();
    while child.try_wait()?.is_none() {
        if begin.elapsed() > LONGEST {
            child.kill()?;
            child.wait()?;
            return Ok((String::new(), true));
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    let text = reader.join().unwrap_or_else(|_| Ok(String::new()))?;
    Ok((text, false))
}

/// The folder of git, which may stand elsewhere.
fn said_path(root: &Path) -> Result<String, String> {
    let mut git = Command::new("git");
    git.current_dir(root).args(["rev-parse", "--absolute-git-dir"]);
    said(git.output(), "git rev-parse")
}

/// The standard output of a command that succeeds.
fn said(output: std::io::Result<Output>, name: &str) -> Result<String, String> {
    let output = output.map_err(|error| format!("{name}: {error}"))?;
    match output.status.success() {
        true => Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned()),
        false => Err(format!("{name}: {}", String::from_utf8_lossy(&output.stderr).trim())),
    }
}

#[cfg(test)]
mod tests {
    use super::{Outcome, outcome};

    #[test]
    fn outcomes_are_read_off_the_last_lines() {
        let text = |what: &str| outcome(&format!("\nrunning 1 test\n.\ntest result: {what}; 0"));
        assert_eq!(text("ok. 1 passed"), Outcome::Passes);
        assert_eq!(text("FAILED. 0 passed"), Outcome::Fails);
        assert_eq!(text("ok. 0 passed"), Outcome::Missing);
        assert_eq!(outcome("running 1 test"), Outcome::Fails);
    }
}
