//! What the numbers in parentheses of a page stand for.

use holonom_report::page::escape;
use std::fmt::Write;

/// Where the equations stand.
const SOURCE: &str = "S. Leyendecker, J. E. Marsden, M. Ortiz, Variational integrators for constrained dynamical systems, ZAMM 88 (2008) \
                      677–708";

/// Equations that labels cite, in words.
const EQUATIONS: [(&str, &str); 7] = [
    ("34", "momentum p_n of a node, the constrained discrete Legendre transform with multipliers"),
    (
        "36",
        "multiplier λ_n of a node, from the discrete Legendre transforms of the steps beside it",
    ),
    ("39", "projected momentum ᵠp_n of a node, from the step that starts there"),
    ("40", "projected momentum ᵠp_n of a node, from the step that ends there"),
    ("45", "hidden constraint at velocity level, G(q_{n+1/2}) Δq/h = 0"),
    ("46", "hidden constraint at momentum level, G(q_n) M⁻¹ p_n = 0"),
    ("47", "multiplier λ_0 of the initial node, a one-sided difference"),
];

/// A list of the equations that a page cites; nothing where it cites none.
pub(crate) fn legend(html: &str) -> String {
    let cites = |number: &str| {
        html.contains(&format!("({number})")) || html.contains(&format!(", {number})"))
    };
    let cited: Vec<_> = EQUATIONS.iter().filter(|(number, _)| cites(number)).collect();
    if cited.is_empty() {
        return String::new();
    }
    let mut legend =
        format!("<h2>Equations</h2>\n<p class=\"note\">{SOURCE}:</p>\n<dl class=\"facts\">\n");
    for (number, words) in cited {
        let _ = writeln!(legend, "<div><dt>({number})</dt><dd>{}</dd></div>", escape(words));
    }
    legend + "</dl>\n"
}

#[cfg(test)]
mod tests {
    #[test]
    fn only_what_is_cited_is_explained() {
        let legend = super::legend("<th>λ (36), p (projected, 40)</th>");
        assert!(legend.contains("multiplier") && legend.contains("ZAMM 88"), "{legend}");
        assert!(legend.contains("(40)") && !legend.contains("45"), "{legend}");
        assert_eq!(super::legend("h = 0.01"), "");
    }
}
