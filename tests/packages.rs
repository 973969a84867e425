//! Crates that are published are whole: what crates.io asks for is stated, and no file from outside
//! the package is compiled.

use std::path::{Path, PathBuf};

/// The folders of the crates that are published.
fn published() -> Vec<PathBuf> {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join("crates");
    let folders = std::fs::read_dir(crates).unwrap().map(|entry| entry.unwrap().path());
    folders.filter(|folder| !read(&folder.join("Cargo.toml")).contains("publish = false")).collect()
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn packages_state_what_a_registry_asks_for() {
    let published = published();
    println!("{} crates", published.len());
    assert!(published.len() >= 16);
    for folder in &published {
        let name = folder.file_name().unwrap().to_string_lossy();
        let manifest = read(&folder.join("Cargo.toml"));
        let keys = [
            "description",
            "version",
            "rust-version",
            "license",
            "keywords",
            "categories",
            "readme",
        ];
        for key in keys {
            let stated = manifest.lines().any(|line| line.starts_with(key));
            assert!(stated, "{name}: no {key}");
        }
        assert!(read(&folder.join("README.md")).starts_with(&format!("# {name}\n")), "{name}");
        for license in ["LICENSE-MIT", "LICENSE-APACHE"] {
            assert!(read(&folder.join(license)).contains("Licen"), "{name}: {license}");
        }
    }
}

/// A path in `include_str!` or `include_bytes!` begins in the folder of its file; above `src` there
/// is the folder of the package.
#[test]
fn packages_include_their_own_files_alone() {
    let mut included = 0;
    for folder in published() {
        visit(&folder.join("src"), 1, &mut included);
    }
    println!("{included} places");
    assert!(included > 5);
}

fn visit(folder: &Path, depth: usize, included: &mut usize) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            visit(&path, depth + 1, included);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let text = read(&path);
            let starts = ["include_str!(", "include_bytes!("].map(|mark| text.match_indices(mark));
            for (at, _) in starts.into_iter().flatten() {
                let (_, quoted) = text[at..].split_once('"').unwrap();
                let up = quoted.split('/').take_while(|part| *part == "..").count();
                assert!(up <= depth, "{}: {}", path.display(), quoted.lines().next().unwrap());
                *included += 1;
            }
        }
    }
}
