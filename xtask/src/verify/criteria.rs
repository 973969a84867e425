//! What each criterion asks, and with which limit: for the page.

use super::mutants::{Mutant, list};
use holonom::verification::certificate::Criterion;
use holonom::verification::frequency::RESOLVED;
use holonom::verification::growth::UNBIASED;
use holonom::verification::judge::{
    EXPONENT_TOLERANCE, FIRST_ORDER, FORM_TOLERANCE, LEAST_TREND_STEPS, MOMENTUM_CAP,
    ORDER_TOLERANCE,
};
use holonom::verification::output::LEAST_ORDER;
use holonom::verification::trend::{NEGLIGIBLE, WIDENING};

/// Statement and limit of a criterion.
fn asks(criterion: Criterion) -> (&'static str, String) {
    match criterion {
        Criterion::Order => (
            "`q`, `p`, `λ` converge with the order of the scheme",
            format!(
                "slope within {ORDER_TOLERANCE} of the nominal order, over four halvings (order 6: two to four; 8 and more: one to four, and a miss by less than an eighth of the order over at most two is inconclusive; above 8 within a twentieth; not applicable where errors fall to round-off before that, which those of a lower order would not). `λ_0` of (47) and \
                 multipliers of single energy–momentum steps: at least {FIRST_ORDER}. An error of half the quantity at the finest step, \
                 in a study in which `q` (for multipliers `q` and `p`) has its order, fails"
            ),
        ),
        Criterion::Output => (
            "momenta, multipliers, reactions, energies and momentum maps satisfy the equations of motion along the \
             configurations; reported `|g|` is `|g(q)|`",
            format!(
                "differences from central differences of the order `p` of the scheme vanish with order {LEAST_ORDER} `p` or more in `h`, or are \
                 below 1e-9 of the largest force that acts; `|g|`: 1e-15 (1 + `|q|²`)"
            ),
        ),
        Criterion::Energy => (
            "variational: the error of `H` is bounded, without secular drift; energy–momentum: `H` is constant",
            format!(
                "sixteen block medians of `H_d` or of the shadow energy `H̃ = (p H_d + E_d)/(p + 1)` within {:.0} % of the band of `H_d`, \
                 the second half at most {WIDENING} times as far from the median as the first; or all of it below `100 ε √N`. What fails is measured again at half the step, where a drift stays the same part of the band. Applies to \
                 conservative systems, from {LEAST_TREND_STEPS} steps on, where `h ω_max ≤ {RESOLVED}`. Energy–momentum: `100 ε √N`",
                100.0 * NEGLIGIBLE
            ),
        ),
        Criterion::Momentum => (
            "momentum maps of the symmetries change by round-off only",
            format!(
                "at most `ε √N`; or growth of at most `N^{UNBIASED}`, four random walks of its own steps and {MOMENTUM_CAP:.0e} `ε √N`, \
                 relative to the sum of the terms"
            ),
        ),
        Criterion::Residual => (
            "constraints at positions and, (46), at momenta; (45) at velocities follows from that at positions",
            format!(
                "`g`: 1e-13 (1 + `|q|²`); (46), where `p_n` is defined (order 2, regular `M`): order {:.1} or more, or 1e-11",
                2.0 - 2.0 * ORDER_TOLERANCE
            ),
        ),
        Criterion::Reversal => (
            "`N` steps forward and `N` back return to the initial state",
            "`10 ε √N κ²`, `κ` the growth of tangent vectors over the run, at least 10; not applicable to dissipative systems".into(),
        ),
        Criterion::Symplecticity => (
            "`Ω` of curves on `T*C` does not change, by differences of real steps",
            format!("{FORM_TOLERANCE:.0e} of its largest term; energy–momentum schemes do not conserve it: not applicable"),
        ),
        Criterion::Conditioning => (
            "condition numbers of the Newton matrix against `h`",
            format!("exponents 0 (nodal, reduced), −1 (d'Alembert), −3 (constrained) as written, 0 as factorized; within {EXPONENT_TOLERANCE}"),
        ),
        Criterion::Agreement => (
            "the four variational schemes give one trajectory",
            "`100 ε √N κ`, `κ` as above".into(),
        ),
        _ => ("values that are known in closed form", "1e-10".into()),
    }
}

/// The table of criteria.
pub(super) fn table() -> String {
    let all = list::all();
    let mut text = String::from("| criterion | property | limit | mutants |\n|---|---|---|---|\n");
    for criterion in Criterion::ALL {
        let (property, limit) = asks(criterion);
        let count = all.iter().filter(|m: &&Mutant| m.criterion == criterion).count();
        text += &format!("| {} | {property} | {limit} | {count} |\n", criterion.name());
    }
    text
}
