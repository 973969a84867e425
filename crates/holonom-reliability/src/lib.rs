//! The harnesses of reliability, which try to make the program fail, and the page of what they
//! found. `cargo xtask` runs them; not published.
//!
//! | module | concept |
//! |---|---|
//! | [`soak`] | random valid mechanisms, assembled, stepped and judged |
//! | [`fuzz`] | mutated inputs for everything that reads |
//! | [`interrupt`] | runs that are disturbed, and continued |
//! | [`stored`], `page` | the numbers of the harnesses, and `RELIABILITY.md` from them: [`run`] |
//! | [`part`] | options of all harnesses |
//! | [`mutants`] | defects made on purpose, which the harnesses must find |
//! | [`guard`] | panics as data |
//! | [`shape`] | kinds of messages |
//! | `program` | the program `holonom` as a process, and the repository |
//! | `scratch`, [`text_file`] | temporary folders; text files with errors in words |

pub mod fuzz;
pub mod guard;
pub mod interrupt;
pub mod mutants;
mod page;
pub mod part;
mod program;
mod scratch;
pub mod shape;
pub mod soak;
pub mod stored;
pub mod text_file;

pub use page::FuzzTallies;

use soak::tally::SoakTally;
use stored::Stored;

/// Writes the page: `--soak FILE… --fuzz FILE… --interrupt FILE…`, the parts of one run each, and
/// `--touching FILE…`, where bodies that touch were tried by themselves.
///
/// # Errors
/// What cannot be understood, read or written, in words.
pub fn run(options: &[&str]) -> Result<(), String> {
    const HELP: &str = "write --soak FILE… --fuzz FILE… --interrupt FILE… [--touching FILE…]";
    const WORDS: [&str; 4] = ["--soak", "--fuzz", "--interrupt", "--touching"];
    let mut files: [Vec<&str>; 4] = Default::default();
    let mut last = None;
    for option in options {
        match (WORDS.iter().position(|word| word == option), last) {
            (Some(word), _) => last = Some(word),
            (None, Some(word)) => files[word].push(option),
            (None, None) => return Err(HELP.to_owned()),
        }
    }
    if files[..3].iter().any(Vec::is_empty) {
        return Err(HELP.to_owned());
    }
    let [soak, fuzz, interrupt, touching] = &files;
    let mut add = |all: &mut SoakTally, part| all.add(part);
    let soak = Stored::read(soak, &mut add)?;
    let touching = if touching.is_empty() { None } else { Some(Stored::read(touching, &mut add)?) };
    let fuzz = Stored::read(fuzz, &mut |all: &mut FuzzTallies, part: FuzzTallies| {
        part.into_iter().for_each(|(name, tally)| all.entry(name).or_default().add(tally));
    })?;
    let interrupt = Stored::read(interrupt, &mut |all, part| interrupt::tally::add(all, part))?;
    let path = program::repository().join("RELIABILITY.md");
    text_file::write(&path, &page::page(&soak, touching.as_ref(), &fuzz, &interrupt))
}
