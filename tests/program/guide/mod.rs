//! The guide: every page is listed, every link leads somewhere, every model is valid, every command
//! runs and prints what the page shows; the pages of the reference and the pictures of pairs are
//! those of the program.
//!
//! `HOLONOM_GUIDE=write` replaces outputs, pages of the reference and pictures of pairs that are
//! out of date.
#![allow(clippy::unwrap_used)] // tests

mod links;
mod page;
mod pairs;
mod run;

use std::fs;
use std::path::{Path, PathBuf};

use holonom::model::reference::ReferenceSection;
use page::Page;

const REFERENCE: &str = "reference";

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().unwrap()
}

fn source() -> PathBuf {
    root().join("docs/guide/src")
}

/// Whether what is out of date is to be written.
fn writes() -> bool {
    std::env::var("HOLONOM_GUIDE").is_ok_and(|value| value == "write")
}

/// All pages below a folder, by their path from there.
fn pages(folder: &Path) -> Vec<Page> {
    let mut pages = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(&next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "md") {
                pages.push(Page::read(&path));
            }
        }
    }
    pages.sort_by(|a, b| a.path.cmp(&b.path));
    assert!(pages.len() > 2, "{} has {} pages", folder.display(), pages.len());
    pages
}

/// The contents list each page once, and nothing else.
#[test]
fn every_page_is_listed() {
    let summary = source().join("SUMMARY.md");
    let links = links::of(&Page::read(&summary));
    let mut listed: Vec<PathBuf> = links.iter().map(|link| source().join(&link.target)).collect();
    listed.sort();
    let found = pages(&source()).into_iter().map(|page| page.path);
    let found: Vec<PathBuf> = found.filter(|path| *path != summary).collect();
    println!("{} pages", found.len());
    assert_eq!(listed, found);
}

/// Every link of the guide and of README.md leads to a file, and to a heading where it names one.
#[test]
fn every_link_leads_somewhere() {
    let mut pages = pages(&source());
    pages.push(Page::read(&root().join("README.md")));
    let mut count = 0;
    let mut dead = Vec::new();
    for page in &pages {
        for link in links::of(page) {
            count += 1;
            if let Some(reason) = links::fault(page, &link) {
                dead.push(format!("{}:{}: {reason}", page.path.display(), link.line + 1));
            }
        }
    }
    println!("{count} links");
    assert!(count > 20, "{count} links found");
    assert!(dead.is_empty(), "{}", dead.join("\n"));
}

/// Every command of a page runs, in order, in one folder, and prints what stands below it.
#[test]
fn every_command_prints_what_the_page_shows() {
    let mut commands = 0;
    let mut differences = Vec::new();
    for mut page in pages(&source()) {
        if page.path.parent().is_some_and(|folder| folder.ends_with(REFERENCE)) {
            continue; // the examples of the reference are tested where they stand
        }
        let result = run::run(&mut page);
        commands += result.commands;
        differences.extend(result.differences);
        differences.extend(run::pictures(&page));
        if writes() {
            page.write();
        }
    }
    println!("{commands} commands");
    assert!(commands > 20, "{commands} commands found");
    assert!(differences.is_empty(), "{}", differences.join("\n\n"));
}

/// The reference is written from the schema of model files.
#[test]
fn reference_is_that_of_the_program() {
    let folder = source().join(REFERENCE);
    for section in ReferenceSection::names().filter_map(ReferenceSection::of) {
        let path = folder.join(format!("{}.md", section.name));
        let expected = section.markdown();
        if writes() {
            fs::create_dir_all(&folder).unwrap();
            fs::write(&path, &expected).unwrap();
        }
        let found = fs::read_to_string(&path).unwrap_or_default();
        assert!(
            found == expected,
            "{} is out of date: HOLONOM_GUIDE=write cargo test -p holonom -p holonom-cli --test \
             command_line -- guide",
            path.display()
        );
    }
}
