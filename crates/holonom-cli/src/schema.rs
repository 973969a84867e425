//! `holonom schema`: the keys of the model file.

use holonom::model::nearest;
use holonom::model::reference::ReferenceSection;

use crate::arguments::SchemaArguments;
use crate::failure::Failure;
use crate::stdout;

pub(crate) fn schema(arguments: &SchemaArguments) -> Result<(), Failure> {
    let Some(name) = &arguments.section else {
        return stdout::json(&holonom::Model::schema());
    };
    match ReferenceSection::of(name) {
        Some(section) => stdout::bytes(section.text().as_bytes()),
        None => Err(unknown(name)),
    }
}

fn unknown(name: &str) -> Failure {
    let inside = ReferenceSection::names()
        .filter_map(ReferenceSection::of)
        .find(|section| has_table(section, name));
    let help = match (inside, nearest(name, ReferenceSection::names())) {
        (Some(section), _) => {
            format!("it is a part of {}: `holonom schema {}`", section.heading(), section.name)
        }
        (None, Some(best)) => format!("did you mean `{best}`?"),
        (None, None) => {
            format!(
                "the sections are: {}",
                ReferenceSection::names().collect::<Vec<_>>().join(", ")
            )
        }
    };
    Failure::Usage { message: format!("model files have no section `{name}`"), help }
}

/// Whether a key of the section is a table of its own.
fn has_table(section: &ReferenceSection, key: &str) -> bool {
    let mut keys = section.tables.iter().flat_map(|table| &table.of);
    keys.any(|path| path.rsplit('.').next() == Some(key))
}
