//! What the names in the expressions of a model stand for.

use std::collections::BTreeMap;

use crate::Model;
use crate::expression::{
    Curve, ExpressionError, ExpressionProgram, KnownName, Surface, is_reserved, is_word,
};
use crate::text::problem::nearest;
use crate::types::law::Formula;
use crate::types::table::Table;

/// The names of a law along a coordinate or between two points: time, coordinate, rate.
pub const ALONG: [&str; 3] = ["t", "x", "v"];
/// The names of a law on a body or a point mass: time, the point where it acts, its velocity, the
/// angular velocity of the body, in space.
pub const MOTION: [&str; 10] = ["t", "x", "y", "z", "vx", "vy", "vz", "wx", "wy", "wz"];
/// The names of a bushing: time, its six coordinates, their rates.
pub const SIX: [&str; 13] =
    ["t", "x1", "x2", "x3", "x4", "x5", "x6", "v1", "v2", "v3", "v4", "v5", "v6"];
/// Every name of a law that is its own.
pub(crate) const OWN: [&str; 11] = ["t", "x", "v", "y", "z", "vx", "vy", "vz", "wx", "wy", "wz"];
/// Whether expressions of all sections can read something of this name.
#[must_use]
pub fn is_readable(name: &str) -> bool {
    let plain = is_word(name) && !name.is_empty();
    plain && !is_reserved(name) && !OWN.contains(&name) && name != LAST
}

/// In a sampled signal: its value until then.
pub(crate) const LAST: &str = "last";

/// The names that expressions of a section have of their own.
pub(crate) fn own_names(section: &str) -> &'static [&'static str] {
    match section {
        "law" => &OWN,
        "bushing" => &SIX,
        _ => &TIME,
    }
}
/// The name of a function of time.
pub const TIME: [&str; 1] = ["t"];

/// The tables of a model, by their names.
#[derive(Clone, Debug)]
pub struct Curves<'a>(BTreeMap<&'a str, KnownName>);

impl<'a> Curves<'a> {
    /// Those of a model whose tables are valid.
    #[must_use]
    pub fn new(model: &'a Model) -> Self {
        let valid = model.tables.iter().filter(|table| table.fault().is_none());
        let own = |table: &'a Table| {
            let surface = Surface::new(table).map(KnownName::Surface);
            (table.name.as_str(), surface.unwrap_or_else(|| KnownName::Curve(Curve::new(table))))
        };
        Self(valid.map(own).collect())
    }

    /// The table of this name.
    #[must_use]
    pub fn known(&self, name: &str) -> Option<KnownName> {
        self.0.get(name).cloned()
    }

    /// Their names.
    pub fn names(&self) -> impl Iterator<Item = &'a str> {
        self.0.keys().copied()
    }

    /// An expression of the time alone; `None` where it is none.
    pub(crate) fn of_time(&self, formula: &Formula) -> Option<ExpressionProgram> {
        self.compile(formula, &TIME).ok()
    }

    /// Compiles an expression of these inputs, which is how many its program reads.
    ///
    /// # Errors
    /// [`ExpressionError`].
    pub fn compile(
        &self,
        formula: &Formula,
        own: &[&str],
    ) -> Result<ExpressionProgram, ExpressionError> {
        let text = formula.0.as_str();
        let mut known = |name: &str| {
            let input = own.iter().position(|own| *own == name).map(KnownName::Input);
            input.or_else(|| self.known(name))
        };
        ExpressionProgram::parse(text, &mut known).map_err(|error| {
            let Some(name) = error.unknown.clone() else { return error };
            let names = || own.iter().copied().chain(self.0.keys().copied());
            let help = match nearest(&name, names().filter(|own| own.len() > 1)) {
                Some(best) => format!("did you mean `{best}`?"),
                None => format!("this law knows {}, and [parameters]", own.join(" ")),
            };
            ExpressionError { message: format!("`{name}` is not known"), help, ..error }
        })
    }
}
