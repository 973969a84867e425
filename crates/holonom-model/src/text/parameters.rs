//! `[parameters]` of a model file and the expressions that use them: a text that begins with `=`
//! stands for its value.
//!
//! ```toml
//! [parameters]
//! length = 0.8
//! reach = "= length/2 + 0.1"
//! ```
//! Parameters may depend on each other in any order. Expressions are evaluated after overrides, so
//! that one `--set parameters.length=0.4` changes a mechanism consistently; the model itself has
//! numbers alone.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::include::writer::quoted;
use super::key_path::below;
use super::overrides::Override;
use super::problem::{MAX_PROBLEMS, Problem, nearest};
use super::sections::{LISTS, PARAMETERS, is_formula};
use crate::expression::{
    ExpressionError, evaluate, is_reserved, is_time, is_word, names, renamed, vocabulary,
};
use crate::formula::own_names;

/// The section in the JSON schema.
pub(crate) fn schema() -> serde_json::Value {
    let words = vocabulary();
    serde_json::json!({
        "description": format!(
            "Numbers that expressions use: elsewhere in the file a text such as `\"= 2*length\"` stands for its value. \
             Expressions have {words}."
        ),
        "type": "object",
        "additionalProperties": {
            "description": "A number, or an expression of other parameters. Its name has letters, digits and `_`.",
            "type": ["number", "string"],
        },
    })
}

/// A parameter: what the file says, and its value once it is known.
pub(super) struct FileParameter {
    pub(super) text: String,
    pub(super) place: Range<usize>,
    pub(super) value: Option<f64>,
}

/// Whether a text or an override may hold parameters or expressions at all.
pub(crate) fn concern(text: &str, overrides: &[Override]) -> bool {
    let may = |text: &str| ["\"=", "'=", PARAMETERS].iter().any(|word| text.contains(word));
    may(text) || overrides.iter().any(|one| may(&one.key) || one.value.contains('='))
}

/// Values of all expressions, in the order of the table, as a model file writes numbers. `own`:
/// parameters of the text itself, `set`: those whose values were replaced.
pub(crate) fn values(
    mut table: DeTable<'_>,
    own: &BTreeSet<String>,
    set: &[&str],
) -> Result<Vec<String>, Vec<Problem>> {
    let mut problems = Vec::new();
    let mut parameters = take(&mut table, &mut problems);
    resolve(&mut parameters, &mut problems);
    let mut values = Vec::new();
    if problems.is_empty() && !set.is_empty() {
        let used = used(&mut table, &parameters);
        let idle = set.iter().filter(|name| !used.contains(**name));
        problems.extend(idle.map(|name| without_effect(name, own, &used)));
    }
    if problems.is_empty() {
        each(&mut table, &mut |path, expression, value| {
            if is_formula(path)
                && !value.get_ref().as_str().is_some_and(|text| text.starts_with('='))
            {
                match with_values(expression, variables_at(path), &parameters) {
                    Ok(text) => values.push(quoted(&text)),
                    Err(problem) if problems.len() < MAX_PROBLEMS => {
                        problems.push(problem.below(path).at(Some(value.span())));
                    }
                    Err(_) => {}
                }
                return;
            }
            let known = &mut |name: &str| parameters.get(name).and_then(|own| own.value);
            let fault = match evaluate(expression, known) {
                Ok(number) if number.is_finite() => return values.push(written(number)),
                Ok(number) => (format!("its value is {number}"), None),
                Err(error) => {
                    let along = error.unknown.as_deref().filter(|_| is_formula(path));
                    let help = match along.filter(|name| variables_at(path).contains(name)) {
                        Some(_) => format!(
                            "what is evaluated along the run has no `=`: write \"{}\"",
                            expression.trim()
                        ),
                        None => help(&error, &parameters),
                    };
                    (error.message.clone(), Some(help))
                }
            };
            if problems.len() < MAX_PROBLEMS {
                let message = format!("the expression `{}`: {}", expression.trim(), fault.0);
                let mut problem = Problem::new(path, message).at(Some(value.span()));
                problem.help = fault.1;
                problems.push(problem);
            }
        });
    }
    if problems.is_empty() { Ok(values) } else { Err(problems) }
}

/// The variables of the expression at a key path.
fn variables_at(path: &str) -> &'static [&'static str] {
    own_names(path.split('.').next().unwrap_or_default())
}

/// An expression that is evaluated along the run, with numbers in the place of parameters.
fn with_values(
    text: &str,
    own: &[&str],
    parameters: &BTreeMap<String, FileParameter>,
) -> Result<String, Problem> {
    let mut clash = None;
    let text = renamed(text, &mut |name| match parameters.get(name).and_then(|own| own.value) {
        Some(_) if own.contains(&name) => {
            clash = Some(name.to_owned());
            name.to_owned()
        }
        Some(value) if value.is_sign_negative() => format!("({value:?})"),
        Some(value) => format!("{value:?}"),
        None => name.to_owned(),
    });
    match clash {
        None => Ok(text),
        Some(name) => {
            let of = if own.len() > 1 { "law" } else { "expression" };
            let message = format!("`{name}` is a variable of the {of} and a parameter");
            Err(Problem::new("", message).help("give the parameter another name"))
        }
    }
}

/// Removes the section `[parameters]`, and replaces each expression by its value.
pub(crate) fn substitute<'i>(table: &mut DeTable<'i>, values: &'i [String]) {
    table.remove(PARAMETERS);
    if values.is_empty() {
        return; // there are no expressions
    }
    let mut values = values.iter();
    each(table, &mut |_, _, value| {
        if let Some(number) = values.next().and_then(|text| DeValue::parse(text).ok()) {
            *value = Spanned::new(value.span(), number.into_inner());
        }
    });
}

/// Not `inf` and not `nan`, which are numbers of TOML.
fn is_finite(number: &str) -> bool {
    number.parse().is_ok_and(f64::is_finite)
}

/// A number as a model file writes it; a whole one serves for counts as well.
fn written(number: f64) -> String {
    match number.fract() == 0.0 && number.abs() < 1e15 {
        true => format!("{number:.0}"),
        false => format!("{number:?}"),
    }
}

/// The parameters of the file.
pub(super) fn take(
    table: &mut DeTable<'_>,
    problems: &mut Vec<Problem>,
) -> BTreeMap<String, FileParameter> {
    let mut parameters = BTreeMap::new();
    let Some(section) = table.remove(PARAMETERS) else { return parameters };
    let place = section.span();
    let DeValue::Table(entries) = section.into_inner() else {
        let problem = Problem::new(PARAMETERS, "`parameters` must be a table").at(Some(place));
        problems.push(problem.help("write [parameters] with one pair of brackets"));
        return parameters;
    };
    for (key, value) in entries {
        let (name, place) = (key.get_ref().to_string(), value.span());
        let path = format!("{PARAMETERS}.{name}");
        let text = match value.get_ref() {
            DeValue::Float(float) => {
                Some(float.as_str().replace('_', "")).filter(|number| is_finite(number))
            }
            DeValue::Integer(integer) => Some(integer.as_str().replace('_', "")),
            DeValue::String(text) => text.strip_prefix('=').map(str::to_owned),
            _ => None,
        };
        let plain = is_word(&name);
        let wrong = |message: String, help: &str| {
            Problem::new(path.clone(), message).help(help).at(Some(place.clone()))
        };
        match text {
            _ if problems.len() >= MAX_PROBLEMS => break,
            _ if is_reserved(&name) => {
                problems.push(wrong(
                    format!("`{name}` is a constant or a function of expressions"),
                    "choose another name",
                ));
            }
            _ if !plain => {
                let help = "use letters, digits and _, a letter first";
                problems.push(wrong(format!("`{name}` cannot be used in expressions"), help));
            }
            None => {
                let help = "write a number, or an expression such as \"= 2*length\"";
                problems.push(wrong(format!("the parameter `{name}` is no finite number"), help));
            }
            Some(text) => {
                parameters.insert(name, FileParameter { text, place, value: None });
            }
        }
    }
    parameters
}

/// Finds the values, each parameter after those it depends on.
pub(super) fn resolve(
    parameters: &mut BTreeMap<String, FileParameter>,
    problems: &mut Vec<Problem>,
) {
    // of each parameter those that wait for it, and for how many parameters it waits itself
    let mut waiting: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let mut missing: BTreeMap<String, usize> = BTreeMap::new();
    for (name, parameter) in parameters.iter() {
        let used: BTreeSet<String> = names(&parameter.text)
            .into_iter()
            .filter(|used| parameters.contains_key(used))
            .collect();
        missing.insert(name.clone(), used.len());
        for other in used {
            waiting.entry(other).or_default().push(name.clone());
        }
    }
    let mut ready: Vec<String> =
        missing.iter().filter(|(_, count)| **count == 0).map(|(name, _)| name.clone()).collect();
    while let Some(name) = ready.pop() {
        let known = &mut |name: &str| parameters.get(name).and_then(|parameter| parameter.value);
        let value = parameters.get(&name).and_then(|own| evaluate(&own.text, known).ok());
        let (Some(own), Some(value)) = (parameters.get_mut(&name), value) else { continue };
        own.value = Some(value);
        for other in waiting.remove(&name).unwrap_or_default() {
            let count = missing.entry(other.clone()).or_default();
            *count -= 1;
            if *count == 0 {
                ready.push(other);
            }
        }
    }
    let (mut circles, mut causes) = (Vec::new(), Vec::new());
    for (name, parameter) in parameters.iter().filter(|(_, parameter)| parameter.value.is_none()) {
        if causes.len() == MAX_PROBLEMS {
            break;
        }
        let value = |name: &str| parameters.get(name).and_then(|parameter| parameter.value);
        let Err(error) = evaluate(&parameter.text, &mut |name| value(name)) else { continue };
        let on = error.unknown.as_deref().filter(|other| parameters.contains_key(*other));
        let message = match on {
            Some(other) => format!("`{name}` depends on `{other}`, which has no value"),
            None => format!("the parameter `{name}` has no value: {}", error.message),
        };
        let mut problem = Problem::new(format!("{PARAMETERS}.{name}"), message);
        problem.help = match on {
            Some(_) => Some("parameters must not depend on each other in a circle".to_owned()),
            None => Some(help(&error, parameters)),
        };
        let list = if on.is_some() { &mut circles } else { &mut causes };
        if list.len() < MAX_PROBLEMS {
            list.push(problem.at(Some(parameter.place.clone())));
        }
    }
    problems.extend(if causes.is_empty() { circles } else { causes });
}

/// What to write instead of an expression.
fn help(error: &ExpressionError, parameters: &BTreeMap<String, FileParameter>) -> String {
    let name = error.unknown.as_deref().unwrap_or_default();
    let near = nearest(name, parameters.keys().map(String::as_str));
    // the time is near to every other letter
    let near = near.filter(|best| !is_time(name) || best.eq_ignore_ascii_case(name));
    match near.filter(|_| error.unknown.is_some()) {
        Some(best) => format!("did you mean `{best}`?"),
        None => error.help.clone(),
    }
}

/// The names of the parameters that a text states.
pub(crate) fn stated(table: &DeTable<'_>) -> BTreeSet<String> {
    let section = table.get(PARAMETERS).and_then(|section| section.get_ref().as_table());
    section.into_iter().flat_map(|own| own.keys().map(|key| key.get_ref().to_string())).collect()
}

/// The parameters that an expression of the model depends on, itself or by other parameters.
fn used(table: &mut DeTable<'_>, parameters: &BTreeMap<String, FileParameter>) -> BTreeSet<String> {
    let mut waiting = Vec::new();
    each(table, &mut |_, expression, _| waiting.extend(names(expression)));
    let mut used = BTreeSet::new();
    while let Some(name) = waiting.pop() {
        if let Some(parameter) = parameters.get(&name)
            && used.insert(name)
        {
            waiting.extend(names(&parameter.text));
        }
    }
    used
}

/// The parameters that expressions of a text use.
pub(crate) fn used_in(text: &str) -> BTreeSet<String> {
    let Ok(table) = DeTable::parse(text) else { return BTreeSet::new() };
    let mut table = table.into_inner();
    let parameters = take(&mut table, &mut Vec::new());
    used(&mut table, &parameters)
}

/// A value for a parameter that no expression uses.
fn without_effect(name: &str, own: &BTreeSet<String>, used: &BTreeSet<String>) -> Problem {
    let key = format!("{PARAMETERS}.{name}");
    let list = || used.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    let help = match nearest(name, used.iter().map(String::as_str)) {
        Some(best) => format!("did you mean `{PARAMETERS}.{best}`?"),
        None if used.is_empty() => {
            "set a value of the model itself, such as body.NAME.mass, or let an expression use the parameter".to_owned()
        }
        None => format!("expressions use {}", list()),
    };
    let message = match own.contains(name) {
        true => format!("no expression uses the parameter `{name}`: its value changes nothing"),
        false => format!("the model has no parameter `{name}`"),
    };
    Problem::new(key, message).help(help)
}

/// Visits all expressions: key path, what follows the `=` or an expression that is evaluated along
/// the run, the value.
pub(super) fn each<'i>(
    table: &mut DeTable<'i>,
    visit: &mut dyn FnMut(&str, &str, &mut Spanned<DeValue<'i>>),
) {
    for (key, value) in table.iter_mut() {
        expressions(&mut key.get_ref().to_string(), value, visit);
    }
}

/// Visits each value of a table that is neither a table nor a list, with its key path.
pub(super) fn each_value(table: &DeTable<'_>, visit: &mut dyn FnMut(&str, &DeValue<'_>)) {
    for (key, value) in table {
        values_below(&mut key.get_ref().to_string(), value.get_ref(), visit);
    }
}

fn values_below(path: &mut String, value: &DeValue<'_>, visit: &mut dyn FnMut(&str, &DeValue<'_>)) {
    match value {
        DeValue::Table(table) => {
            for (key, value) in table {
                let end = format_args!(".{}", key.get_ref());
                below(path, end, |path| values_below(path, value.get_ref(), visit));
            }
        }
        DeValue::Array(array) => {
            let part = LISTS.contains(&path.as_str());
            for (index, value) in array.iter().enumerate() {
                let label = label(part, index, value.get_ref());
                below(path, &label, |path| values_below(path, value.get_ref(), visit));
            }
        }
        own => visit(path, own),
    }
}

/// The end of the key path of an entry of a list: its name where it is a part of the model.
fn label(part: bool, index: usize, value: &DeValue<'_>) -> String {
    let name = value.get("name").and_then(|name| name.get_ref().as_str());
    match name.filter(|name| part && !name.is_empty()) {
        Some(name) => format!(".{name}"),
        None => format!(".{index}"),
    }
}

fn expressions<'i>(
    path: &mut String,
    value: &mut Spanned<DeValue<'i>>,
    visit: &mut dyn FnMut(&str, &str, &mut Spanned<DeValue<'i>>),
) {
    match value.get_mut() {
        DeValue::Table(table) => {
            for (key, value) in table.iter_mut() {
                let end = format_args!(".{}", key.get_ref());
                below(path, end, |path| expressions(path, value, visit));
            }
        }
        DeValue::Array(array) => {
            let part = LISTS.contains(&path.as_str());
            for (index, value) in array.iter_mut().enumerate() {
                let label = label(part, index, value.get_ref());
                below(path, &label, |path| expressions(path, value, visit));
            }
        }
        DeValue::String(text) if !path.ends_with(".description") => {
            let along = is_formula(path).then_some(text.as_ref());
            if let Some(expression) = text.strip_prefix('=').or(along) {
                let expression = expression.to_owned();
                visit(path, &expression, value);
            }
        }
        _ => {}
    }
}
