//! A table with commas: a heading with `at`, `twist` and keys of a section, a row for each station.

use crate::types::section::Section;
use crate::types::station::Station;
use toml::{Table, Value};

pub(super) fn rows(text: &str) -> Result<Vec<Station>, String> {
    let mut lines = text
        .lines()
        .enumerate()
        .map(|(k, line)| (k + 1, line.trim().trim_start_matches('\u{feff}')))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let (_, heading) = lines.next().ok_or("the table is empty")?;
    let names: Vec<&str> = heading.split(',').map(str::trim).collect();
    if !names.contains(&"at") {
        return Err("the heading has no column `at`".to_owned());
    }
    lines.map(|(line, row)| station(&names, row).map_err(|e| format!("line {line}: {e}"))).collect()
}

fn station(names: &[&str], row: &str) -> Result<Station, String> {
    let fields: Vec<&str> = row.split(',').map(str::trim).collect();
    if fields.len() != names.len() {
        return Err(format!("{} values for {} columns", fields.len(), names.len()));
    }
    let (mut at, mut twist, mut section) = (0.0, 0.0, Table::new());
    for (name, field) in names.iter().zip(fields) {
        let value: f64 =
            field.parse().map_err(|_| format!("`{}` is no number", field.escape_debug()))?;
        if !value.is_finite() {
            return Err(format!("{name} = {value} is not finite"));
        }
        match *name {
            "at" => at = value,
            "twist" => twist = value,
            name => place(&mut section, name, value)?,
        }
    }
    let section: Section = Value::Table(section).try_into().map_err(|error: toml::de::Error| {
        format!("the heading is that of no section: {}", error.message())
    })?;
    Ok(Station { at, section: Some(section), twist })
}

/// Sets a key of a section; `mass_center_1` and `mass_center_2` are the entries of a list.
fn place(section: &mut Table, name: &str, value: f64) -> Result<(), String> {
    let entry = name.rsplit_once('_').filter(|(key, _)| key.ends_with("_center"));
    let Some((key, index)) = entry else {
        section.insert(name.to_owned(), Value::Float(value));
        return Ok(());
    };
    let list = section.entry(key).or_insert_with(|| Value::Array(vec![Value::Float(0.0); 2]));
    let slot = match index {
        "1" => list.get_mut(0),
        "2" => list.get_mut(1),
        _ => None,
    };
    *slot.ok_or_else(|| format!("`{name}` is no column: write {key}_1 or {key}_2"))? =
        Value::Float(value);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_keys_of_a_section() {
        let text = "# blade\nat, EA, shear_center_2, twist\n0, 3.5, 0.2, 0.1\n\n2, 1e3, -0.2, 0\n";
        let rows = rows(text).unwrap();
        assert_eq!(rows.len(), 2);
        let section = rows[1].section.as_ref().unwrap();
        assert_eq!(
            (rows[1].at, section.ea, section.shear_center),
            (2.0, Some(1e3), Some([0.0, -0.2]))
        );
        assert!((rows[0].twist - 0.1).abs() < 1e-15);
    }

    #[test]
    fn faults_are_named_with_their_line() {
        let cases = [
            ("EA\n3\n", "the heading has no column `at`"),
            ("at, EA\n0, 3\n1, x\n", "line 3: `x` is no number"),
            ("at, EA\n0\n", "line 2: 1 values for 2 columns"),
            ("at, EA\n0, inf\n", "line 2: EA = inf is not finite"),
            ("at, mass_center_3\n0, 1\n", "line 2: `mass_center_3` is no column"),
            ("", "the table is empty"),
        ];
        for (text, expected) in cases {
            let found = rows(text).unwrap_err();
            assert!(found.starts_with(expected), "{found}");
        }
        let found = rows("at, EB\n0, 1\n").unwrap_err();
        assert!(found.contains("line 2") && found.contains("EB"), "{found}");
    }
}
