//! Remarks on elements that are too long for their stress-free curvature.

use crate::system::beams::Beams;
use vi_beam::curved::{COARSE, most_coupled};

/// Of each beam with such elements.
pub(super) fn remarks(beams: &Beams) -> impl Iterator<Item = String> {
    beams.list.iter().filter_map(|beam| {
        let own = beam.legs.iter().flat_map(|leg| beams.parts.of(leg));
        let found = most_coupled(&beams.parts.elements, own)?;
        (found.coupling > COARSE).then(|| {
            format!(
                "element {} of beam `{}` is curved or twisted by {:.1}° without stress, which is too much for \
                 stiffnesses as unlike as those of its section: what passes between bending and twist along it makes \
                 its frequencies and critical loads wrong; write {:.1} times as many elements",
                found.element,
                beam.name,
                found.angle.to_degrees(),
                found.refinement()
            )
        })
    })
}
