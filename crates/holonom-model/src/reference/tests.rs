use super::*;
use crate::ModelError;

/// The examples of all sections are one valid model.
#[test]
fn examples_form_a_valid_model() {
    let text: String =
        ReferenceSection::names().filter_map(ReferenceSection::of).map(|s| s.example).collect();
    let model = Model::from_toml(&text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    assert_eq!(
        ReferenceSection::names().count(),
        LISTS.len() + TABLES.len() + 1,
        "a section without page"
    );
    for (name, example) in EXAMPLES {
        assert!(example.contains(&format!("[{name}]")), "{name} is not in its own example");
    }
    assert!(!model.sensors.is_empty());
}

/// A value that the page states as default changes nothing when it is written into the file.
#[test]
fn defaults_are_those_of_the_model() {
    let plain = "model = { name = \"m\", dimension = 2 }\n[[particle]]\nname = \"p\"\nmass = 1.0\n\
                 position = [0.0, 0.0]\n[simulation]\nstep = 0.1\nend = 1.0\n";
    let expected = Model::from_toml(plain).unwrap();
    let simulation = ReferenceSection::of("simulation").unwrap();
    let mut tried = 0;
    for row in &simulation.tables[0].rows {
        if let Presence::Default(value) = &row.presence {
            let found = Model::from_toml(&format!("{plain}{} = {value}\n", row.name));
            assert_eq!(found.as_ref(), Ok(&expected), "{} = {value}", row.name);
            tried += 1;
        } else {
            assert_eq!(row.presence, Presence::Required, "{} states no default", row.name);
        }
    }
    assert_eq!(tried + 2, simulation.tables[0].rows.len(), "step and end have none");
}

/// Every key and every word of every section has a type and a meaning.
#[test]
fn nothing_is_left_without_a_meaning() {
    for section in ReferenceSection::names().filter_map(ReferenceSection::of) {
        for table in &section.tables {
            assert!(!table.rows.is_empty(), "{}: {:?} is empty", section.name, table.of);
            for row in &table.rows {
                let place = format!("{} {:?} {}", section.name, table.of, row.name);
                assert!(row.kind.as_deref() != Some(""), "{place} has no type");
                assert!(row.kind.is_some() || !row.about.is_empty(), "{place} has no meaning");
            }
        }
    }
}

#[test]
fn page_of_loads() {
    insta::assert_snapshot!("load_text", ReferenceSection::of("load").unwrap().text());
    insta::assert_snapshot!("load_markdown", ReferenceSection::of("load").unwrap().markdown());
    assert_eq!(ReferenceSection::of("loads"), None);
}

/// A value that is no table, where one belongs, is answered with how it is written; entries of a
/// list are never taken for keys in their order.
#[test]
fn what_is_no_table_is_answered_with_one() {
    let foreign = ["struct", "enum", "variant", "map,", "sequence", "floating point"];
    let mut tried = 0;
    for section in ReferenceSection::names().filter_map(ReferenceSection::of) {
        let mut tag = String::new();
        for row in &section.tables[0].rows {
            if row.name.starts_with("type = ") {
                tag = format!("{}\n", row.name);
            }
            if row.kind.as_deref() != Some("table") {
                continue;
            }
            for value in ["3.0", "2", "\"word\"", "true", "[1.0, 2.0]", "[\"arc\", 1.0, 2.0]"] {
                let text = format!("{}\n{tag}{} = {value}\n", section.heading(), row.name);
                let ModelError::Invalid(all) = Model::from_toml(&text).unwrap_err() else {
                    panic!("{text}")
                };
                let said = all.iter().find(|own| own.message.ends_with("expected a table"));
                let said = said.unwrap_or_else(|| panic!("{text}{all:#?}"));
                assert!(!foreign.iter().any(|word| said.message.contains(word)), "{text}{said}");
                let help = said.help.as_deref().unwrap_or_default();
                let form = help.strip_prefix(&format!("write `{} = {{ ", row.name));
                assert!(form.is_some_and(|form| !form.starts_with('…')), "{text}{said}: {help}");
                tried += 1;
            }
        }
    }
    println!("{tried} values");
    assert!(tried > 100, "{tried}");
}

/// The same of tables within tables, and of entries of lists of tables.
#[test]
fn what_is_no_table_within_one_is_answered_with_one() {
    for (text, key, form) in [
        (
            "[[beam]]\nsection = { material = [1.0, 2.0] }\n",
            "beam[0].section.material",
            "material = { ",
        ),
        ("[[joint]]\nfriction = { model = 3.0 }\n", "joint[0].friction.model", "model = { type"),
        ("[[body]]\ncollision = [[1.0, 2.0]]\n", "body[0].collision[0]", "collision = [{ type"),
    ] {
        let ModelError::Invalid(all) = Model::from_toml(text).unwrap_err() else {
            panic!("{text}")
        };
        let said = all.iter().find(|own| own.message.ends_with("expected a table"));
        let said = said.unwrap_or_else(|| panic!("{text}{all:#?}"));
        let help = said.help.as_deref().unwrap_or_default();
        println!("{said}: {help}");
        assert!(said.key == key && help.starts_with(&format!("write `{form}")), "{said}: {help}");
    }
}

/// A table where a list of tables belongs, of a part without a name.
#[test]
fn a_list_of_tables_is_said_to_be_one() {
    let text = "[[body]]\ncollision = { type = \"box\" }\n";
    let ModelError::Invalid(all) = Model::from_toml(text).unwrap_err() else { panic!("{text}") };
    let said = all.iter().find(|own| own.key == "body[0].collision").unwrap();
    assert_eq!(said.message, "invalid type: table, expected a list of tables");
    assert_eq!(said.help.as_deref(), Some("write a list such as [{ … }, { … }]"));
}
