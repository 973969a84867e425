//! The page of a model that was checked: its initial configuration in 3-D, and what the assembly
//! found.

use holonom_model::{Model, ModelError};

use super::page::{foot, head, heading, push_list, push_model, push_warnings};
use super::scene::Scene;

/// What the assembly of a model found, in words.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Assembled {
    /// Subjects and findings.
    pub facts: Vec<(&'static str, String)>,
    /// What is worth knowing.
    pub warnings: Vec<String>,
}

/// The page; `command` makes it again.
///
/// # Errors
/// [`ModelError`] when the model cannot be assembled.
pub fn configuration_page(
    model: &Model,
    found: &Assembled,
    command: &str,
) -> Result<String, ModelError> {
    let name = &model.header.name;
    let mut html = head(&format!("{name}: initial configuration"));
    let mut about = vec!["initial configuration".to_owned()];
    about.extend(model.header.description.clone().filter(|words| !words.is_empty()));
    html += &heading(name, &about, command);
    push_warnings(&mut html, &found.warnings);
    html += &Scene::initial(model)?.map_or_else(String::new, |scene| scene.html());
    push_list(&mut html, found.facts.iter().cloned());
    push_model(&mut html, &model.to_toml());
    foot(&mut html, env!("CARGO_PKG_VERSION"));
    Ok(html)
}
