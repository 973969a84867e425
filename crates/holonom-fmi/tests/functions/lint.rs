//! Where unsafe code may be.

use std::path::Path;

/// Files of a folder that hold the word.
fn unsafe_files(folder: &Path, found: &mut Vec<String>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            unsafe_files(&path, found);
        } else if path.extension().is_some_and(|own| own == "rs") {
            let text = std::fs::read_to_string(&path).unwrap();
            if text.lines().any(|line| line.contains("unsafe ") && !line.trim().starts_with("//")) {
                found.push(path.file_name().unwrap().to_string_lossy().into_owned());
            }
        }
    }
}

#[test]
fn unsafe_code_is_in_three_modules_of_the_c_interface() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut found = Vec::new();
    for entry in std::fs::read_dir(crates).unwrap() {
        let folder = entry.unwrap().path();
        if !folder.ends_with("vi-testkit") {
            unsafe_files(&folder.join("src"), &mut found); // the allocator of tests counts
        }
    }
    found.sort();
    assert_eq!(found, ["fmi2.rs", "fmi3.rs", "pointers.rs"]);
}
