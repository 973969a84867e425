//! Whether `VERIFICATION.md` is of the integrators as they are.

use holonom_reliability::text_file;
use std::path::Path;
use std::process::Command;

/// What the numbers of the page depend on.
const INTEGRATORS: [&str; 10] = [
    "crates/vi-core/src",
    "crates/vi-constraints/src",
    "crates/vi-rigid/src",
    "crates/vi-multibody/src",
    "crates/vi-beam/src",
    "crates/vi-statics/src",
    "crates/vi-control/src",
    "crates/vi-emscheme/src",
    "crates/vi-verify/src",
    "xtask/src/verify",
];

/// A sentence: the page is of the present integrators, or of which commit and what has changed
/// since.
///
/// # Errors
/// When there is no page, or it names no commit.
pub(super) fn age(root: &Path) -> Result<String, String> {
    let path = root.join("VERIFICATION.md");
    let page = text_file::read(&path)?;
    let commit = named(&page).ok_or("VERIFICATION.md names no commit: run `cargo xtask verify`")?;
    let mut diff = Command::new("git");
    diff.current_dir(root).args(["diff", "--name-only", commit, "HEAD", "--"]).args(INTEGRATORS);
    Ok(match diff.output() {
        Ok(output) if output.status.success() => {
            let files = String::from_utf8_lossy(&output.stdout);
            let changed: Vec<&str> = files.lines().collect();
            match changed.as_slice() {
                [] => format!(
                    "VERIFICATION.md is of commit {commit}: the integrators have not changed since"
                ),
                [first, ..] => format!(
                    "VERIFICATION.md is of commit {commit}; {} files of the integrators or the verifier have changed since \
                     ({first}, …): run `cargo xtask verify`",
                    changed.len()
                ),
            }
        }
        _ => format!(
            "VERIFICATION.md is of commit {commit}, which this clone does not hold: its age is not known"
        ),
    })
}

/// The commit that a page names.
fn named(page: &str) -> Option<&str> {
    let (_, rest) = page.split_once("at commit ")?;
    let commit = rest.split(|c: char| !c.is_ascii_hexdigit()).next()?;
    (commit.len() >= 7).then_some(commit)
}

#[cfg(test)]
mod tests {
    use super::named;

    #[test]
    fn the_commit_is_read_off_the_page() {
        let page = "Written by `cargo xtask verify` on 2026-11-20 at commit 1877b7d in 19 min.";
        assert_eq!(named(page), Some("1877b7d"));
        assert_eq!(named("at commit unknown in 3 min"), None);
        assert_eq!(named(""), None);
    }
}
