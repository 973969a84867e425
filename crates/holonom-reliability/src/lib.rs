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

use page::PageNumbers;
use soak::tally::SoakTally;
use stored::Stored;

/// Writes the page: `--soak FILE… --touching FILE… --fuzz FILE… --interrupt FILE…`, the parts of
/// one run each. The section of what is not named stays as it is.
///
/// # Errors
/// What cannot be understood, read or written, in words.
pub fn run(options: &[&str]) -> Result<(), String> {
    const WORDS: [&str; 4] = ["--soak", "--touching", "--fuzz", "--interrupt"];
    let mut files: [Vec<&str>; 4] = Default::default();
    let mut last = None;
    for option in options {
        match (WORDS.iter().position(|word| word == option), last) {
            (Some(word), _) => last = Some(word),
            (None, Some(word)) => files[word].push(option),
            (None, None) => {
                return Err(format!("write {} FILE…, or some of them", WORDS.join(" FILE… ")));
            }
        }
    }
    let [soak, touching, fuzz, interrupt] = &files;
    let mut add = |all: &mut SoakTally, part| all.add(part);
    let numbers = PageNumbers {
        soak: Stored::read_some(soak, &mut add)?,
        touching: Stored::read_some(touching, &mut add)?,
        fuzz: Stored::read_some(fuzz, &mut |all: &mut FuzzTallies, part: FuzzTallies| {
            part.into_iter().for_each(|(name, tally)| all.entry(name).or_default().add(tally));
        })?,
        interrupt: Stored::read_some(interrupt, &mut |all, part| interrupt::tally::add(all, part))?,
    };
    let path = program::repository().join("RELIABILITY.md");
    let before = text_file::read(&path)?;
    text_file::write(&path, &page::page(&before, &numbers))
}
