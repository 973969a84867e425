//! Links of a page, and where they lead.

use super::page::Page;

pub(super) struct Link {
    pub(super) target: String,
    pub(super) line: usize,
}

/// Links outside of code, pictures too.
pub(super) fn of(page: &Page) -> Vec<Link> {
    let blocks = page.blocks();
    let in_block = |line: usize| blocks.iter().any(|block| block.lines.contains(&line));
    let mut links = Vec::new();
    for (line, text) in page.lines.iter().enumerate().filter(|(line, _)| !in_block(*line)) {
        // every second part is code
        let words: String = text.split('`').step_by(2).collect::<Vec<_>>().join("`");
        for (begin, end) in [("](", ')'), ("src=\"", '"')] {
            for rest in words.split(begin).skip(1) {
                let target = rest.split(end).next().unwrap_or_default().to_owned();
                links.push(Link { target, line });
            }
        }
    }
    links
}

/// Why a link leads nowhere.
pub(super) fn fault(page: &Page, link: &Link) -> Option<String> {
    if link.target.starts_with("https://") {
        return None;
    }
    let (file, anchor) = link.target.split_once('#').unwrap_or((&link.target, ""));
    let folder = page.path.parent().unwrap();
    let path = if file.is_empty() { page.path.clone() } else { folder.join(file) };
    if !path.exists() {
        return Some(format!("{file} does not exist"));
    }
    if anchor.is_empty() {
        return None;
    }
    let target = Page::read(&path);
    let heading = |line: &&String| line.starts_with('#');
    let mut names = target.lines.iter().filter(heading).map(|line| slug(line));
    (!names.any(|name| name == anchor)).then(|| format!("{file} has no heading #{anchor}"))
}

/// The anchor of a heading.
fn slug(heading: &str) -> String {
    let text = heading.trim_start_matches('#').trim().to_lowercase();
    let kept = text.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

#[test]
fn a_dead_link_is_found() {
    let page = Page::read(&super::source().join("SUMMARY.md"));
    let to = |target: &str| fault(&page, &Link { target: target.into(), line: 0 });
    assert_eq!(to("limits.md"), None);
    assert!(to("missing.md").is_some() && to("limits.md#missing").is_some());
    assert_eq!(slug("## `[[joint]]`: a pair"), "joint-a-pair");
}
