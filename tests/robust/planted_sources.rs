//! The list of defects of the sources, `xtask/mutants.toml`, is of the sources as they are: each
//! text that is changed stands in its file once, and the test that names the defect exists.

use std::collections::BTreeSet;
use std::path::Path;
use xtask::mutants::list;

#[test]
fn defects_of_the_sources_can_be_planted() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let all = list::all(&root).unwrap();
    for mutant in &all {
        for edit in &mutant.edits {
            let text = std::fs::read_to_string(root.join(&edit.file)).unwrap();
            let planted = edit.planted(&text).unwrap_or_else(|e| panic!("{}: {e}", mutant.name));
            assert_ne!(planted, text, "{}", mutant.name);
        }
        assert!(mutant.test.exists(&root).unwrap(), "{}: no {:?}", mutant.name, mutant.test);
    }
    let names: BTreeSet<&str> = all.iter().map(|mutant| mutant.name.as_str()).collect();
    assert_eq!(names.len(), all.len(), "two defects have one name");
    println!("{} defects", all.len());
}
