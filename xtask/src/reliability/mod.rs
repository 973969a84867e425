//! What the three harnesses of reliability share, and `cargo xtask reliability`, which writes
//! `RELIABILITY.md`.
//!
//! | file | concept |
//! |---|---|
//! | [`stored`], `page` | the numbers of the harnesses, and the page from them |
//! | [`part`] | options of all harnesses |
//! | [`mutants`] | defects made on purpose, which the harnesses must find |
//! | [`guard`] | panics as data |
//! | [`shape`] | kinds of messages |

pub mod guard;
pub mod mutants;
mod page;
pub mod part;
pub mod shape;
pub mod stored;

pub use page::FuzzTallies;

use crate::interrupt;
use crate::soak::tally::Tally;
use crate::text_file;
use std::path::Path;
use stored::Stored;

/// Writes the page: `--soak FILE… --fuzz FILE… --interrupt FILE…`, the parts of one run each.
///
/// # Errors
/// What cannot be understood, read or written, in words.
pub fn run(options: &[&str]) -> Result<(), String> {
    const HELP: &str = "write --soak FILE… --fuzz FILE… --interrupt FILE…";
    let place = |word: &str| options.iter().position(|option| *option == word).ok_or(HELP);
    let (first, second, third) = (place("--soak")?, place("--fuzz")?, place("--interrupt")?);
    if first != 0 || second > third {
        return Err(HELP.to_owned());
    }
    let (soak, fuzz) = (&options[1..second], &options[second + 1..third]);
    let interrupt = &options[third + 1..];
    let soak = Stored::read(soak, &mut |all: &mut Tally, part| all.add(part))?;
    let fuzz = Stored::read(fuzz, &mut |all: &mut FuzzTallies, part: FuzzTallies| {
        part.into_iter().for_each(|(name, tally)| all.entry(name).or_default().add(tally));
    })?;
    let interrupt = Stored::read(interrupt, &mut |all, part| interrupt::tally::add(all, part))?;
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().ok_or("no root")?;
    let path = root.join("RELIABILITY.md");
    text_file::write(&path, &page::page(&soak, &fuzz, &interrupt))
}
