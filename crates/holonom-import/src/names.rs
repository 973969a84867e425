//! Names of the model file: unique, without the characters that it refuses.

use std::collections::{BTreeMap, BTreeSet};

use holonom_model::GROUND;

/// Characters of a name at most.
const LONGEST: usize = 90;

/// The names taken so far.
#[derive(Debug, Default)]
pub(crate) struct TakenNames {
    taken: BTreeSet<String>,
    /// Of each name the next number behind it.
    next: BTreeMap<String, u64>,
}

impl TakenNames {
    /// A name for what is called `wanted`; another component of this name makes it `wanted_suffix`.
    pub(crate) fn unique(&mut self, wanted: &str, suffix: &str) -> String {
        let base = clean(wanted, suffix);
        let with_suffix = format!("{base}_{suffix}");
        let next = self.next.entry(base.clone()).or_insert(2);
        let numbered = std::iter::repeat_with(|| {
            *next += 1;
            format!("{base}_{}", *next - 1)
        });
        let mut candidates = [base.clone(), with_suffix].into_iter().chain(numbered);
        let free = candidates.find(|name| name != GROUND && !self.taken.contains(name));
        let name = free.unwrap_or_default();
        self.taken.insert(name.clone());
        name
    }
}

/// The name with `_` for each character that a name must not have; `instead` where nothing is left.
fn clean(name: &str, instead: &str) -> String {
    let odd = |c: char| c.is_control() || ".,\"[]=".contains(c);
    let replaced: String =
        name.chars().map(|c| if odd(c) { '_' } else { c }).take(LONGEST).collect();
    match replaced.trim() {
        "" => instead.to_owned(),
        formula if formula.starts_with(['+', '-', '@']) => format!("_{}", &formula[1..]),
        trimmed => trimmed.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_allowed() {
        let mut names = TakenNames::default();
        assert_eq!(names.unique("knee", "body"), "knee");
        assert_eq!(names.unique("knee", "joint"), "knee_joint");
        assert_eq!(names.unique("knee", "joint"), "knee_2");
        assert_eq!(names.unique("ground", "body"), "ground_body");
        assert_eq!(names.unique(" a.b=\"c\" ", "body"), "a_b__c_");
        assert_eq!(names.unique("", "body"), "body");
        assert_eq!(names.unique("+1", "body"), "_1");
        assert_eq!(names.unique("-x", "body"), "_x");
    }
}
