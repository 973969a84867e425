//! The JSON schema of model files: that of the types, with what is resolved before they are read.

use schemars::schema_for;

use super::Model;
use crate::text::include;
use crate::text::parameters;
use crate::text::sections::PARAMETERS;

/// The schema.
pub(super) fn of_models() -> serde_json::Value {
    let mut schema = schema_for!(Model).to_value();
    without_null(&mut schema);
    schema["title"] = "holonom model".into();
    schema["properties"][PARAMETERS] = parameters::schema();
    schema["properties"][include::KEY] = include::schema();
    schema
}

/// TOML has no null: what may be absent is not required, that is all.
fn without_null(schema: &mut serde_json::Value) {
    use serde_json::Value;
    match schema {
        Value::Object(map) => {
            if let Some(Value::Array(types)) = map.get_mut("type") {
                types.retain(|t| t != "null");
                if let [only] = types.as_slice() {
                    let only = only.clone();
                    map.insert("type".into(), only);
                }
            }
            if map.get("default").is_some_and(Value::is_null) {
                map.remove("default");
            }
            if let Some(Value::Array(options)) = map.get_mut("anyOf") {
                options.retain(|o| o["type"] != "null");
            }
            map.values_mut().for_each(without_null);
        }
        Value::Array(items) => items.iter_mut().for_each(without_null),
        _ => {}
    }
}
