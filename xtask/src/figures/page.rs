//! The page that shows and explains the figures.

use super::Section;

const HEAD: &str = "\
# Figures of Leyendecker, Marsden & Ortiz (2008)

Examples of S. Leyendecker, J. E. Marsden, M. Ortiz, *Variational integrators for constrained
dynamical systems*, ZAMM 88 (2008) 677–708, computed with this project. Equation numbers are those of
the article. `cargo xtask figures` makes this page and its pictures anew; the numbers in the captions
are read off the runs. What was found to need a correction or a qualification is in
[ERRATA.md](ERRATA.md).
";

/// The page as Markdown.
pub(super) fn page(sections: &[Section]) -> String {
    let mut text = HEAD.to_owned();
    for section in sections {
        text += &format!("\n## {}\n\n{}\n", section.heading, section.words);
        for figure in &section.figures {
            let name = figure.file.trim_end_matches(".svg").replace('_', " ");
            text += &format!("\n![{name}]({})\n\n{}\n", figure.file, figure.caption);
        }
    }
    text
}
