//! Where unsafe code may be.

use std::path::Path;

/// Files of a folder that hold the word.
fn unsafe_files(crate_name: &str, folder: &Path, found: &mut Vec<String>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            unsafe_files(crate_name, &path, found);
        } else if path.extension().is_some_and(|own| own == "rs") {
            let text = std::fs::read_to_string(&path).unwrap();
            if text.lines().any(|line| line.contains("unsafe ") && !line.trim().starts_with("//")) {
                let name = path.file_name().unwrap().to_string_lossy();
                found.push(format!("{crate_name}/{name}"));
            }
        }
    }
}

#[test]
fn unsafe_code_is_in_few_modules() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut found = Vec::new();
    for entry in std::fs::read_dir(crates).unwrap() {
        let folder = entry.unwrap().path();
        let name = folder.file_name().unwrap().to_string_lossy().into_owned();
        if name != "vi-testkit" {
            unsafe_files(&name, &folder.join("src"), &mut found); // its allocator counts
        }
    }
    found.sort();
    // that of Python calls a C function by its address
    let modules = ["fmi/fmi2.rs", "fmi/fmi3.rs", "fmi/pointers.rs", "python/law.rs"];
    assert_eq!(found, modules.map(|own| format!("holonom-{own}")));
}
