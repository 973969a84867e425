//! Remarks on sections whose extension or shear is so stiff that rounding hides their bending.
//!
//! The extension of an element has the rounding `ε`, its force `ε EA`, beside forces of bending of
//! `EI/L²`. Measured on cantilevers that a force at the tip bends by a third of their length:
//! the shape of mean directors is lost from `EA L²/EI = 10¹⁴` on, that of elements of second order
//! from `10¹⁵`, of helicoidal ones from `10¹⁶`.

#![allow(non_snake_case)] // C

use crate::digits::rounded;
use crate::system::beams::Beams;
use vi_beam::ElementKind;

/// `EA L²/EI` from which a beam of mean directors, or of other elements, is named.
const HIDDEN: [f64; 2] = [3e13, 1e15];
/// `EA L²/EI` of a beam that extends by no more than `10⁻⁸`.
const ENOUGH: f64 = 1e8;

/// Of each beam with such sections.
pub(super) fn remarks(beams: &Beams) -> impl Iterator<Item = String> {
    beams.list.iter().filter_map(|beam| {
        let elements = &beams.parts.elements;
        let length: f64 = beam.legs.iter().map(|leg| beams.parts.length(leg)).sum();
        let own = beam.legs.iter().flat_map(|leg| beams.parts.of(leg));
        let ratio = own.map(|element| {
            let C = elements.stiffness(element);
            let stiffest = C[(0, 0)].max(C[(1, 1)]).max(C[(2, 2)]);
            stiffest * length * length / C[(3, 3)].min(C[(4, 4)])
        });
        let ratio = ratio.fold(0.0, f64::max);
        let [mean, other] = HIDDEN;
        let (most, also) = match beam.kind {
            ElementKind::MeanDirectors => (mean, ", or element = \"helicoidal\""),
            _ => (other, ""),
        };
        (ratio >= most).then(|| {
            format!(
                "the extension or shear of beam `{}` is {} times as stiff as its bending (EA L²/EI): rounding hides its \
                 bending, and what is computed of it is not right; EA and GA of {} EI/L² are as good as rigid: write \
                 those{also}",
                beam.name,
                rounded(ratio, 2),
                rounded(ENOUGH, 1)
            )
        })
    })
}
