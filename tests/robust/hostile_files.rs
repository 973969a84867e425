//! Files made to confuse the program: it answers in words, in time, and obeys none of them.

#![allow(clippy::unwrap_used)] // a test

use crate::program::command::{PENDULUM, code, folder, holonom};
use std::fs;

#[test]
fn numbers_near_the_smallest_are_simulated_and_drawn() {
    let folder = folder("hostile", "subnormal");
    for (name, text) in [
        ("hang", include_str!("../hostile/subnormal_hang.toml")),
        ("panic", include_str!("../hostile/subnormal_panic.toml")),
    ] {
        let file = format!("{name}.toml");
        fs::write(folder.join(&file), text).unwrap();
        assert_eq!(code(&folder, &["run", &file, "-q", "-o", name]), 0);
        assert!(folder.join(name).join("plots/energy.svg").exists());
    }
}

#[test]
fn control_characters_do_not_reach_the_terminal() {
    let folder = folder("hostile", "control");
    let title = PENDULUM.replacen("name = \"", "name = \"\\u001b[31mred\\u009b\\u202e", 1);
    let name = PENDULUM.replace("\"bob\"", "\"bob\\u001b[2J\"");
    let key = format!("{PENDULUM}\n\"odd\\u001b[31m\" = 1\n");
    let raw = format!("{PENDULUM}\n# raw \u{1b}[31m\n");
    for (text, expected) in [(title, 0), (name, 3), (key, 3), (raw, 3)] {
        fs::write(folder.join("model.toml"), &text).unwrap();
        for verb in ["check", "run"] {
            let output = holonom(&folder, &[verb, "model.toml"]);
            assert_eq!(output.status.code(), Some(expected), "{verb}");
            let said = [output.stdout, output.stderr].map(|b| String::from_utf8(b).unwrap());
            let obeyed = |c: char| (c.is_control() && c != '\n') || c == '\u{202e}';
            assert!(!said.concat().contains(obeyed), "{:?}", said.concat());
        }
        let _ = fs::remove_dir_all(folder.join("model-out"));
    }
}
