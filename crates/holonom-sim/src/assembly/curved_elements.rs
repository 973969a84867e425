//! Remarks on elements that are too long for their curvature, without stress or under load, and on
//! those that are too long for a rope that sags.

use crate::system::beams::{BeamParts, Beams};
use vi_beam::curved::{COARSE, CurvedElement, most_coupled};
use vi_beam::sagging::{SLACK, SaggingElement, most_sagging};

/// What a remark says of an element, by which it is known again.
const CURVED: &str = "is curved or twisted by";
const SAGS: &str = "sags:";

/// Of each beam whose elements are too long without stress.
pub(super) fn remarks(beams: &Beams) -> impl Iterator<Item = String> {
    beams.list.iter().filter_map(|beam| {
        let own = beam.legs.iter().flat_map(|leg| beams.parts.of(leg));
        let found = most_coupled(&beams.parts.elements, own, None)?;
        (found.coupling > COARSE).then(|| curved(beam, &found, " without stress"))
    })
}

/// Of each beam whose elements are too long in the configuration `q`, unless that is `known`.
pub(crate) fn remarks_at(beams: &Beams, q: &[f64], known: &[String]) -> Vec<String> {
    let of_beam = |beam: &BeamParts| {
        let elements = &beams.parts.elements;
        let own = || beam.legs.iter().flat_map(|leg| beams.parts.of(leg));
        let is_known = |what: &str| {
            let words = format!("of beam `{}` {what}", beam.name);
            known.iter().any(|text| text.contains(&words))
        };
        let bent = most_coupled(elements, own(), Some(q));
        let bent = bent.filter(|own| own.coupling > COARSE && !is_known(CURVED));
        let slack = most_sagging(elements, own(), q);
        let slack = slack.filter(|own| own.sag() > SLACK && !is_known(SAGS));
        let bent = bent.map(|found| curved(beam, &found, ""));
        [bent, slack.map(|found| sagging(beam, &found))].into_iter().flatten()
    };
    beams.list.iter().flat_map(of_beam).collect()
}

/// How many elements a beam needs.
fn needed(beam: &BeamParts, refinement: f64) -> String {
    match &beam.legs[..] {
        [leg] => {
            let count = (refinement * leg.elements.len() as f64).ceil();
            format!("write {refinement:.1} times as many elements, elements = {count}")
        }
        _ => format!("write {refinement:.1} times as many elements"),
    }
}

fn curved(beam: &BeamParts, found: &CurvedElement, when: &str) -> String {
    format!(
        "element {} of beam `{}` {CURVED} {:.1}°{when}, which is too much for stiffnesses as unlike as those of its \
         section: what passes between bending and twist along it makes its stiffness, its frequencies and critical loads \
         wrong; {}",
        found.element,
        beam.name,
        found.angle.to_degrees(),
        needed(beam, found.refinement())
    )
}

fn sagging(beam: &BeamParts, found: &SaggingElement) -> String {
    format!(
        "element {} of beam `{}` {SAGS} its tension is {:.0} times what its bending holds, N ℓ²/EI, and it turns by {:.1}°: \
         there it may have directions without stability that a rope has not; write element = \"rope\", or {}",
        found.element,
        beam.name,
        found.ratio,
        found.angle.to_degrees(),
        needed(beam, found.refinement())
    )
}
