//! `holonom view`: the page of a finished run in the browser.

use holonom::report;

use crate::arguments::ViewArguments;
use crate::failure::Failure;
use crate::folder::folder;
use crate::{stderr, stdout};

pub(crate) fn view(arguments: &ViewArguments) -> Result<(), Failure> {
    let folder = folder(&arguments.dir)?;
    let page = folder.path().join("report.html");
    if !page.is_file() {
        report::write(&folder)?;
    }
    let page = page.canonicalize().unwrap_or(page);
    let time = arguments.at.map_or_else(String::new, |t| format!("#t={t}"));
    let address = format!("file://{}{time}", percent_encoded(&page.to_string_lossy()));
    if arguments.print {
        return stdout::bytes(format!("{address}\n").as_bytes());
    }
    if open::that(&address).is_err() {
        stderr::line(&format!("no browser could be started: open {address}"));
    }
    Ok(())
}

/// A path as a part of an address.
fn percent_encoded(path: &str) -> String {
    let plain = |b: u8| b.is_ascii_alphanumeric() || b"/-._~:".contains(&b);
    let encode = |b: u8| if plain(b) { char::from(b).to_string() } else { format!("%{b:02X}") };
    path.bytes().map(encode).collect()
}
