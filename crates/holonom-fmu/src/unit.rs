//! Units of variables by the base units of the standard.

/// Exponents of kg, m, s and rad.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BaseUnit {
    /// kg
    pub kg: i32,
    /// m
    pub m: i32,
    /// s
    pub s: i32,
    /// rad
    pub rad: i32,
}

const fn base(kg: i32, m: i32, s: i32, rad: i32) -> BaseUnit {
    BaseUnit { kg, m, s, rad }
}

/// Units that others are written by.
const KNOWN: [(&str, BaseUnit); 8] = [
    ("1", base(0, 0, 0, 0)),
    ("kg", base(1, 0, 0, 0)),
    ("m", base(0, 1, 0, 0)),
    ("s", base(0, 0, 1, 0)),
    ("rad", base(0, 0, 0, 1)),
    ("N", base(1, 1, -2, 0)),
    ("J", base(1, 2, -2, 0)),
    ("W", base(1, 2, -3, 0)),
];

impl BaseUnit {
    /// That of a unit as holonom writes it: `N·m`, `rad/s²`; `None` where a part is not known.
    #[must_use]
    pub fn of(unit: &str) -> Option<Self> {
        let (over, under) = unit.split_once('/').unwrap_or((unit, "1"));
        let mut found = Self::default();
        let factors = over.split('·').map(|own| (own, 1));
        for (factor, sign) in factors.chain(under.split(['·', '/']).map(|own| (own, -1))) {
            let letters = factor.trim_end_matches(['²', '³']);
            let power = match factor.strip_prefix(letters) {
                Some("²") => 2,
                Some("³") => 3,
                _ => 1,
            };
            let (_, own) = KNOWN.iter().find(|(name, _)| *name == letters)?;
            let by = sign * power;
            found.kg += by * own.kg;
            found.m += by * own.m;
            found.s += by * own.s;
            found.rad += by * own.rad;
        }
        Some(found)
    }

    /// Names and exponents other than 0.
    pub fn exponents(self) -> impl Iterator<Item = (&'static str, i32)> {
        [("kg", self.kg), ("m", self.m), ("s", self.s), ("rad", self.rad)]
            .into_iter()
            .filter(|(_, exponent)| *exponent != 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_have_their_exponents() {
        assert_eq!(BaseUnit::of("N·m"), Some(base(1, 2, -2, 0)));
        assert_eq!(BaseUnit::of("rad/s²"), Some(base(0, 0, -2, 1)));
        assert_eq!(BaseUnit::of("1/m"), Some(base(0, -1, 0, 0)));
        assert_eq!(BaseUnit::of("W"), Some(base(1, 2, -3, 0)));
        assert_eq!(BaseUnit::of("furlong"), None);
    }
}
