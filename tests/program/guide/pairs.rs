//! The pictures of the kinematic pairs are drawings of runs of the models beside them.

use std::fs;

use holonom::model::reference::ReferenceSection;

use super::{source, writes};
use crate::program::command::{folder, holonom, words};

/// Each type of joint has a model and a picture of it, made by `run` and `export --format svg`.
#[test]
fn every_pair_is_shown_as_it_moves() {
    let joint = ReferenceSection::of("joint").unwrap();
    let types = joint.tables.iter().find(|table| table.of == ["type"]).unwrap();
    let pairs: Vec<&str> = types.rows.iter().map(|row| row.name.trim_matches('"')).collect();
    assert_eq!(pairs.len(), 8, "{pairs:?}");
    let folder = folder("guide_pairs", "pictures");
    for pair in pairs {
        let model = source().join(format!("pairs/{pair}.toml"));
        let text = fs::read_to_string(&model).unwrap();
        assert!(text.contains(&format!("type = \"{pair}\"")), "{pair}: {text}");
        let (file, drawing) = (model.display().to_string(), format!("{pair}.svg"));
        let run = ["run", &file, "-o", pair];
        let export = ["export", pair, "--format", "svg", "--frames", "50", "-o", &drawing];
        for arguments in [&run[..], &export[..]] {
            let output = holonom(&folder, arguments);
            assert_eq!(output.status.code(), Some(0), "{}", words(&output));
        }
        let (made, shown) = (folder.join(&drawing), source().join("pairs").join(&drawing));
        let made = fs::read_to_string(made).unwrap();
        if writes() {
            fs::write(&shown, &made).unwrap();
        }
        let shown = fs::read_to_string(shown).unwrap_or_default();
        assert!(shown == made, "{drawing} is out of date: HOLONOM_GUIDE=write cargo test … guide");
    }
}
