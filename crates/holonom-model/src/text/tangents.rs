//! How the values of a model text change with its parameters: the derivatives of all expressions.
//!
//! ```text
//! p_j = e_j(θ, p),   ∂p_j/∂θ_k = Σ_i ∂e_j/∂p_i ∂p_i/∂θ_k        in the order of dependence
//! key = e(p)         ∂key/∂θ_k = Σ_j ∂e/∂p_j ∂p_j/∂θ_k
//! ```
//! `θ`: the parameters that are numbers. Slopes are those of [`ExpressionProgram::gradient`],
//! exact.

use std::collections::BTreeMap;

use toml::de::{DeTable, DeValue};

use super::parameters::{FileParameter, each, each_value, resolve, take};
use super::problem::{Problem, nearest};
use super::sections::is_formula;
use crate::expression::{ExpressionProgram, KnownName, Moving, names, renamed};

/// How the numbers of a model change with one of its parameters.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ParameterTangent {
    /// The parameter.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// The derivatives of the numbers at these key paths, `body.arm.mass`; others do not change.
    pub keys: BTreeMap<String, f64>,
    /// Expressions along the run that read it, by key path: laws, histories, paths, signals.
    pub formulas: BTreeMap<String, MovingText>,
}

/// An expression along the run that a parameter changes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MovingText {
    /// The expression, with the values of the parameters that do not change.
    pub text: String,
    /// Those that do, by their names.
    pub moving: BTreeMap<String, Moving>,
}

impl ParameterTangent {
    /// Whether nothing depends on it.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.keys.is_empty() && self.formulas.is_empty()
    }
}

/// The tangents of all parameters of a table that are numbers, then of the numbers at `keys`.
pub(super) fn tangents(
    mut table: DeTable<'_>,
    keys: &[&str],
) -> Result<Vec<ParameterTangent>, Vec<Problem>> {
    let mut problems = Vec::new();
    let mut parameters = take(&mut table, &mut problems);
    resolve(&mut parameters, &mut problems);
    if !problems.is_empty() {
        return Err(problems);
    }
    let free: Vec<String> = parameters
        .iter()
        .filter(|(_, own)| own.text.trim().parse::<f64>().is_ok())
        .map(|(name, _)| name.clone())
        .collect();
    let chain = ParameterChain::new(&parameters, &free, &mut problems);
    let mut found: Vec<ParameterTangent> = free
        .iter()
        .map(|name| ParameterTangent {
            name: name.clone(),
            value: parameters[name].value.unwrap_or(f64::NAN),
            ..ParameterTangent::default()
        })
        .collect();
    each(&mut table, &mut |path, expression, value| {
        let along =
            is_formula(path) && !value.get_ref().as_str().is_some_and(|text| text.starts_with('='));
        if along {
            for (k, own) in found.iter_mut().enumerate() {
                let moved = chain.moved(expression, k);
                if !moved.moving.is_empty() {
                    own.formulas.insert(path.to_owned(), moved);
                }
            }
            return;
        }
        match chain.slopes(expression) {
            Ok(slopes) => {
                for (own, slope) in found.iter_mut().zip(slopes) {
                    if slope != 0.0 {
                        own.keys.insert(path.to_owned(), slope);
                    }
                }
            }
            Err(message) => problems.push(Problem::new(path, message).at(Some(value.span()))),
        }
    });
    found.extend(at_keys(&table, keys, &mut problems));
    if problems.is_empty() { Ok(found) } else { Err(problems) }
}

/// The tangents of numbers that stand in the file: each changes itself alone.
fn at_keys(
    table: &DeTable<'_>,
    keys: &[&str],
    problems: &mut Vec<Problem>,
) -> Vec<ParameterTangent> {
    let mut stated = BTreeMap::new();
    if !keys.is_empty() {
        each_value(table, &mut |path, value| {
            let number = match value {
                DeValue::Integer(own) => {
                    i64::from_str_radix(own.as_str(), own.radix()).ok().map(|number| number as f64)
                }
                DeValue::Float(own) => own.as_str().parse().ok(),
                _ => None,
            };
            stated.insert(path.to_owned(), number);
        });
    }
    let one = |key: &&str| match stated.get(*key) {
        Some(Some(value)) => Some(ParameterTangent {
            name: (*key).to_owned(),
            value: *value,
            keys: BTreeMap::from([((*key).to_owned(), 1.0)]),
            ..ParameterTangent::default()
        }),
        Some(None) => {
            let message = "no number stands there, by which a derivative could be".to_owned();
            let help = "name the parameters that it follows from, or state a number";
            problems.push(Problem::new(*key, message).help(help));
            None
        }
        None => {
            let message = "the model file states no such number".to_owned();
            let numbers = stated.iter().filter(|own| own.1.is_some()).map(|own| own.0.as_str());
            let help = match nearest(key, numbers) {
                Some(best) => format!("did you mean `{best}`?"),
                None => "state it there".to_owned(),
            };
            problems.push(Problem::new(*key, message).help(help));
            None
        }
    };
    keys.iter().filter_map(one).collect()
}

/// The derivatives of all parameters by those that are numbers.
struct ParameterChain<'a> {
    parameters: &'a BTreeMap<String, FileParameter>,
    rows: BTreeMap<String, Vec<f64>>,
}

impl<'a> ParameterChain<'a> {
    fn new(
        parameters: &'a BTreeMap<String, FileParameter>,
        free: &[String],
        problems: &mut Vec<Problem>,
    ) -> Self {
        let unit = |k: usize| (0..free.len()).map(|j| f64::from(u8::from(j == k))).collect();
        let rows = free.iter().enumerate().map(|(k, name)| (name.clone(), unit(k))).collect();
        let mut chain = Self { parameters, rows };
        // each after those it depends on: circles were refused
        let mut left: Vec<&String> =
            parameters.keys().filter(|name| !chain.rows.contains_key(*name)).collect();
        while !left.is_empty() {
            let known = |name: &&String| {
                let used = names(&parameters[*name].text);
                used.iter().all(|own| !parameters.contains_key(own) || chain.rows.contains_key(own))
            };
            let Some(next) = left.iter().position(known) else { break };
            let name = left.swap_remove(next);
            let row = chain.slopes(&parameters[name].text).unwrap_or_else(|message| {
                let path = format!("parameters.{name}");
                problems.push(Problem::new(path, message).at(Some(parameters[name].place.clone())));
                vec![0.0; free.len()]
            });
            chain.rows.insert(name.clone(), row);
        }
        chain
    }

    /// An expression along the run as the parameter of this number changes it.
    fn moved(&self, expression: &str, k: usize) -> MovingText {
        let mut moving = BTreeMap::new();
        let text = renamed(expression, &mut |name| {
            let Some(own) = self.parameters.get(name) else { return name.to_owned() };
            let value = format!("({:?})", own.value.unwrap_or(f64::NAN));
            match self.rows.get(name).and_then(|row| row.get(k)) {
                Some(slope) if *slope != 0.0 => {
                    moving.insert(name.to_owned(), Moving { value, slope: format!("{slope:?}") });
                    name.to_owned()
                }
                _ => value,
            }
        });
        MovingText { text, moving }
    }

    /// The derivatives of an expression, or why it has none.
    fn slopes(&self, text: &str) -> Result<Vec<f64>, String> {
        let list: Vec<&String> = self.parameters.keys().collect();
        let values: Vec<f64> =
            self.parameters.values().map(|own| own.value.unwrap_or(f64::NAN)).collect();
        let place = |name: &str| list.binary_search_by(|own| own.as_str().cmp(name)).ok();
        let program = ExpressionProgram::parse(text, &mut |name| place(name).map(KnownName::Input))
            .map_err(|error| error.message)?;
        if let Some(kink) = program.kink(&values) {
            let text = text.trim();
            return Err(format!("the expression `{text}` has no derivative: {kink}"));
        }
        let mut slopes = vec![0.0; values.len()];
        program.gradient(&values, &mut slopes).map_err(|undefined| undefined.message)?;
        let mut sum = vec![0.0; self.rows.values().next().map_or(0, Vec::len)];
        for (name, slope) in list.iter().zip(&slopes).filter(|(_, slope)| **slope != 0.0) {
            let row = self.rows.get(*name).into_iter().flatten();
            sum.iter_mut().zip(row).for_each(|(sum, x)| *sum += slope * x);
        }
        Ok(sum)
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp)] // exact by construction
mod tests {
    use crate::{ModelText, Override};
    use std::path::Path;

    const TEXT: &str = r#"
        [parameters]
        length = 0.8
        density = 7800.0
        half = "= length/2"
        weight = "= density*length*0.01^2"
        idle = 3.0
        [[body]]
        name = "arm"
        mass = "= weight"
        position = ["= half*cos(length)", 0.0, "= -half"]
        [[law]]
        name = "push"
        effort = "density*t"
    "#;

    fn tangents(text: &str, overrides: &[Override]) -> Vec<super::ParameterTangent> {
        let text = ModelText::from_text(Path::new("x.toml"), text);
        text.parameter_tangents(overrides).expect("it has derivatives")
    }

    #[test]
    fn keys_change_by_the_chain_rule_through_other_parameters() {
        let found = tangents(TEXT, &[]);
        let names: Vec<_> = found.iter().map(|own| own.name.as_str()).collect();
        assert_eq!(names, ["density", "idle", "length"]);
        let [density, idle, length] = &found[..] else { unreachable!() };
        assert!(idle.is_idle());
        assert_eq!(density.formulas.keys().collect::<Vec<_>>(), ["law.push.effort"]);
        assert!((density.keys["body.arm.mass"] - 0.8e-4).abs() < 1e-18);
        assert!((length.keys["body.arm.mass"] - 0.78).abs() < 1e-15);
        let x = 0.5 * 0.8_f64.cos() - 0.4 * 0.8_f64.sin();
        assert!((length.keys["body.arm.position.0"] - x).abs() < 1e-15);
        assert_eq!(length.keys["body.arm.position.2"], -0.5);
        assert_eq!(length.keys.len(), 3);
    }

    #[test]
    fn numbers_of_the_file_change_themselves() {
        let text = ModelText::from_text(Path::new("x.toml"), TEXT);
        let set = [Override::new("law.push.point", "[0.5, 1]")];
        let of = |names: &[&str]| {
            let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
            text.tangents_of(&set, &names)
        };
        let found = of(&["length", "law.push.point.1", "body.arm.position.1"]).expect("numbers");
        assert_eq!(found.len(), 5); // after the parameters
        assert_eq!((found[3].name.as_str(), found[3].value), ("law.push.point.1", 1.0));
        assert_eq!(found[3].keys, [("law.push.point.1".to_owned(), 1.0)].into());
        assert_eq!(found[4].value, 0.0);
        let refused = |name: &str| format!("{:?}", of(&[name]).expect_err("no number"));
        assert!(refused("body.arm.mass").contains("no number stands there"));
        assert!(refused("body.arm.positoin.1").contains("body.arm.position.1"));
    }

    #[test]
    fn a_parameter_that_is_set_depends_on_no_other() {
        let found = tangents(TEXT, &[Override::new("parameters.half", "0.3")]);
        let length = found.iter().find(|own| own.name == "length").expect("a parameter");
        assert_eq!(length.keys.get("body.arm.position.2"), None);
        assert!(found.iter().any(|own| own.name == "half" && own.value == 0.3));
    }

    #[test]
    fn kinks_and_jumps_are_refused_by_name() {
        let refused = |expression: &str| {
            let text = format!("[parameters]\na = 1.0\n[model]\nx = \"= {expression}\"");
            let text = ModelText::from_text(Path::new("x.toml"), text);
            text.parameter_tangents(&[]).err().map(|error| error.to_string()).unwrap_or_default()
        };
        assert!(refused("floor(2.5*a)").contains("`floor(2.5*a)` jumps"));
        assert!(refused("abs(a - 1)").contains("`abs(a - 1)` has a kink"));
        assert!(refused("max(a, 1)").contains("kink"));
        assert!(refused("min(1, a)").contains("kink"));
        assert!(refused("select(a - 1, 2, a)").contains("kink"));
        assert!(refused("sqrt(a - 1)").contains("sqrt"));
        assert_eq!(refused("abs(a - 2) + max(a, 0.5) + floor(1.5) + sign(a)"), "");
    }
}
