//! Which property is expected, what was measured, and whether the two agree.

use super::convergence::ErrorSequence;
use super::measure::Conditioning;
use super::subject::SteppingMethod;
use serde::{Deserialize, Serialize};

/// The property that is verified.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Criterion {
    /// The order of convergence of `q`, `p`, `λ`.
    Order,
    /// What is reported at the nodes satisfies the equations of motion along the configurations.
    Output,
    /// The energy error is bounded and has no trend.
    Energy,
    /// Momentum maps drift by unbiased round-off only.
    Momentum,
    /// Constraints and hidden constraints hold.
    Residual,
    /// Time reverses.
    Reversal,
    /// `DΦᵀ Ω DΦ = Ω`.
    Symplecticity,
    /// Condition numbers against the step.
    Conditioning,
    /// The schemes give the same motion.
    Agreement,
    /// Values that are known in closed form.
    ClosedForm,
}

impl Criterion {
    /// All of them.
    pub const ALL: [Self; 10] = [
        Self::Order,
        Self::Output,
        Self::Energy,
        Self::Momentum,
        Self::Residual,
        Self::Reversal,
        Self::Symplecticity,
        Self::Conditioning,
        Self::Agreement,
        Self::ClosedForm,
    ];

    /// In words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Order => "order",
            Self::Output => "output",
            Self::Energy => "energy",
            Self::Momentum => "momentum",
            Self::Residual => "constraints",
            Self::Reversal => "time reversal",
            Self::Symplecticity => "symplecticity",
            Self::Conditioning => "condition number",
            Self::Agreement => "agreement",
            Self::ClosedForm => "closed form",
        }
    }
}

/// Whether a property holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// It holds.
    Pass,
    /// It does not hold, and the cause is known.
    KnownDeviation,
    /// The numbers do not decide; the reason says why.
    Inconclusive,
    /// The scheme or the system does not have the property; the reason says why.
    NotApplicable,
    /// It does not hold.
    Fail,
}

impl Verdict {
    /// All of them, in the order of [`counts`].
    pub const ALL: [Self; 5] =
        [Self::Pass, Self::KnownDeviation, Self::Inconclusive, Self::NotApplicable, Self::Fail];

    /// Whether the property was judged: neither inconclusive nor not applicable.
    #[must_use]
    pub fn is_judged(self) -> bool {
        !matches!(self, Self::Inconclusive | Self::NotApplicable)
    }

    /// How far from a pass: failures highest, then known deviations, then what was not judged.
    #[must_use]
    pub fn severity(self) -> u32 {
        match self {
            Self::Pass => 0,
            Self::Inconclusive | Self::NotApplicable => 1,
            Self::KnownDeviation => 2,
            Self::Fail => 3,
        }
    }

    /// In words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::KnownDeviation => "known deviation",
            Self::Inconclusive => "inconclusive",
            Self::NotApplicable => "not applicable",
            Self::Fail => "FAIL",
        }
    }
}

/// One property, measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// What it is about.
    pub criterion: Criterion,
    /// The method; `None` where several are compared.
    pub method: Option<SteppingMethod>,
    /// Its order; 0 where it does not matter.
    pub order: u32,
    /// The quantity.
    pub quantity: String,
    /// What theory says.
    pub expected: String,
    /// What was found.
    pub measured: String,
    /// The number that was judged, where there is one.
    pub value: Option<f64>,
    /// The judgement.
    pub verdict: Verdict,
    /// Why, where that is not plain.
    pub reason: String,
}

impl Finding {
    /// One about which nothing is known yet.
    #[must_use]
    pub fn new(criterion: Criterion, method: SteppingMethod, order: u32, quantity: &str) -> Self {
        Self {
            criterion,
            method: Some(method),
            order,
            quantity: quantity.to_owned(),
            expected: String::new(),
            measured: String::new(),
            value: None,
            verdict: Verdict::Inconclusive,
            reason: String::new(),
        }
    }
}

impl std::fmt::Display for Finding {
    /// `FAIL, order of q, constrained, order 8: 7.64, expected 8: why`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}, {} of {}", self.verdict.name(), self.criterion.name(), self.quantity)?;
        if let Some(method) = self.method {
            write!(f, ", {}, order {}", method.name(), self.order)?;
        }
        for (before, text) in
            [(": ", &self.measured), (", expected ", &self.expected), (": ", &self.reason)]
        {
            if !text.is_empty() {
                write!(f, "{before}{text}")?;
            }
        }
        Ok(())
    }
}

/// How many findings have each verdict, in words: `8 pass, 1 known deviation, …`.
#[must_use]
pub fn counts(findings: &[&Finding]) -> String {
    let count = |verdict: Verdict| {
        let number = findings.iter().filter(|f| f.verdict == verdict).count();
        format!("{number} {}", verdict.name().to_lowercase())
    };
    Verdict::ALL.map(count).join(", ")
}

/// A convergence study of a method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Study {
    /// The method.
    pub method: SteppingMethod,
    /// Its order.
    pub order: u32,
    /// End of the runs, s.
    pub end: f64,
    /// What errors were measured against.
    pub reference: String,
    /// The errors, by quantity.
    pub curves: Vec<ErrorSequence>,
}

/// A curve over time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TimeCurve {
    /// What it shows.
    pub name: String,
    /// `(t, value)`, thinned out.
    pub points: Vec<(f64, f64)>,
}

/// All findings about one system.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Certificate {
    /// The system.
    pub system: String,
    /// The findings.
    pub findings: Vec<Finding>,
    /// Convergence studies.
    pub studies: Vec<Study>,
    /// Condition numbers of each method.
    pub conditioning: Vec<(SteppingMethod, Conditioning)>,
    /// Energy and momentum errors of the long run.
    pub histories: Vec<TimeCurve>,
}

impl Certificate {
    /// How many findings have a verdict.
    #[must_use]
    pub fn count(&self, verdict: Verdict) -> usize {
        self.findings.iter().filter(|f| f.verdict == verdict).count()
    }

    /// Whether nothing failed.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.count(Verdict::Fail) == 0
    }

    /// The findings about a criterion that failed.
    pub fn failures(&self, criterion: Criterion) -> impl Iterator<Item = &Finding> {
        self.findings.iter().filter(move |f| f.criterion == criterion && f.verdict == Verdict::Fail)
    }
}
